//! Do two parts clash, and by how much? `cargo run --release --example clash -- a.stl b.stl`
//!
//! Prints the common volume and whether it is certainly nothing; writes it as a mesh if there is any.

#![allow(clippy::print_stdout)]

use std::process::ExitCode;

use ldi_ops::{Error, Settings, Solid};

fn main() -> Result<ExitCode, Error> {
    let mut paths = std::env::args().skip(1);
    let (Some(a), Some(b)) = (paths.next(), paths.next()) else {
        eprintln!("usage: clash A B");
        return Ok(ExitCode::from(2));
    };
    let (a, b) = (Solid::open(a)?, Solid::open(b)?);
    let (first, second) = (a.bounds(), b.bounds());
    if first.min.cmpgt(second.max).any() || second.min.cmpgt(first.max).any() {
        println!("the boxes are apart: no clash");
        return Ok(ExitCode::SUCCESS);
    }
    let common = a.intersect(&b).sample(&Settings::rays(512))?;
    common.warnings().iter().for_each(|warning| eprintln!("warning: {warning}"));
    let volume = common.volume();
    println!("{} and {} share {volume}", a.name(), b.name());
    if volume.value <= volume.error {
        return Ok(ExitCode::SUCCESS);
    }
    common.surface()?.write("clash.stl")?;
    println!("written to clash.stl");
    Ok(ExitCode::FAILURE)
}
