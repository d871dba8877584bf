//! Meshes of images: contoured, simplified on request, and checked to be manifolds.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::job::Finish;
use super::memory::{self, Limit};
use super::output::write_notes;
use crate::bits::Ones;
use crate::grid::{Axis, Grid};
use crate::integrate::VolumeEstimate;
use crate::ldi::{Ldi, NodePlanes};
use crate::mesh::io::Format;
use crate::mesh::{Aabb, LengthUnit, Precision, TriangleMesh, io};
use crate::number::number;
use crate::progress::Monitor;
use crate::sampler::cpu::CpuSampler;
use crate::sampler::{FillRule, Mode, Sampler};
use crate::surface::manifold::{ManifoldFailure, ManifoldReport};
use crate::surface::parts::{Dropped, Parts};
#[cfg(feature = "simplify")]
use crate::surface::simplify::simplify;
use crate::surface::{Coordinates, Surface, contour_in};
use crate::{Error, Warning};

/// The report of a mesh that was contoured from images.
#[derive(Clone, Debug)]
pub struct SurfaceReport {
    /// The file; `None` where none was written, as the mesh is empty or far from the volume.
    pub path: Option<PathBuf>,
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
    /// The volume before parts were dropped and triangles removed.
    pub contoured_volume: f64,
    /// The volume that may be missing where edges are cut off, as normals are unknown: one pitch times the area.
    pub cut_off: f64,
    /// The number of ray crossings of walls between two neighbouring nodes, which the mesh lacks.
    pub walls: u64,
    /// The number of ray crossings of gaps between two neighbouring nodes, which the mesh lacks.
    pub gaps: u64,
    /// The number of nodes about which the images disagree.
    pub disagreements: u64,
    /// The largest distance of a sample from the mesh before it was simplified.
    pub largest_distance: f64,
    /// The number of vertices that could not be placed on their edge or corner.
    pub blunted: u64,
    /// The number of pairs of triangles that cross; unknown for a simplified mesh.
    pub crossing_pairs: Option<u64>,
    /// The report of the simplification, if requested.
    pub simplified: Option<SimplifiedReport>,
    /// The volume of the largest part, as a share of the total.
    pub largest_share: f64,
    /// The small parts that were dropped.
    pub dropped: Dropped,
    /// The offset that was subtracted from the coordinates.
    pub recentred: Option<DVec3>,
}

/// The report of a simplification.
#[derive(Clone, Copy, Debug)]
pub struct SimplifiedReport {
    /// The requested bound of the distance.
    pub bound: f64,
    /// The largest distance that was measured, in either direction.
    pub distance: f64,
    /// The number of triangles before.
    pub triangles: usize,
}

/// The images of one solid, with their normals, mode, unit and volume.
pub struct Imaged<'a> {
    /// The images along x, y and z.
    pub images: &'a [Ldi],
    /// The normals of the triangles that the images refer to; `None` where they are unknown.
    pub normals: Option<&'a [[f32; 3]]>,
    /// The mode of the images.
    pub mode: Mode,
    /// The unit of lengths, where it is known.
    pub unit: Option<LengthUnit>,
    /// The volume that a mesh of the images is compared with.
    pub volume: Option<VolumeEstimate>,
    /// The memory limit in bytes; a share of the free memory without it.
    pub memory: Option<u64>,
}

/// Contours images and writes the mesh, unless it is empty or far from the volume. Returns its report and warnings.
pub fn write(
    imaged: &Imaged,
    path: &Path,
    finish: Finish,
    progress: &Monitor,
) -> Result<(SurfaceReport, Vec<Warning>), Error> {
    let precision = Format::from_path(path).map_err(Error::input)?.precision();
    let (mesh, mut report) = mesh(imaged, finish, precision, progress)?;
    let mut warnings = warnings(&report, imaged.normals.is_some());
    let refusal = match mesh.triangles.is_empty() {
        true => Some(Warning::new("empty-surface", "no lattice node lies inside the result".to_owned())),
        false => far_from_volume(imaged, &report),
    };
    if let Some(Warning { code, message }) = refusal {
        let name = path.display();
        let old = match path.is_file() {
            true => format!("; {name} is from an earlier run and was left as it was"),
            false => String::new(),
        };
        warnings.push(Warning::new(code, format!("{name}: no mesh was written: {message}{old}")));
    } else {
        progress.stage("writing")?;
        let written = io::write_at(path, &mesh, imaged.unit, report.recentred.unwrap_or_default());
        let written = written.map_err(write_error)?;
        warnings.extend(write_notes(path, &written.notes));
        report.path = Some(path.to_path_buf());
    }
    Ok((report, warnings))
}

