//! Welding: positions with the same coordinates become one.
//!
//! Readers of triangle soups leave most of them apart, since the mesh check goes by coordinates anyway. Formats whose
//! readers go by indices need them welded. Coordinates are compared exactly: any tolerance would close some gap that is
//! intended.

use std::sync::atomic::{AtomicU32, Ordering};

use crate::parallel::*;
use glam::DVec3;

use super::TriangleMesh;
use super::hash::{PI, mix, position_hash};
use crate::allocation::{vec_with_room, zeroed};
use crate::cancel::checkpoint;

/// Number of positions that one task looks up.
const CHUNK: usize = 8192;

/// Number of positions whose first slots are loaded together.
const BLOCK: usize = 64;

/// The mark of an empty slot.
const FREE: u32 = 0;

/// The positions of a mesh that stay when those with the same coordinates are one: the first of each.
#[derive(Debug)]
pub(crate) struct Weld {
    /// The indices of the positions that stay, in ascending order.
    pub(crate) kept: Vec<u32>,
    /// For each position, its index among those that stay.
    pub(crate) new_index: Vec<u32>,
}

impl Weld {
    /// Finds equal positions by their hashes. 0 and −0 are the same; NaNs equal nothing.
    pub(crate) fn of(positions: &[DVec3]) -> Weld {
        let Table { entries, slots: mut new_index } = Table::of(positions);
        let first = |slot: &mut u32| *slot = !entries[*slot as usize].load(Ordering::Relaxed);
        new_index.par_iter_mut().with_min_len(CHUNK).for_each(first);
        drop(entries);
        let mut kept = Vec::with_capacity(positions.len());
        for index in 0..positions.len() {
            // The first position of a set comes before the others, so that its new index is known.
            let first = new_index[index] as usize;
            new_index[index] = if first == index { kept.len() as u32 } else { new_index[first] };
            if first == index {
                kept.push(index as u32);
            }
        }
        Weld { kept, new_index }
    }

    /// Removes the positions that do not stay, in place.
    pub(crate) fn retain(&self, positions: &mut Vec<DVec3>) {
        for (place, &index) in self.kept.iter().enumerate() {
            positions[place] = positions[index as usize];
        }
        positions.truncate(self.kept.len());
    }
}

/// A hash table of positions that all threads fill at once: a slot holds the complement of the least index of its position, so
/// that the order of insertions does not matter.
struct Table {
    entries: Vec<AtomicU32>,
    /// The slot of each position.
    slots: Vec<u32>,
}

impl Table {
    fn of(positions: &[DVec3]) -> Table {
        let count = (2 * positions.len() as u64).next_power_of_two().min(1 << 32) as usize;
        let mut entries: Vec<AtomicU32> = vec_with_room(count);
        // Written before they are read: pages that are read first are mapped twice, and all threads wait for that.
        entries.par_extend((0..count).into_par_iter().with_min_len(CHUNK).map(|_| AtomicU32::new(FREE)));
        let mut slots: Vec<u32> = zeroed(positions.len());
        slots.par_chunks_mut(BLOCK).zip(positions.par_chunks(BLOCK)).enumerate().with_min_len(CHUNK / BLOCK).for_each(
            |(block, (slots, positions_of_block))| {
                checkpoint();
                let mask = entries.len() - 1;
                let mut found = [FREE; BLOCK];
                // Insertions wait for one another, and loads do not: so the entries are brought into the cache first.
                let indices = (block * BLOCK) as u32..;
                for ((slot, found), (position, index)) in
                    slots.iter_mut().zip(&mut found).zip(positions_of_block.iter().zip(indices.clone()))
                {
                    // NaNs equal nothing, so that each has a place of its own; many are spread as positions are.
                    let of_nan = || mix(u64::from(index) ^ PI[8], PI[9]);
                    let hash = if position.is_nan() { of_nan() } else { position_hash(*position)[0] };
                    *slot = (hash as usize & mask) as u32;
                    *found = entries[*slot as usize].load(Ordering::Relaxed);
                }
                for ((slot, found), index) in slots.iter_mut().zip(found).zip(indices) {
                    *slot = insert(&entries, positions, index, (*slot, found));
                }
            },
        );
        Table { entries, slots }
    }
}

/// Returns the slot of a position, in which its index is noted, given the first slot by its hash and what that held.
#[inline]
fn insert(entries: &[AtomicU32], positions: &[DVec3], index: u32, (first, found): (u32, u32)) -> u32 {
    let position = positions[index as usize];
    let mask = entries.len() - 1;
    let (mut slot, mut found) = (first as usize, found);
    loop {
        if found == FREE {
            match entries[slot].compare_exchange(FREE, !index, Ordering::Relaxed, Ordering::Relaxed) {
                Ok(_) => return slot as u32,
                Err(other) => found = other,
            }
        }
        if positions[!found as usize] == position {
            entries[slot].fetch_max(!index, Ordering::Relaxed);
            return slot as u32;
        }
        slot = (slot + 1) & mask;
        found = entries[slot].load(Ordering::Relaxed);
    }
}

impl TriangleMesh {
    /// Replaces positions with the same coordinates by the first of them; the order of positions and triangles is kept. Returns
    /// the indices that the kept positions had, unless all are kept.
    pub fn weld(&mut self) -> Option<Vec<u32>> {
        let weld = Weld::of(&self.positions);
        if weld.kept.len() == self.positions.len() {
            return None;
        }
        weld.retain(&mut self.positions);
        let renumber = |triangle: &mut [u32; 3]| *triangle = triangle.map(|index| weld.new_index[index as usize]);
        self.triangles.par_iter_mut().for_each(renumber);
        Some(weld.kept)
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
    fn many_nans_stay_apart_beside_as_many_positions() {
        let of = |i: u32| DVec3::new(f64::from(i / 2), if i < 200_000 { f64::NAN } else { 0.0 }, 0.0);
        let Weld { kept, new_index } = Weld::of(&(0..400_000).map(of).collect::<Vec<_>>());
        assert_eq!((kept.len(), new_index[399_999]), (300_000, 299_999));
        assert!((0..200_000).eq(new_index[..200_000].iter().copied()));
    }

    #[test]
    fn many_equal_positions_become_the_first_of_them_whatever_the_threads() {
        // Few different coordinates, so that sets are large and spread over many blocks and threads.
        let place = |i: u64| (i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) % 37;
        let positions: Vec<DVec3> =
            (0..40_000).map(|i| DVec3::new(place(i) as f64, -(place(i + 1) as f64), place(i * i) as f64)).collect();
        let mut numbers = std::collections::HashMap::new();
        let mut kept = Vec::new();
        let new_index: Vec<u32> = (0..)
            .zip(&positions)
            .map(|(index, position)| {
                *numbers.entry(position.to_array().map(|c| (c + 0.0).to_bits())).or_insert_with(|| {
                    kept.push(index);
                    kept.len() as u32 - 1
                })
            })
            .collect();
        for threads in [1, 4] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let weld = pool.install(|| Weld::of(&positions));
            assert!(weld.kept == kept && weld.new_index == new_index, "{threads}");
        }
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
