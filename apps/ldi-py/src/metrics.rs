//! Metrics of scaffolds.

use std::path::PathBuf;

use glam::DVec3;
use ldi_ops::metrics::BoundaryCondition;
use ldi_ops::report::scaffold_report::{self, Status};
use ldi_ops::report::sweep::row::Row;
use ldi_ops::report::sweep::{self, Objective};
use ldi_ops::report::{DIRECTIONS, ReportBuilder, Roi, Settings, id};
use ldi_ops::{Limits, Report};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::{exception, usage};
use crate::keywords::{Call, count, one_of};
use crate::shape::Shape;

/// A metric: a number with its meaning, error, bounds and unit. `float(metric)` is the value, NaN where there is none.
#[pyclass(frozen, module = "ldi_ops")]
pub struct Metric(scaffold_report::Metric);

/// The metrics of a scaffold: a mapping from id to `Metric`, in the order of the catalogue.
#[pyclass(frozen, mapping, module = "ldi_ops")]
pub struct Metrics {
    report: Report,
}

/// Returns the catalogue of metrics, in order: id, unit for lengths in a unit, name.
#[pyfunction]
#[pyo3(signature = (unit=None))]
pub fn catalogue(py: Python<'_>, unit: Option<&str>) -> PyResult<Vec<(&'static str, String, &'static str)>> {
    let unit = unit.map(ldi_ops::unit::parse).transpose().map_err(|message| usage(py, message))?;
    Ok(id::all().map(|metric| (metric.id, metric.quantity.of(unit).to_string(), metric.name)).collect())
}

/// Returns the page on a sweep: its title, its rows as a JSON list, and what is better as a JSON object of metrics and 'max' or
/// 'min'; large porosity and large thinnest wall if that is empty.
#[pyfunction]
pub fn sweep_page(py: Python<'_>, title: &str, rows: &str, pareto: &str) -> PyResult<String> {
    let wrong = |error: serde_json::Error| usage(py, error.to_string());
    let rows: Vec<Row> = serde_json::from_str(rows).map_err(wrong)?;
    if let Some(other) = rows.iter().find(|row| !row.parameters.keys().eq(rows[0].parameters.keys())) {
        return Err(usage(py, format!("the row {} has other parameters than the first", other.design)));
    }
    let words = serde_json::from_str(pareto).map_err(wrong)?;
    let objectives = Objective::read(&words).map_err(|problem| usage(py, problem))?;
    Ok(py.detach(|| sweep::html(title, &rows, &objectives, &sweep::front(&rows, &objectives))))
}

