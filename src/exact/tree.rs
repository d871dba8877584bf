//! A hierarchy of boxes over faces, to find those that may meet.
//!
//! The faces are sorted along a Morton curve and cut into leaves of equal size; the boxes above them form a complete binary
//! tree, so that no links are stored. Boxes are in `f32`, rounded outwards.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::cancel::checkpoint;

/// Faces of a leaf, at most.
const LEAF: usize = 4;

/// Number of pairs of nodes from which the search is split into tasks.
const TASKS: usize = 512;

/// A box, rounded outwards.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    pub min: Vec3,
    pub max: Vec3,
}

impl Extent {
    const EMPTY: Extent = Extent { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    #[inline]
    pub fn of(points: impl IntoIterator<Item = DVec3>) -> Extent {
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for point in points {
            (min, max) = (min.min(point), max.max(point));
        }
        let (low, high) = (min.as_vec3(), max.as_vec3());
        let down = |x: f32| x.next_down();
        let up = |x: f32| x.next_up();
        Extent {
            min: Vec3::new(down(low.x), down(low.y), down(low.z)),
            max: Vec3::new(up(high.x), up(high.y), up(high.z)),
        }
    }

    #[inline]
    pub fn touches(&self, other: &Extent) -> bool {
        (self.min.cmple(other.max) & other.min.cmple(self.max)).all()
    }

    pub fn join(self, other: Extent) -> Extent {
        Extent { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Returns the box, wider by a millionth of the largest coordinates.
    pub fn widened(self) -> Extent {
        let margin = Vec3::splat(1e-6 * self.min.abs().max(self.max.abs()).max_element());
        Extent { min: self.min - margin, max: self.max + margin }
    }

    fn width(&self) -> f32 {
        (self.max - self.min).element_sum()
    }
}

/// Faces, by their numbers, and the boxes around them.
pub(super) struct Tree {
    /// The faces in the order of the leaves, with their boxes.
    faces: Vec<(u32, Extent)>,
    /// The boxes of the nodes: the root is node 1, the children of node i are 2 i and 2 i + 1, and leaves are the last.
    nodes: Vec<Extent>,
}

impl Tree {
    /// Builds a tree over faces with their boxes.
    pub fn new(faces: Vec<(u32, Extent)>) -> Tree {
        let bounds = faces.par_iter().map(|(_, extent)| *extent).reduce(|| Extent::EMPTY, Extent::join);
        let scale = 2097151.0 / (bounds.max - bounds.min).max(Vec3::splat(f32::MIN_POSITIVE));
        let mut keyed: Vec<(u64, (u32, Extent))> = faces
            .into_par_iter()
            .map(|(face, extent)| {
                let centre = (0.5 * (extent.min + extent.max) - bounds.min) * scale;
                (morton(centre), (face, extent))
            })
            .collect();
        keyed.par_sort_unstable_by_key(|&(key, (face, _))| (key, face));
        let faces: Vec<(u32, Extent)> = keyed.into_par_iter().map(|(_, face)| face).collect();
        let leaves = faces.len().div_ceil(LEAF).max(1).next_power_of_two();
        let mut nodes = vec![Extent::EMPTY; 2 * leaves];
        nodes[leaves..].par_iter_mut().enumerate().for_each(|(leaf, node)| {
            let members = &faces[leaf * faces.len() / leaves..(leaf + 1) * faces.len() / leaves];
            *node = members.iter().fold(Extent::EMPTY, |all, (_, extent)| all.join(*extent));
        });
        for node in (1..leaves).rev() {
            nodes[node] = nodes[2 * node].join(nodes[2 * node + 1]);
        }
        Tree { faces, nodes }
    }

    fn leaves(&self) -> usize {
        self.nodes.len() / 2
    }

    fn is_leaf(&self, node: usize) -> bool {
        node >= self.leaves()
    }

    fn members(&self, node: usize) -> &[(u32, Extent)] {
        let (leaf, leaves) = (node - self.leaves(), self.leaves());
        &self.faces[leaf * self.faces.len() / leaves..(leaf + 1) * self.faces.len() / leaves]
    }

    /// Returns what `look` finds of the pairs of faces whose boxes touch, in an order that does not depend on threads.
    pub fn pairs<T: Send>(&self, other: &Tree, look: impl Fn(u32, u32) -> Option<T> + Sync) -> Vec<T> {
        let mut tasks = vec![(1, 1)];
        while tasks.len() < TASKS {
            let next: Vec<_> = tasks.iter().flat_map(|&pair| self.children(other, pair)).collect();
            if next == tasks || next.is_empty() {
                tasks = next;
                break;
            }
            tasks = next;
        }
        let found: Vec<Vec<T>> = tasks
            .into_par_iter()
            .map(|task| {
                checkpoint();
                let mut found = Vec::new();
                let mut pending = vec![task];
                while let Some((i, j)) = pending.pop() {
                    if !(self.is_leaf(i) && other.is_leaf(j)) {
                        pending.extend(self.children(other, (i, j)));
                        continue;
                    }
                    for (a, extent) in self.members(i) {
                        for (b, beside) in other.members(j) {
                            if extent.touches(beside) {
                                found.extend(look(*a, *b));
                            }
                        }
                    }
                }
                found
            })
            .collect();
        found.into_iter().flatten().collect()
    }

    /// Returns the pairs of children that touch, of the wider of two nodes; a pair of leaves itself.
    fn children(&self, other: &Tree, (i, j): (usize, usize)) -> impl Iterator<Item = (usize, usize)> {
        let (a, b) = (self.nodes[i], other.nodes[j]);
        let splits_first = !self.is_leaf(i) && (other.is_leaf(j) || a.width() >= b.width());
        let pairs = match (splits_first, other.is_leaf(j)) {
            (true, _) => [(2 * i, j), (2 * i + 1, j)],
            (false, false) => [(i, 2 * j), (i, 2 * j + 1)],
            (false, true) => [(i, j), (0, 0)],
        };
        pairs.into_iter().filter(|&(i, j)| self.nodes[i].touches(&other.nodes[j]))
    }

    /// Calls `visit` for the faces whose boxes touch a box.
    pub fn touching(&self, extent: &Extent, mut visit: impl FnMut(u32)) {
        let mut pending = vec![1];
        while let Some(node) = pending.pop() {
            if !self.nodes[node].touches(extent) {
                continue;
            }
            if self.is_leaf(node) {
                self.members(node).iter().filter(|(_, own)| own.touches(extent)).for_each(|&(face, _)| visit(face));
            } else {
                pending.extend([2 * node + 1, 2 * node]);
            }
        }
    }
}

/// Interleaves the bits of three coordinates below 2²¹.
fn morton(point: Vec3) -> u64 {
    let spread = |x: f32| {
        let mut x = u64::from(x as u32);
        x = (x | x << 32) & 0x001f_0000_0000_ffff;
        x = (x | x << 16) & 0x001f_0000_ff00_00ff;
        x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
        x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
        (x | x << 2) & 0x1249_2492_4924_9249
    };
    spread(point.x) | spread(point.y) << 1 | spread(point.z) << 2
}
