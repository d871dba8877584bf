//! Simplified meshes compared with brute force: distances, manifold check, topology, the caller's criterion.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::solids;
use crate::testing::meshes::{cube, reversed, tetrahedron, together};
use crate::testing::near::distance;
use crate::testing::random::Random;

/// Splits every triangle into four, `times` times, with shared midpoints.
fn refined(mesh: &TriangleMesh, times: usize) -> TriangleMesh {
    let mut mesh = mesh.clone();
    for _ in 0..times {
        let mut middles = BTreeMap::new();
        let mut positions = mesh.positions.clone();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((mesh.positions[a as usize] + mesh.positions[b as usize]) / 2.0);
                positions.len() as u32 - 1
            })
        };
        let mut triangles = Vec::new();
        for &[a, b, c] in &mesh.triangles {
            let (x, y, z) = (middle(a, b), middle(b, c), middle(c, a));
            triangles.extend([[a, x, z], [x, b, y], [z, y, c], [x, y, z]]);
        }
        mesh = TriangleMesh { positions, triangles };
    }
    mesh
}

fn within(bound: f64) -> Limits<'static> {
    Limits { bound, grid: None, precision: Precision::Double }
}

fn simplified(mesh: &TriangleMesh, bound: f64) -> Simplified {
    simplify(mesh, &within(bound), |_| Vec::new()).unwrap()
}

fn corners(mesh: &TriangleMesh) -> Vec<[DVec3; 3]> {
    mesh.triangles.iter().map(|indices| indices.map(|vertex| mesh.positions[vertex as usize])).collect()
}

/// Returns the largest distance of points from a mesh, by comparing every one with every triangle.
fn farthest(points: &[DVec3], mesh: &TriangleMesh) -> f64 {
    let corners = corners(mesh);
    let of = |point: &DVec3| corners.iter().map(|corners| distance(*point, *corners)).fold(f64::INFINITY, f64::min);
    points.par_iter().map(of).reduce(|| 0.0, f64::max)
}

/// Returns the larger of the distances of the vertices of `original` from `other`, and of midpoints of sides and centroids of a
/// thousand triangles of `other` from `original`.
fn apart(original: &TriangleMesh, other: &TriangleMesh) -> f64 {
    let some = corners(other).into_iter().step_by(other.triangles.len() / 1000 + 1);
    let inner: Vec<DVec3> = some.flat_map(|[a, b, c]| [(a + b) / 2.0, (b + c) / 2.0, (a + b + c) / 3.0]).collect();
    farthest(&original.positions, other).max(farthest(&inner, original))
}

fn assert_same_topology(original: &TriangleMesh, result: &TriangleMesh) {
    let (before, after) =
        (ManifoldReport::of(original, Precision::Single), ManifoldReport::of(result, Precision::Single));
    assert!(after.passed(), "{:?}", after.failures());
    assert_eq!((after.components, after.genus), (before.components, before.genus));
}

#[test]
fn refined_cubes_simplify_to_twelve_triangles() {
    for (corner, side, bound) in [(0.0, 1.0, 1e-3), (1e7, 20.0, 0.01), (-3.0, 1e-5, 1e-8), (0.0, 1e12, 1e9)] {
        // More triangles than two patches hold.
        let original = refined(&cube(DVec3::splat(corner), side), 5);
        assert!(original.triangles.len() > PATCH);
        let result = simplified(&original, bound);
        assert_eq!(result.mesh.triangles.len(), 12, "{corner} {side}");
        let expected: BTreeSet<_> =
            cube(DVec3::splat(corner), side).positions.iter().map(|p| p.to_array().map(f64::to_bits)).collect();
        let found: BTreeSet<_> = result.mesh.positions.iter().map(|p| p.to_array().map(f64::to_bits)).collect();
        assert_eq!(found, expected);
        assert!(result.distance <= bound);
    }
}

#[test]
fn the_bound_holds_by_brute_force_and_larger_bounds_leave_fewer_triangles() {
    let original = solids::torus(10.0, 3.0, 96, 48).unwrap();
    assert!(original.triangles.len() > PATCH);
    let mut before = usize::MAX;
    for bound in [0.05, 0.3] {
        let result = simplified(&original, bound);
        assert_same_topology(&original, &result.mesh);
        // The borders of the first pass's patches go in later ones.
        assert!(result.passes > 1, "{}", result.passes);
        let apart = apart(&original, &result.mesh);
        assert!(result.distance <= bound && apart <= bound * (1.0 + 1e-12), "{apart} {} {bound}", result.distance);
        // Distances from the corresponding part are no less than distances from the nearest.
        assert!(apart <= result.distance + 1e-12);
        assert!(result.mesh.triangles.len() < before);
        before = result.mesh.triangles.len();
    }
    assert!(before < original.triangles.len() / 8, "{before}");
}

