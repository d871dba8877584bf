//! Arguments of `clash`.

use std::path::PathBuf;

use clap::Args;
use ldi_ops::cubic::TypedVolume;
use ldi_ops::driver::clash::rules::IgnoredPair;
use ldi_ops::length::Length;
use ldi_ops::mesh::LengthUnit;
use ldi_ops::unit;

use super::{BackendArguments, CommonArguments, FillArguments, MemorySize, SpacingArguments, TransformArguments};

#[derive(Debug, Args)]
#[command(after_help = CLASH_EXAMPLES)]
pub struct ClashArguments {
    /// The parts: mesh files, folders of mesh files, and assemblies (.3mf, .glb, .gltf), whose objects are parts in their places
    #[arg(value_name = "PART", required_unless_present = "assembly")]
    pub parts: Vec<PathBuf>,
    /// Further parts from a list with their places, .toml
    #[arg(long, value_name = "FILE")]
    pub assembly: Option<PathBuf>,
    /// Output folder for clash.html, clash.json and clash.csv; created if missing
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Write the table of near pairs as CSV
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    #[command(flatten)]
    pub transforms: TransformArguments,
    #[command(flatten)]
    pub rules: RuleArguments,
    #[command(flatten)]
    pub comparison: ComparisonArguments,
    #[command(flatten)]
    pub common: CommonArguments,
}

/// What pairs of parts may do.
#[derive(Debug, Args)]
#[command(next_help_heading = "Rules")]
pub struct RuleArguments {
    /// Least distance between two parts, in file units or with a unit: 0.3mm. A smaller one is a finding
    #[arg(long, value_name = "D", allow_hyphen_values = true)]
    pub clearance: Option<Length>,
    /// Accept parts that touch
    #[arg(long)]
    pub allow_touching: bool,
    /// Accept overlaps up to this volume, in cubic file units or with a unit: 0.5mm3, 0.2ml [default: 0]
    #[arg(long, value_name = "V", allow_hyphen_values = true)]
    pub max_volume: Option<TypedVolume>,
    /// Do not compare parts with these names, in which * stands for any characters and ? for one: 'bolt*:plate.stl'; may be
    /// repeated. Names may have colons: the one at which both sides name parts separates them
    #[arg(long, value_name = "A:B")]
    pub ignore: Vec<IgnoredPair>,
}

/// How parts are compared.
#[derive(Debug, Args)]
#[command(next_help_heading = "Comparison")]
pub struct ComparisonArguments {
    /// Unit of length of files that state none: mm, um (µm), cm, m, in, ft
    #[arg(long, value_parser = unit::parse)]
    pub unit: Option<LengthUnit>,
    /// Largest gap, or depth of an overlap, that counts as touching [default: 2.4e-7 of the largest coordinate of a pair, the
    /// rounding of 32-bit coordinates, but at most 1 % of the thickness of either part]
    #[arg(long, value_name = "T", allow_hyphen_values = true)]
    pub touching: Option<Length>,
    /// Rays along the longest side of the box of an overlap [default: 128]. Like --pitch and --tolerance, for volumes that are
    /// not exact
    #[arg(long, value_name = "N", conflicts_with_all = ["pitch", "tolerance"])]
    #[arg(value_parser = super::number_of_rays, allow_hyphen_values = true)]
    pub resolution: Option<u32>,
    #[command(flatten)]
    pub spacing: SpacingArguments,
    #[command(flatten)]
    pub fill: FillArguments,
    #[command(flatten)]
    pub backend: BackendArguments,
    /// Memory limit: 800M, 2G or 1.5GiB. Parts that exceed it are refused, exact common volumes that do are estimated from
    /// images, and images that do are refused; a --tolerance stops at the finest images that fit [default: 80 % of free memory]
    #[arg(long, value_name = "SIZE", allow_hyphen_values = true)]
    pub memory: Option<MemorySize>,
}

const CLASH_EXAMPLES: &str = "\
Examples:
  ldi-ops clash housing.stl shaft.stl --unit mm
  ldi-ops clash housing.stl shaft.stl --transform-b 'translate(0,0,2)' --unit mm
  ldi-ops clash assembly.3mf --clearance 0.3mm -o clashes        a page with pictures
  ldi-ops clash parts/ --ignore 'bolt*:plate*' --allow-touching --csv clashes.csv
  ldi-ops clash housing.stl --assembly bolts.toml --max-volume 0.01mm3 --unit mm

bolts.toml lists parts with their places; paths are relative to it:

  [[part]]
  file = \"bolt.stl\"
  name = \"bolt 1\"
  transform = \"translate(10,0,0) rotate(0,0,1,30)\"

A part has the name of its file, with that of its object in an assembly: assembly.3mf/bolt. Equal
names are numbered: bolt#2. --transform names the files and folders a, b, c …; all parts of one move
together. Parts are separate, touching or overlapping. Distances are exact, and so are volumes of
parts whose triangles are consistently oriented, or can be turned so under the even-odd rule; others
are estimates with their range. The exit code is 1 if a pair breaks a rule: if it overlaps by more
than --max-volume, touches without --allow-touching, or is nearer than --clearance.

JSON: {\"schema\", \"command\", \"unit\", \"clearance\", \"passed\", \"counts\", \"parts\", \"pairs\": [{\"a\", \"b\",
\"state\", \"finding\", \"distance\", \"depth\", \"points\", \"overlap\": {\"volume\", \"bounds\", \"deepest\", \"depth\",
\"contained\", \"certain\"}}], \"seconds\", \"warnings\"}, the worst pairs first.";
