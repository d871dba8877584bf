//! The descriptions of operations: inputs, raster, and outputs.

use std::path::PathBuf;

use super::bound::Bound;
use super::certainty::Certainty;
use crate::Error;
use crate::boolean::{BooleanOperation, Expression};
use crate::grid::Axis;
use crate::length::Length;
use crate::mesh::io::Format;
use crate::mesh::{LengthUnit, Precision};
use crate::placement::Placement;
use crate::sampler::{FillRule, Mode};
use crate::surface::MOST_LEVELS;
#[cfg(feature = "npz")]
use crate::voxels;

/// A file to read, and where to place its mesh.
#[derive(Clone, Debug)]
pub struct Input {
    /// The name in an expression, or of a part.
    pub name: Option<String>,
    /// The file.
    pub path: PathBuf,
    /// The map of the coordinates.
    pub placement: Option<Placement>,
}

/// The treatment of meshes that are not closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Openness {
    /// An open mesh is an error.
    Refused,
    /// An open mesh is an error that names the option `--allow-open`.
    RefusedByDefault,
    /// An open mesh is sampled; rays that do not close count as empty.
    Sampled,
}

/// The device that samples.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Backend {
    /// The device that is expected to finish first.
    #[default]
    Auto,
    /// The processor.
    Cpu,
    /// The adapter whose name contains this text; the first one without a name.
    Gpu(Option<String>),
}

/// The spacing of the raster. Lengths are in the unit of the inputs, or have their own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spacing<L = f64> {
    /// Rays along the longest side of the common box.
    Resolution(u32),
    /// Distance between neighbouring rays.
    Pitch(L),
    /// The resolution at which the error estimate falls below this share of the volume.
    Tolerance(f64),
}

impl Spacing {
    /// Checks that the spacing can give a raster.
    ///
    /// # Errors
    /// No rays, and lengths and shares that are no positive numbers.
    pub(crate) fn check(self) -> Result<(), Error> {
        match self {
            Spacing::Resolution(0) => Err(Error::Usage("the resolution is 0; at least 1 ray is needed".to_owned())),
            Spacing::Pitch(value) | Spacing::Tolerance(value) if !(value.is_finite() && value > 0.0) => {
                Err(Error::Usage(format!("{value}: a pitch or tolerance must be a positive number")))
            }
            _ => Ok(()),
        }
    }

    /// Returns the spacing with its length in the unit of the inputs.
    pub(crate) fn of_inputs(self) -> Spacing<Length> {
        match self {
            Spacing::Resolution(rays) => Spacing::Resolution(rays),
            Spacing::Pitch(value) => Spacing::Pitch(Length { value, unit: None }),
            Spacing::Tolerance(share) => Spacing::Tolerance(share),
        }
    }
}

impl Spacing<Length> {
    /// Returns the spacing with its length in a unit.
    ///
    /// # Errors
    /// A length with a unit where that of the inputs is not known.
    pub fn in_unit(self, unit: Option<LengthUnit>) -> Result<Spacing, Error> {
        Ok(match self {
            Spacing::Resolution(rays) => Spacing::Resolution(rays),
            Spacing::Pitch(pitch) => Spacing::Pitch(pitch.in_unit(unit, "--pitch")?),
            Spacing::Tolerance(share) => Spacing::Tolerance(share),
        })
    }
}

/// A solid to be measured.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Measurement {
    /// The result of an expression over all inputs.
    Boolean(Boolean),
    /// The one input, with area and moments.
    Volume,
    /// The one input, for its image.
    Sample,
}

/// An expression over the inputs, with the wording of the request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Boolean {
    /// The expression over the indices of the inputs.
    pub expression: Expression,
    /// The wording of the request.
    pub wording: Wording,
}

/// The wording in which a Boolean is requested.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wording {
    /// One operation on a list of inputs.
    Operation(BooleanOperation),
    /// An expression in text.
    Typed(String),
}

impl Measurement {
    /// Returns the name of the command.
    pub fn command(&self) -> &'static str {
        match self {
            Measurement::Boolean(Boolean { wording, .. }) => match wording {
                Wording::Operation(BooleanOperation::Intersection) => "intersect",
                Wording::Operation(BooleanOperation::Union) => "union",
                Wording::Operation(BooleanOperation::Difference) => "difference",
                Wording::Operation(BooleanOperation::Xor) => "xor",
                Wording::Typed(_) => "csg",
            },
            Measurement::Volume => "volume",
            Measurement::Sample => "sample",
        }
    }

    /// Returns the expression over the inputs; `None` where a single input is measured.
    pub fn expression(&self) -> Option<&Expression> {
        match self {
            Measurement::Boolean(Boolean { expression, .. }) => Some(expression),
            Measurement::Volume | Measurement::Sample => None,
        }
    }

    /// Returns the expression as text, if it was given as text.
    pub fn typed_expression(&self) -> Option<&str> {
        match self {
            Measurement::Boolean(Boolean { wording: Wording::Typed(text), .. }) => Some(text),
            _ => None,
        }
    }
}

