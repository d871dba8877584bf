//! Reads, places and checks the inputs of a job.

use std::fs;
use std::io::{Cursor, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::parallel::*;
use glam::{DAffine3, DVec3};
#[cfg(feature = "report")]
use sha2::{Digest, Sha256};

#[cfg(feature = "npz")]
use super::image_file::ImageFile;
use super::job::{Finish, Input, Openness};
use super::memory::{self, Cost, Limit};
use super::{bytes, machine, size, surface};
use crate::error::OpenMesh;
use crate::grid::{Grid, LatticeSolid};
use crate::mesh::check::{MeshReport, check};
use crate::mesh::io::{self, Format, FormatError, MeshFile, ReadError, ReadNote};
use crate::mesh::{Aabb, ClosedMesh, Fold, LengthUnit, NotClosed, Precision, TriangleMesh};
use crate::number::number;
use crate::progress::Monitor;
use crate::sampler::FillRule;
use crate::unit;
use crate::{Error, Warning};

/// A checked input that may be sampled, with its name, unit and warnings.
#[derive(Clone, Debug)]
pub struct Solid {
    /// The name in an expression.
    pub operand: Option<String>,
    /// The path as given.
    pub path: PathBuf,
    /// The checked mesh.
    pub surface: Surface,
    /// The number of its triangles that were turned, so that all are consistently oriented.
    pub turned: usize,
    /// The unit that the file itself states.
    pub stated_unit: Option<LengthUnit>,
    /// The unit of the coordinates, if the file or the user states it.
    pub unit: Option<LengthUnit>,
    /// True if its placement scales it, so that its size tells nothing about its unit.
    pub is_scaled: bool,
    /// The signed volume of the placed mesh.
    pub volume: f64,
    /// The hash of the file, if requested.
    pub sha256: Option<String>,
    /// Warnings of the reader and of the placement.
    pub(crate) warnings: Vec<Warning>,
    /// The note that the shells of beams overlap, if they do.
    pub(crate) beams: Option<String>,
}

/// A mesh and the result of the closure check.
#[derive(Clone, Debug)]
pub enum Surface {
    /// A closed mesh.
    Closed(Arc<ClosedMesh>),
    /// An open mesh, which is sampled because the user requests it.
    Open {
        /// The mesh.
        mesh: TriangleMesh,
        /// The box of its vertices.
        bounds: Aabb,
    },
}

impl Solid {
    /// Returns the name of the file, for messages.
    pub fn name(&self) -> impl std::fmt::Display + '_ {
        self.path.display()
    }

    /// Returns the mesh.
    pub fn mesh(&self) -> &TriangleMesh {
        match &self.surface {
            Surface::Closed(closed) => closed.mesh(),
            Surface::Open { mesh, .. } => mesh,
        }
    }

    /// Returns the box around the mesh.
    pub fn bounds(&self) -> Aabb {
        match &self.surface {
            Surface::Closed(closed) => closed.bounds(),
            Surface::Open { bounds, .. } => *bounds,
        }
    }

    /// Returns whether the mesh is closed.
    pub fn is_closed(&self) -> bool {
        self.closed().is_some()
    }

    /// Returns the mesh if it is closed.
    pub fn closed(&self) -> Option<&ClosedMesh> {
        match &self.surface {
            Surface::Closed(closed) => Some(closed.as_ref()),
            Surface::Open { .. } => None,
        }
    }

    /// Returns whether the triangles are consistently oriented. Those of an open mesh are not.
    pub fn is_oriented(&self) -> bool {
        matches!(&self.surface, Surface::Closed(closed) if closed.oriented())
    }

    /// Returns whether the triangles were consistently oriented as given. Those of an open mesh were not.
    pub fn was_oriented(&self) -> bool {
        self.is_oriented() && self.turned == 0
    }

    /// Rounds the solid to a grid around it.
    pub fn quantise(&self, grid: &Grid) -> Result<LatticeSolid<'_>, Error> {
        let lattice = match &self.surface {
            Surface::Closed(closed) => grid.quantise(closed),
            Surface::Open { mesh, .. } => grid.quantise_open(mesh),
        };
        lattice.map_err(|error| Error::input(format!("{}: {error}", self.name())))
    }
}

/// The requirements of a job on its inputs.
#[derive(Clone, Copy)]
pub struct InputRequirements {
    /// The unit of files that state none.
    pub unit: Option<LengthUnit>,
    /// The treatment of meshes that are not closed.
    pub openness: Openness,
    /// The requirement on the orientation of triangles.
    pub sides: Sides,
    /// The fill rule.
    pub fill: FillRule,
    /// True if the files are hashed.
    pub hashes: bool,
}

