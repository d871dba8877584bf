//! Progress and cancellation of long operations.

use std::fmt::Display;
use std::ops::ControlFlow;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread;
use std::time::Duration;

use crate::Error;
use crate::cancel::{self, Unwound};
use crate::parallel;

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
    fn heartbeat(&self) -> Result<(), Error> {
        self.change(|_| {})
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

/// The time between two questions to a listener.
const HEARTBEAT: Duration = Duration::from_millis(50);

/// The stack of each thread in bytes, as large as that of a main thread.
const STACK: usize = 8 << 20;

/// Runs an operation with a monitor of its progress: [`stoppable`] with a listener or a number of threads, else on the current pool.
///
/// # Errors
/// Those of the operation and of [`stoppable`].
pub(crate) fn run<T: Send>(
    listener: Option<&dyn Progress>,
    threads: usize,
    operation: impl FnOnce(&Monitor) -> Result<T, Error> + Send,
) -> Result<T, Error> {
    let monitor = Monitor::new(listener);
    match (listener, threads) {
        (None, 0) => parallel::in_pool(|| operation(&monitor)),
        _ => stoppable(&monitor, threads, || operation(&monitor)),
    }
}

/// Runs an operation on `threads` threads (0: as many as here) that the monitor's listener can stop at any checkpoint of its loops
/// (`cancel.rs`).
///
/// # Errors
/// Those of the operation; [`Error::Cancelled`] where it was stopped; a machine error where no threads could be started.
fn stoppable<T: Send>(
    monitor: &Monitor,
    threads: usize,
    operation: impl FnOnce() -> Result<T, Error> + Send,
) -> Result<T, Error> {
    let flag = Arc::clone(&monitor.is_stopped);
    let threads = if threads == 0 { rayon::current_num_threads() } else { threads };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .stack_size(STACK)
        .start_handler(move |_| cancel::work_for(Arc::clone(&flag)))
        .build()
        .map_err(|error| Error::machine(format!("no threads could be started: {error}")))?;
    // The calling thread asks the listener. If it belongs to a pool, it takes up no other work meanwhile.
    thread::scope(|scope| {
        let (done, is_done) = mpsc::channel::<()>();
        let worker = scope.spawn(move || {
            let _done = done;
            pool.install(operation)
        });
        while is_done.recv_timeout(HEARTBEAT) == Err(mpsc::RecvTimeoutError::Timeout) && monitor.heartbeat().is_ok() {}
        match worker.join() {
            Ok(result) => result,
            Err(payload) if payload.is::<Unwound>() => Err(Error::Cancelled),
            Err(payload) => resume_unwind(payload),
        }
    })
}

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::sync::atomic::AtomicU64;

    use crate::parallel::*;

    use super::*;
    use crate::cancel::checkpoint;

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

    /// Goes on for so many questions.
    struct Patience(AtomicU64);

    impl Progress for Patience {
        fn update(&self, _: &str, _: u64, _: u64) -> ControlFlow<()> {
            match self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)) {
                Ok(_) => ControlFlow::Continue(()),
                Err(_) => ControlFlow::Break(()),
            }
        }
    }

    #[test]
    fn endless_loops_on_all_threads_stop_and_drop_what_they_own() {
        let patience = Patience(AtomicU64::new(2));
        let monitor = Monitor::new(Some(&patience));
        let owned = Arc::new(());
        let result: Result<(), Error> = stoppable(&monitor, 3, || {
            (0..3).into_par_iter().for_each(|_| {
                let _owned = Arc::clone(&owned);
                loop {
                    checkpoint();
                }
            });
            Ok(())
        });
        assert_eq!(result, Err(Error::Cancelled));
        assert_eq!(Arc::strong_count(&owned), 1);
    }

    #[test]
    fn results_errors_and_panics_pass() {
        let monitor = Monitor::new(None);
        assert_eq!(stoppable(&monitor, 2, || Ok(rayon::current_num_threads())), Ok(2));
        assert_eq!(stoppable::<()>(&monitor, 1, || Err(Error::input("none"))), Err(Error::input("none")));
        let panicked = catch_unwind(AssertUnwindSafe(|| stoppable::<()>(&monitor, 1, || panic!("a fault"))));
        assert_eq!(panicked.unwrap_err().downcast_ref::<&str>(), Some(&"a fault"));
    }

    #[test]
    fn checkpoints_outside_operations_do_nothing() {
        checkpoint();
    }
}
