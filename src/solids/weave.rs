//! Woven cloths: round yarns that pass over and under each other without touching.
//!
//! # Theory
//! Yarns of a plain weave run along sines: warp i along y at x = i p, z = a cos(πy / p), and weft j along x at y = j p,
//! z = −a cos(πx / p), each inverted from one yarn to the next. At a crossing their middle lines are 2a apart. With cos
//! t ≥ 1 − t² / 2 the squared distance of any two of their points, x and y from the crossing, is at least 4a² + (1 −
//! 2π²a² / p²)(x² + y²), so nothing comes closer than at crossings as long as a ≤ p / (π √2).

use std::f64::consts::{PI, SQRT_2, TAU};

use glam::{DVec2, DVec3};

use super::{SolidError, check_length, check_range, check_triangles, rounded};
use crate::cancel::checkpoint;
use crate::mesh::TriangleMesh;

/// Layers of plain-woven cloth, one above the other along z, centred on the origin. No two yarns touch, so each yarn is
/// a shell and `yarns[0] + yarns[1]` of them make a layer.
///
/// A yarn of n crossings has `2 segments (n steps + 1)` triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weave {
    /// Number of yarns along y, side by side in x, and of yarns along x, side by side in y; 1 to 10 000 each.
    pub yarns: [u32; 2],
    /// Number of cloths, 1 to 10 000.
    pub layers: u32,
    /// Distance between the middle lines of neighbouring yarns.
    pub spacing: f64,
    /// Radius of a yarn.
    pub radius: f64,
    /// Least distance between the surfaces of crossing yarns, and of layers. With the radius it gives the amplitude a =
    /// radius + gap / 2 of the yarns, which is at most spacing / (π √2).
    pub gap: f64,
    /// Number of segments round a yarn, at least 3.
    pub segments: u32,
    /// Number of segments of a yarn from one crossing to the next, at least 2.
    pub steps: u32,
}

impl Weave {
    /// Builds the closed surfaces of the yarns.
    ///
    /// # Errors
    /// Fails for a parameter out of the range that its field states, or too many triangles.
    pub fn build(&self) -> Result<TriangleMesh, SolidError> {
        for (name, value) in [("spacing", self.spacing), ("radius", self.radius), ("gap", self.gap)] {
            check_length(name, value)?;
        }
        for n in self.yarns {
            check_range("yarns", n.into(), 1.0, 10_000.0)?;
        }
        check_range("layers", self.layers.into(), 1.0, 10_000.0)?;
        check_range("segments", self.segments.into(), 3.0, 1e6)?;
        check_range("steps", self.steps.into(), 2.0, 1e6)?;
        let most = self.spacing / (PI * SQRT_2) - self.gap / 2.0;
        check_range("radius", self.radius, 0.0, most).map_err(|_| SolidError::OutOfRange {
            parameter: "radius",
            value: self.radius,
            allowed: format!("at most {} for yarns of this spacing and gap to pass each other", rounded(most)),
        })?;
        let crossings = self.yarns.map(u64::from);
        let yarn = |crossings: u64| 2 * u64::from(self.segments) * (crossings * u64::from(self.steps) + 1);
        let layer = crossings[0] * yarn(crossings[1]) + crossings[1] * yarn(crossings[0]);
        let triangles = layer.saturating_mul(self.layers.into());
        check_triangles("segments", self.segments, triangles)?;

        let mut mesh = TriangleMesh::default();
        mesh.triangles.reserve(triangles as usize);
        let amplitude = self.radius + self.gap / 2.0;
        let rise = 2.0 * (amplitude + self.radius) + self.gap;
        let centred = |i: u32, n: u32| f64::from(i) - f64::from(n - 1) / 2.0;
        for layer in 0..self.layers {
            let z = rise * centred(layer, self.layers);
            for (family, side) in [(0, 1.0), (1, -1.0)] {
                let (count, length) = (self.yarns[family], self.yarns[1 - family]);
                for i in 0..count {
                    checkpoint();
                    let across = self.spacing * centred(i, count);
                    // The cosine of crossing j of yarn i, whose sign is opposite at the next yarn.
                    let amplitude = if i % 2 == 0 { side * amplitude } else { -side * amplitude };
                    let turn = |along: f64, p: DVec2| match family {
                        0 => DVec3::new(across - p.x, along, z + p.y),
                        _ => DVec3::new(along, across + p.x, z + p.y),
                    };
                    self.add_yarn(&mut mesh, length, amplitude, turn);
                }
            }
        }
        Ok(mesh)
    }

