//! Arguments as they are typed. What they mean together is for [`crate::resolve`].

mod certainty;
mod clash;
mod manual;
mod memory;
mod render;
mod report;
mod sum;
mod sweep;

use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::styling::{AnsiColor, Styles};
use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Args, FromArgMatches, Parser, Subcommand, ValueEnum};
use ldi_ops::mesh::LengthUnit;
use ldi_ops::solids::Model;

pub use self::certainty::CertaintyArguments;
pub use self::clash::{ClashArguments, ComparisonArguments, RuleArguments};
pub use self::manual::{CompletionsArguments, ManArguments};
pub use self::memory::MemorySize;
pub use self::render::{BackgroundChoice, FacetChoice, PictureSize, RenderArguments, SliceAt};
pub use self::report::{BuildChoice, EdgesChoice, JudgingArguments, RasterArguments, RegionArguments, ReportArguments};
pub use self::sum::{BallArguments, MinkowskiArguments, OffsetArguments, SumArguments, SumPlacingArguments};
pub use self::sweep::SweepArguments;
use ldi_ops::driver::Bound;
use ldi_ops::driver::job::Finish;
use ldi_ops::length::Length;
use ldi_ops::placement::{Placement, PlacementError};
use ldi_ops::unit;

const STYLES: Styles =
    Styles::styled().header(AnsiColor::Green.on_default().bold()).literal(AnsiColor::Cyan.on_default().bold());

/// Measures and combines solids given as triangle meshes: volumes, Booleans, Minkowski sums, offsets, scaffold reports.
/// Computes on layered depth images: for each of a raster of parallel rays, the depths at which it enters and leaves the solid.
#[derive(Debug, Parser)]
#[command(name = "ldi-ops", version, styles = STYLES, max_term_width = 110, after_help = EXAMPLES, after_long_help = EPILOGUE)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

const EXAMPLES: &str = "\
Examples:
  ldi-ops intersect scaffold.stl bone.stl --unit mm        their common volume
  ldi-ops volume part.3mf --tolerance 0.1%                 refine to a relative error of 0.1 %
  ldi-ops check part.stl                                   check that it is a solid

`ldi-ops COMMAND --help` lists the options of a command.";

const EPILOGUE: &str = "\
Examples:
  ldi-ops intersect scaffold.stl bone.stl --unit mm        their common volume
  ldi-ops intersect scaffold.stl bone.stl -o common.stl    and a mesh of it
  ldi-ops csg 'a & (b | c)' a=scaffold.stl b=bone.stl c=part.stl -o part.3mf
  ldi-ops difference block.stl drill.stl --transform-b 'rotate(1,0,0,90) translate(0,5,0)'
  ldi-ops intersect a.stl b.stl --assert-below 5mm3        exit 0 only if that is proved
  ldi-ops volume part.3mf --tolerance 0.1%                 refine to a relative error of 0.1 %
  ldi-ops volume struts.stl --fill nonzero                 unites overlapping shells
  ldi-ops minkowski part.stl ball.stl -o sum.stl           sum of any two solids
  ldi-ops offset part.stl --distance -0.2 -o thin.stl      inwards by a true ball
  ldi-ops report scaffold.stl --unit mm -o report          pores, walls, percolation, topology
  ldi-ops sweep plan.toml -o runs                          designs from parameters, one table
  ldi-ops sample part.stl --axis z -o part.npz             the image, for numpy
  ldi-ops volume part.stl --backend gpu                    on the first GPU of `ldi-ops devices`
  ldi-ops clash assembly.3mf --clearance 0.3mm -o clashes  overlaps and gaps of parts
  ldi-ops check part.stl                                   check that it is a solid
  ldi-ops generate gyroid --cells 4 -o gyroid.stl
  ldi-ops render scaffold.stl bone.stl -o picture.png      the common solid, in two colours

Inputs are meshes (.stl, .obj, .ply, .off, .gltf, .glb, .3mf) or images (.npz), whose surface is
the mesh. The result goes to stdout, as text or with `--json -` as JSON; all other output goes to
stderr.

Aliases of commands: intersection, common, and (intersect); join, merge, or (union); subtract,
minus (difference); info (check). Lengths may have units: --pitch 0.05mm, --distance 50um,
translate(1mm,0,0).