/// The requirement on the orientation of triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// The operation is not defined without a consistent orientation.
    Needed,
    /// The fill rule decides which points are inside.
    NotNeeded,
}

/// Returns the SHA-256 of bytes, in hexadecimal digits.
#[cfg(feature = "report")]
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A mesh file, not yet placed or checked.
pub struct ReadMesh {
    /// The mesh, its unit and the notes of its reader.
    pub file: MeshFile,
    /// The fold of the triangles for the mesh check, if the reader has made it.
    pub(crate) fold: Option<Fold>,
    /// The hash of the file, if requested.
    pub sha256: Option<String>,
    /// Warnings of the reader.
    pub warnings: Vec<Warning>,
}

/// Returns the format of a mesh to read, by its name.
///
/// # Errors
/// Names without an extension of a known format.
pub fn format_of(path: &Path) -> Result<Format, Error> {
    Format::from_path(path).map_err(|error| match error {
        FormatError::NoExtension { .. } | FormatError::Unknown { .. } if cfg!(feature = "npz") => {
            Error::input(format!("{error}, and images in .npz"))
        }
        error => Error::input(error),
    })
}

/// Reads a mesh file, or a file of images, whose surface becomes the mesh.
pub fn read(path: &Path, hashes: bool) -> Result<ReadMesh, Error> {
    let is_images = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("npz"));
    let format = if is_images { None } else { Some(format_of(path)?) };
    if let Some(format) = format {
        io::examine(path, format).map_err(Error::input)?;
    }
    let failure = |source| {
        let error = ReadError::Io { path: path.to_path_buf(), source };
        match &error {
            ReadError::Io { source, .. } if source.kind() == ErrorKind::OutOfMemory => Error::machine(error),
            _ => Error::input(error),
        }
    };
    let (file, length) = bytes::open(path).map_err(failure)?;
    if let (Some(format), false) = (format, hashes)
        && let Some((file, fold)) = io::stream(&file, length, format).map_err(failure)?
    {
        return Ok(ReadMesh { file, fold: Some(fold), sha256: None, warnings: Vec::new() });
    }
    let bytes = bytes::of_file(file, length).map_err(failure)?;
    #[cfg(feature = "report")]
    let hash = || hashes.then(|| sha256(&bytes));
    #[cfg(not(feature = "report"))]
    let hash = || None;
    let parse = || match format {
        Some(format) => {
            let (file, fold) = io::parse_folded(&bytes, format, path).map_err(Error::input)?;
            let notes = file.notes.iter();
            let warnings = notes.map(|note| Warning::new(note.code(), format!("{}: {note}", path.display()))).collect();
            Ok((file, fold, warnings))
        }
        None => surface_of_images(&bytes, path).map(|(file, warnings)| (file, None, warnings)),
    };
    let (parsed, sha256) = join(parse, hash);
    let (file, fold, warnings) = parsed?;
    Ok(ReadMesh { file, fold, sha256, warnings })
}

#[cfg(feature = "npz")]
/// Returns the surface of the images in a file.
fn surface_of_images(bytes: &[u8], path: &Path) -> Result<(MeshFile, Vec<Warning>), Error> {
    let file = ImageFile::read(Cursor::new(bytes), path)?;
    let imaged = file.imaged(path, file.mode(path, None)?)?;
    let (mesh, report) = surface::mesh(&imaged, Finish::full(), Precision::Double, &Monitor::new(None))?;
    let doubts = file.doubts(path, imaged.mode, Some(&report));
    if mesh.triangles.is_empty() {
        return Err(Error::input(format!("{}: no lattice node lies inside the images", path.display())));
    }
    let mut warnings = surface::warnings(&report, imaged.normals.is_some());
    warnings.extend(surface::far_from_volume(&imaged, &report));
    for warning in &mut warnings {
        warning.message = format!("{}: {}", path.display(), warning.message);
    }
    warnings.extend(doubts);
    warnings.extend(file.warnings);
    Ok((MeshFile { mesh, unit: file.unit, notes: Vec::new() }, warnings))
}

#[cfg(not(feature = "npz"))]
fn surface_of_images(_: &[u8], path: &Path) -> Result<(MeshFile, Vec<Warning>), Error> {
    Err(Error::input(format!("{}: build ldi_ops with the feature `npz` to read images", path.display())))
}

