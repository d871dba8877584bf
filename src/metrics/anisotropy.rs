//! Mean intercept lengths, their ellipsoid, the degree of anisotropy.
//!
//! A line in direction d crosses the surface P_L(d) times per unit length, and the mean intercept length is its reciprocal,
//! MIL(d) = 1/P_L(d). What is usually counted on a raster of lines is known in closed form on a mesh: a facet of area A and
//! unit normal n shows lines the area A·|n·d|, so that P_L(d) = Σ A_f |n_f·d| / TV, without a line and without noise.
//!
//! Harrigan and Mann (*Journal of Materials Science* 19, 1984) describe MIL by an ellipsoid: 1/MIL² = dᵀ M d, M found by
//! least squares. Its half axes a ≥ b ≥ c are the reciprocal roots of the eigenvalues of M, and the degree of anisotropy is
//! DA = 1 − (c/a)²: 0 where all directions are alike, 1 where lines in some direction never meet the surface, as between
//! parallel plates (a is infinite then).
//!
//! # Directions
//! The fit is over the midpoints of a grid on the faces of a cube, in equal angles ([`DIRECTIONS`] of them on the half
//! sphere), each weighted by its solid angle. That set has all symmetries of the cube, so that a cubic structure that lies
//! along the axes has DA = 0 but for rounding. A spiral of as many directions has none of them: it gives a lattice of struts a
//! DA of some 0.001 that is not there.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::eigen::Principal;
use super::elements::SurfaceElements;

/// Cells along the edge of a face of the cube that directions run through.
const CELLS: usize = 14;

/// Directions on half a sphere.
pub const DIRECTIONS: usize = 3 * CELLS * CELLS;

/// Facets that one task looks at. Part of the result, since it decides the order of additions.
const CHUNK: usize = 1 << 13;

/// Facets that are added to all directions at a time.
const AT_ONCE: usize = 4;

/// An eigenvalue of 1/MIL² below this share of the largest is one of 0 and rounding.
const NONE: f64 = 1e-12;

/// How often lines of every direction cross a surface.
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
    /// Their directions, at right angles and of length 1.
    pub directions: [DVec3; 3],
    /// DA = 1 − (c/a)²: from 0, isotropic, to 1.
    pub degree: f64,
    /// The root of the mean square by which dᵀ M d misses 1/MIL², as a share of the mean of 1/MIL²: how far from an
    /// ellipsoid intercepts are.
    pub misfit: f64,
}

impl Crossings {
    /// Of a surface in a volume TV, in cubic world units.
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

    /// Directions, of length 1 and on one half of the sphere, with P_L in crossings per world unit.
    pub fn by_direction(&self) -> impl Iterator<Item = (DVec3, f64)> {
        directions().map(|(direction, _)| direction).zip(self.per_length.iter().copied())
    }

    /// The mean of P_L over all directions, in crossings per world unit: half the area per volume, but for the sum over
    /// directions.
    pub fn mean(&self) -> f64 {
        let (sum, weights) = directions()
            .zip(&self.per_length)
            .fold((0.0, 0.0), |(sum, weights), ((_, weight), p)| (sum + weight * p, weights + weight));
        sum / weights
    }

    /// The ellipsoid; nothing where there is no surface, or no volume.
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

    /// M of dᵀ M d = P_L², by weighted least squares.
    ///
    /// Sums of weights times products of four components depend on the set of directions alone, and those with an odd power
    /// vanish by its symmetry. So the products' coefficients stand alone, and those of the squares meet in three equations
    /// of the form (u − v) m_i + v (m_x + m_y + m_z) = r_i with u = ⟨x⁴⟩ and v = ⟨x²y²⟩.
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

/// How often a line in `direction`, of length 1, crosses a surface in a volume TV: P_L, per world unit.
pub fn crossings_along(surface: &SurfaceElements, volume: f64, direction: DVec3) -> f64 {
    let normals = &surface.facets().normals;
    super::elements::in_chunks(normals.len(), |f| surface.areas()[f] * normals[f].dot(direction).abs()) / volume
}

/// Directions with their weights, the solid angle of their cell but for a factor.
fn directions() -> impl Iterator<Item = (DVec3, f64)> {
    let slope = |cell: usize| (std::f64::consts::FRAC_PI_2 * ((cell as f64 + 0.5) / CELLS as f64 - 0.5)).tan();
    (0..DIRECTIONS).map(move |i| {
        let (face, s, t) = (i / (CELLS * CELLS), slope(i / CELLS % CELLS), slope(i % CELLS));
        let d = DVec3::from_array(std::array::from_fn(|axis| [1.0, s, t][(axis + 3 - face) % 3]));
        let weight = (1.0 + s * s) * (1.0 + t * t) / d.length().powi(3);
        (d.normalize(), weight)
    })
}
