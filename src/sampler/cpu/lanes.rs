//! Coverage and depth of eight small triangles side by side, in loops that compilers turn into vector instructions.
//!
//! The results are those of [`EdgeWalk`](crate::fixed::EdgeWalk) and [`DepthPlane`], bit for bit: floating point serves
//! where its error bound proves it right. Coverage is by masks, as in the seed: a strip of 8 × 8 rays has a bit for each
//! ray, and the XOR over the edges of the rays that are not left of them is what the triangle covers.

use super::bin::{LANES, Lanes};
use super::raster::Clip;
use crate::fixed::{COLUMN_DOUBT, Crossing, DepthPlane, Hit, MAGIC, nearest_integer};
use crate::grid::Axis;

/// Columns and rows of a strip.
const SIDE: i32 = 8;

/// Columns of the widest triangle, in strips that cost a pass over all edges each.
const WIDEST: i32 = 8 * SIDE;

/// Products of extents below this limit, and their differences, are exact in `f64`.
const EXACT: f64 = (1u64 << 52) as f64;

/// Where the rays of a strip lie, from its first ray, and room for a list of them.
pub struct Places {
    across: [f64; 64],
    up: [f64; 64],
    ray: [u32; 64],
    covered: [u16; 64 * LANES + 4],
}

impl Places {
    /// Returns the places of the strips of an image.
    pub fn new(clip: &Clip) -> Places {
        let step = f64::from(1u32 << clip.pixels.shift);
        let (column, row) = (|place: usize| place as i32 % SIDE, |place: usize| place as i32 / SIDE);
        Places {
            across: std::array::from_fn(|place| f64::from(column(place)) * step),
            up: std::array::from_fn(|place| f64::from(row(place)) * step),
            ray: std::array::from_fn(|place| (row(place) * clip.width + column(place)) as u32),
            covered: [0; 64 * LANES + 4],
        }
    }
}

/// Returns `x` as an integer within 0 to 8; `x` is an integer.
#[inline(always)]
fn within_strip(x: f64) -> u64 {
    let x = if x > 0.0 { x } else { 0.0 };
    let x = if x < f64::from(SIDE) { x } else { f64::from(SIDE) };
    (x + MAGIC).to_bits() & 15
}

