//! Points of the original, each in the list of a triangle.

use glam::DVec3;

use super::collapse::NONE;

/// Points in linked lists, one for each triangle.
pub(super) struct Samples<'a> {
    pub points: &'a [DVec3],
    /// The first and the last point of each triangle.
    ends: Vec<[u32; 2]>,
    /// The point after each.
    next: Vec<u32>,
    /// For each triangle, whether its points may be nearer to one close by than to it.
    is_stale: Vec<bool>,
}

impl<'a> Samples<'a> {
    /// Creates the lists of `count` triangles, with the triangle of each point.
    pub fn new(points: &'a [DVec3], homes: &[u32], count: usize) -> Samples<'a> {
        let next = vec![NONE; points.len()];
        let mut samples = Samples { points, ends: vec![[NONE; 2]; count], next, is_stale: vec![false; count] };
        (0..).zip(homes).for_each(|(sample, &home)| samples.add(home, sample));
        samples
    }

    /// Adds a point to the list of a triangle.
    pub fn add(&mut self, triangle: u32, sample: u32) {
        let ends = &mut self.ends[triangle as usize];
        self.next[sample as usize] = ends[0];
        *ends = [sample, if ends[0] == NONE { sample } else { ends[1] }];
    }

    /// Moves all points of a triangle to another one nearby.
    pub fn join(&mut self, from: u32, into: u32) {
        let [first, last] = std::mem::replace(&mut self.ends[from as usize], [NONE; 2]);
        if first != NONE {
            self.is_stale[into as usize] = true;
            let ends = &mut self.ends[into as usize];
            self.next[last as usize] = ends[0];
            *ends = [first, if ends[0] == NONE { last } else { ends[1] }];
        }
    }

    /// Returns whether points of a triangle may be nearer to one close by.
    pub fn is_stale(&self, triangle: u32) -> bool {
        self.is_stale[triangle as usize]
    }

    /// Notes that points of a triangle may be nearer to one close by.
    pub fn mark_stale(&mut self, triangle: u32) {
        self.is_stale[triangle as usize] = true;
    }

    /// Empties the list of a triangle, which is not stale any more, and returns its first point.
    pub fn take(&mut self, triangle: u32) -> Option<u32> {
        self.is_stale[triangle as usize] = false;
        let [first, _] = std::mem::replace(&mut self.ends[triangle as usize], [NONE; 2]);
        some(first)
    }

    /// Returns the point after another one in its list.
    pub fn after(&self, sample: u32) -> Option<u32> {
        some(self.next[sample as usize])
    }

    /// Makes a point the first one of its triangle.
    pub fn bring_forward(&mut self, triangle: u32, sample: u32) {
        let [first, last] = self.ends[triangle as usize];
        let before = self.of(triangle).find(|&other| self.next[other as usize] == sample);
        if let Some(before) = before {
            self.next[before as usize] = self.next[sample as usize];
            self.next[sample as usize] = first;
            self.ends[triangle as usize] = [sample, if last == sample { before } else { last }];
        }
    }

    /// Returns the points of a triangle.
    pub fn of(&self, triangle: u32) -> impl Iterator<Item = u32> {
        std::iter::successors(some(self.ends[triangle as usize][0]), |&sample| self.after(sample))
    }
}

fn some(sample: u32) -> Option<u32> {
    (sample != NONE).then_some(sample)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_hold_what_was_added_moved_and_removed() {
        let points = vec![DVec3::ZERO; 40];
        let homes: Vec<u32> = (0..40).map(|i| i * 7 % 5).collect();
        let mut samples = Samples::new(&points, &homes, 5);
        let mut expected: Vec<Vec<u32>> =
            (0..5).map(|t| (0..40).filter(|i| homes[*i as usize] == t).collect()).collect();
        let check = |samples: &Samples, expected: &[Vec<u32>]| {
            for (triangle, expected) in (0..).zip(expected) {
                let mut found: Vec<u32> = samples.of(triangle).collect();
                found.sort_unstable();
                assert_eq!(&found, expected, "{triangle}");
            }
        };
        check(&samples, &expected);
        for triangle in 0..5 {
            // The first, one in the middle, and the last.
            let listed: Vec<u32> = samples.of(triangle).collect();
            for sample in [listed[0], listed[3], listed[listed.len() - 1]] {
                samples.bring_forward(triangle, sample);
                assert_eq!(samples.of(triangle).next(), Some(sample));
                check(&samples, &expected);
            }
        }
        let moves = [(1, 2), (3, 1), (2, 3), (1, 3), (4, 1)];
        for (from, into) in moves {
            samples.join(from, into);
            let mut moved = std::mem::take(&mut expected[from as usize]);
            expected[into as usize].append(&mut moved);
            expected[into as usize].sort_unstable();
            check(&samples, &expected);
        }
        assert!(samples.is_stale(3) && !samples.is_stale(0));
        samples.take(0);
        expected[0].clear();
        let first = samples.take(3).unwrap();
        let taken: Vec<u32> = std::iter::successors(Some(first), |&sample| samples.after(sample)).collect();
        assert_eq!(taken.len(), expected[3].len());
        assert!(!samples.is_stale(3));
        taken.iter().for_each(|&sample| samples.add(4, sample));
        expected[4] = std::mem::take(&mut expected[3]);
        check(&samples, &expected);
    }
}