Exit codes: 0 done; 1 a requested check failed; 2 wrong usage or input; 3 machine (memory,
device).";

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Volume of the intersection of solids; -o writes it as a mesh, images or voxels
    #[command(aliases = ["intersection", "common", "and"])]
    Intersect(IntersectArguments),
    /// Volume of the union of solids
    #[command(aliases = ["join", "merge", "or"])]
    Union(ListArguments),
    /// Volume of the first solid minus all others
    #[command(aliases = ["subtract", "minus"])]
    Difference(ListArguments),
    /// Volume of the symmetric difference: the points that lie in an odd number of the solids
    #[command(alias = "symmetric-difference")]
    Xor(ListArguments),
    /// Volume of a Boolean expression over solids: 'a & (b | c) - d'
    Csg(CsgArguments),
    /// Minkowski sum A ⊕ B of two solids, or their difference A ⊖ B
    Minkowski(MinkowskiArguments),
    /// Offset of a solid by a distance, outwards or inwards
    Offset(OffsetArguments),
    /// Opening by a ball, which removes parts thinner than the ball
    Open(BallArguments),
    /// Closing by a ball, which fills gaps and pores narrower than the ball
    Close(BallArguments),
    /// Volume, area, centroid and inertia of solids
    Volume(VolumeArguments),
    /// Layered depth images of a solid as .npz, or its surface, or voxels
    Sample(SampleArguments),
    /// Mesh or voxels from the images in a .npz file
    Surface(SurfaceArguments),
    /// Check whether meshes are solids, and list all defects; exit code 1 if one is not
    #[command(aliases = ["info", "validate"])]
    Check(CheckArguments),
    /// Not available: the error names the alternatives
    #[command(hide = true, aliases = ["fix", "heal"])]
    Repair(RepairArguments),
    /// Convert between mesh formats
    Convert(ConvertArguments),
    /// Generate a model solid
    Generate(GenerateArguments),
    /// Metrics of scaffolds and their pores: a page, tables, and a paragraph about the methods
    Report(ReportArguments),
    /// Metrics of many designs of a model solid: a table, and a page with the designs that no other dominates
    Sweep(SweepArguments),
    /// Overlaps, contacts and clearances of parts and assemblies, with places; exit code 1 if a pair breaks a rule
    Clash(ClashArguments),
    /// Picture of solids, or of a slice through them, as .png
    Render(RenderArguments),
    /// List the devices for sampling, and the choice of `--backend auto` with its reason
    Devices(DevicesArguments),
    /// A script that completes commands and options in a shell
    Completions(CompletionsArguments),
    /// The man pages: of the program to stdout, or of all commands to a folder
    Man(ManArguments),
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
  ldi-ops intersect scaffold.stl bone.stl -o common.stl
  ldi-ops intersect a.stl b.stl c.stl --transform c='scale(2)'
  ldi-ops intersect a.stl b.stl --axis z --mode exact --resolution 1024 --json -
  ldi-ops intersect a.stl b.stl --transform-b 'translate(1,0,0) rotate(0,0,1,30)' -o common.npz
  ldi-ops intersect a.stl b.stl --backend gpu

The volume is exact if the triangles of all solids are consistently oriented, or can be turned so
under the even-odd rule, whatever the raster. The raster is for files (-o), for --estimate, and for
solids whose volume is not exact; it encloses the box of all solids. In the JSON, `inputs[].volume`
is the signed volume of the mesh itself.";

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

More than two solids are combined from left to right: A − B − C, A xor B xor C. The volume is exact
if the triangles of all solids are consistently oriented, or can be turned so under the even-odd
rule, whatever the raster, which is for files (-o) and for --estimate; it encloses the box of all
solids. An over-estimate of a difference subtracts under-estimates, so that it remains an
over-estimate. --transform names the solids a, b, c … z, aa, ab …";

/// Two or more solids, their placement, and the operation's options.
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

/// The options that all Booleans share, besides solids and placement.
#[derive(Debug, Args)]
pub struct OperationArguments {
    #[command(flatten)]
    pub sampling: SamplingArguments,
    #[command(flatten)]
    pub method: MethodArguments,
    #[command(flatten)]
    pub certainty: CertaintyArguments,
    #[command(flatten)]
    pub writing: ImageArguments,
    /// Method of a written mesh: `exact` keeps the triangles of the inputs and cuts those that meet others; `sampled` contours
    /// images, on the raster of --resolution or --pitch [default: exact where the inputs allow it, else sampled]
    #[arg(long, value_enum)]
    pub mesh: Option<MeshChoice>,
    #[command(flatten)]
    pub common: CommonArguments,
}

