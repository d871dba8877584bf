//! The next coarser level: aggregates of unknowns and the conductances between them.

use crate::parallel::*;

use super::operator::{Coarse, Operator};
use crate::cancel::checkpoint;

/// Unknowns in a task that makes rows.
const CHUNK: usize = 1 << 12;

/// The aggregates of the unknowns of two planes of cells, which lie next to one another: no block extends farther.
struct Slab {
    starts: Vec<u32>,
    members: Vec<u32>,
    blocks: Vec<[u16; 3]>,
}

/// The index that denotes no aggregate.
const NONE: u32 = u32::MAX;

/// A partition of unknowns into aggregates.
pub(super) struct Aggregates {
    /// The aggregate of each unknown.
    pub of: Vec<u32>,
    /// The first member of each aggregate in `members`, and the end of the last's.
    starts: Vec<u32>,
    members: Vec<u32>,
}

/// The cells of a raster that unknowns lie in, in ascending order of z, and the number of cells along each axis.
pub(super) struct Cells {
    pub size: [u32; 3],
    pub of: Vec<[u16; 3]>,
}

impl Cells {
    /// Returns whether there is only one cell.
    pub fn is_one(&self) -> bool {
        self.size == [1; 3]
    }
}

impl Aggregates {
    /// Finds the connected parts of each block of 2 × 2 × 2 cells, and the blocks as cells of the next level.
    pub fn new(operator: &impl Operator, cells: &Cells) -> (Aggregates, Cells) {
        debug_assert!(cells.of.is_sorted_by_key(|cell| cell[2]), "unknowns in the order of their planes");
        let count = operator.count();
        let mut of = vec![NONE; count];
        let (mut left, mut first) = (&mut of[..], 0);
        let slabs = cells.of.chunk_by(|a, b| a[2] / 2 == b[2] / 2).map(|slab| {
            let (own, rest) = std::mem::take(&mut left).split_at_mut(slab.len());
            left = rest;
            first += slab.len();
            (first - slab.len(), own)
        });
        let slabs: Vec<(usize, &mut [u32])> = slabs.collect();
        let mut made: Vec<(&mut [u32], Slab)> =
            slabs.into_par_iter().map(|(first, of)| Slab::in_slab(operator, cells, first, of)).collect();
        let counts = made.iter().map(|(_, slab)| slab.blocks.len() as u32);
        let before: Vec<u32> = counts.scan(0, |sum, count| Some(std::mem::replace(sum, *sum + count))).collect();
        let numbered = made.par_iter_mut().zip(before);
        numbered.for_each(|((of, _), before)| of.iter_mut().for_each(|aggregate| *aggregate += before));
        let (mut starts, mut members, mut blocks) = (vec![0], Vec::with_capacity(count), Vec::new());
        for (_, slab) in made {
            starts.extend(slab.starts);
            members.extend(slab.members);
            blocks.extend(slab.blocks);
        }
        let cells = Cells { size: cells.size.map(|side| side.div_ceil(2)), of: blocks };
        (Aggregates { of, starts, members }, cells)
    }

    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// Returns the unknowns of an aggregate.
    #[inline]
    pub fn members(&self, aggregate: usize) -> &[u32] {
        &self.members[self.starts[aggregate] as usize..self.starts[aggregate + 1] as usize]
    }

    /// Returns the conductances between aggregates: the sums of those between their members, which is the matrix restricted to
    /// one value for each aggregate (Galerkin).
    pub fn coarse(&self, operator: &impl Operator) -> Coarse {
        let chunks = (0..self.count().div_ceil(CHUNK)).into_par_iter();
        let made: Vec<Rows> = chunks
            .map(|chunk| {
                let mut rows = Rows::default();
                for aggregate in chunk * CHUNK..self.count().min((chunk + 1) * CHUNK) {
                    self.add_row(operator, aggregate as u32, &mut rows);
                }
                rows
            })
            .collect();
        let links = made.iter().map(|rows| rows.links.len()).sum();
        let mut coarse = Coarse {
            starts: Vec::with_capacity(self.count() + 1),
            others: Vec::with_capacity(links),
            conductances: Vec::with_capacity(links),
            ends: Vec::with_capacity(self.count()),
            inverses: Vec::with_capacity(self.count()),
        };
        coarse.starts.push(0);
        for rows in made {
            let mut at = 0;
            for (length, end) in rows.lengths {
                let links = &rows.links[at..at + length as usize];
                at += length as usize;
                let total = links.iter().fold(end, |sum, &(_, conductance)| sum + conductance);
                coarse.others.extend(links.iter().map(|&(other, _)| other));
                coarse.conductances.extend(links.iter().map(|&(_, conductance)| conductance));
                coarse.starts.push(coarse.others.len() as u32);
                coarse.ends.push(end);
                coarse.inverses.push(1.0 / total);
            }
        }
        coarse
    }

