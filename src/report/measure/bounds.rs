//! Lower and upper bounds of metrics, from an inner and an outer solid.
//!
//! The inner solid is all cubes of one pitch that lie in the solid, the outer one all that intersect it. Volumes are summed on
//! a finer raster, because they only need cubes to be counted. Percolation and thickness are measured again on both, as they
//! grow or shrink with the solid: the pores of the outer solid let no larger ball pass than those of the solid itself.

use super::balls::Balls;
use super::record::Record;
use super::{Clock, Study};
use crate::Error;
use crate::driver::input::Solid;
use crate::grid::{Axis, Grid};
use crate::ldi::{Ldi, NodePlanes};
use crate::metrics::bounds::{Interval, Sampled, SolidBounds, VolumeBounds, Within, finer_grid};
use crate::metrics::{BoundaryCondition, Distribution, NodeSet, Phase};
use crate::report::id;
use crate::sampler::{FillRule, Mode, Sampler};

/// Most cubes along the longest side for volumes.
const FINEST: u32 = 1024;

/// Difference of the lattices that a value and its bounds are rounded to, as a share.
const ROUNDED: f64 = 1e-6;

/// Adds bounds to volume, porosity, percolation and the thinnest wall.
pub fn measure(study: &Study, sampler: &dyn Sampler, clock: &mut Clock, record: &mut Record) -> Result<(), Error> {
    clock.time("bounds of volume", || volumes(study, sampler, record))?;
    let grid = study.region.grid();
    let is_fine = grid.rays().into_iter().max().is_some_and(|rays| rays > COARSE);
    // A periodic cell must consist of whole pitches.
    let halves = study.settings.edges != BoundaryCondition::Periodic || grid.rays().iter().all(|rays| rays % 2 == 0);
    if !(is_fine && halves) {
        between_cubes(study, clock, record);
        return Ok(());
    }
    let Study { subject, settings, .. } = *study;
    let images = subject.sample(&subject.grid_of_pitch(2.0 * grid.pitch())?, settings.fill, sampler)?;
    let region = images.region();
    let planes = NodePlanes::new(&images.solid, Mode::Exact).expect("images along the three axes of one grid");
    let solid = NodeSet::of_planes(&planes);
    between_cubes(&Study { subject, settings, images: &images, region: &region, solid }, clock, record);
    Ok(())
}

/// Rasters of more rays than this along the longest side are halved for metrics between cubes: these take longer than the
/// values themselves, and are accurate to a few cubes at best.
const COARSE: u32 = 128;

/// Computes bounds of percolation and of the thinnest wall on the raster of a study.
fn between_cubes(study: &Study, clock: &mut Clock, record: &mut Record) {
    let bounds =
        clock.time("inner and outer solid", || SolidBounds::of(&study.images.lattice, &study.solid, study.region));
    let region = match study.images.roi() {
        Some(roi) if !study.region.is_box() => SolidBounds::of(roi, study.region.nodes(), study.region),
        // A box is exact.
        _ => SolidBounds { inner: study.region.nodes().clone(), outer: study.region.nodes().clone() },
    };
    let between = |solid: &NodeSet, of_solid: &NodeSet, of_pores: &NodeSet| {
        Balls::between_cubes(study, solid, of_solid, of_pores.minus(solid))
    };
    let [outer, inner] = clock.time("balls between cubes", || {
        [between(&bounds.outer, &region.outer, &region.inner), between(&bounds.inner, &region.inner, &region.outer)]
    });
    clock.time("bounds of thickness", || thinnest(study, &outer, &inner, record));
    clock.time("bounds of percolation", || percolation(study, [outer, inner], record));
}

fn volumes(study: &Study, sampler: &dyn Sampler, record: &mut Record) -> Result<(), Error> {
    let grid = finer_grid(study.region.grid(), FINEST);
    let fill = study.settings.fill;
    let solid = study.subject.solid.quantise(&grid)?;
    let image = sampler.sample(&solid, Axis::X, Mode::Exact, fill)?;
    let sampled = Sampled { solid: &solid, inside: nodes(&image) };
    let found = match study.subject.roi {
        None => VolumeBounds::of(&sampled, &Within::Box(*solid.bounds())),
        Some(roi) => of_region(&sampled, roi, &grid, fill, sampler)?,
    };
    if !study.subject.solid.is_closed() {
        // The state along unclosed rays is unknown.
        return Ok(());
    }
    let put = |record: &mut Record, id, Interval { lower, upper }: Interval| {
        let value = record.value(id);
        if let Some(entry) = record.found(id) {
            entry.bounds(Some(lower), Some(upper));
            let slack = ROUNDED * upper;
            if value.is_some_and(|value| value < lower - slack || value > upper + slack) {
                entry.unresolved(
                    "the value from rays lies outside its bounds: the raster is too coarse; raise --resolution",
                );
            }
        }
    };
    put(record, id::VOLUME_SOLID, found.solid);
    put(record, id::VOLUME_TOTAL, found.region);
    let porosity = found.porosity();
    put(record, id::POROSITY, porosity);
    put(record, id::VOLUME_FRACTION, Interval { lower: 1.0 - porosity.upper, upper: 1.0 - porosity.lower });
    Ok(())
}

