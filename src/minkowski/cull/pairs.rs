//! Pairs of features whose patches meet.

use crate::parallel::*;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use super::gauss::Patch;
use crate::cancel::checkpoint;

/// Patches that one task looks up; results are in the order of the patches, independent of threads.
const PATCHES_PER_TASK: usize = 512;

/// The results of a visitor of pairs of features, and the number of visited pairs.
pub struct Found<T> {
    /// Lists whose order, within and among them, depends only on the patches.
    pub kept: Vec<Vec<T>>,
    /// Pairs of patches that meet.
    pub visited: u64,
}

/// Calls `visit` for every pair of patches that meet, features of `a` first; features that share several faces are visited for
/// each. The patches of the smaller set are held in a hierarchy of boxes, in which those of the larger are looked up.
pub fn meeting<T: Send>(a: &[Patch], b: &[Patch], visit: impl Fn(&Patch, &Patch, &mut Vec<T>) + Sync) -> Found<T> {
    match a.len() < b.len() {
        true => look_up(b, a, |in_b, in_a, kept| visit(in_a, in_b, kept)),
        false => look_up(a, b, visit),
    }
}

fn look_up<T: Send>(queries: &[Patch], held: &[Patch], visit: impl Fn(&Patch, &Patch, &mut Vec<T>) + Sync) -> Found<T> {
    let indices = (0..held.len() as u32).collect();
    let hierarchy = PlocBuilder::new().build(PlocSearchDistance::Low, held, indices, SortPrecision::U64, 0);
    let of_task = |queries: &[Patch]| {
        checkpoint();
        let (mut kept, mut visited) = (Vec::new(), 0);
        for query in queries {
            hierarchy.aabb_traverse(query.bounds, |hierarchy, node| {
                let node = &hierarchy.nodes[node as usize];
                let first = node.first_index as usize;
                for &index in &hierarchy.primitive_indices[first..first + node.prim_count as usize] {
                    visited += 1;
                    visit(query, &held[index as usize], &mut kept);
                }
                true
            });
        }
        (kept, visited)
    };
    let (kept, visited): (Vec<Vec<T>>, Vec<u64>) = queries.par_chunks(PATCHES_PER_TASK).map(of_task).unzip();
    Found { kept, visited: visited.into_iter().sum() }
}
