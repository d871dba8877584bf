//! The commands `intersect`, `union`, `difference`, `xor`, `csg`, `volume` and `sample`.

use std::slice;
use std::time::Instant;

use ldi_ops::Error;
use ldi_ops::driver::backend::Backends;
use ldi_ops::driver::job::{Backend, MeasureJob, Measurement};
use ldi_ops::driver::measure::measure_files;
use ldi_ops::driver::measured::{Measured, Method};
use ldi_ops::number::number;

use super::{Each, Finished, Outcome, Refused, say_warnings, surface_exit, worst};
use crate::exit::Exit;
use crate::progress::Progress;
use crate::resolve::{Command, Report};

/// Runs a command; `start` is the start of the process.
pub fn run(command: &Command<MeasureJob>, start: Instant, progress: &Progress) -> Result<Finished, Error> {
    let Command { job, inputs, target, report } = command;
    let monitor = progress.monitor();
    let opening = Instant::now();
    let backends = Backends::open(&job.backend)?;
    if let Backend::Gpu(_) = job.backend {
        monitor.detail(format_args!("opened the GPU in {:.4} s", opening.elapsed().as_secs_f64()));
    }
    let measure = |inputs, start| measure_files(job, inputs, target.as_ref(), &backends, start, &monitor);
    let results: Vec<Each<Measured>> = match job.measurement {
        Measurement::Volume => {
            let each = inputs.iter().enumerate().map(|(i, input)| {
                let start = if i == 0 { start } else { Instant::now() };
                measure(slice::from_ref(input), start).map_err(|error| Refused::new(&input.path, error))
            });
            each.collect()
        }
        _ => vec![Ok(measure(inputs, start)?)],
    };
    progress.finish();
    Ok(finished(results, report, progress))
}

/// Says what users should know of results, and returns them with the exit: a check is false if a tolerance was not reached, or if
/// what was asserted or requested is not there.
pub fn finished(results: Vec<Each<Measured>>, report: &Report, progress: &Progress) -> Finished {
    for measured in results.iter().flatten() {
        if let Some(refinement) =
            measured.refinement.filter(|refinement| refinement.reached && measured.volume.method != Method::Exact)
        {
            progress.note(refinement);
        }
        // Where the inputs leave one value, a greater resolution resolves nothing.
        let said = measured.warnings.iter().filter(|warning| warning.code != "not-resolved" || !is_pinned(measured));
        say_warnings(said, progress);
    }
    let exit = worst(&results, |measured| match measured.refinement {
        Some(refinement) if !refinement.reached => Exit::CheckFalse,
        _ if !measured.certified.holds() => Exit::CheckFalse,
        _ => surface_exit(measured.surface.as_ref()),
    });
    Finished { outcome: Outcome::Measured(results), report: report.clone(), exit }
}

/// Returns whether no ray met a result whose bounds by the inputs agree to seven digits: they are then its value.
pub fn is_pinned(result: &Measured) -> bool {
    let estimate = result.estimate();
    let [least, greatest] = estimate.possible.map(number);
    estimate.is_unresolved() && least == greatest
}
