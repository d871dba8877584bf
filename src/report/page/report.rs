//! The page of one solid.

use askama::Template;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::plot::{convergence, curve, ellipsoid, histogram, profile};
use super::slices::{self, Shown};
use super::table::{self, GroupTable, KeyFigure, Row};
use super::verdict::Strip;
use super::{FOOT, STYLE, words};
use crate::report::id::Group;
use crate::report::quantity::{Quantity, Unit};
use crate::report::scaffold_report::{
    Alert, Anisotropy, Convergence, ConvergenceSeries, InputFile, Profile, Provenance, ScaffoldReport, Severity, Varied,
};

/// A plot with its title, its result and a guide to reading it.
pub struct Figure {
    pub title: String,
    pub drawing: String,
    pub finding: String,
    pub reading: &'static str,
}

#[derive(Template)]
#[template(path = "report.html", config = "src/report/askama.toml")]
struct Page<'s> {
    style: &'static str,
    foot: &'static str,
    title: &'s str,
    facts: Vec<String>,
    strip: Strip,
    alerts: Vec<AlertItem<'s>>,
    key_figures: Vec<KeyFigure>,
    groups: Vec<GroupTable>,
    view: Option<String>,
    slices: Vec<SliceRow>,
    distributions: Vec<Figure>,
    access: Option<Figure>,
    profiles: Vec<Figure>,
    anisotropy: Option<AnisotropyFigure>,
    topology: Vec<Row>,
    studies: Vec<Study>,
    provenance: &'s Provenance,
    facts_of_run: Vec<(&'static str, String)>,
    inputs: Vec<InputRow<'s>>,
    seconds: Vec<(&'static str, String)>,
}

struct AlertItem<'s> {
    class: &'static str,
    word: &'static str,
    alert: &'s Alert,
}

struct SliceRow {
    title: &'static str,
    reading: &'static str,
    colour_bar: String,
    colours: String,
    figures: Vec<(String, String)>,
}

struct AnisotropyFigure {
    bars: String,
    outlines: Option<String>,
    finding: String,
    directions: Vec<(&'static str, String, [String; 3])>,
}

struct Study {
    title: &'static str,
    reading: &'static str,
    drawing: Option<String>,
    caption: String,
    at: Vec<String>,
    rows: Vec<StudyRow>,
    orders: bool,
}

struct StudyRow {
    number: usize,
    class: usize,
    name: &'static str,
    unit: String,
    values: Vec<String>,
    change: String,
    order: String,
}

struct InputRow<'s> {
    role: &'static str,
    path: &'s str,
    sha256: &'s str,
    triangles: String,
    surface: &'static str,
    unit: &'static str,
}

/// Returns the page.
pub fn html(report: &ScaffoldReport) -> String {
    let length = Quantity::Length(1).of(report.unit);
    let page = Page {
        style: STYLE,
        foot: FOOT,
        title: &report.title,
        facts: facts(report, &length),
        strip: Strip::of(report.verdict.as_ref()),
        alerts: alerts(report),
        key_figures: table::key_figures(report),
        groups: table::groups(report),
        view: report.pictures.view.as_ref().map(|png| format!("data:image/png;base64,{}", STANDARD.encode(png))),
        slices: slice_rows(report, &length),
        distributions: distributions(report),
        access: report.access.as_ref().filter(|curve| curve.points.len() > 1).map(|access| Figure {
            title: "Interconnectivity A(d)".to_owned(),
            drawing: curve::access(access, &length),
            finding: curve::finding(access, &length),
            reading: "The share of the pore volume that a ball of diameter d reaches from the faces of the region; the marks \
                are the largest balls that pass from face to face. A curve that stays high until d comes near the pore size is \
                good: cells, nutrients and powder get everywhere. One that falls early has throats much narrower than its \
                pores; one that begins below 100 % has closed pores.",
        }),
        profiles: profiles(report, &length),
        anisotropy: report.anisotropy.as_ref().map(|of| anisotropy(of, &length)),
        topology: table::rows(report, Group::Topology),
        studies: report.convergence.iter().map(|of| study(report, of, &length)).collect(),
        provenance: &report.provenance,
        facts_of_run: facts_of_run(&report.provenance, &length),
        inputs: inputs(&report.provenance),
        seconds: report.provenance.seconds.iter().map(|&(stage, seconds)| (stage, words::seconds(seconds))).collect(),
    };
    super::rendered(&page)
}

