//! The part of the original that new triangles must be near.

use glam::DVec3;

use super::collapse::NONE;
use super::face::{Base, Face, side_beyond};
use crate::box_tree::{Box32, in_order};
use crate::closest::{Closest, ClosestTriangle, squared_distance_from_segment};
use crate::parallel::*;

/// The share of the bound that is left for what is farther away between the points inside a triangle.
const BETWEEN: f64 = 0.1;

/// Most parts into which a side of the original is divided by samples.
const MOST_PARTS: f64 = 16.0;

/// Most parts into which its longest side is divided by the raster of samples inside.
const INNER_PARTS: f64 = 4.0;

/// Least cosine of the angle, 75°, between a new triangle and one of the original near it. One collapse turns a triangle by less,
/// but several together may turn it farther.
const LIKE: f64 = 0.25;

/// Triangles are in no order if those that follow one another are farther apart than this number of mean sides, in the mean.
const FAR: f64 = 16.0;

/// Most sides through which the triangle under a point is looked for.
const WALK: usize = 16;

/// How often a side is halved to find where it leaves the bound of a triangle.
const HALVINGS: usize = 12;

/// Most triangles over which a side passes. Around a vertex it may come back to the same.
const MOST_PASSED: usize = 1 << 12;

/// Triangles of the original, or within a small distance of it, from which distances are measured. Those with numbers nearby are near
/// one another.
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
        let (given, corners) =
            if is_in_order(&corners, spacing) { (given, corners) } else { ordered(&given, &corners) };
        let tree = (!corners.is_empty()).then(|| ClosestTriangle::of_neighbours(corners));
        let sides = Sides::new(given);
        let at = vertices.iter().map(|&vertex| sides.from(vertex).last().map_or(NONE, |(_, triangle)| triangle));
        Original { tree, at: at.collect(), beyond: sides.beyond(), spacing, bound: bound - flat, flat }
    }

    /// Returns a bound of the distance of a triangle along its first side, of which both ends are vertices of the patch, and from
    /// points inside. `None` if it is more than the bound, or if the original does not face as the triangle does at the centroid.
    ///
    /// `vertex` is the first corner's. Of the triangles around a new vertex, each begins with it, so that the last side is the first of
    /// the next; the side between is old.
    pub fn distance(&self, face: &Face, vertex: u32) -> Option<f64> {
        let tree = self.tree.as_ref()?;
        let [a, b, c] = face.corners;
        let faces_like = |[a, b, c]: [DVec3; 3]| {
            let normal = (b - a).cross(c - a);
            normal.dot(face.normal) >= LIKE * normal.length()
        };
        let inner = ((1.0 - BETWEEN) * self.bound).powi(2);
        let start = match self.at[vertex as usize] {
            NONE => self.near(tree, a, NONE, self.bound * self.bound, |_| true)?,
            triangle => Closest { squared: 0.0, hint: triangle },
        };
        let centroid = self.near(tree, (a + b + c) / 3.0, start.hint, inner, faces_like)?;
        let mut largest = centroid.squared.max(self.squared_along(tree, start, [a, b])?);
        for point in inside(face.corners, self.spacing) {
            largest = largest.max(self.near(tree, point, centroid.hint, inner, |_| true)?.squared);
        }
        Some(largest.sqrt() + self.flat)
    }

    /// Returns a bound of the square of the distance along a side from a point near a triangle. `None` if it is more than the bound, or
    /// if no way of at most [`MOST_PASSED`] triangles was found.
    ///
    /// It holds at every point: the way divides the side into parts, each of which has both ends within the distance of one triangle, and
    /// the distance from a triangle, which is convex, is largest at an end. The next triangle is the one beyond the side under
    /// which the new one passes, as long as that is near.
    fn squared_along(&self, tree: &ClosestTriangle, start: Closest, [a, b]: [DVec3; 2]) -> Option<f64> {
        let (along, limit) = (b - a, self.bound * self.bound);
        let (mut triangle, mut entry) = self.towards(tree, start.hint, [a, b]);
        let (mut largest, mut passed) = (start.squared, 0.0f64);
        for _ in 0..MOST_PASSED {
            let corners = tree.corners(triangle);
            if corners.contains(&b) {
                return Some(largest);
            }
            let base = Base::new(corners);
            let (at, rates) = (base.weights(a), base.rates(along));
            let exits = (0..3).filter(|&side| entry != Some(side) && rates[side] < 0.0);
            let least = |one: &(f64, usize), other: &(f64, usize)| one.0.total_cmp(&other.0);
            let exit = exits.map(|side| (at[side] / -rates[side], side)).min_by(least);
            let step = exit.filter(|(share, _)| *share < 1.0).map(|(share, side)| {
                let (end, common) = (passed.max(share), [corners[side], corners[(side + 1) % 3]]);
                // The distance from their common side is at least that from either.
                (self.beyond[triangle as usize][side], end, squared_distance_from_segment(a + along * end, common))
            });
            if let Some((next, end, squared)) = step.filter(|&(next, _, squared)| next != NONE && squared <= limit) {
                largest = largest.max(squared);
                entry = self.beyond[next as usize].iter().position(|&other| other == triangle);
                (triangle, passed) = (next, end);
                continue;
            }
            let squared = tree.squared_from(b, triangle);
            if squared <= limit {
                return Some(largest.max(squared));
            }
            let (at, other) = self.leave(tree, triangle, passed, [a, along])?;
            largest = largest.max(other.squared);
            (triangle, entry, passed) = (other.hint, None, at);
        }
        None
    }

    /// Finds where a side passes from a triangle to another than the one beyond, as it does below a sharp edge: where it leaves the
    /// bound of the triangle for good, to the triangle nearest there. Also returns the square of the distance of the farther one of both.
    /// `None` if it leaves it at once, or if no other triangle is within the bound.
    fn leave(
        &self,
        tree: &ClosestTriangle,
        triangle: u32,
        passed: f64,
        [a, along]: [DVec3; 2],
    ) -> Option<(f64, Closest)> {
        let (corners, limit) = (tree.corners(triangle), self.bound * self.bound);
        // The distance from a triangle is convex along a side: all between two near places are near.
        let (mut at, mut far) = (passed, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (at + far);
            let is_near = tree.squared_from(a + along * middle, triangle) <= limit;
            *(if is_near { &mut at } else { &mut far }) = middle;
        }
        if at == passed {
            return None;
        }
        let point = a + along * at;
        let other = tree.below(point, limit, |other| other != corners)?;
        Some((at, Closest { squared: other.squared.max(tree.squared_from(point, triangle)), ..other }))
    }

    /// Turns around the first end of a side, from a triangle that has it, to the one over which the side begins; also returns by which
    /// side of that triangle it does not go on, where it begins over an edge between two.
    fn towards(&self, tree: &ClosestTriangle, start: u32, [a, b]: [DVec3; 2]) -> (u32, Option<usize>) {
        let (mut triangle, mut before) = (start, NONE);
        for _ in 0..WALK {
            let corners = tree.corners(triangle);
            let Some(i) = corners.iter().position(|&corner| corner == a) else { break };
            let rates = Base::new(corners).rates(b - a);
            let beside = [i, (i + 2) % 3];
            let Some(&side) = beside.iter().find(|side| rates[**side] < 0.0) else {
                return (triangle, None);
            };
            let next = self.beyond[triangle as usize][side];
            if next == NONE {
                break;
            }
            if next == before {
                return (triangle, Some(side));
            }
            (triangle, before) = (next, triangle);
        }
        (start, None)
    }

    /// Returns a triangle that has a property and is nearer to a point than a limit, or `None` if there is none. The one that the way
    /// from a known triangle leads to is tried first; the closest one is searched for only if that is none.
    fn near(
        &self,
        tree: &ClosestTriangle,
        point: DVec3,
        start: u32,
        limit: f64,
        has: impl Fn([DVec3; 3]) -> bool,
    ) -> Option<Closest> {
        if start != NONE {
            let triangle = self.under(tree, point, start);
            let squared = tree.squared_from(point, triangle);
            if squared < limit && has(tree.corners(triangle)) {
                return Some(Closest { squared, hint: triangle });
            }
        }
        tree.below(point, limit, has)
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

/// Returns whether triangles that follow one another are near one another, as those of a contour are.
fn is_in_order(corners: &[[DVec3; 3]], spacing: f64) -> bool {
    let steps = corners.windows(2).map(|pair| pair[0][0].distance(pair[1][0]));
    steps.sum::<f64>() <= FAR * spacing * corners.len() as f64
}

/// Returns triangles, and their corners, in the order of a space-filling curve.
fn ordered(triangles: &[[u32; 3]], corners: &[[DVec3; 3]]) -> (Vec<[u32; 3]>, Vec<[DVec3; 3]>) {
    let whole = Box32::around(corners.as_flattened().iter().copied());
    let extents = (0..corners.len() as u32).into_par_iter().map(|i| (i, Box32::around(corners[i as usize])));
    in_order(&whole, extents).into_iter().map(|i| (triangles[i as usize], corners[i as usize])).unzip()
}

/// The sides of triangles, in lists of those that begin at a vertex or at few others.
struct Sides {
    triangles: Vec<[u32; 3]>,
    /// The first side of each list.
    firsts: Vec<u32>,
    /// The two ends of each side, and its triangle.
    all: Vec<[u32; 3]>,
}

impl Sides {
    fn new(triangles: Vec<[u32; 3]>) -> Sides {
        let mut sides = Sides { firsts: vec![0; triangles.len().next_power_of_two() + 1], all: Vec::new(), triangles };
        for &vertex in sides.triangles.as_flattened() {
            let list = sides.list(vertex);
            sides.firsts[list + 1] += 1;
        }
        (1..sides.firsts.len()).for_each(|list| sides.firsts[list] += sides.firsts[list - 1]);
        let mut next = sides.firsts.clone();
        sides.all = vec![[NONE; 3]; 3 * sides.triangles.len()];
        for (triangle, &[a, b, c]) in (0..).zip(&sides.triangles) {
            for [from, to] in [[a, b], [b, c], [c, a]] {
                let next = &mut next[sides.list(from)];
                sides.all[*next as usize] = [from, to, triangle];
                *next += 1;
            }
        }
        sides
    }

    /// Returns the list of the sides that begin at a vertex.
    fn list(&self, vertex: u32) -> usize {
        // Multiplied by the golden ratio, as numbers may have any stride.
        let mixed = u64::from(vertex.wrapping_mul(0x9e37_79b9));
        ((mixed * (self.firsts.len() - 1) as u64) >> 32) as usize
    }

    /// Returns the other end of each side that begins at a vertex, and its triangle, in the order of triangles.
    fn from(&self, vertex: u32) -> impl Iterator<Item = (u32, u32)> {
        let list = self.list(vertex);
        let sides = &self.all[self.firsts[list] as usize..self.firsts[list + 1] as usize];
        sides.iter().filter(move |side| side[0] == vertex).map(|&[_, to, triangle]| (to, triangle))
    }

    /// Returns for each triangle and side, the one between its first two corners first, a triangle that has the side in the opposite
    /// direction, or `NONE`.
    fn beyond(&self) -> Vec<[u32; 3]> {
        let of_side = |[a, b]: [u32; 2]| self.from(b).find(|(to, _)| *to == a).map_or(NONE, |(_, triangle)| triangle);
        self.triangles.iter().map(|&[a, b, c]| [[a, b], [b, c], [c, a]].map(of_side)).collect()
    }
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
        let beyond = Sides::new(triangles.clone()).beyond();
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
                    assert_eq!(found.squared, tree.squared_from(point, found.hint));
                }
                None => {
                    far += 1;
                    assert!(least >= limit - 1e-12);
                }
            }
        }
        assert!(near > 500 && far > 500 && under > 2000, "{near} near, {far} far, {under} under");
    }

    /// A sheet with a hole, of which some triangles are of a patch; sides from anywhere to anywhere.
    #[test]
    fn sides_are_as_near_at_every_point_as_the_walk_says() {
        let mut random = Random::new(8);
        let (mut triangles, places) = sheet(&mut random);
        triangles.drain(100..103);
        let vertices: Vec<u32> = (0..places.len() as u32).collect();
        let (own, others) = triangles.split_at(triangles.len() / 2);
        let bound = 0.3;
        let original = Original::new([own, others], &vertices, |vertex| places[vertex as usize], 1.0, [bound, 0.0]);
        let tree = original.tree.as_ref().unwrap();
        let [mut near, mut far, mut missed, mut loose] = [0; 4];
        for _ in 0..4000 {
            let ends = [(); 2].map(|()| random.below(places.len()));
            let [a, b] = ends.map(|end| places[end]);
            if a == b || a.distance(b) > 5.0 {
                continue;
            }
            let (a, start) = match random.below(4) {
                // Not from a vertex.
                0 => (a + DVec3::Z * 0.1, tree.of(a + DVec3::Z * 0.1, 0)),
                _ => (a, Closest { squared: 0.0, hint: original.at[ends[0]] }),
            };
            let found = original.squared_along(tree, start, [a, b]);
            let points = (0..=256).map(|i| a.lerp(b, f64::from(i) / 256.0));
            let largest = points.map(|point| tree.of(point, 0).squared).fold(0.0, f64::max).sqrt();
            match found {
                Some(found) => {
                    near += 1;
                    loose += usize::from(found.sqrt() > 1.5 * largest);
                    assert!(found.sqrt() <= bound && largest <= found.sqrt() + 1e-12, "{largest} {found}");
                }
                None if largest < 0.5 * bound => missed += 1,
                None => far += 1,
            }
        }
        assert!(near > 500 && far > 200 && missed < 20 && loose < near / 4, "{near} {far} {missed} {loose}");
    }
}
