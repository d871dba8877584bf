//! Joins what lies near one another: vertices become one, and sides and triangles get vertices.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::meetings::{Meeting, closest_shares};
use super::parted::Piece;
use crate::closest::squared_distance;
use crate::mesh::Precision;
use crate::surface::fans::sorted;

/// Joins what lies near one another.
pub(super) fn join(
    pieces: &mut Vec<Piece>,
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
                let places = places.get_or_insert_with(|| Places::of(pieces, positions, 2.0 * distance));
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
    for piece in std::mem::take(pieces) {
        if !piece.corners.iter().any(|&corner| is_touched[corner as usize]) {
            pieces.push(Piece { is_new: is_waiting(&piece), ..piece });
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
        pieces.extend(parts.into_iter().map(|part| Piece { is_new, ..part }));
    }
}

/// Vertices by the cubes that they lie in.
struct Places {
    side: f64,
    cubes: HashMap<[i64; 3], Vec<u32>>,
}

impl Places {
    fn of(pieces: &[Piece], positions: &[DVec3], side: f64) -> Places {
        let mut places = Places { side, cubes: HashMap::new() };
        let mut used = vec![false; positions.len()];
        pieces.iter().flat_map(|piece| piece.corners).for_each(|vertex| used[vertex as usize] = true);
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
