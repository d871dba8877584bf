//! Solids on a lattice of integers, as bodies: closed surfaces with a known winding number.
//!
//! A solid is taken to be one body. Where that cannot be proved (`fronts`), each of its shells is to be one; shells may overlap.
//! Where that cannot be proved either, shells meet themselves, and their own winding numbers are counted as those of others.

use std::f64::consts::FRAC_PI_4;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::parallel::*;
use glam::{DVec3, I64Vec3};

use super::growth::Directions;
use super::signs::{Plane, Vertex};
use super::{NotExact, crossed};
use crate::allocation::vec_with_room;
use crate::boolean::Expression;
use crate::box_tree::Box32;
use crate::face_tree::FaceTree;
use crate::mesh::measure::{Frame, Sum};
use crate::mesh::{Aabb, ClosedMesh, TriangleMesh, Unproved, Weld};
use crate::union_find::UnionFind;

/// Number of positions that one task rounds.
const CHUNK: usize = 4096;

/// Number of faces of a run, which have a common box; faces near one another in the mesh are mostly near one another in space.
const FACES_OF_RUN: usize = 32;

/// Bits of a lattice coordinate: points lie within ± 2^39 of the lattice's origin.
const BITS: i32 = 40;

/// Faces of a solid whose corners may fall together on the lattice, whatever their share.
const LOST: usize = 1 << 10;

/// One in so many faces of a solid, or fewer, may do so, whatever their number.
const LOST_OF: usize = 32;

/// Number of shells of a solid that grow at different rates.
const SHELLS: i32 = 1 << 12;

/// Brings lattice coordinates to at most 1.
pub(super) const SCALE: f64 = 1.0 / (1u64 << (BITS - 1)) as f64;

/// A map between world coordinates and integers. Its step is a power of two, so that scaling is exact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    pub step: f64,
    /// The lattice coordinates, relative to world zero, of lattice point zero.
    origin: DVec3,
}

impl Lattice {
    /// Returns the lattice for solids in a box.
    pub fn around(bounds: Aabb) -> Lattice {
        let longest = bounds.extent().max_element().clamp(f64::MIN_POSITIVE, f64::MAX);
        let exponent = longest.log2().floor() as i32 + 1 - BITS;
        let step = 2f64.powi(exponent.clamp(-1000, 900));
        Lattice { step, origin: ((bounds.min + bounds.extent() / 2.0) / step).round() }
    }

    /// Returns the lattice point next to a position, and the vector from there to the position.
    #[inline]
    fn round(&self, position: DVec3) -> (DVec3, DVec3) {
        // The step is a power of two, so this is the same as a division.
        let exact = position * (1.0 / self.step);
        let rounded = exact.to_array().map(nearest);
        let rounded = DVec3::from(rounded);
        (rounded - self.origin, exact - rounded)
    }

    /// Returns the world position of a lattice point.
    pub fn position(&self, point: DVec3) -> DVec3 {
        (point + self.origin) * self.step
    }

    /// Returns the frame of a region's local coordinates.
    pub fn frame(&self, region: &Region) -> Frame {
        Frame::new((self.origin + region.centre) * region.scale, self.step / region.scale)
    }
}

/// The box that the result lies in, in lattice coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Region {
    min: DVec3,
    max: DVec3,
    /// A lattice point in the middle.
    centre: DVec3,
    /// A power of two that brings distances from the centre, along the axes, to at most 1.
    scale: f64,
}

impl Default for Region {
    /// Returns all of the lattice.
    fn default() -> Region {
        Region::within([DVec3::splat(-1.0 / SCALE), DVec3::splat(1.0 / SCALE)])
    }
}

impl Region {
    /// Returns the box in which the result of an expression over solids lies.
    pub fn of(expression: &Expression, solids: &[&ClosedMesh], lattice: &Lattice) -> Region {
        let corners = expression.corners(|input| {
            let Aabb { min, max } = solids[input].bounds();
            [min, max].map(|corner| lattice.round(corner).0)
        });
        // Points are rounded by half a step, and crossings by less than one.
        Region::within([corners[0] - 2.0, corners[1] + 2.0])
    }

