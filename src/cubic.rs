//! Volumes as they are typed: `5` in cubic units of the file, or `5mm3`, `5 mm³`, `0.2ml`.

use std::fmt;
use std::str::FromStr;

use crate::Error;
use crate::mesh::LengthUnit;
use crate::unit;

/// A volume that was typed, with a unit or in the cubed unit of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct TypedVolume {
    /// The number.
    pub value: f64,
    /// Its own unit, in cubic nanometres, with its symbol.
    unit: Option<(f64, String)>,
}

/// Share of a converted volume within which the true one lies: of fewer than eight roundings.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

impl TypedVolume {
    /// Returns a volume in the cubed unit of the file.
    pub fn without_unit(value: f64) -> TypedVolume {
        TypedVolume { value, unit: None }
    }

    /// Returns the least and the greatest volume in a cubed unit that it may be after rounding.
    ///
    /// # Errors
    /// A volume with a unit where that of the inputs is not known; `what` names the option.
    pub fn in_cubed(&self, unit: Option<LengthUnit>, what: &str) -> Result<[f64; 2], Error> {
        let Some((own, symbol)) = &self.unit else { return Ok([self.value; 2]) };
        let Some(unit) = unit else {
            return Err(Error::input(format!(
                "{what} {self}: the input states no unit, so {symbol} cannot be converted; state the unit of its coordinates \
                 (--unit mm, say), or give the volume in its cube, without its name"
            )));
        };
        let value = self.value * own / cubed(unit);
        let error = ROUNDING * value.abs();
        Ok([value - error, value + error])
    }
}

fn cubed(unit: LengthUnit) -> f64 {
    unit::nanometres(unit).powi(3)
}

/// Returns a unit of volume in cubic nanometres: a litre, a part of it, or the cube of a unit of length.
fn cubic_nanometres(text: &str) -> Result<f64, String> {
    const LITRE: f64 = 1e24;
    let lower = text.to_lowercase();
    let litres = match lower.as_str() {
        "l" | "litre" | "litres" | "liter" | "liters" => Some(LITRE),
        "dl" => Some(1e-1 * LITRE),
        "cl" => Some(1e-2 * LITRE),
        "ml" | "cc" => Some(1e-3 * LITRE),
        // MICRO SIGN and GREEK SMALL LETTER MU.
        "ul" | "\u{b5}l" | "\u{3bc}l" => Some(1e-6 * LITRE),
        _ => None,
    };
    let length = ["^3", "³", "3"].into_iter().find_map(|power| lower.strip_suffix(power));
    match (litres, length.map(|length| unit::parse(length.trim()))) {
        (Some(litres), _) => Ok(litres),
        (None, Some(Ok(length))) => Ok(cubed(length)),
        (None, _) => Err("units of volume are mm3 (or mm³), um3, cm3, m3, in3, ft3, and l, dl, cl, ml, ul".to_owned()),
    }
}

/// As it was typed.
impl fmt::Display for TypedVolume {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.value, self.unit.as_ref().map_or("", |(_, symbol)| symbol))
    }
}

impl FromStr for TypedVolume {
    type Err = String;

    fn from_str(text: &str) -> Result<TypedVolume, String> {
        let text = text.trim();
        let mut ends = text.char_indices().map(|(at, c)| at + c.len_utf8()).rev();
        // The longest start that is a number; a unit may end with a digit.
        let number = ends.find_map(|end| Some((end, text[..end].trim_end().parse::<f64>().ok()?)));
        let (end, value) = number
            .filter(|(_, value)| value.is_finite())
            .ok_or("a volume is a number, with a unit or without: 5, 5mm3, 0.2ml")?;
        let symbol = text[end..].trim();
        let unit = match symbol {
            "" => None,
            _ => Some((cubic_nanometres(symbol)?, symbol.to_owned())),
        };
        Ok(TypedVolume { value, unit })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn in_mm(text: &str) -> f64 {
        let [least, most] = text.parse::<TypedVolume>().unwrap().in_cubed(Some(LengthUnit::Millimetre), "V").unwrap();
        assert!(least <= most && most - least <= 1e-14 * most.abs());
        0.5 * (least + most)
    }

    #[test]
    fn volumes_are_read_with_or_without_a_unit() {
        for text in
            ["5", "5mm3", " 5 mm³", "5 mm^3", "5e0mm3", "0.005ml", "5µl", "5 ul", "5e9um3", "0.005 cm3", "5e-6l"]
        {
            assert!((in_mm(text) - 5.0).abs() < 1e-14, "{text}: {}", in_mm(text));
        }
        assert!((in_mm("2 in3") - 32_774.128).abs() < 1e-9);
        assert_eq!(in_mm("-1e-3"), -1e-3);
        for wrong in ["", "mm3", "5mm", "5 mm2", "5 furlong3", "inf", "NaN", "1,5ml", "5 3"] {
            assert!(wrong.parse::<TypedVolume>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_volume_with_a_unit_needs_that_of_the_file() {
        let volume: TypedVolume = "0.1ml".parse().unwrap();
        let error = volume.in_cubed(None, "--assert-below").unwrap_err();
        assert!(error.to_string().starts_with("--assert-below 0.1ml: the input states no unit"), "{error}");
        assert_eq!("0.1".parse::<TypedVolume>().unwrap().in_cubed(None, "--assert-below"), Ok([0.1; 2]));
    }
}
