//! Amounts as the user types them: a number with an optional unit.

use thiserror::Error;

use crate::mesh::LengthUnit;
use crate::report::quantity::Quantity;
use crate::unit;

/// A number with an optional unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Amount {
    /// The text as typed.
    text: String,
    value: f64,
    unit: TypedUnit,
}

/// The unit of an amount.
#[derive(Clone, Copy, Debug, PartialEq)]
enum TypedUnit {
    /// No unit: that of the metric.
    None,
    Percent,
    Length(LengthUnit, i8),
}

#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum AmountError {
    #[error("\"{0}\" is not a number")]
    NoNumber(String),
    #[error("\"{text}\" has the unknown unit \"{unit}\"; {known}, with powers as in mm^2 and 1/mm, and % for shares")]
    Unit { text: String, unit: String, known: String },
    #[error("\"{text}\" is not {wanted}")]
    Quantity { text: String, wanted: &'static str },
    #[error("{text} is not a share from 0 to 1; write percent as \"{text} %\"")]
    Share { text: String },
    #[error("\"{text}\" has a unit, but the solid has none; set --unit")]
    NoUnit { text: String },
}

impl Amount {
    /// Returns a number without a unit.
    pub fn plain(value: f64) -> Amount {
        Amount { text: value.to_string(), value, unit: TypedUnit::None }
    }

    /// Reads `0.6`, `60 %`, `300 um`, `3 mm^2`, `1.5 1/mm³`.
    pub fn parse(text: &str) -> Result<Amount, AmountError> {
        let trimmed = text.trim();
        // The longest prefix that parses is the number: three characters of `1e3 um`, one of `1em`.
        let ends = trimmed.char_indices().map(|(at, _)| at).chain([trimmed.len()]).rev();
        let (value, rest) = ends
            .filter_map(|end| Some((trimmed[..end].parse::<f64>().ok()?, trimmed[end..].trim())))
            .find(|(value, _)| value.is_finite())
            .ok_or_else(|| AmountError::NoNumber(text.to_owned()))?;
        let unit = typed_unit(rest).map_err(|known| AmountError::Unit {
            text: text.to_owned(),
            unit: rest.to_owned(),
            known,
        })?;
        Ok(Amount { text: trimmed.to_owned(), value, unit })
    }

    /// Returns the value in the unit of a metric of the given quantity, for a solid with coordinates in `solid`.
    pub fn in_unit(&self, quantity: Quantity, solid: Option<LengthUnit>) -> Result<f64, AmountError> {
        let text = || self.text.clone();
        match (self.unit, quantity) {
            (TypedUnit::None, Quantity::Share) if !(0.0..=1.0).contains(&self.value) => {
                Err(AmountError::Share { text: text() })
            }
            (TypedUnit::None, _) => Ok(self.value),
            (TypedUnit::Percent, Quantity::Share) => Ok(self.value / 100.0),
            (TypedUnit::Length(unit, typed), Quantity::Length(power)) if typed == power => {
                let solid = solid.ok_or_else(|| AmountError::NoUnit { text: text() })?;
                Ok(converted(self.value, unit, solid, power))
            }
            _ => Err(AmountError::Quantity { text: text(), wanted: wanted(quantity) }),
        }
    }
}

/// Converts a power of a length. Dividing by a whole factor makes 300 µm exactly 0.3 mm.
fn converted(value: f64, from: LengthUnit, to: LengthUnit, power: i8) -> f64 {
    let factor = unit::factor(from, to);
    let (factor, power) =
        if factor < 1.0 { (unit::factor(to, from), -i32::from(power)) } else { (factor, power.into()) };
    if power < 0 { value / factor.powi(-power) } else { value * factor.powi(power) }
}

fn wanted(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Number => "a pure number",
        Quantity::Share => "a share, from 0 to 1 or in %",
        Quantity::Length(1) => "a length",
        Quantity::Length(2) => "an area",
        Quantity::Length(3) => "a volume",
        Quantity::Length(-1) => "a number per length",
        Quantity::Length(-3) => "a number per volume",
        Quantity::Length(_) => "an amount in the power of a length that this metric has",
    }
}

fn typed_unit(text: &str) -> Result<TypedUnit, String> {
    match text {
        "" => return Ok(TypedUnit::None),
        "%" => return Ok(TypedUnit::Percent),
        _ => {}
    }
    let (over, text) = match text.strip_prefix("1/").or_else(|| text.strip_prefix('/')) {
        Some(rest) => (-1, rest.trim()),
        None => (1, text),
    };
    let end = text.find(|c: char| !c.is_alphabetic()).unwrap_or(text.len());
    let length = unit::parse(&text[..end])?;
    let power = match text[end..].trim() {
        "" | "^1" => 1,
        "²" | "^2" | "2" => 2,
        "³" | "^3" | "3" => 3,
        "⁻¹" | "^-1" => -1,
        "⁻²" | "^-2" => -2,
        "⁻³" | "^-3" => -3,
        _ => return Err("powers are ², ³, ^2 and ^3".to_owned()),
    };
    Ok(TypedUnit::Length(length, over * power))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn in_mm(text: &str, power: i8) -> Result<f64, AmountError> {
        Amount::parse(text)?.in_unit(Quantity::Length(power), Some(LengthUnit::Millimetre))
    }

    #[test]
    fn units_are_converted() {
        for (text, power, value) in [
            ("300 um", 1, 0.3),
            ("300\u{b5}m", 1, 0.3),
            ("300 \u{3bc}m", 1, 0.3),
            ("3e2 um", 1, 0.3),
            (" 2cm ", 1, 20.0),
            ("1 in", 1, 25.4),
            ("2 ft", 1, 609.6),
            ("1 cm²", 2, 100.0),
            ("5 mm^3", 3, 5.0),
            ("2 1/um", -1, 2000.0),
            ("4 mm⁻³", -3, 4.0),
            ("0.25", 1, 0.25),
        ] {
            assert_eq!(in_mm(text, power), Ok(value), "{text}");
        }
        assert_eq!(Amount::parse("60 %").unwrap().in_unit(Quantity::Share, None), Ok(0.6));
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        for text in ["", "mm", "inf", "nan mm", "- 3"] {
            assert!(matches!(Amount::parse(text), Err(AmountError::NoNumber(_))), "{text}");
        }
        for text in ["3 yards", "3 mm^9", "3 % mm", "3 µ", "1,5 mm"] {
            assert!(matches!(Amount::parse(text), Err(AmountError::Unit { .. })), "{text}");
        }
        assert!(matches!(in_mm("3 %", 1), Err(AmountError::Quantity { .. })));
        assert!(matches!(in_mm("3 mm", 2), Err(AmountError::Quantity { .. })));
        assert!(matches!(
            Amount::parse("3 mm").unwrap().in_unit(Quantity::Length(1), None),
            Err(AmountError::NoUnit { .. })
        ));
        assert!(matches!(Amount::parse("60").unwrap().in_unit(Quantity::Share, None), Err(AmountError::Share { .. })));
    }
}
