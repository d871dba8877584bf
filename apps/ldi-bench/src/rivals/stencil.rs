//! Methods that route fragments by their ordinal, which a stencil buffer counts.

use ldi_ops::fixed::Crossing;
use ldi_ops::grid::{Axis, LatticeSolid};

use super::{Layers, Rival, for_each_fragment, rays};

/// A count in the stencil buffer, then one pass for each layer, and a sort.
///
/// B. Heidelberger, M. Teschner and M. Gross, Real-time volumetric intersections of deforming objects, Vision, Modeling and
/// Visualization 2003. The stencil buffer has 8 bits, so fragments from the 256th of a ray on are lost, and a ray of more has 255
/// layers, an odd number. Passes grow with the layers.
pub struct StencilBuffer {
    name: &'static str,
    cap: u32,
}

impl StencilBuffer {
    /// The method with a stencil buffer of 8 bits.
    pub const AS_PUBLISHED: StencilBuffer = StencilBuffer { name: "stencil buffer, 8 bits", cap: 255 };
    /// The method with as large a count as needed, which loses nothing.
    pub const UNCAPPED: StencilBuffer = StencilBuffer { name: "stencil buffer, uncapped", cap: u32::MAX };
}

impl Rival for StencilBuffer {
    fn name(&self) -> &'static str {
        self.name
    }

    fn sample(&self, solid: &LatticeSolid, axis: Axis) -> Layers {
        let mut counts = vec![0u32; rays(solid, axis)];
        for_each_fragment(solid, axis, |ray, _| counts[ray] = (counts[ray] + 1).min(self.cap));
        let most = counts.into_iter().max().unwrap_or(0);
        let (found, passes) = route(solid, axis, 1, most);
        Layers::gather(rays(solid, axis), &found, 1 + passes)
    }
}

/// Eight fragments a pass in the samples of a multisampled pixel, to which a stencil buffer routes them, and a sort.
///
/// K. Myers and L. Bavoil, Stencil routed A-buffer, SIGGRAPH 2007 sketches. A single pass loses the fragments of a ray from the
/// ninth on. More passes lose nothing here; the stencil buffer of the sketch has 8 bits.
pub struct RoutedABuffer {
    name: &'static str,
    passes: u32,
}

impl RoutedABuffer {
    const SAMPLES: u32 = 8;
    /// The method in a single pass.
    pub const ONE_PASS: RoutedABuffer = RoutedABuffer { name: "routed A-buffer, 8, one pass", passes: 1 };
    /// The method with as many passes as the solid needs.
    pub const ALL_PASSES: RoutedABuffer =
        RoutedABuffer { name: "routed A-buffer, 8 a pass", passes: u32::MAX / RoutedABuffer::SAMPLES };
}

impl Rival for RoutedABuffer {
    fn name(&self) -> &'static str {
        self.name
    }

    fn sample(&self, solid: &LatticeSolid, axis: Axis) -> Layers {
        let (found, passes) = route(solid, axis, Self::SAMPLES, Self::SAMPLES * self.passes);
        Layers::gather(rays(solid, axis), &found, passes)
    }
}

/// Keeps the first `most` fragments of each ray, `each` of them a pass, until a pass meets none beyond its own. Returns them with
/// their rays, and the passes.
fn route(solid: &LatticeSolid, axis: Axis, each: u32, most: u32) -> (Vec<(u32, Crossing)>, u32) {
    let mut found = Vec::new();
    let mut counts = vec![0; rays(solid, axis)];
    let mut passes = 0;
    let mut is_more = most > 0;
    while is_more {
        let kept = passes * each..(passes + 1) * each;
        counts.fill(0);
        is_more = false;
        for_each_fragment(solid, axis, |ray, crossing| {
            let ordinal = counts[ray];
            counts[ray] += 1;
            if kept.contains(&ordinal) {
                found.push((ray as u32, crossing));
            }
            is_more |= ordinal >= kept.end;
        });
        passes += 1;
        is_more &= passes * each < most;
    }
    (found, passes)
}