fn of_region(
    sampled: &Sampled,
    roi: &Solid,
    grid: &Grid,
    fill: FillRule,
    sampler: &dyn Sampler,
) -> Result<VolumeBounds, Error> {
    let roi = roi.quantise(grid)?;
    let image = sampler.sample(&roi, Axis::X, Mode::Exact, fill)?;
    Ok(VolumeBounds::of(sampled, &Within::Solid(Sampled { solid: &roi, inside: nodes(&image) })))
}

fn nodes(image: &Ldi) -> NodePlanes<'_> {
    NodePlanes::new([image], Mode::Exact).expect("one image is a view of its own grid")
}

/// Bounds the largest balls that span the axes: between the cubes of the outer solid, and of the inner one.
fn percolation(study: &Study, outer_and_inner: [Balls; 2], record: &mut Record) {
    // The diameters along x, y and z, in pitches.
    let found = outer_and_inner.map(|balls| match balls.percolation_between_cubes(study) {
        Some(spans) => spans.map(|span| span.map(|span| span.diameter)),
        None => [None; 3],
    });
    let pitch = study.region.grid().pitch();
    let diameter = |span: Option<f64>| span.map(|diameter| diameter * pitch);
    // Centres of balls at a wall of the region are at nodes, up to half a pitch from their true place.
    let [lower, upper] = found;
    let lower = lower.map(|span| span.map(|diameter| (diameter - 1.0).max(0.0)));
    let upper = upper.map(|span| span.map(|diameter| diameter + 1.0));
    for (axis, id) in id::PERCOLATION_ALONG.all().into_iter().enumerate() {
        if let Some(entry) = record.found(id) {
            // The lower bound is 0 if the outer solid leaves no path.
            entry.bounds(Some(diameter(lower[axis]).unwrap_or(0.0)), diameter(upper[axis]));
        }
    }
    let least = |spans: [Option<f64>; 3]| diameter(spans.into_iter().try_fold(f64::INFINITY, |a, b| Some(a.min(b?))));
    if let Some(entry) = record.found(id::PERCOLATION) {
        entry.bounds(Some(least(lower).unwrap_or(0.0)), least(upper));
    }
}

/// Bounds the thinnest wall by the 1st percentiles of the thickness of the inner and of the outer solid, and a pitch more
/// either way. Where the inner one has lost more than 1 % of the solid altogether, the lower bound is 0.
fn thinnest(study: &Study, outer: &Balls, inner: &Balls, record: &mut Record) {
    let Some(value) = record.value(id::WALL_THINNEST) else { return };
    let edges = study.settings.edges;
    let pitch = study.region.grid().pitch();
    let p1 = |balls: &Balls| {
        let (map, _) = balls.uncut(balls.thickness(Phase::Solid), edges);
        let thickness = Distribution::of_map(&map, pitch)?;
        Some(thickness.quantile(0.01)).filter(|thickness| thickness.is_finite())
    };
    let solid = Phase::Solid.nodes(&study.solid, study.region.nodes());
    // Parts of the solid without a node are lost, too.
    let lost = outer.nodes(Phase::Solid).minus(&inner.nodes(Phase::Solid).grown(RIND)).count() as f64;
    let lower = if lost / solid.count() as f64 > 0.01 { None } else { p1(inner) };
    let upper = p1(outer);
    if let Some(entry) = record.found(id::WALL_THINNEST) {
        // The thinnest 1 % are different nodes in each solid, and their thickness is known to a pitch.
        let least = lower.map_or(0.0, |lower| (lower.min(value) - pitch).max(0.0));
        entry.bounds(Some(least), upper.map(|upper| upper.max(value) + pitch));
        if lower.is_none() {
            entry.unresolved("more than 1 % of the solid is thinner than the raster resolves; raise --resolution");
        }
    }
}

/// Greatest depth of the inner solid below the surface, in nodes: a cube that the surface meets, and its diagonal.
const RIND: usize = 3;
