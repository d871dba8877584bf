//! The replacement of `gpu.rs` in builds without the feature `gpu`: no GPU can be opened.

use std::convert::Infallible;

use crate::Error;
use crate::driver::gpu;
use crate::gpu::DeviceError;
use crate::grid::{Axis, Grid};
use crate::minkowski::{Exterior, Primitives, RaySpans, ResolveError, ResolvedSpans};
use crate::sampler::SampleError;

/// The type of a GPU, which this build never opens.
pub struct SumGpu {
    pub name: String,
    never: Infallible,
}

impl SumGpu {
    pub fn open(requested: Option<&str>) -> Result<SumGpu, Error> {
        Err(gpu::refused(requested))
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