#[derive(Debug, Args)]
#[command(after_help = CSG_EXAMPLES)]
pub struct CsgArguments {
    /// Boolean expression: names, the operators - & ^ | and parentheses
    #[arg(value_name = "EXPR")]
    pub expression: String,
    /// The solids, each with its name in the expression
    #[arg(required = true, value_name = "NAME=FILE")]
    pub solids: Vec<NamedFile>,
    #[command(flatten)]
    pub placing: ListPlacingArguments,
    #[command(flatten)]
    pub operation: OperationArguments,
}

const CSG_EXAMPLES: &str = "\
Examples:
  ldi-ops csg 'a & (b | c)' a=a.stl b=b.stl c=c.stl --unit mm
  ldi-ops csg 'scaffold & bone - hole' scaffold=scaffold.stl bone=bone.stl hole=drill.stl
  ldi-ops csg 'a - b - c' a=block.stl b=drill.stl c=drill.stl --transform c='translate(9,0,0)'
  ldi-ops csg 'a & b' a=a.stl b=b.stl --transform-b 'rotate(0,0,1,30)'

Operators by precedence, the highest first; equal ones are evaluated from left to right:
  a - b   difference: in a and not in b
  a & b   intersection: in both
  a ^ b   symmetric difference: in exactly one
  a | b   union: in either
The precedence is that of sets in Python: a | b & c - d is a | (b & (c - d)). Names consist of
letters, digits and _. The expression must use every input, and may use one more than once.
--transform-a and --transform-b place the inputs named a and b. All inputs are evaluated in one
pass along each ray, without intermediate images. An over-estimate subtracts under-estimates, so
that it remains an over-estimate. The JSON adds `expression`, and `name` to each of `inputs`.";

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
    pub method: MethodArguments,
    #[command(flatten)]
    pub certainty: CertaintyArguments,
    #[command(flatten)]
    pub common: CommonArguments,
}

const VOLUME_EXAMPLES: &str = "\
Examples:
  ldi-ops volume part.stl --unit mm
  ldi-ops volume part.stl --tolerance 0.1%
  ldi-ops volume *.stl --json volumes.json

