//! Reports for tests: one with everything, one with hardly anything. Their numbers are invented, near those of a gyroid.

use std::path::Path;

use super::id::{self, Group, Statistic};
use super::limits::Limits;
use super::measure::record::Record;
use super::quantity::Quantity;
use super::scaffold_report::*;
use crate::grid::Axis;
use crate::mesh::LengthUnit;

const MM: Option<LengthUnit> = Some(LengthUnit::Millimetre);
/// A title that every writer must escape.
pub const AWKWARD: &str = "a&b <script>alert(\"1\")</script> 'quoted', with a name so long that it has to be broken somewhere_or_other_however_few_spaces_it_has.stl";

/// Returns invented values of some metrics, with errors, bounds and parameters; one metric has a warning, one no value.
fn metrics() -> Vec<Metric> {
    let mean = Statistic::Mean;
    let mut record = Record::default();
    for (id, value) in [
        (id::VOLUME_TOTAL, 1000.0),
        (id::VOLUME_SOLID, 301.27),
        (id::POROSITY, 0.698_73),
        (id::POROSITY_OPEN, 0.698_7),
        (id::POROSITY_CLOSED, 0.0),
        (id::SURFACE_AREA, 3_091.7),
        (id::SURFACE_SPECIFIC, 10.262),
        (id::SURFACE_DENSITY, 3.0917),
        (id::PERCOLATION, 0.415),
        (id::PORE_LARGEST, 0.459),
        (id::SOLID_THICKNESS.of(mean), 0.2134),
        (id::PORE_THICKNESS.of(mean), 0.4377),
        (id::NUMBER, 1.536),
        (id::WALL_THINNEST, 0.171),
        (id::CHORD_SOLID.along(Axis::X), 0.62),
        (id::ANISOTROPY, 0.2143),
        (id::EULER, -4001.0),
        (id::BETTI_0, 1.0),
        (id::BETTI_1, 4002.0),
        (id::BETTI_2, 0.0),
        (id::CONNECTIVITY, 4.002),
        (id::PERMEABILITY, 7.13e-6),
        (id::CENTROID_SOLID.along(Axis::X), -4.998),
        (id::OVERHANG, 0.1464),
    ] {
        let entry = record.put(id, value).with("pitch", "0.039 mm");
        if id.group != Group::Topology {
            entry.error(value.abs() * 0.004);
        }
        match id {
            id::VOLUME_SOLID | id::POROSITY | id::PERCOLATION | id::WALL_THINNEST => {
                entry.bounds(Some(value * 0.98), Some(value * 1.02))
            }
            id::PERMEABILITY => entry.with("K", "5"),
            id::OVERHANG => entry.with("angle from the horizontal, degrees", "45"),
            _ if id == id::CHORD_SOLID.along(Axis::X) => entry.warn("7.2 % of the chords end at the region's faces"),
            _ => entry,
        };
    }
    record.lacks(id::TORTUOSITY_PORE_DIFFUSIVE.along(Axis::Z), "no pore leads through");
    let mut metrics = record.into_metrics(MM);
    for metric in &mut metrics {
        metric.definition = "A line that says enough to tell the metric from its neighbours & is <not> markup.";
    }
    metrics
}

/// Returns a report with every kind of content.
pub fn rich() -> ScaffoldReport {
    let metrics = metrics();
    ScaffoldReport {
        schema: SCHEMA,
        title: "gyroid-10mm.stl".to_owned(),
        unit: MM,
        verdict: Some(verdict(&metrics)),
        alerts: alerts(),
        metrics,
        histograms: (0..4).map(histogram).collect(),
        access: Some(access()),
        profiles: ["x", "y", "z"].into_iter().map(profile).collect(),
        anisotropy: Some(Anisotropy {
            degree: 0.2143,
            lengths: [0.712, 0.655, 0.631],
            directions: [[0.0, 0.6, 0.8], [1.0, 0.0, 0.0], [0.0, 0.8, -0.6]],
        }),
        convergence: convergence(),
        provenance: provenance("models/gyroid-10mm.stl"),
        pictures: Pictures { view: Some(view()), slices: slices() },
    }
}

/// Returns the report of a block without unit and pores, for which few metrics have values.
pub fn poor() -> ScaffoldReport {
    let mut metrics = rich().metrics;
    for metric in &mut metrics {
        metric.unit = metric.unit.quantity.of(None);
        (metric.error, metric.lower, metric.upper) = (None, None, None);
        if !matches!(metric.group, Group::Volume | Group::Surface) {
            (metric.value, metric.status) = (None, Status::NotApplicable);
            metric.warnings = vec!["no pores <in> this & that solid".to_owned()];
        }
    }
    // Values that a writer must survive although measuring never produces them.
    metrics[0].value = Some(f64::NAN);
    metrics[1].lower = Some(f64::NEG_INFINITY);
    ScaffoldReport {
        schema: SCHEMA,
        title: AWKWARD.to_owned(),
        metrics,
        provenance: provenance(AWKWARD),
        ..ScaffoldReport::default()
    }
}

/// Returns a verdict with every outcome.
fn verdict(metrics: &[Metric]) -> Verdict {
    let limits = "porosity = { min = 0.6, max = 0.8 }\npercolation.min = 0.41\nwall.thinnest.min = 0.2\n\
                  tortuosity.pore.diffusive.z.max = 2.0";
    let limits = Limits::parse(Path::new("limits.toml"), limits).unwrap();
    limits.judge(metrics, MM).unwrap()
}

fn alerts() -> Vec<Alert> {
    vec![
        Alert {
            code: "censored-chords",
            severity: Severity::Note,
            message: "7.2 % of the chords along x end at the region's faces; their mean is too small.".to_owned(),
        },
        Alert {
            code: "unit-assumed",
            severity: Severity::Warning,
            message: "gyroid-10mm.stl has no unit; mm was given with --unit.".to_owned(),
        },
    ]
}

