//! Arguments as they are typed. What they mean together is for [`crate::resolve`].

mod render;
mod report;
mod sum;

use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::styling::{AnsiColor, Styles};
use clap::error::ErrorKind;
use clap::{Arg, ArgAction, ArgMatches, Args, FromArgMatches, Parser, Subcommand, ValueEnum};
use ldi_ops::mesh::LengthUnit;
use ldi_ops::solids::Model;

pub use self::render::{BackgroundChoice, FacetChoice, PictureSize, RenderArguments, SliceAt};
pub use self::report::{BuildChoice, EdgesChoice, JudgingArguments, RasterArguments, RegionArguments, ReportArguments};
pub use self::sum::{
    BallArguments, MemorySize, MinkowskiArguments, OffsetArguments, SumArguments, SumPlacingArguments,
};
use ldi_ops::driver::Bound;
use ldi_ops::length::Length;
use ldi_ops::placement::{Placement, PlacementError};
use ldi_ops::unit;

const STYLES: Styles =
    Styles::styled().header(AnsiColor::Green.on_default().bold()).literal(AnsiColor::Cyan.on_default().bold());

/// Volumes and Booleans of solids given as triangle meshes, computed on layered depth images: for each of a raster of
/// parallel rays, the depths at which it enters and leaves the solid.
#[derive(Debug, Parser)]
#[command(name = "ldi-ops", version, styles = STYLES, max_term_width = 110, after_help = EXAMPLES, after_long_help = EPILOGUE)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

const EXAMPLES: &str = "\
Examples:
  ldi-ops intersect scaffold.stl bone.stl --unit mm        their common volume
  ldi-ops volume part.3mf --tolerance 0.1%                 refine until the estimate is below 0.1 %
  ldi-ops check part.stl                                   is it a solid? exit code 1 if not

`ldi-ops COMMAND --help` tells a command's flags.";

const EPILOGUE: &str = "\
Examples:
  ldi-ops intersect scaffold.stl bone.stl --unit mm        their common volume
  ldi-ops intersect scaffold.stl bone.stl -o common.stl    and a mesh of it to print
  ldi-ops csg 'a & (b | c)' a=scaffold.stl b=bone.stl c=part.stl -o part.3mf
  ldi-ops difference block.stl drill.stl --transform-b 'rotate(1,0,0,90) translate(0,5,0)'
  ldi-ops volume part.3mf --tolerance 0.1%                 refine until the estimate is below 0.1 %
  ldi-ops volume struts.stl --fill nonzero                 overlapping shells unite
  ldi-ops minkowski part.stl ball.stl -o sum.stl           every a + b, of any two solids
  ldi-ops offset part.stl --distance -0.2 -o thin.stl      by a true ball, inwards or outwards
  ldi-ops report scaffold.stl --unit mm -o report          pores, walls, percolation, topology: a page
  ldi-ops sample part.stl --axis z -o part.npz             the image, for numpy
  ldi-ops volume part.stl --backend gpu                    on the first GPU of `ldi-ops devices`
  ldi-ops check part.stl                                   is it a solid? exit code 1 if not
  ldi-ops generate gyroid --cells 4 -o gyroid.stl
  ldi-ops render scaffold.stl bone.stl -o picture.png      what the two share, each in its colour

Meshes are read from .stl, .obj, .ply, .off, .gltf, .glb and .3mf, and from .npz, images of which the
surface is the mesh. The result goes to stdout, as
text or with `--json -` as JSON; everything else goes to stderr.

Other words for commands: intersection, common, and (intersect); join, merge, or (union); subtract, minus
(difference); info (check). Lengths take units: --pitch 0.05mm, --distance 50um, translate(1mm,0,0).

