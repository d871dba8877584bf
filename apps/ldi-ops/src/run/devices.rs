//! `devices`: where sampling can run.

use super::{Finished, machine};
use crate::exit::{Exit, Failure};
use crate::resolve::DevicesJob;
use crate::{json, report};

/// What there is to run on.
pub struct Devices {
    /// The processor's name, where the system tells it.
    pub cpu: Option<String>,
    pub threads: usize,
    pub gpu: &'static str,
    /// Why `--backend auto` chooses what it chooses.
    pub reason: &'static str,
}

pub fn run(job: &DevicesJob) -> Result<Finished, Failure> {
    let devices = Devices {
        cpu: machine::cpu_name(),
        threads: rayon::current_num_threads(),
        gpu: "not in this build",
        reason: "it is the only sampler in this build",
    };
    let stdout = json::deliver(&job.report, || json::devices(&devices), || report::devices(&devices))?;
    Ok(Finished { stdout, exit: Exit::Done })
}
