//! Sheets for tests: one with everything, one with hardly anything. Their numbers are invented, near those of a gyroid.

use super::id;
use super::quantity::Quantity;
use super::scaffold_report::*;
use crate::mesh::LengthUnit;

const MM: Option<LengthUnit> = Some(LengthUnit::Millimetre);
/// A title that every writer must escape.
pub const AWKWARD: &str = "a&b <script>alert(\"1\")</script> 'quoted', with a name so long that it has to be broken somewhere_or_other_however_few_spaces_it_has.stl";

/// Returns a metric with a value, an error and bounds 2 % around it.
fn metric(
    id: &'static str,
    group: Group,
    symbol: &'static str,
    name: &'static str,
    quantity: Quantity,
    value: f64,
) -> Metric {
    Metric {
        id,
        group,
        symbol,
        name,
        definition: "What it is, in a line that says enough to tell it from its neighbours & is <not> markup.",
        value: Some(value),
        error: (group != Group::Topology).then_some(value.abs() * 0.004),
        lower: None,
        upper: None,
        unit: quantity.of(MM),
        method: "rays along x, y and z",
        parameters: vec![("pitch", "0.039 mm".to_owned())],
        reference: "Bouxsein et al. 2010, J. Bone Miner. Res. 25, 1468",
        status: Status::Measured,
        warnings: Vec::new(),
    }
}

fn bounded(mut metric: Metric) -> Metric {
    let value = metric.value.unwrap_or(0.0);
    (metric.lower, metric.upper) = (Some(value * 0.98), Some(value * 1.02));
    metric
}

fn missing(mut metric: Metric, why: &str) -> Metric {
    (metric.value, metric.error, metric.status) = (None, None, Status::NotApplicable);
    metric.warnings = vec![why.to_owned()];
    metric
}

/// Returns a metric with one more parameter.
fn with(mut metric: Metric, name: &'static str, value: &str) -> Metric {
    metric.parameters.push((name, value.to_owned()));
    metric
}

/// Returns a sheet with every kind of content.
pub fn rich() -> ScaffoldReport {
    use Group::*;
    use Quantity::*;
    let mut spread = metric("chords.solid.x.mean", Chords, "ℓ̄_s,x", "Mean chord of the solid along x", Length(1), 0.62);
    spread.warnings = vec!["7.2 % of the chords end at the region's faces".to_owned()];
    let metrics = vec![
        metric(id::TOTAL_VOLUME, Volume, "TV", "Volume of the region", Length(3), 1000.0),
        bounded(metric(id::SOLID_VOLUME, Volume, "BV", "Volume of the solid", Length(3), 301.27)),
        bounded(metric(id::POROSITY, Volume, "φ", "Porosity", Share, 0.698_73)),
        metric(id::OPEN_POROSITY, Volume, "φ_open", "Open porosity", Share, 0.698_7),
        metric(id::CLOSED_POROSITY, Volume, "φ_closed", "Closed porosity", Share, 0.0),
        metric(id::SURFACE, Surface, "BS", "Surface", Length(2), 3_091.7),
        metric(id::SURFACE_PER_SOLID, Surface, "BS/BV", "Specific surface", Length(-1), 10.262),
        metric(id::SURFACE_PER_TOTAL, Surface, "BS/TV", "Surface density", Length(-1), 3.0917),
        bounded(metric(id::PERCOLATION, Access, "d_perc", "Percolation diameter", Length(1), 0.415)),
        metric(id::LARGEST_PORE, Access, "d_max", "Largest pore", Length(1), 0.459),
        metric(id::THICKNESS, Thickness, "Tb.Th", "Mean thickness", Length(1), 0.2134),
        bounded(metric(id::THINNEST_WALL, Thickness, "τ₁", "Thinnest wall (1st percentile)", Length(1), 0.171)),
        metric(id::SEPARATION, Thickness, "Tb.Sp", "Mean separation", Length(1), 0.4377),
        metric(id::NUMBER, Thickness, "Tb.N", "Trabecular number", Length(-1), 1.536),
        spread,
        metric(id::ANISOTROPY, Anisotropy, "DA", "Degree of anisotropy", Number, 0.2143),
        metric("euler", Topology, "χ", "Euler characteristic", Number, -4001.0),
        metric("topology.solid.components", Topology, "β₀", "Pieces of the solid", Number, 1.0),
        metric("topology.tunnels", Topology, "β₁", "Tunnels", Number, 4002.0),
        metric("topology.cavities", Topology, "β₂", "Closed cavities", Number, 0.0),
        metric(id::CONNECTIVITY, Topology, "Conn.D", "Connectivity density", Length(-3), 4.002),
        missing(
            metric("tortuosity.diffusive.z", Transport, "τ_D,z", "Diffusive tortuosity along z", Number, 1.0),
            "no pore leads through",
        ),
        with(metric("permeability", Transport, "k", "Permeability (Kozeny–Carman)", Length(2), 7.13e-6), "K", "5"),
        metric("moments.centroid.x", Moments, "x̄", "Centroid, x", Length(1), -4.998),
        with(
            metric(id::OVERHANG, Manufacture, "–", "Overhanging surface", Share, 0.1464),
            "angle from the horizontal, degrees",
            "45",
        ),
    ];
    ScaffoldReport {
        schema: SCHEMA,
        title: "gyroid-10mm.stl".to_owned(),
        unit: MM,
        verdict: Some(verdict()),
        alerts: alerts(),
        metrics,
        histograms: ["solid.thickness", "pore.size.local", "pore.size.access", "chords.pore.x"]
            .iter()
            .enumerate()
            .map(|(i, id)| histogram(id, i))
            .collect(),
        access: Some(access()),
        profiles: ["x", "y", "z"].into_iter().map(profile).collect(),
        anisotropy: Some(super::scaffold_report::Anisotropy {
            degree: 0.2143,
            lengths: [0.712, 0.655, 0.631],
            directions: [[0.0, 0.6, 0.8], [1.0, 0.0, 0.0], [0.0, 0.8, -0.6]],
        }),
        convergence: convergence(),
        provenance: provenance("models/gyroid-10mm.stl"),
        pictures: Pictures { view: Some(view()), slices: slices() },
    }
}

