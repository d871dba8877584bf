//! Arguments of `report`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use ldi_ops::length::Length;
use ldi_ops::mesh::LengthUnit;
use ldi_ops::placement::Placement;
use ldi_ops::unit;

use super::{BackendChoice, CommonArguments, FillChoice};

#[derive(Debug, Args)]
#[command(after_help = REPORT_EXAMPLES)]
pub struct ReportArguments {
    /// The solids, each measured on its own
    #[arg(required = true, value_name = "A")]
    pub solids: Vec<PathBuf>,
    /// The folder for report.html, metrics.json, metrics.csv and methods.txt; it is made where there is none. Of several
    /// solids each gets a folder in it, index.html sums them up, and designs.csv has a row for each
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    #[command(flatten)]
    pub region: RegionArguments,
    #[command(flatten)]
    pub judging: JudgingArguments,
    #[command(flatten)]
    pub raster: RasterArguments,
    #[command(flatten)]
    pub common: CommonArguments,
}

/// What is measured of the solids.
#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct RegionArguments {
    /// Unit of files that state none: mm, um (µm), cm, m, in, ft
    #[arg(long, value_parser = unit::parse)]
    pub unit: Option<LengthUnit>,
    /// Measure meshes that are not closed too; rays that do not close count as empty, and an alert says so
    #[arg(long)]
    pub allow_open: bool,
    /// Region of interest, within which all is measured: a closed mesh, such as the bone around the scaffold; `hull`, the
    /// convex hull of the solid; or `wrap:D`, the solid with all pores filled that a ball of diameter D from outside cannot enter
    /// (`wrap`: a quarter of the longest side; `./hull` names a file) [default: the box of the solid]
    #[arg(long, value_name = "B|hull|wrap[:D]")]
    pub roi: Option<PathBuf>,
    /// Place the solid before use, left to right, in its own unit: 'translate(1,0,0) rotate(0,0,1,30) scale(2)'
    #[arg(long, value_name = "PLACEMENT")]
    pub transform_a: Option<Placement>,
    /// Place the region of interest likewise
    #[arg(long, value_name = "PLACEMENT", requires = "roi")]
    pub transform_roi: Option<Placement>,
    /// What becomes of balls where the region ends: border, they must lie within it; clip, they may reach beyond, as in
    /// BoneJ and PoreSpy; periodic, the box is a cell that repeats
    #[arg(long, value_enum, default_value_t = EdgesChoice::Border)]
    pub edges: EdgesChoice,
    /// What is inside where shells overlap: even-odd cancels, nonzero unites
    #[arg(long, value_enum, default_value_t = FillChoice::EvenOdd)]
    pub fill: FillChoice,
}

/// What the numbers are held against.
#[derive(Debug, Args)]
#[command(next_help_heading = "Judging")]
pub struct JudgingArguments {
    /// Limits that the metrics have to keep, in a .toml file; exit code 1 where one is broken
    #[arg(long, value_name = "FILE")]
    pub limits: Option<PathBuf>,
    /// Another design, to be put beside the first: compare.html
    #[arg(long, value_name = "B")]
    pub compare: Option<PathBuf>,
    /// Which way is up when it is printed: x, y, z, -x, -y or -z
    #[arg(long, value_enum, default_value_t = BuildChoice::Z, allow_hyphen_values = true)]
    pub build: BuildChoice,
    /// Surface counts as overhanging where it faces down and is less steep than this, in degrees from the horizontal
    #[arg(long, value_name = "DEGREES", default_value_t = 45.0)]
    pub overhang_angle: f64,
    /// The constant K of the Kozeny–Carman estimate of permeability
    #[arg(long, value_name = "K", default_value_t = 5.0)]
    pub kozeny: f64,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Sampling")]
pub struct RasterArguments {
    /// Rays along the longest side of the region [default: 256]
    #[arg(long, value_name = "N", conflicts_with = "pitch")]
    pub resolution: Option<u32>,
    /// Distance of neighbouring rays, in file units or with a unit: 0.05mm
    #[arg(long, value_name = "H", allow_hyphen_values = true)]
    pub pitch: Option<Length>,
    /// Rays along the longest side for tortuosity, whose equations are solved on a raster of its own
    #[arg(long, value_name = "N", default_value_t = 128)]
    pub tortuosity_resolution: u32,
    /// Where it is sampled, which changes no bit of a result; see `ldi-ops devices`
    #[arg(long, value_enum, default_value_t = BackendChoice::Auto)]
    pub backend: BackendChoice,
    /// GPU to use, by its name or a part of it; implies --backend gpu
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,
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
  ldi-ops report scaffold.stl --unit mm -o report
  ldi-ops report scaffold.stl --unit mm --roi bone.stl -o report          within the bone alone
  ldi-ops report scaffold.stl --unit mm --limits limits.toml -o report    exit code 1 if a limit is broken
  ldi-ops report old.stl --compare new.stl --unit mm -o report
  ldi-ops report *.stl --unit mm -o reports                               a table to sort, and a page each
  ldi-ops report cell.stl --edges periodic --resolution 128 -o report     one cell of a lattice

limits.toml holds metrics by their ids in metrics.json, with min, max or both, as shares or lengths;
lengths may have a unit:

  porosity = { min = \"60 %\", max = \"80 %\" }
  percolation = { min = \"300 um\" }
  \"wall.thinnest\" = { min = \"0.2 mm\" }

report.html is one file without network; metrics.json holds every metric with its bounds, method,
parameters and source, metrics.csv the same as a long table, methods.txt a paragraph for a paper.
stdout has the key figures, or with `--json -` what is in metrics.json.";
