//! Everything that a report says of one solid, before it is said.
//!
//! All values are in world units (`unit` names the length, if it is known), positions in world coordinates. JSON is this
//! structure without pictures.

use crate::mesh::LengthUnit;
use serde::{Serialize, Serializer};

use super::quantity::Unit;

/// The version of metrics.json.
pub const SCHEMA: &str = "ldi-ops-report/1";

/// A report on one solid.
#[derive(Clone, Debug, Serialize)]
pub struct Sheet {
    /// The version of the JSON.
    pub schema: &'static str,
    /// The name of the solid: that of its file.
    pub title: String,
    /// The unit of length; nothing where neither the file nor the user says.
    #[serde(serialize_with = "symbol")]
    pub unit: Option<LengthUnit>,
    /// What the limits come to, where any were given.
    pub verdict: Option<Verdict>,
    /// Remarks on inputs and metrics.
    pub alerts: Vec<Alert>,
    /// All metrics of the catalogue, in its order.
    pub metrics: Vec<Metric>,
    /// Distributions.
    pub histograms: Vec<HistogramPlot>,
    /// Access to the pores from outside, by diameter.
    pub access: Option<AccessCurve>,
    /// Porosity along the axes.
    pub profiles: Vec<Profile>,
    /// The ellipsoid of mean intercept lengths.
    pub anisotropy: Option<Anisotropy>,
    /// Main metrics against pitch and size of the region.
    pub convergence: Vec<Convergence>,
    /// Inputs, settings, device and times.
    pub provenance: Provenance,
    /// The view and the slices.
    #[serde(skip)]
    pub pictures: Pictures,
}

impl Sheet {
    /// A metric by its id.
    pub fn metric(&self, id: &str) -> Option<&Metric> {
        self.metrics.iter().find(|metric| metric.id == id)
    }
}

/// A number, what it means and how it came about.
#[derive(Clone, Debug, Serialize)]
pub struct Metric {
    /// A name that does not change, for programs: `porosity`, `solid.thickness.mean`; see [`super::id`].
    pub id: &'static str,
    /// The family that the metric belongs to.
    pub group: Group,
    /// As the field writes it: `BV/TV`, `Tb.Th`.
    pub symbol: &'static str,
    /// The name for people.
    pub name: &'static str,
    /// One line: what it is.
    pub definition: &'static str,
    /// Nothing where there is none; `status` and `warnings` say why.
    pub value: Option<f64>,
    /// An estimate of the error of the value, ±; not a bound.
    pub error: Option<f64>,
    /// What it is at least, and at most: from the inner and the outer solid.
    pub lower: Option<f64>,
    /// The upper bound, likewise.
    pub upper: Option<f64>,
    /// The unit of the value.
    pub unit: Unit,
    /// How it was found.
    pub method: &'static str,
    /// What it depends on beside the solid: names and values.
    #[serde(serialize_with = "object")]
    pub parameters: Vec<(&'static str, String)>,
    /// Where the definition is from.
    pub reference: &'static str,
    /// Whether the value holds.
    pub status: Status,
    /// Reasons for doubt.
    pub warnings: Vec<String>,
}

/// The section of the table a metric is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Group {
    /// Volumes and shares of volume.
    Volume,
    /// Areas and curvature.
    Surface,
    /// Access to the pores from outside, and percolation.
    Access,
    /// Thickness of the solid and width of the pores.
    Thickness,
    /// Chord lengths.
    Chords,
    /// Mean intercept lengths by direction.
    Anisotropy,
    /// Pieces, holes and cavities.
    Topology,
    /// Tortuosity and permeability.
    Transport,
    /// Centroid and inertia.
    Moments,
    /// Overhang and thin walls.
    Manufacture,
}

/// Whether there is a value, and if not, why.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// There is one.
    Measured,
    /// There is none in this solid: the separation of a block without pores.
    NotApplicable,
    /// The raster is too coarse for it; a value may be there, and a warning is.
    NotResolved,
}

/// What the user's limits come to.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// Whether every limit is kept.
    pub passed: bool,
    /// The limits, in the order of their file.
    pub limits: Vec<LimitVerdict>,
}

/// One limit, and the metric held to it.
#[derive(Clone, Debug, Serialize)]
pub struct LimitVerdict {
    /// The metric's id.
    pub metric: String,
    /// The name of the metric for people.
    pub name: String,
    /// The least value allowed.
    pub min: Option<f64>,
    /// The greatest value allowed.
    pub max: Option<f64>,
    /// The value of the metric.
    pub value: Option<f64>,
    /// Its lower bound.
    pub lower: Option<f64>,
    /// Its upper bound.
    pub upper: Option<f64>,
    /// The unit of all of these.
    pub unit: Unit,
    /// The outcome.
    pub outcome: LimitOutcome,
}

/// The outcome of a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LimitOutcome {
    /// Value and bounds keep it.
    Kept,
    /// The value keeps it, though a bound does not.
    KeptWithinBounds,
    /// The value breaks it.
    Broken,
    /// There is no value to hold against it; counts as broken.
    NoValue,
}

/// Something that the reader must know before believing a number.
#[derive(Clone, Debug, Serialize)]
pub struct Alert {
    /// A name that does not change, for programs.
    pub code: &'static str,
    /// The severity.
    pub severity: Severity,
    /// The text, with the size of the effect.
    pub message: String,
}

/// The severity of an alert.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// For information.
    Note,
    /// The values may not hold.
    Warning,
}

