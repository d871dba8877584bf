//! Lines of text in DejaVu Sans, whose licence permits embedding and which has the letters of units (µ).

use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};

use super::canvas::{Canvas, Colour};

/// A typeface at one size.
pub(super) struct Type {
    font: FontRef<'static>,
    /// The height from the deepest descender to the highest ascender, in pixels.
    size: f32,
}

impl Type {
    pub fn of_size(size: f64) -> Type {
        let font = FontRef::try_from_slice(dejavu::sans::regular()).expect("the embedded font is sound");
        Type { font, size: size as f32 }
    }

    /// Returns the width of a line, in pixels.
    pub fn width(&self, text: &str) -> f64 {
        let (_, end) = self.lay(text);
        f64::from(end)
    }

    /// Returns the height of capitals and digits, in pixels.
    pub fn height(&self) -> f64 {
        // DejaVu Sans: 1493 of 2384 units.
        f64::from(self.size) * 0.626
    }

    /// Draws a line whose baseline starts at `at`.
    pub fn draw(&self, canvas: &mut Canvas, at: [f64; 2], text: &str, colour: Colour) {
        let (glyphs, _) = self.lay(text);
        for mut glyph in glyphs {
            glyph.position.x += at[0] as f32;
            glyph.position.y = at[1] as f32;
            let Some(outline) = self.font.outline_glyph(glyph) else { continue };
            let (left, top) = (outline.px_bounds().min.x as i64, outline.px_bounds().min.y as i64);
            outline.draw(|x, y, share| canvas.cover(left + i64::from(x), top + i64::from(y), colour, share.min(1.0)));
        }
    }

    /// Returns the glyphs of a line that begins at 0, and its end.
    fn lay(&self, text: &str) -> (Vec<Glyph>, f32) {
        let font = self.font.as_scaled(PxScale::from(self.size));
        let (mut glyphs, mut x) = (Vec::<Glyph>::new(), 0.0);
        for letter in text.chars() {
            let id = font.glyph_id(letter);
            if let Some(before) = glyphs.last() {
                x += font.kern(before.id, id);
            }
            glyphs.push(id.with_scale_and_position(self.size, point(x, 0.0)));
            x += font.h_advance(id);
        }
        (glyphs, x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::canvas::Background;

    #[test]
    fn drawn_text_has_the_stated_extent() {
        let letters = Type::of_size(30.0);
        let mut canvas = Canvas::new(200, 60, Background::Transparent);
        letters.draw(&mut canvas, [10.0, 40.0], "100 µm", Colour::srgb(0));
        let covered = |x: usize, y: usize| canvas.pixels()[y * 200 + x][3] > 0.5;
        let columns: Vec<usize> = (0..200).filter(|&x| (0..60).any(|y| covered(x, y))).collect();
        let rows: Vec<usize> = (0..60).filter(|&y| (0..35).any(|x| covered(x, y))).collect();
        let end = 10.0 + letters.width("100 µm");
        assert!(columns[0] >= 10 && (columns[columns.len() - 1] as f64 - end).abs() < 4.0, "{columns:?} {end}");
        assert!((rows.len() as f64 - letters.height()).abs() < 2.0 && rows[rows.len() - 1] == 39, "{rows:?}");
    }
}
