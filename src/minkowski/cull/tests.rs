//! Culling compared with all pairs by plain integers, coverage of the boundary by points of the sum, and known areas.

use std::collections::{BTreeMap, BTreeSet};

use super::*;
use crate::solids;
use crate::testing::random::Congruential;

type Point = [i32; 3];

/// Places positions on an even lattice with the given number of steps per unit, welded; triangles are unchanged.
fn on_lattice(positions: &[[f64; 3]], triangles: &[[u32; 3]], steps: f64) -> Polyhedron {
    let least = [0, 1, 2].map(|i| positions.iter().map(|p| p[i]).fold(f64::INFINITY, f64::min));
    let snap = |p: &[f64; 3]| [0, 1, 2].map(|i| 2 * ((p[i] - least[i]) * steps).round() as i32);
    let mut welded: Vec<Point> = Vec::new();
    let mut seen = BTreeMap::new();
    let mut index = |p: Point| {
        *seen.entry(p).or_insert_with(|| {
            welded.push(p);
            welded.len() as u32 - 1
        })
    };
    let of_vertex: Vec<u32> = positions.iter().map(|p| index(snap(p))).collect();
    let corners = triangles.iter().map(|triangle| triangle.map(|vertex| of_vertex[vertex as usize]));
    let triangles = corners.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    Polyhedron::from_parts(welded, triangles)
}

macro_rules! solid {
    ($mesh:expr, $steps:expr) => {{
        let mesh = $mesh.unwrap();
        let positions: Vec<[f64; 3]> = mesh.positions.iter().map(|p| p.to_array()).collect();
        on_lattice(&positions, &mesh.triangles, $steps)
    }};
}

/// Draws from 0 to below 1, in 24 bits.
fn share(random: &mut Congruential) -> f64 {
    (random.bits() >> 40) as f64 / (1_u64 << 24) as f64
}

/// Returns a geodesic sphere whose vertices are moved in and out at random.
fn crumpled(frequency: u32, depth: f64, steps: f64, seed: u64) -> Polyhedron {
    let mut random = Congruential::new(seed);
    let mesh = solids::geodesic(1.0, frequency).unwrap();
    let moved = mesh.positions.iter().map(|&p| (p * (1.0 - depth * share(&mut random))).to_array());
    on_lattice(&moved.collect::<Vec<_>>(), &mesh.triangles, steps)
}

/// Returns unit cells without the walls between them; their faces are halved.
fn cells(of: &[Point]) -> Polyhedron {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for cell in of {
        for axis in 0..3 {
            for step in [0, 1] {
                let mut next = *cell;
                next[axis] += 2 * step - 1;
                if of.contains(&next) {
                    continue;
                }
                let corner = |i: i32, j: i32| {
                    let mut at = cell.map(f64::from);
                    at[axis] += f64::from(step);
                    at[(axis + 1) % 3] += f64::from(i);
                    at[(axis + 2) % 3] += f64::from(j);
                    at
                };
                let first = positions.len() as u32;
                positions.extend([corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]);
                let [a, b, c, d] = [first, first + 1, first + 2, first + 3];
                triangles.extend(match step {
                    1 => [[a, b, c], [a, c, d]],
                    _ => [[a, c, b], [a, d, c]],
                });
            }
        }
    }
    on_lattice(&positions, &triangles, 10.0)
}

fn l_solid() -> Polyhedron {
    cells(&[[0, 0, 0], [1, 0, 0], [0, 1, 0]])
}

/// Returns two tetrahedra that share a vertex.
fn pinch() -> Polyhedron {
    let positions = [
        [0.0; 3],
        [3.0, 1.0, 0.0],
        [0.0, 4.0, 1.0],
        [1.0, 0.0, 5.0],
        [-3.0, -1.0, 0.5],
        [0.0, -4.0, -1.0],
        [-1.0, 0.0, -5.0],
    ];
    let triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3], [0, 4, 5], [0, 6, 4], [0, 5, 6], [4, 6, 5]];
    on_lattice(&positions, &triangles, 7.0)
}

