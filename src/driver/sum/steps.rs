//! One step: images of a sum, a difference or an offset from closed meshes.

use std::borrow::Cow;
use std::fmt::Display;
use std::time::Instant;

use super::backend::SumBackend;
use super::between_rays::{BetweenRays, Searched, Tests};
use super::bounds::certified_bounds;
use super::finer::{FinerSum, Parts};
use super::forecast::Forecast;
use super::spot_check::first_difference;
use crate::Error;
use crate::driver::job::{Keep, Spacing};
use crate::driver::machine;
use crate::driver::measured::{Seconds, StepReport};
use crate::driver::memory::{self, Cost, Limit};
use crate::driver::raster::refused_pitch;
use crate::fixed::{Crossing, Hit, TriangleHit};
use crate::grid::{Axis, Grid, SumGrid, offset_grid};
use crate::integrate;
use crate::ldi::{Ldi, VolumeSums};
use crate::length::Length;
use crate::mesh::ClosedMesh;
use crate::metrics::bounds::Interval;
use crate::minkowski::ball::{BallMembership, BallPatches, BallProbe, PatchCounts};
use crate::minkowski::{
    CullCounts, Exterior, Interior, Membership, Polyhedron, Primitives, RaySpans, ResolveCounts, ResolvedSpans,
    SumMembership, SumProbe, cull,
};
use crate::number::number;
use crate::progress::Monitor;
use crate::sampler::Mode;
use crate::sampler::cpu::CpuSampler;

/// The operation of a step.
#[derive(Clone, Copy)]
pub enum Step<'m> {
    /// The sum with another solid.
    Sum(&'m ClosedMesh),
    /// The positions at which the reflection of this solid fits into the first one: the complement of the sum of this solid and
    /// the first one's complement.
    DifferenceOfReflected(&'m ClosedMesh),
    /// The offset by a distance, which shrinks the solid if it is negative.
    Offset(f64),
}

/// Number of primitive triangles up to which the step does not test which of them lie inside the sum.
const FEW_TRIANGLES: usize = 1 << 15;

/// Bytes per gap during gap resolution: its position, and the component of nodes that it belongs to.
const BYTES_OF_GAP: f64 = 12.0;

/// Bytes of the ends of a ray along z.
const BYTES_OF_ENDS: f64 = 6.0;

/// Bytes per triangle of the search for the closest triangle.
const BYTES_OF_CLOSEST: f64 = 150.0;

/// Bytes of the normal of a sample, and of its number.
const BYTES_OF_NORMAL: f64 = 16.0;

/// Memory in addition to spans and images, in bytes.
#[derive(Clone, Copy, Debug, Default)]
struct ExtraMemory {
    /// Bytes that do not depend on the pitch.
    fixed: f64,
    /// Bytes that grow with the number of rays.
    of_rays: f64,
}

/// The sides of its facets on which a solid may lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sides {
    /// Behind the facets.
    Behind,
    /// On both sides, as the surface has folds.
    Both,
}

/// The failure of a step.
enum StepError {
    /// Rays contradict each other or the exact membership test.
    Contradiction(Error),
    /// Any other error.
    Failed(Error),
}

impl From<Error> for StepError {
    fn from(failure: Error) -> StepError {
        StepError::Failed(failure)
    }
}

impl From<StepError> for Error {
    fn from(error: StepError) -> Error {
        match error {
            StepError::Contradiction(failure) | StepError::Failed(failure) => failure,
        }
    }
}

/// The settings that all steps of a job share.
#[derive(Clone, Copy)]
pub struct Setting<'s> {
    pub pitch: f64,
    /// The requested spacing, from which the pitch follows.
    pub requested: Spacing<Length>,
    /// The side that a resolution counts along.
    pub longest: f64,
    pub lod: u32,
    pub limit: Limit,
    /// Bytes of rasters and meshes before, which grow with the number of rays.
    pub held_by_rays: u64,
    pub backend: &'s SumBackend,
    /// The axes of the requested images.
    pub axes: &'s [Axis],
    pub mode: Mode,
    pub keep: Keep,
    /// True if certified bounds of the volume are needed.
    pub needs_bounds: bool,
    /// True for a raster that only checks a finer one, beside whose images it needs less memory than was forecast for that.
    /// Details between its rays are not searched.
    pub is_coarser: bool,
    /// The names of the inputs, for messages.
    pub names: &'s str,
    pub progress: &'s Monitor<'s>,
}

