//! Progress and cancellation of long operations.

use std::fmt::Display;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::Error;

/// A listener to a long operation. All methods may be called from any thread.
pub trait Progress: Sync {
    /// Receives the current stage, and the number of steps that are done of `total`, which is 0 if unknown. The operation calls
    /// it at every step, and every 50 ms between steps. If it returns `Break`, the operation ends with [`Error::Cancelled`] within
    /// 0.2 s and leaves no file.
    fn update(&self, stage: &str, done: u64, total: u64) -> ControlFlow<()>;

    /// Receives a line about the operation: times and counts.
    fn detail(&self, _line: &str) {}
}

/// The sender of an operation's [`Progress`]: counts steps over all stages and remembers a request to stop.
pub struct Monitor<'p> {
    listener: Option<&'p dyn Progress>,
    state: Mutex<State>,
    is_stopped: Arc<AtomicBool>,
}

#[derive(Default)]
struct State {
    stage: String,
    done: u64,
    total: u64,
}

impl<'p> Monitor<'p> {
    /// Creates a monitor with or without a listener.
    pub fn new(listener: Option<&'p dyn Progress>) -> Monitor<'p> {
        Monitor { listener, state: Mutex::default(), is_stopped: Arc::default() }
    }

    /// Begins a stage.
    pub fn stage(&self, stage: impl Into<String>) -> Result<(), Error> {
        let stage = stage.into();
        self.change(|state| state.stage = stage)
    }

    /// Announces further steps.
    pub fn expect(&self, steps: usize) -> Result<(), Error> {
        self.change(|state| state.total += steps as u64)
    }

    /// Counts one of the expected steps as done.
    pub fn step(&self) -> Result<(), Error> {
        self.change(|state| state.done += 1)
    }

    /// Counts all steps up to this number as done, after the operation that should have done them failed.
    #[cfg(feature = "report")]
    pub(crate) fn catch_up(&self, steps: usize) -> Result<(), Error> {
        self.change(|state| state.done = state.done.max(steps as u64))
    }

    /// Sends a line to the listener.
    pub fn detail(&self, line: impl Display) {
        if let Some(listener) = self.listener {
            listener.detail(&line.to_string());
        }
    }

    /// Repeats the state to the listener, which may then stop the operation.
    pub(crate) fn heartbeat(&self) -> Result<(), Error> {
        self.change(|_| {})
    }

    /// Returns the flag that is set when the listener stops the operation.
    pub(crate) fn stop_flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.is_stopped)
    }

    fn change(&self, change: impl FnOnce(&mut State)) -> Result<(), Error> {
        let Some(listener) = self.listener else { return Ok(()) };
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        change(&mut state);
        if listener.update(&state.stage, state.done, state.total).is_break() {
            self.is_stopped.store(true, Ordering::Relaxed);
        }
        match self.is_stopped.load(Ordering::Relaxed) {
            true => Err(Error::Cancelled),
            false => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A listener that stops the operation at the third update.
    struct Listener(Mutex<Vec<(String, u64, u64)>>);

    impl Progress for Listener {
        fn update(&self, stage: &str, done: u64, total: u64) -> ControlFlow<()> {
            let mut seen = self.0.lock().unwrap();
            seen.push((stage.to_owned(), done, total));
            if seen.len() < 3 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        }
    }

    #[test]
    fn a_listener_receives_stages_and_stops_the_operation() {
        let listener = Listener(Mutex::default());
        let monitor = Monitor::new(Some(&listener));
        assert_eq!(monitor.expect(2), Ok(()));
        assert_eq!(monitor.stage("sampling"), Ok(()));
        assert_eq!(monitor.step(), Err(Error::Cancelled));
        assert_eq!(monitor.stage("writing"), Err(Error::Cancelled));
        let seen = listener.0.into_inner().unwrap();
        assert_eq!(seen[1], ("sampling".to_owned(), 0, 2));
        assert_eq!(seen[2], ("sampling".to_owned(), 1, 2));
        assert_eq!(Monitor::new(None).step(), Ok(()));
    }
}
