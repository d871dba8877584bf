//! What metrics are at least and at most: from the solid that certainly is there and the one that may be.
//!
//! The inner solid is all cubes of one pitch that lie in the solid, the outer one all that have part in it. Volumes are summed
//! on a finer raster, as there cubes are counted and nothing more. Percolation and thickness are found again on either, as
//! they grow or shrink with the solid: the pores of the outer solid let no larger ball pass than those of the solid itself.

use ldi_ops::grid::{Axis, Grid};
use ldi_ops::ldi::{Combine, Ldi, NodePlanes};
use ldi_ops::metrics::bounds::{Interval, Sampled, SolidBounds, VolumeBounds, Within, finer_grid};
use ldi_ops::metrics::distance::{Crossings, DistanceField};
use ldi_ops::metrics::thickness::local_thickness;
use ldi_ops::metrics::{Distribution, Edges, NodeSet, Phase};
use ldi_ops::sampler::{Fill, Mode, Sampler};
use rayon::prelude::*;

use super::Study;
use super::balls::{PoreBalls, from_outside};
use super::record::Record;
use crate::exit::Failure;
use crate::run::Solid;

/// Cubes along the longest side for volumes, at most.
const FINEST: u32 = 1024;

/// Bounds of volume, porosity, percolation and the thinnest wall, put beside their values.
pub fn measure(study: &Study, sampler: &dyn Sampler, record: &mut Record) -> Result<(), Failure> {
    volumes(study, sampler, record)?;
    let bounds = SolidBounds::of(&study.images.lattice, &study.solid, study.region);
    percolation(study, &bounds, record);
    thinnest(study, &bounds, record);
    Ok(())
}

fn volumes(study: &Study, sampler: &dyn Sampler, record: &mut Record) -> Result<(), Failure> {
    let grid = finer_grid(study.region.grid(), FINEST);
    let fill = study.settings.fill;
    let solid = study.subject.solid.quantise(&grid)?;
    let image = sampler.sample(&solid, Axis::X, Mode::Exact, fill)?;
    let sampled = Sampled { solid: &solid, inside: nodes(&image) };
    let total = study.region.volume();
    let found = match study.subject.roi {
        None => VolumeBounds::of(&sampled, &Within::Box(*solid.bounds())),
        Some(roi) => of_region(&sampled, roi, &grid, fill, sampler)?,
    };
    let put = |record: &mut Record, id, Interval { lower, upper }: Interval| {
        if let Some(entry) = record.found(id) {
            entry.bounds(Some(lower), Some(upper));
        }
    };
    put(record, "volume.solid", found.solid);
    put(record, "volume.total", found.region);
    let porosity = found.porosity();
    put(record, "porosity", porosity);
    put(record, "volume.fraction", Interval { lower: 1.0 - porosity.upper, upper: 1.0 - porosity.lower });
    debug_assert!(found.region.contains(total) || study.subject.roi.is_some() || total == 0.0);
    Ok(())
}

fn of_region(
    sampled: &Sampled,
    roi: &Solid,
    grid: &Grid,
    fill: Fill,
    sampler: &dyn Sampler,
) -> Result<VolumeBounds, Failure> {
    let roi = roi.quantise(grid)?;
    let image = sampler.sample(&roi, Axis::X, Mode::Exact, fill)?;
    Ok(VolumeBounds::of(sampled, &Within::Solid(Sampled { solid: &roi, inside: nodes(&image) })))
}

fn nodes(image: &Ldi) -> NodePlanes<'_> {
    NodePlanes::new([image], Combine::Most).expect("one image is a view of its own grid")
}