fn facts(report: &ScaffoldReport, length: &Unit) -> Vec<String> {
    let Provenance { rays: [x, y, z], pitch, edges, region, made, .. } = &report.provenance;
    let unit = match report.unit {
        Some(_) => format!("lengths in {}", length.for_people()),
        None => "unit of length unknown".to_owned(),
    };
    let region = match region.as_str() {
        "box" => "box of the solid".to_owned(),
        "hull" => "convex hull of the solid".to_owned(),
        region => match region.strip_prefix("wrap:") {
            Some(diameter) => format!("solid wrapped by a ball of diameter {diameter}"),
            None => region.to_owned(),
        },
    };
    vec![
        format!("region: {region}"),
        format!("{x} × {y} × {z} rays"),
        format!("pitch {}", words::with_unit(*pitch, length)),
        format!("edges: {edges}"),
        unit,
        made.clone(),
    ]
}

fn alerts(report: &ScaffoldReport) -> Vec<AlertItem<'_>> {
    let mut alerts: Vec<_> = report
        .alerts
        .iter()
        .map(|alert| match alert.severity {
            Severity::Warning => AlertItem { class: "warning", word: "Warning", alert },
            Severity::Note => AlertItem { class: "note", word: "Note", alert },
        })
        .collect();
    alerts.sort_by_key(|item| std::cmp::Reverse(item.alert.severity));
    alerts
}

fn slice_rows(report: &ScaffoldReport, length: &Unit) -> Vec<SliceRow> {
    let slices = &report.pictures.slices;
    let row = |shown| {
        let range = slices::range(slices, shown)?;
        let (title, reading) = match shown {
            Shown::Solid => (
                "Local thickness of the solid",
                "Each point of the solid has the diameter of the largest ball within the solid that covers it. Even colour \
                 means walls and struts of one thickness; dark spots are the thin places, where a part breaks or a printer fails. Where the region cuts the solid, balls reach beyond it and are as large as the others at most.",
            ),
            Shown::Pore => (
                "Local width of the pores",
                "Each point of the pores has the diameter of the largest ball within the pores that covers it. Dark necks \
                 between bright rooms are throats, which decide what passes through.",
            ),
        };
        let name = if shown == Shown::Solid { "Thickness" } else { "Width" };
        Some(SliceRow {
            title,
            reading,
            colour_bar: slices::colour_bar(shown, range, length),
            colours: format!("{name} ({})", length.for_people()),
            figures: slices
                .iter()
                .map(|slice| (slices::drawing(slice, shown, range, length), slices::finding(slice, shown, length)))
                .collect(),
        })
    };
    [Shown::Solid, Shown::Pore].into_iter().filter_map(row).collect()
}

fn distributions(report: &ScaffoldReport) -> Vec<Figure> {
    let drawn = report.histograms.iter().filter(|plot| plot.shares.iter().any(|&share| share > 0.0));
    drawn
        .map(|plot| Figure {
            title: plot.title.clone(),
            drawing: histogram::histogram(plot),
            finding: histogram::finding(plot),
            reading: plot.reading,
        })
        .collect()
}

fn profiles(report: &ScaffoldReport, length: &Unit) -> Vec<Figure> {
    let figure = |of: &Profile| Figure {
        title: format!("Porosity along {}", of.axis),
        drawing: profile::profile(of, &report.profiles, length),
        finding: profile::finding(of),
        reading: "",
    };
    report.profiles.iter().filter(|profile| profile.positions.len() > 1).map(figure).collect()
}

