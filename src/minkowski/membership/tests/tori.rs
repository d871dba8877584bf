//! Tori and balls: analytic membership of points that are not close to a surface, and invariance under exchange of the operands
//! and under translation.

use super::*;
use crate::solids;

const CENTRE: i32 = 1 << 20;

/// Places positions, times 2^10, about the centre, with coordinates permuted cyclically by `turn`.
fn placed(positions: impl IntoIterator<Item = [f64; 3]>, triangles: &[[u32; 3]], turn: usize) -> Polyhedron {
    let place = |p: [f64; 3]| std::array::from_fn(|i| CENTRE + 2 * (p[(i + turn) % 3] * 512.0).round() as i32);
    Polyhedron::from_parts(positions.into_iter().map(place).collect(), triangles.to_vec())
}

fn torus(major: f64, minor: f64, around: u32, across: u32, turn: usize) -> Polyhedron {
    let mesh = solids::torus(major, minor, around, across).unwrap();
    placed(mesh.positions.iter().map(|p| p.to_array()), &mesh.triangles, turn)
}

fn ball(radius: f64) -> Polyhedron {
    let mesh = solids::sphere(radius, 32).unwrap();
    placed(mesh.positions.iter().map(|p| p.to_array()), &mesh.triangles, 0)
}

/// Returns points about a sum, and their distances from the circle of radius 100 in its middle.
fn around_a_circle(seed: u64) -> Vec<([i32; 3], f64)> {
    let mut random = Random::new(seed);
    let mut point = || {
        let [x, y, z] = random.point(-170 << 10..170 << 10);
        let [u, v, w] = [x, y, z / 2].map(|c| f64::from(c) / 1024.0);
        ([x, y, z / 2].map(|c| c + 2 * CENTRE), (u.hypot(v) - 100.0).hypot(w))
    };
    (0..2000).map(|_| point()).collect()
}

fn compare(sum: &SumMembership, seed: u64, expected: impl Fn(f64) -> Option<bool>) {
    let places = around_a_circle(seed);
    let mut counts = [0; 2];
    for ((point, answer), (_, distance)) in answers(sum, places.iter().map(|place| place.0)).into_iter().zip(&places) {
        if let Some(expected) = expected(*distance) {
            assert_eq!(answer, expected, "{point:?}, {distance}");
            counts[usize::from(answer)] += 1;
        }
    }
    assert!(counts.iter().all(|&count| count > 10), "{counts:?}");
}

#[test]
fn adding_a_ball_thickens_and_subtracting_it_thins_a_torus() {
    let (ring, ball) = (torus(100.0, 30.0, 96, 48, 0), ball(20.0));
    let off = |distance: f64, limit: f64| ((distance - limit).abs() > 1.0).then_some(distance < limit);
    compare(&SumMembership::new(&ring, Exterior::Out, &ball), 1, |distance| off(distance, 50.0));
    compare(&SumMembership::new(&ball, Exterior::Out, &ring), 2, |distance| off(distance, 50.0));
    let thinner = SumMembership::new(&ring.complement(), Exterior::In, &ball);
    compare(&thinner, 3, |distance| off(distance, 10.0).map(|is_in| !is_in));
}

#[test]
fn a_ball_wider_than_the_hole_closes_it() {
    let ring = torus(100.0, 30.0, 96, 48, 0);
    let middle = [2 * CENTRE + 1; 3];
    for (radius, expected) in [(69.0, false), (71.0, true)] {
        assert_eq!(answers(&SumMembership::new(&ring, Exterior::Out, &ball(radius)), [middle])[0].1, expected);
    }
}

#[test]
fn sums_of_tori_commute_and_translate() {
    let (a, b) = (torus(100.0, 30.0, 24, 12, 0), torus(50.0, 12.0, 16, 8, 1));
    let mut random = Random::new(4);
    let mut pick = |of: &Polyhedron| of.positions()[random.within(0..of.positions().len() as i32) as usize];
    // Vertices on vertices, where everything ties, and the lattice positions beside them.
    let sums: Vec<[i32; 3]> = (0..2000).map(|_| plus(pick(&a), pick(&b))).collect();
    let points: Vec<[i32; 3]> = sums.iter().flat_map(|&sum| [sum, sum.map(|c| c + 1), sum.map(|c| c - 1)]).collect();
    let one = answers(&SumMembership::new(&a, Exterior::Out, &b), points.clone());
    assert!([true, false].iter().all(|is_in| one.iter().filter(|answer| answer.1 == *is_in).count() > 50));
    assert_eq!(one, answers(&SumMembership::new(&b, Exterior::Out, &a), points.clone()));
    let by = [1 << 28, 12, 1 << 27];
    let there = Polyhedron::from_parts(a.positions().iter().map(|&p| plus(p, by)).collect(), a.triangles().to_vec());
    let elsewhere =
        answers(&SumMembership::new(&there, Exterior::Out, &b), points.iter().map(|&point| plus(point, by)));
    assert!(one.iter().zip(&elsewhere).all(|(one, other)| one.1 == other.1));
}

fn plus(a: [i32; 3], b: [i32; 3]) -> [i32; 3] {
    std::array::from_fn(|i| a[i] + b[i])
}
