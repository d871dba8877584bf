//! The memory budget: forecasts the memory of an operation, and refuses an operation that would exceed the limit.
//!
//! A forecast has four parts. Meshes and primitives are in memory already and do not depend on the pitch h. Rows in progress
//! grow as 1/h, rays and samples as 1/h², lattice nodes as 1/h³. So a forecast at one pitch gives the pitch that meets a limit.
//!
//! The bytes of a sample were measured as address space: on a gyroid of 3.3 million triangles at 1000 to 6000 rays, the forecast
//! for images is 1.0 to 1.4 times the memory in use.

use std::fmt::{self, Display};

use super::job::Spacing;
use super::machine;
use super::work::expected_crossings;
use crate::Error;
use crate::grid::{Axis, Grid, LatticeSolid};
use crate::length::Length;
use crate::number::{number, rounded_up};

/// The share of the free memory that an operation takes without `--memory`.
const SHARE_OF_FREE: f64 = 0.8;

/// The share of the limit that a proposed raster takes: the forecast is an estimate, and the memory in use before it varies
/// from run to run.
const MARGIN: f64 = 0.9;

/// Operations that take fewer bytes are admitted even if no memory is free.
const LITTLE: f64 = 64e6;

/// Largest factor of the pitch that the search for a fitting raster tries.
const COARSEST: f64 = 1e5;

/// The bytes that a process is expected to hold at most, at one pitch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Bytes that do not depend on the pitch.
    pub fixed: f64,
    /// Bytes that grow with the number of rows.
    pub of_rows: f64,
    /// Bytes that grow with the number of rays.
    pub of_rays: f64,
    /// Bytes that grow with the number of nodes.
    pub of_nodes: f64,
}

impl Cost {
    /// Returns the bytes at a pitch `factor` times as long.
    fn at(&self, factor: f64) -> f64 {
        self.fixed + self.of_rows / factor + self.of_rays / factor.powi(2) + self.of_nodes / factor.powi(3)
    }

    /// Returns the bytes.
    pub fn bytes(&self) -> u64 {
        self.at(1.0) as u64
    }
}

/// Returns the largest of some costs at a pitch `factor` times as long.
fn largest(costs: &[Cost], factor: f64) -> f64 {
    costs.iter().map(|cost| cost.at(factor)).fold(0.0, f64::max)
}

/// Returns the least factor of the pitch, above 1, at which all costs are below a limit; `None` where no pitch is coarse enough.
fn below(costs: &[Cost], limit: f64) -> Option<f64> {
    let (mut fits, mut low) = (2.0, 1.0);
    while largest(costs, fits) > limit {
        (low, fits) = (fits, 2.0 * fits);
        if fits > COARSEST {
            return None;
        }
    }
    // A thousandth of the pitch is finer than the accuracy of the estimate.
    while fits - low > 1e-3 * low {
        let middle = 0.5 * (low + fits);
        match largest(costs, middle) > limit {
            true => low = middle,
            false => fits = middle,
        }
    }
    Some(fits)
}

/// Returns the least factor of the pitch, above 1, at which all costs are below a limit with a margin; `None` where no pitch is
/// coarse enough, or the limit is not known.
pub fn fitting(costs: &[Cost], limit: Limit) -> Option<f64> {
    below(costs, MARGIN * limit.bytes()? as f64)
}

/// Returns whether a cost is below a limit with a margin, or the limit is not known.
pub fn fits(cost: Cost, limit: Limit) -> bool {
    limit.bytes().is_none_or(|most| cost.at(1.0) <= MARGIN * most as f64)
}

/// The most memory that the process may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// The given number of bytes.
    Asked(u64),
    /// A share of the free bytes, plus those that the process holds.
    Free(u64),
    /// The system does not report the free memory, or it does not matter.
    Unknown,
}

impl Limit {
    /// Returns the requested limit, or one from the free memory.
    pub fn new(requested: Option<u64>) -> Limit {
        let of_free = |free| Limit::Free((SHARE_OF_FREE * free as f64) as u64 + machine::held_memory());
        requested.map(Limit::Asked).or_else(|| machine::free_memory().map(of_free)).unwrap_or(Limit::Unknown)
    }

    /// Returns the limit of an operation that takes at most some bytes: not known where they are too few to be refused, as to ask the
    /// system for the free memory takes 6 % of the time of a Boolean of cubes.
    pub fn of_at_most(requested: Option<u64>, bytes: f64) -> Limit {
        if requested.is_none() && bytes <= LITTLE { Limit::Unknown } else { Limit::new(requested) }
    }

