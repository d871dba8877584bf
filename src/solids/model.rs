//! The table of all solids by name, with parameters that have defaults and are given as text.

use std::fmt;
use std::str::FromStr;

use glam::DVec3;

use super::{
    Brush, GeodesicFrame, HyperboloidFrame, LatticeForm, LongBone, MinimalSurface, Organic, Part, Skull, SolidError,
    StrutLattice, StrutPattern, Surface, TorusKnot, TrabecularBone, Weave, chain, chain_mail, cuboid, cylinder, ell,
    geodesic, hollow_box, hyperboloid, sphere, star, torus,
};
use crate::length::Length;
use crate::mesh::{LengthUnit, TriangleMesh};
use crate::unit;

/// A solid and its parameters, ready to be built.
pub struct Model {
    kind: &'static ModelKind,
    recipe: Recipe,
    /// The parameters that have their default values.
    defaults: Vec<&'static Parameter>,
}

type Recipe = Box<dyn Fn() -> Result<TriangleMesh, SolidError> + Send + Sync>;

/// A parameter of a model, as a help text shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// The parameter's name.
    pub name: &'static str,
    /// The default value.
    pub default: &'static str,
    /// A description of one line.
    pub meaning: &'static str,
    /// True if its values are lengths, in millimetres.
    pub is_length: bool,
}

/// A model with its name, as a help text shows it.
#[derive(Clone, Copy, Debug)]
pub struct ModelKind {
    /// The model's name.
    pub name: &'static str,
    /// A description of one line.
    pub summary: &'static str,
    /// The parameters.
    pub parameters: &'static [Parameter],
    read: fn(&mut Values) -> Result<Recipe, SolidError>,
}

/// Declares a kind of model: its name, a summary, the expression that builds it from its parameters, and these: `length` for
/// lengths and `number` for all others, a name, a default and a meaning. Their types are those that the expression demands.
macro_rules! kind {
    ($name:literal, $summary:literal, $build:expr, [
        $($unit:ident $field:ident $(as $option:literal)? = $default:literal, $meaning:literal;)*
    ]) => {
        ModelKind {
            name: $name,
            summary: $summary,
            parameters: &[$(Parameter {
                name: kind!(@name $field $($option)?),
                default: $default,
                meaning: $meaning,
                is_length: kind!(@is_length $unit),
            }),*],
            read: |values| {
                $(let $field = values.next()?;)*
                Ok(Box::new(move || $build))
            },
        }
    };
    (@name $field:ident) => { stringify!($field) };
    (@name $field:ident $option:literal) => { $option };
    (@is_length length) => { true };
    (@is_length number) => { false };
}

/// Declares a kind of minimal surface.
macro_rules! minimal_surface {
    ($name:literal, $summary:literal, $surface:ident) => {
        kind!($name, $summary, {
            let part = minimal_part(part, wall, fraction);
            MinimalSurface { surface: Surface::$surface, part, cells, cell_size, resolution }.build()
        }, [
            number part = "sheet", "sheet: a wall along the surface; network: the solid on one side of it";
            length wall = "1", "mean thickness of a sheet, mm";
            number fraction = "0.5", "share of volume of a network";
            number cells = "4", "cells along the axes: one number, or three with commas";
            length cell_size as "cell-size" = "10", "side of a cell, mm";
            number resolution = "28", "grid cells along the side of a cell";
        ])
    };
}

/// Declares a kind of strut lattice.
macro_rules! strut_lattice {
    ($name:literal, $summary:literal, $pattern:ident) => {
        kind!($name, $summary, {
            let form = lattice_form(form, resolution, segments);
            StrutLattice { pattern: StrutPattern::$pattern, form, cells, cell_size, radius }.build()
        }, [
            number form = "union", "union: one surface; overlapping: a closed cylinder for each strut";
            length radius = "1", "radius of a strut, mm";
            number cells = "4", "cells along the axes: one number, or three with commas";
            length cell_size as "cell-size" = "10", "side of a cell, mm";
            number resolution = "32", "grid cells along the side of a cell of a union";
            number segments = "24", "segments round an overlapping strut";
        ])
    };
}