    fn within([min, max]: [DVec3; 2]) -> Region {
        let centre = (0.5 * (min + max)).floor();
        let longest = (max - centre).max_element().clamp(1.0, 1.0 / SCALE);
        Region { min, max, centre, scale: 2f64.powi(-(longest.log2().ceil() as i32)) }
    }

    /// Returns the coordinates relative to the centre, in the unit of the region, of a lattice point.
    #[inline]
    pub fn local(&self, point: DVec3) -> DVec3 {
        (point - self.centre) * self.scale
    }

    /// Returns the unit of local coordinates, in lattice steps.
    pub fn unit(&self) -> f64 {
        1.0 / self.scale
    }

    fn touches(&self, [a, b, c]: [DVec3; 3]) -> bool {
        a.min(b).min(c).cmple(self.max).all() && a.max(b).max(c).cmpge(self.min).all()
    }

    /// Returns a bound on the area of a plane within the region: that of a disc as wide as its diagonal.
    fn greatest_section(&self) -> f64 {
        FRAC_PI_4 * (self.max - self.min).max(DVec3::ZERO).length_squared()
    }
}

/// Returns the integer next to a number.
#[inline]
fn nearest(number: f64) -> f64 {
    // Numbers of 2^51 and above have no more than one binary place; of those below, the sum has none.
    const SHIFT: f64 = 1.5 * (1u64 << 52) as f64;
    if number.abs() < (1u64 << 51) as f64 { (number + SHIFT) - SHIFT } else { number.round() }
}

/// The number of bodies of a solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wholeness {
    /// The solid is one body.
    Whole,
    /// Each shell is a body, as some meet.
    Shells,
    /// Each shell is a body that meets itself.
    Crossed,
}

/// A closed surface.
#[derive(Clone, Debug)]
pub(super) struct Body {
    /// The index of its solid.
    pub solid: usize,
    pub faces: Range<u32>,
    pub points: Range<u32>,
    pub extent: Box32,
    /// The boxes of runs of faces that follow one another, [`FACES_OF_RUN`] each.
    runs: Vec<Box32>,
    /// Its winding number in front of its faces; behind them it is one more. Of a body that meets itself, a number from which those in
    /// front of its faces are counted.
    pub front: i32,
    /// True if its faces may meet one another.
    pub is_crossed: bool,
    /// The rate at which it grows.
    rate: i32,
    /// True if bodies grow.
    is_growing: bool,
    /// The number of each face in the mesh as given, unless all are in order.
    numbers: Option<Vec<u32>>,
    /// The number of each point in the mesh as given, unless all are in order.
    vertices: Option<Vec<u32>>,
}

impl Body {
    /// Returns the triangle of the mesh as given that a face is.
    pub fn triangle(&self, face: u32) -> u32 {
        let face = face - self.faces.start;
        self.numbers.as_ref().map_or(face, |numbers| numbers[face as usize])
    }

    /// Returns the vertex of the mesh as given that a point is.
    pub fn vertex(&self, point: u32) -> u32 {
        let point = point - self.points.start;
        self.vertices.as_ref().map_or(point, |vertices| vertices[point as usize])
    }

    /// Returns a reason whose triangles are faces of this body, with their numbers in the mesh as given.
    pub fn as_given(&self, why: Unproved) -> Unproved {
        match &self.numbers {
            Some(numbers) => why.renumbered(|face| numbers[face as usize]),
            None => why,
        }
    }
}

/// All bodies. Points and faces are numbered through all of them.
#[derive(Debug, Default)]
pub(super) struct Bodies {
    /// Lattice points, which are integers.
    pub points: Vec<DVec3>,
    pub faces: Vec<[u32; 3]>,
    pub bodies: Vec<Body>,
    /// Where the result lies.
    pub region: Region,
    /// A bound on the volume between the surfaces as given and on the lattice within the region, in cubic steps.
    pub displaced: f64,
    directions: Directions,
    /// The complement of the lowest point at which a body was found to touch itself although it trembles.
    touching: AtomicU32,
    /// The numbers of points and of faces that there will be at most.
    room: [usize; 2],
}

impl Bodies {
    /// Returns an empty list of bodies, with room for the points and faces of some solids, whose result lies in a region.
    pub fn with_room_for(solids: &[&ClosedMesh], region: Region) -> Bodies {
        let points = solids.iter().map(|solid| solid.mesh().positions.len()).sum();
        let faces = solids.iter().map(|solid| solid.mesh().triangles.len()).sum();
        Bodies { room: [points, faces], region, ..Bodies::default() }
    }

