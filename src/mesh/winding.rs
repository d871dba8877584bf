//! A proof that the winding number of a closed mesh is 0 or 1 everywhere, so that its divergence sums are those of the
//! solid.
//!
//! The divergence theorem gives ∫ w dV, w being the winding number. That is the volume of the solid, under either fill
//! rule, exactly where w takes no values but 0 and 1.
//!
//! # The argument
//! 1. No two triangles meet elsewhere than in corners and sides that they share (exact signs, [`super::meet`]). So the
//!    surface is embedded, and w is constant on either side of each sheet of it.
//! 2. Where every side is shared by exactly two triangles, which use it in opposite directions, w on the outer side is the
//!    same on all triangles that sides connect.
//! 3. If that connects all triangles, the outer side of one is the unbounded part of space, where w = 0; so w is 0 or 1
//!    where the signed volume is positive, and 0 or −1, all triangles facing inwards, where it is negative.
//! 4. Otherwise [`check`] finds the shells and how many others each lies in. Where those at even depth face
//!    outwards and those at odd depth inwards, w alternates between 0 and 1.
//!
//! A mesh may have windings 0 and 1 and no such proof: shells that touch, T-junctions and flat triangles all count as
//! triangles that meet.

use std::fmt;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::parallel::*;
use glam::DVec3;

use super::meet::{crossing, meet_elsewhere, shared_corners, widest_axis};
use super::{ClosedMesh, TriangleMesh, check};
use crate::box_tree::Box32;
use crate::cancel::checkpoint;
use crate::face_tree::FaceTree;
use crate::number::number;
use crate::union_find::UnionFind;

/// The reason why the winding number of a mesh is not proved to be 0 or 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Unproved {
    /// The triangles are not consistently oriented.
    NotOriented,
    /// Two triangles meet elsewhere than in corners and sides that they share.
    TrianglesMeet {
        /// The triangles, in ascending order.
        triangles: [u32; 2],
    },
    /// A shell faces the wrong way for the number of shells around it.
    ShellFacing {
        /// A triangle of the shell.
        triangle: usize,
    },
    /// The corners of a triangle lie on a line.
    Flat {
        /// The triangle.
        triangle: usize,
    },
    /// A triangle touches others of its shell, without crossing them, where that meets itself.
    Touches {
        /// The triangle.
        triangle: usize,
    },
    /// A set of triangles, each narrower than a few units of rounding, whose sides others share.
    TooThin {
        /// The largest of the triangles.
        triangle: usize,
    },
    /// The corners of many triangles fall together once coordinates are rounded, as beside a far larger solid.
    TooSmall,
    /// The mesh encloses no volume.
    NoVolume,
}

impl Unproved {
    /// Returns the reason with other numbers of its triangles.
    pub(crate) fn renumbered(self, number: impl Fn(u32) -> u32) -> Unproved {
        match self {
            Unproved::TrianglesMeet { triangles } => Unproved::TrianglesMeet { triangles: triangles.map(number) },
            Unproved::ShellFacing { triangle } => Unproved::ShellFacing { triangle: number(triangle as u32) as usize },
            Unproved::Flat { triangle } => Unproved::Flat { triangle: number(triangle as u32) as usize },
            Unproved::Touches { triangle } => Unproved::Touches { triangle: number(triangle as u32) as usize },
            Unproved::TooThin { triangle } => Unproved::TooThin { triangle: number(triangle as u32) as usize },
            Unproved::NotOriented | Unproved::TooSmall | Unproved::NoVolume => self,
        }
    }
}

impl fmt::Display for Unproved {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Unproved::NotOriented => write!(f, "its triangles are not consistently oriented"),
            Unproved::TrianglesMeet { triangles: [a, b] } => write!(f, "triangles {a} and {b} touch or cross"),
            Unproved::ShellFacing { triangle } => write!(f, "the shell of triangle {triangle} faces the wrong way"),
            Unproved::Flat { triangle } => write!(f, "the corners of triangle {triangle} lie on a line"),
            Unproved::Touches { triangle } => write!(f, "triangle {triangle} touches others of its shell"),
            Unproved::TooThin { triangle } => write!(f, "triangle {triangle} is too thin"),
            Unproved::TooSmall => {
                write!(
                    f,
                    "corners of many of its triangles fall together where the coordinates of all inputs are rounded"
                )
            }
            Unproved::NoVolume => write!(f, "it encloses no volume"),
        }
    }
}

