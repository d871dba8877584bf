//! Text output of results: what stdout carries, and the details that `-v` adds on stderr.

mod clash;

use std::fmt::Write;

use glam::DVec3;
use ldi_ops::driver::backend::Ran;
use ldi_ops::driver::certainty::Judged;
use ldi_ops::driver::machine::peak_memory_bytes;
use ldi_ops::driver::measured::{Measured, Method, StepReport};
use ldi_ops::driver::render::Rendered;
use ldi_ops::driver::sum::BetweenRays;
use ldi_ops::driver::surface::{Made, SampledReport, SimplifiedReport, SurfaceReport};
use ldi_ops::grid::Axis;
use ldi_ops::mesh::check::Severity;
use ldi_ops::mesh::io::Format;
use ldi_ops::mesh::{Aabb, LengthUnit};
use ldi_ops::number::{coordinate, digits, exact, number};
use ldi_ops::report::files::Reported;
use ldi_ops::report::id::{self, MetricId, Statistic};
use ldi_ops::report::scaffold_report::{LimitOutcome, Metric, ScaffoldReport};
use ldi_ops::report::sweep::Swept;
use ldi_ops::sampler::{Estimate, FillRule, Mode};
use ldi_ops::surface::{Apart, FinerBlocks};
use ldi_ops::unit;
use ldi_ops::{exact_text, rounded_outwards, with_error};

use crate::run::{Checked, Converted, Devices, Each, Generated, Outcome, Surfaced, is_pinned};

/// Returns the text of a result.
pub fn of(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Measured(results) => each(results, measured),
        Outcome::Surfaced(result) => surfaced(result),
        Outcome::Checked(results) => checked(results),
        Outcome::Converted(result) => converted(result),
        Outcome::Generated(result) => generated(result),
        Outcome::Devices(result) => devices(result),
        Outcome::Rendered(result) => rendered(result),
        Outcome::Reported(result) => reported(result),
        Outcome::Swept(result) => swept(result),
        Outcome::Compared(result) => clash::of(result),
        Outcome::Text(text) => text.clone(),
    }
}

/// Returns the details of a result, such as raster, backend, time and memory; of some results there are none.
pub fn details(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Measured(results) => {
            let of = |result: &Measured| match results.len() {
                1 => measured_details(result),
                // Several results need the names of their solids.
                _ => format!("{}\n{}", result.solids[0].name(), measured_details(result)),
            };
            each(results, of)
        }
        Outcome::Surfaced(result) => surfaced_details(result),
        Outcome::Rendered(result) => rendered_details(result),
        Outcome::Reported(result) => reported_details(result),
        Outcome::Compared(result) => clash::details(result),
        Outcome::Checked(_)
        | Outcome::Converted(_)
        | Outcome::Generated(_)
        | Outcome::Devices(_)
        | Outcome::Swept(_)
        | Outcome::Text(_) => String::new(),
    }
}

/// Returns the texts of results, with a blank line between them.
fn each(results: &[Each<Measured>], text: impl Fn(&Measured) -> String) -> String {
    results.iter().flatten().map(text).collect::<Vec<_>>().join("\n")
}

/// A table of lines, each with a label.
#[derive(Default)]
struct Table {
    text: String,
}

impl Table {
    fn line(&mut self, label: &str, what: impl std::fmt::Display) {
        // A space separates even a long label.
        let _ = writeln!(self.text, "{label:<11} {what}");
    }

    fn more(&mut self, what: impl std::fmt::Display) {
        self.line("", what);
    }

    /// Adds the peak memory of the process, where the system tells it, and `more` behind it.
    fn memory(&mut self, more: impl std::fmt::Display) {
        if let Some(bytes) = peak_memory_bytes() {
            self.line("memory", format_args!("{:.0} MB at most{more}", bytes as f64 / 1e6));
        }
    }
}

/// The metrics printed on stdout; the files have all of them.
const KEY_METRICS: [MetricId; 11] = [
    id::POROSITY,
    id::POROSITY_CLOSED,
    id::SURFACE_DENSITY,
    id::SOLID_THICKNESS.of(Statistic::Mean),
    id::WALL_THINNEST,
    id::PORE_THICKNESS.of(Statistic::Mean),
    id::PORE_LARGEST,
    id::PERCOLATION,
    id::ANISOTROPY,
    id::EULER,
    id::TORTUOSITY_PORE_DIFFUSIVE.along(Axis::Z),
];

