//! Forecasts the memory that images take, and refuses what does not fit before it is taken.
//!
//! Rays are counted, and samples expected from the areas of triangles. What a sample takes was measured, as addresses: on a
//! gyroid of 3.3 million triangles at 1000 to 6000 rays the forecast is 1.0 to 1.4 times what was taken.

use super::work::expected_crossings;
use crate::Error;
use crate::grid::{Axis, Grid, LatticeSolid};
use crate::number::number;

/// What is made of solids, as far as memory goes with it.
#[derive(Clone, Copy, Debug)]
pub struct Images<'a> {
    /// The axes, one after another.
    pub axes: &'a [Axis],
    /// Images along one axis that are held at the same time, the result among them.
    pub at_once: u64,
    /// Whether the images know triangles.
    pub have_triangles: bool,
    /// Whether the image of an axis is kept while the next is made.
    pub are_kept: bool,
    /// Whether all are written with their normals.
    pub have_normals: bool,
}

/// Bytes of a ray, in the offsets of an image.
const RAY: f64 = 4.0;

/// Bytes of a sample in a list that grows, which may have room for twice as many.
const GROWING: f64 = 8.0;

/// Bytes of a sample on its way through a band of rows: its crossing, sorted, and its place in the band's own image.
const IN_BAND: f64 = 24.0;

/// The rows that are under way at the same time.
const ROWS_UNDER_WAY: f64 = 256.0;

/// Bytes of a sample that is kept: its depth, and with its triangle.
const KEPT: f64 = 8.0;
const KEPT_WITH_TRIANGLE: f64 = 12.0;

/// Bytes of a sample when normals are written: what is kept, and the normal twice while the list of it is joined.
const WITH_NORMAL: f64 = 30.0;

/// Jobs that need less are never the reason for which memory runs out.
const LITTLE: f64 = 64e6;

/// The share of the memory that a raster which is proposed should take.
const SHARE: f64 = 0.9;

/// What an image along one axis is made of.
struct Extent {
    rays: f64,
    rows: f64,
    /// Of all inputs together.
    samples: f64,
}

impl Images<'_> {
    fn extents(&self, grid: &Grid, solids: &[LatticeSolid]) -> Vec<Extent> {
        let extent = |&axis| {
            let (columns, rows) = grid.image_size(axis);
            let samples = solids.iter().map(|solid| expected_crossings(solid, axis)).sum();
            Extent { rays: f64::from(columns) * f64::from(rows), rows: f64::from(rows), samples }
        };
        self.axes.iter().map(extent).collect()
    }

    /// The bytes that images take at most with so large a share of the rays along each side.
    fn bytes(&self, extents: &[Extent], share: f64) -> f64 {
        let (mut kept, mut written, mut most) = (0.0, 0.0, 0.0f64);
        for Extent { rays, rows, samples } in extents {
            let (rays, rows, samples) = (RAY * share * share * rays, share * rows, share * share * samples);
            // The samples of all inputs, and those of the result.
            let lists = if self.at_once > 1 { 2.0 } else { 1.0 };
            let triangles = if self.have_triangles { lists + 1.0 } else { 0.0 };
            let under_way = IN_BAND * samples * (ROWS_UNDER_WAY / rows).min(1.0);
            let images = self.at_once as f64 * rays + GROWING * samples * (lists + triangles);
            most = most.max(kept + images + under_way);
            if self.are_kept {
                kept += rays + samples * if self.have_triangles { KEPT_WITH_TRIANGLE } else { KEPT };
                written += rays + samples * if self.have_normals { WITH_NORMAL } else { KEPT };
            }
        }
        most.max(written)
    }
}

