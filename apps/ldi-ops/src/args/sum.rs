//! Arguments of `minkowski`, `offset`, `open` and `close`.

use std::path::PathBuf;

use clap::Args;
use ldi_ops::length::Length;
use ldi_ops::mesh::LengthUnit;
use ldi_ops::placement::Placement;
use ldi_ops::unit;

use super::{
    CertaintyArguments, CommonArguments, DeviceArguments, FillArguments, ImageArguments, KindArguments, MeshChoice,
    SpacingArguments,
};

#[derive(Debug, Args)]
#[command(after_help = MINKOWSKI_EXAMPLES)]
pub struct MinkowskiArguments {
    /// The first solid, A
    pub a: PathBuf,
    /// The second solid, B
    pub b: PathBuf,
    /// Compute the difference A ⊖ B: all x for which B moved by x lies within A
    #[arg(long)]
    pub difference: bool,
    /// Reflect B through the origin: A ⊕ (−B) is the set of translations for which B meets A
    #[arg(long)]
    pub reflect: bool,
    #[command(flatten)]
    pub placing: SumPlacingArguments,
    /// Place B before use, in the way of --transform-a
    #[arg(long, value_name = "PLACEMENT", help_heading = "Input")]
    pub transform_b: Option<Placement>,
    #[command(flatten)]
    pub rest: SumArguments,
}

const MINKOWSKI_EXAMPLES: &str = "\
Examples:
  ldi-ops minkowski part.stl b.stl --unit mm
  ldi-ops minkowski part.stl b.stl -o sum.stl
  ldi-ops minkowski scaffold.stl a.stl --difference --transform-b 'scale(0.3)' --json -
  ldi-ops minkowski bone.stl drill.stl --reflect -o obstacle.npz
  ldi-ops minkowski part.stl b.stl --memory 2G

A ⊕ B is the set of all sums a + b. Neither solid needs to be convex or to contain the origin;
the sum moves with B. Both solids must be closed and consistently oriented, or able to be turned so
under the even-odd rule; a solid that is inside out is reversed. --fill nonzero unites overlapping
shells of one solid. The result of --difference may be empty: a warning says so, and --bounds limits
what may be left. The images along all three axes are made even if --axis names one. The JSON adds
`memory` and `steps`: pairs of features, their primitives, the crossings of these, and the resolved
gaps. --backend gpu finds the crossings and resolves the gaps on the GPU.";

#[derive(Debug, Args)]
#[command(after_help = OFFSET_EXAMPLES)]
pub struct OffsetArguments {
    /// The solid
    pub a: PathBuf,
    /// Distance, outwards, or inwards if negative; in file units or with a unit: 0.1mm
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
  ldi-ops offset part.stl --distance -0.2 -o shrunk.stl
  ldi-ops offset part.stl --distance 50um --unit mm --tolerance 0.5%
  ldi-ops offset bone.stl --distance 1 --axis z --json -

The result has all points within the distance of the solid, or with a negative distance all
points at least as deep inside it: an offset by a true ball, round at edges and corners. Inwards,
thin walls vanish; if nothing is left, a warning says so, and --bounds limits what may be left.
--backend gpu resolves the gaps on the GPU.";

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

open offsets the solid inwards by the radius and back: walls, struts and edges thinner than the
ball vanish. close offsets it outwards and back: pores, gaps and inner edges in which the ball
does not fit are filled. The second step starts from the surface of the first at the same pitch.";

/// The options that all sums and offsets share, besides solids and placement.
#[derive(Debug, Args)]
pub struct SumArguments {
    #[command(flatten)]
    pub sampling: SumSamplingArguments,
    #[command(flatten)]
    pub method: SumMethodArguments,
    #[command(flatten)]
    pub certainty: CertaintyArguments,
    #[command(flatten)]
    pub writing: ImageArguments,
    #[command(flatten)]
    pub common: CommonArguments,
}

/// The method of the volume and of a written mesh, of which sums have one.
#[derive(Debug, Args)]
#[command(next_help_heading = "Sampling")]
pub struct SumMethodArguments {
    /// Refused, with the reason: no sum or offset has an exact volume
    #[arg(long, conflicts_with = "estimate")]
    pub exact: bool,
    /// Take the estimate of the images, as sums and offsets always do
    #[arg(long)]
    pub estimate: bool,
    /// Method of a written mesh; `sampled` is the only one of sums and offsets, and `exact` is refused with the reason
    #[arg(long, value_enum)]
    pub mesh: Option<MeshChoice>,
}

impl SumMethodArguments {
    /// Returns why the method cannot be had.
    pub fn refusal(&self) -> Option<&'static str> {
        if self.exact {
            return Some(
                "--exact: the volume of a sum or an offset follows from images alone; remove --exact for an estimate",
            );
        }
        (self.mesh == Some(MeshChoice::Exact)).then_some(
            "--mesh exact: the mesh of a sum or an offset follows from images alone; remove the option, and choose \
             --resolution and --surface-error",
        )
    }
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct SumPlacingArguments {
    /// Unit of length of files that state none: mm, um (µm), cm, m, in, ft
    #[arg(long, value_parser = unit::parse)]
    pub unit: Option<LengthUnit>,
    /// Place A before use, steps from left to right: 'translate(1,0,0) rotate(0,0,1,30) scale(2)', in its own unit; rotate
    /// takes an axis and degrees, scale one number or three
    #[arg(long, value_name = "PLACEMENT")]
    pub transform_a: Option<Placement>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Sampling")]
pub struct SumSamplingArguments {
    /// Rays along the longest side of the result's box, or of A's if the result lies within A [default: 512]
    #[arg(long, value_name = "N", conflicts_with_all = ["pitch", "tolerance"])]
    #[arg(value_parser = super::number_of_rays, allow_hyphen_values = true)]
    pub resolution: Option<u32>,
    #[command(flatten)]
    pub spacing: SpacingArguments,
    #[command(flatten)]
    pub kind: KindArguments,
    #[command(flatten)]
    pub fill: FillArguments,
    #[command(flatten)]
    pub device: DeviceArguments,
}
