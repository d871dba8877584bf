//! Formatting of elements in parallel, and writing of the bytes in order.
//!
//! One thread takes longer to format four million triangles than the system takes to write the bytes, so while one
//! group of tasks is written the next is formatted. Memory is bounded by two groups, whatever the length of the file,
//! and the bytes do not depend on the number of threads.

use std::io::{self, Write};

use crate::parallel::*;

use crate::cancel::checkpoint;

/// Number of elements that one task formats: enough to outweigh the overhead, few enough that their bytes stay in a
/// cache.
const ELEMENTS_PER_TASK: usize = 1 << 13;

/// Writes the bytes that `format` appends for each element, in the order of the elements.
pub(super) fn write_each<T: Sync>(
    out: &mut (impl Write + Send),
    elements: &[T],
    format: impl Fn(&T, &mut Vec<u8>) + Sync,
) -> io::Result<()> {
    let tasks = rayon::current_num_threads();
    let fill = |elements: &[T], buffers: &mut Vec<Vec<u8>>| {
        let used = elements.len().div_ceil(ELEMENTS_PER_TASK);
        buffers.resize_with(used, Vec::new);
        elements.par_chunks(ELEMENTS_PER_TASK).zip(buffers.par_iter_mut()).for_each(|(elements, buffer)| {
            buffer.clear();
            elements.iter().for_each(|element| format(element, buffer));
        });
    };
    let (mut ready, mut next) = (Vec::new(), Vec::new());
    for group in elements.chunks(ELEMENTS_PER_TASK * tasks) {
        checkpoint();
        let write = || ready.iter().try_for_each(|bytes: &Vec<u8>| out.write_all(bytes));
        let (written, ()) = join(write, || fill(group, &mut next));
        written?;
        std::mem::swap(&mut ready, &mut next);
    }
    ready.iter().try_for_each(|bytes| out.write_all(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parallel_writing_keeps_the_order_of_elements() {
        for count in [0, 1, ELEMENTS_PER_TASK, 5 * ELEMENTS_PER_TASK - 1, 9 * ELEMENTS_PER_TASK + 7] {
            let elements: Vec<u32> = (0..count as u32).collect();
            let mut bytes = Vec::new();
            write_each(&mut bytes, &elements, |element, bytes| bytes.extend(element.to_le_bytes())).unwrap();
            let expected: Vec<u8> = elements.iter().flat_map(|element| element.to_le_bytes()).collect();
            assert!(bytes == expected, "{count}");
        }
    }

    #[test]
    fn full_disks_end_the_writing() {
        struct Full(usize);
        impl Write for Full {
            fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
                self.0 = self.0.checked_sub(bytes.len()).ok_or(io::ErrorKind::StorageFull)?;
                Ok(bytes.len())
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        for room in [0, ELEMENTS_PER_TASK, 100 * ELEMENTS_PER_TASK - 1] {
            let failed = write_each(&mut Full(room), &[0u8; 100 * ELEMENTS_PER_TASK], |byte, bytes| bytes.push(*byte));
            assert_eq!(failed.unwrap_err().kind(), io::ErrorKind::StorageFull, "{room}");
        }
    }
}
