//! Reading, placing and checking the inputs of a job.

use std::io::{Cursor, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine3, DVec3};
use rayon::prelude::*;
#[cfg(feature = "report")]
use sha2::{Digest, Sha256};

#[cfg(feature = "npz")]
use super::image_file::ImageFile;
use super::job::{Finish, Input, Openness};
use super::{bytes, size, surface};
use crate::error::OpenMesh;
use crate::grid::{Grid, LatticeSolid};
use crate::mesh::check::{MeshReport, check};
use crate::mesh::io::{self, Format, MeshFile, ReadError, ReadNote, WriteNote};
use crate::mesh::{Aabb, ClosedMesh, LengthUnit, NotClosed, Precision, TriangleMesh};
use crate::progress::Monitor;
use crate::sampler::FillRule;
use crate::unit;
use crate::{Error, Warning};

/// An input that may be sampled, with what is known of it.
#[derive(Clone, Debug)]
pub struct Solid {
    /// What an expression calls it.
    pub operand: Option<String>,
    /// The path as it was given.
    pub path: PathBuf,
    /// The checked mesh.
    pub surface: Surface,
    /// The unit that the file itself states.
    pub stated_unit: Option<LengthUnit>,
    /// The unit of the coordinates, where the file or the user says it.
    pub unit: Option<LengthUnit>,
    /// The signed volume of the mesh itself, placed.
    pub volume: f64,
    /// The hash of the file, where JSON is asked for.
    pub sha256: Option<String>,
    /// Remarks of the reader and of the placement.
    pub(crate) warnings: Vec<Warning>,
    /// The remark that the shells of beams overlap, where they do.
    pub(crate) beams: Option<String>,
}

/// A mesh and what the check said of it.
#[derive(Clone, Debug)]
pub enum Surface {
    /// A closed mesh.
    Closed(Arc<ClosedMesh>),
    /// Sampled because the user wishes it.
    Open {
        /// The mesh.
        mesh: TriangleMesh,
        /// The box of its vertices.
        bounds: Aabb,
    },
}

impl Solid {
    /// The file's name, for messages.
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

    /// An open mesh is not oriented: its open edges are used in one direction alone.
    pub fn is_oriented(&self) -> bool {
        matches!(&self.surface, Surface::Closed(closed) if closed.oriented())
    }

    /// Snaps the solid to a grid that was laid around it.
    pub fn quantise(&self, grid: &Grid) -> Result<LatticeSolid<'_>, Error> {
        let lattice = match &self.surface {
            Surface::Closed(closed) => grid.quantise(closed),
            Surface::Open { mesh, .. } => grid.quantise_open(mesh),
        };
        lattice.map_err(|error| Error::input(format!("{}: {error}", self.name())))
    }
}

/// What the inputs of one job must satisfy.
#[derive(Clone, Copy)]
pub struct InputRequirements {
    /// The unit of files that state none.
    pub unit: Option<LengthUnit>,
    /// The treatment of meshes that are not closed.
    pub openness: Openness,
    /// Whether triangles must agree on what is outside.
    pub sides: Sides,
    /// The fill rule.
    pub fill: FillRule,
    /// Whether the files are hashed.
    pub hashes: bool,
}

/// Whether the triangles of a mesh must agree on what is outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// What is made of the mesh has no meaning otherwise.
    Needed,
    /// A fill rule tells what is inside.
    NotNeeded,
}

/// A file that was read, not yet placed or checked.
pub struct ReadMesh {
    /// The mesh, its unit and the remarks of its reader.
    pub file: MeshFile,
    /// The hash of the file, where it was wanted.
    pub sha256: Option<String>,
    /// What there is to say of it.
    pub warnings: Vec<Warning>,
}

/// Reads a mesh file, or a file of images, of which the surface is the mesh.
pub fn read(path: &Path, hashes: bool) -> Result<ReadMesh, Error> {
    let is_images = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("npz"));
    let format = if is_images { None } else { Some(Format::from_path(path).map_err(Error::input)?) };
    if let Some(format) = format {
        io::examine(path, format).map_err(Error::input)?;
    }
    let bytes = bytes::of_file(path).map_err(|source| {
        let error = ReadError::Io { path: path.to_path_buf(), source };
        match &error {
            ReadError::Io { source, .. } if source.kind() == ErrorKind::OutOfMemory => Error::machine(error),
            _ => Error::input(error),
        }
    })?;
    #[cfg(feature = "report")]
    let hash = || hashes.then(|| Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect());
    #[cfg(not(feature = "report"))]
    let hash = || None;
    let parse = || match format {
        Some(format) => {
            let file = io::parse(&bytes, format, path).map_err(Error::input)?;
            let said = file.notes.iter();
            let said = said.map(|note| Warning::new(note.code(), format!("{}: {note}", path.display()))).collect();
            Ok((file, said))
        }
        None => surface_of_images(&bytes, path),
    };
    let (parsed, sha256) = rayon::join(parse, hash);
    let (file, warnings) = parsed?;
    Ok(ReadMesh { file, sha256, warnings })
}

