//! Parts of a closed surface that lie on one another within a distance, as walls and gaps thinner than a file can hold: they get the
//! same vertices, sides and triangles there, and triangles that face each other vanish.
//!
//! Vertices within twice the distance of one another become one, vertices within it of a side or a triangle become corners there, and
//! sides that pass each other get a common vertex, round by round until nothing new is as near (a form of iterated snap rounding;
//! Valque and Lazard, "Removing self-intersections in 3D meshes while preserving floating-point coordinates", 2020). Diagonals between
//! parts of a triangle wait for that: parts with the same corners come to have the same diagonals, where cutting them at once would
//! double the parts from round to round. Each step maps the surface as a chain of triangles: its boundary stays zero, so every edge
//! keeps as many uses in one direction as in the other.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::apart::lowest_first;
use super::fans::sorted;
use crate::box_tree::Box32;
use crate::cancel::checkpoint;
use crate::closest::squared_distance;
use crate::face_tree::FaceTree;
use crate::mesh::meet::{meet_elsewhere, shared_corners, widest_axis};
use crate::mesh::{Aabb, Precision, TriangleMesh};
use crate::parallel::*;

/// Most rounds; each may bring further parts of the surface near one another.
const ROUNDS: usize = 32;

/// The distances that are tried, until all that is near is joined, or what is left does not cross itself: where many sides pass each
/// other, they may bend one another on and on within one, but not within a smaller or a greater one.
const FACTORS: [f64; 7] = [1.0, 0.5, 2.0, 0.25, 4.0, 0.125, 8.0];

/// Most times that the same is joined: what was joined may be parted again where other parts of the surface are.
const MOST_TIMES: usize = 3;

/// Most parts of a triangle of which the diagonals are turned.
const MOST_PARTS: usize = 512;

/// Most passes over the diagonals of a triangle's parts.
const PASSES: usize = 16;

/// Triangles that may be added, per triangle that was looked at first.
const MOST_MORE: usize = 2;

/// What lies near one another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
enum Meeting {
    /// Two vertices, the lower one first.
    Vertices([u32; 2]),
    /// A vertex and an edge, its lower end first.
    Edge { vertex: u32, edge: [u32; 2] },
    /// Two edges, the lower one first.
    Edges([[u32; 2]; 2]),
    /// A vertex and the inside of a triangle, its corners in order.
    Face { vertex: u32, face: [u32; 3] },
    /// Two edges, of which one or both are diagonals between parts of a triangle.
    Diagonals([[u32; 2]; 2]),
}

/// Gives parts of a closed, oriented mesh within a distance of one another the same vertices, and removes triangles that then face
/// each other. Edges must have as many uses in one direction as in the other, and do so after. Vertices come from cuts from the
/// number `first_of_cuts` on, which is returned as it is after. Parts near one another are looked for from `suspects`, and from
/// triangles of cuts that are thinner than the distance. `sources` follow the triangles. Of several vertices the lowest keeps its
/// position; new ones are rounded to a precision. Where that does not come to an end, or leaves what is near as it is and crossing, other
/// distances are tried; if it comes to no end with any, all stays as it is.
pub(crate) fn snap<S: Copy + Send + Sync>(
    mesh: &mut TriangleMesh,
    sources: &mut Vec<S>,
    (first_of_cuts, suspects): (u32, Vec<bool>),
    distance: f64,
    precision: Precision,
) -> u32 {
    let piece = |(whole, (&corners, is_suspect)): (u32, (&[u32; 3], bool))| {
        let height = || Face::new(corners, corners.map(|vertex| mesh.positions[vertex as usize]), [true; 3]).height;
        // Of a triangle without extent it is no number.
        let is_thin = || height() <= distance || height().is_nan();
        let is_new = is_suspect || corners.iter().any(|&vertex| vertex >= first_of_cuts) && is_thin();
        Piece { corners, is_outer: [true; 3], whole, is_new }
    };
    let numbers = (0..mesh.triangles.len() as u32).into_par_iter();
    let pieces: Vec<Piece> =
        numbers.zip(mesh.triangles.par_iter().zip(suspects)).with_min_len(1 << 12).map(piece).collect();
    if !pieces.par_iter().with_min_len(1 << 12).any(|piece| piece.is_new) {
        return first_of_cuts;
    }
    let mut first = None;
    let mut found = None;
    for factor in FACTORS {
        let Some(joined) = in_rounds(pieces.clone(), &mesh.positions, factor * distance, precision) else { continue };
        if joined.is_settled || !joined.has_crossings(&mesh.triangles) {
            found = Some(joined);
            break;
        }
        first = first.or(Some(joined));
    }
    let Some(Joined { pieces, positions, .. }) = found.or(first) else { return first_of_cuts };
    *sources = pieces.iter().map(|piece| sources[piece.whole as usize]).collect();
    let triangles = pieces.into_iter().map(|piece| piece.corners).collect();
    let (compact, used) = TriangleMesh { positions, triangles: Vec::new() }.of_triangles(triangles);
    *mesh = compact;
    used.partition_point(|&vertex| vertex < first_of_cuts) as u32
}

