//! Plots of porosity profiles, slice by slice.

use super::{AxisOf, Frame};
use crate::report::page::words;
use crate::report::quantity::{Quantity, Unit};
use crate::report::scaffold_report::Profile;

/// Draws the profile along one axis, in a frame that fits all of `profiles`.
pub fn profile(profile: &Profile, profiles: &[Profile], length: &Unit) -> String {
    let mut frame = frame(&[profile], range(profiles), length);
    draw(&mut frame, profile, "series pore");
    if let Some(mean) = mean(profile) {
        let [left, right] = frame.x.places();
        let at = frame.y.within(100.0 * mean);
        frame.svg.line("mark mean", [left, at], [right, at]);
    }
    for (i, (&position, &porosity)) in profile.positions.iter().zip(&profile.porosity).enumerate() {
        let last = profile.positions.len() - 1;
        let ends = [i.saturating_sub(1), (i + 1).min(last)].map(|j| (profile.positions[j] + position) / 2.0);
        let says = format!("{}: {}", words::with_unit(position, length), words::maybe(Some(porosity), &share()));
        frame.hint(ends, says);
    }
    frame.finish(&finding(profile))
}

/// Draws the profiles of two solids along the same axis.
pub fn profiles(profiles: [&Profile; 2], length: &Unit) -> String {
    let mut frame = frame(&profiles, range(profiles), length);
    for (profile, class) in profiles.into_iter().zip(["series a", "series b"]) {
        draw(&mut frame, profile, class);
    }
    frame.finish(&format!("A: {} B: {}", finding(profiles[0]), finding(profiles[1])))
}

/// Summarises a profile in a sentence.
pub fn finding(profile: &Profile) -> String {
    let axis = profile.axis;
    let known = || profile.porosity.iter().copied().filter(|value| value.is_finite());
    let (Some(mean), low, high) = (mean(profile), known().fold(f64::INFINITY, f64::min), known().fold(0.0, f64::max))
    else {
        return format!("Along {axis}: no slice has an area.");
    };
    let [mean, low, high] = [mean, low, high].map(|value| words::value(value, &share()));
    format!("Along {axis}: mean {mean}\u{a0}%, from {low} to {high}\u{a0}%.")
}

fn share() -> Unit {
    Quantity::Share.of(None)
}

/// Returns the mean over slices with a value.
fn mean(profile: &Profile) -> Option<f64> {
    let known: Vec<f64> = profile.porosity.iter().copied().filter(|value| value.is_finite()).collect();
    (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
}

/// Returns the range of porosities of profiles, rounded outwards to tenths, in percent.
fn range<'p>(profiles: impl IntoIterator<Item = &'p Profile>) -> [f64; 2] {
    let known = profiles.into_iter().flat_map(|profile| &profile.porosity).copied().filter(|value| value.is_finite());
    let [low, high] = known.fold([1.0, 0.0], |[low, high]: [f64; 2], value| [low.min(value), high.max(value)]);
    if low > high {
        return [0.0, 100.0];
    }
    [(10.0 * low).floor().max(0.0), (10.0 * high).ceil().min(10.0)].map(|tenths| 10.0 * tenths)
}

fn frame(profiles: &[&Profile], range_of_porosity: [f64; 2], length: &Unit) -> Frame {
    let positions = || profiles.iter().flat_map(|profile| profile.positions.iter().copied());
    let range = [positions().fold(f64::INFINITY, f64::min), positions().fold(f64::NEG_INFINITY, f64::max)];
    let range = if range[0] <= range[1] { range } else { [0.0, 1.0] };
    let title = format!("Position along {} ({})", profiles[0].axis, length.for_people());
    Frame::new(
        &AxisOf { title: &title, range },
        &AxisOf { title: "Porosity (%)", range: range_of_porosity },
        Vec::new(),
    )
}

/// Draws a profile; the line is broken where a slice has no value.
fn draw(frame: &mut Frame, profile: &Profile, class: &str) {
    let points: Vec<[f64; 2]> =
        profile.positions.iter().copied().zip(profile.porosity.iter().copied()).map(|(x, y)| [x, y]).collect();
    for run in points.split(|[_, porosity]| !porosity.is_finite()).filter(|run| !run.is_empty()) {
        let places: Vec<_> = run.iter().map(|&[x, y]| frame.at([x, 100.0 * y])).collect();
        frame.svg.polyline(class, places);
    }
}
