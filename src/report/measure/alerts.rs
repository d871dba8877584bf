//! Alerts: facts that limit the trust in a number.

use super::Study;
use super::record::Record;
use crate::grid::Axis;
use crate::mesh::convex_hull;
use crate::metrics::BoundaryCondition;
use crate::number::number;
use crate::report::id::{self, Statistic};
use crate::report::scaffold_report::{Alert, Convergence, Severity, Varied};

/// Share of chords cut by the region above which chord metrics are doubtful.
const CENSORED: f64 = 0.05;

/// Relative change of a metric from twice the pitch above which it is doubtful.
const CHANGE: f64 = 0.01;

/// Least share of its box that the convex hull of a solid fills if the box has cut the solid.
const FILLED: f64 = 0.9;

/// Returns the message that the solid does not fill its box, with its porosity within its convex hull.
///
/// A scaffold cut by a box reaches all its faces and, except for single cells, its edges and corners, so that its convex hull
/// fills it; even 2 × 2 × 2 cells of a primitive sheet, which have none of the corners, fill 94.7 %, and a cylinder 78.5 %.
fn unfilled_box(study: &Study, record: &Record) -> Option<String> {
    let settings = study.settings;
    if study.subject.roi.is_some() || settings.edges == BoundaryCondition::Periodic {
        return None;
    }
    let hull = convex_hull(&study.subject.solid.mesh().positions)?.signed_volume();
    let share = hull / study.region.volume();
    let porosity = 1.0 - record.value(id::VOLUME_SOLID)? / hull;
    let percent = |share: f64| number((1000.0 * share.max(0.0)).round() / 10.0);
    (share < FILLED).then(|| {
        format!(
            "the convex hull of the solid fills {} % of its box, and all of the box that is not solid counts as pores; within the \
             hull the porosity is {} %: measure there with --roi hull, within its outline with --roi wrap:D, or within another solid with --roi FILE",
            percent(share),
            percent(porosity)
        )
    })
}

/// Returns all alerts that follow from the metrics themselves.
pub fn of(study: &Study, record: &Record, convergence: &[Convergence]) -> Vec<Alert> {
    let pitch = study.region.grid().pitch();
    let mut alerts = Vec::new();
    let mut say = |code, severity, message: String| alerts.push(Alert { code, severity, message });
    if !study.subject.solid.is_closed() {
        let (name, rays) = (study.subject.solid.name(), study.images.unclosed());
        let message =
            format!("{name}: the mesh is not closed: {rays} rays do not close and count as empty; repair the mesh");
        say("open", Severity::Warning, message);
    }
    if let Some(message) = unfilled_box(study, record) {
        say("box-not-filled", Severity::Warning, message);
    }
    if study.subject.roi.is_some() && record.value(id::VOLUME_SOLID) == Some(0.0) {
        let message =
            "the region of interest contains no part of the solid; check that both have one unit (--unit) and one place (--transform-roi)".to_owned();
        say("outside", Severity::Warning, message);
    }
    let with_bounds = [id::VOLUME_TOTAL, id::VOLUME_SOLID, id::VOLUME_FRACTION, id::POROSITY];
    let outside: Vec<&str> = with_bounds.into_iter().filter(|&id| record.is_unresolved(id)).map(|id| id.id).collect();
    if !outside.is_empty() {
        let names = outside.join(", ");
        let message = format!(
            "values from rays lie outside their bounds ({names}), as may all metrics that follow from them: the raster is too coarse; \
             raise --resolution"
        );
        say("outside-bounds", Severity::Warning, message);
    }
    if let Some(thin) = record.value(id::SOLID_THICKNESS.of(Statistic::P5)).filter(|thin| *thin < 3.0 * pitch) {
        say(
            "thin-walls",
            Severity::Warning,
            format!(
                "5 % of the solid is thinner than {} pitches, and walls below 3 are not resolved; raise --resolution",
                number((thin / pitch * 100.0).round() / 100.0)
            ),
        );
    }
    if let Some(narrow) = record.value(id::PORE_THICKNESS.of(Statistic::P5)).filter(|narrow| *narrow < 3.0 * pitch) {
        let pitches = number((narrow / pitch * 100.0).round() / 100.0);
        say(
            "narrow-pores",
            Severity::Note,
            format!(
                "5 % of the pore volume is narrower than {pitches} pitches, and pores below 3 are not resolved; raise --resolution"
            ),
        );
    }
    let cut = Axis::ALL.into_iter().filter_map(|axis| {
        let share = record.value(id::CHORD_CENSORED.along(axis)).filter(|share| *share > CENSORED)?;
        Some(format!("{} % along {}", number((share * 1000.0).round() / 10.0), axis.name()))
    });
    let cut: Vec<String> = cut.collect();
    if !cut.is_empty() {
        let message = format!(
            "the region cuts chords, which the distributions leave out: {}; a larger --roi cuts fewer",
            cut.join(", ")
        );
        say("censored-chords", Severity::Note, message);
    }
    for study in convergence.iter().filter(|study| study.over == Varied::Pitch) {
        for series in &study.series {
            let [.., Some(coarse), Some(fine)] = series.values[..] else { continue };
            // The change of a share is relative to 1.
            let whole = if series.metric == id::POROSITY { 1.0 } else { fine.abs().max(f64::MIN_POSITIVE) };
            let change = (fine - coarse).abs() / whole;
            if change > CHANGE {
                let percent = number((change * 1000.0).round() / 10.0);
                say(
                    "not-converged",
                    if change > 0.1 { Severity::Warning } else { Severity::Note },
                    format!(
                        "{} changes by {percent} % from twice the pitch to the pitch; raise --resolution",
                        series.metric.name
                    ),
                );
            }
        }
    }
    let pieces = record.value(id::BETTI_0).unwrap_or(0.0);
    if pieces > 1.0 {
        let largest = record.value(id::PIECE_LARGEST).unwrap_or(0.0);
        say(
            "loose-pieces",
            Severity::Note,
            format!(
                "the solid within the region is in {pieces} pieces; the largest has {} % of it",
                number(100.0 * largest)
            ),
        );
    }
    alerts
}
