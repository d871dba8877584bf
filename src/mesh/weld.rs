//! Welding: positions with the same coordinates become one.
//!
//! Readers of triangle soups leave most of them apart, since the mesh check goes by coordinates anyway. Formats whose
//! readers go by indices need them welded. Coordinates are compared exactly: any tolerance would close some gap that is
//! intended.

use std::cmp::Ordering;

use glam::DVec3;
use rayon::prelude::*;

use super::TriangleMesh;

/// The positions of a mesh that stay when those with the same coordinates are one: the first of each.
#[derive(Debug)]
pub(super) struct Weld {
    /// The indices of the positions that stay, in ascending order.
    pub(super) kept: Vec<u32>,
    /// For each position, its index among those that stay.
    pub(super) new_index: Vec<u32>,
}

impl Weld {
    /// Sorts the positions, which takes the time of a sort and two words a position. 0 and −0 are the same; NaNs equal
    /// nothing.
    pub(super) fn of(positions: &[DVec3]) -> Weld {
        let mut order: Vec<u32> = (0..positions.len() as u32).collect();
        let at = |index: u32| positions[index as usize];
        order.par_sort_unstable_by(|&a, &b| compare(at(a), at(b)).then(a.cmp(&b)));
        // First the index of the first equal position, then the rank of that one among all firsts.
        let mut new_index = vec![0; positions.len()];
        for alike in order.chunk_by(|&a, &b| at(a) == at(b)) {
            alike.iter().for_each(|&index| new_index[index as usize] = alike[0]);
        }
        let mut kept = order;
        kept.clear();
        for index in 0..positions.len() {
            let first = new_index[index] as usize;
            new_index[index] = if first == index { kept.len() as u32 } else { new_index[first] };
            if first == index {
                kept.push(index as u32);
            }
        }
        Weld { kept, new_index }
    }
}

fn compare(a: DVec3, b: DVec3) -> Ordering {
    // Adding 0 turns −0 into 0.
    let order = |a: f64, b: f64| (a + 0.0).total_cmp(&(b + 0.0));
    order(a.x, b.x).then_with(|| order(a.y, b.y)).then_with(|| order(a.z, b.z))
}

impl TriangleMesh {
    /// Replaces positions with the same coordinates by the first of them; the order of positions and triangles is kept.
    pub fn weld(&mut self) {
        let Weld { kept, new_index } = Weld::of(&self.positions);
        if kept.len() == self.positions.len() {
            return;
        }
        self.positions = kept.iter().map(|&index| self.positions[index as usize]).collect();
        self.triangles.as_flattened_mut().iter_mut().for_each(|index| *index = new_index[*index as usize]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn welding_keeps_the_first_of_equal_positions() {
        let corners = [[1.0, 2.0, 3.0], [0.0, 0.0, 0.0], [1.0, 2.0, 3.0], [5.0, 0.0, 0.0], [-0.0, 0.0, -0.0]];
        let nan = DVec3::new(f64::NAN, 0.0, 0.0);
        let positions: Vec<DVec3> = corners.into_iter().map(DVec3::from).chain([nan, nan]).collect();
        let mut mesh = TriangleMesh { positions, triangles: vec![[0, 1, 3], [2, 4, 5], [0, 2, 6]] };
        mesh.weld();
        assert_eq!(mesh.positions[..3], [[1.0, 2.0, 3.0], [0.0, 0.0, 0.0], [5.0, 0.0, 0.0]].map(DVec3::from));
        assert_eq!(mesh.positions.len(), 5);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 1, 3], [0, 0, 4]]);
    }

    #[test]
    fn welding_the_soup_of_a_solid_restores_the_solid() {
        let solid = crate::solids::geodesic(1.0, 20).unwrap();
        let positions = solid.triangles.iter().flatten().map(|&index| solid.positions[index as usize]).collect();
        let triangles = (0..solid.triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mut soup = TriangleMesh { positions, triangles };
        soup.weld();
        assert_eq!(soup.positions.len(), solid.positions.len());
        let corners = |mesh: &TriangleMesh| -> Vec<DVec3> {
            mesh.triangles.iter().flatten().map(|&index| mesh.positions[index as usize]).collect()
        };
        assert_eq!(corners(&soup), corners(&solid));
    }
}