    /// Returns the bytes, where they are known.
    pub fn bytes(self) -> Option<u64> {
        match self {
            Limit::Asked(bytes) | Limit::Free(bytes) => Some(bytes),
            Limit::Unknown => None,
        }
    }

    /// Returns the bytes of the limit, if a cost exceeds it.
    fn exceeded_by(self, costs: &[Cost]) -> Option<u64> {
        let bytes = largest(costs, 1.0);
        let is_little = matches!(self, Limit::Free(_)) && bytes - machine::held_memory() as f64 <= LITTLE;
        self.bytes().filter(|most| bytes > *most as f64 && !is_little)
    }
}

impl Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Limit::Asked(bytes) => write!(f, "--memory allows {}", size(*bytes as f64)),
            Limit::Free(bytes) => {
                write!(f, "{} are allowed (80 % of the free memory)", size(*bytes as f64))
            }
            Limit::Unknown => f.write_str("the free memory is not known"),
        }
    }
}

/// Refuses an operation whose cost is above the limit. `subject` names the data that need the memory; `way_out` returns advice,
/// from the factor of the pitch at which the cost would fit, if any.
///
/// # Errors
/// A machine error with the cost, the limit and the way out.
pub fn admit(
    costs: &[Cost],
    limit: Limit,
    subject: impl Display,
    way_out: impl FnOnce(Option<f64>) -> String,
) -> Result<(), Error> {
    let Some(most) = limit.exceeded_by(costs) else { return Ok(()) };
    let way_out = way_out(fitting(costs, limit));
    let fixed = costs.first().map_or(0.0, |cost| cost.fixed);
    let fixed = match fixed > MARGIN * most as f64 {
        true => format!(" ({} of it on any raster)", size(fixed)),
        false => String::new(),
    };
    Err(Error::machine(format!(
        "{subject} need about {} of memory{fixed}, and {limit}; {way_out}",
        size(largest(costs, 1.0))
    )))
}

/// Returns what an operation without a raster needs and what is allowed, if the process would hold more than the limit; `subject`
/// names the operation, and `bytes` are those that it takes beyond the `held` ones.
pub fn excess(subject: impl Display, held: u64, bytes: f64, limit: Limit) -> Option<String> {
    let fixed = held as f64 + bytes;
    limit.exceeded_by(&[Cost { fixed, ..Cost::default() }])?;
    Some(format!("{subject} needs about {} of memory, and {limit}", size(fixed)))
}

/// Returns the raster whose pitch is `factor` times that of `grid`, as [`advice`].
pub fn coarser(factor: Option<f64>, longest: f64, grid: &Grid, requested: Spacing<Length>) -> String {
    advice(rays_within(factor, longest, grid), longest, requested)
}

/// Returns the rays along the side `longest` of the raster whose pitch is `factor` times that of `grid`; 0 if there is none.
pub fn rays_within(factor: Option<f64>, longest: f64, grid: &Grid) -> u32 {
    factor.map_or(0, |factor| (longest / (factor * grid.pitch())) as u32)
}

/// Returns a raster of so many rays along the side `longest`, as advice: a resolution where one was requested, which counts along
/// that side, and else a pitch, rounded up so that it gives no more rays.
pub fn advice(rays: u32, longest: f64, requested: Spacing<Length>) -> String {
    let pitch = longest / f64::from(rays);
    match (rays, requested) {
        (0, _) => "no raster would fit; raise --memory".to_owned(),
        (_, Spacing::Resolution(_)) => format!("--resolution {rays}, a pitch of {}, would fit", number(pitch)),
        (_, Spacing::Pitch(_) | Spacing::Tolerance(_)) => {
            format!("--pitch {}, {rays} rays along the longest side, would fit", rounded_up(pitch))
        }
    }
}

/// Returns a number of bytes for people: in MB, or in GB from 10 GB on.
pub fn size(bytes: f64) -> String {
    match bytes {
        0.5..1.5 => "1 byte".to_owned(),
        ..1e5 => format!("{} bytes", number(bytes.round())),
        ..1e10 => format!("{} MB", number((bytes / 1e5).round() / 10.0)),
        _ => format!("{} GB", number((bytes / 1e8).round() / 10.0)),
    }
}