/// The images of a step.
pub struct StepImages {
    pub grid: Grid,
    /// The sums along the requested axes.
    pub volume_sums: Vec<VolumeSums>,
    /// The images along these axes, if they are kept.
    pub images: Vec<Ldi>,
    /// The normals of the primitives that the images refer to as triangles.
    pub normals: Vec<[f32; 3]>,
    /// The solids, if a mesh may need finer images.
    pub finer: Option<FinerSum>,
    /// The volume that an over- or under-estimate adds or omits, in cubic world units: the mean over the axes.
    pub bias: f64,
    /// Certified bounds of the volume, if they are needed.
    pub bounds: Option<Interval>,
    pub report: StepReport,
}

/// The times of the stages of a step.
struct Laps {
    since: Instant,
    seconds: Vec<(&'static str, f64)>,
}

impl Laps {
    fn start() -> Laps {
        Laps { since: Instant::now(), seconds: Vec::new() }
    }

    /// Ends a stage and returns its seconds.
    fn lap(&mut self, stage: &'static str) -> f64 {
        let took = self.since.elapsed().as_secs_f64();
        match self.seconds.iter_mut().find(|(known, _)| *known == stage) {
            Some((_, seconds)) => *seconds += took,
            None => self.seconds.push((stage, took)),
        }
        self.since = Instant::now();
        took
    }
}

impl Setting<'_> {
    /// Runs a step on a solid.
    pub fn make(&self, a: &ClosedMesh, step: &Step, seconds: &mut Seconds) -> Result<StepImages, Error> {
        match self.keep.has_triangles() {
            true => self.make_with::<TriangleHit>(a, step, seconds),
            false => self.make_with::<Crossing>(a, step, seconds),
        }
    }

    /// Runs a step with one type of hits. Facets that contradict each other come from folds, in which the solid lies on the wrong
    /// side of its facets; rounding to the lattice may cause them. The step then runs again with both sides of all facets.
    fn make_with<H: Hit + Sync>(
        &self,
        a: &ClosedMesh,
        step: &Step,
        seconds: &mut Seconds,
    ) -> Result<StepImages, Error> {
        let mut of_sides = |sides| match *step {
            Step::Sum(b) => self.of_pair::<H>(a, b, Exterior::Out, sides, seconds),
            Step::DifferenceOfReflected(b) => self.of_pair::<H>(a, b, Exterior::In, sides, seconds),
            Step::Offset(distance) => self.of_ball::<H>(a, distance, sides, seconds),
        };
        match of_sides(Sides::Behind) {
            Err(StepError::Contradiction(_)) => {
                self.progress.detail(format_args!("facets contradict each other: both sides of each are used"));
                Ok(of_sides(Sides::Both)?)
            }
            result => Ok(result?),
        }
    }

