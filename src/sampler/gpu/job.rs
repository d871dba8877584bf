//! One job: bands of rays along up to three axes, made in one recording, and the dispatches that the routes share.

use std::sync::Arc;

use super::band::Band;
use super::image::Image;
use super::solid::{Blocks, Chunk, ResidentSolid};
use super::stages::{COMPACT, Flag, Flags, GeometryPass, SCAN, Stage};
use super::view::{BLOCK_ROWS, FOUND_WORDS, SCAN_BLOCK, TALLY_WORDS, Tally, View, wide};
use super::{GpuSampler, Route};
use crate::gpu::{DeviceError, Pool, Recorder, Workgroups, bytes_of, counted, workgroups};
use crate::ldi::{BandImage, Windings};
use crate::sampler::stages::UNCLOSED;

/// Bands of images of one solid, of the intersection of two, or of a combination.
pub(super) struct Job<'a> {
    pub sampler: &'a GpuSampler,
    pub pool: &'a mut Pool,
    pub solids: &'a [Arc<ResidentSolid>],
    pub image: &'a Image,
    pub route: Route,
    pub bands: &'a [Band],
    /// The input of its shaders, without the sizes of lists.
    pub view: View,
}

/// The reason why a job could not be done.
pub(super) enum JobError {
    Device(DeviceError),
    /// A buffer would take more bytes than allowed; a smaller job needs less.
    TooLarge {
        what: &'static str,
        bytes: u64,
        limit: u64,
    },
}

impl From<DeviceError> for JobError {
    fn from(error: DeviceError) -> JobError {
        JobError::Device(error)
    }
}

impl JobError {
    /// Returns whether a smaller job may succeed.
    pub fn has_way_out(&self) -> bool {
        use DeviceError::{OutOfMemory, TooLarge};
        matches!(self, JobError::TooLarge { .. } | JobError::Device(TooLarge { .. } | OutOfMemory { .. }))
    }
}

/// The image of a band, read back, and the winding sums of the images of the leaves of a combination.
pub(super) struct Brought {
    pub image: BandImage,
    pub of_leaves: Vec<Windings>,
}

/// Images on the device, valid as soon as the recorded commands have run.
pub(super) struct DeviceImage {
    /// The places of the crossings that the samples of each ray come from.
    pub starts: wgpu::Buffer,
    /// Number of samples of each ray, or the mark of an unclosed one.
    pub counts: wgpu::Buffer,
    /// The samples: those of a ray follow one another, and between rays there may be gaps.
    pub samples: wgpu::Buffer,
    /// The triangles of the samples, if they are kept.
    pub triangles: Option<wgpu::Buffer>,
    pub tallies: wgpu::Buffer,
    /// An upper bound of the number of samples.
    pub most_samples: u64,
    /// There are no gaps.
    pub is_dense: bool,
}

/// Images on the device without gaps.
pub(super) struct CompactImage {
    /// The offset of the samples of each ray, and the end of the last ones.
    pub offsets: wgpu::Buffer,
    pub samples: wgpu::Buffer,
    pub triangles: Option<wgpu::Buffer>,
}

impl CompactImage {
    /// Records that the first of the samples, and their triangles, are read back.
    pub fn read(&self, recorder: &mut Recorder, samples: u64) {
        recorder.read_back(&self.samples, 0, bytes_of(samples));
        if let Some(triangles) = &self.triangles {
            recorder.read_back(triangles, 0, bytes_of(samples));
        }
    }
}

impl Tally {
    /// Returns the winding sums.
    pub fn windings(&self) -> Windings {
        Windings {
            wound: wide(self.wound_low, self.wound_high),
            aligned: wide(self.aligned_low, self.aligned_high),
            changes: i64::from(self.changes),
            unpaired: wide(self.unpaired_low, self.unpaired_high),
        }
    }
}

