//! Diagonals between the parts of a triangle, and parts that face each other.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::parted::Piece;
use crate::cancel::checkpoint;
use crate::parallel::*;
use crate::surface::apart::lowest_first;

/// Most parts of a triangle of which the diagonals are turned.
const MOST_PARTS: usize = 512;

/// Most passes over the diagonals of a triangle's parts.
const PASSES: usize = 16;

/// Turns diagonals between new parts of one triangle: to sides of other triangles that join two of their corners, and else to a
/// Delaunay triangulation of these, about. So parts of two triangles that lie on each other come to be the same.
pub(super) fn turn_diagonals(pieces: &mut [Piece], positions: &[DVec3]) {
    let sides = pieces.iter().flat_map(|piece| (0..3).filter(|&i| piece.is_outer[i]).map(|i| piece.side(i)));
    let mut beside: HashMap<u32, Vec<u32>> = HashMap::new();
    let is_at_new = at_new(pieces, positions.len());
    for [from, to] in sides.filter(|side| side.iter().all(|&end| is_at_new[end as usize])) {
        beside.entry(from.min(to)).or_default().push(from.max(to));
    }
    for parts in pieces.chunk_by_mut(|a, b| a.whole == b.whole) {
        checkpoint();
        if (2..=MOST_PARTS).contains(&parts.len()) && parts.iter().any(|part| part.is_new) {
            Diagonals { parts, positions }.turn(&beside);
        }
    }
}

/// Returns which of a number of vertices are corners of new pieces.
fn at_new(pieces: &[Piece], vertices: usize) -> Vec<bool> {
    let mut is_at_new = vec![false; vertices];
    let corners = pieces.iter().filter(|piece| piece.is_new).flat_map(|piece| piece.corners);
    corners.for_each(|vertex| is_at_new[vertex as usize] = true);
    is_at_new
}

/// A diagonal between two parts, and the one that takes its place.
struct Turn {
    /// The two parts, and the sides that they share.
    both: [(usize, usize); 2],
    /// The ends of the diagonal, and those of the other one.
    corners: [u32; 4],
}

/// The parts of a triangle.
struct Diagonals<'a> {
    parts: &'a mut [Piece],
    positions: &'a [DVec3],
}

