//! Metrics from inscribed balls: thickness, pore widths, access from outside, percolation.

use crate::parallel::*;
use glam::DVec3;

use super::Study;
use super::growth::Growth;
use super::plots::{self, Plot};
use super::record::Record;
use super::slices::{SliceMaker, position};
use crate::grid::Axis;
use crate::metrics::access::{self, Ends, access_sizes, bottlenecks, percolation, percolation_between_walls};
use crate::metrics::components::{open_pores, rim};
use crate::metrics::distance::{Crossings, DistanceField};
use crate::metrics::thickness::{Ball, largest_balls, largest_balls_between, radii, thickness_of};
use crate::metrics::{BoundaryCondition, Distribution, NodeSet, Phase};
use crate::number::number;
use crate::report::id::{self, ByStatistic, Statistic};
use crate::report::scaffold_report::{AccessCurve, HistogramPlot};

/// Number of points in the access curve.
const POINTS: usize = 128;

/// Lengths below this many pitches are not resolved.
const RESOLVED: f64 = 3.0;

const TOO_COARSE: &str = "shorter than 3 pitches: the raster is too coarse; raise --resolution";
const NO_PORES: &str = "the region contains no pores";
const NO_SOLID: &str = "the region contains no solid";
const NO_SURFACE: &str = "the region contains no surface for a ball to touch";

/// Returns the boundary condition for balls that come from outside: the faces of the region are not walls.
pub fn from_outside(edges: BoundaryCondition) -> BoundaryCondition {
    match edges {
        BoundaryCondition::Periodic => BoundaryCondition::Periodic,
        BoundaryCondition::Clip | BoundaryCondition::Border => BoundaryCondition::Clip,
    }
}

/// The largest balls of both phases: those that may reach beyond the region, and those of its boundary condition.
pub struct Balls {
    /// The nodes of the solid and of the pores.
    phases: [NodeSet; 2],
    pub free: Inscribed,
    /// `Some` if the boundary condition differs from that of free balls, or the solid does.
    within: Option<Inscribed>,
}

/// The largest balls of each phase, and the distances of all nodes.
pub struct Inscribed {
    distances: Vec<f32>,
    balls: [Vec<Ball>; 2],
    edges: BoundaryCondition,
}

impl Inscribed {
    fn of(crossings: &Crossings, edges: BoundaryCondition, phases: &[NodeSet; 2]) -> (Inscribed, DistanceField) {
        let field = DistanceField::of(crossings, edges);
        let balls = phases.each_ref().map(|nodes| largest_balls(&field, nodes));
        // All threads write the copy, because the first touch of new memory is slow.
        let distances = field.values().par_iter().with_min_len(1 << 16).copied().collect();
        (Inscribed { distances, balls, edges }, field)
    }

    /// Adds walls to the field that the balls were found in.
    fn between(&self, walls: [[f32; 3]; 2], field: DistanceField, phases: &[NodeSet; 2]) -> Inscribed {
        let field = field.between(walls);
        let balls = [0, 1].map(|phase| largest_balls_between(&field, &phases[phase], &self.balls[phase]));
        Inscribed { balls, edges: field.edges(), distances: field.into_values() }
    }

    /// Returns the balls of the pores, with radii in place of the distances; `None` if no surface limits them.
    fn into_rooms(self, pores: &NodeSet) -> Option<Rooms> {
        let Inscribed { distances, balls: [_, balls], .. } = self;
        let is_held = !balls.is_empty() && balls.iter().all(|ball| ball.radius.is_finite());
        is_held.then(|| Rooms { radii: radii(distances, pores, &balls), balls })
    }
}

/// The largest balls of the pores, and for each node the radius of the largest one that is centred in its cell.
struct Rooms {
    radii: Vec<f32>,
    balls: Vec<Ball>,
}

impl Balls {
    /// Finds the balls of a study.
    pub fn of(study: &Study) -> Balls {
        let phases = Phase::BOTH.map(|phase| phase.nodes(&study.solid, study.region.nodes()));
        let edges = study.settings.edges;
        let crossings = |edges| Crossings::of_images(&study.images.solid, study.region, edges);
        let free = crossings(from_outside(edges));
        let walls = study.region.walls();
        Balls::found(edges, phases, &free, walls, || (edges == BoundaryCondition::Border).then(|| crossings(edges)))
    }

