//! Checks that every solid of this folder must pass, computed from the triangles alone.

use std::collections::HashMap;

use crate::mesh::TriangleMesh;

/// Returns the signed volume, as a divergence sum over all triangles.
pub(super) fn volume(mesh: &TriangleMesh) -> f64 {
    let at = |v: u32| mesh.positions[v as usize];
    mesh.triangles.iter().map(|&[a, b, c]| at(a).dot(at(b).cross(at(c)))).sum::<f64>() / 6.0
}

/// Returns vertices − edges + triangles of a closed mesh.
pub(super) fn euler_characteristic(mesh: &TriangleMesh) -> i64 {
    mesh.positions.len() as i64 - mesh.triangles.len() as i64 / 2
}

/// Returns the number of shells: sets of triangles connected by vertices.
pub(super) fn components(mesh: &TriangleMesh) -> usize {
    let mut parent: Vec<usize> = (0..mesh.positions.len()).collect();
    fn root(parent: &mut [usize], mut v: usize) -> usize {
        while parent[v] != v {
            parent[v] = parent[parent[v]];
            v = parent[v];
        }
        v
    }
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| root(&mut parent, v as usize));
        parent[b] = a;
        let c = root(&mut parent, c);
        parent[c] = root(&mut parent, a);
    }
    (0..parent.len()).filter(|&v| parent[v] == v).count()
}

/// Asserts that every directed edge and its opposite occur once each, the triangles round each vertex form one fan,
/// every vertex is used, the corners of a triangle are distinct, and the volume is positive.
pub(super) fn assert_solid(mesh: &TriangleMesh) {
    let mut next = HashMap::with_capacity(3 * mesh.triangles.len());
    let mut valence = vec![0_usize; mesh.positions.len()];
    for (i, &[a, b, c]) in mesh.triangles.iter().enumerate() {
        for (from, to, then) in [(a, b, c), (b, c, a), (c, a, b)] {
            assert_ne!(mesh.positions[from as usize], mesh.positions[to as usize], "degenerate triangle {i}");
            assert!(next.insert((from, to), then).is_none(), "directed edge {from} → {to} twice, in triangle {i}");
            valence[from as usize] += 1;
        }
    }
    let mut fans = HashMap::new();
    for (&(from, to), &then) in &next {
        assert!(next.contains_key(&(to, from)), "edge {from} → {to} has no opposite");
        fans.insert(from, (to, then));
    }
    for (v, &count) in valence.iter().enumerate() {
        let v = v as u32;
        let (start, mut spoke) = fans.get(&v).copied().unwrap_or_else(|| panic!("vertex {v} is unused"));
        let mut met = 1;
        while spoke != start {
            spoke = next[&(v, spoke)];
            met += 1;
        }
        assert_eq!(met, count, "vertex {v} has more than one fan");
    }
    assert!(mesh.positions.iter().all(|p| p.is_finite()));
    assert!(volume(mesh) > 0.0);
}

/// Returns the least angle of each triangle in degrees, ascending.
pub(super) fn least_angles(mesh: &TriangleMesh) -> Vec<f64> {
    let mut angles: Vec<f64> = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
            [(a, b, c), (b, c, a), (c, a, b)]
                .map(|(p, q, r)| (q - p).angle_between(r - p).to_degrees())
                .into_iter()
                .fold(180.0, f64::min)
        })
        .collect();
    angles.sort_by(f64::total_cmp);
    angles
}