    /// Adds a solid, as one body or as its shells, that grows at a rate or rests.
    ///
    /// # Errors
    /// A mesh that is not consistently oriented, or many of whose faces lose their corners to the lattice.
    pub fn add(
        &mut self,
        solid: usize,
        mesh: &ClosedMesh,
        lattice: &Lattice,
        wholeness: Wholeness,
        rate: Option<i32>,
    ) -> Result<(), Unproved> {
        if !mesh.oriented() {
            return Err(Unproved::NotOriented);
        }
        // The arrays of the first solid become those of all.
        let room = if self.points.is_empty() { self.room } else { [0; 2] };
        let rounded = Rounded::of(mesh.mesh(), (lattice, &self.region), room);
        if rounded.has_lost_many(mesh.mesh()) {
            return Err(Unproved::TooSmall);
        }
        let Rounded { mesh, numbers, vertices, displaced } = rounded;
        self.displaced += displaced;
        match wholeness {
            Wholeness::Whole => {
                self.push(solid, mesh, wholeness, rate.map(|rate| SHELLS * rate), [numbers, vertices]);
            }
            Wholeness::Shells | Wholeness::Crossed => {
                let (mesh, numbers, vertices) = match wholeness {
                    Wholeness::Crossed => crossed::prepare(mesh, numbers, vertices),
                    _ => (mesh, numbers, vertices),
                };
                // Shells grow at different rates, so that those that are flush part.
                for (number, faces) in (0..).zip(shells(&mesh)) {
                    let rate = rate.map(|rate| SHELLS * rate + i32::min(number, SHELLS - 1));
                    let (shell, points) =
                        mesh.of_triangles(faces.iter().map(|&face| mesh.triangles[face as usize]).collect());
                    let as_given = |numbers: &Option<Vec<u32>>, own: Vec<u32>| match numbers {
                        Some(numbers) => own.into_iter().map(|index| numbers[index as usize]).collect(),
                        None => own,
                    };
                    let (faces, points) = (as_given(&numbers, faces), as_given(&vertices, points));
                    self.push(solid, shell, wholeness, rate, [Some(faces), Some(points)]);
                }
            }
        }
        Ok(())
    }

    fn push(
        &mut self,
        solid: usize,
        mesh: TriangleMesh,
        wholeness: Wholeness,
        rate: Option<i32>,
        [numbers, vertices]: [Option<Vec<u32>>; 2],
    ) {
        let (point, face) = (self.points.len() as u32, self.faces.len() as u32);
        let (runs, is_inside_out) = measure(&mesh);
        let extent = runs.iter().copied().fold(Box32::EMPTY, Box32::union);
        let (turn, front) = match wholeness {
            // Inside-out, a whole solid is the same solid.
            Wholeness::Whole => (is_inside_out, 0),
            _ => (false, if is_inside_out { -1 } else { 0 }),
        };
        let is_crossed = wholeness == Wholeness::Crossed;
        let (rate, is_growing) = (rate.unwrap_or(0), rate.is_some());
        let renumber = |[a, b, c]: [u32; 3]| {
            let [b, c] = if turn { [c, b] } else { [b, c] };
            [a, b, c].map(|index| index + point)
        };
        if point == 0 {
            // Taken as they are: copies of large arrays take longer than all else here.
            (self.points, self.faces) = (mesh.positions, mesh.triangles);
            if turn {
                self.faces.par_iter_mut().for_each(|face| *face = renumber(*face));
            }
        } else {
            self.points.par_extend(mesh.positions);
            self.faces.par_extend(mesh.triangles.into_par_iter().map(renumber));
        }
        let (points, faces) = (point..self.points.len() as u32, face..self.faces.len() as u32);
        self.bodies.push(Body {
            solid,
            faces,
            points,
            extent,
            runs,
            front,
            is_crossed,
            rate,
            is_growing,
            numbers,
            vertices,
        });
    }

    /// Returns the corners of a face.
    #[inline]
    pub fn corners(&self, face: u32) -> [DVec3; 3] {
        self.faces[face as usize].map(|index| self.points[index as usize])
    }