Exit codes: 0 done; 1 a check that was asked for is false; 2 usage or input; 3 machine (memory,
device).";

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Common volume of solids; -o writes the common solid, as a mesh, an image or voxels
    #[command(aliases = ["intersection", "common", "and"])]
    Intersect(IntersectArguments),
    /// Volume of what lies in any of several solids
    #[command(aliases = ["join", "merge", "or"])]
    Union(ListArguments),
    /// Volume of what lies in the first solid and in none of the others
    #[command(aliases = ["subtract", "minus"])]
    Difference(ListArguments),
    /// Volume of what lies in an odd number of the solids: for two, in exactly one
    #[command(alias = "symmetric-difference")]
    Xor(ListArguments),
    /// Volume of what an expression makes of solids: 'a & (b | c) - d'
    Csg(CsgArguments),
    /// Minkowski sum A ⊕ B of two solids, or their difference A ⊖ B
    Minkowski(MinkowskiArguments),
    /// A solid grown or shrunk by a distance
    Offset(OffsetArguments),
    /// Opening by a ball: what is thinner than the ball vanishes
    Open(BallArguments),
    /// Closing by a ball: gaps and pores narrower than the ball are filled
    Close(BallArguments),
    /// Volume, area, centroid and inertia of solids
    Volume(VolumeArguments),
    /// The layered depth image of a solid, as .npz; or its surface, or voxels
    Sample(SampleArguments),
    /// From images in a .npz file back to a mesh
    Surface(SurfaceArguments),
    /// Is it a solid? All defects; exit code 1 if not
    #[command(aliases = ["info", "validate"])]
    Check(CheckArguments),
    /// There is none: the error says what to use instead
    #[command(hide = true, aliases = ["fix", "heal"])]
    Repair(RepairArguments),
    /// Convert between mesh formats
    Convert(ConvertArguments),
    /// Make a model solid
    Generate(GenerateArguments),
    /// Metrics of scaffolds and their pores: a page, a table, and what to say of the method
    Report(ReportArguments),
    /// A picture of solids or of a slice through them, as .png
    Render(RenderArguments),
    /// Where sampling can run, and what `--backend auto` chooses and why
    Devices(DevicesArguments),
}

#[derive(Debug, Args)]
#[command(after_help = INTERSECT_EXAMPLES)]
pub struct IntersectArguments {
    #[command(flatten)]
    pub list: ListOfSolids,
}

const INTERSECT_EXAMPLES: &str = "\
Examples:
  ldi-ops intersect scaffold.stl bone.stl --unit mm
  ldi-ops intersect scaffold.stl bone.stl --mode exact --simplify 0.1h -o common.stl
  ldi-ops intersect a.stl b.stl c.stl --transform c='scale(2)'
  ldi-ops intersect a.stl b.stl --axis z --mode exact --resolution 1024 --json -
  ldi-ops intersect a.stl b.stl --transform-b 'translate(1,0,0) rotate(0,0,1,30)' -o common.npz
  ldi-ops intersect a.stl b.stl --backend gpu

The grid is laid around the box of all solids. `inputs[].volume` in the JSON is the signed volume
of the mesh itself.";

#[derive(Debug, Args)]
#[command(after_help = LIST_EXAMPLES)]
pub struct ListArguments {
    #[command(flatten)]
    pub list: ListOfSolids,
}

const LIST_EXAMPLES: &str = "\
Examples:
  ldi-ops union a.stl b.stl c.stl --unit mm
  ldi-ops difference block.stl drill.stl --transform-b 'translate(0,0,2)'
  ldi-ops difference block.stl drill.stl drill.stl --transform c='translate(9,0,0)'
  ldi-ops xor a.stl b.stl --axis all --json result.json

With more than two solids the operation is done from left to right: A − B − C, A xor B xor C. The
grid is laid around the box of all. An over-estimate of a difference takes under-estimates away, so
that it stays an over-estimate. The solids are named a, b, c … z, aa, ab … by --transform.";

/// Two solids or more, what is to be done before the operation, and what after.
#[derive(Debug, Args)]
pub struct ListOfSolids {
    /// The first solid, A
    pub a: PathBuf,
    /// The second solid, B, and any further ones
    #[arg(required = true, value_name = "B")]
    pub others: Vec<PathBuf>,
    #[command(flatten)]
    pub placing: ListPlacingArguments,
    #[command(flatten)]
    pub operation: OperationArguments,
}

/// What all Booleans take beside solids and their places.
#[derive(Debug, Args)]
pub struct OperationArguments {
    #[command(flatten)]
    pub sampling: SamplingArguments,
    #[command(flatten)]
    pub writing: ImageArguments,
    #[command(flatten)]
    pub common: CommonArguments,
}

