//! Parts of a mesh, without the positions that they do not use.

use super::TriangleMesh;

/// The number of an unused position.
const UNUSED: u32 = u32::MAX;

impl TriangleMesh {
    /// Returns the mesh of some triangles over the positions of this one, with the used positions only, in their order,
    /// and the indices that those had here. It takes time and memory for the positions between the first and the last used one.
    ///
    /// # Panics
    /// Panics if an index is out of range.
    pub fn of_triangles(&self, mut triangles: Vec<[u32; 3]>) -> (TriangleMesh, Vec<u32>) {
        let kept = renumber(&mut triangles);
        let positions = kept.iter().map(|&vertex| self.positions[vertex as usize]).collect();
        (TriangleMesh { positions, triangles }, kept)
    }
}

/// Numbers the vertices that triangles use from zero, in their order, and returns their former numbers.
pub(crate) fn renumber(triangles: &mut [[u32; 3]]) -> Vec<u32> {
    let used = triangles.as_flattened();
    let first = used.iter().copied().min().unwrap_or(0);
    let span = used.iter().max().map_or(0, |&last| (last - first) as usize + 1);
    let mut numbers = vec![UNUSED; span];
    used.iter().for_each(|&vertex| numbers[(vertex - first) as usize] = 0);
    let kept: Vec<u32> = (first..).zip(&numbers).filter(|(_, number)| **number != UNUSED).map(|(v, _)| v).collect();
    (0..).zip(&kept).for_each(|(number, &vertex)| numbers[(vertex - first) as usize] = number);
    triangles.as_flattened_mut().iter_mut().for_each(|vertex| *vertex = numbers[(*vertex - first) as usize]);
    kept
}
