//! Answers for boxes, compared with the exact membership of points in them.

use super::*;
use crate::minkowski::{Membership, Probed};
use crate::solids;
use crate::testing::random::Random;

/// Compares the answers for random boxes with points in them that lie on rays along z.
fn agrees<P: Probe, M: Membership>(grid: &Grid, probe: &P, membership: &M, seed: u64) -> [usize; 4] {
    let mut random = Random::new(seed);
    let (mut counts, mut memory, mut of_points) = ([0; 4], P::Memory::default(), M::Memory::default());
    for _ in 0..4000 {
        // One half of a pixel to four of them, with the nodes of as many pixels, or of one.
        let halves = random.choose(&[1, 2, 4, 8]);
        let side = halves << (grid.shift() - 1);
        let pixel = [0, 1, 2].map(|i| random.below(grid.rays()[i] as usize - 4) as u32);
        let min = pixel.map(|index| (index << grid.shift()) as i32 + (1 << (grid.shift() - 2)));
        let bounds = LatticeBox { min, max: min.map(|low| low + side) };
        let answer = probe.probe(&bounds, &mut memory);
        counts[answer as usize] += 1;
        for _ in 0..6 {
            let [x, y] = [0, 1].map(|i| grid.node(pixel[i] + random.below((halves as usize).div_ceil(2)) as u32));
            let point = [x, y, random.between(bounds.min[2], bounds.max[2] - 1) | 1];
            assert!((0..2).all(|i| (bounds.min[i]..=bounds.max[i]).contains(&point[i])));
            let is_in = membership.contains(point, &mut of_points);
            match answer {
                Probed::Filled => assert!(is_in, "{bounds:?} is filled, but {point:?} is out"),
                Probed::Empty => assert!(!is_in, "{bounds:?} is empty, but {point:?} is in"),
                Probed::Inside | Probed::Outside => {}
            }
        }
    }
    counts
}

#[test]
fn boxes_that_are_proved_have_one_state_in_sums() {
    let [a, b] = [solids::torus(1.0, 0.35, 24, 12).unwrap(), solids::ell(DVec3::splat(0.5), [0.3, 0.2]).unwrap()];
    let [a, b] = [a, b].map(|mesh| ClosedMesh::check(mesh).unwrap());
    let grids = SumGrid::with_pitch(a.bounds(), b.bounds(), 0.06, 1024).unwrap();
    let [a, b] = [grids.a.quantise(&a).unwrap(), grids.b.quantise(&b).unwrap()].map(|solid| Polyhedron::new(&solid));
    for (exterior, seed) in [(Exterior::Out, 31), (Exterior::In, 32)] {
        let a = if exterior == Exterior::In { a.clone().complement() } else { a.clone() };
        let membership = SumMembership::new(&a, exterior, &b);
        let [filled, inside, outside, _] = agrees(&grids.sum, &SumProbe::new(&membership), &membership, seed);
        // The difference is empty.
        let enough = outside > 100 || exterior == Exterior::In;
        assert!(filled > 300 && inside > 50 && enough, "{exterior:?} {filled} {inside} {outside}");
    }
}

#[test]
fn boxes_that_are_proved_have_one_state_in_offsets() {
    for (distance, seed) in [(0.2, 33), (0.02, 34), (-0.15, 35), (-0.02, 36)] {
        let mesh = ClosedMesh::check(solids::torus(1.0, 0.35, 24, 12).unwrap()).unwrap();
        let grid = offset_grid(mesh.bounds(), distance, 0.06, 1024).unwrap();
        let solid = Polyhedron::new(&grid.quantise(&mesh).unwrap());
        let (solid, exterior) =
            if distance > 0.0 { (solid, Exterior::Out) } else { (solid.complement(), Exterior::In) };
        let membership = BallMembership::new(&grid, &solid, distance.abs() / grid.step(), exterior).unwrap();
        let [filled, inside, outside, empty] = agrees(&grid, &BallProbe::new(&membership, &solid), &membership, seed);
        assert!(filled > 300 && inside > 50 && outside > 50 && empty > 100, "{filled} {inside} {outside} {empty}");
    }
}