/// Passes the crossings of the triangles with the rays of `clip` to `put`, which counts rays from the first of the band.
/// Returns the lanes that it leaves to the caller, as bits: those of large triangles, and of edges too close to a ray.
#[inline(always)]
pub fn cover<H: Hit>(lanes: &Lanes, clip: &Clip, places: &mut Places, mut put: impl FnMut(u32, H)) -> u32 {
    const EDGES: [(usize, usize); 3] = [(0, 1), (1, 2), (2, 0)];
    let (corners, pixels) = (&lanes.corners, clip.pixels);
    let step = f64::from(1u32 << pixels.shift);
    let (per_step, first) = (1.0 / step, f64::from(pixels.first));

    // The box of each triangle.
    let [mut low, mut high] = [[[0i32; LANES]; 3]; 2];
    for i in 0..3 {
        for l in 0..LANES {
            low[i][l] = corners[0][i][l].min(corners[1][i][l]).min(corners[2][i][l]);
            high[i][l] = corners[0][i][l].max(corners[1][i][l]).max(corners[2][i][l]);
        }
    }
    let [mut column, mut width, mut row, mut height] = [[0i32; LANES]; 4];
    for l in 0..LANES {
        column[l] = pixels.index_from(low[0][l]).max(clip.columns.start);
        width[l] = pixels.index_from(high[0][l]).min(clip.columns.end) - column[l];
        row[l] = pixels.index_from(low[1][l]).max(clip.rows.start);
        height[l] = pixels.index_from(high[1][l]).min(clip.rows.end) - row[l];
    }
    let mut left_out = [0u64; LANES];
    let (mut highest, mut widest) = (0, 0);
    for l in 0..LANES {
        let extent = |i: usize| f64::from(high[i][l]) - f64::from(low[i][l]);
        let (a, b, c) = (extent(0), extent(1), extent(2));
        let is_exact = (a * b < EXACT) & (b * c < EXACT) & (a * c < EXACT);
        let is_small = (width[l] <= WIDEST) & (height[l] <= SIDE) & is_exact;
        left_out[l] = if is_small { 0 } else { u64::MAX };
        highest = highest.max(if is_small { height[l] } else { 0 });
        widest = widest.max(if is_small { width[l] } else { 0 });
    }

    // Edges: the first column in a row is that of `EdgeWalk`, counted from the column of the box.
    let mut at = [[[0.0; LANES]; 3]; 3];
    for corner in 0..3 {
        for i in 0..3 {
            for l in 0..LANES {
                at[corner][i][l] = f64::from(corners[corner][i][l]);
            }
        }
    }
    let mut first_row = [0.0; LANES];
    for l in 0..LANES {
        first_row[l] = f64::from(row[l]) * step + first;
    }
    let [mut slope, mut start] = [[[0.0; LANES]; 3]; 2];
    for (edge, (a, b)) in EDGES.into_iter().enumerate() {
        for l in 0..LANES {
            slope[edge][l] = (at[b][0][l] - at[a][0][l]) / (at[b][1][l] - at[a][1][l]) * per_step;
            start[edge][l] = (at[a][0][l] - first) * per_step - f64::from(column[l]);
        }
    }

    // Planes, as in `DepthPlane`; normals are exact. Depths are summed from the first ray of a strip, which adds
    // roundings: at most 17 of 2^-53 of the slopes times the reach, and four of 2^30.
    let [mut across, mut up, mut doubt, mut from, mut rise] = [[0.0; LANES]; 5];
    let [mut leaves, mut sloped, mut ray] = [[0u32; LANES]; 3];
    let mut in_height = [0u64; LANES];
    let outwards = if clip.axis == Axis::Y { -1.0 } else { 1.0 };
    for l in 0..LANES {
        let side = |to: usize, i: usize| at[to][i][l] - at[0][i][l];
        let (u, v) = ([side(1, 0), side(1, 1), side(1, 2)], [side(2, 0), side(2, 1), side(2, 2)]);
        let minor = |i: usize, j: usize| u[i] * v[j] - u[j] * v[i];
        let normal = [minor(1, 2), minor(2, 0), minor(0, 1)];
        let per_depth = -1.0 / normal[2];
        across[l] = normal[0] * per_depth;
        up[l] = normal[1] * per_depth;
        let reach = |i: usize| u[i].abs().max(v[i].abs());
        let sum = across[l].abs() * reach(0) + up[l].abs() * reach(1);
        // The depth of a triangle across the rays is that of its corners, which is even.
        let is_flat = (normal[0] == 0.0) & (normal[1] == 0.0);
        doubt[l] = if is_flat { -1.0 } else { sum * (1.0 / (1u64 << 48) as f64) + 1.0 / (1u64 << 20) as f64 };
        sloped[l] = if is_flat { 0 } else { 0b11 };
        leaves[l] = u32::from(normal[2] * outwards > 0.0);
        from[l] = f64::from(column[l]) * step + first - at[0][0][l];
        rise[l] = up[l] * (first_row[l] - at[0][1][l]);
        ray[l] = (row[l] - clip.first_row).wrapping_mul(clip.width).wrapping_add(column[l]) as u32;
        let rows = SIDE * height[l].clamp(0, SIDE);
        in_height[l] = if rows > 63 { u64::MAX } else { (1u64 << (rows & 63)) - 1 };
    }

    let mut planes = [const { None }; LANES];
    let mut left = 0;
    while left < widest {
        let before = f64::from(left);
        let mut masks = [0u64; LANES];
        for (edge, (a, b)) in EDGES.into_iter().enumerate() {
            for r in 0..highest {
                for l in 0..LANES {
                    let here = first_row[l] + f64::from(r) * step;
                    let guess = start[edge][l] + (here - at[a][1][l]) * slope[edge][l];
                    let nearest = (guess + MAGIC) - MAGIC;
                    let difference = guess - nearest;
                    let column = nearest - before + if difference > 0.0 { 1.0 } else { 0.0 };
                    let spans = if (at[a][1][l] < here) != (at[b][1][l] < here) { u64::MAX } else { 0 };
                    masks[l] ^= (((0xFF << within_strip(column)) & 0xFF) & spans) << (SIDE * r) as u32;
                    left_out[l] |= if difference.abs() > COLUMN_DOUBT { 0 } else { spans };
                }
            }
        }
        let mut base = [0.0; LANES];
        for l in 0..LANES {
            let in_width = !(0xFFu64 << within_strip(f64::from(width[l] - left))) & 0xFF;
            masks[l] &= in_width.wrapping_mul(0x0101_0101_0101_0101) & in_height[l] & !left_out[l];
            base[l] = at[0][2][l] + (across[l] * (from[l] + before * step) + rise[l]);
        }

        // The rays of all lanes in one list: a loop of a few for each lane would be mispredicted at every end.
        let mut count = 0;
        for (l, mut mask) in masks.into_iter().enumerate() {
            let end = count + mask.count_ones() as usize;
            while count < end {
                for i in 0..4 {
                    places.covered[count + i] = (l as u16) << 6 | (mask.trailing_zeros() as u16 & 63);
                    mask &= mask.wrapping_sub(1);
                }
                count += 4;
            }
            count = end;
        }
        for &covered in &places.covered[..count] {
            let (l, place) = ((covered >> 6) as usize % LANES, (covered & 63) as usize);
            let guess = base[l] + (across[l] * places.across[place] + up[l] * places.up[place]);
            let (nearest, difference) = nearest_integer(guess);
            let crossing = if difference.abs() > doubt[l] {
                let below = (nearest as u32).wrapping_sub((difference.to_bits() >> 63) as u32);
                Crossing((below & !1) << 2 | ((1 + (below & 1)) & sloped[l]) << 1 | leaves[l])
            } else {
                let (row, column) = (row[l] + place as i32 / SIDE, column[l] + left + place as i32 % SIDE);
                decide(&mut planes[l], lanes, l, clip, row, column)
            };
            put(ray[l] + left as u32 + places.ray[place], H::new(crossing, lanes.triangles[l]));
        }
        left += SIDE;
    }
    (0..LANES).fold(0, |bits, l| bits | (left_out[l] as u32 & 1) << l)
}

/// Returns the crossing of a ray whose depth floating point cannot decide.
#[cold]
fn decide(plane: &mut Option<DepthPlane>, lanes: &Lanes, lane: usize, clip: &Clip, row: i32, column: i32) -> Crossing {
    let plane = plane.get_or_insert_with(|| DepthPlane::new(&lanes.of(lane), clip.axis));
    plane.crossing(clip.pixels.ray(column), clip.pixels.ray(row))
}
