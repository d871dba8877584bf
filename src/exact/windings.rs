//! The winding numbers of the solids at the points of every body.
//!
//! Along an edge, the winding number of another body changes by one at each crossing. So points that are connected by edges
//! without crossings have the same winding numbers, and crossings give the differences between these patches. One
//! point of each connected surface is located by a ray.

use std::ops::Range;

use crate::parallel::*;

use super::bodies::Bodies;
use super::crossings::{Crossing, Crossings};
use super::near::Near;
use super::signs::{Plane, Vertex, is_left_of};
use crate::box_tree::Box32;
use crate::cancel::checkpoint;
use crate::face_tree::FaceTree;
use crate::union_find::UnionFind;

/// The winding numbers of all solids on each patch, less those of the patch's own body.
pub(super) struct Windings {
    solids: usize,
    patch_of_point: Vec<u32>,
    /// The first point of each patch.
    first_points: Vec<u32>,
    numbers: Vec<i32>,
}

impl Windings {
    pub fn of(bodies: &Bodies, solids: usize, crossings: &Crossings, near: &[Option<Near>]) -> Windings {
        let (patch_of_point, first_points) = patches(bodies, crossings);
        let links = Links::of(crossings, &patch_of_point, first_points.len());
        let numbers = vec![0; solids * first_points.len()];
        let mut found = Windings { solids, patch_of_point, first_points, numbers };
        let mut rays = Rays { bodies, near, met: bodies.bodies.iter().map(|_| MetBody::default()).collect() };
        let mut is_known = vec![false; found.first_points.len()];
        for patch in 0..found.first_points.len() {
            if is_known[patch] {
                continue;
            }
            checkpoint();
            is_known[patch] = true;
            rays.locate(found.first_points[patch], &mut found.numbers[solids * patch..solids * (patch + 1)]);
            let mut pending = vec![patch];
            while let Some(from) = pending.pop() {
                for link in links.of_patch(from) {
                    let to = link.to as usize;
                    if is_known[to] {
                        continue;
                    }
                    is_known[to] = true;
                    pending.push(to);
                    found.numbers.copy_within(solids * from..solids * (from + 1), solids * to);
                    for crossing in crossings.along(link.edge) {
                        let solid = bodies.bodies[bodies.body_of_face(crossing.face) as usize].solid;
                        let change = if crossing.enters == link.is_upwards { 1 } else { -1 };
                        found.numbers[solids * to + solid] += change;
                    }
                }
            }
        }
        found
    }

    /// Returns the patch of a point.
    pub fn patch(&self, point: u32) -> u32 {
        self.patch_of_point[point as usize]
    }

    /// Returns the winding numbers of all solids at a point, without those of the point's own body.
    pub fn at(&self, point: u32) -> &[i32] {
        self.of_patch(self.patch(point))
    }

    /// Returns [`Windings::at`] of the points of a patch.
    pub fn of_patch(&self, patch: u32) -> &[i32] {
        let first = self.solids * patch as usize;
        &self.numbers[first..first + self.solids]
    }

    /// Returns the first point of each patch.
    pub fn first_points(&self) -> &[u32] {
        &self.first_points
    }
}

/// Returns the patch of each point, and the first point of each patch.
fn patches(bodies: &Bodies, crossings: &Crossings) -> (Vec<u32>, Vec<u32>) {
    let joined = UnionFind::new(bodies.points.len() as u32);
    (0..bodies.faces.len() as u32).into_par_iter().with_min_len(4096).for_each(|face| {
        let [a, b, c] = bodies.faces[face as usize];
        for (u, v) in [(a, b), (b, c), (c, a)] {
            if u < v && (!crossings.is_crossed(face) || crossings.range([u, v]).is_empty()) {
                joined.join(u, v);
            }
        }
    });
    let mut patch_of_point = joined.roots();
    let mut first_points = Vec::new();
    // The root is the first point of its set, so its number is known when another point needs it.
    for point in 0..patch_of_point.len() {
        let root = patch_of_point[point] as usize;
        patch_of_point[point] = if root == point {
            first_points.push(point as u32);
            first_points.len() as u32 - 1
        } else {
            patch_of_point[root]
        };
    }
    (patch_of_point, first_points)
}

