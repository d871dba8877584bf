//! In the place of `gpu.rs` in builds without the feature `gpu`: no GPU is ever open.

use std::convert::Infallible;

use crate::Error;
use crate::driver::gpu;
use crate::gpu::DeviceError;
use crate::grid::{Axis, Grid};
use crate::minkowski::{Outer, Primitives, RaySpans, SettleError, Settled};
use crate::sampler::SampleError;

/// A GPU that is never open.
pub struct SumGpu {
    pub name: String,
    never: Infallible,
}

impl SumGpu {
    pub fn open(wanted: Option<&str>) -> Result<SumGpu, Error> {
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