/// Returns the metrics of a shape, within a region and against limits, with its view if the page shall have one.
pub fn measured(
    py: Python<'_>,
    shape: &Shape,
    [region, limits]: [Option<&Bound<'_, PyAny>>; 2],
    view: bool,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Metrics> {
    let limits = limits.map(|limits| read_limits(py, limits)).transpose()?;
    let region = region.map(|region| read_region(py, region)).transpose()?;
    let keywords = settings.map(|settings| settings.copy()).transpose()?;
    let course = keywords.as_ref().map(|keywords| course(py, keywords)).transpose()?.unwrap_or_default();
    let report = shape.call(py, keywords.as_ref())?.without_bounds().run(py, |settings| {
        let mut builder = course.of(Report::of(&shape.shape.solid(settings)?.named(shape.text())));
        builder = match region {
            None => builder,
            Some(Roi::Solid(region)) => builder.region(&region.solid(settings)?),
            Some(Roi::Hull) => builder.within_hull(),
            Some(Roi::Wrap(diameter)) => builder.within(Roi::Wrap(diameter)),
        };
        if let Some(limits) = &limits {
            builder = builder.limits(limits);
        }
        if !view {
            builder = builder.without_view();
        }
        builder.measure(settings)
    });
    Ok(Metrics { report: report? })
}

/// The keywords of metrics alone; `MetricsSettings` in the stubs documents them.
#[derive(Default)]
struct Course {
    edges: Option<BoundaryCondition>,
    tortuosity_rays: Option<u32>,
    printed: Option<(DVec3, f64)>,
}

impl Course {
    fn of(&self, builder: ReportBuilder) -> ReportBuilder {
        let builder = self.edges.into_iter().fold(builder, ReportBuilder::edges);
        let builder = self.tortuosity_rays.into_iter().fold(builder, ReportBuilder::tortuosity_rays);
        self.printed.into_iter().fold(builder, |builder, (up, angle)| builder.printed(up, angle))
    }
}

/// Takes the keywords of metrics out of those of a call.
fn course(py: Python<'_>, keywords: &Bound<'_, PyDict>) -> PyResult<Course> {
    let take = |name: &str| -> PyResult<Option<Bound<'_, PyAny>>> {
        let value = keywords.get_item(name)?;
        if value.is_some() {
            keywords.del_item(name)?;
        }
        Ok(value.filter(|value| !value.is_none()))
    };
    let word = |name| take(name)?.map(|value| value.extract::<String>()).transpose();
    let edges = BoundaryCondition::ALL.map(|edges| (edges.name(), edges));
    let edges = word("edges")?.map(|word| one_of(py, "edges", &word, &edges)).transpose()?;
    let up = word("build")?.map(|word| one_of(py, "build", &word, &DIRECTIONS)).transpose()?;
    let angle = take("overhang_angle")?.map(|angle| angle.extract::<f64>()).transpose()?;
    let usual = Settings::default();
    let printed =
        (up.is_some() || angle.is_some()).then(|| (up.unwrap_or(usual.build), angle.unwrap_or(usual.overhang_angle)));
    let rays = take("tortuosity_resolution")?.map(|rays| count(py, "tortuosity_resolution", &rays)).transpose()?;
    Ok(Course { edges, tortuosity_rays: rays, printed })
}

fn read_region(py: Python<'_>, region: &Bound<'_, PyAny>) -> PyResult<Roi<ldi_ops::Shape>> {
    if let Ok(shape) = region.cast::<Shape>() {
        return Ok(Roi::Solid(shape.get().shape.clone()));
    }
    let wrong = || usage(py, "a region is a Shape, 'hull', 'wrap', or 'wrap:2mm' with the diameter of a ball");
    let word: String = region.extract().map_err(|_| wrong())?;
    let read = Roi::following(&word).map_err(|problem| usage(py, format!("region '{word}': {problem}")))?;
    read.ok_or_else(wrong)
}

fn read_limits(py: Python<'_>, limits: &Bound<'_, PyAny>) -> PyResult<Limits> {
    let read = match limits.cast::<PyDict>() {
        Ok(limits) => {
            let text: String = py.import("ldi_ops._interop")?.call_method1("limits_as_toml", (limits,))?.extract()?;
            Limits::parse(&text)
        }
        Err(_) => Limits::open(limits.extract::<PathBuf>()?),
    };
    read.map_err(|error| exception(py, &error))
}

#[pymethods]
impl Metric {
    /// A stable name: 'porosity', 'solid.thickness.mean'.
    #[getter]
    fn id(&self) -> &'static str {
        self.0.id
    }

    /// The name for readers.
    #[getter]
    fn name(&self) -> &'static str {
        self.0.name
    }

    /// The symbol in the literature: 'BV/TV', 'Tb.Th'.
    #[getter]
    fn symbol(&self) -> &'static str {
        self.0.symbol
    }

    /// The definition in one line.
    #[getter]
    fn definition(&self) -> &'static str {
        self.0.definition
    }

    /// The value in `unit`; None where `status` and `warnings` say why.
    #[getter]
    fn value(&self) -> Option<f64> {
        self.0.value
    }

    /// An estimate of the error, not a bound; None where there is none.
    #[getter]
    fn error(&self) -> Option<f64> {
        self.0.error
    }

    /// The lower bound, from the inner and the outer solid.
    #[getter]
    fn lower(&self) -> Option<f64> {
        self.0.lower
    }

    /// The upper bound, from the inner and the outer solid.
    #[getter]
    fn upper(&self) -> Option<f64> {
        self.0.upper
    }

    /// The unit of value, error and bounds: '1', 'mm', '1/mm'.
    #[getter]
    fn unit(&self) -> String {
        self.0.unit.to_string()
    }

    /// 'measured', 'not-applicable' or 'not-resolved'.
    #[getter]
    fn status(&self) -> &'static str {
        match self.0.status {
            Status::Measured => "measured",
            Status::NotApplicable => "not-applicable",
            Status::NotResolved => "not-resolved",
        }
    }

    /// The method of measurement.
    #[getter]
    fn method(&self) -> &'static str {
        self.0.method
    }

    /// The source of the definition.
    #[getter]
    fn reference(&self) -> &'static str {
        self.0.reference
    }

    /// Reasons for doubt.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings.clone()
    }

    fn __float__(&self) -> f64 {
        self.0.value.unwrap_or(f64::NAN)
    }

    fn __str__(&self) -> String {
        self.0.to_string()
    }

    fn __repr__(&self) -> String {
        format!("Metric({}: {})", self.0.id, self.0)
    }
}

