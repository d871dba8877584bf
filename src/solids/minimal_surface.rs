//! Triply periodic minimal surfaces as scaffolds: gyroid, primitive, diamond; as a sheet or as a network.
//!
//! The surfaces are approximated by their usual nodal form f = 0 (von Schnering and Nesper, Zeitschrift für Physik B
//! 83, 1991), with x, y, z in 2π per cell:
//!
//! | surface | f | area per cell, in L² |
//! |---|---|---|
//! | gyroid | sin x cos y + sin y cos z + sin z cos x | 3.0917 |
//! | primitive | cos x + cos y + cos z | 2.3526 |
//! | diamond | sin x sin y sin z + sin x cos y cos z + cos x sin y cos z + cos x cos y sin z | 3.8380 |
//!
//! A sheet is |f| < t, a wall with the surface in its middle; a network is f < t, the solid on one side. The level t
//! follows from the design parameters: the mean thickness of the wall or the volume fraction. Both are quantiles of f,
//! or of |f|, over a cell.

use std::f64::consts::TAU;

use glam::DVec3;

use super::contour::{Implicit, contour};
use super::{SolidError, check_length, check_range, periodic_block, rounded};
use crate::mesh::TriangleMesh;

/// Smallest wall thickness of a sheet in grid spacings; thinner walls would break up where they are thinnest.
const SPACINGS_PER_WALL: f64 = 1.5;

/// Number of points along each axis of a cell that determine the level.
const LEVEL_SAMPLES: u32 = 100;

/// A triply periodic minimal surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// Schoen's gyroid; its network is chiral.
    Gyroid,
    /// Schwarz' primitive surface; its network is cubic.
    Primitive,
    /// Schwarz' diamond surface; its network is that of diamond.
    Diamond,
}

/// The solid part of a minimal surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    /// A wall along the surface.
    Sheet {
        /// Mean thickness: the volume of the wall over the area of its middle surface.
        wall: f64,
    },
    /// One of the two labyrinths.
    Network {
        /// Its volume fraction.
        fraction: f64,
    },
}

/// A block of cells of a minimal surface, centred on the origin and capped by the planes of its box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MinimalSurface {
    /// The surface.
    pub surface: Surface,
    /// The solid part.
    pub part: Part,
    /// Number of cells along each axis, 1 to 10 000.
    pub cells: [u32; 3],
    /// Side of a cell.
    pub cell_size: f64,
    /// Number of grid cells along the side of a cell, 4 to 1024; the number of triangles grows with its square.
    pub resolution: u32,
}

impl Surface {
    /// Returns f at an angle.
    fn value(self, p: DVec3) -> f64 {
        let ((sx, cx), (sy, cy), (sz, cz)) = (p.x.sin_cos(), p.y.sin_cos(), p.z.sin_cos());
        match self {
            Surface::Gyroid => sx * cy + sy * cz + sz * cx,
            Surface::Primitive => cx + cy + cz,
            Surface::Diamond => sx * sy * sz + sx * cy * cz + cx * sy * cz + cx * cy * sz,
        }
    }

    /// Returns f and its gradient by angle.
    fn value_and_gradient(self, p: DVec3) -> (f64, DVec3) {
        let ((sx, cx), (sy, cy), (sz, cz)) = (p.x.sin_cos(), p.y.sin_cos(), p.z.sin_cos());
        match self {
            Surface::Gyroid => {
                (sx * cy + sy * cz + sz * cx, DVec3::new(cx * cy - sz * sx, cy * cz - sx * sy, cz * cx - sy * sz))
            }
            Surface::Primitive => (cx + cy + cz, -DVec3::new(sx, sy, sz)),
            Surface::Diamond => (
                sx * sy * sz + sx * cy * cz + cx * sy * cz + cx * cy * sz,
                DVec3::new(
                    cx * sy * sz + cx * cy * cz - sx * sy * cz - sx * cy * sz,
                    sx * cy * sz - sx * sy * cz + cx * cy * cz - cx * sy * sz,
                    sx * sy * cz - sx * cy * sz - cx * sy * sz + cx * cy * cz,
                ),
            ),
        }
    }

    /// Returns where in its cell a block begins, as a fraction of the cell along each axis.
    ///
    /// Found by trial: at these values no loose chips are cut off at edges and corners of a block by sheets that fill a
    /// quarter to three quarters of it, nor by networks that fill 0.3 to 0.7. At 0 gyroid and diamond have some.
    fn phase(self, part: Part) -> f64 {
        match (self, part) {
            (Surface::Gyroid, Part::Sheet { .. }) | (Surface::Diamond, _) => 0.11,
            (Surface::Gyroid, Part::Network { .. }) => 0.07,
            (Surface::Primitive, _) => 0.0,
        }
    }

