//! Unions of shapes with all crossings kept, including buried ones, compared with gaps decided one by one.

use std::collections::HashSet;
use std::sync::Mutex;

use glam::DVec3;

use super::*;
use crate::fixed::{Crossing, Pixels};
use crate::testing::images::in_serpentine;
use crate::testing::random::Random;

/// A closed surface with its solid behind it.
#[derive(Clone, Debug)]
enum Shape {
    /// Twice the centre, odd, so that the nearest lattice positions on both sides are equally near, and four times the square
    /// of the radius, divisible by eight, so that no lattice position lies on it.
    Ball([i32; 3], i64),
    /// The second shape without the first.
    Shell(Box<Shape>, Box<Shape>),
    /// Cuts at even positions, and the cells between them; those before the first and after the last cut are out.
    Cells([Vec<i32>; 3], Vec<bool>),
    /// The complement of the shape.
    Not(Box<Shape>),
}

fn ball(centre: [i32; 3], radius: i32) -> Shape {
    Shape::Ball(centre.map(|c| 2 * c + 1), 4 * i64::from(radius).pow(2) / 8 * 8)
}

fn cuboid(from: [i32; 3], to: [i32; 3]) -> Shape {
    Shape::Cells(std::array::from_fn(|i| vec![from[i] / 2 * 2, to[i] / 2 * 2]), vec![true])
}

impl Shape {
    fn contains(&self, point: [i32; 3]) -> bool {
        match self {
            Shape::Ball(centre, square) => {
                (0..3).map(|i| i64::from(2 * point[i] - centre[i]).pow(2)).sum::<i64>() < *square
            }
            Shape::Shell(inner, exterior) => exterior.contains(point) && !inner.contains(point),
            Shape::Not(shape) => !shape.contains(point),
            Shape::Cells(cuts, inside) => {
                let mut cell = 0;
                for (cuts, &position) in cuts.iter().zip(&point) {
                    let at = cuts.partition_point(|&cut| cut < position);
                    if at == 0 || at == cuts.len() {
                        return false;
                    }
                    cell = cell * (cuts.len() - 1) + at - 1;
                }
                inside[cell]
            }
        }
    }

    /// Adds the crossings of a ray through `point`.
    fn cross(&self, axis: Axis, mut point: [i32; 3], to: &mut Vec<Crossing>) {
        let depth = axis.depth();
        match self {
            Shape::Ball(centre, _) => {
                let middle = (centre[depth] - 1) / 2;
                let mut holds = |position: i32| {
                    point[depth] = position;
                    self.contains(point)
                };
                if !holds(middle) {
                    return;
                }
                // The greatest position before the first crossing, and the last.
                let mut search = |mut inside: i32, mut outside: i32| {
                    while (inside - outside).abs() > 1 {
                        let between = (inside + outside) / 2;
                        *if holds(between) { &mut inside } else { &mut outside } = between;
                    }
                    inside.min(outside) as u32
                };
                for (below, leaves) in [(search(middle, -1), 0), (search(middle, 1 << 29), 1)] {
                    to.push(Crossing((below >> 1) << 3 | (1 + (below & 1)) << 1 | leaves));
                }
            }
            Shape::Shell(inner, exterior) => {
                let first = to.len();
                inner.cross(axis, point, to);
                to[first..].iter_mut().for_each(|crossing| crossing.0 ^= 1);
                exterior.cross(axis, point, to);
            }
            Shape::Not(shape) => {
                let first = to.len();
                shape.cross(axis, point, to);
                to[first..].iter_mut().for_each(|crossing| crossing.0 ^= 1);
            }
            Shape::Cells(cuts, _) => {
                for &cut in &cuts[depth] {
                    let [before, behind] = [cut - 1, cut + 1].map(|position| {
                        point[depth] = position;
                        self.contains(point)
                    });
                    if before != behind {
                        to.push(Crossing((cut as u32 >> 1) << 3 | u32::from(before)));
                    }
                }
            }
        }
    }
}

/// A union of shapes.
#[derive(Debug)]
struct Union {
    grid: Grid,
    exterior: Exterior,
    shapes: Vec<Shape>,
}

impl Membership for Union {
    type Memory = ();

