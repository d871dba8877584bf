//! The largest balls: the nodes at which they are searched, and the positions of their centres between nodes.

use crate::parallel::*;

use super::Ball;
use crate::bits::ones;
use crate::cancel::checkpoint;
use crate::metrics::access::steps::{self, Row, Steps, bits};
use crate::metrics::distance::DistanceField;
use crate::metrics::{BoundaryCondition, NodeSet};

/// Accepted deficit of the growth of the distance towards a neighbour relative to a plain slope, as a share of the step. On a
/// ridge between surfaces whose nearest points are seen under an angle 2β, it grows by cos 2β at most.
const SLACK: f32 = 0.15;

/// Near the surface a neighbour is inconclusive, since distances are to crossings and those may be a pitch apart. So where the
/// slope, by differences, is no less than this, it is followed over these steps, in pitches.
const GENTLE: f32 = 0.6;
const FAR_STEPS: [f32; 4] = [1.0, 1.5, 2.0, 3.0];

/// Error bound of distances there, in pitches, and its increase at a distance of 1.
const ROUGHNESS: f32 = 0.1;
const ROUGHNESS_AT_1: f32 = 0.4;

/// A component of a direction counts if it is more than this share of the greatest one: tan 22.5°.
const DIAGONAL: f32 = 0.414;

/// Greatest distance of a centre from its node along each axis, in pitches.
const REACH: f32 = 0.5;

/// The first step of a centre, the ratio of consecutive steps, and their number. Together they extend from a corner of the cell
/// to the opposite one.
const STEP: f32 = 0.5;
const SHRINK: f32 = 0.72;
const STEPS: usize = 16;

/// A node and its neighbours.
const NEIGHBOURHOOD: usize = 27;

/// Balls that are searched at once, side by side.
const LANES: usize = 8;

/// Farthest node along an axis that decides on a ball, in pitches: the last of the far steps.
const FARTHEST: usize = 3;

/// Finds balls of a phase that no other one much exceeds, at most one for each cell around a node. In the order of their nodes.
///
/// The nodes searched are those from which the distance does not grow as it would on a slope, neither by a step away from their
/// site nor up the slope of the field: those that a ridge of the field passes. The centre of a ball is the point of its node's
/// cell at which the least distance to the sites of the node and its neighbours in the phase is greatest; that distance is its
/// radius. It is never less than the distance of the node. Empty where distances are infinite.
///
/// # Panics
/// If field and nodes are of rasters of different sizes, or there are 2³² nodes or more.
pub fn largest_balls(field: &DistanceField, nodes: &NodeSet) -> Vec<Ball> {
    Near::new(field, nodes).balls(nodes)
}

/// Finds the largest balls in a field with walls from those of the same field without them, which remain where no wall is near.
///
/// # Panics
/// As [`largest_balls`].
pub fn largest_balls_between(field: &DistanceField, nodes: &NodeSet, free: &[Ball]) -> Vec<Ball> {
    let beside_walls = field.beside_walls().grown(FARTHEST);
    let mut balls = Near::new(field, nodes).balls(&nodes.and(&beside_walls));
    let [columns, rows, _] = field.size();
    balls.par_extend(free.par_iter().copied().with_min_len(1 << 12).filter(|ball| {
        let node = ball.node as usize;
        !beside_walls.contains([node % columns, node / columns % rows, node / columns / rows])
    }));
    balls.par_sort_unstable_by_key(|ball| ball.node);
    balls
}

/// A field, and the nodes of the phase.
#[derive(Clone, Copy)]
struct Near<'a> {
    field: &'a DistanceField,
    nodes: &'a NodeSet,
}