/// Reads, places and checks all inputs, and brings them to one unit.
pub fn solids(inputs: &[Input], requirements: InputRequirements) -> Result<(Vec<Solid>, Vec<Warning>), Error> {
    let loaded: Vec<_> = inputs.par_iter().map(|input| solid(input, requirements)).collect();
    let (mut solids, mut warnings, mut errors) = (Vec::new(), Vec::new(), Vec::new());
    for loaded in loaded {
        match loaded {
            Ok((solid, found)) => {
                solids.push(solid);
                warnings.extend(found);
            }
            Err(error) => errors.push(error),
        }
    }
    if !errors.is_empty() {
        return Err(all_of(errors));
    }
    warnings.extend(bring_to_one_unit(&mut solids, requirements)?);
    Ok((solids, warnings))
}

/// Returns the error of inputs that cannot be used: a list of them all, where each has no more than a message, or else the first.
fn all_of(mut errors: Vec<Error>) -> Error {
    let message = |error: &Error| match error {
        Error::Input(message) => Some(format!("\n  {}", message.replace('\n', "\n    "))),
        _ => None,
    };
    let messages: Option<Vec<String>> = errors.iter().map(message).collect();
    let Some(messages) = messages.filter(|messages| messages.len() > 1) else { return errors.swap_remove(0) };
    let more = match messages.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!("\n  and {more} more"),
    };
    Error::input(format!(
        "{} inputs cannot be used:{}{more}",
        messages.len(),
        messages[..messages.len().min(LISTED)].concat()
    ))
}

/// Checks solids that are in memory already, and brings them to one unit.
pub fn ready(solids: &mut [Solid], requirements: InputRequirements) -> Result<Vec<Warning>, Error> {
    let mut warnings = Vec::new();
    for solid in &mut *solids {
        warnings.append(&mut std::mem::take(&mut solid.warnings));
        warnings.extend(check_rules(solid, requirements)?);
    }
    warnings.extend(bring_to_one_unit(solids, requirements)?);
    Ok(warnings)
}

/// Brings solids to the unit of the first that has one.
fn bring_to_one_unit(solids: &mut [Solid], requirements: InputRequirements) -> Result<Vec<Warning>, Error> {
    let mut warnings = Vec::new();
    // If any file states no unit, `--unit` applies to that file and is not ignored.
    if solids.iter().all(|solid| solid.stated_unit.is_some()) {
        let ignored = |s: &Solid| size::unit_ignored(&s.path, s.stated_unit, requirements.unit, s.bounds().extent());
        warnings.extend(solids.iter().filter_map(ignored));
    }
    let as_read = solids.iter().filter(|solid| !solid.is_scaled);
    warnings.extend(
        as_read.filter_map(|s| size::implausible(&s.path, s.unit, s.stated_unit.is_none(), s.bounds().extent())),
    );
    let unitless: Vec<String> =
        solids.iter().filter(|solid| solid.unit.is_none()).map(|solid| solid.name().to_string()).collect();
    let common = solids.iter().find_map(|solid| solid.unit);
    if !unitless.is_empty() {
        let assumed = match common {
            Some(unit) => format!("in{}, as in the other file", unit::suffix(Some(unit), 1)),
            None => "in file units".to_owned(),
        };
        let message = format!("{}: no unit is stated: lengths are {assumed} (set --unit)", list(&unitless));
        warnings.push(Warning::new("unit-assumed", message));
    }
    if let Some(common) = common {
        for solid in solids {
            if let Some(own) = convert(solid, common, requirements)? {
                let (own_name, common_name) = (unit::suffix(Some(own), 1), unit::suffix(Some(common), 1));
                let message =
                    format!("{}: converted from{own_name} to{common_name}, the unit of the first file", solid.name());
                warnings.push(Warning::new("unit-converted", message));
            }
        }
    }
    Ok(warnings)
}

/// Converts a solid to a unit, and returns the unit that it had if that was another. A solid without a unit is taken to be in it.
pub fn convert(
    solid: &mut Solid,
    unit: LengthUnit,
    requirements: InputRequirements,
) -> Result<Option<LengthUnit>, Error> {
    let own = solid.unit.replace(unit).unwrap_or(unit);
    if own == unit {
        return Ok(None);
    }
    map(solid, &DAffine3::from_scale(DVec3::splat(unit::factor(own, unit))), requirements)?;
    solid.volume = solid.mesh().signed_volume();
    Ok(Some(own))
}

/// Most names or messages in a list.
const LISTED: usize = 6;

