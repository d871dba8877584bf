//! A surface of which some triangles are in parts. Of a large one little is joined: what is looked at and changed are the pieces near
//! new ones, and all others stay as they were given.

use std::collections::HashMap;

use glam::DVec3;

use crate::box_tree::Box32;
use crate::mesh::Aabb;
use crate::parallel::*;

/// Number of triangles of a run: of those that follow one another, and so mostly lie beside one another.
const TRIANGLES_OF_RUN: usize = 64;

/// A part of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Piece {
    pub corners: [u32; 3],
    /// Whether the side from each corner lies on a side of the triangle.
    pub is_outer: [bool; 3],
    /// The number of the triangle.
    pub whole: u32,
    /// True if what is near it was not looked for yet.
    pub is_new: bool,
}

impl Piece {
    /// Returns the side from a corner to the next.
    pub fn side(&self, i: usize) -> [u32; 2] {
        [self.corners[i], self.corners[(i + 1) % 3]]
    }
}

/// Returns the box of a triangle and of what lies within a distance around it.
pub(super) fn extent(corners: [u32; 3], positions: &[DVec3], around: f64) -> Box32 {
    let [a, b, c] = corners.map(|vertex| positions[vertex as usize]);
    Box32::of(Aabb { min: a.min(b).min(c) - around, max: a.max(b).max(c) + around })
}

/// The triangles as they were given.
pub(super) struct Given<'m> {
    triangles: &'m [[u32; 3]],
    positions: &'m [DVec3],
    /// The box of each run.
    runs: Vec<Box32>,
}

impl<'m> Given<'m> {
    pub fn of(triangles: &'m [[u32; 3]], positions: &'m [DVec3]) -> Given<'m> {
        let union = |run: &[[u32; 3]]| {
            let boxes = run.iter().map(|&corners| extent(corners, positions, 0.0));
            boxes.fold(Box32::EMPTY, Box32::union)
        };
        let runs = triangles.par_chunks(TRIANGLES_OF_RUN).with_min_len(1 << 6).map(union).collect();
        Given { triangles, positions, runs }
    }

    /// Returns the triangles whose boxes touch cells that some boxes touch, in order.
    fn near(&self, boxes: &[Box32]) -> Vec<u32> {
        let marks = Marks::of(boxes);
        let triangles_of = |run: usize| {
            let first = run * TRIANGLES_OF_RUN;
            let of_run = self.triangles[first..].iter().take(TRIANGLES_OF_RUN).zip(first as u32..);
            of_run.map(|(&corners, triangle)| (extent(corners, self.positions, 0.0), triangle))
        };
        let runs = (0..self.runs.len()).into_par_iter().with_min_len(1 << 6);
        let near = runs.filter(|&run| marks.touches(&self.runs[run])).flat_map_iter(|run| {
            triangles_of(run).filter(|(extent, _)| marks.touches(extent)).map(|(_, triangle)| triangle)
        });
        near.collect()
    }
}

/// Cells in the box of some boxes, of which those are marked that the boxes touch.
struct Marks {
    bounds: Box32,
    /// The least corner, and cells per length.
    min: DVec3,
    scale: DVec3,
    /// Number of cells along each side.
    cells: usize,
    is_marked: Vec<bool>,
}

impl Marks {
    /// Most cells that are marked one by one.
    const MOST: usize = 1 << 22;

    fn of(boxes: &[Box32]) -> Marks {
        let bounds = boxes.iter().copied().fold(Box32::EMPTY, Box32::union);
        let [min, max] = bounds.corners();
        let cells = (4.0 * (boxes.len() as f64).cbrt()).clamp(8.0, 64.0) as usize;
        let scale = cells as f64 / (max - min).max(DVec3::splat(f64::MIN_POSITIVE));
        let mut marks = Marks { bounds, min, scale, cells, is_marked: vec![false; cells.pow(3)] };
        let count = |extent: &Box32| {
            let [from, to] = marks.range(extent);
            (0..3).map(|axis| to[axis] + 1 - from[axis]).product::<usize>()
        };
        // Of boxes that fill most of it, cells tell nothing.
        if boxes.iter().map(count).sum::<usize>() > Self::MOST {
            marks.is_marked.fill(true);
            return marks;
        }
        for extent in boxes {
            marks.cells_of(extent).for_each(|cell| marks.is_marked[cell] = true);
        }
        marks
    }

    fn range(&self, extent: &Box32) -> [[usize; 3]; 2] {
        let cell = |at: f64| (at.max(0.0) as usize).min(self.cells - 1);
        extent.corners().map(|corner| ((corner - self.min) * self.scale).to_array().map(cell))
    }