JSON: {\"schema\", \"command\", \"inputs\", \"results\": [object, …], \"warnings\"}, with one object
per file; for a single file its keys are at the top level too. If a file cannot be measured, its
object is {\"path\", \"error\"}, the others are measured, and the exit code is 2 or 3. `volume` adds
the keys `area`, `area_error`, `centroid` (three numbers) and `inertia` (a 3 × 3 tensor about the
centroid, unit density). They are exact if the triangles of the solid are consistently oriented, or
can be turned so under the even-odd rule. Otherwise, or if faces of one shell lie on one another, the
area is that of the mesh's triangles, times the share of ray hits along all three axes that bound
the solid, and `area_error` an estimate: triangles inside the solid do not count.";

#[derive(Debug, Args)]
#[command(after_help = SAMPLE_LAYOUT)]
pub struct SampleArguments {
    /// The solid
    pub solid: PathBuf,
    #[command(flatten)]
    pub placing: PlacingArguments,
    #[command(flatten)]
    pub sampling: SamplingArguments,
    /// Output file: .npz (images), .stl, .obj, .ply, .off, .glb or .3mf (surface), .vti (ParaView) or .npy (numpy; voxels)
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
    /// Images of one solid, as written by `-o FILE.npz`: along x, y and z for a surface, along one axis or more for voxels
    pub images: PathBuf,
    /// Output file: .stl, .obj, .ply, .off, .glb or .3mf (surface), .vti or .npy (voxels)
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    #[command(flatten)]
    pub finish: FinishArguments,
    /// Mode of the images, which decides about nodes where they disagree: inside if any over-estimate, all under-estimates, or
    /// most exact images say so [default: the mode that the file states, or else exact]
    #[arg(long, value_enum)]
    pub mode: Option<ModeChoice>,
    /// Unit of length, if the file states none: mm, um (µm), cm, m, in, ft
    #[arg(long, value_parser = unit::parse)]
    pub unit: Option<LengthUnit>,
    #[command(flatten)]
    pub common: CommonArguments,
}

const SURFACE_EXAMPLES: &str = "\
Examples:
  ldi-ops sample part.stl --mode exact -o part.npz && ldi-ops surface part.npz -o again.stl
  ldi-ops intersect lattice.stl bone.stl -o common.npz && ldi-ops surface common.npz -o common.3mf
  ldi-ops surface part.npz --surface-error 0.1h -o small.stl

The mesh is a closed, oriented 2-manifold. Its edges and corners are sharp if the file has
normals, as written by `sample` and the operations; without normals they are cut off.";

const SAMPLE_LAYOUT: &str = "\
Examples:
  ldi-ops sample part.stl --axis z -o part.npz
  ldi-ops sample part.stl --axis all --mode exact --resolution 1024 -o part.npz
  ldi-ops sample part.stl --axis z --resolution 256 -o part.vti
  ldi-ops sample part.stl --resolution 256 --surface-error 0 -o remeshed.ply

Arrays of .npz, for one axis:
  axis      '<U1' ()         x, y or z: the direction of the rays
  offsets   uint32 (n + 1,)  ray r = row · columns + column has depths[offsets[r]:offsets[r+1]]
  depths    int32            sorted, in lattice steps from the near end of the grid;
                             [depths[2i], depths[2i+1]) is inside
  normals   float32 (…, 3)   of the surface at each depth: of length 1, outwards, in world axes
  unclosed  uint32           rays that do not close; they have no depths
  mode      '<U5' ()         kind of the image: exact, over or under
  unit      '<U2' ()         of lengths: um, mm, cm, m, in or ft; absent if unknown
  grid      record ()        origin: world position of the grid's corner; pitch: distance
                             between neighbouring rays; ray i lies at origin + (i + 0.5) · pitch
                             + step; step: length of a lattice step, pitch / 2**shift; rays:
                             pixels along x, y and z; shift; lod
Columns and rows run along the other two axes in increasing order: x → (y, z), y → (x, z),
z → (x, y). With --axis all, `axis` is ['x', 'y', 'z'], and offsets, depths, normals and unclosed
become offsets_x, depths_x, normals_x, unclosed_x and so on for y and z.

  import numpy as np
  a = np.load('part.npz')                                          # --axis z
  inside = (a['depths'][1::2] - a['depths'][0::2]).sum(dtype=np.int64)
  volume = inside * a['grid']['step'] * a['grid']['pitch']**2

Voxels are cubes of one pitch around the points where rays of the three axes meet: 1 if the point
is inside, 0 if not. Where images along several axes disagree, a voxel is inside if any image
says so (--mode over), or if all do (under). .npy is an array uint8 of shape (rays along x, y,
z); .vti has cells with the value `inside`, in world coordinates, and the unit as a field.";

#[derive(Debug, Args)]
#[command(after_help = CHECK_EXAMPLES)]
pub struct CheckArguments {
    /// The meshes to check
    #[arg(required = true, value_name = "A")]
    pub meshes: Vec<PathBuf>,
    /// Unit of length of files that state none: mm, um (µm), cm, m, in, ft
    #[arg(long, value_parser = unit::parse)]
    pub unit: Option<LengthUnit>,
    #[command(flatten)]
    pub common: CommonArguments,
}

/// The arguments of a command that does not exist.
#[derive(Debug, Args)]
pub struct RepairArguments {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    pub rest: Vec<OsString>,
}

const CHECK_EXAMPLES: &str = "\
Examples:
  ldi-ops check part.stl
  ldi-ops check *.stl --json report.json

The exit code is 1 if a mesh has a defect of severity error. A warning names two triangles of a
solid that touch or cross, if there are any: the fill rule decides what is inside where shells
overlap. Sampling needs only a closed mesh: an even number of triangles at every edge, where
identical coordinates are one vertex.

JSON: {\"schema\", \"command\", \"inputs\", \"results\": [{\"path\", \"solid\", …}], \"warnings\"}, in the
order of the files. If a file cannot be read, its object is {\"path\", \"error\"}, the others are
checked, and the exit code is 2.";

#[derive(Debug, Args)]
#[command(after_help = CONVERT_EXAMPLES)]
pub struct ConvertArguments {
    /// The mesh to read
    pub from: PathBuf,
    /// Output file: .obj, .ply, .off, .3mf (64-bit coordinates), .stl or .glb (32-bit)
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Unit of length, if the file states none: mm, um (µm), cm, m, in, ft. Coordinates are unchanged, except in .glb, which
    /// is in metres; .3mf states the unit, and other formats have it as a comment
    #[arg(long, value_parser = unit::parse)]
    pub unit: Option<LengthUnit>,
    /// Place the mesh before writing; steps from left to right
    #[arg(long, value_name = "PLACEMENT")]
    pub transform_a: Option<Placement>,
    /// Subtract a round offset near the centre from all coordinates; .glb and .3mf store it as a translation
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
    pub reading: ReadingArguments,
    #[command(flatten)]
    pub transforms: TransformArguments,
}

/// The placements of several inputs.
#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct TransformArguments {
    /// Place A, the first input, before use, steps from left to right: 'translate(1,0,0) rotate(0,0,1,30) scale(2)', in its own
    /// unit; rotate takes an axis and degrees, scale one number or three
    #[arg(long, value_name = "PLACEMENT")]
    pub transform_a: Option<Placement>,
    /// Place B, the second input, before use: 'translate(1,0,0) rotate(0,0,1,30) scale(2)'
    #[arg(long, value_name = "PLACEMENT")]
    pub transform_b: Option<Placement>,
    /// Place the named input before use, steps from left to right: b='translate(1,0,0) rotate(0,0,1,30) scale(2)', in its own
    /// unit; rotate takes an axis and degrees, scale one number or three; may be repeated for other inputs. Inputs are named a, b,
    /// c … in their order, those of `csg` as there
    #[arg(long = "transform", value_name = "NAME=PLACEMENT")]
    pub transforms: Vec<NamedPlacement>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct PlacingArguments {
    #[command(flatten)]
    pub reading: ReadingArguments,
    /// Place A before use, steps from left to right: 'translate(1,0,0) rotate(0,0,1,30) scale(2)', in its own unit; rotate
    /// takes an axis and degrees, scale one number or three
    #[arg(long, value_name = "PLACEMENT")]
    pub transform_a: Option<Placement>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct ReadingArguments {
    /// Unit of length of files that state none: mm, um (µm), cm, m, in, ft
    #[arg(long, value_parser = unit::parse)]
    pub unit: Option<LengthUnit>,
    /// Accept meshes that are not closed; rays that do not close count as empty and are reported
    #[arg(long)]
    pub allow_open: bool,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Sampling")]
pub struct SamplingArguments {
    /// Rays along the longest side of the box of all solids [default: 512]
    #[arg(long, value_name = "N", conflicts_with_all = ["pitch", "tolerance"])]
    #[arg(value_parser = number_of_rays, allow_hyphen_values = true)]
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

/// Pitch or tolerance of the raster, instead of a resolution.
#[derive(Debug, Args)]
pub struct SpacingArguments {
    /// Distance between neighbouring rays, in file units or with a unit: 0.05mm
    #[arg(long, value_name = "H", conflicts_with = "tolerance", allow_hyphen_values = true)]
    pub pitch: Option<Length>,
    /// Refine until the estimated relative error of a volume is below this share: 0.1% or 0.001
    #[arg(long, value_name = "P%", allow_hyphen_values = true)]
    pub tolerance: Option<Share>,
}

/// The method of the volume.
#[derive(Debug, Args)]
#[command(next_help_heading = "Sampling")]
pub struct MethodArguments {
    /// Insist on the exact volume, from the triangles; fail with the reason where it cannot be had [default: exact where it
    /// can be had]
    #[arg(long, conflicts_with = "estimate")]
    pub exact: bool,
    /// Take the estimate of the images, even where the exact volume can be had
    #[arg(long)]
    pub estimate: bool,
}

/// The kind of the images, and their directions.
#[derive(Debug, Args)]
#[command(next_help_heading = "Sampling")]
pub struct KindArguments {
    /// LOD-C, the number of voxels along a ray for over and under: 32 to 65536
    #[arg(long, value_name = "N", default_value_t = 1024)]
    pub lod: u32,
    /// Directions of the rays of the measured and written images; the three images of `all` complement one another, and their
    /// spread enters the error estimate
    #[arg(long, value_enum, default_value_t = AxisChoice::All)]
    pub axis: AxisChoice,
    /// Kind of the images: over (encloses the result on every ray), under (lies inside it on every ray), or exact (every
    /// crossing). A mesh passes through the samples and is itself no bound
    #[arg(long, value_enum, default_value_t = ModeChoice::Exact)]
    pub mode: ModeChoice,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Sampling")]
pub struct FillArguments {
    /// Fill rule, for overlapping shells: even-odd cancels the overlap, nonzero unites the shells. Minkowski sums and offsets
    /// of overlapping shells need nonzero
    #[arg(long, value_enum, default_value_t = FillChoice::EvenOdd)]
    pub fill: FillChoice,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Sampling")]
pub struct BackendArguments {
    /// Device (see `ldi-ops devices`), with the same bits on each: auto chooses by the amount of work, and the CPU for sums and
    /// offsets; gpu uses the first GPU or fails
    #[arg(long, value_enum, default_value_t = BackendChoice::Auto)]
    pub backend: BackendChoice,
    /// GPU to use, by its name or a part of it; implies --backend gpu
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Sampling")]
pub struct DeviceArguments {
    #[command(flatten)]
    pub backend: BackendArguments,
    /// Memory limit: 800M, 2G or 1.5GiB. A job whose estimate exceeds it is refused before sampling, with a resolution that fits
    /// [default: 80 % of free memory]
    #[arg(long, value_name = "SIZE", allow_hyphen_values = true)]
    pub memory: Option<MemorySize>,
}

#[derive(Debug, Default, Args)]
pub struct ImageArguments {
    /// Output file for the result: .stl, .obj, .ply, .off, .glb or .3mf (surface, a closed manifold mesh with sharp edges),
    /// .npz (images), .vti (ParaView) or .npy (numpy; voxels)
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub finish: FinishArguments,
}

/// The processing of a mesh before it is written.
#[derive(Debug, Default, Args)]
pub struct FinishArguments {
    /// Remove triangles of a mesh of images while it stays within this distance of what it was: in pitches (0.1h), in file
    /// units (0.02) or with a unit (20um), or 0 for all triangles; a bound above 0 asks for a mesh of images
    /// [default: 0.05h, for meshes that are of images anyway]
    #[arg(long, visible_alias = "simplify", value_name = "BOUND", allow_hyphen_values = true)]
    pub surface_error: Option<Bound>,
    /// Halve the pitch up to N times, 0 to 4, where a mesh of images lacks walls and gaps thinner than the pitch. Exact meshes lack
    /// none, and .npz files and meshes of --mode over or under have no finer rays [default: 3]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=i64::from(Finish::MOST_LEVELS)))]
    pub refine: Option<u32>,
    /// Drop components of the mesh below this share of its volume, such as crumbs and bubbles: 0.1% or 0.001
    #[arg(long, value_name = "P%", allow_hyphen_values = true)]
    pub drop_parts: Option<Share>,
    /// Subtract a round offset near the centre from the mesh's coordinates, to keep detail far from the origin; .glb and .3mf
    /// store it as a translation
    #[arg(long)]
    pub recentre: bool,
}

/// Most threads of a job: ten times as many take more than a minute to start, and gain nothing.
const MOST_THREADS: usize = 1024;

fn threads(text: &str) -> Result<NonZeroUsize, String> {
    let threads = text.parse().ok().filter(|threads: &NonZeroUsize| threads.get() <= MOST_THREADS);
    threads
        .ok_or_else(|| format!("expected at least 1 and at most {MOST_THREADS} threads, best one for each processor"))
}

fn number_of_rays(text: &str) -> Result<u32, &'static str> {
    text.parse().map_err(|_| "expected a whole number of rays, as in 512, and at most 65536")
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Common")]
pub struct CommonArguments {
    /// Write the result as JSON to a file, or with `-` to stdout in place of the text
    #[arg(long, value_name = "FILE|-")]
    pub json: Option<PathBuf>,
    /// Number of threads, at most 1024 [default: one per processor]
    #[arg(long, value_name = "N", value_parser = threads, allow_hyphen_values = true)]
    pub threads: Option<NonZeroUsize>,
    /// Show no progress and no notes on stderr; warnings and errors remain
    #[arg(short, long, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print more detail on stderr: stages, raster, backend, mesh, time and memory; stdout stays the same
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
pub enum MeshChoice {
    Exact,
    Sampled,
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

/// Returns whether an expression can use this name.
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

/// A model and its parameters, whose options come from [`Model::kinds`].
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

Lengths are in millimetres. All solids are closed and face outwards. `ldi-ops generate KIND
--help` lists the parameters of a kind and their defaults. The extension of the file selects the
format.";

/// Other names of kinds.
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
                    .help("Output file: .obj, .ply, .off, .3mf (64-bit coordinates), .stl or .glb (32-bit)")
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
            .filter(|parameter| chosen.value_source(parameter.name) == Some(ValueSource::CommandLine))
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
