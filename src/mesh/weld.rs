//! Welding: positions with the same coordinates become one.
//!
//! Readers of triangle soups leave most of them apart, since the mesh check goes by coordinates anyway. Formats whose
//! readers go by indices need them welded. Coordinates are compared exactly: any tolerance would close some gap that is
//! intended.

use glam::DVec3;
use rayon::prelude::*;

use super::TriangleMesh;
use super::hash::position_hash;
use crate::cancel::checkpoint;

/// The positions of a mesh that stay when those with the same coordinates are one: the first of each.
#[derive(Debug)]
pub(super) struct Weld {
    /// The indices of the positions that stay, in ascending order.
    pub(super) kept: Vec<u32>,
    /// For each position, its index among those that stay.
    pub(super) new_index: Vec<u32>,
}

impl Weld {
    /// Finds equal positions by their hashes. 0 and −0 are the same; NaNs equal nothing.
    pub(super) fn of(positions: &[DVec3]) -> Weld {
        const FREE: u32 = u32::MAX;
        let hashes: Vec<u64> = positions.par_iter().map(|&p| position_hash(p)[0]).collect();
        let mut table = vec![FREE; (2 * positions.len()).next_power_of_two()];
        let mask = table.len() - 1;
        let mut kept: Vec<u32> = Vec::new();
        let mut new_index = Vec::with_capacity(positions.len());
        for (index, position) in positions.iter().enumerate() {
            if index % 4096 == 0 {
                checkpoint();
            }
            if position.is_nan() {
                new_index.push(kept.len() as u32);
                kept.push(index as u32);
                continue;
            }
            let mut slot = hashes[index] as usize & mask;
            while table[slot] != FREE && positions[kept[table[slot] as usize] as usize] != *position {
                slot = (slot + 1) & mask;
            }
            if table[slot] == FREE {
                table[slot] = kept.len() as u32;
                kept.push(index as u32);
            }
            new_index.push(table[slot]);
        }
        Weld { kept, new_index }
    }
}

impl TriangleMesh {
    /// Replaces positions with the same coordinates by the first of them; the order of positions and triangles is kept. Returns
    /// the indices that the kept positions had, unless all are kept.
    pub fn weld(&mut self) -> Option<Vec<u32>> {
        let Weld { kept, new_index } = Weld::of(&self.positions);
        if kept.len() == self.positions.len() {
            return None;
        }
        self.positions = kept.iter().map(|&index| self.positions[index as usize]).collect();
        self.triangles.as_flattened_mut().iter_mut().for_each(|index| *index = new_index[*index as usize]);
        Some(kept)
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