/// Returns the text of `report`.
fn reported(result: &Reported) -> String {
    let mut tables: Vec<String> = result.reports.iter().map(one_reported).collect();
    let mut table = Table::default();
    for (i, page) in result.pages.iter().enumerate() {
        table.line(if i == 0 { "written" } else { "" }, page.display());
    }
    if !result.pages.is_empty() {
        tables.push(table.text);
    }
    tables.join("\n")
}

/// Returns the text of `sweep`.
fn swept(result: &Swept) -> String {
    let Swept { title, chosen, measured, is_older, rows, missing, front, unresolved, written } = result;
    let mut table = Table::default();
    let part =
        if *missing == 0 && rows.len() == *chosen { String::new() } else { format!(" of {chosen} of this part") };
    table.line("sweep", format_args!("{title}; {measured} measured now{part}"));
    let failed = result.failed().count();
    if failed > 0 {
        table.more(format_args!("{failed} failed"));
    }
    if *missing > 0 {
        let table_of = if *is_older { "the table in the folder is of an earlier run" } else { "no table until then" };
        table.more(format_args!("{missing} of other parts are not measured yet: {table_of}"));
    }
    if let Some(kept) = result.kept() {
        table.line("limits", format_args!("{kept} of {} designs keep them", rows.len() - failed));
    }
    if *missing == 0 {
        let plural = if front.len() == 1 { "" } else { "s" };
        table.line("front", format_args!("{} design{plural} that no other dominates", front.len()));
    }
    if *unresolved > 0 {
        table.more(format_args!("{unresolved} left out, whose values the raster does not resolve: raise resolution"));
    }
    let warnings = result.warnings().into_iter().map(|(code, count)| format!("{code} in {count}"));
    let warnings: Vec<String> = warnings.collect();
    if !warnings.is_empty() {
        table.line("warnings", warnings.join(", "));
    }
    for (i, path) in written.iter().enumerate() {
        table.line(if i == 0 { "written" } else { "" }, path.display());
    }
    table.text
}

fn one_reported(report: &ScaffoldReport) -> String {
    let mut table = Table::default();
    table.line("report", &report.title);
    for id in KEY_METRICS {
        let Some(metric) = report.metric(id.id) else { continue };
        let _ = writeln!(table.text, "{:<40} {}", format!("{} ({})", metric.name, metric.symbol), metric_value(metric));
    }
    if let Some(verdict) = &report.verdict {
        for limit in &verdict.limits {
            let outcome = match limit.outcome {
                LimitOutcome::Kept => "kept",
                LimitOutcome::KeptWithinBounds => "kept by the value, but not by its bounds",
                LimitOutcome::Broken if limit.is_broken_by_bounds() => "BROKEN by its bounds, though not by its value",
                LimitOutcome::Broken => "BROKEN",
                LimitOutcome::NoValue => "BROKEN: no value",
            };
            let scale = limit.unit.scale_for_people();
            let end = |word: &str, end: Option<f64>| end.map(|end| format!("{word} {}", rounded(end * scale)));
            let ends = match (limit.min, limit.max) {
                (Some(min), Some(max)) if min == max => [end("exactly", limit.min), None],
                (min, max) => [end("at least", min), end("at most", max)],
            };
            let asked: Vec<String> = ends.into_iter().flatten().collect();
            let value = limit.value.map_or("–".to_owned(), |value| rounded(value * scale));
            let unit = limit.unit.for_people();
            let said = format!("{}: {outcome}; {value} {unit}, asked {} {unit}", limit.name, asked.join(" and "));
            table.line("limit", said.replace(" ,", ",").trim_end());
        }
    }
    let [x, y, z] = report.provenance.rays;
    let pitch = format!("{}{}", number(report.provenance.pitch), unit::suffix(report.unit, 1));
    table.line("grid", format_args!("{x} × {y} × {z} rays, pitch {pitch}, edges {}", report.provenance.edges));
    table.text
}

