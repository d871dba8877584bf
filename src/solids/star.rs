//! A star: a geodesic sphere with a spike on every face. It has few triangles, and hardly any convex edges but those of
//! spikes.

use glam::DVec3;

use super::{SolidError, check_length, check_triangles, geodesic};
use crate::mesh::TriangleMesh;

/// Returns a geodesic sphere of radius `valley` about the origin, each of whose faces carries a spike with its tip at
/// `radius`; `60 frequency²` triangles. Every ray from the origin meets its surface once, so that it has no
/// self-intersection.
///
/// # Errors
/// Fails for a radius that is not a length, a `valley` not below `radius`, and a frequency of zero or with too many
/// triangles.
pub fn star(radius: f64, valley: f64, frequency: u32) -> Result<TriangleMesh, SolidError> {
    check_length("radius", radius)?;
    check_length("valley", valley)?;
    if valley >= radius {
        let allowed = format!("below the radius {radius} of the tips");
        return Err(SolidError::OutOfRange { parameter: "valley", value: valley, allowed });
    }
    check_triangles("frequency", frequency, 60 * u64::from(frequency).pow(2))?;
    let TriangleMesh { mut positions, triangles } = geodesic(valley, frequency)?;
    let mut spikes = Vec::with_capacity(3 * triangles.len());
    for [a, b, c] in triangles {
        let middle: DVec3 = [a, b, c].into_iter().map(|v| positions[v as usize]).sum();
        let tip = positions.len() as u32;
        positions.push(radius * middle.normalize());
        spikes.extend([[a, b, tip], [b, c, tip], [c, a, tip]]);
    }
    Ok(TriangleMesh { positions, triangles: spikes })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::closure::{assert_solid, euler_characteristic, volume};

    #[test]
    fn star_has_genus_zero_and_one_tip_per_face() {
        for frequency in [1, 2, 5] {
            let mesh = star(10.0, 4.0, frequency).unwrap();
            assert_solid(&mesh);
            assert_eq!((mesh.triangles.len() as u32, euler_characteristic(&mesh)), (60 * frequency.pow(2), 2));
            let tips = mesh.positions.iter().filter(|p| (p.length() - 10.0).abs() < 1e-9).count();
            assert_eq!(tips as u32, 20 * frequency.pow(2));
        }
    }

    #[test]
    fn spikes_stand_on_the_icosahedron() {
        // Twenty cones over the faces from the tips and from the origin: a third of face area × radius.
        let side = 4.0 / (std::f64::consts::TAU / 5.0).sin();
        let face = 3.0_f64.sqrt() / 4.0 * side * side;
        let exact = 20.0 * face * 10.0 / 3.0;
        assert!((volume(&star(10.0, 4.0, 1).unwrap()) / exact - 1.0).abs() < 1e-12);
    }

    #[test]
    fn wrong_parameters_are_refused() {
        let text = |result: Result<TriangleMesh, SolidError>| result.unwrap_err().to_string();
        assert_eq!(text(star(4.0, 4.0, 1)), "valley is 4, but must be below the radius 4 of the tips");
        assert!(text(star(4.0, 2.0, 0)).starts_with("frequency is 0, but must be from 1"));
        assert!(text(star(4.0, 2.0, 1000)).contains("gives 60000000 triangles"));
    }
}
