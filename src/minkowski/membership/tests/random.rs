//! Reproducible pseudo-random numbers.

/// SplitMix64.
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a number in `from..to`.
    pub fn between(&mut self, from: i32, to: i32) -> i32 {
        from + (self.next() % (to - from) as u64) as i32
    }

    /// Returns three numbers in `from..to`.
    pub fn point(&mut self, from: i32, to: i32) -> [i32; 3] {
        std::array::from_fn(|_| self.between(from, to))
    }

    /// Returns three even numbers, from twice `from` up to but without twice `to`.
    pub fn even_point(&mut self, from: i32, to: i32) -> [i32; 3] {
        self.point(from, to).map(|c| 2 * c)
    }
}
