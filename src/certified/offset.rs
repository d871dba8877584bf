//! Certified volumes of offsets by a ball.
//!
//! # The argument
//! Let r be the size of the distance, and N the set of points within r of the surface of a solid S. The offset outwards is
//! S ∪ N, and that inwards S − N. A cell without surface lies on one side of it, as its winding number tells.
//!
//! Let c be the centre of a cell, ρ half its diagonal, q a point of a triangle T, g = c − q and u = g / |g|, and δ = p − c for a
//! point p of the cell.
//! - **Near**: p is in N if |g + δ| ≤ r. That follows from u·δ ≤ (r² − |g|² − ρ²) / 2|g|.
//! - **Far**: T is convex, and so lies on one side of a plane with the normal u through its corner that is farthest along u. Let
//!   l be the distance of c from that plane. Then p is at least l + u·δ away from T. If q is the point closest to c, then l
//!   = |g|; if it is not, l is less, and the bound is as valid. For all triangles that matter, with the direction u of the
//!   nearest one: N lies in u·δ ≤ max (r − l + |u′ − u| ρ).
//!
//! So a cell is near or far as a whole, or its volume in N lies between those of two half spaces with the same normal
//! (`half_space`). Their distance is of second order in the cell's size, and the width of the interval with it. Where a cell
//! at the finest side meets both the surface and the boundary of N, its volume is between 0 and all.
//!
//! Coordinates relative to the centre are rounded by a share ε = 2⁻⁵³ of the largest, m; all that follows from them has errors
//! far below [`ROUNDING`] m, or for l, [`ROUNDING`] m² / |g|.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;

use super::cell::Cell;
use super::half_space;
use super::node::Node;
use super::refine::{BUDGET, TOGETHER, Totals};
use super::shells::Shells;
use crate::cancel::checkpoint;
use crate::closest::closest_to_origin;
use crate::parallel::join;
use crate::sampler::FillRule;

/// Error bound of coordinates, distances and dot products, as a share of the largest coordinate: 2⁻⁴⁴.
const ROUNDING: f64 = 1.0 / (1u64 << 44) as f64;

/// A solid whose winding numbers are 0 and one of 1 and −1, and a distance.
pub(super) struct Offset {
    pub shells: Shells,
    /// The size of the distance.
    pub radius: f64,
    /// True if the solid grows.
    pub is_outwards: bool,
}

/// One pass over the tree of cells.
pub(super) struct OffsetPass<'o> {
    offset: &'o Offset,
    finest: f64,
    visited: AtomicU64,
}

/// A triangle, seen from the centre of a cell.
struct Sight {
    triangle: u32,
    /// An upper bound of its distance.
    most: f64,
    /// A lower bound of its distance from a point at δ is `least` + `towards`·δ.
    least: f64,
    /// The direction from the triangle to the centre, of length 1 within rounding.
    towards: DVec3,
}

/// A cell as seen from its centre.
struct View {
    centre: DVec3,
    half: DVec3,
    /// Half the diagonal, rounded up.
    reach: f64,
}

impl View {
    fn of(cell: &Cell) -> View {
        let centre = cell.min + 0.5 * (cell.max - cell.min);
        let half = (centre - cell.min).max(cell.max - centre) * (1.0 + 4.0 * f64::EPSILON);
        View { centre, half, reach: half.length() * (1.0 + 8.0 * f64::EPSILON) }
    }
}

