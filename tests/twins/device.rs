//! The measurements of a device: the times of its stages and its copy bandwidth.

use glam::DVec3;
use ldi_ops::gpu::{Device, DeviceError, Needs};
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::mesh::{ClosedMesh, TriangleMesh};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::gpu::{GpuOptions, GpuSampler, Route};
use ldi_ops::sampler::{Estimate, FillRule, Mode, SampleError, Sampler};
use ldi_ops::solids::{cuboid, sphere};

use crate::twin::ADAPTER;

#[test]
fn the_costs_of_a_device_are_times() {
    let costs = Device::open(&ADAPTER, Needs::default()).unwrap().costs().unwrap();
    assert_eq!(costs.native_product.is_some(), ADAPTER.int64);
    let operations = [costs.dispatch, costs.scattered_addition, costs.shared_addition, costs.paired_product];
    // A fast device takes too little for them to be told from nothing.
    let all = operations.into_iter().chain(costs.native_product);
    assert!(
        costs.submission > 0.0 && all.into_iter().all(|seconds| seconds.is_finite() && seconds >= 0.0),
        "{costs:?}"
    );
}

#[test]
fn the_copy_bandwidth_of_a_device_is_positive() {
    let device = Device::open(&ADAPTER, Needs::default()).unwrap();
    device.keep_stage_times(true);
    let bandwidth = device.copy_bandwidth(1 << 22).unwrap();
    assert!(bandwidth > 0.0 && bandwidth.is_finite(), "{bandwidth}");
    assert_eq!(device.take_stage_times(), [], "copies are no stages of a job");
}

#[test]
fn every_stage_is_timed() {
    let options = GpuOptions { route: Route::Masks, ..GpuOptions::default() };
    let sampler = GpuSampler::open(&ADAPTER, options).unwrap();
    let device = sampler.device();
    let cube = ClosedMesh::check(cuboid(DVec3::ZERO, DVec3::ONE).unwrap()).unwrap();
    let grid = Grid::with_resolution(cube.bounds(), 16, 64).unwrap();
    let cube = grid.quantise(&cube).unwrap();
    let sample = || sampler.sample(&cube, Axis::X, Mode::Estimate(Estimate::Over), FillRule::EvenOdd).unwrap();
    sample();
    assert_eq!(device.take_stage_times(), [], "nobody asked for times");
    device.keep_stage_times(true);
    sample();
    let times = device.take_stage_times();
    let is_timed = |name: &str| times.iter().any(|time| time.stage == name);
    for stage in ["masks", "classify", "scan (spread blocks)", "identities", "retrieve"] {
        assert_eq!(is_timed(stage), device.adapter().timestamps, "{stage}: {times:?}");
    }
    for transfer in ["clear", "read back"] {
        assert_eq!(is_timed(transfer), device.times_transfers(), "{transfer}: {times:?}");
    }
}

/// If one route replaces another without need, the twins compare less than they seem to.
#[test]
fn each_route_runs_its_own_stage() {
    let cube = ClosedMesh::check(cuboid(DVec3::ZERO, DVec3::ONE).unwrap()).unwrap();
    let cube = Grid::with_resolution(cube.bounds(), 16, 1024).unwrap().quantise(&cube).unwrap();
    for (route, stage) in [(Route::Masks, "masks"), (Route::Lists, "place")] {
        let sampler = GpuSampler::open(&ADAPTER, GpuOptions { route, ..GpuOptions::default() }).unwrap();
        let device = sampler.device();
        device.keep_stage_times(true);
        sampler.sample(&cube, Axis::Y, Mode::Estimate(Estimate::Under), FillRule::EvenOdd).unwrap();
        let times = device.take_stage_times();
        let is_timed = times.iter().any(|time| time.stage == stage);
        assert_eq!(is_timed, device.adapter().timestamps, "{stage}: {times:?}");
    }
}

