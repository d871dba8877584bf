//! Reduced crossing lists: `count` → `scan` → `scatter` → `sort` (and `merge`) as for images, then `gaps` (how often
//! each crossing is kept) → `scan` → `offsets` and `keep`.

use super::band::cut;
use super::image::{BandError, BandJob, Image, Way};
use super::lists::Lists;
use super::passes::MOST_SCANNED;
use super::stages::{GAPS, KEEP, OFFSETS};
use super::{GpuSampler, State};
use crate::fixed::{Crossing, Hit};
use crate::gpu::{Recorder, bytes_of, held, workgroups};
use crate::grid::{Axis, LatticeSolid};
use crate::ldi::TooManySamples;
use crate::sampler::SampleError;
use crate::sampler::lists::{Keep, ListSampler, RayLists};

/// The kept crossings of a band, read back to the host.
struct KeptBand {
    /// The offset of the crossings of each ray, and the end of the last ones.
    offsets: Vec<u32>,
    crossings: Vec<u32>,
    /// Empty where they are not requested.
    triangles: Vec<u32>,
    /// Number of crossings before the reduction.
    total: u64,
}

impl BandJob<'_> {
    /// Finds the kept crossings, and reads them back.
    fn kept(&mut self) -> Result<KeptBand, BandError> {
        let device = &self.sampler.device;
        let rays = u64::from(self.band.rays());
        let mut recorder = Recorder::new(device);
        // For each crossing, how often it is kept, and its place.
        let Lists { starts, totals, crossings, crossed, .. } = self.sorted_lists(&mut recorder, 2)?;
        let (starts, total) = (&starts[0], totals[0]);
        if total == 0 {
            let offsets = vec![0; rays as usize + 1];
            return Ok(KeptBand { offsets, crossings: Vec::new(), triangles: Vec::new(), total });
        }
        if total > MOST_SCANNED {
            let (bytes, limit) = (bytes_of(total), bytes_of(MOST_SCANNED));
            return Err(BandError::TooLarge { what: "crossings", bytes, limit });
        }
        let by_crossing = || workgroups(total as u32);
        let counts = self.words("copies of crossings", total)?;
        let places = self.words("places of crossings", total + 2)?;
        let offsets = self.words("offsets", rays + 2)?;
        let view = recorder.uniform(bytemuck::bytes_of(&self.view()));
        self.run(&mut recorder, &GAPS, &[(0, &view), (1, starts), (2, &crossings), (3, &counts)], by_crossing())?;
        self.scan_of(&mut recorder, total as u32, &counts, &places)?;
        let bound = [(0, &view), (1, starts), (2, &places), (3, &offsets)];
        self.run(&mut recorder, &OFFSETS, &bound, workgroups(rays as u32 + 1))?;
        recorder.read_back(&offsets, 0, bytes_of(rays + 1));
        let offsets = recorder.finish()?.swap_remove(0);

        let kept = u64::from(offsets[rays as usize]);
        let keeps_triangles = self.image.keeps_triangles;
        self.admit("kept crossings", kept, if keeps_triangles { 2 } else { 1 })?;
        let kept_crossings = self.words("kept crossings", kept)?;
        let kept_triangles = self.words("kept triangles", if keeps_triangles { kept } else { 1 })?;
        let mut recorder = Recorder::new(device);
        let view = recorder.uniform(bytemuck::bytes_of(&self.view()));
        let bound = [
            (0, &view),
            (1, starts),
            (2, &places),
            (3, &crossings),
            (4, &crossed),
            (5, &kept_crossings),
            (6, &kept_triangles),
        ];
        self.run(&mut recorder, &KEEP, &bound, by_crossing())?;
        recorder.read_back(&kept_crossings, 0, bytes_of(kept));
        if keeps_triangles {
            recorder.read_back(&kept_triangles, 0, bytes_of(kept));
        }
        let mut brought = recorder.finish()?.into_iter();
        let mut next = || {
            let mut words = brought.next().unwrap_or_default();
            words.truncate(kept as usize);
            words
        };
        Ok(KeptBand { offsets, crossings: next(), triangles: next(), total })
    }
}

impl KeptBand {
    /// Appends the band to the lists of the rays before it.
    fn append<H: Hit>(self, lists: &mut RayLists<H>, axis: Axis) -> Result<(), TooManySamples> {
        let before = lists.hits.len();
        if before + self.crossings.len() > u32::MAX as usize {
            return Err(TooManySamples { axis });
        }
        lists.offsets.extend(self.offsets[1..].iter().map(|end| before as u32 + end));
        let triangles = self.triangles.into_iter().chain(std::iter::repeat(0));
        let hits = self.crossings.into_iter().zip(triangles);
        lists.hits.extend(hits.map(|(crossing, triangle)| H::new(Crossing(crossing), triangle)));
        lists.crossings += self.total;
        Ok(())
    }
}

impl ListSampler for GpuSampler {
    type Error = SampleError;

    fn crossings<H: Hit>(&self, triangles: &LatticeSolid, axis: Axis, keep: Keep) -> Result<RayLists<H>, SampleError> {
        let image = Image::of_kept(triangles, axis, keep, H::KEEPS_TRIANGLE)?;
        let mut state = held(&self.state);
        let State { pool, residents } = &mut *state;
        let solids = self.resident(residents, &[triangles])?;
        let (columns, rows) = image.grid.image_size(axis);
        let looked_at = image.window_rows();
        let mut lists = RayLists { offsets: vec![0; (looked_at.start * columns) as usize + 1], ..RayLists::default() };
        let Way { route, most_rays } = image.way(self);
        let mut bands = cut(looked_at.clone(), columns, most_rays);
        bands.reverse();
        while let Some(band) = bands.pop() {
            let mut job = BandJob { sampler: self, pool, solids: &solids, image: &image, route, band };
            match (job.kept(), band.halves()) {
                (Ok(part), _) => part.append(&mut lists, axis)?,
                (Err(BandError::Device(error)), _) => return Err(error.into()),
                (Err(BandError::TooLarge { .. }), Some([first, second])) => bands.extend([second, first]),
                (Err(BandError::TooLarge { what, bytes, limit }), None) => {
                    return Err(self.device.too_large(what, bytes, limit).into());
                }
            }
        }
        let end = lists.hits.len() as u32;
        lists.offsets.resize(columns as usize * rows as usize + 1, end);
        Ok(lists)
    }
}
