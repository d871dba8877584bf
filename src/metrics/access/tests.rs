use super::*;
use crate::grid::{Axis, Grid};
use crate::ldi::Ldi;
use crate::mesh::ClosedMesh;
use crate::metrics::{Edges, NodeSet, Region};
use crate::sampler::cpu::CpuSampler;
use crate::sampler::{Fill, Sampler};
use crate::solids;

/// The greatest of a function over the cell of each node of a cube, at points a quarter of a pitch apart, and 0 at nodes
/// where it is not above 0. Node i lies at i + 0.5 from the face of the box.
fn radii_in_cells(side: usize, distance: impl Fn([f64; 3]) -> f64) -> Vec<f32> {
    const PLACES: [f64; 5] = [-0.5, -0.25, 0.0, 0.25, 0.5];
    (0..side.pow(3) as u32)
        .map(|index| {
            let node = steps::place([side; 3], index).map(|i| i as f64 + 0.5);
            if distance(node) <= 0.0 {
                return 0.0;
            }
            let at = |x, y, z| distance([node[0] + x, node[1] + y, node[2] + z]);
            let cell = PLACES.iter().flat_map(|x| PLACES.iter().flat_map(move |y| PLACES.map(|z| (*x, *y, z))));
            cell.fold(0.0, |most, (x, y, z)| f64::max(most, at(x, y, z))) as f32
        })
        .collect()
}

fn radii_at_nodes(side: usize, distance: impl Fn([f64; 3]) -> f64) -> Vec<f32> {
    let node = |index| steps::place([side; 3], index).map(|i| i as f64 + 0.5);
    (0..side.pow(3) as u32).map(|index| distance(node(index)).max(0.0) as f32).collect()
}

fn nodes_of(side: usize, radii: &[f32]) -> NodeSet {
    NodeSet::from_fn([side; 3], |[x, y, z]| radii[(z * side + y) * side + x] > 0.0)
}

/// How far it is to the struts of a cubic lattice that run along the edges of cells, in units of whatever they are given in.
fn to_struts(period: f64, radius: f64) -> impl Fn([f64; 3]) -> f64 {
    move |place| {
        let [x, y, z] = place.map(|c| c - (c / period).round() * period);
        (y.hypot(z)).min(x.hypot(z)).min(x.hypot(y)) - radius
    }
}

#[test]
fn between_struts_the_window_and_the_pore_are_as_wide_as_they_are() {
    let mut errors = Vec::new();
    for side in [15, 26, 41] {
        let (period, radius) = (side as f64, 0.15 * side as f64);
        let radii = radii_in_cells(side, to_struts(period, radius));
        let nodes = nodes_of(side, &radii);
        let exact = period - 2.0 * radius;
        for edges in [Edges::Clip, Edges::Periodic] {
            for axis in Axis::ALL {
                let ends = Ends::of_raster([side; 3], axis);
                let found = percolation(&radii, &nodes, &ends, edges).unwrap();
                println!(
                    "{side} along {}, {edges:?}: {:.3}, exactly {exact:.3}, at {:?}",
                    axis.name(),
                    found.diameter,
                    found.node
                );
                assert!((found.diameter - exact).abs() <= 1.0, "{found:?} for {exact}");
                let window = found.node[axis.depth()];
                assert!(window == 0 || window == side - 1, "{found:?}");
                errors.push((found.diameter - exact).abs());
            }
        }
        let largest = 2.0 * f64::from(radii.iter().copied().fold(0.0, f32::max));
        assert!((largest - (2.0f64.sqrt() * period - 2.0 * radius)).abs() <= 1.0, "{largest}");
    }
    println!("at most {:.4} pitches off", errors.iter().copied().fold(0.0, f64::max));
}

/// Twice as many cells that are shifted by half a cell: the walls of the box leave half a window at the sides, but that in
/// the middle is whole.
#[test]
fn a_border_narrows_what_lies_at_the_sides() {
    let side = 24;
    let free = vec![100.0; side * side * side];
    let nodes = NodeSet::full([side; 3]);
    for (edges, exact) in [(Edges::Border, 24.0), (Edges::Clip, 200.0)] {
        let found = percolation(&free, &nodes, &Ends::of_raster([side; 3], Axis::Y), edges).unwrap();
        assert_eq!(found.diameter, exact);
    }
    // A wall half way across leaves a gap of 12 pitches on one side.
    let radii = radii_at_nodes(side, |[x, ..]| 12.0 - x);
    let nodes = nodes_of(side, &radii);
    let ends = Ends::of_raster([side; 3], Axis::Z);
    let found = percolation(&radii, &nodes, &ends, Edges::Border).unwrap();
    assert!((found.diameter - 12.0).abs() <= 1.0, "{found:?}");
    assert_eq!(percolation(&radii, &nodes, &Ends::of_raster([side; 3], Axis::X), Edges::Border), None);
}

/// Points of the gyroid's surface in a cell of so many pitches: where lines between nodes cross it.
fn gyroid_points(side: usize) -> Vec<[f64; 3]> {
    let at = |p: [f64; 3]| gyroid(p.map(|c| c / side as f64));
    let mut points = Vec::new();
    for index in 0..side.pow(3) as u32 {
        let node = steps::place([side; 3], index).map(|i| i as f64);
        for axis in 0..3 {
            let along = |t: f64| std::array::from_fn(|a| node[a] + if a == axis { t } else { 0.0 });
            let (mut low, mut high) = (0.0, 1.0);
            if (at(along(low)) > 0.0) == (at(along(high)) > 0.0) {
                continue;
            }
            for _ in 0..30 {
                let middle = 0.5 * (low + high);
                if (at(along(middle)) > 0.0) == (at(along(low)) > 0.0) { low = middle } else { high = middle }
            }
            points.push(along(low));
        }
    }
    points
}