/// Proves that the winding number of a mesh is 0 or 1 everywhere, or 0 or −1 everywhere; the sign of
/// [`ClosedMesh::signed_volume`] tells which. See the module's docs.
///
/// It takes about 0.2 s for a million triangles on two threads. The result, including the reason, does not depend on
/// threads.
pub fn prove_simple(mesh: &ClosedMesh) -> Result<(), Unproved> {
    if !mesh.oriented() {
        return Err(Unproved::NotOriented);
    }
    let triangles = mesh.mesh();
    let count = triangles.triangles.len();
    let sheets = prove_embedded(&tree_of(mesh), 0, |triangle| corners(triangles, triangle), &vec![true; count])?;
    let all = || (0..count as u32).into_par_iter().with_min_len(CHUNK);
    let is_connected = || all().all(|triangle| sheets.parts.find(triangle) == 0);
    if sheets.are_closed && is_connected() {
        return if mesh.signed_volume() == 0.0 { Err(Unproved::NoVolume) } else { Ok(()) };
    }
    let report = check(triangles);
    match report.inside_out.first.first().or(report.solids_in_solids.first.first()) {
        Some(shell) => Err(Unproved::ShellFacing { triangle: shell.triangle }),
        None => Ok(()),
    }
}

/// A place where a surface passes through itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfCrossing {
    /// The triangles that cross, in ascending order.
    pub triangles: [u32; 2],
    /// The middle of the segment in which they cross, rounded.
    pub at: DVec3,
}

impl fmt::Display for SelfCrossing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let SelfCrossing { triangles: [a, b], at } = self;
        let [x, y, z] = at.to_array().map(number);
        write!(f, "triangles {a} and {b} cross near ({x}, {y}, {z})")
    }
}

/// Returns the first place where a surface passes through itself: triangles that have corners on both sides of each other and more than
/// a point in common. `None` if it does so nowhere, though it may touch itself in points, along lines and over areas.
///
/// The first is that of the hierarchy's order. Surfaces that pass through each other along sides of both alone are not found. It takes
/// about as long as [`prove_simple`], and the result does not depend on threads.
pub fn first_crossing(mesh: &ClosedMesh) -> Option<SelfCrossing> {
    let tree = tree_of(mesh);
    let reach = mesh.bounds().min.abs().max(mesh.bounds().max.abs()).max_element();
    let facet = |place: usize| {
        let triangle = tree.faces()[place];
        (triangle, corners(mesh.mesh(), triangle))
    };
    let look = |&(first, a): &(u32, [DVec3; 3]), &(second, b): &(u32, [DVec3; 3])| {
        let [from, to] = crossing(a, b)?;
        let at = from.midpoint(to).map(|entry| if entry.abs() < 1e-14 * reach { 0.0 } else { entry });
        Some(SelfCrossing { triangles: [first.min(second), first.max(second)], at })
    };
    tree.first_of_own_pairs(|_| true, facet, look)?.into_iter().min_by_key(|found| found.triangles)
}

fn corners(mesh: &TriangleMesh, triangle: u32) -> [DVec3; 3] {
    mesh.triangles[triangle as usize].map(|vertex| mesh.positions[vertex as usize])
}

/// Returns the hierarchy of all triangles. Boxes are relative to the longest side, so that none leaves the range of `f32`.
fn tree_of(mesh: &ClosedMesh) -> FaceTree {
    let bounds = mesh.bounds();
    let unit = bounds.extent().max_element().max(f64::MIN_POSITIVE);
    let local = |point: DVec3| (point - bounds.min) / unit;
    let extent = |triangle: u32| Box32::around(corners(mesh.mesh(), triangle).map(local));
    let around = Box32::around([bounds.min, bounds.max].map(local));
    let all = (0..mesh.mesh().triangles.len() as u32).into_par_iter().with_min_len(CHUNK);
    FaceTree::new(&around, all.map(|triangle| (triangle, extent(triangle))), extent)
}

