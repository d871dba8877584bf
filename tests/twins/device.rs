//! The measurements of a device: the times of its stages and its copy bandwidth.

use glam::DVec3;
use ldi_ops::gpu::{Device, Needs};
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::mesh::ClosedMesh;
use ldi_ops::sampler::gpu::{GpuOptions, GpuSampler, Route};
use ldi_ops::sampler::{Estimate, FillRule, Mode, Sampler};
use ldi_ops::solids::cuboid;

use crate::twin::ADAPTER;

#[test]
fn the_copy_bandwidth_of_a_device_is_positive() {
    let device = Device::open(&ADAPTER, Needs::default()).unwrap();
    device.keep_stage_times();
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
    device.keep_stage_times();
    sample();
    let times = device.take_stage_times();
    let is_timed = |name: &str| times.iter().any(|time| time.stage == name);
    for stage in ["masks", "masks (large triangles)", "classify", "identities", "retrieve"] {
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
    for (route, stage) in [(Route::Masks, "masks"), (Route::Lists, "scatter"), (Route::Tiles, "tiles")] {
        let sampler = GpuSampler::open(&ADAPTER, GpuOptions { route, ..GpuOptions::default() }).unwrap();
        let device = sampler.device();
        device.keep_stage_times();
        sampler.sample(&cube, Axis::Y, Mode::Estimate(Estimate::Under), FillRule::EvenOdd).unwrap();
        let times = device.take_stage_times();
        let is_timed = times.iter().any(|time| time.stage == stage);
        assert_eq!(is_timed, device.adapter().timestamps, "{stage}: {times:?}");
    }
}
