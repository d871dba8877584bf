//! The dispatches that the routes share.

use super::image::{BandError, BandJob};
use super::solid::Chunk;
use super::stages::{GeometryPass, PLAN, SCAN, Stage};
use super::view::{BLOCK_ROWS, PLANNED_WORDS, Planned, SCAN_BLOCK, View};
use crate::gpu::{DeviceError, Recorder, Workgroups, bytes_of, workgroups};

/// Largest number of blocks that the queue of large triangles holds.
const QUEUE_CAPACITY: u64 = 1 << 20;

/// Largest number of items of a prefix sum: one dimension of workgroups, of which every adapter allows 65 535.
pub const MOST_SCANNED: u64 = 65_535 * SCAN_BLOCK as u64;

impl BandJob<'_> {
    /// Returns the view of the band.
    pub fn view(&self) -> View {
        View::new(&self.image.grid, self.image.axis, &self.band, &self.image.window)
    }

    /// Refuses several buffers of this many words each, where one exceeds a binding or all of them exceed the memory
    /// budget. A single ray, which cannot be divided further, may exceed the budget.
    pub fn admit(&self, what: &'static str, words: u64, buffers: u64) -> Result<(), BandError> {
        let bytes = bytes_of(words);
        let budget = if self.band.rays() > 1 { self.sampler.options.memory / buffers } else { u64::MAX };
        let limit = self.sampler.largest_binding().min(budget);
        if bytes > limit { Err(BandError::TooLarge { what, bytes, limit }) } else { Ok(()) }
    }

    /// Returns a pooled buffer with room for this many words.
    pub fn words(&mut self, name: &'static str, words: u64) -> Result<wgpu::Buffer, DeviceError> {
        self.pool.room(&self.sampler.device, name, bytes_of(words))
    }

    /// Runs one kernel with one invocation per ray.
    pub fn by_ray(
        &self,
        recorder: &mut Recorder,
        stage: &'static Stage,
        buffers: &[(u32, &wgpu::Buffer)],
    ) -> Result<(), DeviceError> {
        self.run(recorder, stage, buffers, workgroups(self.band.rays()))
    }

    /// Runs one kernel.
    pub fn run(
        &self,
        recorder: &mut Recorder,
        stage: &'static Stage,
        buffers: &[(u32, &wgpu::Buffer)],
        workgroups: Workgroups,
    ) -> Result<(), DeviceError> {
        let kernel = self.sampler.kernels.get(&self.sampler.device, stage, self.image.flags())?;
        recorder.dispatch(&kernel, buffers, workgroups);
        Ok(())
    }

    /// Prepares for geometry passes whose completeness [`none_left_out`](Self::none_left_out) is to check.
    pub fn watch_queue(&mut self, recorder: &mut Recorder) -> Result<wgpu::Buffer, DeviceError> {
        let planned = self.words("planned workgroups", PLANNED_WORDS)?;
        recorder.clear(&planned, bytes_of(PLANNED_WORDS));
        Ok(planned)
    }

    /// Refuses the band if the queue had no room for some blocks of large triangles. A band of few rays has none.
    pub fn none_left_out(&self, planned: &[u32]) -> Result<(), BandError> {
        let planned: Planned = bytemuck::cast_slice(planned)[0];
        match u64::from(planned.left_out) {
            0 => Ok(()),
            blocks => {
                let limit = 8 * QUEUE_CAPACITY;
                Err(BandError::TooLarge { what: "blocks of large triangles", bytes: limit + 8 * blocks, limit })
            }
        }
    }

    /// Runs one pass over the geometry of solid `i`, whose crossings begin at `first_crossing` where it stores any.
    pub fn geometry_pass(
        &mut self,
        recorder: &mut Recorder,
        pass: &'static GeometryPass,
        i: usize,
        first_crossing: u32,
        buffers: &[(u32, &wgpu::Buffer)],
    ) -> Result<(), DeviceError> {
        let solids = self.solids;
        let room = self.sampler.largest_binding().saturating_sub(8) / 8;
        let triangles = solids[i].chunks.iter().map(|chunk| chunk.count).max().unwrap_or(0);
        let most_blocks = u64::from(triangles) * u64::from(self.band.rows.div_ceil(BLOCK_ROWS));
        let capacity = most_blocks.min(QUEUE_CAPACITY).min(room) as u32;
        let queue = self.words("queue", 2 + 2 * u64::from(capacity))?;
        let planned = self.words("planned workgroups", PLANNED_WORDS)?;
        for Chunk { positions, triangles, first_triangle, count } in &solids[i].chunks {
            let view = View {
                triangles: *count,
                first_triangle: *first_triangle,
                queue_capacity: capacity,
                first_crossing,
                ..self.view()
            };
            let view = recorder.uniform(bytemuck::bytes_of(&view));
            recorder.clear(&queue, 8);
            let mut bound = vec![(0, &view), (1, positions), (2, triangles), (3, &queue)];
            bound.extend(buffers);
            self.run(recorder, &pass.triangles, &bound, workgroups(*count))?;
            self.run(recorder, &PLAN, &[(0, &view), (1, &queue), (2, &planned)], Workgroups::Counted(1, 1))?;
            self.run(recorder, &pass.blocks, &bound, Workgroups::Indirect(&planned))?;
        }
        Ok(())
    }

    /// Writes the exclusive prefix sum of the `counts` of all rays into `starts`; after one entry per ray come the
    /// total and the maximum.
    pub fn scan(
        &mut self,
        recorder: &mut Recorder,
        counts: &wgpu::Buffer,
        starts: &wgpu::Buffer,
    ) -> Result<(), DeviceError> {
        self.scan_of(recorder, self.band.rays(), counts, starts)
    }

    /// Writes the prefix sum of this many counts, of rays or of anything else.
    pub fn scan_of(
        &mut self,
        recorder: &mut Recorder,
        items: u32,
        counts: &wgpu::Buffer,
        starts: &wgpu::Buffer,
    ) -> Result<(), DeviceError> {
        let blocks = items.div_ceil(SCAN_BLOCK);
        let sums = self.words("block sums", 2 * u64::from(blocks))?;
        let view = recorder.uniform(bytemuck::bytes_of(&View { rays: items, ..self.view() }));
        for (stage, groups) in SCAN.iter().zip([blocks, 1, blocks]) {
            let buffers = [(0, &view), (1, counts), (2, &sums), (3, starts)];
            self.run(recorder, stage, &buffers, Workgroups::Counted(groups, 1))?;
        }
        Ok(())
    }
}
