//! Histograms of distributions, one alone or two overlaid.

use super::{AxisOf, Frame, Mark};
use crate::report::page::words;
use crate::report::scaffold_report::HistogramPlot;

/// Draws one distribution as bars, with its mean and percentiles.
pub fn histogram(plot: &HistogramPlot) -> String {
    let marks = marks(plot);
    let largest = plot.shares.iter().copied().fold(0.0, f64::max);
    let x = axis_title(plot);
    let mut frame = Frame::new(
        &AxisOf { title: &x, range: plot.range },
        &AxisOf { title: "Share (%)", range: [0.0, 100.0 * largest * 1.04] },
        marks,
    );
    let class = if plot.phase == "pore" { "bar pore" } else { "bar solid" };
    for (i, &share) in plot.shares.iter().enumerate() {
        let [from, to] = bin(plot, i);
        let says = format!("{}: {}\u{a0}%", span(plot, [from, to]), words::significant(100.0 * share, 3));
        let ([left, top], [right, bottom]) = (frame.at([from, 100.0 * share]), frame.at([to, 0.0]));
        frame.svg.rect(class, [left, top], [right - left, bottom - top], None);
        frame.hint([from, to], says);
    }
    frame.finish(&finding(plot))
}

/// Draws two distributions as outlines, in shares per unit, so that bins of different widths compare.
pub fn histograms(plots: [&HistogramPlot; 2]) -> String {
    let ranges = plots.map(|plot| plot.range);
    let range = [ranges[0][0].min(ranges[1][0]), ranges[0][1].max(ranges[1][1])];
    let heights = plots.map(|plot| {
        let [from, to] = bin(plot, 0);
        let width = to - from;
        plot.shares.iter().map(|share| 100.0 * share / width).collect::<Vec<_>>()
    });
    let largest = heights.iter().flatten().copied().fold(0.0, f64::max);
    let unit = plots[0].unit.for_people();
    let mut frame = Frame::new(
        &AxisOf { title: &axis_title(plots[0]), range },
        &AxisOf {
            title: &if unit.is_empty() { "Density (%)".to_owned() } else { format!("% per {unit}") },
            range: [0.0, largest * 1.04],
        },
        means(plots),
    );
    for ((plot, heights), class) in plots.into_iter().zip(&heights).zip(["series a", "series b"]) {
        let mut points = vec![frame.at([plot.range[0], 0.0])];
        for (i, &height) in heights.iter().enumerate() {
            let [from, to] = bin(plot, i);
            points.extend([frame.at([from, height]), frame.at([to, height])]);
        }
        points.push(frame.at([plot.range[1], 0.0]));
        frame.svg.polyline(class, points);
    }
    frame.finish(&format!("A: {} B: {}", finding(plots[0]), finding(plots[1])))
}

/// Summarises a distribution in a sentence.
pub fn finding(plot: &HistogramPlot) -> String {
    let HistogramPlot { title, unit, mean, deviation, .. } = plot;
    let mut text = format!("{title}: mean {}", words::with_unit(*mean, unit));
    if deviation.is_finite() {
        text += &format!(", standard deviation {}", words::with_unit(*deviation, unit));
    }
    let at = |share: f64| plot.quantiles.iter().find(|(of, _)| (of - share).abs() < 1e-9).map(|&(_, value)| value);
    if let (Some(low), Some(high)) = (at(0.05), at(0.95)) {
        text += &format!("; nine tenths lie between {} and {}", words::value(low, unit), words::with_unit(high, unit));
    }
    text + "."
}

fn marks(plot: &HistogramPlot) -> Vec<Mark> {
    let mean =
        Mark { at: plot.mean, label: format!("mean {}", words::value(plot.mean, &plot.unit)), class: "mark mean" };
    let quantiles = plot.quantiles.iter().map(|&(share, value)| Mark {
        at: value,
        label: format!("p{}", words::significant(100.0 * share, 3)),
        class: "mark quantile",
    });
    std::iter::once(mean).chain(quantiles).filter(|mark| mark.at.is_finite()).collect()
}

fn means(plots: [&HistogramPlot; 2]) -> Vec<Mark> {
    let named = plots.into_iter().zip([("mean A", "mark a"), ("mean B", "mark b")]);
    let marks = named.map(|(plot, (label, class))| Mark { at: plot.mean, label: label.to_owned(), class });
    marks.filter(|mark| mark.at.is_finite()).collect()
}

fn bin(plot: &HistogramPlot, i: usize) -> [f64; 2] {
    let [low, high] = plot.range;
    let count = plot.shares.len().max(1) as f64;
    [i, i + 1].map(|i| low + (high - low) * i as f64 / count)
}

fn span(plot: &HistogramPlot, [from, to]: [f64; 2]) -> String {
    format!("{} to {}", words::value(from, &plot.unit), words::with_unit(to, &plot.unit))
}

fn axis_title(plot: &HistogramPlot) -> String {
    match plot.unit.for_people().as_str() {
        "" => plot.title.clone(),
        unit => format!("{} ({unit})", plot.title),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture;

    #[test]
    fn outlines_of_two_distributions_rise_above_the_axis() {
        let plots = fixture::rich().histograms;
        let text = histograms([&plots[0], &plots[1]]);
        let outlines: Vec<&str> = text.split(r#"<polyline class="series"#).skip(1).collect();
        assert_eq!(outlines.len(), 2);
        for outline in outlines {
            let points = outline.split_once(r#"points=""#).unwrap().1.split_once('"').unwrap().0;
            let heights = || points.split(' ').map(|point| point.split_once(',').unwrap().1.parse::<f64>().unwrap());
            let (top, floor) = (heights().fold(f64::INFINITY, f64::min), heights().fold(0.0, f64::max));
            assert!(floor - top > 20.0, "an outline of height {}: {points}", floor - top);
        }
    }
}
