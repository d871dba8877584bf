//! Distances compared with all crossings, one by one.

mod images;

use super::*;
use crate::metrics::NodeSet;
use crate::testing::random::Congruential;

fn random_nodes(size: [usize; 3], share: f64, seed: u64) -> NodeSet {
    let mut random = Congruential::new(seed);
    let mut set = NodeSet::empty(size);
    for node in nodes(size) {
        if random.share() < share {
            set.insert(node);
        }
    }
    set
}

fn nodes([columns, rows, planes]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..planes).flat_map(move |z| (0..rows).flat_map(move |y| (0..columns).map(move |x| [x, y, z])))
}

/// Returns all crossings as positions.
fn cloud(crossings: &Crossings) -> Vec<[f64; 3]> {
    let size = crossings.size();
    let mut all = Vec::new();
    for axis in Axis::ALL {
        let columns = size[axis.column()];
        for row in 0..columns * size[axis.row()] {
            for &place in crossings.row(axis, row) {
                let mut position = [0.0; 3];
                position[axis.depth()] = f64::from(place);
                position[axis.column()] = (row % columns) as f64;
                position[axis.row()] = (row / columns) as f64;
                all.push(position);
            }
        }
    }
    all
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

/// Compares every node's distance with that to each point of the cloud, and the site with the distance.
fn check(crossings: &Crossings, edges: BoundaryCondition) -> DistanceField {
    let field = DistanceField::of(crossings, edges);
    assert_eq!(distances(crossings, edges), field.values(), "distances alone have the same bits");
    let size = field.size();
    let cloud = cloud(crossings);
    for (index, node) in nodes(size).enumerate() {
        let at = node.map(|i| i as f64);
        let to = |place: &[f64; 3]| {
            let wrapped = [0, 1, 2].map(|i| {
                let off = place[i] - at[i];
                let period = size[i] as f64;
                if edges == BoundaryCondition::Periodic { off - period * (off / period).round() } else { off }
            });
            distance(wrapped, [0.0; 3])
        };
        let mut expected = cloud.iter().map(to).fold(f64::INFINITY, f64::min);
        if let Some(walls) = crossings.walls() {
            let to_walls = walls.iter().flat_map(|corner| [0, 1, 2].map(|i| (f64::from(corner[i]) - at[i]).abs()));
            expected = to_walls.fold(expected, f64::min);
        }
        let found = f64::from(field.values()[index]);
        if expected.is_infinite() {
            assert!(found.is_infinite() && field.site(index).is_none());
            continue;
        }
        assert!((found - expected).abs() <= 1e-5 * (1.0 + expected), "{node:?}: {found}, not {expected}");
        let site = field.site(index).unwrap().map(f64::from);
        assert!((distance(site, at) - found).abs() <= 1e-5 * (1.0 + found), "{node:?}: {site:?} is not at {found}");
    }
    field
}

#[test]
fn distances_of_random_nodes_equal_those_to_the_nearest_crossing() {
    for (seed, size) in [(1, [13, 9, 17]), (2, [70, 5, 6]), (3, [6, 67, 4]), (4, [5, 3, 41]), (5, [1, 8, 8])] {
        for share in [0.5, 0.05, 0.002, 0.0] {
            let solid = random_nodes(size, share, seed);
            for edges in [BoundaryCondition::Clip, BoundaryCondition::Periodic, BoundaryCondition::Border] {
                check(&Crossings::of_nodes(&solid, edges), edges);
            }
        }
    }
}

#[test]
fn distances_of_formulas_equal_those_to_the_nearest_crossing() {
    let sphere = |[x, y, z]: [f64; 3]| distance([x, y, z], [9.3, 10.1, 8.8]) - 7.4;
    let wave = |p: [f64; 3]| {
        let [x, y, z] = p.map(|x| x * std::f64::consts::TAU / 24.0);
        x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos() + 0.3
    };
    for edges in [BoundaryCondition::Clip, BoundaryCondition::Periodic, BoundaryCondition::Border] {
        check(&Crossings::of_function([20, 21, 19], edges, sphere).0, edges);
        check(&Crossings::of_function([24; 3], edges, wave).0, edges);
    }
}

#[test]
fn distance_fields_do_not_depend_on_the_thread_count() {
    let solid = random_nodes([40, 33, 37], 0.02, 9);
    let crossings = Crossings::of_nodes(&solid, BoundaryCondition::Periodic);
    let of = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| DistanceField::of(&crossings, BoundaryCondition::Periodic))
    };
    let (one, three) = (of(1), of(3));
    assert_eq!(one.values, three.values);
    assert_eq!(one.sites, three.sites);
}

#[test]
fn two_crossings_at_one_place_hide_none_behind_them() {
    let crossings = Crossings::of_places([9, 1, 1], |axis, _| match axis {
        Axis::X => vec![0.25, 2.0, 2.0, 6.5],
        _ => Vec::new(),
    });
    let field = check(&crossings, BoundaryCondition::Clip);
    assert_eq!(field.values(), [0.25, 0.75, 0.0, 1.0, 2.0, 1.5, 0.5, 0.5, 1.5]);
}

#[test]
fn far_distances_mix_those_tried_and_those_of_envelopes() {
    for (size, share) in [([170, 5, 100], 2e-4), ([64, 96, 3], 3e-4), ([3, 170, 33], 1e-4)] {
        let solid = random_nodes(size, share, 11);
        for edges in [BoundaryCondition::Clip, BoundaryCondition::Periodic] {
            let field = check(&Crossings::of_nodes(&solid, edges), edges);
            assert!(field.values().iter().any(|&value| value > 30.0));
        }
    }
}
