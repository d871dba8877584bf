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
}