impl<'a> Near<'a> {
    fn new(field: &'a DistanceField, nodes: &'a NodeSet) -> Near<'a> {
        assert_eq!(field.size(), nodes.size(), "nodes of the field's raster");
        assert!(u32::try_from(nodes.volume()).is_ok(), "fewer than 2^32 nodes");
        Near { field, nodes }
    }

    /// Returns the balls of the nodes of a part of the phase.
    fn balls(self, part: &NodeSet) -> Vec<Ball> {
        let [_, rows, planes] = self.field.size();
        let (steps, climb) = (Steps::new(self.nodes, self.field.edges()), way_to_climb());
        let of_row = |nodes: &mut Vec<([usize; 3], [f32; 3])>, row: usize| {
            checkpoint();
            let (y, z) = (row % rows, row / rows);
            // Reads all sites of the row first, because they lie far apart in memory.
            nodes.clear();
            nodes.extend(ones(part.row(y, z)).filter_map(|x| Some(([x, y, z], self.field.site_of([x, y, z])?))));
            nodes.retain(|&(node, site)| self.is_ridge(node, site));
            let around = steps.row(y, z);
            let mut balls = Vec::with_capacity(nodes.len());
            for some in nodes.chunks(LANES) {
                let mut sites = Sites::default();
                for (lane, &(node, _)) in some.iter().enumerate() {
                    self.add_sites_nearby(node, &around, lane, &mut sites);
                }
                let Top { offset, squared } = climb(&sites);
                balls.extend(some.iter().enumerate().map(|(lane, &(node, _))| {
                    let centre = [0, 1, 2].map(|axis| node[axis] as f32 + offset[axis][lane]);
                    Ball { centre, radius: squared[lane].sqrt(), node: self.index(node) as u32 }
                }));
            }
            balls
        };
        (0..rows * planes).into_par_iter().with_min_len(16).map_init(Vec::new, of_row).flatten_iter().collect()
    }

    #[inline]
    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        let [columns, rows, _] = self.field.size();
        (z * rows + y) * columns + x
    }

    /// Returns a neighbour of a node, where there is one.
    #[inline]
    fn neighbour(&self, node: [usize; 3], offset: [i32; 3]) -> Option<[usize; 3]> {
        let size = self.field.size();
        let mut other = [0; 3];
        for axis in 0..3 {
            let at = node[axis].wrapping_add_signed(offset[axis] as isize);
            other[axis] = match self.field.edges() {
                _ if at < size[axis] => at,
                BoundaryCondition::Periodic => (at as isize).rem_euclid(size[axis] as isize) as usize,
                BoundaryCondition::Clip | BoundaryCondition::Border => return None,
            };
        }
        Some(other)
    }

    /// Returns whether the distance does not continue to grow away from the surface.
    fn is_ridge(&self, node: [usize; 3], site: [f32; 3]) -> bool {
        let distance = self.field.values()[self.index(node)];
        if distance == 0.0 {
            return false;
        }
        let away = [0, 1, 2].map(|axis| (node[axis] as f32 - site[axis]) / distance);
        let greatest = away.iter().fold(0.0, |most: f32, part| most.max(part.abs()));
        let next = away.map(|part| if part.abs() > DIAGONAL * greatest { part.signum() as i32 } else { 0 });
        let length = (next.iter().filter(|&&part| part != 0).count() as f32).sqrt();
        if self.grows(node, distance, away, next, SLACK * length) {
            return false;
        }
        let slope = self.slope(node, distance);
        let steepness = slope.iter().map(|part| part * part).sum::<f32>().sqrt();
        if steepness < GENTLE {
            return true;
        }
        let up = slope.map(|part| part / steepness);
        let roughness = ROUGHNESS + ROUGHNESS_AT_1 / distance;
        !FAR_STEPS.iter().any(|steps| {
            let offset = up.map(|part| (part * steps).round() as i32);
            self.grows(node, distance, up, offset, roughness)
        })
    }

    /// Returns whether the distance grows from a node to another one of the phase as it would on a slope, to some slack.
    fn grows(&self, node: [usize; 3], distance: f32, up: [f32; 3], offset: [i32; 3], slack: f32) -> bool {
        let along: f32 = (0..3).map(|axis| up[axis] * offset[axis] as f32).sum();
        let other = self.neighbour(node, offset).filter(|&other| self.nodes.contains(other));
        other.is_some_and(|other| self.field.values()[self.index(other)] >= distance + along - slack)
    }

    /// Returns the slope at a node of the distance, which is negative outside of the phase.
    fn slope(&self, node: [usize; 3], distance: f32) -> [f32; 3] {
        [0, 1, 2].map(|axis| {
            let beside = [-1, 1].map(|by| {
                let mut offset = [0; 3];
                offset[axis] = by;
                let other = self.neighbour(node, offset)?;
                let value = self.field.values()[self.index(other)];
                Some(if self.nodes.contains(other) { value } else { -value })
            });
            match beside {
                [Some(before), Some(after)] => 0.5 * (after - before),
                [Some(before), None] => distance - before,
                [None, Some(after)] => after - distance,
                [None, None] => 0.0,
            }
        })
    }

    /// Adds to a lane the sites of a node and its neighbours in the phase, relative to the node. `around` is the node's row.
    fn add_sites_nearby(&self, node: [usize; 3], around: &Row, lane: usize, sites: &mut Sites) {
        let mut numbers = [u32::MAX; NEIGHBOURHOOD];
        let repeats = self.field.edges() == BoundaryCondition::Periodic;
        for bit in bits(around.cube(node[0])) {
            let place = bit as usize;
            let by = [place % 3, place / 3 % 3, place / 9];
            let index = around.number(node[0], bit);
            // Most nodes share their site with the neighbour before them along one of the axes.
            if let Some(number) = self.field.site_number(index as usize) {
                numbers[place] = number;
                let shares = |step: usize, by: usize| by > 0 && numbers[place - step] == number;
                if shares(1, by[0]) || shares(3, by[1]) || shares(9, by[2]) {
                    continue;
                }
            }
            let other = match repeats {
                true => steps::place(self.field.size(), index),
                false => [0, 1, 2].map(|axis| node[axis] + by[axis] - 1),
            };
            let Some(site) = self.field.site_of(other) else { continue };
            sites.add(lane, [0, 1, 2].map(|axis| site[axis] - (other[axis] as f32 - (by[axis] as f32 - 1.0))));
        }
    }
}

