//! The command `report`.

use ldi_ops::report::ReportJob;
use ldi_ops::report::files::report_files;
use ldi_ops::report::scaffold_report::Severity;
use ldi_ops::{Error, ErrorKind};

use super::{Finished, Outcome};
use crate::exit::Exit;
use crate::progress::Progress;
use crate::resolve::Report;

/// Runs a command.
pub fn run(job: &ReportJob, report: &Report, progress: &Progress) -> Result<Finished, Error> {
    let reported = report_files(job, &progress.monitor(), |report| {
        for alert in report.alerts.iter().filter(|alert| alert.severity == Severity::Warning) {
            progress.warn(&alert.message);
        }
    })?;
    progress.finish();
    if let Some(failed) = &reported.failed {
        progress.warn(failed);
    }
    let exit = match reported.worst {
        Some(ErrorKind::Machine) => Exit::Machine,
        Some(_) => Exit::Input,
        None if reported.passed() => Exit::Done,
        None => Exit::CheckFalse,
    };
    Ok(Finished { outcome: Outcome::Reported(reported), report: report.clone(), exit })
}