    /// Returns the area of f = 0 in one cell of side 1.
    fn area(self) -> f64 {
        match self {
            Surface::Gyroid => 3.0917,
            Surface::Primitive => 2.3526,
            Surface::Diamond => 3.8380,
        }
    }

    /// Returns the level below which `of(f)` lies in a given fraction of the volume.
    fn level(self, fraction: f64, of: fn(f64) -> f64) -> f64 {
        // The offsets keep samples off the planes of symmetry, where many would share one value.
        let angle = |i: u32, offset: f64| TAU * (f64::from(i) + offset) / f64::from(LEVEL_SAMPLES);
        let mut values = Vec::with_capacity(LEVEL_SAMPLES.pow(3) as usize);
        for z in 0..LEVEL_SAMPLES {
            for y in 0..LEVEL_SAMPLES {
                for x in 0..LEVEL_SAMPLES {
                    let p = DVec3::new(angle(x, 0.372), angle(y, 0.213), angle(z, 0.109));
                    values.push(of(self.value(p)));
                }
            }
        }
        let rank = ((fraction * values.len() as f64) as usize).min(values.len() - 1);
        *values.select_nth_unstable_by(rank, f64::total_cmp).1
    }
}

impl MinimalSurface {
    /// Builds the closed surface of the solid.
    ///
    /// # Errors
    /// Fails for a parameter out of the range that its field states, a wall that the grid does not resolve or that
    /// fills the cell, and too many grid nodes or triangles.
    pub fn build(&self) -> Result<TriangleMesh, SolidError> {
        let block = periodic_block(self.cells, self.cell_size, self.resolution)?;
        let level = match self.part {
            Part::Sheet { wall } => {
                check_length("wall", wall)?;
                let least = SPACINGS_PER_WALL * block.spacing;
                let most = 0.95 * self.cell_size / self.surface.area();
                check_range("wall", wall, least, most).map_err(|_| SolidError::OutOfRange {
                    parameter: "wall",
                    value: wall,
                    allowed: format!(
                        "from {} ({SPACINGS_PER_WALL} grid spacings at resolution {}) to {} (95 % solid)",
                        rounded(least),
                        self.resolution,
                        rounded(most)
                    ),
                })?;
                self.surface.level(self.surface.area() * wall / self.cell_size, f64::abs)
            }
            Part::Network { fraction } => {
                check_range("fraction", fraction, 0.02, 0.98)?;
                self.surface.level(fraction, |f| f)
            }
        };
        let solid = Levelled {
            surface: self.surface,
            sheet: matches!(self.part, Part::Sheet { .. }),
            level,
            origin: block.min - self.surface.phase(self.part) * self.cell_size,
            angle_per_length: TAU / self.cell_size,
        };
        contour(&solid, &block, ("resolution", self.resolution.into()))
    }
}

/// f − t or |f| − t as an implicit solid.
struct Levelled {
    surface: Surface,
    sheet: bool,
    level: f64,
    /// A point at which the angles are zero.
    origin: DVec3,
    angle_per_length: f64,
}

impl Implicit for Levelled {
    fn value(&self, p: DVec3) -> f64 {
        let f = self.surface.value(self.angle_per_length * (p - self.origin));
        if self.sheet { f.abs() - self.level } else { f - self.level }
    }