/// A part of a triangle.
#[derive(Clone, Copy, Debug)]
struct Piece {
    corners: [u32; 3],
    /// Whether the side from each corner lies on a side of the triangle.
    is_outer: [bool; 3],
    /// The number of the triangle.
    whole: u32,
    /// True if what is near it was not looked for yet.
    is_new: bool,
}

impl Piece {
    /// Returns the side from a corner to the next.
    fn side(&self, i: usize) -> [u32; 2] {
        [self.corners[i], self.corners[(i + 1) % 3]]
    }
}

/// A surface whose parts near one another were joined.
struct Joined {
    pieces: Vec<Piece>,
    positions: Vec<DVec3>,
    /// True if nothing that was near one another had to be left so, at any time.
    is_settled: bool,
}

impl Joined {
    /// Returns whether pieces that are not as given meet others elsewhere than in corners and sides that they share, by their places.
    fn has_crossings(&self, given: &[[u32; 3]]) -> bool {
        if self.pieces.is_empty() {
            return false;
        }
        let at = |vertex: u32| self.positions[vertex as usize];
        let corners = |piece: u32| self.pieces[piece as usize].corners;
        let pieces: Vec<u32> = (0..self.pieces.len() as u32).collect();
        let tree = FaceTree::of(&pieces, |piece| Box32::around(corners(piece).map(at)));
        let is_changed = |place: usize| {
            let piece = &self.pieces[tree.faces()[place] as usize];
            piece.corners != given[piece.whole as usize]
        };
        let prepare = |place: usize| corners(tree.faces()[place]).map(at);
        let has_area = |[a, b, c]: &[DVec3; 3]| (b - a).cross(c - a) != DVec3::ZERO;
        let look = |one: &[DVec3; 3], other: &[DVec3; 3]| {
            let shared = shared_corners(one, other);
            // Walls between the same corners do not cross.
            let may_meet = shared.contains(&3) && has_area(one) && has_area(other);
            (may_meet && meet_elsewhere(one, other, shared, widest_axis(*one))).then_some(())
        };
        tree.first_of_own_pairs(is_changed, prepare, look).is_some()
    }
}

/// Joins what is near one another; `None` if that does not come to an end.
fn in_rounds(mut pieces: Vec<Piece>, positions: &[DVec3], distance: f64, precision: Precision) -> Option<Joined> {
    let most = pieces.len() + MOST_MORE * (64 + pieces.iter().filter(|piece| piece.is_new).count());
    let mut positions = positions.to_vec();
    let mut times: HashMap<Meeting, usize> = HashMap::new();
    let mut is_settled = true;
    for _ in 0..ROUNDS {
        checkpoint();
        let mut meetings = meetings(&pieces, &positions, distance);
        let is_diagonal = |meeting: &Meeting| matches!(meeting, Meeting::Diagonals(_));
        let are_diagonals = meetings.iter().all(is_diagonal);
        meetings.retain(|meeting| {
            if is_diagonal(meeting) && !are_diagonals {
                return true;
            }
            let times = times.entry(*meeting).or_default();
            *times += 1;
            is_settled &= *times <= MOST_TIMES;
            *times <= MOST_TIMES
        });
        if meetings.is_empty() {
            return Some(Joined { pieces, positions, is_settled });
        }
        apply(&mut pieces, &mut positions, &meetings, distance, precision);
        let mut kept = without_opposites(&pieces, positions.len()).into_iter();
        pieces.retain(|_| kept.next().expect("one flag per piece"));
        if pieces.len() > most {
            return None;
        }
    }
    None
}

