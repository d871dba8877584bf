//! The triangulation of the parts of a face that its outline bounds.
//!
//! The outline is known by the numbers of its vertices, and its loops follow from them alone. Positions are rounded as in the
//! file, so that loops may touch or cross by a rounding step. Ear clipping with exact signs of the rounded positions, at first with
//! a margin for what rounding moves, then takes the best ear that is left, so that every piece of outline borders exactly one
//! triangle in any case; the diagonals are turned where that makes the worse triangle better.

use std::collections::HashSet;

use glam::DVec2;
use robust::{Coord, orient2d};

use crate::cancel::checkpoint;

/// Marks the absence of a neighbour.
const NONE: u32 = u32::MAX;

/// Nodes of a polygon from which they are sorted into buckets.
const MANY: usize = 64;

/// Turns of diagonals per triangle at most; a few per cent of them are used.
const TURNS: usize = 16;

/// Appends the triangles of a region to the left of its outline, whose pieces are given by their ends. They turn as the
/// outline does. Positions are rounded to a share `epsilon` of them, and may be off by an error before. Returns false if the outline
/// is not closed.
#[must_use]
pub(super) fn triangulate(
    outline: &mut [[u32; 2]],
    at: impl Fn(u32) -> DVec2,
    (epsilon, error): (f64, f64),
    triangles: &mut Vec<[u32; 3]>,
) -> bool {
    if let &mut [[a, b], [c, d], [e, f]] = outline {
        // One triangle, in one of the two orders of its pieces.
        if b == c && d == e && f == a {
            triangles.push([a, b, d]);
            return true;
        }
        if b == e && f == c && d == a {
            triangles.push([a, b, f]);
            return true;
        }
    }
    outline.sort_unstable();
    let mut ends: Vec<u32> = outline.iter().map(|piece| piece[1]).collect();
    ends.sort_unstable();
    if !outline.iter().map(|piece| piece[0]).eq(ends) {
        return false;
    }
    let mut vertices: Vec<u32> = outline.iter().map(|piece| piece[0]).collect();
    vertices.dedup();
    let points: Vec<DVec2> = vertices.iter().map(|&vertex| at(vertex)).collect();
    let local = |vertex: u32| vertices.partition_point(|&other| other < vertex) as u32;
    let pieces: Vec<[u32; 2]> = outline.iter().map(|piece| piece.map(local)).collect();
    let greatest = points.iter().fold(0.0, |most: f64, point| most.max(point.abs().max_element()));
    let rounding = error + epsilon * greatest;
    let mut region = Region { points: &points, rounding, nodes: Vec::new(), buckets: None, found: Vec::new() };
    let loops = loops(&pieces, &points);
    for polygon in region.polygons(&loops) {
        region.clip(polygon);
    }
    let found = Diagonals::of(region.found, &points).turned();
    triangles.extend(found.into_iter().map(|triangle| triangle.map(|index| vertices[index as usize])));
    true
}

fn turn([a, b, c]: [DVec2; 3]) -> f64 {
    let coord = |p: DVec2| Coord { x: p.x, y: p.y };
    orient2d(coord(a), coord(b), coord(c))
}

/// Returns the loops of pieces that are sorted by their starts. Where several leave a vertex, each loop takes the one that bounds
/// the same corner of the region.
fn loops(pieces: &[[u32; 2]], points: &[DVec2]) -> Vec<Vec<u32>> {
    let mut is_used = vec![false; pieces.len()];
    let mut loops = Vec::new();
    for first in 0..pieces.len() {
        if is_used[first] {
            continue;
        }
        let mut corners = Vec::new();
        let mut piece = first;
        while !is_used[piece] {
            is_used[piece] = true;
            let [from, to] = pieces[piece];
            corners.push(from);
            let start = pieces.partition_point(|other| other[0] < to);
            let leaving = (start..pieces.len()).take_while(|&other| pieces[other][0] == to);
            let back = points[from as usize] - points[to as usize];
            // The corner of the region lies clockwise from the way back.
            let angle = |other: usize| {
                let ahead = points[pieces[other][1] as usize] - points[to as usize];
                let angle = -back.angle_to(ahead);
                if angle > 0.0 { angle } else { angle + std::f64::consts::TAU }
            };
            let free: Vec<usize> = leaving.filter(|&other| !is_used[other] || other == first).collect();
            piece = match free[..] {
                [] => break,
                [only] => only,
                _ => *free.iter().min_by(|a, b| angle(**a).total_cmp(&angle(**b))).expect("there are several"),
            };
        }
        loops.push(corners);
    }
    loops
}