/// Returns the number of rays of the images along all axes.
pub fn rays(grid: &Grid) -> f64 {
    Axis::ALL.iter().map(|&axis| rays_along(grid, axis) as f64).sum()
}

/// Returns the number of rays of the image along an axis.
pub fn rays_along(grid: &Grid, axis: Axis) -> u64 {
    let (columns, rows) = grid.image_size(axis);
    u64::from(columns) * u64::from(rows)
}

/// Returns the number of lattice nodes.
pub fn nodes(grid: &Grid) -> f64 {
    grid.rays().iter().map(|&n| f64::from(n)).product()
}

/// The images of solids, as far as their memory depends on them.
#[derive(Clone, Copy, Debug)]
pub struct Images<'a> {
    /// The bytes that the process holds already.
    pub held: u64,
    /// The axes, one after another.
    pub axes: &'a [Axis],
    /// Number of images along one axis that are held at the same time, the result among them.
    pub at_once: u64,
    /// True if samples have triangles.
    pub have_triangles: bool,
    /// True if the image of an axis is kept while the next is made.
    pub are_kept: bool,
    /// True if all images are written with their normals.
    pub have_normals: bool,
}

/// Bytes of a ray, in the offsets of an image.
const RAY: f64 = 4.0;

/// Bytes of a sample in a growing list, which may have twice the capacity in use.
const GROWING: f64 = 8.0;

/// Bytes of a sample in a band of rows in progress: its sorted crossing, and its place in the image of the band.
const IN_BAND: f64 = 24.0;

/// Number of rows that are in progress at the same time.
const ROWS_UNDER_WAY: f64 = 256.0;

/// Bytes of a kept sample: its depth, without and with its triangle.
const KEPT: f64 = 8.0;
const KEPT_WITH_TRIANGLE: f64 = 12.0;

/// Bytes of a sample when normals are written: its depth, its triangle, and twice its normal while the lists are joined.
const WITH_NORMAL: f64 = 30.0;

impl Images<'_> {
    /// Returns the bytes that are held while each axis is sampled, and while all images are written.
    fn costs(&self, grid: &Grid, solids: &[LatticeSolid]) -> Vec<Cost> {
        let held = Cost { fixed: self.held as f64, ..Cost::default() };
        let (mut kept, mut written, mut costs) = (0.0, held, Vec::new());
        for &axis in self.axes {
            let rays = RAY * rays_along(grid, axis) as f64;
            let rows = f64::from(grid.image_size(axis).1);
            let samples: f64 = solids.iter().map(|solid| expected_crossings(solid, axis)).sum();
            // The samples of all inputs, and those of the result.
            let lists = if self.at_once > 1 { 2.0 } else { 1.0 };
            let triangles = if self.have_triangles { lists + 1.0 } else { 0.0 };
            let images = self.at_once as f64 * rays + GROWING * samples * (lists + triangles);
            let (of_rows, all_rows) = match rows > ROWS_UNDER_WAY {
                true => (IN_BAND * samples * ROWS_UNDER_WAY / rows, 0.0),
                false => (0.0, IN_BAND * samples),
            };
            costs.push(Cost { of_rows, of_rays: kept + images + all_rows, ..held });
            if self.are_kept {
                kept += rays + samples * if self.have_triangles { KEPT_WITH_TRIANGLE } else { KEPT };
                written.of_rays += rays + samples * if self.have_normals { WITH_NORMAL } else { KEPT };
            }
        }
        costs.push(written);
        costs
    }
}

/// Refuses images that would not fit into memory; `way_out` is as in [`admit`].
///
/// # Errors
/// A machine error.
pub fn admit_images(
    images: Images,
    grid: &Grid,
    solids: &[LatticeSolid],
    limit: Limit,
    way_out: impl FnOnce(Option<f64>) -> String,
) -> Result<(), Error> {
    let [x, y, z] = grid.rays();
    admit(&images.costs(grid, solids), limit, format_args!("the images of {x} × {y} × {z} rays"), way_out)
}

/// Refuses images along z of solids and of their result, for a picture, that would not fit into memory.
///
/// # Errors
/// A machine error.
pub fn admit_pictures(grid: &Grid, solids: &[LatticeSolid], limit: Limit, way_out: &str) -> Result<(), Error> {
    let images = Images {
        held: machine::held_memory(),
        axes: &[Axis::Z],
        at_once: solids.len() as u64 + 1,
        have_triangles: true,
        are_kept: true,
        have_normals: false,
    };
    admit_images(images, grid, solids, limit, |_| way_out.to_owned())
}

