//! The route by lists: all crossings of each ray, sorted.

use super::passes::TALLY_WORDS;
use super::stages::{COMPACT, COUNT, MEET, RESOLVE, SCATTER, SORT};
use super::{BandImage, BandJob, Made, Windings};
use crate::gpu::{DeviceError, Recorder, bytes_of};
use crate::sampler::gpu::view::{Tally, UNCLOSED, View};

impl BandJob<'_> {
    /// Makes the band.
    pub fn by_lists(&mut self) -> Result<Made, DeviceError> {
        let sampler = self.sampler;
        let view = self.view();
        let rays = u64::from(view.rays);
        let two = self.solids.len() == 2;
        let counts = self.words("counts", rays)?;
        let counts_b = if two { self.words("counts of the second", rays)? } else { counts.clone() };
        let starts = self.words("starts", rays + 1)?;
        let starts_b = if two { self.words("starts of the second", rays + 1)? } else { starts.clone() };
        let lists = [(&counts, &starts), (&counts_b, &starts_b)];
        let lists = &lists[..self.solids.len()];

        let mut recorder = Recorder::new(&sampler.device);
        for (i, (counts, starts)) in lists.iter().enumerate() {
            recorder.clear(counts, bytes_of(rays));
            self.geometry_pass(&mut recorder, &COUNT, i, 0, &[(4, counts)])?;
            self.scan(&mut recorder, counts, starts)?;
            recorder.read_back(starts, bytes_of(rays), 4);
        }
        let totals: Vec<u64> = recorder.finish()?.iter().map(|words| u64::from(words[0])).collect();
        let total: u64 = totals.iter().sum();
        if bytes_of(total) > sampler.largest_binding() {
            return Ok(Made::TooLarge { what: "crossings", bytes: bytes_of(total) });
        }

        let keeps_triangles = self.image.keeps_triangles;
        let crossings = self.words("crossings", total)?;
        let crossed = self.words("crossed triangles", if keeps_triangles { total } else { 1 })?;
        let loose = if two { self.words("loose samples", total)? } else { crossings.clone() };
        let samples = self.words("samples", total)?;
        let offsets = self.words("offsets", rays + 1)?;
        let tally = self.words("tally", TALLY_WORDS)?;
        let mut recorder = Recorder::new(&sampler.device);
        recorder.clear(&tally, bytes_of(TALLY_WORDS));
        let mut first_crossing = 0;
        for (i, (counts, starts)) in lists.iter().enumerate() {
            let bound = [(4, *counts), (5, *starts), (6, &crossings), (7, &crossed)];
            self.geometry_pass(&mut recorder, &SCATTER, i, first_crossing, &bound)?;
            let view = recorder.uniform(bytemuck::bytes_of(&View { first_crossing, ..view }));
            self.by_ray(&mut recorder, &SORT, &[(0, &view), (1, starts), (2, &crossings), (3, &crossed)])?;
            first_crossing += totals[i] as u32;
        }
        let uniform = recorder.uniform(bytemuck::bytes_of(&view));
        if two {
            let bound =
                [(0, &uniform), (1, &starts), (2, &starts_b), (3, &crossings), (4, &loose), (5, &counts), (6, &tally)];
            self.by_ray(&mut recorder, &MEET, &bound)?;
        } else {
            let bound = [(0, &uniform), (1, &starts), (2, &crossings), (3, &crossed), (4, &counts), (5, &tally)];
            self.by_ray(&mut recorder, &RESOLVE, &bound)?;
        }
        self.scan(&mut recorder, &counts, &offsets)?;
        let compacted = [(0, &uniform), (1, &starts), (2, &starts_b), (4, &offsets)];
        let compacted = |loose, samples| [&compacted[..], &[(3, loose), (5, samples)]].concat();
        self.by_ray(&mut recorder, &COMPACT, &compacted(&loose, &samples))?;
        let triangles = match keeps_triangles {
            true => Some(self.words("triangles of samples", total)?),
            false => None,
        };
        if let Some(triangles) = &triangles {
            self.by_ray(&mut recorder, &COMPACT, &compacted(&crossed, triangles))?;
        }
        self.bring_back(recorder, &counts, &offsets, &samples, triangles.as_ref(), &tally, total).map(Made::Band)
    }

    /// Runs what is recorded and reads the band; there are at most `most` samples.
    #[expect(clippy::too_many_arguments, reason = "the buffers that make an image, each once")]
    pub fn bring_back(
        &self,
        mut recorder: Recorder,
        counts: &wgpu::Buffer,
        offsets: &wgpu::Buffer,
        samples: &wgpu::Buffer,
        triangles: Option<&wgpu::Buffer>,
        tally: &wgpu::Buffer,
        most: u64,
    ) -> Result<BandImage, DeviceError> {
        let rays = u64::from(self.band.rays());
        recorder.read_back(offsets, 0, bytes_of(rays + 1));
        recorder.read_back(samples, 0, bytes_of(most));
        recorder.read_back(tally, 0, bytes_of(TALLY_WORDS));
        if let Some(triangles) = triangles {
            recorder.read_back(triangles, 0, bytes_of(most));
        }
        let mut brought = recorder.finish()?.into_iter();
        let mut next = || brought.next().unwrap_or_default();
        let (mut ends, depths, tally, mut triangles) = (next(), next(), next(), next());
        let total = ends[ends.len() - 1] as usize;
        ends.remove(0);
        triangles.truncate(total);
        let mut depths: Vec<i32> = bytemuck::cast_vec(depths);
        depths.truncate(total);
        let tally: Tally = bytemuck::cast_slice(&tally)[0];
        let windings = Windings {
            wound: (u64::from(tally.wound_low) | u64::from(tally.wound_high) << 32) as i64,
            aligned: i64::from(tally.aligned),
            changes: i64::from(tally.changes),
        };
        let unclosed = if tally.unclosed == 0 { Vec::new() } else { self.unclosed_rays(counts)? };
        let windings = self.image.counts_windings.then_some(windings);
        Ok(BandImage::from_parts(ends, depths, triangles, windings, unclosed))
    }

    fn unclosed_rays(&self, counts: &wgpu::Buffer) -> Result<Vec<u32>, DeviceError> {
        let mut recorder = Recorder::new(&self.sampler.device);
        recorder.read_back(counts, 0, bytes_of(u64::from(self.band.rays())));
        let counts = recorder.finish()?;
        let unclosed = |(ray, count): (usize, &u32)| (*count == UNCLOSED).then_some(ray as u32);
        Ok(counts[0].iter().enumerate().filter_map(unclosed).collect())
    }
}