/// A corner of a polygon.
#[derive(Clone, Copy)]
struct Node {
    vertex: u32,
    next: u32,
    previous: u32,
    /// True once it is no corner any more.
    is_cut: bool,
}

/// The nodes of a polygon in square buckets, so that an ear is compared with those nearby alone.
struct Buckets {
    min: DVec2,
    /// 1 / side of a bucket.
    scale: f64,
    counts: [usize; 2],
    /// The offset of the nodes of each bucket, and the end of the last.
    starts: Vec<u32>,
    nodes: Vec<u32>,
}

impl Buckets {
    /// Sorts nodes into about as many buckets. `None` if they have no extent.
    fn of(nodes: &[(u32, DVec2)]) -> Option<Buckets> {
        let (min, max) = nodes
            .iter()
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(min, max), (_, point)| (min.min(*point), max.max(*point)));
        let extent = max - min;
        let side = (extent.x.sqrt() * extent.y.sqrt() / (nodes.len() as f64).sqrt())
            .max(extent.max_element() / nodes.len() as f64);
        let scale = Some(1.0 / side).filter(|scale| scale.is_normal())?;
        let counts = (extent * scale).to_array().map(|count| count as usize + 1);
        let mut buckets = Buckets { min, scale, counts, starts: vec![0; counts[0] * counts[1] + 1], nodes: Vec::new() };
        let places: Vec<usize> = nodes.iter().map(|(_, point)| buckets.number(buckets.place(*point))).collect();
        places.iter().for_each(|&place| buckets.starts[place + 1] += 1);
        (1..buckets.starts.len()).for_each(|i| buckets.starts[i] += buckets.starts[i - 1]);
        let mut free = buckets.starts.clone();
        buckets.nodes = vec![NONE; nodes.len()];
        for (place, (node, _)) in places.into_iter().zip(nodes) {
            buckets.nodes[free[place] as usize] = *node;
            free[place] += 1;
        }
        Some(buckets)
    }

    /// Returns the bucket of a point; monotone in both coordinates.
    fn place(&self, point: DVec2) -> [usize; 2] {
        let place = ((point - self.min) * self.scale).to_array();
        [0, 1].map(|i| (place[i] as usize).min(self.counts[i] - 1))
    }

    fn number(&self, [x, y]: [usize; 2]) -> usize {
        y * self.counts[0] + x
    }

    /// Returns the nodes of the buckets that a box touches, unless there are more than `most` buckets.
    fn near(&self, min: DVec2, max: DVec2, most: usize) -> Option<impl Iterator<Item = u32> + '_> {
        let (low, high) = (self.place(min), self.place(max));
        let rows = low[1]..=high[1];
        let is_few = (high[0] - low[0] + 1) * rows.clone().count() <= most;
        // The buckets of a row are stored one after the other.
        let of_row = move |y: usize| {
            let [first, last] = [low[0], high[0]].map(|x| self.number([x, y]));
            &self.nodes[self.starts[first] as usize..self.starts[last + 1] as usize]
        };
        is_few.then(|| rows.flat_map(of_row).copied())
    }
}

/// Polygons that are being cut into triangles.
struct Region<'p> {
    points: &'p [DVec2],
    /// The distance by which points are rounded.
    rounding: f64,
    nodes: Vec<Node>,
    /// The nodes of the polygon that is being cut, if there are many.
    buckets: Option<Buckets>,
    found: Vec<[u32; 3]>,
}

