//! Surface by orientation: what overhangs when it is built layer by layer.

use glam::DVec3;

use super::elements::{SurfaceElements, in_chunks};

/// Whether what lies on the build plate counts as overhanging.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Plate {
    /// It counts, as all that faces down.
    #[default]
    Counted,
    /// Facets in the lowest plane of the mesh rest on the plate.
    Supported,
}

/// Surface that faces down more steeply than an angle allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overhang {
    /// Its area, in square world units.
    pub area: f64,
    /// Its share of all surface within the region.
    pub share: f64,
}

/// How near to the lowest corner a facet's corners lie in the lowest plane, as a share of the mesh's height.
const LOWEST: f64 = 1e-6;

/// The surface whose normal n has n·`build` < −cos `angle`: that which lies within `angle`, in degrees, of facing straight
/// down. A ball has (1 − cos θ)/2 of its surface there, 14.64 % at 45°; a lying cylinder a quarter of its side.
///
/// `build` is the direction in which layers are added, of any length; what faces of a box cut off is no surface and counts
/// neither as overhang nor in the share. Nothing where there is no surface, or no direction.
pub fn overhang(surface: &SurfaceElements, build: DVec3, angle: f64, plate: Plate) -> Option<Overhang> {
    let up = build.try_normalize()?;
    let limit = -angle.to_radians().cos();
    let facets = surface.facets();
    let heights = || facets.triangles.iter().flatten().map(|&v| facets.positions[v as usize].dot(up));
    let lowest = match plate {
        Plate::Counted => f64::NEG_INFINITY,
        Plate::Supported => {
            let (low, high) = heights().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), h| (a.min(h), b.max(h)));
            low + LOWEST * (high - low)
        }
    };
    let rests = |facet: usize| facets.corners(facet).iter().all(|corner| corner.dot(up) <= lowest);
    let total = surface.area();
    let area = in_chunks(facets.normals.len(), |facet| {
        let overhangs = facets.normals[facet].dot(up) < limit && !rests(facet);
        if overhangs { surface.areas()[facet] } else { 0.0 }
    });
    (total > 0.0).then(|| Overhang { area, share: area / total })
}
