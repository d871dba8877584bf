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

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::measure::{EMPTY, include};
use super::meet::{are_parted, meet, widest_axis};
use super::{Aabb, ClosedMesh, check};
use crate::cancel::checkpoint;
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
    /// A set of triangles, each narrower than a few units of rounding, whose sides others share.
    TooThin {
        /// The largest of the triangles.
        triangle: usize,
    },
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
            Unproved::TooThin { triangle } => Unproved::TooThin { triangle: number(triangle as u32) as usize },
            Unproved::NotOriented | Unproved::NoVolume => self,
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
            Unproved::TooThin { triangle } => write!(f, "triangle {triangle} is too thin"),
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
    let corners = |triangle: u32| triangles.triangles[triangle as usize].map(|i| triangles.positions[i as usize]);
    let sheets = prove_embedded(&corners, &vec![true; triangles.triangles.len()])?;
    let is_connected = || (0..triangles.triangles.len() as u32).into_par_iter().all(|t| sheets.parts.find(t) == 0);
    if sheets.are_closed && is_connected() {
        return if mesh.signed_volume() == 0.0 { Err(Unproved::NoVolume) } else { Ok(()) };
    }
    let report = check(triangles);
    match report.inside_out.first.first().or(report.solids_in_solids.first.first()) {
        Some(shell) => Err(Unproved::ShellFacing { triangle: shell.triangle }),
        None => Ok(()),
    }
}

/// Triangles that meet no others elsewhere than in corners and sides that they share.
pub(crate) struct Sheets {
    /// The sets of these triangles that are connected by sides of exactly two triangles, which use them in opposite directions.
    pub parts: UnionFind,
    /// True if they are all triangles of the mesh, and all their sides are of this kind.
    pub are_closed: bool,
}

/// Proves that some triangles of a mesh meet no triangle of it elsewhere than in corners and sides that they share.
///
/// `corners` returns the corners of a triangle, and `is_needed` tells which are to be proved.
///
/// # Errors
/// [`Unproved::TrianglesMeet`], where one of the two is needed.
pub(crate) fn prove_embedded(
    corners: &(impl Fn(u32) -> [DVec3; 3] + Sync),
    is_needed: &[bool],
) -> Result<Sheets, Unproved> {
    let Some(surface) = Surface::new(corners, is_needed) else {
        return Ok(Sheets { parts: UnionFind::new(is_needed.len() as u32), are_closed: false });
    };
    surface.embed()?;
    Ok(surface.sheets())
}

/// The box of a triangle, relative to that of all, rounded outwards.
#[derive(Clone, Copy)]
struct Extent {
    min: Vec3,
    max: Vec3,
}

impl Extent {
    fn of([a, b, c]: [DVec3; 3]) -> Extent {
        let (min, max) = (a.min(b).min(c), a.max(b).max(c));
        let down = |x: f64| (x as f32).next_down();
        let up = |x: f64| (x as f32).next_up();
        Extent {
            min: Vec3::new(down(min.x), down(min.y), down(min.z)),
            max: Vec3::new(up(max.x), up(max.y), up(max.z)),
        }
    }

    #[inline]
    fn touches(&self, other: &Extent) -> bool {
        (self.min.cmple(other.max) & other.min.cmple(self.max)).all()
    }
}

/// A grid of cells of one size, and the triangles that touch each.
struct Level {
    /// 1 / side of a cell.
    scale: f32,
    cells: [u32; 3],
    /// The offset of the triangles of each cell, and the end of the last.
    starts: Vec<u32>,
    triangles: Vec<u32>,
    /// The triangles of the level, once each.
    members: Vec<u32>,
}

