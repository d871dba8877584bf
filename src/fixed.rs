//! Exact integer coverage and depth: the intersections of a triangle with the rays of an image.
//!
//! All results are those of exact rational arithmetic under the perturbation of the world stated in [`crate::sampler`].
//! `f64` serves only as a guess: the code uses it where its error bound proves it right, and otherwise decides by the
//! sign of an exact integer. Two facts make this cheap.
//!
//! - **Coverage from edges.** With the larger perturbation on the column axis, an edge and a row have one *first
//!   column*: the least column whose ray is not left of the edge, ties included. A triangle covers, in each row between
//!   its vertices, the columns from the lesser to the greater first column of its two edges there. The first column
//!   depends on the edge alone, so a mesh whose edges have even valence gives every ray an even count by construction.
//! - **Depth from a residual.** Near an integer `m`, the side on which the plane passes is the sign of
//!   `n·(ray − vertex)` at depth m. Its terms overflow `i64`, but its value is |n_depth|·|m − d| < 2^62, so wrapping
//!   arithmetic yields it exactly.

use std::ops::Range;

use crate::grid::Axis;

/// A position in view coordinates: column, row and depth, in lattice steps.
pub type ViewPosition = [i32; 3];

/// The intersection of one triangle with one ray, in 32 bits: `floor / 2` in the high bits, then the position of the
/// true depth above `floor`, then the direction. Crossings of a ray sort by depth as plain integers.
///
/// Layout: bits 3–31 `floor / 2`; bits 1–2: 0 if the depth is exactly `floor`, 1 if it lies above and `nearest` is
/// `floor`, 2 if `nearest` is `floor + 2`; bit 0: 1 where the ray leaves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct Crossing(pub u32);

impl Crossing {
    /// Returns the crossing at a depth that was computed in floating point, in [0, 2^30), with the given
    /// [`winding`](Self::winding). Where the depth is an odd integer, `nearest` lies above.
    #[inline]
    pub fn at(depth: f64, winding: i32) -> Crossing {
        let below = depth as u32;
        let is_even = f64::from(below) == depth && below & 1 == 0;
        let fraction = if is_even { 0 } else { 1 + (below & 1) };
        Crossing((below >> 1) << 3 | fraction << 1 | u32::from(winding < 0))
    }

    /// Returns the largest even lattice position that is not above the true depth.
    pub fn floor(self) -> i32 {
        ((self.0 >> 3) << 1) as i32
    }

    /// Returns the least even lattice position that is not below the true depth.
    pub fn ceil(self) -> i32 {
        self.floor() + if self.0 & 0b110 != 0 { 2 } else { 0 }
    }

    /// Returns the even lattice position nearest to the true depth.
    pub fn nearest(self) -> i32 {
        self.floor() + ((self.0 >> 1) & 2) as i32
    }

    /// Returns +1 where the ray enters the triangle's solid, −1 where it leaves.
    pub fn winding(self) -> i32 {
        1 - 2 * (self.0 & 1) as i32
    }

    /// Returns the crossing moved by an even number of lattice steps, to a depth in the same range.
    pub(crate) fn moved(self, by: i32) -> Crossing {
        debug_assert!(by & 1 == 0 && self.floor() + by >= 0, "{self:?} moved by {by}");
        Crossing(self.0.wrapping_add((by << 2) as u32))
    }

    /// Returns half of [`floor`](Self::floor), in 29 bits.
    pub fn half_floor(self) -> u32 {
        self.0 >> 3
    }
}

/// A crossing with or without its triangle; samplers are generic over it, so that images without triangles have no
/// overhead.
pub trait Hit: Copy + Ord + Default + Send {
    /// True if it stores its triangle.
    const KEEPS_TRIANGLE: bool;
    /// Returns the hit of a crossing with the triangle of the given index.
    fn new(crossing: Crossing, triangle: u32) -> Self;
    /// Returns the position and direction.
    fn crossing(self) -> Crossing;
    /// Returns the triangle's index, if it is stored.
    fn triangle(self) -> Option<u32>;
    /// Returns hits as integers that sort as they do, if they have no triangles.
    fn keys(hits: &mut [Self]) -> Option<&mut [u32]>;
}

