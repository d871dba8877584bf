//! The nodes near which a ray crosses the surface of a sum.

use crate::parallel::*;

use crate::bits::{after, before};
use crate::cancel::checkpoint;
use crate::fixed::{Hit, Pixels};
use crate::grid::Grid;
use crate::minkowski::RaySpans;
use crate::minkowski::spans::{RangeOnRay, RayEnds};

/// Returns the nodes of some planes that have a crossing on a ray between two of the 27 nodes about them, a bit each, in words
/// and rows as [`NodeSet`](crate::metrics::NodeSet) has them. A ray that crosses before its first node counts for that node.
pub fn near_crossings<H: Hit + Sync>(
    grid: &Grid,
    (spans, ends_along_z): (&[RaySpans<H>; 3], &RayEnds),
    planes: std::ops::Range<usize>,
) -> Vec<u64> {
    let [columns, rows, count] = grid.rays().map(|n| n as usize);
    let (words, pixels) = (columns.div_ceil(64), Pixels::new(grid.shift()));
    let plane = rows * words;
    let (first, end) = (planes.start.saturating_sub(1), (planes.end + 1).min(count));
    // Rays along x and y, spread within their plane.
    let mut level = vec![0u64; (end - first) * plane];
    level.par_chunks_mut(plane).enumerate().for_each(|(at, bits)| {
        checkpoint();
        let z = first + at;
        let (mut along_x, mut along_y) = (vec![0; plane], vec![0; plane]);
        for y in 0..rows {
            let hits = spans[0].of_ray((z * rows + y) as u32);
            for_each_end(hits, pixels, 0..columns, |x| set(&mut along_x[y * words..], x));
        }
        for x in 0..columns {
            let hits = spans[1].of_ray((z * columns + x) as u32);
            for_each_end(hits, pixels, 0..rows, |y| set(&mut along_y[y * words..], x));
        }
        for (y, bits) in bits.chunks_mut(words).enumerate() {
            near(y, rows).for_each(|y| unite(bits, &along_x[y * words..]));
            add_spread(bits, &along_y[y * words..][..words]);
        }
    });
    // Rays along z, row by row, spread along x.
    let depth = planes.len();
    let mut upright = vec![0u64; rows * depth * words];
    upright.par_chunks_mut(depth * words).enumerate().for_each(|(y, bits)| {
        for x in 0..columns {
            let ray = (y * columns + x) as u32;
            if ends_along_z.place(ray, planes.start, planes.end) != RangeOnRay::Among {
                continue;
            }
            for_each_end(spans[2].of_ray(ray), pixels, planes.clone(), |z| {
                set(&mut bits[(z - planes.start) * words..], x)
            });
        }
        let mut narrow = vec![0; words];
        for row in bits.chunks_mut(words) {
            narrow.copy_from_slice(row);
            add_spread(row, &narrow);
        }
    });
    let mut found = vec![0u64; depth * plane];
    found.par_chunks_mut(plane).enumerate().for_each(|(at, bits)| {
        near(planes.start + at, count).for_each(|z| unite(bits, &level[(z - first) * plane..]));
        for (y, bits) in bits.chunks_mut(words).enumerate() {
            near(y, rows).for_each(|y| unite(bits, &upright[(y * depth + at) * words..]));
        }
    });
    found
}

/// Calls `mark` with the nodes within a range at both ends of each interval between nodes that has a crossing.
fn for_each_end<H: Hit>(hits: &[H], pixels: Pixels, range: std::ops::Range<usize>, mut mark: impl FnMut(usize)) {
    let behind = |hit: &H| pixels.index_from(hit.crossing().nearest()) as usize;
    let passed = if range.start > 0 { hits.partition_point(|hit| behind(hit) < range.start) } else { 0 };
    for node in hits[passed..].iter().map(behind).take_while(|&node| node <= range.end) {
        if node > range.start {
            mark(node - 1);
        }
        if node < range.end {
            mark(node);
        }
    }
}

/// Returns an index and those next to it.
fn near(index: usize, count: usize) -> std::ops::Range<usize> {
    index.saturating_sub(1)..(index + 2).min(count)
}

/// Adds the bits of the words that `others` begins with.
fn unite(bits: &mut [u64], others: &[u64]) {
    bits.iter_mut().zip(others).for_each(|(bits, others)| *bits |= others);
}

/// Adds the bits of a row and those next to them.
fn add_spread(bits: &mut [u64], row: &[u64]) {
    bits.iter_mut().enumerate().for_each(|(word, bits)| *bits |= row[word] | before(row, word) | after(row, word));
}

fn set(row: &mut [u64], bit: usize) {
    row[bit / 64] |= 1 << (bit % 64);
}