#[test]
fn walls_thinner_than_the_bound_stay_within_it() {
    // A wavy sheet: samples of one side are near the other, too.
    for (thickness, bound) in [(0.3, 0.5), (0.3, 0.2), (0.05, 1.0)] {
        let sheet = solids::cuboid(DVec3::ZERO, DVec3::new(24.0, 24.0, thickness)).unwrap();
        let mut original = refined(&sheet, 5);
        for position in &mut original.positions {
            position.z += 1.5 * (position.x / 2.0).sin() * (position.y / 3.0).cos();
        }
        let result = simplified(&original, bound);
        assert_same_topology(&original, &result.mesh);
        let apart = apart(&original, &result.mesh);
        assert!(apart <= bound * (1.0 + 1e-12), "{thickness}: {apart} {bound}");
        assert_eq!(crossing_pairs(&result.mesh, Precision::Double), 0);
        // Where both sides are within the bound of one another, they would often cross, and parts stay as they were.
        assert!(3 * result.mesh.triangles.len() < 2 * original.triangles.len(), "{}", result.mesh.triangles.len());
    }
}

#[test]
fn spikes_higher_than_the_bound_stay() {
    let mut original = refined(&cube(DVec3::ZERO, 1.0), 5);
    let top: Vec<usize> = (0..original.positions.len()).filter(|&i| original.positions[i].z == 1.0).collect();
    let inner = |p: DVec3| p.x > 0.1 && p.x < 0.9 && p.y > 0.1 && p.y < 0.9;
    let spikes: Vec<usize> = top.into_iter().filter(|&i| inner(original.positions[i])).step_by(37).collect();
    assert!(spikes.len() > 10);
    spikes.iter().for_each(|&i| original.positions[i].z = 1.0055);
    let result = simplified(&original, 0.005);
    assert_same_topology(&original, &result.mesh);
    assert!(apart(&original, &result.mesh) <= 0.005 * (1.0 + 1e-12));
    let left = result.mesh.positions.iter().filter(|position| position.z > 1.0).count();
    // One between others may go, where the surface spans those.
    assert!(left + 1 >= spikes.len() && result.mesh.triangles.len() < original.triangles.len() / 20, "{left}");
}

#[test]
fn rounded_boxes_have_few_triangles() {
    // Flat faces beside bent ones, in several passes.
    let mut original = refined(&cube(DVec3::splat(-1.0), 2.0), 6);
    for position in &mut original.positions {
        let core = position.clamp(DVec3::splat(-0.8), DVec3::splat(0.8));
        *position = core + 0.2 * (*position - core).normalize_or_zero();
    }
    assert!(original.triangles.len() > 4 * PATCH);
    let result = simplified(&original, 0.004);
    assert_same_topology(&original, &result.mesh);
    assert!(result.mesh.triangles.len() < 560, "{}", result.mesh.triangles.len());
    assert!(farthest(&original.positions, &result.mesh) <= 0.004 * (1.0 + 1e-12));
}

#[test]
fn parts_smaller_than_the_bound_neither_vanish_nor_tear() {
    let scaled = |mesh: &TriangleMesh, scale: f64, by: DVec3| TriangleMesh {
        positions: mesh.positions.iter().map(|position| *position * scale + by).collect(),
        triangles: mesh.triangles.clone(),
    };
    let ball = solids::geodesic(10.0, 12).unwrap();
    let speck = scaled(&refined(&tetrahedron(), 2), 0.01, DVec3::X * 20.0);
    let ring = scaled(&solids::torus(5.0, 0.05, 60, 8).unwrap(), 1.0, DVec3::X * -20.0);
    let hollow = scaled(&reversed(&solids::geodesic(1.0, 6).unwrap()), 0.02, DVec3::ZERO);
    let original = together(&[ball, speck, ring, hollow]);
    let manifold = ManifoldReport::of(&original, Precision::Single);
    assert!(manifold.passed() && (manifold.components, manifold.genus) == (4, Some(1)), "{:?}", manifold.failures());
    let result = simplified(&original, 0.5);
    assert_same_topology(&original, &result.mesh);
    assert!(result.mesh.triangles.len() < original.triangles.len() / 2, "{}", result.mesh.triangles.len());
    assert!(apart(&original, &result.mesh) <= 0.5);
}

