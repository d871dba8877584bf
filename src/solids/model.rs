//! The catalogue of all solids by name, with parameters that have defaults and are given as text.

use glam::DVec3;

use super::{
    Brush, GeodesicFrame, HyperboloidFrame, LatticeForm, LongBone, MinimalSurface, Organic, Part, Skull, SolidError,
    StrutLattice, StrutPattern, Surface, TorusKnot, TrabecularBone, Weave, chain, chain_mail, cuboid, cylinder, ell,
    geodesic, hollow_box, hyperboloid, sphere, star, torus,
};
use crate::mesh::TriangleMesh;

/// A solid and its parameters, ready to be built.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Model {
    /// See [`cuboid`].
    Cuboid {
        /// Least coordinates.
        min: DVec3,
        /// Greatest coordinates.
        max: DVec3,
    },
    /// See [`ell`].
    Ell {
        /// Sides of the box.
        size: DVec3,
        /// Sides of the notch, along x and y.
        notch: [f64; 2],
    },
    /// See [`hollow_box`].
    HollowBox {
        /// Sides of the box.
        size: DVec3,
        /// Sides of its hollow.
        hollow: DVec3,
    },
    /// See [`sphere`].
    Sphere {
        /// Radius.
        radius: f64,
        /// Number of meridians.
        segments: u32,
    },
    /// See [`geodesic()`].
    Geodesic {
        /// Radius.
        radius: f64,
        /// Number of parts of each edge of the icosahedron.
        frequency: u32,
    },
    /// See [`star()`].
    Star {
        /// Radius of the tips.
        radius: f64,
        /// Radius of the sphere between them.
        valley: f64,
        /// Number of parts of each edge of the icosahedron.
        frequency: u32,
    },
    /// See [`torus`].
    Torus {
        /// Radius of the circle on which the tube's centre lies.
        major: f64,
        /// Radius of the tube.
        minor: f64,
        /// Number of segments along the large circle.
        around: u32,
        /// Number of segments along the small circle.
        across: u32,
    },
    /// See [`cylinder`].
    Cylinder {
        /// Radius.
        radius: f64,
        /// Height.
        height: f64,
        /// Number of segments of the circle.
        segments: u32,
    },
    /// See [`hyperboloid`].
    Hyperboloid {
        /// Radius in the middle.
        waist: f64,
        /// Radius at the ends.
        rim: f64,
        /// Height.
        height: f64,
        /// Number of segments of the circles.
        segments: u32,
        /// Number of zones along the height.
        zones: u32,
    },
    /// See [`TorusKnot`].
    TorusKnot(TorusKnot),
    /// See [`chain()`].
    Chain {
        /// Number of rings.
        links: u32,
        /// Radius of a ring's middle line.
        major: f64,
        /// Radius of a ring's section.
        minor: f64,
        /// Number of segments along a ring.
        around: u32,
        /// Number of segments round its section.
        across: u32,
    },
    /// See [`chain_mail`].
    ChainMail {
        /// Number of flat rings along x.
        columns: u32,
        /// Number of flat rings along y.
        rows: u32,
        /// Radius of a ring's middle line.
        major: f64,
        /// Radius of a ring's section.
        minor: f64,
        /// Number of segments along a ring.
        around: u32,
        /// Number of segments round its section.
        across: u32,
    },
    /// See [`Weave`].
    Weave(Weave),
    /// See [`GeodesicFrame`].
    GeodesicFrame(GeodesicFrame),
    /// See [`HyperboloidFrame`].
    HyperboloidFrame(HyperboloidFrame),
    /// See [`Brush`].
    Brush(Brush),
    /// See [`MinimalSurface`].
    MinimalSurface(MinimalSurface),
    /// See [`StrutLattice`].
    StrutLattice(StrutLattice),
    /// See [`LongBone`].
    LongBone(LongBone),
    /// See [`TrabecularBone`].
    TrabecularBone(TrabecularBone),
    /// See [`Organic`].
    Organic(Organic),
    /// See [`Skull`].
    Skull(Skull),
}

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
    build: fn(&Arguments) -> Result<Model, SolidError>,
}