    /// Returns the box of a face.
    #[inline]
    pub fn extent(&self, face: u32) -> Box32 {
        Box32::around(self.corners(face))
    }

    /// Returns the hierarchy of all faces of a body.
    pub fn tree(&self, body: &Body) -> FaceTree {
        let faces = body.faces.clone().into_par_iter().with_min_len(CHUNK).map(|face| (face, self.extent(face)));
        FaceTree::new(&body.extent, faces, |face| self.extent(face))
    }

    /// Returns the runs of a body's faces, with their boxes.
    pub fn runs<'a>(
        &self,
        body: &'a Body,
    ) -> impl IndexedParallelIterator<Item = (&'a Box32, Range<u32>)> + Clone + use<'a> {
        let Range { start, end } = body.faces;
        let faces = move |run: usize| {
            let first = start + (run * FACES_OF_RUN) as u32;
            first..end.min(first + FACES_OF_RUN as u32)
        };
        let runs = body.runs.par_iter().enumerate().with_min_len(CHUNK / FACES_OF_RUN);
        runs.map(move |(run, extent)| (extent, faces(run)))
    }

    /// Returns the faces of a body in runs of which `is_near` accepts the box.
    pub fn faces_in_runs(
        &self,
        body: &Body,
        is_near: impl Fn(&Box32) -> bool + Sync + Send,
    ) -> impl ParallelIterator<Item = u32> {
        self.runs(body).filter(move |(extent, _)| is_near(extent)).flat_map_iter(|(_, faces)| faces)
    }

    /// Returns the plane of a face.
    pub fn plane(&self, face: u32) -> Plane<'_> {
        let body = self.body_of_face(face);
        Plane::new(self.faces[face as usize].map(|point| Vertex::of(self, point, body)))
    }

    /// Returns a point.
    pub fn vertex(&self, point: u32) -> Vertex<'_> {
        Vertex::of(self, point, self.body_of_point(point))
    }

    /// Returns the corners of a face from one of them on.
    pub fn corners_from(&self, face: u32, point: u32) -> [u32; 3] {
        let corners = self.faces[face as usize];
        let first = corners.iter().position(|&corner| corner == point).expect("the point is a corner of the face");
        [0, 1, 2].map(|i| corners[(first + i) % 3])
    }

    /// Returns the ends of an edge.
    pub fn ends(&self, edge: [u32; 2]) -> [Vertex<'_>; 2] {
        let body = self.body_of_point(edge[0]);
        edge.map(|point| Vertex::of(self, point, body))
    }

    /// Returns the vector, in infinitesimal steps, by which a point of a body moves as the body grows or trembles.
    pub fn growth(&self, point: u32, body: u32) -> I64Vec3 {
        let &Body { rate, is_crossed, is_growing, .. } = &self.bodies[body as usize];
        let grown = match rate {
            0 => I64Vec3::ZERO,
            rate => i64::from(rate) * self.directions.of(self, point),
        };
        match (is_crossed, is_growing) {
            (false, _) => grown,
            (true, false) => crossed::tremor(point),
            // Growth decides where faces of two bodies coincide.
            (true, true) => grown + (crossed::tremor(point) >> 16),
        }
    }

    /// Returns whether a body grows or trembles.
    pub fn grows(&self, body: u32) -> bool {
        let body = &self.bodies[body as usize];
        body.rate != 0 || body.is_crossed
    }

    /// Notes that the body of a point touches itself there, or at a face of that point, if it is one that meets itself.
    pub fn note_touching(&self, point: u32) {
        if self.bodies[self.body_of_point(point) as usize].is_crossed {
            self.touching.fetch_max(!point, Ordering::Relaxed);
        }
    }

    /// Returns a face of which it was noted that it touches others of its body.
    pub fn touching_face(&self) -> Option<u32> {
        let point = Some(!self.touching.load(Ordering::Relaxed)).filter(|&point| point != u32::MAX)?;
        self.faces.iter().position(|face| face.contains(&point)).map(|face| face as u32)
    }

    /// Returns a reason that refers to a face, with the face's number in the mesh as given.
    pub fn refusal(&self, face: u32, why: impl Fn(usize) -> Unproved) -> NotExact {
        let body = &self.bodies[self.body_of_face(face) as usize];
        NotExact { input: body.solid, why: body.as_given(why((face - body.faces.start) as usize)) }
    }

    /// Returns the corners that faces share.
    pub fn shared_corners(&self, one: u32, other: u32) -> impl Iterator<Item = u32> {
        let [a, b] = [one, other].map(|face| self.faces[face as usize]);
        a.into_iter().filter(move |point| b.contains(point))
    }

    /// Returns the body of a face.
    pub fn body_of_face(&self, face: u32) -> u32 {
        self.bodies.partition_point(|body| body.faces.end <= face) as u32
    }

    /// Returns the body of a point.
    pub fn body_of_point(&self, point: u32) -> u32 {
        self.bodies.partition_point(|body| body.points.end <= point) as u32
    }

    /// Returns the solid of a point and the point's number in the mesh as given, unless the number is beyond all points.
    pub fn given_vertex(&self, point: u32) -> Option<(usize, u32)> {
        let body = self.bodies.get(self.body_of_point(point) as usize)?;
        Some((body.solid, body.vertex(point)))
    }

    /// Returns the solid of a face.
    pub fn solid_of_face(&self, face: u32) -> usize {
        self.bodies[self.body_of_face(face) as usize].solid
    }
}