#[cfg(feature = "npz")]
/// The surface of images in a file.
fn surface_of_images(bytes: &[u8], path: &Path) -> Result<(MeshFile, Vec<Warning>), Error> {
    let file = ImageFile::read(Cursor::new(bytes), path)?;
    let imaged = file.imaged(path, file.mode(path, None)?)?;
    let (mesh, report) = surface::mesh(&imaged, Finish::default(), Precision::Double, &Monitor::new(None))?;
    if mesh.triangles.is_empty() {
        return Err(Error::input(format!("{}: no lattice node lies inside the images", path.display())));
    }
    let mut warnings = surface::warnings(&report, imaged.normals.is_some());
    warnings.extend(surface::far_from_volume(&imaged, &report));
    for warning in &mut warnings {
        warning.message = format!("{}: {}", path.display(), warning.message);
    }
    warnings.extend(file.warnings);
    Ok((MeshFile { mesh, unit: file.unit, notes: Vec::new() }, warnings))
}

#[cfg(not(feature = "npz"))]
fn surface_of_images(_: &[u8], path: &Path) -> Result<(MeshFile, Vec<Warning>), Error> {
    Err(Error::input(format!("{}: build ldi_ops with the feature `npz` to read images", path.display())))
}

/// What a writer had to say.
pub fn write_notes(path: &Path, notes: &[WriteNote]) -> Vec<Warning> {
    notes.iter().map(|note| Warning::new(note.code(), format!("{}: {note}", path.display()))).collect()
}

/// Reads, places and checks all inputs, and brings them to one unit.
pub fn solids(inputs: &[Input], requirements: InputRequirements) -> Result<(Vec<Solid>, Vec<Warning>), Error> {
    let loaded: Vec<_> = inputs.par_iter().map(|input| solid(input, requirements)).collect();
    let (mut solids, mut warnings) = (Vec::new(), Vec::new());
    for loaded in loaded {
        let (solid, said) = loaded?;
        solids.push(solid);
        warnings.extend(said);
    }
    warnings.extend(bring_to_one_unit(&mut solids, requirements)?);
    Ok((solids, warnings))
}

/// Checks solids that were made or read before, and brings them to one unit.
pub fn ready(solids: &mut [Solid], requirements: InputRequirements) -> Result<Vec<Warning>, Error> {
    let mut warnings = Vec::new();
    for solid in &mut *solids {
        let mut said = std::mem::take(&mut solid.warnings);
        warnings.append(&mut said);
        warnings.extend(check_rules(solid, requirements)?);
    }
    warnings.extend(bring_to_one_unit(solids, requirements)?);
    Ok(warnings)
}

/// Brings solids to the unit of the first that has one.
fn bring_to_one_unit(solids: &mut [Solid], requirements: InputRequirements) -> Result<Vec<Warning>, Error> {
    let mut warnings = Vec::new();
    // Where any file states no unit, the one that was given is for that file.
    if solids.iter().all(|solid| solid.stated_unit.is_some()) {
        let ignored = |s: &Solid| size::unit_ignored(&s.path, s.stated_unit, requirements.unit, s.bounds().extent());
        warnings.extend(solids.iter().filter_map(ignored));
    }
    warnings.extend(
        solids.iter().filter_map(|s| size::implausible(&s.path, s.unit, s.stated_unit.is_none(), s.bounds().extent())),
    );
    let unitless: Vec<String> =
        solids.iter().filter(|solid| solid.unit.is_none()).map(|solid| solid.name().to_string()).collect();
    let common = solids.iter().find_map(|solid| solid.unit);
    if !unitless.is_empty() {
        let taken = match common {
            Some(unit) => format!("lengths are taken to be in{} as in the other file", unit::suffix(Some(unit), 1)),
            None => "lengths are in file units, whatever they are".to_owned(),
        };
        let files = unitless.join(", ");
        warnings.push(Warning::new("unit-assumed", format!("{files}: no unit is stated; {taken}; --unit tells it")));
    }
    if let Some(common) = common {
        for solid in solids {
            let own = solid.unit.replace(common).unwrap_or(common);
            if own != common {
                let (name, own_name, common_name) =
                    (solid.name().to_string(), unit::suffix(Some(own), 1), unit::suffix(Some(common), 1));
                map(solid, &DAffine3::from_scale(DVec3::splat(unit::factor(own, common))), requirements)?;
                solid.volume = solid.mesh().signed_volume();
                let message = format!("{name}: converted from{own_name} to{common_name}, the unit of the first file");
                warnings.push(Warning::new("unit-converted", message));
            }
        }
    }
    Ok(warnings)
}

