//! Groups of pairs that lie close together.

use std::ops::Range;

use glam::DVec3;

use crate::mesh::Aabb;

/// A pair of boxes, its place and its cost.
struct Placed {
    pair: [usize; 2],
    /// The middle of what the boxes share, or of the gap between them.
    place: DVec3,
    cost: f64,
}

/// Groups pairs of boxes into at most `count` tiles of about equal cost, so that the pairs of a tile lie close together and have few
/// boxes. Each tile has its pairs in order.
///
/// The pairs are halved by cost across the longest side of the box of their places, and so on.
pub fn tiles(
    boxes: &[Aabb],
    pairs: &[[usize; 2]],
    cost: impl Fn([usize; 2]) -> f64,
    count: usize,
) -> Vec<Vec<[usize; 2]>> {
    let placed = |&pair: &[usize; 2]| {
        let [a, b] = pair.map(|part| &boxes[part]);
        Placed { pair, place: 0.5 * (a.min.max(b.min) + a.max.min(b.max)), cost: cost(pair) }
    };
    let mut placed: Vec<Placed> = pairs.iter().map(placed).collect();
    let mut found = Vec::new();
    let mut stack: Vec<(Range<usize>, usize)> = vec![(0..placed.len(), count)];
    while let Some((range, count)) = stack.pop() {
        let part = &mut placed[range.clone()];
        if count < 2 || part.len() < 2 {
            let mut tile: Vec<[usize; 2]> = part.iter().map(|placed| placed.pair).collect();
            tile.sort_unstable();
            found.push(tile);
            continue;
        }
        let at = range.start + split(part, (count / 2) as f64 / count as f64);
        stack.extend([(range.start..at, count / 2), (at..range.end, count - count / 2)]);
    }
    found.retain(|tile| !tile.is_empty());
    found
}

/// Sorts pairs across their longest side and returns the number of those that have a share of the cost: at least one, but not all.
fn split(pairs: &mut [Placed], share: f64) -> usize {
    let low = pairs.iter().fold(DVec3::INFINITY, |low, placed| low.min(placed.place));
    let high = pairs.iter().fold(DVec3::NEG_INFINITY, |high, placed| high.max(placed.place));
    let axis = (high - low).max_position();
    pairs.sort_by(|p, q| p.place[axis].total_cmp(&q.place[axis]).then(p.pair.cmp(&q.pair)));
    let most = share * pairs.iter().map(|placed| placed.cost).sum::<f64>();
    let mut sum = 0.0;
    let within = pairs.iter().take_while(|placed| {
        sum += placed.cost;
        sum <= most
    });
    within.count().clamp(1, pairs.len() - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns unit cubes in a row, and the pairs of neighbours.
    fn row(count: usize) -> (Vec<Aabb>, Vec<[usize; 2]>) {
        let cube = |at: usize| Aabb { min: DVec3::X * at as f64, max: DVec3::X * at as f64 + DVec3::ONE };
        ((0..count).map(cube).collect(), (1..count).map(|at| [at - 1, at]).collect())
    }

    #[test]
    fn tiles_have_each_pair_once_and_neighbours_together() {
        let (boxes, pairs) = row(33);
        for count in [0, 1, 2, 3, 8, 32, 100] {
            let tiles = tiles(&boxes, &pairs, |_| 1.0, count);
            assert_eq!(tiles.len(), count.clamp(1, 32));
            let mut all: Vec<[usize; 2]> = tiles.iter().flatten().copied().collect();
            all.sort_unstable();
            assert_eq!(all, pairs);
            for tile in &tiles {
                assert_eq!(tile.last().unwrap()[1] - tile[0][0], tile.len(), "neighbours share parts: {tile:?}");
                assert!(tile.len() <= 32usize.div_ceil(tiles.len()), "{count} tiles: {tile:?}");
            }
        }
        assert!(tiles(&boxes, &[], |_| 1.0, 4).is_empty());
    }

    #[test]
    fn tiles_have_about_equal_costs() {
        let (boxes, pairs) = row(9);
        let tiles = tiles(&boxes, &pairs, |[i, _]| if i == 7 { 7.0 } else { 1.0 }, 2);
        let mut sizes: Vec<usize> = tiles.iter().map(Vec::len).collect();
        sizes.sort_unstable();
        assert_eq!(sizes, [1, 7]);
    }
}
