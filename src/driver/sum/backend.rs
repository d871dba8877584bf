//! Where the crossings of primitives are found and gaps resolved: on the CPU, or on the GPU that was asked for.
//!
//! Culling takes milliseconds and images are made of what has come back, so both stay on the CPU, and so does the forecast on
//! its coarse raster. The bits are the same by either. A GPU that gives up is an error and never a reason for the CPU to go on.

use super::gpu::SumGpu;
use crate::Error;
use crate::driver::backend::{Auto, Ran};
use crate::driver::job::Backend;
use crate::fixed::Hit;
use crate::gpu::DeviceError;
use crate::grid::{Axis, Grid};
use crate::minkowski::{Exterior, Membership, Primitives, RaySpans, ResolveError, ResolvedSpans, resolve};
use crate::sampler::cpu::CpuSampler;

/// Bits that resolving on the CPU remembers of a node: two planes of each slab are kept.
const BITS_OF_NODE: f64 = 0.5;

/// Bits of a node that a GPU sends back at the most: two states, three walls, and what of them is open, and begins a run.
const BITS_OF_FLOODED_NODE: f64 = 7.0;

/// One of them.
pub enum SumBackend {
    /// The processor.
    Cpu,
    /// A GPU.
    Gpu(Box<SumGpu>),
}

impl SumBackend {
    /// Opens the device that was asked for; `auto` takes none.
    pub fn open(backend: &Backend) -> Result<SumBackend, Error> {
        match backend {
            Backend::Auto | Backend::Cpu => Ok(SumBackend::Cpu),
            Backend::Gpu(wanted) => Ok(SumBackend::Gpu(Box::new(SumGpu::open(wanted.as_deref())?))),
        }
    }

    /// What is told of it, where `asked` is what was asked for.
    pub fn ran(&self, asked: &Backend) -> Ran {
        let reason = || Auto { reason: "no GPU has been measured for sums yet".to_owned(), warning: None };
        let gpu = match self {
            SumBackend::Cpu => None,
            SumBackend::Gpu(gpu) => Some(gpu.name.clone()),
        };
        Ran { gpu, auto: (*asked == Backend::Auto).then(reason) }
    }

    /// Refuses a grid that a device has no room for.
    pub fn admit(&self, grid: &Grid) -> Result<(), Error> {
        match self {
            SumBackend::Cpu => Ok(()),
            SumBackend::Gpu(gpu) => Ok(gpu.admit(grid)?),
        }
    }

    /// Bits of the host that resolving takes for each node.
    pub fn bits_of_node(&self) -> f64 {
        match self {
            SumBackend::Cpu => BITS_OF_NODE,
            SumBackend::Gpu(_) => BITS_OF_FLOODED_NODE,
        }
    }

    /// The spans of primitives along an axis, and how many crossings there were.
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

    /// Removes gaps that are none, if no two rays contradict one another and the device does not fail.
    pub fn resolve<H: Hit + Sync>(
        &self,
        grid: &Grid,
        spans: [RaySpans<H>; 3],
        exterior: Exterior,
        membership: &impl Membership,
        tell: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Result<ResolvedSpans<H>, ResolveError>, DeviceError> {
        match self {
            SumBackend::Cpu => Ok(resolve(grid, spans, exterior, membership, tell)),
            SumBackend::Gpu(gpu) => gpu.resolve(grid, spans, exterior, membership, tell),
        }
    }
}
