//! Signals that end the program: it removes the temporary files of the writes under way and exits with 128 plus the
//! number of the signal, as shells report it.

/// Handles the signals from here on. Where that cannot be, they end the program all the same, only less tidily.
#[cfg(unix)]
pub fn handle() {
    use std::{mem, process, ptr, thread};

    // SAFETY: the set is initialised before it is used, and all pointers are to values that live during the calls.
    let signals = unsafe {
        let mut signals: libc::sigset_t = mem::zeroed();
        libc::sigemptyset(&mut signals);
        libc::sigaddset(&mut signals, libc::SIGINT);
        libc::sigaddset(&mut signals, libc::SIGTERM);
        // `nohup` has hangups ignored.
        let mut action: libc::sigaction = mem::zeroed();
        libc::sigaction(libc::SIGHUP, ptr::null(), &mut action);
        if action.sa_sigaction != libc::SIG_IGN {
            libc::sigaddset(&mut signals, libc::SIGHUP);
        }
        // Every thread inherits the mask, so that the one below alone takes them.
        libc::pthread_sigmask(libc::SIG_BLOCK, &signals, ptr::null_mut());
        signals
    };
    let spawned = thread::Builder::new().name("signals".to_owned()).spawn(move || {
        let mut signal = 0;
        // SAFETY: both pointers are to values of this thread.
        if unsafe { libc::sigwait(&signals, &mut signal) } == 0 {
            ldi_ops::output::abandon();
            process::exit(128 + signal);
        }
    });
    if spawned.is_err() {
        // SAFETY: as above.
        unsafe { libc::pthread_sigmask(libc::SIG_UNBLOCK, &signals, ptr::null_mut()) };
    }
}

/// Handles the interrupt of a console from here on.
#[cfg(not(unix))]
pub fn handle() {
    const INTERRUPTED: i32 = 130;
    let _ = ctrlc::set_handler(|| {
        ldi_ops::output::abandon();
        std::process::exit(INTERRUPTED);
    });
}