/// Returns the details of `report`: the time of each solid.
fn reported_details(result: &Reported) -> String {
    let mut table = Table::default();
    for report in &result.reports {
        let total = report.provenance.seconds.iter().find(|(stage, _)| *stage == "total");
        let seconds = total.map_or(0.0, |(_, seconds)| *seconds);
        table.line("time", format_args!("{}: {seconds:.2} s", report.title));
    }
    table.memory("");
    table.text
}

/// Formats a value with its estimated error; its bounds, which are worst cases, are in the files.
fn metric_value(metric: &Metric) -> String {
    let Some(value) = metric.value else {
        return format!("– ({})", metric.warnings.first().map_or("no value", String::as_str));
    };
    let scale = metric.unit.scale_for_people();
    let unit = metric.unit.for_people();
    let said = match metric.error.filter(|&error| error > 0.0) {
        Some(error) => {
            let (value, error) = with_error(value * scale, error * scale);
            format!("{value} ± {error} {unit}")
        }
        None => format!("{} {unit}", rounded(value * scale)),
    };
    said.trim_end().to_owned()
}

/// Rounds to four digits, more than most of these numbers are accurate to.
fn rounded(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return number(value);
    }
    let scale = 10f64.powi(3 - value.abs().log10().floor() as i32);
    number((value * scale).round() / scale)
}

/// Formats the volume of a result.
fn value(result: &Measured) -> String {
    let estimate = result.estimate();
    if !is_pinned(result) {
        return estimate.to_string();
    }
    let (value, error) = with_error(estimate.value, estimate.error);
    format!("{value} ± {error}{}", unit::suffix(estimate.unit, estimate.power))
}

/// Returns the text of `intersect`, `union`, `difference`, `xor`, `csg`, `minkowski`, `offset`, `volume` and `sample`.
fn measured(result: &Measured) -> String {
    let mut table = Table::default();
    table.line(result.command, value(result));
    // Beside an over- or under-estimate.
    if let Some(exact) = result.volume.exact.filter(|_| result.volume.method != Method::Exact) {
        table.line("exact", exact_text(exact, result.unit, 3));
    }
    certified(&mut table, result);
    measures(&mut table, result);
    inputs(&mut table, result);
    if let Some(path) = &result.output {
        let holds_place = Format::from_path(path).is_ok_and(Format::holds_place);
        let offset = result.surface.as_ref().and_then(|surface| surface.recentred).filter(|_| !holds_place);
        table.line("written", format_args!("{}{}", path.display(), recentred(offset, result.unit)));
    }
    table.text
}

/// Returns the details of the same commands.
fn measured_details(result: &Measured) -> String {
    let mut table = Table::default();
    if let Some(expression) = &result.expression {
        table.line("expression", expression);
    }
    making(&mut table, result);
    cost(&mut table, result);
    table.text
}

/// Adds certified bounds and the verdicts on assertions.
fn certified(table: &mut Table, result: &Measured) {
    let cubed = unit::suffix(result.unit, 3);
    if let Some(bounds) = result.certified.bounds {
        let [lower, upper] = rounded_outwards(bounds);
        table.line("bounds", format_args!("{lower} to {upper}{cubed} (certified)"));
    }
    for judged in &result.certified.judged {
        let Judged { side, limit, .. } = judged;
        table.line("assert", format_args!("{} {}{cubed}: {judged}", side.name(), digits(*limit, 12)));
    }
}

