//! What the signs of a cubic cell's corners imply: the loops that a surface between them leaves on the cell's faces.
//!
//! A dual surface has one quadrilateral for each lattice edge whose ends differ, and one vertex in a cell for each loop
//! (Nielson, Dual Marching Cubes, 2004). Loops instead of cells are what keeps two sheets in one cell apart.
//!
//! One case is left in which that surface is no manifold: a face with inside corners on one diagonal and outside corners on
//! the other, whose two arcs belong to one loop in *both* cells that share it, so that four quadrilaterals meet in one edge
//! (Wenger, Isosurfaces, 2013, section 3.3.5; the cases C16 and C19 of Nielson). Arcs may be paired in two ways on such a
//! face. A loop that holds both arcs falls into two when the pairing changes, in either cell, and no change ever merges loops
//! that were split; so a single pass over the ambiguous faces, each changed if it is still [at fault](at_fault), leaves none.
//! Then a side of a quadrilateral, which is an arc, belongs to exactly two quadrilaterals; and a diagonal joins cells that
//! share only the one lattice edge, so it is never a side nor another diagonal. The triangles are therefore closed,
//! consistently oriented and 2-manifold, whatever the signs.
//!
//! # Numbering
//! A **corner** is its place in bits: 1 for x, 2 for y, 4 for z. An **edge** along `axis` that has the places u and v (0 or 1)
//! on the two axes that follow cyclically is `4 · axis + u + 2 · v`. The **face** on `side` of `axis` is `2 · axis + side`.
//! Signs of corners and joined faces are bits by these numbers.

use std::sync::LazyLock;

/// The loops that the surface leaves on the faces of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loops {
    /// How many there are, at most four.
    pub count: u8,
    /// For each of the twelve edges the loop that crosses it, or [`NO_LOOP`].
    pub of_edge: [u8; 12],
}

/// The entry of an edge that no loop crosses.
pub const NO_LOOP: u8 = u8::MAX;

/// The edge between two corners.
const fn edge_between(a: usize, b: usize) -> usize {
    let axis = match a ^ b {
        1 => 0,
        2 => 1,
        _ => 2,
    };
    edge_at(axis, (a >> ((axis + 1) % 3)) & 1, (a >> ((axis + 2) % 3)) & 1)
}

/// The edge along `axis` that has the places `u` and `v` (0 or 1) on the two axes that follow cyclically.
pub const fn edge_at(axis: usize, u: usize, v: usize) -> usize {
    axis * 4 + u + 2 * v
}

/// Ends of an edge, the lower first.
pub const fn edge_ends(edge: usize) -> (usize, usize) {
    let axis = edge / 4;
    let low = ((edge & 1) << ((axis + 1) % 3)) | (((edge >> 1) & 1) << ((axis + 2) % 3));
    (low, low | (1 << axis))
}

/// Corners of the face on `side` of `axis`, counter-clockwise seen from outside.
const fn face_corners(axis: usize, side: usize) -> [usize; 4] {
    let (u, v, s) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3), side << axis);
    if side == 1 { [s, s | u, s | u | v, s | v] } else { [s, s | v, s | u | v, s | u] }
}

/// The loops of a cell, given which of its corners are inside and which of its faces are joined: inside corners on a diagonal
/// of a face are joined there, and cut off on all other faces.
pub fn loops(inside: u8, joined: u8) -> Loops {
    static UNJOINED: LazyLock<Vec<Loops>> = LazyLock::new(|| (0..=255).map(|inside| follow(inside, 0)).collect());
    if joined == 0 { UNJOINED[usize::from(inside)] } else { follow(inside, joined) }
}

