//! The loops that a surface between the corners of a cubic cell leaves on the cell's faces, from the signs of the corners.
//!
//! A dual surface has one quadrilateral for each lattice edge whose ends differ, and one vertex in a cell for each loop
//! (Nielson, Dual Marching Cubes, 2004). One vertex for each loop, not for each cell, keeps two sheets in one cell apart.
//!
//! In one case that surface is not a manifold: a face with inside corners on one diagonal and outside corners on the other,
//! whose two arcs belong to one loop in *both* cells that share it, so that four quadrilaterals meet in one edge (Wenger,
//! Isosurfaces, 2013, section 3.3.5; the cases C16 and C19 of Nielson). Arcs may be paired in two ways on such a face. A loop
//! that holds both arcs splits in two when the pairing changes, in either cell, and no change ever merges loops that were
//! split; so a single pass over the ambiguous faces, changing each that is still [at fault](at_fault), leaves none. Then a side
//! of a quadrilateral, which is an arc, belongs to exactly two quadrilaterals; and a diagonal joins cells that share only the
//! one lattice edge, so it is never a side nor another diagonal. The triangles are therefore closed, consistently oriented and
//! 2-manifold, whatever the signs.
//!
//! # Numbering
//! A **corner** is its position in bits: 1 for x, 2 for y, 4 for z. An **edge** along `axis` at the positions u and v (0 or 1)
//! on the two axes that follow cyclically is `4 · axis + u + 2 · v`. The **face** on `side` of `axis` is `2 · axis + side`.
//! Signs of corners, joined faces and cut edges are bit sets indexed by these numbers.
//!
//! # Cut edges
//! An edge between two corners of the same sign may be *cut*: the surface crosses it twice, around a gap between inside corners or
//! on both sides of a wall between outside ones. The **crossing** at its lower end has the number of the edge, as the crossing of
//! an edge whose ends differ, and the one at its upper end that plus [`UPPER`]. A face with cut edges has up to four arcs, and may
//! be joined as an ambiguous one may: then its arcs cut off intervals outside rather than inside. What is said above about arcs
//! that belong to one loop in both cells holds for any face with two. Around an edge that is cut, the two quadrilaterals may have
//! the same vertices in several cells, where a wall or a gap ends; then they must not both be cut along a diagonal between two of
//! those.

use std::sync::LazyLock;

/// The loops that the surface leaves on the faces of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loops {
    /// The number of loops: at most four, or twelve where edges are cut.
    pub count: u8,
    /// The loop of each crossing, or [`NO_LOOP`].
    pub of_crossing: [u8; 24],
}

/// The number of a cut edge's upper crossing minus that of the edge.
pub const UPPER: usize = 12;

/// The entry of an edge that no loop crosses.
pub const NO_LOOP: u8 = u8::MAX;

/// Returns the edge between two corners.
pub const fn edge_between(a: usize, b: usize) -> usize {
    let axis = match a ^ b {
        1 => 0,
        2 => 1,
        _ => 2,
    };
    edge_at(axis, (a >> ((axis + 1) % 3)) & 1, (a >> ((axis + 2) % 3)) & 1)
}

/// Returns the edge along `axis` at the positions `u` and `v` (0 or 1) on the two axes that follow cyclically.
pub const fn edge_at(axis: usize, u: usize, v: usize) -> usize {
    axis * 4 + u + 2 * v
}

/// Returns the ends of an edge, the lower first.
pub const fn edge_ends(edge: usize) -> (usize, usize) {
    let axis = edge / 4;
    let low = ((edge & 1) << ((axis + 1) % 3)) | (((edge >> 1) & 1) << ((axis + 2) % 3));
    (low, low | (1 << axis))
}

/// Returns the corners of the face on `side` of `axis`, counter-clockwise seen from outside.
pub const fn face_corners(axis: usize, side: usize) -> [usize; 4] {
    let (u, v, s) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3), side << axis);
    if side == 1 { [s, s | u, s | u | v, s | v] } else { [s, s | v, s | u | v, s | u] }
}

