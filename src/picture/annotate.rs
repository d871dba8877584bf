//! Annotations of a figure: a scale bar, axes, captions.

use glam::{DMat3, DVec3};

use super::camera::Camera;
use super::canvas::{Canvas, Colour};
use super::text::Type;

/// The largest share of a picture's width that a scale bar may take.
const BAR: f64 = 0.2;

/// A scale bar: a round length in the units of the view and in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScaleBar {
    /// The length, 1, 2 or 5 times a power of ten, in the units of the view.
    pub length: f64,
    /// The same length in pixels.
    pub pixels: f64,
}

impl ScaleBar {
    /// Returns the longest bar of a round length that is at most a fifth as wide as the picture.
    pub fn of(camera: &Camera) -> ScaleBar {
        let most = BAR * f64::from(camera.format().width) * camera.pixel();
        let exponent = most.log10().floor() as i32;
        // One power less, in case the logarithm was rounded up.
        let lengths = (exponent - 1..=exponent).flat_map(|e| [1.0, 2.0, 5.0].map(|m| m * power_of_ten(e)));
        let length = lengths.filter(|&length| length <= most * (1.0 + 1e-12)).fold(0.0, f64::max);
        ScaleBar { length, pixels: length / camera.pixel() }
    }
}

/// Returns 10^`exponent`, rounded to the nearest number.
fn power_of_ten(exponent: i32) -> f64 {
    if exponent < 0 { 1.0 / 10f64.powi(-exponent) } else { 10f64.powi(exponent) }
}

/// One line of a caption, optionally after a colour patch.
#[derive(Clone, Debug, PartialEq)]
pub struct CaptionLine {
    /// The patch.
    pub patch: Option<Colour>,
    /// The text.
    pub text: String,
}

/// Draws the annotations of one picture, scaled to its size.
pub struct Annotator<'c> {
    canvas: &'c mut Canvas,
    letters: Type,
    /// The unit of all lengths: about a fiftieth of the picture's shorter side.
    unit: f64,
}

impl<'c> Annotator<'c> {
    /// Creates an annotator for a picture.
    pub fn new(canvas: &'c mut Canvas) -> Annotator<'c> {
        let unit = (f64::from(canvas.width().min(canvas.height())) / 48.0).max(7.0);
        Annotator { canvas, letters: Type::of_size(1.22 * unit), unit }
    }

    /// Returns the distance of annotations from the edge of the picture.
    fn margin(&self) -> f64 {
        1.5 * self.unit
    }

    /// Covers what lies behind a scale bar.
    pub fn plate(&mut self, bar: ScaleBar, label: &str) {
        let (margin, height) = (self.margin(), f64::from(self.canvas.height()));
        let width = bar.pixels.max(self.letters.width(label));
        let paper = self.canvas.background().colour();
        let top = height - margin - self.letters.height() - 1.6 * self.unit;
        self.canvas.rectangle([0.5 * margin, top], [1.5 * margin + width, height - 0.5 * margin], paper, 0.85);
    }

    /// Draws a scale bar at the lower left, with its length above it.
    pub fn scale_bar(&mut self, bar: ScaleBar, label: &str) {
        let ink = self.canvas.background().ink();
        let (left, bottom) = (self.margin(), f64::from(self.canvas.height()) - self.margin());
        let thick = (0.22 * self.unit).max(2.0).round();
        let bottom = bottom.round();
        self.canvas.rectangle([left, bottom - thick], [left + bar.pixels, bottom], ink, 1.0);
        let baseline = bottom - thick - 0.45 * self.unit;
        let middle = left + 0.5 * (bar.pixels - self.letters.width(label)).max(0.0);
        self.letters.draw(self.canvas, [middle, baseline], label, ink);
    }

    /// Draws the axes x, y and z of the view at the lower right.
    pub fn axes(&mut self, rotation: DMat3) {
        let length = 2.1 * self.unit;
        let reach = length + 1.1 * self.unit;
        let (width, height) = (f64::from(self.canvas.width()), f64::from(self.canvas.height()));
        let origin = [width - self.margin() - reach, height - self.margin() - reach];
        let axes = [(DVec3::X, "x", 0xc8453b), (DVec3::Y, "y", 0x3f8f4f), (DVec3::Z, "z", 0x3a6fb8)];
        let mut axes = axes.map(|(axis, name, colour)| (rotation * axis, name, Colour::srgb(colour)));
        // Axes that point away are drawn first.
        axes.sort_by(|a, b| a.0.z.total_cmp(&b.0.z));
        let ink = self.canvas.background().ink();
        for (axis, name, colour) in axes {
            let flat = axis.truncate();
            let tip = [origin[0] + length * flat.x, origin[1] - length * flat.y];
            self.canvas.stroke(origin, tip, 0.2 * self.unit, colour, 1.0);
            // An axis along the line of sight is a dot without a name.
            if flat.length() < 0.2 {
                self.canvas.stroke(origin, origin, 0.45 * self.unit, colour, 1.0);
                continue;
            }
            let away = flat.normalize() * 0.62 * self.unit;
            let middle = [tip[0] + away.x, tip[1] - away.y];
            let at = [middle[0] - 0.5 * self.letters.width(name), middle[1] + 0.36 * self.letters.height()];
            self.letters.draw(self.canvas, at, name, ink);
        }
    }

    /// Draws lines of text at the upper left.
    pub fn caption(&mut self, lines: &[CaptionLine]) {
        let ink = self.canvas.background().ink();
        let height = self.letters.height();
        let mut baseline = self.margin() + height;
        for line in lines {
            let mut left = self.margin();
            if let Some(patch) = line.patch {
                let (top, side) = ((baseline - height).round(), height.round());
                self.canvas.rectangle([left, top], [left + 1.4 * side, top + side], patch, 1.0);
                left += 1.4 * side + 0.6 * self.unit;
            }
            self.letters.draw(self.canvas, [left, baseline], &line.text, ink);
            baseline += 1.6 * self.unit;
        }
    }

    /// Draws a ring about a point given in pixels, on a wider one in the colour of the background.
    pub fn ring(&mut self, [x, y]: [f64; 2], radius: f64) {
        const CORNERS: usize = 32;
        let ink = self.canvas.background().ink();
        let corner = |i: usize| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / CORNERS as f64).sin_cos();
            [x + radius * cos, y + radius * sin]
        };
        let paper = self.canvas.background().colour();
        for (width, colour) in [(4.5, paper), (1.6, ink)] {
            (0..CORNERS).for_each(|i| self.canvas.stroke(corner(i), corner(i + 1), width, colour, 1.0));
        }
    }

    /// Draws a faint closed line through corners given in pixels.
    pub fn outline(&mut self, corners: &[[f64; 2]]) {
        let ink = self.canvas.background().ink();
        for (i, &from) in corners.iter().enumerate() {
            self.canvas.stroke(from, corners[(i + 1) % corners.len()], 1.0, ink, 0.22);
        }
    }
}
