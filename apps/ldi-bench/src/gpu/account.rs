//! Compulsory traffic of each stage, for any shader: bytes and atomics to compare measured times with.
//!
//! A stage reads each of its inputs once and writes each of its outputs once. Words of four bytes that atomics change, one by
//! one and in no order, count as read and written once, however often they are hit. Data that fits any cache, such as block
//! sums, uniforms and the blocks of rows of large triangles, is left out. So is the granularity of memory: a scattered word transfers a
//! whole sector, which is part of what a ratio to this traffic shows.

use std::ops::AddAssign;

use ldi_ops::grid::LatticeSolid;
use ldi_ops::ldi::Ldi;
use serde::Serialize;

/// Bytes of a position, and of a triangle.
const CORNERS: u64 = 12;

/// Bytes of a word.
const WORD: u64 = 4;

/// Bits of a mask word.
const WORD_BITS: u32 = 32;

/// Invocations of a workgroup of all stages that count windings.
const WORKGROUP: u64 = 64;

/// Counters to which every workgroup of such a stage adds, unless it has met no crossing.
const TALLIES: u64 = 4;

/// Words of the tally that is read back to the host.
const TALLY_WORDS: u64 = 8;

/// The size of one image of one solid.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Size {
    /// Number of triangles.
    pub triangles: u64,
    /// Number of vertices.
    pub positions: u64,
    /// Number of rays.
    pub rays: u64,
    /// Words of a mask, over all rays.
    pub mask_words: u64,
    /// Number of crossings of rays with triangles.
    pub crossings: u64,
    /// Number of rays with a crossing.
    pub crossed_rays: u64,
    /// Words of a mask with a crossing.
    pub crossed_words: u64,
    /// Number of samples of the image.
    pub samples: u64,
}

impl Size {
    /// Returns the size of an image of `samples` samples with the crossings of `exact`, the exact image under the even-odd
    /// rule, which has triangle ids. Its depths are rounded, so that a crossing at the very end of a word may count for the
    /// next one.
    pub fn of(solid: &LatticeSolid, exact: &Ldi, samples: u64) -> Size {
        let grid = exact.grid();
        let word = |depth: i32| (depth as u32 / grid.voxel(exact.axis())).min(grid.lod() - 1) / WORD_BITS;
        let (mut crossed_rays, mut crossed_words) = (0, 0);
        for ray in 0..exact.rays() {
            // Depths along a ray do not decrease, nor do their word indices.
            let runs = exact.samples(ray).chunk_by(|&a, &b| word(a) == word(b)).count() as u64;
            crossed_words += runs;
            crossed_rays += u64::from(runs > 0);
        }
        Size {
            triangles: solid.triangles().len() as u64,
            positions: solid.positions().len() as u64,
            rays: exact.rays().into(),
            mask_words: u64::from(exact.rays()) * u64::from(grid.lod().div_ceil(WORD_BITS)),
            crossings: exact.depths().len() as u64,
            crossed_rays,
            crossed_words,
            samples,
        }
    }

    /// Returns the bytes of a geometry pass: it reads all triangles and all positions.
    fn geometry(&self) -> u64 {
        CORNERS * (self.triangles + self.positions)
    }

    /// Returns the traffic of a prefix sum: it reads the counts twice, to sum the blocks and to spread their sums, and writes
    /// the offsets of rays.
    fn scan(&self) -> Moved {
        Moved::bytes(WORD * (2 * self.rays + self.rays + 1))
    }

    /// Returns the atomics on the tally: all workgroups of a stage of `invocations` add to it.
    fn tallied(&self, invocations: u64) -> u64 {
        TALLIES * invocations.div_ceil(WORKGROUP)
    }

