//! `devices`: lists the devices that can sample.

use ldi_ops::Error;
use ldi_ops::driver::backend::{LARGE_WORK, crossings};
use ldi_ops::driver::device::GpuDevice;
use ldi_ops::driver::{gpu, machine};
use ldi_ops::gpu::DeviceError;

use super::{Finished, Outcome};
use crate::exit::Exit;
use crate::resolve::DevicesJob;

/// The available devices.
pub struct Devices {
    /// The processor's name, if the system reports it.
    pub cpu: Option<String>,
    pub threads: usize,
    /// True if this build can use a GPU.
    pub gpu_built: bool,
    /// The GPUs, the likeliest choice first.
    pub gpus: Vec<GpuDevice>,
    /// The reason why no GPU is listed.
    pub no_gpu: Option<String>,
    pub auto: AutoChoice,
}

/// The choice of `--backend auto` for large work, and its reason. Small work stays on the CPU.
pub struct AutoChoice {
    pub backend: &'static str,
    pub reason: String,
}

pub fn run(job: &DevicesJob) -> Result<Finished, Error> {
    let threads = rayon::current_num_threads();
    let (gpus, automatic) = gpu::list();
    let why_none = || gpu::ABSENT.map_or_else(|| DeviceError::NoAdapter.to_string(), str::to_owned);
    let no_gpu = gpus.is_empty().then(why_none);
    let auto = match automatic {
        Ok(reason) => {
            let small = crossings(LARGE_WORK * threads as f64);
            let reason = format!("{reason}; less than {small} stays on the CPU");
            AutoChoice { backend: "gpu", reason }
        }
        Err(reason) => AutoChoice { backend: "cpu", reason },
    };
    let devices = Devices { cpu: machine::cpu_name(), threads, gpu_built: gpu::ABSENT.is_none(), gpus, no_gpu, auto };
    Ok(Finished { outcome: Outcome::Devices(devices), report: job.report.clone(), exit: Exit::Done })
}