/// Adds the measures of `volume`.
fn measures(table: &mut Table, result: &Measured) {
    let length = unit::suffix(result.unit, 1);
    if let Some(measures) = &result.measures {
        let (area, squared) = (measures.area, unit::suffix(result.unit, 2));
        table.line(
            "area",
            match measures.area_error {
                0.0 => format!("{}{squared}", number(area)),
                error => {
                    let (area, error) = with_error(area, error);
                    format!("{area} ± {error}{squared}")
                }
            },
        );
        if measures.centroid.is_finite() {
            let bounds = result.solids[0].bounds();
            let size = bounds.min.abs().max(bounds.max.abs()).max_element();
            let centroid = without_noise(measures.centroid, DVec3::splat(size));
            table.line("centroid", format_args!("{}{length}", place(centroid, bounds.extent().max_element())));
            for (i, row) in [0, 1, 2].map(|row| measures.inertia.row(row)).into_iter().enumerate() {
                let suffix = unit::suffix(result.unit, 5);
                let products =
                    [0, 1, 2].map(|j| (measures.inertia.row(i)[i] * measures.inertia.row(j)[j]).abs().sqrt());
                let row = without_noise(row, DVec3::from_array(products) * (1.0 - DVec3::AXES[i]));
                table.line(if i == 0 { "inertia" } else { "" }, format_args!("{}{suffix}", vector(row)));
            }
        }
    }
}

/// Adds the inputs, a line each.
fn inputs(table: &mut Table, result: &Measured) {
    let cubed = unit::suffix(result.unit, 3);
    for (i, solid) in result.solids.iter().enumerate() {
        let lack = |is: bool, name: &str| if is { String::new() } else { format!(", not {name}") };
        let (closed, oriented) = (lack(solid.is_closed(), "closed"), lack(solid.was_oriented(), "oriented"));
        let triangles = solid.mesh().triangles.len();
        let volume = number(solid.volume);
        let operand = solid.operand.as_ref().map(|name| format!("{name} = ")).unwrap_or_default();
        table.line(
            if i == 0 { "input" } else { "" },
            format_args!(
                "{operand}{}: {triangles} triangles{closed}{oriented}, mesh volume {volume}{cubed}",
                solid.name()
            ),
        );
    }
}

/// Adds the grid, the images and other details of the computation.
fn making(table: &mut Table, result: &Measured) {
    let length = unit::suffix(result.unit, 1);
    let grid = &result.grid;
    let [x, y, z] = grid.rays();
    table.line(
        "grid",
        format_args!(
            "{x} × {y} × {z} rays, pitch {}{length}, quantisation {:.1e}{length}",
            number(grid.pitch()),
            grid.quantisation()
        ),
    );
    if let Some(ran) = &result.ran {
        images(table, result, ran);
    }
    for step in result.sum.iter().flat_map(|sum| &sum.steps) {
        sum_step(table, step, result.unit);
    }
    if result.unclosed > 0 {
        table.line("unclosed", format_args!("{} rays, counted as empty", result.unclosed));
    }
    if let Some(refinement) = &result.refinement {
        let reached = if refinement.reached { "reached" } else { "NOT reached" };
        let (asked, came_to) = (number(100.0 * refinement.asked), number(100.0 * refinement.came_to));
        let by = match result.ran {
            None => "by the exact volume".to_owned(),
            Some(_) => format!("with {} rays along the longest side", refinement.resolution),
        };
        table.line("tolerance", format_args!("{asked} % {reached}: {came_to} % {by}"));
    }
    if let Some(report) = &result.surface {
        let [mesh, quality] = surface(report, result.unit);
        table.line("mesh", mesh);
        table.more(quality);
    }
}

/// Adds the time and memory of a result.
fn cost(table: &mut Table, result: &Measured) {
    let seconds = &result.seconds;
    table.line(
        "time",
        format_args!(
            "{:.3} s: read {:.3}, sample {:.3}, operate {:.3}, integrate {:.3}, write {:.3}",
            seconds.total, seconds.read, seconds.sample, seconds.operate, seconds.integrate, seconds.write
        ),
    );
    let expected = result.sum.as_ref().map(|sum| format!("; estimate {:.0} MB", sum.memory_estimate() as f64 / 1e6));
    table.memory(expected.unwrap_or_default());
}

/// Adds the kind of the images, the backend, layers and samples.
fn images(table: &mut Table, result: &Measured, ran: &Ran) {
    let image = match result.mode {
        Mode::Exact => "exact".to_owned(),
        Mode::Estimate(Estimate::Over) => format!("over-estimate with LOD-C {}", result.grid.lod()),
        Mode::Estimate(Estimate::Under) => format!("under-estimate with LOD-C {}", result.grid.lod()),
    };
    let fill = match result.fill {
        FillRule::EvenOdd => "even-odd",
        FillRule::NonZero => "non-zero",
    };
    table.line("image", format_args!("{image}, {fill}"));
    table.line("backend", ran);
    let layers = Axis::ALL.iter().filter_map(|axis| Some((axis.name(), result.layers[axis.depth()]?)));
    let layers: Vec<String> = layers.map(|(axis, layers)| format!("{layers} along {axis}")).collect();
    table.line("layers", format_args!("at most {}; {} samples in all", layers.join(", "), result.samples));
}