    /// Finds the balls between the cubes of another solid, which may lie in a region in part: of its part there, and of pores.
    pub fn between_cubes(study: &Study, solid: &NodeSet, region: &NodeSet, pores: NodeSet) -> Balls {
        let inside = solid.and(region);
        let edges = study.settings.edges;
        let is_whole = inside == *solid;
        let of_inside = || {
            let differs = edges == BoundaryCondition::Border || !is_whole;
            differs.then(|| Crossings::of_nodes(&inside, edges))
        };
        let free = Crossings::of_nodes(solid, from_outside(edges));
        Balls::found(edges, [inside.clone(), pores], &free, is_whole.then(|| solid.walls()), of_inside)
    }

    /// Finds the balls between free crossings and, where there are others, between those. Walls need no other crossings.
    fn found(
        edges: BoundaryCondition,
        phases: [NodeSet; 2],
        free: &Crossings,
        walls: Option<[[f32; 3]; 2]>,
        others: impl FnOnce() -> Option<Crossings>,
    ) -> Balls {
        let (free, field) = Inscribed::of(free, from_outside(edges), &phases);
        let within = match walls.filter(|_| edges == BoundaryCondition::Border) {
            Some(walls) => Some(free.between(walls, field, &phases)),
            None => {
                drop(field);
                others().map(|crossings| Inscribed::of(&crossings, edges, &phases).0)
            }
        };
        Balls { phases, free, within }
    }

    /// Returns the nodes of a phase.
    pub fn nodes(&self, phase: Phase) -> &NodeSet {
        &self.phases[phase as usize]
    }

    /// Returns the local thickness of a phase under the boundary condition of the region, in pitches.
    pub fn thickness(&self, phase: Phase) -> Vec<f32> {
        self.thickness_by(self.within.as_ref().unwrap_or(&self.free), phase)
    }

    fn thickness_by(&self, Inscribed { distances, balls, edges }: &Inscribed, phase: Phase) -> Vec<f32> {
        thickness_of(&balls[phase as usize], distances, self.nodes(phase), *edges)
    }

    /// Returns the local thickness of the solid with 0 at nodes that are thinner only because the region ends there, and its
    /// thickness with balls that may reach beyond the region; that one only if the boundary condition does not allow it anyway
    /// and a surface limits the balls. `map` is the [`thickness`](Balls::thickness).
    pub fn uncut(&self, mut map: Vec<f32>, edges: BoundaryCondition) -> (Vec<f32>, Option<Vec<f32>>) {
        let free = (edges == BoundaryCondition::Border)
            .then(|| self.thickness_by(&self.free, Phase::Solid))
            .filter(|free| free.par_iter().with_min_len(1 << 14).all(|thickness| thickness.is_finite()));
        if let Some(free) = &free {
            leave_out_cuts(&mut map, free);
        }
        (map, free)
    }

    /// Returns the diameters of the largest balls that span the axes, in pitches, and their bottleneck nodes; `None` if no
    /// surface limits the balls of the pores.
    ///
    /// The ends are open. With [`BoundaryCondition::Border`] the other faces of a box are walls; a region that is not a box has
    /// no other faces, and only the solid limits the balls.
    pub fn percolation(self, study: &Study) -> Option<[Option<access::Percolation>; 3]> {
        let Balls { phases: [_, pores], free, within } = self;
        let free = free.into_rooms(&pores)?;
        let within = within.and_then(|within| within.into_rooms(&pores));
        Some(spans(study, &pores, &free, within.as_ref()))
    }

    /// Returns the diameters of the same balls where the walls count as they do between cubes: at nodes.
    pub fn percolation_between_cubes(self, study: &Study) -> Option<[Option<access::Percolation>; 3]> {
        Balls { within: None, ..self }.percolation(study)
    }
}

/// Returns the largest balls that span the axes, from free balls and those within the region.
fn spans(study: &Study, pores: &NodeSet, free: &Rooms, within: Option<&Rooms>) -> [Option<access::Percolation>; 3] {
    let along = |axis: Axis| {
        let ends = Ends::of_region(study.region, axis)?;
        match (within.filter(|_| study.region.is_box()), study.settings.edges) {
            (Some(within), BoundaryCondition::Border) => {
                let bounds = study.region.bounds_in_pitches();
                percolation_between_walls(&free.radii, &within.radii, pores, &ends, bounds)
            }
            (_, BoundaryCondition::Border) if !study.region.is_box() => {
                percolation(&free.radii, pores, &ends, BoundaryCondition::Clip)
            }
            (_, edges) => percolation(&free.radii, pores, &ends, edges),
        }
    };
    let (x, (y, z)) = join(|| along(Axis::X), || join(|| along(Axis::Y), || along(Axis::Z)));
    [x, y, z]
}

