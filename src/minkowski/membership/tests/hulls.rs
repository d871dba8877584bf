//! Heaps of tetrahedra: the sum of two is the hull of the sums of their vertices.

use super::*;

type Tetrahedron = [[i32; 3]; 4];

fn minus(a: [i32; 3], b: [i32; 3]) -> [i128; 3] {
    std::array::from_fn(|i| i128::from(a[i]) - i128::from(b[i]))
}

fn cross([a, b, c]: [i128; 3], [d, e, f]: [i128; 3]) -> [i128; 3] {
    [b * f - c * e, c * d - a * f, a * e - b * d]
}

fn dot(a: [i128; 3], b: [i128; 3]) -> i128 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

fn polyhedron(tetrahedra: &[Tetrahedron]) -> Polyhedron {
    let faces = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let parts: Vec<Polyhedron> =
        tetrahedra.iter().map(|corners| Polyhedron::from_parts(corners.to_vec(), faces.clone())).collect();
    together(&parts)
}

/// Returns four corners in general position, oriented such that the faces look outwards.
fn random_tetrahedron(random: &mut Random, mut corner: impl FnMut(&mut Random) -> [i32; 3]) -> Tetrahedron {
    loop {
        let [a, b, c, d] = std::array::from_fn(|_| corner(random));
        match dot(cross(minus(b, a), minus(c, a)), minus(d, a)) {
            0 => {}
            volume if volume > 0 => return [a, b, c, d],
            _ => return [a, c, b, d],
        }
    }
}

/// Returns whether a movable point is in the hull of the sums of two tetrahedra's corners: on the inner side of every plane
/// through three of them that has all of them on one side.
fn is_in_hull(a: &Tetrahedron, b: &Tetrahedron, point: [i32; 3]) -> bool {
    let sums: Vec<[i32; 3]> =
        a.iter().flat_map(|a| b.iter().map(move |b| std::array::from_fn(|i| a[i] + b[i]))).collect();
    for i in 0..sums.len() {
        for j in 0..i {
            for k in 0..j {
                let normal = cross(minus(sums[j], sums[i]), minus(sums[k], sums[i]));
                let Some(tie) = normal.into_iter().find(|&n| n != 0) else { continue };
                let sides = || sums.iter().map(|&sum| dot(normal, minus(sum, sums[i])));
                let inner = match (sides().any(|side| side < 0), sides().any(|side| side > 0)) {
                    (true, true) => continue,
                    (false, _) => 1,
                    (true, false) => -1,
                };
                let side = dot(normal, minus(point, sums[i]));
                if inner * (if side == 0 { tie } else { side }) < 0 {
                    return false;
                }
            }
        }
    }
    true
}

/// Compares `rounds` pairs of heaps with corners and points from the given sources.
fn compare(
    rounds: u64,
    mut corner: impl FnMut(&mut Random) -> [i32; 3] + Copy,
    mut point: impl FnMut(&mut Random) -> [i32; 3],
) -> [u32; 2] {
    let mut counts = [0; 2];
    for round in 0..rounds {
        let mut random = Random::new(round);
        let mut heap = |random: &mut Random| -> Vec<Tetrahedron> {
            (0..random.within(1..4)).map(|_| random_tetrahedron(random, &mut corner)).collect()
        };
        let (a, b) = (heap(&mut random), heap(&mut random));
        let sum = SumMembership::new(&polyhedron(&a), Exterior::Out, &polyhedron(&b));
        let points: Vec<[i32; 3]> = (0..60).map(|_| point(&mut random)).collect();
        for (point, answer) in answers(&sum, points) {
            let expected = a.iter().any(|a| b.iter().any(|b| is_in_hull(a, b, point)));
            assert_eq!(answer, expected, "{point:?}, {a:?}, {b:?}");
            counts[usize::from(answer)] += 1;
        }
    }
    counts
}

#[test]
fn membership_in_sums_of_small_tied_heaps_agrees_with_hulls() {
    let counts = compare(150, |random| random.point(0..5).map(|c| 2 * c), |random| random.point(0..17));
    assert!(counts.iter().all(|&count| count > 1000), "{counts:?}");
}

#[test]
fn membership_in_sums_of_lattice_sized_heaps_agrees_with_hulls() {
    const HALF: i32 = 1 << 29;
    let counts = compare(100, |random| random.point(0..HALF / 2).map(|c| 2 * c), |random| random.point(0..2 * HALF));
    assert!(counts.iter().all(|&count| count > 300), "{counts:?}");
    // All differences are as large as possible.
    let extreme = |random: &mut Random| random.point(0..2).map(|c| if c == 0 { 0 } else { 2 * HALF - 2 });
    let near = |random: &mut Random| {
        let [least, greatest] = [random.within(0..5), 2 * HALF - 1 - random.within(0..5)];
        random.point(0..3).map(|c| [least, HALF - 1, greatest][c as usize])
    };
    let counts = compare(60, extreme, near);
    assert!(counts.iter().all(|&count| count > 100), "{counts:?}");
}
