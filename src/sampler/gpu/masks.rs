//! The route by masks: Leung & Wang's method, with two masks from one geometry pass.

use super::passes::{TALLY_WORDS, workgroups};
use super::stages::{CLASSIFY, IDENTITIES, MASKS, RETRIEVE};
use super::{BandJob, Made};
use crate::gpu::{DeviceError, Recorder, bytes_of};

impl BandJob<'_> {
    /// Makes the band.
    pub fn by_masks(&mut self) -> Result<Made, DeviceError> {
        let sampler = self.sampler;
        let view = self.view();
        let rays = u64::from(view.rays);
        let mask = rays * u64::from(view.words);
        let names = [["change", "any"], ["change of the second", "any of the second"]];
        let mut masks = Vec::new();
        for [change, any] in &names[..self.solids.len()] {
            masks.push([self.words(change, mask)?, self.words(any, mask)?]);
        }
        let ranks = self.words("ranks", mask)?;
        let counts = self.words("counts", rays)?;
        let offsets = self.words("offsets", rays + 1)?;
        let tally = self.words("tally", TALLY_WORDS)?;
        let [none, none_2] = [self.words("none", 1)?, self.words("none, too", 1)?];

        let mut recorder = Recorder::new(&sampler.device);
        let uniform = recorder.uniform(bytemuck::bytes_of(&view));
        recorder.clear(&tally, bytes_of(TALLY_WORDS));
        for (i, [change, any]) in masks.iter().enumerate() {
            recorder.clear(change, bytes_of(mask));
            recorder.clear(any, bytes_of(mask));
            self.geometry_pass(&mut recorder, &MASKS, i, 0, &[(4, change), (5, any)])?;
        }
        let [change, any] = &masks[0];
        let [change_b, any_b] = masks.get(1).map_or([&none, &none_2], |[change, any]| [change, any]);
        self.by_ray(
            &mut recorder,
            &CLASSIFY,
            &[(0, &uniform), (1, change), (2, any), (3, &ranks), (4, &counts), (5, &tally), (6, change_b), (7, any_b)],
        )?;
        self.scan(&mut recorder, &counts, &offsets)?;
        recorder.read_back(&offsets, bytes_of(rays), 4);
        let total = u64::from(recorder.finish()?[0][0]);
        if bytes_of(total) > sampler.largest_binding() {
            return Ok(Made::TooLarge { what: "samples", bytes: bytes_of(total) });
        }

        let samples = self.words("samples", total)?;
        let mut recorder = Recorder::new(&sampler.device);
        let uniform = recorder.uniform(bytemuck::bytes_of(&view));
        let identities = sampler.kernels.get(&sampler.device, &IDENTITIES, self.image.flags())?;
        let bound = [(0, &uniform), (1, &offsets), (2, &samples)];
        recorder.dispatch(&identities, &bound, workgroups(total as u32));
        // Classification has put the voxels of one sample into the first mask, those of two into the second or, of an
        // intersection, into the second solid's first.
        let pair = if self.solids.len() == 2 { change_b } else { any };
        for (i, [_, any]) in masks.iter().enumerate() {
            let bound = [(4, change), (5, pair), (6, &ranks), (7, &offsets), (8, &samples), (9, &tally), (10, any)];
            self.geometry_pass(&mut recorder, &RETRIEVE, i, 0, &bound)?;
        }
        self.bring_back(recorder, &counts, &offsets, &samples, None, &tally, total).map(Made::Band)
    }
}