const fn parameter(name: &'static str, default: &'static str, meaning: &'static str) -> Parameter {
    Parameter { name, default, meaning, is_length: false }
}

const fn length(name: &'static str, default: &'static str, meaning: &'static str) -> Parameter {
    Parameter { name, default, meaning, is_length: true }
}

const RADIUS: Parameter = length("radius", "10", "radius, mm");
const SEGMENTS: Parameter = parameter("segments", "64", "segments round the axis");
const CELL_SIZE: Parameter = length("cell-size", "10", "side of a cell, mm");
const WINDOW: Parameter = parameter("window", "0.8", "sides of a window as a share of those of its face");
const CELLS: Parameter = parameter("cells", "4", "cells along the axes: one number, or three with commas");

const MINIMAL_SURFACE: &[Parameter] = &[
    parameter("part", "sheet", "sheet: a wall along the surface; network: the solid on one side of it"),
    length("wall", "1", "mean thickness of a sheet, mm"),
    parameter("fraction", "0.5", "share of volume of a network"),
    CELLS,
    CELL_SIZE,
    parameter("resolution", "28", "grid cells along the side of a cell"),
];

const LATTICE: &[Parameter] = &[
    parameter("form", "union", "union: one surface; overlapping: a closed cylinder for each strut"),
    length("radius", "1", "radius of a strut, mm"),
    CELLS,
    CELL_SIZE,
    parameter("resolution", "32", "grid cells along the side of a cell of a union"),
    parameter("segments", "24", "segments round an overlapping strut"),
];

