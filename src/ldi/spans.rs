//! The inside of one ray as half-open intervals.

/// The non-empty intervals `[start, end)` of one ray, touching ones merged, in ascending order.
///
/// An image may hold intervals of zero length (two coincident faces) and touching ones (a face between two shells); as
/// point sets these are empty and one interval. Only this type normalises them.
#[derive(Clone, Debug)]
pub struct Spans<'a> {
    samples: &'a [i32],
}

impl<'a> Spans<'a> {
    /// Returns the spans of a ray's samples: an even number of non-decreasing depths.
    pub fn new(samples: &'a [i32]) -> Spans<'a> {
        Spans { samples }
    }
}

impl Iterator for Spans<'_> {
    type Item = (i32, i32);

    fn next(&mut self) -> Option<(i32, i32)> {
        loop {
            let [start, end, rest @ ..] = self.samples else { return None };
            self.samples = rest;
            let (start, mut end) = (*start, *end);
            while let [next_start, next_end, rest @ ..] = self.samples
                && *next_start == end
            {
                end = *next_end;
                self.samples = rest;
            }
            if start < end {
                return Some((start, end));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touching_intervals_merge_and_empty_ones_vanish() {
        let spans: Vec<_> = Spans::new(&[0, 2, 2, 4, 6, 6, 8, 10]).collect();
        assert_eq!(spans, [(0, 4), (8, 10)]);
        assert_eq!(Spans::new(&[6, 6, 6, 6]).count(), 0);
        assert_eq!(Spans::new(&[4, 4, 4, 8]).collect::<Vec<_>>(), [(4, 8)]);
    }
}
