//! Summaries that stay on the device, against those of the CPU's images.

use ldi_ops::grid::Axis;
use ldi_ops::mesh::ClosedMesh;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::gpu::{GpuOptions, Route};
use ldi_ops::sampler::{Estimate, Fill, Mode, Sampler};

use crate::images::{frame, grid_of, mesh};
use crate::soups::{self, Random};

#[test]
fn summaries_are_those_of_the_images() {
    let cpu = CpuSampler::default();
    for (band_rays, route) in [(1 << 24, Route::Masks), (50, Route::Masks), (20, Route::Lists), (5, Route::Masks)] {
        let prefill = Some(0xa5a5_a5a5);
        let gpu = crate::sampler(GpuOptions { band_rays, route, prefill, ..GpuOptions::default() });
        for (name, generator) in soups::oriented() {
            let mut random = Random::new(31);
            let frame = frame(&mut random);
            let (a, b) = (generator(&mut random, &frame), generator(&mut random, &frame));
            let grid = grid_of(&frame, random.choose(&[32, 33, 64, 100, 256, 1024]));
            let (a, b) = (ClosedMesh::check(mesh(&a)).unwrap(), ClosedMesh::check(mesh(&b)).unwrap());
            let (a, b) = (grid.quantise(&a).unwrap(), grid.quantise(&b).unwrap());
            for axis in Axis::ALL {
                for fill in [Fill::EvenOdd, Fill::NonZero] {
                    let what = format!("{name}, {axis:?}, {fill:?}, bands of {band_rays}");
                    for mode in [Mode::Exact, Mode::Estimate(Estimate::Over), Mode::Estimate(Estimate::Under)] {
                        let found = gpu.summarise(&a, axis, mode, fill).unwrap();
                        assert_eq!(found, cpu.summarise(&a, axis, mode, fill).unwrap(), "{what}, {mode:?}");
                    }
                    let found = gpu.summarise_intersection(&a, &b, axis, Estimate::Over, fill).unwrap();
                    let expected = cpu.summarise_intersection(&a, &b, axis, Estimate::Over, fill).unwrap();
                    assert_eq!(found, expected, "{what}, two solids");
                }
            }
        }
    }
}
