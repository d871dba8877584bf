//! An organic solid resembling a sitting hare: lobes and limbs blended smoothly, with waves on its skin.
//!
//! It represents scanned shapes: thick and thin parts, saddles and dents, no edge and only approximate symmetry.

use glam::DVec3;

use super::blend::{capsule, ellipsoid, smooth_min};
use super::contour::{Block, Implicit, contour};
use super::{SolidError, check_length, check_range};
use crate::mesh::TriangleMesh;

/// A blob with head, ears, haunches and tail, facing greater x, centred on the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Organic {
    /// Approximate height.
    pub size: f64,
    /// Height of the waves on its skin, relative to the default, 0 to 2.
    pub bumps: f64,
    /// Number of grid cells along the height, 24 to 1024; the number of triangles grows with its square.
    pub resolution: u32,
}

/// Half the box in units of the size, with room for the waves.
const REACH: DVec3 = DVec3::new(0.60, 0.36, 0.58);

impl Organic {
    /// Builds the closed surface of the solid.
    ///
    /// # Errors
    /// Fails for a parameter out of the range that its field states, and too many grid nodes or triangles.
    pub fn build(&self) -> Result<TriangleMesh, SolidError> {
        check_length("size", self.size)?;
        check_range("bumps", self.bumps, 0.0, 2.0)?;
        check_range("resolution", self.resolution.into(), 24.0, 1024.0)?;
        let spacing = self.size / f64::from(self.resolution);
        let half = (REACH * f64::from(self.resolution)).ceil();
        let block = Block { min: -spacing * half, spacing, cells: (2.0 * half).to_array().map(|n| n as usize) };
        let hare = Hare { size: self.size, bumps: 0.010 * self.bumps };
        contour(&hare, &block, ("resolution", self.resolution.into()))
    }
}

/// The solid in units of its size.
struct Hare {
    size: f64,
    bumps: f64,
}

impl Hare {
    fn trunk(p: DVec3) -> f64 {
        let lobe = |x: f64, z: f64, radii: [f64; 3]| ellipsoid(p - DVec3::new(x, 0.0, z), DVec3::from_array(radii));
        let mut d = lobe(-0.12, -0.20, [0.36, 0.25, 0.26]);
        d = smooth_min(d, lobe(0.14, -0.12, [0.18, 0.17, 0.22]), 0.10);
        d = smooth_min(d, lobe(0.27, 0.13, [0.18, 0.14, 0.15]), 0.08);
        d = smooth_min(d, lobe(0.42, 0.09, [0.09, 0.08, 0.07]), 0.06);
        smooth_min(d, lobe(-0.47, -0.24, [0.09, 0.09, 0.09]), 0.03)
    }

    fn limbs(p: DVec3, side: f64) -> f64 {
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, side * y, z);
        // One ear leans further out than the other.
        let tip = at(0.06 - 0.03 * side, 0.15 + 0.03 * side, 0.48);
        let ear = capsule(p, at(0.20, 0.07, 0.24), tip, 0.045, 0.052);
        let haunch = ellipsoid(p - at(-0.20, 0.21, -0.27), DVec3::new(0.19, 0.10, 0.18));
        let foot = capsule(p, at(0.14, 0.15, -0.42), at(0.34, 0.16, -0.43), 0.07, 0.06);
        smooth_min(smooth_min(ear, haunch, 0.02), foot, 0.02)
    }
}

impl Implicit for Hare {
    fn value(&self, p: DVec3) -> f64 {
        let p = p / self.size;
        let limbs = Hare::limbs(p, -1.0).min(Hare::limbs(p, 1.0));
        let waves = (31.0 * p.x + 0.7).sin() * (29.0 * p.y + 1.9).sin() * (27.0 * p.z + 0.3).sin();
        (smooth_min(Hare::trunk(p), limbs, 0.05) + self.bumps * waves) * self.size
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::closure::{assert_solid, euler_characteristic, least_angles, volume};

    const ORGANIC: Organic = Organic { size: 20.0, bumps: 1.0, resolution: 40 };

    #[test]
    fn organic_is_one_shell_of_genus_zero_inside_its_box() {
        for organic in [
            ORGANIC,
            Organic { bumps: 0.0, ..ORGANIC },
            Organic { bumps: 2.0, ..ORGANIC },
            Organic { resolution: 24, ..ORGANIC },
            Organic { resolution: 24, bumps: 2.0, ..ORGANIC },
        ] {
            let mesh = organic.build().unwrap();
            assert_solid(&mesh);
            assert_eq!(euler_characteristic(&mesh), 2, "{organic:?}");
            // A cap would reach the box.
            let most = mesh.positions.iter().fold(DVec3::ZERO, |most, p| most.max(p.abs()));
            assert!(most.cmplt(organic.size * REACH).all(), "{organic:?}: {most}");
        }
    }

    #[test]
    fn volume_converges_and_triangles_are_well_shaped() {
        let fine = Organic { resolution: 120, ..ORGANIC }.build().unwrap();
        let coarse = Organic { resolution: 60, ..ORGANIC }.build().unwrap();
        assert!((volume(&coarse) / volume(&fine) - 1.0).abs() < 0.005);
        assert!(least_angles(&fine)[fine.triangles.len() / 100] > 20.0);
    }

    #[test]
    fn wrong_parameters_are_refused() {
        let text = |organic: Organic| organic.build().unwrap_err().to_string();
        assert_eq!(text(Organic { bumps: -1.0, ..ORGANIC }), "bumps is -1, but must be from 0 to 2");
        assert_eq!(text(Organic { resolution: 8, ..ORGANIC }), "resolution is 8, but must be from 24 to 1024");
        assert!(text(Organic { size: f64::NAN, ..ORGANIC }).starts_with("size is NaN"));
    }
}
