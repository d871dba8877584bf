//! The cells beside a block of finer ones: their loops and vertices.
//!
//! A cell that shares a face or an edge with a cell that finer ones replace has parts of faces and edges instead of whole ones. The
//! surface leaves arcs on the parts as on whole ones, and loops of arcs again have one vertex each. So the mesh stays closed and a
//! manifold, by construction: each crossed part of an edge has one polygon, whose corners are the loops around it (Ju et al. 2002, the
//! minimal edges of an octree), and each arc, which is a side of a polygon, belongs to two.
//!
//! Nothing is cut on the border: crossings of a part of an edge that cancel are dropped.
//!
//! The triangles from a vertex of the border to a row of finer cells fold over one another if it lies beside the row's end. All crossings
//! of a loop draw it there, as most of them are on the side of the finer cells; with weights by which the parts of a face count as much
//! as a whole one, it lies near the middle of its cell. The first place is tried, as it needs the smaller triangles, and the second taken
//! where they cross.

use std::collections::{BTreeMap, HashMap};

use glam::{DVec3, Vec3};

use super::cells::{APART, REACH, bounds_of, grid_bounds, target_of};
use super::cuts::{Cuts, cells_around, edge_of};
use super::edges::{Source, UNKNOWN};
use super::feature::Feature;
use super::pairing::{Face, are_joined, joined_faces};
use super::part::{CellMap, CellSet};
use super::qef::{Bounds, Loop, Place};
use crate::cell::{Signs, arcs, edge_at, edge_between, face_corners, is_ambiguous, loops};
use crate::grid::Grid;

/// The relation of the cells of a block to those that they replace.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// Cells are replaced by 2^levels along each axis.
    pub levels: u32,
    /// The first finer cell of cell 0.
    pub offset: [i32; 3],
}

impl Scale {
    /// Returns the first of the finer cells of a cell, or the finer node at a node.
    pub fn fine(self, at: [i32; 3]) -> [i32; 3] {
        std::array::from_fn(|i| (at[i] << self.levels) + self.offset[i])
    }

    /// Returns the cell that a finer cell lies in.
    pub fn coarse(self, fine: [i32; 3]) -> [i32; 3] {
        std::array::from_fn(|i| (fine[i] - self.offset[i]) >> self.levels)
    }

    /// Returns the number of finer cells in a cell along each axis.
    pub fn parts(self) -> i32 {
        1 << self.levels
    }

    /// Converts coordinates of finer cells.
    pub fn place(self, fine: DVec3) -> DVec3 {
        (fine - DVec3::from_array(self.offset.map(f64::from))) / f64::from(self.parts())
    }

    /// Converts to coordinates of finer cells.
    pub fn fine_place(self, place: DVec3) -> DVec3 {
        place * f64::from(self.parts()) + DVec3::from_array(self.offset.map(f64::from))
    }
}

/// A crossed edge of a cell: a whole one, or one of the parts of an edge, in coordinates of finer cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
struct Edge {
    is_whole: bool,
    axis: usize,
    node: [i32; 3],
}

/// A cell beside a block, and its loops.
#[derive(Clone, Debug)]
pub struct BorderCell {
    /// The number of its first vertex among those of the border.
    pub first: u32,
    pub count: u32,
    /// For each of its edges that is whole the loop of the crossing.
    pub of_whole: [u16; 12],
}

/// The vertex of a loop, in coordinates of cells.
#[derive(Clone, Copy, Debug)]
pub struct BorderVertex {
    pub place: DVec3,
    /// The place that a contour of the finer cells tries first, nearer to these.
    pub start: DVec3,
    /// The mean of the crossings, to which it is pulled back where triangles would cross one another.
    pub mean: DVec3,
    /// The place on its feature, if that is beyond its cell.
    pub target: Option<DVec3>,
    pub facing: Vec3,
}

impl BorderVertex {
    /// Returns it as a feature, with its place and its mean in the coordinates of a contour.
    pub fn feature(&self, vertex: u32, [held, mean]: [DVec3; 2]) -> Feature {
        let facing = self.facing;
        Feature { vertex, target: None, held, mean, facing, is_alone: false, is_between: true }
    }
}