const KINDS: &[ModelKind] = &[
    kind!("cuboid", "box between two corners", cuboid(min, max), [
        length min = "-10,-10,-10", "least coordinates, mm";
        length max = "10,10,10", "greatest coordinates, mm";
    ]),
    kind!("ell", "L along z: a box that lacks one edge", ell(size, notch), [
        length size = "1,1,1", "sides of the box, mm";
        length notch = "0.5,0.5", "sides of what it lacks along x and y, mm: one number, or two with a comma";
    ]),
    kind!("hollow-box", "box with a closed box-shaped hollow", hollow_box(size, hollow), [
        length size = "20,20,20", "sides, mm";
        length hollow = "10,10,10", "sides of the hollow, mm";
    ]),
    kind!("sphere", "sphere of meridians and parallels", sphere(radius, segments), [
        length radius = "10", "radius, mm";
        number segments = "64", "segments round the axis";
    ]),
    kind!("geodesic", "sphere of even triangles from an icosahedron", geodesic(radius, frequency), [
        length radius = "10", "radius, mm";
        number frequency = "16", "parts into which an edge of the icosahedron is cut";
    ]),
    kind!("geodesic-frame", "geodesic sphere of bars, with a window in every triangle",
        GeodesicFrame { radius, frequency, window, depth }.build(), [
        length radius = "10", "radius, mm";
        number frequency = "6", "parts into which an edge of the icosahedron is cut";
        number window = "0.8", "sides of a window as a share of those of its face";
        length depth = "0.5", "depth of the bars towards the middle, mm";
    ]),
    kind!("star", "geodesic sphere with a spike on every face", star(radius, valley, frequency), [
        length radius = "10", "radius of the tips, mm";
        length valley = "4", "radius of the sphere between the spikes, mm";
        number frequency = "1", "parts into which an edge of the icosahedron is cut";
    ]),
    kind!("torus", "ring with a round section", torus(major, minor, around, across), [
        length major = "10", "radius of the middle line, mm";
        length minor = "3", "radius of the section, mm";
        number around = "96", "segments along the ring";
        number across = "32", "segments round the section";
    ]),
    kind!("cylinder", "round cylinder along z", cylinder(radius, height, segments), [
        length radius = "10", "radius, mm";
        length height = "20", "height, mm";
        number segments = "64", "segments round the axis";
    ]),
    kind!("hyperboloid", "solid inside a hyperboloid of one sheet, saddle-shaped on its side",
        hyperboloid(waist, rim, height, segments, zones), [
        length waist = "5", "radius in the middle, mm";
        length rim = "10", "radius at the ends, mm";
        length height = "20", "height, mm";
        number segments = "64", "segments round the axis";
        number zones = "32", "zones along the height";
    ]),
    kind!("hyperboloid-frame", "hyperboloid of two families of straight bars, with windows between them", {
        let crossings = frame_crossings(crossings, bars);
        HyperboloidFrame { waist, height, bars, crossings, window, depth }.build()
    }, [
        length waist = "5", "radius in the middle, mm";
        length height = "20", "height, mm";
        number bars = "24", "bars of either family";
        number crossings = "8",
            "crossings of a bar on either side of the waist, which set the rims; fewer by default below 18 bars";
        number window = "0.8", "sides of a window as a share of those of its face";
        length depth = "0.4", "depth of the bars across the surface, mm";
    ]),
    kind!("knot", "tube along a torus knot, by default a trefoil",
        TorusKnot { p, q, major, minor, tube, segments, sides }.build(), [
        number p = "2", "turns round the axis";
        number q = "3", "turns round the section of the torus";
        length major = "8", "radius of the torus' middle line, mm";
        length minor = "4", "radius of its section, mm";
        length tube = "1.6", "radius of the tube, mm";
        number segments = "60", "segments along the tube";
        number sides = "8", "segments round the tube";
    ]),
    kind!("chain", "interlocked rings along x that do not touch", chain(links, major, minor, around, across), [
        number links = "5", "number of rings";
        length major = "5", "radius of a ring's middle line, mm";
        length minor = "1", "radius of a ring's section, mm";
        number around = "64", "segments along a ring";
        number across = "24", "segments round its section";
    ]),
    kind!("chain-mail", "net of interlocked rings in the plane of x and y that do not touch",
        chain_mail(columns, rows, major, minor, around, across), [
        number columns = "4", "flat rings along x";
        number rows = "3", "flat rings along y";
        length major = "5", "radius of a ring's middle line, mm";
        length minor = "1", "radius of a ring's section, mm";
        number around = "64", "segments along a ring";
        number across = "24", "segments round its section";
    ]),
    kind!("weave", "layers of plain-woven cloth of round yarns that do not touch",
        Weave { yarns, layers, spacing, radius, gap, segments, steps }.build(), [
        number yarns = "8", "yarns side by side in x and in y: one number, or two with a comma";
        number layers = "1", "cloths one above the other";
        length spacing = "2", "distance between neighbouring yarns, mm";
        length radius = "0.3", "radius of a yarn, mm";
        length gap = "0.2", "least distance between crossing yarns, mm";
        number segments = "16", "segments round a yarn";
        number steps = "8", "segments of a yarn from crossing to crossing";
    ]),
    kind!("brush", "round bristles along z on a plate, one surface",
        Brush { bristles, spacing, radius, length, plate, resolution }.build(), [
        number bristles = "8", "bristles along x and y: one number, or two with a comma";
        length spacing = "2", "distance between neighbouring bristles, mm";
        length radius = "0.5", "radius of a bristle, mm";
        length length = "8", "length of a bristle, mm";
        length plate = "1", "thickness of the plate, mm";
        number resolution = "16", "grid cells from bristle to bristle";
    ]),
    minimal_surface!("gyroid", "scaffold along Schoen's gyroid, sheet or network, capped by its box", Gyroid),
    minimal_surface!(
        "primitive",
        "scaffold along Schwarz' primitive surface, sheet or network, capped by its box",
        Primitive
    ),
    minimal_surface!(
        "diamond",
        "scaffold along Schwarz' diamond surface, sheet or network, capped by its box",
        Diamond
    ),
    strut_lattice!("cubic", "lattice of struts along the axes", Cubic),
    strut_lattice!("bcc", "lattice of struts along the diagonals of its cells", BodyCentred),
    kind!("bone", "long bone in the likeness of a femur, along z",
        LongBone { length, girth, bow, resolution }.build(), [
        length length = "100", "length, mm";
        number girth = "1", "breadth in units of that of a femur of this length";
        number bow = "1", "bow of the shaft in units of that of a femur";
        number resolution = "200", "grid cells along the length";
    ]),
    kind!("trabecular", "block of trabecular bone, rods and plates without order, capped by its box",
        TrabecularBone { size, spacing, fraction, stretch, seed, resolution }.build(), [
        length size = "5,5,7", "sides of the block, mm";
        length spacing = "1", "distance from one trabecula across to the next, mm";
        number fraction = "0.35", "share of volume that is bone";
        number stretch = "1.5", "how much longer trabeculae are along z";
        number seed = "1", "picks one of many such bones";
        number resolution = "12", "grid cells along the spacing";
    ]),
    kind!("organic", "likeness of a sitting hare: lobes, limbs and a wavy skin",
        Organic { size, bumps, resolution }.build(), [
        length size = "20", "about its height, mm";
        number bumps = "1", "height of the waves on its skin in units of the usual";
        number resolution = "65", "grid cells along the height";
    ]),
    kind!("skull", "likeness of a skull: a thick shell with two eye sockets, a nose and a hole below",
        Skull { size, wall, resolution }.build(), [
        length size = "20", "about its length and height, mm";
        number wall = "0.08", "thickness of the shell as a share of the size";
        number resolution = "38", "grid cells along the size";
    ]),
];