    fn contains(&self, point: [i32; 3], (): &mut ()) -> bool {
        assert!(point.iter().all(|position| position % 2 == 1), "{point:?} is on no ray");
        self.shapes.iter().any(|shape| shape.contains(point))
    }
}

impl Union {
    fn new(rays: [u32; 3], shift: u32, shapes: Vec<Shape>) -> Union {
        Union { grid: Grid::from_parts(DVec3::ZERO, 1.0, rays, shift, 32).unwrap(), exterior: Exterior::Out, shapes }
    }

    /// Returns the spans of all crossings, and those with true gaps only.
    fn spans(&self, axis: Axis) -> [RaySpans<Crossing>; 2] {
        let (columns, rows) = self.grid.image_size(axis);
        let pixels = Pixels::new(self.grid.shift());
        let mut certain = RaySpans { axis, offsets: vec![0], hits: Vec::new() };
        let mut exact = certain.clone();
        let mut crossings = Vec::new();
        for ray in 0..columns * rows {
            let mut point = [1; 3];
            point[axis.column()] = pixels.ray((ray % columns) as i32);
            point[axis.row()] = pixels.ray((ray / columns) as i32);
            crossings.clear();
            self.shapes.iter().for_each(|shape| shape.cross(axis, point, &mut crossings));
            crossings.sort_unstable();
            self.exterior.keep_gaps(pixels, &crossings, &mut certain.hits);
            let hits = &certain.hits[certain.offsets[ray as usize] as usize..];
            let mut is_gap = |pair: &[Crossing]| {
                // All of the gap is out if a position in it is, even a node.
                let ends = [pair[0], pair[1]].map(|hit| pixels.index_from(hit.nearest()));
                point[axis.depth()] = match ends[0] < ends[1] {
                    true => pixels.ray(ends[0]),
                    false => pair[0].ceil() + 1,
                };
                !self.contains(point, &mut ())
            };
            let first_gap = self.exterior.first_gap().min(hits.len());
            exact.hits.extend(&hits[..first_gap]);
            let mut pairs = hits[first_gap..].chunks_exact(2);
            exact.hits.extend(pairs.by_ref().filter(|pair| is_gap(pair)).flatten());
            exact.hits.extend(pairs.remainder());
            certain.offsets.push(certain.hits.len() as u32);
            exact.offsets.push(exact.hits.len() as u32);
        }
        [certain, exact]
    }

    /// Resolves the union, compares the result with gaps decided one by one and its counts with a scan of all nodes, and
    /// returns the counts.
    fn check(&self) -> ResolveCounts {
        let spans = Axis::ALL.map(|axis| self.spans(axis));
        let certain = || spans.each_ref().map(|[certain, _]| certain.clone());
        let exact = spans.each_ref().map(|[_, exact]| exact.clone());
        let resolved = resolve(&self.grid, certain(), self.exterior, self, &|_, _| {}).unwrap();
        let gaps = |spans: &[RaySpans<Crossing>; 3]| {
            let of_ray = |hits: &[Crossing]| (hits.len() - self.exterior.first_gap().min(hits.len())) / 2;
            let of_axis = |spans: &RaySpans<Crossing>| {
                (0..spans.offsets.len() as u32 - 1).map(|ray| of_ray(spans.of_ray(ray)) as u64).sum::<u64>()
            };
            spans.iter().map(of_axis).sum::<u64>()
        };
        assert_eq!(resolved.counts.gaps, gaps(&certain()));
        assert_eq!(resolved.counts.gaps_out, gaps(&exact));
        assert_eq!(resolved.spans, exact);
        let (open, components) = self.components(&certain());
        let out = components.iter().filter(|&&node| !self.contains(node, &mut ())).count() as u64;
        assert_eq!(resolved.counts.open_nodes, open);
        assert_eq!(resolved.counts.components, components.len() as u64);
        assert_eq!((resolved.counts.cavities, resolved.counts.filled), (out, components.len() as u64 - out));
        resolved.counts
    }