#[test]
fn points_stay_within_the_errors_of_their_triangles_from_pass_to_pass() {
    let original = solids::torus(10.0, 3.0, 256, 128).unwrap();
    assert!(original.triangles.len() > 4 * PATCH);
    let (limits, spacing) = (within(0.01), mean_side(&original));
    let (inner, homes) = points_of(&original, spacing);
    let target = Target { original: &original, inner, slack: 0.0, measures: true, spacing, limits: &limits };
    let mut state = Surface::new(&original, as_given(&original), homes);
    let mut rest = Vec::new();
    for split in SPLITS {
        let mut division = state.divide(&target, split);
        assert!(resolve(&mut division, &target, &|_| Vec::new(), &mut 0));
        rest.push(division.rest.len());
        state.take(&division, Age::Verified);
        assert_eq!(state.triangles.len(), state.errors.len());
        for (point, &home) in (0..).zip(&state.homes) {
            let corners = state.triangles[home as usize].map(|vertex| original.positions[vertex as usize]);
            assert!(distance(target.point(point), corners) <= state.errors[home as usize] + 1e-12);
        }
    }
    // At first all may change, and later only what is near the borders of patches.
    assert!(rest[0] == 0 && rest[3] > 0 && state.triangles.len() < original.triangles.len() / 2, "{rest:?}");
}

#[test]
fn triangles_in_any_order_simplify_alike() {
    let original = solids::torus(10.0, 3.0, 160, 64).unwrap();
    let mut shuffled = original.clone();
    let mut random = Random::new(9);
    (1..shuffled.triangles.len()).for_each(|i| shuffled.triangles.swap(i, random.below(i + 1)));
    let [here, there] = [&original, &shuffled].map(|mesh| simplified(mesh, 0.05));
    assert_same_topology(&original, &there.mesh);
    assert!(apart(&original, &there.mesh) <= 0.05 * (1.0 + 1e-12));
    let [here, there] = [here, there].map(|result| result.mesh.triangles.len() as f64);
    assert!((there / here - 1.0).abs() < 0.05, "{here} {there}");
}

#[test]
fn requested_positions_are_restored() {
    let original = solids::torus(10.0, 3.0, 128, 48).unwrap();
    let wanted: Vec<DVec3> = original.positions.iter().step_by(137).copied().collect();
    let plain = simplified(&original, 0.1);
    let missing = |mesh: &TriangleMesh| -> Vec<DVec3> {
        wanted.iter().filter(|place| !mesh.positions.contains(place)).copied().collect()
    };
    assert!(missing(&plain.mesh).len() > wanted.len() / 4);
    let calls = RefCell::new(0);
    let result = simplify(&original, &within(0.1), |mesh| {
        *calls.borrow_mut() += 1;
        assert!(ManifoldReport::of(mesh, Precision::Single).passed());
        missing(mesh)
    });
    let result = result.unwrap();
    assert_eq!(missing(&result.mesh), []);
    assert_same_topology(&original, &result.mesh);
    assert!(*calls.borrow() > result.passes && *calls.borrow() <= result.rounds);
    let (here, there) = (result.mesh.triangles.len(), plain.mesh.triangles.len());
    assert!(there < here && here < original.triangles.len() / 2, "{there} {here}");
}

/// What the first pass removes is gone for those that follow.
#[test]
fn the_pass_over_what_is_flat_is_verified_at_once_where_later_is_too_late() {
    // Triangles in pairs, as those of quadrilaterals are: faces that fall together in 32 bits, and a place inside a flat face.
    let plate = |z: f64, side: f64| {
        let mut mesh = refined(&cube(DVec3::Z * z, side), 4);
        mesh.triangles.chunks_exact_mut(4).for_each(|parts| parts[1..].rotate_right(1));
        mesh
    };
    let beside = together(&[plate(1e7, 16.0), plate(1e7 + 16.3, 16.0)]);
    let plain = plate(0.0, 8.0);
    let wanted = DVec3::new(3.0, 5.0, 8.0);
    assert!(plain.positions.contains(&wanted));
    for (original, wanted) in [(&beside, None), (&plain, Some(wanted))] {
        let limits = Limits { precision: Precision::Single, ..within(1.0) };
        let missing = |mesh: &TriangleMesh| wanted.filter(|place| !mesh.positions.contains(place));
        let acceptable = |mesh: &TriangleMesh| missing(mesh).into_iter().collect();
        assert!(decimated(original, &limits, &acceptable, false, &mut 0).is_none());
        let result = simplify(original, &limits, acceptable).unwrap();
        let [before, after] = [original, &result.mesh].map(|mesh| ManifoldReport::of(mesh, Precision::Double));
        assert!(after.passed() && (after.components, after.genus) == (before.components, before.genus));
        assert_eq!((crossing_pairs(&result.mesh, Precision::Double), missing(&result.mesh)), (0, None));
        assert!(result.mesh.triangles.len() < original.triangles.len() / 2, "{}", result.mesh.triangles.len());
    }
}

