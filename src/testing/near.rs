//! The distance of points from a mesh, by comparing them with every triangle nearby.

use std::collections::HashMap;

use glam::DVec3;
use ldi_ops::mesh::TriangleMesh;

/// An index of triangles by the blocks of a raster that they are near.
pub struct Near<'m> {
    mesh: &'m TriangleMesh,
    reach: f64,
    blocks: HashMap<[i64; 3], Vec<u32>>,
}

impl<'m> Near<'m> {
    /// Returns an index for points up to `reach` from a mesh.
    pub fn new(mesh: &'m TriangleMesh, reach: f64) -> Near<'m> {
        let mut near = Near { mesh, reach, blocks: HashMap::new() };
        for (index, triangle) in (0..).zip(&mesh.triangles) {
            let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
            let low = near.block(a.min(b).min(c) - reach);
            let high = near.block(a.max(b).max(c) + reach);
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        near.blocks.entry([x, y, z]).or_default().push(index);
                    }
                }
            }
        }
        near
    }

    fn block(&self, point: DVec3) -> [i64; 3] {
        (point / (2.0 * self.reach)).floor().to_array().map(|c| c as i64)
    }

    /// Returns the distance of a point from the mesh, if it is within reach.
    pub fn distance(&self, point: DVec3) -> Option<f64> {
        let triangles = self.blocks.get(&self.block(point))?;
        let of = |&index: &u32| {
            distance(point, self.mesh.triangles[index as usize].map(|v| self.mesh.positions[v as usize]))
        };
        triangles.iter().map(of).min_by(f64::total_cmp).filter(|distance| *distance <= self.reach)
    }
}

/// Returns the distance of a point from a triangle: from its plane where the point projects into it, else from its sides.
pub fn distance(point: DVec3, corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let above = (0..3).all(|i| normal.cross(corners[(i + 1) % 3] - corners[i]).dot(point - corners[i]) >= 0.0);
    if above && normal.length_squared() > 0.0 {
        return normal.dot(point - a).abs() / normal.length();
    }
    let side = |i: usize| {
        let (from, along) = (corners[i], corners[(i + 1) % 3] - corners[i]);
        let share = if along.length_squared() > 0.0 { along.dot(point - from) / along.length_squared() } else { 0.0 };
        (from + along * share.clamp(0.0, 1.0)).distance(point)
    };
    (0..3).map(side).fold(f64::INFINITY, f64::min)
}