/// Returns a two-sided rectangle of zero thickness, with one diagonal edge or two.
fn sheet(diagonals: usize) -> Polyhedron {
    let positions = [[0.0; 3], [4.0, 1.0, 0.5], [3.0, 4.0, 1.5], [-1.0, 3.0, 1.0]];
    let back = if diagonals == 1 { [[0, 2, 1], [0, 3, 2]] } else { [[0, 3, 1], [1, 3, 2]] };
    on_lattice(&positions, &[&[[0, 1, 2], [0, 2, 3]], &back[..]].concat(), 5.0)
}

/// Returns a tetrahedron with a needle at one of its corners.
fn spike() -> Polyhedron {
    let positions = [[0.0; 3], [3.0, 1.0, 0.0], [0.0, 4.0, 1.0], [1.0, 0.0, 5.0], [2.0, -1.0, 7.0], [4.0, -3.0, 11.0]];
    let triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3], [3, 4, 5], [3, 5, 4]];
    on_lattice(&positions, &triangles, 6.0)
}

/// Returns a cube with slivers between its faces that rounding has flipped in all ways.
fn slivers() -> Polyhedron {
    let mesh = crate::testing::meshes::cube(DVec3::ZERO, 1.0);
    let (mut positions, mut triangles) = (mesh.positions, mesh.triangles);
    let mut random = Congruential::new(5);
    for i in 0..triangles.len() {
        let [a, b, c] = triangles[i];
        let middle = positions.len() as u32;
        positions.push(positions[a as usize].lerp(positions[b as usize], 0.2 + 0.6 * share(&mut random)));
        triangles[i] = [a, middle, c];
        triangles.extend([[middle, b, c], [a, b, middle]]);
    }
    let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 0.9, 0.2);
    on_lattice(&positions.iter().map(|&p| (turn * p).to_array()).collect::<Vec<_>>(), &triangles, 1e6)
}

