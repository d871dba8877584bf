//! Access and percolation, compared with definitions evaluated node by node and with closed forms.

use super::*;
use crate::grid::Axis;
use crate::metrics::components::{open_pores, rim};
use crate::metrics::distance::{Crossings, DistanceField};
use crate::metrics::thickness::{largest_balls, radii};
use crate::metrics::{BoundaryCondition, NodeSet, Phase, Region};
use crate::solids;
use crate::testing::images::{closed, grid_around, surface_images};

fn radii_at_nodes(side: usize, distance: impl Fn([f64; 3]) -> f64) -> Vec<f32> {
    let node = |index| steps::place([side; 3], index).map(|i| i as f64 + 0.5);
    (0..side.pow(3) as u32).map(|index| distance(node(index)).max(0.0) as f32).collect()
}

fn nodes_of(side: usize, radii: &[f32]) -> NodeSet {
    NodeSet::from_fn([side; 3], |[x, y, z]| radii[(z * side + y) * side + x] > 0.0)
}

/// Returns the distance to the struts of a cubic lattice along the edges of cells, in the units of the arguments.
fn to_struts(period: f64, radius: f64) -> impl Fn([f64; 3]) -> f64 {
    move |place| {
        let [x, y, z] = place.map(|c| c - (c / period).round() * period);
        (y.hypot(z)).min(x.hypot(z)).min(x.hypot(y)) - radius
    }
}

/// Returns the percolation of a box along an axis, computed from crossings.
fn spans(side: usize, edges: BoundaryCondition, axis: Axis, solid: impl Fn([f64; 3]) -> f64 + Sync) -> Percolation {
    let (crossings, solid) = Crossings::of_function([side; 3], edges, solid);
    let pores = Phase::Pore.nodes(&solid, &NodeSet::full([side; 3]));
    let field = DistanceField::of(&crossings, edges);
    let radii = radii(field.values().to_vec(), &pores, &largest_balls(&field, &pores));
    percolation(&radii, &pores, &Ends::of_raster([side; 3], axis), edges).expect("what spans the box")
}

#[test]
fn struts_percolate_at_the_width_of_their_windows() {
    for side in [16, 32, 64] {
        let (period, radius) = (side as f64, 0.15 * side as f64);
        let exact = period - 2.0 * radius;
        // Struts in the edges of the box, so that windows are in its faces, and elsewhere.
        for shift in [0.5, 0.5 + 0.37 * period] {
            let solid = |p: [f64; 3]| to_struts(period, radius)(p.map(|c| c + shift));
            let found = spans(side, BoundaryCondition::Periodic, Axis::Y, solid);
            println!("{side}, {shift:.2}: {:.3}, exactly {exact:.3}, at {:?}", found.diameter, found.node);
            assert!((found.diameter - exact).abs() <= 1.0, "{found:?} for {exact}");
            // The window lies half way between two struts across the other axes, and in the plane of those along them.
            let off = found.node.map(|c| (c as f64 + shift) / period);
            let from = |axis: usize, place: f64| (off[axis] - place - (off[axis] - place).round()).abs() * period;
            assert!(from(0, 0.5) < 2.0 && from(2, 0.5) < 2.0 && from(1, 0.0) < 2.0, "{found:?}, {off:?}");
        }
        let clipped = spans(side, BoundaryCondition::Clip, Axis::Z, |p| to_struts(period, radius)(p.map(|c| c + 0.5)));
        assert!((clipped.diameter - exact).abs() <= 1.0, "{clipped:?} for {exact}");
    }
}

/// Radii are computed as if there were nothing beyond the lateral faces; with a border, they are walls.
#[test]
fn a_border_limits_the_radii_at_the_sides() {
    let side = 24;
    let free = vec![100.0; side * side * side];
    let nodes = NodeSet::full([side; 3]);
    for (edges, exact) in [(BoundaryCondition::Border, 24.0), (BoundaryCondition::Clip, 200.0)] {
        let found = percolation(&free, &nodes, &Ends::of_raster([side; 3], Axis::Y), edges).unwrap();
        assert_eq!(found.diameter, exact);
    }
    // A wall half way across leaves a gap of 12 pitches on one side.
    let radii = radii_at_nodes(side, |[x, ..]| 12.0 - x);
    let nodes = nodes_of(side, &radii);
    let ends = Ends::of_raster([side; 3], Axis::Z);
    let found = percolation(&radii, &nodes, &ends, BoundaryCondition::Border).unwrap();
    assert!((found.diameter - 12.0).abs() <= 1.0, "{found:?}");
    assert_eq!(percolation(&radii, &nodes, &Ends::of_raster([side; 3], Axis::X), BoundaryCondition::Border), None);
}