/// Records the access from outside; returns the curve and the distribution of sizes.
pub fn access(study: &Study, found: Balls, record: &mut Record) -> (Option<AccessCurve>, Option<HistogramPlot>) {
    let Balls { phases: [_, pores], free, within } = found;
    let free = match pores.is_empty() {
        true => Err(NO_PORES),
        false => free.into_rooms(&pores).ok_or(NO_SURFACE),
    };
    let free = match free {
        Ok(free) => free,
        Err(why) => {
            lacks_access(record, why);
            return (None, None);
        }
    };
    let within = within.and_then(|within| within.into_rooms(&pores));
    let spans = spans(study, &pores, &free, within.as_ref());
    put_percolation(study, spans, record);
    let Rooms { radii, balls } = free;
    // Balls enter through the faces; if they must lie within the region, only balls within it cover pores.
    let balls = within.map_or(balls, |within| within.balls);
    let edges = from_outside(study.settings.edges);
    let reached = bottlenecks(&radii, &pores, &rim(study.region.nodes()), edges);
    drop(radii);
    let open = open_pores(&pores, study.region.nodes(), study.settings.edges);
    put_open(study, &pores, &open, record);
    let map = access_sizes(&balls, &reached, &open, edges);
    drop(reached);
    let pitch = study.region.grid().pitch();
    let curve = access::AccessCurve::of(&map, &open, &pores, pitch).map(|curve| {
        let half = curve.points().filter(|&(_, share)| share >= 0.5).map(|(diameter, _)| diameter).last();
        record.put_or(id::ACCESS_HALF, half, "less than half of the pore volume is open");
        let every = curve.points().count().div_ceil(POINTS).max(1);
        AccessCurve {
            points: curve.points().step_by(every).map(|(diameter, share)| [diameter, share]).collect(),
            percolation: spans.map(|span| span.map(|span| span.diameter * pitch)),
        }
    });
    let plot = Plot {
        id: "pore.access",
        title: "Access-limited pore size",
        reading: "The largest ball that gets to each place from outside, as mercury would in porosimetry. Much of it far left of \
                  the pore widths means that wide pores lie behind narrow throats.",
    };
    let histogram = Distribution::of_map(&map, pitch).map(|sizes| {
        put_spread(id::PORE_ACCESS, &sizes, pitch, record);
        plots::histogram(plot, Phase::Pore, &sizes, study.subject.solid.unit)
    });
    if histogram.is_none() {
        lacks_spread(id::PORE_ACCESS, "no pore is open", record);
    }
    (curve, histogram)
}

/// Records that the access from outside is missing, and the reason.
fn lacks_access(record: &mut Record, why: &str) {
    for id in [id::PERCOLATION, id::ACCESS_HALF].into_iter().chain(id::PERCOLATION_ALONG.all()) {
        record.lacks(id, why);
    }
    lacks_spread(id::PORE_ACCESS, why, record);
    // Without a surface, no pore is closed.
    record.put(id::POROSITY_OPEN, if why == NO_PORES { 0.0 } else { 1.0 });
    record.put(id::POROSITY_CLOSED, 0.0);
}

fn put_percolation(study: &Study, spans: [Option<access::Percolation>; 3], record: &mut Record) {
    let grid = study.region.grid();
    let edges = study.settings.edges;
    let mut closed = Vec::new();
    for (axis, span) in Axis::ALL.into_iter().zip(spans) {
        let none = "no path through the pores leads from face to face";
        let entry =
            record.put_or(id::PERCOLATION_ALONG.along(axis), span.map(|span| span.diameter * grid.pitch()), none);
        entry.with("edges", edges.name());
        match span {
            Some(span) => {
                let place = Axis::ALL.map(|axis| number(position(grid, axis, span.node[axis.depth()])));
                entry.with("narrowest at", place.join(", "));
                if span.diameter < RESOLVED {
                    entry.unresolved(
                        "narrower than 3 pitches: a wall thinner than a pitch could close the path; raise --resolution",
                    );
                }
            }
            None => closed.push(axis.name()),
        }
    }
    let least = spans.iter().flatten().map(|span| span.diameter).fold(f64::INFINITY, f64::min);
    let all = closed.is_empty().then_some(least * grid.pitch());
    let why = format!("no path through the pores spans {}", closed.join(" and "));
    record.put_or(id::PERCOLATION, all, &why).with("edges", edges.name());
}

