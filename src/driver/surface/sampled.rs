//! Meshes that are contoured from images, and simplified.

use glam::DVec3;

use super::simplified::simplified;
use super::{Made, SurfaceReport, checked, middle, without_small_parts};
use crate::driver::bound::Bound;
use crate::driver::finer::Finer;
use crate::driver::job::Finish;
use crate::driver::memory::{self, Limit};
use crate::grid::FineBox;
use crate::integrate::VolumeEstimate;
use crate::ldi::Ldi;
use crate::mesh::{Aabb, LengthUnit, Precision, TriangleMesh};
use crate::number::number;
use crate::progress::Monitor;
use crate::sampler::Mode;
use crate::surface::parts::Parts;
use crate::surface::simplify::crossing_pairs as crossing_pairs_of;
use crate::surface::{Coordinates, FineSource, FinerBlocks, Surface, contour_in, contour_refined};
use crate::{Error, Warning};

/// What a mesh from images lost.
#[derive(Clone, Copy, Debug)]
pub struct SampledReport {
    /// The volume before parts were dropped and triangles removed.
    pub contoured_volume: f64,
    /// The volume that may be missing where edges are cut off, as normals are unknown: one pitch times the area.
    pub cut_off: f64,
    /// The number of walls between two neighbouring nodes that rays cross away from the mesh.
    pub walls: u64,
    /// The number of gaps between two neighbouring nodes that rays cross away from the mesh.
    pub gaps: u64,
    /// The blocks of finer cells where details needed them.
    pub blocks: FinerBlocks,
    /// Whether the cells are those of the raster because there is too little memory for finer ones.
    pub lacks_memory_to_refine: bool,
    /// The number of nodes about which the images disagree.
    pub disagreements: u64,
    /// The largest distance of a sample from the mesh before it was simplified.
    pub largest_distance: f64,
    /// The number of vertices that could not be placed on their edge or corner.
    pub blunted: u64,
    /// The number of pairs of triangles that cross.
    pub crossing_pairs: u64,
    /// The report of the simplification; `None` for the full mesh.
    pub simplified: Option<SimplifiedReport>,
    /// Whether the mesh is full because there is too little memory to simplify it.
    pub lacks_memory: bool,
}

impl SampledReport {
    /// Returns the numbers of walls and gaps that the mesh lacks, in words.
    pub fn lost(&self) -> String {
        let counted = |count: u64, name: &str| format!("{count} {name}{}", if count == 1 { "" } else { "s" });
        format!("{} and {}", counted(self.walls, "wall"), counted(self.gaps, "gap"))
    }

    /// Returns the options by which the mesh would keep more details, in words.
    fn way_to_keep_more(&self) -> &'static str {
        match self.lacks_memory_to_refine {
            true => "raise --resolution, or --memory for finer cells, to keep more",
            false => "raise --resolution to keep more",
        }
    }
}

/// The report of a simplification.
#[derive(Clone, Copy, Debug)]
pub struct SimplifiedReport {
    /// The bound of the distance.
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
    /// What the images were made from, if they can be made again on finer rays.
    pub finer: Option<Finer<'a>>,
}

/// Contours images into a mesh for a file of a precision, and simplifies it.
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
    let (grid, limit) = (a.grid(), Limit::new(imaged.memory));
    let admit = |is_simplified: bool| memory::admit_mesh(samples, grid, is_simplified, limit);
    let within = match finish.surface_error {
        Some(bound) => admit(!bound.is_zero()).map(|()| bound)?,
        None if admit(true).is_ok() => Bound::DEFAULT,
        None => admit(false).map(|()| Bound::ZERO)?,
    };
    let bound = if within.is_zero() { 0.0 } else { within.length(grid.pitch(), imaged.unit)? };
    if !(bound >= 0.0 && bound.is_finite()) {
        return Err(Error::input(format!("the bound of a mesh's distance must be a length or zero, not {bound}")));
    }
    progress.stage("contouring")?;
    let size = grid.pitch() * DVec3::from_array(grid.rays().map(f64::from));
    let recentred = finish.recentre.then(|| middle(Aabb { min: grid.origin(), max: grid.origin() + size }));
    let coordinates = Coordinates { precision, offset: recentred.unwrap_or_default() };
    // Finer cells are at most as many as the others, and the mesh without them is there at the same time.
    let has_room = memory::admit_mesh(3 * samples, grid, !within.is_zero(), limit).is_ok();
    let levels = finish.refine.unwrap_or(Finish::LEVELS);
    let is_exact = imaged.mode == Mode::Exact && imaged.normals.is_some();
    let finer = imaged.finer.filter(|_| levels > 0 && is_exact).map(|finer| (finer, levels));
    let surface = contour([a, b, c], imaged, finer.filter(|_| has_room), coordinates)?;
    let Surface { mesh, sub_resolution, blocks, disagreements, distance, stayed, pulled, crossing_pairs, .. } = surface;
    let contoured_volume = mesh.signed_volume();
    let cut_off = if imaged.normals.is_some() { 0.0 } else { a.grid().pitch() * mesh.area() };
    let (mesh, shares) = without_small_parts(mesh, finish);
    let (mesh, simplified, crossing_pairs) = match within.is_zero() || mesh.triangles.is_empty() {
        true => (mesh, None, crossing_pairs),
        false => {
            progress.stage("simplifying")?;
            let grid = grid.translated(-coordinates.offset);
            let (mesh, simplified) = simplified(mesh, &grid, bound, precision)?;
            // New triangles cross none, so only those of before may.
            let left = if crossing_pairs == 0 { 0 } else { crossing_pairs_of(&mesh, precision) };
            (mesh, Some(simplified), left)
        }
    };
    let mut mesh = mesh;
    turn_crumbs(&mut mesh, a.grid().pitch(), precision);
    let report = SampledReport {
        contoured_volume,
        cut_off,
        walls: sub_resolution.walls,
        gaps: sub_resolution.gaps,
        blocks,
        lacks_memory_to_refine: finer.is_some() && !has_room,
        disagreements,
        largest_distance: distance,
        blunted: stayed + pulled,
        crossing_pairs,
        simplified,
        lacks_memory: finish.surface_error.is_none() && within.is_zero(),
    };
    checked(mesh, precision, Made::Sampled(report), shares, recentred, progress)
}