/// Reads, places and checks one input.
fn solid(input: &Input, requirements: InputRequirements) -> Result<(Solid, Vec<Warning>), Error> {
    let mut solid = load(input, requirements)?;
    let mut warnings = std::mem::take(&mut solid.warnings);
    warnings.extend(check_rules(&solid, requirements)?);
    Ok((solid, warnings))
}

/// Reads and places one input, and checks that it is closed.
pub fn load(input: &Input, requirements: InputRequirements) -> Result<Solid, Error> {
    let ReadMesh { file, sha256, mut warnings } = read(&input.path, requirements.hashes)?;
    let MeshFile { mut mesh, unit, notes } = file;
    let beams = notes.iter().find(|note| matches!(note, ReadNote::BeamsMeshed { .. })).map(ToString::to_string);
    if let Some(placement) = &input.placement {
        let map = placement.map(unit.or(requirements.unit));
        mesh.transform(&map.map_err(|error| Error::input(format!("{}: {error}", input.path.display())))?);
        warnings.extend(placed_exactly(&mesh, &input.path)?);
    }
    let mut solid = made(mesh, &input.path, requirements)?;
    solid.operand = input.name.clone();
    (solid.stated_unit, solid.unit) = (unit, unit.or(requirements.unit));
    (solid.sha256, solid.warnings, solid.beams) = (sha256, warnings, beams);
    Ok(solid)
}

impl Solid {
    /// Returns the solid of a closed mesh, without unit, by a name.
    pub fn from_closed(closed: ClosedMesh, name: &str) -> Solid {
        let volume = closed.signed_volume();
        Solid::unnamed(Surface::Closed(Arc::new(closed)), volume, Path::new(name))
    }

    fn unnamed(surface: Surface, volume: f64, path: &Path) -> Solid {
        Solid {
            operand: None,
            path: path.to_path_buf(),
            surface,
            stated_unit: None,
            unit: None,
            volume,
            sha256: None,
            warnings: Vec::new(),
            beams: None,
        }
    }
}

/// Returns the solid of a mesh, without unit, by the name of `path`.
pub fn made(mesh: TriangleMesh, path: &Path, requirements: InputRequirements) -> Result<Solid, Error> {
    let surface = bounding(mesh, path, requirements)?;
    let volume = match &surface {
        Surface::Closed(closed) => closed.signed_volume(),
        Surface::Open { mesh, .. } => mesh.signed_volume(),
    };
    Ok(Solid::unnamed(surface, volume, path))
}

/// Checks whether the triangles of a solid say what the fill rule and the operation have to know.
fn check_rules(solid: &Solid, requirements: InputRequirements) -> Result<Option<Warning>, Error> {
    let name = solid.name();
    if let (Some(beams), FillRule::EvenOdd) = (&solid.beams, requirements.fill) {
        return Err(Error::input(format!(
            "{name}: {beams}; the even-odd rule would cut away what beams have in common, so use --fill nonzero"
        )));
    }
    if let Some(closed) = solid.closed() {
        if requirements.sides == Sides::Needed && !closed.oriented() {
            return Err(Error::input(format!(
                "{name}: the triangles do not agree on what is outside, and without that there is no sum:\n{}",
                defects(&check(closed.mesh()))
            )));
        }
        match requirements.fill {
            FillRule::EvenOdd if closed.every_triangle_even() => {
                return Err(Error::input(format!(
                    "{name}: every triangle occurs an even number of times, so the even-odd rule sees nothing; use --fill \
                     nonzero or remove the duplicates"
                )));
            }
            FillRule::NonZero if !closed.oriented() => {
                return Err(Error::input(format!(
                    "{name}: --fill nonzero needs a mesh whose triangles agree on what is outside, and this one's do not; \
                     use even-odd\n{}",
                    defects(&check(closed.mesh()))
                )));
            }
            _ => {}
        }
    }
    Ok(remarks(solid, requirements.fill).filter(|_| requirements.sides == Sides::NotNeeded))
}