impl ModelKind {
    /// Returns the text of a parameter with lengths in millimetres: `0.4` of `400um`. Other texts are returned as they are.
    pub fn in_millimetres(&self, name: &str, text: &str) -> String {
        let is_length = self.parameters.iter().any(|parameter| parameter.name == name && parameter.is_length);
        let one = |part: &str| match part.parse::<Length>() {
            Ok(Length { value, unit: Some(unit) }) if is_length => {
                unit::convert(value, unit, LengthUnit::Millimetre).to_string()
            }
            _ => part.to_owned(),
        };
        text.split(',').map(one).collect::<Vec<_>>().join(",")
    }
}

impl Model {
    /// Returns all models in the order in which a help text should list them.
    pub fn kinds() -> &'static [ModelKind] {
        KINDS
    }

    /// Returns the model of a name, with values for some of its parameters and defaults for the others. The last value
    /// counts where one is given twice.
    ///
    /// # Errors
    /// Fails for an unknown name of a model or a parameter, or a value that cannot be parsed. [`Model::build`] checks
    /// whether values are in range.
    pub fn from_parameters(kind: &str, values: &[(&str, &str)]) -> Result<Model, SolidError> {
        let names = |names: &mut dyn Iterator<Item = &'static str>| names.collect::<Vec<_>>().join(", ");
        let found = KINDS.iter().find(|k| k.name == kind).ok_or_else(|| SolidError::UnknownKind {
            kind: kind.to_owned(),
            known: names(&mut KINDS.iter().map(|k| k.name)),
        })?;
        for (name, _) in values {
            if !found.parameters.iter().any(|p| p.name == *name) {
                return Err(SolidError::UnknownParameter {
                    kind: found.name,
                    parameter: (*name).to_owned(),
                    known: names(&mut found.parameters.iter().map(|p| p.name)),
                });
            }
        }
        let mut values = Values { parameters: found.parameters.iter(), given: values, defaults: Vec::new() };
        let recipe = (found.read)(&mut values)?;
        Ok(Model { kind: found, recipe, defaults: values.defaults })
    }

    /// Builds the closed, outward-oriented mesh of the solid.
    ///
    /// # Errors
    /// Fails for a parameter that is out of range, or a mesh that would be too large; see the shape's own function or
    /// struct. The error names the defaults that take part in it.
    pub fn build(&self) -> Result<TriangleMesh, SolidError> {
        (self.recipe)().map_err(|error| {
            let is_named = |p: &&&Parameter| error.words().any(|word| word.replace('_', "-") == p.name);
            let named = self.defaults.iter().filter(is_named).map(|p| format!("--{} is {}", p.name, p.default));
            match named.collect::<Vec<_>>().join(" and ") {
                defaults if defaults.is_empty() => error,
                defaults => SolidError::Default { error: Box::new(error), defaults },
            }
        })
    }
}