/// A triangle with its plane.
struct Face {
    vertices: [u32; 3],
    corners: [DVec3; 3],
    is_outer: [bool; 3],
    /// The box around the side from each corner.
    around: [Aabb; 3],
    /// Of length 1; zero if the triangle has no area.
    normal: DVec3,
    /// Its least height.
    height: f64,
    /// A bound on the error of the distance of a point near it from its plane.
    error: f64,
}

impl Face {
    fn new(vertices: [u32; 3], corners: [DVec3; 3], is_outer: [bool; 3]) -> Face {
        let ends = [0, 1, 2].map(|i| [corners[i], corners[(i + 1) % 3]]);
        let around = ends.map(|[p, q]| Aabb { min: p.min(q), max: p.max(q) });
        let lengths = ends.map(|[p, q]| p.distance(q));
        let longest = (0..3).max_by(|&i, &j| lengths[i].total_cmp(&lengths[j])).unwrap_or(0);
        // From the corner between the shorter sides, where the rounding is least.
        let [a, b, c] = [2, 0, 1].map(|i| corners[(longest + i) % 3]);
        let normal = (b - a).cross(c - a);
        let height = normal.length() / lengths[longest];
        let error = 8.0 * f64::EPSILON * lengths.iter().product::<f64>() / normal.length();
        Face { vertices, corners, is_outer, around, normal: normal.normalize_or_zero(), height, error }
    }
}

/// Returns what lies near one another of pairs of triangles of which one is new, in order.
fn meetings(pieces: &[Piece], positions: &[DVec3], distance: f64) -> Vec<Meeting> {
    let at = |vertex: u32| positions[vertex as usize];
    let extent = |face: u32| {
        let [a, b, c] = pieces[face as usize].corners.map(at);
        Box32::of(Aabb { min: a.min(b).min(c) - 0.5 * distance, max: a.max(b).max(c) + 0.5 * distance })
    };
    let near = near(pieces, extent);
    if near.is_empty() {
        return Vec::new();
    }
    let tree = FaceTree::of(&near, extent);
    let prepare = |place: usize| {
        let Piece { corners, is_outer, .. } = pieces[tree.faces()[place] as usize];
        Face::new(corners, corners.map(at), is_outer)
    };
    let is_wanted = |place: usize| pieces[tree.faces()[place] as usize].is_new;
    let look = |one: &Face, other: &Face, found: &mut Vec<Meeting>| of_pair(one, other, distance, found);
    tree.distinct_of_own_pairs(is_wanted, prepare, look)
}

/// Returns the triangles that may be near new ones, in order: those whose boxes touch cells that the boxes of new ones touch.
fn near(pieces: &[Piece], extent: impl Fn(u32) -> Box32 + Sync) -> Vec<u32> {
    /// Number of cells along each side of the box of all new triangles.
    const CELLS: usize = 64;
    /// Most cells that are marked one by one.
    const MOST_CELLS: usize = 1 << 22;
    let new: Vec<Box32> =
        (0..pieces.len() as u32).into_par_iter().filter(|&face| pieces[face as usize].is_new).map(&extent).collect();
    if new.is_empty() {
        return Vec::new();
    }
    let bounds = new.iter().copied().fold(Box32::EMPTY, Box32::union);
    let [min, max] = bounds.corners();
    let scale = CELLS as f64 / (max - min).max(DVec3::splat(f64::MIN_POSITIVE));
    let range = |extent: &Box32| {
        let cell = |at: f64| (at.max(0.0) as usize).min(CELLS - 1);
        extent.corners().map(|corner| ((corner - min) * scale).to_array().map(cell))
    };
    let cells = |extent: &Box32| {
        let [from, to] = range(extent);
        let row = move |z: usize, y: usize| (from[0]..=to[0]).map(move |x| (z * CELLS + y) * CELLS + x);
        (from[2]..=to[2]).flat_map(move |z| (from[1]..=to[1]).flat_map(move |y| row(z, y)))
    };
    let mut is_marked = vec![false; CELLS * CELLS * CELLS];
    // Of boxes that fill most of it, cells tell nothing.
    let count = |extent: &Box32| {
        let [from, to] = range(extent);
        (0..3).map(|axis| to[axis] + 1 - from[axis]).product::<usize>()
    };
    match new.iter().map(count).sum::<usize>() <= MOST_CELLS {
        true => new.iter().flat_map(cells).for_each(|cell| is_marked[cell] = true),
        false => is_marked.fill(true),
    }
    let may_touch = |face: &u32| {
        let extent = extent(*face);
        extent.touches(&bounds) && cells(&extent).any(|cell| is_marked[cell])
    };
    (0..pieces.len() as u32).into_par_iter().with_min_len(1 << 10).filter(may_touch).collect()
}

