//! In the place of `gpu.rs` in builds without the feature `gpu`: no GPU is ever open.

use std::convert::Infallible;

use ldi_ops::gpu::DeviceError;
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::minkowski::{Outer, Primitives, RaySpans, SettleError, Settled};
use ldi_ops::sampler::SampleError;

use crate::exit::Failure;
use crate::run::gpu;

/// A GPU that is never open.
pub struct SumGpu {
    pub name: String,
    never: Infallible,
}

impl SumGpu {
    pub fn open(wanted: Option<&str>) -> Result<SumGpu, Failure> {
        Err(gpu::refused(wanted))
    }

    pub fn admit(&self, _: &Grid) -> Result<(), DeviceError> {
        match self.never {}
    }

    pub fn spans<H>(&self, _: &Primitives, _: &Grid, _: Axis, _: Outer) -> Result<(RaySpans<H>, u64), SampleError> {
        match self.never {}
    }

    pub fn settle<H, M>(
        &self,
        _: &Grid,
        _: [RaySpans<H>; 3],
        _: Outer,
        _: &M,
        _: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Result<Settled<H>, SettleError>, DeviceError> {
        match self.never {}
    }
}
