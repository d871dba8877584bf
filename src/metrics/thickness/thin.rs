//! Selection of the balls that need painting.

use std::cmp::Reverse;

use crate::parallel::*;

use super::Ball;
use crate::allocation::filled;
use crate::metrics::BoundaryCondition;

/// Greatest difference in radius, in pitches, between a dropped ball and the one that covers it; for sizes, twice that.
const LESS: f32 = 0.25;

/// Greatest distance of the outermost part of a dropped ball beyond those around it, in pitches.
const CRESCENT: f32 = 0.125;

/// The index that denotes no ball.
const NONE: u32 = u32::MAX;

/// Returns the balls to paint, as indices, those of the largest size first.
///
/// A ball is dropped if a kept one has its centre within √(2 r ε) of its own, no smaller a size, and about the same radius; of
/// the union of balls along a ridge, crescents about ε thick (0.125 pitches) are lost.
pub(super) fn thin_out(balls: &[Ball], sizes: &[f32], raster: [usize; 3], edges: BoundaryCondition) -> Vec<u32> {
    // Positive numbers are in the order of their bits.
    let entry = |(index, (ball, size)): (usize, (&Ball, &f32))| {
        let [size, radius] = [size, &ball.radius].map(|length| u64::from(length.to_bits()));
        (Reverse(size << 32 | radius), ball.node, index as u32)
    };
    let mut order: Vec<_> = balls.par_iter().zip(sizes).enumerate().with_min_len(1 << 12).map(entry).collect();
    order.par_sort_unstable();
    let mut kept_near = filled(raster.iter().product(), NONE);
    let mut kept: Vec<u32> = Vec::new();
    let mut lengths: Vec<[f32; 2]> = Vec::new();
    for (Reverse(bits), node, index) in order {
        let [size, radius] = [bits >> 32, bits].map(|bits| f32::from_bits(bits as u32));
        if let Some([of_near, radius_of_near]) = lengths.get(kept_near[node as usize] as usize)
            && (radius_of_near - radius).abs() <= LESS
            && of_near - size <= 2.0 * LESS
        {
            continue;
        }
        stamp(&mut kept_near, raster, edges, [node, kept.len() as u32], radius);
        kept.push(index);
        lengths.push([size, radius]);
    }
    kept
}

/// Marks the nodes near a kept ball with its number among those that are kept.
fn stamp(
    kept_near: &mut [u32],
    [columns, rows, planes]: [usize; 3],
    edges: BoundaryCondition,
    [node, number]: [u32; 2],
    radius: f32,
) {
    let reach = (2.0 * radius * CRESCENT).sqrt();
    let node = node as usize;
    let [x, y, z] = [node % columns, node / columns % rows, node / columns / rows];
    let whole = reach as i64;
    for dz in -whole..=whole {
        let Some(z) = moved(z, dz, planes, edges) else { continue };
        let across = (reach * reach - (dz * dz) as f32).max(0.0).sqrt() as i64;
        for dy in -across..=across {
            let Some(y) = moved(y, dy, rows, edges) else { continue };
            let along = (reach * reach - (dz * dz + dy * dy) as f32).max(0.0).sqrt() as i64;
            let row = (z * rows + y) * columns;
            for dx in -along..=along {
                if let Some(x) = moved(x, dx, columns, edges) {
                    kept_near[row + x] = number;
                }
            }
        }
    }
}

/// Returns a coordinate moved by an offset, wrapped with [`BoundaryCondition::Periodic`].
pub(super) fn moved(from: usize, by: i64, length: usize, edges: BoundaryCondition) -> Option<usize> {
    let at = from as i64 + by;
    match edges {
        BoundaryCondition::Periodic => Some(at.rem_euclid(length as i64) as usize),
        BoundaryCondition::Clip | BoundaryCondition::Border => (0..length as i64).contains(&at).then_some(at as usize),
    }
}
