//! Compares sums and differences of the library with brute force, sample by sample.

use ldi_ops::fixed::Crossing;
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::ldi::Ldi;
use ldi_ops::minkowski::{Exterior, Polyhedron, SumMembership, cull, resolve};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{Estimate, Mode};

use crate::sums::{HalfSpace, Point, clip, eroded, minus_spans, sum, union};
use crate::testing::random::Random;

/// A convex piece: its corners, and triangles that face outwards.
#[derive(Clone, Debug)]
struct Piece {
    corners: Vec<[i32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Piece {
    fn points(&self) -> Vec<Point> {
        self.corners.iter().map(|corner| corner.map(i128::from)).collect()
    }

    /// Returns the same surface turned over, as that of a hole.
    fn reversed(mut self) -> Piece {
        self.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        self
    }
}

const OCTAHEDRON: [[u32; 3]; 8] =
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
const BOX: [[u32; 3]; 12] = [
    [0, 2, 1],
    [1, 2, 3],
    [4, 5, 6],
    [5, 7, 6],
    [0, 1, 4],
    [1, 5, 4],
    [2, 6, 3],
    [3, 6, 7],
    [0, 4, 2],
    [2, 4, 6],
    [1, 3, 5],
    [3, 7, 5],
];

/// Returns a random convex piece with even corners in `[0, size]`: a box or an octahedron, whose faces tie with rays, or a
/// tetrahedron.
fn random_piece(random: &mut Random, size: i32) -> Piece {
    match random.between(0, 2) {
        0 => {
            let low: [i32; 3] = std::array::from_fn(|_| random.even(0, size - 2));
            let high: [i32; 3] = std::array::from_fn(|i| random.even(low[i] + 2, size));
            let corner = |k: usize| std::array::from_fn(|i| if k >> i & 1 == 1 { high[i] } else { low[i] });
            Piece { corners: (0..8).map(corner).collect(), triangles: BOX.to_vec() }
        }
        1 => {
            let radius = random.even(2, size / 4 * 2);
            let centre: [i32; 3] = std::array::from_fn(|_| random.even(radius, size - radius));
            let corner = |k: usize| {
                let mut corner = centre;
                corner[k / 2] += if k.is_multiple_of(2) { radius } else { -radius };
                corner
            };
            Piece { corners: (0..6).map(corner).collect(), triangles: OCTAHEDRON.to_vec() }
        }
        _ => loop {
            let corners: Vec<[i32; 3]> = (0..4).map(|_| std::array::from_fn(|_| random.even(0, size))).collect();
            let [a, b, c, d] = std::array::from_fn(|i| corners[i].map(i64::from));
            let edge = |p: [i64; 3]| -> [i64; 3] { std::array::from_fn(|i| p[i] - a[i]) };
            let (u, v, w) = (edge(b), edge(c), edge(d));
            let volume = u[0] * (v[1] * w[2] - v[2] * w[1])
                + u[1] * (v[2] * w[0] - v[0] * w[2])
                + u[2] * (v[0] * w[1] - v[1] * w[0]);
            if volume != 0 {
                let mut triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
                if volume < 0 {
                    triangles.iter_mut().for_each(|triangle: &mut [u32; 3]| triangle.swap(1, 2));
                }
                return Piece { corners, triangles };
            }
        },
    }
}

/// Returns a small random piece anywhere in `[0, size]`.
fn random_hole(random: &mut Random, size: i32) -> Piece {
    let mut hole = random_piece(random, (size / 4).max(4) & !1);
    let by: [i32; 3] = std::array::from_fn(|_| random.even(0, (size - size / 4) & !1));
    hole.corners.iter_mut().for_each(|corner| (0..3).for_each(|i| corner[i] += by[i]));
    hole
}

fn random_heap(random: &mut Random, size: i32) -> Vec<Piece> {
    (0..random.between(1, 3)).map(|_| random_piece(random, size)).collect()
}

/// Joins all pieces into one solid; vertices of equal position become one.
fn polyhedron<'p>(pieces: impl IntoIterator<Item = &'p Piece>) -> Polyhedron {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for piece in pieces {
        for triangle in &piece.triangles {
            triangles.push(triangle.map(|corner| {
                let position = piece.corners[corner as usize];
                positions.iter().position(|p| *p == position).unwrap_or_else(|| {
                    positions.push(position);
                    positions.len() - 1
                }) as u32
            }));
        }
    }
    Polyhedron::from_parts(positions, triangles)
}

/// Returns a grid of pixels of 2^shift steps that covers `size` lattice steps.
fn grid(size: i32, shift: u32, lod: u32) -> Grid {
    let rays = (size as u32 >> shift) + 1;
    Grid::from_parts(glam::DVec3::ZERO, 1.0, [rays; 3], shift, lod).unwrap()
}

/// Returns the images of A ⊕ B, or of complement(complement(A) ⊕ B), along x, y and z.
fn images(grid: &Grid, a: &Polyhedron, exterior: Exterior, b: &Polyhedron, mode: Mode) -> [Ldi; 3] {
    let sampler = CpuSampler::default();
    let (primitives, _) = cull(a, b);
    let spans = Axis::ALL.map(|axis| primitives.spans::<Crossing, _>(grid, axis, exterior, &sampler).unwrap().0);
    let membership = SumMembership::new(a, exterior, b);
    let resolved = resolve(grid, spans, exterior, &membership, &|_, _| ()).unwrap();
    resolved.spans.map(|spans| spans.image(grid, mode, &sampler).unwrap())
}

/// Returns those spans of a ray that have a length.
fn spans_of(image: &Ldi, ray: u32) -> Vec<(i128, i128)> {
    let spans = image.samples(ray).chunks(2).map(|span| (i128::from(span[0]), i128::from(span[1])));
    spans.filter(|(low, high)| low < high).collect()
}

type Spans = Vec<(crate::sums::Depth, crate::sums::Depth)>;

/// Compares three images with the brute-force result of every ray.
fn compare(images: &[Ldi; 3], case: &str, brute: impl Fn(usize, Point) -> Spans) {
    for image in images {
        let (grid, axis) = (image.grid(), image.axis());
        let (columns, rows) = image.size();
        for ray in 0..columns * rows {
            let mut position = [0; 3];
            position[axis.column()] = i128::from(grid.node(ray % columns));
            position[axis.row()] = i128::from(grid.node(ray / columns));
            let expected: Vec<(i128, i128)> = brute(axis.depth(), position)
                .iter()
                .map(|(low, high)| (low.nearest(), high.nearest()))
                .filter(|(low, high)| low < high)
                .collect();
            assert_eq!(spans_of(image, ray), expected, "{case}, ray {ray} along {}", axis.name());
        }
    }
}

/// Returns the spans of a union of convex bodies.
fn of_union(bodies: &[Vec<HalfSpace>], shift: u32, axis: usize, position: Point) -> Spans {
    union(bodies.iter().filter_map(|body| clip(body, axis, position)).collect(), shift)
}

/// Returns whether every span of `inner` lies in one of `exterior`.
fn assert_inside(inner: &Ldi, exterior: &Ldi, case: &str) {
    let (columns, rows) = inner.size();
    for ray in 0..columns * rows {
        let exterior = exterior.samples(ray);
        for span in inner.samples(ray).chunks(2).filter(|span| span[0] < span[1]) {
            let holds = exterior.chunks(2).any(|o| o[0] <= span[0] && span[1] <= o[1]);
            assert!(holds, "{case}, ray {ray} along {}: {span:?} in {exterior:?}", inner.axis().name());
        }
    }
}

#[test]
fn sums_of_heaps_equal_unions_of_hulls() {
    for seed in 0..300 {
        let mut random = Random::new(seed);
        let (shift, size) = (random.between(2, 5) as u32, random.between(12, 120) & !1);
        let part = random.between(4, size - 4) & !1;
        let (a, b) = (random_heap(&mut random, part), random_heap(&mut random, size - part));
        let grid = grid(size, shift, random.choose(&[32, 64, 1024]));
        let (first, second) = (polyhedron(&a), polyhedron(&b));
        let pairs = a.iter().flat_map(|p| b.iter().map(move |q| sum(&p.points(), &q.points())));
        let hulls: Vec<Vec<HalfSpace>> = pairs.collect();
        let case = format!("seed {seed}");
        let [exact, over, under] = [Mode::Exact, Mode::Estimate(Estimate::Over), Mode::Estimate(Estimate::Under)]
            .map(|mode| images(&grid, &first, Exterior::Out, &second, mode));
        compare(&exact, &case, |axis, position| of_union(&hulls, shift, axis, position));
        for axis in 0..3 {
            assert_inside(&under[axis], &exact[axis], &case);
            assert_inside(&exact[axis], &over[axis], &case);
        }
        assert_eq!(exact, images(&grid, &second, Exterior::Out, &first, Mode::Exact), "{case}: B ⊕ A");
    }
}

/// For a convex A with a convex hole H, A ⊖ B is A ⊖ B of the convex body less H ⊕ (−B).
#[test]
fn differences_of_convex_bodies_match_brute_force() {
    let mut with_holes = 0;
    for seed in 0..300 {
        let mut random = Random::new(seed);
        let (shift, size) = (random.between(2, 5) as u32, random.between(40, 120) & !1);
        let reach = random.between(4, size / 3) & !1;
        let body = random_piece(&mut random, size - reach);
        let b = random_heap(&mut random, reach);
        let bounds = crate::sums::hull(&body.points());
        let fits = |hole: &Piece| hole.points().iter().all(|&corner| bounds.iter().all(|h| h.holds_within(corner)));
        let hole = (0..50).map(|_| random_hole(&mut random, size - reach)).find(fits);
        with_holes += u32::from(hole.is_some());
        // −B, moved so that the sum of it and the complement of A lies in the grid.
        let reflect = |piece: &Piece| {
            let corners = piece.corners.iter().map(|corner| corner.map(|c| reach - c)).collect();
            Piece { corners, triangles: piece.triangles.clone() }.reversed()
        };
        let reflected: Vec<Piece> = b.iter().map(reflect).collect();
        let grid = grid(size, shift, 1024);
        let shell = hole.clone().map(Piece::reversed);
        let solid = polyhedron([&body].into_iter().chain(&shell)).complement();
        let found = images(&grid, &solid, Exterior::In, &polyhedron(&reflected), Mode::Exact);
        // x + B ⊆ A in the coordinates of the reflected and moved B: A less the corners, moved.
        let points: Vec<Point> = b.iter().flat_map(Piece::points).map(|p| p.map(|c| c - i128::from(reach))).collect();
        let inner = eroded(&body.points(), &points);
        let holes: Vec<Vec<HalfSpace>> =
            hole.iter().flat_map(|h| reflected.iter().map(|q| sum(&h.points(), &q.points()))).collect();
        compare(&found, &format!("seed {seed}"), |axis, position| {
            // Gaps of the subtracted set are closed, since they are gaps of the complement's sum.
            let taken = of_union(&holes, shift, axis, position);
            let left = clip(&inner, axis, position).map(|span| minus_spans(span, &taken)).unwrap_or_default();
            left.into_iter().filter(|(low, high)| low.has_gap_to(high, shift)).collect()
        });
    }
    assert!(with_holes > 20, "{with_holes}");
}