/// Records the shares of the region that are open and closed pores.
fn put_open(study: &Study, pores: &NodeSet, open: &NodeSet, record: &mut Record) {
    let porosity = record.value(id::POROSITY).unwrap_or(f64::NAN);
    let share = open.count() as f64 / pores.count() as f64;
    let nodes = study.region.nodes().count() as f64;
    let closed = (pores.count() - open.count()) as f64;
    // The porosity comes from rays, which are more accurate than nodes; the nodes give its open part.
    record.put(id::POROSITY_OPEN, porosity * share).with("nodes", open.count());
    record.put(id::POROSITY_CLOSED, porosity * (1.0 - share)).with("nodes", closed);
    debug_assert!(closed <= nodes);
}

/// Records thickness and pore widths, colours the slices with them, follows their means through the region, and returns their
/// distributions.
pub fn thickness(
    study: &Study,
    found: &Balls,
    slices: &mut [SliceMaker],
    growth: &mut Growth,
    record: &mut Record,
) -> Vec<HistogramPlot> {
    let edges = study.settings.edges;
    let pitch = study.region.grid().pitch();
    let mut plots = Vec::new();
    let mut walls = None;
    for phase in Phase::BOTH {
        let nodes = found.nodes(phase);
        if phase == Phase::Solid
            && nodes.is_empty()
            && record.value(id::VOLUME_SOLID).is_some_and(|volume| volume > 0.0)
        {
            lost_between_rays(record);
            continue;
        }
        let (spread, plot, nothing) = match phase {
            Phase::Solid => (id::SOLID_THICKNESS, THICKNESS, NO_SOLID),
            Phase::Pore => (id::PORE_THICKNESS, WIDTH, NO_PORES),
        };
        let map = match nodes.is_empty() {
            true => Err(nothing),
            false => Ok(found.thickness(phase)),
        };
        let values = map.as_ref().ok().and_then(|map| Distribution::of_map(map, pitch));
        let (map, values) = match (map, values) {
            (Ok(map), Some(values)) if values.max().is_finite() => (map, values),
            (map, _) => {
                lacks_spread(spread, map.err().unwrap_or(NO_SURFACE), record);
                continue;
            }
        };
        put_spread(spread, &values, pitch, record);
        if phase == Phase::Pore {
            slices.iter_mut().for_each(|slice| slice.fill(phase, &map, nodes.size()));
        }
        growth.take(phase, &map, nodes, pitch);
        plots.push(plots::histogram(plot, phase, &values, study.subject.solid.unit));
        if phase == Phase::Solid {
            walls = Some(map);
        }
    }
    if let Some(map) = walls {
        let nodes = found.nodes(Phase::Solid);
        let (counted, free) = found.uncut(map, edges);
        let values = Distribution::of_map(&counted, 1.0).expect("some nodes always count");
        let most = values.quantile(0.99) as f32;
        // In a picture, nodes at a cut by the region appear neither thin nor thicker than the rest.
        let shown = free.map(|mut shown| {
            let nodes = shown.par_iter_mut().zip(&counted).with_min_len(1 << 14);
            nodes.for_each(|(free, &counted)| *free = if counted > 0.0 { counted } else { free.min(most) });
            shown
        });
        let shown = shown.as_ref().unwrap_or(&counted);
        slices.iter_mut().for_each(|slice| slice.fill(Phase::Solid, shown, nodes.size()));
        put_thinnest(study, &counted, values.quantile(0.01) * pitch, nodes, record);
    }
    let largest = record.value(id::PORE_THICKNESS.of(Statistic::Max));
    let entry = record.put_or(id::PORE_LARGEST, largest, NO_PORES);
    entry.with("edges", edges.name());
    if largest.is_some_and(|largest| largest < RESOLVED * pitch) {
        entry.unresolved(TOO_COARSE);
    }
    let [wall, pore] = [id::SOLID_THICKNESS, id::PORE_THICKNESS].map(|family| family.of(Statistic::Mean));
    let means = record.value(wall).zip(record.value(pore));
    let why = "the region lacks walls or pores";
    let entry = record.put_or(id::NUMBER, means.map(|(wall, pore)| 1.0 / (wall + pore)), why);
    if means.is_some_and(|(wall, pore)| wall.min(pore) < RESOLVED * pitch) {
        entry.unresolved(TOO_COARSE);
    }
    if record.value(wall).is_none() && !record.is_unresolved(wall) {
        record.lacks(id::WALL_THINNEST, NO_SOLID);
    }
    plots
}

