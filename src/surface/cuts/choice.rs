//! The choice of the edges that are cut for walls and gaps thinner than the lattice.
//!
//! Not all edges that rays cross twice are cut: beside every sharp edge of a solid, rays cut its tip off. What is thin is known by
//! the normals of its two sides, which are nearly opposite; by a cell whose corners have one sign, although cut edges divide
//! them; or by an edge that divides the corners of all four cells around it. From there walls and gaps are followed, from edge to
//! edge of one cell, as far as they divide the corners in front of them from those behind. Where that ends lies their rim, in the
//! cells around their last edges; it may be off by a pitch along them.
//!
//! A face with cut edges is joined where the normals at the ends of its arcs agree better so: an arc between opposite normals closes
//! a wall, or bridges a gap. Where four quadrilaterals would meet in one edge, the other pairing of the face's arcs is taken. Edges
//! are not cut after all where that does not help, where both their quadrilaterals would have the same four vertices, or where a
//! loop would have too many crossings.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::Vec3;
use rayon::prelude::*;

use super::super::edges::{Crossing, Pair, Source};
use super::super::pairing::{Face, joined_faces};
use super::super::part::Part;
use super::super::qef::MOST_CROSSINGS;
use super::{CutCell, Cuts, Place, apart, cells_around, edge_of, place};
use crate::cancel::checkpoint;
use crate::cell::{Loops, Signs, UPPER, arcs, at_fault, edge_ends, face_edges, loops, parts};

/// The cosine between the normals of two sides, 135°, below which they are those of a wall or a gap, not of an edge.
const OPPOSITE: f32 = -0.707;

/// Differences of cosines below this are none.
const SAME: f32 = 1e-3;

/// Some edges that may be cut, and the cells around them.
struct Choice<'a> {
    source: &'a Source<'a>,
    edges: BTreeMap<Place, [Crossing; 2]>,
    cells: HashMap<[i32; 3], Signs>,
}

impl Cuts {
    /// Finds the walls and gaps of images that are thinner than the lattice.
    pub fn of_thin(source: &Source, part: Part) -> Cuts {
        let mut choice = Choice::new(source, part);
        choice.follow();
        choice.settle();
        let Choice { edges, cells, .. } = choice;
        let of_cell = |(cell, signs): ([i32; 3], Signs)| {
            let Signs { cut, joined, .. } = signs;
            // Ambiguous faces are decided with those of all other cells.
            let joined = faces_with(cut).fold(0, |bits, face| bits | joined & 1 << face);
            let walls = cut_edges(cut).filter(|&edge| signs.is_wall(edge)).fold(0, |bits, edge| bits | 1 << edge);
            (cell, CutCell { cut, joined, walls, gaps: cut & !walls })
        };
        let of_cell = cells.into_iter().filter(|(_, signs)| signs.cut != 0).map(of_cell).collect();
        Cuts { of_edge: edges, of_cell }
    }
}

