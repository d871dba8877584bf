//! The allocator: large arrays in large pages, where the system has them.
//!
//! A job touches each of its large arrays a few times, so that the page faults of the first touch, one for every 4 KiB, cost an
//! eighth of all its time; with pages of 2 MiB they cost next to nothing. The system's allocator stays in charge.
//!
//! If memory runs out, the program prints an error, removes its temporary files and exits with the exit code for the machine.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use ldi_ops::allocation;

use crate::exit::Exit;

/// Blocks smaller than this have too few pages to matter.
const LARGE: usize = 4 << 20;

/// The system's allocator, with advice to use large pages for large blocks.
pub struct LargePages;

// SAFETY: every call is passed on to the system's allocator unchanged, and the advice changes no content.
unsafe impl GlobalAlloc for LargePages {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's guarantees are those that the system's allocator requires.
        advised(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as in `alloc`.
        advised(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as in `alloc`, and the block came from the system's allocator.
        advised(unsafe { System.realloc(block, layout, size) }, size)
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: as in `realloc`.
        unsafe { System.dealloc(block, layout) }
    }
}

/// Returns the given block, after advising the system about the whole pages in it.
#[inline]
fn advised(block: *mut u8, size: usize) -> *mut u8 {
    if block.is_null() {
        refused(size);
    } else if size >= LARGE {
        advise(block, size);
    }
    block
}

/// Ends the program for lack of memory, unless the failure is handled.
#[cold]
fn refused(size: usize) {
    thread_local! {
        static IS_ENDING: Cell<bool> = const { Cell::new(false) };
    }
    static ENDS: AtomicBool = AtomicBool::new(false);
    if allocation::is_handled() {
        return;
    }
    let is_again = IS_ENDING.try_with(|ending| ending.replace(true)).unwrap_or(true);
    if !is_again {
        // One thread ends the program; others that run out of memory wait for that.
        while ENDS.swap(true, Ordering::Relaxed) {
            thread::sleep(Duration::from_secs(1));
        }
        let mut text = [0u8; 256];
        let mut rest = &mut text[..];
        let _ = writeln!(
            rest,
            "ldi-ops: error: out of memory: cannot allocate {size} more bytes; lower the resolution (a smaller --resolution), \
             or allow the program more memory"
        );
        let length = 256 - rest.len();
        say(&text[..length]);
        ldi_ops::output::abandon();
    }
    Exit::Machine.at_once()
}

/// Writes to stderr without its lock, which a waiting thread may hold.
#[cfg(unix)]
fn say(text: &[u8]) {
    // SAFETY: pointer and length are those of the slice.
    unsafe { libc::write(2, text.as_ptr().cast(), text.len()) };
}

#[cfg(not(unix))]
fn say(text: &[u8]) {
    let _ = std::io::stderr().write_all(text);
}

#[cfg(target_os = "linux")]
fn advise(block: *mut u8, size: usize) {
    const PAGE: usize = 4096;
    let skipped = block.addr().wrapping_neg() % PAGE;
    let length = (size - skipped) / PAGE * PAGE;
    // SAFETY: the range lies within the block. If the advice fails, on systems with larger pages or without huge ones, nothing
    // changes.
    unsafe { libc::madvise(block.wrapping_add(skipped).cast(), length, libc::MADV_HUGEPAGE) };
}

#[cfg(not(target_os = "linux"))]
fn advise(_block: *mut u8, _size: usize) {}
