//! Mean intercept lengths, their ellipsoid, the degree of anisotropy.
//!
//! A line in direction d crosses the surface P_L(d) times per unit length, and the mean intercept length is its reciprocal,
//! MIL(d) = 1/P_L(d). On a raster of lines it is usually counted; on a mesh it has a closed form: a facet of area A and unit
//! normal n presents the area A·|n·d| to lines, so that P_L(d) = Σ A_f |n_f·d| / TV, without lines and without noise.
//!
//! Harrigan and Mann (*Journal of Materials Science* 19, 1984) describe MIL by an ellipsoid: 1/MIL² = dᵀ M d, with M from a
//! least-squares fit. Its half axes a ≥ b ≥ c are the reciprocal roots of the eigenvalues of M, and the degree of anisotropy is
//! DA = 1 − (c/a)²: 0 where all directions are alike, 1 where lines in some direction never meet the surface, as between
//! parallel plates (a is infinite then).
//!
//! # Directions
//! The fit is over the midpoints of a grid on the faces of a cube, in equal angles ([`DIRECTIONS`] of them on the half sphere),
//! each weighted by its solid angle. That set has all symmetries of the cube, so that a cubic structure aligned with the axes
//! has DA = 0 to rounding. A Fibonacci spiral of as many directions has none of them, and gave a DA of 0.003 for a cube and of
//! 0.0012 for struts along the axes. In other orientations, the cube has up to 0.003 here (0.005 on the spiral) and the struts
//! 0.0006 (0.0016): a MIL that is not an ellipsoid is not fitted by one, and its misfit is distributed slightly unevenly.

use crate::parallel::*;
use glam::{DMat3, DVec3};

use super::eigen::Principal;
use super::surface_area::SurfaceElements;

/// Cells along the edge of a face of the cube that directions run through.
const CELLS: usize = 14;

/// Number of directions on half a sphere.
pub const DIRECTIONS: usize = 3 * CELLS * CELLS;

/// Facets in one task. Part of the result, since it determines the order of additions.
const CHUNK: usize = 1 << 13;

/// Facets that are added to all directions at a time.
const AT_ONCE: usize = 4;

/// An eigenvalue of 1/MIL² below this share of the largest counts as 0 with rounding.
const NONE: f64 = 1e-12;

/// Crossings of lines of every direction with a surface.
#[derive(Clone, Debug)]
pub struct Crossings {
    /// P_L by direction, in crossings per world unit.
    per_length: Vec<f64>,
}

/// The ellipsoid of mean intercept lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anisotropy {
    /// Half axes in world units, descending: a, b, c. Infinite where lines never cross the surface.
    pub half_axes: [f64; 3],
    /// Their directions, orthonormal.
    pub directions: [DVec3; 3],
    /// DA = 1 − (c/a)²: from 0, isotropic, to 1.
    pub degree: f64,
    /// The root mean square difference between dᵀ M d and 1/MIL², as a share of the mean of 1/MIL²: the deviation of the
    /// intercepts from an ellipsoid.
    pub misfit: f64,
}

impl Crossings {
    /// Computes the crossings of a surface in a volume TV, in cubic world units.
    pub fn of(surface: &SurfaceElements, volume: f64) -> Crossings {
        let [x, y, z] = [0, 1, 2].map(|axis| directions().map(|(d, _)| d[axis]).collect::<Vec<f64>>());
        let (areas, normals) = (surface.areas(), &surface.facets().normals);
        let of_chunk = |(areas, normals): (&[f64], &[DVec3])| {
            let mut sums = vec![0.0; DIRECTIONS];
            for (areas, normals) in areas.chunks(AT_ONCE).zip(normals.chunks(AT_ONCE)) {
                let mut shown = [DVec3::ZERO; AT_ONCE];
                shown.iter_mut().zip(areas.iter().zip(normals)).for_each(|(s, (&area, &normal))| *s = area * normal);
                for (sum, ((x, y), z)) in sums.iter_mut().zip(x.iter().zip(&y).zip(&z)) {
                    *sum += shown.iter().map(|s| (s.x * x + s.y * y + s.z * z).abs()).sum::<f64>();
                }
            }
            sums
        };
        let chunks = areas.par_chunks(CHUNK).zip(normals.par_chunks(CHUNK));
        let by_chunk: Vec<Vec<f64>> = chunks.map(of_chunk).collect();
        let mut per_length = vec![0.0; DIRECTIONS];
        for sums in by_chunk {
            per_length.iter_mut().zip(sums).for_each(|(total, sum)| *total += sum);
        }
        per_length.iter_mut().for_each(|sum| *sum /= volume);
        Crossings { per_length }
    }

