//! A bit for each voxel of a ray.

use ldi_ops::fixed::Crossing;
use ldi_ops::grid::{Axis, LatticeSolid};

use super::{Layers, Rival, for_each_fragment, rays};

/// Bit masks of LOD-C voxels a ray, in which each fragment inverts all voxels before its own. Runs of set voxels are the layers.
///
/// E. Eisemann and X. Décoret, Single-pass GPU solid voxelization for real-time applications, Graphics Interface 2008. A voxel is
/// set where its far face is inside (the mask T1 of Leung and Wang): parts and gaps within one voxel are lost, and every depth is
/// rounded down to a face, so that the volume may be too large or too small. The conservative form also sets the voxels that hold
/// fragments: it encloses the solid on every ray, loses gaps, and is up to two voxels too long for each part.
pub struct Voxelisation {
    name: &'static str,
    is_conservative: bool,
}

impl Voxelisation {
    /// The masks T1 alone.
    pub const PARITY: Voxelisation = Voxelisation { name: "solid voxels, T1", is_conservative: false };
    /// The masks T1 | ANY.
    pub const CONSERVATIVE: Voxelisation = Voxelisation { name: "solid voxels, T1 or ANY", is_conservative: true };
}

impl Rival for Voxelisation {
    fn name(&self) -> &'static str {
        self.name
    }

    fn sample(&self, solid: &LatticeSolid, axis: Axis) -> Layers {
        let (lod, voxel) = (solid.grid().lod() as usize, self.tolerance(solid, axis));
        let words = lod.div_ceil(64);
        let mut parity = vec![0u64; words * rays(solid, axis)];
        let mut occupied = vec![0u64; if self.is_conservative { parity.len() } else { 0 }];
        for_each_fragment(solid, axis, |ray, crossing| {
            let z = ((crossing.floor() / voxel) as usize).min(lod - 1);
            let mask = &mut parity[words * ray..][..words];
            mask[..z / 64].iter_mut().for_each(|word| *word = !*word);
            mask[z / 64] ^= (1 << (z % 64)) - 1;
            if self.is_conservative {
                occupied[words * ray + z / 64] |= 1 << (z % 64);
            }
        });
        parity.iter_mut().zip(&occupied).for_each(|(inside, surface)| *inside |= surface);
        let mut found = Vec::new();
        let end = solid.grid().length(axis.depth());
        let mut change = |ray: usize, z: usize, winding: i32| {
            found.push((ray as u32, Crossing::at(f64::from((z as i32 * voxel).min(end)), winding)));
        };
        for (ray, mask) in parity.chunks_exact(words).enumerate() {
            let mut before = 0;
            for (i, &word) in mask.iter().enumerate() {
                let mut changes = word ^ (word << 1 | before);
                before = word >> 63;
                while changes != 0 {
                    let bit = changes.trailing_zeros() as usize;
                    change(ray, 64 * i + bit, if word >> bit & 1 == 1 { 1 } else { -1 });
                    changes &= changes - 1;
                }
            }
            if before == 1 {
                change(ray, 64 * words, -1);
            }
        }
        Layers::gather(rays(solid, axis), &found, 1)
    }

    fn tolerance(&self, solid: &LatticeSolid, axis: Axis) -> i32 {
        solid.grid().voxel(axis) as i32
    }
}
