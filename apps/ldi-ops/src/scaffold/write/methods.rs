//! methods.txt: what to write into a paper about how the numbers were found. Only what was measured is said.

use std::fmt::Write;

use crate::scaffold::page::words;
use crate::scaffold::quantity::Quantity;
use crate::scaffold::sheet::{InputFile, Metric, Sheet, Status};

/// Parameters that were chosen; others tell of what was found.
const SETTINGS: [&str; 5] = ["pitch", "edges", "angle from the horizontal, degrees", "build direction", "K"];
/// Lines end before this column.
const COLUMNS: usize = 100;

/// The paragraph, the definitions and the sources.
pub fn methods(sheet: &Sheet) -> String {
    let measured: Vec<&Metric> = sheet.metrics.iter().filter(|metric| is_measured(metric)).collect();
    let sources = sources(&measured);
    let mut sentences = vec![what(sheet), raster(sheet), edges(sheet)];
    sentences.extend(how(&measured, &sources));
    sentences.extend(bounds(&measured));
    sentences.extend(resolution(sheet));
    let mut text = wrapped(&sentences.join(" "), "");
    if !measured.is_empty() {
        text += "\nDefinitions\n";
        for metric in &measured {
            text += &wrapped(&format!("{}: {}", named(metric), metric.definition), "  ");
        }
    }
    if !sources.is_empty() {
        text += "\nSources\n";
        for (i, source) in sources.iter().enumerate() {
            text += &wrapped(&format!("[{}] {source}", i + 1), "  ");
        }
    }
    text
}

fn is_measured(metric: &Metric) -> bool {
    metric.status != Status::NotApplicable && metric.value.is_some_and(f64::is_finite)
}

/// Each source once, in the order of the metrics.
fn sources<'s>(measured: &[&'s Metric]) -> Vec<&'s str> {
    let mut sources: Vec<&str> = Vec::new();
    for metric in measured {
        if !metric.reference.is_empty() && !sources.contains(&metric.reference) {
            sources.push(metric.reference);
        }
    }
    sources
}

fn what(sheet: &Sheet) -> String {
    let inputs = &sheet.provenance.inputs;
    let of_role = |role: &str| inputs.iter().find(|input| input.role == role);
    let described = |input: &InputFile| {
        let InputFile { path, triangles, sha256, .. } = input;
        format!("{path} ({} triangles, SHA-256 {sha256})", words::count(*triangles))
    };
    let solid = of_role("solid").map_or(sheet.title.clone(), described);
    let region = match of_role("roi") {
        Some(roi) => format!("the volume that {} bounds", described(roi)),
        None => "the bounding box of the solid".to_owned(),
    };
    let unit = match sheet.unit {
        Some(unit) => format!("Lengths are in {}.", unit.symbol()),
        None => "The unit of length is not known; lengths are in units of the file.".to_owned(),
    };
    let version = sheet.provenance.version;
    format!("The solid {solid} was analysed with ldi-ops {version} within {region}. {unit}")
}

fn raster(sheet: &Sheet) -> String {
    let [x, y, z] = sheet.provenance.rays;
    let pitch = words::with_unit(sheet.provenance.pitch, &Quantity::Length(1).of(sheet.unit));
    format!(
        "Layered depth images of its surface were sampled along x, y and z, with rays {pitch} apart ({x} × {y} × {z} nodes \
         where the rays of the three axes meet)."
    )
}

fn edges(sheet: &Sheet) -> String {
    match sheet.provenance.edges {
        "periodic" => "The region was taken as a cell that repeats in all directions.".to_owned(),
        "border" => "The boundary of the region was taken as a wall: balls of either phase lie within it.".to_owned(),
        "clip" => {
            "Where the region ends, nothing was assumed: balls touch the surface alone and may reach beyond.".to_owned()
        }
        other => format!("Edges of the region: {other}."),
    }
}

