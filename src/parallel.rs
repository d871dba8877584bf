//! Parallel iterators of Rayon that are quick to compile.
//!
//! Rayon compiles its work stealing anew for each closure that it is given, which is a third of the code that this library hands
//! to the compiler's back end. A [`ParIter`] divides its work where Rayon would, by one compiled function that calls closures by
//! reference: a call for each division, of which there are few to a thread. Its methods are those of Rayon's iterators, and modules
//! write `use crate::parallel::*` for `use rayon::prelude::*`.
//!
//! There is no such iterator for what has no length before it runs, by Rayon: ranges of `u64`, inclusive ranges, sets and maps. Sorts,
//! `par_chunk_by`, `par_bridge`, and what follows a method that [`ParIter`] does not have (`map(…).enumerate()`) divide by Rayon's code.

use rayon::iter::plumbing::{Consumer, Folder, Producer, ProducerCallback, Reducer, UnindexedConsumer};
use rayon::iter::{Enumerate, MaxLen, MinLen, Zip};
pub(crate) use rayon::iter::{IndexedParallelIterator, ParallelBridge, ParallelExtend, ParallelIterator};

/// Runs a closure on a thread of the current pool. From a thread outside, each parallel loop would hand its work over and wait for it
/// anew, some 20 µs each time.
pub(crate) fn in_pool<T: Send>(run: impl FnOnce() -> T + Send) -> T {
    rayon::scope(|_| run())
}

/// Runs two closures, in parallel where a thread is free, and returns both results.
pub(crate) fn join<A, B>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B)
where
    A: Send,
    B: Send,
{
    let (mut a, mut b) = (Some(a), Some(b));
    let (mut of_a, mut of_b) = (None, None);
    join_by_reference(&mut |_| of_a = a.take().map(|run| run()), &mut |_| of_b = b.take().map(|run| run()));
    both(of_a, of_b)
}

/// Runs two closures, once each. They are told whether another thread took them up.
#[inline(never)]
fn join_by_reference(a: &mut (dyn FnMut(bool) + Send), b: &mut (dyn FnMut(bool) + Send)) {
    rayon::join_context(|context| a(context.migrated()), |context| b(context.migrated()));
}

fn both<A, B>(a: Option<A>, b: Option<B>) -> (A, B) {
    let (Some(a), Some(b)) = (a, b) else { unreachable!("both closures have run") };
    (a, b)
}

/// An iterator of Rayon that divides its work by [`Division`].
#[derive(Clone)]
pub(crate) struct ParIter<I>(I);

/// The methods of Rayon's iterators that would give back an iterator with its own division.
impl<I: IndexedParallelIterator> ParIter<I> {
    pub(crate) fn enumerate(self) -> ParIter<Enumerate<I>> {
        ParIter(self.0.enumerate())
    }

    pub(crate) fn with_min_len(self, min: usize) -> ParIter<MinLen<I>> {
        ParIter(self.0.with_min_len(min))
    }

    pub(crate) fn with_max_len(self, max: usize) -> ParIter<MaxLen<I>> {
        ParIter(self.0.with_max_len(max))
    }

    pub(crate) fn zip<Z>(self, other: Z) -> ParIter<Zip<I, Z::Iter>>
    where
        Z: rayon::iter::IntoParallelIterator<Iter: IndexedParallelIterator>,
    {
        ParIter(self.0.zip(other))
    }
}

impl<I: IndexedParallelIterator> ParallelIterator for ParIter<I> {
    type Item = I::Item;

    fn drive_unindexed<C: UnindexedConsumer<I::Item>>(self, consumer: C) -> C::Result {
        self.drive(consumer)
    }

    fn opt_len(&self) -> Option<usize> {
        Some(self.len())
    }
}

impl<I: IndexedParallelIterator> IndexedParallelIterator for ParIter<I> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn drive<C: Consumer<I::Item>>(self, consumer: C) -> C::Result {
        let length = self.len();
        self.0.with_producer(Divided { length, consumer })
    }

    fn with_producer<F: ProducerCallback<I::Item>>(self, callback: F) -> F::Output {
        self.0.with_producer(callback)
    }
}

/// A consumer of so many items.
struct Divided<C> {
    length: usize,
    consumer: C,
}

impl<T, C: Consumer<T>> ProducerCallback<T> for Divided<C> {
    type Output = C::Result;

    fn callback<P: Producer<Item = T>>(self, producer: P) -> C::Result {
        let division = Division::new(self.length, producer.min_len(), producer.max_len());
        division.run(self.length, false, producer, self.consumer)
    }
}

/// Where work is divided, by Rayon's rule: into a piece for each thread, more if these exceed the most items of a piece, and again
/// where another thread took a piece up.
#[derive(Clone, Copy)]
struct Division {
    /// The least items of a piece.
    least: usize,
    /// Into how many pieces it is still to be divided.
    pieces: usize,
}