/// The border of a block.
pub struct Border {
    pub scale: Scale,
    /// The cells beside the block that the surface passes.
    pub cells: BTreeMap<[i32; 3], BorderCell>,
    pub vertices: Vec<BorderVertex>,
    of_part: HashMap<([i32; 3], usize, [i32; 3]), u32>,
    /// The joined faces between finer cells and the border.
    pub joined: Vec<Face>,
    /// The box of the whole grid, in coordinates of finer cells.
    pub limits: Bounds,
}

/// The input of a border.
pub struct Sides<'a> {
    pub source: &'a Source<'a>,
    pub grid: &'a Grid,
    /// The cells that are replaced.
    pub replaced: &'a CellSet,
    /// The finer images.
    pub fine: &'a Source<'a>,
    pub scale: Scale,
}

impl Border {
    /// Finds the loops of the cells beside a block, and places their vertices.
    pub fn new(sides: &Sides, beside: &CellSet, cuts: &Cuts) -> Border {
        let mut tracer = Tracer { sides, cuts, joined: HashMap::new(), paired: HashMap::new() };
        let mut beside: Vec<Outer> = beside.iter().map(|&cell| tracer.outer(cell)).collect();
        beside.sort_unstable_by_key(|outer| outer.cell);
        tracer.propose(&beside);
        let traced = beside.iter().map(|outer| (outer.cell, tracer.trace(outer)));
        let mut traced: CellMap<Traced> = traced.filter(|(_, traced)| traced.count > 0).collect();
        beside.retain(|outer| traced.contains_key(&outer.cell));
        tracer.mend(&beside, &mut traced);
        let joined = tracer.joined.iter().filter(|(_, joined)| **joined).map(|(face, _)| *face).collect();
        let mut border = Border { joined, ..Border::empty(sides.scale, sides.grid) };
        for Outer { cell, .. } in beside {
            border.add(sides, cell, &traced[&cell]);
        }
        border
    }

    /// Returns a border without cells.
    pub fn empty(scale: Scale, grid: &Grid) -> Border {
        let (cells, of_part) = (BTreeMap::new(), HashMap::new());
        let Bounds { least, greatest } = grid_bounds(grid);
        let limits = Bounds { least: scale.fine_place(least), greatest: scale.fine_place(greatest) };
        Border { scale, cells, vertices: Vec::new(), of_part, joined: Vec::new(), limits }
    }

    /// Returns the vertex of the loop that a part of an edge belongs to in the cell that holds a finer one.
    pub fn vertex(&self, fine: [i32; 3], axis: usize, node: [i32; 3]) -> u32 {
        self.of_part[&(self.scale.coarse(fine), axis, node)]
    }

    /// Returns the vertices as features in coordinates of finer cells, and where they start.
    pub fn features(&self) -> impl Iterator<Item = (Feature, DVec3)> {
        let fine = |place: DVec3| self.scale.fine_place(place);
        let feature = move |(number, vertex): (u32, &BorderVertex)| {
            (vertex.feature(number, [vertex.place, vertex.mean].map(fine)), fine(vertex.start))
        };
        (0..).zip(&self.vertices).map(feature)
    }

    /// Takes the places of the vertices from a contour of the finer cells, which begins with them.
    pub fn take_places(&mut self, of_contour: &[DVec3]) {
        let scale = self.scale;
        let places = self.vertices.iter_mut().zip(of_contour);
        places.for_each(|(vertex, &place)| vertex.place = scale.place(place));
    }

