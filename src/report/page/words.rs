//! Text of numbers and missing values on a page.

use super::plot::svg::escaped;
use crate::number;
use crate::report::quantity::{Quantity, Unit};
use crate::report::scaffold_report::{Metric, Status};

/// The placeholder of a missing number.
pub const NOTHING: &str = "–";
/// Digits of a value without a known error.
const DIGITS: usize = 4;
/// Digits of an error.
const ERROR_DIGITS: i32 = 2;
/// Most digits of a value with an error: an error of 1e-12 does not justify twelve decimals.
const MOST_DIGITS: i32 = 6;

/// Formats a number with `digits` significant digits, and a power of ten where it would be long.
pub fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return if value == f64::INFINITY { "∞".to_owned() } else { NOTHING.to_owned() };
    }
    if number::plain(value) {
        return minus(&number::digits(value, digits));
    }
    let text = number::digits(value, digits);
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    format!("{} × 10{}", minus(mantissa), exponent.chars().map(superscript).collect::<String>())
}

/// Replaces hyphens by minus signs, which are as wide as a digit, and removes the sign of zero.
pub fn minus(text: &str) -> String {
    match text.strip_prefix('-') {
        Some(zero) if zero.chars().all(|c| matches!(c, '0' | '.')) => zero.to_owned(),
        _ => text.replace('-', "−"),
    }
}

fn superscript(c: char) -> char {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    c.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize])
}

/// Formats a value without its unit; whole numbers keep all their digits.
pub fn value(value: f64, unit: &Unit) -> String {
    let scaled = value * unit.scale_for_people();
    match unit.quantity {
        Quantity::Number if scaled.fract() == 0.0 && scaled.abs() < 1e9 => grouped(scaled),
        _ => significant(scaled, DIGITS),
    }
}

