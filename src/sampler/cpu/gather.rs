//! The corners and boxes of eight triangles at a time, in vector instructions (AVX2): most of the time of binning goes
//! into triangles between the rays.

use std::arch::x86_64::*;
use std::array::from_fn;
use std::ops::Range;

use bytemuck::cast;

use super::bin::{LANES, Lists, View};

/// Most positions, whose coordinates have 32-bit signed indices.
pub const MOST: usize = i32::MAX as usize / 3;

/// Lists the triangles of a run whose boxes have rays in them. The solid has no more than [`MOST`] positions.
#[target_feature(enable = "avx2,bmi1,bmi2")]
pub fn list_run(view: &View, run: Range<usize>, lists: &mut Lists) {
    let (window, pixels) = (lists.window, lists.pixels);
    let positions = view.solid.positions().as_flattened();
    assert!((1..=3 * MOST).contains(&positions.len()) || run.is_empty());
    let all = _mm256_set1_epi32;
    let last = all(positions.len() as i32 / 3 - 1);
    let shift = _mm_cvtsi32_si128(pixels.shift as i32);
    let round_up = all((1 << pixels.shift) - 1 - pixels.first);
    let index_from = |position| _mm256_sra_epi32(_mm256_add_epi32(position, round_up), shift);
    let rays = |[a, b, c]: [__m256i; 3], within: &Range<i32>| {
        let start = index_from(_mm256_min_epi32(_mm256_min_epi32(a, b), c));
        let end = index_from(_mm256_max_epi32(_mm256_max_epi32(a, b), c));
        [_mm256_max_epi32(start, all(within.start)), _mm256_min_epi32(end, all(within.end))]
    };
    let mut first = run.start as u32;
    for eight in view.solid.triangles()[run].chunks(LANES) {
        let vertices: [[u32; 3]; LANES] = match eight.as_array() {
            Some(eight) => *eight,
            None => from_fn(|i| *eight.get(i).unwrap_or(&eight[0])),
        };
        let places = by_corner(cast(vertices)).map(|vertices| {
            let vertices = _mm256_min_epu32(vertices, last);
            _mm256_add_epi32(_mm256_add_epi32(vertices, vertices), vertices)
        });
        let gather = |axis: usize| {
            // SAFETY: places are three times a vertex that is at most the last; with an axis added they are within positions.
            places.map(|places| unsafe { _mm256_i32gather_epi32::<4>(positions.as_ptr().add(axis), places) })
        };
        let (columns, rows) = (gather(view.axis.column()), gather(view.axis.row()));
        let (in_columns, in_rows) = (rays(columns, &window.columns), rays(rows, &window.rows));
        let is_in = |[start, end]: [__m256i; 2]| _mm256_cmpgt_epi32(end, start);
        let meets = _mm256_and_si256(is_in(in_columns), is_in(in_rows));
        let mut meets = _mm256_movemask_ps(_mm256_castsi256_ps(meets)) & ((1 << eight.len()) - 1);
        if meets != 0 {
            let depths = gather(view.axis.depth());
            let corners: [[[i32; LANES]; 3]; 3] = from_fn(|c| [columns[c], rows[c], depths[c]].map(cast));
            let [starts, ends]: [[i32; LANES]; 2] = in_rows.map(cast);
            while meets != 0 {
                let lane = meets.trailing_zeros() as usize % LANES;
                meets &= meets - 1;
                lists.push(starts[lane]..ends[lane], &corners, lane, first + lane as u32);
            }
        }
        first += LANES as u32;
    }
}

/// Returns the first vertices of eight triangles, the second and the third ones, from three after three.
#[inline]
#[target_feature(enable = "avx2")]
fn by_corner([a, b, c]: [__m256i; 3]) -> [__m256i; 3] {
    const THIRD: i32 = 0b0100_1001;
    const SECOND: i32 = 0b1001_0010;
    const FIRST: i32 = 0b0010_0100;
    let first = _mm256_blend_epi32::<FIRST>(_mm256_blend_epi32::<SECOND>(a, b), c);
    let second = _mm256_blend_epi32::<THIRD>(_mm256_blend_epi32::<FIRST>(a, b), c);
    let third = _mm256_blend_epi32::<SECOND>(_mm256_blend_epi32::<THIRD>(a, b), c);
    [
        _mm256_permutevar8x32_epi32(first, _mm256_setr_epi32(0, 3, 6, 1, 4, 7, 2, 5)),
        _mm256_permutevar8x32_epi32(second, _mm256_setr_epi32(1, 4, 7, 2, 5, 0, 3, 6)),
        _mm256_permutevar8x32_epi32(third, _mm256_setr_epi32(2, 5, 0, 3, 6, 1, 4, 7)),
    ]
}
