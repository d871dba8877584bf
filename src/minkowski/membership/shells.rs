//! Shells: vertex-connected sets of triangles.

use crate::minkowski::Polyhedron;

/// Returns a vertex of each shell of a surface.
pub fn vertex_of_each_shell(surface: &Polyhedron) -> Vec<[i32; 3]> {
    let mut parents: Vec<u32> = (0..surface.positions().len() as u32).collect();
    for &[a, b, c] in surface.triangles() {
        join(&mut parents, a, b);
        join(&mut parents, a, c);
    }
    // The root of a shell is its lowest vertex; a vertex without triangles bounds nothing.
    let mut is_listed = vec![false; parents.len()];
    let mut vertices = Vec::new();
    for &[a, ..] in surface.triangles() {
        let root = root(&mut parents, a) as usize;
        if !is_listed[root] {
            is_listed[root] = true;
            vertices.push(surface.positions()[root]);
        }
    }
    vertices
}

fn join(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parents, a), root(parents, b));
    parents[a.max(b) as usize] = a.min(b);
}

fn root(parents: &mut [u32], mut vertex: u32) -> u32 {
    while parents[vertex as usize] != vertex {
        let above = parents[parents[vertex as usize] as usize];
        parents[vertex as usize] = above;
        vertex = above;
    }
    vertex
}