/// The channels of a gyroid are narrowest where three of them meet, at L/8 · (1, 1, 1) and equivalent points: from there the
/// distance to the surface at (0, 0, 0) is √3/8 L. Half way between two such points it is 0.2297 L, which is the largest pore.
#[test]
fn a_gyroid_percolates_at_the_width_where_its_channels_meet() {
    for side in [16, 32, 64] {
        let period = side as f64;
        let exact = 3.0f64.sqrt() / 4.0 * period;
        for edges in [BoundaryCondition::Periodic, BoundaryCondition::Clip] {
            let found = spans(side, edges, Axis::X, |p| {
                let [(sx, cx), (sy, cy), (sz, cz)] = p.map(|c| (std::f64::consts::TAU * (c + 0.5) / period).sin_cos());
                sx * cy + sy * cz + sz * cx
            });
            println!("{side}, {edges:?}: {:.4} L, exactly {:.4} L", found.diameter / period, exact / period);
            // With Clip, surface beyond the box is ignored.
            if edges == BoundaryCondition::Periodic {
                assert!(
                    (found.diameter - exact).abs() <= 1.0 && (found.diameter / exact - 1.0).abs() < 1.0 / period,
                    "{found:?}"
                );
            }
        }
    }
}

/// A box is as wide as the walls around the axis allow, however near its ends; what is narrower than it decides otherwise.
#[test]
fn walls_around_the_axis_limit_a_ball_that_spans_a_box() {
    let size = [24, 16, 30];
    let nodes = NodeSet::full(size);
    let bounds = [[-0.5; 3], size.map(|side| side as f64 - 0.5)];
    let to_faces =
        |node: [usize; 3]| (0..3).map(move |a| (node[a] as f32 + 0.5).min(size[a] as f32 - 0.5 - node[a] as f32));
    let within = |most: f32| -> Vec<f32> {
        (0..nodes.volume() as u32).map(|node| to_faces(steps::place(size, node)).fold(most, f32::min)).collect()
    };
    // Balls of the whole width, narrower ones everywhere, and balls of 5 beside which those within have 3.
    let of_walls = [15.0, 23.0, 15.0];
    for (free, most, diameters) in [(100.0, 100.0, of_walls), (5.0, 5.0, [10.0; 3]), (5.0, 3.0, [6.0; 3])] {
        let (free, within) = (vec![free; nodes.volume()], within(most));
        for (axis, exact) in Axis::ALL.into_iter().zip(diameters) {
            let ends = Ends::of_raster(size, axis);
            let found = percolation_between_walls(&free, &within, &nodes, &ends, bounds).unwrap();
            assert_eq!(found.diameter, exact, "{most} along {axis:?}");
        }
    }
}

/// Compares the flood with the definition, by passes over all nodes until nothing changes: in a maze, in rooms and in the open, with
/// many equal radii.
#[test]
fn bottlenecks_agree_with_brute_force() {
    let maze = |[x, y, z]: [usize; 3]| (x * 5 + y * 3 + z * 7 + x * y * z) % 7 < 4;
    let rooms = |[x, y, z]: [usize; 3]| (x % 37 != 20 || y % 5 == 2) && (y != 6 || z < 3) && z * 8 + y != 41;
    agree_with_brute_force([13, 9, 11], NodeSet::from_fn([13, 9, 11], maze), 1009);
    for levels in [3, 1009] {
        agree_with_brute_force([75, 11, 9], NodeSet::from_fn([75, 11, 9], rooms), levels);
    }
    for size in [[66, 2, 7], [10, 3, 3], [72, 5, 4], [128, 4, 3], [64, 3, 3], [75, 1, 1], [75, 1, 6], [75, 6, 1]] {
        agree_with_brute_force(size, NodeSet::full(size), 5);
    }
}

