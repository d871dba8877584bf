//! Placements as they are typed: `translate(1,0,0) rotate(0,0,1,30) scale(2)`, applied left to right. Translations may have
//! units: `translate(1mm,0,0)`.

use std::fmt;
use std::str::FromStr;

use glam::{DAffine3, DMat3, DVec3};

use crate::length::Length;
use crate::mesh::LengthUnit;
use crate::{excerpt, length, unit};

/// A placement that was typed: a map of file coordinates, and beside it the part of the translation that was typed with
/// units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    map: DAffine3,
    /// In nanometres.
    shift: DVec3,
    /// A unit that was typed.
    unit: Option<LengthUnit>,
}

impl Placement {
    const NONE: Placement = Placement { map: DAffine3::IDENTITY, shift: DVec3::ZERO, unit: None };

    /// Returns the map from file coordinates to placed ones, for a file in a unit.
    pub fn map(&self, unit: Option<LengthUnit>) -> Result<DAffine3, String> {
        let mut map = self.map;
        match (unit, self.unit) {
            (_, None) => {}
            (Some(unit), Some(_)) => map.translation += self.shift / unit::nanometres(unit),
            (None, Some(typed)) => return Err(length::no_unit("the placement", typed)),
        }
        Ok(map)
    }

    /// Returns the placement followed by a step.
    fn then(self, step: Placement) -> Placement {
        Placement {
            map: step.map * self.map,
            shift: step.map.matrix3 * self.shift + step.shift,
            unit: self.unit.or(step.unit),
        }
    }

    fn is_finite(&self) -> bool {
        let determinant = self.map.matrix3.determinant();
        self.map.is_finite() && self.shift.is_finite() && determinant != 0.0 && determinant.is_finite()
    }
}

impl From<DAffine3> for Placement {
    fn from(map: DAffine3) -> Placement {
        Placement { map, ..Placement::NONE }
    }
}

/// A problem of a placement and the character at which it occurs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlacementError {
    text: String,
    /// The character, from 0.
    at: usize,
    problem: String,
}

impl fmt::Display for PlacementError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let PlacementError { text, at, problem } = self;
        write!(f, "at character {}: {problem}\n{}", at + 1, excerpt::pointing_at(text, *at))
    }
}

impl std::error::Error for PlacementError {}

impl FromStr for Placement {
    type Err = PlacementError;

    fn from_str(text: &str) -> Result<Placement, PlacementError> {
        let characters: Vec<char> = text.chars().collect();
        let mut reader = Reader { characters: &characters, at: 0 };
        let mut placement = Placement::NONE;
        let result = (|| {
            reader.skip_space();
            if reader.peek().is_none() {
                return Err((0, format!("the placement is empty; {FORMS}")));
            }
            while reader.peek().is_some() {
                // Steps apply from left to right.
                placement = placement.then(reader.step()?);
                reader.skip_space();
                if reader.peek() == Some(',') || reader.peek() == Some(';') {
                    return Err((reader.at, "separate the steps by spaces only".to_owned()));
                }
            }
            match placement.is_finite() {
                true => Ok(placement),
                false => Err((0, "the combined steps overflow".to_owned())),
            }
        })();
        result.map_err(|(at, problem)| PlacementError { text: text.to_owned(), at, problem })
    }
}

const FORMS: &str = "steps are translate(x,y,z), rotate(axis x,axis y,axis z,degrees), scale(s) and scale(x,y,z)";

/// A character and the problem there.
type Fault = (usize, String);

struct Reader<'a> {
    characters: &'a [char],
    at: usize,
}

