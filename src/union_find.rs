//! Disjoint sets (union–find) that many threads join at once.
//!
//! Elements point to a lower one of their set or to themselves, and of two sets the lower root always wins. So the root
//! of a set is its lowest element, whatever the order of joins, and the result does not depend on threads.

use std::sync::atomic::{AtomicU32, Ordering};

use crate::parallel::*;

/// Disjoint sets of the elements 0, 1, …
#[derive(Debug)]
pub(crate) struct UnionFind {
    parents: Vec<AtomicU32>,
}

impl UnionFind {
    /// Returns this many elements, each a set by itself.
    pub(crate) fn new(count: u32) -> UnionFind {
        UnionFind { parents: (0..count).into_par_iter().with_min_len(1 << 12).map(AtomicU32::new).collect() }
    }

    /// Returns the root of the set of an element: once all joins are done, its lowest element.
    pub(crate) fn find(&self, mut element: u32) -> u32 {
        loop {
            let parent = self.parents[element as usize].load(Ordering::Relaxed);
            if parent == element {
                return element;
            }
            let above = self.parents[parent as usize].load(Ordering::Relaxed);
            // A parent only ever becomes lower, so another thread's step is no worse than this one, and may be kept.
            if above != parent {
                let _ = self.parents[element as usize].compare_exchange(
                    parent,
                    above,
                    Ordering::Relaxed,
                    Ordering::Relaxed,
                );
            }
            element = above;
        }
    }

    /// Merges the sets of two elements.
    pub(crate) fn join(&self, a: u32, b: u32) {
        let (mut a, mut b) = (self.find(a), self.find(b));
        while a != b {
            let (low, high) = (a.min(b), a.max(b));
            let hung = self.parents[high as usize].compare_exchange(high, low, Ordering::Relaxed, Ordering::Relaxed);
            if hung.is_ok() {
                return;
            }
            (a, b) = (self.find(low), self.find(high));
        }
    }

    /// Returns the root of each element's set.
    pub(crate) fn roots(&self) -> Vec<u32> {
        (0..self.parents.len() as u32).into_par_iter().with_min_len(1 << 12).map(|element| self.find(element)).collect()
    }
}
