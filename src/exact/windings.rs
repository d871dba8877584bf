//! The winding numbers of the solids at the points of every body.
//!
//! Along an edge, the winding number of another body changes by one at each crossing. So points that are connected by edges
//! without crossings have the same winding numbers, and crossings give the differences between these patches. One
//! point of each connected surface is located by a ray. The own number of a body that meets itself is
//! known at its outermost point, and changes at the crossings of its edges with its faces in the same way.

use std::ops::Range;

use crate::parallel::*;

use super::bodies::Bodies;
use super::crossings::{Crossing, Crossings};
use super::near::Near;
use super::signs::{Plane, Vertex, is_left_of};
use super::stars::{Stars, Turn, outermost};
use crate::box_tree::Box32;
use crate::cancel::checkpoint;
use crate::face_tree::FaceTree;
use crate::union_find::UnionFind;

/// The winding numbers of all solids on each patch, less `Body::front` of the patch's own body.
pub(super) struct Windings {
    solids: usize,
    stars: Stars,
    /// The patch of each sector.
    patch_of_sector: Vec<u32>,
    /// The first sector of each patch.
    first_sectors: Vec<u32>,
    numbers: Vec<i32>,
}

impl Windings {
    /// Finds the winding numbers.
    pub fn of(
        bodies: &Bodies,
        solids: usize,
        (crossings, stars): (&Crossings, Stars),
        near: &[Option<Near>],
    ) -> Windings {
        let (patch_of_sector, first_sectors) = patches(bodies, crossings, &stars);
        let patches = first_sectors.len();
        let links = Links::of(crossings, &stars, &patch_of_sector, patches);
        let mut found = Windings { solids, stars, patch_of_sector, first_sectors, numbers: vec![0; solids * patches] };
        let mut rays = Rays { bodies, near, met: bodies.bodies.iter().map(|_| MetBody::default()).collect() };
        let mut is_known = vec![false; patches];
        let all = &bodies.bodies;
        let crossed = all.iter().enumerate().filter(|(_, body)| body.is_crossed);
        let (has_crossed, mut arriving) = (crossed.clone().next().is_some(), vec![0; solids]);
        let of_crossed = crossed.map(|(own, body)| {
            let (edge, number) = outermost(own, bodies);
            (found.patch(edge) as usize, number - body.front)
        });
        let others = (0..patches).map(|patch| (patch, 0));
        let starts: Vec<(usize, i32)> = of_crossed.chain(others).collect();
        for (patch, own_number) in starts {
            if std::mem::replace(&mut is_known[patch], true) {
                continue;
            }
            checkpoint();
            let point = found.point_of(patch as u32);
            let numbers = &mut found.numbers[solids * patch..solids * (patch + 1)];
            rays.locate(point, numbers);
            numbers[all[bodies.body_of_point(point) as usize].solid] += own_number;
            let mut pending = vec![patch];
            while let Some(from) = pending.pop() {
                for link in links.of_patch(from) {
                    let to = link.to as usize;
                    let is_first = !std::mem::replace(&mut is_known[to], true);
                    if !is_first && !has_crossed {
                        continue;
                    }
                    arriving.copy_from_slice(found.of_patch(from as u32));
                    match link.way {
                        Way::Along { edge, is_upwards } => {
                            for crossing in crossings.along(edge) {
                                let is_entered = crossing.enters == is_upwards;
                                arriving[bodies.solid_of_face(crossing.face)] += if is_entered { 1 } else { -1 };
                            }
                        }
                        Way::Around { solid, change } => arriving[solid] += change,
                    }
                    if is_first {
                        found.numbers[solids * to..solids * (to + 1)].copy_from_slice(&arriving);
                        pending.push(to);
                    } else if found.of_patch(link.to) != arriving {
                        // No surface has such numbers; they would be of one that touches itself still.
                        bodies.note_touching(found.point_of(link.to));
                    }
                }
            }
        }
        found
    }

    /// Returns the patch from which an edge starts.
    #[inline]
    pub fn patch(&self, edge: [u32; 2]) -> u32 {
        self.patch_of_sector[self.stars.sector(edge) as usize]
    }

