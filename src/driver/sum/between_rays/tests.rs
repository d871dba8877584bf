//! Searches whose answers are known boxes: sums of boxes are boxes, and so are box-shaped hollows under sums and offsets.

mod boxes;
mod convex;
mod crossings;
mod probes;

use glam::DVec3;

use super::*;
use crate::fixed::Crossing;
use crate::grid::{SumGrid, offset_grid};
use crate::mesh::{ClosedMesh, TriangleMesh};
use crate::minkowski::ball::{BallMembership, BallProbe};
use crate::minkowski::{Polyhedron, SumMembership, SumProbe, cull, resolve};
use crate::sampler::cpu::CpuSampler;

/// The grid of a search and its result.
struct Search {
    grid: Grid,
    found: BetweenRays,
}

/// Searches A ⊕ B, or with [`Exterior::In`] A ⊖ (−B).
fn of_sum(a: TriangleMesh, b: TriangleMesh, exterior: Exterior, pitch: f64) -> Search {
    let [a, b] = [a, b].map(|mesh| ClosedMesh::check(mesh).unwrap());
    let grids = SumGrid::with_pitch(a.bounds(), b.bounds(), pitch, 1024).unwrap();
    let (grid, b) = (grids.sum, Polyhedron::new(&grids.b.quantise(&b).unwrap()));
    let a = Polyhedron::new(&grids.a.quantise(&a).unwrap());
    let a = if exterior == Exterior::In { a.complement() } else { a };
    let primitives = cull(&a, &b).0;
    let sampler = CpuSampler::default();
    let spans = Axis::ALL.map(|axis| primitives.spans::<Crossing, _>(&grid, axis, exterior, &sampler).unwrap().0);
    let membership = SumMembership::new(&a, exterior, &b);
    let resolved = resolve(&grid, spans, exterior, &membership, &|_, _| ()).unwrap();
    let (tests, probe) = (Tests::of_sum(&resolved.counts, [&a, &b]), SumProbe::new(&membership));
    let searched = Searched { grid: &grid, spans: &resolved.spans, exterior, probe: &probe, tests };
    Search { grid, found: searched.bounded_by(&primitives) }
}

/// Searches the offset of a solid by a distance.
fn of_ball(mesh: TriangleMesh, distance: f64, pitch: f64) -> Search {
    let mesh = ClosedMesh::check(mesh).unwrap();
    let grid = offset_grid(mesh.bounds(), distance, pitch, 1024).unwrap();
    let solid = Polyhedron::new(&grid.quantise(&mesh).unwrap());
    let (solid, exterior) = if distance > 0.0 { (solid, Exterior::Out) } else { (solid.complement(), Exterior::In) };
    let radius = distance.abs() / grid.step();
    let patches = BallPatches::new(&solid, radius);
    let spans = Axis::ALL.map(|axis| patches.spans::<Crossing>(&grid, axis, exterior).unwrap());
    let membership = BallMembership::new(&grid, &solid, radius, exterior).unwrap();
    let resolved = resolve(&grid, spans, exterior, &membership, &|_, _| ()).unwrap();
    let probe = BallProbe::new(&membership, &solid);
    let tests = Tests::of_ball(&grid);
    let searched = Searched { grid: &grid, spans: &resolved.spans, exterior, probe: &probe, tests };
    Search { grid, found: searched.bounded_by_patches(&patches) }
}

impl Search {
    /// Returns whether a ray meets a box.
    fn is_met(&self, min: DVec3, max: DVec3) -> bool {
        let first = |at: f64, i: usize| ((at - self.grid.origin()[i]) / self.grid.pitch() - 0.5).ceil();
        // Two of three sides with a ray between their ends.
        (0..3).filter(|&i| first(min[i], i) < first(max[i], i)).count() >= 2
    }

    /// Asserts that a box is found as one detail, unless rays meet it; then none. Returns whether it was found.
    fn is_found(&self, is_solid: bool, min: DVec3, max: DVec3) -> bool {
        if self.is_met(min, max) {
            assert_eq!(self.found.details, [], "{min} {max}");
            return false;
        }
        self.is_one(is_solid, min, max);
        true
    }

    /// Asserts that one detail was found, with the place and the size of a box to the accuracy of the search. That of details in
    /// many cubes is an eighth of the pitch.
    fn is_one(&self, is_solid: bool, min: DVec3, max: DVec3) {
        let BetweenRays { details, is_complete, .. } = &self.found;
        assert!(*is_complete && details.len() == 1, "{min} {max}: {details:?}");
        let detail = details[0];
        let side = self.grid.pitch() / if (max - min).max_element() > self.grid.pitch() { 8.0 } else { 16.0 };
        assert_eq!(detail.is_solid, is_solid);
        let near = |a: DVec3, b: DVec3| (a - b).abs().max_element() <= side;
        assert!(near(detail.place, 0.5 * (min + max)), "{min} {max}: {detail:?}");
        assert!(near(0.5 * detail.size, 0.5 * (max - min)), "{min} {max}: {detail:?}");
        let volume = (max - min).element_product();
        let accuracy = (max - min + 2.0 * side).element_product() - volume;
        assert!((detail.volume - volume).abs() <= accuracy, "{volume}: {detail:?}");
    }
}
