//! Grouping of rays into fragments: the parts of each pixel that are one piece of surface.
//!
//! The rays of a pixel that meet one skin at similar depths and with similar normals are shaded as one. Most pixels hold one
//! such piece, so that lighting, which is expensive, is evaluated per pixel and not per ray, while silhouettes and creases stay
//! antialiased by many rays.

use crate::parallel::*;
use glam::Vec3;

use super::normals::Normals;
use super::scene::{Hit, Scene};
use crate::cancel::checkpoint;

/// A piece of surface in a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fragment {
    /// The position in the view, in rays from the grid's corner.
    pub at: Vec3,
    /// The unit normal, towards the eye.
    pub normal: Vec3,
    /// The index of the skin; `None` for the face of a cut.
    pub skin: Option<u16>,
    /// The number of rays of the pixel that meet it.
    pub rays: u16,
    /// Strength of the outline here, from 0 to 1.
    pub line: f32,
}

/// All fragments of a picture, pixel by pixel in rows from the top.
pub(super) struct Fragments {
    pub all: Vec<Fragment>,
    /// The first fragment of each pixel; one more entry than pixels.
    pub first: Vec<u32>,
}

/// Rows of pixels in one task.
const BAND: u32 = 16;

/// Depth difference in pixels below which rays belong to one surface.
const NEAR: f32 = 3.0;

/// Cosine between normals above which rays belong to one surface.
const ALIKE: f32 = 0.85;

/// Half the width of a side of a triangle, in pixels.
const SIDE: f64 = 0.5;

pub(super) fn fragments(scene: &Scene, normals: &[Normals]) -> Fragments {
    let format = scene.camera.format();
    let bands: Vec<(Vec<Fragment>, Vec<u32>)> = (0..format.height.div_ceil(BAND))
        .into_par_iter()
        .map(|band| {
            let rows = band * BAND..format.height.min((band + 1) * BAND);
            Band::trace(scene, normals, rows).fragments()
        })
        .collect();
    let mut fragments = Fragments { all: Vec::new(), first: vec![0] };
    for (all, ends) in bands {
        let before = fragments.all.len() as u32;
        fragments.all.extend(all);
        fragments.first.extend(ends.iter().map(|end| before + end));
    }
    fragments
}

/// The rays of some rows of pixels, with a margin of one pixel all around.
struct Band<'s> {
    scene: &'s Scene<'s>,
    normals: &'s [Normals<'s>],
    /// The first triangle of each skin.
    starts: Vec<u32>,
    rows: std::ops::Range<u32>,
    /// Rays in a row, margins included.
    stride: usize,
    hits: Vec<Option<Hit>>,
    /// Depths in rays; `NOTHING` where the ray meets nothing.
    depths: Vec<f32>,
}

/// The depth of a miss, in rays: behind everything, and finite so that differences stay finite.
const NOTHING: f32 = -1e7;

