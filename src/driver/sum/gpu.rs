//! The part of a sum that runs on a GPU. Builds without the feature `gpu` use `no_gpu.rs` instead.

use crate::Error;
use crate::driver::gpu;
use crate::fixed::Hit;
use crate::gpu::DeviceError;
use crate::grid::{Axis, Grid};
use crate::minkowski::resolve::gpu::{GpuResolveError, GpuResolver};
use crate::minkowski::{Exterior, Membership, Primitives, RaySpans, ResolveError, ResolvedSpans};
use crate::sampler::SampleError;
use crate::sampler::gpu::GpuSampler;

/// An open GPU, with its sampler and its resolver of gaps.
pub struct SumGpu {
    /// The name in results.
    pub name: String,
    sampler: GpuSampler,
    resolver: GpuResolver,
}

impl SumGpu {
    /// Opens the adapter of a name, or the first adapter.
    pub fn open(requested: Option<&str>) -> Result<SumGpu, Error> {
        let (name, sampler) = gpu::sampler(requested)?;
        let resolver = GpuResolver::new(sampler.device());
        Ok(SumGpu { name, sampler, resolver })
    }

    /// Checks that the device has memory for gap resolution on a grid.
    pub fn admit(&self, grid: &Grid) -> Result<(), DeviceError> {
        self.resolver.admit(grid)
    }

    pub fn spans<H: Hit>(
        &self,
        primitives: &Primitives,
        grid: &Grid,
        axis: Axis,
        exterior: Exterior,
    ) -> Result<(RaySpans<H>, u64), SampleError> {
        primitives.spans(grid, axis, exterior, &self.sampler)
    }

    pub fn resolve<H: Hit + Sync>(
        &self,
        grid: &Grid,
        spans: [RaySpans<H>; 3],
        exterior: Exterior,
        membership: &impl Membership,
        report_progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Result<ResolvedSpans<H>, ResolveError>, DeviceError> {
        match self.resolver.resolve(grid, spans, exterior, membership, report_progress) {
            Ok(resolved) => Ok(Ok(resolved)),
            Err(GpuResolveError::Resolve(error)) => Ok(Err(error)),
            Err(GpuResolveError::Device(error)) => Err(error),
        }
    }
}