/// Adds the statistics of a step of a sum, on two lines.
fn sum_step(table: &mut Table, report: &StepReport, unit: Option<LengthUnit>) {
    let StepReport { operation, distance, pairs, primitives, sampled, crossings, resolved, between_rays, .. } = report;
    let by = distance.map(|distance| format!(" by {}{}", number(distance), unit::suffix(unit, 1)));
    let pairs =
        pairs.map(|pairs| format!(" of {} pairs kept, {} visited of {}", pairs.kept, pairs.visited, pairs.candidates));
    let (by, pairs) = (by.unwrap_or_default(), pairs.unwrap_or_default());
    table.line("step", format_args!("{operation}{by}: {primitives} primitives{pairs}"));
    let crossings = crossings.map(|crossings| format!(" in {} crossings", crossings.iter().sum::<u64>()));
    table.more(format_args!(
        "{sampled} sampled{}; {} components and {} gaps tested: {} out, {} in",
        crossings.unwrap_or_default(),
        resolved.components,
        resolved.gaps_tested,
        resolved.cavities,
        resolved.filled
    ));
    if let Some(BetweenRays { candidates, details, searched_to, .. }) = between_rays {
        table.more(format_args!(
            "between the rays: {candidates} cubes searched, for cavities down to {}{}; {} details found",
            digits(*searched_to, 3),
            unit::suffix(unit, 1),
            details.len()
        ));
    }
}

/// Formats the data of a mesh, on two lines.
fn surface(report: &SurfaceReport, unit: Option<LengthUnit>) -> [String; 2] {
    let (length, cubed) = (unit::suffix(unit, 1), unit::suffix(unit, 3));
    let SurfaceReport { vertices, triangles, components, genus, .. } = report;
    let largest = match components {
        0 | 1 => String::new(),
        _ => format!(" (all but the largest {:.1e} of the volume)", (1.0 - report.largest_share).abs()),
    };
    let (made, quality) = match &report.made {
        Made::Exact(Apart { merged, moved }) => {
            let rounded = match merged + moved {
                0 => String::new(),
                _ => format!("; of vertices with equal coordinates {merged} merged and {moved} moved"),
            };
            ("exact".to_owned(), rounded)
        }
        Made::Sampled(sampled) => of_images(sampled, &length),
    };
    let dropped = match report.dropped.parts {
        0 => String::new(),
        parts => format!("; {parts} small parts dropped"),
    };
    let recentred = recentred(report.recentred, unit);
    [
        format!(
            "{triangles} triangles, {vertices} vertices, {components} components{largest}, genus {genus}; {made}{recentred}"
        ),
        format!("closed 2-manifold around {}{cubed}{quality}{dropped}", number(report.volume)),
    ]
}

/// Returns the origin of a mesh of images, and what it lost.
fn of_images(report: &SampledReport, length: &str) -> (String, String) {
    let (made, before) = match report.simplified {
        Some(SimplifiedReport { distance, triangles, .. }) => {
            (format!("from images, simplified from {triangles} within {}{length}", number(distance)), " before that")
        }
        None => ("from images".to_owned(), ""),
    };
    let finer = match report.blocks {
        FinerBlocks { count: 0, .. } => String::new(),
        FinerBlocks { count: 1, finest } => format!("; 1 block of cells {finest} times finer"),
        FinerBlocks { count, finest } => format!("; {count} blocks of cells up to {finest} times finer"),
    };
    let crossing = match report.crossing_pairs {
        0 => String::new(),
        pairs => format!("; {pairs} pairs of triangles cross"),
    };
    let lost = format!(
        "; samples at most {}{length} away{before}; {} below the pitch dropped{finer}{crossing}",
        number(report.largest_distance),
        report.lost()
    );
    (made, lost)
}

