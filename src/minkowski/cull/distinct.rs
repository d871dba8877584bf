//! Removal of duplicate primitives, and the triangles of the others.

use crate::parallel::*;

use super::Primitives;

/// A primitive in a canonical order: equal for equal positions and orientation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Shape {
    /// A triangle that begins with the least of its corners.
    Triangle([[i32; 3]; 3]),
    /// A parallelogram that begins with the least of its corners, with the greatest opposite to it.
    Parallelogram([[i32; 3]; 4]),
}

impl Shape {
    /// Creates a triangle that is counter-clockwise from outside.
    pub fn triangle(corners: [[i32; 3]; 3]) -> Shape {
        Shape::Triangle(least_first(corners))
    }

    /// Creates a parallelogram that is counter-clockwise from outside.
    pub fn parallelogram(corners: [[i32; 3]; 4]) -> Shape {
        Shape::Parallelogram(least_first(corners))
    }

    /// Returns its corners in order.
    pub fn corners(&self) -> &[[i32; 3]] {
        match self {
            Shape::Triangle(corners) => corners,
            Shape::Parallelogram(corners) => corners,
        }
    }

    /// Returns a hash that is equal for equal shapes.
    fn hash(&self) -> u64 {
        const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;
        let mixed = self.corners().iter().flatten().fold(0_u64, |hash, &coordinate| {
            (hash.rotate_left(23) ^ u64::from(coordinate.cast_unsigned())).wrapping_mul(FACTOR)
        });
        (mixed ^ mixed >> 29).wrapping_mul(FACTOR) ^ mixed >> 32
    }
}

fn least_first<const N: usize>(mut corners: [[i32; 3]; N]) -> [[i32; 3]; N] {
    let least = (1..N).fold(0, |least, i| if corners[i] < corners[least] { i } else { least });
    corners.rotate_left(least);
    corners
}

/// Number of tables that shapes are distributed over by their hashes, so that several are filled in parallel.
const TABLES: u32 = 8;

/// Removes every shape that equals an earlier one.
pub fn keep_distinct(lists: &mut [Vec<Shape>]) {
    let hashes: Vec<u64> = lists.par_iter().flat_map_iter(|list| list.iter().map(Shape::hash)).collect();
    let starts = starts(lists.iter().map(Vec::len));
    let at = |index: u32| {
        let list = starts.partition_point(|&start| start <= index as usize) - 1;
        &lists[list][index as usize - starts[list]]
    };
    let repeated: Vec<Vec<u32>> =
        (0..TABLES).into_par_iter().map(|table| repeated(&hashes, table, |a, b| at(a) == at(b))).collect();
    if repeated.iter().all(Vec::is_empty) {
        return;
    }
    let mut keep = vec![true; hashes.len()];
    repeated.into_iter().flatten().for_each(|index| keep[index as usize] = false);
    lists.par_iter_mut().zip(&starts).for_each(|(list, &start)| {
        let mut keep = keep[start..].iter();
        list.retain(|_| keep.next().is_some_and(|&keep| keep));
    });
}

/// Returns the shapes of one table that equal an earlier one, by an open hash table of indices with the upper halves of hashes.
fn repeated(hashes: &[u64], table: u32, same: impl Fn(u32, u32) -> bool) -> Vec<u32> {
    const EMPTY: u64 = u64::MAX;
    let mine = || hashes.iter().enumerate().filter(|&(_, hash)| (hash >> 32) as u32 % TABLES == table);
    let mask = (2 * mine().count()).next_power_of_two() - 1;
    let mut slots = vec![EMPTY; mask + 1];
    let mut found = Vec::new();
    for (index, &hash) in mine() {
        let entry = hash >> 32 << 32 | index as u64;
        let mut slot = hash as usize & mask;
        loop {
            let other = slots[slot];
            if other == EMPTY {
                slots[slot] = entry;
                break;
            }
            if other >> 32 == hash >> 32 && same(other as u32, index as u32) {
                found.push(index as u32);
                break;
            }
            slot = (slot + 1) & mask;
        }
    }
    found
}

/// Triangulates all shapes; the triangles of a shape share its positions.
///
/// # Panics
/// If there are 2^32 positions or more, which take 50 GB.
pub fn primitives(lists: &[Vec<Shape>]) -> Primitives {
    let counts = |of: fn(&Shape) -> usize| {
        let counts: Vec<usize> = lists.par_iter().map(|list| list.iter().map(of).sum()).collect();
        starts(counts.into_iter())
    };
    let (corners, triangles) = (counts(|shape| shape.corners().len()), counts(|shape| shape.corners().len() - 2));
    let [position_count, triangle_count] = [&corners, &triangles].map(|starts| starts[lists.len()]);
    assert!(u32::try_from(position_count).is_ok(), "{position_count} positions of primitives are more than 2^32");
    let mut primitives =
        Primitives { positions: vec![[0; 3]; position_count], triangles: vec![[0; 3]; triangle_count] };
    let (mut positions, mut indices) = (&mut primitives.positions[..], &mut primitives.triangles[..]);
    let mut parts = Vec::with_capacity(lists.len());
    for (i, list) in lists.iter().enumerate() {
        let of_list = |starts: &[usize]| starts[i + 1] - starts[i];
        let part = (
            list,
            corners[i] as u32,
            positions.split_off_mut(..of_list(&corners)).expect("they add up"),
            indices.split_off_mut(..of_list(&triangles)).expect("they add up"),
        );
        parts.push(part);
    }
    parts.into_par_iter().for_each(|(list, first, positions, triangles)| write(list, first, positions, triangles));
    primitives
}

/// Writes the positions and triangles of a list of shapes, whose positions begin at `first` among all.
fn write(list: &[Shape], first: u32, positions: &mut [[i32; 3]], triangles: &mut [[u32; 3]]) {
    let (mut next, mut triangles) = (0, triangles.iter_mut());
    for shape in list {
        let corners = shape.corners();
        positions[next..next + corners.len()].copy_from_slice(corners);
        let base = first + next as u32;
        for (last, triangle) in (base + 2..base + corners.len() as u32).zip(&mut triangles) {
            *triangle = [base, last - 1, last];
        }
        next += corners.len();
    }
}

/// Returns the start of each of many parts, and the end of the last one.
fn starts(counts: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut starts = vec![0];
    starts.extend(counts.scan(0, |end, count| {
        *end += count;
        Some(*end)
    }));
    starts
}
