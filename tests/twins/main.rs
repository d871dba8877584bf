//! The GPU's sampler against the CPU's, byte for byte. Needs an adapter, be it a software one, and fails without.
//!
//! The adapter is the first that is found, or the one that `LDI_ADAPTER` names.

mod images;
#[path = "../oracle/soups.rs"]
mod soups;

use std::sync::LazyLock;

use glam::DVec3;
use ldi_ops::gpu::{Adapter, Device, adapters, choose};
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::mesh::ClosedMesh;
use ldi_ops::sampler::gpu::{GpuOptions, GpuSampler};
use ldi_ops::sampler::{Estimate, Fill, Mode, Sampler};
use ldi_ops::solids::cuboid;

/// The adapter that everything here runs on.
static ADAPTER: LazyLock<Adapter> = LazyLock::new(|| {
    let wanted = std::env::var("LDI_ADAPTER").ok();
    let adapters = adapters();
    choose(&adapters, wanted.as_deref()).unwrap_or_else(|error| panic!("twins need an adapter: {error}")).clone()
});

/// A sampler with the given options.
fn sampler(options: GpuOptions) -> GpuSampler {
    GpuSampler::open(&ADAPTER, options).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_device_tells_how_fast_it_copies() {
    let device = Device::open(&ADAPTER).unwrap();
    device.keep_stage_times();
    let bandwidth = device.copy_bandwidth(1 << 22).unwrap();
    assert!(bandwidth > 0.0 && bandwidth.is_finite(), "{bandwidth}");
    assert_eq!(device.take_stage_times(), [], "copies are no stages of a job");
}

#[test]
fn every_stage_is_timed() {
    let sampler = sampler(GpuOptions::default());
    let device = sampler.device();
    let cube = ClosedMesh::check(cuboid(DVec3::ZERO, DVec3::ONE).unwrap()).unwrap();
    let grid = Grid::with_resolution(cube.bounds(), 16, 64).unwrap();
    let cube = grid.quantise(&cube).unwrap();
    let sample = || sampler.sample(&cube, Axis::X, Mode::Estimate(Estimate::Over), Fill::EvenOdd).unwrap();
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
