//! Sums of images that stay on the device.

use super::band::Band;
use super::image::{Image, Way};
use super::job::{DeviceImage, Job, JobError};
use super::lists::Lists;
use super::stages::{MOMENT_SUMS, VOLUME_SUMS};
use super::view::{Found, LEVEL_SUMS, MOMENT_WORDS, MOMENTS, NODE_SUMS, SUMS, TOTALS_WORDS, Tally, wide};
use super::{GpuSampler, Route, WithLeaves, are_different};
use crate::gpu::{DeviceError, Recorder, bytes_of};
use crate::grid::{Axis, LatticeSolid};
use crate::ldi::{Ldi, MomentSums, RaySums, VolumeSums, Windings};
use crate::sampler::{SampleError, SolidSums};

/// The sums over the counted rows of a band.
#[derive(Default)]
struct BandSums {
    sums: RaySums,
    layers: u32,
    samples: u64,
    unclosed: u64,
    windings: Windings,
    /// Those of the images of the leaves of a combination.
    of_leaves: Vec<Windings>,
    moments: MomentSums,
}

impl BandSums {
    fn plus(self, other: BandSums) -> BandSums {
        BandSums {
            sums: self.sums.plus(other.sums),
            layers: self.layers.max(other.layers),
            samples: self.samples + other.samples,
            unclosed: self.unclosed + other.unclosed,
            windings: self.windings.plus(other.windings),
            of_leaves: sums_by_leaf(self.of_leaves, other.of_leaves),
            moments: self.moments.plus(other.moments),
        }
    }

    /// Returns the sums that were read back for one band.
    fn of(totals: &[u32], tally: &Tally, of_leaves: Vec<Windings>, moments: MomentSums) -> BandSums {
        let sum = |i: u32| wide(totals[2 * i as usize], totals[2 * i as usize + 1]);
        let sums = RaySums {
            steps: std::array::from_fn(|parity| sum(parity as u32)),
            nodes: std::array::from_fn(|parity| [0, 1].map(|depth| sum(NODE_SUMS + 2 * parity as u32 + depth))),
            level: std::array::from_fn(|level| sum(LEVEL_SUMS + level as u32)),
        };
        let [layers, samples] = [0, 1].map(|i| totals[2 * SUMS as usize + i]);
        BandSums {
            sums,
            layers,
            samples: u64::from(samples),
            unclosed: u64::from(tally.unclosed),
            windings: tally.windings(),
            of_leaves,
            moments,
        }
    }
}

/// Returns the sums for moments that were read back for one band.
fn moments_of(totals: &[u32]) -> MomentSums {
    let sum = |i: usize| (0..4).fold(0, |sum, word| sum | u128::from(totals[4 * i + word]) << (32 * word)) as i128;
    let sums: [i128; MOMENTS] = std::array::from_fn(sum);
    let [one, column, row, twice_depth, column_column, row_row, thrice_depth_depth, ..] = sums;
    let [.., column_row, twice_column_depth, twice_row_depth] = sums;
    MomentSums {
        one,
        column,
        row,
        twice_depth,
        column_column,
        row_row,
        thrice_depth_depth,
        column_row,
        twice_column_depth,
        twice_row_depth,
        coincident: totals[4 * MOMENTS].into(),
    }
}

/// Returns the winding sums of each leaf in two bands together; a band may have none.
pub(super) fn sums_by_leaf(mut some: Vec<Windings>, others: Vec<Windings>) -> Vec<Windings> {
    if some.is_empty() {
        return others;
    }
    some.iter_mut().zip(others).for_each(|(sum, other)| *sum = sum.plus(other));
    some
}

impl Job<'_> {
    /// Makes the bands, sums them, and reads the sums back, one of each band.
    fn volume_sums(&mut self) -> Result<Vec<BandSums>, JobError> {
        if self.route == Route::Masks {
            let mut recorder = Recorder::new(&self.sampler.device);
            let image = self.record_masks(&mut recorder)?;
            self.record_sums(&mut recorder, &image)?;
            return Ok(recorder.finish(|parts| self.sums_of(parts))?);
        }
        let others = 1 + self.words_of_image();
        let record = |job: &mut Self, recorder: &mut Recorder, lists: &Lists| {
            let image = job.resolve(recorder, lists)?;
            Ok(job.record_sums(recorder, &image)?)
        };
        let (greatest, sums) =
            self.by_lists(others, record, |job, found: &Found, parts| (found.greatest, job.sums_of(parts)))?;
        self.admit_rounds(greatest)?;
        Ok(sums)
    }

    /// Records that images are summed, and the sums read back.
    fn record_sums(&mut self, recorder: &mut Recorder, image: &DeviceImage) -> Result<(), DeviceError> {
        let bands = self.bands.len() as u64;
        let totals_words = u64::from(TOTALS_WORDS) * bands;
        let levels = self.words("levels", image.most_samples)?;
        let totals = self.zeros(recorder, "totals", totals_words)?;
        let bound = [(1, &image.starts), (2, &image.counts), (3, &image.samples), (4, &levels), (5, &totals)];
        self.by_ray(recorder, &VOLUME_SUMS, &bound)?;
        recorder.read_back(&totals, 0, bytes_of(totals_words));
        recorder.read_back(&image.tallies, 0, bytes_of(self.tally_words()));
        if self.image.has_moments {
            let words = u64::from(MOMENT_WORDS) * bands;
            let moments = self.zeros(recorder, "moments", words)?;
            let bound = [(1, &image.starts), (2, &image.counts), (3, &image.samples), (4, &moments)];
            self.by_ray(recorder, &MOMENT_SUMS, &bound)?;
            recorder.read_back(&moments, 0, bytes_of(words));
        }
        Ok(())
    }

    /// Returns the sums that were read back, one of each band.
    fn sums_of(&self, parts: &[&[u32]]) -> Vec<BandSums> {
        let tallies: &[Tally] = bytemuck::cast_slice(parts[1]);
        let totals = parts[0].chunks_exact(TOTALS_WORDS as usize);
        let of_band = |(band, totals)| {
            let words = MOMENT_WORDS as usize;
            let moments = parts.get(2).map(|all| moments_of(&all[words * band..][..words])).unwrap_or_default();
            BandSums::of(totals, &tallies[band], self.windings_of_leaves(tallies, band), moments)
        };
        totals.enumerate().map(of_band).collect()
    }
}