/// A mesh on the lattice, with one position per point and no face with a repeated corner.
struct Rounded {
    mesh: TriangleMesh,
    /// The number of each face in the mesh as given, unless all are in order.
    numbers: Option<Vec<u32>>,
    /// The number of each point in the mesh as given, unless all are in order.
    vertices: Option<Vec<u32>>,
    /// A bound on the volume between the two within a region, in cubic steps.
    displaced: f64,
}

impl Rounded {
    /// Rounds a mesh, into arrays with room for at least some points and faces.
    fn of(
        mesh: &TriangleMesh,
        (lattice, region): (&Lattice, &Region),
        [room_for_points, room_for_faces]: [usize; 2],
    ) -> Rounded {
        let TriangleMesh { positions, triangles } = mesh;
        let round = |&position: &DVec3| {
            let (point, moved) = lattice.round(position);
            // The length of the displacement, rounded upwards.
            let moved = if moved == DVec3::ZERO { 0.0 } else { (moved.length() as f32).next_up() };
            (point, moved)
        };
        let (mut points, mut moved) = (vec_with_room(positions.len().max(room_for_points)), Vec::new());
        positions.par_iter().with_min_len(CHUNK).map(round).unzip_into_vecs(&mut points, &mut moved);
        let displaced = match moved.par_iter().any(|&moved| moved > 0.0) {
            true => {
                let swept = triangles.par_chunks(CHUNK).map(|chunk| swept(chunk, (&points, &moved), region));
                swept.collect::<Vec<f64>>().iter().sum()
            }
            false => 0.0,
        };
        drop(moved);
        let weld = Weld::of(&points);
        let count = points.len();
        weld.retain(&mut points);
        let Weld { kept, new_index } = weld;
        let mut welded = vec_with_room(triangles.len().max(room_for_faces));
        let renumber = |triangle: &[u32; 3]| triangle.map(|index| new_index[index as usize]);
        welded.par_extend(triangles.par_iter().with_min_len(CHUNK).map(renumber));
        drop(new_index);
        let vertices = (kept.len() < count).then_some(kept);
        let mut mesh = TriangleMesh { positions: points, triangles: welded };
        let is_face = |[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
        let kept = || (0..).zip(&mesh.triangles).filter(|(_, triangle)| is_face(triangle)).map(|(face, _)| face);
        let numbers: Option<Vec<u32>> = (!mesh.triangles.par_iter().all(is_face)).then(|| kept().collect());
        if numbers.is_some() {
            mesh.triangles.retain(is_face);
        }
        Rounded { mesh, numbers, vertices, displaced }
    }

    /// Returns whether the corners of many given faces fell together. The others then lie on one another in such numbers that the pairs
    /// fill the memory, and what is left says little about the solid.
    fn has_lost_many(&self, given: &TriangleMesh) -> bool {
        let TriangleMesh { positions, triangles } = given;
        let is_face = |triangle: &&[u32; 3]| {
            let [a, b, c] = triangle.map(|index| positions[index as usize]);
            a != b && b != c && c != a
        };
        let left = self.mesh.triangles.len();
        let are_many = |count: usize| count - left > LOST && (count - left) * LOST_OF > count;
        // Mostly all faces are left.
        are_many(triangles.len()) && are_many(triangles.iter().filter(is_face).count())
    }
}

/// Returns the boxes of runs of faces, and whether the mesh is inside-out.
fn measure(mesh: &TriangleMesh) -> (Vec<Box32>, bool) {
    let origin = mesh.triangles.first().map_or(DVec3::ZERO, |face| mesh.positions[face[0] as usize]);
    let of_run = |run: &[[u32; 3]]| {
        let mut bounds = Aabb { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
        let mut volume = Sum::default();
        for face in run {
            let [a, b, c] = face.map(|index| mesh.positions[index as usize]);
            bounds = Aabb { min: bounds.min.min(a.min(b).min(c)), max: bounds.max.max(a.max(b).max(c)) };
            volume.add((a - origin).dot((b - origin).cross(c - origin)));
        }
        (Box32::of(bounds), volume)
    };
    let (runs, volumes): (Vec<Box32>, Vec<Sum>) =
        mesh.triangles.par_chunks(FACES_OF_RUN).with_min_len(CHUNK / FACES_OF_RUN).map(of_run).unzip();
    let mut volume = Sum::default();
    volumes.into_iter().for_each(|of_run| volume.join(of_run));
    (runs, volume.total() < 0.0)
}

/// Returns a bound on the volume that triangles sweep within a region while their corners move: the greatest displacement times the
/// greatest area, or the greatest section of the region.
fn swept(triangles: &[[u32; 3]], (points, moved): (&[DVec3], &[f32]), region: &Region) -> f64 {
    let section = region.greatest_section();
    let of = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|index| points[index as usize]);
        if !region.touches([a, b, c]) {
            return 0.0;
        }
        let farthest = triangle.iter().fold(0.0, |most: f32, &index| most.max(moved[index as usize]));
        let (u, v) = (b - a, c - a);
        let slack = 1.0 + u.length() + v.length();
        f64::from(farthest) * (0.5 * u.cross(v).length() + 2.0 * slack).min(section)
    };
    triangles.iter().map(of).sum()
}

