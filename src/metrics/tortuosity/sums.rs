//! Loops over unknowns, in tasks of a fixed size, so that sums do not depend on the number of threads.

use crate::parallel::*;

use crate::cancel::checkpoint;

/// Unknowns in one task.
const CHUNK: usize = 1 << 12;

/// Returns Σ of a term over 0..`count`.
pub(super) fn sum(count: usize, term: impl Fn(usize) -> f64 + Sync) -> f64 {
    if count <= CHUNK {
        return (0..count).map(term).sum();
    }
    let of_chunk = |chunk: usize| (chunk * CHUNK..count.min((chunk + 1) * CHUNK)).map(&term).sum();
    let sums: Vec<f64> = (0..count.div_ceil(CHUNK)).into_par_iter().map(of_chunk).collect();
    sums.into_iter().sum()
}

/// Sets or changes each element, by its index.
pub(super) fn each<T: Send>(values: &mut [T], change: impl Fn(usize, &mut T) + Sync) {
    let [] = each_summing(values, |i, value| {
        change(i, value);
        []
    });
}

/// Sets or changes each element, by its index, and returns the sums of the terms that `change` returns.
pub(super) fn each_summing<T: Send, const N: usize>(
    values: &mut [T],
    change: impl Fn(usize, &mut T) -> [f64; N] + Sync,
) -> [f64; N] {
    let add = |sums: [f64; N], terms: [f64; N]| std::array::from_fn(|k| sums[k] + terms[k]);
    let of_chunk = |chunk: usize, values: &mut [T]| {
        let terms = values.iter_mut().enumerate().map(|(i, value)| change(chunk * CHUNK + i, value));
        terms.fold([0.0; N], add)
    };
    if values.len() <= CHUNK {
        return of_chunk(0, values);
    }
    let chunks = values.par_chunks_mut(CHUNK).enumerate().map(|(chunk, values)| {
        checkpoint();
        of_chunk(chunk, values)
    });
    chunks.collect::<Vec<_>>().into_iter().fold([0.0; N], add)
}
