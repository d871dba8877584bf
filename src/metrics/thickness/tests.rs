use std::f64::consts::TAU;

use super::*;
use crate::metrics::distance::Crossings;
use crate::metrics::{Edges, Phase};

/// The thickness of the solid where a function is negative, or of its pores.
fn thickness_of(
    size: [usize; 3],
    edges: Edges,
    phase: Phase,
    function: impl Fn([f64; 3]) -> f64 + Sync,
) -> (NodeSet, DistanceField, Vec<f32>) {
    let (crossings, solid) = Crossings::of_function(size, edges, function);
    let nodes = phase.nodes(&solid, &NodeSet::full(size));
    let field = DistanceField::of(&crossings, edges);
    let thickness = local_thickness(&field, &nodes);
    (nodes, field, thickness)
}

/// Least, mean and greatest of what is above 0.
fn spread(map: &[f32]) -> [f64; 3] {
    let values: Vec<f64> = map.iter().filter(|&&value| value > 0.0).map(|&value| f64::from(value)).collect();
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = values.iter().copied().fold(0.0, f64::max);
    [least, values.iter().sum::<f64>() / values.len() as f64, greatest]
}

/// Leaves the nodes of the inner third: elsewhere a tilted solid is cut so that it has a surface on one side alone.
fn keep_inner(map: &mut [f32], side: usize) {
    for (index, value) in map.iter_mut().enumerate() {
        let node = [index % side, index / side % side, index / side / side];
        if node.iter().any(|i| !(side / 3..side - side / 3).contains(i)) {
            *value = 0.0;
        }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(a: [f64; 3]) -> [f64; 3] {
    a.map(|part| part / dot(a, a).sqrt())
}

#[test]
fn a_slab_is_as_thick_as_it_is() {
    for normal in [[0.0, 0.0, 1.0], unit([1.0, 1.0, 0.0]), unit([1.0, 2.0, 3.0]), unit([5.0, 1.0, 0.3])] {
        for thickness in [2.0, 3.3, 6.7, 13.1] {
            let middle = dot(normal, [20.2, 19.7, 20.4]);
            let (_, _, mut map) =
                thickness_of([40; 3], Edges::Clip, Phase::Solid, |p| (dot(normal, p) - middle).abs() - 0.5 * thickness);
            keep_inner(&mut map, 40);
            let [least, mean, greatest] = spread(&map);
            println!("slab {normal:.2?} {thickness}: {least:.2} {mean:.2} {greatest:.2}");
            assert!((mean - thickness).abs() < 0.5);
            assert!(thickness - least < 1.0 && greatest - thickness < 1.0);
        }
    }
}

#[test]
fn a_ball_is_as_thick_as_its_diameter() {
    for radius in [2.0, 4.0, 8.0, 24.0] {
        let side = 2 * radius as usize + 5;
        let half = (side / 2) as f64;
        for centre in [[half; 3], [half + 0.5; 3], [half + 0.31, half - 0.17, half + 0.44]] {
            let (_, _, map) = thickness_of([side; 3], Edges::Clip, Phase::Solid, |p| {
                let off = [0, 1, 2].map(|i| p[i] - centre[i]);
                dot(off, off).sqrt() - radius
            });
            let [least, mean, greatest] = spread(&map);
            println!(
                "ball R/h {radius}: {:.3} {:.3} {:.3} of 2R, greatest off by {:+.2}",
                least / (2.0 * radius),
                mean / (2.0 * radius),
                greatest / (2.0 * radius),
                greatest - 2.0 * radius
            );
            for value in [least, mean, greatest] {
                assert!((value - 2.0 * radius).abs() < 1.0);
            }
        }
    }
}

#[test]
fn a_rod_is_as_thick_as_its_diameter() {
    for along in [[0.0, 0.0, 1.0], unit([1.0, 1.0, 0.0]), unit([1.0, 2.0, 3.0])] {
        for diameter in [4.0, 8.0, 16.0, 24.0] {
            let (_, _, mut map) = thickness_of([40; 3], Edges::Clip, Phase::Solid, |p| {
                let off = [p[0] - 20.3, p[1] - 19.6, p[2] - 20.1];
                (dot(off, off) - dot(off, along).powi(2)).max(0.0).sqrt() - 0.5 * diameter
            });
            keep_inner(&mut map, 40);
            let [least, mean, greatest] = spread(&map);
            println!("rod {along:.2?} {diameter}: {least:.2} {mean:.2} {greatest:.2}");
            assert!((mean - diameter).abs() < 1.0 && (greatest - diameter).abs() < 1.0);
        }
    }
}

/// Distance to struts of radius r along x, y and z through the corners of cells.
fn struts(p: [f64; 3], cell: f64, radius: f64) -> f64 {
    let off = p.map(|x| x - cell * (x / cell).round());
    let across = |a: f64, b: f64| (a * a + b * b).sqrt();
    across(off[0], off[1]).min(across(off[1], off[2])).min(across(off[2], off[0])) - radius
}

#[test]
fn struts_have_the_thickest_nodes_and_the_widest_pores_that_they_have() {
    for cell in [16, 32, 64] {
        let (size, period) = ([cell; 3], cell as f64);
        let radius = 0.15 * period;
        for shift in [0.0, 0.37] {
            let function = |p: [f64; 3]| struts(p.map(|x| x + shift), period, radius);
            let [.., node] = spread(&thickness_of(size, Edges::Periodic, Phase::Solid, function).2);
            let [.., pore] = spread(&thickness_of(size, Edges::Periodic, Phase::Pore, function).2);
            let of_node = 6f64.sqrt() * radius;
            let of_pore = 2f64.sqrt() * period - 2.0 * radius;
            println!("struts {cell}: node {node:.2} of {of_node:.2}, pore {pore:.2} of {of_pore:.2}");
            assert!((node - of_node).abs() < 1.0 && (pore - of_pore).abs() < 1.0);
        }
    }
}

fn gyroid(p: [f64; 3], cell: f64) -> f64 {
    let [x, y, z] = p.map(|x| x * TAU / cell);
    x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos()
}

#[test]
fn a_gyroid_has_the_largest_pore_that_it_has() {
    for cell in [16, 32, 64] {
        let period = cell as f64;
        for phase in Phase::BOTH {
            let (.., map) = thickness_of([cell; 3], Edges::Periodic, phase, |p| gyroid(p, period));
            let [least, mean, greatest] = spread(&map);
            println!("gyroid {cell}: {:.4} {:.4} {:.4} of L", least / period, mean / period, greatest / period);
            assert!((greatest - 0.459 * period).abs() < 1.0);
        }
    }
}

#[test]
fn thickness_is_at_least_twice_the_distance_and_moves_along() {
    let size = [24, 24, 24];
    for edges in [Edges::Clip, Edges::Border, Edges::Periodic] {
        let at = |shift: [f64; 3]| {
            thickness_of(size, edges, Phase::Pore, move |p| gyroid([0, 1, 2].map(|i| p[i] + shift[i]), 24.0) + 0.1)
        };
        let (nodes, field, map) = at([0.0; 3]);
        for (index, &value) in map.iter().enumerate() {
            let node = [index % 24, index / 24 % 24, index / 576];
            assert!(value >= 2.0 * field.values()[index] * f32::from(u8::from(nodes.contains(node))));
            assert_eq!(value > 0.0, nodes.contains(node), "{edges:?} {node:?}: {value} at {}", field.values()[index]);
        }
        if edges == Edges::Periodic {
            let (.., moved) = at([5.0, 0.0, 7.0]);
            let worst = (0..map.len()).map(|index| {
                let [x, y, z] = [index % 24, index / 24 % 24, index / 576];
                (moved[index] - map[((z + 7) % 24 * 24 + y) * 24 + (x + 5) % 24]).abs()
            });
            let worst = worst.fold(0.0, f32::max);
            println!("moved by whole nodes: {worst:.3}");
            assert!(worst < 0.6);
        }
    }
}

/// At each node the greatest diameter of a ball of the field around any node of the phase that holds it.
fn of_all_balls(field: &DistanceField, nodes: &NodeSet) -> Vec<f32> {
    let [columns, rows, planes] = field.size();
    let at = |index: usize| [index % columns, index / columns % rows, index / columns / rows];
    let mut map = vec![0.0f32; columns * rows * planes];
    for (index, &radius) in field.values().iter().enumerate().filter(|(index, _)| nodes.contains(at(*index))) {
        for (other, value) in map.iter_mut().enumerate().filter(|(other, _)| nodes.contains(at(*other))) {
            let off: usize = (0..3).map(|i| at(index)[i].abs_diff(at(other)[i]).pow(2)).sum();
            if off as f32 <= radius * radius {
                *value = value.max(2.0 * radius);
            }
        }
    }
    map
}

#[test]
fn thickness_lies_between_what_coarse_and_what_fine_nodes_have() {
    // Bumps of random places and sizes, rough but no less than a few pitches wide.
    let mut state = 7u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / f64::from(1 << 24)
    };
    for share in [0.35, 0.5] {
        let bumps: Vec<[f64; 4]> =
            (0..12).map(|_| [16.0 * next(), 16.0 * next(), 16.0 * next(), 3.0 + 3.0 * next()]).collect();
        let function = |p: [f64; 3]| {
            let heights =
                bumps.iter().map(|b| (-(0..3).map(|i| (p[i] - b[i]).powi(2)).sum::<f64>() / (b[3] * b[3])).exp());
            share - heights.sum::<f64>()
        };
        for phase in Phase::BOTH {
            let (nodes, field, map) = thickness_of([16; 3], Edges::Clip, phase, function);
            let coarse = of_all_balls(&field, &nodes);
            let finer = 3usize;
            let (fine_nodes, fine_field, _) =
                thickness_of([16 * finer; 3], Edges::Clip, phase, |p| function(p.map(|x| x / finer as f64)));
            let fine = of_all_balls(&fine_field, &fine_nodes);
            let (mut below, mut above, mut sum, mut count) = (0.0f32, 0.0f32, 0.0, 0.0);
            for (index, &value) in map.iter().enumerate().filter(|(_, value)| **value > 0.0) {
                let [x, y, z] = [index % 16, index / 16 % 16, index / 256].map(|i| i * finer);
                let of_fine = fine[(z * 16 * finer + y) * 16 * finer + x] / finer as f32;
                below = below.max(coarse[index] - value);
                above = above.max(value - of_fine);
                sum += f64::from(value - of_fine);
                count += 1.0;
            }
            let mean = sum / count;
            println!("{share} {phase:?}: below coarse by {below:.2}, above fine by {above:.2}, mean off by {mean:+.3}");
            assert!(below < 0.51 && mean.abs() < 0.5);
        }
    }
}

#[test]
fn threads_do_not_change_a_map() {
    let of = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| thickness_of([32; 3], Edges::Periodic, Phase::Solid, |p| gyroid(p, 16.0)).2)
    };
    assert_eq!(of(1), of(3));
}
