//! Thickness compared with closed forms.

use std::f64::consts::TAU;

use super::*;
use crate::metrics::distance::Crossings;
use crate::metrics::{BoundaryCondition, Phase};

/// Returns the thickness of the solid where a function is negative, or of its pores.
fn thickness_of(
    size: [usize; 3],
    edges: BoundaryCondition,
    phase: Phase,
    function: impl Fn([f64; 3]) -> f64 + Sync,
) -> (NodeSet, DistanceField, Vec<f32>) {
    let (crossings, solid) = Crossings::of_function(size, edges, function);
    let nodes = phase.nodes(&solid, &NodeSet::full(size));
    let field = DistanceField::of(&crossings, edges);
    let thickness = local_thickness(&field, &nodes);
    (nodes, field, thickness)
}

/// Returns least, mean and greatest of the values above 0.
fn spread(map: &[f32]) -> [f64; 3] {
    let values: Vec<f64> = map.iter().filter(|&&value| value > 0.0).map(|&value| f64::from(value)).collect();
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = values.iter().copied().fold(0.0, f64::max);
    [least, values.iter().sum::<f64>() / values.len() as f64, greatest]
}

/// Keeps the nodes of the inner third: elsewhere a tilted solid is cut so that it has a surface on one side alone.
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
fn slabs_have_their_thickness() {
    for normal in [[0.0, 0.0, 1.0], unit([1.0, 1.0, 0.0]), unit([1.0, 2.0, 3.0]), unit([5.0, 1.0, 0.3])] {
        for thickness in [2.0, 3.3, 6.7, 13.1] {
            let middle = dot(normal, [20.2, 19.7, 20.4]);
            let (_, _, mut map) = thickness_of([40; 3], BoundaryCondition::Clip, Phase::Solid, |p| {
                (dot(normal, p) - middle).abs() - 0.5 * thickness
            });
            keep_inner(&mut map, 40);
            let [least, mean, greatest] = spread(&map);
            println!("slab {normal:.2?} {thickness}: {least:.2} {mean:.2} {greatest:.2}");
            assert!((mean - thickness).abs() < 0.5);
            assert!(thickness - least < 1.0 && greatest - thickness < 1.0);
        }
    }
}

#[test]
fn every_node_of_a_thick_slab_has_the_full_thickness() {
    for normal in [unit([1.0, 2.0, 3.0]), unit([5.0, 1.0, 0.3]), unit([3.0, 3.0, 1.0]), unit([1.0, 0.02, 0.0])] {
        let middle = dot(normal, [24.2, 23.7, 24.4]);
        let function = |p: [f64; 3]| (dot(normal, p) - middle).abs() - 10.0;
        let (crossings, solid) = Crossings::of_function([48; 3], BoundaryCondition::Clip, function);
        // For the surface itself, and for the rough one of its voxels.
        for (crossings, tolerance) in [(crossings, 1.0), (Crossings::of_nodes(&solid, BoundaryCondition::Clip), 2.0)] {
            let mut map = local_thickness(&DistanceField::of(&crossings, BoundaryCondition::Clip), &solid);
            keep_inner(&mut map, 48);
            let [least, mean, _] = spread(&map);
            println!("thick slab {normal:.2?}: {least:.2} {mean:.2}");
            assert!(least > 20.0 - tolerance);
        }
    }
}