#[test]
fn unreachable_requests_return_the_original() {
    let original = solids::torus(10.0, 3.0, 40, 20).unwrap();
    for place in [DVec3::ZERO, DVec3::X * 10.0, DVec3::splat(1e6)] {
        let result = simplify(&original, &within(0.1), |_| vec![place]).unwrap();
        assert_eq!((&result.mesh, result.distance), (&original, 0.0));
    }
    // A place that only the original restores, although every patch can be simplified.
    let all = original.positions.len();
    let result = simplify(&original, &within(0.1), |mesh| {
        if mesh.positions.len() < all { original.positions.clone() } else { Vec::new() }
    });
    assert_eq!(result.unwrap().mesh.triangles.len(), original.triangles.len());
}

#[test]
fn simplification_does_not_depend_on_the_thread_count() {
    let original = solids::torus(10.0, 3.0, 160, 64).unwrap();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| simplified(&original, 0.05))
    };
    let (one, four) = (with(1), with(4));
    assert_eq!((one.mesh, one.distance.to_bits()), (four.mesh, four.distance.to_bits()));
}

#[test]
fn invalid_bounds_are_refused() {
    for bound in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = simplify(&cube(DVec3::ZERO, 1.0), &within(bound), |_| Vec::new()).unwrap_err();
        assert!(matches!(error, SimplifyError::Bound { .. }), "{error}");
    }
    let mut open = cube(DVec3::ZERO, 1.0);
    open.triangles.pop();
    let error = simplify(&open, &within(0.1), |_| Vec::new()).unwrap_err();
    assert!(error.to_string().contains("3 edges do not border"), "{error}");
    let nothing = simplified(&TriangleMesh::default(), 0.1);
    assert_eq!(nothing.mesh, TriangleMesh::default());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn bounds_and_gates_hold_for_bumpy_balls(
        waves in prop::collection::vec((-4.0..4.0f64, -4.0..4.0f64, -4.0..4.0f64, 0.0..0.4f64), 1..4),
        bound in 0.01..1.0f64,
    ) {
        let mut original = solids::geodesic(10.0, 10).unwrap();
        for position in &mut original.positions {
            let sum: f64 = waves.iter().map(|&(x, y, z, a)| a * (position.dot(DVec3::new(x, y, z)) / 4.0).sin()).sum();
            *position *= 1.0 + sum;
        }
        prop_assume!(ManifoldReport::of(&original, Precision::Single).passed());
        let result = simplified(&original, bound);
        let manifold = ManifoldReport::of(&result.mesh, Precision::Single);
        prop_assert!(manifold.passed() && manifold.genus == Some(0) && manifold.components == 1, "{:?}", manifold.failures());
        let apart = apart(&original, &result.mesh);
        prop_assert!(apart <= bound * (1.0 + 1e-12) && result.distance <= bound, "{apart} {} {bound}", result.distance);
        let given: BTreeSet<_> = original.positions.iter().map(|p| p.to_array().map(f64::to_bits)).collect();
        prop_assert!(result.mesh.positions.iter().all(|p| given.contains(&p.to_array().map(f64::to_bits))));
    }
}

#[test]
fn pairs_of_few_tested_triangles_are_those_among_all_pairs() {
    let mut random = Random::new(11);
    let mut vector = || DVec3::from_array([0; 3].map(|_| random.share()));
    let positions: Vec<DVec3> = (0..400).flat_map(|_| [vector() * 2.0; 3].map(|at| at + vector())).collect();
    let triangles: Vec<[u32; 3]> = (0..400).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = TriangleMesh { positions, triangles };
    let new: Vec<bool> = (0..400).map(|i| i % 3 != 0).collect();
    let pairs = |tested: &[bool]| {
        let found = crossing(&mesh, [&new, tested], Precision::Single);
        found.into_iter().map(|[a, b]| [a.min(b), a.max(b)]).collect::<BTreeSet<_>>()
    };
    let all = pairs(&[true; 400]);
    for every in [2, 5, 40] {
        let tested: Vec<bool> = (0..400).map(|i| i % every == 0).collect();
        let expected: BTreeSet<_> =
            all.iter().copied().filter(|pair| pair.iter().any(|&i| tested[i as usize])).collect();
        assert!(expected.len() > 10);
        assert_eq!(pairs(&tested), expected, "one in {every}");
    }
}