impl Level {
    /// Sorts the triangles of a level into cells.
    fn new(side: f32, size: Vec3, members: Vec<u32>, extents: &[Extent]) -> Level {
        let scale = 1.0 / side;
        let cells = (size * scale).to_array().map(|c| c as u32 + 1);
        let mut level = Level { scale, cells, starts: Vec::new(), triangles: Vec::new(), members: Vec::new() };
        let counts: Vec<AtomicU32> =
            (0..cells.iter().product::<u32>() + 1).into_par_iter().map(|_| AtomicU32::new(0)).collect();
        members.par_iter().with_min_len(CHUNK).for_each(|&triangle| {
            level.each_cell(&extents[triangle as usize], |cell| {
                counts[cell as usize].fetch_add(1, Ordering::Relaxed);
            });
        });
        let mut end = 0;
        for count in &counts {
            end += count.load(Ordering::Relaxed);
            count.store(end, Ordering::Relaxed);
        }
        let slots: Vec<AtomicU32> = (0..end).into_par_iter().map(|_| AtomicU32::new(0)).collect();
        members.par_iter().with_min_len(CHUNK).for_each(|&triangle| {
            level.each_cell(&extents[triangle as usize], |cell| {
                let slot = counts[cell as usize].fetch_sub(1, Ordering::Relaxed) - 1;
                slots[slot as usize].store(triangle, Ordering::Relaxed);
            });
        });
        level.starts = counts.into_iter().map(AtomicU32::into_inner).collect();
        level.triangles = slots.into_iter().map(AtomicU32::into_inner).collect();
        level.members = members;
        level
    }

    /// Returns the cell of a point; monotone in every coordinate.
    #[inline]
    fn cell(&self, point: Vec3) -> [u32; 3] {
        let cell = (point * self.scale).to_array();
        [0, 1, 2].map(|i| (cell[i] as u32).min(self.cells[i] - 1))
    }

    #[inline]
    fn number(&self, [x, y, z]: [u32; 3]) -> u32 {
        (z * self.cells[1] + y) * self.cells[0] + x
    }

    #[inline]
    fn each_cell(&self, extent: &Extent, mut visit: impl FnMut(u32)) {
        let (low, high) = (self.cell(extent.min), self.cell(extent.max));
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    visit(self.number([x, y, z]));
                }
            }
        }
    }

    fn of_cell(&self, cell: u32) -> &[u32] {
        &self.triangles[self.starts[cell as usize] as usize..self.starts[cell as usize + 1] as usize]
    }

    /// Returns whether a cell is the lowest that both boxes touch, which is the one that tests the pair.
    #[inline]
    fn is_first(&self, cell: u32, one: &Extent, other: &Extent) -> bool {
        self.number(self.cell(one.min.max(other.min))) == cell
    }
}

/// Number of triangles or cells that one task takes.
const CHUNK: usize = 4096;

/// Largest number of cells of the finest level.
const MOST_CELLS: f64 = 4e6;

/// The mark of a side of one triangle alone.
const FREE: u32 = u32::MAX;

/// The mark of a side of more than two triangles, or of two in the same direction.
const CROWDED: u32 = u32::MAX - 1;

/// The triangles near those that are needed, by numbers of their own, that are being tested against one another.
struct Surface<'m, C> {
    corners: &'m C,
    is_needed: &'m [bool],
    /// The triangles in the mesh, in ascending order.
    triangles: Vec<u32>,
    extents: Vec<Extent>,
    /// Levels from fine to coarse, each with cells of twice the side of the level before.
    levels: Vec<Level>,
    /// The level that each triangle belongs to.
    level_of: Vec<u8>,
    /// The other triangle at each side, or a mark; of triangles that are not needed, only some.
    neighbors: Vec<[AtomicU32; 3]>,
}

impl<'m, C: Fn(u32) -> [DVec3; 3] + Sync> Surface<'m, C> {
    /// Sorts the triangles near those that are needed; returns `None` if there are none.
    fn new(corners: &'m C, is_needed: &'m [bool]) -> Option<Surface<'m, C>> {
        let all = (0..is_needed.len() as u32).into_par_iter();
        let around = |triangle: u32| corners(triangle).into_iter().fold(EMPTY, include);
        let needed = all.clone().filter(|&triangle| is_needed[triangle as usize]);
        let bounds = needed.map(around).reduce_with(Aabb::union)?;
        // In units of the longest side, so that no coordinate leaves the range of f32.
        let unit = bounds.extent().max_element().max(f64::MIN_POSITIVE);
        let local = |point: DVec3| (point - bounds.min) / unit;
        let whole = Extent::of([bounds.min, bounds.max, bounds.max].map(local));
        let extent = |triangle: u32| (triangle, Extent::of(corners(triangle).map(local)));
        let (triangles, extents): (Vec<u32>, Vec<Extent>) =
            all.map(extent).filter(|(_, extent)| extent.touches(&whole)).unzip();
        let size = (bounds.extent() / unit).as_vec3();

