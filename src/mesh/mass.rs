//! Volume, area, centroid and inertia of the solid that a mesh bounds, from sums over its triangles.
//!
//! Each triangle spans a tetrahedron with the centre of the box. With corners a, b, c, s = a + b + c and d = a · (b ×
//! c) its volume is d / 6, its first moments are d s / 24, its second moments d (a aᵀ + b bᵀ + c cᵀ + s sᵀ) / 120
//! (Tonon, "Explicit exact formulas for the 3-D tetrahedron inertia tensor in terms of its vertex coordinates", 2004).
//! The sums are those of the solid where its winding numbers are 0 and 1; see [`super::prove_simple`].

use glam::{DMat3, DVec3};

use super::measure::Frame;
use super::{Aabb, TriangleMesh};

/// Number of sums that give the mass properties.
pub(crate) const TERMS: usize = 12;

/// The mass properties of a solid of unit density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// The volume, negative where the triangles face inwards, in cubic units of the mesh.
    pub volume: f64,
    /// A bound on the error of the volume from rounding in f64.
    pub volume_rounding: f64,
    /// The area of all triangles, in square units.
    pub area: f64,
    /// The centre of mass; NaN where the volume is zero.
    pub centroid: DVec3,
    /// The inertia tensor about the centroid, in units to the fifth, negative where the volume is; NaN where that is zero.
    pub inertia: DMat3,
}

impl MassProperties {
    /// Sums over all triangles whose indices are in range. The result does not depend on the number of threads.
    pub(super) fn of(mesh: &TriangleMesh, bounds: Aabb) -> MassProperties {
        let frame = Frame::of(Some(bounds));
        let sums = mesh.sums(|corners| terms(corners.map(|corner| frame.local(corner))));
        MassProperties::from_sums(sums, &frame)
    }

    /// Returns the properties from sums of [`terms`] in a frame.
    pub(crate) fn from_sums(sums: [f64; TERMS], frame: &Frame) -> MassProperties {
        let [six, x, y, z, xx, yy, zz, xy, yz, zx, twice_area, products] = sums;
        let unit = frame.unit();
        let cubed = unit * unit * unit;
        let volume = six / 6.0 * cubed;
        // d is the sum of three products of a coordinate and a difference of two products of sides: at most seven roundings, each of a
        // share ε / 2 of the products' sizes. Corners that move by ε / 2 of their coordinates change the volume by no more than the
        // prisms that their triangles sweep along the axes, ε / 4 of these sizes. Together less than ε.
        let volume_rounding = f64::EPSILON * products * cubed;
        let local = DVec3::new(x, y, z) / (4.0 * six);
        let second = |sum: f64, i: usize, j: usize| sum / (20.0 * six) - local[i] * local[j];
        let (cxx, cyy, czz) = (second(xx, 0, 0), second(yy, 1, 1), second(zz, 2, 2));
        let (cxy, cyz, czx) = (second(xy, 0, 1), second(yz, 1, 2), second(zx, 2, 0));
        let covariance =
            DMat3::from_cols(DVec3::new(cxx, cxy, czx), DVec3::new(cxy, cyy, cyz), DVec3::new(czx, cyz, czz));
        let inertia = DMat3::from_diagonal(DVec3::splat(cxx + cyy + czz)) - covariance;
        let (centroid, inertia) = match six == 0.0 {
            true => (DVec3::NAN, DMat3::NAN),
            false => (frame.world(local), volume * unit * unit * inertia),
        };
        MassProperties { volume, volume_rounding, area: twice_area / 2.0 * unit * unit, centroid, inertia }
    }
}

