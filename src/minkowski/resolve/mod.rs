//! Gap resolution: decides which of the possible gaps are out of the solid.
//!
//! A gap lies wholly in or wholly out. Each lattice node lies on three rays. Some nodes are decided at once: a node that lies
//! in no gap of one of its rays is in, and one beyond the crossings of one of its rays is out. Two neighbours with no crossing
//! between them on the ray through both lie in one interval, and so are in or out together. The nodes that are still **open**
//! fall into sets, which touch a node that is in, one that is out, or neither. Sets of the last kind are the components: one
//! exact test of one node decides each. A gap has the state of its nodes; a gap between two nodes is tested by itself.
//!
//! Nodes are bits, 64 of a row per word, as in [`NodePlanes`](crate::ldi::NodePlanes), but never all in memory: they are made
//! slab by slab (`slab`), and only the two outer planes of a slab and the sets of its gaps are kept. Within a slab the runs of
//! open nodes along x are united with their neighbours (`sets`, `layer`), then slab with slab. A flood, plane after plane until
//! nothing changes, would do as well where cavities are simple; union–find takes one pass even in a maze.
//!
//! A node that is in by one ray must not be out by another. Exact crossings of primitives that cover the boundary never
//! contradict one another; where others do, the result is an error and no image.

mod fill;
#[cfg(feature = "gpu")]
pub mod gpu;
mod layer;
mod masks;
mod sets;
mod slab;
#[cfg(test)]
mod tests;

use std::sync::atomic::{AtomicU64, Ordering};

use crate::parallel::*;

use super::{Exterior, Membership, RaySpans};
use crate::cancel::checkpoint;
use crate::fixed::Hit;
use crate::grid::{Axis, Grid};
use layer::Raster;
use sets::{IN, Sets};
use slab::SlabSets;

/// Spans whose gaps are all out, and the counts of their resolution.
#[derive(Clone, Debug, PartialEq)]
pub struct ResolvedSpans<H> {
    /// The spans along x, y and z.
    pub spans: [RaySpans<H>; 3],
    /// The counts of decisions.
    pub counts: ResolveCounts,
}

/// The numbers of nodes, components and gaps that were decided, by method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ResolveCounts {
    /// Nodes that lie in a gap of all three of their rays.
    pub open_nodes: u64,
    /// Sets of open nodes that no path of nodes connects to one that is certainly in or out; one test each.
    pub components: u64,
    /// Components that are out: cavities, including pockets whose mouth is narrower than the pitch.
    pub cavities: u64,
    /// Components that are in.
    pub filled: u64,
    /// Gaps of all rays.
    pub gaps: u64,
    /// Gaps between two nodes; one test each.
    pub gaps_tested: u64,
    /// Gaps that are out, and stay.
    pub gaps_out: u64,
}

/// The reason why gaps could not be resolved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ResolveError {
    /// The crossings of different rays contradict one another.
    #[error("lattice node {node:?} is inside by the crossings of one ray and outside by those of another ray")]
    Contradiction {
        /// Indices of the node along x, y and z.
        node: [u32; 3],
    },
    /// The spans at some axis are not those of the grid's rays along it.
    #[error(
        "spans of {rays} rays along {}; those of {expected} rays along {} are needed",
        found.name(), axis.name()
    )]
    Mismatch {
        /// The expected axis.
        axis: Axis,
        /// The axis of the spans.
        found: Axis,
        /// Number of rays of the spans.
        rays: usize,
        /// Number of rays of the grid along `axis`.
        expected: usize,
    },
}

/// Gaps and nodes that are tested between two calls of `progress`.
const BATCH: usize = 256;

