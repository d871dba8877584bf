//! Numbers for people.

/// A number with seven digits or so.
pub fn number(value: f64) -> String {
    digits(value, 7)
}

/// A number with so many digits, fewer where they would be zeros.
pub fn digits(value: f64, digits: usize) -> String {
    if !value.is_finite() || value == 0.0 {
        return format!("{value}");
    }
    let after_first = digits.saturating_sub(1);
    if !plain(value) {
        return format!("{value:.after_first$e}");
    }
    let decimals = (after_first as i32 - value.abs().log10().floor() as i32).clamp(0, 12) as usize;
    let text = format!("{value:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// Whether a number reads well without an exponent.
pub fn plain(value: f64) -> bool {
    value == 0.0 || (1e-4..1e9).contains(&value.abs())
}
