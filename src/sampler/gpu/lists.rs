//! The route by lists: all crossings of each ray, sorted.

use super::image::{BandError, BandJob, MadeBand};
use super::stages::{COMPACT, COUNT, MEET, MERGE, RESOLVE, SCATTER, SORT};
use super::view::{PLANNED_WORDS, SORTED_ALONE, TALLY_WORDS, View};
use crate::gpu::{Recorder, bytes_of, workgroups};
use crate::sampler::stages::ListStages;

/// The crossings of each solid in a band, sorted.
pub(super) struct Lists {
    /// The offset of the crossings of each ray, solid by solid.
    pub starts: Vec<wgpu::Buffer>,
    /// Number of crossings of each solid.
    pub totals: Vec<u64>,
    /// The largest number of crossings on a ray.
    greatest: u32,
    pub crossings: wgpu::Buffer,
    pub crossed: wgpu::Buffer,
}

impl<'a> BandJob<'a> {
    /// Makes the band.
    pub fn make_by_lists(&mut self) -> Result<MadeBand<'a>, BandError> {
        let view = self.view();
        let rays = u64::from(view.rays);
        let two = self.solids.len() == 2;
        let mut recorder = Recorder::new(&self.sampler.device);
        let keeps_triangles = self.image.keeps_triangles;
        // Samples, with gaps between them where there are two solids, and then without; and their triangles.
        let others = (1 + u64::from(two)) * if keeps_triangles { 2 } else { 1 };
        let Lists { starts, totals, greatest, crossings, crossed } = self.sorted_lists(&mut recorder, others)?;
        // The stage that resolves a ray iterates over all of its crossings.
        self.sampler.device.admit_rounds(greatest)?;
        let total = totals.iter().sum();
        let counts = self.words("sample counts", rays)?;
        let loose = if two { self.words("loose samples", total)? } else { crossings.clone() };
        let samples = self.words("samples", total)?;
        let offsets = self.words("offsets", rays + 2)?;
        let tally = self.words("tally", TALLY_WORDS)?;
        recorder.clear(&tally, bytes_of(TALLY_WORDS));
        let (starts, starts_b) = (&starts[0], starts.last().unwrap_or(&starts[0]));
        let uniform = recorder.uniform(bytemuck::bytes_of(&view));
        if two {
            let bound =
                [(0, &uniform), (1, starts), (2, starts_b), (3, &crossings), (4, &loose), (5, &counts), (6, &tally)];
            self.by_ray(&mut recorder, &MEET, &bound)?;
        } else {
            let bound = [(0, &uniform), (1, starts), (2, &crossings), (3, &crossed), (4, &counts), (5, &tally)];
            self.by_ray(&mut recorder, &RESOLVE, &bound)?;
        }
        self.scan(&mut recorder, &counts, &offsets)?;
        let compacted = [(0, &uniform), (1, starts), (2, starts_b), (4, &offsets)];
        let compacted = |loose, samples| [&compacted[..], &[(3, loose), (5, samples)]].concat();
        self.by_ray(&mut recorder, &COMPACT, &compacted(&loose, &samples))?;
        let triangles = match keeps_triangles {
            true => Some(self.words("triangles of samples", total)?),
            false => None,
        };
        if let Some(triangles) = &triangles {
            self.by_ray(&mut recorder, &COMPACT, &compacted(&crossed, triangles))?;
        }
        Ok(MadeBand { recorder, counts, offsets, samples, triangles, tally, most_samples: total })
    }

    /// Runs the first geometry pass, which counts the crossings, and records the second, and the sort. Each crossing
    /// will take `others` words besides its lists.
    pub(super) fn sorted_lists(&mut self, recorder: &mut Recorder, others: u64) -> Result<Lists, BandError> {
        let rays = u64::from(self.band.rays());
        let names = [("counts", "starts"), ("counts of the second", "starts of the second")];
        let mut lists = Vec::new();
        let mut counting = Recorder::new(&self.sampler.device);
        let planned = self.watch_queue(&mut counting)?;
        for (i, (counts, starts)) in names.iter().take(self.solids.len()).enumerate() {
            let (counts, starts) = (self.words(counts, rays)?, self.words(starts, rays + 2)?);
            counting.clear(&counts, bytes_of(rays));
            self.geometry_pass(&mut counting, &COUNT, i, 0, &[(4, &counts)])?;
            self.scan(&mut counting, &counts, &starts)?;
            counting.read_back(&starts, bytes_of(rays), 8);
            lists.push((counts, starts));
        }
        counting.read_back(&planned, 0, bytes_of(PLANNED_WORDS));
        let mut found = counting.finish()?;
        self.none_left_out(&found.pop().unwrap_or_default())?;
        let totals: Vec<u64> = found.iter().map(|words| u64::from(words[0])).collect();
        let greatest = found.iter().map(|words| words[1]).max().unwrap_or(0);
        let total: u64 = totals.iter().sum();
        let (has_long_rays, keeps_triangles) = (greatest > SORTED_ALONE, self.image.keeps_triangles);
        // The crossings themselves, those between sorts, and the triangles of both.
        let buffers = (1 + u64::from(has_long_rays)) * if keeps_triangles { 2 } else { 1 };
        self.admit("crossings", total, buffers + others)?;
        let lists_of = |words: u64| if keeps_triangles { words } else { 1 };
        let mut list = (self.words("crossings", total)?, self.words("crossed triangles", lists_of(total))?);
        let mut first_crossing = 0;
        for (i, (counts, starts)) in lists.iter().enumerate() {
            let bound = [(4, counts), (5, starts), (6, &list.0), (7, &list.1)];
            self.geometry_pass(recorder, &SCATTER, i, first_crossing, &bound)?;
            let view = recorder.uniform(bytemuck::bytes_of(&View { first_crossing, ..self.view() }));
            self.by_ray(recorder, &SORT, &[(0, &view), (1, starts), (2, &list.0), (3, &list.1)])?;
            first_crossing += totals[i] as u32;
        }
        if has_long_rays {
            let mut other =
                (self.words("merged crossings", total)?, self.words("triangles of merged", lists_of(total))?);
            let mut run = 1;
            while run < greatest {
                let mut first_crossing = 0;
                for ((_, starts), &count) in lists.iter().zip(&totals) {
                    let view = View { first_crossing, run, ..self.view() };
                    let view = recorder.uniform(bytemuck::bytes_of(&view));
                    let bound = [(0, &view), (1, starts), (2, &list.0), (3, &list.1), (4, &other.0), (5, &other.1)];
                    self.run(recorder, &MERGE, &bound, workgroups(count as u32))?;
                    first_crossing += count as u32;
                }
                std::mem::swap(&mut list, &mut other);
                run *= 2;
            }
        }
        let starts = lists.into_iter().map(|(_, starts)| starts).collect();
        let (crossings, crossed) = list;
        Ok(Lists { starts, totals, greatest, crossings, crossed })
    }

    /// Returns the sorted crossings of the only solid, read back.
    pub fn list_stages(&mut self) -> Result<ListStages, BandError> {
        let mut recorder = Recorder::new(&self.sampler.device);
        let lists = self.sorted_lists(&mut recorder, 1)?;
        recorder.read_back(&lists.starts[0], 0, bytes_of(u64::from(self.band.rays()) + 1));
        recorder.read_back(&lists.crossings, 0, bytes_of(lists.totals[0]));
        let mut brought = recorder.finish()?.into_iter();
        let mut next = || brought.next().unwrap_or_default();
        let (starts, mut crossings) = (next(), next());
        crossings.truncate(lists.totals[0] as usize);
        Ok(ListStages { starts, crossings })
    }
}