        let width = |extent: &Extent| (extent.max - extent.min).max_element();
        let mean = extents.par_iter().map(|extent| f64::from(width(extent))).sum::<f64>() / extents.len() as f64;
        let volume = |side: f64| size.to_array().iter().map(|&c| f64::from(c) / side + 1.0).product::<f64>();
        let mut finest = 1.5 * mean;
        while volume(finest) > MOST_CELLS {
            finest *= 1.2;
        }
        let finest = finest as f32;
        let level_of: Vec<u8> =
            extents.par_iter().map(|extent| (width(extent) / finest).log2().ceil().clamp(0.0, 30.0) as u8).collect();
        let coarsest = level_of.par_iter().copied().max().unwrap_or(0);
        let levels = (0..=coarsest).map(|k| {
            let all = (0..triangles.len() as u32).into_par_iter();
            let members: Vec<u32> = all.filter(|&t| level_of[t as usize] == k).collect();
            Level::new(finest * f32::from(k).exp2(), size, members, &extents)
        });
        let levels = levels.collect();
        let neighbors = (0..triangles.len()).into_par_iter().map(|_| [FREE; 3].map(AtomicU32::new)).collect();
        Some(Surface { corners, is_needed, triangles, extents, levels, level_of, neighbors })
    }

    /// Returns whether a triangle is needed.
    #[inline]
    fn is_needed(&self, triangle: u32) -> bool {
        self.is_needed[self.triangles[triangle as usize] as usize]
    }

    /// Tests every pair of triangles whose boxes touch and of which one is needed.
    fn embed(&self) -> Result<(), Unproved> {
        for level in &self.levels {
            let cells = (0..level.starts.len() as u32 - 1).into_par_iter().with_min_len(64);
            first(cells.filter_map(|cell| self.within_cell(level, cell)))?;
        }
        if self.levels.len() > 1 {
            for level in &self.levels {
                let triangles = level.members.par_iter().with_min_len(CHUNK);
                first(triangles.filter_map(|&triangle| self.with_larger(triangle)))?;
            }
        }
        Ok(())
    }

    /// Joins the needed triangles that share a side.
    fn sheets(&self) -> Sheets {
        let parts = UnionFind::new(self.is_needed.len() as u32);
        let join = |triangle: u32| {
            let beside = self.neighbors[triangle as usize].each_ref().map(|side| side.load(Ordering::Relaxed));
            for other in beside.into_iter().filter(|&other| other < CROWDED && self.is_needed(other)) {
                parts.join(self.triangles[triangle as usize], self.triangles[other as usize]);
            }
            beside.into_iter().all(|other| other < CROWDED)
        };
        let all = (0..self.triangles.len() as u32).into_par_iter().with_min_len(CHUNK);
        let is_closed = |triangle: u32| self.is_needed(triangle) && join(triangle);
        let are_closed = all.map(is_closed).reduce(|| true, |a, b| a & b);
        Sheets { parts, are_closed: are_closed && self.triangles.len() == self.is_needed.len() }
    }

    /// Tests the pairs of a cell; returns the least one that meets.
    fn within_cell(&self, level: &Level, cell: u32) -> Option<[u32; 2]> {
        checkpoint();
        let members = level.of_cell(cell);
        if members.len() < 2 || !members.iter().any(|&triangle| self.is_needed(triangle)) {
            return None;
        }
        // Stored contiguously, since each is read as often as the cell has members.
        let facets: Vec<Facet> = members.iter().map(|&triangle| self.facet(triangle)).collect();
        let mut found = None;
        for (i, one) in facets.iter().enumerate() {
            for other in &facets[i + 1..] {
                let decides = one.is_needed || other.is_needed;
                if decides && one.extent.touches(&other.extent) && level.is_first(cell, &one.extent, &other.extent) {
                    found = lesser(found, self.look_at(one, other));
                }
            }
        }
        found
    }

    /// Tests a triangle against those of coarser levels.
    fn with_larger(&self, triangle: u32) -> Option<[u32; 2]> {
        let one = self.facet(triangle);
        let mut found = None;
        for level in &self.levels[usize::from(self.level_of[triangle as usize]) + 1..] {
            level.each_cell(&one.extent, |cell| {
                for &other in level.of_cell(cell) {
                    let extent = &self.extents[other as usize];
                    let decides = one.is_needed || self.is_needed(other);
                    if decides && one.extent.touches(extent) && level.is_first(cell, &one.extent, extent) {
                        found = lesser(found, self.look_at(&one, &self.facet(other)));
                    }
                }
            });
        }
        found
    }

    fn facet(&self, triangle: u32) -> Facet {
        let corners = (self.corners)(self.triangles[triangle as usize]);
        let (is_needed, extent) = (self.is_needed(triangle), self.extents[triangle as usize]);
        Facet { triangle, is_needed, axis: widest_axis(corners), corners, extent }
    }

    /// Returns the pair if it meets; marks the side that they share.
    fn look_at(&self, one: &Facet, other: &Facet) -> Option<[u32; 2]> {
        let (a, b) = (&one.corners, &other.corners);
        // Corners in the same place are one, whatever their indices.
        let mut shared = [3; 3];
        for (place, corner) in shared.iter_mut().zip(b) {
            for (i, own) in a.iter().enumerate() {
                if own.x == corner.x && own == corner {
                    *place = i;
                }
            }
        }
        if !are_parted(a, b, shared, one.axis) {
            let numbers = [0, 1, 2].map(|j| if shared[j] < 3 { shared[j] as u32 } else { 3 + j as u32 });
            let place_of = |number: u32| if number < 3 { a[number as usize] } else { b[number as usize - 3] };
            if meet([0, 1, 2], numbers, place_of) {
                let [a, b] = [one, other].map(|facet| self.triangles[facet.triangle as usize]);
                return Some([a.min(b), a.max(b)]);
            }
        }
        for j in 0..3 {
            let (from, to) = (shared[j], shared[(j + 1) % 3]);
            if from == 3 || to == 3 {
                continue;
            }
            // The sides of `one` go from corner i to i + 1.
            let is_opposite = from == (to + 1) % 3;
            self.note(one, if is_opposite { to } else { from }, other.triangle, is_opposite);
            self.note(other, j, one.triangle, is_opposite);
        }
        None
    }

    /// Notes the triangle at a side of another. The mark does not depend on the order of the notes.
    fn note(&self, facet: &Facet, side: usize, beside: u32, is_opposite: bool) {
        let mark = &self.neighbors[facet.triangle as usize][side];
        if mark.swap(beside, Ordering::Relaxed) != FREE || !is_opposite {
            mark.store(CROWDED, Ordering::Relaxed);
        }
    }
}

/// A triangle as the pair test needs it.
struct Facet {
    triangle: u32,
    is_needed: bool,
    /// The axis along which its projection is largest.
    axis: usize,
    corners: [DVec3; 3],
    extent: Extent,
}

/// Returns the lesser of two pairs, so that the reported pair does not depend on threads.
fn lesser(a: Option<[u32; 2]>, b: Option<[u32; 2]>) -> Option<[u32; 2]> {
    a.into_iter().chain(b).min()
}

/// Fails with the first pair of the first cell or triangle that has one.
fn first(found: impl ParallelIterator<Item = [u32; 2]>) -> Result<(), Unproved> {
    match found.find_first(|_| true) {
        Some(triangles) => Err(Unproved::TrianglesMeet { triangles }),
        None => Ok(()),
    }
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
        // A small triangle beside large ones: two levels of cells.
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
        for mesh in [pair(DVec3::splat(0.5)), pair(DVec3::X), pair(DVec3::new(1.0, 0.25, 0.25)), skewed, doubled] {
            assert!(matches!(proof(&mesh), Err(Unproved::TrianglesMeet { .. })), "{:?}", proof(&mesh));
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
