//! Values with errors.

use ldi_ops::driver::measured::Method;
use ldi_ops::{Estimate, Verdict};
use pyo3::prelude::*;

/// A volume with its error and unit. `float(volume)` is the value; `str(volume)` has the digits that the error makes significant.
#[pyclass(frozen, module = "ldi_ops")]
pub struct Volume(pub Estimate);

#[pymethods]
impl Volume {
    /// The value, in `unit`.
    #[getter]
    fn value(&self) -> f64 {
        self.0.value
    }

    /// The rounding bound of an exact value; for an estimate, an error estimate, which is not a bound. In `unit`.
    #[getter]
    fn error(&self) -> f64 {
        self.0.error
    }

    /// The unit, such as 'mm³'; None where neither the files nor `load` state one.
    #[getter]
    fn unit(&self) -> Option<String> {
        self.0.unit.map(|_| ldi_ops::unit::suffix(self.0.unit, self.0.power).trim().to_owned())
    }

    /// 'exact' or 'estimate'.
    #[getter]
    fn method(&self) -> &'static str {
        match self.0.method {
            Method::Exact => "exact",
            Method::Estimate(_) => "estimate",
        }
    }

    /// The certified lower bound; None unless `bounds=True` asks for it.
    #[getter]
    fn lower(&self) -> Option<f64> {
        self.0.bounds.map(|[lower, _]| lower)
    }

    /// The certified upper bound; None unless `bounds=True` asks for it.
    #[getter]
    fn upper(&self) -> Option<f64> {
        self.0.bounds.map(|[_, upper]| upper)
    }

    /// The least and the greatest value that the inputs, and certified bounds of a sum, allow.
    #[getter]
    fn possible(&self) -> (f64, f64) {
        (self.0.possible[0], self.0.possible[1])
    }

    /// Whether the certified bounds prove that the value is below a limit: True, False, or None if they do not decide.
    fn is_below(&self, limit: f64) -> Option<bool> {
        decided(self.0.is_below(limit))
    }

    /// Whether the certified bounds prove that the value is above a limit: True, False, or None if they do not decide.
    fn is_above(&self, limit: f64) -> Option<bool> {
        decided(self.0.is_above(limit))
    }

    fn __float__(&self) -> f64 {
        self.0.value
    }

    fn __str__(&self) -> String {
        self.0.to_string()
    }

    fn __repr__(&self) -> String {
        format!("Volume({})", self.0)
    }
}

fn decided(verdict: Verdict) -> Option<bool> {
    match verdict {
        Verdict::Certain => Some(true),
        Verdict::CertainlyNot => Some(false),
        Verdict::Undecided => None,
    }
}
