//! The vertex-connected parts of a mesh.
//!
//! Where two surfaces graze each other the solid ends in a knife edge. Thinner than the pitch, it contains only scattered
//! nodes, and its mesh falls into crumbs that are of no use in a print.

use crate::parallel::*;
use glam::DVec3;

use crate::mesh::TriangleMesh;
use crate::union_find::UnionFind;

/// Returns for each vertex the lowest vertex of its part; for a vertex without triangles the vertex itself. Triangles with an
/// index out of range or with one twice connect nothing.
///
/// The result does not depend on threads.
pub fn part_of_vertices(mesh: &TriangleMesh) -> Vec<u32> {
    let vertices = mesh.positions.len();
    let union_find = UnionFind::new(vertices as u32);
    let connects =
        |&&[a, b, c]: &&[u32; 3]| a != b && b != c && c != a && [a, b, c].iter().all(|&v| (v as usize) < vertices);
    mesh.triangles.par_iter().filter(connects).for_each(|&[a, b, c]| {
        union_find.join(a, b);
        union_find.join(a, c);
    });
    union_find.roots()
}

/// The parts of a closed mesh.
#[derive(Clone, Debug)]
pub struct Parts {
    of_vertex: Vec<u32>,
    /// By the lowest vertex of a part; `None` for vertices that are not the lowest or have no triangle.
    volumes: Vec<Option<f64>>,
}

/// The parts removed from a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dropped {
    /// The number of parts.
    pub parts: usize,
    /// The sum of their volumes, in cubic world units; cavities count negative.
    pub volume: f64,
}

impl Parts {
    /// Finds the parts of a mesh whose indices are in range.
    ///
    /// # Panics
    /// If an index is out of range.
    pub fn of(mesh: &TriangleMesh) -> Parts {
        let of_vertex = part_of_vertices(mesh);
        // Volumes are sums of tetrahedra from a point; a point on the mesh keeps the terms small.
        let base = mesh.positions.first().copied().unwrap_or(DVec3::ZERO);
        let mut volumes: Vec<Option<f64>> = vec![None; of_vertex.len()];
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize] - base);
            *volumes[of_vertex[triangle[0] as usize] as usize].get_or_insert(0.0) += a.dot(b.cross(c)) / 6.0;
        }
        Parts { of_vertex, volumes }
    }

    /// Returns the number of parts.
    pub fn count(&self) -> usize {
        self.volumes().count()
    }

    fn volumes(&self) -> impl Iterator<Item = f64> + '_ {
        self.volumes.iter().flatten().copied()
    }

    /// Returns the volume of the largest part, as a share of the sum of the positive volumes.
    pub fn largest_share(&self) -> f64 {
        // Cavities are not solids and subtract nothing from the whole here.
        let all: f64 = self.volumes().filter(|&volume| volume > 0.0).sum();
        if all > 0.0 { self.volumes().fold(0.0, f64::max) / all } else { 0.0 }
    }

    /// Returns whether a part or a cavity has a volume below a limit.
    pub fn has_crumbs(&self, limit: f64) -> bool {
        self.volumes().any(|volume| volume.abs() < limit)
    }

    /// Returns the mesh without parts whose volume is below a share of the total; cavities that small are filled.
    pub fn without_small(&self, mesh: TriangleMesh, share: f64) -> (TriangleMesh, Dropped) {
        let least = share * self.volumes().sum::<f64>();
        let is_small = |volume: &f64| volume.abs() < least;
        let small: Vec<f64> = self.volumes().filter(is_small).collect();
        let dropped = Dropped { parts: small.len(), volume: small.iter().fold(0.0, |sum, volume| sum + volume) };
        if dropped.parts == 0 {
            return (mesh, dropped);
        }
        let stays = |triangle: &[u32; 3]| {
            let volume = self.volumes[self.of_vertex[triangle[0] as usize] as usize];
            volume.is_some_and(|volume| !is_small(&volume))
        };
        let (mesh, _) = mesh.of_triangles(mesh.triangles.iter().copied().filter(stays).collect());
        (mesh, dropped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::meshes::{cube, reversed, together};

    #[test]
    fn small_parts_and_small_cavities_are_dropped() {
        let big = cube(DVec3::ZERO, 4.0);
        let cavities = [reversed(&cube(DVec3::ONE, 1.0)), reversed(&cube(DVec3::splat(3.0), 0.1))];
        let crumb = cube(DVec3::splat(9.0), 0.2);
        let mesh = together(&[big.clone(), cavities[0].clone(), cavities[1].clone(), crumb]);
        let parts = Parts::of(&mesh);
        assert_eq!(parts.count(), 4);
        assert!((parts.largest_share() - 64.0 / (64.0 + 0.008)).abs() < 1e-12);
        let (kept, dropped) = parts.without_small(mesh.clone(), 1e-3);
        assert_eq!((dropped.parts, kept), (2, together(&[big, cavities[0].clone()])));
        assert!((dropped.volume - 0.007).abs() < 1e-12);
        assert_eq!(parts.without_small(mesh.clone(), 0.0), (mesh, Dropped::default()));
    }

    #[test]
    fn empty_meshes_have_no_parts() {
        let parts = Parts::of(&TriangleMesh::default());
        assert_eq!((parts.count(), parts.largest_share()), (0, 0.0));
    }

    #[test]
    fn invalid_triangles_connect_no_parts() {
        let mut mesh = together(&[cube(DVec3::ZERO, 1.0), cube(DVec3::splat(3.0), 1.0)]);
        let parts = part_of_vertices(&mesh);
        mesh.triangles.extend([[0, 0, 8], [0, 8, 99]]);
        assert_eq!(part_of_vertices(&mesh), parts);
        assert_ne!(parts[0], parts[8]);
    }
}