/// Formats a whole number with grouped thousands.
fn grouped(value: f64) -> String {
    let digits = format!("{:.0}", value.abs());
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        // Four digits are not grouped.
        if i > 0 && (digits.len() - i) % 3 == 0 && digits.len() > 4 {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    if value < 0.0 { format!("−{text}") } else { text }
}

/// Formats a count with grouped thousands.
pub fn count(count: u64) -> String {
    grouped(count as f64)
}

/// Formats a value with its unit: `0.213 mm`, `71.2 %`, `−4`.
pub fn with_unit(value: f64, unit: &Unit) -> String {
    let text = self::value(value, unit);
    let symbol = unit.for_people();
    match symbol.as_str() {
        "" => text,
        "°" => text + "°",
        symbol => format!("{text}\u{a0}{symbol}"),
    }
}

/// Formats a value and its estimated error, with the decimals that the error justifies, without their unit.
pub fn with_error(value: f64, error: Option<f64>, unit: &Unit) -> String {
    let scale = unit.scale_for_people();
    let Some(error) = error.map(|error| (error * scale).abs()).filter(|&error| error > 0.0 && error.is_finite()) else {
        return self::value(value, unit);
    };
    let scaled = value * scale;
    let size = scaled.abs().max(error);
    if !number::plain(size) || !scaled.is_finite() {
        return format!("{} ± {}", significant(scaled, DIGITS), significant(error, ERROR_DIGITS as usize));
    }
    let decimals = ERROR_DIGITS - 1 - error.log10().floor() as i32;
    let most = MOST_DIGITS - 1 - size.log10().floor() as i32;
    let decimals_shown = decimals.min(most).clamp(0, 9) as usize;
    // An error that would round to 0 has its own digits.
    let error = match decimals > most {
        true => significant(error, 1),
        false => format!("{error:.decimals_shown$}"),
    };
    format!("{} ± {error}", minus(&format!("{scaled:.decimals_shown$}")))
}

/// Formats `bounds LOWER to UPPER` without the unit; an unknown end is `–`.
pub fn bounds(lower: Option<f64>, upper: Option<f64>, unit: &Unit) -> Option<String> {
    let end = |end: Option<f64>| end.map_or(NOTHING.to_owned(), |end| value(end, unit));
    (lower.is_some() || upper.is_some()).then(|| format!("bounds {} to {}", end(lower), end(upper)))
}

/// Returns the reason why a metric has no value.
pub fn reason(metric: &Metric) -> String {
    match metric.warnings.as_slice() {
        [] => match metric.status {
            Status::NotResolved => "not resolved: the raster is too coarse".to_owned(),
            Status::NotApplicable => "does not apply to this solid".to_owned(),
            Status::Measured => "no finite value".to_owned(),
        },
        warnings => warnings.join("; "),
    }
}

/// Formats a symbol as HTML: the part after the first space or `_` is a subscript.
pub fn symbol(symbol: &str) -> String {
    match symbol.split_once([' ', '_']) {
        Some((base, below)) => format!("{}<sub>{}</sub>", escaped(base), escaped(below)),
        None => escaped(symbol),
    }
}

/// Formats an optional value with its unit.
pub fn maybe(value: Option<f64>, unit: &Unit) -> String {
    match value {
        Some(value) if value.is_finite() => with_unit(value, unit),
        _ => NOTHING.to_owned(),
    }
}

/// Formats seconds in ms, s or min.
pub fn seconds(seconds: f64) -> String {
    match seconds {
        s if s < 0.9995 => format!("{:.0}\u{a0}ms", 1e3 * s),
        s if s < 119.5 => format!("{}\u{a0}s", number::digits(s, 3)),
        s => format!("{:.0}\u{a0}min {:.0}\u{a0}s", (s.round() / 60.0).floor(), s.round() % 60.0),
    }
}

#[cfg(test)]
mod tests {
    use crate::mesh::LengthUnit;

    use super::*;

    #[test]
    fn numbers_have_the_digits_they_deserve() {
        let mm = Quantity::Length(1).of(Some(LengthUnit::Millimetre));
        let share = Quantity::Share.of(None);
        let number = Quantity::Number.of(None);
        assert_eq!(with_unit(0.213_456_7, &mm), "0.2135\u{a0}mm");
        assert_eq!(with_unit(0.7, &share), "70\u{a0}%");
        assert_eq!(with_unit(-27.0, &number), "−27");
        assert_eq!(value(1_234_567.0, &number), "1\u{202f}234\u{202f}567");
        assert_eq!(value(1234.0, &number), "1234");
        assert_eq!(significant(3.2e-9, 3), "3.2 × 10⁻⁹");
        assert_eq!(significant(f64::INFINITY, 3), "∞");
        assert_eq!(significant(f64::NAN, 3), NOTHING);
        assert_eq!([significant(-0.0, 3), value(-0.0, &number), minus("-0.00")], ["0", "0", "0.00"]);
        assert_eq!(with_error(-1e-4, Some(0.02), &mm), "0.000 ± 0.020");
    }

    #[test]
    fn an_error_decides_the_decimals() {
        let mm = Quantity::Length(1).of(None);
        assert_eq!(with_error(0.213_456, Some(0.001_23), &mm), "0.2135 ± 0.0012");
        assert_eq!(with_error(0.7, Some(0.004), &Quantity::Share.of(None)), "70.00 ± 0.40");
        assert_eq!(with_error(1234.5, Some(31.0), &mm), "1234 ± 31");
        assert_eq!(with_error(0.5, Some(1e-9), &mm), "0.500000 ± 1 × 10⁻⁹");
        assert_eq!(with_error(0.5, Some(0.0), &mm), "0.5");
        assert_eq!(with_error(2.5e-7, Some(1.2e-8), &mm), "2.5 × 10⁻⁷ ± 1.2 × 10⁻⁸");
    }

    #[test]
    fn symbols_have_subscripts() {
        assert_eq!(symbol("φ_open"), "φ<sub>open</sub>");
        assert_eq!(symbol("Tb.Th p1"), "Tb.Th<sub>p1</sub>");
        assert_eq!(symbol("a<b"), "a&lt;b");
    }

    #[test]
    fn bounds_may_be_open() {
        let share = Quantity::Share.of(None);
        assert_eq!(bounds(Some(0.1), Some(0.2), &share).unwrap(), "bounds 10 to 20");
        assert_eq!(bounds(Some(0.1), None, &share).unwrap(), "bounds 10 to –");
        assert_eq!(bounds(None, None, &share), None);
    }
}