/// Returns the error of a mesh that could not be written.
pub fn write_error(error: io::WriteError) -> Error {
    match &error {
        io::WriteError::Io { path, source } => Error::output(path, source),
        _ => Error::input(error),
    }
}

/// Returns a warning if the volume of a mesh is far from the measured volume.
pub fn far_from_volume(imaged: &Imaged, report: &SurfaceReport) -> Option<Warning> {
    let VolumeEstimate { value, error } = imaged.volume?;
    let mesh = report.contoured_volume;
    let message = || {
        format!(
            "the mesh encloses a volume of {}, but the solid has {} ± {}: the mesh lacks {} walls and {} gaps that are thinner \
             than the pitch; raise --resolution to keep more",
            number(mesh),
            number(value),
            number(error),
            report.walls,
            report.gaps
        )
    };
    is_far(value, error + report.cut_off, mesh).then(|| Warning::new("mesh-far-from-volume", message()))
}

/// Returns whether the volume of a mesh differs from the measured volume by far more than its error, or, for large errors, by
/// more than half of the volume.
fn is_far(value: f64, error: f64, mesh: f64) -> bool {
    let distance = (mesh - value).abs();
    distance > (10.0 * error).max(0.01 * value) || distance > (2.0 * error).max(0.5 * value)
}

/// Returns a round offset near the middle of a box: a multiple of the power of ten next above its longest side.
pub fn middle(bounds: Aabb) -> DVec3 {
    let unit = 10f64.powi(bounds.extent().max_element().log10().ceil() as i32);
    let offset = (0.5 * (bounds.min + bounds.max) / unit).round() * unit;
    // Adding 0 makes 0 of −0.
    if offset.is_finite() { offset + DVec3::ZERO } else { DVec3::ZERO }
}

/// Contours images into a mesh for a file of a precision.
pub fn mesh(
    imaged: &Imaged,
    finish: Finish,
    precision: Precision,
    progress: &Monitor,
) -> Result<(TriangleMesh, SurfaceReport), Error> {
    let [a, b, c] = imaged.images else {
        return Err(Error::input("a mesh needs images along all three axes, x, y and z"));
    };
    let samples = imaged.images.iter().map(|image| image.depths().len() as u64).sum();
    memory::admit_mesh(samples, Limit::new(imaged.memory))?;
    progress.stage("contouring")?;
    let grid = a.grid();
    let size = grid.pitch() * DVec3::from_array(grid.rays().map(f64::from));
    let recentred = finish.recentre.then(|| middle(Aabb { min: grid.origin(), max: grid.origin() + size }));
    let coordinates = Coordinates { precision, offset: recentred.unwrap_or_default() };
    let surface = contour_in([a, b, c], imaged.normals, imaged.mode, coordinates).map_err(Error::input)?;
    let Surface { mesh, sub_resolution, disagreements, distance, stayed, pulled, crossing_pairs, .. } = surface;
    let contoured_volume = mesh.signed_volume();
    let cut_off = if imaged.normals.is_some() { 0.0 } else { a.grid().pitch() * mesh.area() };
    let parts = Parts::of(&mesh);
    let mut largest_share = parts.largest_share();
    let (mesh, dropped) = parts.without_small(mesh, finish.least_part.unwrap_or(0.0));
    drop(parts);
    if dropped.parts > 0 {
        largest_share = Parts::of(&mesh).largest_share();
    }
    let (mesh, simplified) = match finish.simplify {
        Some(bound) if !mesh.triangles.is_empty() => {
            progress.stage("simplifying")?;
            let (mesh, simplified) =
                simplified(mesh, &grid.translated(-coordinates.offset), bound.length(grid.pitch(), imaged.unit)?)?;
            (mesh, Some(simplified))
        }
        _ => (mesh, None),
    };
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
        vertices: manifold.vertices,
        triangles: manifold.triangles,
        components: manifold.components,
        genus: manifold.genus.unwrap_or(0),
        volume: manifold.signed_volume,
        contoured_volume,
        cut_off,
        walls: sub_resolution.walls,
        gaps: sub_resolution.gaps,
        disagreements,
        largest_distance: distance,
        blunted: stayed + pulled,
        crossing_pairs: simplified.is_none().then_some(crossing_pairs),
        simplified,
        largest_share,
        dropped,
        recentred,
    };
    Ok((mesh, report))
}

