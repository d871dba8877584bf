//! Settings of an operation.

use crate::Error;
use crate::driver::certainty::Certainty;
use crate::driver::job::{
    Backend, Keep, MeasureJob, Measurement, Openness, Spacing, SumJob, SumOperation, VolumeMethod,
};
use crate::grid::Axis;
use crate::length::Length;
use crate::progress::{self, Monitor, Progress};
use crate::sampler::{FillRule, Mode};

/// The axes of the images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Axes {
    /// Only x.
    X,
    /// Only y.
    Y,
    /// Only z.
    Z,
    /// All three axes. A surface needs them, and they give the best volume.
    #[default]
    All,
}

impl Axes {
    pub(crate) fn list(self) -> Vec<Axis> {
        match self {
            Axes::X => vec![Axis::X],
            Axes::Y => vec![Axis::Y],
            Axes::Z => vec![Axis::Z],
            Axes::All => Axis::ALL.to_vec(),
        }
    }
}

/// The default number of rays along the longest side.
const DEFAULT_RAYS: u32 = 512;

/// The default number of voxels along each ray (LOD-C) of over- and under-estimates.
const DEFAULT_LOD: u32 = 1024;

/// The settings of an operation: raster, axes, mode, fill rule, device, threads, memory and progress. Each has a default.
///
/// ```
/// use ldi_ops::{Axes, Backend, FillRule, Mode, Settings};
///
/// let settings =
/// Settings::pitch(0.05).mode(Mode::Exact).axes(Axes::Z).fill(FillRule::NonZero).backend(Backend::Cpu).threads(2);
/// # let _ = settings;
/// ```
#[derive(Clone)]
pub struct Settings<'p> {
    spacing: Spacing,
    axes: Axes,
    mode: Mode,
    fill: FillRule,
    backend: Backend,
    lod: u32,
    threads: usize,
    memory: Option<u64>,
    bounds: bool,
    progress: Option<&'p dyn Progress>,
}

impl Default for Settings<'_> {
    /// Returns 512 rays along the longest side, exact images along all axes, the even-odd rule, and all threads.
    fn default() -> Self {
        Settings::with_spacing(Spacing::Resolution(DEFAULT_RAYS))
    }
}

impl<'p> Settings<'p> {
    /// Returns settings with a number of rays along the longest side of the common box.
    pub fn rays(rays: u32) -> Settings<'p> {
        Settings::with_spacing(Spacing::Resolution(rays))
    }

    /// Returns settings with a pitch, in the unit of the first solid.
    pub fn pitch(pitch: f64) -> Settings<'p> {
        Settings::with_spacing(Spacing::Pitch(pitch))
    }

    /// Returns settings whose raster is refined until the error estimate is below this share of the volume.
    pub fn tolerance(share: f64) -> Settings<'p> {
        Settings::with_spacing(Spacing::Tolerance(share))
    }

    fn with_spacing(spacing: Spacing) -> Settings<'p> {
        Settings {
            spacing,
            axes: Axes::All,
            mode: Mode::Exact,
            fill: FillRule::EvenOdd,
            backend: Backend::Auto,
            lod: DEFAULT_LOD,
            threads: 0,
            memory: None,
            bounds: false,
            progress: None,
        }
    }

    /// Sets the mode of the images: exact, over- or under-estimate.
    pub fn mode(self, mode: Mode) -> Self {
        Settings { mode, ..self }
    }

    /// Sets the axes of the images.
    pub fn axes(self, axes: Axes) -> Self {
        Settings { axes, ..self }
    }

    /// Sets the fill rule, which decides which winding numbers are inside.
    pub fn fill(self, fill: FillRule) -> Self {
        Settings { fill, ..self }
    }

    /// Sets the device that samples.
    pub fn backend(self, backend: Backend) -> Self {
        Settings { backend, ..self }
    }

    /// Sets the voxels along each ray (LOD-C) of over- and under-estimates.
    pub fn lod(self, lod: u32) -> Self {
        Settings { lod, ..self }
    }

    /// Sets the number of threads; 0 means one for each processor.
    pub fn threads(self, threads: usize) -> Self {
        Settings { threads, ..self }
    }

    /// Sets the most bytes that the process may hold; the default is a share of the free memory.
    pub fn memory_limit(self, bytes: u64) -> Self {
        Settings { memory: Some(bytes), ..self }
    }

    /// Requests certified bounds of volumes ([`Estimate::bounds`](crate::Estimate::bounds)).
    pub fn bounds(self, bounds: bool) -> Self {
        Settings { bounds, ..self }
    }

    /// Sets the listener that receives the progress and may stop the operation.
    pub fn progress(self, progress: &'p dyn Progress) -> Self {
        Settings { progress: Some(progress), ..self }
    }

    pub(crate) fn fill_rule(&self) -> FillRule {
        self.fill
    }

    pub(crate) fn needs_bounds(&self) -> bool {
        self.bounds
    }

    /// Returns the most bytes that the process may hold, if they were set.
    pub fn memory(&self) -> Option<u64> {
        self.memory
    }

    pub(crate) fn device(&self) -> &Backend {
        &self.backend
    }

    pub(crate) fn spacing(&self) -> Spacing<Length> {
        self.spacing.of_inputs()
    }

    /// Runs a function on the threads of the settings. Their listener may stop it as it may stop an operation, with
    /// [`Error::Cancelled`]: files are read, solids combined and voxels filled by calls that take no settings themselves.
    ///
    /// # Errors
    /// Those of the function, and [`Error::Cancelled`].
    pub fn install<T: Send>(&self, work: impl FnOnce() -> Result<T, Error> + Send) -> Result<T, Error> {
        match (self.progress, self.threads) {
            // The function may lock, or wait for other threads: it stays on the caller's.
            (None, 0) => work(),
            _ => self.run(|_| work()),
        }
    }

    /// Runs an operation on the threads of the settings, with a monitor of its progress.
    pub(crate) fn run<T: Send>(&self, operation: impl FnOnce(&Monitor) -> Result<T, Error> + Send) -> Result<T, Error> {
        progress::run(self.progress, self.threads, operation)
    }

    pub(crate) fn measure_job(
        &self,
        measurement: Measurement,
        method: VolumeMethod,
        keep: Keep,
    ) -> Result<MeasureJob, Error> {
        self.check()?;
        Ok(MeasureJob {
            measurement,
            unit: None,
            openness: Openness::Refused,
            spacing: self.spacing(),
            lod: self.lod,
            axes: self.axes.list(),
            mode: self.mode,
            fill: self.fill,
            backend: self.backend.clone(),
            memory: self.memory,
            method,
            hashes: false,
            certainty: Certainty { bounds: self.bounds, assertions: Vec::new() },
            keep,
        })
    }

    pub(crate) fn sum_job(&self, operation: SumOperation<Length>, keep: Keep) -> Result<SumJob, Error> {
        self.check()?;
        Ok(SumJob {
            operation,
            unit: None,
            spacing: self.spacing(),
            lod: self.lod,
            axes: self.axes.list(),
            mode: self.mode,
            fill: self.fill,
            backend: self.backend.clone(),
            memory: self.memory,
            hashes: false,
            certainty: Certainty { bounds: self.bounds, assertions: Vec::new() },
            keep,
        })
    }

    /// Checks the raster.
    pub(crate) fn check(&self) -> Result<(), Error> {
        self.spacing.check()
    }
}
