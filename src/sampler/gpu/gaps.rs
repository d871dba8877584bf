//! Reduced crossing lists: lists as for images, sorted, then `gaps` (how often each crossing is kept) → `scan` → `offsets` and
//! `keep`.

use super::GpuSampler;
use super::image::Image;
use super::job::{Job, JobError};
use super::lists::Lists;
use super::stages::{GAPS, KEEP, OFFSETS};
use super::view::{FOUND_WORDS, View};
use crate::fixed::{Crossing, Hit};
use crate::gpu::{Recorder, bytes_of, workgroups};
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

/// Crossings of a list for each round of a loop that an adapter guarantees: an invocation of the workgroup that sorts them takes
/// about two rounds for a crossing.
const CROSSINGS_PER_ROUND: u32 = 8;

impl Job<'_> {
    /// Finds the kept crossings of the only band, and reads them back.
    fn kept(&mut self) -> Result<KeptBand, JobError> {
        let rays = self.rays();
        let keeps_triangles = self.image.keeps_triangles;
        let mut kept_buffers = None;
        let record = |job: &mut Self, recorder: &mut Recorder, lists: &Lists| {
            job.sort_short(recorder, lists)?;
            let Lists { starts, capacity, crossings, crossed, .. } = lists;
            let counts = job.words("copies of crossings", *capacity)?;
            let places = job.words("places of crossings", capacity + 1)?;
            let offsets = job.words("offsets", rays + 1)?;
            // Twice where a crossing ends a gap and its ray; far fewer do, and the buffer need not have room for all.
            let room = (2 * capacity).min(job.sampler.largest_binding() / 4);
            let kept = job.words("kept crossings", room)?;
            let kept_triangles = job.words("kept triangles", if keeps_triangles { room } else { 1 })?;
            let none = job.words("no long lists", 1)?;
            let found = job.zeros(recorder, "kept found", FOUND_WORDS)?;
            let by_crossing = workgroups(*capacity as u32);
            let view = View { capacity: *capacity as u32, ..job.view };
            job.run(recorder, &GAPS, &view, &[(1, starts), (2, crossings), (3, &counts)], by_crossing)?;
            let view = View { lists: *capacity as u32, capacity: u32::MAX, ..job.view };
            job.scan(recorder, &view, &counts, &places, [&found, &none])?;
            let bound = [(1, starts), (2, &places), (3, &offsets)];
            job.run(recorder, &OFFSETS, &job.view, &bound, workgroups(job.view.rays + 1))?;
            let bound = [(1, starts), (2, &places), (3, crossings), (4, crossed), (5, &kept), (6, &kept_triangles)];
            let view = View { capacity: room as u32, ..job.view };
            job.run(recorder, &KEEP, &view, &bound, by_crossing)?;
            recorder.read_back(&offsets, 0, bytes_of(u64::from(job.bands[0].rays()) + 1));
            kept_buffers = Some(([kept, kept_triangles], room));
            Ok(())
        };
        let others = if keeps_triangles { 6 } else { 4 };
        let (offsets, found) = self.by_lists(others, record, |_, found, parts| (parts[0].to_vec(), *found))?;
        self.sampler.device.admit_rounds(found.greatest / CROSSINGS_PER_ROUND)?;
        let count = u64::from(offsets[offsets.len() - 1]);
        let Some((buffers, room)) = kept_buffers else { unreachable!("lists were recorded") };
        if count > room {
            return Err(JobError::TooLarge { what: "kept crossings", bytes: bytes_of(count), limit: bytes_of(room) });
        }
        let mut recorder = Recorder::new(&self.sampler.device);
        for (buffer, wanted) in buffers.iter().zip([true, keeps_triangles]) {
            recorder.read_back(buffer, 0, if wanted { bytes_of(count) } else { 0 });
        }
        let total = found.total.into();
        Ok(recorder.finish(|parts| KeptBand {
            offsets,
            crossings: parts[0].to_vec(),
            triangles: parts[1].to_vec(),
            total,
        })?)
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
        let image = Image::of_kept(triangles, keep, H::KEEPS_TRIANGLE)?;
        let (columns, rows) = image.grid.image_size(axis);
        let before = (image.window_rows(axis).start * columns) as usize;
        let mut lists = RayLists { offsets: vec![0; before + 1], ..RayLists::default() };
        self.by_jobs(
            &[triangles],
            &image,
            &[axis],
            |job| job.kept().map(|kept| [kept]),
            |_, part| Ok(part.append(&mut lists, axis)?),
        )?;
        let end = lists.hits.len() as u32;
        lists.offsets.resize(columns as usize * rows as usize + 1, end);
        Ok(lists)
    }
}
