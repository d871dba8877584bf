//! A long bone resembling a human femur.
//!
//! It is built from tapered capsules and ellipsoids that are blended by a smooth minimum, with the proportions of a
//! femur: a shaft that bows forwards, at the top a round head on a slanting neck with the two trochanters, at the
//! bottom a flare with two condyles and the notch between them. It is not meant for anatomical measurements; it is an
//! organic shape with thick and thin parts, concave and convex, without symmetry.

use glam::DVec3;

use super::blend::{capsule, ellipsoid, smooth_difference, smooth_min};
use super::contour::{Block, Implicit, contour};
use super::{SolidError, check_length, check_range};
use crate::mesh::TriangleMesh;

/// A long bone along the z axis, centred on the origin: head up, the head on the side of greater x, the bow towards
/// greater y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LongBone {
    /// Length from condyles to head.
    pub length: f64,
    /// Breadth relative to that of a femur of this length, 0.5 to 2.5.
    pub girth: f64,
    /// Bow of the shaft relative to that of a femur, 0 to 3.
    pub bow: f64,
    /// Number of grid cells along the length, 48 to 2048; the number of triangles grows with its square.
    pub resolution: u32,
}

impl LongBone {
    /// Builds the closed surface of the bone.
    ///
    /// # Errors
    /// Fails for a parameter out of the range that its field states, and too many grid nodes or triangles.
    pub fn build(&self) -> Result<TriangleMesh, SolidError> {
        check_length("length", self.length)?;
        check_range("girth", self.girth, 0.5, 2.5)?;
        check_range("bow", self.bow, 0.0, 3.0)?;
        check_range("resolution", self.resolution.into(), 48.0, 2048.0)?;
        let spacing = self.length / f64::from(self.resolution);
        // A margin of two cells keeps the bone off the box at either end.
        let breadth = [-0.11 * self.girth, -0.10 * self.girth, 0.0];
        let reach = [0.16 * self.girth, 0.10 * self.girth + 0.03 * self.bow, 1.0];
        let least = breadth.map(|low| (low * f64::from(self.resolution)).floor() - 2.0);
        let most = reach.map(|high| (high * f64::from(self.resolution)).ceil() + 2.0);
        let foot = DVec3::new(0.0, 0.0, -self.length / 2.0);
        let block = Block {
            min: foot + spacing * DVec3::from_array(least),
            spacing,
            cells: std::array::from_fn(|axis| (most[axis] - least[axis]) as usize),
        };
        let femur = Femur { foot, length: self.length, girth: self.girth, bow: self.bow };
        contour(&femur, &block, ("resolution", self.resolution.into()))
    }
}

/// The bone as an implicit solid. Internally, lengths are in units of its own length and breadths are scaled by
/// `girth`.
struct Femur {
    foot: DVec3,
    length: f64,
    girth: f64,
    bow: f64,
}

impl Femur {
    /// Returns the axis of the shaft at height z: it bows forwards most at its middle.
    fn middle(&self, z: f64) -> DVec3 {
        let s = ((z - 0.05) / 0.85).clamp(0.0, 1.0);
        DVec3::new(0.012 * (s - 0.5) * self.girth, 0.030 * self.bow * 4.0 * s * (1.0 - s) - 0.006 * self.girth, z)
    }

    /// Returns the height of the shaft's upper end: inside the mass that carries neck and trochanters.
    fn shaft_top(&self) -> f64 {
        1.0 - 0.120 * self.girth
    }

    fn shaft(&self, p: DVec3) -> f64 {
        let z = p.z.clamp(0.10 * self.girth, self.shaft_top());
        // Narrowest slightly above the middle, wider towards both ends.
        let down = ((0.46 - z) / 0.36).clamp(0.0, 1.0);
        let up = ((z - 0.56) / 0.32).clamp(0.0, 1.0);
        let radius = 0.0300 + 0.018 * down * down * down + 0.009 * up * up;
        p.distance(self.middle(z)) - self.girth * radius
    }
}

