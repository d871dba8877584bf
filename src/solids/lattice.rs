//! Lattices of round struts, merged into one surface or left as overlapping cylinders.
//!
//! A cell of the cubic lattice has a node in its middle and struts to the middles of its six faces; one of the
//! body-centred lattice has a node in its middle and struts to its eight corners. Struts of the merged form are all
//! points within the radius of these lines, clipped by the box. A cubic cell of side L and radius r ≤ L / 2 then has
//! the volume 3πr²L − 8√2 r³.

use glam::DVec3;

use super::contour::{Implicit, contour};
use super::primitives::cylinder;
use super::{SolidError, check_length, check_range, check_triangles, periodic_block, rounded};
use crate::mesh::TriangleMesh;

/// Smallest radius in grid spacings; thinner struts would break up.
const SPACINGS_PER_RADIUS: f64 = 1.0;

/// The directions of struts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StrutPattern {
    /// Along the three axes through the middle of each cell.
    Cubic,
    /// Along the four diagonals of each cell.
    BodyCentred,
}

/// The way in which struts are combined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LatticeForm {
    /// One surface, clipped and capped by the box.
    Union {
        /// Number of grid cells along the side of a cell, 4 to 1024.
        resolution: u32,
    },
    /// A closed cylinder for each strut, which overlaps its neighbours: the form that many design programs write, and a
    /// solid only under a fill rule. Cylinders extend beyond their nodes by their radius, except where a cubic strut
    /// ends on the box; body-centred ones protrude from it.
    Overlapping {
        /// Number of segments round a cylinder, at least 3; it has four times as many triangles.
        segments: u32,
    },
}

/// A block of lattice cells, centred on the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrutLattice {
    /// The directions of struts.
    pub pattern: StrutPattern,
    /// The way in which they are combined.
    pub form: LatticeForm,
    /// Number of cells along each axis, 1 to 10 000.
    pub cells: [u32; 3],
    /// Side of a cell.
    pub cell_size: f64,
    /// Radius of a strut, below half the cell size.
    pub radius: f64,
}

impl StrutLattice {
    /// Builds the closed surface of the solid, or the closed surfaces of its struts.
    ///
    /// # Errors
    /// Fails for a parameter out of the range that its field states, a radius that the grid does not resolve, and too
    /// many grid nodes or triangles.
    pub fn build(&self) -> Result<TriangleMesh, SolidError> {
        check_length("radius", self.radius)?;
        match self.form {
            LatticeForm::Union { resolution } => self.union(resolution),
            LatticeForm::Overlapping { segments } => self.overlapping(segments),
        }
    }

    /// Returns the number of struts of the overlapping form.
    pub fn struts(&self) -> u64 {
        let [x, y, z] = self.cells.map(u64::from);
        match self.pattern {
            StrutPattern::Cubic => y * z * (x + 1) + z * x * (y + 1) + x * y * (z + 1),
            StrutPattern::BodyCentred => 8 * x * y * z,
        }
    }

    fn union(&self, resolution: u32) -> Result<TriangleMesh, SolidError> {
        let block = periodic_block(self.cells, self.cell_size, resolution)?;
        let (least, most) = (SPACINGS_PER_RADIUS * block.spacing, self.cell_size / 2.0);
        check_range("radius", self.radius, least, most).map_err(|_| SolidError::OutOfRange {
            parameter: "radius",
            value: self.radius,
            allowed: format!(
                "from {} (a grid spacing at resolution {resolution}) to {} (half a cell)",
                rounded(least),
                rounded(most)
            ),
        })?;
        let solid = Struts { pattern: self.pattern, radius: self.radius, cell_size: self.cell_size, corner: block.min };
        contour(&solid, &block, ("resolution", resolution.into()))
    }