#[test]
fn a_ball_is_as_thick_as_its_diameter() {
    for radius in [2.0, 4.0, 8.0, 24.0] {
        let side = 2 * radius as usize + 5;
        let half = (side / 2) as f64;
        for centre in [[half; 3], [half + 0.5; 3], [half + 0.31, half - 0.17, half + 0.44]] {
            let (_, _, map) = thickness_of([side; 3], BoundaryCondition::Clip, Phase::Solid, |p| {
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
            let (_, _, mut map) = thickness_of([40; 3], BoundaryCondition::Clip, Phase::Solid, |p| {
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

/// Returns the distance to struts of radius r along x, y and z through the corners of cells.
fn struts(p: [f64; 3], cell: f64, radius: f64) -> f64 {
    let off = p.map(|x| x - cell * (x / cell).round());
    let across = |a: f64, b: f64| (a * a + b * b).sqrt();
    across(off[0], off[1]).min(across(off[1], off[2])).min(across(off[2], off[0])) - radius
}

#[test]
fn struts_have_their_closed_form_node_and_pore_sizes() {
    for cell in [16, 32, 64] {
        let (size, period) = ([cell; 3], cell as f64);
        let radius = 0.15 * period;
        for shift in [0.0, 0.37] {
            let function = |p: [f64; 3]| struts(p.map(|x| x + shift), period, radius);
            let [.., node] = spread(&thickness_of(size, BoundaryCondition::Periodic, Phase::Solid, function).2);
            let [.., pore] = spread(&thickness_of(size, BoundaryCondition::Periodic, Phase::Pore, function).2);
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
fn a_gyroid_has_its_known_largest_pore() {
    for cell in [16, 32, 64] {
        let period = cell as f64;
        for phase in Phase::BOTH {
            let (.., map) = thickness_of([cell; 3], BoundaryCondition::Periodic, phase, |p| gyroid(p, period));
            let [least, mean, greatest] = spread(&map);
            println!("gyroid {cell}: {:.4} {:.4} {:.4} of L", least / period, mean / period, greatest / period);
            assert!((greatest - 0.459 * period).abs() < 1.0);
        }
    }
}

#[test]
fn thickness_is_at_least_twice_the_distance_and_shifts_with_the_solid() {
    let size = [24, 24, 24];
    for edges in [BoundaryCondition::Clip, BoundaryCondition::Border, BoundaryCondition::Periodic] {
        let at = |shift: [f64; 3]| {
            thickness_of(size, edges, Phase::Pore, move |p| gyroid([0, 1, 2].map(|i| p[i] + shift[i]), 24.0) + 0.1)
        };
        let (nodes, field, map) = at([0.0; 3]);
        for (index, &value) in map.iter().enumerate() {
            let node = [index % 24, index / 24 % 24, index / 576];
            assert!(value >= 2.0 * field.values()[index] * f32::from(u8::from(nodes.contains(node))));
            assert_eq!(value > 0.0, nodes.contains(node), "{edges:?} {node:?}: {value} at {}", field.values()[index]);
        }
        if edges == BoundaryCondition::Periodic {
            let (.., moved) = at([5.0, 0.0, 7.0]);
            let differences = (0..map.len()).map(|index| {
                let [x, y, z] = [index % 24, index / 24 % 24, index / 576];
                (moved[index] - map[((z + 7) % 24 * 24 + y) * 24 + (x + 5) % 24]).abs()
            });
            let differences: Vec<f32> = differences.collect();
            let worst = differences.iter().copied().fold(0.0, f32::max);
            let mean = differences.iter().sum::<f32>() / nodes.count() as f32;
            println!("moved by whole nodes: {mean:.4} on average, {worst:.3} at worst");
            assert!(mean < 0.02 && worst < 2.0);
        }
    }
}

#[test]
fn thickness_maps_do_not_depend_on_the_thread_count() {
    let of = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| thickness_of([32; 3], BoundaryCondition::Periodic, Phase::Solid, |p| gyroid(p, 16.0)).2)
    };
    assert_eq!(of(1), of(3));
}

#[test]
fn balls_between_walls_are_those_of_a_field_with_walls() {
    let size = [34, 27, 30];
    let functions: [fn([f64; 3]) -> f64; 4] = [
        |[x, y, z]| {
            0.4 - ((0.5 * x).sin() * (0.5 * y).cos()
                + (0.5 * y).sin() * (0.5 * z).cos()
                + (0.5 * z).sin() * (0.5 * x).cos())
        },
        // A slab that two faces of the raster cut.
        |[x, y, _]| (x + 0.3 * y - 18.2).abs() - 4.4,
        // A ball beside a face, and one within.
        |p| {
            (dot(p, p).sqrt() - 9.3)
                .min(((p[0] - 22.0).powi(2) + (p[1] - 13.0).powi(2) + (p[2] - 16.0).powi(2)).sqrt() - 6.1)
        },
        // No pores.
        |_| -1.0,
    ];
    let mut kept = 0;
    for function in functions {
        let solid = Crossings::of_function(size, BoundaryCondition::Clip, function).1;
        let with = |edges| DistanceField::of(&Crossings::of_nodes(&solid, edges), edges);
        for phase in Phase::BOTH {
            let nodes = phase.nodes(&solid, &NodeSet::full(size));
            let field = with(BoundaryCondition::Clip);
            let free = largest_balls(&field, &nodes);
            let field = field.between(solid.walls());
            let found = largest_balls_between(&field, &nodes, &free);
            assert_eq!(found, largest_balls(&with(BoundaryCondition::Border), &nodes));
            kept += found.iter().filter(|ball| free.contains(ball)).count();
        }
    }
    assert!(kept > 100, "{kept} balls remain");
}