impl<'s> Band<'s> {
    fn trace(scene: &'s Scene, normals: &'s [Normals], rows: std::ops::Range<u32>) -> Band<'s> {
        let format = scene.camera.format();
        let s = format.supersampling as i64;
        let stride = ((i64::from(format.width) + 2) * s) as usize;
        let scale = 1.0 / (1u64 << scene.camera.grid().shift()) as f32;
        let (mut hits, mut depths) = (Vec::new(), Vec::new());
        for y in (i64::from(rows.start) - 1) * s..(i64::from(rows.end) + 1) * s {
            checkpoint();
            for x in -s..(i64::from(format.width) + 1) * s {
                let ray = match (u32::try_from(x), u32::try_from(y)) {
                    (Ok(x), Ok(y)) if y < format.height * format.supersampling => scene.camera.ray(x, y),
                    _ => None,
                };
                let hit = ray.and_then(|ray| scene.hit(ray));
                depths.push(hit.map_or(NOTHING, |hit| hit.depth() as f32 * scale));
                hits.push(hit);
            }
        }
        let mut starts = vec![0];
        for skin in scene.skins {
            starts.push(starts[starts.len() - 1] + skin.triangles.len() as u32);
        }
        Band { scene, normals, starts, rows, stride, hits, depths }
    }

    /// Returns the fragments of all pixels, and the end of those of each pixel.
    fn fragments(&self) -> (Vec<Fragment>, Vec<u32>) {
        let format = self.scene.camera.format();
        let s = format.supersampling;
        let (mut all, mut ends) = (Vec::new(), Vec::new());
        for y in self.rows.clone() {
            checkpoint();
            for x in 0..format.width {
                let first = all.len();
                for (dy, dx) in (0..s).flat_map(|dy| (0..s).map(move |dx| (dy, dx))) {
                    let at = ((y - self.rows.start + 1) * s + dy) as usize * self.stride + ((x + 1) * s + dx) as usize;
                    if let Some(hit) = self.hits[at] {
                        let ray =
                            self.scene.camera.ray(x * s + dx, y * s + dy).expect("a ray that hits is on the grid");
                        add(&mut all, first, self.fragment(hit, ray, at), s);
                    }
                }
                for fragment in &mut all[first..] {
                    let rays = f32::from(fragment.rays);
                    fragment.at /= rays;
                    fragment.line /= rays;
                    fragment.normal = fragment.normal.normalize_or(Vec3::Z);
                }
                ends.push(all.len() as u32);
            }
        }
        (all, ends)
    }

    fn fragment(&self, hit: Hit, ray: u32, at: usize) -> Fragment {
        let grid = self.scene.camera.grid();
        let (columns, _) = self.scene.image.size();
        let (column, row) = (ray % columns, ray / columns);
        let line = self.line(at);
        let (normal, skin, line) = match hit {
            Hit::Cut { .. } => (self.scene.cut.map_or(Vec3::Z, |cut| cut.normal()), None, line),
            Hit::Sample { sample, .. } => {
                let triangle = self.scene.triangle(sample);
                let skin = self.starts.partition_point(|&start| start <= triangle) - 1;
                let (x, y) = (f64::from(grid.node(column)), f64::from(grid.node(row)));
                let (normals, triangle) = (&self.normals[skin], triangle - self.starts[skin]);
                let pixel = f64::from(self.scene.camera.format().supersampling << grid.shift());
                let is_side = normals.to_side(triangle, x, y).is_some_and(|distance| distance < SIDE * pixel);
                (normals.at(triangle, x, y), Some(skin as u16), if is_side { 1.0 } else { line })
            }
        };
        let place = Vec3::new(column as f32 + 0.5, row as f32 + 0.5, self.depths[at]);
        Fragment { at: place, normal, skin, rays: 1, line }
    }

    /// Returns the strength of the outline at a ray: the second difference of depth over a pixel to either side, which is zero
    /// on a plane however steep, and large at an occlusion edge. Where a surface is steep on both sides, small bumps bend it
    /// strongly, so the tolerance is larger there.
    fn line(&self, at: usize) -> f32 {
        let reach = self.scene.camera.format().supersampling as usize;
        let steps = [reach, reach * self.stride, reach * self.stride + reach, reach * self.stride - reach];
        let line = |step: usize| {
            let scale = 1.0 / reach as f32;
            let before = (self.depths[at - step] - self.depths[at]) * scale;
            let after = (self.depths[at + step] - self.depths[at]) * scale;
            let tolerance = 1.0 + 0.6 * before.abs().min(after.abs());
            smoothstep(1.2 * tolerance, 5.0 * tolerance, 0.5 * (before + after).abs())
        };
        steps.into_iter().map(line).fold(0.0, f32::max)
    }
}

/// Adds a ray's piece to the matching fragment of its pixel, or as a new one.
fn add(all: &mut Vec<Fragment>, first: usize, piece: Fragment, supersampling: u32) {
    let near = NEAR * supersampling as f32;
    let same = |f: &&mut Fragment| {
        let rays = f32::from(f.rays);
        f.skin == piece.skin
            && (f.at.z / rays - piece.at.z).abs() < near
            && f.normal.dot(piece.normal) > ALIKE * f.normal.length()
    };
    match all[first..].iter_mut().find(same) {
        Some(fragment) => {
            fragment.at += piece.at;
            fragment.normal += piece.normal;
            fragment.line += piece.line;
            fragment.rays += 1;
        }
        None => all.push(piece),
    }
}

/// Returns 0 below `low`, 1 above `high`, and a smooth transition between.
fn smoothstep(low: f32, high: f32, value: f32) -> f32 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
