//! Sums without details, and searches that end early.

use super::*;
use crate::minkowski::Probed;
use crate::solids;
use crate::testing::random::Random;

/// A box, pushed out of shape by a random linear map.
fn skewed(random: &mut Random) -> TriangleMesh {
    let mut mesh = solids::cuboid(DVec3::splat(-0.5), DVec3::splat(0.5)).unwrap();
    let mut of = || 0.4 * random.unit();
    let map = glam::DMat3::from_cols_array(&[1.0, of(), of(), of(), 1.0, of(), of(), of(), 1.0]);
    mesh.positions.iter_mut().for_each(|position| *position = map * *position);
    mesh
}

#[test]
fn convex_sums_and_offsets_have_no_details() {
    let mut random = Random::new(11);
    for round in 0..30 {
        let (a, mut b) = (skewed(&mut random), skewed(&mut random));
        b.positions.iter_mut().for_each(|position| *position *= 0.5);
        let pitch = 0.05 + 0.05 * random.share();
        let searches = [
            of_sum(a.clone(), b.clone(), Exterior::Out, pitch),
            of_ball(a.clone(), 0.2 + 0.3 * random.share(), pitch),
            of_ball(a.clone(), -0.1, pitch),
            of_sum(
                a,
                {
                    b.positions.iter_mut().for_each(|p| *p *= 0.4);
                    b
                },
                Exterior::In,
                pitch,
            ),
        ];
        for (of, Search { found, .. }) in searches.iter().enumerate() {
            assert!(found.details.is_empty() && found.is_complete, "{round} {of}: {found:?}");
        }
    }
}

#[test]
fn curved_solids_have_no_details() {
    let torus = || solids::torus(1.0, 0.4, 32, 16).unwrap();
    let sphere = || solids::sphere(0.3, 16).unwrap();
    for pitch in [0.05, 0.08, 0.11] {
        for Search { found, .. } in [
            of_sum(torus(), sphere(), Exterior::Out, pitch),
            of_sum(torus(), sphere(), Exterior::In, pitch),
            of_ball(torus(), 0.3, pitch),
            of_ball(torus(), -0.2, pitch),
            of_ball(sphere(), 0.2, pitch),
        ] {
            assert!(found.details.is_empty() && found.is_complete, "{pitch}: {found:?}");
        }
    }
}

/// A solid of which nothing but centres can be proved.
struct Unprovable;

impl Probe for Unprovable {
    type Memory = ();

    fn probe(&self, _: &LatticeBox, (): &mut ()) -> Probed {
        Probed::Inside
    }
}

/// Calls `search` with a grid of 64 × 64 × 80 nodes, of three slabs, whose rays cross nothing.
fn without_crossings<R>(
    exterior: Exterior,
    tests: usize,
    search: impl FnOnce(&Searched<Crossing, Unprovable>) -> R,
) -> R {
    let grid = Grid::from_parts(DVec3::ZERO, 1.0, [64, 64, 80], 12, 1024).unwrap();
    let spans = Axis::ALL.map(|axis| {
        let (columns, rows) = grid.image_size(axis);
        RaySpans { axis, offsets: vec![0; (columns * rows) as usize + 1], hits: Vec::new() }
    });
    search(&Searched { grid: &grid, spans: &spans, exterior, probe: &Unprovable, tests: Tests(tests) })
}

#[test]
fn a_search_that_runs_out_of_tests_says_so() {
    let found = |count: u64| {
        let cubes = |planes: std::ops::Range<usize>| {
            let mut bits = vec![0; planes.len() * 64];
            bits[0] = if planes.start == 0 { (1 << count) - 1 } else { 0 };
            bits
        };
        without_crossings(Exterior::In, 20_000, |searched| searched.details(cubes))
    };
    // 4681 boxes for each cube, to the last halving.
    let few = found(2);
    assert!(few.is_complete && few.searched_to == 1.0 / 16.0 && few.warning(0.0, None).is_none(), "{few:?}");
    let mut many = found(60);
    assert!(!many.is_complete && many.searched_to == 0.25, "{many:?}");
    many.details.push(Detail { is_solid: false, place: DVec3::ONE, size: DVec3::splat(0.5), volume: 0.125 });
    let warning = many.warning(0.0, None).unwrap();
    assert!(warning.message.contains("ended at its limit, and more details narrower than 0.25 may"), "{warning}");
}

#[test]
fn candidates_of_all_slabs_count_towards_one_limit() {
    // The first cube of each plane.
    let one_a_plane = |planes: std::ops::Range<usize>| {
        let mut bits = vec![0; planes.len() * 64];
        bits.iter_mut().step_by(64).for_each(|bits| *bits = 1);
        bits
    };
    let of_planes: Vec<[u32; 3]> = (0..80).map(|z| [0, 0, z]).collect();
    for (tests, inside, is_cut) in [(80, &of_planes[..], false), (79, &[], true)] {
        let found = without_crossings(Exterior::In, tests, |searched| searched.candidates(one_a_plane));
        assert_eq!((found.count, &found.inside[..], found.is_cut), (80, inside, is_cut), "{tests} tests");
        let found = without_crossings(Exterior::Out, tests, |searched| searched.candidates(one_a_plane));
        assert_eq!((&found.outside[..], found.is_cut), (&of_planes[..], false));
    }
    // The first pieces are kept, in order, where one slab or all together have too many.
    for (rows, is_cut) in [(64, true), (16, true), (12, false)] {
        let cubes = |planes: std::ops::Range<usize>| {
            planes.flat_map(|_| (0..64).map(|row| if row < rows { u64::MAX } else { 0 })).collect::<Vec<u64>>()
        };
        let found = without_crossings(Exterior::Out, 80, |searched| searched.candidates(cubes));
        assert_eq!((found.count, found.is_cut), (64 * rows * 80, is_cut));
        let kept = MOST_PIECES.min(found.count as usize) as u32;
        let numbers = found.outside.iter().map(|&[x, y, z]| (z * rows as u32 + y) * 64 + x);
        assert!(numbers.eq(0..kept), "{rows} rows");
    }
}
