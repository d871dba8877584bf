//! Signals that end the program: it removes the temporary files of unfinished writes and exits with 128 plus the number of the
//! signal, the convention of shells.

/// Installs the handler. If that fails, signals still end the program, but temporary files stay.
#[cfg(unix)]
pub fn handle() {
    use std::{mem, process, ptr, thread};

    // SAFETY: the set is initialised before use, and all pointers are to values that live during the calls.
    let signals = unsafe {
        let mut signals: libc::sigset_t = mem::zeroed();
        libc::sigemptyset(&mut signals);
        libc::sigaddset(&mut signals, libc::SIGINT);
        libc::sigaddset(&mut signals, libc::SIGTERM);
        // `nohup` makes the process ignore hangups; they stay ignored.
        let mut action: libc::sigaction = mem::zeroed();
        libc::sigaction(libc::SIGHUP, ptr::null(), &mut action);
        if action.sa_sigaction != libc::SIG_IGN {
            libc::sigaddset(&mut signals, libc::SIGHUP);
        }
        // Every thread inherits the mask, so that only the one below receives the signals.
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

/// Installs the handler of console interrupts.
#[cfg(not(unix))]
pub fn handle() {
    const INTERRUPTED: i32 = 130;
    let _ = ctrlc::set_handler(|| {
        ldi_ops::output::abandon();
        std::process::exit(INTERRUPTED);
    });
}
