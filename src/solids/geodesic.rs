//! Geodesic spheres of class I: an icosahedron whose faces are subdivided into small triangles and projected onto the
//! sphere.
//!
//! A frequency ν gives 20 ν² triangles over 10 ν² + 2 vertices.

use glam::DVec3;

use super::{SolidError, check_length, check_range, check_triangles};
use crate::cancel::checkpoint;
use crate::mesh::TriangleMesh;

/// Faces of the icosahedron, counter-clockwise from outside, over the vertices of [`icosahedron`].
const FACES: [[u32; 3]; 20] = [
    [0, 11, 5],
    [0, 5, 1],
    [0, 1, 7],
    [0, 7, 10],
    [0, 10, 11],
    [1, 5, 9],
    [5, 11, 4],
    [11, 10, 2],
    [10, 7, 6],
    [7, 1, 8],
    [3, 9, 4],
    [3, 4, 2],
    [3, 2, 6],
    [3, 6, 8],
    [3, 8, 9],
    [4, 9, 5],
    [2, 4, 11],
    [6, 2, 10],
    [8, 6, 7],
    [9, 8, 1],
];

/// Returns a geodesic sphere of class I about the origin, each edge of its icosahedron divided into `frequency` parts;
/// `20 frequency²` triangles.
///
/// # Errors
/// Fails for a radius that is not a length, or a frequency of zero or with too many triangles.
pub fn geodesic(radius: f64, frequency: u32) -> Result<TriangleMesh, SolidError> {
    check_length("radius", radius)?;
    check_range("frequency", frequency.into(), 1.0, 1e6)?;
    check_triangles("frequency", frequency, 20 * u64::from(frequency).pow(2))?;
    let corners = icosahedron();
    let steps = f64::from(frequency);
    let on_sphere = |flat: DVec3| radius * flat.normalize();
    let mut positions: Vec<DVec3> = corners.iter().map(|&p| on_sphere(p)).collect();

    // Vertices along an edge are created once, in the direction from its lesser corner, so that both faces share them.
    let per_edge = frequency - 1;
    let mut edge_first = [[0_u32; 12]; 12];
    for [a, b] in FACES.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).filter(|[a, b]| a < b) {
        edge_first[a as usize][b as usize] = positions.len() as u32;
        positions.extend(
            (1..frequency).map(|i| on_sphere(corners[a as usize].lerp(corners[b as usize], f64::from(i) / steps))),
        );
    }
    let on_edge = |a: u32, b: u32, i: u32| match i {
        0 => a,
        i if i == frequency => b,
        i if a < b => edge_first[a as usize][b as usize] + i - 1,
        i => edge_first[b as usize][a as usize] + per_edge - i,
    };

    let mut triangles = Vec::with_capacity(20 * frequency as usize * frequency as usize);
    for [a, b, c] in FACES {
        // Row i lies i steps from a towards c and runs parallel to ab; its place j lies j steps from the side ac.
        let face_first = positions.len() as u32;
        let [pa, pb, pc] = [a, b, c].map(|v| corners[v as usize]);
        for i in 1..frequency {
            checkpoint();
            for j in 1..frequency - i {
                let (s, t) = (f64::from(j) / steps, f64::from(i) / steps);
                positions.push(on_sphere((1.0 - s - t) * pa + s * pb + t * pc));
            }
        }
        let at = |i: u32, j: u32| {
            if i == 0 {
                on_edge(a, b, j)
            } else if j == 0 {
                on_edge(a, c, i)
            } else if i + j == frequency {
                on_edge(b, c, i)
            } else {
                // Row k holds frequency − k − 1 inner vertices.
                let before = (i - 1) * per_edge - i * (i - 1) / 2;
                face_first + before + j - 1
            }
        };
        for i in 0..frequency {
            for j in 0..frequency - i {
                triangles.push([at(i, j), at(i, j + 1), at(i + 1, j)]);
                if i + j + 1 < frequency {
                    triangles.push([at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
                }
            }
        }
    }
    Ok(TriangleMesh { positions, triangles })
}

/// Returns the vertices of an icosahedron: the corners of three golden rectangles.
fn icosahedron() -> [DVec3; 12] {
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    [
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ]
    .map(DVec3::from_array)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::closure::{assert_solid, euler_characteristic, least_angles, volume};

    #[test]
    fn spheres_of_any_frequency_are_solids() {
        for frequency in [1, 2, 3, 4, 7, 20] {
            let mesh = geodesic(1.5, frequency).unwrap();
            assert_solid(&mesh);
            assert_eq!(mesh.triangles.len() as u32, 20 * frequency * frequency);
            assert_eq!(euler_characteristic(&mesh), 2);
            assert!(mesh.positions.iter().all(|p| (p.length() - 1.5).abs() < 1e-14));
        }
    }

    #[test]
    fn volume_converges_and_triangles_are_even() {
        let mesh = geodesic(1.0, 32).unwrap();
        let exact = 4.0 / 3.0 * std::f64::consts::PI;
        assert!((volume(&mesh) / exact - 1.0).abs() < 2e-3);
        assert!(least_angles(&mesh)[0] > 45.0);
    }

    #[test]
    fn wrong_parameters_are_refused() {
        assert!(geodesic(0.0, 4).is_err());
        assert!(geodesic(1.0, 0).is_err());
        let error = geodesic(1.0, 2000).unwrap_err();
        assert_eq!(error.to_string(), "frequency = 2000 gives 80000000 triangles, but at most 50000000 are allowed");
    }
}
