//! The choice of the device that samples: the requested one, or the one that `auto` chooses, with the reason.

use std::fmt;
use std::sync::OnceLock;

use super::device::Gpu;
use super::gpu;
use super::job::Backend;
use crate::gpu::DeviceError;
use crate::grid::{Axis, LatticeSolid};
use crate::ldi::{Ldi, VolumeSums};
use crate::sampler::cpu::CpuSampler;
use crate::sampler::{
    Combination, Combined, Estimate, FillRule, MaskIntersection, Mode, SampleError, Sampler, SolidSums,
};
use crate::{Error, Warning};

/// Triangles and expected crossings per CPU thread from which `auto` looks for a GPU.
///
/// This is an estimate; it has not been measured on hardware. Opening a device and compiling its shaders takes 0.1 to 0.3 s, in
/// which each CPU thread processes up to 15 million crossings of 20 ns.
pub const LARGE_WORK: f64 = 15e6;

/// The samplers of one run, which threads may share. It opens a device once for all images.
pub struct Backends {
    cpu: CpuSampler,
    request: Request,
}

/// The requested device.
enum Request {
    Cpu,
    Gpu(Gpu),
    /// The result of the search for a GPU, which takes time and starts at the first large work.
    Auto(OnceLock<Found>),
}

/// The result of the search for a GPU.
enum Found {
    Gpu {
        gpu: WithCpu,
        reason: String,
    },
    /// The reason why there is no GPU.
    Nothing(String),
    /// A GPU that could not be opened.
    Broken(DeviceError),
}

impl Backends {
    /// Opens the requested device. `auto` opens none yet.
    pub fn open(backend: &Backend) -> Result<Backends, Error> {
        let request = match backend {
            Backend::Auto => Request::Auto(OnceLock::new()),
            Backend::Cpu => Request::Cpu,
            Backend::Gpu(name) => Request::Gpu(gpu::open(name.as_deref())?),
        };
        Ok(Backends { cpu: CpuSampler::default(), request })
    }

    /// Returns the sampler for some work; `work` counts triangles and crossings.
    pub fn choose(&self, work: impl FnOnce() -> f64) -> Choice<'_> {
        match &self.request {
            Request::Cpu => Choice::Cpu { cpu: &self.cpu, auto: None },
            Request::Gpu(gpu) => Choice::Gpu(gpu),
            Request::Auto(found) => {
                if let Some(absent) = gpu::ABSENT {
                    return self.auto_cpu(absent.to_owned());
                }
                let work = work();
                if work < LARGE_WORK * rayon::current_num_threads() as f64 {
                    return self.auto_cpu(format!("{} are too few to open a GPU for", crossings(work)));
                }
                match found.get_or_init(find_gpu) {
                    Found::Gpu { gpu, reason } => Choice::AutoGpu { gpu, reason },
                    Found::Nothing(reason) => self.auto_cpu(reason.clone()),
                    Found::Broken(fault) => Choice::Cpu { cpu: &self.cpu, auto: Some(Auto::after(fault)) },
                }
            }
        }
    }

    fn auto_cpu(&self, reason: String) -> Choice<'_> {
        Choice::Cpu { cpu: &self.cpu, auto: Some(Auto { reason, warning: None }) }
    }
}

/// Returns a size of work as text.
pub fn crossings(work: f64) -> String {
    format!("{:.1} million triangles and crossings", work / 1e6)
}

fn find_gpu() -> Found {
    match gpu::automatic() {
        Err(reason) => Found::Nothing(reason),
        Ok(automatic) => match automatic.open() {
            Ok(gpu) => Found::Gpu { gpu: WithCpu { gpu, fault: OnceLock::new() }, reason: automatic.reason },
            Err(fault) => Found::Broken(fault),
        },
    }
}

/// The chosen device.
pub enum Choice<'b> {
    /// The processor.
    Cpu {
        /// Its sampler.
        cpu: &'b CpuSampler,
        /// The choice of `auto`; `None` where the CPU was requested.
        auto: Option<Auto>,
    },
    /// The requested GPU.
    Gpu(&'b Gpu),
    /// The GPU that `auto` chose.
    AutoGpu {
        /// The GPU, with the CPU as its fallback.
        gpu: &'b WithCpu,
        /// The reason, as text.
        reason: &'b str,
    },
}