fn agree_with_brute_force(size: [usize; 3], nodes: NodeSet, levels: usize) {
    let scattered = |i: usize| (i * 7919 % 10_007 % levels + 1) as f32 / 100.0;
    let radii: Vec<f32> = (0..nodes.volume())
        .map(|i| if nodes.contains(steps::place(size, i as u32)) { scattered(i) } else { 0.0 })
        .collect();
    let outside = rim(&NodeSet::full(size));
    for edges in [BoundaryCondition::Clip, BoundaryCondition::Periodic] {
        let steps = steps::Steps::new(&nodes, edges);
        let start = |i: usize| if outside.contains(steps.place(i as u32)) { radii[i] } else { 0.0 };
        let mut wide: Vec<f32> = (0..radii.len()).map(start).collect();
        loop {
            let next: Vec<f32> = (0..radii.len())
                .map(|i| {
                    let node = steps.place(i as u32);
                    if radii[i] == 0.0 {
                        return 0.0;
                    }
                    let around =
                        steps::bits(steps.from(node)).map(|bit| wide[steps.index(steps.neighbour(node, bit)) as usize]);
                    around.fold(wide[i], |best, way| best.max(way.min(radii[i])))
                })
                .collect();
            if next == wide {
                break;
            }
            wide = next;
        }
        let found = bottlenecks(&radii, &nodes, &outside, edges);
        assert_eq!(wide, found, "{edges:?}");
        let widest = Axis::ALL.map(|axis| percolation(&radii, &nodes, &Ends::of_raster(size, axis), edges));
        for (axis, found) in Axis::ALL.into_iter().zip(widest) {
            let far = size[axis.depth()] - 1;
            let near = NodeSet::from_fn(size, |node| node[axis.depth()] == 0);
            // Without wrapping it is the bottleneck of the far end.
            if edges == BoundaryCondition::Clip {
                let ways = bottlenecks(&radii, &nodes, &near, edges);
                let there = |i: &usize| steps::place(size, *i as u32)[axis.depth()] == far;
                let exact = 2.0 * (0..ways.len()).filter(there).map(|i| ways[i]).fold(0.0, f32::max);
                let found = found.map_or(0.0, |found| found.diameter);
                assert!((0.0..1.0 / 32.0).contains(&(f64::from(exact) - found)), "{found} for {exact}");
            }
        }
    }
}