    /// Makes a sum, or with [`Exterior::In`] a difference of the reflected solid.
    fn of_pair<H: Hit + Sync>(
        &self,
        a: &ClosedMesh,
        b: &ClosedMesh,
        exterior: Exterior,
        sides: Sides,
        seconds: &mut Seconds,
    ) -> Result<StepImages, StepError> {
        let mut laps = Laps::start();
        self.progress.stage("culling")?;
        let grids = SumGrid::with_pitch(a.bounds(), b.bounds(), self.pitch, self.lod);
        let SumGrid { sum: grid, a: grid_a, b: grid_b } = grids.map_err(|error| {
            refused_pitch(&error, (a.bounds().extent() + b.bounds().extent()).max_element(), self.names)
        })?;
        let (a, b) = (self.polyhedron(&grid_a, a, exterior)?, self.polyhedron(&grid_b, b, Exterior::Out)?);
        let (mut primitives, pairs) = match sides {
            Sides::Behind => cull(&a, &b),
            Sides::Both => cull(&a.two_sided(), &b.two_sided()),
        };
        let mut culled = laps.lap("cull");
        let sampler = CpuSampler::default();
        if primitives.triangles.len() > FEW_TRIANGLES {
            primitives = primitives.outside(&Interior::new(&grid, &a, exterior, &b, &sampler));
        }
        culled += laps.lap("interior");
        let CullCounts { candidates, visited, kept, distinct } = pairs;
        self.progress.detail(format_args!(
            "culled in {culled:.4} s: {candidates} pairs, {visited} of them visited, {kept} kept; {distinct} primitives, {} \
             triangles to sample",
            primitives.triangles.len()
        ));

        let membership = SumMembership::new(&a, exterior, &b);
        let forecast = || {
            Forecast::of::<StepError>(
                &grid,
                |grid, axis| Ok(primitives.spans(grid, axis, exterior, &sampler)?.0),
                |grid, spans| Ok(self.resolved_spans(&SumBackend::Cpu, grid, spans, exterior, &membership)?.spans),
                // In a random order, half of the crossings are ends of possible gaps.
                (&primitives.positions, &primitives.triangles, 0.5),
            )
        };
        let memory_estimate = self.admit::<H>(&grid, forecast, |_| ExtraMemory::default())?;
        seconds.operate += culled + laps.lap("forecast");

        let spans = |axis| self.backend.spans(&primitives, &grid, axis, exterior);
        let (spans, crossings) = self.sampled::<H>(seconds, &mut laps, &grid, spans)?;
        let normals = if self.keep.has_triangles() { primitives.normals(&grid) } else { Vec::new() };
        seconds.operate += laps.lap("normals");
        let sampled = primitives.triangles.len() as u64;
        // Only bounds, the search between the rays and finer rays need the primitives again.
        let primitives = if self.is_coarser { Primitives::default() } else { primitives };
        let ResolvedSpans { spans, counts: resolved } =
            self.resolved(seconds, &mut laps, &grid, spans, exterior, &membership)?;
        let tests = Tests::of_sum(&resolved, [&a, &b]);
        let probe = SumProbe::new(&membership);
        let searched = Searched { grid: &grid, spans: &spans, exterior, probe: &probe, tests };
        let between_rays = self.between_rays(seconds, &mut laps, || searched.bounded_by(&primitives))?;
        let bounds = match self.needs_bounds {
            true => {
                self.progress.stage("certifying bounds")?;
                Some(certified_bounds(&grid, &primitives, &spans[0])?)
            }
            false => None,
        };
        let operation = match exterior {
            Exterior::Out => "sum",
            Exterior::In => "difference",
        };
        let report = StepReport {
            operation,
            distance: None,
            is_folded: sides == Sides::Both,
            pairs: Some(pairs),
            primitives: pairs.distinct,
            sampled,
            crossings: Some(crossings),
            resolved,
            between_rays,
            memory_estimate,
            seconds: Vec::new(),
        };
        let mut images = self.images(seconds, &mut laps, grid, &spans, report)?;
        images.normals = normals;
        drop(membership);
        images.finer = self.finer(exterior, || Parts::OfPair { primitives, solids: [a, b] });
        images.bounds = bounds;
        images.report.seconds = laps.seconds;
        Ok(images)
    }