/// Returns names as text, the first of them where there are many.
fn list(names: &[String]) -> String {
    match names.len() {
        count if count > LISTED => format!("{} and {} others", names[..3].join(", "), count - 3),
        _ => names.join(", "),
    }
}

/// Reads, places and checks one input.
fn solid(input: &Input, requirements: InputRequirements) -> Result<(Solid, Vec<Warning>), Error> {
    let mut solid = load(input, requirements)?;
    let mut warnings = std::mem::take(&mut solid.warnings);
    warnings.extend(check_rules(&mut solid, requirements)?);
    Ok((solid, warnings))
}

/// Bytes that a loaded part takes for each byte of its file, while the file is read: of packed formats and of others.
const BYTES_OF_PACKED: f64 = 12.0;
const BYTES_OF_OTHER: f64 = 3.0;

/// Refuses parts whose meshes would not fit into memory.
pub fn admit_files<'p>(paths: impl ExactSizeIterator<Item = &'p Path>, limit: Option<u64>) -> Result<(), Error> {
    let bytes = |path: &Path| {
        let length = fs::metadata(path).map_or(0, |data| data.len()) as f64;
        let is_packed = matches!(Format::from_path(path), Ok(Format::ThreeMf));
        length * if is_packed { BYTES_OF_PACKED } else { BYTES_OF_OTHER }
    };
    let count = paths.len();
    let fixed = machine::held_memory() as f64 + paths.map(bytes).sum::<f64>();
    let cost = Cost { fixed, ..Cost::default() };
    let subject = format_args!("the meshes of {count} files");
    memory::admit(&[cost], Limit::new(limit), subject, |_| "compare fewer parts at a time".to_owned())
}

/// Reads several inputs at the same time, as [`load`] reads one.
pub fn load_all(
    inputs: &[Input],
    requirements: InputRequirements,
    memory: Option<u64>,
    progress: &Monitor,
) -> Result<Vec<Solid>, Error> {
    progress.stage("reading")?;
    admit_files(inputs.iter().map(|input| input.path.as_path()), memory)?;
    progress.expect(inputs.len())?;
    let load = |input: &Input| {
        let solid = load(input, requirements);
        progress.step()?;
        solid
    };
    // The error is that of the first input that has one, whichever is read first.
    let loaded: Vec<Result<Solid, Error>> = inputs.par_iter().map(load).collect();
    loaded.into_iter().collect()
}

/// Reads and places one input, and checks that it is closed.
pub fn load(input: &Input, requirements: InputRequirements) -> Result<Solid, Error> {
    let ReadMesh { file, mut fold, sha256, mut warnings } = read(&input.path, requirements.hashes)?;
    let MeshFile { mut mesh, unit, notes } = file;
    let beams = notes.iter().find(|note| matches!(note, ReadNote::BeamsMeshed { .. })).map(ToString::to_string);
    let mut is_scaled = false;
    if let Some(placement) = &input.placement {
        let map = placement.map(unit.or(requirements.unit));
        let map = map.map_err(|error| Error::input(format!("{}: {error}", input.path.display())))?;
        is_scaled = (map.matrix3.determinant().abs() - 1.0).abs() > 1e-9;
        mesh.transform(&map);
        warnings.extend(check_rounding(&mesh, &input.path)?);
        fold = None;
    }
    let checked = match fold {
        Some(fold) => ClosedMesh::of_fold(mesh, fold),
        None => ClosedMesh::check(mesh),
    };
    let mut solid = checked_solid(checked, &input.path, requirements)?;
    (solid.operand, solid.is_scaled) = (input.name.clone(), is_scaled);
    (solid.stated_unit, solid.unit) = (unit, unit.or(requirements.unit));
    (solid.sha256, solid.warnings, solid.beams) = (sha256, warnings, beams);
    Ok(solid)
}

impl Solid {
    /// Returns the solid of a closed mesh, with a name and without a unit.
    pub fn from_closed(closed: ClosedMesh, name: &str) -> Solid {
        let volume = closed.signed_volume();
        Solid::unnamed(Surface::Closed(Arc::new(closed)), volume, Path::new(name))
    }

    fn unnamed(surface: Surface, volume: f64, path: &Path) -> Solid {
        Solid {
            operand: None,
            path: path.to_path_buf(),
            surface,
            turned: 0,
            stated_unit: None,
            unit: None,
            is_scaled: false,
            volume,
            sha256: None,
            warnings: Vec::new(),
            beams: None,
        }
    }
}

