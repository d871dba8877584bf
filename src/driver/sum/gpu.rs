//! The part of a sum that a GPU makes; `no_gpu.rs` takes this module's place in builds without them.

use crate::Error;
use crate::driver::gpu;
use crate::fixed::Hit;
use crate::gpu::DeviceError;
use crate::grid::{Axis, Grid};
use crate::minkowski::resolve::gpu::{GpuResolveError, GpuResolver};
use crate::minkowski::{Exterior, Membership, Primitives, RaySpans, ResolveError, ResolvedSpans};
use crate::sampler::SampleError;
use crate::sampler::gpu::GpuSampler;

/// A GPU that is open, with all of its device that sums take.
pub struct SumGpu {
    /// What it is called in results.
    pub name: String,
    sampler: GpuSampler,
    resolver: GpuResolver,
}

impl SumGpu {
    /// Opens the adapter of a name, or the first one.
    pub fn open(wanted: Option<&str>) -> Result<SumGpu, Error> {
        let (name, sampler) = gpu::sampler(wanted)?;
        let resolver = GpuResolver::new(sampler.device());
        Ok(SumGpu { name, sampler, resolver })
    }

    /// Whether there is room for resolving on a grid.
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
        tell: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Result<ResolvedSpans<H>, ResolveError>, DeviceError> {
        match self.resolver.resolve(grid, spans, exterior, membership, tell) {
            Ok(resolved) => Ok(Ok(resolved)),
            Err(GpuResolveError::Resolve(error)) => Ok(Err(error)),
            Err(GpuResolveError::Device(error)) => Err(error),
        }
    }
}