    /// Returns the number of nodes that are neither certainly in nor out, and a node of each component, by a search from node
    /// to node.
    fn components(&self, spans: &[RaySpans<Crossing>; 3]) -> (u64, Vec<[i32; 3]>) {
        let rays = self.grid.rays();
        let hits = |node: [u32; 3], axis: Axis| {
            let (columns, _) = self.grid.image_size(axis);
            spans[axis.depth()].of_ray(node[axis.row()] * columns + node[axis.column()])
        };
        let is_open = |node: [u32; 3]| {
            Axis::ALL.into_iter().all(|axis| {
                let hits = hits(node, axis);
                let position = self.grid.node(node[axis.depth()]);
                let before = hits.iter().filter(|hit| hit.nearest() < position).count();
                let in_gap = before % 2 == (self.exterior.first_gap() + 1) % 2;
                in_gap && (self.exterior == Exterior::In || (before > 0 && before < hits.len()))
            })
        };
        let (mut seen, mut components, mut open) = (HashSet::new(), Vec::new(), 0);
        let nodes = (0..rays[2]).flat_map(|z| (0..rays[1]).flat_map(move |y| (0..rays[0]).map(move |x| [x, y, z])));
        for node in nodes {
            if !is_open(node) || !seen.insert(node) {
                continue;
            }
            let (mut to_visit, mut is_component) = (vec![node], true);
            while let Some(node) = to_visit.pop() {
                open += 1;
                for (axis, step) in Axis::ALL.into_iter().flat_map(|axis| [(axis, 1), (axis, -1)]) {
                    let mut next = node;
                    let depth = axis.depth();
                    next[depth] = node[depth].wrapping_add_signed(step);
                    if next[depth] >= rays[depth] {
                        continue;
                    }
                    let least = self.grid.node(node[depth].min(next[depth]));
                    let between = least..least + (1 << self.grid.shift());
                    if hits(node, axis).iter().any(|hit| between.contains(&hit.nearest())) {
                        continue;
                    }
                    match is_open(next) {
                        false => is_component = false,
                        true if seen.insert(next) => to_visit.push(next),
                        true => {}
                    }
                }
            }
            if is_component {
                components.push(node.map(|index| self.grid.node(index)));
            }
        }
        (open, components)
    }
}

/// Returns cells as large as pixels, with a node in each.
fn pixel_cells(rays: [u32; 3], shift: u32, mut inside: impl FnMut([u32; 3]) -> bool) -> Shape {
    let cuts = rays.map(|n| (0..=n as i32).map(|i| i << shift).collect());
    let nodes = (0..rays[0]).flat_map(|x| (0..rays[1]).flat_map(move |y| (0..rays[2]).map(move |z| [x, y, z])));
    Shape::Cells(cuts, nodes.map(&mut inside).collect())
}

fn random_shape(random: &mut Random, lengths: [i32; 3]) -> Shape {
    let least = *lengths.iter().min().unwrap();
    match random.below(4) {
        kind @ (0 | 1) => {
            let radius = random.within(2..least / 2);
            let centre = lengths.map(|length| random.within(radius..length - radius));
            match kind {
                0 => ball(centre, radius),
                _ => Shape::Shell(Box::new(ball(centre, random.within(1..radius))), Box::new(ball(centre, radius))),
            }
        }
        2 => {
            let ends = lengths.map(|length| (random.within(0..length - 2), random.within(2..length)));
            cuboid(ends.map(|(from, to)| from.min(to)), ends.map(|(from, to)| from.max(to) + 2))
        }
        _ => {
            let cuts = lengths.map(|length| {
                let mut cuts: Vec<i32> = (0..random.within(2..9)).map(|_| random.within(0..length / 2) * 2).collect();
                cuts.sort_unstable();
                cuts.dedup();
                cuts
            });
            let cells = cuts.iter().map(|cuts| cuts.len() - 1).product();
            Shape::Cells(cuts, (0..cells).map(|_| random.below(3) != 0).collect())
        }
    }
}