impl Choice<'_> {
    /// Returns the sampler.
    pub fn sampler(&self) -> &dyn MaskIntersection {
        match self {
            Choice::Cpu { cpu, .. } => *cpu,
            Choice::Gpu(gpu) => gpu.sampler.as_ref(),
            Choice::AutoGpu { gpu, .. } => *gpu,
        }
    }

    /// Returns whether the device is a GPU. Transferring images from it takes time, so sums are better computed on it.
    pub fn is_gpu(&self) -> bool {
        !matches!(self, Choice::Cpu { .. })
    }

    /// Returns the device that has made the images so far.
    pub fn ran(&self) -> Ran {
        match self {
            Choice::Cpu { auto, .. } => Ran { gpu: None, auto: auto.clone() },
            Choice::Gpu(gpu) => Ran { gpu: Some(gpu.name.clone()), auto: None },
            Choice::AutoGpu { gpu, reason } => match gpu.fault.get() {
                None => {
                    let auto = Auto { reason: (*reason).to_owned(), warning: None };
                    Ran { gpu: Some(gpu.gpu.name.clone()), auto: Some(auto) }
                }
                Some(fault) => Ran { gpu: None, auto: Some(Auto::after(fault)) },
            },
        }
    }
}

/// The device that made the images of a result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ran {
    /// The name of the GPU; `None` for the CPU.
    pub gpu: Option<String>,
    /// The choice of `auto`; `None` where the device was requested.
    pub auto: Option<Auto>,
}

impl Ran {
    /// Returns the name of the backend, as `--backend` takes it.
    pub fn backend(&self) -> &'static str {
        if self.gpu.is_some() { "gpu" } else { "cpu" }
    }
}

impl fmt::Display for Ran {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match &self.gpu {
            Some(name) => write!(f, "gpu, {name}")?,
            None => write!(f, "cpu, {} threads", rayon::current_num_threads())?,
        }
        match &self.auto {
            Some(Auto { reason, .. }) => write!(f, " (auto: {reason})"),
            None => Ok(()),
        }
    }
}

/// The choice of `auto`, explained.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Auto {
    /// The reason, as text.
    pub reason: String,
    /// The warning that the chosen GPU failed.
    pub warning: Option<Warning>,
}

impl Auto {
    /// Returns the choice of the CPU after the chosen GPU could not be opened or failed.
    fn after(fault: &DeviceError) -> Auto {
        let warning =
            Warning::new("gpu-failed", format!("{fault}; --backend auto continued on the CPU, with the same results"));
        Auto { reason: format!("the GPU failed: {fault}"), warning: Some(warning) }
    }
}

/// A GPU that `auto` chose. When it fails, the CPU makes this image and all later ones, with the same bits.
pub struct WithCpu {
    gpu: Gpu,
    fault: OnceLock<DeviceError>,
}

impl WithCpu {
    fn run<T>(&self, operation: impl Fn(&dyn MaskIntersection) -> Result<T, SampleError>) -> Result<T, SampleError> {
        if self.fault.get().is_none() {
            match operation(self.gpu.sampler.as_ref()) {
                // Another thread may have recorded its own meanwhile.
                Err(SampleError::Device(fault)) => drop(self.fault.set(fault)),
                result => return result,
            }
        }
        operation(&CpuSampler::default())
    }
}

impl Sampler for WithCpu {
    fn sample(&self, solid: &LatticeSolid, axis: Axis, mode: Mode, fill: FillRule) -> Result<Ldi, SampleError> {
        self.run(|sampler| sampler.sample(solid, axis, mode, fill))
    }

    fn sample_along(
        &self,
        solid: &LatticeSolid,
        axes: &[Axis],
        mode: Mode,
        fill: FillRule,
    ) -> Result<Vec<Ldi>, SampleError> {
        self.run(|sampler| sampler.sample_along(solid, axes, mode, fill))
    }

    fn sample_surface(&self, solid: &LatticeSolid, axis: Axis, fill: FillRule) -> Result<Ldi, SampleError> {
        self.run(|sampler| sampler.sample_surface(solid, axis, fill))
    }

    fn volume_sums(
        &self,
        solid: &LatticeSolid,
        axis: Axis,
        mode: Mode,
        fill: FillRule,
    ) -> Result<VolumeSums, SampleError> {
        self.run(|sampler| sampler.volume_sums(solid, axis, mode, fill))
    }

    fn volume_sums_along(
        &self,
        solid: &LatticeSolid,
        axes: &[Axis],
        mode: Mode,
        fill: FillRule,
    ) -> Result<Vec<VolumeSums>, SampleError> {
        self.run(|sampler| sampler.volume_sums_along(solid, axes, mode, fill))
    }

    fn solid_sums_along(
        &self,
        solid: &LatticeSolid,
        axes: &[Axis],
        mode: Mode,
        fill: FillRule,
    ) -> Result<Vec<SolidSums>, SampleError> {
        self.run(|sampler| sampler.solid_sums_along(solid, axes, mode, fill))
    }

