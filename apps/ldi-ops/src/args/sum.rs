//! Arguments of `minkowski`, `offset`, `open` and `close`.

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use ldi_ops::length::Length;
use ldi_ops::mesh::LengthUnit;
use ldi_ops::placement::Placement;
use ldi_ops::unit;

use super::{AxisChoice, BackendChoice, CommonArguments, FillChoice, ImageArguments, ModeChoice};

#[derive(Debug, Args)]
#[command(after_help = MINKOWSKI_EXAMPLES)]
pub struct MinkowskiArguments {
    /// The first solid, A
    pub a: PathBuf,
    /// The second solid, B
    pub b: PathBuf,
    /// A ⊖ B, where B fits: all x for which B moved by x lies within A
    #[arg(long)]
    pub difference: bool,
    /// −B for B, B seen through the origin: A ⊕ (−B) is where B must not be moved to if it is to keep clear of A
    #[arg(long)]
    pub reflect: bool,
    #[command(flatten)]
    pub placing: SumPlacingArguments,
    /// Place B before use
    #[arg(long, value_name = "PLACEMENT", help_heading = "Input")]
    pub transform_b: Option<Placement>,
    #[command(flatten)]
    pub rest: SumArguments,
}

const MINKOWSKI_EXAMPLES: &str = "\
Examples:
  ldi-ops minkowski part.stl b.stl --unit mm
  ldi-ops minkowski part.stl b.stl --mode exact --simplify 0.1h -o sum.stl
  ldi-ops minkowski scaffold.stl a.stl --difference --transform-b 'scale(0.3)' --json -
  ldi-ops minkowski bone.stl drill.stl --reflect -o obstacle.npz
  ldi-ops minkowski part.stl b.stl --memory 2G

A ⊕ B is every a + b. Neither needs to be convex, or to contain the origin; where B lies, the sum lies
with it. Both solids must be closed, with triangles that agree on what is outside; one that is inside
out is turned. Where shells of one solid overlap, --fill nonzero unites them. --difference may leave
nothing, which is told; the volume is then 0. The JSON adds `memory` and `steps`: pairs of features,
their primitives, the crossings of these, and what was filled between.";

#[derive(Debug, Args)]
#[command(after_help = OFFSET_EXAMPLES)]
pub struct OffsetArguments {
    /// The solid
    pub a: PathBuf,
    /// How far the surface moves, outwards, or inwards if below zero; in file units or with a unit: 0.1mm
    #[arg(long, value_name = "D", allow_hyphen_values = true)]
    pub distance: Length,
    #[command(flatten)]
    pub placing: SumPlacingArguments,
    #[command(flatten)]
    pub rest: SumArguments,
}

const OFFSET_EXAMPLES: &str = "\
Examples:
  ldi-ops offset part.stl --distance 0.5 --unit mm
  ldi-ops offset part.stl --distance -0.2 --mode exact -o shrunk.stl
  ldi-ops offset part.stl --distance 50um --unit mm
  ldi-ops offset bone.stl --distance 1 --axis z --json -

All points within the distance of the solid, or with a distance below zero those that are as far inside
it: by a true ball, round about edges and corners. Inwards thin walls vanish, and perhaps all does,
which is told; the volume is then 0.";

#[derive(Debug, Args)]
#[command(after_help = BALL_EXAMPLES)]
pub struct BallArguments {
    /// The solid
    pub a: PathBuf,
    /// Radius of the ball, in file units or with a unit: 500um
    #[arg(long, value_name = "R", allow_hyphen_values = true)]
    pub radius: Length,
    #[command(flatten)]
    pub placing: SumPlacingArguments,
    #[command(flatten)]
    pub rest: SumArguments,
}

const BALL_EXAMPLES: &str = "\
Examples:
  ldi-ops open part.stl --radius 0.1 --unit mm
  ldi-ops close scaffold.stl --radius 0.2 --mode exact -o closed.stl

open keeps what a ball reaches that stays within the solid: it goes inwards by the radius and back, so
that walls, struts and edges thinner than the ball vanish. close goes outwards and back, and fills
pores, gaps and inner edges where no such ball fits. The second step starts from the surface of the
first at the same pitch.";

