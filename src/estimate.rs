//! Values with errors and units.

use std::fmt;

use crate::driver::certainty::{Side, Verdict};
use crate::driver::measured::{Method, Volume};
use crate::mesh::LengthUnit;
use crate::number::{number, outwards, plain};
use crate::unit;

/// Rounding of an exact value, as a share of it, that the digits of [`number`] show.
const NOTICED: f64 = 1e-7;

/// A value, its error and its unit. `Display` prints only the digits that the error makes significant: `317.118 ± 0.094 mm³`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Estimate {
    /// The value, in `unit` to the power of `power`.
    pub value: f64,
    /// The rounding bound of an exact value; for an estimate, an error estimate, which is not a bound.
    pub error: f64,
    /// The method.
    pub method: Method,
    /// The least and the greatest value that the inputs, and certified bounds, allow; of an exact value, that its rounding allows.
    pub possible: [f64; 2],
    /// Certified bounds: the value is proved to lie between them. `None` unless [`Settings::bounds`](crate::Settings::bounds)
    /// requests them.
    pub bounds: Option<[f64; 2]>,
    /// The unit of length, where it is known.
    pub unit: Option<LengthUnit>,
    /// The power of the unit: 3 for a volume.
    pub power: u32,
    is_unresolved: bool,
}

impl Estimate {
    pub(crate) fn of_volume(volume: &Volume, unit: Option<LengthUnit>) -> Estimate {
        let &Volume { value, error, method, possible, .. } = volume;
        Estimate { value, error, method, possible, bounds: None, unit, power: 3, is_unresolved: volume.is_unresolved() }
    }

    /// Returns whether the certified bounds prove that the value is below a limit; undecided without bounds.
    pub fn is_below(&self, limit: f64) -> Verdict {
        self.bounds.map_or(Verdict::Undecided, |bounds| Verdict::of(Side::Below, bounds, [limit; 2]))
    }

    /// Returns whether the certified bounds prove that the value is above a limit; undecided without bounds.
    pub fn is_above(&self, limit: f64) -> Verdict {
        self.bounds.map_or(Verdict::Undecided, |bounds| Verdict::of(Side::Above, bounds, [limit; 2]))
    }

    /// Returns whether no ray met the result, so that only `possible` is known.
    pub fn is_unresolved(&self) -> bool {
        self.is_unresolved
    }
}

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = unit::suffix(self.unit, self.power);
        if self.is_unresolved {
            let [least, greatest] = outwards(self.possible);
            return write!(f, "at least {least} and at most {greatest}{unit}: not resolved");
        }
        match self.method {
            Method::Exact => {
                let within = if is_noticed([self.value, self.error]) { " within rounding" } else { "" };
                write!(f, "{} (exact{within})", exact_text([self.value, self.error], self.unit, self.power))
            }
            Method::Estimate(_) => {
                let (value, error) = with_error(self.value, self.error);
                write!(f, "{value} ± {error}{unit}")
            }
        }
    }
}

/// Returns an exact value with its unit, and with the bound of its rounding where the digits show it.
pub fn exact_text([value, rounding]: [f64; 2], unit: Option<LengthUnit>, power: u32) -> String {
    let unit = unit::suffix(unit, power);
    if !is_noticed([value, rounding]) {
        return format!("{}{unit}", number(value));
    }
    let (value, rounding) = with_error(value, rounding);
    format!("{value} ± {rounding}{unit}")
}

/// Returns whether the digits of an exact value show its rounding.
fn is_noticed([value, rounding]: [f64; 2]) -> bool {
    rounding > NOTICED * value
}

/// Returns a value with the digits that its error makes significant, and the error with two digits.
pub fn with_error(value: f64, error: f64) -> (String, String) {
    // The rounding of f64 is not an error worth stating.
    let error = if error <= 4.0 * f64::EPSILON * value.abs() { 0.0 } else { error };
    if !(error > 0.0 && error.is_finite() && value.is_finite()) {
        return (number(value), number(error));
    }
    // The number of decimals at which the error has two digits.
    let digits = 1 - error.log10().floor() as i32;
    let is_plain = plain(value.abs().max(error)) && digits >= -3;
    if is_plain && digits <= 9 {
        let digits = digits.max(0) as usize;
        return (format!("{value:.digits$}"), format!("{error:.digits$}"));
    }
    let error = format!("{error:.1e}");
    if value == 0.0 {
        return ("0".to_owned(), error);
    }
    if is_plain {
        // Not more than f64 has.
        let digits = digits.min(15 - value.abs().log10().floor() as i32) as usize;
        return (format!("{value:.digits$}"), error);
    }
    let significant = (value.abs().log10().floor() as i32 + digits).clamp(1, 15) as usize;
    (format!("{value:.significant$e}"), error)
}

