//! Compares spans resolved by a flood on the device with those resolved by the CPU's disjoint sets.

use std::collections::HashSet;
use std::fmt::Display;

use ldi_ops::fixed::{Hit, TriangleHit};
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::minkowski::resolve::gpu::{GpuResolveError, GpuResolver, Reached};
use ldi_ops::minkowski::{
    Exterior, Membership, Primitives, RaySpans, ResolveCounts, ResolveError, ResolvedSpans, resolve,
};
use ldi_ops::sampler::cpu::CpuSampler;

use crate::lattice::frame;
use crate::on_lattice::grid;
use crate::soups::{self, Frame, Soup};
use crate::testing::images::in_serpentine;
use crate::testing::random::Random;
use crate::twin::{self, Twin};

type Spans = [RaySpans<TriangleHit>; 3];

/// A membership test by the digits of the point alone: if the backends test different points, their results differ.
struct AnyAnswer;

impl Membership for AnyAnswer {
    type Memory = ();

    fn contains(&self, point: [i32; 3], (): &mut ()) -> bool {
        let mut random = Random::new(point.iter().fold(7, |all, &position| all << 21 ^ all >> 5 ^ position as u64));
        random.chance(2)
    }
}

fn spans(soup: &Soup, grid: &Grid, exterior: Exterior) -> Spans {
    let primitives = Primitives { positions: soup.positions.clone(), triangles: soup.triangles.clone() };
    Axis::ALL.map(|axis| primitives.spans(grid, axis, exterior, &CpuSampler::default()).unwrap().0)
}

fn twin() -> &'static Twin {
    &twin::plain()[0]
}

fn by_gpu(spans: &Spans, grid: &Grid, exterior: Exterior) -> Result<ResolvedSpans<TriangleHit>, GpuResolveError> {
    let resolver = GpuResolver::prefilled(twin().gpu.device(), 0xa5a5_a5a5);
    // A second run with buffers that have been used.
    let first = resolver.resolve(grid, spans.clone(), exterior, &AnyAnswer, &|_, _| {});
    assert_eq!(resolver.resolve(grid, spans.clone(), exterior, &AnyAnswer, &|_, _| {}), first);
    first
}

/// Compares the resolved spans, and the nodes that the flood reaches with those of a search from node to node.
fn compare(what: impl Display, spans: &Spans, grid: &Grid, exterior: Exterior) -> Result<ResolveCounts, ResolveError> {
    let expected = resolve(grid, spans.clone(), exterior, &AnyAnswer, &|_, _| {});
    let found = by_gpu(spans, grid, exterior);
    let reached = GpuResolver::new(twin().gpu.device()).reached(grid, spans, exterior).unwrap();
    match (found, expected) {
        (Ok(found), Ok(expected)) => {
            assert_eq!(found.counts, expected.counts, "{what}");
            assert!(found.spans == expected.spans, "{what}: other spans");
            compare_nodes(&what, spans, grid, exterior, &reached.unwrap());
            Ok(found.counts)
        }
        (found, Err(error)) => {
            assert_eq!(found.err(), Some(GpuResolveError::Resolve(error)), "{what}");
            assert_eq!(reached, None, "{what}");
            Err(error)
        }
        (Err(error), Ok(_)) => panic!("{what}: {error}"),
    }
}

/// Returns for each node of a ray whether it is in, whether it is beyond all crossings, and whether there is a crossing before.
fn on_ray(hits: &[TriangleHit], grid: &Grid, nodes: u32, exterior: Exterior) -> Vec<[bool; 3]> {
    let before = |node: u32| hits.iter().filter(|hit| hit.crossing().nearest() < grid.node(node)).count();
    let state = |node: u32| {
        let count = before(node);
        let beyond = exterior == Exterior::Out && (count == 0 || count == hits.len());
        [(count % 2 == 1) == (exterior == Exterior::Out), beyond, node > 0 && count > before(node - 1)]
    };
    (0..nodes).map(state).collect()
}

