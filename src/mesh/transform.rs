//! Affine maps of the positions of a mesh.

use crate::parallel::*;
use glam::DAffine3;

use super::TriangleMesh;

/// Number of positions or triangles that one task maps.
const CHUNK: usize = 1 << 14;

impl TriangleMesh {
    /// Maps every position. Reverses the triangles where the map mirrors space, so that they face the same side as
    /// before.
    pub fn transform(&mut self, map: &DAffine3) {
        self.positions.par_chunks_mut(CHUNK).for_each(|positions| {
            for position in positions {
                *position = map.transform_point3(*position);
            }
        });
        if map.matrix3.determinant() < 0.0 {
            self.triangles.par_chunks_mut(CHUNK).for_each(|triangles| {
                for triangle in triangles {
                    triangle.swap(1, 2);
                }
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::testing::meshes::tetrahedron;

    #[test]
    fn mirrored_solids_face_outwards() {
        let mut mesh = tetrahedron();
        mesh.transform(&DAffine3::from_scale(DVec3::new(-2.0, 1.0, 1.0)));
        assert_eq!(mesh.signed_volume(), 2.0 * tetrahedron().signed_volume());
        assert_eq!(mesh.positions[1], DVec3::new(-2.0, 0.0, 0.0));
    }

    #[test]
    fn moved_solids_keep_their_triangles() {
        let mut mesh = tetrahedron();
        mesh.transform(&DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0)));
        assert_eq!(mesh.triangles, tetrahedron().triangles);
        assert_eq!(mesh.positions[0], DVec3::new(1.0, 2.0, 3.0));
    }
}