const KINDS: &[ModelKind] = &[
    ModelKind {
        name: "cuboid",
        summary: "box between two corners",
        parameters: &[
            length("min", "-10,-10,-10", "least coordinates, mm"),
            length("max", "10,10,10", "greatest coordinates, mm"),
        ],
        build: |a| Ok(Model::Cuboid { min: a.vector("min")?, max: a.vector("max")? }),
    },
    ModelKind {
        name: "ell",
        summary: "L along z: a box that lacks one edge",
        parameters: &[
            length("size", "1,1,1", "sides of the box, mm"),
            length("notch", "0.5,0.5", "sides of what it lacks along x and y, mm: one number, or two with a comma"),
        ],
        build: |a| {
            let expected = "a number, or two with a comma between them";
            Ok(Model::Ell { size: a.vector("size")?, notch: a.read("notch", expected, one_or_several)? })
        },
    },
    ModelKind {
        name: "hollow-box",
        summary: "box with a closed box-shaped hollow",
        parameters: &[length("size", "20,20,20", "sides, mm"), length("hollow", "10,10,10", "sides of the hollow, mm")],
        build: |a| Ok(Model::HollowBox { size: a.vector("size")?, hollow: a.vector("hollow")? }),
    },
    ModelKind {
        name: "sphere",
        summary: "sphere of meridians and parallels",
        parameters: &[RADIUS, SEGMENTS],
        build: |a| Ok(Model::Sphere { radius: a.number("radius")?, segments: a.count("segments")? }),
    },
    ModelKind {
        name: "geodesic",
        summary: "sphere of even triangles from an icosahedron",
        parameters: &[RADIUS, parameter("frequency", "16", "parts into which an edge of the icosahedron is cut")],
        build: |a| Ok(Model::Geodesic { radius: a.number("radius")?, frequency: a.count("frequency")? }),
    },
    ModelKind {
        name: "geodesic-frame",
        summary: "geodesic sphere of bars, with a window in every triangle",
        parameters: &[
            RADIUS,
            parameter("frequency", "6", "parts into which an edge of the icosahedron is cut"),
            WINDOW,
            length("depth", "0.5", "depth of the bars towards the middle, mm"),
        ],
        build: |a| {
            Ok(Model::GeodesicFrame(GeodesicFrame {
                radius: a.number("radius")?,
                frequency: a.count("frequency")?,
                window: a.number("window")?,
                depth: a.number("depth")?,
            }))
        },
    },
    ModelKind {
        name: "star",
        summary: "geodesic sphere with a spike on every face",
        parameters: &[
            length("radius", "10", "radius of the tips, mm"),
            length("valley", "4", "radius of the sphere between the spikes, mm"),
            parameter("frequency", "1", "parts into which an edge of the icosahedron is cut"),
        ],
        build: |a| {
            Ok(Model::Star {
                radius: a.number("radius")?,
                valley: a.number("valley")?,
                frequency: a.count("frequency")?,
            })
        },
    },
    ModelKind {
        name: "torus",
        summary: "ring with a round section",
        parameters: &[
            length("major", "10", "radius of the middle line, mm"),
            length("minor", "3", "radius of the section, mm"),
            parameter("around", "96", "segments along the ring"),
            parameter("across", "32", "segments round the section"),
        ],
        build: |a| {
            Ok(Model::Torus {
                major: a.number("major")?,
                minor: a.number("minor")?,
                around: a.count("around")?,
                across: a.count("across")?,
            })
        },
    },
    ModelKind {
        name: "cylinder",
        summary: "round cylinder along z",
        parameters: &[RADIUS, length("height", "20", "height, mm"), SEGMENTS],
        build: |a| {
            Ok(Model::Cylinder {
                radius: a.number("radius")?,
                height: a.number("height")?,
                segments: a.count("segments")?,
            })
        },
    },
    ModelKind {
        name: "hyperboloid",
        summary: "solid inside a hyperboloid of one sheet, saddle-shaped on its side",
        parameters: &[
            length("waist", "5", "radius in the middle, mm"),
            length("rim", "10", "radius at the ends, mm"),
            length("height", "20", "height, mm"),
            SEGMENTS,
            parameter("zones", "32", "zones along the height"),
        ],
        build: |a| {
            Ok(Model::Hyperboloid {
                waist: a.number("waist")?,
                rim: a.number("rim")?,
                height: a.number("height")?,
                segments: a.count("segments")?,
                zones: a.count("zones")?,
            })
        },
    },
    ModelKind {
        name: "hyperboloid-frame",
        summary: "hyperboloid of two families of straight bars, with windows between them",
        parameters: &[
            length("waist", "5", "radius in the middle, mm"),
            length("height", "20", "height, mm"),
            parameter("bars", "24", "bars of either family"),
            parameter("crossings", "8", "crossings of a bar on either side of the waist, which set the rims"),
            WINDOW,
            length("depth", "0.4", "depth of the bars across the surface, mm"),
        ],
        build: |a| {
            Ok(Model::HyperboloidFrame(HyperboloidFrame {
                waist: a.number("waist")?,
                height: a.number("height")?,
                bars: a.count("bars")?,
                crossings: a.count("crossings")?,
                window: a.number("window")?,
                depth: a.number("depth")?,
            }))
        },
    },
    ModelKind {
        name: "knot",
        summary: "tube along a torus knot, by default a trefoil",
        parameters: &[
            parameter("p", "2", "turns round the axis"),
            parameter("q", "3", "turns round the section of the torus"),
            length("major", "8", "radius of the torus' middle line, mm"),
            length("minor", "4", "radius of its section, mm"),
            length("tube", "1.6", "radius of the tube, mm"),
            parameter("segments", "60", "segments along the tube"),
            parameter("sides", "8", "segments round the tube"),
        ],
        build: |a| {
            Ok(Model::TorusKnot(TorusKnot {
                p: a.count("p")?,
                q: a.count("q")?,
                major: a.number("major")?,
                minor: a.number("minor")?,
                tube: a.number("tube")?,
                segments: a.count("segments")?,
                sides: a.count("sides")?,
            }))
        },
    },
    ModelKind {
        name: "chain",
        summary: "interlocked rings along x that do not touch",
        parameters: &[
            parameter("links", "5", "number of rings"),
            length("major", "5", "radius of a ring's middle line, mm"),
            length("minor", "1", "radius of a ring's section, mm"),
            parameter("around", "64", "segments along a ring"),
            parameter("across", "24", "segments round its section"),
        ],
        build: |a| {
            Ok(Model::Chain {
                links: a.count("links")?,
                major: a.number("major")?,
                minor: a.number("minor")?,
                around: a.count("around")?,
                across: a.count("across")?,
            })
        },
    },
    ModelKind {
        name: "chain-mail",
        summary: "net of interlocked rings in the plane of x and y that do not touch",
        parameters: &[
            parameter("columns", "4", "flat rings along x"),
            parameter("rows", "3", "flat rings along y"),
            length("major", "5", "radius of a ring's middle line, mm"),
            length("minor", "1", "radius of a ring's section, mm"),
            parameter("around", "64", "segments along a ring"),
            parameter("across", "24", "segments round its section"),
        ],
        build: |a| {
            Ok(Model::ChainMail {
                columns: a.count("columns")?,
                rows: a.count("rows")?,
                major: a.number("major")?,
                minor: a.number("minor")?,
                around: a.count("around")?,
                across: a.count("across")?,
            })
        },
    },
    ModelKind {
        name: "weave",
        summary: "layers of plain-woven cloth of round yarns that do not touch",
        parameters: &[
            parameter("yarns", "8", "yarns side by side in x and in y: one number, or two with a comma"),
            parameter("layers", "1", "cloths one above the other"),
            length("spacing", "2", "distance between neighbouring yarns, mm"),
            length("radius", "0.3", "radius of a yarn, mm"),
            length("gap", "0.2", "least distance between crossing yarns, mm"),
            parameter("segments", "16", "segments round a yarn"),
            parameter("steps", "8", "segments of a yarn from crossing to crossing"),
        ],
        build: |a| {
            let expected = "a whole number, or two with a comma between them";
            Ok(Model::Weave(Weave {
                yarns: a.read("yarns", expected, one_or_several)?,
                layers: a.count("layers")?,
                spacing: a.number("spacing")?,
                radius: a.number("radius")?,
                gap: a.number("gap")?,
                segments: a.count("segments")?,
                steps: a.count("steps")?,
            }))
        },
    },
    ModelKind {
        name: "brush",
        summary: "round bristles along z on a plate, one surface",
        parameters: &[
            parameter("bristles", "8", "bristles along x and y: one number, or two with a comma"),
            length("spacing", "2", "distance between neighbouring bristles, mm"),
            length("radius", "0.5", "radius of a bristle, mm"),
            length("length", "8", "length of a bristle, mm"),
            length("plate", "1", "thickness of the plate, mm"),
            parameter("resolution", "16", "grid cells from bristle to bristle"),
        ],
        build: |a| {
            let expected = "a whole number, or two with a comma between them";
            Ok(Model::Brush(Brush {
                bristles: a.read("bristles", expected, one_or_several)?,
                spacing: a.number("spacing")?,
                radius: a.number("radius")?,
                length: a.number("length")?,
                plate: a.number("plate")?,
                resolution: a.count("resolution")?,
            }))
        },
    },
    ModelKind {
        name: "gyroid",
        summary: "scaffold along Schoen's gyroid, sheet or network, capped by its box",
        parameters: MINIMAL_SURFACE,
        build: |a| a.minimal_surface(Surface::Gyroid),
    },
    ModelKind {
        name: "primitive",
        summary: "scaffold along Schwarz' primitive surface, sheet or network, capped by its box",
        parameters: MINIMAL_SURFACE,
        build: |a| a.minimal_surface(Surface::Primitive),
    },
    ModelKind {
        name: "diamond",
        summary: "scaffold along Schwarz' diamond surface, sheet or network, capped by its box",
        parameters: MINIMAL_SURFACE,
        build: |a| a.minimal_surface(Surface::Diamond),
    },
    ModelKind {
        name: "cubic",
        summary: "lattice of struts along the axes",
        parameters: LATTICE,
        build: |a| a.lattice(StrutPattern::Cubic),
    },
    ModelKind {
        name: "bcc",
        summary: "lattice of struts along the diagonals of its cells",
        parameters: LATTICE,
        build: |a| a.lattice(StrutPattern::BodyCentred),
    },
    ModelKind {
        name: "bone",
        summary: "long bone in the likeness of a femur, along z",
        parameters: &[
            length("length", "100", "length, mm"),
            parameter("girth", "1", "breadth in units of that of a femur of this length"),
            parameter("bow", "1", "bow of the shaft in units of that of a femur"),
            parameter("resolution", "200", "grid cells along the length"),
        ],
        build: |a| {
            Ok(Model::LongBone(LongBone {
                length: a.number("length")?,
                girth: a.number("girth")?,
                bow: a.number("bow")?,
                resolution: a.count("resolution")?,
            }))
        },
    },
    ModelKind {
        name: "trabecular",
        summary: "block of trabecular bone, rods and plates without order, capped by its box",
        parameters: &[
            length("size", "5,5,7", "sides of the block, mm"),
            length("spacing", "1", "distance from one trabecula across to the next, mm"),
            parameter("fraction", "0.35", "share of volume that is bone"),
            parameter("stretch", "1.5", "how much longer trabeculae are along z"),
            parameter("seed", "1", "picks one of many such bones"),
            parameter("resolution", "12", "grid cells along the spacing"),
        ],
        build: |a| {
            Ok(Model::TrabecularBone(TrabecularBone {
                size: a.vector("size")?,
                spacing: a.number("spacing")?,
                fraction: a.number("fraction")?,
                stretch: a.number("stretch")?,
                seed: a.count("seed")?,
                resolution: a.count("resolution")?,
            }))
        },
    },
    ModelKind {
        name: "organic",
        summary: "likeness of a sitting hare: lobes, limbs and a wavy skin",
        parameters: &[
            length("size", "20", "about its height, mm"),
            parameter("bumps", "1", "height of the waves on its skin in units of the usual"),
            parameter("resolution", "65", "grid cells along the height"),
        ],
        build: |a| {
            Ok(Model::Organic(Organic {
                size: a.number("size")?,
                bumps: a.number("bumps")?,
                resolution: a.count("resolution")?,
            }))
        },
    },
    ModelKind {
        name: "skull",
        summary: "likeness of a skull: a thick shell with two eye sockets, a nose and a hole below",
        parameters: &[
            length("size", "20", "about its length and height, mm"),
            parameter("wall", "0.08", "thickness of the shell as a share of the size"),
            parameter("resolution", "38", "grid cells along the size"),
        ],
        build: |a| {
            Ok(Model::Skull(Skull {
                size: a.number("size")?,
                wall: a.number("wall")?,
                resolution: a.count("resolution")?,
            }))
        },
    },
];

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
        (found.build)(&Arguments { parameters: found.parameters, values })
    }

    /// Builds the closed, outward-oriented mesh of the solid.
    ///
    /// # Errors
    /// Fails for a parameter that is out of range, or a mesh that would be too large; see the shape's own function or
    /// struct.
    pub fn build(&self) -> Result<TriangleMesh, SolidError> {
        match *self {
            Model::Cuboid { min, max } => cuboid(min, max),
            Model::Ell { size, notch } => ell(size, notch),
            Model::HollowBox { size, hollow } => hollow_box(size, hollow),
            Model::Sphere { radius, segments } => sphere(radius, segments),
            Model::Geodesic { radius, frequency } => geodesic(radius, frequency),
            Model::Star { radius, valley, frequency } => star(radius, valley, frequency),
            Model::Torus { major, minor, around, across } => torus(major, minor, around, across),
            Model::Cylinder { radius, height, segments } => cylinder(radius, height, segments),
            Model::Hyperboloid { waist, rim, height, segments, zones } => {
                hyperboloid(waist, rim, height, segments, zones)
            }
            Model::TorusKnot(model) => model.build(),
            Model::Chain { links, major, minor, around, across } => chain(links, major, minor, around, across),
            Model::ChainMail { columns, rows, major, minor, around, across } => {
                chain_mail(columns, rows, major, minor, around, across)
            }
            Model::Weave(model) => model.build(),
            Model::GeodesicFrame(model) => model.build(),
            Model::HyperboloidFrame(model) => model.build(),
            Model::Brush(model) => model.build(),
            Model::MinimalSurface(model) => model.build(),
            Model::StrutLattice(model) => model.build(),
            Model::LongBone(model) => model.build(),
            Model::TrabecularBone(model) => model.build(),
            Model::Organic(model) => model.build(),
            Model::Skull(model) => model.build(),
        }
    }
}

