//! The flood on the device: from spans to the nodes that it reaches.

use std::sync::Mutex;

use crate::parallel::*;

use super::stages::{CAST, FLOOD, NodeTally, NodeView, REACHED, SEEDS, SPREAD, TALLY_WORDS, device_words, head};
use crate::fixed::Hit;
use crate::gpu::{Device, DeviceError, Pool, Recorder, Stage, StageKernels, Workgroups, bytes_of, held, workgroups};
use crate::grid::Axis;
use crate::minkowski::resolve::layer::Raster;
use crate::minkowski::{Exterior, RaySpans};

/// Rounds of sweeps before the first check for progress; the number doubles after each check.
const FIRST_ROUNDS: u32 = 2;

/// Most rounds between two such checks.
const MOST_ROUNDS: u32 = 32;

/// The result of a flood on a device, in bits of nodes: row after row of words along x, with the last word of a row padded by
/// zeros in `inside` and ones in `outside`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reached {
    /// Nodes that are in, certainly or by connection.
    pub inside: Vec<u64>,
    /// Nodes that are out, certainly or by connection.
    pub outside: Vec<u64>,
    /// For each node, whether a crossing lies between it and the one before it along x, y and z; empty where all nodes are
    /// reached.
    pub walls: [Vec<u64>; 3],
    /// Number of nodes that were neither certainly in nor out.
    pub open_nodes: u64,
}

/// The state kept between floods.
pub struct State {
    pool: Pool,
    kernels: StageKernels,
}

impl State {
    /// Creates an empty state; buffers are filled with the given word, if any, before use.
    pub fn new(prefill: Option<u32>) -> State {
        State { pool: Pool::new(prefill), kernels: StageKernels::new(head()) }
    }
}

/// One flood.
struct Flood<'a> {
    device: &'a Device,
    state: &'a mut State,
    /// The views along x, y and z.
    views: [NodeView; 3],
}

/// Returns the number of words of a mask of all nodes on the device, if it fits.
pub fn admit(device: &Device, raster: &Raster) -> Result<u64, DeviceError> {
    let words = u64::from(device_words(raster)) * raster.nodes[1] as u64 * raster.nodes[2] as u64;
    if bytes_of(words) > device.largest_binding() {
        return Err(device.too_large("masks of nodes", bytes_of(words), device.largest_binding()));
    }
    let longest = raster.nodes[1].max(raster.nodes[2]).max(raster.words);
    device.admit_rounds(longest as u32)?;
    Ok(words)
}

/// Runs the flood; returns `None` where some node is reached from both sides.
pub fn flood<H: Hit + Sync>(
    device: &Device,
    state: &Mutex<State>,
    raster: &Raster,
    spans: &[RaySpans<H>; 3],
    exterior: Exterior,
) -> Result<Option<Reached>, DeviceError> {
    let words = admit(device, raster)?;
    let state = &mut *held(state);
    let views = Axis::ALL.map(|axis| NodeView::new(raster, axis, exterior));
    Flood { device, state, views }.run(words, spans)
}

