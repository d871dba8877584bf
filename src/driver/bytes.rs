//! Opens input files, and reads whole ones into memory.

use std::fs::File;
use std::io;
use std::path::Path;

use super::machine;
#[cfg(unix)]
use crate::allocation::handled;
use crate::cancel::checkpoint;
use crate::input;

/// Bytes that one thread reads at a time. Smaller files are read whatever memory is free.
const PIECE: usize = 1 << 22;

/// Opens a file whose bytes fit into memory, and returns their number.
pub fn open(path: &Path) -> io::Result<(File, u64)> {
    let file = input::open(path)?;
    let length = file.metadata()?.len();
    if length >= PIECE as u64 && machine::free_memory().is_some_and(|free| length > free) {
        return Err(io::Error::new(io::ErrorKind::OutOfMemory, format!("its {length} bytes do not fit into memory")));
    }
    Ok((file, length))
}

/// Reads a whole file.
///
/// Several threads read it piece by piece: the copy out of the system's cache and the first touch of new memory cost as
/// much as parsing a binary mesh does.
#[cfg(unix)]
pub fn of_file(file: File, length: u64) -> io::Result<Vec<u8>> {
    use std::io::Read;
    use std::os::unix::fs::FileExt;

    use crate::parallel::*;

    if length < PIECE as u64 {
        let mut bytes = Vec::new();
        file.take(length).read_to_end(&mut bytes)?;
        return Ok(bytes);
    }
    let length = usize::try_from(length).map_err(|_| io::Error::from(io::ErrorKind::OutOfMemory))?;
    // Test the allocation first, as `vec!` aborts if it fails. `vec!` is still used, as the system provides zeroed pages.
    handled(|| Vec::<u8>::new().try_reserve_exact(length))?;
    let mut bytes = vec![0; length];
    bytes.par_chunks_mut(PIECE).enumerate().try_for_each(|(piece, bytes)| {
        checkpoint();
        file.read_exact_at(bytes, (piece * PIECE) as u64)
    })?;
    Ok(bytes)
}

/// Reads a whole file.
#[cfg(not(unix))]
pub fn of_file(mut file: File, _length: u64) -> io::Result<Vec<u8>> {
    use std::io::Read;

    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}