#[derive(Debug, Args)]
#[command(after_help = CSG_EXAMPLES)]
pub struct CsgArguments {
    /// What to make of the solids: names, the operators - & ^ | and parentheses
    #[arg(value_name = "EXPR")]
    pub expression: String,
    /// The solids, each with the name that it has in the expression
    #[arg(required = true, value_name = "NAME=FILE")]
    pub solids: Vec<NamedFile>,
    #[command(flatten)]
    pub reading: ReadingArguments,
    #[command(flatten)]
    pub named: NamedPlacingArguments,
    #[command(flatten)]
    pub operation: OperationArguments,
}

const CSG_EXAMPLES: &str = "\
Examples:
  ldi-ops csg 'a & (b | c)' a=a.stl b=b.stl c=c.stl --unit mm
  ldi-ops csg 'scaffold & bone - hole' scaffold=scaffold.stl bone=bone.stl hole=drill.stl
  ldi-ops csg 'a - b - c' a=block.stl b=drill.stl c=drill.stl --transform c='translate(9,0,0)'

Operators, the tightest first; equal ones are taken from left to right, parentheses before all:
  a - b   what is in a and not in b
  a & b   what is in both
  a ^ b   what is in one and not in the other
  a | b   what is in either
They bind as they do on the sets of Python: a | b & c - d is a | (b & (c - d)). Names are of
letters, digits and _; every input is used, and every name is an input's. An input may occur more
than once. All inputs are swept at once, ray by ray, and no image of a part is made. An
over-estimate takes under-estimates away, so that it stays an over-estimate. The JSON adds
`expression`, and to each of `inputs` its `name`.";

#[derive(Debug, Args)]
#[command(after_help = VOLUME_EXAMPLES)]
pub struct VolumeArguments {
    /// The solids, each measured on its own
    #[arg(required = true, value_name = "A")]
    pub solids: Vec<PathBuf>,
    #[command(flatten)]
    pub placing: PlacingArguments,
    #[command(flatten)]
    pub sampling: SamplingArguments,
    #[command(flatten)]
    pub common: CommonArguments,
}

const VOLUME_EXAMPLES: &str = "\
Examples:
  ldi-ops volume part.stl --unit mm
  ldi-ops volume part.stl --tolerance 0.1%
  ldi-ops volume *.stl --json volumes.json

