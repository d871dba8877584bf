//! Culling on a GPU: every candidate pair of features, one invocation per pair.
//!
//! The test of a pair is that of the CPU, by the same exact signs; a device tests all pairs where the CPU looks up the few
//! whose normals may meet. Features are found on the host, and pairs that are kept come back in the order of arrival and are
//! sorted, so that the result is the same on any device. It has the primitives that [`cull`](super::cull()) has, in another
//! order.

mod stages;

use std::sync::{Arc, Mutex};

use rayon::prelude::*;

use super::distinct::Shape;
use super::features::{Edge, Features};
use super::sign::{Direction, Normal};
use super::{assemble, edge_on_edge, facet_on_corner};
use crate::gpu::{Device, DeviceError, Pool, Recorder, Stage, StageKernels, bytes_of, held, workgroups};
use crate::minkowski::{CullCounts, Polyhedron, Primitives};
use crate::sampler::gpu::Arithmetic;
use stages::{CORNERS, DIRECTION_WORDS, EDGES, NORMAL_WORDS, PairView, head};

/// Pairs of one dispatch, limited so that a device that also draws stays responsive.
const PAIRS_AT_ONCE: u32 = 1 << 26;

/// Pairs whose shapes one task makes.
const PAIRS_PER_TASK: usize = 1 << 14;

/// A culler on one device. Calls from several threads take turns.
pub struct GpuCuller {
    device: Arc<Device>,
    state: Mutex<State>,
}

/// The state kept between calls.
struct State {
    pool: Pool,
    kernels: StageKernels,
}

impl GpuCuller {
    /// Creates a culler on a device, such as that of a sampler, with the arithmetic of that sampler.
    pub fn new(device: &Arc<Device>, arithmetic: Arithmetic) -> GpuCuller {
        GpuCuller::prefilled(device, arithmetic, None)
    }

    /// Creates a culler that fills every buffer with a word, if one is given, before use, so that tests detect unwritten
    /// elements.
    pub fn prefilled(device: &Arc<Device>, arithmetic: Arithmetic, word: Option<u32>) -> GpuCuller {
        let state = State { pool: Pool::new(word), kernels: StageKernels::new(head(arithmetic)) };
        GpuCuller { device: Arc::clone(device), state: Mutex::new(state) }
    }

    /// Returns the primitives that cover the boundary of A ⊕ B, as [`cull`](super::cull()) finds them, and the counts of pairs.
    pub fn cull(&self, a: &Polyhedron, b: &Polyhedron) -> Result<(Primitives, CullCounts), DeviceError> {
        let (a_features, b_features) = rayon::join(|| Features::new(a), || Features::new(b));
        let (mut lists, mut visited) = (Vec::new(), 0);
        for (of, on) in [(&a_features, &b_features), (&b_features, &a_features)] {
            let shape = |&[facet, corner]: &[u32; 2]| {
                facet_on_corner(of, &of.facets[facet as usize], on, &on.corners[corner as usize])
            };
            lists.extend(shapes(&self.facets_on_corners(of, on)?, shape));
            visited += of.facets.len() as u64 * on.corners.len() as u64;
        }
        let shape = |&[of_a, of_b]: &[u32; 2]| {
            let (of_a, turned) = (&a_features.edges[of_a as usize], of_b as usize % 2);
            let of_b = &b_features.edges[of_b as usize / 2];
            Shape::parallelogram(edge_on_edge(&a_features, of_a, &b_features, of_b)[turned])
        };
        lists.extend(shapes(&self.edges_on_edges(&a_features, &b_features)?, shape));
        visited += a_features.edges.len() as u64 * b_features.edges.len() as u64;
        Ok(assemble([a, b], [&a_features, &b_features], lists, visited))
    }

    /// Returns the pairs of facets and corners that make primitives.
    fn facets_on_corners(&self, of: &Features, on: &Features) -> Result<Vec<[u32; 2]>, DeviceError> {
        let facets: Vec<u32> = of.facets.iter().flat_map(|facet| words_of_normal(&facet.normal)).collect();
        let corners: Vec<u32> = on.corners.iter().flat_map(|corner| corner.spokes).collect();
        let spokes: Vec<u32> = on.spokes.iter().flat_map(words_of_direction).collect();
        let pairs = [of.facets.len(), on.corners.len()];
        self.kept(&CORNERS, pairs, &[("facets", &facets), ("corners", &corners), ("spokes", &spokes)])
    }

