//! Units of length, as they are typed, converted and printed.

use crate::mesh::LengthUnit;
use crate::number::digits;

/// Reads a unit by its symbol or its English name, in capitals or not; µ is either of the two letters that look like it.
pub fn parse(text: &str) -> Result<LengthUnit, String> {
    match text.to_lowercase().as_str() {
        // MICRO SIGN and GREEK SMALL LETTER MU.
        "um" | "\u{b5}m" | "\u{3bc}m" | "micron" | "microns" | "micrometre" | "micrometres" | "micrometer"
        | "micrometers" => Ok(LengthUnit::Micrometre),
        "mm" | "millimetre" | "millimetres" | "millimeter" | "millimeters" => Ok(LengthUnit::Millimetre),
        "cm" | "centimetre" | "centimetres" | "centimeter" | "centimeters" => Ok(LengthUnit::Centimetre),
        "m" | "metre" | "metres" | "meter" | "meters" => Ok(LengthUnit::Metre),
        "in" | "inch" | "inches" | "\"" => Ok(LengthUnit::Inch),
        "ft" | "foot" | "feet" | "'" => Ok(LengthUnit::Foot),
        _ => Err("units are mm, um (or µm), cm, m, in and ft".to_owned()),
    }
}

/// Returns the number of units `to` in one unit `from`: the nearest f64, exact for whole numbers.
pub fn factor(from: LengthUnit, to: LengthUnit) -> f64 {
    nanometres(from) / nanometres(to)
}

/// A length in another unit: rounded twice at most, and back to itself where the units are the same.
pub fn convert(length: f64, from: LengthUnit, to: LengthUnit) -> f64 {
    length * nanometres(from) / nanometres(to)
}

/// Returns a length as text, of four digits, with its unit: `0.3125 mm`.
pub fn rounded(length: f64, unit: Option<LengthUnit>) -> String {
    format!("{}{}", digits(length, 4), suffix(unit, 1))
}

/// Returns the length of a unit in nanometres, a whole number.
pub fn nanometres(unit: LengthUnit) -> f64 {
    match unit {
        LengthUnit::Micrometre => 1e3,
        LengthUnit::Millimetre => 1e6,
        LengthUnit::Centimetre => 1e7,
        LengthUnit::Inch => 25.4e6,
        LengthUnit::Foot => 304.8e6,
        LengthUnit::Metre => 1e9,
    }
}

/// A power of a unit for people: ` mm³`, with the space before it, and nothing where no unit is known.
pub fn suffix(unit: Option<LengthUnit>, power: u32) -> String {
    let Some(unit) = unit else { return String::new() };
    let symbol = match unit {
        LengthUnit::Micrometre => "µm",
        unit => unit.symbol(),
    };
    let exponent = match power {
        2 => "²",
        3 => "³",
        4 => "⁴",
        5 => "⁵",
        _ => "",
    };
    format!(" {symbol}{exponent}")
}

/// A power of a unit for machines, in ASCII: `mm^3`.
pub fn symbol(unit: LengthUnit, power: u32) -> String {
    match power {
        1 => unit.symbol().to_owned(),
        _ => format!("{}^{power}", unit.symbol()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_unicode_micro_signs_are_read() {
        assert_eq!(parse("\u{b5}m"), Ok(LengthUnit::Micrometre));
        assert_eq!(parse("\u{3bc}m"), Ok(LengthUnit::Micrometre));
        assert!(parse("miles").is_err());
    }

    #[test]
    fn units_are_read_by_symbol_and_name_in_any_case() {
        for text in ["mm", "MM", "Mm", "Millimeters", "millimetre"] {
            assert_eq!(parse(text), Ok(LengthUnit::Millimetre), "{text}");
        }
        for text in ["in", "IN", "inch", "Inches", "\""] {
            assert_eq!(parse(text), Ok(LengthUnit::Inch), "{text}");
        }
        for text in ["um", "UM", "µM", "micron", "Micrometers"] {
            assert_eq!(parse(text), Ok(LengthUnit::Micrometre), "{text}");
        }
        assert_eq!((parse("M"), parse("feet")), (Ok(LengthUnit::Metre), Ok(LengthUnit::Foot)));
    }

    #[test]
    fn factors_are_exact_where_representable() {
        assert_eq!(factor(LengthUnit::Metre, LengthUnit::Micrometre), 1e6);
        assert_eq!(factor(LengthUnit::Inch, LengthUnit::Millimetre), 25.4);
        assert_eq!(factor(LengthUnit::Foot, LengthUnit::Inch), 12.0);
    }

    #[test]
    fn units_are_printed_with_their_power() {
        assert_eq!(suffix(Some(LengthUnit::Micrometre), 3), " µm³");
        assert_eq!(suffix(None, 3), "");
        assert_eq!(symbol(LengthUnit::Millimetre, 3), "mm^3");
        assert_eq!(symbol(LengthUnit::Millimetre, 1), "mm");
    }
}
