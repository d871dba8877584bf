//! Axis-aligned solids with a notch or a hollow: the simplest ones that are not convex.

use glam::DVec3;

use super::{SolidError, check_length, check_range, cuboid};
use crate::mesh::TriangleMesh;

/// Returns an L along z: a box centred on the origin without its edge of greatest x and y, whose breadth and depth are
/// `notch`; 20 triangles, one reflex edge. Its volume is (x y − notch x · notch y) z.
///
/// # Errors
/// Fails for a side or notch that is not a length, or a notch that is not below the sides.
pub fn ell(size: DVec3, notch: [f64; 2]) -> Result<TriangleMesh, SolidError> {
    size.to_array().into_iter().try_for_each(|side| check_length("size", side))?;
    notch.into_iter().try_for_each(|side| check_length("notch", side))?;
    below("notch", notch[0], size.x)?;
    below("notch", notch[1], size.y)?;
    let far = size / 2.0;
    let (x, y) = (far.x - notch[0], far.y - notch[1]);
    let outline = [[-far.x, -far.y], [far.x, -far.y], [far.x, y], [x, y], [x, far.y], [-far.x, far.y]];
    let at_height = |z: f64| outline.map(|[x, y]| DVec3::new(x, y, z));
    let mut triangles = Vec::with_capacity(20);
    for i in 0..6 {
        let j = (i + 1) % 6;
        triangles.extend([[i, j, 6 + j], [i, 6 + j, 6 + i]]);
    }
    // The reflex corner sees the whole outline.
    for [a, b] in [[4, 5], [5, 0], [0, 1], [1, 2]] {
        triangles.extend([[9, 6 + a, 6 + b], [3, b, a]]);
    }
    Ok(TriangleMesh { positions: [at_height(-far.z), at_height(far.z)].concat(), triangles })
}

/// Returns a box with a box-shaped hollow, both centred on the origin: two shells, 24 triangles.
///
/// # Errors
/// Fails for a side that is not a length, or a hollow that is not below the box along an axis.
pub fn hollow_box(size: DVec3, hollow: DVec3) -> Result<TriangleMesh, SolidError> {
    for axis in 0..3 {
        check_length("size", size[axis])?;
        check_length("hollow", hollow[axis])?;
        below("hollow", hollow[axis], size[axis])?;
    }
    let mut mesh = cuboid(-size / 2.0, size / 2.0)?;
    let inner = cuboid(-hollow / 2.0, hollow / 2.0)?;
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(inner.positions);
    mesh.triangles.extend(inner.triangles.iter().map(|&[a, b, c]| [first + a, first + c, first + b]));
    Ok(mesh)
}

/// Checks that a notch or hollow leaves some of the box along one side.
fn below(parameter: &'static str, value: f64, side: f64) -> Result<(), SolidError> {
    check_range(parameter, value, 0.0, side * (1.0 - 1e-9)).map_err(|_| SolidError::OutOfRange {
        parameter,
        value,
        allowed: format!("below the side {side} of the box"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::closure::{assert_solid, components, euler_characteristic, volume};

    #[test]
    fn ell_has_the_volume_of_its_outline() {
        for (size, notch, exact) in
            [(DVec3::ONE, [0.5, 0.5], 0.75), (DVec3::new(4.0, 3.0, 2.0), [1.0, 2.5], (12.0 - 2.5) * 2.0)]
        {
            let mesh = ell(size, notch).unwrap();
            assert_solid(&mesh);
            assert_eq!((mesh.triangles.len(), euler_characteristic(&mesh)), (20, 2));
            assert_eq!(volume(&mesh), exact);
            let greatest = mesh.positions.iter().fold(DVec3::MIN, |most, &p| most.max(p));
            assert_eq!(greatest, size / 2.0);
            assert!(
                !mesh.positions.iter().any(|p| p.truncate() == greatest.truncate()),
                "the notch is at greatest x, y"
            );
        }
    }

    #[test]
    fn hollow_box_has_the_volume_of_the_box_less_its_hollow() {
        let mesh = hollow_box(DVec3::new(4.0, 3.0, 2.0), DVec3::new(1.0, 2.0, 1.5)).unwrap();
        assert_solid(&mesh);
        assert_eq!((components(&mesh), euler_characteristic(&mesh)), (2, 4));
        assert_eq!(volume(&mesh), 24.0 - 3.0);
    }

    #[test]
    fn wrong_parameters_are_refused() {
        let text = |result: Result<TriangleMesh, SolidError>| result.unwrap_err().to_string();
        assert_eq!(text(ell(DVec3::ONE, [0.5, 1.0])), "notch is 1, but must be below the side 1 of the box");
        assert!(text(ell(DVec3::ONE, [0.0, 0.5])).starts_with("notch is 0, but must be from"));
        assert!(text(ell(DVec3::new(1.0, -1.0, 1.0), [0.5; 2])).starts_with("size is -1, but must be from"));
        assert_eq!(
            text(hollow_box(DVec3::ONE, DVec3::new(0.5, 2.0, 0.5))),
            "hollow is 2, but must be below the side 1 of the box"
        );
    }
}