impl Division {
    fn new(length: usize, least: usize, most: usize) -> Division {
        Division { least: least.max(1), pieces: rayon::current_num_threads().max(length / most.max(1)) }
    }

    fn run<P, C>(mut self, length: usize, migrated: bool, producer: P, consumer: C) -> C::Result
    where
        P: Producer,
        C: Consumer<P::Item>,
    {
        if consumer.full() {
            return consumer.into_folder().complete();
        }
        if !self.divides(length, migrated) {
            return producer.fold_with(consumer.into_folder()).complete();
        }
        let middle = length / 2;
        let (left, right) = producer.split_at(middle);
        let (of_left, of_right, reducer) = consumer.split_at(middle);
        let (mut left, mut right) = (Some((left, of_left)), Some((right, of_right)));
        let (mut left_result, mut right_result) = (None, None);
        let part = |length, migrated, part: &mut Option<(P, C)>| {
            part.take().map(|(producer, consumer)| self.run(length, migrated, producer, consumer))
        };
        join_by_reference(&mut |migrated| left_result = part(middle, migrated, &mut left), &mut |migrated| {
            right_result = part(length - middle, migrated, &mut right)
        });
        let (left, right) = both(left_result, right_result);
        reducer.reduce(left, right)
    }

    /// Returns whether this many items are divided, and counts the division.
    fn divides(&mut self, length: usize, migrated: bool) -> bool {
        if length / 2 < self.least || !migrated && self.pieces == 0 {
            return false;
        }
        self.pieces /= 2;
        if migrated {
            self.pieces = self.pieces.max(rayon::current_num_threads());
        }
        true
    }
}

/// As Rayon's trait of this name, for what has a length.
pub(crate) trait IntoParallelIterator:
    Sized + rayon::iter::IntoParallelIterator<Iter: IndexedParallelIterator>
{
    fn into_par_iter(self) -> ParIter<Self::Iter> {
        ParIter(rayon::iter::IntoParallelIterator::into_par_iter(self))
    }
}

impl<T: rayon::iter::IntoParallelIterator<Iter: IndexedParallelIterator>> IntoParallelIterator for T {}

/// As Rayon's trait of this name.
pub(crate) trait ParallelSlice<T: Sync> {
    fn as_parallel_slice(&self) -> &[T];

    fn par_iter(&self) -> ParIter<rayon::slice::Iter<'_, T>> {
        self.as_parallel_slice().into_par_iter()
    }

    fn par_chunks(&self, size: usize) -> ParIter<rayon::slice::Chunks<'_, T>> {
        ParIter(rayon::slice::ParallelSlice::par_chunks(self.as_parallel_slice(), size))
    }

    fn par_chunks_exact(&self, size: usize) -> ParIter<rayon::slice::ChunksExact<'_, T>> {
        ParIter(rayon::slice::ParallelSlice::par_chunks_exact(self.as_parallel_slice(), size))
    }

    fn par_windows(&self, size: usize) -> ParIter<rayon::slice::Windows<'_, T>> {
        ParIter(rayon::slice::ParallelSlice::par_windows(self.as_parallel_slice(), size))
    }

    fn par_chunk_by<P>(&self, are_together: P) -> rayon::slice::ChunkBy<'_, T, P>
    where
        P: Fn(&T, &T) -> bool + Send + Sync,
    {
        rayon::slice::ParallelSlice::par_chunk_by(self.as_parallel_slice(), are_together)
    }
}

impl<T: Sync> ParallelSlice<T> for [T] {
    fn as_parallel_slice(&self) -> &[T] {
        self
    }
}

/// As Rayon's trait of this name.
pub(crate) trait ParallelSliceMut<T: Send> {
    fn as_parallel_slice_mut(&mut self) -> &mut [T];

    fn par_iter_mut(&mut self) -> ParIter<rayon::slice::IterMut<'_, T>> {
        self.as_parallel_slice_mut().into_par_iter()
    }

    fn par_chunks_mut(&mut self, size: usize) -> ParIter<rayon::slice::ChunksMut<'_, T>> {
        ParIter(rayon::slice::ParallelSliceMut::par_chunks_mut(self.as_parallel_slice_mut(), size))
    }

    fn par_chunk_by_mut<P>(&mut self, are_together: P) -> rayon::slice::ChunkByMut<'_, T, P>
    where
        P: Fn(&T, &T) -> bool + Send + Sync,
    {
        rayon::slice::ParallelSliceMut::par_chunk_by_mut(self.as_parallel_slice_mut(), are_together)
    }

    fn par_sort_unstable(&mut self)
    where
        T: Ord,
    {
        rayon::slice::ParallelSliceMut::par_sort_unstable(self.as_parallel_slice_mut());
    }

    fn par_sort_unstable_by<F>(&mut self, compare: F)
    where
        F: Fn(&T, &T) -> std::cmp::Ordering + Sync,
    {
        rayon::slice::ParallelSliceMut::par_sort_unstable_by(self.as_parallel_slice_mut(), compare);
    }

    fn par_sort_unstable_by_key<K, F>(&mut self, key: F)
    where
        K: Ord,
        F: Fn(&T) -> K + Sync,
    {
        rayon::slice::ParallelSliceMut::par_sort_unstable_by_key(self.as_parallel_slice_mut(), key);
    }
}

