//! Sets of nodes of a raster, a bit each.

use crate::parallel::*;

use crate::bits::is_set;
use crate::ldi::NodePlanes;

/// A set of nodes of a raster.
///
/// Node (x, y, z) is bit `x % 64` of word `x / 64` of row `z · size[1] + y`; rows are whole words, and the bits beyond the last
/// node of a row are 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeSet {
    size: [usize; 3],
    words: usize,
    bits: Vec<u64>,
}

impl NodeSet {
    /// Returns the empty set of a raster with `size` nodes along x, y and z.
    pub fn empty(size: [usize; 3]) -> NodeSet {
        let words = size[0].div_ceil(64);
        NodeSet { size, words, bits: vec![0; words * size[1] * size[2]] }
    }

    /// Returns all nodes of a raster.
    pub fn full(size: [usize; 3]) -> NodeSet {
        let mut set = NodeSet::empty(size);
        set.bits.fill(u64::MAX);
        set.trim();
        set
    }

    /// Returns the nodes for which `belongs` is true.
    pub fn from_fn(size: [usize; 3], belongs: impl Fn([usize; 3]) -> bool + Sync) -> NodeSet {
        let mut set = NodeSet::empty(size);
        set.change_rows(&|[y, z], bits| {
            for x in (0..size[0]).filter(|&x| belongs([x, y, z])) {
                bits[x / 64] |= 1 << (x % 64);
            }
        });
        set
    }

    /// Calls `change` with [y, z] and the words of each row. Behind a pointer, it shares the compiled loop with all others.
    fn change_rows(&mut self, change: &(dyn Fn([usize; 2], &mut [u64]) + Sync)) {
        let rows = self.size[1];
        let each = self.bits.par_chunks_mut(self.words.max(1)).enumerate().with_min_len(16);
        each.for_each(|(row, bits)| change([row % rows, row / rows], bits));
    }

    /// Returns the nodes that are inside by the images.
    pub fn of_planes(planes: &NodePlanes) -> NodeSet {
        let size = planes.grid().rays().map(|n| n as usize);
        let mut set = NodeSet::empty(size);
        let mut at = 0;
        for plane in planes.planes() {
            set.bits[at..at + plane.len()].copy_from_slice(&plane);
            at += plane.len();
        }
        set.trim();
        set
    }

    /// Returns the nodes whose byte is not 0, from an array whose index runs fastest along x.
    ///
    /// # Panics
    /// If there is not a byte for each node.
    pub fn from_bytes(size: [usize; 3], bytes: &[u8]) -> NodeSet {
        assert_eq!(bytes.len(), size.iter().product::<usize>(), "a byte for each node");
        NodeSet::from_fn(size, |[x, y, z]| bytes[(z * size[1] + y) * size[0] + x] != 0)
    }

    /// Returns the number of nodes along x, y and z.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Returns the number of nodes of the raster, in the set or not.
    pub fn volume(&self) -> usize {
        self.size.iter().product()
    }

    /// Returns the lower and upper corner of the raster in pitches: the outer faces of the cubes around its nodes.
    pub fn walls(&self) -> [[f32; 3]; 2] {
        [[-0.5; 3], self.size.map(|n| n as f32 - 0.5)]
    }

    /// Returns the number of words of a row.
    pub fn words(&self) -> usize {
        self.words
    }

    /// Returns the words of row (y, z).
    #[inline]
    pub fn row(&self, y: usize, z: usize) -> &[u64] {
        let at = (z * self.size[1] + y) * self.words;
        &self.bits[at..at + self.words]
    }

    /// Returns the words of row (y, z) for writing. Bits beyond the last node must stay 0.
    pub fn row_mut(&mut self, y: usize, z: usize) -> &mut [u64] {
        let at = (z * self.size[1] + y) * self.words;
        &mut self.bits[at..at + self.words]
    }

    /// Returns whether a node belongs to the set.
    #[inline]
    pub fn contains(&self, [x, y, z]: [usize; 3]) -> bool {
        is_set(self.row(y, z), x)
    }

    /// Adds a node.
    pub fn insert(&mut self, [x, y, z]: [usize; 3]) {
        self.row_mut(y, z)[x / 64] |= 1 << (x % 64);
    }

    /// Returns the number of nodes in the set.
    pub fn count(&self) -> u64 {
        self.bits.par_chunks(1 << 14).map(|words| words.iter().map(|w| u64::from(w.count_ones())).sum::<u64>()).sum()
    }

    /// Returns whether the set is empty.
    pub fn is_empty(&self) -> bool {
        self.bits.iter().all(|&word| word == 0)
    }

    /// Returns the nodes of both sets.
    pub fn and(&self, other: &NodeSet) -> NodeSet {
        self.combined(other, |a, b| a & b)
    }