    /// Adds a yarn with a number of crossings. `place` maps a position along the cloth and one across it (sideways, to
    /// the left seen along the yarn, and up) to a point in the world.
    fn add_yarn(&self, mesh: &mut TriangleMesh, crossings: u32, amplitude: f64, place: impl Fn(f64, DVec2) -> DVec3) {
        let (segments, rings) = (self.segments, crossings * self.steps + 1);
        let first = mesh.positions.len() as u32;
        for ring in 0..rings {
            // A yarn extends beyond its outermost crossings by half a spacing.
            let phase = PI * (f64::from(ring) / f64::from(self.steps) - 0.5);
            let along = self.spacing * (phase / PI - f64::from(crossings - 1) / 2.0);
            let slope = DVec2::new(self.spacing, -amplitude * PI * phase.sin()).normalize();
            for i in 0..segments {
                let section = self.radius * DVec2::from_angle(TAU * f64::from(i) / f64::from(segments));
                let upwards = section.y * slope.perp();
                mesh.positions
                    .push(place(along + upwards.x, DVec2::new(section.x, amplitude * phase.cos() + upwards.y)));
            }
        }
        let ends = [0, rings - 1].map(|ring| {
            let range = (first + ring * segments) as usize..(first + (ring + 1) * segments) as usize;
            mesh.positions[range].iter().sum::<DVec3>() / f64::from(segments)
        });
        let poles = mesh.positions.len() as u32;
        mesh.positions.extend(ends);
        let at = |ring: u32, i: u32| first + ring * segments + i % segments;
        for i in 0..segments {
            mesh.triangles.push([poles, at(0, i + 1), at(0, i)]);
            mesh.triangles.push([poles + 1, at(rings - 1, i), at(rings - 1, i + 1)]);
            for ring in 1..rings {
                let (a, b, c, d) = (at(ring - 1, i), at(ring - 1, i + 1), at(ring, i + 1), at(ring, i));
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::closure::{assert_solid, components, euler_characteristic, volume};

    const CLOTH: Weave =
        Weave { yarns: [4, 3], layers: 2, spacing: 2.0, radius: 0.3, gap: 0.2, segments: 12, steps: 8 };

    #[test]
    fn yarns_have_genus_zero_and_a_known_volume() {
        let mesh = CLOTH.build().unwrap();
        assert_solid(&mesh);
        assert_eq!(components(&mesh), 14);
        assert_eq!(euler_characteristic(&mesh), 28);
        assert_eq!(mesh.triangles.len(), 2 * (4 * 24 * 25 + 3 * 24 * 33));
        // A tube perpendicular to its middle line has the volume of section times length (Pappus).
        let fine = Weave { segments: 48, steps: 64, ..CLOTH }.build().unwrap();
        let steps = 1000;
        let arc = |i: i32| {
            let t = PI * (f64::from(i) + 0.5) / f64::from(steps);
            (2.0_f64.powi(2) + (0.4 * PI * t.sin()).powi(2)).sqrt() / f64::from(steps)
        };
        let exact = PI * 0.09 * 2.0 * 24.0 * (0..steps).map(arc).sum::<f64>();
        assert!((volume(&fine) / exact - 1.0).abs() < 0.005, "{} {exact}", volume(&fine));
    }

    #[test]
    fn yarns_keep_their_gap() {
        // The amplitude is near the maximum that the proof allows.
        let cloth = Weave { yarns: [3, 3], layers: 2, radius: 0.34, segments: 24, steps: 24, ..CLOTH };
        let mesh = cloth.build().unwrap();
        let yarns: Vec<&[DVec3]> = mesh.positions.chunks(24 * 73 + 2).collect();
        assert_eq!(yarns.len(), 12);
        let mut least = f64::MAX;
        for (i, a) in yarns.iter().enumerate() {
            for b in &yarns[..i] {
                let pairs = a.iter().flat_map(|p| b.iter().map(|q| p.distance_squared(*q)));
                least = pairs.fold(least, f64::min);
            }
        }
        assert!((least.sqrt() / 0.2 - 1.0).abs() < 0.01, "{}", least.sqrt());
    }

    #[test]
    fn cloth_is_centred() {
        let mesh = CLOTH.build().unwrap();
        let (low, high) = mesh.positions.iter().fold((DVec3::MAX, DVec3::MIN), |(l, h), p| (l.min(*p), h.max(*p)));
        assert!((low + high).length() < 1e-12, "{low} {high}");
        assert!((high.z - (0.7 + 0.8)).abs() < 1e-12, "{high}");
    }

    #[test]
    fn wrong_parameters_are_refused() {
        let text = |weave: Weave| weave.build().unwrap_err().to_string();
        assert!(text(Weave { radius: 0.4, ..CLOTH }).starts_with("radius is 0.4, but must be at most 0.35"));
        assert!(text(Weave { yarns: [0, 3], ..CLOTH }).starts_with("yarns is 0, but must be from 1"));
        assert!(text(Weave { steps: 1, ..CLOTH }).starts_with("steps is 1, but"));
        let many = Weave { yarns: [1000; 2], layers: 100, ..CLOTH };
        assert_eq!(text(many), "segments = 12 gives 38404800000 triangles, but at most 50000000 are allowed");
    }
}
