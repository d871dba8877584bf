//! The shape of a porous solid: the solid with its pores filled.

use super::components::{Connectivity, reached, rim};
use super::distance::{Crossings, distances};
use super::{BoundaryCondition, NodeSet, Region};
use crate::grid::{Axis, LatticeBox};
use crate::ldi::{Ldi, LdiError, Mode, NodePlanes, NodesError};

/// Least radius of the ball, in pitches: below it the distances between nodes and crossings are too coarse.
pub const RADIUS_MIN: f64 = 2.0;

/// Returns how far outside of the true boundary that of a [wrapped](wrap) solid may lie, in pitches; see there.
pub(crate) fn error(radius: f64) -> f64 {
    0.5 / radius
}

/// Error of [`wrap`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WrapError {
    /// The images do not belong together.
    #[error(transparent)]
    Nodes(#[from] NodesError),
    /// Internal: the result is an invalid image.
    #[error(transparent)]
    Image(#[from] LdiError),
    /// The ball is too small for the raster.
    #[error(
        "the radius of the wrapping ball is {radius} pitches; at least {RADIUS_MIN} are needed: use a larger ball or a smaller pitch"
    )]
    SmallBall {
        /// Radius in pitches.
        radius: f64,
    },
}

/// Returns the exact images of everything that a ball of `radius` pitches cannot reach when it rolls in from the boundary of
/// the raster: the morphological closing of the solid by that ball, cavities and enclosed pores filled.
///
/// `images` are exact images of the solid along x, y and z, with a margin of more than `radius` pitches on every side. The boundary
/// lies δ²/2r outside of the true one, where δ < 1 is the distance in pitches to the nearest crossing: 0.02 pitches in the mean for a
/// ball of 4. Sharp edges are cut off by less than a pitch.
///
/// The centres that the ball reaches are the nodes further than `radius` from the surface that are connected to the rim of the
/// raster; where distances pass `radius` between two nodes the crossing is interpolated linearly. The result is the set of
/// points further than `radius` from those crossings.
///
/// # Errors
/// Images that do not belong together, and a ball of less than [`RADIUS_MIN`] pitches.
pub fn wrap(images: &[Ldi; 3], radius: f64) -> Result<[Ldi; 3], WrapError> {
    if radius.is_nan() || radius < RADIUS_MIN {
        return Err(WrapError::SmallBall { radius });
    }
    let solid = NodeSet::of_planes(&NodePlanes::new(images, Mode::Exact)?);
    let grid = *images[0].grid();
    let last = grid.rays().map(|n| grid.node(n - 1));
    let raster = Region::of_box(&grid, LatticeBox { min: [grid.node(0); 3], max: last });
    let filled = filled(&Crossings::of_images(images, &raster, BoundaryCondition::Clip), &solid, radius);
    Ok([filled.image(&grid, Axis::X)?, filled.image(&grid, Axis::Y)?, filled.image(&grid, Axis::Z)?])
}

