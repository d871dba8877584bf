//! The earlier work of a sampler, and concurrent samplers, change no bit of an image.

use ldi_ops::grid::{Axis, LatticeSolid};
use ldi_ops::mesh::{ClosedMesh, TriangleMesh};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::gpu::GpuOptions;

use crate::comparison::assert_same;
use crate::lattice::lod;
use crate::on_lattice::{closed, grid, mesh};
use crate::soups::{Frame, oriented};
use crate::testing::random::Random;
use crate::twin::{self, ESTIMATES, ROUTES, Twin, compare_along, compare_intersections};

/// A pair of solids on one grid, and the first of them with a triangle missing.
struct Case {
    frame: Frame,
    lod: u32,
    meshes: [ClosedMesh; 2],
    open: TriangleMesh,
}

impl Case {
    /// Frames range from six pixels a side to hundreds, so that leftovers of a large image would show in a small one.
    fn random(random: &mut Random) -> Case {
        let most = random.choose(&[6, 10, 40, 150]);
        let frame = Frame { shift: 6, rays: std::array::from_fn(|_| random.between(6, most) as u32) };
        let generators = oriented();
        let (_, generator) = random.choose(&generators);
        let (a, b) = (generator(random, &frame), generator(random, &frame));
        let mut open = a.clone();
        open.triangles.pop();
        let lod = if most == 150 { random.choose(&[32, 100, 1024]) } else { lod(random) };
        Case { frame, lod, meshes: [closed(&a), closed(&b)], open: mesh(&open) }
    }

    fn with_solids(&self, run: impl FnOnce([LatticeSolid; 3])) {
        let grid = grid(&self.frame, self.lod);
        let [a, b] = [0, 1].map(|i| grid.quantise(&self.meshes[i]).unwrap());
        run([a, b, grid.quantise_open(&self.open).unwrap()]);
    }
}

/// The operations to choose from: three that make images, and two that return the data between the stages, for which an image
/// must fit one band.
const IMAGES: usize = 3;
const EVERYTHING: usize = 5;

fn compare_cases(what: &str, twins: &[Twin], operations: usize, seed: u64, rounds: usize) {
    let mut random = Random::new(seed);
    let cases: Vec<Case> = (0..8).map(|_| Case::random(&mut random)).collect();
    for round in 0..rounds {
        let axis = random.choose(&Axis::ALL);
        let operation = random.below(operations);
        let estimate = random.choose(&ESTIMATES);
        cases[random.below(cases.len())].with_solids(|[a, b, open]| {
            let what = format!("{what}, seed {seed}, round {round}");
            let cpu = CpuSampler::default();
            match operation {
                0 => compare_along(what, twins, &a, axis),
                1 => compare_along(what, twins, &open, axis),
                2 => compare_intersections(what, twins, &a, &b, axis),
                3 => {
                    for twin in twins {
                        assert_same(&what, &twin.gpu.list_stages(&b, axis), &cpu.list_stages(&b, axis));
                    }
                }
                _ => {
                    let expected = cpu.mask_stages(&[&a, &b], axis, estimate);
                    for twin in twins {
                        assert_same(&what, &twin.gpu.mask_stages(&[&a, &b], axis, estimate), &expected);
                    }
                }
            }
        });
    }
}

#[test]
fn images_do_not_depend_on_earlier_images() {
    let twins = ROUTES.map(|route| Twin::open(GpuOptions { route, ..GpuOptions::default() }));
    for seed in 0..3 {
        compare_cases("one after another", &twins, EVERYTHING, seed, 25);
    }
}

/// Solids evict one another from device memory and are loaded again.
#[test]
fn images_do_not_depend_on_resident_solids() {
    let twins = ROUTES.map(|route| Twin::open(GpuOptions { route, memory: 2 << 20, ..GpuOptions::default() }));
    compare_cases("little memory", &twins, IMAGES, 50, 25);
}

#[test]
fn concurrent_samplers_give_equal_images() {
    std::thread::scope(|scope| {
        for seed in 100..102 {
            scope.spawn(move || {
                let twins = ROUTES.map(|route| Twin::open(GpuOptions { route, ..GpuOptions::default() }));
                compare_cases("two samplers", &twins, EVERYTHING, seed, 15);
            });
        }
    });
}

#[test]
fn a_sampler_shared_by_two_threads_gives_equal_images() {
    std::thread::scope(|scope| {
        for seed in 200..202 {
            scope.spawn(move || compare_cases("one sampler, two threads", twin::plain(), EVERYTHING, seed, 15));
        }
    });
}