    /// Returns the pairs of edges that make primitives; for the second edge twice its index, plus one for the reversed
    /// parallelogram.
    fn edges_on_edges(&self, a: &Features, b: &Features) -> Result<Vec<[u32; 2]>, DeviceError> {
        let edges = |of: &Features| of.edges.iter().flat_map(words_of_edge).collect::<Vec<u32>>();
        let sides = |of: &Features| of.sides.iter().flat_map(words_of_normal).collect::<Vec<u32>>();
        let (of_a, of_b) = ((edges(a), sides(a)), (edges(b), sides(b)));
        let buffers: [(&'static str, &[u32]); 4] = [
            ("edges", &of_a.0),
            ("sides", &of_a.1),
            ("edges of the second", &of_b.0),
            ("sides of the second", &of_b.1),
        ];
        self.kept(&EDGES, [a.edges.len(), b.edges.len()], &buffers)
    }

    /// Runs a stage over all pairs and returns the kept ones, ascending. Runs twice if the buffer was too small.
    fn kept(
        &self,
        stage: &'static Stage,
        [firsts, others]: [usize; 2],
        features: &[(&'static str, &[u32])],
    ) -> Result<Vec<[u32; 2]>, DeviceError> {
        if firsts == 0 || others == 0 {
            return Ok(Vec::new());
        }
        let State { pool, kernels } = &mut *held(&self.state);
        let largest = self.device.largest_binding();
        let mut uploaded = Vec::new();
        for &(what, words) in features {
            let bytes = bytes_of(words.len() as u64);
            if bytes > largest {
                return Err(self.device.too_large(what, bytes, largest));
            }
            uploaded.push(self.device.upload(what, bytemuck::cast_slice(words))?);
        }
        let kernel = kernels.get(&self.device, stage)?;
        let count = pool.room(&self.device, "kept pairs count", bytes_of(1))?;
        // Convex solids yield about one pair for each feature.
        let mut room = 4 * (firsts + others) as u64;
        loop {
            let kept = pool.room(&self.device, "kept pairs", bytes_of(2 * room).min(largest))?;
            let capacity = (kept.size() / 8).min(u32::MAX.into()) as u32;
            let mut recorder = Recorder::new(&self.device);
            recorder.clear(&count, bytes_of(1));
            let at_once = (PAIRS_AT_ONCE as usize / others).max(1);
            for first in (0..firsts).step_by(at_once) {
                let pairs = (at_once.min(firsts - first) * others) as u32;
                let view = PairView { first: first as u32, others: others as u32, pairs, capacity };
                let view = recorder.uniform(bytemuck::bytes_of(&view));
                let mut bound = vec![(0, &view)];
                bound.extend(uploaded.iter().chain([&kept, &count]).zip(1..).map(|(buffer, at)| (at, buffer)));
                recorder.dispatch(kernel, &bound, workgroups(pairs));
            }
            recorder.read_back(&count, 0, bytes_of(1));
            let found = recorder.finish()?[0][0];
            if found <= capacity {
                let mut recorder = Recorder::new(&self.device);
                recorder.read_back(&kept, 0, bytes_of(2 * u64::from(found)));
                let words = recorder.finish()?.swap_remove(0);
                let mut pairs: Vec<[u32; 2]> =
                    words.chunks_exact(2).take(found as usize).map(|pair| [pair[0], pair[1]]).collect();
                pairs.sort_unstable();
                return Ok(pairs);
            }
            room = u64::from(found);
            if bytes_of(2 * room) > largest {
                return Err(self.device.too_large("kept pairs", bytes_of(2 * room), largest));
            }
        }
    }
}

/// Makes the shapes of pairs, one list for each task.
fn shapes(pairs: &[[u32; 2]], shape: impl Fn(&[u32; 2]) -> Shape + Sync) -> Vec<Vec<Shape>> {
    pairs.par_chunks(PAIRS_PER_TASK).map(|pairs| pairs.iter().map(&shape).collect()).collect()
}

fn words_of_normal(normal: &Normal) -> [u32; NORMAL_WORDS] {
    let mut words = [0; NORMAL_WORDS];
    let mut size = 0_f32;
    for (i, component) in normal.exact.into_iter().enumerate() {
        // Rounded to nearest, which is guaranteed on the host.
        let rounded = component as f32;
        size = size.max(rounded.abs());
        [words[2 * i], words[2 * i + 1]] = [component as u32, (component >> 32) as u32];
        words[6 + i] = rounded.to_bits();
    }
    words[9] = size.to_bits();
    words
}

fn words_of_direction(along: &Direction) -> [u32; DIRECTION_WORDS] {
    let rounded = along.exact.map(|component| component as f32);
    let size = rounded.into_iter().fold(0_f32, |size, component| size.max(component.abs()));
    let [x, y, z] = along.exact.map(|component| component as u32);
    let [rx, ry, rz] = rounded.map(f32::to_bits);
    [x, y, z, rx, ry, rz, size.to_bits()]
}

fn words_of_edge(edge: &Edge) -> [u32; DIRECTION_WORDS + 3] {
    let along = words_of_direction(&edge.along);
    let [first, turn, end] = edge.sides;
    let sides = [first, if edge.may_face_anywhere() { u32::MAX } else { turn }, end];
    std::array::from_fn(|i| if i < DIRECTION_WORDS { along[i] } else { sides[i - DIRECTION_WORDS] })
}
