//! Parts of a mesh, without the positions that they do not use.

use super::TriangleMesh;

/// The number of an unused position.
const UNUSED: u32 = u32::MAX;

impl TriangleMesh {
    /// Returns the mesh of some triangles over the positions of this one, with the used positions only, in their order,
    /// and the indices that those had here.
    ///
    /// # Panics
    /// Panics if an index is out of range.
    pub fn of_triangles(&self, mut triangles: Vec<[u32; 3]>) -> (TriangleMesh, Vec<u32>) {
        let mut numbers = vec![UNUSED; self.positions.len()];
        triangles.as_flattened().iter().for_each(|&vertex| numbers[vertex as usize] = 0);
        let kept: Vec<u32> = (0..).zip(&numbers).filter(|(_, number)| **number != UNUSED).map(|(v, _)| v).collect();
        (0..).zip(&kept).for_each(|(number, &vertex)| numbers[vertex as usize] = number);
        triangles.as_flattened_mut().iter_mut().for_each(|vertex| *vertex = numbers[*vertex as usize]);
        let positions = kept.iter().map(|&vertex| self.positions[vertex as usize]).collect();
        (TriangleMesh { positions, triangles }, kept)
    }
}