impl Hit for Crossing {
    const KEEPS_TRIANGLE: bool = false;

    #[inline]
    fn new(crossing: Crossing, _: u32) -> Crossing {
        crossing
    }

    #[inline]
    fn crossing(self) -> Crossing {
        self
    }

    #[inline]
    fn triangle(self) -> Option<u32> {
        None
    }

    #[inline]
    fn keys(hits: &mut [Crossing]) -> Option<&mut [u32]> {
        Some(bytemuck::cast_slice_mut(hits))
    }
}

/// A crossing and its triangle. Coincident crossings sort by triangle, so that their order is deterministic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct TriangleHit {
    crossing: Crossing,
    /// Index of the triangle in its mesh.
    pub triangle: u32,
}

impl Hit for TriangleHit {
    const KEEPS_TRIANGLE: bool = true;

    #[inline]
    fn new(crossing: Crossing, triangle: u32) -> TriangleHit {
        TriangleHit { crossing, triangle }
    }

    #[inline]
    fn crossing(self) -> Crossing {
        self.crossing
    }

    #[inline]
    fn triangle(self) -> Option<u32> {
        Some(self.triangle)
    }

    #[inline]
    fn keys(_: &mut [TriangleHit]) -> Option<&mut [u32]> {
        None
    }
}

/// One edge of a triangle in a view, prepared to return its first column in each row that it crosses.
#[derive(Clone, Copy, Debug)]
pub struct EdgeWalk {
    column: i32,
    row: i32,
    run: i64,
    rise: i64,
    start: f64,
    slope: f64,
}

/// Adding 3·2^51 removes the fraction bits of a number and leaves the nearest integer in the low ones: on plain x86-64 a
/// tenth of the cost of a call to `round`.
pub(crate) const MAGIC: f64 = 3.0 * (1u64 << 51) as f64;

/// Returns the integer nearest to `x`, and `x` minus it. For |x| ≥ 2^31 the integer is meaningless, and the difference is
/// at most |x|·2^-51.
#[inline(always)]
pub(crate) fn nearest_integer(x: f64) -> (i32, f64) {
    let shifted = x + MAGIC;
    (shifted.to_bits() as i32, x - (shifted - MAGIC))
}

/// Distance from a ray, in pixels, below which integers decide. First columns are at most 2^17 in amount and three roundings of
/// 2^-53 each enter one, so the error of the guess is below 2^-33.
pub(crate) const COLUMN_DOUBT: f64 = 1.0 / (1u64 << 30) as f64;

/// The pixel geometry of a view: the relation of lattice positions to columns and rows.
#[derive(Clone, Copy, Debug)]
pub struct Pixels {
    /// A pixel is 2^shift lattice steps wide.
    pub shift: u32,
    /// The lattice position of ray 0 of any axis.
    pub first: i32,
    per_step: f64,
}

impl Pixels {
    /// Returns the pixels of a grid with 2^`shift` steps each.
    pub fn new(shift: u32) -> Pixels {
        Pixels { shift, first: (1 << (shift - 1)) + 1, per_step: 1.0 / f64::from(1u32 << shift) }
    }

    /// Returns the least index whose ray lies at or above an even lattice position. May be one past the last ray.
    pub fn index_from(self, position: i32) -> i32 {
        // Rays are odd and positions even, so "at or above" and "above" are equivalent.
        (position - self.first + (1 << self.shift) - 1) >> self.shift
    }

    /// Returns the lattice position of ray `index`.
    pub fn ray(self, index: i32) -> i32 {
        (index << self.shift) + self.first
    }
}

impl EdgeWalk {
    /// Prepares the walk along the edge from `low` up to `high`, which lies in a higher row. It depends only on the two
    /// positions, so that the triangles of an edge agree about it.
    #[inline(always)]
    pub fn upwards(low: &ViewPosition, high: &ViewPosition, pixels: Pixels) -> EdgeWalk {
        debug_assert!(low[1] < high[1], "an edge within one lattice row crosses no row of rays");
        let run = i64::from(high[0] - low[0]);
        let rise = i64::from(high[1] - low[1]);
        EdgeWalk {
            column: low[0],
            row: low[1],
            run,
            rise,
            start: f64::from(low[0] - pixels.first) * pixels.per_step,
            slope: run as f64 / rise as f64 * pixels.per_step,
        }
    }

