//! Meshes of results, exact or contoured from images: finished, checked to be manifolds, and written.

mod sampled;
mod simplified;

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::job::Finish;
use super::measured::Volume;
use super::output::write_notes;
use crate::exact::{ExactMesh, Rounding};
use crate::mesh::io::Format;
use crate::mesh::{Aabb, LengthUnit, Precision, TriangleMesh, io};
use crate::number::digits;
use crate::progress::Monitor;
use crate::surface::Apart;
use crate::surface::manifold::{ManifoldFailure, ManifoldReport};
use crate::surface::parts::{Dropped, Parts};
use crate::{Error, Warning, unit};

pub use sampled::{Imaged, SampledReport, SimplifiedReport, far_from_volume, mesh, warnings};

/// The report of a mesh of a result.
#[derive(Clone, Debug)]
pub struct SurfaceReport {
    /// The file; `None` where none was written, as the mesh is empty or far from the volume.
    pub path: Option<PathBuf>,
    /// The method, with what it lets go.
    pub made: Made,
    /// The number of vertices.
    pub vertices: usize,
    /// The number of triangles.
    pub triangles: usize,
    /// The number of connected parts.
    pub components: usize,
    /// The genus, summed over all components.
    pub genus: usize,
    /// The volume that the mesh encloses.
    pub volume: f64,
    /// The volume of the largest part, as a share of the total.
    pub largest_share: f64,
    /// The small parts that were dropped.
    pub dropped: Dropped,
    /// The offset that was subtracted from the coordinates.
    pub recentred: Option<DVec3>,
}

/// The method of a mesh.
#[derive(Clone, Copy, Debug)]
pub enum Made {
    /// From the triangles of the inputs; vertices may have been moved that have equal positions once they are rounded.
    Exact(Apart),
    /// From images.
    Sampled(SampledReport),
}

impl SurfaceReport {
    /// Returns what a mesh from images lost; `None` for an exact mesh.
    pub fn sampled(&self) -> Option<&SampledReport> {
        match &self.made {
            Made::Exact(_) => None,
            Made::Sampled(report) => Some(report),
        }
    }
}

/// An exact mesh in the coordinates of a file.
#[derive(Clone, Debug)]
pub struct Exact {
    /// The mesh.
    pub mesh: ExactMesh,
    /// The precision of its coordinates.
    pub precision: Precision,
    /// The offset that was subtracted from the coordinates.
    pub recentred: Option<DVec3>,
}

impl Exact {
    /// Returns what rounds the mesh, and the options by which it would be rounded less.
    pub fn rounding(&self, unit: Option<LengthUnit>) -> String {
        let Rounding { thickness, is_of_file } = self.mesh.rounding;
        let thickness = unit::rounded(thickness, unit);
        if !is_of_file {
            return format!(
                "the coordinates of all inputs are rounded, and walls below {thickness} are taken for rounding; make the \
                 largest input smaller, or move the inputs nearer to one another"
            );
        }
        let recentre = self.recentred.is_none().then_some("add --recentre");
        let format = (self.precision == Precision::Single).then_some("write a format of 64-bit numbers");
        let options: Vec<&str> = recentre.into_iter().chain(format).collect();
        let advice = if options.is_empty() { String::new() } else { format!("; {}", options.join(", or ")) };
        format!(
            "the numbers of the file round coordinates so far from the origin, and walls below {thickness} are taken for \
             rounding{advice}"
        )
    }

    /// Returns the mesh once it is finished and checked, with its report.
    ///
    /// # Errors
    /// Coordinates that overflow or fall together.
    pub fn finished(self, finish: Finish, progress: &Monitor) -> Result<(TriangleMesh, SurfaceReport), Error> {
        let Exact { mesh: ExactMesh { mesh, apart, .. }, precision, recentred } = self;
        let (mesh, shares) = without_small_parts(mesh, finish);
        checked(mesh, precision, Made::Exact(apart), shares, recentred, progress)
    }
}

/// Contours images and writes the mesh, unless it is empty or far from the volume. Returns its report and warnings.
pub fn write(
    imaged: &Imaged,
    path: &Path,
    finish: Finish,
    progress: &Monitor,
) -> Result<(SurfaceReport, Vec<Warning>), Error> {
    let precision = Format::from_path(path).map_err(Error::input)?.precision();
    let (mesh, report) = mesh(imaged, finish, precision, progress)?;
    let warnings = warnings(&report, imaged.normals.is_some());
    let why_empty =
        || all_dropped(&report, finish).unwrap_or_else(|| "no lattice node lies inside the result".to_owned());
    let refusal = match mesh.triangles.is_empty() {
        true => Some(Warning::new("empty-surface", why_empty())),
        false => far_from_volume(imaged, &report),
    };
    let (report, notes) = written(path, &mesh, report, (imaged.unit, refusal), progress)?;
    Ok((report, [warnings, notes].concat()))
}

