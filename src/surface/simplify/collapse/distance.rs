//! The distance between the triangles that a collapse would make and the original.
//!
//! Every triangle has an error: a bound of its distance, in either direction, from the part of the original that it stands for. A
//! collapse adds to it the distance between the triangles before and after ([`Fan`]), which costs little and holds everywhere. Where
//! the sum exceeds the bound, the distance is measured: points of the original are its samples, each in the list of a
//! triangle that is within its error of the sample, and new triangles are measured from the original at points of their own
//! ([`Original`]). Their error is then the whole bound.
//!
//! Where a collapse needs no measurement, the lists of the triangles are moved as a whole. They are *stale* then: before samples are
//! measured nearby, each goes from triangle to neighbour as long as that is nearer. So samples of parts that are nearly flat, where
//! most collapses happen, are seldom looked at.

use std::ops::Deref;

use glam::DVec3;

use super::super::face::Face;
#[cfg(doc)]
use super::super::fan::Fan;
use super::super::original::Original;
use super::{Collapser, Scratch};
use crate::cancel::checkpoint;
use crate::closest::squared_distance;

/// Triangles are refused without a measurement where the difference in height is more than this number of times the largest
/// distance. The ratio is 1 / cos of the angle from the mean normal of a few triangles, which is seldom more than 60°.
const STEEP: f64 = 2.0;

/// The number of triangles through which the one over a sample is looked for.
const WALK: usize = 32;