/// Adds what of two triangles lies near one another.
fn of_pair(one: &Face, other: &Face, distance: f64, found: &mut Vec<Meeting>) {
    let heights = |face: &Face, of: &Face| of.corners.map(|corner| face.normal.dot(corner - face.corners[0]));
    let both = [heights(one, other), heights(other, one)];
    for (face, heights) in [one, other].into_iter().zip(both) {
        let limit = distance + face.error;
        // The error of a triangle without area is no number.
        if heights.iter().all(|&height| height > limit) || heights.iter().all(|&height| height < -limit) {
            return;
        }
    }
    for (face, of, heights) in [(one, other, both[0]), (other, one, both[1])] {
        for (i, height) in heights.into_iter().enumerate() {
            let (vertex, point) = (of.vertices[i], of.corners[i]);
            let is_far = height.abs() > distance + face.error;
            if !is_far && !face.vertices.contains(&vertex) {
                beside(vertex, point, face, distance, found);
            }
        }
    }
    let are_apart = |edge: &[u32; 2], other: &[u32; 2]| !edge.iter().any(|end| other.contains(end));
    // A side that stays on one side of the other's plane passes none of its sides.
    let comes_near = |face: &Face, heights: [f64; 3], i: usize| {
        let (limit, ends) = (distance + face.error, [heights[i], heights[(i + 1) % 3]]);
        !(ends.iter().all(|&height| height > limit) || ends.iter().all(|&height| height < -limit))
    };
    for i in (0..3).filter(|&i| comes_near(other, both[1], i)) {
        let (edge, ends) = side(one, i);
        for j in (0..3).filter(|&j| comes_near(one, both[0], j)) {
            let (second, second_ends) = side(other, j);
            if are_apart(&edge, &second)
                && may_be_near(one.around[i], other.around[j], distance)
                && do_pass(ends, second_ends, distance)
            {
                let edges = [edge.min(second), edge.max(second)];
                found.push(match one.is_outer[i] && other.is_outer[j] {
                    true => Meeting::Edges(edges),
                    false => Meeting::Diagonals(edges),
                });
            }
        }
    }
}

/// Returns false for boxes whose contents are farther from one another than a distance, whatever rounding does.
fn may_be_near(one: Aabb, other: Aabb, distance: f64) -> bool {
    let slack = DVec3::splat(2.0 * distance);
    (one.min - slack).cmple(other.max).all() && (other.min - slack).cmple(one.max).all()
}

/// Returns a side of a face, its lower end first.
fn side(face: &Face, i: usize) -> ([u32; 2], [DVec3; 2]) {
    let (j, corners) = ((i + 1) % 3, &face.corners);
    let [u, v] = [face.vertices[i], face.vertices[j]];
    if u < v { ([u, v], [corners[i], corners[j]]) } else { ([v, u], [corners[j], corners[i]]) }
}

/// Adds the corner, or else the sides, or else the face that a vertex is near to.
fn beside(vertex: u32, point: DVec3, face: &Face, distance: f64, found: &mut Vec<Meeting>) {
    let near_corner = (0..3).find(|&i| face.corners[i].distance_squared(point) <= 4.0 * distance * distance);
    if let Some(i) = near_corner {
        let corner = face.vertices[i];
        return found.push(Meeting::Vertices([vertex.min(corner), vertex.max(corner)]));
    }
    let before = found.len();
    for i in 0..3 {
        let (edge, ends) = side(face, i);
        if may_be_near(Aabb { min: point, max: point }, face.around[i], distance) && is_beside(point, ends, distance) {
            found.push(Meeting::Edge { vertex, edge });
        }
    }
    let [a, b, _] = face.around;
    if found.len() == before
        && face.height > 2.0 * distance
        && may_be_near(Aabb { min: point, max: point }, a.union(b), distance)
        && squared_distance(point, face.corners) <= distance * distance
    {
        let mut corners = face.vertices;
        corners.sort_unstable();
        found.push(Meeting::Face { vertex, face: corners });
    }
}

