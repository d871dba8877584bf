//! Details of a sum that lie between the rays: cavities in solid, and pieces of solid in void, that no ray meets.
//!
//! The primitives cover the boundary of a sum, so every detail is bounded by primitives. A cube of the raster is **quiet** where
//! no ray crosses the surface between the 27 nodes about it, which then are all in or all out. A quiet cube that a primitive
//! meets is a candidate.
//!
//! - Where its node is *out*, it has a piece of the sum in it, because a sum contains its primitives.
//! - Where its node is *in*, the primitive mostly lies inside the sum, as culling is partial. The cube is then halved along
//!   each axis, again and again: exact tests of the centres find what is out, and boxes that a pair of triangles or a ball is
//!   proved to fill are not halved. So each cavity is found that contains a cube of a sixteenth of a pitch.
//!
//! The number of tests is limited. Where the limit is reached, the search ends with larger boxes, and the result says so.
//! Details that touch each other count as one.
//! Cubes next to a surface that the rays see are not searched.

mod found;
mod quiet;
mod refine;
#[cfg(test)]
mod tests;

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::parallel::*;

use crate::bits::Ones;
use crate::fixed::{Hit, Pixels};
use crate::grid::{Axis, Grid, LatticeBox, LatticeSolid};
use crate::metrics::bounds::SurfaceCubes;
use crate::minkowski::ball::BallPatches;
use crate::minkowski::{Exterior, Polyhedron, Primitives, Probe, RaySpans, ResolveCounts};

pub use self::found::{BetweenRays, Detail};
use self::quiet::near_crossings;
use super::spot_check::is_in_spans;

/// Planes of a slab. The memory is bounded by as many slabs as there are threads, about three bits for each node of them, which is
/// less than the resolution of gaps takes.
const SLAB: usize = 32;

/// Number of halvings of a cube, at most.
const HALVINGS: u32 = 4;

/// Number of cubes with details up to which all halvings measure them.
const FEW_CUBES: usize = 8;

/// Number of halvings, at most, that measure the details of more cubes.
const HALVINGS_OF_MANY: u32 = 3;

/// Most cubes with pieces of the sum that are kept.
const MOST_PIECES: usize = 1 << 16;

/// A resolved sum, and the means to search it.
pub struct Searched<'a, H, P> {
    pub grid: &'a Grid,
    /// Spans whose gaps are all out.
    pub spans: &'a [RaySpans<H>; 3],
    pub exterior: Exterior,
    pub probe: &'a P,
    pub tests: Tests,
}

/// The number of tests that a search may take, so that it takes a small part of the time of the sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tests(pub usize);

/// Fewest tests of a sum of polyhedra with many facets.
const LEAST_TESTS: usize = 1 << 13;

/// Geometric mean of the numbers of facets of two polyhedra above which a test counts as slow.
const MANY_FACETS: usize = 2500;

/// Number of times as many tests, at most, for polyhedra of fewer facets.
const MORE_TESTS: usize = 16;

/// Number of tests of the resolution of gaps, which are as slow, per test.
const GAPS_OF_TEST: u64 = 8;

/// Fewest tests of an offset.
const LEAST_TESTS_OF_BALL: usize = 1 << 16;

/// Number of rays of an offset per test.
const RAYS_OF_TEST: usize = 2;

impl Tests {
    /// Returns the number for a sum of polyhedra. The more facets they have, the slower are tests.
    pub fn of_sum(resolved: &ResolveCounts, solids: [&Polyhedron; 2]) -> Tests {
        let tests = (resolved.components + resolved.gaps_tested) / GAPS_OF_TEST;
        let [a, b] = solids.map(|solid| solid.triangles().len());
        let more = (MANY_FACETS / (a * b).isqrt().max(1)).clamp(1, MORE_TESTS);
        Tests(usize::try_from(tests).unwrap_or(usize::MAX).max(more * LEAST_TESTS))
    }

    /// Returns the number for an offset, whose tests are fast.
    pub fn of_ball(grid: &Grid) -> Tests {
        let [x, y, z] = grid.rays().map(|n| n as usize);
        Tests(((x * y + y * z + z * x) / RAYS_OF_TEST).max(LEAST_TESTS_OF_BALL))
    }
}

/// The quiet cubes that primitives meet, by the state of their nodes.
#[derive(Debug, Default)]
struct Candidates {
    /// Empty if they are more than the tests.
    inside: Vec<[u32; 3]>,
    outside: Vec<[u32; 3]>,
    count: u64,
    /// True if some were omitted because there were too many.
    is_cut: bool,
}