/// One sentence for all metrics that were found alike.
fn how(measured: &[&Metric], sources: &[&str]) -> Vec<String> {
    let mut ways: Vec<(String, Vec<&Metric>)> = Vec::new();
    for metric in measured {
        let mut way = metric.method.to_owned();
        let settings = metric.parameters.iter().filter(|(name, _)| SETTINGS.contains(name));
        let parameters: Vec<String> = settings.map(|(name, value)| format!("{name} {value}")).collect();
        if !parameters.is_empty() {
            let _ = write!(way, " ({})", parameters.join(", "));
        }
        if let Some(i) = sources.iter().position(|source| *source == metric.reference) {
            let _ = write!(way, " [{}]", i + 1);
        }
        match ways.iter_mut().find(|(known, _)| *known == way) {
            Some((_, metrics)) => metrics.push(metric),
            None => ways.push((way, vec![metric])),
        }
    }
    ways.into_iter().map(|(way, metrics)| format!("{}: {way}.", capital(&listed(&together(&metrics))))).collect()
}

fn bounds(measured: &[&Metric]) -> Option<String> {
    let bounded: Vec<String> = measured
        .iter()
        .filter(|metric| metric.lower.is_some() && metric.upper.is_some())
        .map(|metric| named(metric))
        .collect();
    (!bounded.is_empty()).then(|| {
        format!(
            "Lower and upper bounds, from a solid within and a solid around the one that was sampled, are given of {}.",
            listed(&bounded)
        )
    })
}

fn resolution(sheet: &Sheet) -> Option<String> {
    let unresolved: Vec<String> =
        sheet.metrics.iter().filter(|metric| metric.status == Status::NotResolved).map(named).collect();
    (!unresolved.is_empty()).then(|| format!("The raster did not resolve {}.", listed(&unresolved)))
}

/// The names of metrics, those of one quantity at one place: `thickness (mean, median)`, `percolation diameter along x, y
/// and z`.
fn together(metrics: &[&Metric]) -> Vec<String> {
    let mut quantities: Vec<(&str, &str, Vec<&Metric>)> = Vec::new();
    for &metric in metrics {
        let (base, joint) = [", ", " along "]
            .into_iter()
            .find_map(|joint| Some((metric.name.rsplit_once(joint)?.0, joint)))
            .unwrap_or((metric.name, ""));
        match quantities.iter_mut().find(|(known, with, _)| *known == base && *with == joint && !joint.is_empty()) {
            Some((_, _, metrics)) => metrics.push(metric),
            None => quantities.push((base, joint, vec![metric])),
        }
    }
    let say = |(base, joint, metrics): (&str, &str, Vec<&Metric>)| match metrics.as_slice() {
        [one] => named(one),
        several => {
            let each: Vec<String> =
                several.iter().map(|metric| metric.name[base.len() + joint.len()..].to_owned()).collect();
            if joint == ", " {
                format!("{base} ({})", each.join(", "))
            } else {
                format!("{base} along {}", listed(&each))
            }
        }
    };
    quantities.into_iter().map(say).collect()
}

/// `mean thickness (Tb.Th)`.
fn named(metric: &Metric) -> String {
    match metric.symbol {
        "" | "–" | "-" => metric.name.to_owned(),
        symbol => format!("{} ({symbol})", metric.name),
    }
}

fn listed(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [all @ .., last] => format!("{} and {last}", all.join(", ")),
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// Lines of a readable length, all but the first indented; with a line end.
fn wrapped(text: &str, indent: &str) -> String {
    let mut lines = String::new();
    let mut width = 0;
    for word in text.split(' ') {
        let letters = word.chars().count();
        if width > 0 && width + 1 + letters > COLUMNS {
            lines += "\n";
            lines += indent;
            width = indent.len();
        } else if width > 0 {
            lines.push(' ');
            width += 1;
        }
        lines += word;
        width += letters;
    }
    lines + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scaffold::fixture;

    #[test]
    fn only_what_was_measured_is_said() {
        let text = methods(&fixture::rich());
        for said in [
            "ldi-ops",
            "9f86d081",
            "256 × 256 × 256",
            "Mean thickness (Tb.Th)",
            "[1] Bouxsein et al. 2010",
            "Lengths are in mm",
        ] {
            assert!(text.contains(said), "{said} is missing: {text}");
        }
        assert_eq!(text.matches("J. Bone Miner. Res.").count(), 1);
        assert!(!text.contains("iffusive tortuosity"), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= COLUMNS || !line.contains(' ')), "{text}");
        let poor = methods(&fixture::poor());
        assert!(
            poor.contains("unit of length is not known") && !poor.contains("Mean thickness") && !poor.contains("NaN")
        );
    }
}
