//! In the place of `gpu.rs` in builds without the feature `gpu`: no GPU is ever open.

use std::convert::Infallible;

use crate::Error;
use crate::driver::gpu;
use crate::gpu::DeviceError;
use crate::grid::{Axis, Grid};
use crate::minkowski::{Exterior, Primitives, RaySpans, ResolveError, ResolvedSpans};
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

    pub fn spans<H>(&self, _: &Primitives, _: &Grid, _: Axis, _: Exterior) -> Result<(RaySpans<H>, u64), SampleError> {
        match self.never {}
    }

    pub fn resolve<H, M>(
        &self,
        _: &Grid,
        _: [RaySpans<H>; 3],
        _: Exterior,
        _: &M,
        _: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Result<ResolvedSpans<H>, ResolveError>, DeviceError> {
        match self.never {}
    }
}