impl<'a> Choice<'a> {
    /// Takes all edges that rays cross twice between nodes of the same sign.
    fn new(source: &'a Source<'a>, part: Part) -> Choice<'a> {
        let is_between_equals = |pair: &Pair| {
            let mut end = pair.node;
            end[pair.axis] += 1;
            part.may_cut(pair.axis, pair.node)
                && [pair.node, end].into_iter().all(|node| source.is_inside(node) != pair.enters)
        };
        let pairs: Vec<Pair> = source.pairs().into_par_iter().filter(is_between_equals).collect();
        let edges = pairs.iter().map(|pair| (place(pair.axis, pair.node), apart(pair.crossings))).collect();
        let mut cut: HashMap<[i32; 3], u16> = HashMap::new();
        for (cell, edge) in pairs.iter().flat_map(|pair| cells_around(pair.axis, pair.node)) {
            *cut.entry(cell).or_default() |= 1 << edge;
        }
        let signs = |(cell, cut): ([i32; 3], u16)| {
            checkpoint();
            let inside = source.corners_inside(cell);
            (cell, Signs { inside, joined: joined_faces(source, inside, cell), cut })
        };
        Choice { source, edges, cells: cut.into_par_iter().map(signs).collect() }
    }

    /// Keeps the edges of cells through which a wall or a gap passes, and those that continue it.
    fn follow(&mut self) {
        let is_core = |&(&[z, axis, y, x], [one, other]): &(&Place, &[Crossing; 2])| {
            let around = cells_around(axis as usize, [x, y, z]).map(|(cell, edge)| (self.cells[&cell], edge));
            let parts = around.map(|(signs, edge)| parts(signs, edge));
            let passes = (0..4).any(|i| matches!(around[i].0.inside, 0 | u8::MAX) && parts[i]);
            let has_sides = Vec3::from_array(one.normal).dot(Vec3::from_array(other.normal)) < OPPOSITE;
            passes || parts == [true; 4] || has_sides && parts != [false; 4]
        };
        let core = self.edges.par_iter().filter(is_core).map(|(&edge, _)| edge);
        let mut kept: BTreeSet<Place> = core.collect();
        let mut waiting: Vec<Place> = kept.iter().copied().collect();
        while let Some([z, axis, y, x]) = waiting.pop() {
            checkpoint();
            for (cell, _) in cells_around(axis as usize, [x, y, z]) {
                let signs = self.cells[&cell];
                let next = cut_edges(signs.cut).filter(|&edge| continues(signs, edge)).map(|edge| of_cell(cell, edge));
                waiting.extend(next.filter(|&edge| kept.insert(edge)));
            }
        }
        let others = self.edges.keys().copied().filter(|edge| !kept.contains(edge)).collect();
        self.remove(others);
        self.cells.retain(|_, signs| signs.cut != 0);
    }

    /// Pairs the arcs on all faces with cut edges, and gives up edges without which the surface is a manifold.
    fn settle(&mut self) {
        let mut active: BTreeSet<[i32; 3]> = self.cells.keys().copied().collect();
        while !active.is_empty() {
            checkpoint();
            let mut changed = active.clone();
            while !changed.is_empty() {
                let idle =
                    self.edges_of(&changed, |choice, around| !around.iter().any(|&(c, e)| parts(choice.cells[&c], e)));
                changed = self.remove(idle);
                active.extend(&changed);
            }
            self.pair_arcs(&active);
            let beside = active
                .iter()
                .flat_map(|&cell| (0..3).flat_map(move |axis| [-1, 1].map(|step| beside(cell, axis, step))));
            let beside: Vec<[i32; 3]> = beside.filter(|cell| self.cells.contains_key(cell)).collect();
            active.extend(beside);
            let mut wrong = self.mend_faults(&active);
            wrong.extend(self.edges_of(&active, |choice, around| {
                around.iter().all(|&(cell, edge)| {
                    let Loops { of_crossing, .. } = loops(choice.cells[&cell]);
                    of_crossing[edge] == of_crossing[edge + UPPER]
                }) || around.iter().any(|(cell, _)| has_long_loop(choice.cells[cell]))
            }));
            active = self.remove(wrong);
        }
    }

    /// Returns the edges of cells for whose four cells, with the number of the edge in each, a condition holds.
    fn edges_of(
        &self,
        cells: &BTreeSet<[i32; 3]>,
        holds: impl Fn(&Choice, &[([i32; 3], usize); 4]) -> bool + Sync,
    ) -> BTreeSet<Place> {
        let of_cells = cells
            .par_iter()
            .flat_map_iter(|&cell| cut_edges(self.cells[&cell].cut).map(move |edge| edge_of(cell, edge)));
        let found = of_cells.filter(|&(axis, node)| holds(self, &cells_around(axis, node)));
        found.map(|(axis, node)| place(axis, node)).collect()
    }

    /// Stops cutting some edges, and returns the cells around them.
    fn remove(&mut self, edges: BTreeSet<Place>) -> BTreeSet<[i32; 3]> {
        let mut cells = BTreeSet::new();
        for edge in edges {
            self.edges.remove(&edge);
            let [z, axis, y, x] = edge;
            for (cell, edge) in cells_around(axis as usize, [x, y, z]) {
                self.cells.entry(cell).and_modify(|signs| signs.cut &= !(1 << edge));
                cells.insert(cell);
            }
        }
        cells
    }

    /// Chooses the pairing of the arcs on the faces of some cells that have cut edges by the normals of their crossings.
    fn pair_arcs(&mut self, cells: &BTreeSet<[i32; 3]>) {
        let has_cuts = |&(above, axis): &Face| self.cells.get(&above).is_some_and(|s| s.cut & face_edges(axis, 0) != 0);
        let faces: Vec<Face> = self.faces_of(cells).into_iter().filter(has_cuts).collect();
        let joined: Vec<bool> = faces.par_iter().map(|&face| self.are_joined(face)).collect();
        for (face, joined) in faces.into_iter().zip(joined) {
            self.set_joined(face, |_| joined);
        }
    }

    fn faces_of(&self, cells: &BTreeSet<[i32; 3]>) -> BTreeSet<Face> {
        let of_cell = |&cell: &[i32; 3]| (0..3).flat_map(move |axis| [(cell, axis), (beside(cell, axis, 1), axis)]);
        cells.iter().flat_map(of_cell).collect()
    }

    fn set_joined(&mut self, (above, axis): Face, joined: impl Fn(bool) -> bool) {
        for (cell, side) in [(above, 0), (beside(above, axis, -1), 1)] {
            if let Some(signs) = self.cells.get_mut(&cell) {
                let bit = 1 << (2 * axis + side);
                let is_joined = joined(signs.joined & bit != 0);
                signs.joined = signs.joined & !bit | if is_joined { bit } else { 0 };
            }
        }
    }

    /// Returns whether the normals at the ends of a face's arcs agree better if it is joined: those that agree least, or, where they do
    /// not decide between pairings of two arcs, all. Without normals, walls and gaps pass through.
    fn are_joined(&self, (above, axis): Face) -> bool {
        let signs = self.cells[&above];
        let cut = signs.cut & face_edges(axis, 0);
        if self.is_without_normals(cut, above) {
            return cut_edges(cut).all(|edge| signs.is_wall(edge));
        }
        let bit = 1 << (2 * axis);
        let pairings = [signs.joined & !bit, signs.joined | bit].map(|joined| {
            let cosine = |ends: [usize; 2]| {
                let [one, other] = ends.map(|crossing| self.normal(above, signs, crossing));
                one.dot(other)
            };
            arcs(Signs { joined, ..signs }, axis, 0).into_iter().flatten().map(cosine).collect::<Vec<f32>>()
        });
        let least = pairings.each_ref().map(|cosines| cosines.iter().copied().fold(1.0, f32::min));
        let [apart, joined] = match pairings[0].len() {
            2 if (least[0] - least[1]).abs() <= SAME => pairings.map(|cosines| cosines.iter().sum()),
            _ => least,
        };
        joined > apart + SAME
    }

    /// Returns whether the normals at some cut edges of a cell are unknown.
    fn is_without_normals(&self, cut: u16, cell: [i32; 3]) -> bool {
        cut_edges(cut).all(|edge| self.edges[&of_cell(cell, edge)].iter().all(|crossing| crossing.normal == [0.0; 3]))
    }

    /// Returns the normal at a crossing of a cell.
    fn normal(&self, cell: [i32; 3], signs: Signs, crossing: usize) -> Vec3 {
        let edge = crossing % UPPER;
        let (axis, node) = edge_of(cell, edge);
        Vec3::from_array(match signs.cut >> edge & 1 {
            0 => self.source.first_crossing(axis, node).map_or([0.0; 3], |crossing| crossing.normal),
            _ => self.edges[&place(axis, node)][crossing / UPPER].normal,
        })
    }

    /// Takes the other pairing on the faces of some cells where four quadrilaterals would meet in one edge, which splits loops and
    /// never merges any. Returns the edges of faces with more than two arcs of which this is true.
    fn mend_faults(&mut self, cells: &BTreeSet<[i32; 3]>) -> BTreeSet<Place> {
        let mut wrong = BTreeSet::new();
        for (above, axis) in self.faces_of(cells) {
            checkpoint();
            let Some(&signs) = self.cells.get(&above).filter(|signs| signs.cut & face_edges(axis, 0) != 0) else {
                continue;
            };
            if !at_fault(axis, self.cells[&beside(above, axis, -1)], signs) {
                continue;
            }
            if arcs(signs, axis, 0).into_iter().flatten().count() == 2 {
                self.set_joined((above, axis), |is_joined| !is_joined);
            } else {
                wrong.extend(cut_edges(signs.cut & face_edges(axis, 0)).map(|edge| of_cell(above, edge)));
            }
        }
        wrong
    }
}