/// Returns the text of `surface`.
fn surfaced(result: &Surfaced) -> String {
    let mut table = Table::default();
    if let Some(report) = &result.surface {
        let [mesh, _] = surface(report, result.unit);
        table.line("mesh", mesh);
    }
    if let Some(path) = &result.output {
        table.line("written", path.display());
    }
    table.text
}

/// Returns the details of `surface`.
fn surfaced_details(result: &Surfaced) -> String {
    let mut table = Table::default();
    let length = unit::suffix(result.unit, 1);
    let [x, y, z] = result.grid.rays();
    let pitch = number(result.grid.pitch());
    table.line("images", format_args!("{x} × {y} × {z} rays, pitch {pitch}{length}; {} samples", result.samples));
    if let Some(report) = &result.surface {
        let [_, quality] = surface(report, result.unit);
        table.line("mesh", quality);
    }
    let [read, total] = result.seconds;
    table.line("time", format_args!("{total:.3} s: read {read:.3}"));
    table.text
}

/// Returns the text of `check`.
fn checked(results: &[Each<Checked>]) -> String {
    let mut table = Table::default();
    for result in results.iter().flatten() {
        let report = &result.report;
        let verdict = if report.is_solid() { "a solid" } else { "NOT a solid" };
        let _ = writeln!(table.text, "{}: {verdict}", result.path.display());
        table.line(
            "  size",
            format_args!(
                "{} triangles, {} vertices, {} edges, {} components, {} shells",
                report.triangles, report.vertices, report.edges, report.components, report.shells
            ),
        );
        let (squared, cubed) = (unit::suffix(result.unit, 2), unit::suffix(result.unit, 3));
        table.line(
            "  measures",
            format_args!("volume {}{cubed}, area {}{squared}", number(report.signed_volume), number(report.area)),
        );
        if let Some(bounds) = report.bounds {
            let length = unit::suffix(result.unit, 1);
            table.line("  box", format_args!("{}{length}", corners(bounds)));
        }
        let genus = report.genus.map(|genus| format!(", genus {genus}")).unwrap_or_default();
        table.line("  topology", format_args!("Euler characteristic {}{genus}", report.euler_characteristic));
        for defect in report.defects() {
            let severity = match defect.severity() {
                Severity::Error => "  error",
                Severity::Warning => "  warning",
                Severity::Note => "  note",
            };
            table.line(severity, defect);
        }
    }
    table.text
}

/// Returns the text of `convert`.
fn converted(result: &Converted) -> String {
    let unit = match result.unit {
        Some(unit) => format!("in{}", unit::suffix(Some(unit), 1)),
        None => "unit not stated".to_owned(),
    };
    let recentred = recentred(result.recentred, result.unit);
    format!("{}: {} triangles, {unit}{recentred}\n", result.to.display(), result.triangles)
}

/// Formats the offset that was subtracted from the coordinates of a mesh, with all its digits.
fn recentred(offset: Option<DVec3>, unit: Option<LengthUnit>) -> String {
    let offset = offset.map(|offset| offset.to_array().map(exact));
    offset.map_or(String::new(), |[x, y, z]| format!("; recentred by ({x}, {y}, {z}){}", unit::suffix(unit, 1)))
}

/// Returns the text of `generate`.
fn generated(result: &Generated) -> String {
    let mut table = Table::default();
    let unit = Some(LengthUnit::Millimetre);
    table.line(&result.kind, format_args!("{}: {} triangles, in mm", result.to.display(), result.triangles));
    if let Some(bounds) = result.bounds {
        table.line("box", format_args!("{} mm", corners(bounds)));
    }
    table.line("volume", format_args!("{}{}", number(result.volume), unit::suffix(unit, 3)));
    table.line("area", format_args!("{}{}", number(result.area), unit::suffix(unit, 2)));
    table.text
}