/// Returns solids without ties, with many, and with rare features.
fn zoo() -> Vec<(&'static str, Polyhedron)> {
    vec![
        ("cube", cells(&[[0, 0, 0]])),
        ("bar of cells", cells(&[[0, 0, 0], [1, 0, 0], [2, 0, 0]])),
        ("L", l_solid()),
        ("cells at an edge", cells(&[[0, 0, 0], [1, 1, 0]])),
        ("cells at a vertex", cells(&[[0, 0, 0], [1, 1, 1]])),
        (
            "cells around a hole",
            cells(&[[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [2, 2, 0], [1, 2, 0], [0, 2, 0], [0, 1, 0]]),
        ),
        ("pinch", pinch()),
        ("sheet", sheet(1)),
        ("sheet of two diagonals", sheet(2)),
        ("spike", spike()),
        ("slivers", slivers()),
        ("cube inside out", cells(&[[0, 0, 0]]).complement()),
        ("torus", solid!(solids::torus(3.0, 1.0, 7, 6), 1e6)),
        ("coarse torus", solid!(solids::torus(3.0, 1.0, 8, 4), 2.0)),
        ("geodesic", solid!(solids::geodesic(1.0, 2), 1e8)),
        ("cylinder", solid!(solids::cylinder(1.0, 2.0, 9), 1e5)),
        ("crumpled", crumpled(2, 0.7, 1e8, 1)),
        ("crumpled and coarse", crumpled(2, 0.7, 4.0, 2)),
        ("crumpled to ties", crumpled(2, 0.8, 2.0, 3)),
        ("crumpled tetrahedra", crumpled(1, 0.6, 3.0, 4)),
    ]
}

fn less(a: Point, b: Point) -> [i128; 3] {
    [0, 1, 2].map(|i| i128::from(a[i]) - i128::from(b[i]))
}

fn cross(u: [i128; 3], v: [i128; 3]) -> [i128; 3] {
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

fn dot(u: [i128; 3], v: [i128; 3]) -> i128 {
    (0..3).map(|i| u[i] * v[i]).sum()
}

/// A polyhedron's features as defined in the module's docs.
struct Plain<'p> {
    solid: &'p Polyhedron,
    /// Third vertex and normal of each facet at an edge.
    edges: BTreeMap<[u32; 2], Vec<(u32, [i128; 3])>>,
    kept: BTreeSet<[u32; 2]>,
}

impl Plain<'_> {
    fn new(solid: &Polyhedron) -> Plain<'_> {
        let mut plain = Plain { solid, edges: BTreeMap::new(), kept: BTreeSet::new() };
        for &[a, b, c] in solid.triangles() {
            for [from, to, third] in [[a, b, c], [b, c, a], [c, a, b]] {
                let normal = plain.normal([a, b, c]);
                plain.edges.entry([from.min(to), from.max(to)]).or_default().push((third, normal));
            }
        }
        for (&[p, q], around) in &plain.edges {
            let out = match around[..] {
                [(_, n), (third, m)] if n != [0; 3] && m != [0; 3] && !plain.has_turned([p, q]) => {
                    let height = dot(n, less(plain.at(third), plain.at(p)));
                    height > 0 || height == 0 && dot(n, m) > 0
                }
                _ => false,
            };
            if !out {
                plain.kept.insert([p, q]);
            }
        }
        plain
    }

    fn at(&self, vertex: u32) -> Point {
        self.solid.positions()[vertex as usize]
    }

    fn normal(&self, [a, b, c]: [u32; 3]) -> [i128; 3] {
        cross(less(self.at(b), self.at(a)), less(self.at(c), self.at(a)))
    }

    /// Returns whether a facet at an edge has an area, but a height of less than 4 steps.
    fn has_turned(&self, edge: [u32; 2]) -> bool {
        self.edges[&edge].iter().any(|&(third, n)| self.is_turned([edge[0], edge[1], third], n))
    }

    fn is_turned(&self, corners: [u32; 3], n: [i128; 3]) -> bool {
        let squared = |i: usize| {
            let along = less(self.at(corners[i]), self.at(corners[(i + 1) % 3]));
            dot(along, along)
        };
        n != [0; 3] && dot(n, n) < 16 * squared(0).max(squared(1)).max(squared(2))
    }

    /// Returns the number of convex edges that an edge counts for: as many as a corner needs, if it may belong to a sheet or a
    /// needle.
    fn counts(&self, edge: &[u32; 2]) -> usize {
        match self.edges[edge][..] {
            [(_, n), (third, m)]
                if n != [0; 3]
                    && m != [0; 3]
                    && !self.has_turned(*edge)
                    && dot(n, less(self.at(third), self.at(edge[0]))) < 0 =>
            {
                1
            }
            _ => 3,
        }
    }

    fn supports_at_vertex(&self, n: [i128; 3], vertex: u32) -> bool {
        let at = |edge: &&[u32; 2]| edge.contains(&vertex);
        self.kept.iter().filter(at).map(|edge| self.counts(edge)).sum::<usize>() >= 3
            && self.edges.keys().filter(at).flatten().all(|&u| dot(n, less(self.at(u), self.at(vertex))) <= 0)
    }

    fn supports_at_edge(&self, n: [i128; 3], edge: [u32; 2]) -> bool {
        let around = &self.edges[&edge];
        let height = |third: u32| dot(n, less(self.at(third), self.at(edge[0])));
        around.iter().all(|&(third, _)| height(third) <= 0)
            && (around.iter().any(|&(third, _)| height(third) < 0)
                || around.iter().any(|&(_, m)| dot(n, m) > 0)
                || around.iter().all(|&(_, m)| m == [0; 3])
                || self.has_turned(edge))
    }
}