/// Returns the faces of the closed parts of a mesh, in order.
fn shells(mesh: &TriangleMesh) -> Vec<Vec<u32>> {
    let parts = UnionFind::new(mesh.triangles.len() as u32);
    for_each_seam(mesh, |_, [a, b], _| parts.join(a, b));
    let mut order: Vec<(u32, u32)> =
        parts.roots().into_iter().enumerate().map(|(face, root)| (root, face as u32)).collect();
    order.par_sort_unstable();
    order.chunk_by(|a, b| a.0 == b.0).map(|faces| faces.iter().map(|&(_, face)| face).collect()).collect()
}

/// Calls `each` with the two faces at each side and its points, and a number of these faces among those at the side. Where more than
/// two faces share a side, those that follow one another in the order of the mesh are taken to belong together, as in a file that
/// lists its shells one by one.
pub(super) fn for_each_seam(mesh: &TriangleMesh, each: impl Fn(usize, [u32; 2], [u32; 2]) + Sync) {
    let mut sides: Vec<(u32, u32, u32, bool)> = (0..mesh.triangles.len() as u32)
        .into_par_iter()
        .flat_map_iter(|face| {
            let [a, b, c] = mesh.triangles[face as usize];
            [(a, b), (b, c), (c, a)].map(|(u, v)| (u.min(v), u.max(v), face, u < v))
        })
        .collect();
    sides.par_sort_unstable();
    sides.par_chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).for_each(|uses| {
        let (mut unpaired, mut pairs) = (Vec::<(u32, bool)>::new(), 0);
        for &(u, v, face, is_upwards) in uses {
            match unpaired.last() {
                Some(&(other, direction)) if direction != is_upwards => {
                    each(pairs, [other, face], [u, v]);
                    unpaired.pop();
                    pairs += 1;
                }
                _ => unpaired.push((face, is_upwards)),
            }
        }
    });
}