impl Reader<'_> {
    fn peek(&self) -> Option<char> {
        self.characters.get(self.at).copied()
    }

    fn skip_space(&mut self) {
        while self.peek().is_some_and(char::is_whitespace) {
            self.at += 1;
        }
    }

    fn take_while(&mut self, accept: impl Fn(char) -> bool) -> String {
        let start = self.at;
        while self.peek().is_some_and(&accept) {
            self.at += 1;
        }
        self.characters[start..self.at].iter().collect()
    }

    fn found(&self) -> String {
        self.peek().map_or("the end".to_owned(), |c| format!("`{c}`"))
    }

    /// One `name(number, …)`. The numbers of a translation may have units.
    fn step(&mut self) -> Result<Placement, Fault> {
        let start = self.at;
        let name = self.take_while(|c| c.is_alphanumeric() || c == '_');
        if !["translate", "rotate", "scale"].contains(&name.as_str()) {
            let what = if name.is_empty() { self.found() } else { format!("`{name}`") };
            return Err((start, format!("{what} is not a step; {FORMS}")));
        }
        self.skip_space();
        if self.peek() != Some('(') {
            return Err((self.at, format!("expected `(` after {name}, found {}", self.found())));
        }
        self.at += 1;
        let mut lengths = Vec::new();
        loop {
            self.skip_space();
            let at = self.at;
            let length = self.length()?;
            if length.unit.is_some() && name != "translate" {
                return Err((at, format!("`{length}` has a unit, but {name} takes plain numbers")));
            }
            lengths.push(length);
            self.skip_space();
            match self.peek() {
                Some(',') => self.at += 1,
                Some(')') => break,
                _ => return Err((self.at, format!("expected `,` or `)`, found {}", self.found()))),
            }
        }
        self.at += 1;
        let numbers: Vec<f64> = lengths.iter().map(|length| length.value).collect();
        let map = match (name.as_str(), numbers.as_slice()) {
            ("translate", [_, _, _]) => return Ok(translation([lengths[0], lengths[1], lengths[2]])),
            ("scale", &[s]) => scaling(DVec3::splat(s)),
            ("scale", &[x, y, z]) => scaling(DVec3::new(x, y, z)),
            ("rotate", &[x, y, z, degrees]) => rotation(DVec3::new(x, y, z), degrees),
            (_, numbers) => {
                let wanted = match name.as_str() {
                    "translate" => "three lengths",
                    "rotate" => "four numbers, an axis and degrees",
                    _ => "one number or three",
                };
                Err(format!("{name} takes {wanted}, and {} are given", numbers.len()))
            }
        };
        map.map(Placement::from).map_err(|problem| (start, problem))
    }

    fn length(&mut self) -> Result<Length, Fault> {
        let start = self.at;
        let text = self.take_while(|c| c.is_alphanumeric() || "+-._\"'".contains(c));
        match text.parse::<Length>() {
            Ok(length) if length.value.is_finite() => Ok(length),
            _ if text.is_empty() => Err((start, format!("expected a number, found {}", self.found()))),
            Err(problem) if text.starts_with(|c: char| c.is_ascii_digit()) => {
                Err((start, format!("`{text}`: {problem}")))
            }
            _ => Err((start, format!("`{text}` is not a finite number"))),
        }
    }
}

/// A translation by lengths in file units, and by those that have units of their own.
fn translation(lengths: [Length; 3]) -> Placement {
    let of = |length: Length| match length.unit {
        None => (length.value, 0.0),
        Some(unit) => (0.0, length.value * unit::nanometres(unit)),
    };
    let [x, y, z] = lengths.map(of);
    Placement {
        map: DAffine3::from_translation(DVec3::new(x.0, y.0, z.0)),
        shift: DVec3::new(x.1, y.1, z.1),
        unit: lengths.iter().find_map(|length| length.unit),
    }
}

fn scaling(factors: DVec3) -> Result<DAffine3, String> {
    match factors.to_array().iter().all(|&f| f != 0.0) {
        true => Ok(DAffine3::from_scale(factors)),
        false => Err("a scale of 0 would leave no solid".to_owned()),
    }
}

/// The rotation about an axis through the origin, counter-clockwise seen from the axis' tip.
fn rotation(axis: DVec3, degrees: f64) -> Result<DAffine3, String> {
    let largest = axis.abs().max_element();
    if largest == 0.0 {
        return Err("an axis of (0,0,0) has no direction".to_owned());
    }
    // Scaled first, so that a very long or short axis has a length.
    let axis = (axis / largest).normalize();
    let (sin, cos) = sin_cos_degrees(degrees);
    let cross = DMat3::from_cols(
        DVec3::new(0.0, axis.z, -axis.y),
        DVec3::new(-axis.z, 0.0, axis.x),
        DVec3::new(axis.y, -axis.x, 0.0),
    );
    let outer = DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
    Ok(DAffine3::from_mat3(DMat3::IDENTITY * cos + cross * sin + outer * (1.0 - cos)))
}