    /// Returns the traffic of sampling by masks, by stage.
    pub fn by_masks(&self) -> Vec<(&'static str, Moved)> {
        vec![
            // Both masks, written.
            ("clear", Moved::bytes(WORD * 2 * self.mask_words)),
            // The geometry; the words of both masks that are hit, read and written; two atomics per crossing.
            (
                "masks",
                Moved {
                    bytes: self.geometry() + WORD * 2 * 2 * self.crossed_words,
                    atomics: 2 * self.crossings,
                    contended: 0,
                },
            ),
            // Both masks, read; ranks and counts, written; the mask of touched voxels becomes that of pairs, where there are
            // any.
            (
                "classify",
                Moved {
                    bytes: WORD * (2 * self.mask_words + self.mask_words + self.rays + self.crossed_words),
                    atomics: 0,
                    contended: self.tallied(self.rays),
                },
            ),
            ("scan", self.scan()),
            // The samples, written.
            ("identities", Moved::bytes(WORD * self.samples)),
            // The geometry; both masks and the ranks, where words were hit; first rank and first offset of each crossed ray;
            // samples read and written. A crossing changes one sample, or two, or none: about one.
            (
                "retrieve",
                Moved {
                    bytes: self.geometry() + WORD * (3 * self.crossed_words + 2 * self.crossed_rays + 2 * self.samples),
                    atomics: self.crossings,
                    contended: self.tallied(self.triangles),
                },
            ),
            // The offsets of rays, the samples and the tally.
            ("read back", Moved::bytes(WORD * (self.rays + 1 + self.samples + TALLY_WORDS))),
        ]
    }

    /// Returns the traffic of sampling by lists, by stage, for the first of some axes or another one, whose geometry the first
    /// has read. Every crossing of an exact image is a sample, so that nothing is left to compact.
    pub fn by_lists(&self, is_first: bool, is_exact: bool) -> Vec<(&'static str, Moved)> {
        let geometry = if is_first { self.geometry() } else { 0 };
        let mut stages = vec![
            // The counts, written.
            ("clear", Moved::bytes(WORD * self.rays)),
            // The geometry; counts of the crossed rays, read and written; rays and crossings, written; an atomic per crossing.
            (
                "cover",
                Moved {
                    bytes: geometry + WORD * (2 * self.crossed_rays + 2 * self.crossings),
                    atomics: self.crossings,
                    contended: 0,
                },
            ),
            // One scan of the counts of crossings, and one of those of samples.
            ("scan", Moved::bytes(self.scan().bytes * if is_exact { 1 } else { 2 })),
            // Rays and crossings, read; offsets of rays, read; their counts, read and written; crossings written; an atomic per
            // crossing.
            (
                "place",
                Moved {
                    bytes: WORD * (3 * self.crossed_rays + 3 * self.crossings),
                    atomics: self.crossings,
                    contended: 0,
                },
            ),
            // The offsets of rays and the crossings, read; samples and their counts, written.
            (
                "resolve",
                Moved {
                    bytes: WORD * (self.rays + 1 + self.crossings + self.samples + self.rays),
                    atomics: 0,
                    contended: self.tallied(self.rays),
                },
            ),
            // The offsets of rays, the samples and the tally.
            ("read back", Moved::bytes(WORD * (self.rays + 1 + self.samples + TALLY_WORDS))),
        ];
        if !is_exact {
            // Offsets of rays with gaps and without, read; samples read and written.
            stages.push(("compact", Moved::bytes(WORD * (2 * (self.rays + 1) + 2 * self.samples))));
        }
        stages
    }
}

/// The memory traffic of a stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Moved {
    /// Bytes read plus bytes written.
    pub bytes: u64,
    /// Atomic operations spread over a buffer.
    pub atomics: u64,
    /// Atomic operations of all workgroups on the same few words, which are serialised; those of rows of large triangles are left
    /// out.
    pub contended: u64,
}

impl Moved {
    fn bytes(bytes: u64) -> Moved {
        Moved { bytes, ..Moved::default() }
    }
}

