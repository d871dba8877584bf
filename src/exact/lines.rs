//! Lines along an axis through faces of a body, and its own winding numbers in front of these, counted with exact signs.

use std::sync::atomic::{AtomicI32, Ordering};

use crate::parallel::*;
use glam::{DVec2, DVec3, Vec3Swizzles};

use super::bodies::{Bodies, Body, SCALE};
use super::signs::{Plane, Vertex, is_left_of};
use crate::cancel::checkpoint;

/// The body of a line, which is displaced beyond all others.
const LINE: u32 = u32::MAX;

/// A coordinate beyond the lattice.
const BEYOND: f64 = 1.0 / SCALE + 1.0;

/// A line along an axis through a face, from one side of the lattice to the other.
pub(super) struct Line<'b> {
    /// The number of the face within its body.
    pub face: u32,
    plane: Plane<'b>,
    ends: [Vertex<'b>; 2],
    /// True if the first end is in front of the face.
    enters: bool,
}

impl<'b> Line<'b> {
    /// Returns a line along x through a point of the lattice in a face, if there is one near its centroid.
    fn through(face: u32, plane: Plane<'b>) -> Option<Line<'b>> {
        let [a, b, c] = plane.positions();
        let middle = ((a + b + c) / 3.0).round();
        let ends = [-BEYOND, BEYOND].map(|x| Vertex::still(DVec3::new(x, middle.y, middle.z), LINE));
        crosses(&plane, &ends[0]).then(|| Line { face, ends, enters: plane.is_in_front(&ends[0]), plane })
    }

    /// Returns a point of the line.
    fn point(&self) -> DVec3 {
        self.ends[0].at
    }

    /// Returns by how much the winding number grows at a face if the line crosses that before its own.
    fn change(&self, plane: &Plane) -> i32 {
        let enters = plane.is_in_front(&self.ends[0]);
        // The line starts in front of a face that it enters.
        let is_later = plane.has_crossing_in_front(self.ends.each_ref(), &self.plane, self.enters) == enters;
        match (is_later, enters) {
            (true, _) => 0,
            (false, true) => 1,
            (false, false) => -1,
        }
    }
}

/// Returns whether the line along x through a point crosses a face.
fn crosses(plane: &Plane, point: &Vertex) -> bool {
    let [a, b, c] = &plane.corners;
    let [first, second, third] = [[a, b], [b, c], [c, a]].map(|side| is_left_of(point, side));
    first == second && second == third
}

/// A body with the coordinates brought forward, so that another axis is the first.
pub(super) struct Turned<'b> {
    bodies: &'b Bodies,
    own: u32,
    turns: usize,
}

/// Returns a body seen along each of the axes.
pub(super) fn seen_along_axes(bodies: &Bodies, own: usize) -> [Turned<'_>; 3] {
    [0, 1, 2].map(|turns| Turned { bodies, own: own as u32, turns })
}

impl Turned<'_> {
    fn body(&self) -> &Body {
        &self.bodies.bodies[self.own as usize]
    }

    /// Returns the corners of a face by its number within the body.
    fn corners(&self, face: u32) -> [DVec3; 3] {
        self.bodies.corners(self.body().faces.start + face).map(|point| self.turned(point))
    }

    fn turned(&self, point: DVec3) -> DVec3 {
        match self.turns {
            0 => point,
            1 => DVec3::new(point.y, point.z, point.x),
            _ => DVec3::new(point.z, point.x, point.y),
        }
    }

    /// Returns the plane of a face, which does not grow.
    fn plane(&self, face: u32) -> Plane<'static> {
        Plane::new(self.corners(face).map(|corner| Vertex::still(corner, self.own)))
    }

    /// Returns twice the area of a face's projection along the axis in which that is largest, and that axis.
    pub fn widest(&self, face: u32) -> (f64, usize) {
        let [a, b, c] = self.corners(face);
        let projections = (b - a).cross(c - a).abs();
        let axis = projections.max_position();
        (projections[axis], axis)
    }

    /// Returns a line along the axis through a face, if there is one near its centroid.
    pub fn line(&self, face: u32) -> Option<Line<'static>> {
        Line::through(face, self.plane(face))
    }

    /// Returns the winding number in front of the face of each line, with the face.
    pub fn fronts(&self, mut lines: Vec<Line<'_>>) -> impl Iterator<Item = (u32, i32)> {
        lines.sort_unstable_by(|a, b| a.point().y.total_cmp(&b.point().y).then(a.face.cmp(&b.face)));
        let numbers: Vec<AtomicI32> = lines.iter().map(|_| AtomicI32::new(0)).collect();
        let places: Vec<DVec2> = lines.iter().map(|line| line.point().yz()).collect();
        self.bodies.runs(self.body()).for_each(|(extent, faces)| {
            // Most runs are beside all lines.
            if within(&places, extent.corners().map(|corner| self.turned(corner).yz())).next().is_none() {
                return;
            }
            checkpoint();
            for face in faces.map(|face| face - self.body().faces.start) {
                let [a, b, c] = self.corners(face).map(DVec3::yz);
                for i in within(&places, [a.min(b).min(c), a.max(b).max(c)]) {
                    let change = self.change(&lines[i], face);
                    if change != 0 {
                        numbers[i].fetch_add(change, Ordering::Relaxed);
                    }
                }
            }
        });
        // The count ends before the face: behind it if the line leaves there.
        let in_front = |line: Line, number: AtomicI32| (line.face, number.into_inner() - i32::from(!line.enters));
        lines.into_iter().zip(numbers).map(move |(line, number)| in_front(line, number))
    }

    /// Returns by how much the winding number changes where a line crosses a face before its own.
    fn change(&self, line: &Line, face: u32) -> i32 {
        let plane = self.plane(face);
        if face != line.face && crosses(&plane, &line.ends[0]) { line.change(&plane) } else { 0 }
    }
}

/// Returns the numbers of the places in a box, where places are in the order of their first coordinates.
fn within(places: &[DVec2], [min, max]: [DVec2; 2]) -> impl Iterator<Item = usize> {
    let start = places.partition_point(|place| place.x < min.x);
    let numbered = (start..).zip(&places[start..]).take_while(move |(_, place)| place.x <= max.x);
    numbered.filter(move |(_, place)| (min.y..=max.y).contains(&place.y)).map(|(number, _)| number)
}
