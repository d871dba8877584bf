//! The pairs of bodies whose boxes come near one another.

use crate::box_tree::{Box32, BoxTree, opened};
use crate::cancel::checkpoint;
use crate::mesh::Aabb;

/// Returns the pairs of boxes that are at most `distance` apart, the smaller number first, in order.
///
/// A hierarchy of the boxes is compared with itself: n log n where a box comes near a bounded number of others.
pub fn near_pairs(boxes: &[Aabb], distance: f64) -> Vec<[usize; 2]> {
    if boxes.len() < 2 {
        return Vec::new();
    }
    let rounded: Vec<Box32> = boxes.iter().copied().map(Box32::of).collect();
    let tree = BoxTree::new(boxes.len(), |item| rounded[item as usize]);
    let mut pairs = Vec::new();
    let mut stack = vec![[tree.root(); 2]];
    while let Some([a, b]) = stack.pop() {
        checkpoint();
        if tree.bounds(a).squared_distance(tree.bounds(b)) > distance * distance {
            continue;
        }
        if a == b && tree.items(a).is_none() {
            let below: Vec<_> = tree.children(a).collect();
            stack.extend(
                (0..below.len())
                    .flat_map(|i| below[i..].iter().map(move |&other| (i, other)))
                    .map(|(i, other)| [below[i], other]),
            );
            continue;
        }
        if let Some((below, count)) = opened([&tree; 2], [a, b]) {
            stack.extend(&below[..count]);
            continue;
        }
        for &i in tree.items(a).unwrap_or_default() {
            for &j in tree.items(b).unwrap_or_default() {
                let [one, other] = [i.min(j) as usize, i.max(j) as usize];
                let is_counted = a != b || i < j;
                if is_counted && gap(&boxes[one], &boxes[other]) <= distance {
                    pairs.push([one, other]);
                }
            }
        }
    }
    pairs.sort_unstable();
    pairs
}

/// Returns the distance of two boxes.
fn gap(a: &Aabb, b: &Aabb) -> f64 {
    (a.min - b.max).max(b.min - a.max).max(glam::DVec3::ZERO).length()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::testing::random::Random;

    #[test]
    fn near_pairs_are_those_of_all_comparisons() {
        let mut random = Random::new(11);
        for count in [1, 2, 5, 40, 300] {
            let boxes: Vec<Aabb> = (0..count)
                .map(|_| {
                    let min = 10.0 * DVec3::new(random.share(), random.share(), random.share()).round();
                    Aabb { min, max: min + DVec3::new(random.share(), random.share(), 0.0) * 3.0 }
                })
                .collect();
            for distance in [0.0, 0.5, 100.0] {
                let near = |&[i, j]: &[usize; 2]| gap(&boxes[i], &boxes[j]) <= distance;
                let all = (0..count).flat_map(|i| (i + 1..count).map(move |j| [i, j]));
                assert_eq!(near_pairs(&boxes, distance), all.filter(near).collect::<Vec<_>>());
            }
        }
    }
}
