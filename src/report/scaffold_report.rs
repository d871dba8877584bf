//! The data behind one scaffold report.
//!
//! All values are in world units (`unit` names the length, if it is known), positions in world coordinates. JSON is this
//! structure without pictures.

use serde::{Deserialize, Serialize, Serializer};

use super::id::{Group, MetricId};
use super::quantity::Unit;
use crate::mesh::LengthUnit;

/// The schema version of metrics.json.
pub const SCHEMA: &str = "ldi-ops-report/1";

/// A report on one solid.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ScaffoldReport {
    /// The schema version of the JSON.
    pub schema: &'static str,
    /// The name of the solid: that of its file.
    pub title: String,
    /// The unit of length; `None` if neither the file nor the user states it.
    #[serde(serialize_with = "symbol")]
    pub unit: Option<LengthUnit>,
    /// The result of checking the limits, if any were given.
    pub verdict: Option<Verdict>,
    /// Remarks on inputs and metrics.
    pub alerts: Vec<Alert>,
    /// All metrics of the catalogue, in its order.
    pub metrics: Vec<Metric>,
    /// The distributions.
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

impl ScaffoldReport {
    /// Returns a metric by its id.
    pub fn metric(&self, id: &str) -> Option<&Metric> {
        self.metrics.iter().find(|metric| metric.id == id)
    }
}

/// A number with its meaning and its provenance.
#[derive(Clone, Debug, Serialize)]
pub struct Metric {
    /// A stable name for programs: `porosity`, `solid.thickness.mean`.
    pub id: &'static str,
    /// The family that the metric belongs to.
    pub group: Group,
    /// The symbol in the literature: `BV/TV`, `Tb.Th`.
    pub symbol: &'static str,
    /// The name for readers.
    pub name: &'static str,
    /// The definition in one line.
    pub definition: &'static str,
    /// The value; if `None`, `status` and `warnings` say why.
    pub value: Option<f64>,
    /// An estimate of the error of the value, ±; not a bound.
    pub error: Option<f64>,
    /// The lower bound, from the inner and the outer solid.
    pub lower: Option<f64>,
    /// The upper bound, likewise.
    pub upper: Option<f64>,
    /// The unit of the value.
    pub unit: Unit,
    /// The method of measurement.
    pub method: &'static str,
    /// Parameters of the value beside the solid: names and values.
    #[serde(serialize_with = "object")]
    pub parameters: Vec<(&'static str, String)>,
    /// The source of the definition.
    pub reference: &'static str,
    /// The status of the value.
    pub status: Status,
    /// Reasons for doubt.
    pub warnings: Vec<String>,
}

/// The status of a value: present, or the reason why not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// The value is measured.
    Measured,
    /// The metric is undefined for this solid: the separation of a block without pores.
    NotApplicable,
    /// The raster is too coarse for the metric; there may be a value, and there is a warning.
    NotResolved,
}

/// The result of checking the user's limits.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// True if every limit is kept.
    pub passed: bool,
    /// The limits, in the order of their file.
    pub limits: Vec<LimitVerdict>,
}

/// One limit and the metric checked against it.
#[derive(Clone, Debug, Serialize)]
pub struct LimitVerdict {
    /// The metric's id.
    pub metric: String,
    /// The name of the metric for readers.
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

impl LimitVerdict {
    /// Returns whether the limit is broken although the value keeps it: then certified bounds break it.
    pub fn is_broken_by_bounds(&self) -> bool {
        let keeps = |value| self.min.is_none_or(|min| value >= min) && self.max.is_none_or(|max| value <= max);
        self.outcome == LimitOutcome::Broken && self.value.is_some_and(keeps)
    }
}

/// The outcome of a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LimitOutcome {
    /// The value and its bounds keep it.
    Kept,
    /// The value keeps it, but a bound does not.
    KeptWithinBounds,
    /// The value breaks it, or no value within certified bounds keeps it.
    Broken,
    /// There is no value to check; counts as broken.
    NoValue,
}

/// A fact that the reader must know before trusting a number.
#[derive(Clone, Debug, Serialize)]
pub struct Alert {
    /// A stable name for programs.
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
    /// The values may be wrong.
    Warning,
}

/// A distribution to be drawn.
#[derive(Clone, Debug, Serialize)]
pub struct HistogramPlot {
    /// The id: `solid.thickness`, `pore.thickness`, `pore.access`, `chord.solid` or `chord.pore`.
    pub id: String,
    /// The title of the chart.
    pub title: String,
    /// The unit of its axis.
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
    /// The meaning of the plot, with examples of good and bad ones.
    pub reading: &'static str,
}

