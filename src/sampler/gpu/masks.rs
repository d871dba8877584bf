//! The route by masks: Leung & Wang's method, with two masks from one geometry pass.

use super::image::{BandError, BandJob, MadeBand};
use super::stages::{CLASSIFY, IDENTITIES, MASKS, RETRIEVE};
use super::view::{PLANNED_WORDS, TALLY_WORDS};
use crate::gpu::{DeviceError, Recorder, bytes_of, workgroups};
use crate::sampler::stages::MaskStages;

/// The masks of a band, which become its classes.
struct Masks {
    /// Masks W and ANY of each solid.
    masks: Vec<[wgpu::Buffer; 2]>,
    ranks: wgpu::Buffer,
    counts: wgpu::Buffer,
    offsets: wgpu::Buffer,
    tally: wgpu::Buffer,
}

impl Masks {
    /// Returns the buffer that holds the voxels of one sample once masks are classified.
    fn single(&self) -> &wgpu::Buffer {
        &self.masks[0][0]
    }

    /// Returns the buffer that then holds the voxels of two samples.
    fn pair(&self) -> &wgpu::Buffer {
        match &self.masks[..] {
            [[_, any]] => any,
            masks => &masks[1][0],
        }
    }
}

impl<'a> BandJob<'a> {
    /// Records the first geometry pass.
    fn fill_masks(&mut self, recorder: &mut Recorder) -> Result<Masks, DeviceError> {
        let view = self.view();
        let rays = u64::from(view.rays);
        let mask = rays * u64::from(view.words);
        let names = [["change", "any"], ["change of the second", "any of the second"]];
        let mut masks = Vec::new();
        for (i, [change, any]) in names.iter().take(self.solids.len()).enumerate() {
            let [change, any] = [self.words(change, mask)?, self.words(any, mask)?];
            recorder.clear(&change, bytes_of(mask));
            recorder.clear(&any, bytes_of(mask));
            self.geometry_pass(recorder, &MASKS, i, 0, &[(4, &change), (5, &any)])?;
            masks.push([change, any]);
        }
        let tally = self.words("tally", TALLY_WORDS)?;
        recorder.clear(&tally, bytes_of(TALLY_WORDS));
        Ok(Masks {
            masks,
            ranks: self.words("ranks", mask)?,
            counts: self.words("counts", rays)?,
            offsets: self.words("offsets", rays + 2)?,
            tally,
        })
    }

    /// Records the classification and the prefix sum of its counts.
    fn classify(&mut self, recorder: &mut Recorder, masks: &Masks) -> Result<(), DeviceError> {
        let [none, none_too] = [self.words("none", 1)?, self.words("none, too", 1)?];
        let [change, any] = &masks.masks[0];
        let [change_b, any_b] = masks.masks.get(1).map_or([&none, &none_too], |[change, any]| [change, any]);
        let uniform = recorder.uniform(bytemuck::bytes_of(&self.view()));
        let bound = [
            (0, &uniform),
            (1, change),
            (2, any),
            (3, &masks.ranks),
            (4, &masks.counts),
            (5, &masks.tally),
            (6, change_b),
            (7, any_b),
        ];
        self.by_ray(recorder, &CLASSIFY, &bound)?;
        self.scan(recorder, &masks.counts, &masks.offsets)
    }

    /// Makes the band.
    pub fn make_by_masks(&mut self) -> Result<MadeBand<'a>, BandError> {
        let sampler = self.sampler;
        let mut recorder = Recorder::new(&sampler.device);
        let planned = self.watch_queue(&mut recorder)?;
        let masks = self.fill_masks(&mut recorder)?;
        self.classify(&mut recorder, &masks)?;
        recorder.read_back(&planned, 0, bytes_of(PLANNED_WORDS));
        recorder.read_back(&masks.offsets, bytes_of(u64::from(self.band.rays())), 4);
        let brought = recorder.finish()?;
        self.none_left_out(&brought[0])?;
        let total = u64::from(brought[1][0]);
        self.admit("samples", total, 1)?;

        let samples = self.words("samples", total)?;
        let mut recorder = Recorder::new(&sampler.device);
        let uniform = recorder.uniform(bytemuck::bytes_of(&self.view()));
        let bound = [(0, &uniform), (1, &masks.offsets), (2, &samples)];
        self.run(&mut recorder, &IDENTITIES, &bound, workgroups(total as u32))?;
        for i in 0..self.solids.len() {
            let bound = [
                (4, masks.single()),
                (5, masks.pair()),
                (6, &masks.ranks),
                (7, &masks.offsets),
                (8, &samples),
                (9, &masks.tally),
            ];
            self.geometry_pass(&mut recorder, &RETRIEVE, i, 0, &bound)?;
        }
        let Masks { counts, offsets, tally, .. } = masks;
        Ok(MadeBand { recorder, counts, offsets, samples, triangles: None, tally, most_samples: total })
    }

    /// Returns the buffers between the stages, read back.
    pub fn mask_stages(&mut self) -> Result<MaskStages, BandError> {
        let device = &self.sampler.device;
        let view = self.view();
        let (rays, mask) = (u64::from(view.rays), u64::from(view.rays) * u64::from(view.words));
        let mut recorder = Recorder::new(device);
        self.watch_queue(&mut recorder)?;
        let buffers = self.fill_masks(&mut recorder)?;
        for buffer in buffers.masks.iter().flatten() {
            recorder.read_back(buffer, 0, bytes_of(mask));
        }
        let mut filled = recorder.finish()?.into_iter();
        let mut recorder = Recorder::new(device);
        self.classify(&mut recorder, &buffers)?;
        for buffer in [buffers.single(), buffers.pair(), &buffers.ranks] {
            recorder.read_back(buffer, 0, bytes_of(mask));
        }
        recorder.read_back(&buffers.counts, 0, bytes_of(rays));
        recorder.read_back(&buffers.offsets, 0, bytes_of(rays + 1));
        let mut classified = recorder.finish()?.into_iter();
        let mut next = || classified.next().unwrap_or_default();
        let mut masks = Vec::new();
        while let (Some(change), Some(any)) = (filled.next(), filled.next()) {
            masks.push([change, any]);
        }
        let [single, pair, ranks, counts, offsets] = std::array::from_fn(|_| next());
        Ok(MaskStages { masks, single, pair, ranks, counts, offsets })
    }
}
