//! Cavities, nested shells, and surfaces with facets of zero area or zero distance.

use super::*;

fn is_in(sum: &SumMembership, point: [i32; 3]) -> bool {
    answers(sum, [point])[0].1
}

/// Returns (0, 20)³ without [6, 14]³.
fn hollow_cube() -> Polyhedron {
    hollow([0, 20], [6, 14])
}

#[test]
fn a_cube_smaller_than_the_cavity_leaves_some_of_it() {
    let sum = SumMembership::new(&hollow_cube(), Exterior::Out, &cuboid([0; 3], [4; 3]));
    // The cavity of the sum is [10, 14]³.
    for (point, expected) in [
        ([12, 11, 13], false),
        ([10, 11, 13], false),
        ([9, 11, 13], true),
        ([14, 11, 13], true),
        ([13, 13, 13], false),
        ([0, 1, 1], true),
        ([-1, 1, 1], false),
        ([24, 1, 1], false),
        ([23, 23, 23], true),
    ] {
        assert_eq!(is_in(&sum, point), expected, "{point:?}");
    }
    let swapped = SumMembership::new(&cuboid([0; 3], [4; 3]), Exterior::Out, &hollow_cube());
    assert!(!is_in(&swapped, [12, 11, 13]) && is_in(&swapped, [9, 11, 13]));
}

#[test]
fn a_cube_larger_than_the_cavity_fills_it() {
    let sum = SumMembership::new(&hollow_cube(), Exterior::Out, &cuboid([0; 3], [10; 3]));
    let points = (0..30).flat_map(|x| (0..30).map(move |y| [x, y, 15]));
    assert!(answers(&sum, points).into_iter().all(|(_, answer)| answer));
}

#[test]
fn a_cube_as_large_as_the_cavity_fills_it() {
    // No facets cross in general position: neither's vertices are in the other except by the movement.
    let sum = SumMembership::new(&hollow_cube(), Exterior::Out, &cuboid([0; 3], [8; 3]));
    assert!(is_in(&sum, [14, 14, 14]) && is_in(&sum, [13, 13, 13]) && is_in(&sum, [13, 15, 14]));
}

#[test]
fn every_nested_shell_is_tested() {
    // A grain in the cavity of a hollow cube, which B contains entirely without touching a wall; only the grain is met.
    let grain = cuboid([10; 3], [12; 3]);
    let solid = together(&[hollow([0, 40], [2, 38]), grain]);
    let sum = SumMembership::new(&solid, Exterior::Out, &cuboid([0; 3], [8; 3]));
    assert!(is_in(&sum, [15, 15, 15]));
    assert!(!is_in(&sum, [31, 31, 31]));
    // The same with the shells of B.
    let swapped = SumMembership::new(&cuboid([0; 3], [8; 3]), Exterior::Out, &solid);
    assert!(is_in(&swapped, [15, 15, 15]));
    assert!(!is_in(&swapped, [31, 31, 31]));
    // A grain that is everywhere in the cavity of the other, which is in the cavity of the first.
    let nested = together(&[hollow([0, 40], [2, 38]), hollow([10, 30], [12, 28])]);
    let within = SumMembership::new(&nested, Exterior::Out, &cuboid([0; 3], [2; 3]));
    assert!(!is_in(&within, [21; 3]) && is_in(&within, [13; 3]) && !is_in(&within, [7; 3]) && is_in(&within, [1; 3]));
}

#[test]
fn the_complement_of_a_hollow_cube_lies_inside_and_outside() {
    let wall = hollow_cube().complement();
    let sum = SumMembership::new(&wall, Exterior::In, &cuboid([0; 3], [2; 3]));
    // Points where B reflected fits into the wall are not in the sum: x − (0, 2) within (0, 6) or beyond.
    for (point, expected) in
        [([3, 3, 3], false), ([1, 3, 3], true), ([2, 3, 3], false), ([6, 9, 9], true), ([5, 9, 9], false)]
    {
        assert_eq!(is_in(&sum, point), expected, "{point:?}");
    }
    assert!(is_in(&sum, [11; 3]) && is_in(&sum, [1001; 3]) && is_in(&sum, [-1001; 3]));
}

