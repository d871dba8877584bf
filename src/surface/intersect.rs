//! Which triangles of a mesh meet elsewhere than in corners and sides that they share.
//!
//! Two triangles that share no corner meet in a point of a side of one of them, so six tests of a segment against a triangle
//! decide. Two that share a corner meet beyond it only if the side opposite to it, of one, meets the other. Two that share a
//! side meet beyond it only if they are folded flat. In one plane the same is asked of their outlines. All of this rests on
//! signs of volumes and areas alone, and those are exact (Shewchuk, Adaptive precision floating-point arithmetic, 1997).

use glam::DVec3;
use rayon::prelude::*;
use robust::{Coord, Coord3D, orient2d, orient3d};

/// How much larger than they are triangles are looked for, in pitches, as they are seen rounded.
const PADDING: f64 = 1e-3;

/// A triangle that may meet others.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    /// Its number.
    pub triangle: u32,
    /// Whether it is asked what it meets; others are asked about only.
    pub is_active: bool,
    /// Its vertices.
    pub vertices: [u32; 3],
    /// Their places, in coordinates of cells.
    pub corners: [DVec3; 3],
    least: DVec3,
    greatest: DVec3,
}

impl Candidate {
    /// A triangle by its vertices and their places.
    pub fn new(triangle: u32, is_active: bool, vertices: [u32; 3], corners: [DVec3; 3]) -> Candidate {
        let [a, b, c] = corners;
        let (least, greatest) = (a.min(b).min(c) - PADDING, a.max(b).max(c) + PADDING);
        Candidate { triangle, is_active, vertices, corners, least, greatest }
    }

    fn touches(&self, other: &Candidate) -> bool {
        self.least.cmple(other.greatest).all() && other.least.cmple(self.greatest).all()
    }

    /// The cells that its box touches.
    pub fn cells(&self) -> impl Iterator<Item = [i32; 3]> + use<> {
        let (from, to) = (cell_of(self.least), cell_of(self.greatest));
        let row = move |z: i32, y: i32| (from[0]..=to[0]).map(move |x| [x, y, z]);
        (from[2]..=to[2]).flat_map(move |z| (from[1]..=to[1]).flat_map(move |y| row(z, y)))
    }
}

/// The pairs of triangles, by their numbers, for which `do_meet` holds, each ascending, in ascending order. It is asked of
/// those of which one is active and whose boxes touch in a cell in which it `is_sought`. Triangles should not be much
/// larger than cells.
pub fn pairs(
    candidates: &[Candidate],
    is_sought: impl Fn(&Candidate, [i32; 3]) -> bool + Sync,
    do_meet: impl Fn(&Candidate, &Candidate) -> bool + Sync,
) -> Vec<[u32; 2]> {
    let is_sought = &is_sought;
    let places_of = |(i, candidate): (u32, &Candidate)| {
        let candidate = *candidate;
        candidate.cells().filter(move |&cell| is_sought(&candidate, cell)).map(move |cell| (key(cell), i))
    };
    let indices = (0..candidates.len() as u32).into_par_iter().with_min_len(64);
    let mut places: Vec<(u64, u32)> = indices.zip(candidates).flat_map_iter(places_of).collect();
    places.par_sort_unstable_by_key(|place| place.0);
    let groups: Vec<&[(u64, u32)]> = places.chunk_by(|a, b| a.0 == b.0).collect();
    let in_group = |group: &&[(u64, u32)]| {
        let mut found = Vec::new();
        let of_group = || group.iter().map(|&(_, i)| &candidates[i as usize]);
        for (i, one) in of_group().enumerate() {
            for other in of_group().skip(i + 1) {
                // Of all cells that both touch the lowest is asked.
                if (one.is_active || other.is_active)
                    && one.touches(other)
                    && key(cell_of(one.least.max(other.least))) == group[0].0
                    && do_meet(one, other)
                {
                    found.push([one.triangle.min(other.triangle), one.triangle.max(other.triangle)]);
                }
            }
        }
        found
    };
    let mut pairs: Vec<[u32; 2]> = groups.par_iter().with_min_len(64).flat_map_iter(in_group).collect();
    pairs.par_sort_unstable();
    pairs
}

/// The cell that a point lies in.
pub fn cell_of(point: DVec3) -> [i32; 3] {
    point.floor().to_array().map(|c| c as i32)
}

/// A cell in one number: 21 bits an axis hold more than any lattice has.
fn key(cell: [i32; 3]) -> u64 {
    cell.into_iter().fold(0, |key, c| key << 21 | (i64::from(c) + (1 << 20)) as u64 & ((1 << 21) - 1))
}

