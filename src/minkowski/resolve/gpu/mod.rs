//! Gap resolution with the flood on a GPU.
//!
//! The device makes whole masks of nodes from the ends of spans (`cast`, `spread`), takes the nodes that are certainly in and
//! certainly out as seeds (`seeds`), and lets both spread to neighbours that no crossing separates from them, by sweeps along
//! each axis and back (`flood`), round after round until nothing changes. A sweep goes as far as it can, so that the number of
//! rounds is that of the turns of the most winding path, not its length. Both states come back, and with them, where some nodes
//! are reached by neither, the crossings between nodes: their components, of which there are few, are found and tested on the
//! host.
//!
//! The result is that of [`resolve`](super::resolve()), which needs no flood and no masks of all nodes at once. Where rays
//! contradict one another, that function identifies the node.

mod flood;
mod stages;

use std::sync::{Arc, Mutex};

use crate::parallel::*;

use super::layer::{Layer, Raster, find_runs, link, link_row};
use super::masks::{RayGap, Rays};
use super::sets::{IN, OUT, Sets};
use super::slab::{SlabGaps, point_between};
use super::{ResolveCounts, ResolveError, ResolvedSpans, compare, fill, test};
use crate::fixed::Hit;
use crate::gpu::{Device, DeviceError};
use crate::grid::{Axis, Grid};
use crate::minkowski::{Exterior, Membership, RaySpans};
use flood::State;

pub use flood::Reached;

/// A gap resolver that uses one device. Calls from several threads take turns.
pub struct GpuResolver {
    device: Arc<Device>,
    state: Mutex<State>,
}

