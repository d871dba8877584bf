//! A report on a scaffold within a bone, held to limits.
//! `cargo run --release --example scaffold_report -- data/models/gyroid_sheet.stl data/models/bone.stl data/limits.toml`

#![allow(clippy::print_stdout)]

use std::process::ExitCode;

use ldi_ops::{Error, Limits, Report, Settings, Solid, Unit};

fn main() -> Result<ExitCode, Error> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scaffold, bone, limits] = &arguments[..] else {
        eprintln!("usage: scaffold_report SCAFFOLD BONE LIMITS");
        return Ok(ExitCode::from(2));
    };
    let scaffold = Solid::open(scaffold)?.unit(Unit::Millimetre);
    let bone = Solid::open(bone)?.unit(Unit::Millimetre);
    let report = Report::of(&scaffold).region(&bone).limits(&Limits::open(limits)?).measure(&Settings::rays(128))?;
    for id in ["porosity", "porosity.closed", "solid.thickness.mean", "pore.thickness.mean", "percolation"] {
        println!("{id:24} {}", report[id]);
    }
    report.write("report")?;
    println!("written to report/report.html");
    let passed = report.verdict().is_none_or(|verdict| verdict.passed);
    Ok(if passed { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
