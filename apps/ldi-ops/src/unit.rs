//! Units of length, as they are typed, converted and printed.

use ldi_ops::mesh::LengthUnit;

/// Reads a unit: `mm`, `um`, `cm`, `m`, `in` or `ft`, and `µm` with either of the two letters that look like µ.
pub fn parse(text: &str) -> Result<LengthUnit, String> {
    match text {
        // MICRO SIGN and GREEK SMALL LETTER MU.
        "um" | "\u{b5}m" | "\u{3bc}m" => Ok(LengthUnit::Micrometre),
        "mm" => Ok(LengthUnit::Millimetre),
        "cm" => Ok(LengthUnit::Centimetre),
        "m" => Ok(LengthUnit::Metre),
        "in" => Ok(LengthUnit::Inch),
        "ft" => Ok(LengthUnit::Foot),
        _ => Err("units are mm, um (or µm), cm, m, in and ft".to_owned()),
    }
}

/// How many of `to` one of `from` is; the nearest f64, and exact where it is a whole number.
pub fn factor(from: LengthUnit, to: LengthUnit) -> f64 {
    nanometres(from) / nanometres(to)
}

fn nanometres(unit: LengthUnit) -> f64 {
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
    fn both_letters_of_micrometres_are_read() {
        assert_eq!(parse("\u{b5}m"), Ok(LengthUnit::Micrometre));
        assert_eq!(parse("\u{3bc}m"), Ok(LengthUnit::Micrometre));
        assert!(parse("miles").is_err());
    }

    #[test]
    fn factors_are_exact_where_they_can_be() {
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
