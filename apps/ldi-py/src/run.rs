//! Calls of the library: without the GIL, stopped by signals, with progress.

use std::ops::ControlFlow;
use std::process;
use std::sync::{Mutex, OnceLock, PoisonError};
use std::thread::{self, ThreadId};

use ldi_ops::{Error, Progress, Settings};
use pyo3::prelude::*;

use crate::error::exception;

/// The process in which the first call ran.
static PROCESS: OnceLock<u32> = OnceLock::new();

/// Listens to an operation on behalf of the Python thread that waits for it: every 50 ms it runs Python's signal handlers and the
/// caller's progress function.
struct Listener {
    waiting: ThreadId,
    progress: Option<Py<PyAny>>,
    /// The exception that ends the operation.
    raised: Mutex<Option<PyErr>>,
}

impl Listener {
    fn raise(&self, error: PyErr) {
        self.raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }

    fn is_raised(&self) -> bool {
        self.raised.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    /// Runs signal handlers and the progress function.
    fn answer(&self, py: Python<'_>, stage: &str, done: u64, total: u64) -> PyResult<()> {
        py.check_signals()?;
        let Some(progress) = &self.progress else { return Ok(()) };
        let answer = progress.call1(py, (stage, done, total))?;
        match answer.is_none(py) || answer.is_truthy(py)? {
            true => Ok(()),
            false => Err(exception(py, &Error::Cancelled)),
        }
    }
}

impl Progress for Listener {
    fn update(&self, stage: &str, done: u64, total: u64) -> ControlFlow<()> {
        // Workers report each step; the thread that waits reports every 50 ms, and it alone calls Python.
        if thread::current().id() == self.waiting && !self.is_raised() {
            let answer = Python::attach(|py| self.answer(py, stage, done, total));
            answer.unwrap_or_else(|error| self.raise(error));
        }
        if self.is_raised() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// Runs work with settings, on threads of its own, while the calling thread answers signals.
pub fn run<T: Send>(
    py: Python<'_>,
    settings: Settings<'static>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&Settings) -> Result<T, Error> + Send,
) -> PyResult<T> {
    if *PROCESS.get_or_init(process::id) != process::id() {
        let forked = Error::machine(
            "this process was forked from one in which ldi_ops had run, and a fork has none of its threads; start workers by \
             spawn: multiprocessing.get_context('spawn'), or ProcessPoolExecutor(mp_context=…)",
        );
        return Err(exception(py, &forked));
    }
    let listener = Listener { waiting: thread::current().id(), progress, raised: Mutex::default() };
    let result = py.detach(|| work(&settings.progress(&listener)));
    let raised = listener.raised.into_inner().unwrap_or_else(PoisonError::into_inner);
    let closed = close(py, listener.progress.as_ref());
    match (result, raised) {
        (_, Some(error)) => Err(error),
        (Err(error), None) => Err(exception(py, &error)),
        (Ok(value), None) => closed.map(|()| value),
    }
}

/// Calls the method `close` of a progress function, if it has one.
fn close(py: Python<'_>, progress: Option<&Py<PyAny>>) -> PyResult<()> {
    match progress.and_then(|progress| progress.getattr(py, "close").ok()) {
        Some(close) => close.call0(py).map(drop),
        None => Ok(()),
    }
}
