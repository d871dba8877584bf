//! The summary page: a sortable table with a row per solid.

use std::io::Cursor;

use askama::Template;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

use super::sortable::{Cell, Column};
use super::verdict::Strip;
use super::{FOOT, SORT, STYLE, words};
use crate::mesh::LengthUnit;
use crate::report::id::{self, MetricId, Statistic};
use crate::report::quantity::Unit;
use crate::report::scaffold_report::{Metric, ScaffoldReport};

/// A written report and its location.
pub struct Entry<'s> {
    pub report: &'s ScaffoldReport,
    /// The path of its page from the summary: `NAME/report.html`.
    pub link: String,
}

/// A solid that could not be measured.
#[derive(Clone, Debug, Serialize)]
pub struct Unmeasured {
    pub path: String,
    /// The reason.
    pub message: String,
}

/// The columns, each shown if any solid has a value: as many as fit a window.
const COLUMNS: [MetricId; 9] = [
    id::POROSITY,
    id::PERCOLATION,
    id::SOLID_THICKNESS.of(Statistic::Mean),
    id::WALL_THINNEST,
    id::PORE_THICKNESS.of(Statistic::Mean),
    id::SURFACE_SPECIFIC,
    id::ANISOTROPY,
    id::CONNECTIVITY,
    id::OVERHANG,
];

#[derive(Template)]
#[template(path = "summary.html", config = "src/report/askama.toml")]
struct Page<'s> {
    style: &'static str,
    sort: &'static str,
    foot: &'static str,
    title: String,
    headline: String,
    state: &'static str,
    columns: Vec<Column>,
    rows: Vec<Row>,
    judged: bool,
    failures: &'s [Unmeasured],
}

struct Row {
    title: String,
    link: String,
    /// The shaded view, reduced, as a `data:` address.
    thumbnail: Option<String>,
    state: &'static str,
    sign: &'static str,
    verdict: String,
    /// Sort key by broken limits first, then by limits kept by the value but not by a bound; broken ones come last.
    rank: usize,
    alerts: usize,
    cells: Vec<Cell>,
}

/// Returns the page; it links to the pages of its entries and lists the solids that could not be measured.
pub fn html(entries: &[Entry], failures: &[Unmeasured]) -> String {
    let shown: Vec<MetricId> = COLUMNS
        .into_iter()
        .filter(|id| {
            entries.iter().any(|entry| entry.report.metric(id.id).is_some_and(|metric| metric.value.is_some()))
        })
        .collect();
    let one_unit = entries.windows(2).all(|pair| pair[0].report.unit == pair[1].report.unit);
    let judged = entries.iter().any(|entry| entry.report.verdict.is_some());
    let failing =
        entries.iter().filter(|entry| entry.report.verdict.as_ref().is_some_and(|verdict| !verdict.passed)).count();
    let (state, headline) = match (judged, failing) {
        (false, _) => ("none", "No limits were given".to_owned()),
        (true, 0) => ("kept", "Every solid keeps its limits".to_owned()),
        (true, failing) => ("broken", format!("{failing} of {} solids break a limit", entries.len())),
    };
    let page = Page {
        style: STYLE,
        sort: SORT,
        foot: FOOT,
        title: format!("{} solids", entries.len()),
        headline,
        state,
        columns: shown.iter().map(|&id| column(entries, id, one_unit)).collect(),
        rows: entries.iter().map(|entry| row(entry, &shown, one_unit)).collect(),
        judged,
        failures,
    };
    super::rendered(&page)
}

fn column(entries: &[Entry], id: MetricId, one_unit: bool) -> Column {
    let unit = entries.first().filter(|_| one_unit).map(|entry| id.quantity.of(entry.report.unit).for_people());
    Column::of(id, unit.unwrap_or_default())
}

