//! Reads whole files into memory.

use std::io;
use std::path::Path;

#[cfg(unix)]
use super::machine;
#[cfg(unix)]
use crate::allocation::handled;
use crate::input;

/// Reads a whole file.
///
/// Several threads read it piece by piece: the copy out of the system's cache and the first touch of new memory cost as
/// much as parsing a binary mesh does.
#[cfg(unix)]
pub fn of_file(path: &Path) -> io::Result<Vec<u8>> {
    use std::io::Read;
    use std::os::unix::fs::FileExt;

    use rayon::prelude::*;

    const PIECE: usize = 1 << 22;
    let file = input::open(path)?;
    let metadata = file.metadata()?;
    if metadata.len() < PIECE as u64 {
        let mut bytes = Vec::new();
        file.take(metadata.len()).read_to_end(&mut bytes)?;
        return Ok(bytes);
    }
    let length = usize::try_from(metadata.len()).map_err(|_| io::Error::from(io::ErrorKind::OutOfMemory))?;
    if machine::free_memory().is_some_and(|free| metadata.len() > free) {
        return Err(io::Error::new(io::ErrorKind::OutOfMemory, format!("its {length} bytes do not fit into memory")));
    }
    // Test the allocation first, as `vec!` aborts if it fails. `vec!` is still used, as the system provides zeroed pages.
    handled(|| Vec::<u8>::new().try_reserve_exact(length))?;
    let mut bytes = vec![0; length];
    bytes
        .par_chunks_mut(PIECE)
        .enumerate()
        .try_for_each(|(piece, bytes)| file.read_exact_at(bytes, (piece * PIECE) as u64))?;
    Ok(bytes)
}

/// Reads a whole file.
#[cfg(not(unix))]
pub fn of_file(path: &Path) -> io::Result<Vec<u8>> {
    use std::io::Read;

    let mut bytes = Vec::new();
    input::open(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}