/// Triangles that meet no others elsewhere than in corners and sides that they share.
pub(crate) struct Sheets {
    /// The sets of these triangles that are connected by sides of exactly two triangles; these use them in opposite directions, as
    /// the mesh is oriented.
    pub parts: UnionFind,
    /// True if they are all triangles of the mesh, and all their sides are of this kind.
    pub are_closed: bool,
}

/// Proves that some triangles of a closed, consistently oriented mesh meet no triangle of it elsewhere than in corners and sides
/// that they share.
///
/// `tree` holds the triangles whose boxes touch those of the triangles to be proved, by numbers that begin with `first`, and
/// `corners` returns the corners of a triangle by such a number. `is_needed` tells for all triangles of the mesh whether they are to
/// be proved.
///
/// # Errors
/// [`Unproved::TrianglesMeet`], where one of the two is needed; the triangles are numbered from 0.
pub(crate) fn prove_embedded(
    tree: &FaceTree,
    first: u32,
    corners: impl Fn(u32) -> [DVec3; 3] + Sync,
    is_needed: &[bool],
) -> Result<Sheets, Unproved> {
    let neighbors = (0..tree.faces().len()).into_par_iter().with_min_len(CHUNK).map(|_| [FREE; 3].map(AtomicU32::new));
    let surface = Surface { tree, first, corners, is_needed, neighbors: neighbors.collect() };
    surface.embed()?;
    checkpoint();
    Ok(surface.sheets())
}

/// Number of triangles that one task takes.
const CHUNK: usize = 4096;

/// The mark of a side of one triangle alone.
const FREE: u32 = u32::MAX;

/// The mark of a side of more than two triangles.
const CROWDED: u32 = u32::MAX - 1;

/// The triangles near those that are needed, by their places in a tree, that are being tested against one another.
struct Surface<'m, C> {
    tree: &'m FaceTree,
    first: u32,
    corners: C,
    is_needed: &'m [bool],
    /// The place of the other triangle at each side, or a mark; of triangles that are not needed, only some.
    neighbors: Vec<[AtomicU32; 3]>,
}

impl<C: Fn(u32) -> [DVec3; 3] + Sync> Surface<'_, C> {
    /// Returns the number in the mesh of the triangle at a place.
    #[inline]
    fn number(&self, place: usize) -> u32 {
        self.tree.faces()[place] - self.first
    }

    #[inline]
    fn is_needed(&self, place: usize) -> bool {
        self.is_needed[self.number(place) as usize]
    }

    /// Tests every pair of triangles whose boxes touch and of which one is needed.
    fn embed(&self) -> Result<(), Unproved> {
        let facet = |place: usize| {
            let corners = (self.corners)(self.tree.faces()[place]);
            Facet { place, axis: widest_axis(corners), corners }
        };
        let look = |one: &Facet, other: &Facet| self.look_at(one, other);
        match self.tree.first_of_own_pairs(|place| self.is_needed(place), facet, look) {
            Some(pairs) => Err(Unproved::TrianglesMeet { triangles: pairs.into_iter().min().unwrap_or_default() }),
            None => Ok(()),
        }
    }

    /// Joins the needed triangles that share a side.
    fn sheets(&self) -> Sheets {
        let parts = UnionFind::new(self.is_needed.len() as u32);
        let join = |place: usize| {
            let beside = self.neighbors[place].each_ref().map(|side| side.load(Ordering::Relaxed));
            for other in beside.into_iter().filter(|&other| other < CROWDED && self.is_needed(other as usize)) {
                parts.join(self.number(place), self.number(other as usize));
            }
            beside.into_iter().all(|other| other < CROWDED)
        };
        let all = (0..self.neighbors.len()).into_par_iter().with_min_len(CHUNK);
        let is_closed = |place: usize| self.is_needed(place) && join(place);
        let are_closed = all.map(is_closed).reduce(|| true, |a, b| a & b);
        Sheets { parts, are_closed: are_closed && self.neighbors.len() == self.is_needed.len() }
    }

    /// Returns the pair if it meets; marks the side that they share.
    fn look_at(&self, one: &Facet, other: &Facet) -> Option<[u32; 2]> {
        let (a, b) = (&one.corners, &other.corners);
        // Whatever their indices.
        let shared = shared_corners(a, b);
        if meet_elsewhere(a, b, shared, one.axis) {
            let [a, b] = [one, other].map(|facet| self.number(facet.place));
            return Some([a.min(b), a.max(b)]);
        }
        for j in 0..3 {
            let (from, to) = (shared[j], shared[(j + 1) % 3]);
            if from == 3 || to == 3 {
                continue;
            }
            // The sides of `one` go from corner i to i + 1.
            let is_opposite = from == (to + 1) % 3;
            self.note(one, if is_opposite { to } else { from }, other);
            self.note(other, j, one);
        }
        None
    }

    /// Notes the triangle at a side of another. The mark does not depend on the order of the notes.
    fn note(&self, facet: &Facet, side: usize, beside: &Facet) {
        let mark = &self.neighbors[facet.place][side];
        if mark.swap(beside.place as u32, Ordering::Relaxed) != FREE {
            mark.store(CROWDED, Ordering::Relaxed);
        }
    }
}