fn row(entry: &Entry, columns: &[MetricId], one_unit: bool) -> Row {
    let report = entry.report;
    let strip = Strip::of(report.verdict.as_ref());
    let broken = strip.limits.iter().filter(|limit| limit.state == "broken").count();
    let within = strip.limits.iter().filter(|limit| limit.state == "within").count();
    let verdict = match strip.state {
        "kept" => "kept".to_owned(),
        "within" => format!("kept; {within} within bounds"),
        "broken" => format!("{broken} broken"),
        _ => "no limits".to_owned(),
    };
    Row {
        title: report.title.clone(),
        link: address(&entry.link),
        thumbnail: report.pictures.view.as_deref().and_then(thumbnail),
        state: strip.state,
        sign: strip.sign,
        verdict,
        rank: 1000 * broken + within,
        alerts: report.alerts.len(),
        cells: columns.iter().map(|id| cell(report.metric(id.id), one_unit)).collect(),
    }
}

fn cell(metric: Option<&Metric>, one_unit: bool) -> Cell {
    let Some((metric, value)) = metric.and_then(|metric| Some((metric, super::table::finite(metric.value)?))) else {
        return Cell::nothing();
    };
    let unit: &Unit = &metric.unit;
    Cell {
        text: if one_unit { words::with_error(value, metric.error, unit) } else { words::with_unit(value, unit) },
        key: Cell::key(value * if one_unit { 1.0 } else { to_metres(unit) }),
    }
}

/// Pixels of a view per pixel of its thumbnail, along each side.
const SHRINK: usize = 5;

/// Returns a view, a fifth as wide and high, as the address of an image.
fn thumbnail(view: &[u8]) -> Option<String> {
    let mut reader = png::Decoder::new(Cursor::new(view)).read_info().ok()?;
    let mut pixels = vec![0; reader.output_buffer_size()?];
    let frame = reader.next_frame(&mut pixels).ok()?;
    let channels = frame.color_type.samples();
    let [width, height] = [frame.width, frame.height].map(|side| side as usize / SHRINK);
    let mean = |x: usize, y: usize, channel: usize| {
        let block = (0..SHRINK * SHRINK).map(|i| [x * SHRINK + i % SHRINK, y * SHRINK + i / SHRINK]);
        let sum: usize = block.map(|[x, y]| usize::from(pixels[y * frame.line_size + x * channels + channel])).sum();
        (sum / (SHRINK * SHRINK)) as u8
    };
    let small: Vec<u8> = (0..width * height * channels)
        .map(|i| mean(i / channels % width, i / channels / width, i % channels))
        .collect();
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width as u32, height as u32);
    encoder.set_color(frame.color_type);
    encoder.set_compression(png::Compression::High);
    encoder.write_header().ok()?.write_image_data(&small).ok()?;
    Some(format!("data:image/png;base64,{}", STANDARD.encode(file)))
}

/// Returns the factor to metres, which makes lengths of several units sortable; 1 for values without a unit.
fn to_metres(unit: &Unit) -> f64 {
    unit.factor_to(&unit.quantity.of(Some(LengthUnit::Metre))).unwrap_or(1.0)
}

/// Percent-encodes a path as the address of a link.
pub fn address(path: &str) -> String {
    let mut address = String::with_capacity(path.len());
    for byte in path.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' | b'/' => address.push(byte.into()),
            byte => address += &format!("%{byte:02X}"),
        }
    }
    address
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thumbnail_is_a_fifth_of_its_view() {
        let view = crate::report::fixture::rich().pictures.view.unwrap();
        let address = thumbnail(&view).unwrap();
        let file = STANDARD.decode(address.strip_prefix("data:image/png;base64,").unwrap()).unwrap();
        let mut reader = png::Decoder::new(Cursor::new(file)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((frame.width, frame.height), (64 / 5, 48 / 5));
        // The fixture's grey rises by 3 per column.
        assert_eq!(pixels[..3], [6, 21, 36]);
        assert_eq!(thumbnail(b"no picture"), None);
    }

    #[test]
    fn links_lead_to_files_of_any_name() {
        assert_eq!(address("a b/50% #1?/report.html"), "a%20b/50%25%20%231%3F/report.html");
        assert_eq!(address("javascript:µ/report.html"), "javascript%3A%C2%B5/report.html");
    }
}
