//! Quantities and units of the values of a report: pure numbers, shares and powers of a length.

use std::fmt;

use serde::{Serialize, Serializer};

use crate::mesh::LengthUnit;
use crate::unit;

/// The kind of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// A pure number.
    Number,
    /// A part of a whole, from 0 to 1; shown in percent.
    Share,
    /// A power of a length: 1, 2 for areas, −3 for a density of connections.
    Length(i8),
}

/// A quantity and, for powers of a length, the unit of length, if known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unit {
    pub quantity: Quantity,
    pub length: Option<LengthUnit>,
}

impl Quantity {
    /// Returns the unit of this quantity in a solid whose coordinates are in `length`.
    pub fn of(self, length: Option<LengthUnit>) -> Unit {
        Unit { quantity: self, length }
    }
}

impl Unit {
    /// Returns the symbol for readers: `mm²`, `1/µm`, `%`; empty for pure numbers. Lengths in coordinates of an unknown unit
    /// are in `units`.
    pub fn for_people(&self) -> String {
        match self.quantity {
            Quantity::Number => String::new(),
            Quantity::Share => "%".to_owned(),
            Quantity::Length(power) => {
                let symbol = match self.length {
                    Some(LengthUnit::Micrometre) => "µm",
                    Some(unit) => unit.symbol(),
                    None => "units",
                };
                let exponent = match power.unsigned_abs() {
                    2 => "²",
                    3 => "³",
                    4 => "⁴",
                    5 => "⁵",
                    _ => "",
                };
                format!("{}{symbol}{exponent}", if power < 0 { "1/" } else { "" })
            }
        }
    }

    /// Returns the factor that converts a value in this unit to another one; `None` if the two do not convert.
    pub fn factor_to(&self, other: &Unit) -> Option<f64> {
        match (self.quantity, self.length, other.length) {
            _ if self.quantity != other.quantity => None,
            (Quantity::Length(_), from, to) if from == to => Some(1.0),
            (Quantity::Length(power), Some(from), Some(to)) => Some(unit::factor(from, to).powi(power.into())),
            (Quantity::Length(_), ..) => None,
            _ => Some(1.0),
        }
    }

    /// Returns the factor of a value in its text for readers.
    pub fn scale_for_people(&self) -> f64 {
        match self.quantity {
            Quantity::Share => 100.0,
            _ => 1.0,
        }
    }
}

/// The form for programs, in ASCII: `mm^2`, `1/um`; `1` for numbers and shares; empty if the length is unknown.
impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.quantity, self.length) {
            (Quantity::Number | Quantity::Share, _) => f.write_str("1"),
            (Quantity::Length(_), None) => Ok(()),
            (Quantity::Length(power), Some(unit)) => {
                let over = if power < 0 { "1/" } else { "" };
                match power.unsigned_abs() {
                    1 => write!(f, "{over}{}", unit.symbol()),
                    size => write!(f, "{over}{}^{size}", unit.symbol()),
                }
            }
        }
    }
}

/// The text for programs; null if the length is unknown.
impl Serialize for Unit {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match (self.quantity, self.length) {
            (Quantity::Length(_), None) => serializer.serialize_none(),
            _ => serializer.collect_str(self),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_written_for_people_and_for_machines() {
        let mm = Some(LengthUnit::Millimetre);
        let cases = [
            (Quantity::Number.of(mm), "", "1"),
            (Quantity::Share.of(mm), "%", "1"),
            (Quantity::Length(1).of(mm), "mm", "mm"),
            (Quantity::Length(2).of(mm), "mm²", "mm^2"),
            (Quantity::Length(-1).of(Some(LengthUnit::Micrometre)), "1/µm", "1/um"),
            (Quantity::Length(-3).of(mm), "1/mm³", "1/mm^3"),
            (Quantity::Length(3).of(None), "units³", ""),
        ];
        for (unit, people, machines) in cases {
            assert_eq!((unit.for_people().as_str(), unit.to_string().as_str()), (people, machines));
        }
        assert_eq!(serde_json::to_value(Quantity::Length(2).of(None)).unwrap(), serde_json::Value::Null);
        let area = |unit| Quantity::Length(2).of(unit);
        assert_eq!(area(mm).factor_to(&area(Some(LengthUnit::Micrometre))), Some(1e6));
        assert_eq!(area(mm).factor_to(&area(None)), None);
        assert_eq!(area(None).factor_to(&area(None)), Some(1.0));
        assert_eq!(area(mm).factor_to(&Quantity::Length(1).of(mm)), None);
        assert_eq!(serde_json::to_value(Quantity::Share.of(None)).unwrap(), "1");
    }
}