/// Follows the arcs on the faces of a cell.
fn follow(inside: u8, joined: u8) -> Loops {
    // Two faces run along an edge in opposite directions, so each crossed edge has one arc that leaves it.
    let is_inside = |corner: usize| inside >> corner & 1 == 1;
    let mut next = [NO_LOOP; 12];
    for axis in 0..3 {
        for side in 0..2 {
            let corners = face_corners(axis, side);
            let [a, b, c, d] = corners.map(is_inside);
            if a == b && b == c && c == d {
                continue;
            }
            let edge = |i: usize| edge_between(corners[i % 4], corners[(i + 1) % 4]);
            let ambiguous = a == c && b == d;
            let join = ambiguous && joined >> (2 * axis + side) & 1 == 1;
            for i in 0..4 {
                if !is_inside(corners[i]) || is_inside(corners[(i + 1) % 4]) {
                    continue;
                }
                // The arc leaves where the walk round the face goes outside and arrives where it comes back in: on an
                // ambiguous face just before, which cuts off the inside corner, or just after, which joins.
                let arrival = match (ambiguous, join) {
                    (true, false) => i + 3,
                    (true, true) => i + 1,
                    (false, _) => (i + 1..i + 4)
                        .find(|&j| !is_inside(corners[j % 4]) && is_inside(corners[(j + 1) % 4]))
                        .expect("a walk that goes outside comes back"),
                };
                next[edge(i)] = edge(arrival) as u8;
            }
        }
    }
    let mut loops = Loops { count: 0, of_edge: [NO_LOOP; 12] };
    for start in 0..12 {
        if next[start] == NO_LOOP || loops.of_edge[start] != NO_LOOP {
            continue;
        }
        let mut edge = start;
        while loops.of_edge[edge] == NO_LOOP {
            loops.of_edge[edge] = loops.count;
            edge = usize::from(next[edge]);
        }
        loops.count += 1;
    }
    loops
}

/// Whether the ambiguous face across `axis` between the cells `below` and `above`, each as corners inside and faces joined,
/// lies in one loop of either; then it must be joined.
pub fn at_fault(axis: usize, below: (u8, u8), above: (u8, u8)) -> bool {
    let one_loop = |(inside, joined): (u8, u8), side: usize| {
        let loops = loops(inside, joined);
        let corners = face_corners(axis, side);
        let first = loops.of_edge[edge_between(corners[0], corners[1])];
        (1..4).all(|i| loops.of_edge[edge_between(corners[i], corners[(i + 1) % 4])] == first)
    };
    one_loop(below, 1) && one_loop(above, 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_crossed_edge_is_in_one_loop_and_no_other_is() {
        for inside in 0..=255u8 {
            for joined in 0..64 {
                let loops = loops(inside, joined);
                assert!(loops.count <= 4);
                let mut seen = [false; 4];
                for (edge, &of_edge) in loops.of_edge.iter().enumerate() {
                    let (a, b) = edge_ends(edge);
                    let crossed = (inside >> a ^ inside >> b) & 1 == 1;
                    assert_eq!(of_edge != NO_LOOP, crossed, "{inside:08b} {joined:06b} edge {edge}");
                    if crossed {
                        seen[usize::from(of_edge)] = true;
                    }
                }
                assert!(seen.iter().enumerate().all(|(i, &seen)| seen == (i < usize::from(loops.count))));
            }
        }
    }

    #[test]
    fn joining_a_face_at_fault_mends_it_and_merges_nothing() {
        let mut faults = 0;
        for inside in 0..=255u8 {
            for joined in 0..64u8 {
                for axis in 0..3 {
                    for side in 0..2 {
                        let corners = face_corners(axis, side).map(|corner| inside >> corner & 1);
                        let face = 1 << (2 * axis + side);
                        let ambiguous =
                            corners[0] == corners[2] && corners[1] == corners[3] && corners[0] != corners[1];
                        if !ambiguous || joined & face != 0 {
                            continue;
                        }
                        let edges: Vec<usize> = (0..4)
                            .map(|i| edge_between(face_corners(axis, side)[i], face_corners(axis, side)[(i + 1) % 4]))
                            .collect();
                        let one = |loops: Loops| edges.iter().all(|&e| loops.of_edge[e] == loops.of_edge[edges[0]]);
                        let (before, after) = (loops(inside, joined), loops(inside, joined | face));
                        if one(before) {
                            faults += 1;
                            assert!(!one(after) && after.count == before.count + 1, "{inside:08b} {joined:06b}");
                        }
                    }
                }
            }
        }
        assert!(faults > 0);
    }
}