const THICKNESS: Plot = Plot {
    id: "solid.thickness",
    title: "Thickness of the solid",
    reading: "How much of the solid is how thick. A narrow peak is one wall or strut thickness throughout; a tail to the left \
              is thin spots that may not print, a second peak to the right nodes where struts meet.",
};

const WIDTH: Plot = Plot {
    id: "pore.thickness",
    title: "Width of the pores",
    reading: "How much of the pores is how wide, whether or not anything gets there. Compare with the access-limited size: what \
              is wide here and narrow there lies behind throats.",
};

/// Marks the metrics of a solid that has volume but no node as unresolved.
fn lost_between_rays(record: &mut Record) {
    for id in id::SOLID_THICKNESS.all().into_iter().chain([id::WALL_THINNEST]) {
        record.unresolved(
            id,
            "no node of the raster lies in the solid, which is thinner than a pitch; raise --resolution",
        );
    }
}

/// Largest difference between two maps, in pitches, that painting alone can cause.
const REPAINTED: f32 = 0.5;

/// Puts 0 at nodes of a map of thickness that are thinner only because the region ends there; nowhere if that applies to all nodes.
fn leave_out_cuts(map: &mut [f32], free: &[f32]) {
    let is_cut = |within: f32, free: f32| free > within + REPAINTED;
    if map.par_iter().zip(free).with_min_len(1 << 14).any(|(&within, &free)| within > 0.0 && !is_cut(within, free)) {
        let nodes = map.par_iter_mut().zip(free).with_min_len(1 << 14);
        nodes.filter(|(within, free)| is_cut(**within, **free)).for_each(|(within, _)| *within = 0.0);
    }
}

/// Records the thinnest wall and a place of that thickness, from the nodes that count.
fn put_thinnest(study: &Study, map: &[f32], thinnest: f64, nodes: &NodeSet, record: &mut Record) {
    let grid = study.region.grid();
    let [columns, rows, _] = study.solid.size();
    let wanted = (thinnest / grid.pitch()) as f32;
    let some = map.par_iter().enumerate().with_min_len(1 << 14).filter(|&(_, &value)| value > 0.0);
    let miss = |value: f32| (value - wanted).abs();
    // The first of several that are as near.
    let nearest = some.min_by(|a, b| miss(*a.1).total_cmp(&miss(*b.1)).then(a.0.cmp(&b.0)));
    let entry = record.put(id::WALL_THINNEST, thinnest);
    if let Some((index, _)) = nearest {
        let node = [index % columns, index / columns % rows, index / (columns * rows)];
        let place = DVec3::from_array(Axis::ALL.map(|axis| position(grid, axis, node[axis.depth()])));
        entry.with("for example at", place.to_array().map(number).join(", "));
    }
    let counted = map.par_iter().with_min_len(1 << 14).filter(|&&thickness| thickness > 0.0).count();
    let left_out = 1.0 - counted as f64 / nodes.count() as f64;
    entry.with("left out, cut by the region", format!("{} %", number((1000.0 * left_out).round() / 10.0)));
    if thinnest < RESOLVED * grid.pitch() {
        let pitches = number((100.0 * thinnest / grid.pitch()).round() / 100.0);
        entry.unresolved(format!("{pitches} pitches, and walls below 3 are not resolved; raise --resolution"));
    }
}

/// Records the statistics of a distribution.
fn put_spread(spread: ByStatistic, values: &Distribution, pitch: f64, record: &mut Record) {
    for (statistic, length) in [
        (Statistic::Mean, values.mean()),
        (Statistic::Min, values.min()),
        (Statistic::P1, values.quantile(0.01)),
        (Statistic::P5, values.quantile(0.05)),
        (Statistic::P50, values.quantile(0.5)),
        (Statistic::P95, values.quantile(0.95)),
        (Statistic::Max, values.max()),
    ] {
        let entry = record.put(spread.of(statistic), length);
        if length < RESOLVED * pitch {
            entry.unresolved(TOO_COARSE);
        }
    }
    let entry = record.put(spread.of(Statistic::StandardDeviation), values.deviation());
    if values.mean() < RESOLVED * pitch {
        entry.unresolved(TOO_COARSE);
    }
}

/// Records that the statistics of a distribution are missing, and the reason.
fn lacks_spread(spread: ByStatistic, why: &str, record: &mut Record) {
    for id in spread.all() {
        record.lacks(id, why);
    }
}