/// Returns whether a point lies within a distance of the inside of a segment.
fn is_beside(point: DVec3, [from, to]: [DVec3; 2], distance: f64) -> bool {
    let along = to - from;
    let share = along.dot(point - from) / along.length_squared();
    (0.0..=1.0).contains(&share) && (from + share * along).distance_squared(point) <= distance * distance
}

/// Returns the shares of two segments at which they are closest, unless they are parallel. Of nearly parallel ones the first is as
/// precise as their distance from each other, and the second is where the other is closest to that point; of parallel ones the first
/// may be any by rounding.
fn closest_shares([p, q]: [DVec3; 2], [r, s]: [DVec3; 2]) -> Option<[f64; 2]> {
    let (u, v, w) = (q - p, s - r, r - p);
    let across = |vector: DVec3| vector - vector.dot(v) / v.length_squared() * v;
    let aside = across(u);
    let share = across(w).dot(aside) / aside.length_squared();
    share.is_finite().then(|| [share, (share * u - w).dot(v) / v.length_squared()])
}

/// Returns whether two segments pass each other within a distance, and no end is as near to the other segment.
fn do_pass(one: [DVec3; 2], other: [DVec3; 2], distance: f64) -> bool {
    let Some([s, t]) = closest_shares(one, other) else { return false };
    if !(0.0..=1.0).contains(&s) || !(0.0..=1.0).contains(&t) {
        return false;
    }
    let (p, q) = (one[0].lerp(one[1], s), other[0].lerp(other[1], t));
    p.distance_squared(q) <= 0.25 * distance * distance
        && !one.iter().any(|&end| is_near(end, other, distance))
        && !other.iter().any(|&end| is_near(end, one, distance))
}

fn is_near(point: DVec3, segment: [DVec3; 2], distance: f64) -> bool {
    is_beside(point, segment, distance)
        || segment.iter().any(|&end| end.distance_squared(point) <= 4.0 * distance * distance)
}