/// A triangle as the pair test needs it.
struct Facet {
    place: usize,
    /// The axis along which its projection is largest.
    axis: usize,
    corners: [DVec3; 3],
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::mesh::TriangleMesh;
    use crate::solids;
    use crate::testing::meshes::{cube, reversed, tetrahedron, together, unwelded};

    fn proof(mesh: &TriangleMesh) -> Result<(), Unproved> {
        let of = |mesh| prove_simple(&ClosedMesh::check(mesh).unwrap());
        let found = of(mesh.clone());
        assert_eq!(of(unwelded(mesh)), found);
        found
    }

    #[test]
    fn embedded_surfaces_are_proved() {
        let torus = solids::torus(3.0, 1.0, 60, 30).unwrap();
        for mesh in [cube(DVec3::ZERO, 1.0), tetrahedron(), torus.clone(), reversed(&torus)] {
            assert_eq!(proof(&mesh), Ok(()));
        }
        // Small triangles beside large ones.
        let mixed = together(&[cube(DVec3::ZERO, 1000.0), cube(DVec3::splat(1001.0), 0.01)]);
        assert_eq!(proof(&mixed), Ok(()));
    }

    #[test]
    fn nested_shells_are_proved_only_if_they_alternate() {
        let nested = |inner: TriangleMesh| together(&[cube(DVec3::ZERO, 4.0), inner]);
        let hollow = reversed(&cube(DVec3::ONE, 2.0));
        assert_eq!(proof(&nested(hollow.clone())), Ok(()));
        assert_eq!(proof(&together(&[nested(hollow.clone()), cube(DVec3::splat(1.5), 1.0)])), Ok(()));
        for wrong in [
            nested(cube(DVec3::ONE, 2.0)),
            together(&[cube(DVec3::ZERO, 4.0), reversed(&cube(DVec3::splat(9.0), 1.0))]),
        ] {
            assert!(matches!(proof(&wrong), Err(Unproved::ShellFacing { .. })), "{:?}", proof(&wrong));
        }
    }

    #[test]
    fn crossing_touching_and_folded_meshes_are_not_proved() {
        let pair = |by: DVec3| together(&[cube(DVec3::ZERO, 1.0), cube(by, 1.0)]);
        let skewed = together(&[cube(DVec3::ZERO, 1.0), tetrahedron()]);
        let doubled = together(&[tetrahedron(), tetrahedron(), tetrahedron()]);
        let mut pulled = cube(DVec3::ZERO, 1.0);
        pulled.positions[7] = DVec3::new(0.4, 0.6, -0.5);
        let crossing = [pair(DVec3::splat(0.5)), pulled];
        let touching = [pair(DVec3::X), pair(DVec3::new(1.0, 0.25, 0.25)), skewed, doubled];
        for (mesh, crosses) in crossing.iter().map(|mesh| (mesh, true)).chain(touching.iter().map(|mesh| (mesh, false)))
        {
            assert!(matches!(proof(mesh), Err(Unproved::TrianglesMeet { .. })), "{:?}", proof(mesh));
            let found = first_crossing(&ClosedMesh::check(mesh.clone()).unwrap());
            assert_eq!(found.is_some(), crosses, "{found:?}");
        }
        let mut flipped = cube(DVec3::ZERO, 1.0);
        flipped.triangles[3].swap(0, 1);
        assert_eq!(prove_simple(&ClosedMesh::check(flipped).unwrap()), Err(Unproved::NotOriented));
        let flat = together(&[
            TriangleMesh { triangles: vec![[0, 1, 2], [0, 2, 1]], ..tetrahedron() },
            cube(DVec3::splat(3.0), 1.0),
        ]);
        assert!(proof(&flat).is_err());
    }

