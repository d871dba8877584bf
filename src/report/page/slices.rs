//! Slices as pictures: the nodes of a plane coloured by local thickness or width, with a scale bar and a colour bar.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use png::{BitDepth, ColorType, Compression, Encoder, EncodingError};

use super::colour;
use super::plot::scale::{Scale, round_length};
use super::plot::svg::{Anchor, Svg};
use super::words;
use crate::report::quantity::Unit;
use crate::report::scaffold_report::{Slice, SliceNode};

/// Least side of a picture, in pixels: nodes become squares of a whole number of pixels.
const LEAST_SIDE: usize = 480;
/// Width of the drawing around it.
const WIDTH: f64 = 340.0;
const BELOW: f64 = 34.0;

/// The phase whose nodes are coloured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    Solid,
    Pore,
}

impl Shown {
    pub const fn map(self) -> &'static [[u8; 3]; 11] {
        match self {
            Shown::Solid => &colour::SOLID,
            Shown::Pore => &colour::PORE,
        }
    }

    fn of(self, node: SliceNode) -> Option<f64> {
        match (self, node) {
            (Shown::Solid, SliceNode::Solid(value)) | (Shown::Pore, SliceNode::Pore(value)) => Some(f64::from(value)),
            _ => None,
        }
    }
}

/// Returns the range of values that the colours cover: the 1st to the 99th percentile of all slices. With a few extremes
/// included, an even scaffold would have one colour.
pub fn range<'s>(slices: impl IntoIterator<Item = &'s Slice>, shown: Shown) -> Option<[f64; 2]> {
    let values = slices.into_iter().flat_map(|slice| &slice.nodes).filter_map(|&node| shown.of(node));
    let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    let [low, high] = [0.01, 0.99].map(|share| values[(share * last as f64).round() as usize]);
    (high > 0.0).then_some(if low < high { [low, high] } else { [0.0, high] })
}

/// Draws one slice with axes and scale bar.
pub fn drawing(slice: &Slice, shown: Shown, range: [f64; 2], length: &Unit) -> String {
    let [columns, rows] = slice.size.map(|side| side.max(1) as f64);
    // The longer side fills the square.
    let pixel = WIDTH / columns.max(rows);
    let (width, height) = (columns * pixel, rows * pixel);
    let left = (WIDTH - width) / 2.0;
    let mut svg = Svg::new(WIDTH, height + BELOW);
    svg.rect("paper", [left, 0.0], [width, height], None);
    let address = format!("data:image/png;base64,{}", STANDARD.encode(png(slice, shown, range)));
    svg.image([left, 0.0], [width, height], &address);
    svg.rect("frame", [left, 0.0], [width, height], None);
    let bar = round_length(columns * slice.pitch * 0.3);
    let pixels = bar / slice.pitch * pixel;
    svg.rect("scale-bar", [left, height + 10.0], [pixels, 4.0], None);
    svg.text("tick", Anchor::Start, [left, height + 29.0], &words::with_unit(bar, length));
    let [across, up] = slice.along;
    svg.text("tick", Anchor::End, [left + width, height + 16.0], &format!("{across} →  {up} ↑"));
    svg.finish(&finding(slice, shown, length))
}

/// Summarises a slice in a sentence.
pub fn finding(slice: &Slice, shown: Shown, length: &Unit) -> String {
    let inside = slice.nodes.iter().filter(|&&node| node != SliceNode::Outside).count();
    let values: Vec<f64> = slice.nodes.iter().filter_map(|&node| shown.of(node)).collect();
    let (what, measure) = match shown {
        Shown::Solid => ("solid", "thickness"),
        Shown::Pore => ("pores", "width"),
    };
    let place = format!("{} = {}", slice.across, words::with_unit(slice.position, length));
    if values.is_empty() || inside == 0 {
        return format!("Slice at {place}: no {what} here.");
    }
    let share = words::significant(100.0 * values.len() as f64 / inside as f64, 3);
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    format!("Slice at {place}: {share}\u{a0}% {what}, of mean {measure} {}.", words::with_unit(mean, length))
}

