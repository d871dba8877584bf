//! The cubes of a raster that patches may meet.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::parallel::*;
use glam::DVec3;

use super::{BallPatches, exact};
use crate::cancel::checkpoint;
use crate::grid::Grid;
use crate::minkowski::Primitives;

/// Enlargement of cubes for widened patches and for rounding, in lattice steps.
const MARGIN: f64 = 3.0;

/// Patches in one task.
const CHUNK: usize = 1 << 10;

/// The cubes of a grid that tubes and caps may meet.
pub struct RoundCubes<'p> {
    patches: &'p BallPatches<'p>,
    grid: &'p Grid,
    /// The first plane of cubes that each patch may meet, and that behind the last.
    planes: Vec<[u32; 2]>,
}

/// A round patch: points at a distance from a segment, in a box, and in some half-spaces.
struct Round<'p> {
    start: DVec3,
    along: DVec3,
    min: DVec3,
    max: DVec3,
    /// A direction across the segment in which the points reach at least this far from it.
    towards: (DVec3, f64),
    /// Directions in which the points do not lie from the segment.
    away: &'p [DVec3],
}

impl BallPatches<'_> {
    /// Returns the shifted facets, rounded to the lattice. Those wholly outside the grid are omitted.
    pub fn shifted_facets(&self, grid: &Grid) -> Primitives {
        let mut shifted = Primitives::default();
        let facets = (0..self.normals.len()).map(|triangle| self.facet(triangle));
        let turned = self.turned.iter().map(|&triangle| self.facet(triangle as usize).turned());
        for facet in facets.chain(turned).filter(|facet| facet.normal != DVec3::ZERO) {
            let corners = facet.corners.map(|corner| (exact(corner) + self.radius * facet.normal).round());
            let is_outside = (0..3).any(|i| {
                corners.iter().all(|corner| corner[i] < 0.0)
                    || corners.iter().all(|corner| corner[i] > f64::from(grid.length(i)))
            });
            if !is_outside {
                let first = shifted.positions.len() as u32;
                shifted.positions.extend(corners.map(|corner| corner.to_array().map(|c| c as i32)));
                shifted.triangles.push([first, first + 1, first + 2]);
            }
        }
        shifted
    }

    /// Returns the cubes of a grid that tubes and caps may meet.
    pub fn round_cubes<'p>(&'p self, grid: &'p Grid) -> RoundCubes<'p> {
        let count = self.tubes.len() + self.caps.len();
        let of_patch = |at| {
            let planes = self.round(at).cubes(grid, 2);
            [planes.start as u32, planes.end as u32]
        };
        let planes = (0..count).into_par_iter().with_min_len(CHUNK).map(of_patch).collect();
        RoundCubes { patches: self, grid, planes }
    }

    /// Returns a tube, or after all tubes a cap.
    fn round(&self, at: usize) -> Round<'_> {
        match at.checked_sub(self.tubes.len()) {
            None => self.round_tube(at),
            Some(cap) => self.round_cap(cap),
        }
    }

    fn round_tube(&self, at: usize) -> Round<'_> {
        let tube = &self.tubes[at];
        let [first, last] = tube.borders;
        // The tangents at the ends of an arc meet beyond it.
        let apex = (first + last) / (1.0 + first.dot(last)).max(1e-6);
        let min = first.min(last).min(apex).max(DVec3::NEG_ONE);
        let max = first.max(last).max(apex).min(DVec3::ONE);
        let (start, along) = (exact(tube.start), tube.length * tube.direction);
        let end = start + along;
        let middle = (first + last).normalize_or_zero();
        Round {
            start,
            along,
            min: start.min(end) + self.radius * min,
            max: start.max(end) + self.radius * max,
            towards: (middle, self.radius * middle.dot(first).min(middle.dot(last))),
            away: &[],
        }
    }

    fn round_cap(&self, at: usize) -> Round<'_> {
        let cap = &self.caps[at];
        let start = exact(cap.vertex);
        let [min, max] = [cap.least, cap.most].map(|normal| start + self.radius * normal);
        let (first, count) = (cap.spokes.0 as usize, cap.spokes.1 as usize);
        let away = &self.spokes[first..first + count];
        Round { start, along: DVec3::ZERO, min, max, towards: (DVec3::ZERO, 0.0), away }
    }
}

impl Round<'_> {
    /// Returns the cubes along an axis that may meet the patch.
    fn cubes(&self, grid: &Grid, axis: usize) -> Range<usize> {
        let side = f64::from(1u32 << grid.shift());
        let cubes = f64::from(grid.rays()[axis]);
        let low = ((self.min[axis] - MARGIN) / side).floor();
        let end = ((self.max[axis] + MARGIN) / side).floor() + 1.0;
        low.clamp(0.0, cubes) as usize..end.clamp(0.0, cubes) as usize
    }
}

impl RoundCubes<'_> {
    /// Adds the cubes of some planes, a bit each, in words and rows as node sets have them.
    pub fn add_to(&self, bits: &mut [u64], planes: Range<usize>) {
        let found: Vec<AtomicU64> = bits.iter().map(|_| AtomicU64::new(0)).collect();
        self.planes.par_iter().enumerate().with_min_len(CHUNK).for_each(|(at, &[start, end])| {
            let of_patch = planes.start.max(start as usize)..planes.end.min(end as usize);
            if !of_patch.is_empty() {
                checkpoint();
                self.add(&self.patches.round(at), of_patch, planes.start, &found);
            }
        });
        bits.iter_mut().zip(found).for_each(|(bits, found)| *bits |= found.into_inner());
    }

    /// Adds the cubes of a patch in some planes, where `found` begins with the plane `first`.
    fn add(&self, round: &Round, planes: Range<usize>, first: usize, found: &[AtomicU64]) {
        let size = self.grid.rays().map(|n| n as usize);
        let (words, side) = (size[0].div_ceil(64), f64::from(1u32 << self.grid.shift()));
        let [xs, ys] = [0, 1].map(|axis| round.cubes(self.grid, axis));
        let reach = 0.5 * 3f64.sqrt() * side + MARGIN;
        let radius = self.patches.radius;
        let (least, most) = ((radius - reach).max(0.0).powi(2), (radius + reach).powi(2));
        let per_length = 1.0 / round.along.length_squared().max(f64::MIN_POSITIVE);
        for z in planes {
            for y in ys.clone() {
                for x in xs.clone() {
                    let from = side * (DVec3::new(x as f64, y as f64, z as f64) + 0.5) - round.start;
                    let share = (from.dot(round.along) * per_length).clamp(0.0, 1.0);
                    let across = from - share * round.along;
                    let (towards, least_towards) = round.towards;
                    if (least..=most).contains(&across.length_squared())
                        && across.dot(towards) >= least_towards - reach
                        && round.away.iter().all(|direction| across.dot(*direction) <= reach)
                    {
                        let word = &found[((z - first) * size[1] + y) * words + x / 64];
                        if word.load(Ordering::Relaxed) >> (x % 64) & 1 == 0 {
                            word.fetch_or(1 << (x % 64), Ordering::Relaxed);
                        }
                    }
                }
            }
        }
    }
}