/// Returns the sheet of a block without unit and pores, for which few metrics have values.
pub fn poor() -> ScaffoldReport {
    let mut block = rich();
    block.title = AWKWARD.to_owned();
    block.unit = None;
    block.verdict = None;
    block.alerts.clear();
    block.histograms.clear();
    (block.access, block.anisotropy) = (None, None);
    block.profiles.clear();
    block.convergence.clear();
    block.pictures = Pictures::default();
    block.provenance = provenance(AWKWARD);
    for metric in &mut block.metrics {
        metric.unit = metric.unit.quantity.of(None);
        (metric.lower, metric.upper) = (None, None);
        match metric.group {
            Group::Volume | Group::Surface => metric.error = None,
            _ => *metric = missing(metric.clone(), "no pores <in> this & that solid"),
        }
    }
    // Values that a writer must survive although measuring never produces them.
    block.metrics[0].value = Some(f64::NAN);
    block.metrics[1].lower = Some(f64::NEG_INFINITY);
    block
}

fn verdict() -> Verdict {
    let limit =
        |metric: &str, name: &str, [min, max]: [Option<f64>; 2], value, outcome, quantity: Quantity| LimitVerdict {
            metric: metric.to_owned(),
            name: name.to_owned(),
            min,
            max,
            value,
            lower: value.map(|value: f64| value * 0.98),
            upper: value.map(|value: f64| value * 1.02),
            unit: quantity.of(MM),
            outcome,
        };
    let length = Quantity::Length(1);
    Verdict {
        passed: false,
        limits: vec![
            limit(id::POROSITY, "Porosity", [Some(0.6), Some(0.8)], Some(0.6987), LimitOutcome::Kept, Quantity::Share),
            limit(
                id::PERCOLATION,
                "Percolation diameter",
                [Some(0.41), None],
                Some(0.415),
                LimitOutcome::KeptWithinBounds,
                length,
            ),
            limit(
                id::THINNEST_WALL,
                "Thinnest wall (1st percentile)",
                [Some(0.2), None],
                Some(0.171),
                LimitOutcome::Broken,
                length,
            ),
            limit(
                "tortuosity.diffusive.z",
                "Diffusive tortuosity along z",
                [None, Some(2.0)],
                None,
                LimitOutcome::NoValue,
                Quantity::Number,
            ),
        ],
    }
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

fn histogram(id: &str, i: usize) -> HistogramPlot {
    let (title, phase) = [
        ("Thickness of the solid", "solid"),
        ("Pore size, local thickness", "pore"),
        ("Pore size, access-limited", "pore"),
        ("Chords of the pores along x", "pore"),
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
                series(id::THICKNESS, [0.205, 0.211, 0.2134], Some(1.32)),
                ConvergenceSeries {
                    metric: id::SEPARATION,
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
