//! Settings as keyword arguments, and the options of a `with` block.

use ldi_ops::{Axes, Backend, FillRule, Mode, Settings, Unit};
use pyo3::exceptions::{PyOverflowError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::usage;
use crate::run::run;

/// The message where several keywords give a raster.
pub const ONE_RASTER: &str = "resolution, pitch and tolerance exclude one another; give one";

/// The keywords of the raster and the images; `Settings` in the stubs documents them.
const KEYWORDS: [&str; 9] = ["resolution", "pitch", "tolerance", "axes", "mode", "fill", "backend", "lod", "bounds"];

/// Settings of a call, and its progress function.
pub struct Call {
    settings: Settings<'static>,
    progress: Option<Py<PyAny>>,
}

impl Call {
    /// Reads keyword arguments, and the options of the block.
    pub fn new(py: Python<'_>, keywords: Option<&Bound<'_, PyDict>>) -> PyResult<Call> {
        let settings = match keywords {
            Some(keywords) => settings(py, keywords)?,
            None => Settings::default(),
        };
        let options = py.import("ldi_ops._options")?.call_method0("current")?;
        let threads: Option<usize> = options.getattr("threads")?.extract()?;
        let memory: Option<u64> = options.getattr("memory")?.extract()?;
        let progress: Option<Py<PyAny>> = options.getattr("progress")?.extract()?;
        let settings = settings.threads(threads.unwrap_or(0));
        let settings = memory.map_or(settings.clone(), |bytes| settings.memory_limit(bytes));
        Ok(Call { settings, progress })
    }

    /// Returns the call without certified bounds, for results that are no volumes.
    pub fn without_bounds(self) -> Call {
        Call { settings: self.settings.bounds(false), ..self }
    }

    /// Runs an operation that takes settings.
    pub fn run<T: Send>(
        self,
        py: Python<'_>,
        work: impl FnOnce(&Settings) -> Result<T, ldi_ops::Error> + Send,
    ) -> PyResult<T> {
        run(py, self.settings, self.progress, work)
    }

    /// Runs a function that takes no settings.
    pub fn install<T: Send>(
        self,
        py: Python<'_>,
        work: impl FnOnce() -> Result<T, ldi_ops::Error> + Send,
    ) -> PyResult<T> {
        self.run(py, |settings| settings.install(work))
    }
}

fn settings(py: Python<'_>, keywords: &Bound<'_, PyDict>) -> PyResult<Settings<'static>> {
    for (name, _) in keywords {
        let name: String = name.extract()?;
        if !KEYWORDS.contains(&name.as_str()) {
            let known = KEYWORDS.join(", ");
            return Err(PyTypeError::new_err(format!("unknown keyword '{name}'; the settings are: {known}")));
        }
    }
    let raster = |name| keywords.get_item(name).map(|value| value.filter(|value| !value.is_none()));
    let mut settings = match [raster("resolution")?, raster("pitch")?, raster("tolerance")?] {
        [None, None, None] => Settings::default(),
        [Some(rays), None, None] => Settings::rays(count(py, "resolution", &rays)?),
        [None, Some(pitch), None] => Settings::pitch(pitch.extract()?),
        [None, None, Some(share)] => Settings::tolerance(share.extract()?),
        _ => return Err(usage(py, ONE_RASTER)),
    };
    let word = |name| -> PyResult<Option<String>> {
        keywords.get_item(name)?.filter(|value| !value.is_none()).map(|value| value.extract()).transpose()
    };
    if let Some(axes) = word("axes")? {
        settings = settings.axes(one_of(
            py,
            "axes",
            &axes,
            &[("all", Axes::All), ("x", Axes::X), ("y", Axes::Y), ("z", Axes::Z)],
        )?);
    }
    if let Some(mode) = word("mode")? {
        let modes = [("exact", Mode::Exact), ("over", Mode::OVER), ("under", Mode::UNDER)];
        settings = settings.mode(one_of(py, "mode", &mode, &modes)?);
    }
    if let Some(fill) = word("fill")? {
        settings = settings.fill(fill_rule(py, &fill)?);
    }
    if let Some(backend) = word("backend")? {
        settings = settings.backend(match backend.as_str() {
            "auto" => Backend::Auto,
            "cpu" => Backend::Cpu,
            "gpu" => Backend::Gpu(None),
            other => match other.strip_prefix("gpu:") {
                Some(name) => Backend::Gpu(Some(name.to_owned())),
                None => return Err(usage(py, format!("backend='{other}': one of auto, cpu, gpu, gpu:NAME"))),
            },
        });
    }
    if let Some(lod) = keywords.get_item("lod")?.filter(|value| !value.is_none()) {
        settings = settings.lod(count(py, "lod", &lod)?);
    }
    if let Some(bounds) = keywords.get_item("bounds")? {
        settings = settings.bounds(bounds.extract()?);
    }
    Ok(settings)
}

/// Returns a number of rays or voxels.
pub fn count(py: Python<'_>, name: &str, value: &Bound<'_, PyAny>) -> PyResult<u32> {
    match value.extract::<u32>() {
        Err(error) if error.is_instance_of::<PyOverflowError>(py) => {
            Err(usage(py, format!("{name}={value}: a number between 1 and {}", u32::MAX)))
        }
        extracted => extracted,
    }
}

/// Returns a fill rule by its name.
pub fn fill_rule(py: Python<'_>, name: &str) -> PyResult<FillRule> {
    one_of(py, "fill", name, &[("even-odd", FillRule::EvenOdd), ("nonzero", FillRule::NonZero)])
}

/// Returns a unit of length by its name.
pub fn parsed_unit(py: Python<'_>, name: &str) -> PyResult<Unit> {
    ldi_ops::unit::parse(name).map_err(|message| usage(py, format!("unit='{name}': {message}")))
}

/// Returns the value of a word.
pub fn one_of<T: Clone>(py: Python<'_>, name: &str, word: &str, values: &[(&str, T)]) -> PyResult<T> {
    match values.iter().find(|(known, _)| *known == word) {
        Some((_, value)) => Ok(value.clone()),
        None => {
            let known: Vec<&str> = values.iter().map(|(known, _)| *known).collect();
            Err(usage(py, format!("{name}='{word}': one of {}", known.join(", "))))
        }
    }
}