    /// Makes an offset.
    fn of_ball<H: Hit + Sync>(
        &self,
        a: &ClosedMesh,
        distance: f64,
        sides: Sides,
        seconds: &mut Seconds,
    ) -> Result<StepImages, StepError> {
        let mut laps = Laps::start();
        self.progress.stage("finding edges")?;
        let grid = offset_grid(a.bounds(), distance, self.pitch, self.lod);
        let longest = a.bounds().extent().max_element() + 2.0 * distance.max(0.0);
        let grid = grid.map_err(|error| refused_pitch(&error, longest, self.names))?;
        let exterior = if distance > 0.0 { Exterior::Out } else { Exterior::In };
        let solid = self.polyhedron(&grid, a, exterior)?;
        let radius = distance.abs() / grid.step();
        let covered = match sides {
            Sides::Behind => Cow::Borrowed(&solid),
            Sides::Both => Cow::Owned(solid.two_sided()),
        };
        let patches = BallPatches::new(&covered, radius);
        let PatchCounts { facets, tubes, caps } = patches.counts();
        let found = laps.lap("patches");
        self.progress.detail(format_args!(
            "{facets} facets, {tubes} parts of tubes and {caps} of spheres, found in {found:.4} s"
        ));

        let forecast = || {
            Forecast::of::<StepError>(
                &grid,
                |grid, axis| patches.spans(grid, axis, exterior),
                // Most gaps belong to the result.
                |_, spans| Ok(spans),
                (covered.positions(), covered.triangles(), 1.0),
            )
        };
        let extra = |samples: f64| {
            let normals = if self.keep.has_triangles() { BYTES_OF_NORMAL * samples } else { 0.0 };
            // The membership test holds exact images of the solid, which have about as many samples.
            let solid_images = 4.0 * (memory::rays(&grid) + samples);
            ExtraMemory { fixed: BYTES_OF_CLOSEST * facets as f64, of_rays: solid_images.max(normals) }
        };
        let memory_estimate = self.admit::<H>(&grid, forecast, extra)?;
        let membership = BallMembership::new(&grid, &solid, radius, exterior).map_err(Error::from)?;
        seconds.operate += found + laps.lap("forecast");

        let spans = |axis| patches.counted_spans::<H>(&grid, axis, exterior).map_err(Error::machine);
        let (spans, crossings) = self.sampled(seconds, &mut laps, &grid, spans)?;
        let ResolvedSpans { spans, counts: resolved } =
            self.resolved(seconds, &mut laps, &grid, spans, exterior, &membership)?;
        let probe = BallProbe::new(&membership, &solid);
        let tests = Tests::of_ball(&grid);
        let searched = Searched { grid: &grid, spans: &spans, exterior, probe: &probe, tests };
        let between_rays = self.between_rays(seconds, &mut laps, || searched.bounded_by_patches(&patches))?;
        drop(membership);
        let primitives = (facets + tubes + caps) as u64;
        let report = StepReport {
            operation: "offset",
            distance: Some(distance),
            is_folded: sides == Sides::Both,
            pairs: None,
            primitives,
            sampled: primitives,
            crossings: Some(crossings),
            resolved,
            between_rays,
            memory_estimate,
            seconds: Vec::new(),
        };
        let mut images = self.images(seconds, &mut laps, grid, &spans, report)?;
        if self.keep.has_triangles() {
            // An axis without an image has no samples to number.
            let mut all = Axis::ALL.map(|axis| empty_image(&grid, axis));
            for image in images.images.drain(..) {
                let axis = image.axis();
                all[axis.depth()] = Ok(image);
            }
            let [x, y, z] = all;
            let (numbered, normals) = patches.sample_normals([x?, y?, z?]).map_err(Error::input)?;
            images.images = numbered.into_iter().filter(|image| self.axes.contains(&image.axis())).collect();
            images.normals = normals;
            seconds.operate += laps.lap("normals");
        }
        drop(patches);
        let two_sided = match covered {
            Cow::Owned(two_sided) => Some(two_sided),
            Cow::Borrowed(_) => None,
        };
        images.finer = self.finer(exterior, || Parts::OfBall { solid, two_sided, radius });
        images.report.seconds = laps.seconds;
        Ok(images)
    }

    /// Returns a mesh on the lattice, or its complement, as it enters a sum.
    fn polyhedron(&self, grid: &Grid, mesh: &ClosedMesh, exterior: Exterior) -> Result<Polyhedron, Error> {
        let solid = Polyhedron::new(&grid.quantise(mesh).map_err(|error| self.refused(&error))?);
        if solid.triangles().is_empty() {
            return Err(self.refused(&format_args!(
                "every triangle of a solid {} long is thinner than a lattice step of {}, so the solid vanishes; raise \
                 --resolution",
                number(mesh.bounds().extent().max_element()),
                number(2.0 * grid.step())
            )));
        }
        Ok(match exterior {
            Exterior::Out => solid,
            Exterior::In => solid.complement(),
        })
    }

    /// Finds the spans of all rays along all axes, and counts crossings.
    fn sampled<H: Hit>(
        &self,
        seconds: &mut Seconds,
        laps: &mut Laps,
        grid: &Grid,
        spans: impl Fn(Axis) -> Result<(RaySpans<H>, u64), Error>,
    ) -> Result<([RaySpans<H>; 3], [u64; 3]), Error> {
        let mut took = 0.0;
        self.progress.expect(Axis::ALL.len() + self.axes.len())?;
        let [x, y, z] = grid.rays();
        let mut along = |axis: Axis| {
            self.progress.stage(format!("{x} × {y} × {z} rays, along {}", axis.name()))?;
            let found = spans(axis);
            took += laps.lap(["spans_x", "spans_y", "spans_z"][axis.depth()]);
            self.progress.step()?;
            found
        };
        let [(along_x, met_x), (along_y, met_y), (along_z, met_z)] =
            [along(Axis::X)?, along(Axis::Y)?, along(Axis::Z)?];
        seconds.sample += took;
        let kept = along_x.hits.len() + along_y.hits.len() + along_z.hits.len();
        self.progress.detail(format_args!("sampled in {took:.4} s: {kept} crossings that may bound the result"));
        Ok(([along_x, along_y, along_z], [met_x, met_y, met_z]))
    }

