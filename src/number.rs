//! Numbers for people.

/// A number with seven digits or so.
pub fn number(value: f64) -> String {
    digits(value, 7)
}

/// A number with so many digits, fewer where they would be zeros.
pub fn digits(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return format!("{value}");
    }
    if value == 0.0 {
        // Of a negative zero, too.
        return "0".to_owned();
    }
    let after_first = digits.saturating_sub(1);
    if !plain(value) {
        let text = format!("{value:.after_first$e}");
        return match text.split_once('e') {
            Some((mantissa, exponent)) => format!("{}e{exponent}", without_zeros(mantissa)),
            None => text,
        };
    }
    let decimals = (after_first as i32 - value.abs().log10().floor() as i32).clamp(0, 12) as usize;
    without_zeros(&format!("{value:.decimals$}")).to_owned()
}

/// A number with the fewest digits that give the same `f64`.
pub fn exact(value: f64) -> String {
    if plain(value) || !value.is_finite() { format!("{value}") } else { format!("{value:e}") }
}

/// A coordinate with seven digits or so of an extent: with more than seven where it is far from the origin.
pub fn coordinate(value: f64, extent: f64) -> String {
    let more = (value.abs() / extent).log10().ceil() - 1.0;
    // No value has more digits than 17.
    let more = if more.is_finite() { more.clamp(0.0, 10.0) as usize } else { 0 };
    digits(value, 7 + more)
}

/// Two bounds with seven digits or so, the lower one rounded down and the upper one up, except by what `f64` rounds.
pub fn outwards([lower, upper]: [f64; 2]) -> [String; 2] {
    let away = |bound: f64, sign: f64| {
        let text = number(bound);
        let beyond = sign * (text.parse().unwrap_or(bound) - bound);
        if beyond >= -1e-12 * bound.abs() || !bound.is_finite() {
            return text;
        }
        let last = bound.abs().log10().floor() - 6.0;
        let last = if plain(bound) { last.min(0.0) } else { last };
        // Half of the last digit farther, the nearest number is the next one.
        number(bound + sign * 0.5 * 10f64.powf(last))
    };
    [away(lower, -1.0), away(upper, 1.0)]
}

/// A number with seven digits or so, rounded up, except by what `f64` rounds.
pub fn rounded_up(value: f64) -> String {
    let [_, above] = outwards([value, value]);
    above
}

/// A decimal number without zeros at its end.
pub fn without_zeros(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

/// Returns whether a number is readable without an exponent.
pub fn plain(value: f64) -> bool {
    value == 0.0 || (1e-4..1e9).contains(&value.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_no_redundant_zeros() {
        assert_eq!([0.0, -0.0, 0.5, -2.0, 7.772e-15].map(number), ["0", "0", "0.5", "-2", "7.772e-15"]);
        assert_eq!([1e9, 1.25e10].map(number), ["1e9", "1.25e10"]);
    }

    #[test]
    fn coordinates_far_from_the_origin_have_more_digits() {
        assert_eq!([0.123_456_789, 1e9, 1_000_000_001.0].map(exact), ["0.123456789", "1e9", "1.000000001e9"]);
        assert_eq!([0.123_456_789, 12.345_678_9, 0.0].map(|at| coordinate(at, 10.0)), ["0.1234568", "12.34568", "0"]);
        assert_eq!(coordinate(1_000_000_000.5, 1.0), "1.0000000005e9");
        assert_eq!([f64::NAN, 1e300].map(|at| coordinate(at, 0.0)), ["NaN", "1e300"]);
    }

    #[test]
    fn bounds_of_seven_digits_are_rounded_outwards() {
        assert_eq!(outwards([0.0, 1000.0]), ["0", "1000"]);
        assert_eq!(outwards([1.0 / 3.0, 2.0 / 3.0]), ["0.3333333", "0.6666667"]);
        assert_eq!(outwards([2.0 / 3.0, 4.0 / 3.0]), ["0.6666666", "1.333334"]);
        assert_eq!(outwards([1.234_567_89e-7, 9_999_999.9]), ["1.234567e-7", "10000000"]);
        assert_eq!(outwards([12_345_678.6, 123_456_789.4]), ["12345678", "123456790"]);
        assert_eq!(outwards([-1.0 / 3.0, 1.234_567_81e9]), ["-0.3333334", "1.234568e9"]);
        // The sum is a little above 0.3.
        assert_eq!(outwards([0.3, 0.1 + 0.2]), ["0.3", "0.3"]);
        assert_eq!(outwards([0.0, f64::INFINITY]), ["0", "inf"]);
    }
}