/// Contours images; with finer cells where they lack details if there are solids to sample again, up to a number of levels.
fn contour(
    images: [&Ldi; 3],
    imaged: &Imaged,
    finer: Option<(Finer, u32)>,
    coordinates: Coordinates,
) -> Result<Surface, Error> {
    match finer {
        Some((finer, levels)) => {
            let mut sampler = None;
            let sample = |fine: &FineBox| {
                let sampler = match &mut sampler {
                    Some(sampler) => sampler,
                    none => none.insert(finer.sampler(images[0].grid())?),
                };
                sampler(fine)
            };
            let from = FineSource { sample, triangles: finer.triangles() };
            contour_refined(images, imaged.normals, coordinates, levels, from)
        }
        None => Ok(contour_in(images, imaged.normals, imaged.mode, coordinates)?),
    }
}

/// Turns crumbs whose two sides have changed places, which are thinner than the pitch, as the file will have them.
fn turn_crumbs(mesh: &mut TriangleMesh, pitch: f64, precision: Precision) {
    if Parts::of(mesh).has_crumbs(pitch.powi(3)) {
        mesh.face_outwards(|place| precision.round(place));
    }
}

/// Returns a warning if the volume of a mesh is far from the measured volume.
pub fn far_from_volume(imaged: &Imaged, report: &SurfaceReport) -> Option<Warning> {
    let VolumeEstimate { value, error } = imaged.volume?;
    let sampled = report.sampled()?;
    let &SampledReport { contoured_volume: mesh, cut_off, walls, gaps, .. } = sampled;
    let message = || {
        let lacks = match walls + gaps {
            0 => String::new(),
            _ => format!("lacks {} that are thinner than the pitch, and ", sampled.lost()),
        };
        format!(
            "the mesh encloses a volume of {}, but the solid has {} ± {}: the mesh {lacks}widens walls and gaps below a fiftieth of \
             the pitch; {}",
            number(mesh),
            number(value),
            number(error),
            sampled.way_to_keep_more(),
        )
    };
    is_far(value, error + cut_off, mesh).then(|| Warning::new("mesh-far-from-volume", message()))
}

/// Returns whether the volume of a mesh differs from the measured volume by far more than its error, or, for large errors, by
/// more than half of the volume.
fn is_far(value: f64, error: f64, mesh: f64) -> bool {
    let distance = (mesh - value).abs();
    distance > (10.0 * error).max(0.01 * value) || distance > (2.0 * error).max(0.5 * value)
}

/// Number of lost walls and gaps, as a share of the vertices, above which there is a warning.
const NOTEWORTHY: f64 = 1e-3;

/// Returns warnings about details that the mesh lacks, and triangles that it has for lack of memory.
pub fn warnings(report: &SurfaceReport, has_normals: bool) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let Some(sampled) = report.sampled() else { return warnings };
    if sampled.lacks_memory && report.triangles > 0 {
        let message = format!(
            "the mesh keeps all {} triangles: there is too little memory to remove those that its shape does not need; raise \
             --memory or lower --resolution, or accept this with --surface-error 0",
            report.triangles
        );
        warnings.push(Warning::new("mesh-not-simplified", message));
    }
    let lost = sampled.walls + sampled.gaps;
    if lost as f64 > NOTEWORTHY * report.vertices as f64 {
        let message = format!(
            "the mesh lacks details thinner than the pitch: rays cross {} between two neighbouring nodes; {}",
            sampled.lost(),
            sampled.way_to_keep_more()
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