    fn add_row(&self, operator: &impl Operator, aggregate: u32, rows: &mut Rows) {
        let first = rows.links.len();
        let mut end = 0.0;
        for &member in self.members(aggregate as usize) {
            end += operator.end(member as usize);
            operator.links(member as usize, |other, conductance| {
                let other = self.of[other as usize];
                if other == aggregate {
                    return;
                }
                match rows.links[first..].iter_mut().find(|(known, _)| *known == other) {
                    Some((_, sum)) => *sum += conductance,
                    None => rows.links.push((other, conductance)),
                }
            });
        }
        rows.lengths.push(((rows.links.len() - first) as u32, end));
    }
}

impl Slab {
    /// Finds the aggregates of the unknowns from `start` on, numbered from 0, and sets `of` to them.
    fn in_slab<'a>(operator: &impl Operator, cells: &Cells, start: usize, of: &'a mut [u32]) -> (&'a mut [u32], Slab) {
        let block = |unknown: u32| cells.of[unknown as usize].map(|c| c / 2);
        checkpoint();
        let mut slab = Slab { starts: Vec::new(), members: Vec::with_capacity(of.len()), blocks: Vec::new() };
        for first in start..start + of.len() {
            if of[first - start] != NONE {
                continue;
            }
            let (aggregate, here) = (slab.blocks.len() as u32, block(first as u32));
            of[first - start] = aggregate;
            let mut next = slab.members.len();
            slab.members.push(first as u32);
            while let Some(&member) = slab.members.get(next) {
                next += 1;
                operator.links(member as usize, |other, _| {
                    if block(other) == here && of[other as usize - start] == NONE {
                        of[other as usize - start] = aggregate;
                        slab.members.push(other);
                    }
                });
            }
            slab.starts.push((start + slab.members.len()) as u32);
            slab.blocks.push(here);
        }
        (of, slab)
    }
}

/// Consecutive rows.
#[derive(Default)]
struct Rows {
    /// The number of links of each row, and its conductance to the ends.
    lengths: Vec<(u32, f32)>,
    links: Vec<(u32, f32)>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::tortuosity::operator::Fine;
    use crate::testing::random::Random;

    #[test]
    fn aggregates_are_the_connected_parts_of_blocks() {
        let mut random = Random::new(31);
        for (size, wraps) in [([5, 4, 7], false), ([5, 4, 7], true), ([3, 6, 2], true), ([4, 4, 1], false)] {
            let [width, height, depth] = size;
            let all = (0..depth).flat_map(|z| (0..height).flat_map(move |y| (0..width).map(move |x| [x, y, z])));
            let of: Vec<[u16; 3]> = all.filter(|_| random.share() < 0.6).collect();
            let number = |cell: [u16; 3]| of.iter().position(|&other| other == cell);
            let neighbours = of.iter().enumerate().map(|(own, &cell)| {
                [0, 1, 2, 3, 4, 5].map(|face| {
                    let mut other = cell;
                    let (axis, side) = (face / 2, size[face / 2]);
                    other[axis] = match face % 2 {
                        0 if cell[axis] == 0 && !(wraps && axis == 2) => return own as u32,
                        1 if cell[axis] + 1 == side && !(wraps && axis == 2) => return own as u32,
                        up => (cell[axis] + if up == 1 { 1 } else { side - 1 }) % side,
                    };
                    number(other).map_or(own as u32, |other| other as u32)
                })
            });
            let operator = Fine::new(neighbours.collect(), vec![[0.0; 2]; of.len()]);
            let cells = Cells { size: size.map(u32::from), of: of.clone() };
            let (found, coarser) = Aggregates::new(&operator, &cells);
            let mut seen = vec![0; of.len()];
            for aggregate in 0..found.count() {
                let members = found.members(aggregate);
                // Each member but the first is linked to one before it.
                for (i, &member) in members.iter().enumerate() {
                    seen[member as usize] += 1;
                    assert_eq!(found.of[member as usize], aggregate as u32);
                    assert_eq!(of[member as usize].map(|c| c / 2), coarser.of[aggregate]);
                    let mut is_linked = i == 0;
                    operator.links(member as usize, |other, _| is_linked |= members[..i].contains(&other));
                    assert!(is_linked, "{size:?}: {member} of {aggregate}");
                }
            }
            assert!(seen.iter().all(|&times| times == 1) && coarser.of.is_sorted_by_key(|block| block[2]));
            for (own, cell) in of.iter().enumerate() {
                operator.links(own, |other, _| {
                    let is_same = cell.map(|c| c / 2) == of[other as usize].map(|c| c / 2);
                    assert_eq!(found.of[own] == found.of[other as usize], is_same, "{size:?}: {own} and {other}");
                });
            }
        }
    }
}
