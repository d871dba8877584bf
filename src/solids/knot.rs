//! Tubes along torus knots.
//!
//! The curve winds on a torus of radii R and r, p times round its axis while it winds q times round its section: ((R +
//! r cos qt) cos pt, (R + r cos qt) sin pt, r sin qt). It is one closed curve if p and q have no common factor, and
//! knotted if both are at least 2; p = 2, q = 3 is the trefoil. The torus's normal is perpendicular to the curve, so
//! that it frames the sections of the tube without a twist that would have to be closed.
//!
//! A tube has no self-intersection as long as its radius is below the curve's *thickness*: the least radius of a circle
//! that touches the curve at one point and passes through another (Gonzalez and Maddocks 1999), which bounds both its
//! curvature and the distance of two strands.

use std::f64::consts::TAU;

use glam::DVec3;

use super::{SolidError, check_length, check_range, check_triangles, rounded};
use crate::mesh::TriangleMesh;

/// Largest radius of the tube as a fraction of the curve's thickness; the rest allows for the tessellation.
const SHARE_OF_THICKNESS: f64 = 0.9;

/// Least number of segments of the tube for each turn of the curve.
const SEGMENTS_PER_TURN: u32 = 8;

/// A closed tube along a torus knot about the z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorusKnot {
    /// Number of turns round the axis, 1 to 32.
    pub p: u32,
    /// Number of turns round the section of the torus, 1 to 32, without a common factor with `p`.
    pub q: u32,
    /// Radius of the torus' middle line.
    pub major: f64,
    /// Radius of its section, below `major`.
    pub minor: f64,
    /// Radius of the tube, below 0.9 of the curve's thickness.
    pub tube: f64,
    /// Number of segments along the tube, at least eight a turn of either kind.
    pub segments: u32,
    /// Number of segments round the tube, at least 3.
    pub sides: u32,
}