/// Returns the crossings of the filled solid with rows of nodes.
fn filled(surface: &Crossings, solid: &NodeSet, radius: f64) -> Crossings {
    let size = solid.size();
    let index = |[x, y, z]: [usize; 3]| (z * size[1] + y) * size[0] + x;
    let from_solid = distances(surface, BoundaryCondition::Clip);
    let clearance = |node| f64::from(from_solid[index(node)]) - radius;
    let free = NodeSet::from_fn(size, |node| !solid.contains(node) && clearance(node) > 0.0);
    let centres = reached(&free, Connectivity::Faces, BoundaryCondition::Clip, &rim(&NodeSet::full(size)));
    // Neighbours of a reached node that the ball fits into are reached too.
    let ends = Crossings::between(size, |node| centres.contains(node), clearance);
    let from_centres = distances(&ends, BoundaryCondition::Clip);
    let depth = |node| match centres.contains(node) {
        true => -radius,
        false => f64::from(from_centres[index(node)]) - radius,
    };
    Crossings::between(size, |node| depth(node) > 0.0, depth)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball([x, y, z]: [f64; 3], centre: [f64; 3], radius: f64) -> f64 {
        let [dx, dy, dz] = [x - centre[0], y - centre[1], z - centre[2]];
        (dx * dx + dy * dy + dz * dz).sqrt() - radius
    }

    /// Returns the mean of the volumes between crossings along the three axes, in cubic pitches.
    fn volume(crossings: &Crossings) -> f64 {
        let size = crossings.size();
        let of_axis = |axis: Axis| -> f64 {
            let rows = size[axis.column()] * size[axis.row()];
            let spans = (0..rows).flat_map(|row| crossings.row(axis, row).chunks_exact(2));
            spans.map(|span| f64::from(span[1] - span[0])).sum()
        };
        Axis::ALL.map(of_axis).iter().sum::<f64>() / 3.0
    }

    /// Two separate balls get the neck that Connolly's probe leaves between them: a piece of a torus turned inwards.
    #[test]
    fn a_neck_between_two_balls_is_filled_to_the_torus_that_the_ball_sweeps() {
        let (ball_radius, half, radius) = (10.0, 10.5, 4.0);
        let size = [40, 40, 64];
        let place = [19.3, 19.6, 31.7];
        let centres = [half, -half].map(|along| [place[0], place[1], place[2] + along]);
        let two = |p| ball(p, centres[0], ball_radius).min(ball(p, centres[1], ball_radius));
        let (surface, solid) = Crossings::of_function(size, BoundaryCondition::Clip, two);
        let found = volume(&filled(&surface, &solid, radius));

        // The profile around the axis: two circles, and between them the arc that touches both.
        let ring = ((ball_radius + radius).powi(2) - half * half).sqrt();
        let neck = half * radius / (ball_radius + radius);
        let area = |z: f64| match z < neck {
            true => std::f64::consts::PI * (ring - (radius * radius - z * z).sqrt()).powi(2),
            false => std::f64::consts::PI * (ball_radius * ball_radius - (z - half).powi(2)).max(0.0),
        };
        let steps = 20_000;
        let top = half + ball_radius;
        let expected: f64 = (0..steps)
            .map(|i| 2.0 * area((f64::from(i) + 0.5) * top / f64::from(steps)) * top / f64::from(steps))
            .sum();
        let apart = 2.0 * 4.0 / 3.0 * std::f64::consts::PI * ball_radius.powi(3);
        assert!(expected > 1.025 * apart, "the neck is to be seen");
        // Distances to crossings are too long by δ²/2r at most, δ being that to the nearest crossing: 0.02 pitches in the mean.
        let bias = 0.02 * 2.0 * 4.0 * std::f64::consts::PI * ball_radius * ball_radius;
        assert!((found - expected - 0.5 * bias).abs() < 0.6 * bias, "{found} for {expected}");
    }

    #[test]
    fn only_pores_that_the_ball_cannot_enter_are_filled() {
        let (centre, size) = ([20.2, 19.7, 20.4], [41; 3]);
        let hole = |[x, y, _]: [f64; 3], radius: f64| (x - centre[0]).hypot(y - centre[1]) - radius;
        let cavity = |p| ball(p, [centre[0] + 8.0, centre[1], centre[2]], 3.0);
        let drilled = |p| ball(p, centre, 15.0).max(-hole(p, 3.0)).max(-cavity(p));
        let whole = 4.0 / 3.0 * std::f64::consts::PI * 15_f64.powi(3);
        let (surface, solid) = Crossings::of_function(size, BoundaryCondition::Clip, drilled);
        // A ball of radius 2 passes through the hole of 3; one of 4 rests on its rims and adds a cap of itself and one of the
        // solid.
        let open = volume(&filled(&surface, &solid, 2.0));
        let closed = volume(&filled(&surface, &solid, 4.0));
        let channel = 4.0 / 3.0 * std::f64::consts::PI * (15_f64.powi(3) - (225.0 - 9.0_f64).powf(1.5));
        assert!((open / (whole - channel) - 1.0).abs() < 5e-3, "{open} for {}", whole - channel);
        let cap = |radius: f64| {
            let height = radius - (radius * radius - 9.0).sqrt();
            std::f64::consts::PI * height * height * (3.0 * radius - height) / 3.0
        };
        let dented = whole - 2.0 * (cap(4.0) + cap(15.0));
        assert!((closed / dented - 1.0).abs() < 2e-3, "{closed} for {dented}");
    }

    #[test]
    fn a_ball_too_small_for_the_raster_is_refused() {
        let grid = crate::grid::Grid::from_parts(glam::DVec3::ZERO, 1.0, [4; 3], 8, 32).unwrap();
        let empty = Axis::ALL.map(|axis| Ldi::from_parts(grid, axis, vec![0; 17], Vec::new(), Vec::new()).unwrap());
        assert_eq!(wrap(&empty, 1.0).unwrap_err(), WrapError::SmallBall { radius: 1.0 });
    }
}
