//! The facets of a mesh, prepared for sums over its surface.

use crate::parallel::*;
use glam::DVec3;

/// Normals and areas of the triangles of a mesh, with positions and triangles.
#[derive(Clone, Debug)]
pub struct Facets<'a> {
    /// Corners, in world units.
    pub positions: &'a [DVec3],
    /// Three indices for each triangle, counter-clockwise seen from outside.
    pub triangles: &'a [[u32; 3]],
    /// Outward unit normals; zero for a triangle without area.
    pub normals: Vec<DVec3>,
    /// In square world units.
    pub areas: Vec<f64>,
}

impl<'a> Facets<'a> {
    /// # Panics
    /// If a triangle's index is out of range.
    pub fn of(positions: &'a [DVec3], triangles: &'a [[u32; 3]]) -> Facets<'a> {
        let twice = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|v| positions[v as usize]);
            (b - a).cross(c - a)
        };
        let (normals, areas) = triangles
            .par_iter()
            .with_min_len(1 << 12)
            .map(|triangle| {
                let twice = twice(triangle);
                (twice.normalize_or_zero(), 0.5 * twice.length())
            })
            .unzip();
        Facets { positions, triangles, normals, areas }
    }

    /// Returns the corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|v| self.positions[v as usize])
    }
}