#[test]
fn unions_of_shapes_are_resolved_gap_by_gap() {
    let mut random = Random::new(1);
    let mut sums = ResolveCounts::default();
    for case in 0..120 {
        // Up to five slabs.
        let rays = [3..70, 3..20, 3..140].map(|range| random.within(range) as u32);
        let shift = random.within(2..9) as u32;
        let lengths = rays.map(|n| (n << shift) as i32 - 2);
        let mut shapes: Vec<Shape> = (0..random.within(1..12)).map(|_| random_shape(&mut random, lengths)).collect();
        let exterior = if case % 4 == 3 { Exterior::In } else { Exterior::Out };
        if exterior == Exterior::In {
            // The room that the others stand in, as wide as the grid.
            shapes.push(Shape::Not(Box::new(cuboid([2; 3], lengths))));
        }
        let counts = Union { exterior, ..Union::new(rays, shift, shapes) }.check();
        sums.cavities += counts.cavities;
        sums.filled += counts.filled;
        sums.gaps_tested += counts.gaps_tested;
        sums.gaps_out += counts.gaps_out;
    }
    assert!(sums.cavities > 50 && sums.filled > 50 && sums.gaps_tested > 1000 && sums.gaps_out > 1000, "{sums:?}");
}

#[test]
fn mazes_of_random_nodes_resolve_as_expected() {
    let mut random = Random::new(2);
    let mut cavities = 0;
    for case in 0..24 {
        // Around the percolation density of the block, with buried balls beside it.
        let out = [20, 32, 45, 60][case % 4];
        let (rays, shift) = ([random.within(60..70) as u32, 17, random.within(30..70) as u32], 6);
        let mut shapes = vec![pixel_cells(rays, shift, |_| random.below(100) >= out)];
        let lengths = rays.map(|n| (n << shift) as i32);
        for _ in 0..random.below(6) {
            let centre = lengths.map(|length| random.within(300..length - 300));
            shapes.push(ball(centre, random.within(2..300)));
        }
        if case % 2 == 0 {
            cavities += Union::new(rays, shift, shapes).check().cavities;
        } else {
            shapes.push(Shape::Not(Box::new(cuboid([64; 3], lengths.map(|length| length - 64)))));
            cavities += Union { exterior: Exterior::In, ..Union::new(rays, shift, shapes) }.check().cavities;
        }
    }
    assert!(cavities > 1000, "{cavities}");
}

#[test]
fn serpentines_are_one_component_open_or_closed() {
    for open in [false, true] {
        let rays = [65, 9, 65];
        let counts = Union::new(rays, 4, vec![pixel_cells(rays, 4, |node| !in_serpentine(node, open))]).check();
        assert_eq!((counts.cavities, counts.filled), (u64::from(!open), 0));
        assert!(counts.open_nodes > 32 * 4 * 60);
    }
}

/// Returns a tunnel with a bend in a block: from its dead end, a gap of every ray, to a mouth that one ray looks into.
fn bent_tunnel(order: [usize; 3]) -> Union {
    let rays = [40; 3];
    let cells = pixel_cells(rays, 4, |node| {
        let [a, b, c] = order.map(|axis| node[axis]);
        let tunnel = (29..35).contains(&a) && b == 5 || (32..35).contains(&a) && b > 5;
        (20..38).contains(&a) && b < 12 && c < 12 && !(tunnel && (4..8).contains(&c))
    });
    Union::new(rays, 4, vec![cells])
}

#[test]
fn contradictory_crossings_are_refused() {
    // The bend lies between two nodes of one row, one plane or two slabs.
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        let union = bent_tunnel(order);
        assert_eq!(union.check().components, 0);
        let spans = Axis::ALL.map(|axis| union.spans(axis)[0].clone());
        // A gap is missing at the dead end, beside the certain outside, and in it. Sets meet anywhere between.
        for a in [29, 31, 33] {
            let mut spans = spans.clone();
            let axis = Axis::ALL[order[2]];
            let mut node = [0; 3];
            (node[order[0]], node[order[1]]) = (a, 5);
            let ray = node[axis.row()] * 40 + node[axis.column()];
            let spans_of_axis = &mut spans[axis.depth()];
            assert_eq!(spans_of_axis.of_ray(ray).len(), 4);
            fill::fill(spans_of_axis, vec![spans_of_axis.offsets[ray as usize] + 1]);
            assert_eq!(spans_of_axis.of_ray(ray).len(), 2);
            let resolved = resolve(&union.grid, spans, Exterior::Out, &union, &|_, _| {});
            let Err(ResolveError::Contradiction { node }) = resolved else { panic!("{order:?} {a}: {resolved:?}") };
            let [at_a, at_b, at_c] = order.map(|axis| node[axis]);
            let expected = if a == 33 { 33..34 } else { 29..33 };
            assert!(expected.contains(&at_a) && at_b == 5 && (4..8).contains(&at_c), "{order:?} {a} {node:?}");
        }
    }
}

