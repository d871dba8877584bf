//! methods.txt: a methods paragraph for a paper. It covers only measured metrics.

use crate::report::page::words;
use crate::report::quantity::Quantity;
use crate::report::scaffold_report::{InputFile, Metric, ScaffoldReport, Status};

/// Longest line, in characters.
const COLUMNS: usize = 100;

/// Families of metrics with one method: the beginnings of their ids, and the text; `{…}` stands for a parameter of one of them.
const FAMILIES: [(&[&str], &str); 11] = [
    (
        &["volume.", "porosity"],
        "Volumes and porosity are integrals along the rays; open pores are those that are reached from the faces \
      of the region through faces of nodes",
    ),
    (&["surface."], "Surface is summed over the facets of the mesh, without what the region cuts"),
    (
        &["solid.thickness", "pore.thickness", "wall."],
        "Thickness (Tb.Th) and pore width (Tb.Sp) are, at each node, the diameter of the \
      largest ball in the phase that holds it, with distances to where rays cross the surface and centres not bound to the raster",
    ),
    (
        &["pore.access", "percolation", "access."],
        "Access-limited pore sizes and percolation diameters are those of the largest balls that \
      get there from the faces of the region, and from face to face",
    ),
    (&["chord."], "Chords are the segments of the rays within a phase"),
    (
        &["anisotropy", "intercept."],
        "Mean intercept lengths follow from the facets in closed form, and the degree of anisotropy \
      1 − (c/a)² from the ellipsoid fitted to them",
    ),
    (
        &["euler", "betti.", "connectivity"],
        "The Euler characteristic counts corners, edges, faces and cubes of nodes, 26-connected in the \
      solid and 6-connected in the pores, and connectivity density is (1 − Δχ)/TV",
    ),
    (
        &["tortuosity."],
        "Geodesic tortuosity was found by fast marching and diffusive tortuosity by solving Laplace's equation with \
      conjugate gradients, on nodes {pitch} apart",
    ),
    (&["permeability"], "Permeability is the Kozeny–Carman estimate φ³/(K (BS/TV)²) with K = {K}"),
    (
        &["overhang"],
        "Overhanging is surface that faces down at less than {angle from the horizontal, degrees}° from the horizontal",
    ),
    (&["centroid.", "inertia."], "Centroids and inertia are integrals along the rays"),
];

/// Returns the paragraph and the references.
pub fn methods(report: &ScaffoldReport) -> String {
    let measured: Vec<&Metric> = report.metrics.iter().filter(|metric| is_measured(metric)).collect();
    let mut sources = Vec::new();
    let mut sentences = vec![what(report), raster(report), edges(report)];
    for (ids, text) in FAMILIES {
        let family: Vec<&Metric> =
            measured.iter().copied().filter(|metric| ids.iter().any(|id| metric.id.starts_with(id))).collect();
        sentences.extend(how(&family, text, &mut sources));
    }
    sentences.extend(bounds(&measured));
    sentences.extend(resolution(report));
    let mut text = wrapped(&sentences.join(" "), "");
    if !sources.is_empty() {
        text += "\nSources\n";
        for (i, source) in sources.iter().enumerate() {
            text += &wrapped(&format!("[{}] {source}", i + 1), "  ");
        }
    }
    text
}

/// Returns the method of a family, with its reference; `None` if nothing of it was measured.
fn how<'s>(family: &[&'s Metric], text: &str, sources: &mut Vec<&'s str>) -> Option<String> {
    let reference = family.iter().map(|metric| metric.reference).find(|reference| !reference.is_empty());
    let mut text = text.to_owned();
    for (name, value) in family.iter().flat_map(|metric| &metric.parameters) {
        text = text.replace(&format!("{{{name}}}"), value);
    }
    family.first()?;
    let Some(reference) = reference.filter(|reference| reference.contains(|c: char| c.is_ascii_digit())) else {
        return Some(text + ".");
    };
    let known = sources.iter().position(|source| *source == reference);
    let number = known.unwrap_or_else(|| {
        sources.push(reference);
        sources.len() - 1
    });
    Some(format!("{text} [{}].", number + 1))
}