/// Returns the text of `render`.
fn rendered(result: &Rendered) -> String {
    let mut table = Table::default();
    let length = unit::suffix(result.unit, 1);
    let plane = result.plane.map(|(axis, at)| format!(", at {} = {}{length}", axis.name(), number(at)));
    table.line(
        "render",
        format_args!(
            "{}: {} × {} pixels of {}{length}, seen from {}{}",
            result.to.display(),
            result.width,
            result.height,
            number(result.pixel),
            result.view,
            plane.unwrap_or_default(),
        ),
    );
    for (i, solid) in result.solids.iter().enumerate() {
        let triangles = solid.mesh().triangles.len();
        table.line(if i == 0 { "input" } else { "" }, format_args!("{}: {triangles} triangles", solid.name()));
    }
    table.text
}

/// Returns the details of `render`.
fn rendered_details(result: &Rendered) -> String {
    let mut table = Table::default();
    let [columns, rows, _] = result.grid.rays();
    table.line("image", format_args!("{columns} × {rows} rays, {} samples", result.samples));
    table.line("backend", &result.ran);
    let seconds = &result.seconds;
    table.line(
        "time",
        format_args!(
            "{:.3} s: read {:.3}, sample {:.3}, operate {:.3}, shade {:.3}, write {:.3}",
            seconds.total, seconds.read, seconds.sample, seconds.operate, seconds.shade, seconds.write
        ),
    );
    table.memory("");
    table.text
}

/// Returns the text of `devices`.
fn devices(devices: &Devices) -> String {
    let mut table = Table::default();
    let name = devices.cpu.as_deref().unwrap_or("of unknown make");
    table.line("cpu", format_args!("{name}, {} threads", devices.threads));
    for gpu in &devices.gpus {
        table.line("gpu", format_args!("{}: {}, {}, {}", gpu.name, gpu.kind, gpu.api, gpu.driver));
        table.more(format_args!(
            "largest buffer {}, largest binding {}, {} bindings; workgroups of {} with {} of memory",
            bytes(gpu.largest_buffer),
            bytes(gpu.largest_binding),
            gpu.bindings,
            gpu.workgroup,
            bytes(gpu.workgroup_memory.into())
        ));
        let word = |it| if it { "yes" } else { "no" };
        table.more(format_args!("64-bit integers: {}; timestamps: {}", word(gpu.int64), word(gpu.timestamps)));
    }
    if let Some(why) = &devices.no_gpu {
        table.line("gpu", format_args!("none: {why}"));
    }
    table.line("auto", format_args!("{}: {}", devices.auto.backend, devices.auto.reason));
    table.more("every device gives the same bits");
    table.text
}

/// Formats a size in the largest unit of which it has at least one.
fn bytes(size: u64) -> String {
    match [("GiB", 30), ("MiB", 20), ("KiB", 10)].into_iter().find(|(_, shift)| size >> shift > 0) {
        Some((unit, shift)) => {
            format!("{} {unit}", number((size as f64 / f64::from(1u32 << shift) * 10.0).round() / 10.0))
        }
        None => format!("{size} bytes"),
    }
}

/// Returns a vector in which entries that are small beside the terms whose sums they are, as rounding leaves for 0, are 0.
fn without_noise(vector: DVec3, terms: DVec3) -> DVec3 {
    DVec3::select(vector.abs().cmplt(NOISE * terms), DVec3::ZERO, vector)
}

/// Rounding of sums, as a share of the greatest term.
const NOISE: f64 = 1e-14;

fn vector(vector: DVec3) -> String {
    let [x, y, z] = vector.to_array().map(number);
    format!("({x}, {y}, {z})")
}

/// Formats a place in a solid of this extent.
fn place(place: DVec3, extent: f64) -> String {
    let [x, y, z] = place.to_array().map(|at| coordinate(at, extent));
    format!("({x}, {y}, {z})")
}

/// Formats the lowest and the highest corner of a box.
fn corners(bounds: Aabb) -> String {
    let extent = bounds.extent().max_element();
    format!("{} to {}", place(bounds.min, extent), place(bounds.max, extent))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_in_units_that_fit() {
        assert_eq!([0, 1023, 32768, 3 << 19].map(bytes), ["0 bytes", "1023 bytes", "32 KiB", "1.5 MiB"]);
        assert_eq!([(1 << 31) - 1, 5 << 40].map(bytes), ["2 GiB", "5120 GiB"]);
    }
}
