//! Pictures as PNG files.

use std::io::{self, Write};

use png::{BitDepth, ColorType, Compression, Encoder, EncodingError, Filter, SrgbRenderingIntent};

use super::canvas::{Background, Canvas, encoded};

/// Writes a picture with 8 bits per channel in sRGB; only a picture with a transparent background has an alpha channel.
pub fn write(canvas: &Canvas, target: impl Write) -> io::Result<()> {
    let alpha = canvas.background() == Background::Transparent;
    let mut encoder = Encoder::new(target, canvas.width(), canvas.height());
    encoder.set_color(if alpha { ColorType::Rgba } else { ColorType::Rgb });
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Balanced);
    encoder.set_filter(Filter::Adaptive);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header().map_err(as_io)?;
    writer.write_image_data(&bytes(canvas, alpha)).map_err(as_io)?;
    writer.finish().map_err(as_io)
}

fn as_io(error: EncodingError) -> io::Error {
    match error {
        EncodingError::IoError(error) => error,
        other => io::Error::other(other),
    }
}

/// Quantisation levels of linear light; fine enough for the darkest values of sRGB.
const LEVELS: usize = 1 << 14;

/// Returns the picture's bytes, three or four per pixel.
fn bytes(canvas: &Canvas, alpha: bool) -> Vec<u8> {
    let byte = |value: f32| (255.0 * value + 0.5) as u8;
    let table: Vec<u8> = (0..=LEVELS).map(|i| byte(encoded(i as f32 / LEVELS as f32))).collect();
    let level = |light: f32| table[(light.clamp(0.0, 1.0) * LEVELS as f32 + 0.5) as usize];
    let mut bytes = Vec::with_capacity(canvas.pixels().len() * if alpha { 4 } else { 3 });
    for &[r, g, b, a] in canvas.pixels() {
        let scale = if alpha && a > 0.0 { 1.0 / a } else { 1.0 };
        bytes.extend([r, g, b].map(|light| level(light * scale)));
        if alpha {
            bytes.push(byte(a.clamp(0.0, 1.0)));
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::canvas::Colour;

    #[test]
    fn png_files_hold_the_colours_of_the_canvas() {
        for (background, channels) in [(Background::White, 3), (Background::Transparent, 4)] {
            let mut canvas = Canvas::new(3, 2, background);
            canvas.cover(1, 0, Colour::srgb(0x336699), 1.0);
            canvas.cover(2, 1, Colour::srgb(0x336699), 0.5);
            let mut file = Vec::new();
            write(&canvas, &mut file).unwrap();
            let mut reader = png::Decoder::new(io::Cursor::new(file)).read_info().unwrap();
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            let info = reader.next_frame(&mut pixels).unwrap();
            assert_eq!((info.width, info.height, pixels.len()), (3, 2, 6 * channels));
            assert_eq!(pixels[channels..][..3], [0x33, 0x66, 0x99]);
            if background == Background::Transparent {
                assert_eq!(pixels[5 * channels..], [0x33, 0x66, 0x99, 128]);
                assert_eq!(pixels[3], 0);
            }
        }
    }
}