    #[test]
    fn every_corner_pushed_through_the_far_side_is_found() {
        let torus = solids::torus(3.0, 1.0, 24, 12).unwrap();
        for vertex in (0..torus.positions.len()).step_by(7) {
            let mut mesh = torus.clone();
            mesh.positions[vertex] *= -1.01;
            assert!(matches!(proof(&mesh), Err(Unproved::TrianglesMeet { .. })), "{vertex}");
        }
    }

    #[test]
    fn the_proof_does_not_depend_on_the_thread_count() {
        let balls: Vec<TriangleMesh> = (0..8)
            .map(|i| {
                let mut ball = solids::geodesic(1.0, 12).unwrap();
                ball.positions.iter_mut().for_each(|p| p.x += 1.9 * f64::from(i));
                ball
            })
            .collect();
        let mesh = ClosedMesh::check(together(&balls)).unwrap();
        let with = |threads| {
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| prove_simple(&mesh))
        };
        assert!(matches!(with(1), Err(Unproved::TrianglesMeet { .. })));
        assert!((0..10).all(|_| with(4) == with(1)));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]

        /// Boxes on a lattice, some facing inwards: the winding number of a unit cell is the sum over the boxes around it.
        #[test]
        fn proved_meshes_have_winding_numbers_0_and_1_alone(
            boxes in prop::collection::vec(((0..6i32, 0..6i32, 0..6i32), (1..5i32, 1..5i32, 1..5i32), any::<bool>()), 1..4),
        ) {
            let mut meshes = Vec::new();
            for &((x, y, z), (a, b, c), inwards) in &boxes {
                let corner = DVec3::new(x.into(), y.into(), z.into());
                let mesh = solids::cuboid(corner, corner + DVec3::new(a.into(), b.into(), c.into())).unwrap();
                meshes.push(if inwards { reversed(&mesh) } else { mesh });
            }
            let found = proof(&together(&meshes));
            let winding = |cell: [i32; 3]| -> i32 {
                let around = boxes.iter().filter(|((x, y, z), (a, b, c), _)| {
                    (*x..x + a).contains(&cell[0]) && (*y..y + b).contains(&cell[1]) && (*z..z + c).contains(&cell[2])
                });
                around.map(|(_, _, inwards)| if *inwards { -1 } else { 1 }).sum()
            };
            let cells = (0..1000).map(|i| winding([i % 10, i / 10 % 10, i / 100]));
            let (mut least, mut greatest) = (0, 0);
            cells.for_each(|w| (least, greatest) = (least.min(w), greatest.max(w)));
            if found.is_ok() {
                prop_assert!((least, greatest) == (0, 1) || (boxes.len() == 1 && (least, greatest) == (-1, 0)));
            }
            let is_apart = |i: usize, j: usize| {
                let (((x, y, z), (a, b, c), _), ((u, v, w), (d, e, f), _)) = (boxes[i], boxes[j]);
                x + a < u || u + d < x || y + b < v || v + e < y || z + c < w || w + f < z
            };
            let all_apart = (0..boxes.len()).all(|i| (0..i).all(|j| is_apart(i, j)));
            if all_apart && boxes.iter().all(|(_, _, inwards)| !inwards) {
                prop_assert_eq!(found, Ok(()));
            }
        }
    }
}