#[pymethods]
impl Metrics {
    fn __getitem__(&self, id: &str) -> PyResult<Metric> {
        match self.report.get(id) {
            Some(metric) => Ok(Metric(metric.clone())),
            None => Err(PyKeyError::new_err(id.to_owned())),
        }
    }

    fn __contains__(&self, id: &Bound<'_, PyAny>) -> bool {
        id.extract::<String>().is_ok_and(|id| self.report.get(&id).is_some())
    }

    fn __len__(&self) -> usize {
        self.report.metrics().len()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.keys().into_pyobject(py)?.call_method0("__iter__")
    }

    /// The ids of all metrics.
    fn keys(&self) -> Vec<&'static str> {
        self.report.metrics().iter().map(|metric| metric.id).collect()
    }

    /// All metrics.
    fn values(&self) -> Vec<Metric> {
        self.report.metrics().iter().map(|metric| Metric(metric.clone())).collect()
    }

    /// All ids with their metrics.
    fn items(&self) -> Vec<(&'static str, Metric)> {
        self.report.metrics().iter().map(|metric| (metric.id, Metric(metric.clone()))).collect()
    }

    /// The metric of an id, or a default.
    #[pyo3(signature = (id, default=None))]
    fn get<'py>(
        &self,
        py: Python<'py>,
        id: &str,
        default: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        match self.report.get(id) {
            Some(metric) => Ok(Some(Bound::new(py, Metric(metric.clone()))?.into_any())),
            None => Ok(default),
        }
    }

    /// The unit of length, such as 'mm'; None if it is not known.
    #[getter]
    fn unit(&self) -> Option<&'static str> {
        self.report.scaffold_report().unit.map(|unit| unit.symbol())
    }

    /// Whether all limits are kept; None if there were none.
    #[getter]
    fn passed(&self) -> Option<bool> {
        self.report.verdict().map(|verdict| verdict.passed)
    }

    /// Remarks on inputs and metrics: codes and sentences.
    #[getter]
    fn warnings(&self) -> Vec<(&'static str, String)> {
        self.report.scaffold_report().alerts.iter().map(|alert| (alert.code, alert.message.clone())).collect()
    }

    /// Writes report.html, metrics.json, metrics.csv and methods.txt to a folder, which is created if it is missing.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        Call::new(py, None)?.install(py, || self.report.write(folder))
    }

    /// The metrics as a `pandas.DataFrame`, a row each.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("ldi_ops._interop")?.call_method1("metrics_to_pandas", (slf,))
    }

    fn __repr__(&self) -> String {
        let verdict = match self.passed() {
            None => "",
            Some(true) => ", all limits kept",
            Some(false) => ", limits broken",
        };
        format!("Metrics({} of {}{verdict})", self.report.metrics().len(), self.report.scaffold_report().title)
    }
}