impl Implicit for Femur {
    fn value(&self, p: DVec3) -> f64 {
        let p = (p - self.foot) / self.length;
        let g = self.girth;
        // Positions are given as breadth, depth, height; only the height is along the bone and is not scaled.
        let at = |x: f64, y: f64, z: f64| DVec3::new(g * x, g * y, z);
        let mut d = self.shaft(p);

        let head_height = 1.0 - 0.051 * g;
        let head = at(0.098, 0.012, head_height);
        let neck = capsule(p, at(0.010, -0.004, head_height - 0.082 * g), head, 0.038 * g, 0.027 * g);
        let trochanter_foot = at(-0.012, -0.004, head_height - 0.130 * g);
        let trochanter_tip = at(-0.044, -0.014, head_height - 0.022 * g);
        let greater_trochanter = capsule(p, trochanter_foot, trochanter_tip, 0.034 * g, 0.024 * g);
        let lesser_trochanter =
            ellipsoid(p - at(0.024, -0.030, head_height - 0.148 * g), g * DVec3::new(0.015, 0.016, 0.024));
        d = smooth_min(d, greater_trochanter, 0.040 * g);
        d = smooth_min(d, neck, 0.050 * g);
        d = smooth_min(d, lesser_trochanter, 0.034 * g);
        d = smooth_min(d, p.distance(head) - 0.051 * g, 0.014 * g);

        // The flare starts on the axis of the shaft and thinner than it, and so emerges without a step.
        let flare = capsule(p, self.middle(0.30 * g), at(0.0, 0.000, 0.074 * g), 0.010 * g, 0.054 * g);
        let kneecap_side = ellipsoid(p - at(0.0, 0.022, 0.070 * g), g * DVec3::new(0.060, 0.032, 0.045));
        d = smooth_min(d, flare, 0.040 * g);
        d = smooth_min(d, kneecap_side, 0.030 * g);
        for (x, y, width, depth) in [(0.047, -0.014, 0.034, 0.066), (-0.047, -0.010, 0.036, 0.064)] {
            let condyle = ellipsoid(p - at(x, y, 0.052 * g), g * DVec3::new(width, depth, 0.052));
            d = smooth_min(d, condyle, 0.022 * g);
        }
        // The notch between the condyles opens downwards and backwards; the groove in front carries the kneecap.
        let notch = ellipsoid(p - at(0.0, -0.058, 0.018 * g), g * DVec3::new(0.018, 0.058, 0.048));
        let groove = capsule(p, at(0.0, 0.066, 0.085 * g), at(0.0, 0.058, 0.015 * g), 0.016 * g, 0.018 * g);
        d = smooth_difference(d, notch, 0.014 * g);
        smooth_difference(d, groove, 0.020 * g) * self.length
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::closure::{assert_solid, euler_characteristic, least_angles, volume};

    const BONE: LongBone = LongBone { length: 100.0, girth: 1.0, bow: 1.0, resolution: 120 };

    #[test]
    fn bone_is_one_shell_of_genus_zero_with_its_length() {
        for bone in [
            BONE,
            LongBone { girth: 0.5, ..BONE },
            LongBone { girth: 1.6, ..BONE },
            LongBone { girth: 2.5, ..BONE },
            LongBone { bow: 0.0, ..BONE },
            LongBone { bow: 3.0, girth: 2.0, ..BONE },
            LongBone { resolution: 48, ..BONE },
        ] {
            let mesh = bone.build().unwrap();
            assert_solid(&mesh);
            assert_eq!(euler_characteristic(&mesh), 2, "{bone:?}");
            let z = mesh.positions.iter().map(|p| p.z);
            let extent = z.clone().fold(f64::MIN, f64::max) - z.fold(f64::MAX, f64::min);
            assert!((extent - 100.0).abs() < 1.0, "{bone:?} {extent}");
        }
    }

    #[test]
    fn bone_does_not_touch_its_box() {
        // A cap would hold many vertices of exactly the same greatest coordinate.
        for bone in [BONE, LongBone { girth: 2.5, bow: 3.0, ..BONE }] {
            let mesh = bone.build().unwrap();
            for axis in 0..3 {
                for sign in [-1.0, 1.0] {
                    let most = mesh.positions.iter().map(|p| sign * p[axis]).fold(f64::MIN, f64::max);
                    assert_eq!(mesh.positions.iter().filter(|p| sign * p[axis] == most).count(), 1);
                }
            }
        }
    }

    #[test]
    fn volume_converges_and_triangles_are_well_shaped() {
        let fine = LongBone { resolution: 240, ..BONE }.build().unwrap();
        let coarse = BONE.build().unwrap();
        assert!((volume(&coarse) / volume(&fine) - 1.0).abs() < 0.005);
        assert!(least_angles(&fine)[fine.triangles.len() / 100] > 20.0);
    }

    #[test]
    fn the_mesh_does_not_depend_on_the_thread_count() {
        let [one, two] = [1, 2].map(|threads| {
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| BONE.build().unwrap())
        });
        assert_eq!(one, two);
    }

    #[test]
    fn wrong_parameters_are_refused() {
        let text = |bone: LongBone| bone.build().unwrap_err().to_string();
        assert!(text(LongBone { length: 0.0, ..BONE }).starts_with("length is 0, but must be from"));
        assert_eq!(text(LongBone { girth: 3.0, ..BONE }), "girth is 3, but must be from 0.5 to 2.5");
        assert_eq!(text(LongBone { resolution: 8, ..BONE }), "resolution is 8, but must be from 48 to 2048");
    }
}