impl<'o> OffsetPass<'o> {
    pub fn new(offset: &'o Offset, finest: f64) -> OffsetPass<'o> {
        OffsetPass { offset, finest, visited: AtomicU64::new(0) }
    }

    /// Returns the number of cells.
    pub fn visited(&self) -> u64 {
        self.visited.load(Ordering::Relaxed)
    }

    /// Returns the sums over all cells within a node; nothing if there are more than the budget. `near` has all triangles that may
    /// be within the radius of a point of it.
    pub fn sum(&self, node: &Node, near: &[u32]) -> Option<Totals> {
        checkpoint();
        if self.visited.fetch_add(1, Ordering::Relaxed) >= BUDGET {
            return None;
        }
        let Offset { shells, radius, is_outwards } = self.offset;
        let (volume, rounding) = node.cell.volume();
        let is_inside = node.constant_state(FillRule::NonZero);
        // Outwards, the whole solid is in the result; inwards, none of its outside.
        let all = |is_in: bool| match is_in {
            true => Some(Totals::of([volume - rounding, volume + rounding])),
            false => Some(Totals::default()),
        };
        if is_inside == Some(*is_outwards) {
            return all(*is_outwards);
        }
        let view = View::of(&node.cell);
        let sights: Vec<Sight> = near.iter().filter_map(|&triangle| self.sight(triangle, &view)).collect();
        let nearest = sights.iter().min_by(|a, b| a.most.total_cmp(&b.most));
        match (nearest, is_inside) {
            (Some(nearest), _) if nearest.most + view.reach <= *radius => return all(*is_outwards),
            (None, Some(is_inside)) => return all(is_inside),
            _ => {}
        }
        if node.cell.longest_side() > self.finest
            && let Some([a, b]) = node.cell.halves()
        {
            let near: Vec<u32> = sights.into_iter().map(|sight| sight.triangle).collect();
            let half = |cell| self.sum(&node.part(shells, cell), &near);
            let (a, b) = match node.cell.longest_side() > TOGETHER {
                true => join(|| half(a), || half(b)),
                false => (half(a), half(b)),
            };
            return Some(a? + b?);
        }
        let bounds = match (nearest, is_inside) {
            (Some(nearest), Some(_)) => {
                let [least, most] = near_share(nearest, &sights, &view, *radius);
                match is_outwards {
                    true => [least, most],
                    false => [1.0 - most, 1.0 - least],
                }
            }
            _ => [0.0, 1.0],
        };
        Some(Totals::of([(bounds[0] * volume - rounding).max(0.0), bounds[1] * volume + rounding]))
    }

    /// Returns a triangle as seen from the centre of a cell, if it may be within the radius of a point of the cell.
    fn sight(&self, triangle: u32, view: &View) -> Option<Sight> {
        let corners = self.offset.shells.corners(triangle).map(|corner| corner - view.centre);
        let closest = closest_to_origin(corners);
        let size = corners.iter().fold(DVec3::ZERO, |size, corner| size.max(corner.abs())).max_element();
        let distance = closest.length();
        let most = distance + ROUNDING * size;
        if distance <= ROUNDING * size {
            return Some(Sight { triangle, most, least: 0.0, towards: DVec3::ZERO });
        }
        let towards = -closest / distance;
        let farthest = corners.iter().map(|corner| towards.dot(*corner)).fold(f64::NEG_INFINITY, f64::max);
        let least = -farthest - ROUNDING * size * (1.0 + size / distance);
        (least - view.reach <= self.offset.radius).then_some(Sight { triangle, most, least, towards })
    }
}

/// Returns bounds of the share of a cell that lies within the radius of the surface.
fn near_share(nearest: &Sight, sights: &[Sight], view: &View, radius: f64) -> [f64; 2] {
    let reach = view.reach;
    let distance = nearest.most;
    // Rounding of the direction and of depths; coordinates are below 8.
    let slack = 64.0 * ROUNDING * (1.0 + (radius + reach) / distance);
    let near = (radius * radius - distance * distance - reach * reach) / (2.0 * distance) - slack;
    let depth = |sight: &Sight| radius - sight.least + (sight.towards - nearest.towards).length() * reach;
    let far = sights.iter().map(depth).fold(f64::NEG_INFINITY, f64::max) + slack;
    let [least, _] = half_space::share(nearest.towards, near, view.half);
    let [_, most] = half_space::share(nearest.towards, far, view.half);
    [least.min(most), most]
}
