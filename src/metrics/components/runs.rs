//! Maximal runs of nodes along x, the units of labelling.

use std::ops::Range;

use crate::parallel::*;

use crate::cancel::checkpoint;
use crate::metrics::NodeSet;
use crate::metrics::nodes::words_between;

/// Consecutive nodes of a row, from `first` to `last`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Run {
    pub first: u32,
    pub last: u32,
}

/// The maximal runs of a set of nodes, row after row in the order of the set, ascending in each row.
#[derive(Clone, Debug)]
pub(super) struct Runs {
    /// The first run of each row, and the end of the last row's.
    offsets: Vec<u32>,
    runs: Vec<Run>,
}

impl Runs {
    /// # Panics
    /// If there are 2³² runs or more.
    pub fn of(set: &NodeSet) -> Runs {
        let [_, rows, planes] = set.size();
        let by_plane: Vec<(Vec<u32>, Vec<Run>)> = (0..planes)
            .into_par_iter()
            .map(|z| {
                checkpoint();
                let (mut counts, mut runs) = (Vec::with_capacity(rows), Vec::new());
                for y in 0..rows {
                    let before = runs.len();
                    append_runs(set.row(y, z), &mut runs);
                    counts.push((runs.len() - before) as u32);
                }
                (counts, runs)
            })
            .collect();
        let count: usize = by_plane.iter().map(|(_, runs)| runs.len()).sum();
        assert!(u32::try_from(count).is_ok(), "{count} runs of nodes; 4294967295 can be told apart");
        let mut offsets = Vec::with_capacity(rows * planes + 1);
        let mut runs = Vec::with_capacity(count);
        offsets.push(0);
        let mut end = 0;
        for (counts, of_plane) in by_plane {
            offsets.extend(counts.into_iter().map(|count| {
                end += count;
                end
            }));
            runs.extend(of_plane);
        }
        Runs { offsets, runs }
    }

    /// Returns the number of runs.
    pub fn count(&self) -> u32 {
        self.runs.len() as u32
    }

    /// Returns the indices of the runs of a row.
    pub fn row(&self, row: usize) -> Range<u32> {
        self.offsets[row]..self.offsets[row + 1]
    }

    /// Returns the indices of all rows.
    pub fn rows(&self) -> Range<usize> {
        0..self.offsets.len() - 1
    }

    /// Returns all runs.
    pub fn all(&self) -> &[Run] {
        &self.runs
    }

    /// Returns the run of the given index.
    #[inline]
    pub fn get(&self, run: u32) -> Run {
        self.runs[run as usize]
    }

    /// Returns the run that node `x` of a row belongs to.
    pub fn at(&self, row: usize, x: u32) -> Option<u32> {
        let range = self.row(row);
        let runs = &self.runs[range.start as usize..range.end as usize];
        let at = runs.partition_point(|run| run.last < x);
        runs.get(at).is_some_and(|run| run.first <= x).then_some(range.start + at as u32)
    }

    /// Calls `found` with each pair of runs of two rows that overlap, or would if one were `reach` nodes longer at either end;
    /// `reach` ≤ 1.
    pub fn overlapping(&self, a: usize, b: usize, reach: u32, mut found: impl FnMut(u32, u32)) {
        let (mut a, mut b) = (self.row(a), self.row(b));
        while !a.is_empty() && !b.is_empty() {
            let (p, q) = (self.get(a.start), self.get(b.start));
            if p.first <= q.last + reach && q.first <= p.last + reach {
                found(a.start, b.start);
            }
            // The run that ends first cannot overlap a later one of the other row: gaps are a node or more.
            match p.last < q.last {
                true => a.start += 1,
                false => b.start += 1,
            }
        }
    }
}

impl Run {
    /// Returns the number of its nodes.
    pub fn length(self) -> u64 {
        u64::from(self.last - self.first) + 1
    }

    /// Returns the words that it extends into, with a mask of its bits in each.
    pub fn masks(self) -> impl Iterator<Item = (usize, u64)> {
        words_between(self.first as usize, self.last as usize)
    }
}

fn append_runs(words: &[u64], runs: &mut Vec<Run>) {
    let mut open = None;
    for (index, &word) in words.iter().enumerate() {
        let base = index as u32 * 64;
        let mut rest = word;
        // A run that reached the end of the last word ends before the first bit that is not set.
        if let Some(first) = open.take() {
            let more = rest.trailing_ones();
            if more == 64 {
                open = Some(first);
                continue;
            }
            runs.push(Run { first, last: base + more - 1 });
            rest &= u64::MAX << more;
        }
        while rest != 0 {
            let start = rest.trailing_zeros();
            let length = (rest >> start).trailing_ones();
            if start + length == 64 {
                open = Some(base + start);
                break;
            }
            runs.push(Run { first: base + start, last: base + start + length - 1 });
            rest &= u64::MAX << (start + length);
        }
    }
    if let Some(first) = open {
        runs.push(Run { first, last: words.len() as u32 * 64 - 1 });
    }
}