/// Returns all primitives found by testing all pairs, and the number of pairs.
fn brute_force(a: &Polyhedron, b: &Polyhedron) -> (BTreeSet<Shape>, u64) {
    let (a, b) = (Plain::new(a), Plain::new(b));
    let mut found = Vec::new();
    for (of, on) in [(&a, &b), (&b, &a)] {
        let turned = |&[a, b, c]: &[u32; 3]| of.is_turned([a, b, c], of.normal([a, b, c])).then_some([a, c, b]);
        for facet in of.solid.triangles().iter().copied().chain(of.solid.triangles().iter().filter_map(turned)) {
            let normal = of.normal(facet);
            for vertex in 0..on.solid.positions().len() as u32 {
                if normal != [0; 3] && on.supports_at_vertex(normal, vertex) {
                    found.push(Shape::triangle(facet.map(|corner| sum(of.at(corner), on.at(vertex)))));
                }
            }
        }
    }
    for &[a0, a1] in &a.kept {
        for &[b0, b1] in &b.kept {
            let n = cross(less(a.at(a1), a.at(a0)), less(b.at(b1), b.at(b0)));
            let corners = [(a0, b0), (a1, b0), (a1, b1), (a0, b1)].map(|(i, j)| sum(a.at(i), b.at(j)));
            let turned = [0, 3, 2, 1].map(|i| corners[i]);
            for (n, corners) in [(n, corners), (n.map(|n| -n), turned)] {
                if n != [0; 3] && a.supports_at_edge(n, [a0, a1]) && b.supports_at_edge(n, [b0, b1]) {
                    found.push(Shape::parallelogram(corners));
                }
            }
        }
    }
    let kept = found.len() as u64;
    (found.into_iter().collect(), kept)
}

/// Recovers the shapes of primitives from their triangles.
fn shapes(primitives: &Primitives) -> Vec<Shape> {
    let at = |vertex: u32| primitives.positions[vertex as usize];
    let mut shapes = Vec::new();
    for &[a, b, c] in &primitives.triangles {
        match shapes.last_mut() {
            Some(Shape::Triangle([p, q, r])) if *p == at(a) && *r == at(b) && b == a + 2 => {
                let corners = [*p, *q, *r, at(c)];
                shapes.pop();
                shapes.push(Shape::parallelogram(corners));
            }
            _ => shapes.push(Shape::triangle([a, b, c].map(at))),
        }
    }
    shapes
}

#[test]
fn culling_agrees_with_all_pairs_in_plain_integers() {
    let zoo = zoo();
    for (i, (name, a)) in zoo.iter().enumerate() {
        for (other, b) in &zoo[i..] {
            let (primitives, counts) = cull(a, b);
            let found = shapes(&primitives);
            let distinct: BTreeSet<Shape> = found.iter().copied().collect();
            let (expected, kept) = brute_force(a, b);
            assert_eq!(distinct.len(), found.len(), "{name} and {other}: a primitive comes twice");
            let (missing, extra) = (expected.difference(&distinct).count(), distinct.difference(&expected).count());
            assert_eq!((missing, extra), (0, 0), "{name} and {other}: missing and extra of {}", expected.len());
            assert_eq!((counts.kept, counts.distinct), (kept, expected.len() as u64), "{name} and {other}");
        }
    }
}

#[test]
fn primitives_do_not_depend_on_operand_or_triangle_order() {
    for (name, a) in zoo() {
        for (other, b) in [("L", l_solid()), ("crumpled", crumpled(2, 0.5, 1e7, 9))] {
            let set = |a: &Polyhedron, b: &Polyhedron| shapes(&cull(a, b).0).into_iter().collect::<BTreeSet<_>>();
            let expected = set(&a, &b);
            assert_eq!(set(&b, &a), expected, "{name} and {other}");
            let last = b.positions().len() as u32 - 1;
            let positions = b.positions().iter().rev().copied().collect();
            let triangles = b.triangles().iter().rev().map(|&[a, b, c]| [last - b, last - c, last - a]).collect();
            assert_eq!(set(&a, &Polyhedron::from_parts(positions, triangles)), expected, "{name} and {other}");
        }
    }
}

