//! The route by masks: Leung & Wang's method, with two masks from one geometry pass. A job has one band.

use super::job::{Brought, DeviceImage, Job, JobError};
use super::stages::{CLASSIFY, IDENTITIES, MASKS, RETRIEVE};
use super::view::{FOUND_WORDS, TALLY_WORDS, View};
use crate::gpu::{DeviceError, Recorder, bytes_of, workgroups};
use crate::sampler::stages::MaskStages;

/// The masks of a band, which become its classes.
struct Masks {
    /// Masks W and ANY of each solid.
    masks: Vec<[wgpu::Buffer; 2]>,
    ranks: wgpu::Buffer,
    counts: wgpu::Buffer,
    offsets: wgpu::Buffer,
    tallies: wgpu::Buffer,
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

impl Job<'_> {
    /// Returns the number of words of a mask of all rays.
    fn mask_words(&self) -> u64 {
        self.rays() * u64::from(self.view.words)
    }

    /// Records the first geometry pass.
    fn fill_masks(&mut self, recorder: &mut Recorder) -> Result<Masks, DeviceError> {
        let (rays, mask) = (self.rays(), self.mask_words());
        let names = [["change", "any"], ["change of the second", "any of the second"]];
        let mut masks = Vec::new();
        for [change, any] in names.into_iter().take(self.solids.len()) {
            masks.push([self.zeros(recorder, change, mask)?, self.zeros(recorder, any, mask)?]);
        }
        let tallies = self.zeros(recorder, "tallies", TALLY_WORDS)?;
        for (i, [change, any]) in masks.iter().enumerate() {
            self.geometry_pass(recorder, &MASKS, i, &self.view, &[(4, change), (5, any)])?;
        }
        Ok(Masks {
            masks,
            ranks: self.words("ranks", mask)?,
            counts: self.words("sample counts", rays)?,
            offsets: self.words("offsets", rays + 1)?,
            tallies,
        })
    }

    /// Records the classification and the prefix sum of its counts.
    fn classify(&mut self, recorder: &mut Recorder, masks: &Masks) -> Result<(), DeviceError> {
        let [none, none_too] = [self.words("none", 1)?, self.words("none, too", 1)?];
        let found = self.zeros(recorder, "samples found", FOUND_WORDS)?;
        let [change, any] = &masks.masks[0];
        let [change_b, any_b] = masks.masks.get(1).map_or([&none, &none_too], |[change, any]| [change, any]);
        let bound = [
            (1, change),
            (2, any),
            (3, &masks.ranks),
            (4, &masks.counts),
            (5, &masks.tallies),
            (6, change_b),
            (7, any_b),
        ];
        self.by_ray(recorder, &CLASSIFY, &bound)?;
        let view = View { lists: self.view.rays, capacity: u32::MAX, ..self.view };
        self.scan(recorder, &view, &masks.counts, &masks.offsets, [&found, &none])
    }

    /// Records the whole method, but for what comes before the number of samples is known.
    pub fn record_masks(&mut self, recorder: &mut Recorder) -> Result<DeviceImage, JobError> {
        let sampler = self.sampler;
        let mut counting = Recorder::new(&sampler.device);
        let masks = self.fill_masks(&mut counting)?;
        self.classify(&mut counting, &masks)?;
        counting.read_back(&masks.offsets, bytes_of(self.rays()), 4);
        let total = u64::from(counting.finish(|parts| parts[0][0])?);
        self.admit("samples", total, 1)?;

        let samples = self.words("samples", total)?;
        let bound = [(1, &masks.offsets), (2, &samples)];
        self.run(recorder, &IDENTITIES, &self.view, &bound, workgroups(total as u32))?;
        for i in 0..self.solids.len() {
            let bound = [
                (4, masks.single()),
                (5, masks.pair()),
                (6, &masks.ranks),
                (7, &masks.offsets),
                (8, &samples),
                (9, &masks.tallies),
            ];
            self.geometry_pass(recorder, &RETRIEVE, i, &self.view, &bound)?;
        }
        let Masks { counts, offsets, tallies, .. } = masks;
        Ok(DeviceImage {
            starts: offsets,
            counts,
            samples,
            triangles: None,
            tallies,
            most_samples: total,
            is_dense: true,
        })
    }

    /// Makes the image and reads it back, with the counts of its rays where some are unclosed.
    pub fn bring_back_by_masks(&mut self) -> Result<(Vec<Brought>, Option<wgpu::Buffer>), JobError> {
        let mut recorder = Recorder::new(&self.sampler.device);
        let image = self.record_masks(&mut recorder)?;
        self.read_heads(&mut recorder, &image)?.read(&mut recorder, image.most_samples);
        let (images, has_unclosed) = recorder.finish(|parts| self.images_of(&parts[..2], &parts[2..]))?;
        Ok((images, has_unclosed.then_some(image.counts)))
    }

    /// Returns the buffers between the stages, read back.
    pub fn mask_stages(&mut self) -> Result<MaskStages, JobError> {
        let device = &self.sampler.device;
        let (all, mask) = (self.rays() as usize, bytes_of(self.mask_words()));
        let rays = self.bands[0].rays() as usize;
        // Without the rays that fill up the last workgroup.
        let of_rays = |words: &[u32]| words.chunks(all).flat_map(|words| &words[..rays]).copied().collect::<Vec<u32>>();
        let mut recorder = Recorder::new(device);
        let buffers = self.fill_masks(&mut recorder)?;
        for buffer in buffers.masks.iter().flatten() {
            recorder.read_back(buffer, 0, mask);
        }
        let masks =
            recorder.finish(|parts| parts.chunks(2).map(|pair| [of_rays(pair[0]), of_rays(pair[1])]).collect())?;
        let mut recorder = Recorder::new(device);
        self.classify(&mut recorder, &buffers)?;
        for buffer in [buffers.single(), buffers.pair(), &buffers.ranks] {
            recorder.read_back(buffer, 0, mask);
        }
        recorder.read_back(&buffers.counts, 0, bytes_of(rays as u64));
        recorder.read_back(&buffers.offsets, 0, bytes_of(rays as u64 + 1));
        Ok(recorder.finish(|parts| MaskStages {
            masks,
            single: of_rays(parts[0]),
            pair: of_rays(parts[1]),
            ranks: of_rays(parts[2]),
            counts: parts[3].to_vec(),
            offsets: parts[4].to_vec(),
        })?)
    }
}