impl Job<'_> {
    /// Returns the number of rays, with those that fill up workgroups.
    pub fn rays(&self) -> u64 {
        self.view.rays.into()
    }

    /// Returns whether it is a single ray, which cannot be divided further.
    pub fn is_single_ray(&self) -> bool {
        matches!(self.bands, [band] if band.rays() == 1)
    }

    /// Refuses several buffers of this many words each, where one exceeds a binding or all of them exceed the memory
    /// budget. A single ray may exceed the budget.
    pub fn admit(&self, what: &'static str, words: u64, buffers: u64) -> Result<(), JobError> {
        let (bytes, limit) = (bytes_of(words), self.limit(buffers));
        if bytes > limit { Err(JobError::TooLarge { what, bytes, limit }) } else { Ok(()) }
    }

    /// Returns the most bytes of each of several buffers.
    pub fn limit(&self, buffers: u64) -> u64 {
        let budget = if self.is_single_ray() { u64::MAX } else { self.sampler.options.memory / buffers };
        self.sampler.largest_binding().min(budget)
    }

    /// Returns a pooled buffer with room for this many words.
    pub fn words(&mut self, name: &'static str, words: u64) -> Result<wgpu::Buffer, DeviceError> {
        self.pool.room(&self.sampler.device, name, bytes_of(words))
    }

    /// Returns a pooled buffer of this many words, which the recording sets to zero.
    pub fn zeros(
        &mut self,
        recorder: &mut Recorder,
        name: &'static str,
        words: u64,
    ) -> Result<wgpu::Buffer, DeviceError> {
        let buffer = self.words(name, words)?;
        recorder.clear(&buffer, bytes_of(words));
        Ok(buffer)
    }

    /// Runs one kernel over its buffers, with one invocation per ray.
    pub fn by_ray(
        &self,
        recorder: &mut Recorder,
        stage: &'static Stage,
        buffers: &[(u32, &wgpu::Buffer)],
    ) -> Result<(), DeviceError> {
        self.run(recorder, stage, &self.view, buffers, workgroups(self.view.rays))
    }

    /// Runs one kernel.
    pub fn run(
        &self,
        recorder: &mut Recorder,
        stage: &'static Stage,
        view: &View,
        buffers: &[(u32, &wgpu::Buffer)],
        workgroups: Workgroups,
    ) -> Result<(), DeviceError> {
        self.run_as(recorder, stage, self.image.flags(0), view, buffers, workgroups)
    }

    /// Runs one kernel in the variant that the flags select.
    pub fn run_as(
        &self,
        recorder: &mut Recorder,
        stage: &'static Stage,
        flags: Flags,
        view: &View,
        buffers: &[(u32, &wgpu::Buffer)],
        workgroups: Workgroups,
    ) -> Result<(), DeviceError> {
        let kernel = self.sampler.kernels.get(&self.sampler.device, stage, flags)?;
        let view = recorder.uniform(bytemuck::bytes_of(view));
        recorder.dispatch(&kernel, view, buffers, workgroups);
        Ok(())
    }

    /// Runs one pass over the geometry of solid `i`.
    pub fn geometry_pass(
        &self,
        recorder: &mut Recorder,
        pass: &'static GeometryPass,
        i: usize,
        view: &View,
        buffers: &[(u32, &wgpu::Buffer)],
    ) -> Result<(), DeviceError> {
        let flags = self.image.flags(i);
        let view = view.of_part(self.image, i, self.bands);
        for Chunk { positions, triangles, first_triangle, count, blocks } in &self.solids[i].chunks {
            let view = View { triangles: *count, first_triangle: *first_triangle, ..view };
            let bound = |blocks| [&[(1, positions), (2, triangles), (3, blocks)], buffers].concat();
            // The shader of whole triangles does not look at blocks.
            self.run_as(recorder, &pass.triangles, flags, &view, &bound(triangles), workgroups(*count))?;
            for Blocks { buffer, count, are_hard } in blocks {
                let flags = if *are_hard { flags.with(Flag::Hard) } else { flags };
                let view = View { blocks: *count, ..view };
                self.run_as(recorder, &pass.rows, flags, &view, &bound(buffer), workgroups(*count * BLOCK_ROWS))?;
            }
        }
        Ok(())
    }

    /// Writes the exclusive prefix sum of counts into `starts`, and their sum after the last; `view` has their number and the
    /// capacity of the lists.
    pub fn scan(
        &mut self,
        recorder: &mut Recorder,
        view: &View,
        counts: &wgpu::Buffer,
        starts: &wgpu::Buffer,
        [found, long_lists]: [&wgpu::Buffer; 2],
    ) -> Result<(), DeviceError> {
        let blocks = view.lists.div_ceil(SCAN_BLOCK);
        let sums = self.words("block sums", blocks.into())?;
        for stage in &SCAN {
            let buffers = [(1, counts), (2, &sums), (3, starts), (4, found), (5, long_lists)];
            self.run(recorder, stage, view, &buffers, counted(blocks))?;
        }
        Ok(())
    }

    /// Returns the number of words of the tallies of all bands, those of the result and behind them those of each leaf.
    pub fn tally_words(&self) -> u64 {
        TALLY_WORDS * (self.bands.len() * (1 + self.image.leaves())) as u64
    }

    /// Returns the winding sums of each leaf in a band.
    pub fn windings_of_leaves(&self, tallies: &[Tally], band: usize) -> Vec<Windings> {
        let of_leaves = tallies.chunks_exact(self.bands.len()).skip(1);
        of_leaves.map(|of_bands| of_bands[band].windings()).collect()
    }

    /// Makes the images on the device, and reads them back.
    pub fn bring_back(&mut self) -> Result<Vec<Brought>, JobError> {
        let (images, unclosed) = match self.route {
            Route::Masks => self.bring_back_by_masks()?,
            Route::Lists => self.bring_back_by_lists()?,
        };
        let marks = match unclosed {
            Some(counts) => self.unclosed_rays(&counts)?,
            None => vec![Vec::new(); self.bands.len()],
        };
        let marked = |(brought, unclosed): (Brought, Vec<u32>)| Brought {
            image: brought.image.with_unclosed(unclosed),
            ..brought
        };
        Ok(images.into_iter().zip(marks).map(marked).collect())
    }

    /// Records that the gaps between the rays of images are closed, and their offsets and tallies read back.
    pub fn read_heads(&mut self, recorder: &mut Recorder, image: &DeviceImage) -> Result<CompactImage, DeviceError> {
        let compact = match image.is_dense {
            true => CompactImage {
                offsets: image.starts.clone(),
                samples: image.samples.clone(),
                triangles: image.triangles.clone(),
            },
            false => self.compact(recorder, image)?,
        };
        recorder.read_back(&compact.offsets, 0, bytes_of(self.rays() + 1));
        recorder.read_back(&image.tallies, 0, bytes_of(self.tally_words()));
        Ok(compact)
    }

    /// Returns the images that were read back, one a band, and whether there are unclosed rays: from the offsets, the tallies, the
    /// samples, and their triangles if they are kept.
    pub fn images_of(&self, heads: &[&[u32]], samples: &[&[u32]]) -> (Vec<Brought>, bool) {
        let tallies: &[Tally] = bytemuck::cast_slice(heads[1]);
        let image = |(band, tally): (usize, &Tally)| {
            let view = &self.view.bands[band];
            let offsets = &heads[0][view.first_ray as usize..][..=view.rays as usize];
            let first = offsets[0];
            let own = first as usize..offsets[view.rays as usize] as usize;
            let ends = offsets[1..].iter().map(|end| end - first).collect();
            let depths: &[i32] = bytemuck::cast_slice(&samples[0][own.clone()]);
            let triangles = samples.get(1).map_or_else(Vec::new, |triangles| triangles[own].to_vec());
            let windings = self.image.counts_windings().then(|| tally.windings());
            Brought {
                image: BandImage::from_parts(ends, depths.to_vec(), triangles, windings),
                of_leaves: self.windings_of_leaves(tallies, band),
            }
        };
        let own = &tallies[..self.bands.len()];
        (own.iter().enumerate().map(image).collect(), own.iter().any(|tally| tally.unclosed > 0))
    }

    /// Returns the unclosed rays of each band.
    fn unclosed_rays(&self, counts: &wgpu::Buffer) -> Result<Vec<Vec<u32>>, DeviceError> {
        let mut recorder = Recorder::new(&self.sampler.device);
        recorder.read_back(counts, 0, bytes_of(self.rays()));
        recorder.finish(|parts| {
            let of_band = |band: usize| {
                let view = &self.view.bands[band];
                let counts = &parts[0][view.first_ray as usize..][..view.rays as usize];
                let unclosed = |(ray, count): (usize, &u32)| (*count == UNCLOSED).then_some(ray as u32);
                counts.iter().enumerate().filter_map(unclosed).collect()
            };
            (0..self.bands.len()).map(of_band).collect()
        })
    }

    /// Records that the gaps between the rays of images are closed.
    fn compact(&mut self, recorder: &mut Recorder, image: &DeviceImage) -> Result<CompactImage, DeviceError> {
        let offsets = self.words("offsets", self.rays() + 1)?;
        let samples = self.words("samples", image.most_samples)?;
        let none = self.words("no long lists", 1)?;
        let found = self.zeros(recorder, "samples found", FOUND_WORDS)?;
        let view = View { lists: self.view.rays, capacity: u32::MAX, ..self.view };
        self.scan(recorder, &view, &image.counts, &offsets, [&found, &none])?;
        let compacted = |loose, compact| [(1, &image.starts), (2, loose), (3, &offsets), (4, compact)];
        self.by_ray(recorder, &COMPACT, &compacted(&image.samples, &samples))?;
        let mut triangles = None;
        if let Some(loose) = &image.triangles {
            let compact = self.words("triangles of samples", image.most_samples)?;
            self.by_ray(recorder, &COMPACT, &compacted(loose, &compact))?;
            triangles = Some(compact);
        }
        Ok(CompactImage { offsets, samples, triangles })
    }
}
