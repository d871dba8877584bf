//! Sums of images that stay on the device.

use super::band::Band;
use super::image::{BandError, BandJob, Image, MadeBand, Way};
use super::stages::VOLUME_SUMS;
use super::view::{LEVEL_SUMS, NODE_SUMS, SUMS, TALLY_WORDS, Tally, wide};
use super::{GpuSampler, State};
use crate::gpu::{bytes_of, held};
use crate::grid::LatticeSolid;
use crate::ldi::{RaySums, VolumeSums, Windings};
use crate::sampler::SampleError;

/// Number of words of the totals of `shaders/volume_sums.wgsl`: sums in two words each, the largest number of samples of a
/// ray, and the number of all samples.
const TOTALS_WORDS: u64 = 2 * SUMS as u64 + 2;

/// The sums over the counted rows of a band.
struct BandSums {
    sums: RaySums,
    layers: u32,
    samples: u64,
    unclosed: u64,
    windings: Windings,
}

impl BandJob<'_> {
    /// Makes the band, sums it, and reads the sums back.
    fn volume_sums(&mut self) -> Result<BandSums, BandError> {
        let MadeBand { mut recorder, offsets, samples, tally, most_samples, .. } = self.make()?;
        let levels = self.words("levels", most_samples)?;
        let totals = self.words("totals", TOTALS_WORDS)?;
        recorder.clear(&totals, bytes_of(TOTALS_WORDS));
        let view = recorder.uniform(bytemuck::bytes_of(&self.view()));
        let bound = [(0, &view), (1, &offsets), (2, &samples), (3, &levels), (4, &totals)];
        self.by_ray(&mut recorder, &VOLUME_SUMS, &bound)?;
        recorder.read_back(&totals, 0, bytes_of(TOTALS_WORDS));
        recorder.read_back(&tally, 0, bytes_of(TALLY_WORDS));
        let brought = recorder.finish()?;
        let (totals, tally): (&[u32], Tally) = (&brought[0], bytemuck::cast_slice(&brought[1])[0]);
        let sum = |i: u32| wide(totals[2 * i as usize], totals[2 * i as usize + 1]);
        let sums = RaySums {
            steps: std::array::from_fn(|parity| sum(parity as u32)),
            nodes: std::array::from_fn(|parity| [0, 1].map(|depth| sum(NODE_SUMS + 2 * parity as u32 + depth))),
            level: std::array::from_fn(|level| sum(LEVEL_SUMS + level as u32)),
        };
        let [layers, samples] = [0, 1].map(|i| totals[2 * SUMS as usize + i]);
        Ok(BandSums {
            sums,
            layers,
            samples: u64::from(samples),
            unclosed: u64::from(tally.unclosed),
            windings: tally.windings(),
        })
    }
}

impl GpuSampler {
    /// Sums an image on the device; where not even three rows of it fit there, on the host.
    pub(super) fn sums(&self, solids: &[&LatticeSolid], image: &Image) -> Result<VolumeSums, SampleError> {
        match self.sums_on_device(solids, image) {
            Ok(volume_sums) => Ok(volume_sums),
            Err(BandError::Device(error)) => Err(error.into()),
            Err(BandError::TooLarge { .. }) => Ok(self.image(solids, image)?.volume_sums()),
        }
    }

    fn sums_on_device(&self, solids: &[&LatticeSolid], image: &Image) -> Result<VolumeSums, BandError> {
        let mut state = held(&self.state);
        let State { pool, residents } = &mut *state;
        let solids = self.resident(residents, solids)?;
        let (columns, _) = image.grid.image_size(image.axis);
        let looked_at = image.window_rows();
        let Way { route, most_rays } = image.way(self);
        let most_rows = most_rays / columns;
        // A row is compared with its neighbours, which are made as well.
        let at_once = if looked_at.len() as u32 <= most_rows { most_rows } else { most_rows.saturating_sub(2) };
        if at_once == 0 && !looked_at.is_empty() {
            let (rays, limit) = (3 * u64::from(columns), bytes_of(u64::from(most_rays)));
            return Err(BandError::TooLarge { what: "three rows of rays", bytes: bytes_of(rays), limit });
        }
        let part = |first: u32| first..looked_at.end.min(first + at_once);
        let mut parts: Vec<_> = looked_at.clone().step_by(at_once.max(1) as usize).map(part).collect();
        let (mut sums, mut windings) = (RaySums::default(), Windings::default());
        let (mut layers, mut samples, mut unclosed) = (0, 0, 0);
        while let Some(rows) = parts.pop() {
            let with_neighbours = rows.start.saturating_sub(1).max(looked_at.start)..looked_at.end.min(rows.end + 1);
            let band = Band::with_neighbours(with_neighbours, rows.clone(), columns);
            let mut job = BandJob { sampler: self, pool, solids: &solids, image, route, band };
            match job.volume_sums() {
                Ok(part) => {
                    sums = sums.plus(part.sums);
                    windings = windings.plus(part.windings);
                    layers = layers.max(part.layers);
                    samples += part.samples;
                    unclosed += part.unclosed;
                }
                Err(BandError::TooLarge { .. }) if rows.len() > 1 => {
                    let middle = rows.start + rows.len() as u32 / 2;
                    parts.extend([middle..rows.end, rows.start..middle]);
                }
                Err(error) => return Err(error),
            }
        }
        let windings = image.counts_windings.then_some(windings);
        Ok(VolumeSums::from_parts(image.grid, image.axis, sums, layers, [samples, unclosed], windings))
    }
}