fn is_measured(metric: &Metric) -> bool {
    metric.status != Status::NotApplicable && metric.value.is_some_and(f64::is_finite)
}

fn what(report: &ScaffoldReport) -> String {
    let inputs = &report.provenance.inputs;
    let of_role = |role: &str| inputs.iter().find(|input| input.role == role);
    let described = |input: &InputFile| {
        let InputFile { path, triangles, sha256, .. } = input;
        format!("{path} ({} triangles, SHA-256 {sha256})", words::count(*triangles))
    };
    let solid = of_role("solid").map_or(report.title.clone(), described);
    let region = match (of_role("roi"), report.provenance.region.as_str()) {
        (Some(roi), _) => format!("the volume that {} bounds", described(roi)),
        (None, "hull") => "the convex hull of the solid".to_owned(),
        (None, region) => match region.strip_prefix("wrap:") {
            Some(diameter) => {
                format!("the closing of the solid by a ball of diameter {diameter}, its enclosed pores filled")
            }
            None => "the bounding box of the solid".to_owned(),
        },
    };
    let unit = match report.unit {
        Some(unit) => format!("Lengths are in {}.", unit.symbol()),
        None => "The unit of length is not known; lengths are in units of the file.".to_owned(),
    };
    let version = report.provenance.version;
    format!("The solid {solid} was analysed with ldi-ops {version} within {region}. {unit}")
}

fn raster(report: &ScaffoldReport) -> String {
    let [x, y, z] = report.provenance.rays;
    let pitch = words::with_unit(report.provenance.pitch, &Quantity::Length(1).of(report.unit));
    format!(
        "Layered depth images of its surface were sampled along x, y and z, with rays {pitch} apart ({x} × {y} × {z} nodes \
         where the rays of the three axes meet)."
    )
}

fn edges(report: &ScaffoldReport) -> String {
    match report.provenance.edges {
        "periodic" => "The region was taken as a cell that repeats in all directions.".to_owned(),
        "border" => "The boundary of the region was taken as a wall: balls of either phase lie within it.".to_owned(),
        "clip" => {
            "Where the region ends, nothing was assumed: balls touch the surface alone and may reach beyond.".to_owned()
        }
        other => format!("Boundary condition of the region: {other}."),
    }
}

fn bounds(measured: &[&Metric]) -> Option<String> {
    let bounded = measured.iter().any(|metric| metric.lower.is_some() && metric.upper.is_some());
    bounded.then(|| {
        "Lower and upper values of volume, porosity, percolation and the thinnest wall are those of the cubes of nodes that lie in the \
         solid, and of all that its surface meets."
            .to_owned()
    })
}

fn resolution(report: &ScaffoldReport) -> Option<String> {
    let unresolved: Vec<String> =
        report.metrics.iter().filter(|metric| metric.status == Status::NotResolved).map(named).collect();
    (!unresolved.is_empty()).then(|| format!("The raster did not resolve {}.", listed(&unresolved)))
}

/// Returns the name with its symbol: `mean thickness (Tb.Th)`.
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

/// Wraps a text at `COLUMNS`, with all lines but the first indented and a line end.
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
    use crate::report::{fixture, id};

    #[test]
    fn every_family_has_metrics() {
        for start in FAMILIES.iter().flat_map(|(starts, _)| *starts) {
            assert!(id::all().any(|id| id.id.starts_with(start)), "{start}");
        }
    }

    #[test]
    fn only_what_was_measured_is_said() {
        let text = methods(&fixture::rich());
        for said in [
            "ldi-ops",
            "9f86d081",
            "256 × 256 × 256",
            "Thickness (Tb.Th)",
            "[1] Bouxsein et al. 2010",
            "Lengths are in mm",
        ] {
            assert!(text.contains(said), "{said} is missing: {text}");
        }
        assert_eq!(text.matches("J. Bone Miner. Res.").count(), 1);
        assert!(!text.contains("{"), "{text}");
        assert!(text.split_whitespace().count() < 400, "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= COLUMNS || !line.contains(' ')), "{text}");
        let poor = methods(&fixture::poor());
        assert!(poor.contains("unit of length is not known") && !poor.contains("{pitch}") && !poor.contains("NaN"));
    }
}