#[test]
fn facets_without_area_close_a_surface() {
    // An edge of a cube has a vertex in its middle for the facets on one side of it only.
    let cube = cuboid([0; 3], [8; 3]);
    let (mut positions, mut triangles) = (cube.positions().to_vec(), cube.triangles().to_vec());
    let (split, from, to) = triangles
        .iter()
        .enumerate()
        .find_map(|(t, &[a, b, _])| {
            let (p, q) = (positions[a as usize], positions[b as usize]);
            ((0..3).filter(|&i| p[i] != q[i]).count() == 1).then_some((t, a, b))
        })
        .unwrap();
    let middle = positions.len() as u32;
    let (p, q) = (positions[from as usize], positions[to as usize]);
    positions.push(std::array::from_fn(|i| (p[i] + q[i]) / 2));
    let third = triangles[split][2];
    triangles[split] = [from, middle, third];
    triangles.extend([[middle, to, third], [from, to, middle]]);
    let split_cube = Polyhedron::from_parts(positions, triangles);
    let plain = SumMembership::new(&cube, Exterior::Out, &cube);
    let mut random = Random::new(5);
    let points: Vec<[i32; 3]> = (0..3000).map(|_| random.point(-1..18)).collect();
    for sum in [
        SumMembership::new(&split_cube, Exterior::Out, &cube),
        SumMembership::new(&cube, Exterior::Out, &split_cube),
        SumMembership::new(&split_cube, Exterior::Out, &split_cube),
    ] {
        assert_eq!(answers(&sum, points.clone()), answers(&plain, points.clone()));
    }
}

#[test]
fn walls_flattened_by_rounding_have_a_sum() {
    let wall = Polyhedron::from_parts(vec![[0, 0, 0], [20, 0, 0], [0, 20, 0]], vec![[0, 1, 2], [0, 2, 1]]);
    let sum = SumMembership::new(&wall, Exterior::Out, &cuboid([0; 3], [2; 3]));
    assert!(is_in(&sum, [5, 5, 1]) && !is_in(&sum, [5, 5, 3]) && !is_in(&sum, [19, 19, 1]));
}

#[test]
fn needles_without_area_have_a_sum() {
    let needle = Polyhedron::from_parts(vec![[0, 0, 0], [20, 0, 0], [10, 0, 0]], vec![[0, 1, 2], [0, 2, 1]]);
    for sum in [
        SumMembership::new(&needle, Exterior::Out, &cuboid([0; 3], [2; 3])),
        SumMembership::new(&cuboid([0; 3], [2; 3]), Exterior::Out, &needle),
    ] {
        assert!(is_in(&sum, [21, 1, 1]) && is_in(&sum, [1, 1, 1]) && is_in(&sum, [11, 1, 1]));
        assert!(!is_in(&sum, [23, 1, 1]) && !is_in(&sum, [11, 3, 1]) && !is_in(&sum, [-1, 1, 1]));
    }
}

#[test]
fn sums_with_the_empty_set_are_empty_and_of_all_space_full() {
    let nothing = Polyhedron::from_parts(Vec::new(), Vec::new());
    let cube = cuboid([0; 3], [2; 3]);
    assert!(!is_in(&SumMembership::new(&nothing, Exterior::Out, &cube), [1; 3]));
    assert!(!is_in(&SumMembership::new(&cube, Exterior::Out, &nothing), [1; 3]));
    assert!(is_in(&SumMembership::new(&nothing, Exterior::In, &cube), [1; 3]));
    assert!(!is_in(&SumMembership::new(&nothing, Exterior::In, &nothing), [1; 3]));
}
