//! Ambient occlusion and shadow of the main light at each point of a surface, from the image itself.
//!
//! An image holds all layers along the line of sight, so every occluder is known, visible or not. The image is converted to a
//! volume of small cells, each with its solid fraction, and light from each of several directions is propagated through it
//! slice by slice from the eye inwards: the light at a slice is the light that left the one above, shifted by the slope of the
//! direction and attenuated by the cells it passed. The small blur of each step makes shadows soft, as from a wide light. The
//! cost is independent of the solid, no second image is needed, and occluders count that a depth buffer lacks.
//!
//! Directions are within 55° of the line of sight: flatter ones cross more than a cell per slice and would leak through walls,
//! and visible surfaces face the eye, so that these directions matter most.

use crate::parallel::*;
use glam::{Vec2, Vec3};

use super::fragments::Fragment;
use super::scene::Scene;
use crate::cancel::checkpoint;

/// The light that reaches a fragment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Exposure {
    /// The unoccluded share of the hemisphere above the surface, weighted by the cosine.
    pub ambient_occlusion: f32,
    /// The share of the main light that arrives, before the cosine.
    pub key: f32,
}

/// Number of directions of the ambient light.
const AMBIENT: usize = 28;

/// The cosine of the largest angle between a direction of the ambient light and the line of sight.
const FLATTEST: f32 = 0.574;

/// Number of directions of the main light, which is a disc.
const KEY: usize = 4;

/// The radius of that disc, seen from the solid, as a tangent.
const KEY_RADIUS: f32 = 0.07;

/// Cells along the longer side of the window.
const CELLS: u32 = 300;

/// Most cells of a volume.
const CELLS_MAX: usize = 48 << 20;

/// Height above its surface from which a fragment samples the ambient light, in cells, so that it does not shadow itself.
const LIFT: f32 = 1.4;

/// Computes the exposure of every fragment; `key` is the direction towards the main light.
pub(super) fn exposures(scene: &Scene, fragments: &[Fragment], key: Vec3) -> Vec<Exposure> {
    let Some(volume) = Volume::of(scene) else {
        return vec![Exposure { ambient_occlusion: 1.0, key: 1.0 }; fragments.len()];
    };
    let points: Vec<Vec3> = fragments.iter().map(|f| volume.place(f.at) + LIFT * f.normal).collect();
    let order = Order::of(&points, volume.size[2]);
    let directions: Vec<Vec3> = ambient_directions().chain(key_directions(key)).collect();
    let seen: Vec<Vec<u8>> = directions.par_iter().map(|&towards| volume.carry(towards, &points, &order)).collect();
    let exposure = |(i, fragment): (usize, &Fragment)| {
        let (mut open, mut whole) = (0.0, 1e-6);
        for (direction, seen) in directions.iter().zip(&seen).take(AMBIENT) {
            let cosine = fragment.normal.dot(*direction).max(0.0);
            open += cosine * f32::from(seen[i]);
            whole += cosine * 255.0;
        }
        let key: u32 = seen[AMBIENT..].iter().map(|seen| u32::from(seen[i])).sum();
        Exposure { ambient_occlusion: open / whole, key: key as f32 / (255.0 * KEY as f32) }
    };
    fragments.par_iter().enumerate().with_min_len(1 << 12).map(exposure).collect()
}

/// Returns directions spread evenly over the sampled part of the hemisphere (a spherical Fibonacci lattice).
fn ambient_directions() -> impl Iterator<Item = Vec3> {
    const TURN: f32 = 2.399_963;
    (0..AMBIENT).map(|i| {
        let z = 1.0 - (1.0 - FLATTEST) * (i as f32 + 0.5) / AMBIENT as f32;
        let (sin, cos) = (i as f32 * TURN).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * cos, r * sin, z)
    })
}

