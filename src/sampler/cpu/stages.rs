//! The buffers between the stages, of whole images at once: plain loops over rays, as a reference for other backends.

use super::bin::Bins;
use super::classify::RayClasses;
use super::masks::RayMasks;
use super::raster::BandCrossings;
use super::{CpuSampler, closes, exact};
use crate::bits;
use crate::fixed::Crossing;
use crate::grid::{Axis, LatticeSolid};
use crate::sampler::layout::Voxels;
use crate::sampler::stages::{ListStages, MaskStages, UNCLOSED};
use crate::sampler::{Estimate, FillRule, SampleError, admit, region_of_both};

impl CpuSampler {
    /// Returns the buffers between the stages of masks, for one solid or the intersection of two, whole images at once.
    pub fn mask_stages(
        &self,
        solids: &[&LatticeSolid],
        axis: Axis,
        estimate: Estimate,
    ) -> Result<MaskStages, SampleError> {
        let grid = admit(solids, FillRule::EvenOdd)?;
        let region = match solids {
            [a, b] => region_of_both(a, b),
            _ => *solids[0].region(),
        };
        let (columns, rows) = grid.image_size(axis);
        let rays = columns as usize * rows as usize;
        let voxels = Voxels::new(&grid, axis);
        let words = voxels.words();
        let empty = || vec![0; rays * words];
        let mut stages = MaskStages {
            masks: solids.iter().map(|_| [empty(), empty()]).collect(),
            single: empty(),
            pair: empty(),
            ranks: empty(),
            counts: vec![0; rays],
            offsets: vec![0],
        };
        let mut crossings: Vec<BandCrossings> = solids.iter().map(|_| BandCrossings::default()).collect();
        for (crossings, solid) in crossings.iter_mut().zip(solids) {
            crossings.gather(&grid, axis, &Bins::new(solid, &region, axis, rows, &(0..rows)), 0..rows);
        }
        let mut classes = RayClasses::new(words);
        for ray in 0..rays {
            let mut closed = true;
            let masks: Vec<RayMasks> = crossings
                .iter_mut()
                .map(|crossings| {
                    let crossings = crossings.on_ray(ray as u32);
                    closed &= closes(crossings, FillRule::EvenOdd);
                    let mut masks = RayMasks::new(&voxels);
                    masks.enter(crossings, FillRule::EvenOdd, &voxels);
                    masks
                })
                .collect();
            for ([change, any], masks) in stages.masks.iter_mut().zip(&masks) {
                for word in 0..words {
                    change[word * rays + ray] = masks.change[word];
                    any[word * rays + ray] = masks.any[word];
                }
            }
            let mut occupied = masks[0].occupied.clone();
            match &masks[..] {
                _ if !closed => {
                    occupied.fill(0);
                    classes.samples = 0;
                }
                [a, b] => {
                    occupied.iter_mut().zip(&b.occupied).for_each(|(both, b)| *both |= b);
                    classes.classify_intersection(a, b, &occupied, estimate);
                }
                _ => classes.classify(&masks[0], estimate),
            }
            let mut rank = 0;
            for word in 0..words {
                let at = word * rays + ray;
                if bits::is_set(&occupied, word) {
                    (stages.single[at], stages.pair[at]) = (classes.single[word], classes.pair[word]);
                }
                stages.ranks[at] = if closed { rank } else { UNCLOSED };
                rank += stages.single[at].count_ones() + 2 * stages.pair[at].count_ones();
            }
            stages.counts[ray] = if closed { classes.samples } else { UNCLOSED };
            stages.offsets.push(stages.offsets[ray] + classes.samples);
        }
        Ok(stages)
    }

    /// Returns the crossings of all rays, sorted.
    pub fn list_stages(&self, solid: &LatticeSolid, axis: Axis) -> Result<ListStages, SampleError> {
        let grid = admit(&[solid], FillRule::EvenOdd)?;
        let (columns, rows) = grid.image_size(axis);
        let mut crossings = BandCrossings::<Crossing>::default();
        crossings.gather(&grid, axis, &Bins::new(solid, solid.region(), axis, rows, &(0..rows)), 0..rows);
        let mut stages = ListStages { starts: vec![0], crossings: Vec::with_capacity(crossings.count()) };
        for ray in 0..columns * rows {
            let on_ray = crossings.on_ray(ray);
            exact::sort(on_ray);
            stages.crossings.extend(on_ray.iter().map(|crossing| crossing.0));
            stages.starts.push(stages.crossings.len() as u32);
        }
        Ok(stages)
    }
}
