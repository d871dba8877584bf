//! Finds which triangles of a mesh meet, by the cells that they lie in.

use glam::DVec3;
use rayon::prelude::*;

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
