//! What lies between the stages.

use ldi_ops::grid::Axis;
use ldi_ops::mesh::ClosedMesh;
use ldi_ops::sampler::Estimate;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::gpu::GpuOptions;

use crate::images::{frame, grid_of, mesh};
use crate::soups::{self, Random};

#[test]
fn soups_have_the_same_masks_classes_and_lists() {
    let gpu = crate::sampler(GpuOptions { prefill: Some(0xa5a5_a5a5), ..GpuOptions::default() });
    let cpu = CpuSampler::default();
    for (name, generator) in soups::oriented() {
        for seed in 100..104 {
            let mut random = Random::new(seed);
            let frame = frame(&mut random);
            let (a, b) = (generator(&mut random, &frame), generator(&mut random, &frame));
            let grid = grid_of(&frame, random.choose(&[32, 33, 64, 100, 256, 1024]));
            let (a, b) = (ClosedMesh::check(mesh(&a)).unwrap(), ClosedMesh::check(mesh(&b)).unwrap());
            let (a, b) = (grid.quantise(&a).unwrap(), grid.quantise(&b).unwrap());
            for axis in Axis::ALL {
                let what = format!("{name}, seed {seed}, {axis:?}");
                assert!(gpu.list_stages(&a, axis) == cpu.list_stages(&a, axis), "{what}: lists");
                for estimate in [Estimate::Over, Estimate::Under] {
                    for solids in [&[&a][..], &[&a, &b]] {
                        let what = format!("{what}, {estimate:?}, {} solids", solids.len());
                        let found = gpu.mask_stages(solids, axis, estimate).unwrap();
                        let expected = cpu.mask_stages(solids, axis, estimate).unwrap();
                        assert!(found.masks == expected.masks, "{what}: masks");
                        assert!(found.single == expected.single, "{what}: voxels of one sample");
                        assert!(found.pair == expected.pair, "{what}: voxels of two");
                        assert!(found.ranks == expected.ranks, "{what}: ranks");
                        assert!(found.counts == expected.counts, "{what}: counts");
                        assert!(found.offsets == expected.offsets, "{what}: offsets");
                    }
                }
            }
        }
    }
}