/// Returns the contributions of one triangle: to six times the volume, 24 times the first and 120 times the second
/// moments (xx, yy, zz, xy, yz, zx), twice the area, and the sizes of the products in d, which bound its rounding error: along each
/// axis the greatest coordinate, times the products of the other components of two sides.
#[inline]
pub(crate) fn terms([a, b, c]: [DVec3; 3]) -> [f64; TERMS] {
    let (u, v) = (b - a, c - a);
    let normal = u.cross(v);
    let d = a.dot(normal);
    let s = a + b + c;
    let second = |i: usize, j: usize| d * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + s[i] * s[j]);
    [
        d,
        d * s.x,
        d * s.y,
        d * s.z,
        second(0, 0),
        second(1, 1),
        second(2, 2),
        second(0, 1),
        second(1, 2),
        second(2, 0),
        normal.length(),
        a.abs().max(b.abs()).max(c.abs()).dot(products(u.abs(), v.abs())),
    ]
}

/// Returns the sum of the two products that each component of a cross product is the difference of.
fn products(u: DVec3, v: DVec3) -> DVec3 {
    DVec3::new(u.y * v.z + u.z * v.y, u.z * v.x + u.x * v.z, u.x * v.y + u.y * v.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::ClosedMesh;
    use crate::solids;
    use crate::testing::meshes::{cube, reversed, together};

    fn of(mesh: TriangleMesh) -> MassProperties {
        ClosedMesh::check(mesh).unwrap().mass_properties()
    }

    #[test]
    fn plates_have_closed_form_mass_properties_at_any_place() {
        for corner in [DVec3::ZERO, DVec3::new(-7.0, 1e3, 50.0)] {
            let size = DVec3::new(100.0, 1.125, 64.0);
            let found = of(solids::cuboid(corner, corner + size).unwrap());
            let volume = size.x * size.y * size.z;
            assert!((found.volume - volume).abs() <= found.volume_rounding, "{found:?}");
            assert!(found.volume_rounding < 1e-12 * volume, "{found:?}");
            assert!((found.centroid - corner - 0.5 * size).length() < 1e-12 * corner.length().max(100.0), "{found:?}");
            let squares = size * size;
            let exact = DVec3::new(squares.y + squares.z, squares.x + squares.z, squares.x + squares.y) * volume / 12.0;
            let difference = found.inertia - DMat3::from_diagonal(exact);
            assert!(difference.to_cols_array().iter().all(|d| d.abs() < 1e-11 * exact.max_element()), "{difference}");
            assert!((found.area - 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x)).abs() < 1e-9);
        }
    }

    #[test]
    fn volumes_of_needles_keep_their_digits() {
        let found = of(solids::cuboid(DVec3::new(3e6, -1.0, 7.0), DVec3::new(2.3e7, 0.5, 8.0)).unwrap());
        let volume = 2e7 * 1.5;
        assert!((found.volume - volume).abs() <= found.volume_rounding && found.volume_rounding < 1e-12 * volume);
    }

    #[test]
    fn products_of_inertia_have_the_sign_of_the_tensor() {
        // A prism over the right triangle (0,0), (1,0), (0,1): I_xy about the centroid is −∫(x − x̄)(y − ȳ) = 1/72 of h.
        let mut prism = solids::cuboid(DVec3::ZERO, DVec3::ONE).unwrap();
        for p in &mut prism.positions {
            if p.x == 1.0 && p.y == 1.0 {
                (p.x, p.y) = (0.5, 0.5);
            }
        }
        let found = of(prism);
        assert!((found.volume - 0.5).abs() < 1e-15);
        assert!((found.inertia.col(0)[1] - 1.0 / 72.0).abs() < 1e-15, "{}", found.inertia);
        assert!(found.inertia.col(0)[2].abs() < 1e-15);
    }

    #[test]
    fn mass_properties_of_a_hollow_cube_are_the_cubes_less_its_hollows() {
        let mesh = together(&[cube(DVec3::ZERO, 4.0), reversed(&cube(DVec3::ONE, 2.0))]);
        let found = of(mesh.clone());
        assert_eq!((found.volume, found.area), (56.0, 120.0));
        let inertia = (64.0 * 32.0 - 8.0 * 8.0) / 12.0;
        assert!(
            (found.inertia - DMat3::from_diagonal(DVec3::splat(inertia)))
                .to_cols_array()
                .iter()
                .all(|d| d.abs() < 1e-12)
        );
        assert_eq!(of(reversed(&mesh)).volume, -56.0);
    }
}
