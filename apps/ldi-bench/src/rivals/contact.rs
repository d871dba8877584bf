//! The common volume of two solids from peeled layers.

use ldi_ops::grid::{Axis, LatticeSolid};

use super::{DepthPeeling, Rival, length, rays};

/// Returns the common volume of two solids on one grid: the mean over three axes of the lengths on which the layers of both pair
/// up, by their signs.
///
/// F. Faure, S. Barbier, J. Allard and F. Falipou, Image-based collision detection and response between arbitrary volume objects,
/// Symposium on Computer Animation 2008. Layers come from depth peeling, so where two fragments of a solid have the same depth, one
/// is lost and the signs behind it no longer add up. Here each solid is peeled by itself; together they would also lose fragments
/// of one at the depth of the other.
pub fn contact_volume(solids: [&LatticeSolid; 2]) -> f64 {
    let grid = solids[0].grid();
    let along = |axis: Axis| -> i64 {
        let layers = solids.map(|solid| DepthPeeling.sample(solid, axis));
        (0..rays(solids[0], axis))
            .map(|ray| {
                let mut events: Vec<(i32, usize, i32)> = Vec::new();
                for (which, layers) in layers.iter().enumerate() {
                    events.extend(layers.on_ray(ray).iter().map(|c| (c.nearest(), which, c.winding())));
                }
                events.sort_unstable();
                let mut windings = [0; 2];
                let mut ends = Vec::new();
                for (depth, which, winding) in events {
                    let was_in_both = windings.iter().all(|&w| w > 0);
                    windings[which] += winding;
                    if was_in_both != windings.iter().all(|&w| w > 0) {
                        ends.push(depth);
                    }
                }
                length(&ends)
            })
            .sum()
    };
    let steps: i64 = Axis::ALL.into_iter().map(along).sum();
    steps as f64 / 3.0 * grid.step() * grid.pitch() * grid.pitch()
}
