//! The Euler characteristic of a mesh.

use crate::parallel::*;
use glam::DVec3;

/// The numbers of corners, edges and faces of a surface; identical positions are one corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SurfaceCharacteristic {
    /// Different positions that faces use.
    pub corners: u64,
    /// Different edges.
    pub edges: u64,
    /// Triangles whose corners are three different positions.
    pub faces: u64,
    /// Edges that do not have exactly two faces. Where there are any, the surface is not a manifold, and χ of the solid is not
    /// half of the surface's.
    pub irregular_edges: u64,
}

impl SurfaceCharacteristic {
    /// Counts them. A triangle with two corners at one position has no face.
    ///
    /// # Panics
    /// If a triangle's index is out of range.
    pub fn of(positions: &[DVec3], triangles: &[[u32; 3]]) -> SurfaceCharacteristic {
        let of_position = merged(positions);
        let faces: Vec<[u32; 3]> = triangles
            .par_iter()
            .map(|triangle| triangle.map(|v| of_position[v as usize]))
            .filter(|&[a, b, c]| a != b && b != c && c != a)
            .collect();
        let mut is_used = vec![false; positions.len()];
        faces.iter().flatten().for_each(|&v| is_used[v as usize] = true);
        let mut edges: Vec<[u32; 2]> = faces
            .par_iter()
            .flat_map_iter(|&[a, b, c]| [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)]))
            .collect();
        edges.par_sort_unstable();
        let uses = edges.chunk_by(|a, b| a == b).map(<[_]>::len);
        let (count, irregular) =
            uses.fold((0, 0), |(count, irregular), uses| (count + 1, irregular + u64::from(uses != 2)));
        SurfaceCharacteristic {
            corners: is_used.iter().filter(|&&is_used| is_used).count() as u64,
            edges: count,
            faces: faces.len() as u64,
            irregular_edges: irregular,
        }
    }

    /// Returns χ of the surface: corners − edges + faces.
    pub fn of_surface(&self) -> i64 {
        self.corners as i64 - self.edges as i64 + self.faces as i64
    }

    /// Returns χ of the solid that it bounds, half that of the surface; `None` where an edge has not exactly two faces.
    ///
    /// The value is that of the mesh as it is: shells that overlap count as separate solids, and fans of faces that touch only
    /// at a corner as one.
    pub fn of_solid(&self) -> Option<f64> {
        (self.irregular_edges == 0).then(|| self.of_surface() as f64 / 2.0)
    }
}

/// Returns for each position the first one, in a fixed order, that is identical to it.
fn merged(positions: &[DVec3]) -> Vec<u32> {
    // Adding 0 makes −0 and 0 equal.
    let key = |v: u32| positions[v as usize].to_array().map(|x| (x + 0.0).to_bits());
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.par_sort_unstable_by_key(|&v| (key(v), v));
    let mut merged = vec![0; positions.len()];
    for same in order.chunk_by(|&a, &b| key(a) == key(b)) {
        same.iter().for_each(|&v| merged[v as usize] = same[0]);
    }
    merged
}