/// The coordinate of a place without a site.
const FAR: f32 = 1e18;

/// The sites of each lane, relative to its node.
struct Sites {
    at: [[[f32; LANES]; 3]; NEIGHBOURHOOD],
    counts: [usize; LANES],
}

impl Default for Sites {
    fn default() -> Sites {
        Sites { at: [[[FAR; LANES]; 3]; NEIGHBOURHOOD], counts: [0; LANES] }
    }
}

impl Sites {
    fn add(&mut self, lane: usize, site: [f32; 3]) {
        for (coordinates, coordinate) in self.at[self.counts[lane]].iter_mut().zip(site) {
            coordinates[lane] = coordinate;
        }
        self.counts[lane] += 1;
    }

    /// Returns the places that some lane uses.
    fn used(&self) -> &[[[f32; LANES]; 3]] {
        &self.at[..self.counts.into_iter().max().unwrap_or(0)]
    }
}

/// The points of cells that are farthest from their sites, relative to the node, and the squares of their distances.
#[cfg_attr(test, derive(Debug, PartialEq))]
struct Top {
    offset: [[f32; LANES]; 3],
    squared: [f32; LANES],
}

/// Finds the centre of a ball in each lane.
type Climb = fn(&Sites) -> Top;

/// Returns the fastest way of this processor. All return the same bits.
fn way_to_climb() -> Climb {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return |sites| unsafe { climb_avx2(sites) };
    }
    climb
}

/// See [`Climb`]. From the node on, each step leads away from the site that is nearest, and none out of the cell.
fn climb(sites: &Sites) -> Top {
    let mut centre = [[0.0; LANES]; 3];
    let mut top = Top { offset: centre, squared: [-1.0; LANES] };
    let mut step = STEP;
    for _ in 0..STEPS {
        let (mut squared, mut nearest) = ([f32::INFINITY; LANES], centre);
        for site in sites.used() {
            let square = lanes(|lane| {
                let [x, y, z] = [0, 1, 2].map(|axis| site[axis][lane] - centre[axis][lane]);
                x * x + y * y + z * z
            });
            let is_nearer = lanes(|lane| square[lane] < squared[lane]);
            squared = chosen(is_nearer, square, squared);
            nearest = [0, 1, 2].map(|axis| chosen(is_nearer, site[axis], nearest[axis]));
        }
        let is_higher = lanes(|lane| squared[lane] > top.squared[lane]);
        top.squared = chosen(is_higher, squared, top.squared);
        top.offset = [0, 1, 2].map(|axis| chosen(is_higher, centre[axis], top.offset[axis]));
        let distance = lanes(|lane| squared[lane].sqrt().max(f32::MIN_POSITIVE));
        centre = [0, 1, 2].map(|axis| {
            let (from, to) = (centre[axis], nearest[axis]);
            lanes(|lane| (from[lane] + step * ((from[lane] - to[lane]) / distance[lane])).clamp(-REACH, REACH))
        });
        step *= SHRINK;
    }
    top
}

fn lanes<T>(of_lane: impl FnMut(usize) -> T) -> [T; LANES] {
    std::array::from_fn(of_lane)
}

/// Chooses the first value where a condition holds, without a branch in any lane.
#[inline]
fn chosen(condition: [bool; LANES], first: [f32; LANES], second: [f32; LANES]) -> [f32; LANES] {
    lanes(|lane| {
        let mask = u32::from(condition[lane]).wrapping_neg();
        f32::from_bits(first[lane].to_bits() & mask | second[lane].to_bits() & !mask)
    })
}