/// The largest balls that span the axes between the cubes of the outer solid, and of the inner one.
fn percolation(study: &Study, bounds: &SolidBounds, record: &mut Record) {
    let spans = [&bounds.outer, &bounds.inner].map(|solid| spans(study, solid));
    let pitch = study.region.grid().pitch();
    let diameter = |span: Option<f64>| span.map(|diameter| diameter * pitch);
    let [lower, upper] = spans;
    for (axis, id) in ["percolation.x", "percolation.y", "percolation.z"].into_iter().enumerate() {
        if let Some(entry) = record.found(id) {
            // Where the outer solid leaves no way the ball may be as small as one likes.
            entry.bounds(Some(diameter(lower[axis]).unwrap_or(0.0)), diameter(upper[axis]));
        }
    }
    let least = |spans: [Option<f64>; 3]| diameter(spans.into_iter().try_fold(f64::INFINITY, |a, b| Some(a.min(b?))));
    if let Some(entry) = record.found("percolation") {
        entry.bounds(Some(least(lower).unwrap_or(0.0)), least(upper));
    }
}

/// Diameters in pitches, along x, y and z.
fn spans(study: &Study, solid: &NodeSet) -> [Option<f64>; 3] {
    let region = study.region.nodes();
    let pores = region.minus(solid);
    let edges = study.settings.edges;
    let walls = match (study.region.is_box(), edges) {
        // Beyond a region that is no box there is nowhere to go.
        (false, Edges::Border) => solid.or(&NodeSet::full(solid.size()).minus(region)),
        _ => solid.clone(),
    };
    let free = from_outside(edges);
    let field = DistanceField::of(&Crossings::of_nodes(&walls, free), free);
    let found = PoreBalls::of(&field, &pores).map(|balls| balls.percolation(study, &pores));
    found.map_or([None; 3], |spans| spans.map(|span| span.map(|span| span.diameter)))
}

/// The thickness that 1 % of the solid falls below, in the inner and in the outer solid.
fn thinnest(study: &Study, bounds: &SolidBounds, record: &mut Record) {
    let solid = Phase::Solid.nodes(&study.solid, study.region.nodes());
    let edges = study.settings.edges;
    let thickness = |nodes: &NodeSet| {
        let field = DistanceField::of(&Crossings::of_nodes(nodes, edges), edges);
        local_thickness(&field, nodes)
    };
    let pitch = study.region.grid().pitch();
    let p1 = |map: &[f32]| Some(Distribution::of_map_at(map, &solid, pitch)?.quantile(0.01)).filter(|t| t.is_finite());
    if record.value("wall.thinnest").is_none() {
        return;
    }
    let inner = bounds.inner.and(study.region.nodes());
    let mut map = thickness(&inner);
    widen(&mut map, inner.size());
    let lower = p1(&map);
    drop(map);
    let upper = p1(&thickness(&bounds.outer.and(study.region.nodes())));
    if let Some(entry) = record.found("wall.thinnest") {
        entry.bounds(lower, upper);
    }
}

/// How far the inner solid ends within the solid, in pitches: a cube that the surface meets, and its diagonal.
const RIND: usize = 2;

/// Gives every node the largest value within [`RIND`] nodes along each axis: what of the solid lies next to a ball of the inner
/// one is as thick, and what lies next to none may be as thin as one likes.
fn widen(map: &mut Vec<f32>, size: [usize; 3]) {
    let [columns, rows, planes] = size;
    let (length, stride) = ([columns, rows, planes], [1, columns, columns * rows]);
    for axis in 0..3 {
        let from = std::mem::take(map);
        *map = vec![0.0; from.len()];
        map.par_chunks_mut(columns.max(1)).enumerate().for_each(|(row, into)| {
            for (x, into) in into.iter_mut().enumerate() {
                let at = row * columns + x;
                let place = at / stride[axis] % length[axis];
                let (low, high) = (place.min(RIND), (length[axis] - 1 - place).min(RIND));
                let near = (at - low * stride[axis]..=at + high * stride[axis]).step_by(stride[axis]);
                *into = near.map(|i| from[i]).fold(0.0, f32::max);
            }
        });
    }
}