/// The signs of a cell's corners with its joined faces and cut edges, which determine its loops.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Signs {
    /// The corners that are inside.
    pub inside: u8,
    /// The joined faces: inside corners on a diagonal of a face, or intervals inside between cut edges, are joined there, and
    /// separated on all other faces.
    pub joined: u8,
    /// The cut edges; both ends of each have the same sign.
    pub cut: u16,
}

impl Signs {
    /// Returns whether both ends of an edge are inside, or both outside.
    fn are_ends_equal(&self, edge: usize) -> bool {
        let (a, b) = edge_ends(edge);
        (self.inside >> a ^ self.inside >> b) & 1 == 0
    }

    /// Returns whether a cut edge lies between outside corners, so that the surface has a wall there, not a gap.
    pub fn is_wall(&self, edge: usize) -> bool {
        self.inside >> edge_ends(edge).0 & 1 == 0
    }
}

/// Returns the loops of a cell.
pub fn loops(signs: Signs) -> Loops {
    static PLAIN: LazyLock<Vec<Loops>> =
        LazyLock::new(|| (0..=255).map(|inside| follow(Signs { inside, ..Signs::default() })).collect());
    if signs.joined == 0 && signs.cut == 0 { PLAIN[usize::from(signs.inside)] } else { follow(signs) }
}

/// Walks around a face, edge by edge from each of its corners to the next, and returns for each edge the crossing where the
/// walk leaves the inside and the one where it returns.
fn around(Signs { inside, cut, .. }: Signs, axis: usize, side: usize) -> [[Option<usize>; 2]; 4] {
    let corners = face_corners(axis, side);
    [0, 1, 2, 3].map(|i| {
        let ends = [corners[i], corners[(i + 1) % 4]];
        let edge = edge_between(ends[0], ends[1]);
        let upper_first = if ends[0] > ends[1] { [edge + UPPER, edge] } else { [edge, edge + UPPER] };
        match (ends.map(|corner| inside >> corner & 1 == 1), cut >> edge & 1 == 1) {
            ([true, true], true) => upper_first.map(Some),
            ([false, false], true) => [Some(upper_first[1]), Some(upper_first[0])],
            ([true, false], _) => [Some(edge), None],
            ([false, true], _) => [None, Some(edge)],
            _ => [None, None],
        }
    })
}

/// Follows the arcs on the faces of a cell.
fn follow(signs: Signs) -> Loops {
    // Two faces run along an edge in opposite directions, so each crossing has one outgoing arc.
    let mut next = [NO_LOOP; 24];
    for axis in 0..3 {
        for side in 0..2 {
            for [from, to] in arcs(signs, axis, side).into_iter().flatten() {
                next[from] = to as u8;
            }
        }
    }
    let mut loops = Loops { count: 0, of_crossing: [NO_LOOP; 24] };
    for start in 0..24 {
        if next[start] == NO_LOOP || loops.of_crossing[start] != NO_LOOP {
            continue;
        }
        let mut crossing = start;
        while loops.of_crossing[crossing] == NO_LOOP {
            loops.of_crossing[crossing] = loops.count;
            crossing = usize::from(next[crossing]);
        }
        loops.count += 1;
    }
    loops
}

/// Returns the arcs on a face, from crossing to crossing.
pub fn arcs(signs: Signs, axis: usize, side: usize) -> [Option<[usize; 2]>; 4] {
    let around = around(signs, axis, side);
    let joins = signs.joined >> (2 * axis + side) & 1 == 1;
    // An arc starts where the walk round the face goes outside. It ends where the walk last came in, which cuts off the corners
    // between, or, on a joined face, where the walk next comes in.
    [0, 1, 2, 3].map(|i| {
        let [leaves, _] = around[i];
        // Through a wall the walk comes in before it goes outside.
        let is_wall = signs.inside >> face_corners(axis, side)[i] & 1 == 0;
        let arrival = match joins {
            true => (0..4).find_map(|ahead| around[(i + usize::from(is_wall) + ahead) % 4][1]),
            false => (0..4).find_map(|back| around[(i + 4 - usize::from(!is_wall) + 4 - back) % 4][1]),
        };
        leaves.zip(arrival).map(|(from, to)| [from, to])
    })
}

