//! Membership of boxes in an offset solid.

use std::borrow::Borrow;
use std::sync::OnceLock;

use super::exact;
use super::membership::BallMembership;
use crate::grid::LatticeBox;
use crate::minkowski::membership::Shell;
use crate::minkowski::probe::{Probe, Probed, centre, corners};
use crate::minkowski::{Exterior, Membership, Polyhedron};

/// A bound on the error of distances between lattice positions, in lattice steps.
const ROUNDED: f64 = 1e-3;

/// The membership test of boxes in a polyhedron dilated by a ball.
pub struct BallProbe<'s, M> {
    membership: M,
    solid: &'s Polyhedron,
    shell: OnceLock<Shell>,
}

impl<'s, M: Borrow<BallMembership>> BallProbe<'s, M> {
    /// Returns the test for the solid of a membership test.
    pub fn new(membership: M, solid: &'s Polyhedron) -> BallProbe<'s, M> {
        BallProbe { membership, solid, shell: OnceLock::new() }
    }

    /// Returns whether a point off the surface lies in the polyhedron, without the ball. Rays answer for nodes, the middles of
    /// whole cubes; the hierarchy for other points takes longer to build than most searches.
    fn is_inside(&self, point: [i32; 3]) -> bool {
        let membership = self.membership.borrow();
        membership.inside_by_rays(point).unwrap_or_else(|| {
            let shell = self.shell.get_or_init(|| Shell::new(self.solid));
            shell.winds_around(point) != (membership.exterior == Exterior::In)
        })
    }
}

/// Other than a [`BallMembership`], this tests points on any rays.
impl<M: Borrow<BallMembership> + Sync> Membership for BallProbe<'_, M> {
    type Memory = ();

    fn contains(&self, point: [i32; 3], (): &mut ()) -> bool {
        let membership = self.membership.borrow();
        membership.is_near(point) || membership.inside_by_node(point).unwrap_or_else(|| self.is_inside(point))
    }
}

impl<M: Borrow<BallMembership> + Sync> Probe for BallProbe<'_, M> {
    type Memory = u32;

    fn probe(&self, bounds: &LatticeBox, hint: &mut u32) -> Probed {
        let BallMembership { radius, surface, .. } = self.membership.borrow();
        let centre = centre(bounds);
        let Some(surface) = surface else {
            return if self.is_inside(centre) { Probed::Filled } else { Probed::Empty };
        };
        let closest = surface.of(exact(centre), *hint);
        *hint = closest.hint;
        let within = (radius - ROUNDED).max(0.0).powi(2);
        let distance = closest.squared.sqrt();
        let half = exact(centre).distance(exact(bounds.min)).max(exact(centre).distance(exact(bounds.max)));
        if distance <= *radius {
            // The distance from one triangle is convex, so the corners have the greatest.
            let is_within = |corner| surface.squared_from(exact(corner), closest.hint) <= within;
            let is_filled =
                corners(bounds).into_iter().all(is_within) || distance > half + ROUNDED && self.is_inside(centre);
            return if is_filled { Probed::Filled } else { Probed::Inside };
        }
        match self.is_inside(centre) {
            true if distance > half + ROUNDED => Probed::Filled,
            true => Probed::Inside,
            false if distance > radius + half + ROUNDED => Probed::Empty,
            false => Probed::Outside,
        }
    }
}