fn gyroid(p: [f64; 3]) -> f64 {
    let [(sx, cx), (sy, cy), (sz, cz)] = p.map(|c| (std::f64::consts::TAU * c).sin_cos());
    sx * cy + sy * cz + sz * cx
}

/// The channels of a gyroid are narrowest where three of them meet, at L/8 · (1, 1, 1) and the like: from there it is √3/8 L to
/// the surface at (0, 0, 0). Half way between two such places it is 0.2297 L, which is the largest pore.
#[test]
fn a_gyroid_lets_through_what_it_is_known_to() {
    for side in [16, 24, 36] {
        let points = gyroid_points(side);
        let period = side as f64;
        let exact = 3.0f64.sqrt() / 4.0 * period;
        let nearest = |place: [f64; 3]| {
            let square = |point: &[f64; 3]| {
                (0..3)
                    .map(|a| place[a] - point[a])
                    .map(|d| d - (d / period).round() * period)
                    .map(|d| d * d)
                    .sum::<f64>()
            };
            points.iter().map(square).fold(f64::INFINITY, f64::min).sqrt()
        };
        // Only where it may decide is the best place in the cell looked for.
        let radii: Vec<f32> = (0..side.pow(3) as u32)
            .map(|index| {
                let node = steps::place([side; 3], index).map(|i| i as f64 + 0.5);
                if gyroid(node.map(|c| c / period)) <= 0.0 {
                    return 0.0;
                }
                let here = nearest(node);
                if here + 0.9 < 0.2 * period || here > 0.218 * period {
                    return here as f32;
                }
                let around = (0..27).map(|bit| {
                    let by = [bit % 3, bit / 3 % 3, bit / 9].map(|b| f64::from(b - 1) * 0.4);
                    nearest(std::array::from_fn(|a| node[a] + by[a]))
                });
                around.fold(here, f64::max) as f32
            })
            .collect();
        let nodes = nodes_of(side, &radii);
        let found = percolation(&radii, &nodes, &Ends::of_raster([side; 3], Axis::Z), Edges::Periodic).unwrap();
        println!("{side}: {:.4} L, exactly 0.4330 L", found.diameter / period);
        let tolerance = if side < 24 { 1.0 } else { 0.02 * exact };
        assert!((found.diameter - exact).abs() < tolerance, "{found:?}");
    }
}

/// The flood against what the definition says, by going over all nodes until nothing changes.
#[test]
fn bottlenecks_are_those_of_the_widest_ways() {
    let size = [13, 9, 11];
    let nodes = NodeSet::from_fn(size, |[x, y, z]| (x * 5 + y * 3 + z * 7 + x * y * z) % 7 < 4);
    let radii: Vec<f32> = (0..nodes.volume())
        .map(|i| if nodes.contains(steps::place(size, i as u32)) { (i * 7919 % 1009 + 1) as f32 / 100.0 } else { 0.0 })
        .collect();
    let outside = boundary(&NodeSet::full(size));
    for edges in [Edges::Clip, Edges::Periodic] {
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
        assert!(wide.iter().zip(&found).all(|(a, b)| a >= b && a - b < 1.0 / 64.0), "{edges:?}");
        assert!(wide.iter().zip(&found).filter(|(a, b)| a == b).count() * 10 > found.len() * 9);
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
    let mut lowered = radii.clone();
    let ways = bottlenecks(&radii, &pores, &boundary(&NodeSet::full([side; 3])), Edges::Clip);
    let open = reached(&ways, [side; 3]);
    lower(&mut lowered, &ways);
    let sizes = painted(side, &lowered);
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
}

/// The diameter of the largest ball that covers each node, of balls around nodes.
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
fn a_region_that_is_no_box_ends_in_its_outer_twentieths() {
    let closed = ClosedMesh::check(solids::geodesic(10.0, 24).unwrap()).unwrap();
    let grid = Grid::with_resolution(closed.bounds(), 60, 1024).unwrap();
    let solid = grid.quantise(&closed).unwrap();
    let images: [Ldi; 3] =
        Axis::ALL.map(|axis| CpuSampler::default().sample_surface(&solid, axis, Fill::EvenOdd).unwrap());
    let region = Region::of_solid(&images);
    let ends = Ends::of_region(&region, Axis::X).unwrap();
    assert_eq!((ends.low.clone(), ends.high.clone(), ends.axis()), (0..3, 57..60, Axis::X));
    // Balls within the ball: in the outer twentieth there is room for a tenth of its diameter.
    let radii: Vec<f32> = radii_at_nodes(60, |p| 30.0 - p.iter().map(|c| (c - 30.0).powi(2)).sum::<f64>().sqrt());
    let found = percolation(&radii, region.nodes(), &ends, Edges::Border).unwrap();
    assert!((found.diameter - 6.0).abs() <= 1.1, "{found:?}");
    let in_box = Region::of_box(&grid, region.bounds());
    assert_eq!(Ends::of_region(&in_box, Axis::Z), Some(Ends::of_raster([60; 3], Axis::Z)));
}
