//! The next coarser level: aggregates of unknowns and the conductances between them.

use crate::parallel::*;

use super::operator::{Coarse, Operator};

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

/// The cells of a raster that unknowns lie in, and the number of cells along each axis.
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
        let block = |unknown: u32| cells.of[unknown as usize].map(|c| c / 2);
        let count = operator.count();
        let mut of = vec![NONE; count];
        let (mut starts, mut members, mut blocks) = (vec![0], Vec::with_capacity(count), Vec::new());
        for first in 0..count as u32 {
            if of[first as usize] != NONE {
                continue;
            }
            let (aggregate, here) = (blocks.len() as u32, block(first));
            of[first as usize] = aggregate;
            let mut next = members.len();
            members.push(first);
            while let Some(&member) = members.get(next) {
                next += 1;
                operator.links(member as usize, |other, _| {
                    if of[other as usize] == NONE && block(other) == here {
                        of[other as usize] = aggregate;
                        members.push(other);
                    }
                });
            }
            starts.push(members.len() as u32);
            blocks.push(here);
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

/// Consecutive rows.
#[derive(Default)]
struct Rows {
    /// The number of links of each row, and its conductance to the ends.
    lengths: Vec<(u32, f32)>,
    links: Vec<(u32, f32)>,
}
