//! How far a simplified mesh may lie from what it was, as it is typed: `0.1h` or `0.02`.

use std::str::FromStr;

/// A length above zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// In pitches.
    Pitches(f64),
    /// In file units.
    Units(f64),
}

impl Bound {
    /// The bound in file units.
    pub fn length(self, pitch: f64) -> f64 {
        match self {
            Bound::Pitches(share) => share * pitch,
            Bound::Units(length) => length,
        }
    }
}

impl FromStr for Bound {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Bound, &'static str> {
        let (number, bound): (&str, fn(f64) -> Bound) = match text.trim().strip_suffix('h') {
            Some(pitches) => (pitches, Bound::Pitches),
            None => (text, Bound::Units),
        };
        match number.trim().parse::<f64>() {
            Ok(length) if length > 0.0 && length.is_finite() => Ok(bound(length)),
            _ => Err("a length above zero is wanted: 0.1h for a tenth of the pitch, or 0.02 in file units"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_lengths_above_zero() {
        assert_eq!("0.1h".parse(), Ok(Bound::Pitches(0.1)));
        assert_eq!(" 2 h".parse(), Ok(Bound::Pitches(2.0)));
        assert_eq!("0.02".parse(), Ok(Bound::Units(0.02)));
        assert_eq!(Bound::Pitches(0.5).length(3.0), 1.5);
        for wrong in ["0", "-1", "h", "0h", "1mm", "NaN", "inf"] {
            assert!(wrong.parse::<Bound>().is_err(), "{wrong}");
        }
    }
}
