//! A skull-like solid: a thick shell round one cavity that opens through two eye sockets, a nose and a hole below.
//!
//! It is not meant for anatomical measurements. It tests the difficulties of such solids: much of its surface is
//! inside, visible from without only through holes, and hardly any part of it is convex.

use glam::DVec3;

use super::blend::{capsule, ellipsoid, smooth_difference, smooth_min};
use super::contour::{Block, Implicit, contour};
use super::{SolidError, check_length, check_range};
use crate::mesh::TriangleMesh;

/// Smallest wall thickness in grid cells; a thinner wall would break up.
const CELLS_PER_WALL: f64 = 2.0;

/// A shell with four openings, facing greater x, about the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Skull {
    /// Approximate length and height.
    pub size: f64,
    /// Thickness of the shell as a fraction of the size, 0.04 to 0.1.
    pub wall: f64,
    /// Number of grid cells along the size, 30 to 1024, and at least so many that the shell is two cells thick; the
    /// number of triangles grows with its square.
    pub resolution: u32,
}

/// Half the box in units of the size.
const REACH: DVec3 = DVec3::new(0.54, 0.36, 0.54);

impl Skull {
    /// Builds the closed surface of the solid: one surface of genus 3.
    ///
    /// # Errors
    /// Fails for a parameter out of the range that its field states, and too many grid nodes or triangles.
    pub fn build(&self) -> Result<TriangleMesh, SolidError> {
        check_length("size", self.size)?;
        check_range("wall", self.wall, 0.04, 0.10)?;
        check_range("resolution", self.resolution.into(), (CELLS_PER_WALL / self.wall).ceil().max(30.0), 1024.0)?;
        let spacing = self.size / f64::from(self.resolution);
        let half = (REACH * f64::from(self.resolution)).ceil();
        let block = Block { min: -spacing * half, spacing, cells: (2.0 * half).to_array().map(|n| n as usize) };
        contour(&Shell { size: self.size, wall: self.wall }, &block, ("resolution", self.resolution.into()))
    }
}

/// The solid in units of its size.
struct Shell {
    size: f64,
    wall: f64,
}

impl Shell {
    /// Returns braincase, face and jaw, without the cavity.
    fn head(p: DVec3) -> f64 {
        let lobe = |x: f64, z: f64, radii: [f64; 3]| ellipsoid(p - DVec3::new(x, 0.0, z), DVec3::from_array(radii));
        let face = smooth_min(lobe(-0.10, 0.14, [0.39, 0.29, 0.32]), lobe(0.22, -0.12, [0.19, 0.19, 0.24]), 0.10);
        smooth_min(face, lobe(0.22, -0.34, [0.16, 0.14, 0.13]), 0.08)
    }

    /// Returns a cheekbone, which has no cavity.
    fn cheekbone(p: DVec3, side: f64) -> f64 {
        ellipsoid(p - DVec3::new(0.22, 0.18 * side, -0.10), DVec3::new(0.12, 0.07, 0.06))
    }

    /// Returns the cavity of a head, with its openings (eye sockets, the nose and the hole below) and the channels that
    /// keep it in one piece where the wall is thick. All overlap, so that no loose fragments are left between them.
    fn void(p: DVec3, cavity: f64) -> f64 {
        let eye = |side: f64| {
            let (mouth, end) = (DVec3::new(0.50, 0.125 * side, 0.01), DVec3::new(0.10, 0.08 * side, 0.04));
            capsule(p, mouth, end, 0.085, 0.055)
        };
        let nose = capsule(p, DVec3::new(0.55, 0.0, -0.19), DVec3::new(0.15, 0.0, -0.14), 0.050, 0.045);
        let below = capsule(p, DVec3::new(-0.18, 0.0, -0.50), DVec3::new(-0.14, 0.0, 0.0), 0.09, 0.09);
        let throat = capsule(p, DVec3::new(0.0, 0.0, 0.05), DVec3::new(0.20, 0.0, -0.30), 0.08, 0.06);
        [eye(-1.0), eye(1.0), nose, below, throat].into_iter().fold(cavity, |void, part| smooth_min(void, part, 0.05))
    }
}

impl Implicit for Shell {
    fn value(&self, p: DVec3) -> f64 {
        let p = p / self.size;
        let head = Shell::head(p);
        let cheekbones = Shell::cheekbone(p, -1.0).min(Shell::cheekbone(p, 1.0));
        let outside = smooth_min(head, cheekbones, 0.06);
        smooth_difference(outside, Shell::void(p, head + self.wall), 0.02) * self.size
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::closure::{assert_solid, components, euler_characteristic, volume};

    const SKULL: Skull = Skull { size: 20.0, wall: 0.08, resolution: 30 };

    #[test]
    fn skull_is_one_shell_with_four_openings() {
        // The finer ones would show loose fragments that the coarse ones miss.
        for (wall, resolution) in [(0.08, 30), (0.08, 38), (0.05, 40), (0.10, 30), (0.04, 60), (0.06, 60), (0.08, 90)] {
            let skull = Skull { wall, resolution, ..SKULL };
            let mesh = skull.build().unwrap();
            assert_solid(&mesh);
            // A sphere with four openings into another within: three handles.
            assert_eq!((components(&mesh), euler_characteristic(&mesh)), (1, 2 - 2 * 3), "{skull:?}");
            let most = mesh.positions.iter().fold(DVec3::ZERO, |most, p| most.max(p.abs()));
            assert!(most.cmplt(skull.size * REACH).all(), "{skull:?}: {most}");
        }
    }

    #[test]
    fn volume_converges_and_grows_with_the_wall() {
        let of = |wall: f64, resolution: u32| volume(&Skull { wall, resolution, ..SKULL }.build().unwrap());
        assert!((of(0.08, 45) / of(0.08, 90) - 1.0).abs() < 0.02);
        assert!(of(0.10, 45) > 1.15 * of(0.08, 45));
    }

    #[test]
    fn wrong_parameters_are_refused() {
        let text = |skull: Skull| skull.build().unwrap_err().to_string();
        assert_eq!(text(Skull { wall: 0.2, ..SKULL }), "wall is 0.2, but must be from 0.04 to 0.1");
        assert_eq!(
            text(Skull { wall: 0.05, resolution: 20, ..SKULL }),
            "resolution is 20, but must be from 40 to 1024"
        );
        assert!(text(Skull { size: -1.0, ..SKULL }).starts_with("size is -1, but must be from"));
    }
}
