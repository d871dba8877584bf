//! The distance between the triangles that a collapse would make and the original.
//!
//! Every triangle has an error: a bound of its distance, in either direction, from the part of the original that it stands for. A
//! collapse adds to it the distance between the triangles before and after ([`Fan`]), which costs little and holds everywhere. Where
//! the sum exceeds the bound, the distance is measured: removed vertices are the samples of the original, each in the list of a
//! triangle near it, and new triangles are measured from the original at points of their own ([`Original`]). Their error is then
//! the whole bound.
//!
//! Where a collapse needs no measurement, the lists of the triangles are moved as a whole and need to be *settled* before the next
//! one: each sample goes from triangle to neighbour as long as that is nearer. So nearly flat parts, where most collapses happen, never
//! look at their samples.

use std::ops::Deref;

use glam::DVec3;

use super::super::face::Face;
#[cfg(doc)]
use super::super::fan::Fan;
use super::super::original::Original;
use super::{Collapser, Scratch};
use crate::closest::squared_distance;

/// Least ratio of the height of a surface, seen along the mean normal of a few triangles, to the distance.
const STEEP: f64 = 2.0;

impl Collapser<'_> {
    /// Finds the error of the new triangles: by those of the old ones and the difference of both, or else by measuring.
    pub(super) fn keeps_distance(
        &mut self,
        [from, into]: [u32; 2],
        original: &impl Deref<Target = Original>,
        scratch: &mut Scratch,
    ) -> bool {
        let Scratch { fan, faces, old_errors, errors, measured, spared, moved, distance, .. } = scratch;
        old_errors.clear();
        errors.clear();
        measured.clear();
        spared.clear();
        moved.clear();
        *distance = 0.0;
        let around = &self.around[from as usize];
        let ends = around.iter().map(|&number| self.opposite(number, from));
        let can_compare = fan.compare(self.at(from), into, ends, |vertex| self.at(vertex));
        for (i, &number) in around.iter().enumerate() {
            let error = self.errors[number as usize];
            let difference = if can_compare { fan.difference(i) } else { f64::INFINITY };
            if can_compare && difference > STEEP * (self.bound + error) {
                return false;
            }
            let is_certain = error + difference <= self.bound;
            old_errors.push(if is_certain { error } else { f64::INFINITY });
            if error + difference <= self.flat { &mut *spared } else { &mut *measured }.push(number);
        }
        if can_compare {
            errors.extend(fan.errors(old_errors).map(|error| error.min(self.bound)));
        } else {
            errors.resize(faces.len(), self.bound);
        }
        scratch.is_measured = old_errors.contains(&f64::INFINITY);
        !scratch.is_measured || (self.are_near(scratch) && is_near(original, self.bound, scratch))
    }

    /// Measures the samples of triangles from the new ones, and assigns them to these.
    fn are_near(&mut self, scratch: &mut Scratch) -> bool {
        self.settle_from(scratch.measured.iter().chain(&scratch.spared).copied().collect());
        let Scratch { measured, faces, moved, distance, .. } = scratch;
        let is_far = |sample: u32| nearest(faces, self.samples.points[sample as usize], self.bound).is_none();
        if measured.iter().filter_map(|&number| self.samples.of(number).next()).any(is_far) {
            return false;
        }
        for &number in &*measured {
            let far = self.samples.of(number).find(|&sample| {
                let nearest = nearest(faces, self.samples.points[sample as usize], self.bound);
                if let Some((squared, i)) = nearest {
                    *distance = distance.max(squared.sqrt());
                    moved.push((sample, faces[i].0));
                }
                nearest.is_none()
            });
            if let Some(sample) = far {
                // It is likely to be far again.
                self.samples.bring_forward(number, sample);
                return false;
            }
        }
        true
    }

    /// Returns the triangle beyond a side of a triangle.
    fn beyond(&self, triangle: u32, [a, b]: [u32; 2]) -> Option<u32> {
        let has = |other: &u32| *other != triangle && self.triangles[*other as usize].contains(&b);
        self.around[a as usize].iter().copied().find(has)
    }

    /// Assigns the samples of triangles, and of all that are connected with them and not settled, to those that they are near.
    pub(super) fn settle_from(&mut self, mut open: Vec<u32>) {
        open.retain(|&number| !self.samples.is_settled(number));
        while let Some(number) = open.pop() {
            if !self.samples.is_settled(number) {
                self.settle(number);
                let [a, b, c] = self.triangles[number as usize];
                let beyond = [[a, b], [b, c], [c, a]].into_iter().filter_map(|side| self.beyond(number, side));
                open.extend(beyond.filter(|&other| !self.samples.is_settled(other)));
            }
        }
    }

    /// Assigns the samples of a triangle to those that they are near.
    pub(super) fn settle(&mut self, number: u32) {
        let start = Face::new(self.corners(number));
        let mut sample = self.samples.settle(number);
        while let Some((place, next)) = sample.map(|sample| (sample, self.samples.after(sample))) {
            let point = self.samples.points[place as usize];
            let home = if start.squared_height(point).is_some() { number } else { self.home(point, number) };
            self.samples.add(home, place);
            sample = next;
        }
    }

    /// Returns a triangle near a point, found from one nearby by going to neighbours that are nearer.
    fn home(&self, point: DVec3, start: u32) -> u32 {
        let distance = |triangle: u32| (squared_distance(point, self.corners(triangle)), triangle);
        let least = |one: &(f64, u32), other: &(f64, u32)| one.0.total_cmp(&other.0);
        let mut best = distance(start);
        loop {
            let [a, b, c] = self.triangles[best.1 as usize];
            let beyond = [[a, b], [b, c], [c, a]].into_iter().filter_map(|side| self.beyond(best.1, side));
            match beyond.map(distance).filter(|other| other.0 < best.0).min_by(least) {
                Some(nearer) => best = nearer,
                None => break,
            }
        }
        if best.0 > self.bound * self.bound {
            // The way ended at a fold.
            best = self.left().map(distance).min_by(least).unwrap_or(best);
        }
        best.1
    }
}

/// Returns the square of the distance of a point from the nearest of some triangles, and its place among these, if it is within a
/// bound.
fn nearest(faces: &[(u32, Face)], point: DVec3, bound: f64) -> Option<(f64, usize)> {
    let squared_bound = bound * bound;
    let closest =
        |distances: &mut dyn Iterator<Item = (f64, usize)>| distances.min_by(|one, other| one.0.total_cmp(&other.0));
    let numbered = || faces.iter().enumerate();
    // Nearly every point lies above the inside of a triangle.
    let above = closest(&mut numbered().filter_map(|(i, (_, face))| Some((face.squared_height(point)?, i))));
    let is_within = |found: &(f64, usize)| found.0 <= squared_bound;
    let around = || closest(&mut numbered().map(|(i, (_, face))| (face.squared_distance(point), i)));
    above.filter(is_within).or_else(|| around().filter(is_within))
}

/// Measures the new triangles from the original where their errors are not certain.
fn is_near(original: &Original, bound: f64, scratch: &mut Scratch) -> bool {
    for ((_, face), _) in scratch.faces.iter().zip(&scratch.errors).filter(|(_, error)| **error >= bound) {
        let Some(distance) = original.distance(face) else { return false };
        scratch.distance = scratch.distance.max(distance);
    }
    true
}
