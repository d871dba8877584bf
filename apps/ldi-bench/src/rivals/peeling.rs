//! One layer a pass, by depth.

use ldi_ops::fixed::Crossing;
use ldi_ops::grid::{Axis, LatticeSolid};

use super::{Layers, Rival, for_each_fragment, rays};

/// Passes that each find the least depth of a ray that is greater than the last one.
///
/// C. Everitt, Interactive order-independent transparency, NVIDIA white paper, 2001. Of fragments at the same depth only one is
/// found, the first. Passes grow with the layers.
pub struct DepthPeeling;

impl Rival for DepthPeeling {
    fn name(&self) -> &'static str {
        "depth peeling"
    }

    fn sample(&self, solid: &LatticeSolid, axis: Axis) -> Layers {
        let mut found = Vec::new();
        let mut last = vec![-1; rays(solid, axis)];
        let mut next: Vec<Option<Crossing>> = vec![None; last.len()];
        let mut passes = 0;
        let mut before = None;
        // The last pass finds nothing.
        while before != Some(found.len()) {
            before = Some(found.len());
            for_each_fragment(solid, axis, |ray, crossing| {
                let depth = crossing.nearest();
                if depth > last[ray] && next[ray].is_none_or(|least| depth < least.nearest()) {
                    next[ray] = Some(crossing);
                }
            });
            for (ray, next) in next.iter_mut().enumerate() {
                if let Some(crossing) = next.take() {
                    last[ray] = crossing.nearest();
                    found.push((ray as u32, crossing));
                }
            }
            passes += 1;
        }
        Layers::gather(last.len(), &found, passes)
    }
}