/// Joins what lies near one another.
fn apply(
    triangles: &mut Vec<Piece>,
    positions: &mut Vec<DVec3>,
    meetings: &[Meeting],
    distance: f64,
    precision: Precision,
) {
    let mut places: Option<Places> = None;
    let mut kept: HashMap<u32, u32> = HashMap::new();
    let mut heads: HashSet<u32> = HashSet::new();
    for meeting in meetings {
        if let &Meeting::Vertices([low, high]) = meeting
            && !kept.contains_key(&low)
            && !kept.contains_key(&high)
            && !heads.contains(&high)
        {
            kept.insert(high, low);
            heads.insert(low);
        }
    }
    let join = |vertex: u32| kept.get(&vertex).copied().unwrap_or(vertex);
    let bent: HashSet<[u32; 2]> = meetings
        .iter()
        .filter_map(|meeting| match meeting {
            Meeting::Edge { edge, .. } => Some(*edge),
            _ => None,
        })
        .collect();
    // The parts of triangles come to have the same diagonals once they have the same corners.
    let are_diagonals = meetings.iter().all(|meeting| matches!(meeting, Meeting::Diagonals(_)));
    let mut waiting: HashSet<[u32; 2]> = HashSet::new();
    let mut on_edges: HashMap<[u32; 2], Vec<(f64, u32)>> = HashMap::new();
    let mut in_faces: HashMap<[u32; 3], Vec<u32>> = HashMap::new();
    let mut insert = |positions: &[DVec3], vertex: u32, edge: [u32; 2]| {
        let [from, to] = sorted(edge.map(join));
        let vertex = join(vertex);
        if from == to || vertex == from || vertex == to {
            return;
        }
        let [a, b, point] = [from, to, vertex].map(|vertex| positions[vertex as usize]);
        let share = (point - a).dot(b - a) / (b - a).length_squared();
        let on_edge = on_edges.entry([from, to]).or_default();
        if on_edge.iter().all(|&(_, other)| other != vertex) {
            on_edge.push((share, vertex));
        }
    };
    for meeting in meetings {
        match *meeting {
            Meeting::Vertices(_) => {}
            Meeting::Edge { vertex, edge } => insert(positions, vertex, edge),
            Meeting::Diagonals(edges) if !are_diagonals => waiting.extend(edges),
            Meeting::Edges(edges) | Meeting::Diagonals(edges) => {
                let is_settled = |edge: &[u32; 2]| {
                    bent.contains(edge) || edge.iter().any(|end| join(*end) != *end || heads.contains(end))
                };
                if edges.iter().any(is_settled) {
                    waiting.extend(edges);
                    continue;
                }
                let ends = edges.map(|edge| edge.map(|vertex| positions[vertex as usize]));
                let Some([s, t]) = closest_shares(ends[0], ends[1]) else { continue };
                let [p, q] = [ends[0][0].lerp(ends[0][1], s), ends[1][0].lerp(ends[1][1], t)];
                let places = places.get_or_insert_with(|| Places::of(triangles, positions, 2.0 * distance));
                let vertex = places.find_or_add(precision.round(0.5 * (p + q)), positions);
                edges.into_iter().for_each(|edge| insert(positions, vertex, edge));
            }
            Meeting::Face { vertex, face } => {
                let mut face = face.map(join);
                face.sort_unstable();
                in_faces.entry(face).or_default().push(join(vertex));
            }
        }
    }
    on_edges.values_mut().for_each(|on_edge| on_edge.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))));
    let mut is_touched = vec![false; positions.len()];
    let ends = on_edges.keys().flatten().chain(in_faces.keys().flatten());
    kept.keys().chain(ends).for_each(|&vertex| is_touched[vertex as usize] = true);
    let is_waiting = |piece: &Piece| (0..3).any(|i| waiting.contains(&sorted(piece.side(i))));
    for piece in std::mem::take(triangles) {
        if !piece.corners.iter().any(|&corner| is_touched[corner as usize]) {
            triangles.push(Piece { is_new: is_waiting(&piece), ..piece });
            continue;
        }
        let joined = Piece { corners: piece.corners.map(join), ..piece };
        let mut parts = vec![joined];
        for i in 0..3 {
            let [from, to] = [joined.corners[i], joined.corners[(i + 1) % 3]];
            let Some(on_edge) = on_edges.get(&sorted([from, to])) else { continue };
            let mut last = from;
            let mut insert = |vertex: u32| {
                split_side(&mut parts, [last, to], vertex);
                last = vertex;
            };
            match from < to {
                true => on_edge.iter().for_each(|&(_, vertex)| insert(vertex)),
                false => on_edge.iter().rev().for_each(|&(_, vertex)| insert(vertex)),
            }
        }
        let mut corners = joined.corners;
        corners.sort_unstable();
        for &vertex in in_faces.get(&corners).into_iter().flatten() {
            split_inside(&mut parts, vertex, positions);
        }
        let is_new = parts.len() > 1 || joined.corners != piece.corners || is_waiting(&piece);
        parts.retain(|&Piece { corners: [a, b, c], .. }| a != b && b != c && c != a);
        triangles.extend(parts.into_iter().map(|part| Piece { is_new, ..part }));
    }
    turn_diagonals(triangles, positions);
}

/// Vertices by the cubes that they lie in.
struct Places {
    side: f64,
    cubes: HashMap<[i64; 3], Vec<u32>>,
}

impl Places {
    fn of(triangles: &[Piece], positions: &[DVec3], side: f64) -> Places {
        let mut places = Places { side, cubes: HashMap::new() };
        let mut used = vec![false; positions.len()];
        triangles.iter().flat_map(|piece| piece.corners).for_each(|vertex| used[vertex as usize] = true);
        for (vertex, &position) in (0..).zip(positions).filter(|(vertex, _)| used[*vertex as usize]) {
            places.cubes.entry(places.cube(position)).or_default().push(vertex);
        }
        places
    }

    fn cube(&self, position: DVec3) -> [i64; 3] {
        (position / self.side).floor().to_array().map(|c| c as i64)
    }

