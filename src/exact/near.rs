//! The faces of a body that may meet those of another or a ray.

use glam::DVec3;
use rayon::prelude::*;

use crate::box_tree::{Box32, BoxTree, opened};
use crate::cancel::checkpoint;

/// Number of pairs of nodes from which the search is split into tasks.
const TASKS: usize = 512;

/// Some faces with their boxes, and the hierarchy over them.
pub(super) struct NearFaces {
    faces: Vec<(u32, Box32)>,
    tree: BoxTree,
}

impl NearFaces {
    /// Returns the hierarchy of at least one face.
    pub fn new(faces: Vec<(u32, Box32)>) -> NearFaces {
        let tree = BoxTree::new(faces.len(), |item| faces[item as usize].1);
        NearFaces { faces, tree }
    }

    /// Returns the faces.
    pub fn faces(&self) -> impl IndexedParallelIterator<Item = u32> + '_ {
        self.faces.par_iter().map(|&(face, _)| face)
    }

    /// Returns what `look` finds of the pairs of faces whose boxes touch, in an order that does not depend on threads.
    pub fn pairs<T: Send>(&self, other: &NearFaces, look: impl Fn(u32, u32) -> Option<T> + Sync) -> Vec<T> {
        let trees = [&self.tree, &other.tree];
        let touch = |&[a, b]: &[_; 2]| self.tree.bounds(a).touches(other.tree.bounds(b));
        let mut tasks = vec![[self.tree.root(), other.tree.root()]];
        tasks.retain(touch);
        while tasks.len() < TASKS {
            let below = |pair| opened(trees, pair).map_or(([pair; 2], 1), |opened| opened);
            let next: Vec<_> = tasks
                .iter()
                .flat_map(|&pair| {
                    let (pairs, count) = below(pair);
                    pairs.into_iter().take(count)
                })
                .filter(touch)
                .collect();
            if next == tasks {
                break;
            }
            tasks = next;
        }
        let found: Vec<Vec<T>> = tasks
            .into_par_iter()
            .map(|task| {
                checkpoint();
                let (mut found, mut pending) = (Vec::new(), vec![task]);
                while let Some([a, b]) = pending.pop() {
                    if let Some((below, count)) = opened(trees, [a, b]) {
                        pending.extend(below[..count].iter().filter(|pair| touch(pair)));
                        continue;
                    }
                    for &i in self.tree.items(a).unwrap_or_default() {
                        let (face, extent) = self.faces[i as usize];
                        for &j in other.tree.items(b).unwrap_or_default() {
                            let (beside, around) = other.faces[j as usize];
                            if extent.touches(&around) {
                                found.extend(look(face, beside));
                            }
                        }
                    }
                }
                found
            })
            .collect();
        found.into_iter().flatten().collect()
    }

    /// Calls `visit` for the faces whose boxes the ray from a point along +x may meet.
    pub fn ahead_of(&self, point: DVec3, mut visit: impl FnMut(u32)) {
        let items = |items: &[u32]| items.iter().for_each(|&item| visit(self.faces[item as usize].0));
        self.tree.visit(|extent| extent.is_ahead_of(point), items);
    }
}