    /// Returns directions, unit vectors on one half of the sphere, with P_L in crossings per world unit.
    pub fn by_direction(&self) -> impl Iterator<Item = (DVec3, f64)> {
        directions().map(|(direction, _)| direction).zip(self.per_length.iter().copied())
    }

    /// Returns the mean of P_L over all directions, in crossings per world unit: half the area per volume, to the accuracy of
    /// the sum over directions.
    pub fn mean(&self) -> f64 {
        let (sum, weights) = directions()
            .zip(&self.per_length)
            .fold((0.0, 0.0), |(sum, weights), ((_, weight), p)| (sum + weight * p, weights + weight));
        sum / weights
    }

    /// Fits the ellipsoid; `None` where there is no surface, or no volume.
    pub fn ellipsoid(&self) -> Option<Anisotropy> {
        let is_known = self.per_length.iter().all(|p| p.is_finite()) && self.per_length.iter().any(|&p| p > 0.0);
        is_known.then(|| self.fitted())
    }

    fn fitted(&self) -> Anisotropy {
        let matrix = self.quadratic();
        let Principal { values, directions: axes } = Principal::of(matrix);
        let largest = values[2];
        let half_axes = values.map(|value| if value > NONE * largest { value.sqrt().recip() } else { f64::INFINITY });
        let degree = 1.0 - values[0].max(0.0) / largest;
        let (mut squares, mut mean, mut weights) = (0.0, 0.0, 0.0);
        for ((d, weight), p) in directions().zip(&self.per_length) {
            squares += weight * (d.dot(matrix * d) - p * p).powi(2);
            mean += weight * p * p;
            weights += weight;
        }
        Anisotropy { half_axes, directions: axes, degree, misfit: (squares / weights).sqrt() / (mean / weights) }
    }

    /// Returns M of dᵀ M d = P_L², by weighted least squares.
    ///
    /// Sums of weights times products of four components depend on the set of directions alone, and those with an odd power
    /// vanish by its symmetry. So the coefficients of products are independent, and those of squares are coupled in three
    /// equations of the form (u − v) m_i + v (m_x + m_y + m_z) = r_i with u = ⟨x⁴⟩ and v = ⟨x²y²⟩.
    fn quadratic(&self) -> DMat3 {
        let (mut u, mut v) = (0.0, 0.0);
        let (mut squares, mut products) = (DVec3::ZERO, DVec3::ZERO);
        for ((d, weight), p) in directions().zip(&self.per_length) {
            let (square, product) = (d * d, DVec3::new(d.y * d.z, d.z * d.x, d.x * d.y));
            u += weight * square.dot(square) / 3.0;
            v += weight * product.dot(product) / 3.0;
            squares += weight * p * p * square;
            products += weight * p * p * product;
        }
        let trace = squares.element_sum() / (u + 2.0 * v);
        let diagonal = (squares - v * trace) / (u - v);
        let beside = products / (2.0 * v);
        DMat3::from_cols(
            DVec3::new(diagonal.x, beside.z, beside.y),
            DVec3::new(beside.z, diagonal.y, beside.x),
            DVec3::new(beside.y, beside.x, diagonal.z),
        )
    }
}

/// Returns the number of crossings per world unit, P_L, of a line in `direction`, a unit vector, with a surface in a volume TV.
pub fn crossings_along(surface: &SurfaceElements, volume: f64, direction: DVec3) -> f64 {
    let normals = &surface.facets().normals;
    super::surface_area::in_chunks(normals.len(), &|f| surface.areas()[f] * normals[f].dot(direction).abs()) / volume
}