/// Sine and cosine, exact for whole quarter turns, so that a box turned by 90° is still a box.
fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    let turned = degrees.rem_euclid(360.0);
    let quarter = (turned / 90.0).round();
    let (sin, cos) = (turned - 90.0 * quarter).to_radians().sin_cos();
    match quarter as u32 % 4 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(text: &str, point: [f64; 3]) -> [f64; 3] {
        text.parse::<Placement>().unwrap().map(None).unwrap().transform_point3(point.into()).to_array()
    }

    #[test]
    fn translations_use_their_own_unit_or_that_of_the_file() {
        let placement: Placement = "translate(1mm, 2, 0.5in) scale(2) translate(1,0,-1mm)".parse().unwrap();
        let at = |unit| placement.map(Some(unit)).unwrap().transform_point3(DVec3::ZERO).to_array();
        assert_eq!(at(LengthUnit::Millimetre), [3.0, 4.0, 24.4]);
        assert_eq!(at(LengthUnit::Micrometre), [2001.0, 4.0, 24400.0]);
        assert!(placement.map(None).unwrap_err().contains("--unit mm"));
        assert_eq!(
            "translate(0.1mm,0,0)"
                .parse::<Placement>()
                .unwrap()
                .map(Some(LengthUnit::Millimetre))
                .unwrap()
                .translation
                .x,
            0.1
        );
        let error = "scale(2mm)".parse::<Placement>().unwrap_err();
        assert_eq!((error.at, error.problem.as_str()), (6, "`2mm` has a unit, but scale takes plain numbers"));
    }

    #[test]
    fn steps_apply_from_left_to_right() {
        assert_eq!(place("translate(1,0,0) scale(2)", [0.0; 3]), [2.0, 0.0, 0.0]);
        assert_eq!(place("scale(2) translate(1,0,0)", [0.0; 3]), [1.0, 0.0, 0.0]);
        assert_eq!(place("translate(1,0,0)rotate(0,0,1,90)", [0.0; 3]), [0.0, 1.0, 0.0]);
        assert_eq!(place(" scale( 1, 2 ,-3e0 ) ", [1.0; 3]), [1.0, 2.0, -3.0]);
    }

    #[test]
    fn quarter_turns_are_exact() {
        for (degrees, to) in [(90, [-2.0, 1.0, 3.0]), (-90, [2.0, -1.0, 3.0]), (540, [-1.0, -2.0, 3.0])] {
            assert_eq!(place(&format!("rotate(0,0,7,{degrees})"), [1.0, 2.0, 3.0]), to);
        }
        let [x, y, _] = place("rotate(0,0,1,30)", [1.0, 0.0, 0.0]);
        assert!((x - 0.75f64.sqrt()).abs() < 1e-15 && (y - 0.5).abs() < 1e-15);
    }

    #[test]
    fn errors_in_long_text_show_the_surroundings_of_the_fault() {
        let text = format!("{}spin(3){}", "scale(1) ".repeat(10_000), " scale(1)".repeat(100));
        let said = text.parse::<Placement>().unwrap_err().to_string();
        let lines: Vec<&str> = said.lines().collect();
        assert!(lines[0].starts_with("at character 90001: `spin`"), "{said}");
        assert!(lines[1].starts_with("    … ") && lines[1].ends_with(" …") && lines[1].chars().count() < 130);
        let caret = lines[2].chars().count() - 1;
        assert!(lines[1].chars().skip(caret).collect::<String>().starts_with("spin(3)"), "{said}");
    }

    #[test]
    fn errors_give_the_position_of_the_fault() {
        let fault = |text: &str| {
            let error = text.parse::<Placement>().unwrap_err();
            (error.at, error.problem)
        };
        assert_eq!(fault("translate(1,0,x)"), (14, "`x` is not a finite number".into()));
        assert_eq!(fault("translate(1,0"), (13, "expected `,` or `)`, found the end".into()));
        let furlong = "`1furlong`: units are mm, um (or µm), cm, m, in and ft";
        assert_eq!(fault("translate(0,1furlong,0)"), (12, furlong.into()));
        assert_eq!(fault("scale(1) spin(3)").0, 9);
        assert_eq!(fault("scale(0)").0, 0);
        assert_eq!(fault("scale(1,2)"), (0, "scale takes one number or three, and 2 are given".into()));
        assert_eq!(fault("scale(inf)"), (6, "`inf` is not a finite number".into()));
        assert_eq!(fault("scale(2), scale(3)"), (8, "separate the steps by spaces only".into()));
        assert_eq!(fault("rotate(0,0,0,30)").1, "an axis of (0,0,0) has no direction");
        assert_eq!(fault("").0, 0);
        assert_eq!(fault("scale(1e200) scale(1e200)").0, 0);
        assert!(
            "scale(1, )".parse::<Placement>().unwrap_err().to_string().ends_with("\n    scale(1, )\n             ^")
        );
    }
}
