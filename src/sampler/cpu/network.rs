//! Sorting of a few integers in vector registers, by Batcher's bitonic network: no branch that a processor could
//! mispredict, where insertion mispredicts about one for each integer.

use std::arch::x86_64::*;

/// Most integers of a network.
pub const MOST: usize = 16;

/// Integers in a register.
const WIDTH: usize = 8;

/// Sorts at most [`MOST`] integers.
#[target_feature(enable = "avx2")]
pub fn sort(keys: &mut [u32]) {
    assert!(keys.len() <= MOST);
    let (count, keys) = (keys.len() as i32, keys.as_mut_ptr().cast::<i32>());
    let place = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    let is_key = _mm256_cmpgt_epi32(_mm256_set1_epi32(count), place);
    // Places behind the integers hold the greatest there is, and keep it.
    let filled = |keys, is_key| _mm256_or_si256(keys, _mm256_xor_si256(is_key, _mm256_set1_epi32(-1)));
    if count <= WIDTH as i32 {
        // SAFETY: only the integers themselves are read and written.
        unsafe {
            let sorted = sort_eight(filled(_mm256_maskload_epi32(keys, is_key), is_key));
            _mm256_maskstore_epi32(keys, is_key, sorted);
        }
        return;
    }
    let is_second = _mm256_cmpgt_epi32(_mm256_set1_epi32(count - WIDTH as i32), place);
    // SAFETY: there are at least eight integers, and of those behind them only the integers themselves are read and written.
    unsafe {
        let first = sort_eight(_mm256_loadu_si256(keys.cast()));
        let second = sort_eight(filled(_mm256_maskload_epi32(keys.add(WIDTH), is_second), is_second));
        let backwards = _mm256_permutevar8x32_epi32(second, _mm256_setr_epi32(7, 6, 5, 4, 3, 2, 1, 0));
        _mm256_storeu_si256(keys.cast(), merge(_mm256_min_epu32(first, backwards)));
        _mm256_maskstore_epi32(keys.add(WIDTH), is_second, merge(_mm256_max_epu32(first, backwards)));
    }
}

/// Sorts the integers of a register.
#[inline]
#[target_feature(enable = "avx2")]
fn sort_eight(x: __m256i) -> __m256i {
    let x = exchange::<0b1010_1010>(x, _mm256_shuffle_epi32::<0b10_11_00_01>(x));
    let x = exchange::<0b1100_1100>(x, _mm256_shuffle_epi32::<0b00_01_10_11>(x));
    let x = exchange::<0b1010_1010>(x, _mm256_shuffle_epi32::<0b10_11_00_01>(x));
    let backwards = _mm256_permutevar8x32_epi32(x, _mm256_setr_epi32(7, 6, 5, 4, 3, 2, 1, 0));
    let x = exchange::<0b1111_0000>(x, backwards);
    let x = exchange::<0b1100_1100>(x, _mm256_shuffle_epi32::<0b01_00_11_10>(x));
    exchange::<0b1010_1010>(x, _mm256_shuffle_epi32::<0b10_11_00_01>(x))
}

/// Sorts a bitonic register.
#[inline]
#[target_feature(enable = "avx2")]
fn merge(x: __m256i) -> __m256i {
    let x = exchange::<0b1111_0000>(x, _mm256_permute2x128_si256::<0x01>(x, x));
    let x = exchange::<0b1100_1100>(x, _mm256_shuffle_epi32::<0b01_00_11_10>(x));
    exchange::<0b1010_1010>(x, _mm256_shuffle_epi32::<0b10_11_00_01>(x))
}

/// Compares integers with those of their partners; places of `GREATER` keep the greater one.
#[inline]
#[target_feature(enable = "avx2")]
fn exchange<const GREATER: i32>(x: __m256i, partners: __m256i) -> __m256i {
    _mm256_blend_epi32::<GREATER>(_mm256_min_epu32(x, partners), _mm256_max_epu32(x, partners))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random::Random;

    #[test]
    fn sorts_any_few_integers() {
        if !is_x86_feature_detected!("avx2") {
            return println!("this processor has no AVX2, and uses no network");
        }
        // A network sorts all integers if it sorts all zeros and ones (Knuth).
        for count in 0..=MOST {
            for bits in 0..1u32 << count {
                // The integers behind the slice stay.
                let mut keys: [u32; MOST] = std::array::from_fn(|i| (bits >> i & 1) * u32::MAX);
                keys[count..].fill(7);
                // SAFETY: the processor has AVX2.
                unsafe { sort(&mut keys[..count]) };
                assert!(keys[..count].is_sorted() && keys[count..].iter().all(|&key| key == 7), "{count} {bits:b}");
                assert_eq!(keys[..count].iter().filter(|&&key| key > 0).count(), bits.count_ones() as usize);
            }
        }
        let mut random = Random::new(4);
        for case in 0..2_000 {
            let mut keys: Vec<u32> = (0..case % (MOST + 1)).map(|_| random.below(1 << 32) as u32).collect();
            let mut expected = keys.clone();
            expected.sort_unstable();
            // SAFETY: as above.
            unsafe { sort(&mut keys) };
            assert_eq!(keys, expected);
        }
    }
}