impl Region<'_> {
    fn point(&self, node: u32) -> DVec2 {
        self.points[self.nodes[node as usize].vertex as usize]
    }

    fn next(&self, node: u32) -> u32 {
        self.nodes[node as usize].next
    }

    fn previous(&self, node: u32) -> u32 {
        self.nodes[node as usize].previous
    }

    fn corner(&self, node: u32) -> [DVec2; 3] {
        [self.previous(node), node, self.next(node)].map(|node| self.point(node))
    }

    /// Adds a ring of nodes and returns the first.
    fn ring(&mut self, corners: &[u32]) -> u32 {
        let (first, count) = (self.nodes.len() as u32, corners.len() as u32);
        self.nodes.extend(corners.iter().zip(0..).map(|(&vertex, i)| Node {
            vertex,
            next: first + (i + 1) % count,
            previous: first + (i + count - 1) % count,
            is_cut: false,
        }));
        first
    }

    fn around(&self, node: u32) -> impl Iterator<Item = u32> + '_ {
        let mut at = Some(node);
        std::iter::from_fn(move || {
            let current = at?;
            at = Some(self.next(current)).filter(|&next| next != node);
            Some(current)
        })
    }

    /// Returns a node of each polygon without holes: loops that turn left, to which those that turn right inside them are
    /// joined by bridges.
    fn polygons(&mut self, loops: &[Vec<u32>]) -> Vec<u32> {
        let area = |corners: &Vec<u32>| {
            let o = self.points[corners[0] as usize];
            let from_o = |index: u32| self.points[index as usize] - o;
            corners.windows(2).map(|side| from_o(side[0]).perp_dot(from_o(side[1]))).sum::<f64>()
        };
        let areas: Vec<f64> = loops.iter().map(area).collect();
        let (mut outer, mut holes): (Vec<usize>, Vec<usize>) = (0..loops.len()).partition(|&i| areas[i] > 0.0);
        // The least polygons first, so that a hole finds the one directly around it.
        outer.sort_by(|&a, &b| areas[a].total_cmp(&areas[b]));
        let outlines: Vec<&Vec<u32>> = outer.iter().map(|&i| &loops[i]).collect();
        let leftmost = |i: usize| {
            let least = |a: &&u32, b: &&u32| {
                let [a, b] = [a, b].map(|index| self.points[**index as usize]);
                a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y))
            };
            *loops[i].iter().min_by(least).expect("a loop has corners")
        };
        let at = |i: &usize| self.points[leftmost(*i) as usize];
        holes.sort_by(|a, b| at(a).x.total_cmp(&at(b).x).then(at(a).y.total_cmp(&at(b).y)));
        let starts: Vec<u32> = holes.iter().map(|&i| leftmost(i)).collect();
        let mut polygons: Vec<u32> = outlines.iter().map(|corners| self.ring(corners)).collect();
        for (hole, start) in holes.into_iter().zip(starts) {
            let ring = self.ring(&loops[hole]);
            let node = self.around(ring).find(|&node| self.nodes[node as usize].vertex == start).unwrap_or(ring);
            let point = self.point(node);
            let is_around = |i: &usize| match self.contains(outlines[*i], point) {
                Some(is_inside) => is_inside,
                // What touches from within is no larger, and nothing of it lies outside.
                None => {
                    1.001 * areas[outer[*i]] >= -areas[hole]
                        && loops[hole]
                            .iter()
                            .all(|&corner| self.contains(outlines[*i], self.points[corner as usize]) != Some(false))
                }
            };
            let around = (0..outlines.len()).find(is_around);
            match around {
                Some(i) => self.join(polygons[i], node),
                // A loop in nothing is a polygon that is thinner than rounding.
                None => polygons.push(ring),
            }
        }
        polygons
    }

    /// Returns whether a loop winds around a point; `None` if the point lies on the loop, within rounding.
    fn contains(&self, corners: &[u32], point: DVec2) -> Option<bool> {
        let mut is_inside = false;
        for (i, &to) in corners.iter().enumerate() {
            let from = corners[(i + corners.len() - 1) % corners.len()];
            let [a, b] = [from, to].map(|index| self.points[index as usize]);
            let reach = 2.0 * self.rounding;
            let is_beside = (point + reach).cmpge(a.min(b)).all() && (point - reach).cmple(a.max(b)).all();
            if is_beside && turn([a, b, point]).abs() <= reach * a.distance(b) {
                return None;
            }
            if (a.y > point.y) != (b.y > point.y) {
                let [low, high] = if a.y < b.y { [a, b] } else { [b, a] };
                is_inside ^= turn([low, high, point]) > 0.0;
            }
        }
        Some(is_inside)
    }

    /// Joins a hole to the polygon around it by a bridge from a leftmost node to one that it sees.
    fn join(&mut self, polygon: u32, hole: u32) {
        let vertex = self.nodes[hole as usize].vertex;
        let touched = self.around(polygon).find(|&node| self.nodes[node as usize].vertex == vertex);
        if let Some(touched) = touched {
            // At a common vertex the two need no bridge.
            let (after_touched, after_hole) = (self.next(touched), self.next(hole));
            self.nodes[touched as usize].next = after_hole;
            self.nodes[after_hole as usize].previous = touched;
            self.nodes[hole as usize].next = after_touched;
            self.nodes[after_touched as usize].previous = hole;
            return;
        }
        let seen = self.seen_from(polygon, hole);
        let (vertex_of_seen, vertex_of_hole) = (self.nodes[seen as usize].vertex, self.nodes[hole as usize].vertex);
        let (after_seen, before_hole) = (self.next(seen), self.previous(hole));
        // seen → hole … around … before the hole → a copy of the hole's node → a copy of the seen one → after it
        let copies = self.nodes.len() as u32;
        let [copy_of_hole, copy_of_seen] = [copies, copies + 1];
        self.nodes.push(Node { vertex: vertex_of_hole, next: copy_of_seen, previous: before_hole, is_cut: false });
        self.nodes.push(Node { vertex: vertex_of_seen, next: after_seen, previous: copy_of_hole, is_cut: false });
        self.nodes[before_hole as usize].next = copy_of_hole;
        self.nodes[after_seen as usize].previous = copy_of_seen;
        self.nodes[seen as usize].next = hole;
        self.nodes[hole as usize].previous = seen;
    }

    /// Returns a node of a polygon that is seen from a hole's leftmost node: the farther end of the side to the left, unless
    /// other corners lie before it; then the one of them that is seen at the least angle (Eberly, "Triangulation by ear
    /// clipping").
    fn seen_from(&self, polygon: u32, hole: u32) -> u32 {
        let from = self.point(hole);
        if let Some(same) = self.around(polygon).find(|&node| self.point(node) == from) {
            return same;
        }
        let mut best: Option<(f64, u32)> = None;
        for node in self.around(polygon) {
            let [a, b] = [self.point(node), self.point(self.next(node))];
            // The region lies to the right of a side that goes down, and so does the hole.
            if a.y >= from.y && b.y <= from.y && a.y > b.y {
                let x = a.x + (from.y - a.y) / (b.y - a.y) * (b.x - a.x);
                if x <= from.x && best.is_none_or(|(nearest, _)| x > nearest) {
                    best = Some((x, if a.x < b.x { node } else { self.next(node) }));
                }
            }
        }
        let Some((x, end)) = best else {
            let distance = |node: &u32| self.point(*node).distance_squared(from);
            return self.around(polygon).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(polygon);
        };
        let tip = self.point(end);
        let mut least = (f64::INFINITY, f64::INFINITY, end);
        let (low, high) = if tip.y < from.y {
            ([tip, from, DVec2::new(x, from.y)], tip.y..=from.y)
        } else {
            ([from, tip, DVec2::new(x, from.y)], from.y..=tip.y)
        };
        for node in self.around(polygon) {
            let point = self.point(node);
            if point.x > from.x || !high.contains(&point.y) || !holds(low, point, 0.0) {
                continue;
            }
            let slope = (point.y - from.y).abs() / (from.x - point.x);
            let is_open = self.opens_to(node, from);
            if is_open && (slope, from.x - point.x) < (least.0, least.1) {
                least = (slope, from.x - point.x, node);
            }
        }
        least.2
    }

    /// Returns whether a point lies within the corner of the region at a node.
    fn opens_to(&self, node: u32, point: DVec2) -> bool {
        let [before, at, after] = self.corner(node);
        let is_convex = turn([before, at, after]) > 0.0;
        let (left_of_first, left_of_second) = (turn([before, at, point]) >= 0.0, turn([at, after, point]) >= 0.0);
        if is_convex { left_of_first && left_of_second } else { left_of_first || left_of_second }
    }

    /// Cuts the polygon of a node into triangles.
    fn clip(&mut self, start: u32) {
        let mut count = self.around(start).count();
        let mut node = start;
        // What has no width comes first: an ear across it would cover what lies beyond.
        let mut misses = 0;
        while count > 3 && misses < count {
            if self.is_folded(node, 0.0) {
                let before = self.previous(node);
                self.cut(node);
                (node, count, misses) = (before, count - 1, 0);
            } else {
                (node, misses) = (self.next(node), misses + 1);
            }
        }
        let nodes: Vec<(u32, DVec2)> = self.around(node).map(|node| (node, self.point(node))).collect();
        self.buckets = (nodes.len() >= MANY).then(|| Buckets::of(&nodes)).flatten();
        misses = 0;
        // Corners that rounding may have moved out of an ear are taken to lie in it, except for this number of ears, as all others
        // have such corners.
        let mut without_margin = 0usize;
        while count > 3 {
            let (previous, next) = (self.previous(node), self.next(node));
            if self.nodes[previous as usize].vertex == self.nodes[next as usize].vertex {
                // The way to a vertex and straight back bounds nothing.
                let after = self.next(next);
                self.nodes[previous as usize].next = after;
                self.nodes[after as usize].previous = previous;
                self.nodes[node as usize].is_cut = true;
                self.nodes[next as usize].is_cut = true;
                (node, count, misses) = (after, count - 2, 0);
                continue;
            }
            let margin = if without_margin == 0 { 2.0 * self.rounding } else { 0.0 };
            if self.is_folded(node, margin) || self.is_ear(node, count, margin) {
                node = self.cut(node);
                (count, misses, without_margin) = (count - 1, 0, without_margin.saturating_sub(1));
                continue;
            }
            node = self.next(node);
            misses += 1;
            if misses == count {
                checkpoint();
                misses = 0;
                if without_margin == 0 {
                    without_margin = 1 + count / 8;
                    continue;
                }
                // Rounding has folded what is left.
                let quality = |node: &u32| quality(self.corner(*node));
                let best = self.around(node).max_by(|a, b| quality(a).total_cmp(&quality(b))).unwrap_or(node);
                node = self.cut(best);
                count -= 1;
            }
        }
        if count == 3 {
            self.cut(node);
        }
    }

    /// Returns whether the outline turns straight back at a node, within a margin, or has a side without length there.
    fn is_folded(&self, node: u32, margin: f64) -> bool {
        let [before, at, after] = self.corner(node);
        let (back, ahead) = (before - at, after - at);
        let is_straight = || {
            let (shorter, longer) = (back.length().min(ahead.length()), back.length().max(ahead.length()));
            // Of sides as short as the margin, all corners are straight within it.
            let margin = if shorter > 4.0 * margin { margin } else { 0.0 };
            turn([before, at, after]).abs() <= margin * longer
        };
        let is_back = before == at || at == after || (back.dot(ahead) > 0.0 && is_straight());
        let [previous, next] = [self.previous(node), self.next(node)].map(|node| self.nodes[node as usize].vertex);
        is_back && previous != next
    }

    /// Returns whether a triangle at a node of a polygon with `count` nodes covers no other corner, nor comes within a margin of one.
    fn is_ear(&self, node: u32, count: usize, margin: f64) -> bool {
        let corner = self.corner(node);
        if turn(corner) <= 0.0 {
            return false;
        }
        let (min, max) = (corner[0].min(corner[1]).min(corner[2]), corner[0].max(corner[1]).max(corner[2]));
        let (min, max) = (min - margin, max + margin);
        let is_covered = |other: u32| {
            let point = self.point(other);
            let may_hold = point.cmpge(min).all() && point.cmple(max).all();
            may_hold && !corner.contains(&point) && turn(self.corner(other)) <= 0.0 && holds(corner, point, margin)
        };
        match self.buckets.as_ref().and_then(|buckets| buckets.near(min, max, count)) {
            Some(mut near) => !near.any(|other| !self.nodes[other as usize].is_cut && is_covered(other)),
            None => !self.around(node).any(is_covered),
        }
    }

    /// Cuts the triangle at a node off, and returns the node from which to go on.
    fn cut(&mut self, node: u32) -> u32 {
        let (previous, next) = (self.previous(node), self.next(node));
        self.found.push([previous, node, next].map(|node| self.nodes[node as usize].vertex));
        self.nodes[previous as usize].next = next;
        self.nodes[next as usize].previous = previous;
        self.nodes[node as usize].is_cut = true;
        // Fewer slivers than from the next node.
        self.next(next)
    }
}

