//! Membership of boxes in A ⊕ B.
//!
//! A box is filled if a part of the sum that is simple enough contains it:
//! - the sum of two triangles, which is convex, so that it contains a box whose corners it contains;
//! - A moved by a vertex of B, or B by one of A, where no triangle of the moved solid comes near the box and its centre lies in
//!   the solid.

use std::ops::{ControlFlow, Range};

use super::predicates::may_reach;
use super::sum::{SumMembership, SumMemory, Surface, minus};
use super::tree::Stack;
use crate::grid::LatticeBox;
use crate::minkowski::probe::{Probe, Probed, centre, corners};
use crate::minkowski::{Membership, Polyhedron};

/// A sum, prepared for tests of boxes.
pub struct SumProbe<'s> {
    membership: &'s SumMembership,
    /// Vertices that lie far out along the diagonals.
    outmost_of_a: Vec<[i32; 3]>,
    outmost_of_b: Vec<[i32; 3]>,
}

impl<'s> SumProbe<'s> {
    /// Prepares tests of boxes.
    pub fn new(membership: &'s SumMembership) -> SumProbe<'s> {
        let [outmost_of_a, outmost_of_b] = [&membership.a, &membership.b].map(outmost);
        SumProbe { membership, outmost_of_a, outmost_of_b }
    }

    /// Returns whether A moved by one of some vertices, or B, contains the box.
    fn is_in_a_moved_solid(&self, bounds: &LatticeBox, memory: &mut SumMemory) -> bool {
        let SumMembership { a, b, .. } = self.membership;
        let SumMemory { crossing, stack, ray_stack, .. } = memory;
        let of_pair = crossing.map_or([[0; 3]; 3], |[_, j]| b.triangles[j]);
        let near_pair = if crossing.is_some() { &of_pair[..] } else { &[] };
        near_pair.iter().chain(&self.outmost_of_b).any(|&vertex| {
            let moved = moved(bounds, vertex);
            !comes_near(a, &moved, stack) && self.membership.is_in_a(centre(&moved), ray_stack)
        }) || self.membership.is_a_bounded()
            && self.outmost_of_a.iter().any(|&vertex| {
                let moved = moved(bounds, vertex);
                !comes_near(b, &moved, stack) && b.winding(centre(&moved), ray_stack) != 0
            })
    }
}

impl Probe for SumProbe<'_> {
    type Memory = SumMemory;

    fn probe(&self, bounds: &LatticeBox, memory: &mut SumMemory) -> Probed {
        let corners = corners(bounds);
        let fills = |pair| corners.iter().all(|&corner| self.membership.do_cross(pair, corner));
        if memory.crossing.is_some_and(fills) {
            return Probed::Filled;
        }
        if !self.membership.contains(centre(bounds), memory) {
            return Probed::Outside;
        }
        match memory.crossing.is_some_and(fills) || self.is_in_a_moved_solid(bounds, memory) {
            true => Probed::Filled,
            false => Probed::Inside,
        }
    }
}

/// The surface of a polyhedron, for winding numbers.
pub struct Shell(Surface);

impl Shell {
    /// Prepares a surface.
    pub fn new(solid: &Polyhedron) -> Shell {
        Shell(Surface::new(solid))
    }

    /// Returns whether the surface winds around a movable point.
    pub fn winds_around(&self, point: [i32; 3]) -> bool {
        self.0.winding(point, &mut Stack::new()) != 0
    }
}

/// Returns the vertex that lies farthest along each of the eight diagonals.
fn outmost(of: &Surface) -> Vec<[i32; 3]> {
    let along = |k: usize, p: &[i32; 3]| (0..3).map(|i| i64::from(p[i]) * [1, -1][k >> i & 1]).sum::<i64>();
    let mut found: Vec<[i32; 3]> =
        (0..8).filter_map(|k| of.triangles.iter().flatten().copied().max_by_key(|p| (along(k, p), *p))).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// Returns a box moved by the negative of a vertex.
fn moved(bounds: &LatticeBox, vertex: [i32; 3]) -> LatticeBox {
    LatticeBox { min: minus(bounds.min, vertex), max: minus(bounds.max, vertex) }
}

/// Returns whether a triangle of a surface may come within a lattice step of a box.
fn comes_near(surface: &Surface, bounds: &LatticeBox, stack: &mut Stack) -> bool {
    let overlaps = |of: &LatticeBox| (0..3).all(|i| of.min[i] <= bounds.max[i] + 1 && bounds.min[i] <= of.max[i] + 1);
    let any = |triangles: Range<usize>| {
        let is_near = surface.triangles[triangles].iter().any(|corners| {
            (0..3).all(|i| {
                corners.iter().any(|corner| corner[i] <= bounds.max[i] + 1)
                    && corners.iter().any(|corner| corner[i] >= bounds.min[i] - 1)
            }) && may_reach(corners, bounds)
        });
        if is_near { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    surface.tree.visit(stack, overlaps, any).is_break()
}
