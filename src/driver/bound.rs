//! The distance by which a surface may move, typed as `0.1h`, `0.02` or `20um`.

use std::str::FromStr;

use crate::Error;
use crate::length::Length;
use crate::mesh::LengthUnit;

/// A length, or zero, within which nothing moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// In pitches.
    Pitches(f64),
    /// In file units, or in its own unit.
    Length(Length),
}

impl Bound {
    /// The bound of meshes for which none is given.
    pub const DEFAULT: Bound = Bound::Pitches(0.05);

    /// No distance: all triangles stay.
    pub const ZERO: Bound = Bound::Pitches(0.0);

    /// Returns whether the surface may not move.
    pub fn is_zero(self) -> bool {
        let (Bound::Pitches(value) | Bound::Length(Length { value, .. })) = self;
        value == 0.0
    }

    /// Returns the bound in the unit of a raster's pitch.
    pub fn length(self, pitch: f64, unit: Option<LengthUnit>) -> Result<f64, Error> {
        match self {
            Bound::Pitches(share) => Ok(share * pitch),
            Bound::Length(length) => length.in_unit(unit, "--surface-error"),
        }
    }
}

impl FromStr for Bound {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Bound, &'static str> {
        const INVALID: &str =
            "expected a length: 0.1h for a tenth of the pitch, 0.02 in file units, 20um, or 0 for the full mesh";
        let is_pitches = |text: &str| text.trim_end().ends_with(|c: char| c.is_ascii_digit() || c == '.');
        let (number, bound): (&str, fn(Length) -> Bound) = match text.trim().strip_suffix('h') {
            Some(pitches) if is_pitches(pitches) => (pitches, |length| Bound::Pitches(length.value)),
            _ => (text, Bound::Length),
        };
        let length: Length = number.parse().map_err(|_| INVALID)?;
        let is_length = length.value >= 0.0 && length.value.is_finite();
        if is_length { Ok(bound(length)) } else { Err(INVALID) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_lengths_or_zero() {
        assert_eq!("0.1h".parse(), Ok(Bound::Pitches(0.1)));
        assert_eq!(" 2 h".parse(), Ok(Bound::Pitches(2.0)));
        assert_eq!("0.02".parse(), Ok(Bound::Length(Length { value: 0.02, unit: None })));
        let millimetres = Some(LengthUnit::Millimetre);
        assert_eq!("20um".parse::<Bound>().unwrap().length(3.0, millimetres), Ok(0.02));
        assert_eq!("1 inch".parse::<Bound>().unwrap().length(3.0, millimetres), Ok(25.4));
        assert!("20um".parse::<Bound>().unwrap().length(3.0, None).is_err());
        assert_eq!(Bound::Pitches(0.5).length(3.0, None), Ok(1.5));
        for zero in ["0", "0h", "0.0", "0mm", "0 h"] {
            assert!(zero.parse::<Bound>().unwrap().is_zero(), "{zero}");
        }
        assert!(!Bound::DEFAULT.is_zero());
        for wrong in ["-1", "h", "1hh", "-0.1h", "NaN", "inf", "infh"] {
            assert!(wrong.parse::<Bound>().is_err(), "{wrong}");
        }
    }
}