fn histogram(i: usize) -> HistogramPlot {
    let (id, title, phase) = [
        ("solid.thickness", "Thickness of the solid", "solid"),
        ("pore.thickness", "Width of the pores", "pore"),
        ("pore.access", "Access-limited pore size", "pore"),
        ("chord.pore", "Pore chords", "pore"),
    ][i];
    let (mean, deviation) = ([0.2134, 0.4377, 0.401, 0.71][i], [0.021, 0.031, 0.02, 0.35][i]);
    let range = [0.0, mean * 2.0];
    let bins = 64;
    let weight = |bin: usize| (-0.5 * (((bin as f64 + 0.5) / bins as f64 * range[1] - mean) / deviation).powi(2)).exp();
    let sum: f64 = (0..bins).map(weight).sum();
    HistogramPlot {
        id: id.to_owned(),
        title: title.to_owned(),
        unit: Quantity::Length(1).of(MM),
        phase,
        range,
        shares: (0..bins).map(|bin| weight(bin) / sum).collect(),
        mean,
        deviation,
        quantiles: [(0.01, -2.33), (0.05, -1.64), (0.5, 0.0), (0.95, 1.64)]
            .map(|(p, z)| (p, mean + z * deviation))
            .to_vec(),
        reading: "Shares of volume by the diameter of the largest ball that covers a point. One narrow peak is even struts; a \
            tail to the left is thin places, a second peak a second kind of wall.",
    }
}

fn access() -> AccessCurve {
    let points = (0..=60).map(|i| {
        let d = f64::from(i) * 0.0085;
        [d, 1.0 / (1.0 + ((d - 0.43) / 0.012).exp())]
    });
    AccessCurve { points: points.collect(), percolation: [Some(0.415), Some(0.415), Some(0.392)] }
}

fn profile(axis: &'static str) -> Profile {
    let positions: Vec<f64> = (0..128).map(|i| -5.0 + (f64::from(i) + 0.5) * 10.0 / 128.0).collect();
    let mut porosity: Vec<f64> = positions.iter().map(|x| 0.6987 + 0.03 * (x * 2.5).sin()).collect();
    porosity[40] = f64::NAN;
    Profile { axis, positions, porosity }
}

fn convergence() -> Vec<Convergence> {
    let series =
        |metric, values: [f64; 3], order| ConvergenceSeries { metric, values: values.map(Some).to_vec(), order };
    vec![
        Convergence {
            over: Varied::Pitch,
            at: vec![0.156, 0.078, 0.039],
            series: vec![
                series(id::POROSITY, [0.702, 0.6994, 0.6987], Some(1.93)),
                series(id::PERCOLATION, [0.405, 0.411, 0.415], Some(0.58)),
                series(id::SOLID_THICKNESS.of(Statistic::Mean), [0.205, 0.211, 0.2134], Some(1.32)),
                ConvergenceSeries {
                    metric: id::PORE_THICKNESS.of(Statistic::Mean),
                    values: vec![None, Some(0.435), Some(0.4377)],
                    order: None,
                },
            ],
        },
        Convergence {
            over: Varied::Region,
            at: vec![0.5, 0.75, 1.0],
            series: vec![series(id::POROSITY, [0.71, 0.697, 0.6987], None)],
        },
    ]
}

fn provenance(path: &str) -> Provenance {
    Provenance {
        inputs: vec![InputFile {
            role: "solid",
            path: path.to_owned(),
            sha256: "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08".to_owned(),
            triangles: 912_344,
            closed: true,
            oriented: true,
            unit: None,
        }],
        command_line: format!("ldi-ops report '{path}' --unit mm --resolution 256 --limits limits.toml -o report"),
        version: env!("CARGO_PKG_VERSION"),
        made: "2026-01-02T03:04:05Z".to_owned(),
        device: "a processor with a name".to_owned(),
        threads: 8,
        rays: [256, 256, 256],
        pitch: 0.039,
        edges: "clip",
        region: "box".to_owned(),
        seconds: vec![("read", 0.31), ("sample", 0.92), ("distance", 0.55), ("thickness", 3.2), ("total", 131.0)],
        peak_memory_bytes: Some(812 << 20),
    }
}

/// Returns slices of a gyroid; the thickness is an invented smooth function.
fn slices() -> Vec<Slice> {
    let slice = |(across, along): (&'static str, [&'static str; 2])| {
        let size = [96, 72];
        let node = |i: usize| {
            let [u, v, w] = [(i % 96) as f64, (i / 96) as f64, 11.0].map(|at| at * 0.2);
            let gyroid = u.sin() * v.cos() + v.sin() * w.cos() + w.sin() * u.cos();
            let width = (0.3 + 0.1 * (u + v).sin()) as f32;
            match (i % 96, gyroid > 0.4) {
                (0..4, _) => SliceNode::Outside,
                (_, true) => SliceNode::Solid(width),
                (_, false) => SliceNode::Pore(1.4 * width),
            }
        };
        Slice { across, position: 0.013, along, size, nodes: (0..96 * 72).map(node).collect(), pitch: 0.104 }
    };
    [("x", ["y", "z"]), ("y", ["x", "z"]), ("z", ["x", "y"])].into_iter().map(slice).collect()
}

/// Returns a picture as a PNG file.
fn view() -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, 64, 48);
    encoder.set_color(png::ColorType::Grayscale);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&(0..64 * 48).map(|i| (i % 64 * 3) as u8).collect::<Vec<_>>()).unwrap();
    writer.finish().unwrap();
    file
}