    fn overlapping(&self, segments: u32) -> Result<TriangleMesh, SolidError> {
        // There is no grid here, so the lowest resolution serves for the checks of cells and size.
        let corner = periodic_block(self.cells, self.cell_size, 4)?.min;
        check_range("radius", self.radius, 1e-9, self.cell_size / 2.0)?;
        check_range("segments", segments.into(), 3.0, 1e6)?;
        let struts = self.struts();
        check_triangles("segments", segments, struts.saturating_mul(4 * u64::from(segments)))?;
        let mut mesh = TriangleMesh {
            positions: Vec::with_capacity((2 * struts * (u64::from(segments) + 1)) as usize),
            triangles: Vec::with_capacity((4 * struts * u64::from(segments)) as usize),
        };
        let unit = cylinder(self.radius, 2.0, segments)?;
        let [nx, ny, nz] = self.cells;
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    let cell = DVec3::new(x.into(), y.into(), z.into());
                    let node = corner + self.cell_size * (cell + 0.5);
                    match self.pattern {
                        StrutPattern::Cubic => self.cubic_struts(&mut mesh, &unit, node, [x, y, z]),
                        StrutPattern::BodyCentred => self.diagonal_struts(&mut mesh, &unit, node),
                    }
                }
            }
        }
        Ok(mesh)
    }

    /// Adds the struts from a node towards greater coordinates, and on the least cells those back to the box.
    fn cubic_struts(&self, mesh: &mut TriangleMesh, unit: &TriangleMesh, node: DVec3, cell: [u32; 3]) {
        let half = self.cell_size / 2.0;
        for (axis, along) in DVec3::AXES.into_iter().enumerate() {
            if cell[axis] == 0 {
                append_strut(mesh, unit, node - half * along, node + self.radius * along);
            }
            let end = if cell[axis] + 1 == self.cells[axis] { half } else { self.cell_size + self.radius };
            append_strut(mesh, unit, node - self.radius * along, node + end * along);
        }
    }

    /// Adds the struts from a node to the corners of its cell.
    fn diagonal_struts(&self, mesh: &mut TriangleMesh, unit: &TriangleMesh, node: DVec3) {
        for corner in 0..8 {
            let sign = |bit: u32| if (corner >> bit) & 1 == 1 { 1.0 } else { -1.0 };
            let to_corner = self.cell_size / 2.0 * DVec3::new(sign(0), sign(1), sign(2));
            let past = self.radius * to_corner.normalize();
            append_strut(mesh, unit, node - past, node + to_corner + past);
        }
    }
}

/// Adds a copy of a cylinder of height 2 about the z axis, stretched and rotated to run from one point to another.
fn append_strut(mesh: &mut TriangleMesh, unit: &TriangleMesh, from: DVec3, to: DVec3) {
    let first = mesh.positions.len() as u32;
    let (middle, half) = ((from + to) / 2.0, (to - from) / 2.0);
    let (u, v) = half.normalize().any_orthonormal_pair();
    // The pair is completed to a right-handed frame, or the cylinder would be turned inside out.
    let v = if u.cross(v).dot(half) > 0.0 { v } else { -v };
    mesh.positions.extend(unit.positions.iter().map(|p| middle + p.x * u + p.y * v + p.z * half));
    mesh.triangles.extend(unit.triangles.iter().map(|t| t.map(|i| first + i)));
}

/// The distance to the lines of a periodic lattice minus the radius.
struct Struts {
    pattern: StrutPattern,
    radius: f64,
    cell_size: f64,
    corner: DVec3,
}

impl Struts {
    /// Returns the vector from the nearest line to a point, both folded into the octant of one cell, and the signs of
    /// the fold.
    fn away_from_line(&self, p: DVec3) -> (DVec3, DVec3) {
        let in_cell = (p - self.corner) / self.cell_size;
        let from_node = self.cell_size * (in_cell - in_cell.floor() - 0.5);
        let q = from_node.abs();
        let away = match self.pattern {
            StrutPattern::Cubic => {
                // The nearest axis is the one along which the point's coordinate is largest.
                if q.x >= q.y && q.x >= q.z {
                    q.with_x(0.0)
                } else if q.y >= q.z {
                    q.with_y(0.0)
                } else {
                    q.with_z(0.0)
                }
            }
            // In the octant no other diagonal, of this cell or of a neighbour, is nearer than the one along it.
            StrutPattern::BodyCentred => q - DVec3::splat(q.element_sum() / 3.0),
        };
        (away, from_node.signum())
    }
}

impl Implicit for Struts {
    fn value(&self, p: DVec3) -> f64 {
        self.away_from_line(p).0.length() - self.radius
    }

    fn value_and_gradient(&self, p: DVec3, _spacing: f64) -> (f64, DVec3) {
        let (away, signs) = self.away_from_line(p);
        (away.length() - self.radius, away.normalize_or_zero() * signs)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, SQRT_2};

    use super::*;
    use crate::solids::closure::{assert_solid, euler_characteristic, least_angles, volume};

    fn lattice(pattern: StrutPattern, form: LatticeForm) -> StrutLattice {
        StrutLattice { pattern, form, cells: [2; 3], cell_size: 2.0, radius: 0.3 }
    }