    /// Resolves gaps, then compares some nodes with the exact membership test.
    fn resolved<H: Hit + Sync>(
        &self,
        seconds: &mut Seconds,
        laps: &mut Laps,
        grid: &Grid,
        spans: [RaySpans<H>; 3],
        exterior: Exterior,
        membership: &impl Membership,
    ) -> Result<ResolvedSpans<H>, StepError> {
        self.progress.stage("flooding")?;
        let resolved = self.resolved_spans(self.backend, grid, spans, exterior, membership)?;
        let mut took = laps.lap("resolve");
        if let Some(node) = first_difference(grid, &resolved.spans, exterior, membership) {
            let [x, y, z] = node;
            return Err(StepError::Contradiction(self.refused(&format_args!(
                "Internal check failed at node ({x}, {y}, {z}): the result disagrees with the exact membership test. Please \
                 report this; another --resolution may work."
            ))));
        }
        took += laps.lap("spot_check");
        seconds.operate += took;
        let ResolveCounts { components, gaps, gaps_tested, gaps_out, .. } = resolved.counts;
        self.progress.detail(format_args!(
            "resolved in {took:.4} s: {components} components and {gaps_tested} of {gaps} gaps tested, {gaps_out} gaps stay"
        ));
        Ok(resolved)
    }

    fn resolved_spans<H: Hit + Sync>(
        &self,
        backend: &SumBackend,
        grid: &Grid,
        spans: [RaySpans<H>; 3],
        exterior: Exterior,
        membership: &impl Membership,
    ) -> Result<ResolvedSpans<H>, StepError> {
        let progress = self.progress;
        // The monitor remembers a request to stop until the next stage.
        let report_progress = move |done: u64, all: u64| {
            let _ = progress.stage(format!("testing components of open nodes: {done} of {all}"));
        };
        let resolved = backend.resolve(grid, spans, exterior, membership, &report_progress).map_err(Error::from)?;
        resolved.map_err(|error| {
            StepError::Contradiction(self.refused(&format_args!(
                "{error}; a self-intersecting surface may cause this: remove its self-intersections with `ldi-ops sample FILE --fill \
                 nonzero --mode exact -o one.stl`"
            )))
        })
    }

    /// Searches for details between the rays, if they are wanted.
    fn between_rays(
        &self,
        seconds: &mut Seconds,
        laps: &mut Laps,
        search: impl FnOnce() -> BetweenRays,
    ) -> Result<Option<BetweenRays>, Error> {
        if self.is_coarser {
            return Ok(None);
        }
        self.progress.stage("searching between the rays")?;
        let found = search();
        let took = laps.lap("between_rays");
        seconds.operate += took;
        let BetweenRays { candidates, details, .. } = &found;
        self.progress.detail(format_args!(
            "searched between the rays in {took:.4} s: {candidates} cubes may have a detail, {} details found",
            details.len()
        ));
        Ok(Some(found))
    }

    /// Returns the solids of the step for finer rays, if it may have a mesh that needs them.
    fn finer(&self, exterior: Exterior, parts: impl FnOnce() -> Parts) -> Option<FinerSum> {
        let is_wanted = match self.keep {
            Keep::Mesh(request) => request.is_refined,
            Keep::ImagesWithTriangles => true,
            Keep::Sums | Keep::Images => false,
        };
        let can_be = self.mode == Mode::Exact && self.axes.len() == Axis::ALL.len() && !self.is_coarser;
        (is_wanted && can_be).then(|| FinerSum { exterior, parts: parts() })
    }

