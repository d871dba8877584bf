//! The largest balls: the nodes at which they are searched, and the positions of their centres between nodes.

use rayon::prelude::*;

use super::Ball;
use crate::bits::ones;
use crate::cancel::checkpoint;
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

/// Points that are compared at once, and the number of times for a neighbourhood.
const LANES: usize = 8;
const GROUPS: usize = NEIGHBOURHOOD.div_ceil(LANES);

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
        let of_row = |row: usize| {
            checkpoint();
            let (y, z) = (row % rows, row / rows);
            let nodes = ones(part.row(y, z)).map(move |x| [x, y, z]);
            nodes.filter(move |&node| self.is_ridge(node)).map(move |node| self.ball(node))
        };
        (0..rows * planes).into_par_iter().with_min_len(16).flat_map_iter(of_row).collect()
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
    fn is_ridge(&self, node: [usize; 3]) -> bool {
        let Some(site) = self.field.site_of(node) else { return false };
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

    /// Returns the largest ball around a point in the cell of a node, by the sites nearby.
    fn ball(&self, node: [usize; 3]) -> Ball {
        let sites = self.sites_nearby(node);
        let (mut best, mut centre) = ([0.0; 3], [0.0; 3]);
        let mut most = -1.0;
        let mut step = STEP;
        for _ in 0..STEPS {
            let (squared, nearest) = sites.nearest(centre);
            if squared > most {
                (most, best) = (squared, centre);
            }
            let distance = squared.sqrt().max(f32::MIN_POSITIVE);
            for axis in 0..3 {
                let away = (centre[axis] - nearest[axis]) / distance;
                centre[axis] = (centre[axis] + step * away).clamp(-REACH, REACH);
            }
            step *= SHRINK;
        }
        let centre = [0, 1, 2].map(|axis| node[axis] as f32 + best[axis]);
        Ball { centre, radius: most.sqrt(), node: self.index(node) as u32 }
    }

    /// Returns the sites of a node and its neighbours in the phase, relative to the node.
    fn sites_nearby(&self, node: [usize; 3]) -> Sites {
        let mut sites = Sites { groups: [[[FAR; LANES]; GROUPS]; 3], count: 0 };
        let mut numbers = [u32::MAX; NEIGHBOURHOOD];
        for place in 0..NEIGHBOURHOOD {
            let offset = [place % 3, place / 3 % 3, place / 9].map(|i| i as i32 - 1);
            let Some(other) = self.neighbour(node, offset).filter(|&other| self.nodes.contains(other)) else {
                continue;
            };
            // Most nodes share their site with the neighbour before them along one of the axes.
            if let Some(number) = self.field.site_number(other) {
                numbers[place] = number;
                let shares = |step: usize, by: i32| by >= 0 && numbers[place - step] == number;
                if shares(1, offset[0]) || shares(3, offset[1]) || shares(9, offset[2]) {
                    continue;
                }
            }
            let Some(site) = self.field.site_of(other) else { continue };
            let mut from_node = [0.0; 3];
            for axis in 0..3 {
                from_node[axis] = site[axis] - (other[axis] as f32 - offset[axis] as f32);
            }
            sites.add(from_node);
        }
        sites
    }
}

/// The coordinate of a lane without a site.
const FAR: f32 = 1e18;

/// Points, coordinate by coordinate.
struct Sites {
    groups: [[[f32; LANES]; GROUPS]; 3],
    count: usize,
}

impl Sites {
    fn add(&mut self, site: [f32; 3]) {
        for (groups, coordinate) in self.groups.iter_mut().zip(site) {
            groups[self.count / LANES][self.count % LANES] = coordinate;
        }
        self.count += 1;
    }

    /// Returns the square of the distance to the nearest point, and the first point at that distance.
    #[inline]
    fn nearest(&self, from: [f32; 3]) -> (f32, [f32; 3]) {
        let [xs, ys, zs] = &self.groups;
        let mut squares = [[0.0; LANES]; GROUPS];
        let mut least_of_lanes = [f32::INFINITY; LANES];
        for group in 0..self.count.div_ceil(LANES).min(GROUPS) {
            for lane in 0..LANES {
                let (x, y, z) = (xs[group][lane] - from[0], ys[group][lane] - from[1], zs[group][lane] - from[2]);
                let square = x * x + y * y + z * z;
                squares[group][lane] = square;
                least_of_lanes[lane] = if square < least_of_lanes[lane] { square } else { least_of_lanes[lane] };
            }
        }
        let mut least = f32::INFINITY;
        for square in least_of_lanes {
            least = if square < least { square } else { least };
        }
        let mut nearest = 0;
        for (at, &square) in squares.as_flattened()[..self.count].iter().enumerate().rev() {
            nearest = if square == least { at } else { nearest };
        }
        let (group, lane) = (nearest / LANES, nearest % LANES);
        (least, [xs[group][lane], ys[group][lane], zs[group][lane]])
    }
}
