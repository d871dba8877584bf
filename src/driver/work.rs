//! Estimates of the sampling work, made before sampling.

use crate::grid::{Axis, LatticeSolid};

/// Sample size of the cost estimate; larger meshes are strided.
const SAMPLE_SIZE: usize = 1 << 13;

/// Returns the number of triangles and expected crossings of all solids along all axes, to which the sampling time is
/// proportional.
pub fn work(solids: &[LatticeSolid], axes: &[Axis]) -> f64 {
    let each = |solid: &LatticeSolid| {
        let crossings: f64 = axes.iter().map(|&axis| expected_crossings(solid, axis)).sum();
        solid.triangles().len() as f64 * axes.len() as f64 + crossings
    };
    solids.iter().map(each).sum()
}

/// Returns the expected number of crossings of a solid with the rays along an axis.
pub fn expected_crossings(solid: &LatticeSolid, axis: Axis) -> f64 {
    let all = solid.triangles().len();
    let stride = all.div_ceil(SAMPLE_SIZE).max(1);
    let sampled = all.div_ceil(stride).max(1);
    let found: f64 = solid.triangles().iter().step_by(stride).map(|&triangle| crossings(solid, triangle, axis)).sum();
    all as f64 * found / sampled as f64
}

/// Returns the expected number of rays in the solid's region that cross a triangle: its projected area in pixels. A triangle
/// that extends beyond the region counts with the share of its box that lies within.
fn crossings(solid: &LatticeSolid, triangle: [u32; 3], axis: Axis) -> f64 {
    let corners = triangle.map(|vertex| solid.positions()[vertex as usize]);
    let across = [axis.column(), axis.row()];
    let share = across.map(|i| {
        let values = corners.map(|corner| corner[i]);
        let (low, high) = (values.into_iter().fold(i32::MAX, i32::min), values.into_iter().fold(i32::MIN, i32::max));
        let inside = high.min(solid.region().max[i]) - low.max(solid.region().min[i]);
        f64::from(inside.max(0)) / f64::from((high - low).max(1))
    });
    let [a, b, c] = corners.map(|corner| across.map(|i| f64::from(corner[i])));
    let area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs();
    let pixel = f64::from(1u32 << solid.grid().shift());
    share[0] * share[1] * area / (pixel * pixel)
}

#[cfg(test)]
mod tests {
    use crate::grid::{Grid, LatticeBox};
    use crate::mesh::{ClosedMesh, TriangleMesh};
    use crate::sampler::cpu::CpuSampler;
    use crate::sampler::{FillRule, Mode, Sampler};
    use crate::solids;
    use glam::DVec3;

    use super::*;

    #[test]
    fn expected_crossings_match_the_samples_of_an_image() {
        let mesh: TriangleMesh = solids::torus(10.0, 3.0, 300, 200).unwrap();
        let closed = ClosedMesh::check(mesh).unwrap();
        let grid = Grid::with_resolution(closed.bounds(), 200, 1024).unwrap();
        let solid = grid.quantise(&closed).unwrap();
        let half = LatticeBox { max: [grid.length(0) / 2, grid.length(1), grid.length(2)], ..*solid.bounds() };
        for solid in [solid.clone(), solid.within(&half)] {
            for axis in Axis::ALL {
                let image = CpuSampler::default().sample(&solid, axis, Mode::Exact, FillRule::EvenOdd).unwrap();
                let found = image.depths().len() as f64;
                let expected = work(std::slice::from_ref(&solid), &[axis]) - 120_000.0;
                assert!((expected - found).abs() < 0.05 * found, "{axis:?}: {expected} for {found}");
            }
        }
    }

    #[test]
    fn work_adds_up_over_solids_and_axes() {
        let closed = ClosedMesh::check(solids::cuboid(DVec3::ZERO, DVec3::ONE).unwrap()).unwrap();
        let grid = Grid::with_resolution(closed.bounds(), 100, 1024).unwrap();
        let solid = grid.quantise(&closed).unwrap();
        let one = work(std::slice::from_ref(&solid), &[Axis::X]);
        assert!((one - 20_012.0).abs() < 500.0, "{one}");
        let all = work(&[solid.clone(), solid], &Axis::ALL);
        assert!((all - 6.0 * one).abs() < 1.0, "{all}");
    }
}
