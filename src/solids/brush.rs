//! A brush: round bristles on a plate, merged into one surface. Many thin protrusions, no hole.

use glam::DVec3;

use super::contour::{Block, Implicit, contour};
use super::{SolidError, check_length, check_range, rounded};
use crate::mesh::TriangleMesh;

/// Smallest radius in grid spacings; thinner bristles would break up.
const SPACINGS_PER_RADIUS: f64 = 1.0;

/// A plate in the plane of x and y with bristles along z, centred on the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brush {
    /// Number of bristles along x and along y, 1 to 10 000.
    pub bristles: [u32; 2],
    /// Distance between the axes of neighbouring bristles; the plate reaches half of it beyond the outermost axes.
    pub spacing: f64,
    /// Radius of a bristle, below half the spacing.
    pub radius: f64,
    /// Length of a bristle above the plate, rounded up to half a grid cell more than whole ones.
    pub length: f64,
    /// Thickness of the plate, rounded up in the same way.
    pub plate: f64,
    /// Grid cells between the axes of neighbouring bristles, 4 to 1024.
    pub resolution: u32,
}

impl Brush {
    /// Builds the closed surface of the solid.
    ///
    /// # Errors
    /// Fails for a parameter out of the range that its field states, a radius that the grid does not resolve, and too
    /// many grid nodes or triangles.
    pub fn build(&self) -> Result<TriangleMesh, SolidError> {
        for (name, value) in [("spacing", self.spacing), ("length", self.length), ("plate", self.plate)] {
            check_length(name, value)?;
        }
        for n in self.bristles {
            check_range("bristles", n.into(), 1.0, 10_000.0)?;
        }
        check_range("resolution", self.resolution.into(), 4.0, 1024.0)?;
        let step = self.spacing / f64::from(self.resolution);
        for (name, value) in [("length", self.length), ("plate", self.plate)] {
            check_range(name, value, 0.0, 1e6 * step)?;
        }
        let (least, most) = (SPACINGS_PER_RADIUS * step, 0.49 * self.spacing);
        check_range("radius", self.radius, least, most).map_err(|_| SolidError::OutOfRange {
            parameter: "radius",
            value: self.radius,
            allowed: format!(
                "from {} (a grid cell at resolution {}) to {}",
                rounded(least),
                self.resolution,
                rounded(most)
            ),
        })?;
        // The top of the plate lies half way between grid planes, where it comes out as one plane.
        let halves = |length: f64| (length / step - 0.5).ceil().max(0.0) + 0.5;
        let (plate, length) = (halves(self.plate), halves(self.length));
        let cells = [self.bristles[0] * self.resolution, self.bristles[1] * self.resolution, (plate + length) as u32];
        let min = -step / 2.0 * DVec3::from_array(cells.map(f64::from));
        let bristles = Bristles { corner: min, spacing: self.spacing, radius: self.radius, plate: plate * step };
        let block = Block { min, spacing: step, cells: cells.map(|n| n as usize) };
        contour(&bristles, &block, ("resolution", self.resolution.into()))
    }
}

/// Plate and bristles of unlimited extent; the box clips them.
struct Bristles {
    corner: DVec3,
    spacing: f64,
    radius: f64,
    plate: f64,
}

impl Implicit for Bristles {
    fn value(&self, p: DVec3) -> f64 {
        let p = p - self.corner;
        let across = p.truncate() / self.spacing;
        let from_axis = self.spacing * (across - across.floor() - 0.5).length();
        (p.z - self.plate).min(from_axis - self.radius)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::solids::closure::{assert_solid, euler_characteristic, volume};

    const BRUSH: Brush =
        Brush { bristles: [3, 2], spacing: 2.0, radius: 0.5, length: 4.05, plate: 1.05, resolution: 20 };

    #[test]
    fn brush_is_a_ball_of_known_volume() {
        let mesh = BRUSH.build().unwrap();
        assert_solid(&mesh);
        assert_eq!(euler_characteristic(&mesh), 2);
        let exact = 6.0 * (2.0 * 2.0 * 1.05 + PI * 0.25 * 4.05);
        assert!((volume(&mesh) / exact - 1.0).abs() < 0.01, "{} {exact}", volume(&mesh));
        let top = mesh.positions.iter().map(|p| p.z).fold(f64::MIN, f64::max);
        assert!((top - 2.55).abs() < 1e-12);
    }

    #[test]
    fn wrong_parameters_are_refused() {
        let text = |brush: Brush| brush.build().unwrap_err().to_string();
        assert!(text(Brush { radius: 0.05, ..BRUSH }).starts_with("radius is 0.05, but must be from 0.1 (a grid cell"));
        assert!(text(Brush { bristles: [0, 1], ..BRUSH }).starts_with("bristles is 0, but must be from 1"));
        assert!(text(Brush { plate: -1.0, ..BRUSH }).starts_with("plate is -1, but"));
    }
}