/// Returns whether a cut edge of a cell lies between corners of the same sign that no way along edges that are not cut connects.
pub fn parts(signs: Signs, edge: usize) -> bool {
    let mut class: [usize; 8] = [0, 1, 2, 3, 4, 5, 6, 7];
    let connects = |&edge: &usize| signs.are_ends_equal(edge) && signs.cut >> edge & 1 == 0;
    for (a, b) in (0..12).filter(connects).map(edge_ends) {
        let (from, to) = (class[a], class[b]);
        class.iter_mut().filter(|class| **class == from).for_each(|class| *class = to);
    }
    let (a, b) = edge_ends(edge);
    signs.cut >> edge & 1 == 1 && class[a] != class[b]
}

/// Returns whether the face on `side` of `axis` has inside corners on one diagonal alone.
pub fn is_ambiguous(inside: u8, axis: usize, side: usize) -> bool {
    let corners = face_corners(axis, side).map(|corner| inside >> corner & 1);
    corners[0] == corners[2] && corners[1] == corners[3] && corners[0] != corners[1]
}

/// Returns the edges of the face on `side` of `axis`, as bits.
pub fn face_edges(axis: usize, side: usize) -> u16 {
    let corners = face_corners(axis, side);
    (0..4).fold(0, |bits, i| bits | 1 << edge_between(corners[i], corners[(i + 1) % 4]))
}

/// Returns whether two arcs on the face across `axis` between the cells `below` and `above` belong to one loop in both, so that
/// four quadrilaterals would meet in one edge; the arcs must be paired otherwise then.
pub fn at_fault(axis: usize, below: Signs, above: Signs) -> bool {
    let loops = [(below, 1), (above, 0)].map(|(signs, side)| {
        let loops = loops(signs).of_crossing;
        // An arc between two crossings runs one way on one side and the other way on the other.
        let mut of_arcs: Vec<([usize; 2], u8)> = arcs(signs, axis, side)
            .into_iter()
            .flatten()
            .map(|[from, to]| ([from.min(to), from.max(to)], loops[from]))
            .collect();
        // Arcs are identified by their position on the face, which is the same from both cells.
        of_arcs.iter_mut().for_each(|(arc, _)| *arc = arc.map(|crossing| on_face(axis, crossing)));
        of_arcs.iter_mut().for_each(|(arc, _)| arc.sort_unstable());
        of_arcs.sort_unstable();
        of_arcs
    });
    let pairs: Vec<(u8, u8)> = loops[0].iter().zip(&loops[1]).map(|(below, above)| (below.1, above.1)).collect();
    (1..pairs.len()).any(|i| pairs[..i].contains(&pairs[i]))
}