fn anisotropy(of: &Anisotropy, length: &Unit) -> AnisotropyFigure {
    let names = ["a", "b", "c"];
    AnisotropyFigure {
        bars: ellipsoid::bars(of, length),
        outlines: ellipsoid::outlines(of),
        finding: ellipsoid::finding(of, length),
        directions: names
            .into_iter()
            .zip(of.lengths)
            .zip(of.directions)
            .map(|((name, value), direction)| {
                let cosines = direction.map(|cosine| words::significant((cosine * 1e4).round() / 1e4 + 0.0, 4));
                (name, words::with_unit(value, length), cosines)
            })
            .collect(),
    }
}

fn study(report: &ScaffoldReport, of: &Convergence, length: &Unit) -> Study {
    let (title, caption, reading) = match of.over {
        Varied::Pitch => (
            "Over the pitch",
            "Main metrics at several pitches",
            "Values that have come to rest lie on the zero line towards the left. A last change of less than 1 % is good; a \
             large one, or one that does not shrink, asks for a finer raster. The observed order is p where the error shrinks \
             as pitch to the power p: 1 and above is as it should be.",
        ),
        Varied::Region => (
            "Over the region",
            "Main metrics in parts of the region about its middle",
            "A region that is large enough gives the same values as a part of it. Values that still drift where the region is \
             full speak of this specimen rather than of the material.",
        ),
    };
    let at = |at: f64| match of.over {
        Varied::Pitch => words::with_unit(at, length),
        Varied::Region => words::with_unit(at, &Quantity::Share.of(None)),
    };
    let row = |(i, series): (usize, &ConvergenceSeries)| {
        let unit = series.metric.quantity.of(report.unit);
        let value =
            |value: &Option<f64>| table::finite(*value).map_or(words::NOTHING.to_owned(), |v| words::value(v, &unit));
        let change = convergence::last_change(of, series);
        StudyRow {
            number: i + 1,
            class: i % convergence::SERIES,
            name: series.metric.name,
            unit: unit.for_people(),
            values: series.values.iter().map(value).collect(),
            change: change.map_or(words::NOTHING.to_owned(), |change| words::significant(change, 2) + "\u{a0}%"),
            order: series
                .order
                .map_or(words::NOTHING.to_owned(), |order| words::significant((order * 100.0).round() / 100.0, 3)),
        }
    };
    Study {
        title,
        reading,
        drawing: convergence::convergence(of, length),
        caption: caption.to_owned(),
        at: of.at.iter().copied().map(at).collect(),
        rows: of.series.iter().enumerate().map(row).collect(),
        orders: of.over == Varied::Pitch,
    }
}

fn facts_of_run(provenance: &Provenance, length: &Unit) -> Vec<(&'static str, String)> {
    let [x, y, z] = provenance.rays;
    let mut facts = vec![
        ("Program", format!("ldi-ops {}", provenance.version)),
        ("Made", provenance.made.clone()),
        ("Device", provenance.device.clone()),
        ("Threads", provenance.threads.to_string()),
        ("Raster", format!("{x} × {y} × {z} rays, pitch {}", words::with_unit(provenance.pitch, length))),
        ("Region", provenance.region.clone()),
        ("Boundary condition", provenance.edges.to_owned()),
    ];
    if let Some(bytes) = provenance.peak_memory_bytes {
        facts.push(("Peak memory", format!("{}\u{a0}MiB", words::count(bytes.div_ceil(1 << 20)))));
    }
    facts
}

fn inputs(provenance: &Provenance) -> Vec<InputRow<'_>> {
    provenance.inputs.iter().map(InputRow::of).collect()
}

impl<'s> InputRow<'s> {
    fn of(input: &'s InputFile) -> InputRow<'s> {
        let InputFile { role, path, sha256, triangles, closed, oriented, unit } = input;
        InputRow {
            role,
            path,
            sha256,
            triangles: words::count(*triangles),
            surface: match (closed, oriented) {
                (true, true) => "closed, oriented",
                (true, false) => "closed, not oriented",
                (false, _) => "not closed",
            },
            unit: unit.map_or("none", |unit| unit.symbol()),
        }
    }
}
