//! A check that no output overwrites an input or another output.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use ldi_ops::Error;
use ldi_ops::driver::job::Input;
use ldi_ops::mesh::io;
use ldi_ops::report::Roi;
use ldi_ops::report::clash;
use ldi_ops::report::files;
use ldi_ops::report::sweep;

use crate::output::{Identity, identity};
use crate::resolve::{Job, Report};

/// Rejects a job whose outputs would overwrite an input, a file that an input refers to, or one another.
pub fn keep_apart(job: &Job) -> Result<(), Error> {
    let mut outputs: HashMap<Identity, String> = HashMap::new();
    let mut is_replaced = false;
    for (name, path) in files_written(job) {
        is_replaced |= path.exists();
        if let Some(other) = outputs.insert(identity(&path), name.clone()) {
            return Err(Error::input(format!("{other} and {name} are the same file; each needs its own")));
        }
    }
    let refuse = |path: &Path, role: String| match outputs.get(&identity(path)) {
        Some(name) => Err(Error::input(format!("{name}: {role} would be overwritten; choose another name"))),
        None => Ok(()),
    };
    for input in files_read(job) {
        refuse(input, format!("the input {}", input.display()))?;
        // Only existing outputs can be files that an input refers to; finding these requires reading the input.
        let side_files = if is_replaced { io::side_files(input) } else { Vec::new() };
        for file in side_files {
            refuse(&file, format!("{}, which {} refers to,", file.display(), input.display()))?;
        }
    }
    Ok(())
}

/// Returns the input files named on the command line.
fn files_read(job: &Job) -> Vec<&Path> {
    match job {
        Job::Measure(job) => paths(&job.inputs),
        Job::Render(job) => paths(&job.inputs),
        Job::Sum(job) => paths(&job.inputs),
        Job::Surface(job) => vec![&job.images],
        Job::Check(job) => job.meshes.iter().map(PathBuf::as_path).collect(),
        Job::Convert(job) => vec![&job.from.path],
        Job::Report(job, _) => {
            let roi = job.roi.iter().filter_map(|roi| match roi {
                Roi::Solid(input) => Some(input),
                Roi::Hull | Roi::Wrap(_) => None,
            });
            let solids = job.solids.iter().chain(roi).chain(&job.compare);
            solids.map(|input| input.path.as_path()).chain(job.limits.as_deref()).collect()
        }
        Job::Clash(command) => {
            let inputs = paths(&command.job.inputs).into_iter().filter(|path| !path.is_dir());
            inputs.chain(command.job.assembly.as_deref()).collect()
        }
        Job::Sweep(job, _) => vec![&job.plan],
        Job::Generate(_) | Job::Devices(_) | Job::Completions(_) | Job::Man(_) => Vec::new(),
    }
}

fn paths(inputs: &[Input]) -> Vec<&Path> {
    inputs.iter().map(|input| input.path.as_path()).collect()
}

/// Returns the files to be written, each with a description.
fn files_written(job: &Job) -> Vec<(String, PathBuf)> {
    let (output, report) = match job {
        Job::Measure(job) => (job.target.as_ref().map(|target| &target.path), &job.report),
        Job::Sum(job) => (job.target.as_ref().map(|target| &target.path), &job.report),
        Job::Surface(job) => (Some(&job.target.path), &job.report),
        Job::Convert(job) => (Some(&job.to), &job.report),
        Job::Generate(job) => (Some(&job.to), &job.report),
        Job::Render(job) => (Some(&job.job.to), &job.report),
        Job::Check(job) => (None, &job.report),
        Job::Devices(job) => (None, &job.report),
        Job::Report(_, report) | Job::Sweep(_, report) => (None, report),
        Job::Clash(command) => (None, &command.report),
        Job::Completions(_) | Job::Man(_) => (None, &Report::Text),
    };
    let mut files: Vec<(String, PathBuf)> = Vec::new();
    if let Report::TextAndJson(path) = report {
        files.push((format!("--json {}", path.display()), path.clone()));
    }
    files.extend(output.map(|path| (format!("-o {}", path.display()), path.clone())));
    if let Job::Clash(command) = job {
        files.extend(command.csv.iter().map(|path| (format!("--csv {}", path.display()), path.clone())));
        let of_clash = |path: PathBuf| (format!("{}, a file of the comparison,", path.display()), path);
        files.extend(command.folder.iter().flat_map(|folder| clash::files(folder)).map(of_clash));
    }
    if let Job::Sweep(job, _) = job {
        let of_sweep = |path: PathBuf| (format!("{}, a file of the sweep,", path.display()), path);
        files.extend(sweep::files(&job.folder).into_iter().map(of_sweep));
    }
    if let Job::Report(job, _) = job {
        let of_report = |path: PathBuf| (format!("{}, a file of the report,", path.display()), path);
        files.extend(files::files(job).into_iter().map(of_report));
    }
    files
}
