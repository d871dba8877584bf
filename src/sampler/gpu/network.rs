//! A sorting network in WGSL: a fixed list of comparisons sorts a few crossings in registers, without loops in which the
//! invocations of a workgroup would wait for one another (Batcher, "Sorting networks and their applications", 1968).

use std::fmt::Write;

/// Most crossings that the network sorts.
pub const NETWORK: u32 = 32;

/// Returns the pairs of places that odd-even merge sort compares, in order; `size` is a power of two.
fn comparisons(size: u32) -> Vec<[u32; 2]> {
    let mut pairs = Vec::new();
    let mut merged = 1;
    while merged < size {
        let mut reach = merged;
        while reach > 0 {
            for first in (reach % merged..size - reach).step_by(2 * reach as usize) {
                for low in first..first + reach.min(size - first - reach) {
                    if low / (2 * merged) == (low + reach) / (2 * merged) {
                        pairs.push([low, low + reach]);
                    }
                }
            }
            reach /= 2;
        }
        merged *= 2;
    }
    pairs
}

/// Returns a function `sort_few`, which sorts crossings from a place on, at least one and at most [`NETWORK`]; coincident ones by
/// their triangles.
pub fn wgsl() -> String {
    let size = NETWORK;
    let mut text = "fn sort_few(first: u32, count: u32) {\n".to_owned();
    let mut line = |line: String| writeln!(text, "    {line}").expect("a string takes every line");
    for i in 0..size {
        // Behind the last there are greater ones than any.
        line(format!("var c{i} = 0xffffffffu; var t{i} = 0u;"));
        line(format!(
            "if {i}u < count {{ c{i} = crossings[first + {i}u]; if KEEPS_TRIANGLES {{ t{i} = crossed[first + {i}u]; }} }}"
        ));
    }
    line("var least = 0u; var behind = false;".to_owned());
    for [a, b] in comparisons(size) {
        line("if KEEPS_TRIANGLES {".to_owned());
        line(format!("behind = c{a} > c{b} || (c{a} == c{b} && t{a} > t{b});"));
        line(format!("least = select(t{a}, t{b}, behind); t{b} = select(t{b}, t{a}, behind); t{a} = least; }}"));
        line(format!("least = min(c{a}, c{b}); c{b} = max(c{a}, c{b}); c{a} = least;"));
    }
    for i in 0..size {
        line(format!(
            "if {i}u < count {{ crossings[first + {i}u] = c{i}; if KEEPS_TRIANGLES {{ crossed[first + {i}u] = t{i}; }} }}"
        ));
    }
    text + "}\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A network that sorts all sequences of zeros and ones sorts everything (Knuth, volume 3, theorem 5.3.4 Z).
    #[test]
    fn networks_sort_all_zeros_and_ones() {
        for (size, expected) in [(2, 1), (4, 5), (8, 19), (16, 63)] {
            let pairs = comparisons(size);
            assert_eq!(pairs.len(), expected, "{size}");
            for bits in 0..1_u32 << size {
                let sorted = pairs.iter().fold(bits, |bits, [a, b]| {
                    let [low, high] = [bits >> a & 1, bits >> b & 1];
                    bits & !(1 << a | 1 << b) | (low & high) << a | (low | high) << b
                });
                // All ones are at the end.
                let ones = bits.count_ones();
                let expected = if ones == 0 { 0 } else { (u32::MAX >> (32 - ones)) << (size - ones) };
                assert_eq!(sorted, expected, "{size}, {bits:b}");
            }
        }
    }

    #[test]
    fn the_largest_network_sorts_every_rotation_of_zeros_and_ones() {
        let pairs = comparisons(32);
        assert_eq!(pairs.len(), 191);
        for ones in 1..32 {
            for turn in 0..32 {
                let bits = (u32::MAX >> (32 - ones)).rotate_left(turn);
                let sorted = pairs.iter().fold(bits, |bits, [a, b]| {
                    let [low, high] = [bits >> a & 1, bits >> b & 1];
                    bits & !(1 << a | 1 << b) | (low & high) << a | (low | high) << b
                });
                assert_eq!(sorted, (u32::MAX >> (32 - ones)) << (32 - ones), "{ones}, {turn}");
            }
        }
    }
}