    #[test]
    fn cubic_union_has_its_closed_form_volume() {
        let mesh = lattice(StrutPattern::Cubic, LatticeForm::Union { resolution: 40 }).build().unwrap();
        assert_solid(&mesh);
        let (r, side) = (0.3_f64, 2.0);
        let exact = 8.0 * (3.0 * PI * r * r * side - 8.0 * SQRT_2 * r * r * r);
        assert!((volume(&mesh) / exact - 1.0).abs() < 0.01, "{} {exact}", volume(&mesh));
    }

    #[test]
    fn body_centred_union_tends_to_the_length_of_its_struts() {
        // Thin struts overlap at nodes only, in a volume of order r³.
        let mut thin = lattice(StrutPattern::BodyCentred, LatticeForm::Union { resolution: 80 });
        thin.radius = 0.05;
        let mesh = thin.build().unwrap();
        assert_solid(&mesh);
        let struts = 64.0 * 3.0_f64.sqrt() * PI * 0.05 * 0.05;
        let ratio = volume(&mesh) / struts;
        assert!(ratio > 0.85 && ratio < 1.0, "{ratio}");
    }

    #[test]
    fn unions_have_the_topology_of_their_graph() {
        for n in 1..4_u32 {
            let mut model = lattice(StrutPattern::Cubic, LatticeForm::Union { resolution: 16 });
            model.cells = [n; 3];
            let k = i64::from(n);
            assert_eq!(euler_characteristic(&model.build().unwrap()), 2 * (k * k * k - 3 * k * k * (k - 1)));
            model.pattern = StrutPattern::BodyCentred;
            assert_eq!(euler_characteristic(&model.build().unwrap()), 2 * (k * k * k + (k + 1).pow(3) - 8 * k * k * k));
        }
    }

    #[test]
    fn overlapping_struts_are_separate_closed_cylinders() {
        for pattern in [StrutPattern::Cubic, StrutPattern::BodyCentred] {
            let model = lattice(pattern, LatticeForm::Overlapping { segments: 12 });
            let mesh = model.build().unwrap();
            assert_solid(&mesh);
            assert_eq!(mesh.triangles.len() as u64, 48 * model.struts());
            assert_eq!(euler_characteristic(&mesh) as u64, 2 * model.struts());
        }
    }

    #[test]
    fn overlapping_struts_have_the_volume_of_cylinders() {
        let (r, segments) = (0.3, 12);
        let section = f64::from(segments) / 2.0 * (std::f64::consts::TAU / f64::from(segments)).sin() * r * r;
        let cubic = lattice(StrutPattern::Cubic, LatticeForm::Overlapping { segments }).build().unwrap();
        // Each of 12 lines of length 4 has two nodes at which two cylinders overlap by 2 r.
        assert!((volume(&cubic) / (section * 12.0 * (4.0 + 4.0 * r)) - 1.0).abs() < 1e-12);
        let diagonal = lattice(StrutPattern::BodyCentred, LatticeForm::Overlapping { segments }).build().unwrap();
        assert!((volume(&diagonal) / (section * 64.0 * (3.0_f64.sqrt() + 2.0 * r)) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn union_triangles_are_well_shaped_and_independent_of_the_thread_count() {
        for pattern in [StrutPattern::Cubic, StrutPattern::BodyCentred] {
            let model = lattice(pattern, LatticeForm::Union { resolution: 24 });
            let [one, two] = [1, 2].map(|threads| {
                rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| model.build().unwrap())
            });
            assert_eq!(one, two);
            let angles = least_angles(&one);
            let at = |share: f64| angles[(share * angles.len() as f64) as usize];
            assert!(at(0.01) > 10.0 && at(0.5) > 30.0, "{pattern:?} {:.1?}", [0.0, 0.001, 0.01, 0.05, 0.5].map(at));
        }
    }

    #[test]
    fn wrong_parameters_are_named_with_value_and_range() {
        let good = lattice(StrutPattern::Cubic, LatticeForm::Union { resolution: 8 });
        let text = |model: StrutLattice| model.build().unwrap_err().to_string();
        assert_eq!(
            text(StrutLattice { radius: 0.2, ..good }),
            "radius is 0.2, but must be from 0.25 (a grid spacing at resolution 8) to 1 (half a cell)"
        );
        assert!(text(StrutLattice { radius: 1.2, ..good }).starts_with("radius is 1.2, but"));
        assert!(text(StrutLattice { cells: [0, 1, 1], ..good }).starts_with("cells is 0, but"));
        let many = StrutLattice { form: LatticeForm::Overlapping { segments: 64 }, cells: [60; 3], ..good };
        assert_eq!(text(many), "segments = 64 gives 168652800 triangles, but at most 50000000 are allowed");
    }
}