#[test]
fn a_single_contradictory_node_is_refused() {
    // The solid is one node at a corner, and its ray along y has all of its crossings behind it.
    let union = Union::new([3; 3], 4, vec![cuboid([0; 3], [16; 3])]);
    let mut spans = Axis::ALL.map(|axis| union.spans(axis)[0].clone());
    assert_eq!(spans[1].of_ray(0).len(), 2);
    for (hit, position) in spans[1].hits.iter_mut().zip([16, 18]) {
        hit.0 = hit.0 & 7 | (position / 2) << 3;
    }
    let resolved = resolve(&union.grid, spans, Exterior::Out, &union, &|_, _| {});
    assert_eq!(resolved, Err(ResolveError::Contradiction { node: [0; 3] }));
}

#[test]
fn nodes_in_a_slit_of_one_lattice_step_are_outside() {
    let grid = Union::new([9; 3], 8, Vec::new()).grid;
    let (node, radius) = (grid.node(4), 500);
    for axis in 0..3 {
        let shapes = [-1, 1].map(|side| {
            let mut twice = [2 * node + 1; 3];
            twice[axis] = 2 * node + side * (2 * radius + 1);
            Shape::Ball(twice, 4 * i64::from(radius).pow(2))
        });
        let union = Union::new([9; 3], 8, shapes.to_vec());
        assert!(!union.contains([node; 3], &mut ()));
        let spans = union.spans(Axis::ALL[axis])[0].clone();
        let gap = &spans.of_ray(4 * 9 + 4)[1..3];
        assert!(gap[0].ceil() >= gap[1].floor(), "{gap:?}");
        assert_eq!(union.check().components, 0);
    }
}

#[test]
fn spans_do_not_depend_on_the_thread_count_and_progress_is_reported() {
    let (mut random, rays) = (Random::new(3), [66, 40, 130]);
    let lengths = rays.map(|n| (n << 6) as i32 - 2);
    let shapes = (0..40).map(|_| random_shape(&mut random, lengths.map(|length| length / 2))).collect();
    let union = Union::new(rays, 6, shapes);
    let spans = Axis::ALL.map(|axis| union.spans(axis)[0].clone());
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let calls = Mutex::new(Vec::new());
        let note = |done, total| calls.lock().unwrap().push((done, total));
        let resolved = pool.install(|| resolve(&union.grid, spans.clone(), Exterior::Out, &union, &note)).unwrap();
        let tests = resolved.counts.components + resolved.counts.gaps_tested;
        let mut calls = calls.into_inner().unwrap();
        assert_eq!(calls[0], (0, tests));
        calls.sort_unstable();
        assert_eq!(calls.last(), Some(&(tests, tests)));
        assert_eq!(calls.len() as u64, 1 + tests.div_ceil(BATCH as u64));
        resolved
    };
    let resolved = on(1);
    assert!(resolved.counts.components > 5 && resolved.counts.gaps_tested > 2 * BATCH as u64, "{:?}", resolved.counts);
    assert_eq!(resolved, on(4));
}

#[test]
fn spans_of_other_rays_are_refused() {
    let union = Union::new([3, 4, 5], 4, Vec::new());
    let spans = Axis::ALL.map(|axis| union.spans(axis)[0].clone());
    let error = |spans| resolve(&union.grid, spans, Exterior::Out, &union, &|_, _| {}).unwrap_err();
    let [x, y, z] = spans.clone();
    let found = Axis::Y;
    assert_eq!(error([y, x, z]), ResolveError::Mismatch { axis: Axis::X, found, rays: 15, expected: 20 });
    let mut short = spans;
    short[2].offsets.pop();
    assert_eq!(error(short), ResolveError::Mismatch { axis: Axis::Z, found: Axis::Z, rays: 11, expected: 12 });
}
