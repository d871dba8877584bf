//! The GPU's sampler against the CPU's, byte for byte. Needs an adapter, be it a software one, and fails without.
//!
//! The adapter is the first that is found, or the one that `LDI_ADAPTER` names.

mod device;
mod images;
#[path = "../oracle/soups.rs"]
mod soups;

use std::sync::LazyLock;

use ldi_ops::gpu::{Adapter, adapters, choose};
use ldi_ops::sampler::gpu::{GpuOptions, GpuSampler};

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