impl Candidates {
    /// Appends those of the next planes.
    fn joined(mut self, next: Candidates) -> Candidates {
        self.inside.extend(next.inside);
        self.outside.extend(next.outside);
        self.count += next.count;
        self.is_cut |= next.is_cut || self.outside.len() > MOST_PIECES;
        self.outside.truncate(MOST_PIECES);
        self
    }
}

impl<H: Hit + Sync, P: Probe> Searched<'_, H, P> {
    /// Searches for details that triangles bound.
    pub fn bounded_by(&self, primitives: &Primitives) -> BetweenRays {
        let surface = LatticeSolid::of_primitives(self.grid, &primitives.positions, &primitives.triangles);
        let cubes = SurfaceCubes::of(&surface, None);
        self.details(|planes| cubes.slab(planes))
    }

    /// Searches for details that patches bound.
    pub fn bounded_by_patches(&self, patches: &BallPatches) -> BetweenRays {
        let facets = patches.shifted_facets(self.grid);
        let surface = LatticeSolid::of_primitives(self.grid, &facets.positions, &facets.triangles);
        let (cubes, round) = (SurfaceCubes::of(&surface, None), patches.round_cubes(self.grid));
        self.details(|planes| {
            let mut bits = cubes.slab(planes.clone());
            round.add_to(&mut bits, planes);
            bits
        })
    }

    /// Searches for details, where `met` returns the cubes of some planes that primitives meet, as words of bits.
    fn details(&self, met: impl Fn(Range<usize>) -> Vec<u64> + Sync) -> BetweenRays {
        let candidates = self.candidates(met);
        let halvings = self.grid.shift().saturating_sub(2).min(HALVINGS);
        let (cavities, reached) = refine::cubes_with_cavities(self, &candidates.inside, halvings);
        let pitch = self.grid.pitch();
        let mut found = BetweenRays {
            details: Vec::new(),
            pitch,
            candidates: candidates.count,
            searched_to: if candidates.is_cut { pitch } else { pitch / f64::from(1u32 << reached) },
            is_complete: !candidates.is_cut && reached == halvings,
        };
        for (cubes, is_of_sum) in [(&cavities, false), (&candidates.outside, true)] {
            let is_solid = is_of_sum == (self.exterior == Exterior::Out);
            let halvings = if cubes.len() <= FEW_CUBES { halvings } else { halvings.min(HALVINGS_OF_MANY) };
            found.add(self.grid, cubes, is_solid, |cube| {
                refine::extent_in_cube(self.grid, self.probe, cube, is_of_sum, halvings)
            });
        }
        found.sort();
        found
    }

    fn candidates(&self, met: impl Fn(Range<usize>) -> Vec<u64> + Sync) -> Candidates {
        let [columns, rows, planes] = self.grid.rays().map(|n| n as usize);
        let words = columns.div_ceil(64);
        let along_z = &self.spans[Axis::Z.depth()];
        let ends_along_z = along_z.ends(Pixels::new(self.grid.shift()));
        let inside = AtomicUsize::new(0);
        let of_slab = |first: usize| {
            let slab = first..planes.min(first + SLAB);
            let near = near_crossings(self.grid, (self.spans, &ends_along_z), slab.clone());
            let mut found = Candidates::default();
            for (at, (met, near)) in met(slab).into_iter().zip(near).enumerate() {
                for bit in Ones(met & !near) {
                    let row = at / words;
                    let cube = [(at % words) as u32 * 64 + bit, (row % rows) as u32, (first + row / rows) as u32];
                    found.count += 1;
                    match is_in_spans(self.grid, along_z, self.exterior, cube) {
                        true if inside.fetch_add(1, Ordering::Relaxed) < self.tests.0 => found.inside.push(cube),
                        false if found.outside.len() < MOST_PIECES => found.outside.push(cube),
                        _ => found.is_cut = true,
                    }
                }
            }
            found
        };
        let slabs: Vec<usize> = (0..planes).step_by(SLAB).collect();
        let mut found = Candidates::default();
        for slabs in slabs.chunks(rayon::current_num_threads()) {
            let slabs: Vec<Candidates> = slabs.par_iter().with_max_len(1).map(|&first| of_slab(first)).collect();
            found = slabs.into_iter().fold(found, Candidates::joined);
        }
        if found.is_cut {
            found.inside = Vec::new();
        }
        found
    }
}

/// Returns the box of a cube of the raster.
fn box_of(grid: &Grid, cube: [u32; 3]) -> LatticeBox {
    let min = cube.map(|index| (index << grid.shift()) as i32);
    LatticeBox { min, max: min.map(|low| low + (1 << grid.shift())) }
}
