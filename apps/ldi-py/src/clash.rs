//! Parts that overlap, touch or come too near.

use std::path::PathBuf;

use ldi_ops::driver::clash::rules::Rules;
use ldi_ops::driver::clash::{Pair, Relation};
use ldi_ops::{FillRule, Monitor, report};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::clash_plan::ClashPlan;
use crate::error::{codes_and_messages, usage};
use crate::keywords::{Call, ONE_RASTER, fill_rule, parsed_unit};
use crate::shape::Solid;

/// The result of a comparison of parts: the pairs whose boxes come near one another, the worst first.
#[pyclass(frozen, module = "ldi_ops")]
pub struct Clashes {
    pub clashes: ldi_ops::Clashes,
    pub fill: FillRule,
}

/// A comparison of named solids: which overlap, touch, or come nearer than a clearance. Those of other units are converted to
/// `unit`, by default that of the first.
#[pyclass(frozen, module = "ldi_ops._native")]
pub struct Clash {
    clash: ldi_ops::Clash,
    fill: FillRule,
}

#[pymethods]
impl Clash {
    #[new]
    #[pyo3(signature = (parts, *, clearance=None, touching=None, allow_touching=false, ignore=Vec::new(), resolution=None, pitch=None, tolerance=None, fill="even-odd", unit=None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        parts: Vec<(String, Py<Solid>)>,
        clearance: Option<f64>,
        touching: Option<f64>,
        allow_touching: bool,
        ignore: Vec<String>,
        resolution: Option<u32>,
        pitch: Option<f64>,
        tolerance: Option<f64>,
        fill: &str,
        unit: Option<&str>,
    ) -> PyResult<Clash> {
        let ignored: Result<Vec<_>, _> = ignore.iter().map(|pair| pair.parse()).collect();
        let ignored = ignored.map_err(|error| usage(py, format!("ignore: {error}")))?;
        let unit = unit.map(|unit| parsed_unit(py, unit)).transpose()?;
        let solids = parts.iter().map(|(name, solid)| (name.as_str(), &solid.get().solid));
        let mut clash = ldi_ops::Clash::of(solids).rules(Rules { allow_touching, max_volume: None, ignored });
        clash = clearance.into_iter().fold(clash, ldi_ops::Clash::clearance);
        clash = touching.into_iter().fold(clash, ldi_ops::Clash::touching);
        clash = match (resolution, pitch, tolerance) {
            (None, None, None) => clash,
            (Some(rays), None, None) => clash.rays(rays),
            (None, Some(pitch), None) => clash.pitch(pitch),
            (None, None, Some(share)) => clash.tolerance(share),
            _ => return Err(usage(py, ONE_RASTER)),
        };
        clash = unit.into_iter().fold(clash, ldi_ops::Clash::unit);
        Ok(Clash { clash, fill: fill_rule(py, fill)? })
    }

    /// Compares all near pairs.
    fn compare(&self, py: Python<'_>) -> PyResult<Clashes> {
        let clash = self.clash.clone();
        let clashes = Call::new(py, None)?.run(py, |settings| clash.compare(&settings.clone().fill(self.fill)))?;
        Ok(Clashes { clashes, fill: self.fill })
    }

    /// Finds the near pairs.
    fn plan(&self, py: Python<'_>) -> PyResult<ClashPlan> {
        let clash = self.clash.clone();
        let plan = Call::new(py, None)?.run(py, |settings| clash.plan(&settings.clone().fill(self.fill)))?;
        Ok(ClashPlan { plan, fill: self.fill })
    }
}

impl Clashes {
    fn rows<'c, 'py>(&self, py: Python<'py>, pairs: impl Iterator<Item = &'c Pair>) -> PyResult<Bound<'py, PyList>> {
        PyList::new(py, pairs.map(|pair| row(py, &self.clashes, pair)).collect::<Result<Vec<_>, _>>()?)
    }
}

#[pymethods]
impl Clashes {
    /// All near pairs, a dict each: the parts `a` and `b`, `state`, `finding`, `distance`, `volume` with `volume_lower` and
    /// `volume_upper`, `depth` with `depth_upper`, and the place `x`, `y`, `z`. Lengths are in `unit`.
    #[getter]
    fn pairs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        self.rows(py, self.clashes.pairs.iter())
    }

    /// The pairs that break a rule.
    #[getter]
    fn findings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        self.rows(py, self.clashes.findings())
    }

    /// The names of all parts.
    #[getter]
    fn parts(&self) -> Vec<String> {
        self.clashes.parts.iter().map(|part| part.name.clone()).collect()
    }

    /// The unit of all lengths, such as 'mm'; None if it is not known.
    #[getter]
    fn unit(&self) -> Option<&'static str> {
        self.clashes.unit.map(|unit| unit.symbol())
    }

    /// Warnings about the parts: codes and sentences.
    #[getter]
    fn warnings(&self) -> Vec<(&'static str, String)> {
        codes_and_messages(&self.clashes.warnings)
    }

    /// All near pairs as a `pandas.DataFrame`.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("ldi_ops._interop")?.call_method1("clashes_to_pandas", (slf,))
    }

    /// Writes clash.html with pictures, clash.json and clash.csv to a folder, which is created if it is missing.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        Call::new(py, None)?.run(py, |settings| {
            let limits = (self.fill, settings.memory());
            settings.install(|| {
                report::clash::write(&mut self.clashes.clone(), limits, &folder, &Monitor::new(None)).map(drop)
            })
        })
    }

    fn __len__(&self) -> usize {
        self.clashes.pairs.len()
    }

    fn __repr__(&self) -> String {
        let (parts, findings) = (self.clashes.parts.len(), self.clashes.findings().count());
        format!("Clashes({parts} parts, {} near pairs, {findings} findings)", self.clashes.pairs.len())
    }
}

fn row<'py>(py: Python<'py>, clashes: &ldi_ops::Clashes, pair: &Pair) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    let [a, b] = clashes.names(pair);
    row.set_item("a", a)?;
    row.set_item("b", b)?;
    row.set_item("state", pair.relation.name())?;
    row.set_item("finding", pair.finding.map(|finding| finding.name()))?;
    let (distance, depth, common) = match &pair.relation {
        Relation::Separate { distance, .. } => (Some(*distance), None, None),
        Relation::Touching { distance, depth_bound, .. } => (Some(*distance), Some([0.0, *depth_bound]), None),
        Relation::Overlapping(common) => (None, Some([common.depth, common.depth_bound]), Some(common)),
    };
    row.set_item("distance", distance)?;
    row.set_item("volume", common.map(|common| common.volume.value))?;
    row.set_item("volume_lower", common.map(|common| common.volume.lower))?;
    row.set_item("volume_upper", common.map(|common| common.volume.upper))?;
    row.set_item("depth", depth.map(|[lower, _]| lower))?;
    row.set_item("depth_upper", depth.map(|[_, upper]| upper))?;
    for (name, coordinate) in ["x", "y", "z"].into_iter().zip(clashes.place(pair).to_array()) {
        row.set_item(name, coordinate)?;
    }
    Ok(row)
}
