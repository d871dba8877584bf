//! Small meshes with known properties, and rearrangements of meshes.

use glam::DVec3;
use ldi_ops::mesh::TriangleMesh;

/// Returns a cube with shared positions, facing outwards. Position i has bit 0 of i for x, bit 1 for y, bit 2 for z.
pub fn cube(corner: DVec3, side: f64) -> TriangleMesh {
    let positions = (0..8)
        .map(|i| corner + DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1)) * side)
        .collect();
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriangleMesh { positions, triangles }
}

/// Returns the cube from 0 to 1.
pub fn unit_cube() -> TriangleMesh {
    cube(DVec3::ZERO, 1.0)
}

/// Returns the tetrahedron at the origin with edges along the axes, facing outwards.
pub fn tetrahedron() -> TriangleMesh {
    TriangleMesh {
        positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    }
}

/// Returns the same triangles with three positions each, shared by none, as an STL file holds them.
pub fn unwelded(mesh: &TriangleMesh) -> TriangleMesh {
    let positions: Vec<DVec3> = mesh.triangles.iter().flatten().map(|&i| mesh.positions[i as usize]).collect();
    let triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    TriangleMesh { positions, triangles }
}

/// Returns all meshes as one, without welding.
pub fn together(meshes: &[TriangleMesh]) -> TriangleMesh {
    let mut all = TriangleMesh::default();
    for mesh in meshes {
        let base = all.positions.len() as u32;
        all.positions.extend_from_slice(&mesh.positions);
        all.triangles.extend(mesh.triangles.iter().map(|triangle| triangle.map(|index| index + base)));
    }
    all
}

/// Returns the same surface facing the other way.
pub fn reversed(mesh: &TriangleMesh) -> TriangleMesh {
    let triangles = mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    TriangleMesh { positions: mesh.positions.clone(), triangles }
}

/// Returns a solid with a hollow, whose mesh is that of another solid.
pub fn hollowed(outer: TriangleMesh, inner: &TriangleMesh) -> TriangleMesh {
    together(&[outer, reversed(inner)])
}