    /// Returns the nodes of either set.
    pub fn or(&self, other: &NodeSet) -> NodeSet {
        self.combined(other, |a, b| a | b)
    }

    /// Returns the nodes of this set that are not in the other.
    pub fn minus(&self, other: &NodeSet) -> NodeSet {
        self.combined(other, |a, b| a & !b)
    }

    /// Returns all nodes of the raster that are at most `by` < 64 nodes from one of this set along each axis.
    pub fn grown(&self, by: usize) -> NodeSet {
        let [_, rows, planes] = self.size;
        let mut grown = self.clone();
        grown.change_rows(&|_, row| {
            let own = row.to_vec();
            for step in 1..=by {
                for (word, bits) in row.iter_mut().enumerate() {
                    let before = word.checked_sub(1).map_or(0, |word| own[word] >> (64 - step));
                    let after = own.get(word + 1).map_or(0, |next| next << (64 - step));
                    *bits |= own[word] << step | before | own[word] >> step | after;
                }
            }
        });
        for axis in [1, 2] {
            let along = grown.clone();
            grown.change_rows(&|[y, z], bits| {
                let (at, length) = if axis == 1 { (y, rows) } else { (z, planes) };
                for other in at.saturating_sub(by)..(at + by + 1).min(length) {
                    let row = if axis == 1 { along.row(other, z) } else { along.row(y, other) };
                    bits.iter_mut().zip(row).for_each(|(word, other)| *word |= other);
                }
            });
        }
        grown.trim();
        grown
    }

    /// # Panics
    /// If the sets are of rasters of different sizes.
    fn combined(&self, other: &NodeSet, combine: impl Fn(u64, u64) -> u64 + Sync) -> NodeSet {
        assert_eq!(self.size, other.size, "sets of nodes of one raster");
        let mut set = self.clone();
        set.change_beside(other, &|words, others| {
            words.iter_mut().zip(others).for_each(|(word, &other)| *word = combine(*word, other));
        });
        set
    }

    /// Calls `change` with parts of the words of this set and the same part of another.
    fn change_beside(&mut self, other: &NodeSet, change: &(dyn Fn(&mut [u64], &[u64]) + Sync)) {
        const WORDS_PER_TASK: usize = 1 << 14;
        let each = self.bits.par_chunks_mut(WORDS_PER_TASK).zip(other.bits.par_chunks(WORDS_PER_TASK));
        each.for_each(|(words, others)| change(words, others));
    }

    /// Clears the bits beyond the last node of each row.
    fn trim(&mut self) {
        let spare = self.words * 64 - self.size[0];
        if spare > 0 {
            for last in self.bits.iter_mut().skip(self.words - 1).step_by(self.words) {
                *last &= u64::MAX >> spare;
            }
        }
    }
}

/// Returns the words that hold the bits from `first` to `last`, with a mask of those in each.
pub(super) fn words_between(first: usize, last: usize) -> impl Iterator<Item = (usize, u64)> {
    (first / 64..=last / 64).map(move |word| {
        let from = if word == first / 64 { first % 64 } else { 0 };
        let to = if word == last / 64 { last % 64 } else { 63 };
        (word, u64::MAX << from & u64::MAX >> (63 - to))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn node_sets_combine_node_by_node() {
        let size = [70, 3, 5];
        let threes = NodeSet::from_fn(size, |[x, y, z]| (x + y + z) % 3 == 0);
        let low = NodeSet::from_fn(size, |[x, ..]| x < 65);
        for z in 0..5 {
            for y in 0..3 {
                for x in 0..70 {
                    let (a, b) = ((x + y + z) % 3 == 0, x < 65);
                    assert_eq!(threes.contains([x, y, z]), a);
                    assert_eq!(threes.and(&low).contains([x, y, z]), a && b);
                    assert_eq!(threes.or(&low).contains([x, y, z]), a || b);
                    assert_eq!(threes.minus(&low).contains([x, y, z]), a && !b);
                }
            }
        }
        assert_eq!(low.count(), 65 * 15);
        assert_eq!(NodeSet::full(size).count(), 70 * 15);
    }

    #[test]
    fn sets_grow_to_all_sides_and_not_beyond() {
        let size = [130, 7, 9];
        let near = |a: usize, b: usize| a.abs_diff(b) <= 3;
        let grown = NodeSet::from_fn(size, |node| node == [63, 1, 4] || node == [129, 6, 8]).grown(3);
        let expected = NodeSet::from_fn(size, |[x, y, z]| {
            (near(x, 63) && near(y, 1) && near(z, 4)) || (near(x, 129) && near(y, 6) && near(z, 8))
        });
        assert_eq!(grown, expected);
    }
}