/// The requested method of a volume.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VolumeMethod {
    /// Exact where the triangles allow it, else an estimate from images.
    #[default]
    Best,
    /// Exact, or an error with the reason why it cannot be.
    Exact,
    /// An estimate from images.
    Estimate,
}

/// Volumes, Booleans and images of solids.
#[derive(Clone, Debug)]
pub struct MeasureJob {
    /// The solid to be measured.
    pub measurement: Measurement,
    /// The unit of files that state none.
    pub unit: Option<LengthUnit>,
    /// The treatment of meshes that are not closed.
    pub openness: Openness,
    /// The spacing of the raster.
    pub spacing: Spacing<Length>,
    /// Voxels along each ray (LOD-C) of estimates.
    pub lod: u32,
    /// The axes of the images.
    pub axes: Vec<Axis>,
    /// Exact images, over- or under-estimates.
    pub mode: Mode,
    /// The fill rule.
    pub fill: FillRule,
    /// The device that samples.
    pub backend: Backend,
    /// The most bytes that the process may hold; a share of the free memory without it.
    pub memory: Option<u64>,
    /// The method of the volume.
    pub method: VolumeMethod,
    /// True if the files are hashed.
    pub hashes: bool,
    /// What has to be proved about the volume.
    pub certainty: Certainty,
    /// The part of the images that is kept.
    pub keep: Keep,
}

/// Minkowski sums and differences, offsets, openings and closings.
#[derive(Clone, Debug)]
pub struct SumJob {
    /// The operation.
    pub operation: SumOperation<Length>,
    /// The unit of files that state none.
    pub unit: Option<LengthUnit>,
    /// The spacing of the raster.
    pub spacing: Spacing<Length>,
    /// Voxels along each ray (LOD-C) of estimates.
    pub lod: u32,
    /// The axes of the images that are measured and written.
    pub axes: Vec<Axis>,
    /// Exact images, over- or under-estimates.
    pub mode: Mode,
    /// The fill rule.
    pub fill: FillRule,
    /// The device that finds crossings and resolves gaps.
    pub backend: Backend,
    /// The most bytes that the process may hold; a share of the free memory without it.
    pub memory: Option<u64>,
    /// True if the files are hashed.
    pub hashes: bool,
    /// What has to be proved about the volume.
    pub certainty: Certainty,
    /// The part of the images that is kept.
    pub keep: Keep,
}

/// An operation with a second solid or a ball. Lengths are in the unit of the inputs, or have their own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SumOperation<L = f64> {
    /// A ⊕ B.
    Sum(Operand),
    /// A ⊖ B.
    Difference(Operand),
    /// A grown by a distance, or shrunk by one below zero.
    Offset(L),
    /// A shrunk by a radius and grown again.
    Opening(L),
    /// A grown by a radius and shrunk again.
    Closing(L),
}

/// The second solid of a sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operand {
    /// As it is.
    AsItIs,
    /// Reflected through the origin.
    Reflected,
}

impl SumOperation<Length> {
    /// Returns the operation with its length in a unit.
    ///
    /// # Errors
    /// A length with a unit where that of the inputs is not known.
    pub fn in_unit(self, unit: Option<LengthUnit>) -> Result<SumOperation, Error> {
        Ok(match self {
            SumOperation::Sum(operand) => SumOperation::Sum(operand),
            SumOperation::Difference(operand) => SumOperation::Difference(operand),
            SumOperation::Offset(distance) => SumOperation::Offset(distance.in_unit(unit, "--distance")?),
            SumOperation::Opening(radius) => SumOperation::Opening(radius.in_unit(unit, "--radius")?),
            SumOperation::Closing(radius) => SumOperation::Closing(radius.in_unit(unit, "--radius")?),
        })
    }
}

impl<L> SumOperation<L> {
    /// Returns the name of the command.
    pub fn command(&self) -> &'static str {
        match self {
            SumOperation::Sum(_) | SumOperation::Difference(_) => "minkowski",
            SumOperation::Offset(_) => "offset",
            SumOperation::Opening(_) => "open",
            SumOperation::Closing(_) => "close",
        }
    }
}