#[test]
fn primitives_do_not_depend_on_the_thread_count() {
    let (a, b) = (solid!(solids::torus(3.0, 1.0, 60, 30), 1e6), crumpled(4, 0.3, 1e7, 5));
    let on = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| cull(&a, &b));
    let alone = on(1);
    assert!(alone.1.kept > 1000 && alone.1.visited < alone.1.candidates as u64 / 20, "{:?}", alone.1);
    assert_eq!(on(5), alone);
}

/// Convex bodies in general position: the primitives are the hull's facets, a closed surface whose volume is a polynomial in
/// the scale factors of the two bodies (Minkowski).
#[test]
fn primitives_of_convex_bodies_are_the_boundary_of_their_sum() {
    let skewed = |frequency, skew: [f64; 3]| {
        let mesh = solids::geodesic(1.0, frequency).unwrap();
        let skew = |p: DVec3| [p.x + skew[0] * p.y, p.y + skew[1] * p.z, p.z + skew[2] * p.x];
        on_lattice(&mesh.positions.iter().map(|&p| skew(p)).collect::<Vec<_>>(), &mesh.triangles, 0.7e8)
    };
    let (a, b) = (skewed(3, [0.31, 0.17, 0.23]), skewed(2, [-0.19, 0.37, 0.11]));
    let volume = |scale_a, scale_b| enclosed(&cull(&enlarged(&a, scale_a), &enlarged(&b, scale_b)).0);
    let alone = |of: &Polyhedron| {
        enclosed(&Primitives { positions: of.positions().to_vec(), triangles: of.triangles().to_vec() })
    };
    // V(s, t) = a³s³ + 3 m s²t + 3 n s t² + b³t³.
    let (a3, b3) = (alone(&a), alone(&b));
    let mixed = volume(1, 1) - a3 - b3;
    let m3 = (volume(2, 1) - 8.0 * a3 - b3 - 2.0 * mixed) / 2.0;
    let n3 = mixed - m3;
    let v12 = volume(1, 2);
    assert!(m3 > a3.min(b3) && n3 > a3.min(b3));
    assert!((a3 + 2.0 * m3 + 4.0 * n3 + 8.0 * b3 - v12).abs() < 1e-9 * v12);

    let mut edges = BTreeMap::new();
    let (primitives, _) = cull(&a, &b);
    for triangle in &primitives.triangles {
        let at = triangle.map(|vertex| primitives.positions[vertex as usize]);
        for [from, to] in [[at[0], at[1]], [at[1], at[2]], [at[2], at[0]]] {
            *edges.entry([from.min(to), from.max(to)]).or_insert(0) += if from < to { 1 } else { -1 };
        }
    }
    assert!(edges.values().all(|&count| count == 0), "the boundary is not closed");
}

fn enclosed(primitives: &Primitives) -> f64 {
    let at = |vertex: u32| DVec3::from(primitives.positions[vertex as usize].map(f64::from));
    primitives.triangles.iter().map(|&[a, b, c]| at(a).dot(at(b).cross(at(c)))).sum::<f64>() / 6.0
}