/// Returns the solid of a mesh, with the name `path` and without a unit.
pub fn solid_of_mesh(mesh: TriangleMesh, path: &Path, requirements: InputRequirements) -> Result<Solid, Error> {
    checked_solid(ClosedMesh::check(mesh), path, requirements)
}

/// Returns the solid of a mesh that has been checked, if it meets the requirements.
fn checked_solid(
    checked: Result<ClosedMesh, NotClosed>,
    path: &Path,
    requirements: InputRequirements,
) -> Result<Solid, Error> {
    let surface = surface_of(checked, path, requirements)?;
    let volume = match &surface {
        Surface::Closed(closed) => closed.signed_volume(),
        Surface::Open { mesh, .. } => mesh.signed_volume(),
    };
    Ok(Solid::unnamed(surface, volume, path))
}

/// Turns the triangles of a closed mesh that are not consistently oriented, if they can be.
fn orient(solid: &mut Solid) {
    if let Surface::Closed(closed) = &solid.surface
        && !closed.oriented()
        && let Ok((oriented, turned)) = closed.as_ref().clone().orient()
    {
        (solid.volume, solid.turned) = (oriented.signed_volume(), turned);
        solid.surface = Surface::Closed(Arc::new(oriented));
    }
}

/// Checks that the triangles of a solid meet the requirements of the fill rule and the operation. Those that are not consistently
/// oriented are turned first, if that does not change the solid under the rule.
fn check_rules(solid: &mut Solid, requirements: InputRequirements) -> Result<Option<Warning>, Error> {
    if requirements.fill == FillRule::EvenOdd {
        orient(solid);
    }
    let name = solid.name();
    if let (Some(beams), FillRule::EvenOdd) = (&solid.beams, requirements.fill) {
        return Err(Error::input(format!(
            "{name}: {beams}; the even-odd rule would remove the volume where beams overlap; use --fill nonzero"
        )));
    }
    if let Some(closed) = solid.closed() {
        if requirements.sides == Sides::Needed && !closed.oriented() {
            return Err(Error::input(format!(
                "{name}: the triangles are not consistently oriented, so the result is not defined:\n{}",
                defects(&check(closed.mesh()))
            )));
        }
        match requirements.fill {
            FillRule::EvenOdd if closed.every_triangle_even() && solid.bounds().extent().min_element() == 0.0 => {
                return Err(Error::input(format!("{name}: the mesh is flat, so it bounds no solid")));
            }
            FillRule::EvenOdd if closed.every_triangle_even() => {
                return Err(Error::input(format!(
                    "{name}: every triangle occurs an even number of times, so the solid is empty under the even-odd rule; use \
                     --fill nonzero or remove the duplicates"
                )));
            }
            FillRule::NonZero if !closed.oriented() => {
                return Err(Error::input(format!(
                    "{name}: --fill nonzero needs consistently oriented triangles, which this mesh does not have; use --fill \
                     even-odd\n{}",
                    defects(&check(closed.mesh()))
                )));
            }
            _ => {}
        }
    }
    let matters = solid.turned > 0 || requirements.sides == Sides::NotNeeded;
    Ok(orientation_warning(solid, requirements.fill).filter(|_| matters))
}

/// Rounding of coordinates by a placement, as a share of the mesh's size, above which there is a warning.
const NOTEWORTHY_ROUNDING: f64 = 1e-9;

/// Rounding of coordinates by a placement, as a share of the mesh's size, above which the placement is an error.
const LARGEST_ROUNDING: f64 = 1e-4;

/// Checks the rounding of the coordinates of a mesh that was placed far from the origin.
fn check_rounding(mesh: &TriangleMesh, path: &Path) -> Result<Option<Warning>, Error> {
    let Some(bounds) = mesh.bounds() else { return Ok(None) };
    let (size, farthest) = (bounds.extent().max_element(), bounds.min.abs().max(bounds.max.abs()).max_element());
    let moved = farthest * f64::EPSILON / 2.0;
    // Sizes that are NaN are left to the mesh check.
    let is_noteworthy = moved > NOTEWORTHY_ROUNDING * size;
    if !is_noteworthy {
        return Ok(None);
    }
    let message = format!(
        "{}: the transform places the mesh at coordinates of {farthest:.1e}, where 64-bit numbers round by up to {moved:.1e}, \
         {:.2e} of its size; place it nearer to the origin",
        path.display(),
        moved / size
    );
    if moved > LARGEST_ROUNDING * size {
        return Err(Error::input(message));
    }
    Ok(Some(Warning::new("placement-rounded", message)))
}