/// Refuses more rays than an image can hold, and images that would not fit into the memory that is `free`; `way_out` says
/// what would, from the share of the rays along each side that fit.
pub fn admit(
    images: Images,
    grid: &Grid,
    solids: &[LatticeSolid],
    free: Option<u64>,
    way_out: impl FnOnce(f64) -> String,
) -> Result<(), Error> {
    let rays = |axis: &Axis| {
        let (columns, rows) = grid.image_size(*axis);
        u64::from(columns) * u64::from(rows)
    };
    let most = images.axes.iter().map(rays).max().unwrap_or(0);
    if most >= u64::from(u32::MAX) {
        return Err(Error::machine(format!(
            "{most} rays along one axis are more than an image can hold ({})",
            u32::MAX
        )));
    }
    let extents = images.extents(grid, solids);
    let needed = images.bytes(&extents, 1.0);
    let Some(free) = free.map(|free| free as f64).filter(|free| needed > free.max(LITTLE)) else { return Ok(()) };
    let (mut fits, mut does_not) = (0.0, 1.0);
    while does_not - fits > 1e-4 {
        let share = 0.5 * (fits + does_not);
        let side = if images.bytes(&extents, share) <= SHARE * free { &mut fits } else { &mut does_not };
        *side = share;
    }
    let megabytes = |bytes: f64| number((bytes / 1e5).round() / 10.0);
    let [x, y, z] = grid.rays();
    Err(Error::machine(format!(
        "the images of {x} × {y} × {z} rays need about {} MB of memory, and this process may take {} MB more; {}",
        megabytes(needed),
        megabytes(free),
        way_out(fits)
    )))
}

/// Proposes a resolution of so much of the rays along a side.
pub fn coarser(share: f64, longest: f64, grid: &Grid) -> String {
    let rays = (share * longest / grid.pitch()).floor();
    match rays >= 1.0 {
        true => format!("--resolution {rays}, a pitch of {}, would fit", number(longest / rays)),
        false => "no resolution would fit".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use crate::mesh::ClosedMesh;
    use crate::solids;

    use super::*;

    const VOLUME: Images =
        Images { axes: &[Axis::Z], at_once: 1, have_triangles: false, are_kept: false, have_normals: false };

    /// What is forecast for a cube of side 1 at a resolution.
    fn bytes(images: Images, resolution: u32, free: Option<u64>) -> (f64, Result<(), Error>) {
        let cube = solids::cuboid(glam::DVec3::ZERO, glam::DVec3::ONE).unwrap();
        let closed = ClosedMesh::check(cube).unwrap();
        let grid = Grid::with_resolution(closed.bounds(), resolution, 1024).unwrap();
        let solids = [grid.quantise(&closed).unwrap()];
        let admitted = admit(images, &grid, &solids, free, |share| coarser(share, 1.0, &grid));
        (images.bytes(&images.extents(&grid, &solids), 1.0), admitted)
    }

    #[test]
    fn rays_and_samples_are_counted() {
        let (found, admitted) = bytes(VOLUME, 5120, None);
        // Two samples on each of 5120² rays, a twentieth of them under way.
        let rays = 5120.0 * 5120.0;
        assert!((found / (rays * (4.0 + 2.0 * (8.0 + 24.0 / 20.0))) - 1.0).abs() < 0.01, "{found}");
        assert_eq!(admitted, Ok(()));
        let more = [
            Images { at_once: 2, ..VOLUME },
            Images { have_triangles: true, ..VOLUME },
            Images { axes: &Axis::ALL, are_kept: true, ..VOLUME },
            Images { axes: &Axis::ALL, are_kept: true, have_normals: true, ..VOLUME },
        ];
        assert!(more.iter().all(|images| bytes(*images, 5120, None).0 > 1.2 * found));
    }

    #[test]
    fn what_is_proposed_fits() {
        let free = Some(100 << 20);
        let failure = bytes(VOLUME, 5120, free).1.unwrap_err();
        assert_eq!(failure.kind(), crate::ErrorKind::Machine);
        let proposed: u32 =
            failure.to_string().split("--resolution ").nth(1).unwrap().split(',').next().unwrap().parse().unwrap();
        assert!((1000..5120).contains(&proposed), "{failure:?}");
        assert_eq!(bytes(VOLUME, proposed, free).1, Ok(()));
        assert!(bytes(VOLUME, proposed * 5 / 4, free).1.is_err());
        // A job that needs next to nothing is always tried.
        assert_eq!(bytes(VOLUME, 100, Some(0)).1, Ok(()));
    }
}