    /// Returns the nearest vertex within a side of a position, or else a new one there.
    fn find_or_add(&mut self, position: DVec3, positions: &mut Vec<DVec3>) -> u32 {
        let [x, y, z] = self.cube(position);
        let near =
            (-1..=1).flat_map(|dx| (-1..=1).flat_map(move |dy| (-1..=1).map(move |dz| [x + dx, y + dy, z + dz])));
        let square = |vertex: u32| positions[vertex as usize].distance_squared(position);
        let nearest = near
            .filter_map(|cube| self.cubes.get(&cube))
            .flatten()
            .map(|&vertex| (square(vertex), vertex))
            .filter(|&(square, _)| square <= self.side * self.side)
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        nearest.map(|(_, vertex)| vertex).unwrap_or_else(|| {
            let vertex = positions.len() as u32;
            positions.push(position);
            self.cubes.entry([x, y, z]).or_default().push(vertex);
            vertex
        })
    }
}

/// Splits the part that has a side at a vertex. Parts without area stay, as their sides may be split as well.
fn split_side(parts: &mut Vec<Piece>, [from, to]: [u32; 2], vertex: u32) {
    let has_side = |place: usize| (0..3).find(|&i| parts[place].side(i) == [from, to]);
    let Some((place, side)) = (0..parts.len()).find_map(|place| Some((place, has_side(place)?))) else { return };
    let part = parts[place];
    let opposite = part.corners[(side + 2) % 3];
    let [on, after, before] = [0, 1, 2].map(|i| part.is_outer[(side + i) % 3]);
    parts[place] = Piece { corners: [from, vertex, opposite], is_outer: [on, false, before], ..part };
    parts.push(Piece { corners: [vertex, to, opposite], is_outer: [on, after, false], ..part });
}

/// Splits the part that a vertex lies in.
fn split_inside(parts: &mut Vec<Piece>, vertex: u32, positions: &[DVec3]) {
    let at = |vertex: u32| positions[vertex as usize];
    if parts.iter().any(|part| part.corners.contains(&vertex)) {
        return;
    }
    let distance = |part: &Piece| squared_distance(at(vertex), part.corners.map(at));
    let nearest = (0..parts.len()).min_by(|&i, &j| distance(&parts[i]).total_cmp(&distance(&parts[j])));
    let Some(place) = nearest else { return };
    let part = parts[place];
    let with = |side: usize| {
        let [from, to] = part.side(side);
        Piece { corners: [from, to, vertex], is_outer: [part.is_outer[side], false, false], ..part }
    };
    parts[place] = with(0);
    parts.extend([with(1), with(2)]);
}