impl Flood<'_> {
    fn run<H: Hit + Sync>(&mut self, words: u64, spans: &[RaySpans<H>; 3]) -> Result<Option<Reached>, DeviceError> {
        let device = self.device;
        let [inside, outside] = [self.words("inside", words)?, self.words("outside", words)?];
        let walls = [self.words("walls x", words)?, self.words("walls y", words)?, self.words("walls z", words)?];
        let tally = self.words("tally", TALLY_WORDS)?;

        let mut recorder = Recorder::new(device);
        self.cast(&mut recorder, words, spans, &walls, [&inside, &outside])?;
        let by_word = || workgroups(words as u32);
        self.dispatch(&mut recorder, &SEEDS, Axis::X, &[(1, &inside), (2, &outside)], by_word())?;
        recorder.clear(&tally, bytes_of(TALLY_WORDS));
        let counted = [(1, &inside), (2, &outside), (3, &tally)];
        self.dispatch(&mut recorder, &REACHED, Axis::X, &counted, by_word())?;
        recorder.read_back(&tally, 0, bytes_of(TALLY_WORDS));
        let seeds = recorder.finish(|parts| tally_of(parts[0]))?;

        // Also where no node is open: certain nodes may be contradictory.
        self.spread(&walls, [&inside, &outside], &tally)?;

        let mut recorder = Recorder::new(device);
        recorder.clear(&tally, bytes_of(TALLY_WORDS));
        self.dispatch(&mut recorder, &REACHED, Axis::X, &counted, by_word())?;
        recorder.read_back(&tally, 0, bytes_of(TALLY_WORDS));
        recorder.read_back(&inside, 0, bytes_of(words));
        recorder.read_back(&outside, 0, bytes_of(words));
        let (end, mut reached) = recorder.finish(|parts| {
            let reached = Reached {
                inside: host_words(parts[1]),
                outside: host_words(parts[2]),
                walls: Default::default(),
                open_nodes: open_in(&seeds),
            };
            (tally_of(parts[0]), reached)
        })?;
        if end.contradictory != 0 {
            return Ok(None);
        }
        if open_in(&end) > 0 {
            let mut recorder = Recorder::new(device);
            walls.iter().for_each(|walls| recorder.read_back(walls, 0, bytes_of(words)));
            reached.walls = recorder.finish(|parts| [0, 1, 2].map(|axis| host_words(parts[axis])))?;
        }
        Ok(Some(reached))
    }

    /// Sweeps round after round until one reaches nothing new.
    fn spread(
        &mut self,
        walls: &[wgpu::Buffer; 3],
        [inside, outside]: [&wgpu::Buffer; 2],
        tally: &wgpu::Buffer,
    ) -> Result<(), DeviceError> {
        let mut rounds = FIRST_ROUNDS;
        loop {
            let mut recorder = Recorder::new(self.device);
            for left in (0..rounds).rev() {
                if left == 0 {
                    recorder.clear(tally, bytes_of(TALLY_WORDS));
                }
                for axis in Axis::ALL {
                    let bound = [(1, &walls[axis.depth()]), (2, inside), (3, outside), (4, tally)];
                    self.by_line(&mut recorder, &FLOOD[axis.depth()], axis, &bound)?;
                }
            }
            recorder.read_back(tally, 0, bytes_of(TALLY_WORDS));
            if recorder.finish(|parts| tally_of(parts[0]))?.changed == 0 {
                return Ok(());
            }
            rounds = (2 * rounds).min(MOST_ROUNDS);
        }
    }

    /// Records the combination of the rays along all axes: the nodes inside, and those within all crossings.
    fn cast<H: Hit + Sync>(
        &mut self,
        recorder: &mut Recorder,
        words: u64,
        spans: &[RaySpans<H>; 3],
        walls: &[wgpu::Buffer; 3],
        [inside, hull]: [&wgpu::Buffer; 2],
    ) -> Result<(), DeviceError> {
        let [changes, ends] = [self.words("changes", words)?, self.words("ends", words)?];
        for (axis, spans) in Axis::ALL.into_iter().zip(spans) {
            let walls = &walls[axis.depth()];
            let crossings: Vec<u32> = spans.hits.par_iter().map(|hit| hit.crossing().0).collect();
            let starts = self.upload("starts of spans", &spans.offsets)?;
            let crossings_there = self.upload("ends of spans", &crossings)?;
            for mask in [&changes, &ends, walls] {
                recorder.clear(mask, bytes_of(words));
            }
            let bound = [(1, &starts), (2, &crossings_there), (3, &changes), (4, &ends), (5, walls)];
            self.dispatch(recorder, &CAST, axis, &bound, workgroups(crossings.len() as u32))?;
            let bound = [(1, &changes), (2, &ends), (3, inside), (4, hull)];
            self.by_line(recorder, &SPREAD[axis.depth()], axis, &bound)?;
        }
        Ok(())
    }

    fn words(&mut self, name: &'static str, words: u64) -> Result<wgpu::Buffer, DeviceError> {
        self.state.pool.room(self.device, name, bytes_of(words))
    }

    fn upload(&self, what: &'static str, words: &[u32]) -> Result<wgpu::Buffer, DeviceError> {
        let bytes = bytes_of(words.len() as u64);
        if bytes > self.device.largest_binding() {
            return Err(self.device.too_large(what, bytes, self.device.largest_binding()));
        }
        self.device.upload(what, bytemuck::cast_slice(words))
    }

    /// Runs a kernel with one invocation per line of words along an axis.
    fn by_line(
        &mut self,
        recorder: &mut Recorder,
        stage: &'static Stage,
        axis: Axis,
        buffers: &[(u32, &wgpu::Buffer)],
    ) -> Result<(), DeviceError> {
        self.dispatch(recorder, stage, axis, buffers, workgroups(self.views[axis.depth()].lines))
    }

    fn dispatch(
        &mut self,
        recorder: &mut Recorder,
        stage: &'static Stage,
        axis: Axis,
        buffers: &[(u32, &wgpu::Buffer)],
        workgroups: Workgroups,
    ) -> Result<(), DeviceError> {
        let view = recorder.uniform(bytemuck::bytes_of(&self.views[axis.depth()]));
        recorder.dispatch(self.state.kernels.get(self.device, stage)?, view, buffers, workgroups);
        Ok(())
    }
}

fn tally_of(words: &[u32]) -> NodeTally {
    bytemuck::cast_slice(words)[0]
}

/// Returns the number of nodes that no state had reached.
fn open_in(tally: &NodeTally) -> u64 {
    u64::from(tally.open_low) | u64::from(tally.open_high) << 32
}

/// Converts words of the device to words of the host, the lower half first.
fn host_words(words: &[u32]) -> Vec<u64> {
    words.par_chunks_exact(2).map(|pair| u64::from(pair[0]) | u64::from(pair[1]) << 32).collect()
}