    /// Returns the first column in a row, given by its lattice position, which the edge must cross: the least column
    /// whose ray is not left of the edge. May lie outside the image by the edge's own extent.
    #[inline(always)]
    pub fn first_column(&self, row: i32, pixels: Pixels) -> i32 {
        let guess = self.start + f64::from(row - self.row) * self.slope;
        let (column, difference) = nearest_integer(guess);
        if difference.abs() > COLUMN_DOUBT {
            return column + i32::from(difference > 0.0);
        }
        self.decide_column(column, row, pixels)
    }

    /// Compares the nearest ray with the edge: exact, since both products are below 2^61.
    #[cold]
    fn decide_column(&self, column: i32, row: i32, pixels: Pixels) -> i32 {
        let to_ray = i64::from(pixels.ray(column)) - i64::from(self.column);
        let side = to_ray * self.rise - i64::from(row - self.row) * self.run;
        column + i32::from(side < 0)
    }
}

/// Calls `cover` with each of `rows` in which a triangle covers rays, and the columns covered there, which may lie
/// outside the image.
#[inline(always)]
pub fn for_each_run(
    corners: &[ViewPosition; 3],
    pixels: Pixels,
    rows: &Range<i32>,
    mut cover: impl FnMut(i32, Range<i32>),
) {
    // Corners in the order of their rows, which may begin before the grid. Triangles come in any order, so that branches would be
    // mispredicted.
    let key = |i: usize| u64::from(corners[i][1] as u32 ^ 1 << 31) << 2 | i as u64;
    let keys = [key(0), key(1), key(2)];
    let (least, greatest) = (keys[0].min(keys[1]).min(keys[2]), keys[0].max(keys[1]).max(keys[2]));
    let between = keys[0] ^ keys[1] ^ keys[2] ^ least ^ greatest;
    let [low, middle, high] = [least, between, greatest].map(|key| (key & 3) as usize);

    let first = pixels.index_from(corners[low][1]).max(rows.start);
    let end = pixels.index_from(corners[high][1]).min(rows.end);
    // From the row `turn` on, the second short edge bounds the triangle.
    let turn = pixels.index_from(corners[middle][1]);
    if first >= end {
        return;
    }
    let long = EdgeWalk::upwards(&corners[low], &corners[high], pixels);
    let (from, to) = if first < turn { (low, middle) } else { (middle, high) };
    let mut short = EdgeWalk::upwards(&corners[from], &corners[to], pixels);
    for row in first..end {
        if row == turn && row != first {
            short = EdgeWalk::upwards(&corners[middle], &corners[high], pixels);
        }
        let position = pixels.ray(row);
        let (a, b) = (long.first_column(position, pixels), short.first_column(position, pixels));
        if a != b {
            cover(row, a.min(b)..a.max(b));
        }
    }
}

/// The plane of a triangle in a view, prepared to return the depth of each ray that crosses it.
#[derive(Clone, Copy, Debug)]
pub struct DepthPlane {
    vertex: ViewPosition,
    normal: [i64; 3],
    slope: [f64; 2],
    doubt: f64,
    tie_up: bool,
    leaves: u32,
}