/// A distribution to be drawn.
#[derive(Clone, Debug, Serialize)]
pub struct HistogramPlot {
    /// `solid.thickness`, `pore.size.local`, `pore.size.access`, `chords.solid.x` …
    pub id: String,
    /// The title of the chart.
    pub title: String,
    /// What its axis is in.
    pub unit: Unit,
    /// `solid` or `pore`.
    pub phase: &'static str,
    /// Lower end of the first and upper end of the last of equal bins.
    pub range: [f64; 2],
    /// Shares that add up to 1.
    pub shares: Vec<f64>,
    /// The mean.
    pub mean: f64,
    /// The standard deviation.
    pub deviation: f64,
    /// Shares of weight and the values below which they lie: p1, p5, p50, p95.
    pub quantiles: Vec<(f64, f64)>,
    /// What it shows, and what good and bad look like.
    pub reading: &'static str,
}

/// The share of the pore volume that a ball reaches from outside, by its diameter.
#[derive(Clone, Debug, Serialize)]
pub struct AccessCurve {
    /// Diameters and shares (0 to 1), diameters ascending from 0.
    pub points: Vec<[f64; 2]>,
    /// The largest ball that gets from face to face along x, y and z, by its diameter.
    pub percolation: [Option<f64>; 3],
}

/// The porosity of slices across an axis.
#[derive(Clone, Debug, Serialize)]
pub struct Profile {
    /// `x`, `y` or `z`.
    pub axis: &'static str,
    /// Centres of the slices, in world coordinates.
    pub positions: Vec<f64>,
    /// From 0 to 1; not a number (null) where the region has no area.
    pub porosity: Vec<f64>,
}

/// The ellipsoid of mean intercept lengths.
#[derive(Clone, Debug, Serialize)]
pub struct Anisotropy {
    /// Degree of anisotropy, 1 − (c/a)².
    pub degree: f64,
    /// Half axes a ≥ b ≥ c, as lengths; infinite (null) of plates.
    pub lengths: [f64; 3],
    /// Their directions, of length 1.
    pub directions: [[f64; 3]; 3],
}

/// What the main metrics come to when something is varied that should not matter.
#[derive(Clone, Debug, Serialize)]
pub struct Convergence {
    /// The quantity that is varied.
    pub over: Varied,
    /// Pitches in world units, descending; or shares of the region's sides, ascending.
    pub at: Vec<f64>,
    /// One series for each metric.
    pub series: Vec<ConvergenceSeries>,
}

/// The quantity that a convergence study varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Varied {
    /// The distance of the rays.
    Pitch,
    /// The size of the region.
    Region,
}

/// One metric of a convergence study.
#[derive(Clone, Debug, Serialize)]
pub struct ConvergenceSeries {
    /// Its id.
    pub metric: &'static str,
    /// One for each of [`Convergence::at`].
    pub values: Vec<Option<f64>>,
    /// The observed order p of an error that shrinks as h^p; nothing where the values do not tell.
    pub order: Option<f64>,
}

/// Where the numbers are from.
#[derive(Clone, Debug, Serialize)]
pub struct Provenance {
    /// The files that were read.
    pub inputs: Vec<InputFile>,
    /// As it was typed.
    pub command_line: String,
    /// The version of the library.
    pub version: &'static str,
    /// ISO 8601, UTC.
    pub made: String,
    /// The device that sampled.
    pub device: String,
    /// Threads of the processor.
    pub threads: usize,
    /// Rays along x, y and z.
    pub rays: [u32; 3],
    /// In world units.
    pub pitch: f64,
    /// `clip`, `periodic` or `border`.
    pub edges: &'static str,
    /// `box`, `hull`, `wrap:` and a diameter, or the file of the region of interest.
    pub region: String,
    /// Stages and their seconds, in order.
    #[serde(serialize_with = "object")]
    pub seconds: Vec<(&'static str, f64)>,
    /// The most memory that the process held.
    pub peak_memory_bytes: Option<u64>,
}

/// A file that was read.
#[derive(Clone, Debug, Serialize)]
pub struct InputFile {
    /// `solid` or `roi`.
    pub role: &'static str,
    /// Its path as it was given.
    pub path: String,
    /// Its hash (SHA-256), in hexadecimal.
    pub sha256: String,
    /// Its triangles.
    pub triangles: u64,
    /// Whether its mesh is closed.
    pub closed: bool,
    /// Whether its triangles agree on what is outside.
    pub oriented: bool,
    /// The unit that it states.
    #[serde(serialize_with = "symbol")]
    pub unit: Option<LengthUnit>,
}

/// Pairs as an object with their names as keys.
fn object<S: Serializer, V: Serialize>(pairs: &[(&'static str, V)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(pairs.iter().map(|(name, value)| (name, value)))
}

fn symbol<S: Serializer>(unit: &Option<LengthUnit>, serializer: S) -> Result<S::Ok, S::Error> {
    unit.map(LengthUnit::symbol).serialize(serializer)
}

/// What is to be seen, as arrays and files.
#[derive(Clone, Debug, Default)]
pub struct Pictures {
    /// A shaded view, as PNG.
    pub view: Option<Vec<u8>>,
    /// Slices across x, y and z through the middle.
    pub slices: Vec<Slice>,
}

/// A plane of nodes with what is known of them.
#[derive(Clone, Debug)]
pub struct Slice {
    /// `x`, `y` or `z`: the axis across the slice.
    pub across: &'static str,
    /// Where it lies on that axis, in world units.
    pub position: f64,
    /// The axes along columns and rows, by name.
    pub along: [&'static str; 2],
    /// Columns and rows; row 0 is the lowest coordinate.
    pub size: [usize; 2],
    /// Of each node, rows one after another.
    pub nodes: Vec<SliceNode>,
    /// The distance of nodes, in world units.
    pub pitch: f64,
}

/// A node of a slice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SliceNode {
    /// Outside the region.
    Outside,
    /// With the local thickness, in world units.
    Solid(f32),
    /// With the local width of the pore, in world units.
    Pore(f32),
}