/// Returns two bounds with the digits that their distance makes significant: the lower one rounded down, the upper one up.
pub fn rounded_outwards([lower, upper]: [f64; 2]) -> [String; 2] {
    let width = upper - lower;
    let digits = 1.0 - width.log10().floor();
    let unit = 10f64.powf(-digits.max(0.0));
    if !(width > 0.0 && plain(lower) && plain(upper) && unit > 1e-14 * upper && digits <= 12.0) {
        // Where f64 has few more digits: the shortest texts that denote the same numbers.
        let shortest = |bound: f64| if plain(bound) { format!("{bound}") } else { format!("{bound:e}") };
        return [shortest(lower), shortest(upper)];
    }
    let digits = digits.max(0.0) as usize;
    // The nearest number with so many digits, or its neighbour beyond.
    let outwards = |bound: f64, sign: f64| {
        let text = format!("{bound:.digits$}");
        let nearest: f64 = text.parse().unwrap_or(bound);
        match sign * (nearest - bound) >= 0.0 {
            true => text,
            false => format!("{:.digits$}", (nearest + sign * unit).max(0.0)),
        }
    };
    [outwards(lower, -1.0), outwards(upper, 1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(value: f64, error: f64) -> String {
        let (value, error) = with_error(value, error);
        format!("{value} ± {error}")
    }

    #[test]
    fn values_have_the_digits_that_their_error_makes_significant() {
        assert_eq!(written(523.598_776, 0.0123), "523.599 ± 0.012");
        assert_eq!(written(523_598.776, 123.0), "523599 ± 123");
        assert_eq!(written(1.5e-30, 2.5e-33), "1.5000e-30 ± 2.5e-33");
        assert_eq!(written(8.0, 0.0), "8 ± 0");
        assert_eq!(written(27.0, 8.9e-16), "27 ± 0");
        assert_eq!(written(0.0, 0.0), "0 ± 0");
        assert_eq!(written(0.0, 1.4e-5), "0 ± 1.4e-5");
        assert_eq!(written(2.5e20, 1.0e17), "2.5000e20 ± 1.0e17");
        assert_eq!(written(4_171.995_755_484_972, 4.2e-9), "4171.9957554850 ± 4.2e-9");
        assert_eq!(written(0.1234, 2.0e-13), "0.12340000000000 ± 2.0e-13");
        assert_eq!(written(1234.5, 2.0e-12), "1234.500000000000 ± 2.0e-12");
        assert_eq!(written(0.0, 2.0e-13), "0 ± 2.0e-13");
        assert_eq!(written(1.234_567_890_123e-5, 1.2e-16), "1.234567890123e-5 ± 1.2e-16");
    }

    #[test]
    fn bounds_are_rounded_outwards() {
        assert_eq!(rounded_outwards([1.234_567, 1.298_765]), ["1.234", "1.299"]);
        assert_eq!(rounded_outwards([0.0, 0.125]), ["0.00", "0.13"]);
        assert_eq!(rounded_outwards([2.0, 2.0]), ["2", "2"]);
        assert_eq!(rounded_outwards([0.1, 0.1f64.next_up()]), ["0.1", "0.10000000000000002"]);
        assert_eq!(rounded_outwards([0.0, 0.0]), ["0", "0"]);
        assert_eq!(rounded_outwards([0.0, 7.006_492_321_624_092e-46]), ["0", "7.006492321624092e-46"]);
        let mut random = crate::testing::random::Random::new(5);
        for _ in 0..10_000 {
            let lower = random.share() * 10f64.powi(random.between(-6, 10));
            let upper = lower + random.share() * 10f64.powi(random.between(-12, 10));
            let [low, high] = rounded_outwards([lower, upper]).map(|text| text.parse::<f64>().unwrap());
            assert!(low <= lower && upper <= high, "{lower} {upper} {low} {high}");
            assert!(high - low <= 1.5 * (upper - lower) + 1e-12, "{lower} {upper} {low} {high}");
        }
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!(number(8.0), "8");
        assert_eq!(number(0.1), "0.1");
        assert_eq!(number(123_456_789.0), "123456789");
        assert_eq!(number(-1.0 / 3.0), "-0.3333333");
        assert_eq!(number(1e-7), "1e-7");
        assert_eq!(number(f64::NAN), "NaN");
    }
}