/// The bound of the first step, in pitches. A larger first step moves so many nodes to the other side that most places have to
/// be restored, and more triangles remain.
const FIRST_STEP: f64 = 0.1;

#[cfg(feature = "simplify")]
/// Removes triangles within a bound, so that sampling the mesh again gives the same nodes. A bound that is large compared with
/// the pitch is used in steps, each twice as long as the one before; their distances add up.
fn simplified(mesh: TriangleMesh, grid: &Grid, bound: f64) -> Result<(TriangleMesh, SimplifiedReport), Error> {
    let expected = planes_of(&mesh, grid)?;
    let mut report = SimplifiedReport { bound, distance: 0.0, triangles: mesh.triangles.len() };
    let (mut mesh, mut step) = (mesh, FIRST_STEP * grid.pitch());
    while report.distance < bound {
        let rest = bound - report.distance;
        let result = simplify(&mesh, step.min(rest), |mesh| {
            // If the mesh cannot be sampled on this grid, every vertex has to be restored.
            let Ok(found) = planes_of(mesh, grid) else { return mesh.positions.clone() };
            differences(grid, &expected, &found)
        });
        let result = result.map_err(Error::input)?;
        mesh = result.mesh;
        report.distance += result.distance;
        if step >= rest {
            break;
        }
        step *= 2.0;
    }
    Ok((mesh, report))
}

#[cfg(not(feature = "simplify"))]
fn simplified(_: TriangleMesh, _: &Grid, _: f64) -> Result<(TriangleMesh, SimplifiedReport), Error> {
    Err(Error::Usage("build ldi_ops with the feature `simplify` to remove triangles".to_owned()))
}

/// Returns the nodes inside a mesh, plane after plane.
fn planes_of(mesh: &TriangleMesh, grid: &Grid) -> Result<Vec<Vec<u64>>, Error> {
    // The mesh is closed, as the contour and each step of the simplification keep it closed.
    let solid = grid.quantise_open(mesh).map_err(Error::input)?;
    // All three images of one mesh agree about nodes, so one is enough.
    let image = CpuSampler::default().sample(&solid, Axis::X, Mode::Exact, FillRule::EvenOdd)?;
    Ok(NodePlanes::new([&image], Mode::Exact).map_err(Error::input)?.planes().collect())
}

/// Returns the world positions of nodes that differ.
fn differences(grid: &Grid, expected: &[Vec<u64>], found: &[Vec<u64>]) -> Vec<DVec3> {
    let [columns, ..] = grid.rays().map(|n| n as usize);
    let words = columns.div_ceil(64);
    let mut places = Vec::new();
    for (z, (expected, found)) in expected.iter().zip(found).enumerate() {
        for (at, (expected, found)) in expected.iter().zip(found).enumerate() {
            for bit in Ones(expected ^ found) {
                let node = [at % words * 64 + bit as usize, at / words, z].map(|i| f64::from(grid.node(i as u32)));
                places.push(grid.origin() + grid.step() * DVec3::from_array(node));
            }
        }
    }
    places
}

/// Number of lost walls and gaps, as a share of the vertices, above which there is a warning.
const NOTEWORTHY: f64 = 1e-3;

/// Returns warnings about details that the mesh lacks.
pub fn warnings(report: &SurfaceReport, has_normals: bool) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let lost = report.walls + report.gaps;
    if lost as f64 > NOTEWORTHY * report.vertices as f64 {
        let message = format!(
            "the mesh lacks details thinner than the pitch: rays cross {} walls and {} gaps between two neighbouring nodes; \
             raise --resolution to keep more",
            report.walls, report.gaps
        );
        warnings.push(Warning::new("below-resolution", message));
    }
    if !has_normals && report.vertices > 0 {
        let message = "the images have no normals, so edges and corners of the mesh are cut off".to_owned();
        warnings.push(Warning::new("no-normals", message));
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_is_far_beyond_ten_errors_or_a_hundredth_or_half_of_the_volume() {
        assert!(!is_far(100.0, 0.0, 100.9) && is_far(100.0, 0.0, 101.1));
        assert!(!is_far(100.0, 1.0, 90.5) && is_far(100.0, 1.0, 89.5));
        assert!(!is_far(100.0, 17.0, 55.0) && is_far(100.0, 17.0, 0.005));
        assert!(!is_far(100.0, 60.0, 0.005) && !is_far(0.0, 0.0, 0.0));
    }
}