impl TorusKnot {
    /// Builds the closed surface of the tube; `2 segments sides` triangles.
    ///
    /// # Errors
    /// Fails for a parameter out of the range that its field states, and too many triangles.
    pub fn build(&self) -> Result<TriangleMesh, SolidError> {
        self.check()?;
        let mut positions = Vec::with_capacity(self.segments as usize * self.sides as usize);
        for i in 0..self.segments {
            let t = TAU * f64::from(i) / f64::from(self.segments);
            let (centre, normal, tangent) = (self.point(t), self.normal(t), self.tangent(t));
            let across = tangent.cross(normal);
            for j in 0..self.sides {
                let (sin, cos) = (TAU * f64::from(j) / f64::from(self.sides)).sin_cos();
                positions.push(centre + self.tube * (cos * normal + sin * across));
            }
        }
        let at = |i: u32, j: u32| (i % self.segments) * self.sides + j % self.sides;
        let mut triangles = Vec::with_capacity(2 * positions.len());
        for i in 0..self.segments {
            for j in 0..self.sides {
                let (a, b, c, d) = (at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        Ok(TriangleMesh { positions, triangles })
    }

    fn check(&self) -> Result<(), SolidError> {
        check_range("p", self.p.into(), 1.0, 32.0)?;
        check_range("q", self.q.into(), 1.0, 32.0)?;
        if common_factor(self.p, self.q) != 1 {
            let allowed = format!("without a factor in common with p = {}", self.p);
            return Err(SolidError::OutOfRange { parameter: "q", value: self.q.into(), allowed });
        }
        check_length("major", self.major)?;
        check_length("minor", self.minor)?;
        if self.minor >= self.major {
            let allowed = format!("below the major radius {}", self.major);
            return Err(SolidError::OutOfRange { parameter: "minor", value: self.minor, allowed });
        }
        check_range("segments", self.segments.into(), f64::from(SEGMENTS_PER_TURN * self.p.max(self.q)), 1e9)?;
        check_range("sides", self.sides.into(), 3.0, 1e9)?;
        check_triangles("segments", self.segments, 2 * u64::from(self.segments) * u64::from(self.sides))?;
        check_length("tube", self.tube)?;
        let most = SHARE_OF_THICKNESS * self.thickness();
        check_range("tube", self.tube, 0.0, most).map_err(|_| SolidError::OutOfRange {
            parameter: "tube",
            value: self.tube,
            allowed: format!("at most {}, or the tube would meet itself", rounded(most)),
        })?;
        Ok(())
    }

    fn angles(&self, t: f64) -> (f64, f64) {
        (f64::from(self.p) * t, f64::from(self.q) * t)
    }

    fn point(&self, t: f64) -> DVec3 {
        let (round, over) = self.angles(t);
        let out = self.major + self.minor * over.cos();
        DVec3::new(out * round.cos(), out * round.sin(), self.minor * over.sin())
    }

    /// Returns the outward normal of the torus at the point.
    fn normal(&self, t: f64) -> DVec3 {
        let (round, over) = self.angles(t);
        DVec3::new(over.cos() * round.cos(), over.cos() * round.sin(), over.sin())
    }

    /// Returns the unit tangent of the curve.
    fn tangent(&self, t: f64) -> DVec3 {
        let (round, over) = self.angles(t);
        let along = DVec3::new(-round.sin(), round.cos(), 0.0);
        let up = DVec3::new(-over.sin() * round.cos(), -over.sin() * round.sin(), over.cos());
        let out = self.major + self.minor * over.cos();
        (f64::from(self.p) * out * along + f64::from(self.q) * self.minor * up).normalize()
    }

    /// Returns the least radius, by sampling, of a circle that touches the curve and passes through another point of
    /// it.
    fn thickness(&self) -> f64 {
        // A turn round the section is a rotation of the curve into itself about z, so that one of them represents all.
        let per_turn = 48 * self.p.max(4);
        let samples = per_turn * self.q;
        let at = |i: u32| TAU * f64::from(i) / f64::from(samples);
        let points: Vec<DVec3> = (0..samples).map(|i| self.point(at(i))).collect();
        let least = |i: u32| {
            let (here, tangent) = (points[i as usize], self.tangent(at(i)));
            let radius = |there: &DVec3| {
                let chord = *there - here;
                chord.length_squared() / (2.0 * chord.cross(tangent).length())
            };
            // The point itself gives 0 / 0, which `min` ignores.
            points.iter().map(radius).fold(f64::INFINITY, f64::min)
        };
        (0..per_turn).map(least).fold(f64::INFINITY, f64::min)
    }
}

/// Returns the greatest common divisor.
fn common_factor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { common_factor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::solids::closure::{assert_solid, euler_characteristic, volume};

    const TREFOIL: TorusKnot = TorusKnot { p: 2, q: 3, major: 8.0, minor: 4.0, tube: 1.6, segments: 60, sides: 8 };

    fn length(knot: &TorusKnot) -> f64 {
        let at = |i: u32| knot.point(TAU * f64::from(i) / 20_000.0);
        (0..20_000).map(|i| at(i).distance(at(i + 1))).sum()
    }

    #[test]
    fn tubes_are_rings_of_the_right_volume() {
        for (p, q, minor) in [(2, 3, 4.0), (3, 2, 4.0), (1, 1, 2.0), (2, 5, 4.0), (1, 4, 3.0)] {
            let knot = TorusKnot { p, q, minor, tube: 0.8, segments: 600, sides: 48, ..TREFOIL };
            let mesh = knot.build().unwrap();
            assert_solid(&mesh);
            assert_eq!((mesh.triangles.len(), euler_characteristic(&mesh)), (2 * 600 * 48, 0));
            // By Pappus and Guldin, since the centroid of the section runs along the curve.
            let exact = PI * 0.64 * length(&knot);
            assert!((volume(&mesh) / exact - 1.0).abs() < 0.005, "{p} {q}: {} {exact}", volume(&mesh));
        }
        assert_eq!(TREFOIL.build().unwrap().triangles.len(), 960);
    }

    #[test]
    fn strands_of_the_thickest_tube_do_not_touch() {
        let knot = TorusKnot { tube: 0.89 * TREFOIL.thickness(), ..TREFOIL };
        let mesh = knot.build().unwrap();
        assert_solid(&mesh);
        // Every corner of the tube lies at the tube's radius from the curve, and nowhere nearer.
        for corner in &mesh.positions {
            let nearest = (0..6000).map(|i| corner.distance(knot.point(TAU * f64::from(i) / 6000.0)));
            assert!(nearest.fold(f64::INFINITY, f64::min) > 0.999 * knot.tube);
        }
    }

    #[test]
    fn thickness_agrees_with_known_curves() {
        // The (1, 1) curve that is just a tilted circle: all circles that touch it and pass through it are itself.
        let villarceau = |major: f64, minor: f64| TorusKnot { p: 1, q: 1, major, minor, ..TREFOIL }.thickness();
        assert!((villarceau(10.0, 0.001) / 10.0 - 1.0).abs() < 1e-3);
        // Two strands of a flat ring coil, far from the axis, lie opposite each other across its section.
        let coil = TorusKnot { p: 2, q: 1, major: 1000.0, minor: 1.0, ..TREFOIL };
        assert!((coil.thickness() - 1.0).abs() < 1e-3, "{}", coil.thickness());
    }

    #[test]
    fn wrong_parameters_are_refused() {
        let text = |knot: TorusKnot| knot.build().unwrap_err().to_string();
        assert_eq!(text(TorusKnot { q: 4, ..TREFOIL }), "q is 4, but must be without a factor in common with p = 2");
        assert!(text(TorusKnot { tube: 5.0, ..TREFOIL }).contains("or the tube would meet itself"));
        assert!(text(TorusKnot { segments: 20, ..TREFOIL }).starts_with("segments is 20, but must be from 24"));
        assert!(text(TorusKnot { minor: 9.0, ..TREFOIL }).starts_with("minor is 9, but must be below"));
        assert!(text(TorusKnot { p: 0, ..TREFOIL }).starts_with("p is 0, but"));
    }
}
