//! Resolution of `sweep`.

use ldi_ops::Error;
use ldi_ops::report::sweep::SweepJob;

use super::{Invocation, Job, device, invocation, report, usable};
use crate::args::SweepArguments;

/// Resolves `sweep`.
pub fn resolve(arguments: SweepArguments) -> Result<Invocation, Error> {
    let SweepArguments { plan, output: folder, shard, device: choice, common } = arguments;
    usable("-o ", &folder, "a sweep")?;
    let (backend, memory) = device(choice)?;
    Ok(invocation(Job::Sweep(SweepJob { plan, folder, shard, backend, memory }, report(&common)?), &common))
}