/// The share of the pore volume that a ball reaches from outside, by its diameter.
#[derive(Clone, Debug, Serialize)]
pub struct AccessCurve {
    /// Diameters and shares (0 to 1), diameters ascending from 0.
    pub points: Vec<[f64; 2]>,
    /// Diameters of the largest balls that pass from face to face along x, y and z.
    pub percolation: [Option<f64>; 3],
}

/// The porosity of slices across an axis.
#[derive(Clone, Debug, Serialize)]
pub struct Profile {
    /// `x`, `y` or `z`.
    pub axis: &'static str,
    /// Centres of the slices, in world coordinates.
    pub positions: Vec<f64>,
    /// Porosities from 0 to 1; not a number (null) where the region has no area.
    pub porosity: Vec<f64>,
}

/// The ellipsoid of mean intercept lengths.
#[derive(Clone, Debug, Serialize)]
pub struct Anisotropy {
    /// Degree of anisotropy, 1 − (c/a)².
    pub degree: f64,
    /// Half axes a ≥ b ≥ c, as lengths; infinite (null) for plates.
    pub lengths: [f64; 3],
    /// Their directions, as unit vectors.
    pub directions: [[f64; 3]; 3],
}

/// The main metrics as a quantity varies that should not matter.
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
    /// The id of the metric.
    pub metric: MetricId,
    /// One value for each of [`Convergence::at`].
    pub values: Vec<Option<f64>>,
    /// The observed order p of an error that shrinks as h^p; `None` if the values do not determine it.
    pub order: Option<f64>,
}

/// The provenance of the numbers.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Provenance {
    /// The files that were read.
    pub inputs: Vec<InputFile>,
    /// The command line as typed.
    pub command_line: String,
    /// The version of the library.
    pub version: &'static str,
    /// The time of the report, in ISO 8601, UTC.
    pub made: String,
    /// The device that sampled.
    pub device: String,
    /// Number of processor threads.
    pub threads: usize,
    /// Numbers of rays along x, y and z.
    pub rays: [u32; 3],
    /// The pitch in world units.
    pub pitch: f64,
    /// The boundary condition: `clip`, `periodic` or `border`.
    pub edges: &'static str,
    /// The region: `box`, `hull`, `wrap:` and a diameter, or the file of the region of interest.
    pub region: String,
    /// Stages and their seconds, in order.
    #[serde(serialize_with = "object")]
    pub seconds: Vec<(&'static str, f64)>,
    /// Peak memory of the process.
    pub peak_memory_bytes: Option<u64>,
}

/// An input file.
#[derive(Clone, Debug, Serialize)]
pub struct InputFile {
    /// `solid` or `roi`.
    pub role: &'static str,
    /// Its path as it was given.
    pub path: String,
    /// Its SHA-256 hash, in hexadecimal.
    pub sha256: String,
    /// Its number of triangles.
    pub triangles: u64,
    /// True if its mesh is closed.
    pub closed: bool,
    /// True if its triangles agree on which side is outside.
    pub oriented: bool,
    /// The unit that it states.
    #[serde(serialize_with = "symbol")]
    pub unit: Option<LengthUnit>,
}

/// Serialises pairs as an object with their names as keys.
fn object<S: Serializer, V: Serialize>(pairs: &[(&'static str, V)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(pairs.iter().map(|(name, value)| (name, value)))
}

fn symbol<S: Serializer>(unit: &Option<LengthUnit>, serializer: S) -> Result<S::Ok, S::Error> {
    unit.map(LengthUnit::symbol).serialize(serializer)
}

/// The pictures, as arrays and files.
#[derive(Clone, Debug, Default)]
pub struct Pictures {
    /// A shaded view, as PNG.
    pub view: Option<Vec<u8>>,
    /// Slices across x, y and z through the middle.
    pub slices: Vec<Slice>,
}

/// A plane of nodes with their phases and local sizes.
#[derive(Clone, Debug)]
pub struct Slice {
    /// `x`, `y` or `z`: the axis across the slice.
    pub across: &'static str,
    /// Its coordinate on that axis, in world units.
    pub position: f64,
    /// The axes along columns and rows, by name.
    pub along: [&'static str; 2],
    /// Columns and rows; row 0 is the lowest coordinate.
    pub size: [usize; 2],
    /// The nodes, row by row.
    pub nodes: Vec<SliceNode>,
    /// The distance between nodes, in world units.
    pub pitch: f64,
}

/// A node of a slice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SliceNode {
    /// Outside the region.
    Outside,
    /// In the solid, with the local thickness, in world units.
    Solid(f32),
    /// In a pore, with its local width, in world units.
    Pore(f32),
}
