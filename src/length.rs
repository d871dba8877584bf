//! Lengths as they are typed: `0.05` in file units, or `0.05mm`.

use std::fmt;
use std::str::FromStr;

use crate::Error;
use crate::mesh::LengthUnit;
use crate::unit;

/// A length that was typed, with a unit or in that of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Length {
    /// The number.
    pub value: f64,
    /// Its own unit.
    pub unit: Option<LengthUnit>,
}

impl Length {
    /// Returns the length in a unit.
    ///
    /// `what` names the option in the error: a length with a unit has no meaning where the unit of the file is not known.
    pub fn in_unit(self, unit: Option<LengthUnit>, what: &str) -> Result<f64, Error> {
        match (self.unit, unit) {
            (None, _) => Ok(self.value),
            (Some(own), Some(unit)) => Ok(unit::convert(self.value, own, unit)),
            (Some(own), None) => Err(Error::input(no_unit(&format!("{what} {self}"), own))),
        }
    }
}

/// Says that a length with a unit cannot be converted, as the unit of the input is not known.
pub fn no_unit(length: &str, own: LengthUnit) -> String {
    let symbol = unit::symbol(own, 1);
    format!(
        "{length}: the input states no unit, so {symbol} cannot be converted; state the unit of its coordinates (--unit mm, say), \
         or give the length in that unit, without its name"
    )
}

/// As it was typed.
impl fmt::Display for Length {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.value, self.unit.map_or("", LengthUnit::symbol))
    }
}

impl FromStr for Length {
    type Err = String;

    fn from_str(text: &str) -> Result<Length, String> {
        let text = text.trim();
        if let Ok(value) = text.parse() {
            return Ok(Length { value, unit: None });
        }
        // A unit follows the last digit: 1e-3m.
        let end = text.rfind(|c: char| c.is_ascii_digit() || c == '.').map_or(0, |last| last + 1);
        let (number, suffix) = text.split_at(end);
        let value = number.parse().map_err(|_| "a length is a number, with a unit or without: 0.05, 0.05mm, 50um")?;
        Ok(Length { value, unit: Some(unit::parse(suffix.trim())?) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_read_with_or_without_a_unit() {
        let read = |text: &str| text.parse::<Length>().map(|length| (length.value, length.unit));
        assert_eq!(read("0.05"), Ok((0.05, None)));
        assert_eq!(read("-1e-3"), Ok((-1e-3, None)));
        assert_eq!(read("0.1mm"), Ok((0.1, Some(LengthUnit::Millimetre))));
        assert_eq!(read(" 500 µm"), Ok((500.0, Some(LengthUnit::Micrometre))));
        assert_eq!(read("1e-3m"), Ok((1e-3, Some(LengthUnit::Metre))));
        assert_eq!(read("-.5IN"), Ok((-0.5, Some(LengthUnit::Inch))));
        for wrong in ["", "mm", "0.1h", "1 furlong", "1mm2", "1,5mm"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn lengths_convert_to_the_unit_of_the_file() {
        let length = |text: &str| text.parse::<Length>().unwrap();
        assert_eq!(length("500um").in_unit(Some(LengthUnit::Millimetre), "--radius"), Ok(0.5));
        assert_eq!(length("3in").in_unit(Some(LengthUnit::Inch), "--radius"), Ok(3.0));
        assert_eq!(length("0.3").in_unit(Some(LengthUnit::Metre), "--radius"), Ok(0.3));
        assert_eq!(length("0.3").in_unit(None, "--radius"), Ok(0.3));
        let error = length("0.1mm").in_unit(None, "--distance").unwrap_err();
        assert!(error.to_string().starts_with("--distance 0.1mm: the input states no unit"), "{error}");
    }
}