/// A round cavity of radius 12 behind a neck, and another that is closed, in a cube of 64.
#[test]
fn access_to_a_bottle_ends_at_the_width_of_its_neck() {
    let side = 64;
    let neck = 4.5;
    let ball = |centre: [f64; 3], radius: f64| {
        move |p: [f64; 3]| radius - (0..3).map(|a| (p[a] - centre[a]).powi(2)).sum::<f64>().sqrt()
    };
    let bottle = ball([20.5, 20.5, 24.0], 12.0);
    let closed = ball([46.0, 44.0, 40.0], 10.0);
    let tube = |[x, y, z]: [f64; 3]| if z > 24.0 { neck - (x - 20.5).hypot(y - 20.5) } else { f64::NEG_INFINITY };
    let radii = radii_at_nodes(side, |p| bottle(p).max(tube(p)).max(closed(p)));
    let pores = nodes_of(side, &radii);
    let full = NodeSet::full([side; 3]);
    let open = open_pores(&pores, &full, BoundaryCondition::Clip);
    let ways = bottlenecks(&radii, &open, &rim(&full), BoundaryCondition::Clip);
    assert!((0..side.pow(3) as u32).all(|i| (ways[i as usize] > 0.0) == open.contains(steps::place([side; 3], i))));
    let sizes = painted(side, &ways);
    let curve = AccessCurve::of(&sizes, &open, &pores, 0.1).unwrap();

    let in_closed = pores.count() - open.count();
    assert!((in_closed as f64 / (4.0 / 3.0 * std::f64::consts::PI * 1000.0) - 1.0).abs() < 0.02, "{in_closed}");
    assert_eq!(curve.open_share(), open.count() as f64 / pores.count() as f64);
    assert!((0..side.pow(3) as u32).all(|i| sizes[i as usize] == 0.0 || open.contains(steps::place([side; 3], i))));
    let points: Vec<(f64, f64)> = curve.points().collect();
    assert!(points.windows(2).all(|pair| pair[0].0 < pair[1].0 && pair[0].1 >= pair[1].1), "not monotone");
    let at = |d: f64| curve.share(0.1 * d);
    println!(
        "open {:.4}; A at the neck's width −1, +0.01: {:.4}, {:.4}",
        at(0.0),
        at(2.0 * neck - 1.0),
        at(2.0 * neck + 0.01)
    );
    assert!(at(2.0 * neck - 1.0) > 0.9 * at(0.0), "what fits through gets in");
    assert_eq!(at(2.0 * neck + 0.01), 0.0, "what does not fit stays out");
    assert_eq!(AccessCurve::of(&sizes, &open, &NodeSet::empty([side; 3]), 1.0), None);

    // The same from crossings and balls between nodes; only those on ridges are painted.
    let (crossings, solid) = Crossings::of_function([side; 3], BoundaryCondition::Clip, |p| {
        let p = p.map(|c| c + 0.5);
        bottle(p).max(tube(p)).max(closed(p))
    });
    assert_eq!(Phase::Pore.nodes(&solid, &full), pores);
    let field = DistanceField::of(&crossings, BoundaryCondition::Clip);
    let balls = largest_balls(&field, &pores);
    let cells = crate::metrics::thickness::radii(field.values().to_vec(), &pores, &balls);
    let from_balls = access_sizes(
        &balls,
        &bottlenecks(&cells, &open, &rim(&full), BoundaryCondition::Clip),
        &open,
        BoundaryCondition::Clip,
    );
    let of_balls = AccessCurve::of(&from_balls, &open, &pores, 0.1).unwrap();
    let share = |d: f64| of_balls.share(0.1 * d);
    println!("of balls: {:.4}, {:.4}", share(2.0 * neck - 1.0), share(2.0 * neck + 1.0));
    assert_eq!(of_balls.open_share(), curve.open_share());
    assert_eq!(share(2.0 * neck + 1.0), 0.0);
    let inner = |d: f64| (share(d) - at(d)).abs();
    assert!(
        (1..8).all(|d| inner(f64::from(d)) < 0.05),
        "{:?}",
        (1..8).map(|d| inner(f64::from(d))).collect::<Vec<_>>()
    );
}

/// Returns the diameter of the largest ball that covers each node, of balls around nodes.
fn painted(side: usize, radii: &[f32]) -> Vec<f32> {
    let mut sizes = vec![0.0f32; radii.len()];
    for (index, &radius) in radii.iter().enumerate().filter(|&(_, &radius)| radius > 0.0) {
        let centre = steps::place([side; 3], index as u32);
        let around = centre.map(|c| c.saturating_sub(radius as usize)..(c + radius as usize + 1).min(side));
        for z in around[2].clone() {
            for y in around[1].clone() {
                for x in around[0].clone() {
                    let far: usize = [x, y, z].iter().zip(centre).map(|(a, b)| a.abs_diff(b).pow(2)).sum();
                    if far as f32 <= radius * radius {
                        let size = &mut sizes[(z * side + y) * side + x];
                        *size = size.max(2.0 * radius);
                    }
                }
            }
        }
    }
    sizes
}

#[test]
fn regions_other_than_boxes_end_in_their_outer_twentieths() {
    let ball = closed(solids::geodesic(10.0, 24).unwrap());
    let grid = grid_around(&[&ball], 60, 1024);
    let images = surface_images(&grid.quantise(&ball).unwrap());
    let region = Region::of_solid(&images);
    let ends = Ends::of_region(&region, Axis::X).unwrap();
    assert_eq!((ends.low.clone(), ends.high.clone(), ends.axis()), (0..3, 57..60, Axis::X));
    // Balls within the ball: in the outer twentieth the largest has a tenth of its diameter.
    let radii: Vec<f32> = radii_at_nodes(60, |p| 30.0 - p.iter().map(|c| (c - 30.0).powi(2)).sum::<f64>().sqrt());
    let found = percolation(&radii, region.nodes(), &ends, BoundaryCondition::Border).unwrap();
    assert!((found.diameter - 6.0).abs() <= 1.1, "{found:?}");
    let in_box = Region::of_box(&grid, region.bounds());
    assert_eq!(Ends::of_region(&in_box, Axis::Z), Some(Ends::of_raster([60; 3], Axis::Z)));
}
