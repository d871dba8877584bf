//! A net of interlocked rings that do not touch: chains in two directions that share their rings.

use glam::DVec3;

use super::{SolidError, check_range, check_triangles, torus};
use crate::cancel::checkpoint;
use crate::mesh::TriangleMesh;

/// The gap between neighbouring rings, in radii of their section.
const GAP: f64 = 0.5;

/// Returns chain mail in the plane of x and y, centred on the origin: `columns` by `rows` rings flat in the plane, each
/// joined to its neighbours by an upright ring that passes through both, with a gap of half the `minor` radius. All are
/// rings of a [`torus`], each of `2 around across` triangles. A row is a [`chain`](super::chain()) of `2 columns − 1`
/// rings.
///
/// # Errors
/// Fails for everything that [`torus`] refuses; a `minor` radius of more than 0.234 of the `major` one, at which
/// upright rings would meet inside a flat one; no ring or too many triangles.
pub fn chain_mail(
    columns: u32,
    rows: u32,
    major: f64,
    minor: f64,
    around: u32,
    across: u32,
) -> Result<TriangleMesh, SolidError> {
    check_range("columns", columns.into(), 1.0, 1e5)?;
    check_range("rows", rows.into(), 1.0, 1e5)?;
    let rings = 3 * u64::from(columns) * u64::from(rows) - u64::from(columns) - u64::from(rows);
    let per_ring = 2 * u64::from(around).saturating_mul(across.into()).min(u64::MAX / 2);
    check_triangles("columns", columns, per_ring.saturating_mul(rings))?;
    let ring = torus(major, minor, around, across)?;
    // Inside a flat ring the middle lines of two upright ones come to √2 (major − (2 + GAP) minor) of each other.
    let most = major / (2.0 + GAP + (2.0 + GAP) / std::f64::consts::SQRT_2);
    check_range("minor", minor, 0.0, most)?;
    let pitch = 2.0 * major - (2.0 + GAP) * minor;
    let mut mesh = TriangleMesh {
        positions: Vec::with_capacity(rings as usize * ring.positions.len()),
        triangles: Vec::with_capacity(rings as usize * ring.triangles.len()),
    };
    for row in 0..2 * rows - 1 {
        for column in 0..2 * columns - 1 {
            checkpoint();
            let turned: fn(DVec3) -> DVec3 = match (column % 2, row % 2) {
                (0, 0) => |p| p,
                // Quarter turns about x and y, which keep triangles facing outwards.
                (1, 0) => |p| DVec3::new(p.x, -p.z, p.y),
                (0, 1) => |p| DVec3::new(p.z, p.y, -p.x),
                _ => continue,
            };
            let first = mesh.positions.len() as u32;
            let place = |i: u32, n: u32| pitch * (f64::from(i) - f64::from(n - 1));
            let centre = DVec3::new(place(column, columns), place(row, rows), 0.0);
            mesh.positions.extend(ring.positions.iter().map(|&p| centre + turned(p)));
            mesh.triangles.extend(ring.triangles.iter().map(|t| t.map(|v| first + v)));
        }
    }
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::chain;
    use crate::solids::closure::{assert_solid, components, euler_characteristic, volume};

    #[test]
    fn rings_are_tori_that_keep_their_gap() {
        let (major, minor) = (8.55, 2.0);
        let mesh = chain_mail(3, 2, major, minor, 40, 20).unwrap();
        assert_solid(&mesh);
        assert_eq!(components(&mesh), 13);
        assert_eq!(euler_characteristic(&mesh), 0);
        let one = torus(major, minor, 40, 20).unwrap();
        assert!((volume(&mesh) / (13.0 * volume(&one)) - 1.0).abs() < 1e-12);
        let rings: Vec<&[DVec3]> = mesh.positions.chunks(40 * 20).collect();
        for (i, a) in rings.iter().enumerate() {
            for b in &rings[..i] {
                let gap = a.iter().flat_map(|p| b.iter().map(move |q| p.distance(*q))).fold(f64::MAX, f64::min);
                assert!(gap > 0.99 * GAP * minor, "{gap}");
            }
        }
    }

    #[test]
    fn a_row_is_a_chain() {
        assert_eq!(chain_mail(3, 1, 5.0, 1.0, 16, 8), chain(5, 5.0, 1.0, 16, 8));
    }

    #[test]
    fn wrong_parameters_are_refused() {
        assert!(chain_mail(0, 1, 5.0, 1.0, 8, 8).is_err());
        let error = chain_mail(2, 2, 5.0, 1.2, 8, 8).unwrap_err().to_string();
        assert!(error.starts_with("minor is 1.2, but must be from 0 to 1.17"), "{error}");
        let error = chain_mail(1000, 1000, 5.0, 1.0, 8, 8).unwrap_err();
        assert_eq!(error.to_string(), "columns = 1000 gives 383744000 triangles, but at most 50000000 are allowed");
    }
}
