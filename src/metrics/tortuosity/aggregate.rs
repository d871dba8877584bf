//! The next coarser level: aggregates of unknowns and the conductances between them.

use std::ops::Range;

use crate::parallel::*;

use super::operator::{Coarse, Operator};
use crate::cancel::checkpoint;

/// Unknowns in a task that makes rows.
const CHUNK: usize = 1 << 12;

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
        let slabs: Vec<Range<usize>> = cells
            .of
            .chunk_by(|a, b| a[2] / 2 == b[2] / 2)
            .scan(0, |end, slab| Some(std::mem::replace(end, *end + slab.len())..*end))
            .collect();
        let slabs: Vec<Slab> = slabs.into_par_iter().map(|range| Slab::of(operator, cells, range)).collect();
        let (mut of, mut members, mut starts, mut blocks) =
            (Vec::with_capacity(count), Vec::with_capacity(count), vec![0], Vec::new());
        for slab in slabs {
            let before = blocks.len() as u32;
            of.extend(slab.of.into_iter().map(|aggregate| before + aggregate));
            members.extend(slab.members);
            starts.extend(slab.ends);
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

/// The aggregates of the unknowns of two planes of cells, beyond which no block reaches.
struct Slab {
    /// The aggregate of each unknown, counted within the slab.
    of: Vec<u32>,
    members: Vec<u32>,
    /// The end of each aggregate in the members of all slabs.
    ends: Vec<u32>,
    blocks: Vec<[u16; 3]>,
}

impl Slab {
    fn of(operator: &impl Operator, cells: &Cells, unknowns: Range<usize>) -> Slab {
        checkpoint();
        let block = |unknown: u32| cells.of[unknown as usize].map(|c| c / 2);
        let start = unknowns.start;
        let mut of = vec![NONE; unknowns.len()];
        let (mut members, mut ends, mut blocks) = (Vec::with_capacity(unknowns.len()), Vec::new(), Vec::new());
        for first in unknowns {
            if of[first - start] != NONE {
                continue;
            }
            let (aggregate, here) = (blocks.len() as u32, block(first as u32));
            of[first - start] = aggregate;
            let mut next = members.len();
            members.push(first as u32);
            while let Some(&member) = members.get(next) {
                next += 1;
                operator.links(member as usize, |other, _| {
                    if block(other) == here && of[other as usize - start] == NONE {
                        of[other as usize - start] = aggregate;
                        members.push(other);
                    }
                });
            }
            ends.push((start + members.len()) as u32);
            blocks.push(here);
        }
        Slab { of, members, ends, blocks }
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
