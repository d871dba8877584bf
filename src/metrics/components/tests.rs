//! Pieces compared with node-by-node floods, and sets whose pieces are known.

use std::collections::VecDeque;

use super::*;
use crate::testing::images::random_nodes;

const CONNECTIVITIES: [Connectivity; 2] = [Connectivity::Faces, Connectivity::All];

/// In these sizes rows end within a word, at its end, and after it; a raster of one or two nodes meets itself.
const SIZES: [[usize; 3]; 8] =
    [[9, 7, 5], [64, 3, 4], [65, 4, 3], [130, 3, 2], [63, 2, 2], [1, 5, 6], [2, 1, 7], [128, 1, 1]];

fn all_sets() -> impl Iterator<Item = NodeSet> {
    SIZES.into_iter().flat_map(|size| {
        [0.1, 0.3, 0.5, 0.75].into_iter().enumerate().map(move |(at, share)| random_nodes(size, share, at as u64 + 1))
    })
}

/// Floods from node to node. Returns the sizes of pieces in the order of first nodes, the piece of each node, and the number of
/// directions in which each piece is endless.
fn flooded(
    set: &NodeSet,
    connectivity: Connectivity,
    edges: BoundaryCondition,
) -> (Vec<u64>, Vec<Option<u32>>, Vec<usize>) {
    let size = set.size().map(|n| n as i64);
    let at = |[x, y, z]: [i64; 3]| ((z * size[1] + y) * size[0] + x) as usize;
    let mut found: Vec<Option<(u32, [i64; 3])>> = vec![None; set.volume()];
    let (mut sizes, mut ranks) = (Vec::new(), Vec::new());
    for start in 0..set.volume() as i64 {
        let node = [start % size[0], start / size[0] % size[1], start / size[0] / size[1]];
        if !set.contains(node.map(|i| i as usize)) || found[start as usize].is_some() {
            continue;
        }
        let piece = sizes.len() as u32;
        let mut ways = Vec::new();
        let mut count = 0;
        let mut queue = VecDeque::from([node]);
        found[start as usize] = Some((piece, [0; 3]));
        while let Some(node) = queue.pop_front() {
            count += 1;
            let (_, cells) = found[at(node)].unwrap();
            for step in 0..27 {
                let step = [step % 3 - 1, step / 3 % 3 - 1, step / 9 - 1];
                let along = step.iter().filter(|&&step| step != 0).count();
                if along == 0 || (connectivity == Connectivity::Faces && along > 1) {
                    continue;
                }
                let far: [i64; 3] = std::array::from_fn(|i| node[i] + step[i]);
                let next: [i64; 3] = std::array::from_fn(|i| far[i].rem_euclid(size[i]));
                if (edges != BoundaryCondition::Periodic && next != far) || !set.contains(next.map(|i| i as usize)) {
                    continue;
                }
                let there: [i64; 3] = std::array::from_fn(|i| cells[i] + far[i].div_euclid(size[i]));
                match found[at(next)] {
                    None => {
                        found[at(next)] = Some((piece, there));
                        queue.push_back(next);
                    }
                    Some((_, known)) => ways.push(std::array::from_fn(|i| there[i] - known[i])),
                }
            }
        }
        sizes.push(count);
        ranks.push(rank(ways));
    }
    (sizes, found.into_iter().map(|found| found.map(|(piece, _)| piece)).collect(), ranks)
}

/// Returns the rank by elimination.
fn rank(mut rows: Vec<[i64; 3]>) -> usize {
    let mut rank = 0;
    for column in 0..3 {
        let Some(pivot) = (rank..rows.len()).find(|&row| rows[row][column] != 0) else { continue };
        rows.swap(rank, pivot);
        let by = rows[rank];
        for row in &mut rows[rank + 1..] {
            *row = std::array::from_fn(|i| row[i] * by[column] - by[i] * row[column]);
        }
        rows.retain(|row| row != &[0; 3]);
        rank += 1;
    }
    rank
}

#[test]
fn components_agree_with_a_flood_fill() {
    let mut ranks_seen = [0; 4];
    for set in all_sets() {
        for connectivity in CONNECTIVITIES {
            for edges in [BoundaryCondition::Clip, BoundaryCondition::Periodic] {
                let case = format!("{:?} {connectivity:?} {edges:?}", set.size());
                let (sizes, labels, ranks) = flooded(&set, connectivity, edges);
                let pieces = Components::of(&set, connectivity, edges);
                assert_eq!(pieces.sizes(), sizes, "{case}");
                let [columns, rows, _] = set.size();
                for (at, label) in labels.iter().enumerate() {
                    let node = [at % columns, at / columns % rows, at / columns / rows];
                    assert_eq!(pieces.piece_of(node), *label, "{case} {node:?}");
                }
                let found: Vec<usize> = (0..pieces.count() as u32).map(|piece| pieces.directions(piece)).collect();
                assert_eq!(found, ranks, "{case}");
                ranks.iter().for_each(|&rank| ranks_seen[rank] += 1);
                assert_eq!(pieces.nodes(|_| true), set, "{case}");
                let largest = pieces.largest();
                assert_eq!(largest.map(|piece| sizes[piece as usize]), sizes.iter().max().copied());
                let share = pieces.largest_share().map(|share| share * set.count() as f64);
                assert!(share.is_none_or(|nodes| (nodes - *sizes.iter().max().unwrap() as f64).abs() < 1e-9));
            }
        }
    }
    assert!(ranks_seen.iter().all(|&seen| seen > 0), "pieces that go on in each number of directions: {ranks_seen:?}");
}

