//! The largest balls: the nodes at which they are searched, and the positions of their centres between nodes.

use rayon::prelude::*;

use super::Ball;
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

/// Lanes for them, a whole number of vectors.
const LANES: usize = 28;

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
    let [columns, rows, planes] = field.size();
    assert_eq!(field.size(), nodes.size(), "nodes of the field's raster");
    assert!(u32::try_from(nodes.volume()).is_ok(), "fewer than 2^32 nodes");
    let near = Near { field, nodes };
    (0..rows * planes)
        .into_par_iter()
        .flat_map_iter(|row| {
            checkpoint();
            let (y, z) = (row % rows, row / rows);
            let in_row = (0..columns).filter(move |&x| nodes.contains([x, y, z]));
            in_row.filter(move |&x| near.is_ridge([x, y, z])).map(move |x| near.ball([x, y, z]))
        })
        .collect()
}

/// A field, and the nodes of the phase.
#[derive(Clone, Copy)]
struct Near<'a> {
    field: &'a DistanceField,
    nodes: &'a NodeSet,
}

impl Near<'_> {
    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        let [columns, rows, _] = self.field.size();
        (z * rows + y) * columns + x
    }

    /// Returns a neighbour of a node, where there is one.
    fn neighbour(&self, node: [usize; 3], offset: [i32; 3]) -> Option<[usize; 3]> {
        let size = self.field.size();
        let mut other = [0; 3];
        for axis in 0..3 {
            let at = node[axis] as i64 + i64::from(offset[axis]);
            other[axis] = match self.field.edges() {
                BoundaryCondition::Periodic => at.rem_euclid(size[axis] as i64) as usize,
                BoundaryCondition::Clip | BoundaryCondition::Border => {
                    (0..size[axis] as i64).contains(&at).then_some(at as usize)?
                }
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
        let mut sites = Sites { lanes: [[FAR; LANES]; 3] };
        for place in 0..NEIGHBOURHOOD {
            let offset = [place % 3, place / 3 % 3, place / 9].map(|i| i as i32 - 1);
            let Some(other) = self.neighbour(node, offset).filter(|&other| self.nodes.contains(other)) else {
                continue;
            };
            let Some(site) = self.field.site_of(other) else { continue };
            for axis in 0..3 {
                sites.lanes[axis][place] = site[axis] - (other[axis] as f32 - offset[axis] as f32);
            }
        }
        sites
    }
}

/// The coordinate of a lane without a site.
const FAR: f32 = 1e18;

/// Points, coordinate by coordinate.
struct Sites {
    lanes: [[f32; LANES]; 3],
}

impl Sites {
    /// Returns the square of the distance to the nearest point, and that point.
    #[inline]
    fn nearest(&self, from: [f32; 3]) -> (f32, [f32; 3]) {
        let mut squared = [0.0; LANES];
        for (lane, squared) in squared.iter_mut().enumerate() {
            let off = [0, 1, 2].map(|axis| self.lanes[axis][lane] - from[axis]);
            *squared = off[0] * off[0] + off[1] * off[1] + off[2] * off[2];
        }
        let (mut least, mut nearest) = (squared[0], 0);
        for (lane, &squared) in squared.iter().enumerate() {
            if squared < least {
                (least, nearest) = (squared, lane);
            }
        }
        (least, [0, 1, 2].map(|axis| self.lanes[axis][nearest]))
    }
}