/// Returns directions with their weights, proportional to the solid angle of their cell.
fn directions() -> impl Iterator<Item = (DVec3, f64)> {
    let slope = |cell: usize| (std::f64::consts::FRAC_PI_2 * ((cell as f64 + 0.5) / CELLS as f64 - 0.5)).tan();
    (0..DIRECTIONS).map(move |i| {
        let (face, s, t) = (i / (CELLS * CELLS), slope(i / CELLS % CELLS), slope(i % CELLS));
        let d = DVec3::from_array(std::array::from_fn(|axis| [1.0, s, t][(axis + 3 - face) % 3]));
        let weight = (1.0 + s * s) * (1.0 + t * t) / d.length().powi(3);
        (d.normalize(), weight)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriangleMesh;
    use crate::metrics::surface_area::tests::{Sampled, cube, grid_of, network, order, struts, turned, turns, whole};
    use crate::metrics::{Facets, Region};
    use crate::solids::{self, LatticeForm, StrutLattice, StrutPattern, Surface};
    use crate::testing::meshes::together;

    /// Returns the anisotropy of an uncut mesh in a volume of 1.
    fn of(mesh: &TriangleMesh) -> Anisotropy {
        let bounds = mesh.bounds().unwrap();
        let grid = grid_of(bounds.min - DVec3::ONE, bounds.max + DVec3::ONE, 8);
        let facets = Facets::of(&mesh.positions, &mesh.triangles);
        let region = whole(&grid);
        Crossings::of(&SurfaceElements::of_facets(&facets, &region).unwrap(), 1.0).ellipsoid().unwrap()
    }

    #[test]
    fn directions_are_spread_and_have_the_symmetries_of_the_cube() {
        let all: Vec<(DVec3, f64)> = directions().collect();
        assert!(all.len() == DIRECTIONS && DIRECTIONS >= 500);
        let total: f64 = all.iter().map(|(_, weight)| weight).sum();
        let has = |d: DVec3, weight: f64| {
            all.iter().any(|(e, w)| d.dot(*e).abs() > 1.0 - 1e-14 && (w - weight).abs() < 1e-14)
        };
        for &(d, weight) in &all {
            assert!((d.length() - 1.0).abs() < 1e-15);
            assert!(has(DVec3::new(d.y, d.z, d.x), weight) && has(DVec3::new(d.y, d.x, d.z), weight));
            assert!(has(DVec3::new(-d.x, d.y, d.z), weight));
        }
        // ⟨x⁴⟩ = 1/5 and ⟨x²y²⟩ = 1/15 over the sphere.
        let fourth: f64 = all.iter().map(|(d, weight)| weight * d.x.powi(4)).sum::<f64>() / total;
        let mixed: f64 = all.iter().map(|(d, weight)| weight * (d.x * d.y).powi(2)).sum::<f64>() / total;
        assert!((fourth - 0.2).abs() < 1e-3 && (mixed - 1.0 / 15.0).abs() < 1e-3, "{fourth} {mixed}");
    }

    #[test]
    fn intercepts_of_an_ellipsoid_are_proportional_to_its_half_axes() {
        let half = DVec3::new(3.0, 2.0, 1.0);
        let turn = turns(3).last().unwrap();
        let errors = [8, 16, 32].map(|frequency| {
            let mut mesh = solids::geodesic(1.0, frequency).unwrap();
            mesh.positions.iter_mut().for_each(|p| *p *= half);
            let found = of(&turned(mesh, turn));
            let [a, b, c] = found.half_axes;
            println!("ellipsoid of frequency {frequency}: {:.5}:{:.5}:1, DA {:.6}", a / c, b / c, found.degree);
            for (direction, axis) in found.directions.into_iter().zip(DVec3::AXES) {
                assert!(direction.dot(turn * axis).abs() > 1.0 - 1e-5, "{found:?}");
            }
            assert!(found.misfit < 1e-2);
            let errors = [a / c - 3.0, b / c - 2.0, found.degree - (1.0 - 1.0 / 9.0)];
            errors.into_iter().fold(0.0, |worst: f64, error| worst.max(error.abs()))
        });
        println!("ellipsoid: order {:.2}", order(errors));
        assert!(errors[2] < 1e-3 && order(errors) > 1.5, "{errors:?}");
    }

    #[test]
    fn plates_are_wholly_anisotropic() {
        let plate = |z: f64| solids::cuboid(DVec3::new(0.0, 0.0, z), DVec3::new(10.0, 10.0, z + 1.0)).unwrap();
        let plates = together(&[plate(2.0), plate(6.0)]);
        let plates = Sampled::on(&grid_of(DVec3::ZERO, DVec3::splat(10.0), 20), plates);
        let facets = plates.facets();
        let surface = SurfaceElements::within(&facets, &plates.images, &plates.whole());
        assert!((surface.area() - 400.0).abs() < 1e-9);
        let crossings = Crossings::of(&surface, 1000.0);
        let found = crossings.ellipsoid().unwrap();
        assert!((found.degree - 1.0).abs() < 1e-12, "{found:?}");
        assert_eq!(found.half_axes[..2], [f64::INFINITY; 2]);
        // Four surfaces in a length of 10.
        assert!((found.half_axes[2] - 2.5).abs() < 1e-12 && found.directions[2].z.abs() > 1.0 - 1e-12);
        assert!(found.misfit < 1e-12);
        assert!((crossings_along(&surface, 1000.0, DVec3::Z) - 0.4).abs() < 1e-12);
        // Half of the surface per volume, as ⟨|cos θ|⟩ = 1/2.
        assert!((crossings.mean() - 0.2).abs() < 5e-4, "{}", crossings.mean());
    }

    #[test]
    fn a_slanted_plate_in_a_ball_is_wholly_anisotropic() {
        let turn = turns(7).last().unwrap();
        let plate = turned(solids::cuboid(DVec3::new(-3.0, -3.0, -0.2), DVec3::new(3.0, 3.0, 0.2)).unwrap(), turn);
        let grid = grid_of(DVec3::splat(-4.5), DVec3::splat(4.5), 64);
        let [plate, ball] = [plate, solids::geodesic(1.0, 12).unwrap()].map(|mesh| Sampled::on(&grid, mesh));
        let (facets, region) = (plate.facets(), Region::of_solid(&ball.images));
        let surface = SurfaceElements::within(&facets, &plate.images, &region);
        let found = Crossings::of(&surface, region.volume()).ellipsoid().unwrap();
        assert!((found.degree - 1.0).abs() < 1e-9, "{found:?}");
        assert!(found.directions[2].dot(turn * DVec3::Z).abs() > 1.0 - 1e-9);
    }

    #[test]
    fn cubic_structures_are_isotropic() {
        // Prisms of eight sides have the symmetries of the cube together, and so have their facets.
        let form = LatticeForm::Overlapping { segments: 8 };
        let (pattern, cells) = (StrutPattern::Cubic, [2; 3]);
        let found = of(&StrutLattice { pattern, form, cells, cell_size: 1.0, radius: 0.15 }.build().unwrap());
        println!("struts of eight sides: DA {:.1e}, misfit {:.3}", found.degree, found.misfit);
        assert!(found.degree.abs() < 1e-12, "{found:?}");
        // Contoured meshes are not quite as symmetric as the shapes they approximate.
        let mut of_struts = [0.0; 3];
        for (degree, resolution) in of_struts.iter_mut().zip([16, 32, 64]) {
            *degree = of_cell(struts(1, resolution)).degree;
        }
        println!("contoured struts of 16, 32, 64 to a cell: DA {of_struts:.5?}, order {:.2}", order(of_struts));
        let surfaces = [Surface::Gyroid, Surface::Primitive, Surface::Diamond];
        let of_surfaces = surfaces.map(|surface| of_cell(network(surface, 1, 32)).degree);
        println!("{surfaces:?}: DA {of_surfaces:.5?}");
        assert!(of_struts[2] < 5e-3 && of_surfaces.iter().all(|&degree| degree < 5e-3));
    }

    /// Returns the anisotropy of a cell of side 1, cut by its box.
    fn of_cell(mesh: TriangleMesh) -> Anisotropy {
        let cell = Sampled::of(mesh, 8);
        let facets = cell.facets();
        Crossings::of(&SurfaceElements::of_facets(&facets, &cell.boxed()).unwrap(), 1.0).ellipsoid().unwrap()
    }

    #[test]
    fn cubes_are_isotropic_at_any_rotation() {
        let along_the_axes = of(&cube(1.0));
        assert!(along_the_axes.degree.abs() < 1e-13, "{along_the_axes:?}");
        let worst = turns(50).map(|turn| of(&turned(cube(1.0), turn)).degree).fold(0.0, f64::max);
        println!("turned cube: DA {worst:.5} at the worst");
        assert!(worst < 4e-3);
    }

    #[test]
    fn empty_surfaces_have_no_ellipsoid() {
        let block = Sampled::of(cube(1.0), 8);
        let facets = block.facets();
        let surface = SurfaceElements::of_facets(&facets, &block.boxed()).unwrap();
        assert!(Crossings::of(&surface, 1.0).ellipsoid().is_none());
        assert!(Crossings::of(&surface, 0.0).ellipsoid().is_none());
    }
}