/// Writes an exact mesh, unless it is empty, of a result with an exact volume. Returns its report and warnings.
pub fn write_exact(
    exact: Exact,
    &Volume { value, error, possible: [_, greatest], .. }: &Volume,
    unit: Option<LengthUnit>,
    path: &Path,
    finish: Finish,
    progress: &Monitor,
) -> Result<(SurfaceReport, Vec<Warning>), Error> {
    let why_empty = match value > error {
        _ if greatest == 0.0 => "the result is empty".to_owned(),
        false => "the result is empty, or thinner than coordinates are rounded".to_owned(),
        true => format!("the result is too thin, as {}", exact.rounding(unit)),
    };
    let (mesh, report) = exact.finished(finish, progress)?;
    let why_empty = || all_dropped(&report, finish).unwrap_or(why_empty);
    let refusal = mesh.triangles.is_empty().then(|| Warning::new("empty-surface", why_empty()));
    written(path, &mesh, report, (unit, refusal), progress)
}

/// Writes a mesh, unless a warning says why not.
fn written(
    path: &Path,
    mesh: &TriangleMesh,
    mut report: SurfaceReport,
    (unit, refusal): (Option<LengthUnit>, Option<Warning>),
    progress: &Monitor,
) -> Result<(SurfaceReport, Vec<Warning>), Error> {
    if let Some(Warning { code, message }) = refusal {
        let name = path.display();
        let old = match path.is_file() {
            true => format!("; {name} is from an earlier run and was left as it was"),
            false => String::new(),
        };
        let warning = Warning::new(code, format!("{name}: no mesh was written: {message}{old}"));
        return Ok((report, vec![warning]));
    }
    progress.stage("writing")?;
    let written = io::write_at(path, mesh, unit, report.recentred.unwrap_or_default()).map_err(write_error)?;
    report.path = Some(path.to_path_buf());
    Ok((report, write_notes(path, &written.notes)))
}

/// Returns the error of a mesh that could not be written.
pub fn write_error(error: io::WriteError) -> Error {
    match &error {
        io::WriteError::Io { path, source } => Error::output(path, source),
        _ => Error::input(error),
    }
}

/// Returns a round offset near the middle of a box: a multiple of the power of ten next above its longest side.
pub fn middle(bounds: Aabb) -> DVec3 {
    let unit = 10f64.powi(bounds.extent().max_element().log10().ceil() as i32);
    let offset = (0.5 * (bounds.min + bounds.max) / unit).round() * unit;
    // Adding 0 makes 0 of −0.
    if offset.is_finite() { offset + DVec3::ZERO } else { DVec3::ZERO }
}

/// The share of the largest part, and the parts that were dropped.
type Shares = (f64, Dropped);

/// Drops the small parts that the finish names.
fn without_small_parts(mesh: TriangleMesh, finish: Finish) -> (TriangleMesh, Shares) {
    let parts = Parts::of(&mesh);
    let largest_share = parts.largest_share();
    let (mesh, dropped) = parts.without_small(mesh, finish.least_part.unwrap_or(0.0));
    drop(parts);
    let are_some_left = dropped.parts > 0 && !mesh.triangles.is_empty();
    let largest_share = if are_some_left { Parts::of(&mesh).largest_share() } else { largest_share };
    (mesh, (largest_share, dropped))
}

/// Says that a mesh is empty because all of its parts were dropped.
fn all_dropped(report: &SurfaceReport, finish: Finish) -> Option<String> {
    let (least, parts) = (finish.least_part.unwrap_or(0.0), report.dropped.parts);
    (report.triangles == 0 && parts > 0).then(|| {
        let [least, largest] = [least, report.largest_share].map(|share| digits(100.0 * share, 4));
        format!(
            "--drop-parts {least}% drops all of its {parts} parts, of which the largest has {largest} % of the volume"
        )
    })
}

/// Checks that a mesh is a manifold, and returns it with its report.
fn checked(
    mesh: TriangleMesh,
    precision: Precision,
    made: Made,
    (largest_share, dropped): Shares,
    recentred: Option<DVec3>,
    progress: &Monitor,
) -> Result<(TriangleMesh, SurfaceReport), Error> {
    progress.stage("checking the mesh")?;
    let manifold = ManifoldReport::of(&mesh, precision);
    if let Some(failure) = manifold.failures().first() {
        // Coordinates that overflow or coincide after rounding come from the model; the others are faults of this program.
        let way_out = match failure {
            ManifoldFailure::Collapsed(_, Precision::Single) | ManifoldFailure::Welded(_, Precision::Single) => {
                " Write .obj, .ply, .off or .3mf, which hold 64 bits, or pass --recentre."
            }
            ManifoldFailure::Collapsed(..)
            | ManifoldFailure::Welded(..)
            | ManifoldFailure::BadPositions(_)
            | ManifoldFailure::NoVolume { .. } => "",
            _ => " This is an internal error; please report it.",
        };
        return Err(Error::input(format!("the mesh of the result fails the manifold check: {failure}{way_out}")));
    }
    let report = SurfaceReport {
        path: None,
        made,
        vertices: manifold.vertices,
        triangles: manifold.triangles,
        components: manifold.components,
        genus: manifold.genus.unwrap_or(0),
        volume: manifold.signed_volume,
        largest_share,
        dropped,
        recentred,
    };
    Ok((mesh, report))
}
