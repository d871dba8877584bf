//! Conductances between unknowns: the matrices of all levels.

use std::ops::{AddAssign, Mul, Sub};

use crate::parallel::*;

/// The element type of vectors: f32 in the multigrid, f64 outside it.
pub(super) trait Real:
    Copy + From<f32> + AddAssign + Sub<Output = Self> + Mul<Output = Self> + Send + Sync
{
}

impl Real for f32 {}
impl Real for f64 {}

/// A symmetric matrix whose rows are conductances to other unknowns and to the ends.
pub(super) trait Operator: Sync {
    /// Returns the number of unknowns.
    fn count(&self) -> usize;

    /// Returns Σⱼ gᵢⱼ (xᵢ − xⱼ) + eᵢ xᵢ for a row i.
    fn row<T: Real>(&self, row: usize, x: &[T]) -> T;

    /// Returns the inverse of a row's diagonal element.
    fn inverse(&self, row: usize) -> f32;

    /// Calls `visit` with each other unknown of a row and the conductance to it.
    fn links(&self, row: usize, visit: impl FnMut(u32, f32));

    /// Returns the conductance from an unknown to the two ends together.
    fn end(&self, row: usize) -> f32;
}

/// The finest level: nodes, with conductances of 1.
pub(super) struct Fine {
    /// The unknowns across the six faces: the row itself where there is none.
    pub neighbours: Vec<[u32; 6]>,
    /// Conductances to the near end and the far one.
    pub ends: Vec<[f32; 2]>,
    pub inverses: Vec<f32>,
}

impl Fine {
    pub fn new(neighbours: Vec<[u32; 6]>, ends: Vec<[f32; 2]>) -> Fine {
        let inverse = |(row, (around, ends)): (usize, (&[u32; 6], &[f32; 2]))| {
            let degree = around.iter().filter(|&&other| other as usize != row).count();
            1.0 / (degree as f32 + ends[0] + ends[1])
        };
        let inverses = neighbours.par_iter().zip(&ends).enumerate().with_min_len(1 << 12).map(inverse).collect();
        Fine { neighbours, ends, inverses }
    }
}

impl Operator for Fine {
    fn count(&self) -> usize {
        self.neighbours.len()
    }

    #[inline(always)]
    fn row<T: Real>(&self, row: usize, x: &[T]) -> T {
        let here = x[row];
        let mut sum = T::from(self.end(row)) * here;
        for &other in &self.neighbours[row] {
            sum += here - x[other as usize];
        }
        sum
    }

    #[inline(always)]
    fn inverse(&self, row: usize) -> f32 {
        self.inverses[row]
    }

    #[inline]
    fn links(&self, row: usize, mut visit: impl FnMut(u32, f32)) {
        self.neighbours[row].iter().filter(|&&other| other as usize != row).for_each(|&other| visit(other, 1.0));
    }

    #[inline(always)]
    fn end(&self, row: usize) -> f32 {
        self.ends[row][0] + self.ends[row][1]
    }
}

/// A coarser level: aggregates.
pub(super) struct Coarse {
    /// The first link of each row, and the end of the last row's.
    pub starts: Vec<u32>,
    pub others: Vec<u32>,
    pub conductances: Vec<f32>,
    pub ends: Vec<f32>,
    pub inverses: Vec<f32>,
}

impl Coarse {
    #[inline]
    fn range(&self, row: usize) -> std::ops::Range<usize> {
        self.starts[row] as usize..self.starts[row + 1] as usize
    }
}

impl Operator for Coarse {
    fn count(&self) -> usize {
        self.ends.len()
    }

    #[inline(always)]
    fn row<T: Real>(&self, row: usize, x: &[T]) -> T {
        let here = x[row];
        let mut sum = T::from(self.ends[row]) * here;
        let range = self.range(row);
        for (&other, &conductance) in self.others[range.clone()].iter().zip(&self.conductances[range]) {
            sum += T::from(conductance) * (here - x[other as usize]);
        }
        sum
    }

    #[inline(always)]
    fn inverse(&self, row: usize) -> f32 {
        self.inverses[row]
    }

    #[inline]
    fn links(&self, row: usize, mut visit: impl FnMut(u32, f32)) {
        let range = self.range(row);
        self.others[range.clone()].iter().zip(&self.conductances[range]).for_each(|(&other, &g)| visit(other, g));
    }

    #[inline(always)]
    fn end(&self, row: usize) -> f32 {
        self.ends[row]
    }
}