/// Returns the largest number of bytes per sample of a mesh: a vertex, two triangles, and the vertex stars of the manifold check.
///
/// Where triangles are removed, 340 and 400 bytes were measured, of a cube and of an organic solid (`ldi-ops offset --distance 0.1
/// --resolution 512`).
pub fn bytes_of_mesh_sample(is_simplified: bool) -> f64 {
    if is_simplified { 500.0 } else { 110.0 }
}

/// Refuses the mesh of a number of samples, from which triangles are removed or not, if it would not fit.
///
/// # Errors
/// A machine error.
pub fn admit_mesh(samples: u64, grid: &Grid, is_simplified: bool, limit: Limit) -> Result<(), Error> {
    let of_rays = bytes_of_mesh_sample(is_simplified) * samples as f64;
    // The nodes of the mesh before and after, one bit each.
    let of_nodes = if is_simplified { 2.0 / 8.0 * nodes(grid) } else { 0.0 };
    let cost = Cost { fixed: machine::held_memory() as f64, of_rays, of_nodes, ..Cost::default() };
    let subject = format_args!("the {} triangles of a mesh of {samples} samples", 2 * samples);
    let otherwise = if is_simplified { "; --surface-error 0, the full mesh, takes less" } else { "" };
    admit(&[cost], limit, subject, |factor| match factor {
        Some(factor) => {
            let (pitch, coarser) = (number(grid.pitch()), rounded_up(factor * grid.pitch()));
            format!("a pitch of {coarser} instead of {pitch} would fit{otherwise}")
        }
        None => format!("no raster would fit; raise --memory{otherwise}"),
    })
}

#[cfg(test)]
mod tests {
    use crate::mesh::ClosedMesh;
    use crate::solids;

    use super::*;

    const COST: Cost = Cost { fixed: 10e6, of_rows: 0.0, of_rays: 600e6, of_nodes: 400e6 };

    const RAYS: Spacing<Length> = Spacing::Resolution(100);

    const VOLUME: Images =
        Images { held: 0, axes: &[Axis::Z], at_once: 1, have_triangles: false, are_kept: false, have_normals: false };

    /// Returns the forecast for a cube of side 1 at a resolution, and whether it is admitted below a limit.
    fn cube(images: Images, resolution: u32, limit: Limit) -> (f64, Result<(), Error>) {
        let cube = solids::cuboid(glam::DVec3::ZERO, glam::DVec3::ONE).unwrap();
        let closed = ClosedMesh::check(cube).unwrap();
        let grid = Grid::with_resolution(closed.bounds(), resolution, 1024).unwrap();
        let solids = [grid.quantise(&closed).unwrap()];
        let admitted = admit_images(images, &grid, &solids, limit, |factor| coarser(factor, 1.0, &grid, RAYS));
        (largest(&images.costs(&grid, &solids), 1.0), admitted)
    }

    #[test]
    fn sizes_have_the_unit_that_people_use() {
        let sizes = [(0.0, "0 bytes"), (1.0, "1 byte"), (2.0, "2 bytes"), (1.5e6, "1.5 MB"), (1.2e10, "12 GB")];
        for (bytes, text) in sizes {
            assert_eq!(size(bytes), text);
        }
    }

    #[test]
    fn proposed_factors_fit_and_are_the_least() {
        for limit in [20e6, 100e6, 900e6] {
            let factor = below(&[COST], limit).unwrap();
            assert!(COST.at(factor) <= limit && COST.at(0.99 * factor) > limit, "{limit}: {factor}");
        }
        assert_eq!(below(&[COST], 9e6), None);
    }