impl GpuSampler {
    /// Sums images on the device; where not even three rows of one fit there, on the host.
    pub(super) fn sums(
        &self,
        solids: &[&LatticeSolid],
        image: &Image,
        axes: &[Axis],
    ) -> Result<Vec<WithLeaves<SolidSums>>, SampleError> {
        assert!(are_different(axes), "{axes:?} has an axis twice");
        let mut sums = [(); 3].map(|()| BandSums::default());
        let take = |band: &Band, part: BandSums| {
            let sum = &mut sums[band.axis.depth()];
            *sum = std::mem::take(sum).plus(part);
            Ok(())
        };
        let jobs = sum_jobs(image, axes, image.way(self));
        let halves = |band: &Band| halves(image, band);
        match jobs.map(|jobs| self.run_jobs(solids, image, jobs, &halves, |job| job.volume_sums(), take)) {
            Some(Ok(())) => {
                let sums_along = |&axis: &Axis| {
                    let BandSums { sums, layers, samples, unclosed, windings, of_leaves, moments } =
                        std::mem::take(&mut sums[axis.depth()]);
                    let windings = image.counts_windings().then_some(windings);
                    let counts = [samples, unclosed];
                    let volume = VolumeSums::from_parts(image.grid, axis, sums, layers, counts, windings);
                    let result = SolidSums { volume, moments };
                    WithLeaves { result, of_leaves }
                };
                Ok(axes.iter().map(sums_along).collect())
            }
            Some(Err(error)) if !is_too_large(&error) => Err(error),
            _ => {
                let (images, has_moments) = (self.images(solids, image, axes)?, image.has_moments);
                let summed = |image: Ldi| SolidSums {
                    volume: image.volume_sums(),
                    moments: if has_moments { image.moment_sums() } else { MomentSums::default() },
                };
                let summed = |made: WithLeaves<Ldi>| made.map(summed);
                Ok(images.into_iter().map(summed).collect())
            }
        }
    }
}

/// Returns whether a job failed as not even three rows of rays fit the device.
fn is_too_large(error: &SampleError) -> bool {
    matches!(error, SampleError::Device(DeviceError::TooLarge { .. } | DeviceError::OutOfMemory { .. }))
}

/// Returns the jobs that sum the images along some axes: one for all axes where their rays fit together, else bands of each axis.
/// A row is compared with its neighbours, which are made as well. `None` where three rows do not fit.
fn sum_jobs(image: &Image, axes: &[Axis], way: Way) -> Option<Vec<Vec<Band>>> {
    let whole = image.jobs(axes, way);
    let is_whole = |job: &Vec<Band>| job.iter().all(|band| *band == image.whole(band.axis));
    if whole.iter().all(is_whole) {
        return Some(whole);
    }
    let mut jobs = Vec::new();
    for &axis in axes {
        let (columns, _) = image.grid.image_size(axis);
        let rows = image.window_rows(axis);
        let most_rows = way.most_rays / columns;
        let at_once = if rows.len() as u32 <= most_rows { most_rows } else { most_rows.saturating_sub(2) };
        if at_once == 0 && !rows.is_empty() {
            return None;
        }
        let part = |first: u32| vec![counted(image, axis, first..rows.end.min(first.saturating_add(at_once)))];
        jobs.extend(rows.clone().step_by(at_once.max(1) as usize).map(part));
    }
    Some(jobs)
}

/// Returns the band that counts these rows.
fn counted(image: &Image, axis: Axis, rows: std::ops::Range<u32>) -> Band {
    let all = image.window_rows(axis);
    let with_neighbours = rows.start.saturating_sub(1).max(all.start)..all.end.min(rows.end + 1);
    Band::with_neighbours(axis, with_neighbours, rows, image.grid.image_size(axis).0)
}

/// Returns the bands that count the halves of the counted rows, or `None` for a single row.
fn halves(image: &Image, band: &Band) -> Option<[Band; 2]> {
    let rows = band.counted_rows();
    let middle = rows.start + rows.len() as u32 / 2;
    (rows.len() > 1).then(|| [rows.start..middle, middle..rows.end].map(|rows| counted(image, band.axis, rows)))
}
