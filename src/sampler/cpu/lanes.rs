//! Coverage and depth of eight small triangles side by side, in vector instructions (AVX2).
//!
//! The results are those of [`EdgeWalk`](crate::fixed::EdgeWalk) and [`DepthPlane`], bit for bit: fixed point serves
//! where its error bound proves it right. Coverage is by masks, as Leung and Wang find it: a strip of 8 × 8 rays has a bit for each
//! ray, and the XOR over the edges of the rays that are not left of them is what the triangle covers.
//!
//! Columns are 32-bit and depths 64-bit fixed point, modulo powers of two: sums may overflow, as long as the result does
//! not. Compilers made no good vector code of the same loops over arrays.

use std::arch::x86_64::*;
use std::array::from_fn;

use bytemuck::cast;

use super::bin::{LANES, Lanes};
use super::raster::Clip;
use crate::fixed::{Crossing, DepthPlane, Hit, MAGIC};
use crate::grid::Axis;

/// Columns and rows of a strip.
const SIDE: i32 = 8;

/// Columns of the widest triangle, in strips that cost a pass over all edges each, and rows of the highest one.
const WIDEST: i32 = 7 * SIDE;

/// Products of extents below this limit, and their differences, are exact in `f64`; a little less than 2^52, for the
/// roundings of the products.
const EXACT: f32 = ((1u64 << 52) - (1 << 32)) as f32;

/// Log₂ of the columns that an edge may move from row to row; those that move more are left out.
const STEEPEST: i32 = 20;

/// Fraction bits of a column, which is counted from the one before the triangle's box.
const COLUMN_BITS: i32 = 26;

/// Distance from a ray, in units of the last fraction bit, up to which integers decide. Eight roundings of half a unit
/// enter a column; those of `f64`, fewer than 20 of 2^-53 of terms below 2^23 columns, are below two units together.
const COLUMN_DOUBT: i32 = 6;

/// Fraction bits of a depth.
const DEPTH_BITS: u32 = 19;

/// Depths of the first ray of a strip and slopes, in units of the last fraction bit, have to stay below.
const DEEPEST: f64 = (1u64 << 50) as f64;

/// Distance from a lattice position, in units of the last fraction bit, up to which integers decide. The roundings of 64
/// slopes by half a unit enter a depth, and fewer than 20 of `f64`, of 2^-53 of terms below 2^56 each: 57 rays of [`DEEPEST`].
const DEPTH_DOUBT: i32 = 256;

/// Where the rays of a strip lie, from its first ray, and room for a list of them.
pub struct Places {
    ray: [u32; 64],
    covered: [u16; 64 * LANES + 8],
}

impl Places {
    /// Returns the places of the strips of an image.
    pub fn new(clip: &Clip) -> Places {
        let ray = |place: usize| (place as i32 / SIDE * clip.width + place as i32 % SIDE) as u32;
        Places { ray: from_fn(ray), covered: [0; 64 * LANES + 8] }
    }
}

/// The edges of eight triangles: where each meets the first row, in columns from the one before the triangle's box, and
/// how far it moves in a row, both in fixed point; and the first row at or above each corner.
struct Edges {
    places: [__m256i; 3],
    slopes: [__m256i; 3],
    begins: [__m256i; 3],
}

/// The planes of eight triangles: the depth of the first ray, and how much is added to it in a column and in a row, in fixed
/// point; and where it is in doubt.
struct Planes {
    first: [i64; LANES],
    by_column: [i64; LANES],
    by_row: [i64; LANES],
    /// Twice the distance from a lattice position that is in doubt: −1 where none is, `i32::MAX` where all are.
    doubts: [i32; LANES],
    /// The low bits of a [`Crossing`].
    added: [u32; LANES],
}