/// Returns the number of a crossing on a face across `axis`, the same from both cells beside the face.
fn on_face(axis: usize, crossing: usize) -> usize {
    let (edge, upper) = (crossing % UPPER, crossing / UPPER);
    let along = edge / 4;
    // Of the positions u and v, the one on `axis` identifies the cell, not the edge.
    let place = if (along + 1) % 3 == axis { edge >> 1 & 1 } else { edge & 1 };
    4 * along + 2 * place + upper
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edges_between_equals(inside: u8) -> u16 {
        (0..12).filter(|&edge| plain(inside, 0).are_ends_equal(edge)).fold(0, |bits, edge| bits | 1 << edge)
    }

    fn plain(inside: u8, joined: u8) -> Signs {
        Signs { inside, joined, cut: 0 }
    }

    #[test]
    fn loops_contain_each_crossing_exactly_once() {
        let check = |signs: Signs| {
            let loops = loops(signs);
            assert!(loops.count <= if signs.cut == 0 { 4 } else { 12 });
            let mut seen = [false; 12];
            for (crossing, &of_crossing) in loops.of_crossing.iter().enumerate() {
                let (a, b) = edge_ends(crossing % UPPER);
                let is_cut = signs.cut >> (crossing % UPPER) & 1 == 1;
                let is_crossed = (signs.inside >> a ^ signs.inside >> b) & 1 == 1;
                assert_eq!(of_crossing != NO_LOOP, is_cut || (is_crossed && crossing < UPPER), "{signs:?} {crossing}");
                if of_crossing != NO_LOOP {
                    seen[usize::from(of_crossing)] = true;
                }
            }
            assert!(seen.iter().enumerate().all(|(i, &seen)| seen == (i < usize::from(loops.count))), "{signs:?}");
        };
        for inside in 0..=255u8 {
            (0..64).for_each(|joined| check(plain(inside, joined)));
            // All subsets of the edges that may be cut.
            let equal = edges_between_equals(inside);
            let mut cut = equal;
            while cut > 0 {
                // Some of the joined faces: all would take minutes.
                let some = (u32::from(cut) * 37 + u32::from(inside) * 11) as u8 & 63;
                [0, 63, some].into_iter().for_each(|joined| check(Signs { inside, joined, cut }));
                cut = (cut - 1) & equal;
            }
        }
    }

    #[test]
    fn a_cell_all_of_whose_edges_are_cut_has_a_loop_for_each_corner() {
        assert_eq!(loops(Signs { inside: 255, joined: 0, cut: 0xfff }).count, 8);
        // The four edges along x split the cell in two.
        assert_eq!(loops(Signs { inside: 255, joined: 0, cut: 0xf }).count, 2);
    }

    #[test]
    fn walls_pass_through_joined_faces_and_end_on_others() {
        // Four edges along x between outside corners, as a wall across x crosses them.
        let (wall, faces) = (Signs { inside: 0, joined: 0, cut: 0xf }, 0b11_1100);
        assert_eq!(loops(Signs { joined: faces, ..wall }).count, 2);
        assert_eq!(loops(wall).count, 4);
        // It ends in this cell: one loop around two edges and the rim between them.
        assert_eq!(loops(Signs { cut: 0b11, joined: faces, ..wall }).count, 1);
        // The same of a gap, whose faces are joined where it ends.
        let gap = Signs { inside: u8::MAX, ..wall };
        assert_eq!([0, faces].map(|joined| loops(Signs { joined, ..gap }).count), [2, 4]);
        assert!((0..4).all(|edge| parts(wall, edge) && parts(gap, edge)) && !parts(wall, 4));
        assert!(!parts(Signs { cut: 0b11, ..wall }, 0));
    }

    #[test]
    fn the_other_pairing_of_two_arcs_splits_their_loop() {
        let mut split = 0;
        for inside in 0..=255u8 {
            let equal = edges_between_equals(inside);
            let mut states: Vec<Signs> = (0..64).map(|joined| plain(inside, joined)).collect();
            let mut cut = equal;
            while cut > 0 {
                let joined = (u32::from(cut) * 29 + u32::from(inside) * 7) as u8 & 63;
                states.push(Signs { inside, joined, cut });
                cut = (cut - 1) & equal;
            }
            for signs in states {
                let of_crossing = loops(signs).of_crossing;
                for (axis, side) in [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1)] {
                    let found: Vec<[usize; 2]> = arcs(signs, axis, side).into_iter().flatten().collect();
                    if let [[a, _], [b, _]] = found[..]
                        && of_crossing[a] == of_crossing[b]
                    {
                        let other = Signs { joined: signs.joined ^ 1 << (2 * axis + side), ..signs };
                        assert_eq!(loops(other).count, loops(signs).count + 1, "{signs:?} {axis} {side}");
                        split += 1;
                    }
                }
            }
        }
        assert!(split > 1000);
    }

    #[test]
    fn joining_a_faulty_face_repairs_it_and_merges_no_loops() {
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
                        let one =
                            |loops: Loops| edges.iter().all(|&e| loops.of_crossing[e] == loops.of_crossing[edges[0]]);
                        let (before, after) = (loops(plain(inside, joined)), loops(plain(inside, joined | face)));
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