/// Turns diagonals between new parts of one triangle: to sides of other triangles that join two of their corners, and else to a
/// Delaunay triangulation of these, about. So parts of two triangles that lie on each other come to be the same.
fn turn_diagonals(pieces: &mut [Piece], positions: &[DVec3]) {
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

/// Returns which triangles are left once those with the same corners that face each other are removed in pairs.
fn without_opposites(pieces: &[Piece], vertices: usize) -> Vec<bool> {
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
    let mut kept = vec![true; pieces.len()];
    for same in order.chunk_by(|a, b| a.0 == b.0) {
        let (front, back) = same.split_at(same.partition_point(|&(_, is_back, _)| !is_back));
        for (one, other) in front.iter().zip(back) {
            kept[one.2 as usize] = false;
            kept[other.2 as usize] = false;
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;
    use crate::solids::{cuboid, geodesic};
    use crate::surface::manifold::ManifoldReport;
    use crate::surface::take_apart;

    const DISTANCE: f64 = 1e-11;

    /// Returns both meshes as one.
    fn beside(mut mesh: TriangleMesh, other: &TriangleMesh) -> TriangleMesh {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(&other.positions);
        mesh.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + first)));
        mesh
    }

    fn snapped(mut mesh: TriangleMesh) -> TriangleMesh {
        let mut sources: Vec<usize> = (0..mesh.triangles.len()).collect();
        let suspects = vec![true; mesh.triangles.len()];
        let vertices = mesh.positions.len() as u32;
        snap(&mut mesh, &mut sources, (vertices, suspects), DISTANCE, Precision::Double);
        take_apart(&mut mesh, &mut sources, Precision::Double);
        assert_eq!(mesh.triangles.len(), sources.len());
        let report = ManifoldReport::of(&mesh, Precision::Double);
        assert!(report.passed(), "{:?}", report.failures());
        mesh
    }

    #[test]
    fn gaps_and_walls_thinner_than_the_distance_vanish() {
        let whole = cuboid(DVec3::ZERO, DVec3::ONE).unwrap();
        for turn in 0..40 {
            let (size, angle) = (0.2 + 0.013 * f64::from(turn), 0.37 * f64::from(turn));
            // On top of the first, turned about a vertical axis and tilted by less than the distance, its lower side facing down.
            let placed = |low: f64, high: f64, height: f64| {
                let tilt = DQuat::from_rotation_x(2e-13) * DQuat::from_rotation_z(angle);
                let corners = [DVec3::new(-0.5, -0.5, low), DVec3::new(0.5, 0.5, high)].map(|corner| corner * size);
                let mut mesh = cuboid(corners[0], corners[1]).unwrap();
                mesh.positions.iter_mut().for_each(|p| *p = tilt * *p + DVec3::new(0.5, 0.5, height));
                mesh
            };
            let on_top = placed(0.0, 1.0, 1.0 + 1e-12);
            let joined = snapped(beside(whole.clone(), &on_top));
            let expected = whole.area() + on_top.area() - 2.0 * size * size;
            assert!((joined.area() - expected).abs() < 1e-9, "{turn}: {} {expected}", joined.area());
            assert!((joined.signed_volume() - 1.0 - size.powi(3)).abs() < 1e-9);
            assert!(whole.positions.iter().all(|position| joined.positions.contains(position)));
            // A cavity up to the top, but for a skin.
            let mut cavity = placed(-1.0, 0.0, 1.0 - 1e-12);
            cavity.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
            let open = snapped(beside(whole.clone(), &cavity));
            let expected = whole.area() + cavity.area() - 2.0 * size * size;
            assert!((open.area() - expected).abs() < 1e-9, "{turn}: {} {expected}", open.area());
        }
    }

    #[test]
    fn nearly_parallel_segments_pass_where_they_cross() {
        let one = [DVec3::new(0.3, 0.1, 0.7), DVec3::new(1.3, 0.1 + 1e-6, 0.7)];
        for share in [0.25, 0.5, 0.9] {
            let at = one[0].lerp(one[1], share);
            let along = DVec3::new(0.7, -1e-6, 0.0);
            let other = [at - share * along, at + (1.0 - share) * along];
            let [s, t] = closest_shares(one, other).unwrap();
            assert!((s - share).abs() < 1e-8 && (t - share).abs() < 1e-8, "{s} {t} {share}");
            assert!(do_pass(one, other, DISTANCE));
            assert!(!do_pass(one, other.map(|end| end + 1e-11 * DVec3::Z), DISTANCE));
        }
        assert_eq!(closest_shares([DVec3::ZERO, DVec3::X], [DVec3::Y, DVec3::Y + 2.0 * DVec3::X]), None);
    }

    #[test]
    fn what_is_farther_apart_stays() {
        let ball = geodesic(1.0, 6).unwrap();
        let mut other = geodesic(1.0, 6).unwrap();
        other.positions.iter_mut().for_each(|position| position.x = 2.0 + 1e-9 - position.x);
        other.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        let both = beside(other, &ball);
        assert_eq!(snapped(both.clone()), both);
    }

    #[test]
    fn boundaries_stay_zero() {
        // A sheet crumpled within some distances: all becomes chains whose edges are used as often in both directions.
        let mut random = crate::testing::random::Random::new(7);
        for _ in 0..50 {
            let mut mesh = beside(geodesic(1.0, 3).unwrap(), &cuboid(DVec3::splat(-0.5), DVec3::splat(0.5)).unwrap());
            mesh.positions.iter_mut().for_each(|position| {
                position.z = DISTANCE * 3.0 * random.unit();
                position.x += DISTANCE * 3.0 * random.unit();
            });
            let count = mesh.triangles.len();
            let mut sources = vec![(); count];
            let vertices = mesh.positions.len() as u32;
            snap(&mut mesh, &mut sources, (vertices, vec![true; count]), DISTANCE, Precision::Double);
            let mut uses: HashMap<[u32; 2], i32> = HashMap::new();
            for &[a, b, c] in &mesh.triangles {
                for [from, to] in [[a, b], [b, c], [c, a]] {
                    *uses.entry(sorted([from, to])).or_default() += if from < to { 1 } else { -1 };
                }
            }
            assert!(uses.values().all(|&uses| uses == 0));
        }
    }
}