/// Passes the crossings of the triangles with the rays of `clip` to `put`, which counts rays from the first of the band.
/// Returns the lanes that it leaves to the caller, as bits: those of large triangles, and of edges too close to a ray.
#[inline]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
pub fn cover<H: Hit>(lanes: &Lanes, clip: &Clip, places: &mut Places, mut put: impl FnMut(u32, H)) -> u32 {
    let [a, b, c]: [[__m256i; 3]; 3] = lanes.corners.map(|corner| corner.map(cast));
    let least = |i: usize| _mm256_min_epi32(_mm256_min_epi32(a[i], b[i]), c[i]);
    let most = |i: usize| _mm256_max_epi32(_mm256_max_epi32(a[i], b[i]), c[i]);
    let all = _mm256_set1_epi32;
    let minus = |x, y| _mm256_sub_epi32(x, y);

    // The box of each triangle, and the rays of `clip` in it.
    let shift = _mm_cvtsi32_si128(clip.pixels.shift as i32);
    let round_up = all((1 << clip.pixels.shift) - 1 - clip.pixels.first);
    let index_from = |position| _mm256_sra_epi32(_mm256_add_epi32(position, round_up), shift);
    let (low, high) = ([least(0), least(1), least(2)], [most(0), most(1), most(2)]);
    let column = index_from(low[0]);
    let (row, end) = (index_from(low[1]), index_from(high[1]));
    let (width, whole_height) = (minus(index_from(high[0]), column), minus(end, row));
    let row = _mm256_max_epi32(row, all(clip.rows.start));
    let height = minus(_mm256_min_epi32(end, all(clip.rows.end)), row);

    let [x, y, z]: [__m256; 3] = from_fn(|i| _mm256_cvtepi32_ps(minus(high[i], low[i])));
    let product = _mm256_max_ps(_mm256_max_ps(_mm256_mul_ps(x, y), _mm256_mul_ps(y, z)), _mm256_mul_ps(x, z));
    let is_exact = _mm256_castps_si256(_mm256_cmp_ps::<_CMP_LT_OQ>(product, _mm256_set1_ps(EXACT)));
    let is_wide = _mm256_cmpgt_epi32(_mm256_max_epi32(width, whole_height), all(WIDEST));
    let is_large = _mm256_or_si256(is_wide, _mm256_cmpgt_epi32(height, all(SIDE)));
    let is_small = _mm256_andnot_si256(is_large, is_exact);
    let mut left_out = _mm256_xor_si256(is_small, all(-1));
    let (highest, widest) = (greatest(_mm256_and_si256(height, is_small)), greatest(_mm256_and_si256(width, is_small)));

    // From the corners to the first ray, along the edges.
    let position = |index| _mm256_add_epi32(_mm256_sll_epi32(index, shift), all(clip.pixels.first));
    let (first_column, first_row) = (position(column), position(row));
    let (u, v): ([_; 3], [_; 3]) = (from_fn(|i| minus(b[i], a[i])), from_fn(|i| minus(c[i], a[i])));
    let w = [minus(c[0], b[0]), minus(c[1], b[1])];
    let begins = [a, b, c].map(|corner| minus(index_from(corner[1]), row));
    for (edge, (run, rise)) in [(u[0], u[1]), (w[0], w[1]), (v[0], v[1])].into_iter().enumerate() {
        let (run, rise) = (_mm256_abs_epi32(run), _mm256_abs_epi32(rise));
        let crosses_none = _mm256_cmpeq_epi32(begins[edge], begins[(edge + 1) % 3]);
        let is_fine = _mm256_or_si256(_mm256_cmpgt_epi32(rise, _mm256_srli_epi32::<STEEPEST>(run)), crosses_none);
        left_out = _mm256_or_si256(left_out, _mm256_xor_si256(is_fine, all(-1)));
    }

    // Four triangles at a time in `f64`.
    let step = f64::from(1u32 << clip.pixels.shift);
    let number = _mm256_set1_pd;
    let (zero, one, magic) = (number(0.0), number(1.0), number(MAGIC));
    let times = |x, y| _mm256_mul_pd(x, y);
    let not_zero = |x| _mm256_or_pd(x, _mm256_and_pd(_mm256_cmp_pd::<_CMP_EQ_OQ>(x, zero), one));
    let unit = f64::from(1u32 << COLUMN_BITS);
    let (per_step, column_unit, column_per_step) = (number(1.0 / step), number(unit), number(unit / step));
    let depth_unit = f64::from(1u32 << DEPTH_BITS);
    let mut lows = [[_mm256_setzero_si256(); 2]; 6];
    let mut depths = [[_mm256_setzero_si256(); 2]; 3];
    let [mut is_shallow, mut normals] = [[zero; 2]; 2];
    for half in 0..2 {
        let part = |x: __m256i| match half {
            0 => _mm256_cvtepi32_pd(_mm256_castsi256_si128(x)),
            _ => _mm256_cvtepi32_pd(_mm256_extracti128_si256::<1>(x)),
        };
        let (u, v, w) = (u.map(part), v.map(part), w.map(part));
        let minor = |i: usize, j: usize| _mm256_fmsub_pd(u[i], v[j], times(u[j], v[i]));
        let normal = [minor(1, 2), minor(2, 0), minor(0, 1)];
        // One division serves the four inverses.
        let [p, q, r, s] = [u[1], w[1], v[1], normal[2]].map(not_zero);
        let (pq, rs) = (times(p, q), times(r, s));
        let inverse = _mm256_div_pd(one, times(pq, rs));
        let (per_pq, per_rs) = (times(inverse, rs), times(inverse, pq));
        let slopes = [times(u[0], times(per_pq, q)), times(w[0], times(per_pq, p)), times(v[0], times(per_rs, s))];

        let to_first = |corner: [__m256i; 3]| (part(minus(first_column, corner[0])), part(minus(first_row, corner[1])));
        let (from_a, from_b) = (to_first(a), to_first(b));
        for (edge, ((right, down), slope)) in [from_a, from_b, from_a].into_iter().zip(slopes).enumerate() {
            let place = _mm256_fmadd_pd(_mm256_fmsub_pd(down, slope, right), column_per_step, column_unit);
            lows[edge][half] = _mm256_castpd_si256(_mm256_add_pd(place, magic));
            lows[3 + edge][half] = _mm256_castpd_si256(_mm256_fmadd_pd(slope, column_unit, magic));
        }

        let per_depth = times(times(per_rs, r), number(-step * depth_unit));
        let (across, up) = (times(normal[0], per_depth), times(normal[1], per_depth));
        let (right, down) = (times(from_a.0, per_step), times(from_a.1, per_step));
        let depth = _mm256_fmadd_pd(across, right, _mm256_fmadd_pd(up, down, times(part(a[2]), number(depth_unit))));
        for (fixed, real) in depths.iter_mut().zip([depth, across, up]) {
            let bits = _mm256_castpd_si256(_mm256_add_pd(real, magic));
            fixed[half] = _mm256_sub_epi64(bits, _mm256_castpd_si256(magic));
        }
        let size = |x| _mm256_andnot_pd(number(-0.0), x);
        let largest = _mm256_max_pd(_mm256_max_pd(size(across), size(up)), size(depth));
        is_shallow[half] = _mm256_cmp_pd::<_CMP_LT_OQ>(largest, number(DEEPEST));
        normals[half] = normal[2];
    }
    let [p, q, r, s, t, o] = lows.map(|[low, high]| lower(low, high));
    let edges = Edges { places: [p, q, r], slopes: [s, t, o], begins };
    let is_flat = _mm256_cmpeq_epi32(_mm256_or_si256(u[2], v[2]), all(0));
    let is_shallow = lower(_mm256_castpd_si256(is_shallow[0]), _mm256_castpd_si256(is_shallow[1]));
    let doubts = _mm256_blendv_epi8(all(i32::MAX), all(2 * DEPTH_DOUBT), is_shallow);
    let leaves = _mm256_srli_epi32::<31>(upper(_mm256_castpd_si256(normals[0]), _mm256_castpd_si256(normals[1])));
    let leaves = _mm256_xor_si256(leaves, all(i32::from(clip.axis != Axis::Y)));
    let mut planes = Planes {
        first: cast(depths[0]),
        by_column: cast(depths[1]),
        by_row: cast(depths[2]),
        // The depth of a triangle across the rays is that of its corners, which is even.
        doubts: cast(_mm256_or_si256(doubts, is_flat)),
        added: cast(_mm256_or_si256(leaves, _mm256_andnot_si256(is_flat, all(2)))),
    };
    let ray = _mm256_mullo_epi32(minus(row, all(clip.first_row)), all(clip.width));
    let rays: [u32; LANES] = cast(_mm256_add_epi32(ray, column));
    let mut exact = [const { None }; LANES];

    let mut left = 0;
    while left < widest {
        let halves = strip(&edges, height, highest, left, &mut left_out);
        let first_of_strip = _mm256_add_epi32(column, all(left));
        let from = |column: i32| {
            let within = _mm256_max_epi32(minus(all(column), first_of_strip), all(0));
            _mm256_sllv_epi32(all(0xFF), _mm256_min_epi32(within, all(SIDE)))
        };
        let in_clip = _mm256_andnot_si256(from(clip.columns.end), from(clip.columns.start));
        let in_clip = _mm256_mullo_epi32(_mm256_and_si256(in_clip, all(0xFF)), all(0x0101_0101));
        let counts = _mm256_andnot_si256(left_out, in_clip);
        let [p, q] = halves.map(|half| _mm256_and_si256(half, counts));
        let (p, q) = (_mm256_unpacklo_epi32(p, q), _mm256_unpackhi_epi32(p, q));
        let masks = [_mm256_permute2x128_si256::<0x20>(p, q), _mm256_permute2x128_si256::<0x31>(p, q)];
        let masks: [u64; LANES] = cast(masks);

        // The rays of all lanes in one list: a loop of a few for each lane would be mispredicted at every end.
        let mut count = 0;
        for (l, mut mask) in masks.into_iter().enumerate() {
            let mut rays = mask.count_ones() as usize;
            // Four without a branch: most lanes have no more.
            loop {
                let room = places.covered[count..].first_chunk_mut::<4>().expect("there is room for all rays and more");
                for place in room {
                    *place = (l as u16) << 6 | (mask.trailing_zeros() as u16 & 63);
                    mask &= mask.wrapping_sub(1);
                }
                count += rays.min(4);
                if rays <= 4 {
                    break;
                }
                rays -= 4;
            }
        }
        for &covered in &places.covered[..count] {
            const WHOLE: i32 = (1 << DEPTH_BITS) - 1;
            let (l, place) = ((covered >> 6) as usize % LANES, i32::from(covered) & 63);
            let (right, down) = (place % SIDE, place / SIDE);
            let by = planes.by_column[l].wrapping_mul(right.into());
            let depth = planes.first[l].wrapping_add(by).wrapping_add(planes.by_row[l].wrapping_mul(down.into()));
            let ray = rays[l].wrapping_add(left as u32).wrapping_add(places.ray[place as usize]);
            let crossing = if (depth as i32).wrapping_add(DEPTH_DOUBT) & WHOLE > planes.doubts[l] {
                let below = (depth >> DEPTH_BITS) as u32;
                Crossing(((below & !1) << 2 | (below & 1) << 1).wrapping_add(planes.added[l]))
            } else {
                decide(&mut exact[l], lanes, l, clip, ray)
            };
            put(ray, H::new(crossing, lanes.triangles[l]));
        }
        left += SIDE;
        for (first, by) in planes.first.iter_mut().zip(planes.by_column) {
            *first = first.wrapping_add(by.wrapping_mul(SIDE.into()));
        }
    }
    _mm256_movemask_ps(_mm256_castsi256_ps(left_out)) as u32
}

