//! Spot check of a resolved sum: compares nodes with the exact membership test of the operands.
//!
//! One ray that passes between two primitives would spoil a whole flood. This must not happen; if it does, most of the result is
//! wrong, and a few thousand nodes show it within a few milliseconds.

use crate::parallel::*;

use crate::fixed::Hit;
use crate::grid::{Axis, Grid};
use crate::minkowski::{Exterior, Membership, RaySpans};

/// Number of nodes to check.
const NODES: u32 = 4096;

/// Returns the indices of the first node at which the spans along z disagree with the membership test.
pub fn first_difference<H: Hit + Sync, M: Membership>(
    grid: &Grid,
    spans: &[RaySpans<H>; 3],
    exterior: Exterior,
    membership: &M,
) -> Option<[u32; 3]> {
    let along_z = &spans[Axis::Z.depth()];
    (0..NODES)
        .into_par_iter()
        .map_init(M::Memory::default, |memory, at| {
            let node = node(grid, u64::from(at));
            let is_in = membership.contains(node.map(|index| grid.node(index)), memory);
            (is_in != is_in_spans(grid, along_z, exterior, node)).then_some(node)
        })
        .find_map_first(|difference| difference)
}

/// Returns whether a node lies in the spans of rays along z.
pub fn is_in_spans<H: Hit>(grid: &Grid, spans: &RaySpans<H>, exterior: Exterior, [x, y, z]: [u32; 3]) -> bool {
    let (columns, _) = grid.image_size(Axis::Z);
    let is_before = |hit: &H| hit.crossing().nearest() < grid.node(z);
    let ends = spans.of_ray(y * columns + x).partition_point(is_before);
    (ends % 2 == 1) != (exterior == Exterior::In)
}

/// Returns a pseudo-random node for a number, by splitmix64.
fn node(grid: &Grid, at: u64) -> [u32; 3] {
    let mut bits = (at + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^= bits >> 31;
    // Sixteen bits for each axis.
    let rays = grid.rays();
    std::array::from_fn(|i| (((bits >> (16 * i)) & 0xffff) as u32 * rays[i]) >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixed::Crossing;
    use crate::ldi::TooManySamples;
    use crate::mesh::Aabb;
    use crate::minkowski::Primitives;
    use crate::sampler::cpu::CpuSampler;

    /// The points below a height along z.
    struct Below(i32);

    impl Membership for Below {
        type Memory = ();

        fn contains(&self, point: [i32; 3], (): &mut ()) -> bool {
            point[2] < self.0
        }
    }

    #[test]
    fn differences_are_found() -> Result<(), TooManySamples> {
        let bounds = Aabb { min: glam::DVec3::ZERO, max: glam::DVec3::ONE };
        let grid = Grid::with_resolution(bounds, 50, 1024).unwrap();
        let [x, y, top] = [grid.length(0), grid.length(1), (grid.length(2) / 2) & !1];
        let floor_and_lid = [0, top].map(|z| [[0, 0, z], [x, 0, z], [x, y, z], [0, y, z]]);
        let primitives = Primitives {
            positions: floor_and_lid.concat(),
            triangles: vec![[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]],
        };
        let sampler = CpuSampler::default();
        let along = |axis| Ok(primitives.spans::<Crossing, _>(&grid, axis, Exterior::Out, &sampler)?.0);
        let spans = [along(Axis::X)?, along(Axis::Y)?, along(Axis::Z)?];
        assert_eq!(first_difference(&grid, &spans, Exterior::Out, &Below(top)), None);
        let found = first_difference(&grid, &spans, Exterior::Out, &Below(top + top / 8)).unwrap();
        assert!((top..top + top / 8).contains(&grid.node(found[2])), "{found:?}");
        assert!(first_difference(&grid, &spans, Exterior::In, &Below(top)).is_some());
        Ok(())
    }
}
