//! Model solids.

use ldi_ops::solids::{Model, ModelKind};
use ldi_ops::{Error, Unit};
use pyo3::prelude::*;

use crate::keywords::Call;
use crate::shape::Solid;

/// Returns the kinds of model solids: name, summary, and the name, default and meaning of each parameter.
#[pyfunction]
pub fn kinds() -> Vec<Kind> {
    let parameters = |kind: &ModelKind| kind.parameters.iter().map(|p| (p.name, p.default, p.meaning)).collect();
    Model::kinds().iter().map(|kind| (kind.name, kind.summary, parameters(kind))).collect()
}

type Kind = (&'static str, &'static str, Vec<(&'static str, &'static str, &'static str)>);

/// Builds a model solid, in millimetres, from the texts of its parameters.
#[pyfunction]
pub fn generate(py: Python<'_>, kind: &str, parameters: Vec<(String, String)>) -> PyResult<Py<Solid>> {
    let built = Call::new(py, None)?.install(py, || {
        let texts: Vec<(&str, &str)> = parameters.iter().map(|(name, value)| (&**name, &**value)).collect();
        let mesh = Model::from_parameters(kind, &texts).and_then(|model| model.build());
        let mesh = mesh.map_err(|error| Error::Usage(error.to_string()))?;
        Ok(ldi_ops::Solid::from_triangles(mesh.positions, mesh.triangles)?.named(kind).unit(Unit::Millimetre))
    });
    Solid::new(py, built?)
}