/// Returns the rays that a strip of each triangle covers, in its upper and its lower four rows.
#[inline]
#[target_feature(enable = "avx2")]
fn strip(edges: &Edges, height: __m256i, highest: i32, left: i32, left_out: &mut __m256i) -> [__m256i; 2] {
    let all = _mm256_set1_epi32;
    let whole = all((1 << COLUMN_BITS) - 1);
    let before = all(left + 1);
    let mut places = edges.places;
    let mut halves = [all(0); 2];
    for (half, covered) in halves.iter_mut().enumerate() {
        let first = SIDE / 2 * half as i32;
        for r in first..highest.min(first + SIDE / 2) {
            let later = edges.begins.map(|begins| _mm256_cmpgt_epi32(begins, all(r)));
            let mut bits = all(0);
            for edge in 0..3 {
                let spans = _mm256_xor_si256(later[edge], later[(edge + 1) % 3]);
                let column = _mm256_srli_epi32::<COLUMN_BITS>(_mm256_add_epi32(places[edge], whole));
                let column = _mm256_sub_epi32(_mm256_max_epi32(column, before), before);
                let right = _mm256_sllv_epi32(all(-1), _mm256_min_epi32(column, all(SIDE)));
                bits = _mm256_xor_si256(bits, _mm256_and_si256(right, spans));
                let beyond = _mm256_and_si256(_mm256_add_epi32(places[edge], all(COLUMN_DOUBT)), whole);
                let is_near = _mm256_cmpgt_epi32(all(2 * COLUMN_DOUBT + 1), beyond);
                *left_out = _mm256_or_si256(*left_out, _mm256_and_si256(is_near, spans));
                places[edge] = _mm256_add_epi32(places[edge], edges.slopes[edge]);
            }
            let bits = _mm256_and_si256(bits, _mm256_cmpgt_epi32(height, all(r)));
            *covered = _mm256_or_si256(*covered, _mm256_sll_epi32(bits, _mm_cvtsi32_si128(SIDE * (r - first))));
        }
    }
    halves
}