/// See [`climb`], of which this is a copy: compilers make branches of it.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn climb_avx2(sites: &Sites) -> Top {
    use std::arch::x86_64::*;
    let mut centre = [_mm256_setzero_ps(); 3];
    let (mut best, mut most) = (centre, _mm256_set1_ps(-1.0));
    let mut step = STEP;
    for _ in 0..STEPS {
        let (mut squared, mut nearest) = (_mm256_set1_ps(f32::INFINITY), centre);
        for &site in sites.used() {
            let site: [__m256; 3] = bytemuck::cast(site);
            let [x, y, z] = [0, 1, 2].map(|axis| {
                let away = _mm256_sub_ps(site[axis], centre[axis]);
                _mm256_mul_ps(away, away)
            });
            let square = _mm256_add_ps(_mm256_add_ps(x, y), z);
            let is_nearer = _mm256_cmp_ps::<_CMP_LT_OQ>(square, squared);
            squared = _mm256_min_ps(square, squared);
            nearest = [0, 1, 2].map(|axis| _mm256_blendv_ps(nearest[axis], site[axis], is_nearer));
        }
        let is_higher = _mm256_cmp_ps::<_CMP_GT_OQ>(squared, most);
        most = _mm256_max_ps(squared, most);
        best = [0, 1, 2].map(|axis| _mm256_blendv_ps(best[axis], centre[axis], is_higher));
        let distance = _mm256_max_ps(_mm256_sqrt_ps(squared), _mm256_set1_ps(f32::MIN_POSITIVE));
        centre = [0, 1, 2].map(|axis| {
            let direction = _mm256_div_ps(_mm256_sub_ps(centre[axis], nearest[axis]), distance);
            let to = _mm256_add_ps(centre[axis], _mm256_mul_ps(_mm256_set1_ps(step), direction));
            _mm256_max_ps(_mm256_min_ps(to, _mm256_set1_ps(REACH)), _mm256_set1_ps(-REACH))
        });
        step *= SHRINK;
    }
    Top { offset: bytemuck::cast(best), squared: bytemuck::cast(most) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random::Random;

    #[test]
    fn balls_side_by_side_are_those_found_one_after_another() {
        let mut random = Random::new(23);
        for case in 0..200 {
            let mut sites = Sites::default();
            let mut of_lanes = Vec::new();
            for lane in 0..LANES {
                // The last lanes of a row may have no ball.
                let count = match lane <= case % 16 {
                    true => 1 + random.below(if case % 2 == 0 { NEIGHBOURHOOD } else { 3 }),
                    false => 0,
                };
                // Halves make ties.
                let coordinate = |random: &mut Random| (8.0 * (random.share() - 0.5)).round() as f32 / 2.0;
                let own: Vec<[f32; 3]> = (0..count).map(|_| [0; 3].map(|_| coordinate(&mut random))).collect();
                own.iter().for_each(|&site| sites.add(lane, site));
                of_lanes.push(own);
            }
            let found = climb(&sites);
            assert_eq!(found, way_to_climb()(&sites), "case {case}");
            for (lane, own) in of_lanes.iter().enumerate().filter(|(_, own)| !own.is_empty()) {
                let (offset, squared) = alone(own);
                assert_eq!(
                    (found.offset.map(|axis| axis[lane]), found.squared[lane]),
                    (offset, squared),
                    "case {case}"
                );
            }
        }
    }

    /// Finds the centre of one ball as [`climb`] does.
    fn alone(sites: &[[f32; 3]]) -> ([f32; 3], f32) {
        let (mut centre, mut step) = ([0.0f32; 3], STEP);
        let (mut best, mut most) = (centre, -1.0);
        for _ in 0..STEPS {
            let square = |site: &[f32; 3]| {
                let away = [0, 1, 2].map(|axis| site[axis] - centre[axis]);
                away[0] * away[0] + away[1] * away[1] + away[2] * away[2]
            };
            let nearest = *sites.iter().min_by(|a, b| square(a).total_cmp(&square(b))).expect("a site");
            let squared = square(&nearest);
            if squared > most {
                (best, most) = (centre, squared);
            }
            let distance = squared.sqrt().max(f32::MIN_POSITIVE);
            centre = [0, 1, 2]
                .map(|axis| (centre[axis] + step * ((centre[axis] - nearest[axis]) / distance)).clamp(-REACH, REACH));
            step *= SHRINK;
        }
        (best, most)
    }
}