impl fmt::Debug for Model {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Model").field("kind", &self.kind.name).field("defaults", &self.defaults).finish_non_exhaustive()
    }
}

/// The values of a model's parameters, one after another.
struct Values<'a> {
    parameters: std::slice::Iter<'static, Parameter>,
    given: &'a [(&'a str, &'a str)],
    /// The parameters so far that were not given.
    defaults: Vec<&'static Parameter>,
}

impl Values<'_> {
    /// Reads the value of the next parameter.
    fn next<T: Value>(&mut self) -> Result<T, SolidError> {
        let parameter = self.parameters.next().expect("models read their own parameters");
        let given = self.given.iter().rev().find(|(given, _)| *given == parameter.name);
        let text = given.map_or(parameter.default, |(_, text)| text);
        let value = T::parse(text).ok_or_else(|| SolidError::Unreadable {
            parameter: parameter.name,
            text: text.to_owned(),
            expected: T::EXPECTED,
        })?;
        if given.is_some() {
            return Ok(value);
        }
        self.defaults.push(parameter);
        Ok(value.into_default())
    }
}

/// A type of parameters' values.
trait Value: Sized {
    /// The form of the text.
    const EXPECTED: &'static str;

    fn parse(text: &str) -> Option<Self>;

    /// Returns the value where it is a default.
    fn into_default(self) -> Self {
        self
    }
}

macro_rules! values {
    ($($type:ty, $expected:literal, $parse:expr;)*) => {$(
        impl Value for $type {
            const EXPECTED: &'static str = $expected;

            fn parse(text: &str) -> Option<Self> {
                $parse(text)
            }
        }
    )*};
}

values! {
    f64, "a number", one;
    u32, "a whole number", one;
    DVec3, "three numbers with commas between them", |text| several(text).map(DVec3::from_array);
    [f64; 2], "a number, or two with a comma between them", one_or_several;
    [u32; 2], "a whole number, or two with a comma between them", one_or_several;
    [u32; 3], "a whole number, or three with commas between them", one_or_several;
    PartKind, "sheet or network", |text| match text {
        "sheet" => Some(PartKind::Sheet),
        "network" => Some(PartKind::Network),
        _ => None,
    };
    FormKind, "union or overlapping", |text| match text {
        "union" => Some(FormKind::Union),
        "overlapping" => Some(FormKind::Overlapping),
        _ => None,
    };
}

fn one<T: FromStr>(text: &str) -> Option<T> {
    text.trim().parse().ok()
}

/// Parses exactly `N` values with commas between them.
fn several<T: FromStr, const N: usize>(text: &str) -> Option<[T; N]> {
    let parts: Vec<T> = text.split(',').map(one).collect::<Option<_>>()?;
    parts.try_into().ok()
}

/// Parses one value that applies to all, or `N`.
fn one_or_several<T: FromStr + Copy, const N: usize>(text: &str) -> Option<[T; N]> {
    one(text).map(|value| [value; N]).or_else(|| several(text))
}

/// A whole number whose default gives way to other parameters.
#[derive(Clone, Copy)]
struct Count {
    value: u32,
    is_default: bool,
}

impl Value for Count {
    const EXPECTED: &'static str = u32::EXPECTED;

    fn parse(text: &str) -> Option<Count> {
        Some(Count { value: one(text)?, is_default: false })
    }

    fn into_default(self) -> Count {
        Count { is_default: true, ..self }
    }
}

/// Returns the crossings of the bars of a hyperboloid: by default so few that a bar turns by 80° at most from the waist to
/// a rim.
fn frame_crossings(crossings: Count, bars: u32) -> u32 {
    let most = if crossings.is_default { bars.saturating_mul(4) / 9 } else { u32::MAX };
    crossings.value.min(most)
}

