//! A plane through solids, seen along its normal: the inputs that each ray is inside of where it passes the plane.

use crate::parallel::*;
use glam::{DVec3, Vec3};

use super::camera::Camera;
use super::canvas::{Background, Canvas, Colour};
use crate::ldi::Ldi;

/// The colouring of the areas of a slice, by the inputs that they lie in.
pub trait Fills: Sync {
    /// Returns the colour of an area in the inputs of these indices, bit 0 for the first; never called with 0.
    fn colour(&self, inputs: u32) -> Colour;
}

impl<F: Fn(u32) -> Colour + Sync> Fills for F {
    fn colour(&self, inputs: u32) -> Colour {
        self(inputs)
    }
}

/// Most inputs that a slice can distinguish.
pub const INPUTS_MAX: usize = 32;

/// Width of outlines, in pixels.
const LINE: f64 = 1.4;

/// Renders the plane at `depth` of the view, which rays along z cross. Outlines have the colour `ink`.
///
/// # Panics
/// If there are more than [`INPUTS_MAX`] images, or an image lies on another grid than the camera's.
pub fn slice(
    camera: &Camera,
    images: &[&Ldi],
    depth: f64,
    fills: &dyn Fills,
    ink: Colour,
    background: Background,
) -> Canvas {
    assert!(images.len() <= INPUTS_MAX, "a slice tells {INPUTS_MAX} inputs apart");
    assert!(images.iter().all(|image| image.grid() == camera.grid()), "images lie on the camera's grid");
    let grid = camera.grid();
    let steps = (depth - grid.origin().z) / grid.step();
    let steps = steps.clamp(f64::from(i32::MIN), f64::from(i32::MAX)) as i32;
    let format = camera.format();
    let s = format.supersampling;
    let mut canvas = Canvas::new(format.width, format.height, background);
    let reach = ((0.5 * LINE * f64::from(s)).round() as usize).max(1);
    let labels = Labels { camera, images, steps, reach };
    let bands = canvas.rows_mut().enumerate().par_bridge();
    bands.for_each(|(y, row)| {
        let rows = labels.of_row(y as u32);
        for (x, pixel) in row.iter_mut().enumerate() {
            *pixel = labels.pixel(&rows, x, fills, ink, *pixel);
        }
    });
    canvas
}

/// The inputs that the rays around a pixel are inside of.
struct Labels<'a> {
    camera: &'a Camera,
    images: &'a [&'a Ldi],
    steps: i32,
    /// Width of an outline to either side, in rays.
    reach: usize,
}

impl Labels<'_> {
    fn stride(&self) -> usize {
        let format = self.camera.format();
        (format.width * format.supersampling) as usize + 2 * self.reach
    }

    /// Returns, as bits, the inputs that the rays of a row of pixels are inside of, with a margin as wide as an outline
    /// reaches.
    fn of_row(&self, y: u32) -> Vec<u32> {
        let format = self.camera.format();
        let (s, reach) = (i64::from(format.supersampling), self.reach as i64);
        let mut labels = Vec::with_capacity(self.stride() * (s + 2 * reach) as usize);
        for y in i64::from(y) * s - reach..(i64::from(y) + 1) * s + reach {
            for x in -reach..i64::from(format.width) * s + reach {
                let ray = match (u32::try_from(x), u32::try_from(y)) {
                    (Ok(x), Ok(y)) if y < format.height * format.supersampling => self.camera.ray(x, y),
                    _ => None,
                };
                labels.push(ray.map_or(0, |ray| self.of_ray(ray)));
            }
        }
        labels
    }

    fn of_ray(&self, ray: u32) -> u32 {
        let inside = |image: &&Ldi| image.samples(ray).partition_point(|&depth| depth <= self.steps) % 2;
        self.images.iter().enumerate().map(|(i, image)| (inside(image) as u32) << i).sum()
    }

    fn pixel(&self, labels: &[u32], x: usize, fills: &dyn Fills, Colour(ink): Colour, pixel: [f32; 4]) -> [f32; 4] {
        let s = self.camera.format().supersampling as usize;
        let (mut light, mut covered) = (Vec3::ZERO, 0.0);
        for dy in 0..s {
            for dx in 0..s {
                let at = (dy + self.reach) * self.stride() + x * s + dx + self.reach;
                let label = labels[at];
                let edge = self.is_edge(labels, at);
                if label == 0 && !edge {
                    continue;
                }
                covered += 1.0;
                light += if edge { ink } else { fills.colour(label).0 };
            }
        }
        let share = 1.0 / (s * s) as f32;
        let (light, rest) = (light * share, 1.0 - covered * share);
        [
            light.x + pixel[0] * rest,
            light.y + pixel[1] * rest,
            light.z + pixel[2] * rest,
            covered * share + pixel[3] * rest,
        ]
    }

    /// Returns whether an outline covers a ray: whether any of eight rays around it, at the reach, has other inputs.
    fn is_edge(&self, labels: &[u32], at: usize) -> bool {
        let (far, stride) = (self.reach, self.stride());
        let near = (far * 5).div_ceil(7).max(1);
        let steps = [far, far * stride, near * stride + near, near * stride - near];
        steps.into_iter().any(|step| labels[at - step] != labels[at] || labels[at + step] != labels[at])
    }
}

/// Returns the corners of a box as seen, in order around the rectangle of its outline.
pub fn outline_of(min: DVec3, max: DVec3) -> [DVec3; 4] {
    [(min.x, min.y), (max.x, min.y), (max.x, max.y), (min.x, max.y)].map(|(x, y)| DVec3::new(x, y, 0.0))
}