/// What all sums take beside solids and their places.
#[derive(Debug, Args)]
pub struct SumArguments {
    #[command(flatten)]
    pub sampling: SumSamplingArguments,
    #[command(flatten)]
    pub writing: ImageArguments,
    #[command(flatten)]
    pub common: CommonArguments,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct SumPlacingArguments {
    /// Unit of files that state none: mm, um (µm), cm, m, in, ft
    #[arg(long, value_parser = unit::parse)]
    pub unit: Option<LengthUnit>,
    /// Place A before use, left to right, in its own unit: 'translate(1,0,0) rotate(0,0,1,30) scale(2)', where rotate
    /// takes an axis and degrees and scale one number or three
    #[arg(long, value_name = "PLACEMENT")]
    pub transform_a: Option<Placement>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Sampling")]
pub struct SumSamplingArguments {
    /// Rays along the longest side of the result's box, or of that of A where the result lies within A [default: 512]
    #[arg(long, value_name = "N", conflicts_with = "pitch")]
    pub resolution: Option<u32>,
    /// Distance of neighbouring rays, in file units or with a unit: 0.05mm
    #[arg(long, value_name = "H", allow_hyphen_values = true)]
    pub pitch: Option<Length>,
    /// LOD-C, voxels a ray is divided into for over and under: 32 to 65536
    #[arg(long, value_name = "N", default_value_t = 1024)]
    pub lod: u32,
    /// Ray directions of the images that are measured and written; all three are made in any case, as each tells what lies
    /// between the rays of the others
    #[arg(long, value_enum, default_value_t = AxisChoice::All)]
    pub axis: AxisChoice,
    /// Which image is kept: one that encloses the result on every ray, one that lies inside, or every crossing. A mesh of it
    /// passes through the samples and is itself no bound
    #[arg(long, value_enum, default_value_t = ModeChoice::Exact)]
    pub mode: ModeChoice,
    /// What is inside where shells overlap: nonzero unites them, and with even-odd, in which they cancel, there is no sum
    /// of them
    #[arg(long, value_enum, default_value_t = FillChoice::EvenOdd)]
    pub fill: FillChoice,
    /// Where it runs, which changes no bit of the result: gpu finds the crossings of sums and differences there, and which
    /// gaps between them are none, also of offsets; all else stays on the CPU, and with auto everything, as no GPU has been
    /// measured yet
    #[arg(long, value_enum, default_value_t = BackendChoice::Auto)]
    pub backend: BackendChoice,
    /// GPU to use, by its name or a part of it; implies --backend gpu
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,
    /// Memory that may be taken: 800M, 2G or 1.5GiB. A job that is expected to take more is refused before its rays are
    /// cast, with what would fit; where surfaces are large for the raster it may take two or three times what is expected
    /// [default: 80 % of what is free]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<MemorySize>,
}

/// A size of memory, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemorySize(pub u64);

impl FromStr for MemorySize {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<MemorySize, &'static str> {
        const WANTED: &str = "expected a size of memory, as in 800M, 2G or 1.5GiB";
        let text = text.trim().to_ascii_lowercase();
        let end = text.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(text.len());
        let (number, suffix) = text.split_at(end);
        let suffix = suffix.trim();
        let (prefix, base) = match suffix.strip_suffix("ib") {
            Some(prefix) if !prefix.is_empty() => (prefix, 1024f64),
            Some(_) => return Err(WANTED),
            None => (suffix.strip_suffix('b').unwrap_or(suffix), 1000.0),
        };
        let power = match prefix {
            "" => 0,
            "k" => 1,
            "m" => 2,
            "g" => 3,
            "t" => 4,
            _ => return Err(WANTED),
        };
        match number.parse::<f64>() {
            Ok(number) if number > 0.0 => Ok(MemorySize((number * base.powi(power)) as u64)),
            _ => Err(WANTED),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_suffixes() {
        let size = |text: &str| text.parse::<MemorySize>().map(|MemorySize(bytes)| bytes);
        for (text, bytes) in [
            ("123", 123),
            ("800M", 800_000_000),
            ("2G", 2_000_000_000),
            ("2gb", 2_000_000_000),
            ("1.5 GiB", 3 << 29),
            ("4KiB", 4096),
            ("1t", 1_000_000_000_000),
        ] {
            assert_eq!(size(text), Ok(bytes), "{text}");
        }
        for wrong in ["", "0", "-1G", "G", "2X", "1.2.3M", "5iB", "2 G G", "nan"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }
}