    fn sample_combination(
        &self,
        combination: Combination,
        axis: Axis,
        fill: FillRule,
    ) -> Result<Option<Combined<Ldi>>, SampleError> {
        self.run(|sampler| sampler.sample_combination(combination, axis, fill))
    }

    fn combination_sums_along(
        &self,
        combination: Combination,
        axes: &[Axis],
        fill: FillRule,
    ) -> Result<Option<Vec<Combined<VolumeSums>>>, SampleError> {
        self.run(|sampler| sampler.combination_sums_along(combination, axes, fill))
    }
}

impl MaskIntersection for WithCpu {
    fn sample_intersection(
        &self,
        solids: [&LatticeSolid; 2],
        axis: Axis,
        estimate: Estimate,
        fill: FillRule,
    ) -> Result<Ldi, SampleError> {
        self.run(|sampler| sampler.sample_intersection(solids, axis, estimate, fill))
    }

    fn intersection_sums_along(
        &self,
        solids: [&LatticeSolid; 2],
        axes: &[Axis],
        estimate: Estimate,
        fill: FillRule,
    ) -> Result<Vec<VolumeSums>, SampleError> {
        self.run(|sampler| sampler.intersection_sums_along(solids, axes, estimate, fill))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU32, Ordering};

    use crate::grid::Grid;
    use crate::mesh::ClosedMesh;
    use crate::solids;
    use glam::DVec3;

    use super::*;

    /// A sampler that makes some images, and then loses its device.
    struct Faltering {
        left: Arc<AtomicU32>,
    }

    impl Faltering {
        fn image(&self, image: Result<Ldi, SampleError>) -> Result<Ldi, SampleError> {
            let Some(left) = self.left.load(Ordering::Relaxed).checked_sub(1) else {
                return Err(DeviceError::Lost { adapter: "A card".to_owned(), reason: "pulled out".to_owned() }.into());
            };
            self.left.store(left, Ordering::Relaxed);
            image
        }
    }

    impl Sampler for Faltering {
        fn sample(&self, solid: &LatticeSolid, axis: Axis, mode: Mode, fill: FillRule) -> Result<Ldi, SampleError> {
            self.image(CpuSampler::default().sample(solid, axis, mode, fill))
        }

        fn sample_surface(&self, solid: &LatticeSolid, axis: Axis, fill: FillRule) -> Result<Ldi, SampleError> {
            self.image(CpuSampler::default().sample_surface(solid, axis, fill))
        }
    }

    impl MaskIntersection for Faltering {
        fn sample_intersection(
            &self,
            solids: [&LatticeSolid; 2],
            axis: Axis,
            estimate: Estimate,
            fill: FillRule,
        ) -> Result<Ldi, SampleError> {
            self.image(CpuSampler::default().sample_intersection(solids, axis, estimate, fill))
        }
    }

    #[test]
    fn the_cpu_takes_over_from_a_failed_gpu_that_auto_chose() {
        let closed = ClosedMesh::check(solids::cuboid(DVec3::ZERO, DVec3::ONE).unwrap()).unwrap();
        let grid = Grid::with_resolution(closed.bounds(), 8, 1024).unwrap();
        let solid = grid.quantise(&closed).unwrap();
        let left = Arc::new(AtomicU32::new(1));
        let gpu = Gpu { name: "A card".to_owned(), sampler: Box::new(Faltering { left: Arc::clone(&left) }) };
        let gpu = WithCpu { gpu, fault: OnceLock::new() };
        let choice = Choice::AutoGpu { gpu: &gpu, reason: "it is there" };
        let image = || choice.sampler().sample(&solid, Axis::Z, Mode::Exact, FillRule::EvenOdd).unwrap();
        let first = image();
        assert_eq!(choice.ran().to_string(), "gpu, A card (auto: it is there)");
        assert!(image() == first && image() == first);
        let ran = choice.ran();
        assert_eq!((ran.backend(), left.load(Ordering::Relaxed)), ("cpu", 0));
        let warning = ran.auto.and_then(|auto| auto.warning).unwrap();
        assert!(warning.message.contains("A card was lost: pulled out"), "{}", warning.message);
        assert!(warning.message.contains("continued on the CPU"), "{}", warning.message);
    }

    #[test]
    fn small_work_stays_on_the_cpu_without_a_search_for_adapters() {
        let backends = Backends::open(&Backend::Auto).unwrap();
        let ran = backends.choose(|| 1.26e6).ran();
        assert_eq!(ran.backend(), "cpu");
        let reason = ran.auto.unwrap().reason;
        assert_eq!(
            reason.contains("1.3 million triangles and crossings are too few"),
            gpu::ABSENT.is_none(),
            "{reason}"
        );
        let Request::Auto(found) = &backends.request else { panic!("the request is `auto`") };
        assert!(found.get().is_none());
    }
}