    #[test]
    fn refusals_carry_the_figure_the_limit_and_a_way_out() {
        let bounds = crate::mesh::Aabb { min: glam::DVec3::ZERO, max: glam::DVec3::new(10.0, 8.0, 6.0) };
        let grid = Grid::with_resolution(bounds, 100, 1024).unwrap();
        let admitted =
            |limit, spacing| admit(&[COST], limit, "three images", |factor| coarser(factor, 10.0, &grid, spacing));
        assert_eq!(admitted(Limit::Asked(1_010_000_000), RAYS), Ok(()));
        assert_eq!(admitted(Limit::Unknown, RAYS), Ok(()));
        let message = |limit, spacing| admitted(Limit::Asked(limit), spacing).unwrap_err().to_string();
        let refusal = message(500_000_000, RAYS);
        for words in [
            "three images need about 1010 MB of memory",
            "--memory allows 500 MB",
            "--resolution 70, a pitch of 0.1428571, would fit",
        ] {
            assert!(refusal.contains(words), "no `{words}` in: {refusal}");
        }
        for spacing in [Spacing::Pitch(Length { value: 0.1, unit: None }), Spacing::Tolerance(0.01)] {
            let refusal = message(500_000_000, spacing);
            assert!(refusal.ends_with("--pitch 0.1428572, 70 rays along the longest side, would fit"), "{refusal}");
            assert_eq!(Grid::with_pitch(bounds, 0.1428572, 1024).unwrap().rays()[0], 70);
        }
        let refusal = message(5_000_000, RAYS);
        assert!(refusal.contains("10 MB of it on any raster") && refusal.contains("no raster would fit"), "{refusal}");
    }

    #[test]
    fn operations_without_a_raster_name_need_and_limit() {
        let excess_of = |limit| excess("it", 100_000_000, 200e6, limit);
        assert_eq!(excess_of(Limit::Asked(300_000_000)), None);
        assert_eq!(excess_of(Limit::Unknown), None);
        let words = "it needs about 300 MB of memory, and --memory allows 200 MB";
        assert_eq!(excess_of(Limit::Asked(200_000_000)).as_deref(), Some(words));
        // Little memory is always allowed, unless the user sets a limit.
        assert_eq!(excess("it", machine::held_memory(), 1e6, Limit::Free(0)), None);
        assert!(excess("it", machine::held_memory(), 1e6, Limit::Asked(0)).is_some());
    }

    #[test]
    fn rays_and_samples_are_counted() {
        let (found, admitted) = cube(VOLUME, 5120, Limit::Unknown);
        // Two samples on each of 5120² rays, a twentieth of them in progress.
        let rays = 5120.0 * 5120.0;
        assert!((found / (rays * (4.0 + 2.0 * (8.0 + 24.0 / 20.0))) - 1.0).abs() < 0.01, "{found}");
        assert_eq!(admitted, Ok(()));
        let more = [
            Images { at_once: 2, ..VOLUME },
            Images { have_triangles: true, ..VOLUME },
            Images { axes: &Axis::ALL, are_kept: true, ..VOLUME },
            Images { axes: &Axis::ALL, are_kept: true, have_normals: true, ..VOLUME },
        ];
        assert!(more.iter().all(|images| cube(*images, 5120, Limit::Unknown).0 > 1.2 * found));
    }

    #[test]
    fn proposed_resolutions_fit() {
        let limit = Limit::Asked(300 << 20);
        let failure = cube(VOLUME, 5120, limit).1.unwrap_err();
        assert_eq!(failure.kind(), crate::ErrorKind::Machine);
        let proposed: u32 =
            failure.to_string().split("--resolution ").nth(1).unwrap().split(',').next().unwrap().parse().unwrap();
        assert!((1000..5120).contains(&proposed), "{failure:?}");
        assert_eq!(cube(VOLUME, proposed, limit).1, Ok(()));
        assert!(cube(VOLUME, proposed * 5 / 4, limit).1.is_err());
        // An operation that needs very little memory is always admitted.
        assert_eq!(cube(VOLUME, 100, Limit::Free(0)).1, Ok(()));
    }

    #[test]
    fn meshes_are_refused_with_a_pitch_that_fits() {
        let bounds = crate::mesh::Aabb { min: glam::DVec3::ZERO, max: glam::DVec3::ONE };
        let grid = Grid::with_resolution(bounds, 100, 1024).unwrap();
        let limit = Limit::Asked(machine::held_memory() + 200_000_000);
        let refusal = admit_mesh(10_000_000, &grid, true, limit).unwrap_err().to_string();
        let proposed =
            refusal.split("a pitch of ").nth(1).and_then(|rest| rest.split(" instead of 0.01").next()).unwrap();
        let fewer = 10_000_000.0 * (0.01 / proposed.parse::<f64>().unwrap()).powi(2);
        assert_eq!(admit_mesh(fewer as u64, &grid, true, limit), Ok(()), "{refusal}");
        assert!(refusal.ends_with("--surface-error 0, the full mesh, takes less"), "{refusal}");
    }
}