/// The account of `ldi-bench gpu`: three axes in one submission, and over the bus the geometry once and the result.
#[test]
fn three_axes_take_one_submission_and_move_the_result_alone() {
    // Of three sizes, of which only one is a whole number of pitches.
    let mesh = sphere(1.0, 64).unwrap();
    let positions = mesh.positions.iter().map(|&at| at * DVec3::new(1.0, 0.71, 0.33)).collect();
    let ball = ClosedMesh::check(TriangleMesh { positions, ..mesh }).unwrap();
    let grid = Grid::with_resolution(ball.bounds(), 128, 1024).unwrap();
    let ball = grid.quantise(&ball).unwrap();
    let sampler = GpuSampler::open(&ADAPTER, GpuOptions::default()).unwrap();
    let device = sampler.device();
    for mode in [Mode::Exact, Mode::Estimate(Estimate::Over)] {
        for fill in [FillRule::EvenOdd, FillRule::NonZero] {
            device.take_counters();
            let images = sampler.sample_along(&ball, &Axis::ALL, mode, fill).unwrap();
            let counters = device.take_counters();
            assert!(counters.submissions == 1 && counters.dispatches <= 12, "{mode:?}, {fill:?}: {counters:?}");
            let geometry = 12 * (ball.positions().len() + ball.triangles().len()) as u64;
            let is_first = mode == Mode::Exact && fill == FillRule::EvenOdd;
            assert!(counters.uploaded == if is_first { geometry } else { 0 }, "{mode:?}, {fill:?}: {counters:?}");
            let result: usize = images.iter().map(|image| 4 * (image.depths().len() + image.offsets().len())).sum();
            // Some room for more crossings than expected, the rays that fill up workgroups, tallies and totals.
            assert!(counters.read_back < (result + result / 10) as u64 + 8192, "{result}: {counters:?}");

            let sums = sampler.volume_sums_along(&ball, &Axis::ALL, mode, fill).unwrap();
            assert_eq!(sums.len(), 3);
            let counters = device.take_counters();
            assert!(counters.submissions == 1 && counters.dispatches <= 12, "{mode:?}, {fill:?}: {counters:?}");
            assert!(counters.uploaded == 0 && counters.read_back < 1024, "{mode:?}, {fill:?}: {counters:?}");

            let sums = sampler.solid_sums_along(&ball, &Axis::ALL, mode, fill).unwrap();
            assert_eq!(sums.len(), 3);
            let counters = device.take_counters();
            assert!(counters.submissions == 1 && counters.dispatches <= 12, "{mode:?}, {fill:?}: {counters:?}");
            assert!(counters.uploaded == 0 && counters.read_back < 2048, "{mode:?}, {fill:?}: {counters:?}");
        }
    }
}

/// Out of memory, wherever it strikes: smaller jobs make the same image, or the error is told.
#[test]
fn jobs_are_divided_where_the_device_is_out_of_memory() {
    let ball = ClosedMesh::check(sphere(1.0, 32).unwrap()).unwrap();
    let grid = Grid::with_resolution(ball.bounds(), 40, 256).unwrap();
    let ball = grid.quantise(&ball).unwrap();
    for route in [Route::Lists, Route::Masks] {
        let (mut divided, mut told) = (0, 0);
        for mode in [Mode::Exact, Mode::Estimate(Estimate::Under)] {
            let expected = CpuSampler::default().sample_along(&ball, &Axis::ALL, mode, FillRule::EvenOdd).unwrap();
            for checks in 0.. {
                let sampler = GpuSampler::open(&ADAPTER, GpuOptions { route, ..GpuOptions::default() }).unwrap();
                let adapter = sampler.device().adapter().name.clone();
                let error = DeviceError::OutOfMemory { adapter, reason: "a test took it all".to_owned() };
                sampler.device().fail_after(checks, error.clone());
                let submissions = |sampler: &GpuSampler| sampler.device().take_counters().submissions;
                match sampler.sample_along(&ball, &Axis::ALL, mode, FillRule::EvenOdd) {
                    Ok(images) => assert!(images == expected, "{route:?}, {mode:?}, after {checks} checks"),
                    Err(found) => {
                        assert_eq!(found, SampleError::Device(error));
                        told += 1;
                        continue;
                    }
                }
                let taken = submissions(&sampler);
                let undisturbed = sampler.sample_along(&ball, &Axis::ALL, mode, FillRule::EvenOdd).unwrap();
                assert!(undisturbed == expected, "{route:?}, {mode:?}, after {checks} checks, again");
                if taken <= submissions(&sampler) {
                    break;
                }
                divided += 1;
            }
        }
        assert!(divided > 5 && told > 0, "{route:?}: divided {divided} times, told {told} times");
    }
}

#[test]
fn a_lost_device_stays_lost() {
    let cube = ClosedMesh::check(cuboid(DVec3::ZERO, DVec3::ONE).unwrap()).unwrap();
    let cube = Grid::with_resolution(cube.bounds(), 16, 64).unwrap().quantise(&cube).unwrap();
    for checks in 0..12 {
        let sampler = GpuSampler::open(&ADAPTER, GpuOptions::default()).unwrap();
        let adapter = sampler.device().adapter().name.clone();
        let error = DeviceError::Lost { adapter, reason: "a test pulled it out".to_owned() };
        sampler.device().fail_after(checks, error.clone());
        for _ in 0..2 {
            let found = sampler.sample_along(&cube, &Axis::ALL, Mode::Exact, FillRule::EvenOdd);
            assert_eq!(found.unwrap_err(), SampleError::Device(error.clone()), "after {checks} checks");
        }
    }
}
