//! Resolution of `sweep`.

use std::path::PathBuf;

use ldi_ops::Error;
use ldi_ops::report::sweep::SweepJob;

use super::{Invocation, Job, device, invocation, report, usable};
use crate::args::SweepArguments;

/// Resolves `sweep`.
pub fn resolve(arguments: SweepArguments) -> Result<Invocation, Error> {
    let SweepArguments { plan, output, shard, device: choice, common } = arguments;
    let flag = if output.is_some() { "-o " } else { "no -o is given, and " };
    let folder = output.unwrap_or_else(|| {
        let mut name = plan.file_stem().unwrap_or_default().to_owned();
        name.push("-sweep");
        PathBuf::from(name)
    });
    usable(flag, &folder, "a sweep")?;
    let (backend, memory) = device(choice)?;
    Ok(invocation(Job::Sweep(SweepJob { plan, folder, shard, backend, memory }, report(&common)?), &common))
}