    /// Makes the requested images from resolved spans.
    fn images<H: Hit + Sync>(
        &self,
        seconds: &mut Seconds,
        laps: &mut Laps,
        grid: Grid,
        spans: &[RaySpans<H>; 3],
        report: StepReport,
    ) -> Result<StepImages, Error> {
        let sampler = CpuSampler::default();
        let mut step = StepImages {
            grid,
            volume_sums: Vec::new(),
            images: Vec::new(),
            normals: Vec::new(),
            finer: None,
            bias: 0.0,
            bounds: None,
            report,
        };
        for &axis in self.axes {
            self.progress.stage(format!("the image along {}", axis.name()))?;
            let spans = &spans[axis.depth()];
            let mut image = spans.image(&grid, self.mode, &sampler).map_err(Error::machine)?;
            if self.mode != Mode::Exact {
                let exact = spans.image(&grid, Mode::Exact, &sampler).map_err(Error::machine)?;
                let difference = integrate::volume(&image) - integrate::volume(&exact);
                step.bias += difference.abs() / self.axes.len() as f64;
                if self.keep.has_triangles() {
                    image = image.with_triangles_of(&[(&exact, 0)]).map_err(Error::input)?;
                }
            }
            seconds.operate += laps.lap("retrieve");
            step.volume_sums.push(image.volume_sums());
            seconds.integrate += laps.lap("integrate");
            if self.keep != Keep::Sums {
                step.images.push(image);
            }
            self.progress.step()?;
        }
        Ok(step)
    }

    /// Refuses a step that would not fit into memory; returns its expected peak, in bytes, and zero for a raster that only checks
    /// a finer one. `extra` returns the memory in addition to spans and images, from the number of samples.
    fn admit<H>(
        &self,
        grid: &Grid,
        forecast: impl FnOnce() -> Result<Forecast, StepError>,
        extra: impl FnOnce(f64) -> ExtraMemory,
    ) -> Result<u64, StepError> {
        if self.is_coarser {
            return Ok(0);
        }
        self.progress.stage("forecasting memory")?;
        let Forecast { kept, samples } = forecast()?;
        let extra = extra(samples);
        let rays = memory::rays(grid);
        // The spans of one axis are joined from bands, which are in memory at the same time.
        let spans = 4.0 * rays + size_of::<H>() as f64 * kept;
        let resolving = spans
            + BYTES_OF_ENDS * memory::rays_along(grid, Axis::Z) as f64
            + (spans / 3.0).max(BYTES_OF_GAP * 0.5 * kept);
        let of_sample = if self.keep.has_triangles() { 8.0 } else { 4.0 };
        let image = (4.0 * rays + of_sample * samples) / 3.0;
        let images = if self.keep == Keep::Sums { 0.0 } else { image * self.axes.len() as f64 };
        let mesh = match self.keep {
            Keep::Mesh(request) => memory::bytes_of_mesh_sample(request.is_simplified) * samples,
            _ => 0.0,
        };
        // The image of an estimate is in memory together with the exact one.
        let retrieving = spans + images + 2.0 * image;
        let held_by_rays = self.held_by_rays as f64;
        let cost = Cost {
            fixed: (machine::held_memory() as f64 - held_by_rays).max(0.0) + extra.fixed,
            of_rows: 0.0,
            of_rays: resolving.max(retrieving).max(images + mesh) + extra.of_rays + held_by_rays,
            of_nodes: self.backend.bits_of_node() / 8.0 * memory::nodes(grid),
        };
        let subject = format_args!("{}: spans and images", self.names);
        let way_out = |factor| memory::coarser(factor, self.longest, grid, self.requested);
        memory::admit(&[cost], self.limit, subject, way_out)?;
        self.backend.admit(grid)?;
        self.progress.detail(format_args!("{kept:.0} crossings are expected, and {} bytes", cost.bytes()));
        Ok(cost.bytes())
    }

    /// Returns empty images, on the grid of a previous step.
    pub fn empty(&self, previous: StepImages) -> Result<StepImages, Error> {
        let StepImages { grid, report, .. } = previous;
        let images = self.axes.iter().map(|&axis| empty_image(&grid, axis)).collect::<Result<Vec<Ldi>, Error>>()?;
        let volume_sums = images.iter().map(Ldi::volume_sums).collect();
        let normals = Vec::new();
        Ok(StepImages { grid, volume_sums, images, normals, finer: None, bias: 0.0, bounds: None, report })
    }

    fn refused(&self, error: &dyn Display) -> Error {
        Error::input(format!("{}: {error}", self.names))
    }
}

/// Returns an image without samples.
fn empty_image(grid: &Grid, axis: Axis) -> Result<Ldi, Error> {
    let (columns, rows) = grid.image_size(axis);
    let offsets = vec![0; columns as usize * rows as usize + 1];
    Ldi::from_parts(*grid, axis, offsets, Vec::new(), Vec::new()).map_err(Error::input)
}
