//! A slot for each fragment, taken by an atomic count.

use ldi_ops::fixed::Crossing;
use ldi_ops::grid::{Axis, LatticeSolid};

use super::{Layers, Rival, for_each_fragment, rays};

/// A slot for each fragment of a ray, and a sort.
///
/// F. Liu, M.-C. Huang, X.-H. Liu and E.-H. Wu, FreePipe: a programmable parallel rendering architecture for efficient
/// multi-fragment effects, Interactive 3D Graphics and Games 2010. With a fixed number of slots, memory is rays × slots, and
/// fragments beyond them are lost. The compact form, of later work, counts, sums and fills, in two passes, and loses nothing. Both
/// sort by the standard library's unstable sort; the authors' code exchanged neighbours.
pub struct FreePipe {
    name: &'static str,
    slots: Option<usize>,
}

impl FreePipe {
    /// The method with 32 slots for each ray.
    pub const FIXED: FreePipe = FreePipe { name: "FreePipe, 32 slots", slots: Some(32) };
    /// The method with as many slots as fragments.
    pub const COMPACT: FreePipe = FreePipe { name: "FreePipe, compact", slots: None };
}

impl Rival for FreePipe {
    fn name(&self) -> &'static str {
        self.name
    }

    fn sample(&self, solid: &LatticeSolid, axis: Axis) -> Layers {
        let mut counts = vec![0u32; rays(solid, axis)];
        let Some(slots) = self.slots else {
            for_each_fragment(solid, axis, |ray, _| counts[ray] += 1);
            let mut layers = Layers::with_room(&counts, 2);
            counts.fill(0);
            for_each_fragment(solid, axis, |ray, crossing| layers.put(ray, &mut counts, crossing));
            return layers.sorted();
        };
        let mut array = vec![Crossing::default(); slots * counts.len()];
        for_each_fragment(solid, axis, |ray, crossing| {
            let slot = counts[ray] as usize;
            if slot < slots {
                array[ray * slots + slot] = crossing;
                counts[ray] += 1;
            }
        });
        let mut layers = Layers::with_room(&counts, 1);
        for (ray, &count) in counts.iter().enumerate() {
            let start = layers.offsets[ray] as usize;
            let of_ray = &array[ray * slots..][..count as usize];
            layers.crossings[start..start + of_ray.len()].copy_from_slice(of_ray);
        }
        layers.sorted()
    }
}