/// The values given for a model, with the model's parameters.
struct Arguments<'a> {
    parameters: &'static [Parameter],
    values: &'a [(&'a str, &'a str)],
}

impl Arguments<'_> {
    fn read<T>(
        &self,
        name: &str,
        expected: &'static str,
        parse: impl FnOnce(&str) -> Option<T>,
    ) -> Result<T, SolidError> {
        let parameter = self.parameters.iter().find(|p| p.name == name).expect("models read their own parameters");
        let given = self.values.iter().rev().find(|(given, _)| *given == name);
        let text = given.map_or(parameter.default, |(_, text)| text);
        parse(text).ok_or_else(|| SolidError::Unreadable { parameter: parameter.name, text: text.to_owned(), expected })
    }

    fn number(&self, name: &str) -> Result<f64, SolidError> {
        self.read(name, "a number", |text| text.trim().parse().ok())
    }

    fn count(&self, name: &str) -> Result<u32, SolidError> {
        self.read(name, "a whole number", |text| text.trim().parse().ok())
    }

    fn vector(&self, name: &str) -> Result<DVec3, SolidError> {
        self.read(name, "three numbers with commas between them", several).map(DVec3::from_array)
    }

    fn cells(&self) -> Result<[u32; 3], SolidError> {
        self.read("cells", "a whole number, or three with commas between them", one_or_several)
    }

    fn minimal_surface(&self, surface: Surface) -> Result<Model, SolidError> {
        let (wall, fraction) = (self.number("wall")?, self.number("fraction")?);
        let part = self.read("part", "sheet or network", |text| match text {
            "sheet" => Some(Part::Sheet { wall }),
            "network" => Some(Part::Network { fraction }),
            _ => None,
        })?;
        Ok(Model::MinimalSurface(MinimalSurface {
            surface,
            part,
            cells: self.cells()?,
            cell_size: self.number("cell-size")?,
            resolution: self.count("resolution")?,
        }))
    }

    fn lattice(&self, pattern: StrutPattern) -> Result<Model, SolidError> {
        let (resolution, segments) = (self.count("resolution")?, self.count("segments")?);
        let form = self.read("form", "union or overlapping", |text| match text {
            "union" => Some(LatticeForm::Union { resolution }),
            "overlapping" => Some(LatticeForm::Overlapping { segments }),
            _ => None,
        })?;
        Ok(Model::StrutLattice(StrutLattice {
            pattern,
            form,
            cells: self.cells()?,
            cell_size: self.number("cell-size")?,
            radius: self.number("radius")?,
        }))
    }
}

/// Parses exactly `N` values with commas between them.
fn several<T: std::str::FromStr, const N: usize>(text: &str) -> Option<[T; N]> {
    let parts: Vec<T> = text.split(',').map(|part| part.trim().parse().ok()).collect::<Option<_>>()?;
    parts.try_into().ok()
}

/// Parses one value that applies to all, or `N`.
fn one_or_several<T: std::str::FromStr + Copy, const N: usize>(text: &str) -> Option<[T; N]> {
    text.trim().parse().ok().map(|value| [value; N]).or_else(|| several(text))
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
        assert_eq!(Model::from_parameters("diamond", &given), Ok(Model::MinimalSurface(expected)));
        let form = [("form", "overlapping"), ("segments", "7")];
        let Ok(Model::StrutLattice(lattice)) = Model::from_parameters("bcc", &form) else { panic!("not a lattice") };
        assert_eq!(lattice.form, LatticeForm::Overlapping { segments: 7 });
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
}
