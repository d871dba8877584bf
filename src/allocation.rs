//! Memory for large arrays, in large pages where the system has them.
//!
//! A mesh is converted about as fast as memory can be written, so that most of the time would go into the page faults
//! of its first touch: one for every 4 KiB, against one for every 2 MiB here.

use std::alloc::{Layout, handle_alloc_error};
use std::cell::Cell;
use std::collections::TryReserveError;

use crate::parallel::*;
use bytemuck::Zeroable;

/// Smallest array for large pages, in bytes; smaller ones have too few pages to matter.
#[cfg(target_os = "linux")]
const LEAST_BYTES: usize = 8 << 20;

/// Returns an empty vector with room for `count` values. The caller has checked that `count` is plausible.
pub fn vec_with_room<T>(count: usize) -> Vec<T> {
    let vec = Vec::with_capacity(count);
    #[cfg(target_os = "linux")]
    advise_huge_pages(&vec);
    vec
}

/// Does the same for a count for which there may be too little memory.
pub fn try_vec_with_room<T>(count: usize) -> Result<Vec<T>, TryReserveError> {
    let mut vec = Vec::new();
    handled(|| vec.try_reserve_exact(count))?;
    #[cfg(target_os = "linux")]
    advise_huge_pages(&vec);
    Ok(vec)
}

/// Returns values that are 0, and not touched yet.
pub fn zeroed<T: Zeroable>(count: usize) -> Vec<T> {
    let vec = bytemuck::try_zeroed_vec(count)
        .unwrap_or_else(|()| handle_alloc_error(Layout::array::<T>(count).expect("arrays in memory have a layout")));
    #[cfg(target_os = "linux")]
    advise_huge_pages(&vec);
    vec
}

/// Returns `count` equal values, which all threads write: the first touch of new memory takes longer than the writing.
pub fn filled<T: Zeroable + Copy + Send + Sync>(count: usize, value: T) -> Vec<T> {
    let mut vec = zeroed(count);
    vec.par_chunks_mut(CHUNK).for_each(|chunk| chunk.fill(value));
    vec
}

/// Number of values that a task fills.
const CHUNK: usize = 1 << 18;

thread_local! {
    static IS_HANDLED: Cell<bool> = const { Cell::new(false) };
}

/// Runs an allocation whose failure the caller handles, as [`Vec::try_reserve`] reports it.
pub fn handled<R>(allocate: impl FnOnce() -> R) -> R {
    IS_HANDLED.set(true);
    let result = allocate();
    IS_HANDLED.set(false);
    result
}

/// Returns whether this thread is in [`handled`]. An allocator that ends the process when out of memory must not do so
/// then.
pub fn is_handled() -> bool {
    IS_HANDLED.try_with(Cell::get).unwrap_or(false)
}

#[cfg(target_os = "linux")]
fn advise_huge_pages<T>(vec: &Vec<T>) {
    const PAGE: usize = 4096;
    let bytes = vec.capacity() * size_of::<T>();
    if bytes < LEAST_BYTES {
        return;
    }
    let skipped = vec.as_ptr().addr().wrapping_neg() % PAGE;
    let length = (bytes - skipped) / PAGE * PAGE;
    let start = vec.as_ptr().cast::<u8>().wrapping_add(skipped).cast_mut();
    // SAFETY: the range lies within the vector's allocation, and this advice changes no content. It may fail, on
    // systems with larger pages or without huge ones, which has no effect.
    unsafe { libc::madvise(start.cast(), length, libc::MADV_HUGEPAGE) };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn allocations_have_the_requested_capacity_or_fail() {
        assert!(try_vec_with_room::<u64>(usize::MAX).is_err());
        assert!(try_vec_with_room::<u64>(1 << 21).is_ok_and(|vec| vec.capacity() >= 1 << 21));
        for count in [0, 1, 1 << 20, (1 << 20) + 1] {
            let mut vec = vec_with_room::<[f64; 3]>(count);
            assert!(vec.is_empty() && vec.capacity() >= count);
            vec.resize(count, [1.0; 3]);
            assert!(vec.iter().all(|value| *value == [1.0; 3]));
            assert_eq!(filled(count, [1.0; 3]), vec);
        }
    }
}
