//! The data between the stages of the sampler.

use ldi_ops::grid::{Axis, LatticeSolid};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::gpu::Route;

use crate::comparison::assert_same;
use crate::lattice::{frame, generators, lod, region};
use crate::on_lattice::{closed, grid, mesh};
use crate::testing::random::Random;
use crate::twin::{self, ESTIMATES};

fn compare_stages(what: &str, a: &LatticeSolid, b: &LatticeSolid) {
    let cpu = CpuSampler::default();
    for axis in Axis::ALL {
        let lists = cpu.list_stages(a, axis);
        for twin in twin::all().iter().filter(|twin| twin.options.route == Route::Lists) {
            let found = twin.gpu.list_stages(a, axis);
            assert_same(format_args!("{what}, {axis:?}: lists; {}", twin.name()), &found, &lists);
        }
        for estimate in ESTIMATES {
            for solids in [&[a][..], &[a, b]] {
                let expected = cpu.mask_stages(solids, axis, estimate);
                for twin in twin::all().iter().filter(|twin| twin.options.route == Route::Masks) {
                    let found = twin.gpu.mask_stages(solids, axis, estimate);
                    let solids = solids.len();
                    let what = format_args!("{what}, {axis:?}, {estimate:?}, {solids} solids; {}", twin.name());
                    assert_same(what, &found, &expected);
                }
            }
        }
    }
}

#[test]
fn soups_have_equal_masks_classes_and_lists() {
    for (name, generator) in generators() {
        for seed in 100..104 {
            let mut random = Random::new(seed);
            let frame = frame(&mut random);
            let [a, b] = [(); 2].map(|()| closed(&generator(&mut random, &frame)));
            let grid = grid(&frame, lod(&mut random));
            let [a, b] = [&a, &b].map(|mesh| grid.quantise(mesh).unwrap());
            let region = region(&mut random, &frame);
            compare_stages(&format!("{name}, seed {seed}"), &a, &b);
            compare_stages(&format!("{name}, seed {seed}, within"), &b.within(&region), &a);
        }
    }
}

#[test]
fn open_soups_have_equal_masks_classes_and_lists() {
    for (name, generator) in generators() {
        for seed in 200..202 {
            let mut random = Random::new(seed);
            let frame = frame(&mut random);
            let [a, b] = [(); 2].map(|()| {
                let mut soup = generator(&mut random, &frame);
                soup.triangles.remove(random.below(soup.triangles.len()));
                mesh(&soup)
            });
            let grid = grid(&frame, lod(&mut random));
            let [a, b] = [&a, &b].map(|mesh| grid.quantise_open(mesh).unwrap());
            compare_stages(&format!("{name} less a triangle, seed {seed}"), &a, &b);
        }
    }
}
