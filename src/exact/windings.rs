//! The winding numbers of the solids at the points of every body.
//!
//! Along an edge, the winding number of another body changes by one at each crossing. So points that are connected by edges
//! without crossings have the same winding numbers, and crossings give the differences between these patches. One
//! point of each connected surface is located by a ray. The own number of a body that meets itself is
//! known at its outermost point, and changes at the crossings of its edges with its faces in the same way.

use std::mem::replace;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::parallel::*;

use super::bodies::Bodies;
use super::crossings::{Crossing, Crossings};
use super::near::Near;
use super::numbers::Listed;
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
    /// The numbers that are not 0, with their solids, and where those of each patch are.
    numbers: Vec<(u32, i32)>,
    of_patches: Vec<Range<usize>>,
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
        let (numbers, of_patches) = (Vec::new(), vec![0..0; patches]);
        let mut found = Windings { solids, stars, patch_of_sector, first_sectors, numbers, of_patches };
        let all = &bodies.bodies;
        let crossed = all.iter().enumerate().filter(|(_, body)| body.is_crossed);
        let (has_crossed, mut arriving) = (crossed.clone().next().is_some(), Listed::default());
        let of_crossed = crossed.map(|(own, body)| {
            let (edge, number) = outermost(own, bodies);
            (found.patch(edge) as usize, number - body.front)
        });
        let others = (0..patches).map(|patch| (patch, 0));
        // Of each set of linked patches, one is located.
        let linked = UnionFind::new(patches as u32);
        links.list.iter().for_each(|link| linked.join(link.from, link.to));
        let mut has_first = vec![false; patches];
        let is_first = |&(patch, _): &(usize, i32)| !replace(&mut has_first[linked.find(patch as u32) as usize], true);
        let firsts: Vec<(usize, i32)> = of_crossed.chain(others).filter(is_first).collect();
        let points = firsts.iter().map(|&(patch, _)| found.point_of(patch as u32)).collect();
        let located = locate(points, bodies, near);
        let mut is_known = vec![false; patches];
        for ((patch, own_number), mut numbers) in firsts.into_iter().zip(located) {
            checkpoint();
            is_known[patch] = true;
            let own = bodies.body_of_point(found.point_of(patch as u32));
            numbers.add(all[own as usize].solid, own_number);
            found.note(patch, &numbers);
            let mut pending = vec![patch];
            while let Some(from) = pending.pop() {
                for link in links.of_patch(from) {
                    let to = link.to as usize;
                    let is_first = !replace(&mut is_known[to], true);
                    if !is_first && !has_crossed {
                        continue;
                    }
                    arriving.set(found.of_patch(from as u32));
                    match link.way {
                        Way::Along { edge, is_upwards } => {
                            for crossing in crossings.along(edge) {
                                let is_entered = crossing.enters == is_upwards;
                                arriving.add(bodies.solid_of_face(crossing.face), if is_entered { 1 } else { -1 });
                            }
                        }
                        Way::Around { solid, change } => arriving.add(solid, change),
                    }
                    if is_first {
                        found.note(to, &arriving);
                        pending.push(to);
                    } else if found.of_patch(link.to) != arriving.list() {
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

    /// Returns the winding numbers that are not 0 in front of the faces at the start of an edge, less `Body::front` of its body.
    pub fn at(&self, edge: [u32; 2]) -> &[(u32, i32)] {
        self.of_patch(self.patch(edge))
    }

    /// Returns [`Windings::at`] of the edges that start in a patch.
    pub fn of_patch(&self, patch: u32) -> &[(u32, i32)] {
        &self.numbers[self.of_patches[patch as usize].clone()]
    }

    /// Notes the numbers of a patch.
    fn note(&mut self, patch: usize, numbers: &Listed) {
        let first = self.numbers.len();
        self.numbers.extend_from_slice(numbers.list());
        self.of_patches[patch] = first..self.numbers.len();
    }

    /// Returns the number of solids.
    pub fn solids(&self) -> usize {
        self.solids
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

/// Returns the winding numbers of all solids at some points, by rays along +x, without those of the points' own bodies.
fn locate(points: Vec<u32>, bodies: &Bodies, near: &[Option<Near>]) -> Vec<Listed> {
    let all = &bodies.bodies;
    let around = |point: u32| {
        let (own, here) = (bodies.body_of_point(point) as usize, Box32::around([bodies.points[point as usize]]));
        (0..all.len()).filter(move |&body| body != own && all[body].extent.touches(&here))
    };
    let rays: Vec<AtomicU32> = all.iter().map(|_| AtomicU32::new(0)).collect();
    points.par_iter().for_each(|&point| around(point).for_each(|body| _ = rays[body].fetch_add(1, Ordering::Relaxed)));
    let whole = |body: usize| near[body].as_ref().and_then(Near::whole);
    // For one ray, it is faster to test all faces than to sort them.
    let is_sorted = |body: usize| rays[body].load(Ordering::Relaxed) > 1 && whole(body).is_none();
    let sorted = |body: usize| is_sorted(body).then(|| bodies.tree(&all[body]));
    let sorted: Vec<Option<FaceTree>> = (0..all.len()).into_par_iter().map(sorted).collect();
    let numbers = |&point: &u32| {
        checkpoint();
        let position = bodies.points[point as usize];
        let vertex = Vertex::of(bodies, point, bodies.body_of_point(point));
        let mut numbers = Listed::default();
        for body in around(point) {
            let across = |face| winding(&bodies.plane(face), &vertex);
            let number = match whole(body).or(sorted[body].as_ref()) {
                Some(tree) => {
                    let mut sum = 0;
                    tree.ahead_of(position, |face| sum += across(face));
                    sum
                }
                None => {
                    let is_ahead = |face: &u32| bodies.extent(*face).is_ahead_of(position);
                    let faces = bodies.faces_in_runs(&all[body], |run| run.is_ahead_of(position));
                    faces.filter(is_ahead).map(across).sum()
                }
            };
            numbers.add(all[body].solid, number);
        }
        numbers
    };
    points.par_iter().map(numbers).collect()
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
