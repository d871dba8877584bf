//! Selection of the balls that need painting.

use super::Ball;
use crate::allocation::vec_with_room;
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
    let mut order: Vec<u32> = (0..balls.len() as u32).collect();
    let key = |&index: &u32| {
        let ball = &balls[index as usize];
        (std::cmp::Reverse([sizes[index as usize], ball.radius].map(f32::to_bits)), ball.node)
    };
    order.sort_unstable_by_key(key);
    let cells = raster.iter().product();
    let mut kept_near = vec_with_room(cells);
    kept_near.resize(cells, NONE);
    order.retain(|&index| {
        let (ball, size) = (&balls[index as usize], sizes[index as usize]);
        let near = kept_near[ball.node as usize];
        if near != NONE {
            let kept = &balls[near as usize];
            if (kept.radius - ball.radius).abs() <= LESS && sizes[near as usize] - size <= 2.0 * LESS {
                return false;
            }
        }
        stamp(&mut kept_near, raster, edges, ball, index);
        true
    });
    order
}

/// Marks the nodes near a kept ball.
fn stamp(
    kept_near: &mut [u32],
    [columns, rows, planes]: [usize; 3],
    edges: BoundaryCondition,
    ball: &Ball,
    index: u32,
) {
    let reach = (2.0 * ball.radius * CRESCENT).sqrt();
    let node = ball.node as usize;
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
                    kept_near[row + x] = index;
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