/// Returns a warning if the mesh is inside out or not consistently oriented.
fn orientation_warning(solid: &Solid, fill: FillRule) -> Option<Warning> {
    let name = solid.name();
    let effect = match fill {
        FillRule::EvenOdd => "the even-odd rule does not depend on the orientation",
        FillRule::NonZero => "the non-zero rule treats it as solid",
    };
    match solid.is_oriented() {
        true if solid.turned > 0 => Some(Warning::new(
            "not-oriented",
            format!(
                "{name}: the triangles are not consistently oriented; {} of {} were turned so that they are; {effect}",
                solid.turned,
                solid.mesh().triangles.len()
            ),
        )),
        true if solid.volume < 0.0 => Some(Warning::new(
            "inside-out",
            format!("{name}: the mesh is inside out (its signed volume is {}); {effect}", number(solid.volume)),
        )),
        false if solid.is_closed() => Some(Warning::new(
            "not-oriented",
            format!("{name}: the triangles are not consistently oriented, so the mesh has no signed volume; {effect}"),
        )),
        _ => None,
    }
}

/// Returns the surface of a mesh that is closed, or that may be sampled although it is open.
fn surface_of(
    checked: Result<ClosedMesh, NotClosed>,
    path: &Path,
    requirements: InputRequirements,
) -> Result<Surface, Error> {
    let name = path.display();
    let has_corners = |report: &MeshReport| report.bad_positions.count == 0 && report.bad_indices.count == 0;
    match checked {
        Ok(closed) if closed.every_triangle_even() && !has_three_corners(closed.mesh()) => {
            Err(Error::input(format!("{name}: no triangle has three different corners, so the mesh bounds no solid")))
        }
        Ok(closed) => Ok(Surface::Closed(Arc::new(closed))),
        Err(NotClosed { mesh, report }) => match (requirements.openness, mesh.bounds()) {
            (Openness::Sampled, Some(bounds)) if has_corners(&report) => Ok(Surface::Open { mesh, bounds }),
            (Openness::Sampled, _) => Err(Error::input(format!(
                "{name}: the mesh cannot be sampled, even with --allow-open:\n{}",
                defects(&report)
            ))),
            (Openness::Refused | Openness::RefusedByDefault, _) => {
                let failure = match has_corners(&report) {
                    true => "is not closed",
                    false => "has corners without a position",
                };
                let way_out = match requirements.openness {
                    Openness::RefusedByDefault if has_corners(&report) => "; --allow-open samples it anyway",
                    _ => "",
                };
                let message = format!(
                    "{name}: the mesh {failure}, so it bounds no solid:\n{}\n  `ldi-ops check` gives details{way_out}",
                    defects(&report)
                );
                Err(Error::NotClosed(Box::new(OpenMesh { name: name.to_string(), report: *report, message })))
            }
        },
    }
}

/// Returns whether any triangle has three different corners.
fn has_three_corners(mesh: &TriangleMesh) -> bool {
    mesh.triangles.iter().any(|triangle| {
        let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
        a != b && b != c && c != a
    })
}

/// Returns all defects as text, one on each line.
fn defects(report: &MeshReport) -> String {
    let lines: Vec<String> = report.defects().iter().map(|defect| format!("  {defect}")).collect();
    lines.join("\n")
}

/// Maps a solid and checks it again, as coordinates may have become equal or infinite.
pub fn map(solid: &mut Solid, map: &DAffine3, requirements: InputRequirements) -> Result<(), Error> {
    remake(solid, requirements, |mesh| mesh.transform(map))
}

/// Reverses the orientation of a solid whose triangles all face inwards.
pub fn turn(solid: &mut Solid, requirements: InputRequirements) -> Result<(), Error> {
    remake(solid, requirements, |mesh| mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2)))
}

/// Changes the mesh of a solid, and checks it again.
fn remake(
    solid: &mut Solid,
    requirements: InputRequirements,
    change: impl FnOnce(&mut TriangleMesh),
) -> Result<(), Error> {
    let nothing = Surface::Open { mesh: TriangleMesh::default(), bounds: solid.bounds() };
    let mut mesh = match std::mem::replace(&mut solid.surface, nothing) {
        Surface::Closed(closed) => Arc::unwrap_or_clone(closed).into_mesh(),
        Surface::Open { mesh, .. } => mesh,
    };
    change(&mut mesh);
    solid.surface = surface_of(ClosedMesh::check(mesh), &solid.path, requirements)?;
    Ok(())
}
