//! Warnings about units: `--unit` contradicts the file, or the size of a model suggests another unit.

use std::path::Path;

use glam::DVec3;

use crate::Warning;
use crate::mesh::LengthUnit;
use crate::number::digits;
use crate::unit;

/// Plausible range of the longest side of a model, in metres.
const PLAUSIBLE: [f64; 2] = [1e-4, 10.0];

/// Range of side lengths that are common in any unit and give no warning.
const COMMON_NUMBERS: [f64; 2] = [0.1, 1e4];

/// Returns a warning if a file states another unit than `--unit`, with the size of the model in both.
pub fn unit_ignored(path: &Path, own: Option<LengthUnit>, given: Option<LengthUnit>, extent: DVec3) -> Option<Warning> {
    let (own, given) = (own?, given?);
    let name = path.display();
    let message = format!(
        "{name}: the file states{}, so --unit{} is ignored: the model is {}, not {}; to change the unit, drop it with \
         `ldi-ops convert {name} -o FILE.stl`, then pass --unit{}",
        unit::suffix(Some(own), 1),
        unit::suffix(Some(given), 1),
        sides(extent, own),
        sides(extent, given),
        unit::suffix(Some(given), 1),
    );
    (own != given).then(|| Warning::new("unit-ignored", message))
}

/// Returns a warning if a model is implausibly small or large in its unit, with the unit that would fit. `given` is true if the
/// unit comes from the user.
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
            "the unit that the file states may be wrong; to change it, drop it with `ldi-ops convert {name} -o FILE.stl`, \
             then pass --unit {symbol} instead"
        ),
    };
    let message = format!("{name}: the model is {}; {way_out}", sides(extent, unit));
    Some(Warning::new("unit-implausible", message))
}

/// Returns the sides of a box as text: `12 × 10 × 3 mm`.
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
    fn implausible_sizes_suggest_another_unit() {
        let suggested = message(0.05, LengthUnit::Millimetre, true).unwrap();
        assert!(suggested.contains("the model is 0.05 × 0.025 × 0.0125 mm; did you mean --unit m?"), "{suggested}");
        assert!(message(0.12, LengthUnit::Micrometre, true).is_none());
        assert!(message(0.012, LengthUnit::Micrometre, true).unwrap().contains("--unit m?"));
        assert!(message(25_000.0, LengthUnit::Millimetre, true).unwrap().contains("--unit um?"));
        assert!(message(120.0, LengthUnit::Metre, true).unwrap().contains("--unit mm?"));
        assert!(message(120.0, LengthUnit::Metre, false).unwrap().contains("convert a.stl -o FILE.stl"));
    }

    #[test]
    fn ordinary_sizes_in_every_unit_give_no_warning() {
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
