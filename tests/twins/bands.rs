//! Images made in bands of any size, down to one ray, whatever limit forces them.

use ldi_ops::gpu::DeviceError;
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::mesh::ClosedMesh;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::gpu::{GpuOptions, Route};
use ldi_ops::sampler::{Estimate, FillRule, Mode, SampleError, Sampler};
use ldi_ops::solids;

use crate::layers::plates;
use crate::on_lattice::{closed, grid, mesh};
use crate::soups::{self, Frame};
use crate::testing::random::Random;
use crate::twin::{ROUTES, Twin, compare_all, compare_along, compare_intersections};

fn twins(options: GpuOptions) -> [Twin; ROUTES.len()] {
    ROUTES.map(|route| Twin::open(GpuOptions { route, prefill: Some(0x5a5a_5a5a), ..options }))
}

fn compare_soups(twins: &[Twin], seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let mut random = Random::new(seed);
        let frame = Frame { shift: 5, rays: [6, 7, 8] };
        let (a, b) = (soups::mixture(&mut random, &frame), soups::mixture(&mut random, &frame));
        let mut open = a.clone();
        open.triangles.remove(0);
        let (a, b, open) = (closed(&a), closed(&b), mesh(&open));
        let grid = grid(&frame, 100);
        let (a, b, open) = (grid.quantise(&a).unwrap(), grid.quantise(&b).unwrap(), grid.quantise_open(&open).unwrap());
        compare_all(format_args!("mixture {seed}"), twins, &a);
        compare_all(format_args!("mixture {seed}, open"), twins, &open);
        compare_intersections(format_args!("mixture {seed}"), twins, &a, &b, Axis::ALL[seed as usize % 3]);
        compare_intersections(format_args!("mixture {seed}, open"), twins, &b, &open, Axis::X);
    }
}

#[test]
fn bands_of_any_number_of_rays_give_equal_images() {
    // One ray, parts of a row, a row along some axis, a row and a part, a few rows.
    for band_rays in [1, 3, 4, 7, 13] {
        let twins = twins(GpuOptions { band_rays, binding: 64 << 10, ..GpuOptions::default() });
        compare_soups(&twins, 0..1);
    }
}

#[test]
fn any_memory_budget_gives_equal_images() {
    for memory in [0, 1 << 10] {
        compare_soups(&twins(GpuOptions { memory, binding: 64 << 10, ..GpuOptions::default() }), 10..11);
    }
}

#[test]
fn geometry_in_chunks_and_crossings_in_halved_bands_give_equal_images() {
    for (binding, segments, rays) in [(4 << 10, 32, 30), (64 << 10, 100, 110)] {
        let ball = ClosedMesh::check(solids::sphere(1.0, segments).unwrap()).unwrap();
        let grid = Grid::with_resolution(ball.bounds(), rays, 1024).unwrap();
        let (solid, other) = (grid.quantise(&ball).unwrap(), grid.quantise(&ball).unwrap());
        let crossings = CpuSampler::default().list_stages(&solid, Axis::X).unwrap().crossings.len() as u64;
        assert!(4 * crossings > binding, "a band need not be halved");
        assert!(12 * solid.triangles().len() as u64 > binding, "the geometry fits a chunk");
        let twins = twins(GpuOptions { binding, ..GpuOptions::default() });
        compare_along("a ball", &twins, &solid, Axis::ALL[segments as usize % 3]);
        compare_intersections("a ball and itself", &twins, &solid, &other, Axis::Y);
        compare_soups(&twins, 20..21);
    }
}

/// One triangle per chunk, the crossings of one ray per band, and one block of rows, or five, per buffer of blocks.
#[test]
fn the_smallest_bindings_give_equal_images() {
    let frame = Frame { shift: 5, rays: [8, 9, 10] };
    let mesh = closed(&soups::octahedron([140; 3], 116));
    let solid = grid(&frame, 64).quantise(&mesh).unwrap();
    for binding in [8, 40] {
        let twins = twins(GpuOptions { binding, ..GpuOptions::default() });
        compare_along("an octahedron", &twins, &solid, Axis::Y);
        // The crossings of two solids on one ray need 16 bytes.
        if binding >= 16 {
            compare_intersections("an octahedron", &twins, &solid, &solid, Axis::Z);
        }
    }
}

/// A single ray through 600 plates has 1200 crossings, which need 4800 bytes.
#[test]
fn rays_that_do_not_fit_are_refused_with_the_needed_and_allowed_bytes() {
    let frame = Frame { shift: 14, rays: [2; 3] };
    for axis in Axis::ALL {
        let mesh = closed(&plates(&frame, axis, 600, 2, 20, 0));
        // One voxel for every crossing, and masks of a ray that fill a binding.
        let solid = grid(&frame, 32_768).quantise(&mesh).unwrap();
        let twins = twins(GpuOptions { binding: 4 << 10, ..GpuOptions::default() });
        for twin in &twins {
            let over = Mode::Estimate(Estimate::Over);
            let by_route = if twin.options.route == Route::Masks { "samples" } else { "crossings" };
            for (mode, fill, expected) in [
                (Mode::Exact, FillRule::EvenOdd, "crossings"),
                (over, FillRule::NonZero, "crossings"),
                (over, FillRule::EvenOdd, by_route),
            ] {
                let refused = twin.gpu.sample(&solid, axis, mode, fill).unwrap_err();
                let adapter = twin.gpu.device().adapter().name.clone();
                let error = DeviceError::TooLarge { adapter, what: expected, needed: 4800, limit: 4096 };
                assert_eq!(refused, SampleError::Device(error), "{axis:?}, {mode:?}, {fill:?}; {}", twin.name());
            }
        }
        // The samplers still work after the refusal.
        let sound = closed(&soups::cuboid([2; 3], [30_000; 3]));
        compare_all("after a refusal", &twins, &grid(&frame, 64).quantise(&sound).unwrap());
    }
}

#[test]
fn a_ray_that_fills_the_binding_is_sampled() {
    let frame = Frame { shift: 14, rays: [2; 3] };
    let mesh = closed(&plates(&frame, Axis::Z, 512, 2, 20, 0));
    let solid = grid(&frame, 32_768).quantise(&mesh).unwrap();
    let twins = twins(GpuOptions { binding: 4 << 10, ..GpuOptions::default() });
    compare_along("512 plates", &twins, &solid, Axis::Z);
}
