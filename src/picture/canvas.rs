//! Pixels in linear light, and antialiased drawing on them.

use glam::Vec3;

/// A colour in linear light: red, green and blue of sRGB's primaries, from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colour(pub Vec3);

impl Colour {
    /// Returns the colour of an sRGB code, as in `0xRRGGBB`.
    pub fn srgb(code: u32) -> Colour {
        let channel = |shift: u32| linear((code >> shift & 0xff) as f32 / 255.0);
        Colour(Vec3::new(channel(16), channel(8), channel(0)))
    }

    /// Interpolates linearly to another colour: 0 returns this one, 1 the other.
    pub fn mix(self, other: Colour, share: f32) -> Colour {
        Colour(self.0.lerp(other.0, share))
    }
}

/// Converts an sRGB value from 0 to 1 to linear light.
fn linear(value: f32) -> f32 {
    if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// Converts linear light from 0 to 1 to an sRGB value.
pub(super) fn encoded(light: f32) -> f32 {
    if light <= 0.003_130_8 { light * 12.92 } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

/// The background of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Background {
    /// A light grey, on which both white and dark objects show.
    Light,
    /// White.
    White,
    /// Nearly black.
    Dark,
    /// Transparent: the picture has an alpha channel.
    Transparent,
}

impl Background {
    /// Returns the colour; for a transparent background the colour against which annotations are legible.
    pub fn colour(self) -> Colour {
        match self {
            Background::Light => Colour::srgb(0xf3f4f6),
            Background::White | Background::Transparent => Colour::srgb(0xff_ffff),
            Background::Dark => Colour::srgb(0x14171c),
        }
    }

    /// Returns the colour of text and lines on it.
    pub fn ink(self) -> Colour {
        match self {
            Background::Light | Background::White | Background::Transparent => Colour::srgb(0x2a2f38),
            Background::Dark => Colour::srgb(0xe4e7ec),
        }
    }
}

/// A picture: rows from top to bottom, each pixel red, green, blue and alpha in linear light, premultiplied by alpha.
#[derive(Clone, Debug, PartialEq)]
pub struct Canvas {
    width: u32,
    height: u32,
    background: Background,
    pixels: Vec<[f32; 4]>,
}

impl Canvas {
    /// Creates an empty picture.
    pub fn new(width: u32, height: u32, background: Background) -> Canvas {
        let Colour(c) = background.colour();
        let pixel = match background {
            Background::Transparent => [0.0; 4],
            _ => [c.x, c.y, c.z, 1.0],
        };
        Canvas { width, height, background, pixels: vec![pixel; width as usize * height as usize] }
    }

    /// Returns the number of pixels from left to right.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Returns the number of pixels from top to bottom.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Returns the background.
    pub fn background(&self) -> Background {
        self.background
    }

    /// Returns all pixels, row after row.
    pub fn pixels(&self) -> &[[f32; 4]] {
        &self.pixels
    }

    /// Blends a picture of the same size over this one, as transparent as `1 − share`.
    pub fn lay_over(&mut self, top: &Canvas, share: f32) {
        for (pixel, above) in self.pixels.iter_mut().zip(&top.pixels) {
            let rest = 1.0 - share * above[3];
            *pixel = [0, 1, 2, 3].map(|i| share * above[i] + rest * pixel[i]);
        }
    }

    /// Returns the rows, which can be filled in parallel.
    pub(super) fn rows_mut(&mut self) -> std::slice::ChunksMut<'_, [f32; 4]> {
        self.pixels.chunks_mut(self.width as usize)
    }

    /// Blends a colour into a pixel by a share of coverage; pixels outside the picture are ignored.
    pub(super) fn cover(&mut self, x: i64, y: i64, colour: Colour, share: f32) {
        if (0..i64::from(self.width)).contains(&x) && (0..i64::from(self.height)).contains(&y) {
            let pixel = &mut self.pixels[y as usize * self.width as usize + x as usize];
            *pixel = over(*pixel, colour, share);
        }
    }

    /// Fills an axis-aligned rectangle, in pixels from the upper left corner; edges between pixels cover a share of them.
    pub(super) fn rectangle(&mut self, from: [f64; 2], to: [f64; 2], colour: Colour, share: f32) {
        let length = |pixel: i64, from: f64, to: f64| (to.min(pixel as f64 + 1.0) - from.max(pixel as f64)).max(0.0);
        for y in from[1].floor() as i64..to[1].ceil() as i64 {
            for x in from[0].floor() as i64..to[0].ceil() as i64 {
                let covered = length(x, from[0], to[0]) * length(y, from[1], to[1]);
                self.cover(x, y, colour, share * covered as f32);
            }
        }
    }

    /// Draws a straight stroke with round ends.
    pub(super) fn stroke(&mut self, from: [f64; 2], to: [f64; 2], width: f64, colour: Colour, share: f32) {
        let reach = 0.5 * width + 1.0;
        let along = [to[0] - from[0], to[1] - from[1]];
        let squared = (along[0] * along[0] + along[1] * along[1]).max(1e-12);
        let range = |i: usize| (from[i].min(to[i]) - reach).floor() as i64..(from[i].max(to[i]) + reach).ceil() as i64;
        for y in range(1) {
            for x in range(0) {
                let at = [x as f64 + 0.5 - from[0], y as f64 + 0.5 - from[1]];
                let t = ((at[0] * along[0] + at[1] * along[1]) / squared).clamp(0.0, 1.0);
                let distance = (at[0] - t * along[0]).hypot(at[1] - t * along[1]);
                let covered = (0.5 * width + 0.5 - distance).clamp(0.0, 1.0);
                self.cover(x, y, colour, share * covered as f32);
            }
        }
    }
}

/// Blends a colour over a pixel by a share of coverage.
fn over(pixel: [f32; 4], Colour(c): Colour, share: f32) -> [f32; 4] {
    let rest = 1.0 - share;
    [
        c.x * share + pixel[0] * rest,
        c.y * share + pixel[1] * rest,
        c.z * share + pixel[2] * rest,
        share + pixel[3] * rest,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_survive_srgb_encoding() {
        for code in [0, 0x0a, 0x7f, 0xff] {
            let Colour(c) = Colour::srgb(code << 16 | code);
            assert!((encoded(c.x) * 255.0 - code as f32).abs() < 1e-3 && c.y == 0.0 && c.z == c.x);
        }
    }

    #[test]
    fn a_rectangle_covers_its_area() {
        let mut canvas = Canvas::new(10, 10, Background::Transparent);
        canvas.rectangle([1.25, 2.5], [4.0, 7.75], Colour::srgb(0xff0000), 1.0);
        let covered: f32 = canvas.pixels().iter().map(|pixel| pixel[3]).sum();
        assert!((covered - 2.75 * 5.25).abs() < 1e-4, "{covered}");
    }

    #[test]
    fn a_stroke_covers_about_its_area_and_stays_inside_the_picture() {
        let mut canvas = Canvas::new(40, 40, Background::Transparent);
        canvas.stroke([10.0, 10.0], [30.0, 25.0], 4.0, Colour::srgb(0), 1.0);
        let covered: f32 = canvas.pixels().iter().map(|pixel| pixel[3]).sum();
        let expected = 4.0 * 25.0 + std::f32::consts::PI * 4.0;
        assert!((covered - expected).abs() < 3.0, "{covered} for {expected}");
        canvas.stroke([-50.0, 5.0], [90.0, 5.0], 2.0, Colour::srgb(0), 1.0);
    }
}