fn compare_nodes(what: &impl Display, spans: &Spans, grid: &Grid, exterior: Exterior, reached: &Reached) {
    let [nx, ny, nz] = grid.rays().map(|nodes| nodes as usize);
    let index = |[x, y, z]: [usize; 3]| (z * ny + y) * nx + x;
    let (mut inside, mut outside) = (vec![false; nx * ny * nz], vec![false; nx * ny * nz]);
    let mut walls = vec![[false; 3]; nx * ny * nz];
    for (axis, spans) in Axis::ALL.into_iter().zip(spans) {
        let (columns, rows) = grid.image_size(axis);
        for ray in 0..columns * rows {
            let states = on_ray(spans.of_ray(ray), grid, grid.rays()[axis.depth()], exterior);
            for (at, [is_in, is_beyond, is_parted]) in states.into_iter().enumerate() {
                let mut node = [0; 3];
                (node[axis.column()], node[axis.row()]) = ((ray % columns) as usize, (ray / columns) as usize);
                node[axis.depth()] = at;
                inside[index(node)] |= is_in;
                outside[index(node)] |= is_beyond;
                walls[index(node)][axis.depth()] = is_parted;
            }
        }
    }
    let open = inside.iter().zip(&outside).filter(|(inside, outside)| !(**inside | **outside)).count();
    assert_eq!(reached.open_nodes, open as u64, "{what}");
    let nodes = || (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
    for state in [&mut inside, &mut outside] {
        let mut to_visit: Vec<[usize; 3]> = nodes().filter(|&node| state[index(node)]).collect();
        while let Some(node) = to_visit.pop() {
            for axis in 0..3 {
                let (mut before, mut after) = (node, node);
                before[axis] = node[axis].wrapping_sub(1);
                after[axis] += 1;
                let mut go = |to: [usize; 3], wall: [usize; 3]| {
                    if !walls[index(wall)][axis] && !std::mem::replace(&mut state[index(to)], true) {
                        to_visit.push(to);
                    }
                };
                if node[axis] > 0 {
                    go(before, node);
                }
                if after[axis] < [nx, ny, nz][axis] {
                    go(after, after);
                }
            }
        }
    }
    let words = nx.div_ceil(64);
    for [x, y, z] in nodes() {
        let (word, bit) = ((z * ny + y) * words + x / 64, x % 64);
        let found = [&reached.inside, &reached.outside].map(|bits| bits[word] >> bit & 1 == 1);
        let at = index([x, y, z]);
        assert_eq!(found, [inside[at], outside[at]], "{what}: node {x}, {y}, {z}");
    }
    let is_padded = |at: usize| (at + 1).is_multiple_of(words) && !nx.is_multiple_of(64);
    for at in (0..words * ny * nz).filter(|&at| is_padded(at)) {
        assert_eq!([reached.inside[at] >> (nx % 64), !reached.outside[at] >> (nx % 64)], [0, 0], "{what}: padding");
    }
}

/// Returns the surface of the nodes for which `is_full`; each is a pixel-sized cell about its node.
fn cells(frame: &Frame, mut is_full: impl FnMut([u32; 3]) -> bool) -> Soup {
    let [nx, ny, nz] = frame.rays;
    let nodes = || (0..nz).flat_map(move |z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
    let full: HashSet<[u32; 3]> = nodes().filter(|&node| is_full(node)).collect();
    let mut soup = Soup::default();
    for node in nodes().filter(|node| full.contains(node)) {
        for (axis, side) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
            let mut beside = node;
            beside[axis] = (node[axis] + 2 * side).wrapping_sub(1);
            if full.contains(&beside) {
                continue;
            }
            let corner = |u: u32, v: u32| {
                let mut corner = node;
                corner[axis] += side;
                corner[(axis + 1) % 3] += u;
                corner[(axis + 2) % 3] += v;
                corner.map(|index| (index as i32) << frame.shift)
            };
            let first = soup.positions.len() as u32;
            let [one, other] = if side == 1 { [1, 3] } else { [3, 1] };
            soup.positions.extend([corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]);
            soup.triangles.push([first, first + one, first + 2]);
            soup.triangles.push([first, first + 2, first + other]);
        }
    }
    soup
}

#[test]
fn heaps_of_soups_resolve_to_equal_spans() {
    let mut sums = ResolveCounts::default();
    for (name, generator) in soups::oriented() {
        for seed in 400..404 {
            let mut random = Random::new(seed);
            let frame = frame(&mut random);
            let mut soup = Soup::default();
            (0..random.between(1, 5)).for_each(|_| soup.add(&generator(&mut random, &frame)));
            let grid = grid(&frame, 64);
            let exterior = if seed % 4 == 3 { Exterior::In } else { Exterior::Out };
            if exterior == Exterior::In {
                soup = soup.inverted();
            }
            let spans = spans(&soup, &grid, exterior);
            if let Ok(counts) = compare(format_args!("{name}, seed {seed}"), &spans, &grid, exterior) {
                sums.gaps += counts.gaps;
                sums.gaps_tested += counts.gaps_tested;
                sums.gaps_out += counts.gaps_out;
                sums.open_nodes += counts.open_nodes;
            }
        }
    }
    assert!(sums.gaps > 1000 && sums.gaps_tested > 100 && sums.gaps_out > 100 && sums.open_nodes > 100, "{sums:?}");
}

#[test]
fn mazes_resolve_to_equal_spans() {
    let mut random = Random::new(5);
    let (mut components, mut cavities) = (0, 0);
    // Rows of less than a word, of a word, of more; of a host's word and of more.
    for (case, columns) in [5, 31, 32, 33, 63, 64, 65, 96, 130].into_iter().enumerate() {
        for exterior in [Exterior::Out, Exterior::In] {
            let frame = Frame { shift: 4, rays: [columns, random.between(2, 9) as u32, random.between(2, 9) as u32] };
            let out = [20, 32, 45, 60][case % 4];
            let mut soup = cells(&frame, |_| random.below(100) >= out);
            if exterior == Exterior::In {
                // The full nodes become room, and all other nodes are solid.
                soup = soup.inverted();
            }
            let grid = grid(&frame, 64);
            let spans = spans(&soup, &grid, exterior);
            if let Ok(counts) =
                compare(format_args!("{:?}, {out} % out, {exterior:?}", frame.rays), &spans, &grid, exterior)
            {
                components += counts.components;
                cavities += counts.cavities;
            }
        }
    }
    assert!(components > 100 && cavities > 50 && cavities < components, "{components} components, {cavities} cavities");
}

#[test]
fn floods_reach_the_end_of_a_long_tunnel() {
    for open in [false, true] {
        let frame = Frame { shift: 3, rays: [65, 9, 65] };
        let soup = cells(&frame, |node| !in_serpentine(node, open));
        let grid = grid(&frame, 64);
        let counts = compare("a serpentine", &spans(&soup, &grid, Exterior::Out), &grid, Exterior::Out).unwrap();
        assert!(counts.open_nodes > 32 * 4 * 60 && counts.components == u64::from(!open), "{counts:?}");
    }
}

#[test]
fn contradictory_spans_give_equal_errors() {
    let frame = Frame { shift: 4, rays: [40, 6, 5] };
    let grid = grid(&frame, 64);
    let soup = soups::cuboid([20; 3], [500, 80, 70]);
    let whole = spans(&soup, &grid, Exterior::Out);
    let mut contradicted = 0;
    for axis in 0..3 {
        // One axis has an empty image, or that of another cuboid.
        for other in [Soup::default(), soups::cuboid([30; 3], [300, 60, 50])] {
            let mut spans = whole.clone();
            spans[axis] = self::spans(&other, &grid, Exterior::Out)[axis].clone();
            contradicted += usize::from(compare(format_args!("axis {axis}"), &spans, &grid, Exterior::Out).is_err());
        }
    }
    assert!(contradicted > 2, "{contradicted}");
    let mut swapped = whole;
    swapped.swap(0, 1);
    let found = GpuResolver::new(twin().gpu.device()).reached(&grid, &swapped, Exterior::Out);
    assert!(matches!(found, Err(GpuResolveError::Resolve(ResolveError::Mismatch { .. }))), "{found:?}");
}

#[test]
fn empty_spans_resolve_to_no_components() {
    let frame = Frame { shift: 4, rays: [3, 1, 4] };
    let grid = grid(&frame, 64);
    for exterior in [Exterior::Out, Exterior::In] {
        let counts = compare("nothing", &spans(&Soup::default(), &grid, exterior), &grid, exterior).unwrap();
        assert_eq!(counts, ResolveCounts::default());
    }
}
