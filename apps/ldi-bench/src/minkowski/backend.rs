//! The device that culls, samples and resolves gaps: the CPU, or a GPU on request.

use ldi_ops::fixed::Crossing;
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::minkowski::{
    CullCounts, Exterior, Polyhedron, Primitives, RaySpans, ResolvedSpans, SumMembership, cull, resolve,
};
#[cfg(feature = "gpu")]
use ldi_ops::minkowski::{cull::gpu::GpuCuller, resolve::gpu::GpuResolver};
use ldi_ops::sampler::SampleError;
use ldi_ops::sampler::cpu::CpuSampler;
#[cfg(feature = "gpu")]
use ldi_ops::sampler::gpu::{GpuOptions, GpuSampler};

use crate::BenchError;

/// The backend.
pub enum Backend {
    Cpu,
    #[cfg(feature = "gpu")]
    Gpu(Box<OnDevice>),
}

/// All stages on one device.
#[cfg(feature = "gpu")]
pub struct OnDevice {
    sampler: GpuSampler,
    culler: GpuCuller,
    resolver: GpuResolver,
}

impl Backend {
    /// Opens the adapter of the given name, or the CPU if there is no name.
    pub fn named(adapter: Option<&str>) -> Result<Backend, BenchError> {
        match adapter {
            None => Ok(Backend::Cpu),
            #[cfg(feature = "gpu")]
            Some(wanted) => Backend::on_device(wanted).map_err(BenchError::Device),
            #[cfg(not(feature = "gpu"))]
            Some(wanted) => Err(BenchError::model(wanted, "this program was built without the feature gpu")),
        }
    }

    #[cfg(feature = "gpu")]
    fn on_device(wanted: &str) -> Result<Backend, ldi_ops::gpu::DeviceError> {
        let adapters = ldi_ops::gpu::adapters();
        let sampler = GpuSampler::open(ldi_ops::gpu::choose(&adapters, Some(wanted))?, GpuOptions::default())?;
        let culler = GpuCuller::new(sampler.device(), sampler.arithmetic());
        let resolver = GpuResolver::new(sampler.device());
        Ok(Backend::Gpu(Box::new(OnDevice { sampler, culler, resolver })))
    }

    /// Returns the adapter's name, if any.
    pub fn name(&self) -> Option<String> {
        match self {
            Backend::Cpu => None,
            #[cfg(feature = "gpu")]
            Backend::Gpu(on) => Some(on.sampler.device().adapter().name.clone()),
        }
    }

    /// Returns the primitives of a sum.
    pub fn cull(&self, a: &Polyhedron, b: &Polyhedron) -> Result<(Primitives, CullCounts), BenchError> {
        match self {
            Backend::Cpu => Ok(cull(a, b)),
            #[cfg(feature = "gpu")]
            Backend::Gpu(on) => on.culler.cull(a, b).map_err(BenchError::Device),
        }
    }

    /// Returns the spans of a bounded sum along an axis.
    pub fn spans(
        &self,
        name: &str,
        primitives: &Primitives,
        grid: &Grid,
        axis: Axis,
    ) -> Result<(RaySpans<Crossing>, u64), BenchError> {
        let spans = match self {
            Backend::Cpu => {
                primitives.spans(grid, axis, Exterior::Out, &CpuSampler::default()).map_err(SampleError::from)
            }
            #[cfg(feature = "gpu")]
            Backend::Gpu(on) => primitives.spans(grid, axis, Exterior::Out, &on.sampler),
        };
        spans.map_err(|error| BenchError::model(name, error))
    }

    /// Returns the spans of a bounded sum with resolved gaps.
    pub fn resolve(
        &self,
        name: &str,
        grid: &Grid,
        spans: [RaySpans<Crossing>; 3],
        membership: &SumMembership,
    ) -> Result<ResolvedSpans<Crossing>, BenchError> {
        match self {
            Backend::Cpu => resolve(grid, spans, Exterior::Out, membership, &|_, _| ())
                .map_err(|error| BenchError::model(name, error)),
            #[cfg(feature = "gpu")]
            Backend::Gpu(on) => on
                .resolver
                .resolve(grid, spans, Exterior::Out, membership, &|_, _| ())
                .map_err(|error| BenchError::model(name, error)),
        }
    }
}