/// Returns directions over the disc of the main light.
fn key_directions(key: Vec3) -> impl Iterator<Item = Vec3> {
    let (across, up) = key.any_orthonormal_pair();
    (0..KEY).map(move |i| {
        let (sin, cos) = (i as f32 * std::f32::consts::TAU / KEY as f32 + 0.4).sin_cos();
        (key + KEY_RADIUS * (cos * across + sin * up)).normalize()
    })
}

/// The solid as cells, each 255 times its solid fraction.
struct Volume {
    /// Cells along x, y and z.
    size: [usize; 3],
    /// Slices of rows, x fastest.
    cells: Vec<u8>,
    /// The side of a cell, in rays.
    side: f32,
    /// The position of the first cell's corner, in rays from the grid's corner.
    corner: Vec3,
}

impl Volume {
    /// Builds the volume; `None` where there are no samples.
    fn of(scene: &Scene) -> Option<Volume> {
        let (columns, rows) = scene.image.size();
        let row_depths = |row: u32| {
            let rays = (0..columns).map(|column| scene.image.samples(row * columns + column));
            rays.filter_map(|s| Some((*s.first()?, *s.last()?))).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
        };
        let depths = (0..rows).into_par_iter().filter_map(row_depths);
        let (near, far) = depths.reduce_with(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
        let scale = 1.0 / (1u64 << scene.camera.grid().shift()) as f32;
        let (z0, z1) = (near as f32 * scale, far as f32 * scale);

        let mut side = columns.max(rows).div_ceil(CELLS).max(1);
        let size = |side: u32| {
            let depth = ((z1 - z0) / side as f32).ceil().max(1.0) as usize;
            [columns.div_ceil(side) as usize, rows.div_ceil(side) as usize, depth]
        };
        while size(side).into_iter().product::<usize>() > CELLS_MAX {
            side += side.div_ceil(8);
        }
        let size = size(side);
        let mut volume = Volume {
            size,
            cells: vec![0; size.into_iter().product()],
            side: side as f32,
            corner: Vec3::new(0.0, 0.0, z0),
        };
        let rows: Vec<Vec<u8>> = (0..size[1]).into_par_iter().map(|y| volume.row(scene, y, side, scale)).collect();
        let [nx, ny, _] = size;
        volume.cells.par_chunks_mut(nx * ny).enumerate().for_each(|(z, slice)| {
            for (y, row) in rows.iter().enumerate() {
                slice[y * nx..(y + 1) * nx].copy_from_slice(&row[z * nx..(z + 1) * nx]);
            }
        });
        Some(volume)
    }

    /// Converts a point to coordinates of cells.
    fn place(&self, at: Vec3) -> Vec3 {
        (at - self.corner) / self.side
    }

    /// Computes the cells of one row of all slices.
    fn row(&self, scene: &Scene, y: usize, side: u32, scale: f32) -> Vec<u8> {
        let [nx, _, nz] = self.size;
        let (columns, rows) = scene.image.size();
        // Up to four rays along a side of a cell are enough.
        let stride = side.div_ceil(4);
        let bottom = y as u32 * side;
        let mut shares = vec![0.0f32; nz];
        let mut cells = vec![0; nx * nz];
        for x in 0..nx {
            checkpoint();
            let first = x as u32 * side;
            let rays = |from: u32, most: u32| (from..(from + side).min(most)).step_by(stride as usize);
            shares.fill(0.0);
            let mut looked_at = 0.0;
            for row in rays(bottom, rows) {
                for column in rays(first, columns) {
                    looked_at += 1.0;
                    let ray = row * columns + column;
                    let samples = scene.image.samples(ray);
                    if samples.is_empty() {
                        continue;
                    }
                    let limit = scene.limit(ray);
                    for span in samples.chunks_exact(2) {
                        let place = |depth: i32| (depth.min(limit) as f32 * scale - self.corner.z) / self.side;
                        fill(&mut shares, place(span[0]), place(span[1]));
                    }
                }
            }
            for (z, share) in shares.iter().enumerate() {
                cells[z * nx + x] = (255.0 * share / looked_at + 0.5) as u8;
            }
        }
        cells
    }

    /// Returns the light from one direction that arrives at each point, from 0 to 255.
    fn carry(&self, towards: Vec3, points: &[Vec3], order: &Order) -> Vec<u8> {
        let [nx, ny, nz] = self.size;
        let slope = Vec2::new(towards.x, towards.y) / towards.z;
        let mut light = Slice::bright(nx, ny);
        let mut below = Slice::bright(nx, ny);
        let mut rows = Rows::of(&light);
        let mut arrived = vec![255; points.len()];
        for z in (0..nz).rev() {
            checkpoint();
            // The light of a slice is that at its middle.
            for &i in order.of_slice(z) {
                let p = points[i as usize];
                let at = Vec2::new(p.x, p.y) + slope * (z as f32 + 0.5 - p.z);
                arrived[i as usize] = (255.0 * light.at(at) + 0.5) as u8;
            }
            light.carry(&self.cells[z * nx * ny..(z + 1) * nx * ny], slope, &mut rows, &mut below);
            std::mem::swap(&mut light, &mut below);
        }
        arrived
    }
}

/// Adds the length of a span, in cells, to each cell that it passes.
fn fill(shares: &mut [f32], from: f32, to: f32) {
    let (from, to) = (from.max(0.0), to.min(shares.len() as f32));
    if from >= to {
        return;
    }
    let (first, last) = (from as usize, (to.ceil() as usize).min(shares.len()) - 1);
    if first == last {
        shares[first] += to - from;
        return;
    }
    shares[first] += (first + 1) as f32 - from;
    for share in &mut shares[first + 1..last] {
        *share += 1.0;
    }
    shares[last] += to - last as f32;
}

/// Points grouped by the slice that they lie in.
struct Order {
    first: Vec<u32>,
    points: Vec<u32>,
}

impl Order {
    fn of(points: &[Vec3], slices: usize) -> Order {
        // Points above all slices are fully lit and belong to no slice.
        let slice = |p: &Vec3| if p.z >= slices as f32 { slices } else { p.z.max(0.0) as usize };
        let mut first = vec![0u32; slices + 2];
        for point in points {
            first[slice(point) + 1] += 1;
        }
        for z in 1..first.len() {
            first[z] += first[z - 1];
        }
        let (mut next, mut ordered) = (first.clone(), vec![0; points.len()]);
        for (i, point) in points.iter().enumerate() {
            let slot = &mut next[slice(point)];
            ordered[*slot as usize] = i as u32;
            *slot += 1;
        }
        Order { first, points: ordered }
    }

