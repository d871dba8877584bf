//! The Python module `ldi_ops._native`: the library's facade as Python classes.
//!
//! `keywords` reads settings, `run` calls the library with the GIL released and answers signals, `error` raises exceptions. The
//! other modules each wrap one noun of the library. What needs no Rust is in the Python files of the package.

mod clash;
mod clash_plan;
mod error;
mod image;
mod keywords;
mod metrics;
mod run;
mod shape;
mod solids;
mod volume;

/// Large arrays in large pages, and a message where memory runs out, as in the program.
#[global_allocator]
static ALLOCATOR: ldi_ops_cli::LargePages = ldi_ops_cli::LargePages;

/// The compiled part of `ldi_ops`.
#[pyo3::pymodule]
mod _native {
    use std::ffi::OsString;

    use pyo3::prelude::*;

    #[pymodule_export]
    use super::clash::{Clash, Clashes};
    #[pymodule_export]
    use super::clash_plan::ClashPlan;
    #[pymodule_export]
    use super::image::Image;
    #[pymodule_export]
    use super::metrics::{Metric, Metrics, catalogue, sweep_page};
    #[pymodule_export]
    use super::shape::{Shape, Solid};
    #[pymodule_export]
    use super::solids::{generate, kinds};
    #[pymodule_export]
    use super::volume::Volume;

    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");

    /// Returns the symbol of a unit: 'mm' for 'millimetres'.
    #[pyfunction]
    fn unit_symbol(py: Python<'_>, unit: &str) -> PyResult<&'static str> {
        super::keywords::parsed_unit(py, unit).map(|unit| unit.symbol())
    }

    /// Runs the command line, the name of the program first, and returns its exit code.
    #[pyfunction]
    fn main(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
        py.detach(|| ldi_ops_cli::run(arguments))
    }
}