    fn add(&mut self, sides: &Sides, cell: [i32; 3], traced: &Traced) {
        let first = self.vertices.len() as u32;
        let mut of_whole = [u16::MAX; 12];
        let mut points = vec![Vec::new(); traced.count as usize];
        let base = DVec3::from_array(cell.map(f64::from));
        for (edge, &number) in &traced.of_edge {
            let Edge { is_whole, axis, node } = *edge;
            if is_whole {
                let [u, v] = [(axis + 1) % 3, (axis + 2) % 3].map(|i| (node[i] - cell[i]) as usize);
                of_whole[edge_at(axis, u, v)] = number;
            } else {
                self.of_part.insert((cell, axis, node), first + u32::from(number));
            }
            let source = if is_whole { sides.source } else { sides.fine };
            // A ray that does not close has no crossings.
            let crossing = source.first_crossing(axis, node).unwrap_or(UNKNOWN);
            let place = crossing.place(axis, node);
            let place = if is_whole { place } else { sides.scale.place(place) };
            points[usize::from(number)].push((place - base, crossing.normal, is_whole));
        }
        let whole = grid_bounds(sides.grid);
        let bounds = bounds_of(cell, &whole);
        let placed = |of_part: f64| -> Vec<Place> {
            let weight = |is_whole: bool| if is_whole { 1.0 } else { of_part };
            let weighted = |&(place, normal, is_whole): &_| (place, normal, weight(is_whole));
            let of_loop = |points: &Vec<_>| Loop::of(&points.iter().map(weighted).collect::<Vec<_>>());
            points.iter().map(|points| of_loop(points).place(&bounds, REACH)).collect()
        };
        // In the middle of the cell a face in many parts weighs no more than a whole one; nearer to the parts, their triangles are smaller.
        let (places, starts) = (placed(1.0 / f64::from(sides.scale.parts())), placed(1.0));
        let are_apart = |all: &[Place]| {
            (0..all.len()).all(|i| all[..i].iter().all(|other| other.held.distance(all[i].held) >= APART))
        };
        let [are_held, may_start] = [&places, &starts].map(|all| are_apart(all));
        let within = |place: &Place, is_held| base + if is_held { place.held } else { place.mean };
        for (place, start) in places.iter().zip(&starts) {
            let target = target_of(place, &whole.from(base)).filter(|_| are_held);
            self.vertices.push(BorderVertex {
                place: within(place, are_held),
                start: within(start, may_start),
                mean: base + place.mean,
                target: target.map(|target| base + target),
                facing: place.facing.as_vec3(),
            });
        }
        self.cells.insert(cell, BorderCell { first, count: traced.count, of_whole });
    }
}

/// The loops of a cell.
struct Traced {
    count: u32,
    of_edge: BTreeMap<Edge, u16>,
}

/// A cell beside a block, with what its loops depend on.
struct Outer {
    cell: [i32; 3],
    /// Its corners that are inside, as bits.
    inside: u8,
    /// Which of the 27 cells around it and of its own are replaced, as bits, that of x before y before z.
    replaced: u32,
}

impl Outer {
    /// Returns whether the cell at a distance of at most one along each axis is replaced.
    fn is_replaced(&self, [x, y, z]: [i32; 3]) -> bool {
        self.replaced >> (x + 1 + 3 * (y + 1) + 9 * (z + 1)) & 1 == 1
    }

    /// Returns whether finer cells share a face.
    fn is_shared(&self, axis: usize, side: usize) -> bool {
        self.is_replaced(moved([0; 3], axis, 2 * side as i32 - 1))
    }

    /// Returns whether no finer cell has a part of an edge.
    fn is_whole(&self, edge: usize) -> bool {
        let (axis, low) = edge_of([0; 3], edge);
        cells_around(axis, low).iter().all(|(cell, _)| !self.is_replaced(*cell))
    }
}

/// Follows arcs on the faces of cells beside a block.
struct Tracer<'a> {
    sides: &'a Sides<'a>,
    cuts: &'a Cuts,
    /// The ambiguous faces between finer cells and the border, and whether they are joined.
    joined: HashMap<Face, bool>,
    /// The arcs of whole faces on which they are paired otherwise, as the cell above sees them.
    paired: HashMap<Face, Vec<[Edge; 2]>>,
}

fn moved(mut cell: [i32; 3], axis: usize, by: i32) -> [i32; 3] {
    cell[axis] += by;
    cell
}