    fn of_slice(&self, z: usize) -> &[u32] {
        &self.points[self.first[z] as usize..self.first[z + 1] as usize]
    }
}

/// The light that arrives at one slice, with a bright rim all around through which outside light enters.
struct Slice {
    size: [usize; 2],
    light: Vec<f32>,
}

/// Width of the rim in cells; more than any slope.
const RIM: usize = 2;

impl Slice {
    fn bright(nx: usize, ny: usize) -> Slice {
        Slice { size: [nx, ny], light: vec![1.0; (nx + 2 * RIM) * (ny + 2 * RIM)] }
    }

    fn stride(&self) -> usize {
        self.size[0] + 2 * RIM
    }

    /// Interpolates the light at a position in cells from four cell centres.
    fn at(&self, place: Vec2) -> f32 {
        let most = Vec2::new(self.size[0] as f32, self.size[1] as f32) + RIM as f32 - 1.5;
        let p = place.clamp(Vec2::splat(0.5 - RIM as f32), most) + RIM as f32 - 0.5;
        let (x, y) = (p.x as usize, p.y as usize);
        let (fx, fy) = (p.x - x as f32, p.y - y as f32);
        let at = y * self.stride() + x;
        let (low, high) = (&self.light[at..at + 2], &self.light[at + self.stride()..at + self.stride() + 2]);
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        mix(mix(low[0], low[1], fx), mix(high[0], high[1], fx), fy)
    }

