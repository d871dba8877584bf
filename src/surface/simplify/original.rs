//! The part of the original that new triangles must be near.

use glam::DVec3;

use super::collapse::NONE;
use super::face::{Face, side_beyond};
use crate::closest::{Closest, ClosestTriangle};

/// The share of the bound that is left for what is farther away between the points inside a triangle.
const BETWEEN: f64 = 0.1;

/// Most parts into which a side of the original is divided by samples.
const MOST_PARTS: f64 = 16.0;

/// Most parts into which a triangle's first side is divided at first, and how often each of them may be halved.
const MOST_STEPS: f64 = 64.0;
const HALVINGS: u32 = 6;

/// Most parts into which its longest side is divided by the raster of samples inside.
const INNER_PARTS: f64 = 4.0;

/// Least cosine of the angle, 75°, between a new triangle and one of the original near it. One collapse turns a triangle by less,
/// but several together may turn it farther.
const LIKE: f64 = 0.25;

/// Most sides through which the triangle under a point is looked for.
const WALK: usize = 16;

/// Triangles of the original, or within a small distance of it, from which distances are measured. They are numbered in the order of
/// the tree, in which triangles with numbers nearby are near one another.
pub(super) struct Original {
    tree: Option<ClosestTriangle>,
    /// For each triangle one beyond each of its sides, or `NONE` at the border.
    beyond: Vec<[u32; 3]>,
    /// For each vertex of the patch a triangle that has it, or `NONE`.
    at: Vec<u32>,
    /// The distance between samples.
    spacing: f64,
    /// The largest distance from these triangles, and the distance of these from the original.
    bound: f64,
    flat: f64,
}

impl Original {
    /// Creates it from triangles whose distance from the original is at most `flat`, itself less than the bound: `own` ones of a patch,
    /// by places in `vertices`, its sorted vertices, and `others`, by vertices.
    pub fn new(
        [own, others]: [&[[u32; 3]]; 2],
        vertices: &[u32],
        position: impl Fn(u32) -> DVec3,
        spacing: f64,
        [bound, flat]: [f64; 2],
    ) -> Original {
        let of_own = own.iter().map(|indices| indices.map(|place| vertices[place as usize]));
        let given: Vec<[u32; 3]> = of_own.chain(others.iter().copied()).collect();
        let corners: Vec<[DVec3; 3]> = given.iter().map(|indices| indices.map(&position)).collect();
        let tree = (!corners.is_empty()).then(|| ClosestTriangle::new(&corners));
        let order = tree.as_ref().map_or(&[][..], ClosestTriangle::indices);
        let mut at = vec![NONE; vertices.len()];
        for (number, &index) in (0..).zip(order) {
            let places = match own.get(index as usize) {
                Some(places) => places.map(Some),
                None => {
                    given[index as usize].map(|vertex| vertices.binary_search(&vertex).ok().map(|place| place as u32))
                }
            };
            places.into_iter().flatten().for_each(|place| at[place as usize] = number);
        }
        let ordered: Vec<[u32; 3]> = order.iter().map(|&index| given[index as usize]).collect();
        Original { tree, beyond: triangles_beyond_sides(&ordered), at, spacing, bound: bound - flat, flat }
    }

    /// Returns a bound of the distance of a triangle along its first side, of which both ends are vertices of the patch, and from
    /// points inside. `None` if it is more than the bound, or if the original does not face as the triangle does at the centroid.
    ///
    /// Of the triangles around a new vertex, each begins with it, so that the last side is the first of the next; the side between
    /// is old.
    pub fn distance(&self, face: &Face, ends: [u32; 2]) -> Option<f64> {
        let tree = self.tree.as_ref()?;
        let [a, b, c] = face.corners;
        let faces_like = |[a, b, c]: [DVec3; 3]| {
            let normal = (b - a).cross(c - a);
            normal.dot(face.normal) >= LIKE * normal.length()
        };
        let inner = ((1.0 - BETWEEN) * self.bound).powi(2);
        let start = self.at_vertex(tree, ends[0], a)?;
        let centroid = self.near(tree, (a + b + c) / 3.0, start.triangle, inner, faces_like)?;
        let mut largest = centroid.squared.max(self.squared_along(tree, start, ends[1], b)?);
        for point in inside(face.corners, self.spacing) {
            largest = largest.max(self.near(tree, point, centroid.triangle, inner, |_| true)?.squared);
        }
        Some(largest.sqrt() + self.flat)
    }