/// A placement may round coordinates by this share of the mesh's size and nothing is said.
const PLACED_EXACTLY: f64 = 1e-9;

/// A placement that rounds coordinates by more than this share of the mesh's size is refused.
const PLACED_BADLY: f64 = 1e-4;

/// What the numbers of a computer make of a mesh that was placed far from the origin.
fn placed_exactly(mesh: &TriangleMesh, path: &Path) -> Result<Option<Warning>, Error> {
    let Some(bounds) = mesh.bounds() else { return Ok(None) };
    let (size, farthest) = (bounds.extent().max_element(), bounds.min.abs().max(bounds.max.abs()).max_element());
    let moved = farthest * f64::EPSILON / 2.0;
    // Sizes that are no numbers are left to the check.
    let is_told = moved > PLACED_EXACTLY * size;
    if !is_told {
        return Ok(None);
    }
    let message = format!(
        "{}: the transform places the mesh at coordinates of {farthest:.1e}, where 64-bit numbers round by up to {moved:.1e}, \
         {:.2e} of its size; place it nearer to the origin",
        path.display(),
        moved / size
    );
    if moved > PLACED_BADLY * size {
        return Err(Error::input(message));
    }
    Ok(Some(Warning::new("placement-rounded", message)))
}

/// What the check found that does not stand in the way.
fn remarks(solid: &Solid, fill: FillRule) -> Option<Warning> {
    let name = solid.name();
    let care = match fill {
        FillRule::EvenOdd => "the even-odd rule does not care",
        FillRule::NonZero => "the non-zero rule takes it as solid all the same",
    };
    match solid.is_oriented() {
        true if solid.volume < 0.0 => Some(Warning::new(
            "inside-out",
            format!("{name}: the mesh is inside out (its signed volume is {:.6}); {care}", solid.volume),
        )),
        false if solid.is_closed() => Some(Warning::new(
            "not-oriented",
            format!(
                "{name}: the triangles do not agree on what is outside, so the mesh's own volume means nothing; {care}"
            ),
        )),
        _ => None,
    }
}

/// Checks a mesh.
fn bounding(mesh: TriangleMesh, path: &Path, requirements: InputRequirements) -> Result<Surface, Error> {
    let name = path.display();
    match ClosedMesh::check(mesh) {
        Ok(closed) if closed.every_triangle_even() && !has_three_corners(closed.mesh()) => {
            Err(Error::input(format!("{name}: no triangle has three different corners, so the mesh bounds no solid")))
        }
        Ok(closed) => Ok(Surface::Closed(Arc::new(closed))),
        Err(NotClosed { mesh, report }) => match (requirements.openness, mesh.bounds()) {
            (Openness::Sampled, Some(bounds)) if report.bad_positions.count == 0 && report.bad_indices.count == 0 => {
                Ok(Surface::Open { mesh, bounds })
            }
            (Openness::Sampled, _) => {
                Err(Error::input(format!("{name}: the mesh cannot be sampled even so:\n{}", defects(&report))))
            }
            (Openness::Refused, _) => {
                let way_out = match requirements.sides {
                    Sides::Needed => "",
                    Sides::NotNeeded => "; --allow-open samples it all the same",
                };
                let message = format!(
                    "{name}: the mesh is not closed, so it bounds no solid:\n{}\n  `ldi-ops check` tells more{way_out}",
                    defects(&report)
                );
                Err(Error::NotClosed(Box::new(OpenMesh { name: name.to_string(), report: *report, message })))
            }
        },
    }
}

/// Whether any triangle has three different corners.
fn has_three_corners(mesh: &TriangleMesh) -> bool {
    mesh.triangles.iter().any(|triangle| {
        let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
        a != b && b != c && c != a
    })
}

/// All defects, a line each.
fn defects(report: &MeshReport) -> String {
    let lines: Vec<String> = report.defects().iter().map(|defect| format!("  {defect}")).collect();
    lines.join("\n")
}

/// Maps a solid and checks it anew, as coordinates may have become one or infinite.
pub fn map(solid: &mut Solid, map: &DAffine3, requirements: InputRequirements) -> Result<(), Error> {
    remake(solid, requirements, |mesh| mesh.transform(map))
}

/// Turns a solid whose triangles all face inwards.
pub fn turn(solid: &mut Solid, requirements: InputRequirements) -> Result<(), Error> {
    remake(solid, requirements, |mesh| mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2)))
}

/// Changes the mesh of a solid, and checks it anew.
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
    solid.surface = bounding(mesh, &solid.path, requirements)?;
    Ok(())
}