    fn cells_of(&self, extent: &Box32) -> impl Iterator<Item = usize> + use<> {
        let ([from, to], cells) = (self.range(extent), self.cells);
        let row = move |z: usize, y: usize| (from[0]..=to[0]).map(move |x| (z * cells + y) * cells + x);
        (from[2]..=to[2]).flat_map(move |z| (from[1]..=to[1]).flat_map(move |y| row(z, y)))
    }

    /// Returns whether a box touches a marked cell.
    fn touches(&self, extent: &Box32) -> bool {
        extent.touches(&self.bounds) && self.cells_of(extent).any(|cell| self.is_marked[cell])
    }
}

/// All pieces of some triangles.
pub(super) struct Near {
    /// The triangles, in order.
    wholes: Vec<u32>,
    /// Their pieces, in the same order.
    pub pieces: Vec<Piece>,
}

/// A surface of which some triangles are in parts.
pub(super) struct Parted<'g> {
    given: &'g Given<'g>,
    /// The pieces of the triangles that are not as they were given.
    parted: HashMap<u32, Vec<Piece>>,
    /// The triangles with new pieces, in order.
    new: Vec<u32>,
    /// Number of pieces of the whole surface.
    count: usize,
}

impl<'g> Parted<'g> {
    /// Returns the surface as given, of which some triangles are new.
    pub fn of(given: &'g Given<'g>, new: Vec<u32>) -> Parted<'g> {
        Parted { given, parted: HashMap::new(), new, count: given.triangles.len() }
    }

    /// Returns the positions of the vertices that were given.
    pub fn given_positions(&self) -> &'g [DVec3] {
        self.given.positions
    }

    /// Returns the number of pieces.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Returns the number of triangles with new pieces.
    pub fn new_triangles(&self) -> usize {
        self.new.len()
    }

    /// Returns the pieces of triangles within a distance of new pieces.
    pub fn near_new(&self, positions: &[DVec3], around: f64) -> Near {
        self.near(&self.new, |piece| piece.is_new, positions, around)
    }

    /// Returns the pieces of triangles near those that are not as they were given; see [`near_new`](Self::near_new).
    pub fn near_parted(&self, positions: &[DVec3], around: f64) -> Near {
        let parted: Vec<u32> = self.parted.keys().copied().collect();
        self.near(&parted, |_| true, positions, around)
    }

    /// Returns the pieces of some triangles, and of those within a distance of some of these pieces.
    fn near(&self, some: &[u32], is_meant: impl Fn(&Piece) -> bool, positions: &[DVec3], around: f64) -> Near {
        let pieces = self.pieces_of(some).into_iter().filter(is_meant);
        let boxes: Vec<Box32> = pieces.map(|piece| extent(piece.corners, positions, around)).collect();
        let mut wholes = if boxes.is_empty() { Vec::new() } else { self.given.near(&boxes) };
        wholes.extend(some);
        wholes.sort_unstable();
        wholes.dedup();
        Near { pieces: self.pieces_of(&wholes), wholes }
    }

    fn pieces_of(&self, wholes: &[u32]) -> Vec<Piece> {
        let mut pieces = Vec::with_capacity(wholes.len());
        for &whole in wholes {
            match self.parted.get(&whole) {
                Some(parts) => pieces.extend(parts),
                None => pieces.push(self.as_given(whole, self.new.binary_search(&whole).is_ok())),
            }
        }
        pieces
    }

    fn as_given(&self, whole: u32, is_new: bool) -> Piece {
        Piece { corners: self.given.triangles[whole as usize], is_outer: [true; 3], whole, is_new }
    }

    /// Returns whether a piece is a triangle as it was given.
    pub fn is_as_given(&self, piece: &Piece) -> bool {
        *piece == self.as_given(piece.whole, piece.is_new)
    }

    /// Puts back what was near new pieces. There are no other new pieces.
    pub fn put(&mut self, Near { wholes, pieces }: Near) {
        self.new.clear();
        let mut rest = &pieces[..];
        for whole in wholes {
            let (parts, others) = rest.split_at(rest.iter().take_while(|piece| piece.whole == whole).count());
            rest = others;
            if parts.iter().any(|piece| piece.is_new) {
                self.new.push(whole);
            }
            let before = match parts {
                [piece] if self.is_as_given(piece) => self.parted.remove(&whole),
                _ => self.parted.insert(whole, parts.to_vec()),
            };
            self.count += parts.len();
            self.count -= before.map_or(1, |parts| parts.len());
        }
    }

    /// Returns the pieces, with the number of the triangle of each; `None` if all are as they were given.
    pub fn finish(self) -> Option<(Vec<[u32; 3]>, Vec<u32>)> {
        if self.parted.is_empty() {
            return None;
        }
        let (mut triangles, mut wholes) = (Vec::with_capacity(self.count), Vec::with_capacity(self.count));
        let mut parted: Vec<(u32, Vec<Piece>)> = self.parted.into_iter().collect();
        parted.sort_unstable_by_key(|&(whole, _)| whole);
        let mut next = 0;
        let end = (self.given.triangles.len() as u32, Vec::new());
        for (whole, parts) in parted.into_iter().chain([end]) {
            triangles.extend(&self.given.triangles[next as usize..whole as usize]);
            wholes.extend(next..whole);
            triangles.extend(parts.iter().map(|piece| piece.corners));
            wholes.extend(parts.iter().map(|_| whole));
            next = whole + 1;
        }
        Some((triangles, wholes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random::Random;

    /// Small triangles in no order, and a large one.
    fn soup() -> (Vec<[u32; 3]>, Vec<DVec3>) {
        let mut random = Random::new(5);
        let mut point = |size: f64| size * DVec3::from([0, 1, 2].map(|_| random.unit()));
        let mut positions: Vec<DVec3> = (0..3).map(|_| point(10.0)).collect();
        for _ in 0..5000 {
            let corner = point(10.0);
            positions.extend([0, 1, 2].map(|_| corner + point(0.3)));
        }
        let triangles = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        (triangles, positions)
    }

    #[test]
    fn what_touches_the_surroundings_of_new_pieces_is_near() {
        let (triangles, positions) = soup();
        let given = Given::of(&triangles, &positions);
        for (new, around) in
            [(vec![7], 0.5), (vec![100, 4000], 0.1), (vec![0], 0.2), ((0..5000).step_by(7).collect(), 0.0)]
        {
            let near = Parted::of(&given, new.clone()).near_new(&positions, around);
            let of = |triangle: u32, around: f64| extent(triangles[triangle as usize], &positions, around);
            let touches = |triangle: u32| new.iter().any(|&new| of(new, around).touches(&of(triangle, 0.0)));
            assert!(near.wholes.is_sorted() && near.wholes.len() < 5001);
            let missing =
                (0..5001).find(|&triangle| touches(triangle) && near.wholes.binary_search(&triangle).is_err());
            assert_eq!(missing, None);
            let of_new = near.pieces.iter().filter(|piece| piece.is_new).map(|piece| piece.whole);
            assert!(of_new.eq(new.iter().copied()));
        }
    }

    #[test]
    fn pieces_are_counted_and_put_in_the_order_of_their_triangles() {
        let (triangles, positions) = soup();
        let given = Given::of(&triangles, &positions);
        let mut surface = Parted::of(&given, vec![3, 70]);
        let mut near = surface.near_new(&positions, 1.0);
        // The first becomes two, the second none, and a third is new.
        let third = near.wholes.iter().copied().find(|&whole| whole > 70).unwrap();
        near.pieces.retain(|piece| piece.whole != 70);
        let place = near.pieces.iter().position(|piece| piece.whole == 3).unwrap();
        let parts =
            [[9, 10, 5000], [10, 11, 5000]].map(|corners| Piece { corners, is_new: false, ..near.pieces[place] });
        near.pieces.splice(place..=place, parts);
        near.pieces.iter_mut().filter(|piece| piece.whole == third).for_each(|piece| piece.is_new = true);
        surface.put(near);
        assert_eq!((surface.count(), surface.new_triangles()), (5001, 1));
        let near = surface.near_new(&positions, 1.0);
        assert!(near.pieces.iter().all(|piece| piece.is_new == (piece.whole == third)));
        let mut near = surface.near_parted(&positions, 0.0);
        // As it was given again, but turned.
        near.pieces.retain(|piece| piece.corners != parts[1].corners);
        let piece = near.pieces.iter_mut().find(|piece| piece.whole == 3).unwrap();
        piece.corners = [10, 11, 9];
        assert!(!surface.is_as_given(piece));
        surface.put(near);
        let (found, wholes) = surface.finish().unwrap();
        let expected: Vec<u32> = (0..5001).filter(|&whole| whole != 70).collect();
        assert_eq!(wholes, expected);
        let is_given = |(&found, &whole): (&[u32; 3], &u32)| {
            found == if whole == 3 { [10, 11, 9] } else { triangles[whole as usize] }
        };
        assert!(found.iter().zip(&wholes).all(is_given));
        assert!(Parted::of(&given, vec![3]).finish().is_none());
    }
}