impl Collapser<'_> {
    /// Finds the errors of the new triangles by those of the old ones and the difference of both, and which triangles must be
    /// measured. Returns false where they are too far away for that.
    pub(super) fn adds_up(&self, [from, into]: [u32; 2], scratch: &mut Scratch) -> bool {
        let Scratch { fan, faces, old_errors, errors, is_measured, measured, .. } = scratch;
        old_errors.clear();
        errors.clear();
        measured.clear();
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
            if error + difference > self.flat {
                measured.push(number);
            }
        }
        if can_compare {
            errors.extend(fan.errors(old_errors).map(|error| error.min(self.bound)));
        } else {
            errors.resize(faces.len(), self.bound);
        }
        *is_measured = old_errors.contains(&f64::INFINITY);
        true
    }

    /// Returns whether the samples of the old triangles are near the new ones, and assigns them to these.
    pub(super) fn keeps_samples(&mut self, ends: [u32; 2], scratch: &mut Scratch) -> bool {
        // Samples that change triangles raise errors, so that these are added up again.
        if self.refresh_from(self.around[ends[0] as usize].to_vec()) && !self.adds_up(ends, scratch) {
            return false;
        }
        scratch.moved.clear();
        scratch.distance = 0.0;
        self.are_samples_near(scratch)
    }

    /// Returns whether the new triangles are near the original.
    pub(super) fn is_near(&self, into: u32, original: &impl Deref<Target = Original>, scratch: &mut Scratch) -> bool {
        let Scratch { faces, errors, distance: largest, .. } = scratch;
        let mut uncertain = faces.iter().zip(errors).filter(|(_, error)| **error >= self.bound);
        uncertain.all(|((_, face), _)| {
            let distance = original.distance(face, into);
            *largest = largest.max(distance.unwrap_or(0.0));
            distance.is_some()
        })
    }

    /// Measures the samples of old triangles from the new ones, and assigns them to these.
    fn are_samples_near(&mut self, scratch: &mut Scratch) -> bool {
        let Scratch { measured, faces, errors, moved, distance, .. } = scratch;
        let is_far = |sample: u32| nearest(faces, self.samples.points[sample as usize], self.bound).is_none();
        if measured.iter().filter_map(|&number| self.samples.of(number).next()).any(is_far) {
            return false;
        }
        for &number in &*measured {
            checkpoint();
            let far = self.samples.of(number).find(|&sample| {
                let nearest = nearest(faces, self.samples.points[sample as usize], self.bound);
                if let Some((squared, i)) = nearest {
                    errors[i] = errors[i].max(squared.sqrt());
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

    /// Assigns the samples of triangles that are stale, and of all stale ones connected with them, to those that they are near.
    /// Returns whether there were any.
    pub(super) fn refresh_from(&mut self, mut open: Vec<u32>) -> bool {
        open.retain(|&number| self.samples.is_stale(number));
        let were_any = !open.is_empty();
        while let Some(number) = open.pop() {
            if self.samples.is_stale(number) {
                checkpoint();
                self.refresh(number);
                let beyond = self.sides(number).filter_map(|side| self.beyond(number, side));
                open.extend(beyond.filter(|&other| self.samples.is_stale(other)));
            }
        }
        were_any
    }

    /// Assigns the samples of a triangle to those that they are near.
    fn refresh(&mut self, number: u32) {
        let start = Face::new(self.corners(number));
        let mut next = self.samples.take(number);
        while let Some(sample) = next {
            next = self.samples.after(sample);
            let point = self.samples.points[sample as usize];
            let above = start.squared_height(point).filter(|&squared| squared <= self.bound * self.bound);
            let (squared, home) = above.map_or_else(|| self.home(point, number), |squared| (squared, number));
            self.samples.add(home, sample);
            let error = &mut self.errors[home as usize];
            *error = error.max(squared.sqrt());
            // Errors that are the whole bound are no distances that were found.
            self.distance = self.distance.max(squared.sqrt());
        }
    }

    /// Returns a triangle near a point and the square of its distance, found from one nearby.
    fn home(&self, point: DVec3, start: u32) -> (f64, u32) {
        self.over(point, start).unwrap_or_else(|| self.nearer(point, start))
    }

    /// Goes from a triangle to the neighbour beyond the side beyond which a point lies, until it lies over one within the bound.
    fn over(&self, point: DVec3, start: u32) -> Option<(f64, u32)> {
        let mut triangle = start;
        for _ in 0..WALK {
            match Face::new(self.corners(triangle)).height_or_side(point) {
                Ok(squared) => return (squared <= self.bound * self.bound).then_some((squared, triangle)),
                Err(side) => triangle = self.beyond(triangle, self.sides(triangle).nth(side)?)?,
            }
        }
        None
    }

    /// Goes from a triangle to neighbours that are nearer to a point.
    fn nearer(&self, point: DVec3, start: u32) -> (f64, u32) {
        let distance = |triangle: u32| (squared_distance(point, self.corners(triangle)), triangle);
        let least = |one: &(f64, u32), other: &(f64, u32)| one.0.total_cmp(&other.0);
        let mut best = distance(start);
        loop {
            let is_nearer = |other: &(f64, u32)| other.0 < best.0;
            let beyond = self.sides(best.1).filter_map(|side| self.beyond(best.1, side));
            let mut nearer = beyond.map(distance).filter(is_nearer).min_by(least);
            if nearer.is_none() {
                // All that have the nearest corner may be equally far.
                let corners = self.triangles[best.1 as usize].into_iter();
                let around = corners.flat_map(|corner| &self.around[corner as usize]);
                nearer = around.map(|&other| distance(other)).filter(is_nearer).min_by(least);
            }
            match nearer {
                Some(nearer) => best = nearer,
                None => break,
            }
        }
        if best.0 > self.bound * self.bound {
            // The way ended at a fold.
            best = self.left().map(distance).min_by(least).unwrap_or(best);
        }
        best
    }

    /// Returns the sides of a triangle.
    fn sides(&self, triangle: u32) -> impl Iterator<Item = [u32; 2]> {
        let [a, b, c] = self.triangles[triangle as usize];
        [[a, b], [b, c], [c, a]].into_iter()
    }

    /// Returns the triangle beyond a side of a triangle.
    fn beyond(&self, triangle: u32, [a, b]: [u32; 2]) -> Option<u32> {
        let has = |other: &u32| *other != triangle && self.triangles[*other as usize].contains(&b);
        self.around[a as usize].iter().copied().find(has)
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
