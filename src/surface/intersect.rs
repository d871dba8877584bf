//! Search for triangles of a mesh that meet, by the cells that they lie in.

use crate::parallel::*;
use glam::DVec3;

use crate::cancel::checkpoint;
use crate::mesh::Precision;
use crate::mesh::meet::{are_parted, meet, widest_axis};

/// Enlargement of the boxes of triangles, in pitches, as they are also tested rounded.
const PADDING: f64 = 1e-3;

/// A triangle that may meet others.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    /// Its number.
    pub triangle: u32,
    /// True if pairs with this triangle are wanted; a pair of two inactive triangles is not tested.
    pub is_active: bool,
    /// Its vertices.
    pub vertices: [u32; 3],
    /// The positions of its vertices, in coordinates of cells.
    pub corners: [DVec3; 3],
    least: DVec3,
    greatest: DVec3,
}

impl Candidate {
    /// Creates a candidate from its vertices and their positions.
    pub fn new(triangle: u32, is_active: bool, vertices: [u32; 3], corners: [DVec3; 3]) -> Candidate {
        let [a, b, c] = corners;
        let (least, greatest) = (a.min(b).min(c) - PADDING, a.max(b).max(c) + PADDING);
        Candidate { triangle, is_active, vertices, corners, least, greatest }
    }

    fn touches(&self, other: &Candidate) -> bool {
        self.least.cmple(other.greatest).all() && other.least.cmple(self.greatest).all()
    }

    /// Returns the cells that its box touches.
    pub fn cells(&self) -> impl Iterator<Item = [i32; 3]> + use<> {
        cells_of(self.least, self.greatest)
    }
}

/// Returns the pairs of triangles, by their numbers, for which `do_meet` holds, each ascending, in ascending order. It is
/// called for pairs with an active triangle whose boxes touch in a cell in which it `is_sought`. Triangles should not be much
/// larger than cells.
pub fn pairs(
    candidates: &[Candidate],
    is_sought: impl Fn(&Candidate, [i32; 3]) -> bool + Sync,
    do_meet: impl Fn(&Candidate, &Candidate) -> bool + Sync,
) -> Vec<[u32; 2]> {
    let is_sought = &is_sought;
    let places_of = |(i, candidate): (u32, &Candidate)| {
        checkpoint();
        let candidate = *candidate;
        candidate.cells().filter(move |&cell| is_sought(&candidate, cell)).map(move |cell| (key(cell), i))
    };
    let indices = (0..candidates.len() as u32).into_par_iter().with_min_len(64);
    let mut places: Vec<(u64, u32)> = indices.zip(candidates).flat_map_iter(places_of).collect();
    places.par_sort_unstable_by_key(|place| place.0);
    let groups: Vec<&[(u64, u32)]> = places.chunk_by(|a, b| a.0 == b.0).collect();
    let in_group = |group: &&[(u64, u32)]| {
        checkpoint();
        let mut found = Vec::new();
        let of_group = || group.iter().map(|&(_, i)| &candidates[i as usize]);
        for (i, one) in of_group().enumerate() {
            for other in of_group().skip(i + 1) {
                // Of all cells that both touch, only the lowest tests the pair.
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

/// A triangle, by its vertices, with their exact and their rounded places.
pub struct Placed {
    vertices: [u32; 3],
    precision: Precision,
    /// The exact corners and the rounded ones, each with the axis along which the triangle is widest.
    forms: [([DVec3; 3], usize); 2],
}

impl Placed {
    /// Creates it from the exact places of vertices, and those rounded to a precision.
    pub fn new(vertices: [u32; 3], precision: Precision, places: impl Fn(u32) -> [DVec3; 2]) -> Placed {
        let places = vertices.map(places);
        let form = |form: usize| {
            let corners = places.map(|of_vertex| of_vertex[form]);
            (corners, widest_axis(corners))
        };
        Placed { vertices, precision, forms: [form(0), form(1)] }
    }

    /// Returns whether the triangle, which has an area, and another one meet elsewhere than in what they share, exactly or rounded.
    pub fn meets(&self, other: &Placed) -> bool {
        let [one, two] = [self.vertices, other.vertices];
        let shared = two.map(|vertex| one.iter().position(|&corner| corner == vertex).unwrap_or(3));
        let forms = if self.precision == Precision::Double { 1 } else { 2 };
        self.forms.iter().zip(&other.forms).take(forms).any(|((a, axis), (b, _))| {
            let place = |vertex: u32| {
                let corners = one.iter().zip(a).chain(two.iter().zip(b));
                corners.clone().find(|(corner, _)| **corner == vertex).map_or(DVec3::NAN, |(_, place)| *place)
            };
            !are_parted(a, b, shared, *axis) && meet(one, two, place)
        })
    }
}

/// Returns the cell that a point lies in.
pub fn cell_of(point: DVec3) -> [i32; 3] {
    point.floor().to_array().map(|c| c as i32)
}

/// Returns the cells that a box touches.
pub fn cells_of(least: DVec3, greatest: DVec3) -> impl Iterator<Item = [i32; 3]> {
    let (from, to) = (cell_of(least), cell_of(greatest));
    let row = move |z: i32, y: i32| (from[0]..=to[0]).map(move |x| [x, y, z]);
    (from[2]..=to[2]).flat_map(move |z| (from[1]..=to[1]).flat_map(move |y| row(z, y)))
}

/// Packs a cell into one number: 21 bits per axis hold any lattice.
pub fn key(cell: [i32; 3]) -> u64 {
    cell.into_iter().fold(0, |key, c| key << 21 | (i64::from(c) + (1 << 20)) as u64 & ((1 << 21) - 1))
}
