//! Centroid and inertia of the solid and of the pores within a region.
//!
//! The moments of an image are exact sums over its columns ([`integrate::moments`](crate::integrate::moments)); here they are
//! means over the images along x, y and z, each of which is blind to surfaces along its rays. Those of the pores are those of
//! the region minus those of the solid in it: a box has its moments in closed form, another region those of its own images.

use crate::parallel::*;
use glam::{DMat3, DVec3};

pub use super::eigen::Principal;
use super::segments::segments;
use super::{Phase, Region};
use crate::cancel::checkpoint;
use crate::integrate::{Moments, moments};
use crate::ldi::{Ldi, Spans};

/// A volume below this share of the region's counts as zero with rounding.
const NONE: f64 = 1e-12;

/// Returns volume, centroid and inertia, at unit density, of a phase within a region, from the exact images of the solid along
/// x, y and z. In world units; centroid and inertia are NaN where the phase has no volume.
pub fn phase_moments(images: &[Ldi; 3], region: &Region, phase: Phase) -> Moments {
    let solid = combined(&images.each_ref().map(|image| (moments(&solid_within(image, region)), 1.0 / 3.0)));
    match phase {
        Phase::Solid => solid,
        Phase::Pore => combined(&[(region_moments(region), 1.0), (solid, -1.0)]),
    }
}

/// Returns the principal moments of inertia, ascending, in world units to the fifth, and their axes; `None` where the inertia
/// is not finite.
pub fn principal_moments(of: &Moments) -> Option<Principal> {
    of.inertia.is_finite().then(|| Principal::of(of.inertia))
}

/// Returns volume, centroid and inertia of a region.
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

/// Returns the combined moments of several bodies, each with a factor: negative to subtract a body.
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

