//! The part of a sum that a GPU makes; `no_gpu.rs` takes this module's place in builds without them.

use crate::Error;
use crate::driver::gpu;
use crate::fixed::Hit;
use crate::gpu::DeviceError;
use crate::grid::{Axis, Grid};
use crate::minkowski::settle::gpu::{GpuSettleError, GpuSettler};
use crate::minkowski::{Membership, Outer, Primitives, RaySpans, SettleError, Settled};
use crate::sampler::SampleError;
use crate::sampler::gpu::GpuSampler;

/// A GPU that is open, with all of its device that sums take.
pub struct SumGpu {
    /// What it is called in results.
    pub name: String,
    sampler: GpuSampler,
    settler: GpuSettler,
}

impl SumGpu {
    /// Opens the adapter of a name, or the first one.
    pub fn open(wanted: Option<&str>) -> Result<SumGpu, Error> {
        let (name, sampler) = gpu::sampler(wanted)?;
        let settler = GpuSettler::new(sampler.device());
        Ok(SumGpu { name, sampler, settler })
    }

    /// Whether there is room for settling on a grid.
    pub fn admit(&self, grid: &Grid) -> Result<(), DeviceError> {
        self.settler.admit(grid)
    }

    pub fn spans<H: Hit>(
        &self,
        primitives: &Primitives,
        grid: &Grid,
        axis: Axis,
        outer: Outer,
    ) -> Result<(RaySpans<H>, u64), SampleError> {
        primitives.spans(grid, axis, outer, &self.sampler)
    }

    pub fn settle<H: Hit + Sync>(
        &self,
        grid: &Grid,
        spans: [RaySpans<H>; 3],
        outer: Outer,
        membership: &impl Membership,
        tell: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Result<Settled<H>, SettleError>, DeviceError> {
        match self.settler.settle(grid, spans, outer, membership, tell) {
            Ok(settled) => Ok(Ok(settled)),
            Err(GpuSettleError::Settle(error)) => Ok(Err(error)),
            Err(GpuSettleError::Device(error)) => Err(error),
        }
    }
}