/// Returns the faces with some of the given edges.
fn faces_with(edges: u16) -> impl Iterator<Item = usize> {
    (0..6).filter(move |face| edges & face_edges(face / 2, face % 2) != 0)
}

fn cut_edges(cut: u16) -> impl Iterator<Item = usize> {
    (0..12).filter(move |edge| cut >> edge & 1 == 1)
}

/// Returns whether a loop of a cell has more crossings than a vertex is placed by.
fn has_long_loop(signs: Signs) -> bool {
    let Loops { count, of_crossing } = loops(signs);
    (0..count).any(|number| of_crossing.iter().filter(|&&of| of == number).count() > MOST_CROSSINGS)
}

fn of_cell(cell: [i32; 3], edge: usize) -> Place {
    let (axis, node) = edge_of(cell, edge);
    place(axis, node)
}

fn beside(mut cell: [i32; 3], axis: usize, step: i32) -> [i32; 3] {
    cell[axis] += step;
    cell
}

/// Returns whether a wall or a gap across a cut edge continues through a cell: it divides the corners, and is no thicker than the
/// edge on the others that are parallel.
fn continues(signs: Signs, edge: usize) -> bool {
    let axis = edge / 4;
    let own = signs.inside >> edge_ends(edge).0 & 1;
    let is_thicker = |parallel: usize| {
        let (a, b) = edge_ends(parallel);
        signs.cut >> parallel & 1 == 0 && signs.inside >> a & 1 != own && signs.inside >> b & 1 != own
    };
    parts(signs, edge) && !(4 * axis..4 * axis + 4).any(is_thicker)
}