/// Returns the image of the part of a solid that lies in a region.
fn solid_within(image: &Ldi, region: &Region) -> Ldi {
    let (columns, rows) = image.size();
    let of_row = |row: u32| {
        checkpoint();
        let (mut counts, mut depths) = (Vec::with_capacity(columns as usize), Vec::new());
        for ray in row * columns..(row + 1) * columns {
            let before = depths.len();
            let (solid, spans) = (Spans::new(image.samples(ray)), region.spans(image.axis(), ray));
            segments(solid, spans, Phase::Solid, 0, |segment| depths.extend([segment.start, segment.end]));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriangleMesh;
    use crate::metrics::surface_area::tests::{Sampled, grid_of, order, turned, turns};
    use crate::solids;

    /// Returns the moments of a full box between two corners.
    fn of_box(min: DVec3, max: DVec3) -> Moments {
        let (sides, volume) = (max - min, (max - min).element_product());
        let [a, b, c] = (sides * sides).to_array();
        let inertia = DMat3::from_diagonal(DVec3::new(b + c, c + a, a + b) * volume / 12.0);
        Moments { volume, centroid: 0.5 * (min + max), inertia }
    }

    /// Returns the moments of a closed mesh, as a sum over the tetrahedra of its facets and the origin.
    fn of_mesh(mesh: &TriangleMesh) -> Moments {
        let (mut volume, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
            let v = a.dot(b.cross(c)) / 6.0;
            let outer = |p: DVec3| DMat3::from_cols(p.x * p, p.y * p, p.z * p);
            volume += v;
            first += v * (a + b + c) / 4.0;
            second += v / 20.0 * (outer(a) + outer(b) + outer(c) + outer(a + b + c));
        }
        let centroid = first / volume;
        let about =
            second - volume * DMat3::from_cols(centroid.x * centroid, centroid.y * centroid, centroid.z * centroid);
        let trace = about.col(0)[0] + about.col(1)[1] + about.col(2)[2];
        Moments { volume, centroid, inertia: DMat3::from_diagonal(DVec3::splat(trace)) - about }
    }

    /// Returns the worst relative error.
    fn off(found: &Moments, exact: &Moments) -> f64 {
        let length = exact.volume.cbrt();
        let inertia = (found.inertia - exact.inertia).to_cols_array().iter().fold(0.0f64, |m, d| m.max(d.abs()));
        let size = exact.inertia.to_cols_array().iter().fold(0.0f64, |m, d| m.max(d.abs()));
        (found.volume / exact.volume - 1.0)
            .abs()
            .max((found.centroid - exact.centroid).length() / length)
            .max(inertia / size)
    }

    #[test]
    fn a_box_in_a_box_and_its_complement_have_their_known_moments() {
        let (min, max) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(3.0, 6.0, 4.0));
        let (low, high) = (DVec3::ZERO, DVec3::new(8.0, 8.0, 6.0));
        let block = Sampled::on(&grid_of(low, high, 32), solids::cuboid(min, max).unwrap());
        let region = block.whole();
        let (solid, all) = (of_box(min, max), of_box(low, high));
        assert!(off(&phase_moments(&block.images, &region, Phase::Solid), &solid) < 1e-9);
        assert!(off(&region_moments(&region), &all) < 1e-9);
        let pores = phase_moments(&block.images, &region, Phase::Pore);
        let centroid = (all.volume * all.centroid - solid.volume * solid.centroid) / (all.volume - solid.volume);
        assert!((pores.centroid - centroid).length() < 1e-9);
        // The rest of the box, in six boxes around the solid.
        let cut = |from: [f64; 3], to: [f64; 3]| (of_box(DVec3::from_array(from), DVec3::from_array(to)), 1.0);
        let rest = combined(&[
            cut([0.0, 0.0, 0.0], [8.0, 8.0, 3.0]),
            cut([0.0, 0.0, 4.0], [8.0, 8.0, 6.0]),
            cut([0.0, 0.0, 3.0], [8.0, 2.0, 4.0]),
            cut([0.0, 6.0, 3.0], [8.0, 8.0, 4.0]),
            cut([0.0, 2.0, 3.0], [1.0, 6.0, 4.0]),
            cut([3.0, 2.0, 3.0], [8.0, 6.0, 4.0]),
        ]);
        assert!(off(&pores, &rest) < 1e-9, "{pores:?} {rest:?}");
        // The longest side first: least inertia about it.
        let principal = principal_moments(&phase_moments(&block.images, &region, Phase::Solid)).unwrap();
        let m = solid.volume / 12.0;
        for (value, expected) in principal.values.iter().zip([m * 5.0, m * 17.0, m * 20.0]) {
            assert!((value / expected - 1.0).abs() < 1e-9);
        }
        assert!(principal.directions[0].y.abs() > 1.0 - 1e-12);
    }

    #[test]
    fn turned_boxes_converge_to_the_moments_of_their_mesh() {
        let exact = of_box(DVec3::new(-1.0, -0.5, -0.3), DVec3::new(1.0, 0.5, 0.3));
        let block = solids::cuboid(DVec3::new(-1.0, -0.5, -0.3), DVec3::new(1.0, 0.5, 0.3)).unwrap();
        assert!(off(&of_mesh(&block), &exact) < 1e-12);
        let errors = [32, 64, 128].map(|resolution| {
            turns(5).fold(0.0f64, |worst, turn| {
                let block = Sampled::of(turned(block.clone(), turn), resolution);
                worst.max(off(&phase_moments(&block.images, &block.whole(), Phase::Solid), &of_mesh(&block.mesh)))
            })
        });
        println!("turned boxes: off by {errors:.6?}, order {:.2}", order(errors));
        assert!(errors[2] < 5e-3 && order(errors) > 1.0, "{errors:?}");
    }

    #[test]
    fn phases_within_a_mesh_region_fill_it() {
        let grid = grid_of(DVec3::splat(-2.0), DVec3::splat(2.0), 64);
        let block = solids::cuboid(DVec3::new(0.0, -1.5, -1.5), DVec3::splat(1.5)).unwrap();
        let [block, ball] = [block, solids::geodesic(1.0, 24).unwrap()].map(|mesh| Sampled::on(&grid, mesh));
        let region = Region::of_solid(&ball.images);
        let [solid, pores] = Phase::BOTH.map(|phase| phase_moments(&block.images, &region, phase));
        // Half balls: centroids at 3R/8 to either side.
        assert!((solid.centroid - DVec3::new(0.375, 0.0, 0.0)).length() < 5e-3, "{solid:?}");
        assert!((pores.centroid + DVec3::new(0.375, 0.0, 0.0)).length() < 5e-3, "{pores:?}");
        assert!(off(&combined(&[(solid, 1.0), (pores, 1.0)]), &region_moments(&region)) < 1e-12);
        assert!(off(&region_moments(&region), &of_mesh(&ball.mesh)) < 5e-3);
    }

    #[test]
    fn empty_phases_have_no_centroid() {
        let block = Sampled::of(solids::cuboid(DVec3::ZERO, DVec3::ONE).unwrap(), 16);
        let pores = phase_moments(&block.images, &block.boxed(), Phase::Pore);
        assert!(pores.volume == 0.0 && pores.centroid.is_nan() && principal_moments(&pores).is_none());
    }
}
