//! Rows of bits: bit `i % 64` of word `i / 64`.

use std::ops::{BitXor, Shl};

/// Returns whether a bit of a row is set.
#[inline]
pub fn is_set(row: &[u64], bit: usize) -> bool {
    row[bit / 64] >> (bit % 64) & 1 == 1
}

/// Flips a bit of a row; does nothing beyond its end.
#[inline]
pub fn flip(row: &mut [u64], bit: usize) {
    if let Some(word) = row.get_mut(bit / 64) {
        *word ^= 1 << (bit % 64);
    }
}

/// An iterator over the positions of the set bits of a word, ascending.
pub struct Ones(pub u64);

impl Iterator for Ones {
    type Item = u32;

    #[inline]
    fn next(&mut self) -> Option<u32> {
        let bit = self.0.trailing_zeros();
        self.0 &= self.0.wrapping_sub(1);
        (bit < u64::BITS).then_some(bit)
    }
}

/// Returns the positions of the set bits of a row, ascending.
#[inline]
pub fn ones(row: &[u64]) -> impl Iterator<Item = usize> + use<'_> {
    row.iter().enumerate().flat_map(|(word, &bits)| Ones(bits).map(move |bit| 64 * word + bit as usize))
}

/// Returns the bits before those of a word of a row, each at the place of the bit after it.
#[inline]
pub fn before(row: &[u64], word: usize) -> u64 {
    row[word] << 1 | word.checked_sub(1).map_or(0, |before| row[before] >> 63)
}

/// Returns the bits after those of a word of a row, each at the place of the bit before it.
#[inline]
pub fn after(row: &[u64], word: usize) -> u64 {
    row[word] >> 1 | row.get(word + 1).map_or(0, |after| after << 63)
}

/// Writes the bits of a row as bytes of 0 and 1, as many as there are bytes.
pub fn spread_row(row: &[u64], bytes: &mut [u8]) {
    let (words, rest) = bytes.as_chunks_mut::<64>();
    for (bytes, word) in words.iter_mut().zip(row) {
        for (bytes, bits) in bytes.as_chunks_mut::<8>().0.iter_mut().zip(word.to_le_bytes()) {
            *bytes = spread(bits).to_le_bytes();
        }
    }
    for (bit, byte) in rest.iter_mut().enumerate() {
        *byte = (row[words.len()] >> bit & 1) as u8;
    }
}

/// Returns eight bits as the bytes of a word, each 0 or 1.
#[inline]
fn spread(bits: u8) -> u64 {
    const ONES: u64 = 0x0101_0101_0101_0101;
    // Each byte keeps its own bit, and those that are not 0 are carried to their top bit.
    let own = (u64::from(bits) * ONES) & 0x8040_2010_0804_0201;
    ((own + 0x7f * ONES) >> 7) & ONES
}

/// Returns the prefix parity of a word: bit i of the result is the parity of bits 0 to i.
#[inline]
pub fn prefix_parity<W: Copy + BitXor<Output = W> + Shl<u32, Output = W>>(word: W) -> W {
    let doublings = (8 * size_of::<W>()).ilog2();
    (0..doublings).fold(word, |parity, doubling| parity ^ parity << (1 << doubling))
}

/// Replaces each bit of a row by the parity of the bits up to it.
#[inline]
pub fn accumulate(row: &mut [u64]) {
    let mut carry = 0;
    for word in row {
        *word = prefix_parity(*word) ^ carry;
        carry = ((*word as i64) >> 63) as u64;
    }
}

/// Replaces each bit of consecutive rows of `words` words by the parity of the bits at its place in the rows up to its own.
#[inline]
pub fn accumulate_rows(rows: &mut [u64], words: usize) {
    for at in words..rows.len() {
        rows[at] ^= rows[at - words];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn set_bits_are_listed_and_accumulated_across_words() {
        let set = [0, 5, 63, 64, 130, 191];
        let mut row = [0; 3];
        set.iter().for_each(|&bit| flip(&mut row, bit));
        flip(&mut row, 192);
        assert_eq!(ones(&row).collect::<Vec<_>>(), set);
        assert!((0..192).all(|bit| is_set(&row, bit) == set.contains(&bit)));
        let beside = |of: fn(&[u64], usize) -> u64| ones(&[0, 1, 2].map(|word| of(&row, word))).collect::<Vec<_>>();
        assert_eq!(beside(before), [1, 6, 64, 65, 131]);
        assert_eq!(beside(after), [4, 62, 63, 129, 190]);
        let low: u32 = 0x8000_0421;
        assert_eq!(u64::from(prefix_parity(low)), prefix_parity(u64::from(low)) & u64::from(u32::MAX));
        let mut rows = [row, row, [0, 1, 2]].concat();
        accumulate(&mut row);
        assert!((0..192).all(|bit| is_set(&row, bit) == (set.iter().filter(|&&one| one <= bit).count() % 2 == 1)));
        accumulate_rows(&mut rows, 3);
        assert_eq!(rows[3..], [0, 0, 0, 0, 1, 2]);
    }
}