/// The reason why gaps could not be resolved with a device.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuResolveError {
    /// They cannot be resolved by any method.
    #[error(transparent)]
    Resolve(#[from] ResolveError),
    /// The device failed, or has no memory for masks of all nodes.
    #[error(transparent)]
    Device(#[from] DeviceError),
}

/// Rays whose gaps one task processes.
const RAYS_PER_TASK: usize = 4096;

impl GpuResolver {
    /// Creates a resolver on a device, such as that of a sampler.
    pub fn new(device: &Arc<Device>) -> GpuResolver {
        GpuResolver { device: Arc::clone(device), state: Mutex::new(State::new(None)) }
    }

    /// Creates a resolver that fills every buffer with a word before use, so that tests detect unwritten elements.
    pub fn prefilled(device: &Arc<Device>, word: u32) -> GpuResolver {
        GpuResolver { device: Arc::clone(device), state: Mutex::new(State::new(Some(word))) }
    }

    /// Refuses a grid whose masks of nodes exceed the device's largest binding, or whose sweeps need longer loops than the
    /// device is certain to complete. Call it before spans are made.
    pub fn admit(&self, grid: &Grid) -> Result<(), DeviceError> {
        flood::admit(&self.device, &Raster::new(grid)).map(drop)
    }

    /// Decides every gap of the spans along x, y and z, and removes those that are in; the result equals that of
    /// [`resolve`](super::resolve()), including the tested points. Takes seven bits for each node of the grid on the device, in
    /// buffers of one bit each, and up to seven on the host.
    pub fn resolve<H: Hit + Sync>(
        &self,
        grid: &Grid,
        mut spans: [RaySpans<H>; 3],
        exterior: Exterior,
        membership: &impl Membership,
        progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<ResolvedSpans<H>, GpuResolveError> {
        let Some(reached) = self.reached(grid, &spans, exterior)? else {
            return Ok(super::resolve(grid, spans, exterior, membership, progress)?);
        };
        let raster = Raster::new(grid);
        let components = Components::of(&raster, &reached);
        let gaps = Axis::ALL.map(|axis| components.gaps(&raster, &spans[axis.depth()], exterior, &reached));

        let open = Open { components, gaps };
        let points = open.points(grid);
        let answers = test(&points, membership, progress);
        let (of_components, of_gaps) = answers.split_at(open.components.nodes.len());
        let removed = open.gaps_that_are_in(of_components, of_gaps);
        let filled = of_components.iter().filter(|&&answer| answer).count() as u64;
        let gaps = open.gaps.iter().flatten().map(|gaps| gaps.count).sum::<u64>();
        let counts = ResolveCounts {
            open_nodes: reached.open_nodes,
            components: of_components.len() as u64,
            cavities: of_components.len() as u64 - filled,
            filled,
            gaps,
            gaps_tested: of_gaps.len() as u64,
            gaps_out: gaps - removed.iter().map(|removed| removed.len() as u64).sum::<u64>(),
        };
        drop((reached, open));
        spans.par_iter_mut().zip(removed).for_each(|(spans, removed)| fill::fill(spans, removed));
        Ok(ResolvedSpans { spans, counts })
    }

    /// Returns the nodes that the flood reaches; `None` where some node is reached from both sides. For verification of the
    /// device and for inspection.
    pub fn reached<H: Hit + Sync>(
        &self,
        grid: &Grid,
        spans: &[RaySpans<H>; 3],
        exterior: Exterior,
    ) -> Result<Option<Reached>, GpuResolveError> {
        compare(grid, spans)?;
        Ok(flood::flood(&self.device, &self.state, &Raster::new(grid), spans, exterior)?)
    }
}

/// The sets of nodes that the flood has not reached.
#[derive(Default)]
struct Components {
    /// The first node of each set, from set 2 on.
    nodes: Vec<[u32; 3]>,
    /// The set of each run of such nodes along x.
    sets: Vec<u32>,
    open: Vec<u64>,
    starts: Vec<u64>,
    elements: Vec<u32>,
}

/// The components and gaps that are undecided when the flood is over.
struct Open {
    components: Components,
    /// The gaps of the rays along x, y and z.
    gaps: [Vec<RayGaps>; 3],
}

/// Gaps of some rays.
#[derive(Default)]
struct RayGaps {
    gaps: SlabGaps,
    count: u64,
}

impl Open {
    /// Returns the points to test: one node of each component, then a point of each gap between two nodes.
    fn points(&self, grid: &Grid) -> Vec<[i32; 3]> {
        let nodes = self.components.nodes.iter().map(|node| node.map(|index| grid.node(index)));
        let thin = self.gaps.iter().flatten().flat_map(|gaps| &gaps.gaps.thin);
        nodes.chain(thin.map(|&(_, point)| point)).collect()
    }

    /// Returns the hits that begin gaps which are in, by axis, from the answers for components and for gaps between two nodes.
    fn gaps_that_are_in(&self, of_components: &[bool], of_gaps: &[bool]) -> [Vec<u32>; 3] {
        let mut of_gaps = of_gaps.iter();
        self.gaps.each_ref().map(|tasks| {
            let mut found = Vec::new();
            for RayGaps { gaps, .. } in tasks {
                found.extend(&gaps.inside);
                let open = gaps.open.iter().filter(|&&(_, set)| of_components[(set - IN - 1) as usize]);
                found.extend(open.map(|&(hit, _)| hit));
                let tested = gaps.thin.iter().zip(&mut of_gaps);
                found.extend(tested.filter(|&(_, &answer)| answer).map(|(&(hit, _), _)| hit));
            }
            found
        })
    }
}

impl Components {
    /// Unites runs of nodes as slabs do.
    fn of(raster: &Raster, reached: &Reached) -> Components {
        let Reached { inside, outside, walls: [walls_x, walls_y, walls_z], .. } = reached;
        if walls_x.is_empty() {
            return Components::default();
        }
        let (row, plane) = (raster.words, raster.plane());
        let mut walls_x = walls_x.clone();
        if !raster.nodes[0].is_multiple_of(64) {
            // The bits of the last word beyond the last node are connected to nothing.
            walls_x.chunks_mut(row).for_each(|walls| walls[row - 1] |= 1 << (raster.nodes[0] % 64));
        }
        let open: Vec<u64> = inside.par_iter().zip(outside).map(|(inside, outside)| !(inside | outside)).collect();
        let (mut starts, mut elements) = (vec![0; open.len()], vec![0; open.len()]);
        let mut next = IN + 1;
        for first in (0..open.len()).step_by(row) {
            let words = first..first + row;
            let (starts, elements) = (&mut starts[words.clone()], &mut elements[words.clone()]);
            next = find_runs(&open[words.clone()], &walls_x[words], starts, elements, next);
        }
        let mut sets = Sets::new(next - IN - 1);
        let layer = |words: std::ops::Range<usize>| Layer {
            open: &open[words.clone()],
            inside: &inside[words.clone()],
            starts: &starts[words.clone()],
            elements: &elements[words],
        };
        let mut unite = |a, b| sets.unite(a, b);
        let flooded = "the flood has reached all that it touches";
        for first in (0..open.len()).step_by(plane) {
            for (at, walls) in walls_x[first..first + plane].chunks(row).enumerate() {
                let first = first + at * row;
                link_row(layer(first..first + row), walls, &mut unite).expect(flooded);
            }
            let (before, after) = (first..first + plane - row, first + row..first + plane);
            link(layer(before), layer(after.clone()), &walls_y[after], &mut unite).expect(flooded);
            if first > 0 {
                let after = first..first + plane;
                link(layer(first - plane..first), layer(after.clone()), &walls_z[after], &mut unite).expect(flooded);
            }
        }
        let (sets, least) = sets.number();
        let whole = layer(0..open.len());
        let node = |element| {
            let (word, bit) = whole.start_of(element);
            raster.node(0, word, bit)
        };
        let nodes = least.into_iter().map(node).collect();
        Components { nodes, sets, open, starts, elements }
    }

    /// Classifies the gaps of all rays along an axis; those that are out are omitted.
    fn gaps<H: Hit + Sync>(
        &self,
        raster: &Raster,
        spans: &RaySpans<H>,
        exterior: Exterior,
        reached: &Reached,
    ) -> Vec<RayGaps> {
        let rays = Rays::new(raster, spans, exterior);
        let (axis, count) = (spans.axis, spans.offsets.len() - 1);
        let columns = raster.nodes[axis.column()];
        let of_task = |first: usize| {
            let mut found = RayGaps::default();
            for ray in first..count.min(first + RAYS_PER_TASK) {
                let mut node = [0; 3];
                (node[axis.column()], node[axis.row()]) = (ray % columns, ray / columns);
                let take = |gap: RayGap| {
                    found.count += 1;
                    let (from, to) = gap.nodes;
                    node[axis.depth()] = from;
                    if from == to {
                        found.gaps.thin.push((gap.hit, point_between(raster, spans, node, gap.hit)));
                        return;
                    }
                    let [x, y, z] = node;
                    let (word, bit) = ((z * raster.nodes[1] + y) * raster.words + x / 64, (x % 64) as u32);
                    match self.set_of(reached, word, bit) {
                        OUT => {}
                        IN => found.gaps.inside.push(gap.hit),
                        set => found.gaps.open.push((gap.hit, set)),
                    }
                };
                rays.walk(ray as u32, &(0..raster.nodes[axis.depth()]), |_| {}, take);
            }
            found
        };
        (0..count.div_ceil(RAYS_PER_TASK)).into_par_iter().map(|task| of_task(task * RAYS_PER_TASK)).collect()
    }

    fn set_of(&self, reached: &Reached, word: usize, bit: u32) -> u32 {
        if reached.outside[word] >> bit & 1 == 1 {
            return OUT;
        }
        if reached.inside[word] >> bit & 1 == 1 {
            return IN;
        }
        let layer = Layer { open: &self.open, inside: &reached.inside, starts: &self.starts, elements: &self.elements };
        self.sets[layer.element(word, bit) as usize]
    }
}