/// Returns whether a triangle that turns left holds a point, up to a margin beyond its sides.
fn holds([a, b, c]: [DVec2; 3], point: DVec2, margin: f64) -> bool {
    [[a, b], [b, c], [c, a]].into_iter().all(|[from, to]| turn([from, to, point]) >= -margin * from.distance(to))
}

/// Returns twice the area by the square of the longest side: about 0.87 at best, and negative if the triangle is turned over.
fn quality([a, b, c]: [DVec2; 3]) -> f64 {
    let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    if longest == 0.0 { 0.0 } else { turn([a, b, c]) / longest }
}

/// Triangles with the neighbours across their diagonals.
struct Diagonals<'p> {
    points: &'p [DVec2],
    triangles: Vec<[u32; 3]>,
    /// The neighbour at the side from each corner to the next.
    neighbours: Vec<[u32; 3]>,
}

impl<'p> Diagonals<'p> {
    fn of(triangles: Vec<[u32; 3]>, points: &'p [DVec2]) -> Diagonals<'p> {
        let mut neighbours = vec![[NONE; 3]; triangles.len()];
        let mut sides: Vec<([u32; 2], u32, u8, bool)> = Vec::with_capacity(3 * triangles.len());
        for (number, triangle) in (0..).zip(&triangles) {
            for side in 0..3u8 {
                let [u, v] = [triangle[usize::from(side)], triangle[usize::from(side + 1) % 3]];
                sides.push(([u.min(v), u.max(v)], number, side, u < v));
            }
        }
        sides.sort_unstable();
        for same in sides.chunk_by(|a, b| a.0 == b.0) {
            // Only what two triangles use, in opposite directions, may be turned.
            if let &[(_, a, i, up), (_, b, j, other_up)] = same
                && up != other_up
            {
                neighbours[a as usize][usize::from(i)] = b;
                neighbours[b as usize][usize::from(j)] = a;
            }
        }
        Diagonals { points, triangles, neighbours }
    }

    fn quality(&self, triangle: [u32; 3]) -> f64 {
        quality(triangle.map(|index| self.points[index as usize]))
    }

    /// Returns the triangles after all turns of diagonals that better the worse of two triangles.
    fn turned(mut self) -> Vec<[u32; 3]> {
        if self.triangles.len() < 2 {
            return self.triangles;
        }
        let mut pending: Vec<u32> = (0..self.triangles.len() as u32).collect();
        let all = self.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]].map(sorted));
        let mut sides: HashSet<[u32; 2]> = all.collect();
        let mut left = TURNS * self.triangles.len();
        while let Some(first) = pending.pop() {
            for side in 0..3 {
                let second = self.neighbours[first as usize][side];
                if second == NONE || left == 0 {
                    continue;
                }
                let triangle = self.triangles[first as usize];
                let [a, b, c] = [triangle[side], triangle[(side + 1) % 3], triangle[(side + 2) % 3]];
                let other = self.triangles[second as usize];
                let Some(place) = other.iter().position(|&index| index != a && index != b) else { continue };
                let d = other[place];
                if c == d || sides.contains(&sorted([c, d])) {
                    continue;
                }
                let now = self.quality(triangle).min(self.quality(other));
                let then = self.quality([a, d, c]).min(self.quality([d, b, c]));
                if then <= now + 1e-9 * now.abs() {
                    continue;
                }
                left -= 1;
                sides.remove(&sorted([a, b]));
                sides.insert(sorted([c, d]));
                self.turn(first, side, second, place);
                pending.extend([first, second]);
                break;
            }
        }
        self.triangles
    }

    /// Replaces the diagonal at a side of the first triangle by the one to the corner of the second at `place`.
    fn turn(&mut self, first: u32, side: usize, second: u32, place: usize) {
        let triangle = self.triangles[first as usize];
        let [a, b, c] = [triangle[side], triangle[(side + 1) % 3], triangle[(side + 2) % 3]];
        let d = self.triangles[second as usize][place];
        let around = self.neighbours[first as usize];
        let [at_bc, at_ca] = [around[(side + 1) % 3], around[(side + 2) % 3]];
        let around = self.neighbours[second as usize];
        // The second is (b, a, d) in some turn: after d comes b.
        let [at_db, at_ad] = [around[place], around[(place + 2) % 3]];
        self.triangles[first as usize] = [a, d, c];
        self.triangles[second as usize] = [d, b, c];
        self.neighbours[first as usize] = [at_ad, second, at_ca];
        self.neighbours[second as usize] = [at_db, at_bc, first];
        for (neighbour, old, new) in [(at_ad, second, first), (at_bc, first, second)] {
            if neighbour != NONE {
                let entries = &mut self.neighbours[neighbour as usize];
                // Two triangles may share two sides; either entry may be replaced only once.
                if let Some(entry) = entries.iter_mut().find(|entry| **entry == old) {
                    *entry = new;
                }
            }
        }
    }
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a comb of teeth, and square holes in its back: all points, and the loops of their numbers.
    fn comb(teeth: u32) -> (Vec<DVec2>, Vec<Vec<u32>>) {
        let width = f64::from(2 * teeth);
        let mut outline = vec![DVec2::new(0.0, -4.0), DVec2::new(width, -4.0)];
        // From right to left.
        for tooth in (0..teeth).rev() {
            let x = f64::from(2 * tooth);
            outline.extend([(2.0, 0.0), (1.5, 0.0), (1.25, 5.0), (1.0, 0.0)].map(|(dx, y)| DVec2::new(x + dx, y)));
        }
        outline.push(DVec2::ZERO);
        let (mut points, mut loops) = (Vec::new(), Vec::new());
        let mut add = |corners: Vec<DVec2>| {
            let first = points.len() as u32;
            loops.push((first..first + corners.len() as u32).collect());
            points.extend(corners);
        };
        add(outline);
        for tooth in 0..teeth {
            let x = f64::from(2 * tooth);
            add([(0.5, -3.0), (0.5, -1.0), (1.5, -1.0), (1.5, -3.0)].map(|(dx, y)| DVec2::new(x + dx, y)).to_vec());
        }
        (points, loops)
    }

    fn is_cut_without_folds(mut outline: [[u32; 2]; 6], points: [DVec2; 6], area: f64) {
        let mut found = Vec::new();
        assert!(triangulate(&mut outline, |vertex| points[vertex as usize], (f64::EPSILON, 0.0), &mut found));
        let areas: Vec<f64> = found.iter().map(|triangle| turn(triangle.map(|v| points[v as usize])) / 2.0).collect();
        assert!(areas.iter().all(|&area| area > -1e-15), "{areas:?}");
        assert!((areas.iter().sum::<f64>() - area).abs() < 1e-14, "{areas:?}");
    }

    #[test]
    fn corners_moved_out_by_rounding_do_not_fold_a_region() {
        // The face x = 3 of a cuboid without the triangle in which a tetrahedron leaves it, seen along x: one corner of that lies on
        // the face's side, but for rounding.
        let points =
            [[3.0, 0.0], [5.0, 2.0], [3.0, 2.0], [3.0, 5.0 / 7.0], [10.0 / 3.0, 1.0 / 3.0 - 5e-17], [3.0, 2.0 / 3.0]];
        let points = points.map(DVec2::from_array);
        assert!(turn([points[0], points[1], points[4]]) < 0.0);
        is_cut_without_folds([[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 0]], points, 2.0 - 1.0 / 126.0);
    }

    #[test]
    fn a_hole_that_touches_two_sides_but_for_rounding_folds_nothing() {
        let points = [
            [0.0, 4.0],
            [2.0, 2.0],
            [1.0, 0.0],
            [5.0 / 7.0, 20.0 / 7.0],
            [4.0 / 3.0, 8.0 / 3.0],
            [1.0 / 3.0, 8.0 / 3.0],
        ];
        let mut points = points.map(DVec2::from_array);
        (points[4].y, points[5].x) = (points[4].y + 4e-16, points[5].x - 5e-17);
        is_cut_without_folds([[0, 2], [1, 0], [2, 1], [3, 4], [4, 5], [5, 3]], points, 3.0 - 2.0 / 21.0);
    }

    #[test]
    fn regions_of_many_corners_are_covered_once() {
        for teeth in [3, 40, 200] {
            let (points, loops) = comb(teeth);
            let sides = |corners: &Vec<u32>| {
                (0..corners.len()).map(|i| [corners[i], corners[(i + 1) % corners.len()]]).collect::<Vec<_>>()
            };
            let mut outline: Vec<[u32; 2]> = loops.iter().flat_map(sides).collect();
            let mut found = Vec::new();
            assert!(triangulate(&mut outline, |vertex| points[vertex as usize], (1e-16, 0.0), &mut found));
            assert_eq!(found.len(), points.len() + 2 * (loops.len() - 1) - 2);
            let areas: Vec<f64> =
                found.iter().map(|triangle| turn(triangle.map(|vertex| points[vertex as usize])) / 2.0).collect();
            assert!(areas.iter().all(|&area| area > 0.0));
            // The back without the holes, and the teeth.
            let expected = f64::from(teeth) * (8.0 - 2.0 + 1.25);
            assert!((areas.iter().sum::<f64>() - expected).abs() < 1e-9 * expected);
        }
    }
}