impl Tracer<'_> {
    fn outer(&self, cell: [i32; 3]) -> Outer {
        let around = (0..27).map(|i| std::array::from_fn(|axis| cell[axis] + i / 3i32.pow(axis as u32) % 3 - 1));
        let is_replaced = |(i, cell): (u32, [i32; 3])| u32::from(self.sides.replaced.contains(&cell)) << i;
        let replaced = (0..).zip(around).map(is_replaced).sum();
        Outer { cell, inside: self.sides.source.corners_inside(cell), replaced }
    }

    /// Returns the finer cells within a cell that lie on a face of it.
    fn behind(&self, cell: [i32; 3], axis: usize, side: usize) -> impl Iterator<Item = [i32; 3]> + use<> {
        let (first, parts) = (self.sides.scale.fine(cell), self.sides.scale.parts());
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        (0..parts * parts).map(move |at| {
            let mut fine = first;
            fine[axis] += side as i32 * (parts - 1);
            fine[u] += at % parts;
            fine[v] += at / parts;
            fine
        })
    }

    /// Returns the corners of a face of a finer cell that are inside, as bits of the cell's corners.
    fn inside_of_face(&self, fine: [i32; 3], axis: usize, side: usize) -> u8 {
        let corners = face_corners(axis, side).into_iter();
        corners.fold(0, |bits, corner| {
            let node = [0, 1, 2].map(|i| fine[i] + (corner >> i & 1) as i32);
            bits | u8::from(self.sides.fine.is_inside(node)) << corner
        })
    }

    fn propose(&mut self, beside: &[Outer]) {
        for outer in beside {
            let sides = (0..6).map(|face| (face / 2, face % 2));
            for (axis, side) in sides.filter(|&(axis, side)| outer.is_shared(axis, side)) {
                for fine in self.behind(outer.cell, axis, side) {
                    let inside = self.inside_of_face(fine, axis, side);
                    if is_ambiguous(inside, axis, side) {
                        let face = (moved(fine, axis, side as i32), axis);
                        let lowered = if side == 1 { inside >> (1 << axis) } else { inside };
                        self.joined.insert(face, are_joined(self.sides.fine, lowered, face));
                    }
                }
            }
        }
    }

    /// Returns the arcs on a part of a face, from edge to edge.
    fn arcs_of_part(&self, fine: [i32; 3], axis: usize, side: usize) -> Vec<[Edge; 2]> {
        let inside = self.inside_of_face(fine, axis, side);
        if inside == 0 || inside.count_ones() == 4 {
            return Vec::new();
        }
        let is_joined = is_ambiguous(inside, axis, side)
            && self.joined.get(&(moved(fine, axis, side as i32), axis)).copied().unwrap_or(false);
        let signs = Signs { inside, joined: u8::from(is_joined) << (2 * axis + side), cut: 0 };
        let edge = |crossing: usize| {
            let (axis, node) = edge_of(fine, crossing);
            Edge { is_whole: false, axis, node }
        };
        arcs(signs, axis, side).into_iter().flatten().map(|arc| arc.map(edge)).collect()
    }

    /// Returns the arcs on a face that is whole, although its edges may not be.
    fn arcs_of_face(&self, outer: &Outer, axis: usize, side: usize) -> Vec<[Edge; 2]> {
        if let Some(arcs) = self.paired.get(&(moved(outer.cell, axis, side as i32), axis)) {
            // From below, arcs run the other way.
            return arcs.iter().map(|&[from, to]| if side == 0 { [from, to] } else { [to, from] }).collect();
        }
        let crossings = self.around(outer, axis, side);
        let count = crossings.len();
        let leaving = (0..count).filter(|&i| crossings[i].1);
        leaving.map(|i| [crossings[i].0, crossings[(i + count - 1) % count].0]).collect()
    }

    /// Walks around a face counter-clockwise, seen from outside, and returns the crossed edges and whether the walk leaves the inside
    /// there.
    fn around(&self, outer: &Outer, axis: usize, side: usize) -> Vec<(Edge, bool)> {
        let Sides { fine, scale, .. } = self.sides;
        let corners = face_corners(axis, side);
        let mut found = Vec::new();
        for i in 0..4 {
            let (from, to) = (corners[i], corners[(i + 1) % 4]);
            let edge = edge_between(from, to);
            let (along, node) = edge_of(outer.cell, edge);
            if outer.is_whole(edge) {
                let [leaves, enters] = [from, to].map(|corner| outer.inside >> corner & 1 == 1);
                if leaves != enters {
                    found.push((Edge { is_whole: true, axis: along, node }, leaves));
                }
                continue;
            }
            let first = found.len();
            let start = scale.fine(node);
            let mut is_inside = fine.is_inside(start);
            for step in 0..scale.parts() {
                let leaves = std::mem::replace(&mut is_inside, fine.is_inside(moved(start, along, step + 1)));
                if leaves != is_inside {
                    found.push((Edge { is_whole: false, axis: along, node: moved(start, along, step) }, leaves));
                }
            }
            if from > to {
                found[first..].reverse();
                found[first..].iter_mut().for_each(|(_, leaves)| *leaves = !*leaves);
            }
        }
        found
    }

    fn trace(&self, outer: &Outer) -> Traced {
        let mut next: BTreeMap<Edge, Edge> = BTreeMap::new();
        for face in 0..6 {
            let (axis, side) = (face / 2, face % 2);
            if outer.is_shared(axis, side) {
                let parts = self.behind(outer.cell, axis, side);
                next.extend(parts.flat_map(|fine| self.arcs_of_part(fine, axis, side)).map(|[from, to]| (from, to)));
            } else {
                next.extend(self.arcs_of_face(outer, axis, side).into_iter().map(|[from, to]| (from, to)));
            }
        }
        let mut traced = Traced { count: 0, of_edge: BTreeMap::new() };
        for &start in next.keys() {
            let mut edge = start;
            while let std::collections::btree_map::Entry::Vacant(entry) = traced.of_edge.entry(edge) {
                entry.insert(traced.count as u16);
                edge = next[&edge];
                if edge == start {
                    traced.count += 1;
                }
            }
        }
        traced
    }

    /// Pairs arcs otherwise on faces where four polygons would meet in one edge. Two arcs of one loop that exchange their ends split it,
    /// and no other loop changes, so that what was paired stays right.
    fn mend(&mut self, beside: &[Outer], traced: &mut CellMap<Traced>) {
        for outer @ &Outer { cell, .. } in beside {
            for face in 0..6 {
                let (axis, side) = (face / 2, face % 2);
                let other = moved(cell, axis, 2 * side as i32 - 1);
                if outer.is_shared(axis, side) {
                    for fine in self.behind(cell, axis, side) {
                        let key = (moved(fine, axis, side as i32), axis);
                        let Some(&is_joined) = self.joined.get(&key) else { continue };
                        let arcs = self.arcs_of_part(fine, axis, side);
                        let own = |edge: &Edge| traced[&cell].of_edge[edge];
                        let beyond = moved(fine, axis, 2 * side as i32 - 1);
                        let of_beyond = loops(self.signs(beyond)).of_crossing;
                        let across = |edge: &Edge| u16::from(of_beyond[number(beyond, edge)]);
                        if same(&arcs, own) && same(&arcs, across) {
                            self.joined.insert(key, !is_joined);
                            traced.insert(cell, self.trace(outer));
                        }
                    }
                } else if side == 0 && traced.contains_key(&other) {
                    let mut arcs = self.arcs_of_face(outer, axis, side);
                    let loops = |traced: &CellMap<Traced>, [from, _]: &[Edge; 2]| {
                        [cell, other].map(|cell| traced[&cell].of_edge[from])
                    };
                    let find = |traced: &CellMap<Traced>, arcs: &[[Edge; 2]]| {
                        let all: Vec<[u16; 2]> = arcs.iter().map(|arc| loops(traced, arc)).collect();
                        (1..all.len()).find_map(|j| Some((all[..j].iter().position(|one| *one == all[j])?, j)))
                    };
                    while let Some((i, j)) = find(traced, &arcs) {
                        (arcs[i][1], arcs[j][1]) = (arcs[j][1], arcs[i][1]);
                        self.paired.insert((cell, axis), arcs.clone());
                        traced.insert(cell, self.trace(outer));
                        traced.insert(other, self.trace(&self.outer(other)));
                    }
                }
            }
        }
    }

    /// Returns the signs of a finer cell of the block, with the proposed pairings of its own faces.
    fn signs(&self, fine: [i32; 3]) -> Signs {
        let inside = self.sides.fine.corners_inside(fine);
        let cut = self.cuts.in_cell(fine);
        let mut joined = joined_faces(self.sides.fine, inside, fine) | cut.joined;
        for face in 0..6 {
            if let Some(&is_joined) = self.joined.get(&(moved(fine, face / 2, (face % 2) as i32), face / 2)) {
                joined = joined & !(1 << face) | u8::from(is_joined) << face;
            }
        }
        Signs { inside, joined, cut: cut.cut }
    }
}

/// Returns the number of an edge of a finer cell in it.
fn number(fine: [i32; 3], edge: &Edge) -> usize {
    let [u, v] = [(edge.axis + 1) % 3, (edge.axis + 2) % 3].map(|i| (edge.node[i] - fine[i]) as usize);
    edge_at(edge.axis, u, v)
}

/// Returns whether two of some arcs belong to one loop.
fn same(arcs: &[[Edge; 2]], of: impl Fn(&Edge) -> u16) -> bool {
    let numbers: Vec<u16> = arcs.iter().map(|[from, _]| of(from)).collect();
    (1..numbers.len()).any(|i| numbers[..i].contains(&numbers[i]))
}
