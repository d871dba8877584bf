//! The cubes of a raster that patches may meet.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::{BallPatches, exact};
use crate::cancel::checkpoint;
use crate::grid::Grid;
use crate::minkowski::Primitives;

/// Enlargement of cubes for widened patches and for rounding, in lattice steps.
const MARGIN: f64 = 3.0;

/// Patches in one task.
const CHUNK: usize = 1 << 10;

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

    /// Adds the cubes of some planes that tubes and caps may meet, a bit each, in words and rows as node sets have them.
    pub fn add_round_cubes(&self, grid: &Grid, planes: Range<usize>, bits: &mut [u64]) {
        let found: Vec<AtomicU64> = bits.iter().map(|_| AtomicU64::new(0)).collect();
        let (tubes, count) = (self.tubes.len(), self.tubes.len() + self.caps.len());
        (0..count.div_ceil(CHUNK)).into_par_iter().for_each(|chunk| {
            checkpoint();
            for at in chunk * CHUNK..count.min((chunk + 1) * CHUNK) {
                let round = if at < tubes { self.round_tube(at) } else { self.round_cap(at - tubes) };
                self.add_cubes(&round, grid, planes.clone(), &found);
            }
        });
        bits.iter_mut().zip(found).for_each(|(bits, found)| *bits |= found.into_inner());
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

    fn add_cubes(&self, round: &Round, grid: &Grid, planes: Range<usize>, found: &[AtomicU64]) {
        let size = grid.rays().map(|n| n as usize);
        let (words, side) = (size[0].div_ceil(64), f64::from(1u32 << grid.shift()));
        let range = |i: usize| {
            let low = ((round.min[i] - MARGIN) / side).floor().max(0.0) as usize;
            let end = ((round.max[i] + MARGIN) / side).floor() + 1.0;
            low..(end.max(0.0) as usize).min(size[i])
        };
        let (xs, ys, zs) = (range(0), range(1), range(2));
        let reach = 0.5 * 3f64.sqrt() * side + MARGIN;
        let (least, most) = ((self.radius - reach).max(0.0).powi(2), (self.radius + reach).powi(2));
        let per_length = 1.0 / round.along.length_squared().max(f64::MIN_POSITIVE);
        for z in zs.start.max(planes.start)..zs.end.min(planes.end) {
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
                        let word = &found[((z - planes.start) * size[1] + y) * words + x / 64];
                        if word.load(Ordering::Relaxed) >> (x % 64) & 1 == 0 {
                            word.fetch_or(1 << (x % 64), Ordering::Relaxed);
                        }
                    }
                }
            }
        }
    }
}