/// A step from one patch to another, along an edge.
#[derive(Clone, Copy)]
struct Link {
    from: u32,
    to: u32,
    edge: [u32; 2],
    /// True if the step goes from the lower point of the edge to the higher.
    is_upwards: bool,
}

/// The links between patches, by the patch from which they lead.
struct Links {
    list: Vec<Link>,
    starts: Vec<u32>,
}

impl Links {
    fn of(crossings: &Crossings, patch_of_point: &[u32], patches: usize) -> Links {
        let edges = crossings.list().chunk_by(|a: &Crossing, b| a.edge == b.edge).map(|group| group[0].edge);
        let mut list: Vec<Link> = edges
            .flat_map(|edge| {
                let [from, to] = edge.map(|point| patch_of_point[point as usize]);
                [Link { from, to, edge, is_upwards: true }, Link { from: to, to: from, edge, is_upwards: false }]
            })
            .collect();
        list.par_sort_unstable_by_key(|link| (link.from, link.to, link.edge));
        list.dedup_by_key(|link| (link.from, link.to));
        let mut starts = vec![0; patches + 1];
        for link in &list {
            starts[link.from as usize + 1] += 1;
        }
        for patch in 0..patches {
            starts[patch + 1] += starts[patch];
        }
        Links { list, starts }
    }

    fn of_patch(&self, patch: usize) -> &[Link] {
        let range: Range<usize> = self.starts[patch] as usize..self.starts[patch + 1] as usize;
        &self.list[range]
    }
}

/// Rays along +x from points, through the bodies.
struct Rays<'b> {
    bodies: &'b Bodies,
    near: &'b [Option<Near>],
    met: Vec<MetBody>,
}

/// A body that rays meet.
#[derive(Default)]
struct MetBody {
    /// True if a ray has been tested against all faces; for one ray, that is faster than to sort them.
    was_met: bool,
    /// The sorted faces, for all further rays.
    faces: Option<FaceTree>,
}

impl Rays<'_> {
    /// Adds the winding numbers of all other bodies at a point.
    fn locate(&mut self, point: u32, numbers: &mut [i32]) {
        let bodies = self.bodies;
        let position = bodies.points[point as usize];
        let own = bodies.body_of_point(point) as usize;
        let vertex = Vertex::of(bodies, point, own as u32);
        let here = Box32::around([position]);
        for (index, body) in bodies.bodies.iter().enumerate() {
            if index == own || !body.extent.touches(&here) {
                continue;
            }
            let across = |face| winding(&bodies.plane(face), &vertex);
            let met = &mut self.met[index];
            let tree = match self.near[index].as_ref().and_then(Near::whole) {
                Some(tree) => Some(tree),
                None if met.was_met => Some(&*met.faces.get_or_insert_with(|| bodies.tree(body))),
                None => None,
            };
            met.was_met = true;
            numbers[body.solid] += match tree {
                Some(tree) => {
                    let mut sum = 0;
                    tree.ahead_of(position, |face| sum += across(face));
                    sum
                }
                None => {
                    let is_ahead = |face: &u32| bodies.extent(*face).is_ahead_of(position);
                    bodies.faces_in_runs(body, |run| run.is_ahead_of(position)).filter(is_ahead).map(across).sum()
                }
            };
        }
    }
}

/// Returns the contribution of a face to the winding number of its body at a point of another: 1 if the ray along x from the
/// point leaves the body through the face, −1 if it enters.
fn winding(plane: &Plane, point: &Vertex) -> i32 {
    let [a, b, c] = &plane.corners;
    let left = [[a, b], [b, c], [c, a]].map(|side| is_left_of(point, side));
    // Seen against the x axis, sides turn left around the point if the normal points to the observer.
    let is_leaving = match left {
        [true, true, true] => true,
        [false, false, false] => false,
        _ => return 0,
    };
    // The ray leaves through faces that have the point behind them.
    if plane.is_in_front(point) == is_leaving {
        return 0;
    }
    if is_leaving { 1 } else { -1 }
}