    /// Returns the winding numbers of all solids in front of the faces at the start of an edge, less `Body::front` of its body.
    pub fn at(&self, edge: [u32; 2]) -> &[i32] {
        self.of_patch(self.patch(edge))
    }

    /// Returns [`Windings::at`] of the edges that start in a patch.
    pub fn of_patch(&self, patch: u32) -> &[i32] {
        let first = self.solids * patch as usize;
        &self.numbers[first..first + self.solids]
    }

    /// Returns the number of patches.
    pub fn patches(&self) -> u32 {
        self.first_sectors.len() as u32
    }

    /// Returns the patches that begin with one of some points; all patches of a body that does not meet itself do.
    pub fn patches_from(&self, points: &Range<u32>) -> Range<u32> {
        let before = |point: u32| self.first_sectors.partition_point(|&sector| sector < point) as u32;
        before(points.start)..before(points.end)
    }

    /// Returns a point of a patch.
    pub fn point_of(&self, patch: u32) -> u32 {
        self.stars.point(self.first_sectors[patch as usize])
    }

    /// Returns the sectors around points where faces cross.
    pub fn stars(&self) -> &Stars {
        &self.stars
    }
}

/// Returns the patch of each sector, and the first sector of each patch.
fn patches(bodies: &Bodies, crossings: &Crossings, stars: &Stars) -> (Vec<u32>, Vec<u32>) {
    let joined = UnionFind::new(stars.count());
    (0..bodies.faces.len() as u32).into_par_iter().with_min_len(4096).for_each(|face| {
        let [a, b, c] = bodies.faces[face as usize];
        for (u, v) in [(a, b), (b, c), (c, a)] {
            if u < v && (!crossings.is_crossed(face) || crossings.range([u, v]).is_empty()) {
                joined.join(stars.sector([u, v]), stars.sector([v, u]));
            }
        }
    });
    let mut patch_of_sector = joined.roots();
    let mut first_sectors = Vec::new();
    // The root is the first sector of its set, so its number is known when another needs it.
    for sector in 0..patch_of_sector.len() {
        let root = patch_of_sector[sector] as usize;
        patch_of_sector[sector] = if root == sector {
            first_sectors.push(sector as u32);
            first_sectors.len() as u32 - 1
        } else {
            patch_of_sector[root]
        };
    }
    (patch_of_sector, first_sectors)
}

/// A step from one patch to another.
#[derive(Clone, Copy)]
struct Link {
    from: u32,
    to: u32,
    way: Way,
}

/// The way of a step.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Way {
    /// Along an edge.
    Along {
        edge: [u32; 2],
        /// True if the step goes from the lower point of the edge to the higher.
        is_upwards: bool,
    },
    /// Around a point, where the winding number of a solid changes.
    Around { solid: usize, change: i32 },
}

/// The links between patches, by the patch from which they lead.
struct Links {
    list: Vec<Link>,
    starts: Vec<u32>,
}

impl Links {
    fn of(crossings: &Crossings, stars: &Stars, patch_of_sector: &[u32], patches: usize) -> Links {
        let edges = crossings.list().chunk_by(|a: &Crossing, b| a.edge == b.edge).map(|group| group[0].edge);
        let both_ways = |sectors: [u32; 2], way: Way, back: Way| {
            let [from, to] = sectors.map(|sector| patch_of_sector[sector as usize]);
            [Link { from, to, way }, Link { from: to, to: from, way: back }]
        };
        let along = edges.flat_map(|edge| {
            let [up, down] = [true, false].map(|is_upwards| Way::Along { edge, is_upwards });
            both_ways([stars.sector(edge), stars.sector([edge[1], edge[0]])], up, down)
        });
        let around = stars.turns().iter().flat_map(|&Turn { sectors, solid, change }| {
            let [there, back] = [change, -change].map(|change| Way::Around { solid, change });
            both_ways(sectors, there, back)
        });
        let mut list: Vec<Link> = along.chain(around).collect();
        list.par_sort_unstable_by_key(|link| (link.from, link.to, link.way));
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