/// Points along random lines are in or out of the sum by the intersection of A and x − B; where that changes, a primitive lies
/// between, and a single one there faces outwards.
#[test]
fn primitives_cover_the_boundary() {
    let mut random = Congruential::new(77);
    let (mut changes, mut alone) = (0, 0);
    for (name, a) in zoo() {
        for (other, b) in [("L", l_solid()), ("crumpled", crumpled(2, 0.8, 1e7, 6))] {
            if name.contains("out") || name.contains("at a") {
                continue;
            }
            let scale = |of: &Polyhedron| f64::from((of.bounds().max).into_iter().max().unwrap());
            let ratio = scale(&a) / scale(&b);
            let (a, b) = match ratio {
                r if r > 1.0 => (a.clone(), enlarged(&b, r.round() as i32)),
                r => (enlarged(&a, (1.0 / r).round() as i32), b),
            };
            let triangles = corners_of(&shapes_as_triangles(&cull(&a, &b).0));
            let top = [0, 1, 2].map(|i| f64::from(a.bounds().max[i]) + f64::from(b.bounds().max[i]));
            for _ in 0..6 {
                let mut anywhere = || DVec3::from(top.map(|top| (1.2 * share(&mut random) - 0.1) * top));
                let (start, end) = (anywhere(), anywhere());
                let points: Vec<DVec3> = (0..=16).map(|i| start.lerp(end, f64::from(i) / 16.0)).collect();
                let inside: Vec<bool> = points.iter().map(|&x| is_in_sum(&a, &b, x)).collect();
                for (ends, sides) in points.windows(2).zip(inside.windows(2)).filter(|(_, sides)| sides[0] != sides[1])
                {
                    let crossed: Vec<f64> =
                        triangles.iter().filter_map(|triangle| crossing(ends[0], ends[1], triangle)).collect();
                    changes += 1;
                    assert!(!crossed.is_empty(), "{name} and {other}: nothing between {} and {}", ends[0], ends[1]);
                    if let [once] = crossed[..] {
                        alone += 1;
                        assert_eq!(once > 0.0, sides[0], "{name} and {other}: faces inwards");
                    }
                }
            }
        }
    }
    assert!(changes > 100 && alone > 20, "{changes} changes, {alone} at one primitive");
}

fn enlarged(of: &Polyhedron, by: i32) -> Polyhedron {
    Polyhedron::from_parts(of.positions().iter().map(|p| p.map(|x| x * by)).collect(), of.triangles().to_vec())
}

fn shapes_as_triangles(primitives: &Primitives) -> Polyhedron {
    Polyhedron::from_parts(primitives.positions.clone(), primitives.triangles.clone())
}

fn corners_of(solid: &Polyhedron) -> Vec<[DVec3; 3]> {
    let at = |vertex: u32| DVec3::from(solid.positions()[vertex as usize].map(f64::from));
    solid.triangles().iter().map(|triangle| triangle.map(at)).collect()
}

/// Returns whether A and x − B share a point, for x in general position and connected solids.
fn is_in_sum(a: &Polyhedron, b: &Polyhedron, x: DVec3) -> bool {
    let a = corners_of(a);
    let b: Vec<[DVec3; 3]> = corners_of(b).into_iter().map(|[p, q, r]| [x - p, x - q, x - r]).collect();
    let edges = |of: &[[DVec3; 3]]| of.iter().flat_map(|&[p, q, r]| [(p, q), (q, r), (r, p)]).collect::<Vec<_>>();
    let meets = |edges: &[(DVec3, DVec3)], triangles: &[[DVec3; 3]]| {
        edges.iter().any(|&(p, q)| triangles.iter().any(|triangle| crossing(p, q, triangle).is_some()))
    };
    let holds = |of: &[[DVec3; 3]], x: DVec3| {
        let far = x + DVec3::new(0.893, 0.345, 0.2886) * 1e11;
        of.iter().filter(|triangle| crossing(x, far, triangle).is_some()).count() % 2 == 1
    };
    meets(&edges(&a), &b) || meets(&edges(&b), &a) || holds(&a, b[0][0]) || holds(&b, a[0][0])
}

/// Returns a positive number if a segment crosses a triangle along its normal, a negative one if against it, `None` if it does
/// not cross it.
fn crossing(from: DVec3, to: DVec3, [a, b, c]: &[DVec3; 3]) -> Option<f64> {
    let normal = (b - a).cross(c - a);
    let (before, after) = (normal.dot(from - a), normal.dot(to - a));
    if (before > 0.0) == (after > 0.0) {
        return None;
    }
    let at = from + before / (before - after) * (to - from);
    let inside = [(a, b), (b, c), (c, a)].into_iter().all(|(p, q)| (q - p).cross(at - p).dot(normal) >= 0.0);
    inside.then_some(after - before)
}
