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
    /// For each triangle, whether its points are known to be near it; otherwise they are near a triangle close by.
    is_settled: Vec<bool>,
}

impl<'a> Samples<'a> {
    /// Creates the lists of `count` triangles, with the triangle of each point.
    pub fn new(points: &'a [DVec3], homes: &[u32], count: usize) -> Samples<'a> {
        let next = vec![NONE; points.len()];
        let mut samples = Samples { points, ends: vec![[NONE; 2]; count], next, is_settled: vec![true; count] };
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
            let ends = &mut self.ends[into as usize];
            self.next[last as usize] = ends[0];
            *ends = [first, if ends[0] == NONE { last } else { ends[1] }];
        }
    }

    /// Returns whether the points of a triangle are known to be near it.
    pub fn is_settled(&self, triangle: u32) -> bool {
        self.is_settled[triangle as usize]
    }

    /// Empties the list of a triangle, which is settled from now on, and returns its first point.
    pub fn settle(&mut self, triangle: u32) -> Option<u32> {
        self.is_settled[triangle as usize] = true;
        let [first, _] = std::mem::replace(&mut self.ends[triangle as usize], [NONE; 2]);
        some(first)
    }

    /// Returns the point after another one in its list.
    pub fn after(&self, sample: u32) -> Option<u32> {
        some(self.next[sample as usize])
    }

    /// Notes that points of a triangle may be nearer to one close by.
    pub fn unsettle(&mut self, triangle: u32) {
        self.is_settled[triangle as usize] = false;
    }

    /// Removes the points of a triangle.
    pub fn clear(&mut self, triangle: u32) {
        self.ends[triangle as usize] = [NONE; 2];
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
