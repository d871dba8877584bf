//! Stops long loops from outside.
//!
//! An operation with a listener runs on a thread pool of its own, whose threads know its stop flag. A watcher asks the listener
//! every [`HEARTBEAT`]; when the answer is to stop, it raises the flag, and the next [`checkpoint`] on any of these threads
//! unwinds to [`stoppable`], past all owners of memory and unfinished files. So no function between the two has to return an
//! error for it, and a step that is called by itself, outside an operation, can never be stopped.
//!
//! Programs that are built with `panic = "abort"` cannot unwind: there an operation stops between its stages alone.

use std::cell::OnceCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::Duration;

use crate::Error;
use crate::progress::Monitor;

/// The time between two questions to a listener.
const HEARTBEAT: Duration = Duration::from_millis(50);

/// The payload of the unwinding.
struct Cancelled;

thread_local! {
    /// The stop flag of the operation that the thread works for.
    static STOP: OnceCell<Arc<AtomicBool>> = const { OnceCell::new() };
}

/// Ends the operation that the thread works for, if its listener asked for that. Long loops call it at least every few
/// milliseconds, outside locks and where nothing is left half written.
#[inline]
pub(crate) fn checkpoint() {
    if cfg!(panic = "unwind") && STOP.with(|stop| stop.get().is_some_and(|stop| stop.load(Ordering::Relaxed))) {
        resume_unwind(Box::new(Cancelled));
    }
}

/// Runs an operation on `threads` threads (0: as many as here) that the monitor's listener can stop at any [`checkpoint`].
///
/// # Errors
/// Those of the operation; [`Error::Cancelled`] where it was stopped; a machine error where no threads could be started.
pub(crate) fn stoppable<T: Send>(
    monitor: &Monitor,
    threads: usize,
    operation: impl FnOnce() -> Result<T, Error> + Send,
) -> Result<T, Error> {
    let flag = monitor.stop_flag();
    let threads = if threads == 0 { rayon::current_num_threads() } else { threads };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .start_handler({
            let flag = Arc::clone(&flag);
            move |_| STOP.with(|stop| stop.set(Arc::clone(&flag)).expect("the thread is new"))
        })
        .build()
        .map_err(|error| Error::machine(format!("cannot start the threads: {error}")))?;
    let (done, is_done) = mpsc::channel::<()>();
    thread::scope(|scope| {
        scope.spawn(move || {
            while is_done.recv_timeout(HEARTBEAT) == Err(mpsc::RecvTimeoutError::Timeout) {
                if monitor.heartbeat().is_err() {
                    return;
                }
            }
        });
        let ended = catch_unwind(AssertUnwindSafe(|| pool.install(operation)));
        drop(done);
        match ended {
            Ok(result) => result,
            Err(payload) if payload.is::<Cancelled>() => Err(Error::Cancelled),
            Err(payload) => resume_unwind(payload),
        }
    })
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;
    use std::sync::atomic::AtomicU64;

    use rayon::prelude::*;

    use super::*;
    use crate::Progress;

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