    /// Returns a bound of the square of the distance along a side, from a point near a triangle to a vertex of the patch. `None` if it
    /// is more than the bound.
    ///
    /// It holds at every point: the distance from one triangle, which is convex, is largest at an end of a part of the side, so
    /// that two ends within the bound of the same triangle are enough for all between.
    fn squared_along(&self, tree: &ClosestTriangle, mut start: Close, vertex: u32, b: DVec3) -> Option<f64> {
        let a = start.point;
        let count = (a.distance(b) / self.spacing).ceil().clamp(1.0, MOST_STEPS);
        let mut largest = start.squared;
        for i in 1..=count as u32 {
            let is_last = f64::from(i) == count;
            let point = if is_last { b } else { a.lerp(b, f64::from(i) / count) };
            let mut end = Close { point, squared: tree.squared_from(point, start.triangle), ..start };
            if end.squared > self.bound * self.bound {
                end = match is_last {
                    true => self.at_vertex(tree, vertex, b)?,
                    false => self.within(tree, point, start.triangle)?,
                };
                largest = largest.max(self.squared_between(tree, [start, end], HALVINGS)?);
            }
            largest = largest.max(end.squared);
            start = end;
        }
        Some(largest)
    }

    /// Returns a bound of the square of the distance between two points that are within the bound of different triangles, besides those
    /// of the points.
    fn squared_between(&self, tree: &ClosestTriangle, [start, end]: [Close; 2], halvings: u32) -> Option<f64> {
        let of_first = tree.squared_from(end.point, start.triangle);
        let of_last = tree.squared_from(start.point, end.triangle);
        let least = of_first.min(of_last);
        if least <= self.bound * self.bound {
            return Some(least);
        }
        let halvings = halvings.checked_sub(1)?;
        let middle = self.within(tree, 0.5 * (start.point + end.point), start.triangle)?;
        let halves = [[start, middle], [middle, end]].map(|half| self.squared_between(tree, half, halvings));
        Some(middle.squared.max(halves[0]?).max(halves[1]?))
    }

    /// Returns a vertex of the patch with a triangle that has it, or else with the closest one; `None` if that is farther than the
    /// bound.
    fn at_vertex(&self, tree: &ClosestTriangle, vertex: u32, point: DVec3) -> Option<Close> {
        match self.at[vertex as usize] {
            NONE => self.within(tree, point, NONE),
            triangle => Some(Close { point, squared: 0.0, triangle }),
        }
    }

    /// Returns a point with a triangle within the bound of it, or `None` if there is none.
    fn within(&self, tree: &ClosestTriangle, point: DVec3, start: u32) -> Option<Close> {
        self.near(tree, point, start, self.bound * self.bound, |_| true)
    }

    /// Returns a point with a triangle that has a property, and that is nearer than a limit, or `None` if there is none. The triangle
    /// that the way from a known one leads to is tried first; the closest one is searched for only if that is none.
    fn near(
        &self,
        tree: &ClosestTriangle,
        point: DVec3,
        start: u32,
        limit: f64,
        has: impl Fn([DVec3; 3]) -> bool,
    ) -> Option<Close> {
        if start != NONE {
            let triangle = self.under(tree, point, start);
            let squared = tree.squared_from(point, triangle);
            if squared < limit && has(tree.corners(triangle)) {
                return Some(Close { point, squared, triangle });
            }
        }
        let Closest { squared, hint: triangle } = tree.below(point, limit, has)?;
        Some(Close { point, squared, triangle })
    }

    /// Goes from a triangle through the side beyond which a point lies, again and again, and returns where that ends: at the triangle
    /// under the point, at one of two with the point beyond their common side, at the border, or after [`WALK`] sides.
    fn under(&self, tree: &ClosestTriangle, point: DVec3, start: u32) -> u32 {
        let (mut triangle, mut before) = (start, NONE);
        for _ in 0..WALK {
            let Some(side) = side_beyond(point, tree.corners(triangle)) else { break };
            let next = self.beyond[triangle as usize][side];
            if next == NONE || next == before {
                break;
            }
            (triangle, before) = (next, triangle);
        }
        triangle
    }
}

/// A point, and a triangle of the original that is within the bound of it.
#[derive(Clone, Copy)]
struct Close {
    point: DVec3,
    /// The square of the distance.
    squared: f64,
    triangle: u32,
}

/// Returns for each triangle and side, the one between its first two corners first, a triangle that has the side in the opposite
/// direction, or `NONE`.
fn triangles_beyond_sides(triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let of_triangle = |(number, &[a, b, c]): (u32, &[u32; 3])| {
        let sides = [[a, b], [b, c], [c, a]].into_iter().enumerate();
        sides.map(move |(side, [from, to])| ([from.min(to), from.max(to)], from > to, number, side))
    };
    let mut uses: Vec<([u32; 2], bool, u32, usize)> = (0..).zip(triangles).flat_map(of_triangle).collect();
    uses.sort_unstable();
    let mut beyond = vec![[NONE; 3]; triangles.len()];
    for shared in uses.chunk_by(|one, other| one.0 == other.0) {
        let (along, against) = shared.split_at(shared.partition_point(|(_, is_against, ..)| !is_against));
        for (uses, others) in [(along, against), (against, along)] {
            if let Some(&(_, _, other, _)) = others.first() {
                uses.iter().for_each(|&(_, _, triangle, side)| beyond[triangle as usize][side] = other);
            }
        }
    }
    beyond
}

/// Returns points between the ends of a side, about `spacing` apart, but at most 15.
pub(super) fn along([a, b]: [DVec3; 2], spacing: f64) -> impl Iterator<Item = DVec3> {
    let count = parts(a.distance(b), spacing, MOST_PARTS);
    (1..count).map(move |i| a.lerp(b, f64::from(i) / f64::from(count)))
}