JSON: {\"schema\", \"command\", \"inputs\", \"results\": [object, …], \"warnings\"}, with the object of the schema
for each file, and for one file its keys at the top as well. A file that cannot be measured does not keep
the others from it; in its place stands {\"path\", \"error\"}, and the exit code is 2 or 3. `volume` adds to the common keys `area`, `centroid` (three numbers) and `inertia` (a 3 × 3
tensor about the centroid, unit density). The area is that of the mesh's triangles, times
the share of the hits of rays along all three axes that bound the solid: triangles inside it do not
count, and where there are none the area is the mesh's own.";

#[derive(Debug, Args)]
#[command(after_help = SAMPLE_LAYOUT)]
pub struct SampleArguments {
    /// The solid
    pub solid: PathBuf,
    #[command(flatten)]
    pub placing: PlacingArguments,
    #[command(flatten)]
    pub sampling: SamplingArguments,
    /// Where to write: .npz, the image; .stl, .obj, .ply, .off, .glb or .3mf, its surface; .vti (ParaView) or .npy (numpy),
    /// voxels
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    #[command(flatten)]
    pub finish: FinishArguments,
    #[command(flatten)]
    pub common: CommonArguments,
}

#[derive(Debug, Args)]
#[command(after_help = SURFACE_EXAMPLES)]
pub struct SurfaceArguments {
    /// The images of one solid along x, y and z, as `-o FILE.npz` writes them
    pub images: PathBuf,
    /// Where to write the surface: .stl, .obj, .ply, .off, .glb or .3mf; or voxels: .vti or .npy
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    #[command(flatten)]
    pub finish: FinishArguments,
    /// What the images are: where they disagree about a node, it is inside if any of over-estimates says so, if all of
    /// under-estimates do, if most of exact images do [default: what the file states, exact where it states nothing]
    #[arg(long, value_enum)]
    pub mode: Option<ModeChoice>,
    /// Unit of images that state none: mm, um (µm), cm, m, in, ft
    #[arg(long, value_parser = unit::parse)]
    pub unit: Option<LengthUnit>,
    #[command(flatten)]
    pub common: CommonArguments,
}

const SURFACE_EXAMPLES: &str = "\
Examples:
  ldi-ops sample part.stl --mode exact -o part.npz && ldi-ops surface part.npz -o again.stl
  ldi-ops intersect lattice.stl bone.stl -o common.npz && ldi-ops surface common.npz -o common.3mf
  ldi-ops surface part.npz --simplify 0.1h -o small.stl

The mesh is a closed, oriented 2-manifold. With normals, which `sample` and the operations write, its
edges and corners are sharp; without them they are cut off.";

const SAMPLE_LAYOUT: &str = "\
Examples:
  ldi-ops sample part.stl --axis z -o part.npz
  ldi-ops sample part.stl --axis all --mode exact --resolution 1024 -o part.npz
  ldi-ops sample part.stl --axis z --resolution 256 -o part.vti
  ldi-ops sample part.stl --mode exact --resolution 256 -o remeshed.ply

Arrays of .npz, for one axis:
  axis      '<U1' ()         x, y or z: the direction of the rays
  offsets   uint32 (n + 1,)  ray r = row · columns + column has depths[offsets[r]:offsets[r+1]]
  depths    int32            sorted, in lattice steps from the near end of the grid;
                             [depths[2i], depths[2i+1]) is inside
  normals   float32 (…, 3)   of the surface at each depth: of length 1, outwards, in world axes
  unclosed  uint32           rays that did not close; they have no depths
  mode      '<U5' ()         which image is kept: exact, over or under
  unit      '<U2' ()         of lengths: um, mm, cm, m, in or ft; absent where it is not known
  grid      record ()        origin: world position of the grid's corner; pitch: distance of
                             neighbouring rays, of which ray i lies at origin + (i + 0.5) · pitch
                             + step; step: length of a lattice step, pitch / 2**shift; rays:
                             pixels along x, y and z; shift; lod
Columns and rows run along the other two axes in increasing order: x → (y, z), y → (x, z),
z → (x, y). With --axis all, `axis` is ['x', 'y', 'z'], and offsets, depths, normals and unclosed
become offsets_x, depths_x, normals_x, unclosed_x and so on for y and z.

  import numpy as np
  a = np.load('part.npz')                                          # --axis z
  inside = (a['depths'][1::2] - a['depths'][0::2]).sum(dtype=np.int64)
  volume = inside * a['grid']['step'] * a['grid']['pitch']**2

Voxels are cubes of one pitch around the points where rays of the three axes meet, and are 1 where that
point is inside and 0 where not. Where images along several axes disagree, a voxel is inside for --mode
over if any says so, for under if all do. .npy is an array uint8 of shape (rays along x, y, z); .vti has
them as cells with the value `inside`, in their places, with the unit as a field.";

#[derive(Debug, Args)]
#[command(after_help = CHECK_EXAMPLES)]
pub struct CheckArguments {
    /// The meshes to check
    #[arg(required = true, value_name = "A")]
    pub meshes: Vec<PathBuf>,
    /// Unit of files that state none: mm, um (µm), cm, m, in, ft
    #[arg(long, value_parser = unit::parse)]
    pub unit: Option<LengthUnit>,
    #[command(flatten)]
    pub common: CommonArguments,
}

/// Whatever follows a command that does not exist.
#[derive(Debug, Args)]
pub struct RepairArguments {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    pub rest: Vec<OsString>,
}

const CHECK_EXAMPLES: &str = "\
Examples:
  ldi-ops check part.stl
  ldi-ops check *.stl --json report.json

Exit code 1 if any of the meshes has a defect that is an error. To be sampled a mesh need only be
closed: every edge has an even number of uses, identical coordinates being one vertex.
JSON: {\"schema\", \"command\", \"inputs\", \"results\": [{\"path\", \"solid\", …}], \"warnings\"}, in the order of
the files. A file that cannot be read does not keep the others from being checked: {\"path\", \"error\"}
stands in its place, and the exit code is 2.";

#[derive(Debug, Args)]
#[command(after_help = CONVERT_EXAMPLES)]
pub struct ConvertArguments {
    /// The mesh to read
    pub from: PathBuf,
    /// Where to write: .obj, .ply, .off, .3mf (64-bit coordinates), .stl, .glb (32-bit)
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Unit of a file that states none. Coordinates stay as they are, but for .glb, which is in metres; .3mf states
    /// its unit, and in the others it is a remark
    #[arg(long, value_parser = unit::parse)]
    pub unit: Option<LengthUnit>,
    /// Place the mesh first, left to right
    #[arg(long, value_name = "PLACEMENT")]
    pub transform_a: Option<Placement>,
    /// Subtract a round offset near the middle from all coordinates; .glb and .3mf hold it as a translation
    #[arg(long)]
    pub recentre: bool,
    #[command(flatten)]
    pub common: CommonArguments,
}

const CONVERT_EXAMPLES: &str = "\
Examples:
  ldi-ops convert part.3mf -o part.stl
  ldi-ops convert part.stl -o part.3mf --unit mm
  ldi-ops convert part.ply -o part.obj --transform-a 'scale(25.4)'";

#[derive(Debug, Args)]
pub struct DevicesArguments {
    #[command(flatten)]
    pub common: CommonArguments,
}

#[derive(Debug, Args)]
pub struct ListPlacingArguments {
    #[command(flatten)]
    pub first: PlacingArguments,
    /// Place B before use: 'translate(1,0,0) rotate(0,0,1,30) scale(2)'
    #[arg(long, value_name = "PLACEMENT", help_heading = "Input")]
    pub transform_b: Option<Placement>,
    #[command(flatten)]
    pub named: NamedPlacingArguments,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct NamedPlacingArguments {
    /// Place the input of a name before use, left to right, in its own unit: b='translate(1,0,0) rotate(0,0,1,30)
    /// scale(2)', where rotate takes an axis and degrees and scale one number or three; once for each input to be placed
    #[arg(long = "transform", value_name = "NAME=PLACEMENT")]
    pub transforms: Vec<NamedPlacement>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct PlacingArguments {
    #[command(flatten)]
    pub reading: ReadingArguments,
    /// Place A before use, left to right, in its own unit: 'translate(1,0,0) rotate(0,0,1,30) scale(2)', where rotate
    /// takes an axis and degrees and scale one number or three
    #[arg(long, value_name = "PLACEMENT")]
    pub transform_a: Option<Placement>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct ReadingArguments {
    /// Unit of files that state none: mm, um (µm), cm, m, in, ft
    #[arg(long, value_parser = unit::parse)]
    pub unit: Option<LengthUnit>,
    /// Sample a mesh that is not closed too; rays that do not close count as empty and are reported
    #[arg(long)]
    pub allow_open: bool,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Sampling")]
pub struct SamplingArguments {
    /// Rays along the longest side of the box of all solids [default: 512]
    #[arg(long, value_name = "N", conflicts_with_all = ["pitch", "tolerance"])]
    pub resolution: Option<u32>,
    /// Distance of neighbouring rays, in file units or with a unit: 0.05mm
    #[arg(long, value_name = "H", conflicts_with = "tolerance", allow_hyphen_values = true)]
    pub pitch: Option<Length>,
    /// Refine until the error estimate of the volume is below this share of it: 0.1% or 0.001
    #[arg(long, value_name = "P%")]
    pub tolerance: Option<Share>,
    /// LOD-C, voxels a ray is divided into for over and under: 32 to 65536
    #[arg(long, value_name = "N", default_value_t = 1024)]
    pub lod: u32,
    /// Ray directions; all combines three images, each of which makes good what the others are blind to, and gives a
    /// spread
    #[arg(long, value_enum, default_value_t = AxisChoice::All)]
    pub axis: AxisChoice,
    /// Which image is kept: one that encloses the solid on every ray, one that lies inside, or every crossing. A mesh of it
    /// passes through the samples and is itself no bound
    #[arg(long, value_enum, default_value_t = ModeChoice::Exact)]
    pub mode: ModeChoice,
    /// What is inside where shells overlap: even-odd cancels, nonzero unites
    #[arg(long, value_enum, default_value_t = FillChoice::EvenOdd)]
    pub fill: FillChoice,
    /// Where it runs, which changes no bit of a result: auto takes a GPU for large work where there is one and says why,
    /// gpu takes the first that `ldi-ops devices` lists or fails
    #[arg(long, value_enum, default_value_t = BackendChoice::Auto)]
    pub backend: BackendChoice,
    /// GPU to use, by its name or a part of it; implies --backend gpu
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,
}

#[derive(Debug, Default, Args)]
pub struct ImageArguments {
    /// Write the result: its surface, a closed manifold mesh with sharp edges, to .stl, .obj, .ply, .off, .glb or .3mf; its
    /// image to .npz; or voxels to .vti (ParaView) or .npy (numpy)
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub finish: FinishArguments,
}

/// What is done to a mesh before it is written.
#[derive(Debug, Default, Args)]
pub struct FinishArguments {
    /// Remove triangles of the mesh while it stays this near to what it was: in pitches, 0.1h, in file units, 0.02, or with a unit,
    /// 20um
    #[arg(long, value_name = "BOUND")]
    pub simplify: Option<Bound>,
    /// Drop parts of the mesh below this share of its volume: crumbs of knife edges, and bubbles; 0.1% or 0.001
    #[arg(long, value_name = "P%")]
    pub drop_parts: Option<Share>,
    /// Subtract a round offset near the middle from the mesh's coordinates, which keeps the detail of a mesh far from the
    /// origin; .glb and .3mf hold the offset as a translation
    #[arg(long)]
    pub recentre: bool,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Common")]
pub struct CommonArguments {
    /// Write the result as JSON to a file, or to stdout with `-` instead of the text
    #[arg(long, value_name = "FILE|-")]
    pub json: Option<PathBuf>,
    /// Threads to use [default: one for each processor]
    #[arg(long, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// The value alone, and no progress on stderr; warnings and errors stay
    #[arg(short, long, conflicts_with = "verbose")]
    pub quiet: bool,
    /// More detail: raster, backend, mesh, time and memory, and on stderr what is decided on the way
    #[arg(short, long)]
    pub verbose: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum AxisChoice {
    X,
    Y,
    Z,
    All,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum ModeChoice {
    Over,
    Under,
    Exact,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum FillChoice {
    EvenOdd,
    Nonzero,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum BackendChoice {
    Auto,
    Cpu,
    Gpu,
}

/// `NAME=FILE`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedFile {
    pub name: String,
    pub path: PathBuf,
}

impl FromStr for NamedFile {
    type Err = String;

    fn from_str(text: &str) -> Result<NamedFile, String> {
        match text.split_once('=') {
            Some((name, path)) if is_name(name) && !path.is_empty() => {
                Ok(NamedFile { name: name.to_owned(), path: PathBuf::from(path) })
            }
            Some((name, _)) if !is_name(name) => {
                Err(format!("`{name}` is not a valid name; use letters, digits and _"))
            }
            _ => Err("expected NAME=FILE, as in a=part.stl".to_owned()),
        }
    }
}

/// `NAME=PLACEMENT`.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedPlacement {
    pub name: String,
    pub placement: Placement,
}

impl FromStr for NamedPlacement {
    type Err = String;

    fn from_str(text: &str) -> Result<NamedPlacement, String> {
        let (name, placement) = text
            .split_once('=')
            .ok_or("expected NAME=PLACEMENT, as in b='translate(1,0,0)', with the name of an input")?;
        let placement = placement.parse().map_err(|error: PlacementError| error.to_string())?;
        Ok(NamedPlacement { name: name.trim().to_owned(), placement })
    }
}

/// Whether an expression can have this name.
fn is_name(name: &str) -> bool {
    !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_')
}

/// A share of a volume, between 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share(pub f64);

impl FromStr for Share {
    type Err = String;

    fn from_str(text: &str) -> Result<Share, String> {
        let (number, scale) = match text.strip_suffix('%') {
            Some(percent) => (percent.trim_end(), 100.0),
            None => (text, 1.0),
        };
        match number.parse::<f64>() {
            Ok(value) if value > 0.0 && value < scale => Ok(Share(value / scale)),
            _ => Err("expected a share between 0 and 100 %, as in 0.1% or 0.001".to_owned()),
        }
    }
}

/// A model and its parameters. The flags are those that [`Model::kinds`] names.
#[derive(Debug)]
pub struct GenerateArguments {
    pub kind: String,
    pub parameters: Vec<(&'static str, String)>,
    pub output: PathBuf,
    pub common: CommonArguments,
}

const GENERATE_EXAMPLES: &str = "\
Examples:
  ldi-ops generate sphere --radius 12.5 -o sphere.stl
  ldi-ops generate gyroid --part sheet --wall 0.8 --cells 4,4,2 --cell-size 5 -o scaffold.stl
  ldi-ops generate bcc --form overlapping --radius 0.6 -o struts.stl
  ldi-ops generate bone --length 120 -o bone.obj

Lengths are millimetres, and all solids are closed and face outwards. `ldi-ops generate KIND --help`
tells a kind's parameters and their defaults. Files are written as .stl, .obj, .ply, .off, .glb or
.3mf, by their extension.";

/// Names by which people may look for a kind that has another.
const ALIASES: [(&str, &[&str]); 4] =
    [("cuboid", &["box"]), ("bone", &["long-bone"]), ("cubic", &["cubic-lattice"]), ("bcc", &["bcc-lattice"])];

impl Args for GenerateArguments {
    fn augment_args(command: clap::Command) -> clap::Command {
        let kinds = Model::kinds().iter().map(|kind| {
            let parameters = kind.parameters.iter().map(|parameter| {
                // Values may begin with a minus.
                Arg::new(parameter.name)
                    .long(parameter.name)
                    .value_name("VALUE")
                    .help(parameter.meaning)
                    .default_value(parameter.default)
                    .allow_hyphen_values(true)
                    .action(ArgAction::Set)
            });
            let aliases = ALIASES.iter().filter(|(name, _)| *name == kind.name).flat_map(|(_, aliases)| *aliases);
            clap::Command::new(kind.name).visible_aliases(aliases.copied()).about(kind.summary).args(parameters)
        });
        let command = command
            .subcommands(kinds)
            .subcommand_value_name("KIND")
            .subcommand_help_heading("Kinds")
            .subcommand_required(true)
            .disable_help_subcommand(true)
            .after_help(GENERATE_EXAMPLES)
            .arg(
                Arg::new("output")
                    .short('o')
                    .long("output")
                    .value_name("FILE")
                    .help("Where to write: .obj, .ply, .off, .3mf (64-bit coordinates), .stl, .glb (32-bit)")
                    .value_parser(clap::value_parser!(PathBuf)),
            );
        CommonArguments::augment_args(command).mut_args(|arg| arg.global(true))
    }

    fn augment_args_for_update(command: clap::Command) -> clap::Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for GenerateArguments {
    fn from_arg_matches(matches: &ArgMatches) -> Result<GenerateArguments, clap::Error> {
        let missing = |what: &str| clap::Error::raw(ErrorKind::MissingRequiredArgument, format!("{what}\n"));
        let (kind, chosen) = matches.subcommand().ok_or_else(|| missing("the kind of model is missing"))?;
        let known = Model::kinds().iter().find(|known| known.name == kind).into_iter().flat_map(|kind| kind.parameters);
        let parameters = known
            .filter_map(|parameter| Some((parameter.name, chosen.get_one::<String>(parameter.name)?.clone())))
            .collect();
        let output = chosen.get_one::<PathBuf>("output").cloned().ok_or_else(|| missing("-o FILE is missing"))?;
        Ok(GenerateArguments {
            kind: kind.to_owned(),
            parameters,
            output,
            common: CommonArguments::from_arg_matches(chosen)?,
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = GenerateArguments::from_arg_matches(matches)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn inputs_have_names() {
        let file = |text: &str| text.parse::<NamedFile>().map(|file| (file.name, file.path));
        assert_eq!(file("a=x=y.stl"), Ok(("a".to_owned(), "x=y.stl".into())));
        for wrong in ["a.stl", "=a.stl", "a=", "a-b=c.stl", "a b=c.stl"] {
            assert!(file(wrong).is_err(), "{wrong}");
        }
        assert_eq!("aa=scale(2)".parse::<NamedPlacement>().unwrap().name, "aa");
        assert!("scale(2)".parse::<NamedPlacement>().unwrap_err().contains("NAME=PLACEMENT"));
        assert!("b=scale(0)".parse::<NamedPlacement>().unwrap_err().contains("scale of 0"));
    }

    #[test]
    fn shares_are_numbers_or_percentages() {
        assert_eq!("0.1%".parse(), Ok(Share(0.001)));
        assert_eq!("0.001".parse(), Ok(Share(0.001)));
        assert_eq!("5 %".parse(), Ok(Share(0.05)));
        for wrong in ["0", "-1%", "100%", "1", "NaN", "inf%", "%", "much"] {
            assert!(wrong.parse::<Share>().is_err(), "{wrong}");
        }
    }
}
