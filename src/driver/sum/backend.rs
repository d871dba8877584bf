//! The device of a sum: it samples primitives and resolves gaps on the CPU, or on the requested GPU.
//!
//! Culling takes milliseconds, and images are made from spans in host memory, so both stay on the CPU, as does the forecast on
//! its coarse raster. Both devices give the same bits. The failure of a GPU is an error; the CPU does not take over.

use super::gpu::SumGpu;
use crate::Error;
use crate::driver::backend::{Auto, Ran};
use crate::driver::job::Backend;
use crate::fixed::Hit;
use crate::gpu::DeviceError;
use crate::grid::{Axis, Grid};
use crate::minkowski::{Exterior, Membership, Primitives, RaySpans, ResolveError, ResolvedSpans, resolve};
use crate::sampler::cpu::CpuSampler;

/// Bits per node during gap resolution on the CPU, which keeps two planes of each slab.
const BITS_OF_NODE: f64 = 0.5;

/// Largest number of bits per node that a GPU returns: two states, three walls, open or not, and start of a run or not.
const BITS_OF_FLOODED_NODE: f64 = 7.0;

/// The device of a sum.
pub enum SumBackend {
    /// The CPU.
    Cpu,
    /// A GPU.
    Gpu(Box<SumGpu>),
}

impl SumBackend {
    /// Opens the requested device; `auto` takes the CPU.
    pub fn open(backend: &Backend) -> Result<SumBackend, Error> {
        match backend {
            Backend::Auto | Backend::Cpu => Ok(SumBackend::Cpu),
            Backend::Gpu(name) => Ok(SumBackend::Gpu(Box::new(SumGpu::open(name.as_deref())?))),
        }
    }

    /// Returns the device for reports, where `requested` is the requested one.
    pub fn ran(&self, requested: &Backend) -> Ran {
        let reason = || Auto { reason: "no GPU has been measured for sums yet".to_owned(), warning: None };
        let gpu = match self {
            SumBackend::Cpu => None,
            SumBackend::Gpu(gpu) => Some(gpu.name.clone()),
        };
        Ran { gpu, auto: (*requested == Backend::Auto).then(reason) }
    }

    /// Refuses a grid that does not fit into the memory of the device.
    pub fn admit(&self, grid: &Grid) -> Result<(), Error> {
        match self {
            SumBackend::Cpu => Ok(()),
            SumBackend::Gpu(gpu) => Ok(gpu.admit(grid)?),
        }
    }

    /// Returns the bits of host memory per node during gap resolution.
    pub fn bits_of_node(&self) -> f64 {
        match self {
            SumBackend::Cpu => BITS_OF_NODE,
            SumBackend::Gpu(_) => BITS_OF_FLOODED_NODE,
        }
    }

    /// Returns the spans of primitives along an axis, and the number of crossings.
    pub fn spans<H: Hit>(
        &self,
        primitives: &Primitives,
        grid: &Grid,
        axis: Axis,
        exterior: Exterior,
    ) -> Result<(RaySpans<H>, u64), Error> {
        match self {
            SumBackend::Cpu => primitives.spans(grid, axis, exterior, &CpuSampler::default()).map_err(Error::machine),
            SumBackend::Gpu(gpu) => Ok(gpu.spans(primitives, grid, axis, exterior)?),
        }
    }

    /// Resolves gaps. Fails if rays contradict each other, or if the device fails. It reports the number of tested components and
    /// their total to `report_progress`.
    pub fn resolve<H: Hit + Sync>(
        &self,
        grid: &Grid,
        spans: [RaySpans<H>; 3],
        exterior: Exterior,
        membership: &impl Membership,
        report_progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Result<ResolvedSpans<H>, ResolveError>, DeviceError> {
        match self {
            SumBackend::Cpu => Ok(resolve(grid, spans, exterior, membership, report_progress)),
            SumBackend::Gpu(gpu) => gpu.resolve(grid, spans, exterior, membership, report_progress),
        }
    }
}