#[test]
fn reached_nodes_agree_with_a_flood_fill() {
    for set in all_sets() {
        let from = random_nodes(set.size(), 0.02, 77);
        for connectivity in CONNECTIVITIES {
            let (sizes, labels, _) = flooded(&set, connectivity, BoundaryCondition::Clip);
            let [columns, rows, _] = set.size();
            let mut touched = vec![false; sizes.len()];
            let of = |at: usize| [at % columns, at / columns % rows, at / columns / rows];
            for (at, label) in labels.iter().enumerate().filter(|&(at, _)| from.contains(of(at))) {
                label.iter().for_each(|&label| touched[label as usize] |= at < labels.len());
            }
            let expected = NodeSet::from_fn(set.size(), |[x, y, z]| {
                labels[(z * rows + y) * columns + x].is_some_and(|label| touched[label as usize])
            });
            assert_eq!(
                reached(&set, connectivity, BoundaryCondition::Clip, &from),
                expected,
                "{:?} {connectivity:?}",
                set.size()
            );
        }
    }
}

#[test]
fn the_rim_is_the_nodes_with_a_neighbour_outside() {
    for set in all_sets() {
        let size = set.size();
        let outside = |node: [usize; 3], axis: usize, step: isize| {
            let mut next = node;
            match node[axis].checked_add_signed(step) {
                Some(at) if at < size[axis] => next[axis] = at,
                _ => return true,
            }
            !set.contains(next)
        };
        let expected = NodeSet::from_fn(size, |node| {
            set.contains(node) && (0..3).any(|axis| [-1, 1].iter().any(|&step| outside(node, axis, step)))
        });
        assert_eq!(rim(&set), expected, "{size:?}");
    }
}

/// Returns the solid between two radii about the middle of a raster.
fn shell(size: usize, inner: f64, outer: f64) -> NodeSet {
    let middle = (size as f64 - 1.0) / 2.0;
    NodeSet::from_fn([size; 3], |node| {
        let squared: f64 = node.iter().map(|&i| (i as f64 - middle).powi(2)).sum();
        (inner * inner..=outer * outer).contains(&squared)
    })
}

#[test]
fn the_hollow_of_a_ball_is_a_closed_pore() {
    for size in [24, 48, 96] {
        let n = size as f64;
        let solid = shell(size, 0.3 * n, 0.45 * n);
        let region = NodeSet::full([size; 3]);
        let pore = region.minus(&solid);
        let open = open_pores(&pore, &region, BoundaryCondition::Clip);
        let closed = pore.minus(&open);
        assert_eq!(closed, shell(size, 0.0, 0.3 * n - 1e-9).minus(&solid));
        let ratio = closed.count() as f64 / (4.0 / 3.0 * std::f64::consts::PI * (0.3 * n).powi(3));
        println!("closed porosity of a hollow ball, {size} nodes: {ratio:.5} of its own");
        assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
        // A region that is the ball itself cuts nothing, and its rim is solid.
        let ball = shell(size, 0.0, 0.45 * n);
        assert!(open_pores(&ball.minus(&solid), &ball, BoundaryCondition::Border).is_empty());
        // One that cuts through the cavity opens it.
        let half = ball.and(&NodeSet::from_fn([size; 3], |[x, ..]| x < size / 2));
        assert_eq!(open_pores(&half.minus(&solid), &half, BoundaryCondition::Clip), half.minus(&solid));
    }
}

#[test]
fn a_bubble_across_the_faces_of_a_periodic_cell_is_closed() {
    let size = [32; 3];
    let region = NodeSet::full(size);
    let apart = |i: usize, centre: usize| (i as f64 - centre as f64).abs().min(32.0 - (i as f64 - centre as f64).abs());
    let bubble = NodeSet::from_fn(size, |[x, y, z]| apart(x, 0).hypot(apart(y, 1)).hypot(apart(z, 31)) < 8.0);
    let tube = NodeSet::from_fn(size, |[_, y, z]| apart(y, 16).hypot(apart(z, 16)) < 4.0);
    let pore = bubble.or(&tube);
    assert_eq!(open_pores(&pore, &region, BoundaryCondition::Periodic), tube);
    assert_eq!(open_pores(&pore, &region, BoundaryCondition::Clip), pore);
    let pieces = Components::of(&pore, Connectivity::Faces, BoundaryCondition::Periodic);
    assert_eq!((pieces.count(), pieces.all_directions()), (2, 1));
    assert_eq!(Components::of(&pore, Connectivity::Faces, BoundaryCondition::Clip).count(), 9);
}

#[test]
fn a_serpentine_is_one_component() {
    // A serpentine: every other row full, joined at alternate ends.
    let size = [200, 41, 3];
    let set = NodeSet::from_fn(size, |[x, y, z]| z == 1 && (y % 2 == 0 || x == if y % 4 == 1 { 199 } else { 0 }));
    for connectivity in CONNECTIVITIES {
        let pieces = Components::of(&set, connectivity, BoundaryCondition::Clip);
        assert_eq!(pieces.sizes(), [21 * 200 + 20]);
    }
}

#[test]
fn component_numbers_do_not_depend_on_the_thread_count() {
    let set = random_nodes([130, 40, 40], 0.35, 5);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let pieces = Components::of(&set, Connectivity::Faces, BoundaryCondition::Periodic);
            (pieces.sizes().to_vec(), pieces.labels)
        })
    };
    assert_eq!(with(1), with(4));
}

#[test]
fn empty_sets_have_no_components() {
    for edges in [BoundaryCondition::Clip, BoundaryCondition::Periodic] {
        let pieces = Components::of(&NodeSet::empty([5, 6, 7]), Connectivity::All, edges);
        assert_eq!((pieces.count(), pieces.largest(), pieces.largest_share()), (0, None, None));
    }
}
