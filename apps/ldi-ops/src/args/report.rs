//! Arguments of `report`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use ldi_ops::length::Length;
use ldi_ops::mesh::LengthUnit;
use ldi_ops::placement::Placement;
use ldi_ops::unit;

use super::{CommonArguments, DeviceArguments, FillArguments};

#[derive(Debug, Args)]
#[command(after_help = REPORT_EXAMPLES)]
pub struct ReportArguments {
    /// The solids, each measured on its own
    #[arg(required = true, value_name = "A")]
    pub solids: Vec<PathBuf>,
    /// Output folder for report.html, metrics.json, metrics.csv and methods.txt; created if missing. With several solids each
    /// has its own folder in it, and index.html and designs.csv list them all [default: no files; stdout has the key figures]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub region: RegionArguments,
    #[command(flatten)]
    pub judging: JudgingArguments,
    #[command(flatten)]
    pub raster: RasterArguments,
    #[command(flatten)]
    pub common: CommonArguments,
}

/// The region to measure.
#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct RegionArguments {
    /// Unit of length of files that state none: mm, um (µm), cm, m, in, ft
    #[arg(long, value_parser = unit::parse)]
    pub unit: Option<LengthUnit>,
    /// Accept meshes that are not closed; rays that do not close count as empty, and an alert says so
    #[arg(long)]
    pub allow_open: bool,
    /// Region of interest: a closed mesh, such as the bone around the scaffold; `hull`, the convex hull of the solid; or
    /// `wrap:D`, the solid with all pores filled that a ball of diameter D cannot enter from outside (`wrap`: a quarter of the
    /// longest side; `./hull` names a file) [default: the box of the solid]
    #[arg(long, value_name = "B|hull|wrap[:D]")]
    pub roi: Option<PathBuf>,
    /// Place the solid before use, steps from left to right: 'translate(1,0,0) rotate(0,0,1,30) scale(2)', in its own unit
    #[arg(long, value_name = "PLACEMENT")]
    pub transform_a: Option<Placement>,
    /// Place the region of interest, in the same way
    #[arg(long, value_name = "PLACEMENT", requires = "roi")]
    pub transform_roi: Option<Placement>,
    /// Boundary condition of the region: border (balls lie within it), clip (balls may extend beyond it, as in BoneJ and
    /// PoreSpy) or periodic (the box is a cell that repeats)
    #[arg(long, value_enum, default_value_t = EdgesChoice::Border)]
    pub edges: EdgesChoice,
}

/// Limits, comparison and parameters of the metrics.
#[derive(Debug, Args)]
#[command(next_help_heading = "Judging")]
pub struct JudgingArguments {
    /// File of limits on metrics, .toml; the exit code is 1 if one is broken
    #[arg(long, value_name = "FILE")]
    pub limits: Option<PathBuf>,
    /// Second design to compare with the first; -o writes compare.html
    #[arg(long, value_name = "B")]
    pub compare: Option<PathBuf>,
    /// Build direction, upwards: x, y, z, -x, -y or -z
    #[arg(long, value_enum, default_value_t = BuildChoice::Z, allow_hyphen_values = true)]
    pub build: BuildChoice,
    /// Overhang angle, in degrees from the horizontal: surface that faces down at a smaller angle counts as overhang
    #[arg(long, value_name = "DEGREES", default_value_t = 45.0, allow_hyphen_values = true)]
    pub overhang_angle: f64,
    /// Constant K of the Kozeny–Carman estimate of permeability
    #[arg(long, value_name = "K", default_value_t = 5.0, allow_hyphen_values = true)]
    pub kozeny: f64,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Sampling")]
pub struct RasterArguments {
    /// Rays along the longest side of the region [default: 256]
    #[arg(long, value_name = "N", conflicts_with = "pitch")]
    #[arg(value_parser = super::number_of_rays, allow_hyphen_values = true)]
    pub resolution: Option<u32>,
    /// Distance between neighbouring rays, in file units or with a unit: 0.05mm
    #[arg(long, value_name = "H", allow_hyphen_values = true)]
    pub pitch: Option<Length>,
    /// Most rays along the longest side of the raster for tortuosity, whose pitch is a whole multiple of the report's
    #[arg(long, value_name = "N", default_value_t = 128)]
    #[arg(value_parser = super::number_of_rays, allow_hyphen_values = true)]
    pub tortuosity_resolution: u32,
    #[command(flatten)]
    pub fill: FillArguments,
    #[command(flatten)]
    pub device: DeviceArguments,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum EdgesChoice {
    Clip,
    Periodic,
    Border,
}

/// The direction in which a solid is built up.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum BuildChoice {
    X,
    Y,
    Z,
    #[value(name = "-x")]
    MinusX,
    #[value(name = "-y")]
    MinusY,
    #[value(name = "-z")]
    MinusZ,
}

const REPORT_EXAMPLES: &str = "\
Examples:
  ldi-ops report scaffold.stl --unit mm                                   the key figures, no files
  ldi-ops report scaffold.stl --unit mm -o report
  ldi-ops report scaffold.stl --unit mm --roi bone.stl -o report          only within the bone
  ldi-ops report scaffold.stl --unit mm --limits limits.toml -o report    check limits
  ldi-ops report old.stl --compare new.stl --unit mm -o report
  ldi-ops report *.stl --unit mm -o reports                               a page each, and a table
  ldi-ops report cell.stl --edges periodic --resolution 128 -o report     one cell of a lattice

limits.toml lists metrics by their ids in metrics.json, with min, max or both, as shares or
lengths with or without a unit:

  porosity = { min = \"60 %\", max = \"80 %\" }
  percolation = { min = \"300 um\" }
  \"wall.thinnest\" = { min = \"0.2 mm\" }

report.html is one file and needs no network. metrics.json has every metric with its bounds,
method, parameters and source; metrics.csv has the same as a long table, methods.txt a paragraph
for a paper. stdout has the key figures, or with `--json -` the content of metrics.json.";
