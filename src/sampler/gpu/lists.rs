//! The route by lists: all crossings of each ray, sorted.

use super::band::Band;
use super::image::Outcome;
use super::job::{Brought, DeviceImage, Job, JobError};
use super::stages::{APPEND, COMBINE, MEET, PLACE, RESOLVE, SORT, SORT_LONG};
use super::view::{FOUND_WORDS, Found, LONG_DISPATCH, SORTED_ALONE, View};
use crate::gpu::{DeviceError, Recorder, Workgroups, bytes_of, workgroups};
use crate::sampler::stages::ListStages;

/// The crossings of each ray with each solid, on the device.
pub(super) struct Lists {
    /// The offset of the crossings of each ray, solid by solid, and the end of the last ones.
    pub starts: wgpu::Buffer,
    /// The number of rays of all solids.
    pub lists: u64,
    /// The number of crossings that there is room for.
    pub capacity: u64,
    pub crossings: wgpu::Buffer,
    /// The triangles of the crossings, if they are kept.
    pub crossed: wgpu::Buffer,
}

/// Crossings beyond the expected ones for which there is room: a share of those, and a number.
const SLACK: (f64, f64) = (1.0 / 32.0, 1024.0);

/// Expected crossings beyond the room for them, as a share of it, from which a job is divided without a try.
const HOPELESS: f64 = 1.25;

