//! Random numbers that are the same on every machine.

use std::ops::Range;

/// SplitMix64.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.0)
    }

    /// Draws from 0 to `count − 1`.
    pub fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    /// Draws from `least` to `most`, both included.
    pub fn between(&mut self, least: i32, most: i32) -> i32 {
        (i64::from(least) + (self.bits() % (i64::from(most) - i64::from(least) + 1) as u64) as i64) as i32
    }

    /// Draws from a range.
    pub fn within(&mut self, range: Range<i32>) -> i32 {
        self.between(range.start, range.end - 1)
    }

    /// Draws three numbers from a range.
    pub fn point(&mut self, range: Range<i32>) -> [i32; 3] {
        std::array::from_fn(|_| self.within(range.clone()))
    }

    /// Draws an even number from `least` to `most`, where both are even.
    pub fn even(&mut self, least: i32, most: i32) -> i32 {
        self.between(least / 2, most / 2) * 2
    }

    pub fn chance(&mut self, one_in: usize) -> bool {
        self.below(one_in) == 0
    }

    pub fn choose<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }

    /// Draws from −1 to 1.
    pub fn unit(&mut self) -> f64 {
        self.between(-1_000_000, 1_000_000) as f64 / 1e6
    }

    /// Draws from 0 to below 1.
    pub fn share(&mut self) -> f64 {
        share(self.bits())
    }
}

/// A linear congruential generator, whose high bits are random.
pub struct Congruential(u64);

impl Congruential {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0
    }

    /// Draws from 0 to `count − 1`.
    pub fn below(&mut self, count: usize) -> usize {
        ((self.bits() >> 33) % count as u64) as usize
    }

    /// Draws from 0 to below 1.
    pub fn share(&mut self) -> f64 {
        share(self.bits())
    }
}

/// Returns random bits that are a function of `state`: the output function of SplitMix64.
pub fn mix(state: u64) -> u64 {
    let bits = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

fn share(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 53) as f64
}
