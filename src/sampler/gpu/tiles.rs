//! The route by tiles: masks that never leave the memory of a workgroup.

use super::image::{BandError, BandJob, MadeBand};
use super::solid::Chunk;
use super::stages::{BIN, COMPACT, FILL_BINS, TILES};
use super::view::{PLANNED_WORDS, TALLY_WORDS, TILE_SIDE, View};
use crate::gpu::{Recorder, bytes_of, counted};

/// The triangles of each tile of a band.
struct Bins {
    tiles: u32,
    /// The offset of the triangles of each tile.
    starts: wgpu::Buffer,
    triangles: wgpu::Buffer,
}

/// The samples of all rays, not yet in the order of rays.
struct Loose {
    counts: wgpu::Buffer,
    places: wgpu::Buffer,
    offsets: wgpu::Buffer,
    samples: wgpu::Buffer,
    tally: wgpu::Buffer,
    total: u64,
}

impl<'a> BandJob<'a> {
    /// Makes the band. A solid whose geometry needs several bindings uses lists, since a tile needs all of its
    /// triangles.
    pub fn make_by_tiles(&mut self) -> Result<MadeBand<'a>, BandError> {
        let solids = self.solids;
        let [chunk] = &solids[0].chunks[..] else { return self.make_by_lists() };
        let mut recorder = Recorder::new(&self.sampler.device);
        let bins = self.bins(&mut recorder)?;
        let Loose { counts, places, offsets, samples: loose, tally, total } =
            self.sample_tiles(recorder, chunk, &bins)?;
        let samples = self.words("samples", total)?;
        let mut recorder = Recorder::new(&self.sampler.device);
        let view = recorder.uniform(bytemuck::bytes_of(&self.view()));
        let bound = [(0, &view), (1, &places), (2, &places), (3, &loose), (4, &offsets), (5, &samples)];
        self.by_ray(&mut recorder, &COMPACT, &bound)?;
        Ok(MadeBand { recorder, counts, offsets, samples, triangles: None, tally, most_samples: total })
    }

    /// Counts the triangles of each tile and records the pass that lists them.
    fn bins(&mut self, recorder: &mut Recorder) -> Result<Bins, BandError> {
        let columns = self.band.columns();
        let tiles = (columns.end - columns.start).div_ceil(TILE_SIDE) * self.band.rows.div_ceil(TILE_SIDE);
        let counts = self.words("tile counts", tiles.into())?;
        let starts = self.words("tile starts", u64::from(tiles) + 2)?;
        let mut counting = Recorder::new(&self.sampler.device);
        let planned = self.watch_queue(&mut counting)?;
        counting.clear(&counts, bytes_of(tiles.into()));
        self.geometry_pass(&mut counting, &BIN, 0, 0, &[(4, &counts)])?;
        self.scan_of(&mut counting, tiles, &counts, &starts)?;
        counting.read_back(&starts, bytes_of(tiles.into()), 8);
        counting.read_back(&planned, 0, bytes_of(PLANNED_WORDS));
        let found = counting.finish()?;
        self.none_left_out(&found[1])?;
        let [binned, greatest] = [found[0][0], found[0][1]];
        // A lane iterates over a sixty-fourth of the triangles of its tile, and over up to 64 rays for each, perhaps
        // twice.
        self.sampler.device.admit_rounds(greatest / 4)?;
        let binned = u64::from(binned);
        self.admit("triangles of tiles", binned, 1)?;
        let triangles = self.words("triangles of tiles", binned)?;
        let none = self.words("none", 1)?;
        let bound = [(4, &counts), (5, &starts), (6, &triangles), (7, &none)];
        self.geometry_pass(recorder, &FILL_BINS, 0, 0, &bound)?;
        Ok(Bins { tiles, starts, triangles })
    }

    /// Samples all tiles: once, or twice where there are more samples than expected.
    fn sample_tiles(&mut self, mut recorder: Recorder<'a>, chunk: &Chunk, bins: &Bins) -> Result<Loose, BandError> {
        let rays = u64::from(self.band.rays());
        let largest = self.sampler.largest_binding();
        let counts = self.words("counts", rays)?;
        let places = self.words("places", rays)?;
        let offsets = self.words("offsets", rays + 2)?;
        let tally = self.words("tally", TALLY_WORDS)?;
        let next_place = self.words("next place", 1)?;
        // Two per ray, as in a convex solid; the pool keeps the room that earlier images needed.
        let mut room = (2 * rays).min(largest / 4);
        loop {
            let samples = self.words("loose samples", room)?;
            recorder.clear(&tally, bytes_of(TALLY_WORDS));
            recorder.clear(&next_place, bytes_of(1));
            let view = recorder.uniform(bytemuck::bytes_of(&View { triangles: chunk.count, ..self.view() }));
            let bound = [
                (0, &view),
                (1, &chunk.positions),
                (2, &chunk.triangles),
                (3, &bins.starts),
                (4, &bins.triangles),
                (5, &counts),
                (6, &places),
                (7, &samples),
                (8, &tally),
                (9, &next_place),
            ];
            self.run(&mut recorder, &TILES, &bound, counted(bins.tiles))?;
            self.scan(&mut recorder, &counts, &offsets)?;
            recorder.read_back(&offsets, bytes_of(rays), 4);
            let total = u64::from(recorder.finish()?[0][0]);
            self.admit("samples", total, 2)?;
            if bytes_of(total) <= samples.size() {
                return Ok(Loose { counts, places, offsets, samples, tally, total });
            }
            room = total;
            recorder = Recorder::new(&self.sampler.device);
        }
    }
}