impl Job<'_> {
    /// Finds the crossings of all rays, has `record` use them and read results back, and passes those to `take`, all in one
    /// recording. If there are more crossings than expected, it is recorded again with room for as many as there are. Each
    /// crossing will take `others` words besides its lists.
    pub fn by_lists<T>(
        &mut self,
        others: u64,
        mut record: impl FnMut(&mut Self, &mut Recorder, &Lists) -> Result<(), JobError>,
        mut take: impl FnMut(&Self, &Found, &[&[u32]]) -> T,
    ) -> Result<T, JobError> {
        let device = &self.sampler.device;
        // Found and placed crossings, and the triangles of both.
        let buffers = 3 + others + if self.image.keeps_triangles { 2 } else { 0 };
        let expected = self.expected();
        let most = (self.limit(buffers) / 4).min(u32::MAX.into());
        if expected > HOPELESS * most as f64 && !self.is_single_ray() {
            let (bytes, limit) = (bytes_of(expected.min(1e18) as u64), bytes_of(most));
            return Err(JobError::TooLarge { what: "crossings", bytes, limit });
        }
        let axes = self.whole_axes();
        let mut capacity = match axes.map_or(0, |axes| self.solids[0].found(axes)) {
            0 => ((expected * (1.0 + SLACK.0) + SLACK.1) as u64).min(most),
            found => found,
        };
        self.admit("crossings", capacity, buffers)?;
        loop {
            let mut recorder = Recorder::new(device);
            let (lists, found) = self.record_lists(&mut recorder, capacity)?;
            recorder.read_back(&found, 0, bytes_of(FOUND_WORDS));
            record(self, &mut recorder, &lists)?;
            let (found, taken) = recorder.finish(|parts| {
                let found: Found = bytemuck::cast_slice(parts[0])[0];
                (found, (u64::from(found.total) <= capacity).then(|| take(self, &found, &parts[1..])))
            })?;
            if let Some(axes) = axes {
                self.solids[0].remember(axes, found.total.into());
            }
            if let Some(taken) = taken {
                return Ok(taken);
            }
            capacity = found.total.into();
            self.admit("crossings", capacity, buffers)?;
        }
    }

    /// Returns the number of crossings that the areas of the triangles make likely.
    fn expected(&self) -> f64 {
        let of_band = |band: &Band| {
            let share = f64::from(band.rays()) / f64::from(self.image.whole(band.axis).rays().max(1));
            let axis = band.axis.depth();
            let areas = self.solids.iter().zip(&self.image.parts);
            share * areas.map(|(solid, part)| solid.areas[axis] * part.shares[axis]).sum::<f64>()
        };
        self.bands.iter().map(of_band).sum()
    }

    /// Returns the axes, a bit for each, of a job that makes whole images of one solid.
    fn whole_axes(&self) -> Option<usize> {
        let are_whole = self.bands.iter().all(|band| *band == self.image.whole(band.axis)) && !self.image.is_restricted;
        (are_whole && self.solids.len() == 1).then(|| self.bands.iter().map(|band| 1 << band.axis.depth()).sum())
    }

    /// Records the geometry pass, and the two sorts by which lists arise, of rays and of the crossings of long lists.
    fn record_lists(&mut self, recorder: &mut Recorder, capacity: u64) -> Result<(Lists, wgpu::Buffer), DeviceError> {
        let lists = self.solids.len() as u64 * self.rays();
        let triangles_of = |words: u64| if self.image.keeps_triangles { words } else { 1 };
        let (crossed, loose_crossed) = (triangles_of(capacity), triangles_of(capacity));
        let counts = self.zeros(recorder, "counts", lists)?;
        let found = self.zeros(recorder, "found", FOUND_WORDS)?;
        let starts = self.words("starts", lists + 1)?;
        let rays = self.words("rays of found", capacity)?;
        let loose = self.words("found crossings", capacity)?;
        let loose_crossed = self.words("found triangles", loose_crossed)?;
        let crossings = self.words("crossings", capacity)?;
        let crossed = self.words("crossed triangles", crossed)?;
        let long_lists = self.words("long lists", capacity / u64::from(SORTED_ALONE) + 1)?;

        let view = View { lists: lists as u32, capacity: capacity as u32, long_from: SORTED_ALONE, ..self.view };
        for i in 0..self.solids.len() {
            let bound = [(4, &counts), (5, &found), (6, &rays), (7, &loose), (8, &loose_crossed)];
            self.geometry_pass(recorder, &APPEND, i, &view, &bound)?;
        }
        self.scan(recorder, &view, &counts, &starts, [&found, &long_lists])?;
        let bound = [
            (1, &found),
            (2, &starts),
            (3, &counts),
            (4, &rays),
            (5, &loose),
            (6, &loose_crossed),
            (7, &crossings),
            (8, &crossed),
        ];
        self.run(recorder, &PLACE, &view, &bound, workgroups(capacity as u32))?;
        // The crossings are in their places, which leaves room to merge long lists.
        let bound = [
            (1, &starts),
            (2, &crossings),
            (3, &crossed),
            (4, &loose),
            (5, &loose_crossed),
            (6, &long_lists),
            (7, &found),
        ];
        self.run(recorder, &SORT_LONG, &view, &bound, Workgroups::Indirect(&found, LONG_DISPATCH))?;
        Ok((Lists { starts, lists, capacity, crossings, crossed }, found))
    }

    /// Records that the short lists are sorted, where no later stage does so.
    pub fn sort_short(&mut self, recorder: &mut Recorder, lists: &Lists) -> Result<(), DeviceError> {
        let view = View { lists: lists.lists as u32, ..self.view };
        let bound = [(1, &lists.starts), (2, &lists.crossings), (3, &lists.crossed)];
        self.run(recorder, &SORT, &view, &bound, workgroups(view.lists))
    }

    /// Records that lists are turned into images.
    pub fn resolve(&mut self, recorder: &mut Recorder, lists: &Lists) -> Result<DeviceImage, DeviceError> {
        let tallies = self.zeros(recorder, "tallies", self.tally_words())?;
        let counts = self.words("sample counts", self.rays())?;
        let Lists { starts, crossings, crossed, .. } = lists;
        let samples = match &self.image.result {
            Outcome::Own => {
                self.resolve_part(recorder, lists, 0, [&counts, &tallies])?;
                crossings.clone()
            }
            Outcome::Both => {
                self.sort_short(recorder, lists)?;
                let loose = self.words("loose samples", lists.capacity)?;
                let bound = [(1, starts), (2, crossings), (3, &loose), (4, &counts), (5, &tallies)];
                self.by_ray(recorder, &MEET, &bound)?;
                loose
            }
            Outcome::Combination(results) => {
                let of_leaves = self.words("sample counts of leaves", lists.lists)?;
                for part in 0..self.solids.len() {
                    self.resolve_part(recorder, lists, part, [&of_leaves, &tallies])?;
                }
                let results = self.sampler.device.upload("results", bytemuck::cast_slice(results))?;
                let loose = self.words("loose samples", lists.capacity)?;
                let bound = [
                    (1, starts),
                    (2, crossings),
                    (3, &of_leaves),
                    (4, &results),
                    (5, &loose),
                    (6, &counts),
                    (7, &tallies),
                ];
                self.by_ray(recorder, &COMBINE, &bound)?;
                loose
            }
        };
        Ok(DeviceImage {
            starts: starts.clone(),
            counts,
            samples,
            triangles: self.image.keeps_triangles.then(|| crossed.clone()),
            tallies,
            most_samples: lists.capacity,
            is_dense: self.image.is_dense,
        })
    }

    /// Records that the lists of one solid are turned into its image, in place.
    fn resolve_part(
        &self,
        recorder: &mut Recorder,
        lists: &Lists,
        part: usize,
        [counts, tallies]: [&wgpu::Buffer; 2],
    ) -> Result<(), DeviceError> {
        let view = self.view.of_part(self.image, part, self.bands);
        let bound = [(1, &lists.starts), (2, &lists.crossings), (3, &lists.crossed), (4, counts), (5, tallies)];
        self.run_as(recorder, &RESOLVE, self.image.flags(part), &view, &bound, workgroups(view.rays))
    }

    /// Returns the number of words of each crossing that an image takes besides the lists.
    pub fn words_of_image(&self) -> u64 {
        match (&self.image.result, self.image.is_dense, self.image.keeps_triangles) {
            (Outcome::Own, true, _) => 0,
            (Outcome::Own, false, false) => 1,
            _ => 2,
        }
    }

    /// Refuses crossings, of which one list has `greatest`, where an adapter is not certain to complete the loops over them.
    /// `combine` looks at every leaf, and at up to one node for each, at every depth, and the sums take 14 rounds for each of the
    /// samples of all leaves.
    pub fn admit_rounds(&self, greatest: u32) -> Result<(), DeviceError> {
        let leaves = self.image.leaves() as u32;
        let rounds = match leaves {
            0 => greatest,
            _ => greatest.saturating_mul(leaves).saturating_mul((2 * leaves + 5).max(14)) / 8,
        };
        self.sampler.device.admit_rounds(rounds)
    }

    /// Makes the images and reads them back, with the counts of their rays where some are unclosed. Where a window leaves out part
    /// of a solid, so that far fewer samples are likely than there is room for, the host waits for their number first.
    pub fn bring_back_by_lists(&mut self) -> Result<(Vec<Brought>, Option<wgpu::Buffer>), JobError> {
        let others = self.words_of_image();
        let waits = self.image.is_restricted;
        let mut made = None;
        let record = |job: &mut Self, recorder: &mut Recorder, lists: &Lists| {
            let image = job.resolve(recorder, lists)?;
            let compact = job.read_heads(recorder, &image)?;
            if !waits {
                compact.read(recorder, image.most_samples);
            }
            made = Some((compact, image.counts));
            Ok(())
        };
        let take = |job: &Self, found: &Found, parts: &[&[u32]]| {
            let (heads, samples) = parts.split_at(2);
            let result = match waits {
                true => Err([heads[0].to_vec(), heads[1].to_vec()]),
                false => Ok(job.images_of(heads, samples)),
            };
            (found.greatest, result)
        };
        let (greatest, result) = self.by_lists(others, record, take)?;
        // The stage that resolves a ray iterates over all of its crossings.
        self.admit_rounds(greatest)?;
        let Some((compact, counts)) = made else { unreachable!("lists were recorded") };
        let (images, has_unclosed) = match result {
            Ok(images) => images,
            Err([offsets, tallies]) => {
                let mut recorder = Recorder::new(&self.sampler.device);
                compact.read(&mut recorder, offsets[offsets.len() - 1].into());
                recorder.finish(|samples| self.images_of(&[&offsets, &tallies], samples))?
            }
        };
        Ok((images, has_unclosed.then_some(counts)))
    }

    /// Returns the sorted crossings of the only solid in the only band, read back.
    pub fn list_stages(&mut self) -> Result<ListStages, JobError> {
        let record = |job: &mut Self, recorder: &mut Recorder, lists: &Lists| {
            job.sort_short(recorder, lists)?;
            recorder.read_back(&lists.starts, 0, bytes_of(u64::from(job.bands[0].rays()) + 1));
            recorder.read_back(&lists.crossings, 0, bytes_of(lists.capacity));
            Ok(())
        };
        self.by_lists(0, record, |_, found, parts| ListStages {
            starts: parts[0].to_vec(),
            crossings: parts[1][..found.total as usize].to_vec(),
        })
    }
}