impl AddAssign for Moved {
    fn add_assign(&mut self, other: Moved) {
        self.bytes += other.bytes;
        self.atomics += other.atomics;
        self.contended += other.contended;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use ldi_ops::grid::{Axis, Grid};
    use ldi_ops::mesh::ClosedMesh;
    use ldi_ops::sampler::cpu::CpuSampler;
    use ldi_ops::sampler::{FillRule, Sampler};

    /// A size without zeros, with more rays than fit two blocks of a prefix sum or two workgroups.
    const SIZE: Size = Size {
        triangles: 100,
        positions: 52,
        rays: 1000,
        mask_words: 32_000,
        crossings: 640,
        crossed_rays: 300,
        crossed_words: 500,
        samples: 600,
    };

    fn of(stages: &[(&'static str, Moved)], stage: &str) -> Moved {
        stages.iter().find(|(name, _)| *name == stage).unwrap().1
    }

    #[test]
    fn masks_are_accounted_for() {
        let stages = SIZE.by_masks();
        assert_eq!(of(&stages, "clear"), Moved { bytes: 256_000, atomics: 0, contended: 0 });
        assert_eq!(of(&stages, "masks"), Moved { bytes: 152 * 12 + 8000, atomics: 1280, contended: 0 });
        assert_eq!(of(&stages, "classify"), Moved { bytes: 384_000 + 4000 + 2000, atomics: 0, contended: 64 });
        assert_eq!(of(&stages, "scan").bytes, 12_004);
        assert_eq!(of(&stages, "identities").bytes, 2400);
        let retrieval = Moved { bytes: 152 * 12 + 6000 + 2400 + 4800, atomics: 640, contended: 8 };
        assert_eq!(of(&stages, "retrieve"), retrieval);
        assert_eq!(of(&stages, "read back").bytes, 4004 + 2400 + 32);
    }

    #[test]
    fn lists_are_accounted_for() {
        let stages = SIZE.by_lists(true, false);
        assert_eq!(of(&stages, "clear").bytes, 4000);
        assert_eq!(of(&stages, "cover"), Moved { bytes: 152 * 12 + 2400 + 5120, atomics: 640, contended: 0 });
        assert_eq!(of(&stages, "scan").bytes, 24_008);
        assert_eq!(of(&stages, "place"), Moved { bytes: 3600 + 7680, atomics: 640, contended: 0 });
        assert_eq!(of(&stages, "resolve"), Moved { bytes: 4004 + 2560 + 2400 + 4000, atomics: 0, contended: 64 });
        assert_eq!(of(&stages, "compact").bytes, 8008 + 4800);
        assert_eq!(of(&stages, "read back").bytes, 4004 + 2400 + 32);
        let other = SIZE.by_lists(false, true);
        assert_eq!((of(&other, "cover").bytes, of(&other, "scan").bytes), (2400 + 5120, 12_004));
        assert!(other.iter().all(|(name, _)| *name != "compact"));
    }

    #[test]
    fn sizes_are_counted_on_the_image() {
        let cube = ldi_ops::solids::cuboid(DVec3::ZERO, DVec3::new(8.0, 8.0, 8.0)).unwrap();
        let cube = ClosedMesh::check(cube).unwrap();
        let grid = Grid::with_resolution(cube.bounds(), 16, 64).unwrap();
        let solid = grid.quantise(&cube).unwrap();
        let exact = CpuSampler::default().sample_surface(&solid, Axis::Z, FillRule::EvenOdd).unwrap();
        let size = Size::of(&solid, &exact, 7);
        assert_eq!((size.triangles, size.positions, size.samples), (12, 8, 7));
        assert_eq!(size.mask_words, 2 * size.rays);
        // Every crossed ray enters in the first of its two words and leaves in the second.
        assert_eq!((size.crossings, size.crossed_words), (2 * size.crossed_rays, 2 * size.crossed_rays));
        assert!(size.crossed_rays > 0 && size.crossed_rays <= size.rays);
    }
}
