//! Warnings about units: a unit that is given against the one that the file states, and sizes that speak for another unit.

use std::path::Path;

use glam::DVec3;

use crate::Warning;
use crate::mesh::LengthUnit;
use crate::number::digits;
use crate::unit;

/// Sides in metres: the longest side of a model is rarely shorter than the first or longer than the second.
const PLAUSIBLE: [f64; 2] = [1e-4, 10.0];

/// Numbers that no unit makes strange: models have been drawn in every unit with sides of this many of it.
const COMMON_NUMBERS: [f64; 2] = [0.1, 1e4];

/// Says that a file's own unit stands against the one that was given, and what the model measures in both.
pub fn unit_ignored(path: &Path, own: Option<LengthUnit>, given: Option<LengthUnit>, extent: DVec3) -> Option<Warning> {
    let (own, given) = (own?, given?);
    let name = path.display();
    let message = format!(
        "{name}: the file states{}, and --unit{} is for files that state none: the model is {}, and would be {}; if that is \
         meant, `ldi-ops convert {name} -o FILE.stl` drops the unit, and --unit{} then gives it",
        unit::suffix(Some(own), 1),
        unit::suffix(Some(given), 1),
        sides(extent, own),
        sides(extent, given),
        unit::suffix(Some(given), 1),
    );
    (own != given).then(|| Warning::new("unit-ignored", message))
}

/// Says that a model is too small or too large to be in its unit, and which unit would fit; `given` is whether the user gave
/// the unit.
pub fn implausible(path: &Path, unit: Option<LengthUnit>, given: bool, extent: DVec3) -> Option<Warning> {
    let unit = unit?;
    let longest = extent.max_element();
    let metres = longest * unit.metres();
    let fitting = match () {
        _ if metres < PLAUSIBLE[0] && longest < COMMON_NUMBERS[0] => LengthUnit::Metre,
        _ if metres > PLAUSIBLE[1] && longest > COMMON_NUMBERS[1] => LengthUnit::Micrometre,
        _ if metres > PLAUSIBLE[1] && unit == LengthUnit::Metre => LengthUnit::Millimetre,
        _ => return None,
    };
    if longest == 0.0 || fitting == unit {
        return None;
    }
    let (name, symbol) = (path.display(), unit::symbol(fitting, 1));
    let way_out = match given {
        true => format!("did you mean --unit {symbol}?"),
        false => format!(
            "is the unit that the file states meant? `ldi-ops convert {name} -o FILE.stl` drops it, and --unit {symbol} then gives \
             another"
        ),
    };
    let message = format!("{name}: the model is {}; {way_out}", sides(extent, unit));
    Some(Warning::new("unit-implausible", message))
}

/// The sides of a box: `12 × 10 × 3 mm`.
fn sides(extent: DVec3, unit: LengthUnit) -> String {
    let [x, y, z] = extent.to_array().map(|side| digits(side, 3));
    format!("{x} × {y} × {z}{}", unit::suffix(Some(unit), 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(side: f64, unit: LengthUnit, given: bool) -> Option<String> {
        let extent = DVec3::new(side, side / 2.0, side / 4.0);
        implausible(Path::new("a.stl"), Some(unit), given, extent).map(|warning| warning.message)
    }

    #[test]
    fn sizes_that_speak_for_another_unit_are_asked_about() {
        let asked = message(0.05, LengthUnit::Millimetre, true).unwrap();
        assert!(asked.contains("the model is 0.05 × 0.025 × 0.0125 mm; did you mean --unit m?"), "{asked}");
        assert!(message(0.12, LengthUnit::Micrometre, true).is_none());
        assert!(message(0.012, LengthUnit::Micrometre, true).unwrap().contains("--unit m?"));
        assert!(message(25_000.0, LengthUnit::Millimetre, true).unwrap().contains("--unit um?"));
        assert!(message(120.0, LengthUnit::Metre, true).unwrap().contains("--unit mm?"));
        assert!(message(120.0, LengthUnit::Metre, false).unwrap().contains("convert a.stl -o FILE.stl"));
    }

    #[test]
    fn ordinary_sizes_in_every_unit_are_not_asked_about() {
        use LengthUnit::{Centimetre, Foot, Inch, Metre, Micrometre, Millimetre};
        let ordinary = [
            (3.0, Micrometre),
            (50_000.0, Micrometre),
            (0.5, Millimetre),
            (2000.0, Millimetre),
            (0.02, Centimetre),
            (0.1, Inch),
            (3.0, Foot),
            (0.05, Metre),
            (2.0, Metre),
        ];
        for (side, unit) in ordinary {
            assert_eq!(message(side, unit, true), None, "{side} {unit:?}");
        }
    }
}