/// Decides every gap of the spans along x, y and z, and removes those that are in.
///
/// `progress` is called with the number of completed point tests and their total, at the beginning and after every few of them.
/// The result does not depend on the order of threads. Besides the spans this takes six bytes for each ray along z and, for
/// each thread, about five bits for each node of 32 planes.
pub fn resolve<H: Hit + Sync>(
    grid: &Grid,
    mut spans: [RaySpans<H>; 3],
    exterior: Exterior,
    membership: &impl Membership,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<ResolvedSpans<H>, ResolveError> {
    compare(grid, &spans)?;
    let raster = Raster::new(grid);
    let ends_along_z = spans[2].ends(raster.pixels);
    let slabs: Vec<Result<SlabSets, ResolveError>> = raster
        .slabs()
        .into_par_iter()
        .with_max_len(1)
        .map(|planes| slab::resolve(&raster, planes, (&spans, &ends_along_z), exterior))
        .collect();
    drop(ends_along_z);
    // The first contradiction in order, whichever was found first.
    let slabs = slabs.into_iter().collect::<Result<Vec<SlabSets>, ResolveError>>()?;
    let (mut sets, first_sets) = unite_slabs(&raster, &slabs)?;

    // One node of each component, then a point of each gap between two nodes.
    let set_nodes = (IN + 1..).zip(slabs.iter().flat_map(|slab| &slab.set_nodes));
    let (components, nodes): (Vec<u32>, Vec<[u32; 3]>) = set_nodes.filter(|&(set, _)| sets.is_root(set)).unzip();
    let mut points: Vec<[i32; 3]> = nodes.into_iter().map(|node| node.map(|index| grid.node(index))).collect();
    let thin = slabs.iter().flat_map(|slab| &slab.gaps).flat_map(|gaps| &gaps.thin);
    points.extend(thin.map(|&(_, point)| point));
    let answers = test(&points, membership, progress);
    let (of_components, of_gaps) = answers.split_at(components.len());

    let is_in = sets_that_are_in(&mut sets, &components, of_components);
    let removed = gaps_that_are_in(&slabs, &first_sets, &is_in, of_gaps);
    let total = |count: fn(&SlabSets) -> u64| slabs.iter().map(count).sum::<u64>();
    let (gaps, filled) = (total(|slab| slab.gap_count), of_components.iter().filter(|&&answer| answer).count() as u64);
    let counts = ResolveCounts {
        open_nodes: total(|slab| slab.open_nodes),
        components: components.len() as u64,
        cavities: components.len() as u64 - filled,
        filled,
        gaps,
        gaps_tested: of_gaps.len() as u64,
        gaps_out: gaps - removed.iter().map(|removed| removed.len() as u64).sum::<u64>(),
    };
    drop(slabs);
    spans.par_iter_mut().zip(removed).for_each(|(spans, removed)| fill::fill(spans, removed));
    Ok(ResolvedSpans { spans, counts })
}

/// Checks that the spans are those of the grid's rays along x, y and z.
fn compare<H>(grid: &Grid, spans: &[RaySpans<H>; 3]) -> Result<(), ResolveError> {
    for (axis, spans) in Axis::ALL.into_iter().zip(spans) {
        let (columns, rows) = grid.image_size(axis);
        let (rays, expected) = (spans.offsets.len().saturating_sub(1), columns as usize * rows as usize);
        if spans.axis != axis || rays != expected {
            return Err(ResolveError::Mismatch { axis, found: spans.axis, rays, expected });
        }
    }
    Ok(())
}

/// Returns which sets are in, from the answers for the components.
fn sets_that_are_in(sets: &mut Sets, components: &[u32], answers: &[bool]) -> Vec<bool> {
    let mut is_in = vec![false; sets.len() as usize];
    is_in[IN as usize] = true;
    for (&set, &answer) in components.iter().zip(answers) {
        is_in[set as usize] = answer;
    }
    (0..sets.len()).for_each(|set| is_in[set as usize] = is_in[sets.root(set) as usize]);
    is_in
}

/// Returns the hits that begin gaps which are in, by axis. `answers` are those for gaps between two nodes, in their order.
fn gaps_that_are_in(slabs: &[SlabSets], first_sets: &[u32], is_in: &[bool], answers: &[bool]) -> [Vec<u32>; 3] {
    let mut found: [Vec<u32>; 3] = Default::default();
    let mut answers = answers.iter();
    for (slab, first_set) in slabs.iter().zip(first_sets) {
        for (gaps, found) in slab.gaps.iter().zip(&mut found) {
            found.extend(&gaps.inside);
            let open = gaps.open.iter().filter(|&&(_, set)| is_in[(first_set + set) as usize]);
            found.extend(open.map(|&(hit, _)| hit));
            let tested = gaps.thin.iter().zip(&mut answers);
            found.extend(tested.filter(|&(_, &answer)| answer).map(|(&(hit, _), _)| hit));
        }
    }
    found
}

/// Unites the sets of neighbouring slabs. Set s ≥ 2 of a slab becomes set s plus the slab's entry in the returned vector.
fn unite_slabs(raster: &Raster, slabs: &[SlabSets]) -> Result<(Sets, Vec<u32>), ResolveError> {
    let mut first = Vec::with_capacity(slabs.len());
    let mut count = 0;
    for slab in slabs {
        first.push(count);
        count += slab.set_nodes.len() as u32;
    }
    let mut sets = Sets::new(count);
    let global = |first: u32, set: u32| if set > IN { first + set } else { set };
    for (at, pair) in slabs.windows(2).enumerate() {
        let (before, after) = (&pair[0].last, &pair[1].first);
        let joined = layer::link(before.layer(), after.layer(), &after.walls, |a, b| {
            sets.unite(global(first[at], before.set(a)), global(first[at + 1], after.set(b)))
        });
        joined.map_err(|(word, bit)| raster.contradiction(after.plane, word, bit))?;
    }
    Ok((sets, first))
}

/// Tests whether each point is in the solid.
fn test(points: &[[i32; 3]], membership: &impl Membership, progress: &(dyn Fn(u64, u64) + Sync)) -> Vec<bool> {
    let (done, total) = (AtomicU64::new(0), points.len() as u64);
    progress(0, total);
    let mut answers = vec![false; points.len()];
    let batches = answers.par_chunks_mut(BATCH).zip(points.par_chunks(BATCH));
    batches.for_each_init(Default::default, |memory, (answers, points)| {
        checkpoint();
        for (answer, &point) in answers.iter_mut().zip(points) {
            *answer = membership.contains(point, memory);
        }
        let batch = points.len() as u64;
        progress(done.fetch_add(batch, Ordering::Relaxed) + batch, total);
    });
    answers
}
