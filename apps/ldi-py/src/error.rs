//! Errors of the library as exceptions of `ldi_ops`.

use ldi_ops::mesh::check::MeshReport;
use ldi_ops::{Error, Warning};
use numpy::PyArray;
use numpy::ndarray::Array3;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::image::import_numpy;

/// Returns the exception of an error.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    raised(py, error).unwrap_or_else(|failure| failure)
}

fn raised(py: Python<'_>, error: &Error) -> PyResult<PyErr> {
    let message = error.to_string();
    let exception = match error {
        Error::NotClosed(open) => {
            import_numpy(py)?;
            let places = PyDict::new(py);
            for (name, ends) in edges(&open.report) {
                places.set_item(name, PyArray::from_owned_array(py, ends))?;
            }
            class(py, "NotClosed")?.call1((message, &open.name, places))?
        }
        Error::Usage(_) => class(py, "UsageError")?.call1((message,))?,
        Error::Machine(_) => class(py, "MachineError")?.call1((message,))?,
        Error::Cancelled => class(py, "Cancelled")?.call1((message,))?,
        _ => class(py, "InputError")?.call1((message,))?,
    };
    Ok(PyErr::from_value(exception))
}

/// Returns a usage error.
pub fn usage(py: Python<'_>, message: impl Into<String>) -> PyErr {
    exception(py, &Error::Usage(message.into()))
}

/// Returns codes and sentences of warnings.
pub fn codes_and_messages(warnings: &[Warning]) -> Vec<(&'static str, String)> {
    warnings.iter().map(|warning| (warning.code, warning.message.clone())).collect()
}

fn class<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("ldi_ops._errors")?.getattr(name)
}

/// Returns the ends of the first edges of each kind of defect, (n, 2, 3).
fn edges(report: &MeshReport) -> [(&'static str, Array3<f64>); 3] {
    let kinds = [
        ("open_edges", &report.open_edges),
        ("odd_edges", &report.odd_edges),
        ("unbalanced_edges", &report.unbalanced_edges),
    ];
    kinds.map(|(name, found)| {
        let ends = |[edge, end, axis]: [usize; 3]| found.first[edge].ends[end][axis];
        (name, Array3::from_shape_fn((found.first.len(), 2, 3), |(edge, end, axis)| ends([edge, end, axis])))
    })
}
