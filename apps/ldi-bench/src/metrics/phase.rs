//! Metrics of one phase of an array.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::time::Instant;

use ldi_ops::grid::Axis;
use ldi_ops::metrics::access::{Ends, access_sizes, bottlenecks, percolation};
use ldi_ops::metrics::chords::{Chords, Counted, Weighting};
use ldi_ops::metrics::components::{Components, Connectivity, open_pores, rim};
use ldi_ops::metrics::distance::{Crossings, DistanceField, distances};
use ldi_ops::metrics::euler::characteristic;
use ldi_ops::metrics::thickness::{largest_balls, local_thickness, radii};
use ldi_ops::metrics::tortuosity::{EndCondition, TortuosityError, diffusive, geodesic};
use ldi_ops::metrics::{BoundaryCondition, Distribution, NodeSet, Phase};
use serde_json::{Map, Value, json};

use super::array::Array;
use super::{Measure, Plan};
use crate::BenchError;
use crate::clock::median;

/// The relative error of a diffusivity at which it has converged.
const TOLERANCE: f64 = 1e-8;

/// The results, and the seconds of each.
struct Said {
    rounds: usize,
    values: Map<String, Value>,
    seconds: Map<String, Value>,
}

impl Said {
    fn add(&mut self, name: &str, value: Value) {
        self.values.insert(name.to_owned(), value);
    }

    /// Runs work once per round, and records the median time.
    fn timed<T>(&mut self, name: &str, work: impl Fn() -> T) -> T {
        let round = || {
            let start = Instant::now();
            let made = work();
            (made, start.elapsed().as_secs_f64())
        };
        let (mut made, first) = round();
        let mut seconds = vec![first];
        for _ in 1..self.rounds {
            drop(made);
            let (again, seconds_again) = round();
            made = again;
            seconds.push(seconds_again);
        }
        self.seconds.insert(name.to_owned(), json!(median(seconds)));
        made
    }
}

/// Measures a phase; maps are written to files that begin with `maps`, as f32, little-endian, x fastest.
pub fn measure(array: &Array, phase: Phase, plan: &Plan, maps: Option<&Path>) -> Result<Value, BenchError> {
    let region = array.region();
    let nodes = phase.nodes(&array.nodes, region.nodes());
    let mut said = Said { rounds: plan.rounds, values: Map::new(), seconds: Map::new() };
    let asked = |measure| plan.measures.contains(&measure);
    if asked(Measure::Topology) {
        topology(&mut said, &nodes, array);
    }
    if asked(Measure::Chords) {
        chords(&mut said, array, phase);
    }
    let crossings = || Crossings::of_nodes(&array.nodes, BoundaryCondition::Clip);
    if asked(Measure::Distance) {
        let values = said.timed("distance", || distances(&crossings(), BoundaryCondition::Clip));
        summarise(&mut said, "distance", &values, &nodes, maps)?;
    }
    let has_access = asked(Measure::Access) && phase == Phase::Pore;
    if asked(Measure::Thickness) || has_access {
        let field = said.timed("field", || DistanceField::of(&crossings(), BoundaryCondition::Clip));
        if asked(Measure::Thickness) {
            let thickness = said.timed("thickness", || local_thickness(&field, &nodes));
            summarise(&mut said, "thickness", &thickness, &nodes, maps)?;
        }
        if has_access {
            access(&mut said, array, &field, &nodes, maps)?;
        }
    }
    if asked(Measure::Diffusion) && phase == Phase::Pore {
        let find = |axis| diffusive(&nodes, axis, BoundaryCondition::Clip, EndCondition::Nodes, TOLERANCE, &|_| ());
        through(
            &mut said,
            "diffusion",
            &nodes,
            find,
            |found| json!({"formation": found.formation_factor, "tortuosity": found.tortuosity, "spanning": found.spanning_share}),
        )?;
    }
    if asked(Measure::Geodesic) && phase == Phase::Pore {
        let find = |axis| geodesic(&nodes, axis, BoundaryCondition::Clip);
        through(&mut said, "geodesic", &nodes, find, |tortuosity| json!(tortuosity))?;
    }
    said.values.insert("seconds".to_owned(), Value::Object(said.seconds));
    Ok(Value::Object(said.values))
}

fn topology(said: &mut Said, nodes: &NodeSet, array: &Array) {
    for (neighbours, connectivity) in [(6, Connectivity::Faces), (26, Connectivity::All)] {
        let name = format!("components{neighbours}");
        let pieces = said.timed(&name, || Components::of(nodes, connectivity, BoundaryCondition::Clip));
        let mut sizes = pieces.sizes().to_vec();
        sizes.sort_unstable_by(|a, b| b.cmp(a));
        said.add(&name, json!(sizes));
        let name = format!("euler{neighbours}");
        let euler = said.timed(&name, || characteristic(nodes, connectivity, BoundaryCondition::Clip));
        said.add(&name, json!(euler));
    }
    let open = said.timed("open", || open_pores(nodes, array.region().nodes(), BoundaryCondition::Clip).count());
    said.add("open", json!(open));
}