impl<T: Send> ParallelSliceMut<T> for [T] {
    fn as_parallel_slice_mut(&mut self) -> &mut [T] {
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use rayon::ThreadPoolBuilder;

    fn on<R: Send>(threads: usize, run: impl FnOnce() -> R + Send) -> R {
        ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(run)
    }

    #[test]
    fn items_come_in_order_on_any_number_of_threads() {
        for (threads, length) in [1, 2, 3, 8].into_iter().flat_map(|threads| [0, 1, 2, 1000].map(|n| (threads, n))) {
            let expected: Vec<usize> = (0..length).map(|i| i * i).collect();
            let found = on(threads, || {
                let squares: Vec<usize> = (0..length).into_par_iter().with_min_len(3).map(|i| i * i).collect();
                let rows: Vec<_> = squares.par_chunks(7).zip(squares.par_chunks(7)).enumerate().collect();
                assert!(
                    rows.iter().enumerate().all(|(i, &(row, (a, b)))| i == row && a == b && a[0] == squares[7 * i])
                );
                let mut copy = vec![0; length];
                copy.par_chunks_mut(5).zip(squares.par_chunks(5)).for_each(|(to, from)| to.copy_from_slice(from));
                assert_eq!(copy, squares);
                assert_eq!(squares.par_iter().filter(|&&square| square % 2 == 1).count(), length / 2);
                assert_eq!(squares.par_iter().position_first(|&square| square > 99), (length > 10).then_some(10));
                squares
            });
            assert_eq!(found, expected, "{threads} threads");
        }
    }

    #[test]
    fn no_piece_is_less_than_asked_for() {
        let pieces = AtomicUsize::new(0);
        let begin = || pieces.fetch_add(1, Ordering::Relaxed);
        on(4, || (0..1000_usize).into_par_iter().with_min_len(300).for_each_init(begin, |_, _| ()));
        // Halves of 500 would have quarters of 250.
        assert_eq!(pieces.into_inner(), 2);
    }

    #[test]
    fn one_thread_divides_work_as_rayon_does() {
        let pieces = |run: &(dyn Fn(&AtomicUsize) + Sync)| {
            let pieces = AtomicUsize::new(0);
            on(1, || run(&pieces));
            pieces.into_inner()
        };
        for length in [1, 2, 3, 100] {
            let own = pieces(&|count| {
                let begin = || count.fetch_add(1, Ordering::Relaxed);
                (0..length).into_par_iter().with_max_len(10).for_each_init(begin, |_, _: usize| ());
            });
            let of_rayon = pieces(&|count| {
                let begin = || count.fetch_add(1, Ordering::Relaxed);
                let all = rayon::iter::IntoParallelIterator::into_par_iter(0..length);
                all.with_max_len(10).for_each_init(begin, |_, _: usize| ());
            });
            assert_eq!(own, of_rayon, "{length} items");
        }
    }

    #[test]
    fn pieces_that_another_thread_took_up_are_divided_again() {
        // By length, migrated, least and pieces: the pieces that are left, or none where nothing is divided.
        let cases = [
            (8, false, 1, 0, None),
            (8, true, 1, 0, Some(4)),
            (8, false, 1, 3, Some(1)),
            (8, true, 1, 20, Some(10)),
            (9, true, 5, 4, None),
            (10, false, 5, 4, Some(2)),
        ];
        on(4, || {
            for (length, migrated, least, pieces, expected) in cases {
                let mut division = Division { least, pieces };
                let found = division.divides(length, migrated).then_some(division.pieces);
                assert_eq!(found, expected, "{length} {migrated} {least} {pieces}");
            }
        });
    }

    #[test]
    fn both_results_of_a_join_come_back_and_panics_do_too() {
        let (a, b) = on(2, || join(|| vec![1], || "b".to_owned()));
        assert_eq!((a, b.as_str()), (vec![1], "b"));
        let caught = std::panic::catch_unwind(|| on(2, || join(|| 1, || panic!("of b")).0));
        assert_eq!(caught.unwrap_err().downcast_ref::<&str>(), Some(&"of b"));
        let each = || (0..100_u32).into_par_iter().for_each(|i| assert_ne!(i, 70));
        assert!(std::panic::catch_unwind(|| on(2, each)).is_err());
    }
}
