//! Centroid and inertia of the solid and of the pores within a region.
//!
//! The moments of an image are exact sums over its columns ([`integrate::moments`](crate::integrate::moments)); here they are
//! means over the images along x, y and z, each of which is blind to what runs along its rays. Those of the pores are those of
//! the region less those of the solid in it: a box has its moments in closed form, another region those of its own images.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

pub use super::eigen::Principal;
use super::stretches::stretches;
use super::{Phase, Region};
use crate::integrate::{Moments, moments};
use crate::ldi::{Ldi, Spans};

/// A volume below this share of the region's is none but rounding.
const NONE: f64 = 1e-12;

/// Volume, centroid and inertia, at unit density, of a phase within a region, from the exact images of the solid along x, y
/// and z. In world units; centroid and inertia are NaN where the phase has no volume.
pub fn phase_moments(images: &[Ldi; 3], region: &Region, phase: Phase) -> Moments {
    let solid = combined(&images.each_ref().map(|image| (moments(&solid_within(image, region)), 1.0 / 3.0)));
    match phase {
        Phase::Solid => solid,
        Phase::Pore => combined(&[(region_moments(region), 1.0), (solid, -1.0)]),
    }
}

/// The principal moments of inertia, ascending, in world units to the fifth, and their axes; nothing where they are not known.
pub fn principal_moments(of: &Moments) -> Option<Principal> {
    of.inertia.is_finite().then(|| Principal::of(of.inertia))
}

/// Volume, centroid and inertia of a region.
pub fn region_moments(region: &Region) -> Moments {
    match region.images() {
        Some(images) => combined(&images.each_ref().map(|image| (moments(image), 1.0 / 3.0))),
        None => {
            let (grid, bounds) = (region.grid(), region.bounds());
            let [min, max] = [bounds.min, bounds.max].map(|corner| DVec3::from_array(corner.map(f64::from)));
            let squares = (grid.step() * (max - min)).powf(2.0);
            let volume = region.volume();
            let inertia = DMat3::from_diagonal(volume / 12.0 * (squares.element_sum() - squares));
            Moments { volume, centroid: grid.origin() + 0.5 * grid.step() * (min + max), inertia }
        }
    }
}

/// The moments of several bodies together, each with a factor: negative for what is taken away.
fn combined(parts: &[(Moments, f64)]) -> Moments {
    // Bodies without volume have no centroid.
    let parts = || parts.iter().filter(|(part, _)| part.volume > 0.0);
    let volume: f64 = parts().map(|(part, factor)| factor * part.volume).sum();
    let scale: f64 = parts().map(|(part, factor)| factor.abs() * part.volume).sum();
    if volume <= NONE * scale {
        return Moments { volume: 0.0, centroid: DVec3::NAN, inertia: DMat3::NAN };
    }
    let centroid = parts().map(|(part, factor)| factor * part.volume * part.centroid).sum::<DVec3>() / volume;
    let inertia = parts().fold(DMat3::ZERO, |sum, (part, factor)| {
        let d = part.centroid - centroid;
        let product = DMat3::from_cols(d.x * d, d.y * d, d.z * d);
        let steiner = DMat3::from_diagonal(DVec3::splat(d.length_squared())) - product;
        sum + *factor * (part.inertia + part.volume * steiner)
    });
    Moments { volume, centroid, inertia }
}

/// The image of what of a solid lies in a region.
fn solid_within(image: &Ldi, region: &Region) -> Ldi {
    let (columns, rows) = image.size();
    let of_row = |row: u32| {
        let (mut counts, mut depths) = (Vec::with_capacity(columns as usize), Vec::new());
        for ray in row * columns..(row + 1) * columns {
            let before = depths.len();
            let (solid, spans) = (Spans::new(image.samples(ray)), region.spans(image.axis(), ray));
            stretches(solid, spans, Phase::Solid, 0, |stretch| depths.extend([stretch.start, stretch.end]));
            counts.push((depths.len() - before) as u32);
        }
        (counts, depths)
    };
    let by_row: Vec<(Vec<u32>, Vec<i32>)> = (0..rows).into_par_iter().map(of_row).collect();
    let mut offsets = vec![0];
    offsets.extend(by_row.iter().flat_map(|(counts, _)| counts).scan(0, |end, &count| {
        *end += count;
        Some(*end)
    }));
    let depths = by_row.into_iter().flat_map(|(_, depths)| depths).collect();
    Ldi::from_parts(*image.grid(), image.axis(), offsets, depths, Vec::new()).expect("parts of the rays of an image")
}