impl DepthPlane {
    /// Returns the plane of a triangle seen along `axis`; the triangle must not be edge-on.
    #[inline(always)]
    pub fn new(triangle: &[ViewPosition; 3], axis: Axis) -> DepthPlane {
        let [a, b, c] = *triangle;
        let (u, v) = ([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
        let minor = |i: usize, j: usize| i64::from(u[i]) * i64::from(v[j]) - i64::from(u[j]) * i64::from(v[i]);
        // Along y the view's axes (x, z, y) are left-handed, so its normal points inwards.
        let normal = match axis {
            Axis::X | Axis::Z => [minor(1, 2), minor(2, 0), minor(0, 1)],
            Axis::Y => [-minor(1, 2), -minor(2, 0), -minor(0, 1)],
        };
        debug_assert!(normal[2] != 0, "an edge-on triangle crosses no ray");
        let per_depth = -1.0 / normal[2] as f64;
        let slope = [normal[0] as f64 * per_depth, normal[1] as f64 * per_depth];
        let reach = |i: usize| f64::from(u[i].abs().max(v[i].abs()));
        // The rays that cross the triangle are within its reach of the vertex. Seven roundings of 2^-53 enter the sum,
        // and the sum is at most 2^30 + reach.
        let doubt = (slope[0].abs() * reach(0) + slope[1].abs() * reach(1)) * (1.0 / (1u64 << 49) as f64)
            + 1.0 / (1u64 << 20) as f64;
        DepthPlane {
            vertex: a,
            normal,
            slope,
            doubt,
            tie_up: tie_goes_up(normal, axis),
            leaves: u32::from(normal[2] > 0),
        }
    }

    /// Returns the crossing with the ray at lattice position (`column`, `row`), which must pass through the triangle.
    #[inline(always)]
    pub fn crossing(&self, column: i32, row: i32) -> Crossing {
        let (dc, dr) = (column - self.vertex[0], row - self.vertex[1]);
        let guess = f64::from(self.vertex[2]) + (self.slope[0] * f64::from(dc) + self.slope[1] * f64::from(dr));
        let (nearest, difference) = nearest_integer(guess);
        if difference.abs() > self.doubt {
            return self.between(nearest - i32::from(difference < 0.0));
        }
        self.decide(dc, dr, nearest)
    }

    /// Returns the crossing at a depth strictly between `below` and `below + 1`: the parity of `below` decides which
    /// even neighbour is nearer.
    #[inline]
    fn between(&self, below: i32) -> Crossing {
        let below = below as u32;
        Crossing((below >> 1) << 3 | (1 + (below & 1)) << 1 | self.leaves)
    }

    /// Computes the exact answer where the guess is too close to the integer `nearest`, or too coarse.
    #[cold]
    fn decide(&self, dc: i32, dr: i32, nearest: i32) -> Crossing {
        let across = |depth: i32| {
            self.normal[0]
                .wrapping_mul(i64::from(dc))
                .wrapping_add(self.normal[1].wrapping_mul(i64::from(dr)))
                .wrapping_add(self.normal[2].wrapping_mul(i64::from(depth) - i64::from(self.vertex[2])))
        };
        let integer = if self.doubt < 0.25 { nearest } else { self.floor_by_division(dc, dr) };
        // n_depth · (integer − depth), which is small although its terms are not.
        let residual = across(integer);
        if residual == 0 {
            let even = integer & 1 == 0;
            return match (even, self.tie_up) {
                (true, _) => Crossing((integer as u32 >> 1) << 3 | self.leaves),
                (false, up) => Crossing((integer as u32 >> 1) << 3 | (1 + u32::from(up)) << 1 | self.leaves),
            };
        }
        let above = (residual > 0) == (self.normal[2] > 0);
        self.between(integer - i32::from(above))
    }

    /// Returns the floor of the depth for planes so steep that `f64` cannot determine it; such triangles cover almost
    /// no rays.
    fn floor_by_division(&self, dc: i32, dr: i32) -> i32 {
        let numerator = -(i128::from(self.normal[0]) * i128::from(dc) + i128::from(self.normal[1]) * i128::from(dr));
        let (numerator, denominator) = match self.normal[2] > 0 {
            true => (numerator, i128::from(self.normal[2])),
            false => (-numerator, -i128::from(self.normal[2])),
        };
        (numerator.div_euclid(denominator) + i128::from(self.vertex[2])) as i32
    }
}

/// Returns whether a depth that is exactly odd counts as above: the sign of the perturbed plane's depth minus the
/// perturbed node's, to which the axis of least index contributes most.
fn tie_goes_up(normal: [i64; 3], axis: Axis) -> bool {
    // Depth changes by −(n_column ε_column + n_row ε_row) / n_depth, and the node by ε_depth.
    let by_column = -normal[0].signum() * normal[2].signum();
    let by_row = -normal[1].signum() * normal[2].signum();
    let in_order = match axis {
        Axis::X => [-1, by_column, by_row],
        Axis::Y => [by_column, -1, by_row],
        Axis::Z => [by_column, by_row, -1],
    };
    in_order.into_iter().find(|&sign| sign != 0) == Some(1)
}