/// Whether two triangles, by their vertices, meet elsewhere than in vertices and sides that they share.
pub fn meet(one: [u32; 3], other: [u32; 3], place_of: impl Fn(u32) -> DVec3) -> bool {
    let at = |triangle: [u32; 3]| triangle.map(&place_of);
    let shared = |vertex: &u32, triangle: &[u32; 3]| triangle.contains(vertex);
    match one.iter().filter(|vertex| shared(vertex, &other)).count() {
        0 => apart_meet(at(one), at(other)),
        1 => {
            let first = |triangle: [u32; 3], than: [u32; 3]| {
                let turn = triangle.iter().position(|vertex| shared(vertex, &than)).unwrap_or(0);
                [0, 1, 2].map(|i| triangle[(turn + i) % 3])
            };
            corner_meet(at(first(one, other)), at(first(other, one)))
        }
        2 => {
            let last = |triangle: [u32; 3], than: [u32; 3]| {
                let turn = triangle.iter().position(|vertex| !shared(vertex, &than)).unwrap_or(0);
                [1, 2, 0].map(|i| triangle[(turn + i) % 3])
            };
            side_meet(at(last(one, other)), at(last(other, one))[2])
        }
        _ => true,
    }
}

/// The sign of the volume of a tetrahedron.
fn side(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    orient3d(a, b, c, d)
}

/// The sides of a plane that the corners of a triangle lie on.
fn sides(plane: [DVec3; 3], of: [DVec3; 3]) -> [f64; 3] {
    of.map(|point| side(plane[0], plane[1], plane[2], point))
}

fn apart_meet(a: [DVec3; 3], b: [DVec3; 3]) -> bool {
    let b_of_a = sides(a, b);
    if one_sided(&b_of_a) {
        return false;
    }
    let a_of_b = sides(b, a);
    if one_sided(&a_of_b) {
        return false;
    }
    if b_of_a == [0.0; 3] && a_of_b == [0.0; 3] {
        return flat_meet(a, b);
    }
    (0..3).any(|i| {
        let j = (i + 1) % 3;
        crosses(b[i], b[j], b_of_a[i], b_of_a[j], a) || crosses(a[i], a[j], a_of_b[i], a_of_b[j], b)
    })
}

fn one_sided(sides: &[f64]) -> bool {
    sides.iter().all(|&side| side > 0.0) || sides.iter().all(|&side| side < 0.0)
}

/// Whether a segment, of whose ends the sides of a triangle's plane are known, meets the triangle; a segment in its plane
/// does not.
fn crosses(p: DVec3, q: DVec3, of_p: f64, of_q: f64, [a, b, c]: [DVec3; 3]) -> bool {
    if one_sided(&[of_p, of_q]) || (of_p == 0.0 && of_q == 0.0) {
        return false;
    }
    let turns = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
    turns.iter().all(|&turn| turn >= 0.0) || turns.iter().all(|&turn| turn <= 0.0)
}

/// Of triangles that share their first corner.
fn corner_meet(a: [DVec3; 3], b: [DVec3; 3]) -> bool {
    let of = |plane: [DVec3; 3], p, q| [side(plane[0], plane[1], plane[2], p), side(plane[0], plane[1], plane[2], q)];
    let b_of_a = of(a, b[1], b[2]);
    if one_sided(&b_of_a) {
        return false;
    }
    let a_of_b = of(b, a[1], a[2]);
    if one_sided(&a_of_b) {
        return false;
    }
    if b_of_a == [0.0; 2] && a_of_b == [0.0; 2] {
        let (a, b) = flat(a, b);
        let [a, b] = [a, b].map(counter_clockwise);
        let within = |[tip, from, to]: [Coord<f64>; 3], p| orient2d(tip, from, p) >= 0.0 && orient2d(tip, p, to) >= 0.0;
        return within(a, b[1]) || within(a, b[2]) || within(b, a[1]) || within(b, a[2]);
    }
    crosses(b[1], b[2], b_of_a[0], b_of_a[1], a) || crosses(a[1], a[2], a_of_b[0], a_of_b[1], b)
}

/// Of two triangles on one side, the second given by its third corner.
fn side_meet(a: [DVec3; 3], other: DVec3) -> bool {
    if side(a[0], a[1], a[2], other) != 0.0 {
        return false;
    }
    let (a, b) = flat(a, [a[0], a[1], other]);
    orient2d(a[0], a[1], a[2]) * orient2d(b[0], b[1], b[2]) >= 0.0
}

/// Of triangles in one plane: whether no side of either parts them.
fn flat_meet(a: [DVec3; 3], b: [DVec3; 3]) -> bool {
    let (a, b) = flat(a, b);
    let [a, b] = [a, b].map(counter_clockwise);
    let parts = |a: [Coord<f64>; 3], b: [Coord<f64>; 3]| {
        (0..3).any(|i| b.iter().all(|&p| orient2d(a[i], a[(i + 1) % 3], p) < 0.0))
    };
    !parts(a, b) && !parts(b, a)
}

fn counter_clockwise([a, b, c]: [Coord<f64>; 3]) -> [Coord<f64>; 3] {
    if orient2d(a, b, c) < 0.0 { [a, c, b] } else { [a, b, c] }
}

/// Triangles of one plane, seen along the axis that shows the first largest.
fn flat(a: [DVec3; 3], b: [DVec3; 3]) -> ([Coord<f64>; 3], [Coord<f64>; 3]) {
    let normal = (a[1] - a[0]).cross(a[2] - a[0]).abs();
    let axis = if normal.x >= normal.y.max(normal.z) {
        0
    } else if normal.y >= normal.z {
        1
    } else {
        2
    };
    let seen = |p: DVec3| Coord { x: p[(axis + 1) % 3], y: p[(axis + 2) % 3] };
    (a.map(seen), b.map(seen))
}