/// Returns the lower halves of the 64-bit numbers of two vectors.
#[inline]
#[target_feature(enable = "avx2")]
fn lower(a: __m256i, b: __m256i) -> __m256i {
    let both = _mm256_shuffle_ps::<0x88>(_mm256_castsi256_ps(a), _mm256_castsi256_ps(b));
    _mm256_permute4x64_epi64::<0xD8>(_mm256_castps_si256(both))
}

/// Returns the upper halves.
#[inline]
#[target_feature(enable = "avx2")]
fn upper(a: __m256i, b: __m256i) -> __m256i {
    let both = _mm256_shuffle_ps::<0xDD>(_mm256_castsi256_ps(a), _mm256_castsi256_ps(b));
    _mm256_permute4x64_epi64::<0xD8>(_mm256_castps_si256(both))
}

/// Returns the greatest of eight integers.
#[inline]
#[target_feature(enable = "avx2")]
fn greatest(x: __m256i) -> i32 {
    let x = _mm_max_epi32(_mm256_castsi256_si128(x), _mm256_extracti128_si256::<1>(x));
    let x = _mm_max_epi32(x, _mm_shuffle_epi32::<0b01_00_11_10>(x));
    _mm_cvtsi128_si32(_mm_max_epi32(x, _mm_shuffle_epi32::<0b10_11_00_01>(x)))
}

/// Returns the crossing of a ray whose depth fixed point cannot decide.
#[cold]
fn decide(plane: &mut Option<DepthPlane>, lanes: &Lanes, lane: usize, clip: &Clip, ray: u32) -> Crossing {
    let plane = plane.get_or_insert_with(|| DepthPlane::new(&lanes.of(lane), clip.axis));
    let (column, row) = (ray % clip.width as u32, ray / clip.width as u32);
    plane.crossing(clip.pixels.ray(column as i32), clip.pixels.ray(row as i32 + clip.first_row))
}