impl Diagonals<'_> {
    /// Turns the diagonals; `beside` lists the higher ends of sides by their lower ends.
    fn turn(&mut self, beside: &HashMap<u32, Vec<u32>>) {
        let corners: HashSet<u32> = self.parts.iter().flat_map(|part| part.corners).collect();
        let mut wanted: Vec<[u32; 2]> = Vec::new();
        for &from in &corners {
            wanted.extend(
                beside.get(&from).into_iter().flatten().filter(|to| corners.contains(to)).map(|&to| [from, to]),
            );
        }
        wanted.sort_unstable();
        wanted.dedup();
        let front: DVec3 = self.parts.iter().map(|part| self.normal(part.corners)).sum();
        for &side in &wanted {
            self.insert(side, &wanted, front);
        }
        self.delaunay(&wanted, front);
    }

    fn normal(&self, corners: [u32; 3]) -> DVec3 {
        let [a, b, c] = corners.map(|vertex| self.positions[vertex as usize]);
        (b - a).cross(c - a)
    }

    /// Returns twice the area of a triangle as seen along a vector, times its length.
    fn area(&self, corners: [u32; 3], front: DVec3) -> f64 {
        self.normal(corners).dot(front)
    }

    /// Returns the parts at each side.
    fn sides(&self) -> HashMap<[u32; 2], usize> {
        self.parts.iter().zip(0..).flat_map(|(part, place)| (0..3).map(move |i| (part.side(i), place))).collect()
    }

    /// Turns diagonals that pass a side, until it is one of them, if that can be.
    fn insert(&mut self, [p, q]: [u32; 2], wanted: &[[u32; 2]], front: DVec3) {
        for _ in 0..self.parts.len() {
            let sides = self.sides();
            if sides.contains_key(&[p, q]) || sides.contains_key(&[q, p]) {
                return;
            }
            let passes = |&[a, b]: &[u32; 2]| {
                a < b
                    && sides.contains_key(&[b, a])
                    && wanted.binary_search(&[a, b]).is_err()
                    && ![a, b].iter().any(|end| [p, q].contains(end))
                    && (self.area([p, q, a], front) > 0.0) != (self.area([p, q, b], front) > 0.0)
                    && (self.area([a, b, p], front) > 0.0) != (self.area([a, b, q], front) > 0.0)
            };
            let mut crossed: Vec<[u32; 2]> = sides.keys().copied().filter(passes).collect();
            crossed.sort_unstable();
            let Some(turn) = crossed.into_iter().find_map(|side| self.turn_of(side, &sides, front)) else { return };
            self.put(turn);
        }
    }

    /// Returns the turn of a side between two parts, if both stay in front. `sides` are those of some turns before.
    fn turn_of(&self, [a, b]: [u32; 2], sides: &HashMap<[u32; 2], usize>, front: DVec3) -> Option<Turn> {
        let at_side = |side: [u32; 2]| {
            let place = *sides.get(&side)?;
            let i = (0..3).find(|&i| self.parts[place].side(i) == side)?;
            (!self.parts[place].is_outer[i]).then_some((place, i))
        };
        let both = [at_side([a, b])?, at_side([b, a])?];
        let [c, d] = both.map(|(place, i)| self.parts[place].corners[(i + 2) % 3]);
        let is_known = |part: &Piece| part.corners.contains(&c) && part.corners.contains(&d);
        let is_in_front = |corners: [u32; 3]| self.area(corners, front) > 0.0;
        let may_turn = c != d && is_in_front([a, d, c]) && is_in_front([d, b, c]) && !self.parts.iter().any(is_known);
        may_turn.then_some(Turn { both, corners: [a, b, c, d] })
    }

    /// Returns whether a turn makes a Delaunay triangulation of two parts, or unfolds them.
    fn is_better(&self, turn: &Turn, front: DVec3) -> bool {
        let cotangent = |corners: [u32; 3]| {
            let [p, q, r] = corners.map(|vertex| self.positions[vertex as usize]);
            (q - p).dot(r - p) / self.area(corners, front)
        };
        let [a, b, c, d] = turn.corners;
        let is_folded = [[a, b, c], [b, a, d]].iter().any(|&part| self.area(part, front) <= 0.0);
        is_folded || cotangent([c, a, b]) + cotangent([d, b, a]) < 0.0
    }

    fn put(&mut self, Turn { both, corners: [a, b, c, d] }: Turn) {
        let outer = |which: usize, next: usize| self.parts[both[which].0].is_outer[(both[which].1 + next) % 3];
        // Of (a, b, c) the sides after the turned one are (b, c) and (c, a), of (b, a, d) they are (a, d) and (d, b).
        let [bc, ca, ad, db] = [outer(0, 1), outer(0, 2), outer(1, 1), outer(1, 2)];
        let new = [([a, d, c], [ad, false, ca]), ([d, b, c], [db, bc, false])];
        for ((place, _), (corners, is_outer)) in both.into_iter().zip(new) {
            self.parts[place] = Piece { corners, is_outer, is_new: true, ..self.parts[place] };
        }
    }

    fn delaunay(&mut self, wanted: &[[u32; 2]], front: DVec3) {
        for _ in 0..PASSES {
            let sides = self.sides();
            let mut order: Vec<[u32; 2]> = sides.keys().copied().filter(|[a, b]| a < b).collect();
            order.sort_unstable();
            let mut is_turned = false;
            for side in order.into_iter().filter(|side| wanted.binary_search(side).is_err()) {
                if let Some(turn) = self.turn_of(side, &sides, front).filter(|turn| self.is_better(turn, front)) {
                    self.put(turn);
                    is_turned = true;
                }
            }
            if !is_turned {
                return;
            }
        }
    }
}

/// Removes pieces with the same corners that face each other, in pairs, where all corners are those of new pieces.
pub(super) fn remove_opposites(pieces: &mut Vec<Piece>, vertices: usize) {
    let is_at_new = at_new(pieces, vertices);
    let side = |(piece, number): (&Piece, u32)| {
        let mut corners = piece.corners;
        if !corners.iter().all(|&corner| is_at_new[corner as usize]) {
            return None;
        }
        let is_back = lowest_first(&mut corners);
        Some((corners, is_back, number))
    };
    let numbers = 0..pieces.len() as u32;
    let mut order: Vec<([u32; 3], bool, u32)> =
        pieces.par_iter().zip(numbers).with_min_len(1 << 12).filter_map(side).collect();
    order.par_sort_unstable();
    let mut is_kept = vec![true; pieces.len()];
    for same in order.chunk_by(|a, b| a.0 == b.0) {
        let (front, back) = same.split_at(same.partition_point(|&(_, is_back, _)| !is_back));
        for (one, other) in front.iter().zip(back) {
            is_kept[one.2 as usize] = false;
            is_kept[other.2 as usize] = false;
        }
    }
    let mut is_kept = is_kept.into_iter();
    pieces.retain(|_| is_kept.next().expect("one flag per piece"));
}