/// Returns at most 3 points inside a triangle.
pub(super) fn inside([a, b, c]: [DVec3; 3], spacing: f64) -> impl Iterator<Item = DVec3> {
    let count = parts(a.distance(b).max(b.distance(c)).max(c.distance(a)), spacing, INNER_PARTS);
    let weights = (1..count).flat_map(move |i| (1..count - i).map(move |j| [i, j, count - i - j]));
    weights.map(move |weights| {
        let [u, v, w] = weights.map(|weight| f64::from(weight) / f64::from(count));
        a * u + b * v + c * w
    })
}

/// Returns the even number of parts into which a length is divided.
fn parts(length: f64, spacing: f64, most: f64) -> u32 {
    2 * (length / (2.0 * spacing)).ceil().clamp(1.0, most / 2.0) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random::Random;

    /// Number of cells along a side of a sheet.
    const SIDE: u32 = 12;

    /// Returns a sheet of two triangles a cell over a square of unit cells, whose corners have random heights.
    fn sheet(random: &mut Random) -> (Vec<[u32; 3]>, Vec<DVec3>) {
        let row = SIDE + 1;
        let heights: Vec<f64> = (0..row * row).map(|_| 0.6 * random.share()).collect();
        let places = (0..row * row).map(|at| DVec3::new((at % row).into(), (at / row).into(), heights[at as usize]));
        let cells = (0..SIDE * SIDE).map(|cell| cell / SIDE * row + cell % SIDE);
        let triangles = cells.flat_map(|at| [[at, at + 1, at + row], [at + 1, at + row + 1, at + row]]);
        (triangles.collect(), places.collect())
    }

    #[test]
    fn triangles_beyond_sides_have_them_in_the_opposite_direction() {
        let (mut triangles, _) = sheet(&mut Random::new(1));
        // Copies of some, which are no neighbours of what they are copies of.
        triangles.extend_from_within(40..60);
        let beyond = triangles_beyond_sides(&triangles);
        let mut open = 0;
        for (triangle, beyond) in triangles.iter().zip(&beyond) {
            for (side, &other) in beyond.iter().enumerate() {
                let [from, to] = [side, (side + 1) % 3].map(|end| triangle[end]);
                let has = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]].contains(&[to, from]);
                match other {
                    NONE => open += usize::from(!triangles.iter().any(|&triangle| has(triangle))),
                    _ => assert!(has(triangles[other as usize])),
                }
            }
        }
        assert_eq!(open, beyond.as_flattened().iter().filter(|other| **other == NONE).count());
        assert!(open >= 4 * SIDE as usize);
    }

    /// The way from a triangle often ends at one that is farther than the limit.
    #[test]
    fn points_are_near_where_any_triangle_is() {
        let mut random = Random::new(2);
        let (triangles, places) = sheet(&mut random);
        // The patch has every vertex of its own triangles, and some of the others'.
        let vertices: Vec<u32> = (0..places.len() as u32).filter(|vertex| *vertex < 80 || vertex % 3 == 0).collect();
        let has = |vertex: &u32| vertices.binary_search(vertex).is_ok();
        let is_own = |indices: &&[u32; 3]| indices.iter().all(|vertex| *vertex < 80);
        let place = |vertex: u32| vertices.binary_search(&vertex).unwrap() as u32;
        let own: Vec<[u32; 3]> = triangles.iter().filter(is_own).map(|indices| indices.map(place)).collect();
        let others: Vec<[u32; 3]> = triangles.iter().filter(|indices| !is_own(indices)).copied().collect();
        assert!(others.as_flattened().iter().any(|vertex| !has(vertex)));
        let original = Original::new([&own, &others], &vertices, |vertex| places[vertex as usize], 1.0, [0.1, 0.0]);
        let tree = original.tree.as_ref().unwrap();
        for (place, &vertex) in vertices.iter().enumerate() {
            assert!(tree.corners(original.at[place]).contains(&places[vertex as usize]));
        }
        let [mut near, mut far, mut under] = [0; 3];
        for _ in 0..4000 {
            let mut along = |length: f64| length * random.share();
            let point = DVec3::new(along(SIDE.into()), along(SIDE.into()), along(0.6));
            let (limit, start) = (along(0.04), random.below(triangles.len()) as u32);
            let least = tree.of(point, 0).squared;
            under += usize::from(side_beyond(point, tree.corners(original.under(tree, point, start))).is_none());
            match original.near(tree, point, start, limit, |_| true) {
                Some(found) => {
                    near += 1;
                    assert!(found.squared < limit && found.squared >= least - 1e-12);
                    assert_eq!(found.squared, tree.squared_from(point, found.triangle));
                }
                None => {
                    far += 1;
                    assert!(least >= limit - 1e-12);
                }
            }
        }
        assert!(near > 500 && far > 500 && under > 2000, "{near} near, {far} far, {under} under");
    }
}