    fn value_and_gradient(&self, p: DVec3, _spacing: f64) -> (f64, DVec3) {
        let (f, slope) = self.surface.value_and_gradient(self.angle_per_length * (p - self.origin));
        let side = if self.sheet { f.signum() } else { 1.0 };
        (side * f - self.level, side * self.angle_per_length * slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::closure::{assert_solid, components, euler_characteristic, least_angles, volume};

    const SURFACES: [Surface; 3] = [Surface::Gyroid, Surface::Primitive, Surface::Diamond];

    fn block(surface: Surface, part: Part) -> MinimalSurface {
        MinimalSurface { surface, part, cells: [2, 1, 2], cell_size: 5.0, resolution: 24 }
    }

    /// Returns the angles at a point of [`block`].
    fn angle(surface: Surface, part: Part, p: DVec3) -> DVec3 {
        TAU * ((p + DVec3::new(5.0, 2.5, 5.0)) / 5.0 + surface.phase(part))
    }

    #[test]
    fn networks_are_one_component() {
        for surface in SURFACES {
            for fraction in [0.3, 0.4, 0.5, 0.6, 0.7] {
                let mesh = block(surface, Part::Network { fraction }).build().unwrap();
                assert_eq!(components(&mesh), 1, "{surface:?} {fraction}");
            }
            for wall in [0.4, 1.0] {
                // The labyrinths on either side open to the faces, where the two sides of the wall meet.
                let mesh = block(surface, Part::Sheet { wall }).build().unwrap();
                assert_eq!(components(&mesh), 1, "{surface:?} {wall}");
            }
        }
    }

    #[test]
    fn networks_have_the_requested_volume() {
        for surface in SURFACES {
            for fraction in [0.2, 0.5, 0.7] {
                let mesh = block(surface, Part::Network { fraction }).build().unwrap();
                assert_solid(&mesh);
                let share = volume(&mesh) / (4.0 * 125.0);
                assert!((share - fraction).abs() < 0.004, "{surface:?} {fraction}: {share}");
            }
        }
    }

    #[test]
    fn half_networks_have_level_zero() {
        for surface in SURFACES {
            assert!(surface.level(0.5, |f| f).abs() < 2e-3, "{surface:?}");
        }
    }

    #[test]
    fn sheets_have_the_volume_of_their_wall() {
        for surface in SURFACES {
            for wall in [0.4, 0.8] {
                let mesh = block(surface, Part::Sheet { wall }).build().unwrap();
                assert_solid(&mesh);
                let ratio = volume(&mesh) / (4.0 * 25.0 * surface.area() * wall);
                assert!((ratio - 1.0).abs() < 0.02, "{surface:?} {wall}: {ratio}");
            }
        }
    }

    #[test]
    fn walls_have_the_requested_mean_thickness() {
        // For a thin wall the two sides have the area of the middle between them, so that volume over area measures the
        // wall.
        let wall = 0.4;
        let mesh = block(Surface::Gyroid, Part::Sheet { wall }).build().unwrap();
        let extent = DVec3::new(5.0, 2.5, 5.0);
        let area: f64 = mesh
            .triangles
            .iter()
            .map(|t| t.map(|v| mesh.positions[v as usize]))
            .filter(|t| !(0..3).any(|axis| t.iter().all(|p| p[axis].abs() == extent[axis])))
            .map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0)
            .sum();
        assert!((volume(&mesh) / (area / 2.0) / wall - 1.0).abs() < 0.03);
    }

    #[test]
    fn caps_are_exactly_planar_and_cover_the_box() {
        let mesh = block(Surface::Gyroid, Part::Network { fraction: 0.5 }).build().unwrap();
        let extent = DVec3::new(5.0, 2.5, 5.0);
        assert!(mesh.positions.iter().all(|p| p.abs().cmple(extent).all()));
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let cap: f64 = mesh
                    .triangles
                    .iter()
                    .map(|t| t.map(|v| mesh.positions[v as usize]))
                    .filter(|t| t.iter().all(|p| p[axis] == side * extent[axis]))
                    .map(|[a, b, c]| side * (b - a).cross(c - a)[axis] / 2.0)
                    .inspect(|&area| assert!(area > 0.0))
                    .sum();
                let face = 8.0 * extent.x * extent.y * extent.z / (2.0 * extent[axis]);
                assert!((cap / face - 0.5).abs() < 0.005, "{axis} {side}: {cap} of {face}");
            }
        }
    }

    #[test]
    fn gradients_agree_with_finite_differences() {
        for surface in SURFACES {
            for p in [DVec3::new(0.3, 1.7, -2.2), DVec3::new(2.9, -0.4, 1.1)] {
                let (value, gradient) = surface.value_and_gradient(p);
                assert_eq!(value, surface.value(p));
                for (axis, e) in DVec3::AXES.into_iter().enumerate() {
                    let difference = (surface.value(p + 1e-5 * e) - surface.value(p - 1e-5 * e)) / 2e-5;
                    assert!((difference - gradient[axis]).abs() < 1e-8, "{surface:?} {p} {axis}");
                }
            }
        }
    }

    #[test]
    fn no_triangle_is_turned_over() {
        for surface in SURFACES {
            for part in [Part::Network { fraction: 0.5 }, Part::Sheet { wall: 0.4 }] {
                let mesh = block(surface, part).build().unwrap();
                let extent = DVec3::new(5.0, 2.5, 5.0);
                for t in &mesh.triangles {
                    let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
                    if (0..3).any(|axis| [a, b, c].iter().all(|p| p[axis].abs() == extent[axis])) {
                        continue;
                    }
                    let (f, gradient) = surface.value_and_gradient(angle(surface, part, (a + b + c) / 3.0));
                    let outwards = if matches!(part, Part::Sheet { .. }) { f.signum() * gradient } else { gradient };
                    let normal = (b - a).cross(c - a).normalize();
                    assert!(normal.dot(outwards.normalize()) > 0.5, "{surface:?} {part:?} {a} {b} {c}");
                }
            }
        }
    }

    #[test]
    fn vertices_lie_on_the_surface_or_on_the_box() {
        let part = Part::Network { fraction: 0.4 };
        let mesh = block(Surface::Diamond, part).build().unwrap();
        let extent = DVec3::new(5.0, 2.5, 5.0);
        let level = Surface::Diamond.level(0.4, |f| f);
        for p in &mesh.positions {
            let f = Surface::Diamond.value(angle(Surface::Diamond, part, *p));
            assert!((f - level).abs() < 1e-8 || p.abs().cmpeq(extent).any(), "{p}: {f}");
        }
    }

    #[test]
    fn topology_is_that_of_the_surface() {
        // A periodic solid has half the characteristic of its surface. The capped block adds whole struts cut at the
        // box; the difference between blocks of n³ cells leaves the term in n³.
        let chi = |n: u32| {
            let part = Part::Network { fraction: 0.5 };
            let model =
                MinimalSurface { surface: Surface::Primitive, part, cells: [n; 3], cell_size: 1.0, resolution: 12 };
            euler_characteristic(&model.build().unwrap()) / 2
        };
        // Inside is the labyrinth about the cell centre; nodes n³ and struts between them 3 n² (n − 1).
        for n in 1..4_u32 {
            let k = i64::from(n);
            assert_eq!(chi(n), k * k * k - 3 * k * k * (k - 1));
        }
    }

    #[test]
    fn triangles_are_well_shaped() {
        for surface in SURFACES {
            for part in [Part::Network { fraction: 0.5 }, Part::Sheet { wall: 0.5 }] {
                let angles = least_angles(&block(surface, part).build().unwrap());
                let at = |share: f64| angles[(share * angles.len() as f64) as usize];
                assert!(
                    at(0.01) > 15.0 && at(0.5) > 35.0,
                    "{surface:?} {part:?} {:.1?}",
                    [0.0, 0.001, 0.01, 0.05, 0.5].map(at)
                );
            }
        }
    }

    #[test]
    fn the_mesh_does_not_depend_on_the_thread_count() {
        let model = block(Surface::Gyroid, Part::Sheet { wall: 0.5 });
        let [one, two] = [1, 2].map(|threads| {
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| model.build().unwrap())
        });
        assert_eq!(one, two);
        assert_ne!(one, block(Surface::Gyroid, Part::Sheet { wall: 0.6 }).build().unwrap());
    }

    #[test]
    fn coarse_grids_give_manifolds() {
        for surface in SURFACES {
            for resolution in 4..9 {
                for fraction in [0.05, 0.3, 0.5, 0.9] {
                    let part = Part::Network { fraction };
                    let model = MinimalSurface { surface, part, cells: [2; 3], cell_size: 1.0, resolution };
                    match model.build() {
                        Ok(mesh) => assert_solid(&mesh),
                        Err(error) => assert!(matches!(error, SolidError::Empty { .. }), "{error}"),
                    }
                }
            }
        }
    }

    #[test]
    fn wrong_parameters_are_named_with_value_and_range() {
        let good = block(Surface::Gyroid, Part::Sheet { wall: 0.5 });
        let text = |model: MinimalSurface| model.build().unwrap_err().to_string();
        assert_eq!(text(MinimalSurface { cells: [1, 0, 1], ..good }), "cells is 0, but must be from 1 to 10000");
        assert!(text(MinimalSurface { cell_size: -2.0, ..good }).starts_with("cell_size is -2"));
        assert_eq!(text(MinimalSurface { resolution: 2, ..good }), "resolution is 2, but must be from 4 to 1024");
        let thin = text(MinimalSurface { part: Part::Sheet { wall: 0.2 }, ..good });
        assert!(
            thin.starts_with("wall is 0.2, but must be from 0.3125 (1.5 grid spacings at resolution 24)"),
            "{thin}"
        );
        // 1.5 · (5 / 25) is 0.30000000000000004 in binary.
        let wall =
            |wall| MinimalSurface { part: Part::Sheet { wall }, cells: [1; 3], cell_size: 5.0, resolution: 25, ..good };
        assert_solid(&wall(0.3).build().unwrap());
        let thin = text(wall(0.299));
        assert!(thin.starts_with("wall is 0.299, but must be from 0.3 (1.5 grid"), "{thin}");
        let full = text(MinimalSurface { part: Part::Network { fraction: 1.0 }, ..good });
        assert_eq!(full, "fraction is 1, but must be from 0.02 to 0.98");
        let many = text(MinimalSurface { cells: [1000; 3], ..good });
        assert!(many.starts_with("resolution = 24 asks for 13"), "{many}");
        let huge = text(MinimalSurface { cells: [10_000; 3], resolution: 1024, ..good });
        assert!(huge.starts_with("wall is 0.5") || huge.starts_with("resolution = 1024 asks for "), "{huge}");
    }
}