/// The part of images that outlives their measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// Sums alone.
    Sums,
    /// The images.
    Images,
    /// The images, with the triangle of each sample.
    ImagesWithTriangles,
    /// A mesh: the exact one, or else the same images, to be contoured.
    Mesh(MeshRequest),
}

/// The mesh that outlives a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshRequest {
    /// The method.
    pub method: MeshMethod,
    /// The precision of coordinates in the file.
    pub precision: Precision,
    /// True if a round offset is subtracted from the coordinates.
    pub recentre: bool,
    /// True if a bound is asked for within which triangles of a mesh from images are removed. Without one they are removed if there is
    /// memory for it, and forecasts are those of the full mesh.
    pub is_simplified: bool,
    /// True if a mesh from images may get finer cells.
    pub is_refined: bool,
}

/// The requested method of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MeshMethod {
    /// Exact where the triangles allow it, else from images.
    #[default]
    Best,
    /// Exact, or an error with the reason why it cannot be.
    Exact,
    /// From images.
    Sampled,
}

impl Keep {
    /// Returns whether each sample keeps its triangle.
    pub fn has_triangles(self) -> bool {
        matches!(self, Keep::ImagesWithTriangles | Keep::Mesh(_))
    }
}

impl From<Option<&ImageTarget>> for Keep {
    fn from(target: Option<&ImageTarget>) -> Keep {
        let Some(ImageTarget { path, content }) = target else { return Keep::Sums };
        match *content {
            #[cfg(feature = "npz")]
            Content::Voxels(_) => Keep::Images,
            #[cfg(feature = "npz")]
            Content::Images => Keep::ImagesWithTriangles,
            Content::Mesh(finish) => {
                // A name without a known format is refused when the file is written.
                let precision = Format::from_path(path).map_or(Precision::Double, Format::precision);
                Keep::Mesh(finish.request(precision))
            }
        }
    }
}

/// An output file that is computed from images.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageTarget {
    /// The file.
    pub path: PathBuf,
    /// Its content.
    pub content: Content,
}

/// The content of an output file that is computed from images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Content {
    /// The images themselves, as `.npz`.
    #[cfg(feature = "npz")]
    Images,
    /// The lattice nodes inside.
    #[cfg(feature = "npz")]
    Voxels(voxels::Format),
    /// The surface of the solid.
    Mesh(Finish),
}

/// The method of a mesh and its processing before it is written.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Finish {
    /// The method.
    pub method: MeshMethod,
    /// The bound within which triangles of a mesh from images are removed. Without one it is [`Bound::DEFAULT`], or zero if there
    /// is too little memory for the former.
    pub surface_error: Option<Bound>,
    /// How often the pitch is halved where a mesh from images lacks details; [`Finish::LEVELS`] without a number. Meshes of estimates
    /// and of files of images are never refined.
    pub refine: Option<u32>,
    /// The least volume of a part that is kept, as a share of the whole.
    pub least_part: Option<f64>,
    /// True if a round offset is subtracted from the coordinates.
    pub recentre: bool,
}

impl Finish {
    /// How often the pitch is halved where details need it, if no number is given.
    pub const LEVELS: u32 = 3;

    /// The most that may be given.
    pub const MOST_LEVELS: u32 = MOST_LEVELS;

    /// Returns the finish of meshes that keep all triangles.
    pub fn full() -> Finish {
        Finish { surface_error: Some(Bound::ZERO), ..Finish::default() }
    }

    /// Returns the finish of the mesh of a sum that is an operand: full, with the cells of the raster.
    pub fn of_operand() -> Finish {
        Finish { refine: Some(0), ..Finish::full() }
    }

    /// Returns whether the mesh is certainly one of images. A bound of a distance makes sense for those alone.
    pub fn is_of_images(&self) -> bool {
        self.method == MeshMethod::Sampled || self.removes_triangles()
    }

    /// Returns whether a bound is asked for within which triangles are removed.
    fn removes_triangles(&self) -> bool {
        self.surface_error.is_some_and(|bound| !bound.is_zero())
    }

    /// Returns what a measurement has to keep for a file of a precision.
    pub fn request(&self, precision: Precision) -> MeshRequest {
        let method = if self.is_of_images() { MeshMethod::Sampled } else { self.method };
        let (is_simplified, is_refined) = (self.removes_triangles(), self.refine != Some(0));
        MeshRequest { method, precision, recentre: self.recentre, is_simplified, is_refined }
    }
}