#[derive(Clone, Copy)]
enum PartKind {
    Sheet,
    Network,
}

fn minimal_part(kind: PartKind, wall: f64, fraction: f64) -> Part {
    match kind {
        PartKind::Sheet => Part::Sheet { wall },
        PartKind::Network => Part::Network { fraction },
    }
}

#[derive(Clone, Copy)]
enum FormKind {
    Union,
    Overlapping,
}

fn lattice_form(kind: FormKind, resolution: u32, segments: u32) -> LatticeForm {
    match kind {
        FormKind::Union => LatticeForm::Union { resolution },
        FormKind::Overlapping => LatticeForm::Overlapping { segments },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::closure::assert_solid;

    #[test]
    fn every_kind_builds_from_its_defaults() {
        for kind in Model::kinds() {
            let small: &[(&str, &str)] = match kind.parameters {
                parameters if parameters.iter().any(|p| p.name == "cells") => &[("cells", "1")],
                _ => &[],
            };
            let model = Model::from_parameters(kind.name, small).unwrap();
            assert_solid(&model.build().unwrap());
            assert!(!kind.summary.is_empty() && !kind.summary.ends_with('.'));
        }
    }

    #[test]
    fn the_last_of_repeated_values_is_used() {
        let given = [("cells", "2, 3,4"), ("wall", "0.5"), ("part", "network"), ("wall", "0.7"), ("fraction", "0.3")];
        let expected = MinimalSurface {
            surface: Surface::Diamond,
            part: Part::Network { fraction: 0.3 },
            cells: [2, 3, 4],
            cell_size: 10.0,
            resolution: 28,
        };
        assert_eq!(Model::from_parameters("diamond", &given).unwrap().build(), expected.build());
        let form = [("form", "overlapping"), ("segments", "7")];
        let expected = StrutLattice {
            pattern: StrutPattern::BodyCentred,
            form: LatticeForm::Overlapping { segments: 7 },
            cells: [4; 3],
            cell_size: 10.0,
            radius: 1.0,
        };
        assert_eq!(Model::from_parameters("bcc", &form).unwrap().build(), expected.build());
    }

    #[test]
    fn errors_name_values_that_cannot_be_read() {
        let text = |kind: &str, values: &[(&str, &str)]| Model::from_parameters(kind, values).unwrap_err().to_string();
        assert!(
            text("ball", &[]).starts_with("there is no model `ball`; the models are cuboid, ell, hollow-box, sphere")
        );
        assert_eq!(
            text("sphere", &[("size", "1")]),
            "`sphere` has no parameter `size`; its parameters are radius, segments"
        );
        assert_eq!(text("sphere", &[("radius", "big")]), "radius is `big`, but must be a number");
        assert_eq!(text("sphere", &[("segments", "-3")]), "segments is `-3`, but must be a whole number");
        assert_eq!(
            text("cuboid", &[("min", "1,2")]),
            "min is `1,2`, but must be three numbers with commas between them"
        );
        assert_eq!(text("gyroid", &[("part", "wall")]), "part is `wall`, but must be sheet or network");
    }

    #[test]
    fn defaults_give_way_to_other_parameters() {
        let frame = |bars: &str| Model::from_parameters("hyperboloid-frame", &[("bars", bars)]).unwrap().build();
        let expected = |bars, crossings| {
            HyperboloidFrame { waist: 5.0, height: 20.0, bars, crossings, window: 0.8, depth: 0.4 }.build()
        };
        for (bars, crossings) in [(3, 1), (8, 3), (17, 7), (18, 8), (24, 8), (100, 8)] {
            assert_eq!(frame(&bars.to_string()), expected(bars, crossings), "{bars}");
        }
        assert!((3..100).all(|bars| frame(&bars.to_string()).is_ok()));
    }

    #[test]
    fn errors_name_the_defaults_that_take_part() {
        let text = |kind: &str, values: &[(&str, &str)]| {
            Model::from_parameters(kind, values).unwrap().build().unwrap_err().to_string()
        };
        assert_eq!(
            text("torus", &[("minor", "12")]),
            "minor is 12, but must be below the major radius 10; --major is 10 by default"
        );
        assert_eq!(
            text("cuboid", &[("min", "20,0,0")]),
            "max x is 10, but must be finite and above the least coordinate 20; --max is 10,10,10 by default"
        );
        assert_eq!(
            text("hyperboloid-frame", &[("bars", "8"), ("crossings", "8")]),
            "crossings is 8, but must be from 1 to 3"
        );
    }
}