/// Draws the colour bar of a range of values.
pub fn colour_bar(shown: Shown, range: [f64; 2], length: &Unit) -> String {
    const STEPS: usize = 64;
    let mut svg = Svg::new(WIDTH, 46.0);
    let scale = Scale::new(range, [14.0, WIDTH - 14.0]);
    let [from, to] = scale.places();
    let step = (to - from) / STEPS as f64;
    let pixels: Vec<[u8; 3]> =
        (0..STEPS).map(|i| colour::along(shown.map(), (i as f64 + 0.5) / STEPS as f64)).collect();
    let address = format!("data:image/png;base64,{}", STANDARD.encode(strip(&pixels)));
    svg.image([from, 4.0], [step * STEPS as f64, 14.0], &address);
    svg.rect("frame", [from, 4.0], [to - from, 14.0], None);
    let ticks = scale.ticks(5);
    for (&value, label) in ticks.values.iter().zip(ticks.labels()) {
        svg.line("axis", [scale.at(value), 18.0], [scale.at(value), 22.0]);
        svg.text("tick", Anchor::Middle, [scale.at(value), 36.0], &label);
    }
    let name = match shown {
        Shown::Solid => "thickness",
        Shown::Pore => "width",
    };
    let [least, largest] = range.map(|end| words::with_unit(end, length));
    svg.finish(&format!(
        "Colours of the local {name}: the darkest is {least} and less, the brightest {largest} and more."
    ))
}

/// Colour indices: outside, the other phase, and values from there on.
const OUTSIDE: u8 = 0;
const OTHER: u8 = 1;
const FIRST: u8 = 2;
const GREY: u8 = 128;
const TINT: u8 = 40;

/// Encodes a slice as a PNG file of indexed colours, row 0 of the nodes at the bottom.
fn png(slice: &Slice, shown: Shown, [least, largest]: [f64; 2]) -> Vec<u8> {
    let [columns, rows] = slice.size;
    let times = LEAST_SIDE.div_ceil(columns.max(rows).max(1));
    let levels = f64::from(u8::MAX - FIRST);
    let index = |node: SliceNode| match (shown.of(node), node) {
        (Some(value), _) => FIRST + ((value - least) / (largest - least) * levels).clamp(0.0, levels).round() as u8,
        (None, SliceNode::Outside) => OUTSIDE,
        (None, _) => OTHER,
    };
    let mut pixels = Vec::with_capacity(columns * rows * times * times);
    for row in slice.nodes.chunks(columns.max(1)).take(rows).rev() {
        let line: Vec<u8> = row.iter().flat_map(|&node| std::iter::repeat_n(index(node), times)).collect();
        (0..times).for_each(|_| pixels.extend_from_slice(&line));
    }
    let colours = (0..=u8::MAX - FIRST).flat_map(|level| colour::along(shown.map(), f64::from(level) / levels));
    let palette: Vec<u8> = [GREY; 6].into_iter().chain(colours).collect();
    // Outside is transparent; the other phase is a tint that suits a dark page and a light one.
    encoded(columns * times, rows * times, &pixels, palette, vec![0, TINT])
}

/// Encodes a row of colours as a PNG file.
fn strip(colours: &[[u8; 3]]) -> Vec<u8> {
    let pixels: Vec<u8> = (0..colours.len() as u8).collect();
    encoded(colours.len(), 1, &pixels, colours.concat(), Vec::new())
}

fn encoded(width: usize, height: usize, pixels: &[u8], palette: Vec<u8>, alpha: Vec<u8>) -> Vec<u8> {
    let write = || -> Result<Vec<u8>, EncodingError> {
        let mut file = Vec::new();
        let mut encoder = Encoder::new(&mut file, width as u32, height as u32);
        encoder.set_color(ColorType::Indexed);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_compression(Compression::High);
        encoder.set_palette(palette);
        encoder.set_trns(alpha);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(pixels)?;
        writer.finish()?;
        Ok(file)
    };
    write().expect("memory takes all that is written, and the pixels are as many as the sides say")
}
