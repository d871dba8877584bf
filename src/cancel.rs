//! Stops long loops from outside.
//!
//! An operation with a listener runs on a thread pool of its own, whose threads know its stop flag (`progress.rs`). When the flag
//! is raised, the next [`checkpoint`] on any of these threads unwinds to the start of the operation, past all owners of memory and
//! unfinished files. So no function between the two has to return an error for it, and a step that is called by itself, outside
//! an operation, can never be stopped.
//!
//! Programs that are built with `panic = "abort"` cannot unwind: there an operation stops between its stages alone.

use std::cell::OnceCell;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The payload of the unwinding.
pub(crate) struct Unwound;

thread_local! {
    /// The stop flag of the operation that the thread works for.
    static STOP: OnceCell<Arc<AtomicBool>> = const { OnceCell::new() };
}

/// Makes the calling thread, which is new, work for the operation of a flag.
pub(crate) fn work_for(flag: Arc<AtomicBool>) {
    STOP.with(|stop| stop.set(flag).expect("the thread is new"));
}

/// Ends the operation that the thread works for, if its listener asked for that. Long loops call it at least every few
/// milliseconds, outside locks and where nothing is left half written.
///
/// Each task of a parallel loop unwinds by itself, which takes some 100 µs: loops over many items give their tasks a least length.
#[inline]
pub(crate) fn checkpoint() {
    if cfg!(panic = "unwind") && STOP.with(|stop| stop.get().is_some_and(|stop| stop.load(Ordering::Relaxed))) {
        resume_unwind(Box::new(Unwound));
    }
}

/// Returns whether work ends at a checkpoint if the operation that it belongs to is stopped already; else it ends as it should.
#[cfg(test)]
pub(crate) fn stops(work: impl FnOnce() + Send) -> bool {
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::thread;

    let work = || {
        work_for(Arc::new(AtomicBool::new(true)));
        catch_unwind(AssertUnwindSafe(work))
    };
    match thread::scope(|scope| scope.spawn(work).join().expect("panics are caught")) {
        Ok(()) => false,
        Err(payload) => {
            assert!(payload.is::<Unwound>());
            true
        }
    }
}