    /// Attenuates the light by the solid fraction of each cell, and propagates it one slice further down. Each cell below takes the
    /// weighted mean of four cells, two in each of two rows.
    fn carry(&self, cells: &[u8], slope: Vec2, rows: &mut Rows, below: &mut Slice) {
        let ([nx, ny], stride) = (self.size, self.stride());
        let whole = slope.floor();
        let (fx, fy) = (slope.x - whole.x, slope.y - whole.y);
        let from = |start: f32| (RIM as i64 + start as i64) as usize;
        let (left, first) = (from(whole.x), from(whole.y));
        for row in first..=first + ny {
            let light = &self.light[row * stride..(row + 1) * stride];
            let Rows { lit, above, mixed } = rows;
            // The rim is never attenuated.
            let inside = row.checked_sub(RIM).filter(|&y| y < ny);
            if let Some(y) = inside {
                let cells = &cells[y * nx..(y + 1) * nx];
                for ((lit, light), &cell) in lit[RIM..RIM + nx].iter_mut().zip(&light[RIM..RIM + nx]).zip(cells) {
                    *lit = light * (1.0 - f32::from(cell) * (1.0 / 255.0));
                }
            }
            let lit = if inside.is_some() { &lit[..] } else { light };
            for ((mixed, &a), &b) in mixed.iter_mut().zip(&lit[left..][..nx]).zip(&lit[left + 1..][..nx]) {
                *mixed = (1.0 - fx) * a + fx * b;
            }
            if row > first {
                let start = (row - first - 1 + RIM) * stride + RIM;
                for ((below, &a), &b) in below.light[start..start + nx].iter_mut().zip(&above[..]).zip(&mixed[..]) {
                    *below = (1.0 - fy) * a + fy * b;
                }
            }
            std::mem::swap(above, mixed);
        }
    }
}

/// Memory for [`Slice::carry`].
struct Rows {
    /// The light of a row behind its cells, with the bright rim.
    lit: Vec<f32>,
    /// The means of neighbours in the row before.
    above: Vec<f32>,
    /// The means of neighbours in this row.
    mixed: Vec<f32>,
}

impl Rows {
    fn of(slice: &Slice) -> Rows {
        let nx = slice.size[0];
        Rows { lit: vec![1.0; slice.stride()], above: vec![0.0; nx], mixed: vec![0.0; nx] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random::Random;

    #[test]
    fn light_is_the_weighted_mean_of_four_attenuated_cells() {
        let (nx, ny) = (7, 5);
        let mut random = Random::new(4);
        for slope in
            [[0.0, 0.0], [0.3, -0.6], [-1.4, 1.2], [1.0, -1.0], [-0.2, -1.43], [1.43, 0.9]].map(Vec2::from_array)
        {
            let mut light = Slice::bright(nx, ny);
            let (stride, cells) = (light.stride(), (0..nx * ny).map(|_| random.below(256) as u8).collect::<Vec<u8>>());
            let mut attenuated = Slice::bright(nx, ny);
            for (at, &cell) in cells.iter().enumerate() {
                let place = (at / nx + RIM) * stride + at % nx + RIM;
                light.light[place] = random.below(1000) as f32 / 999.0;
                attenuated.light[place] = light.light[place] * (1.0 - f32::from(cell) / 255.0);
            }
            let mut below = Slice::bright(nx, ny);
            light.carry(&cells, slope, &mut Rows::of(&light), &mut below);
            for at in 0..nx * ny {
                let (x, y) = (at % nx, at / nx);
                let middle = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let (found, expected) = (below.light[(y + RIM) * stride + x + RIM], attenuated.at(middle + slope));
                assert!((found - expected).abs() < 1e-5, "{slope}, {x}, {y}: {found}, not {expected}");
            }
            let rim = (0..below.light.len()).filter(|at| {
                let (x, y) = (at % stride, at / stride);
                !(RIM..RIM + nx).contains(&x) || !(RIM..RIM + ny).contains(&y)
            });
            assert!(rim.map(|at| below.light[at]).all(|light| light == 1.0));
        }
    }
}