fn chords(said: &mut Said, array: &Array, phase: Phase) {
    let mut by_axis = Map::new();
    said.seconds.insert("images".to_owned(), json!(array.seconds));
    for (axis, image) in Axis::ALL.iter().zip(&array.images) {
        let chords = said.timed(&format!("chords-{}", axis.name()), || {
            Chords::along(image, &array.region(), phase, BoundaryCondition::Clip)
        });
        let counts = |counted| counts(chords.distribution(Weighting::Number, counted));
        let counts = json!({"all": counts(Counted::All), "complete": counts(Counted::Complete)});
        by_axis.insert(axis.name().to_owned(), counts);
    }
    said.add("chords", Value::Object(by_axis));
}

/// Counts chords by length, which in voxels is a whole number.
fn counts(lengths: Option<Distribution>) -> BTreeMap<u64, u64> {
    let Some(lengths) = lengths else { return BTreeMap::new() };
    let from = |length: f64| (lengths.share_from(length) * lengths.weight()).round() as u64;
    let all = (1..=lengths.max().round() as u64).map(|n| (n, from(n as f64 - 0.5) - from(n as f64 + 0.5)));
    all.filter(|&(_, count)| count > 0).collect()
}

fn access(
    said: &mut Said,
    array: &Array,
    field: &DistanceField,
    nodes: &NodeSet,
    maps: Option<&Path>,
) -> Result<(), BenchError> {
    let region = array.region();
    let (rooms, sizes) = said.timed("access", || {
        let balls = largest_balls(field, nodes);
        let rooms = radii(field.values().to_vec(), nodes, &balls);
        let gets_there = bottlenecks(&rooms, nodes, &rim(region.nodes()), BoundaryCondition::Clip);
        let open = open_pores(nodes, region.nodes(), BoundaryCondition::Clip);
        let sizes = access_sizes(&balls, &gets_there, &open, BoundaryCondition::Clip);
        (rooms, sizes)
    });
    summarise(said, "access", &sizes, nodes, maps)?;
    let mut spans = Map::new();
    for axis in Axis::ALL {
        let ends = Ends::of_raster(nodes.size(), axis);
        let found = said.timed(&format!("percolation-{}", axis.name()), || {
            percolation(&rooms, nodes, &ends, BoundaryCondition::Clip)
        });
        spans.insert(axis.name().to_owned(), json!(found.map(|found| found.diameter)));
    }
    said.add("percolation", Value::Object(spans));
    Ok(())
}

/// Records the result of `find` along each axis; null if there is no way through.
fn through<T>(
    said: &mut Said,
    name: &str,
    nodes: &NodeSet,
    find: impl Fn(Axis) -> Result<Option<T>, TortuosityError>,
    show: impl Fn(T) -> Value,
) -> Result<(), BenchError> {
    let mut by_axis = Map::new();
    for axis in Axis::ALL.into_iter().filter(|axis| nodes.size()[axis.depth()] > 1) {
        let found = said.timed(&format!("{name}-{}", axis.name()), || find(axis));
        let found = found.map_err(|error| BenchError::model(name, error))?;
        by_axis.insert(axis.name().to_owned(), found.map_or(Value::Null, &show));
    }
    said.add(name, Value::Object(by_axis));
    Ok(())
}

/// Records the distribution of the values of nodes, and writes those of all voxels, 0 elsewhere.
fn summarise(
    said: &mut Said,
    name: &str,
    values: &[f32],
    nodes: &NodeSet,
    maps: Option<&Path>,
) -> Result<(), BenchError> {
    let [width, height, _] = nodes.size();
    let is_in = |i: usize| nodes.contains([i % width, i / width % height, i / width / height]);
    let values: Vec<f32> = values.iter().enumerate().map(|(i, &value)| if is_in(i) { value } else { 0.0 }).collect();
    let summary = Distribution::of_map(&values, 1.0).map(|of| {
        let quantiles = [0.05, 0.25, 0.5, 0.75, 0.95].map(|share| of.quantile(share));
        json!({
            "mean": of.mean(), "deviation": of.deviation(), "min": of.min(), "max": of.max(), "quantiles": quantiles,
        })
    });
    said.add(name, json!(summary));
    if let Some(maps) = maps {
        let path = format!("{}.{name}.f32", maps.display());
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        fs::write(&path, bytes).map_err(BenchError::io(path))?;
    }
    Ok(())
}
