//! Selection of the edges and vertices that carry tubes and caps.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::parallel::*;
use glam::DVec3;

use super::cap::Cap;
use super::tube::Tube;
use super::{WIDENED, cone, difference};
use crate::cancel::checkpoint;
use crate::minkowski::Polyhedron;

/// Width in lattice steps below which patches are omitted: their neighbours are widened by more on both sides, even where
/// dozens of them meet.
const NARROW: f64 = WIDENED / 64.0;

/// The cosine between the normals of facets that are folded onto each other, rather than meeting in a corner of a room.
const FOLDED: f64 = -1e-3;

/// Vertices in one task.
const CHUNK: usize = 1 << 11;

/// Tubes and caps, in the order of vertices.
#[derive(Debug, Default)]
pub struct Features {
    /// Triangles that are also shifted to their other side, ascending.
    pub turned: Vec<u32>,
    pub tubes: Vec<Tube>,
    pub caps: Vec<Cap>,
    pub spokes: Vec<DVec3>,
}

/// Finds the tubes and caps of a solid whose triangles have the given unit normals, or zero; `is_thin` marks triangles so thin
/// that their normals are unreliable.
pub fn find(solid: &Polyhedron, normals: &[DVec3], is_thin: &[bool], radius: f64) -> Features {
    let fans = Fans::new(solid);
    let vertices = solid.positions().len();
    let chunks: Vec<Features> = (0..vertices.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            checkpoint();
            let mut found = Around { solid, normals, is_thin, radius, spokes: Vec::new(), all: Features::default() };
            for vertex in chunk * CHUNK..vertices.min((chunk + 1) * CHUNK) {
                found.add_vertex(vertex as u32, fans.of(vertex));
            }
            found.all
        })
        .collect();
    let mut all = Features::default();
    for chunk in chunks {
        let first = all.spokes.len() as u32;
        all.turned.extend_from_slice(&chunk.turned);
        all.tubes.extend_from_slice(&chunk.tubes);
        all.spokes.extend_from_slice(&chunk.spokes);
        all.caps.extend(chunk.caps.iter().map(|cap| Cap { spokes: (first + cap.spokes.0, cap.spokes.1), ..*cap }));
    }
    all.turned.sort_unstable();
    all.turned.dedup();
    all
}

/// The triangles at each vertex.
struct Fans {
    starts: Vec<u32>,
    triangles: Vec<u32>,
}

impl Fans {
    fn new(solid: &Polyhedron) -> Fans {
        let mut starts = vec![0u32; solid.positions().len() + 1];
        solid.triangles().iter().flatten().for_each(|&vertex| starts[vertex as usize] += 1);
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        // Each start is now the end of its fan, and filling backwards moves it to the beginning.
        let mut triangles = vec![0; sum as usize];
        for (index, triangle) in solid.triangles().iter().enumerate().rev() {
            for &vertex in triangle {
                let start = &mut starts[vertex as usize];
                *start -= 1;
                triangles[*start as usize] = index as u32;
            }
        }
        Fans { starts, triangles }
    }

    fn of(&self, vertex: usize) -> &[u32] {
        &self.triangles[self.starts[vertex] as usize..self.starts[vertex + 1] as usize]
    }
}

/// An edge at a vertex, as seen from one of its facets.
#[derive(Clone, Copy)]
struct Spoke {
    /// The other end of the edge.
    to: u32,
    /// True if the facet's boundary runs along the edge away from the vertex.
    leads_away: bool,
    triangle: u32,
    normal: DVec3,
}

impl Spoke {
    /// Returns the unit vector away from the facet, in its plane and at right angles to the edge.
    fn away(&self, direction: DVec3) -> DVec3 {
        let across = direction.cross(self.normal);
        if self.leads_away { across } else { -across }
    }
}

/// The reliability of facet normals in locating the solid.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Trust {
    Sides,
    /// Facets are thin or folded: their outer side may be an effect of rounding.
    Doubtful,
}

/// Unit normals across an edge, from one border to the other.
struct Arc {
    borders: [DVec3; 2],
    middle: DVec3,
}

/// Collects the features around one vertex after another.
struct Around<'s> {
    solid: &'s Polyhedron,
    normals: &'s [DVec3],
    is_thin: &'s [bool],
    radius: f64,
    spokes: Vec<Spoke>,
    all: Features,
}

impl Around<'_> {
    fn add_vertex(&mut self, vertex: u32, fan: &[u32]) {
        let mut spokes = std::mem::take(&mut self.spokes);
        spokes.clear();
        for &triangle in fan {
            let [a, b, c] = self.solid.triangles()[triangle as usize];
            let (next, last) = if a == vertex {
                (b, c)
            } else if b == vertex {
                (c, a)
            } else {
                (a, b)
            };
            let normal = self.normals[triangle as usize];
            spokes.push(Spoke { to: next, leads_away: true, triangle, normal });
            spokes.push(Spoke { to: last, leads_away: false, triangle, normal });
        }
        spokes.sort_unstable_by_key(|spoke| (spoke.to, !spoke.leads_away));
        let first = self.all.spokes.len();
        let trust = self.trust(vertex, fan, &spokes);
        let mut convex = 0;
        for edge in spokes.chunk_by(|a, b| a.to == b.to) {
            let [from, to] = [vertex, edge[0].to].map(|v| self.solid.positions()[v as usize]);
            let along = difference(from, to);
            let length = along.length();
            let direction = along / length;
            self.all.spokes.push(direction);
            let arcs = arcs(edge, direction, self.radius, trust);
            convex += usize::from(!arcs.is_empty());
            // The other end may not be doubtful.
            if vertex < edge[0].to || trust == Trust::Doubtful {
                let tube = |borders: [DVec3; 2]| Tube { start: from, direction, length, borders };
                let parts = arcs.iter().flat_map(|arc| arc.parts());
                self.all.tubes.extend(parts.map(tube));
            }
        }
        // A cap has at least three sides, each of which is that of a convex edge.
        if (convex < 3 && trust == Trust::Sides) || !self.add_cap(vertex, first) {
            self.all.spokes.truncate(first);
        }
        self.spokes = spokes;
    }

    /// Returns whether the facets around a vertex determine the outer side; marks those that do not to be shifted to both
    /// sides.
    fn trust(&mut self, vertex: u32, fan: &[u32], spokes: &[Spoke]) -> Trust {
        let mut trust = Trust::Sides;
        for &triangle in fan.iter().filter(|&&triangle| self.is_thin[triangle as usize]) {
            self.all.turned.push(triangle);
            trust = Trust::Doubtful;
        }
        for edge in spokes.chunk_by(|a, b| a.to == b.to) {
            let [a, b] = edge else { continue };
            if a.normal.dot(b.normal) < FOLDED {
                let [from, to] = [vertex, a.to].map(|v| self.solid.positions()[v as usize]);
                // By exactly half a turn or inwards.
                if b.normal.dot(a.away(difference(from, to).normalize())) < 1e-12 {
                    self.all.turned.extend([a.triangle, b.triangle]);
                    trust = Trust::Doubtful;
                }
            }
        }
        trust
    }

    /// Adds the cap of the edge directions from `first` on, if there is one, and keeps only those that bound it. Returns
    /// whether there is one.
    fn add_cap(&mut self, vertex: u32, first: usize) -> bool {
        let directions = &self.all.spokes[first..];
        let corners = cone::polygon(directions);
        if corners.is_empty() || self.radius * cone::width(&corners) < NARROW {
            return false;
        }
        let (least, most) = cone::bounds(&corners, directions);
        let bounding = |direction: &DVec3| corners.iter().any(|corner| corner.dot(*direction) > -1e-9);
        let mut kept = first;
        for i in first..self.all.spokes.len() {
            if bounding(&self.all.spokes[i]) {
                self.all.spokes[kept] = self.all.spokes[i];
                kept += 1;
            }
        }
        self.all.spokes.truncate(kept);
        let spokes = (first as u32, (kept - first) as u32);
        self.all.caps.push(Cap { vertex: self.solid.positions()[vertex as usize], spokes, least, most });
        true
    }
}

/// Returns the unit normals away from the solid across an edge with the given facets: if it is convex, or where the solid's
/// side is unknown, those that lead away from the facets.
fn arcs(edge: &[Spoke], direction: DVec3, radius: f64, trust: Trust) -> Vec<Arc> {
    match edge {
        [a, b] if a.leads_away && !b.leads_away && a.normal != DVec3::ZERO && b.normal != DVec3::ZERO => {
            let (sine, cosine) = (b.normal.dot(a.away(direction)), b.normal.dot(a.normal));
            let is_wide = cosine <= 0.0 || radius * sine.abs() > NARROW;
            // For two facets that are folded onto each other the side of the solid is unknown.
            let is_convex = sine > if cosine > 0.0 { 0.0 } else { -1e-12 };
            let side = if is_convex { 1.0 } else { -1.0 };
            let middle =
                if cosine > 0.0 { side * (a.normal + b.normal) } else { a.away(direction) + b.away(direction) };
            let arc = || Arc { borders: [side * a.normal, side * b.normal], middle: middle.normalize_or_zero() };
            (is_wide && (is_convex || trust == Trust::Doubtful)).then(arc).into_iter().collect()
        }
        _ => {
            let known = edge.iter().filter(|spoke| spoke.normal != DVec3::ZERO);
            unbound_arcs(&known.map(|spoke| spoke.away(direction)).collect::<Vec<_>>(), direction)
        }
    }
}

/// Returns all unit normals across an edge that are within a quarter turn of those in `away`: a superset of the necessary ones
/// where the pairing of facets is unknown.
fn unbound_arcs(away: &[DVec3], direction: DVec3) -> Vec<Arc> {
    let reference = away.first().copied().unwrap_or(direction.any_orthonormal_vector());
    let sideways = direction.cross(reference);
    let at = |angle: f64| reference * angle.cos() + sideways * angle.sin();
    let arc = |low: f64, high: f64| Arc { borders: [at(low), at(high)], middle: at(0.5 * (low + high)) };
    if away.is_empty() {
        return vec![arc(0.0, PI), arc(PI, 2.0 * PI)];
    }
    let angles = || away.iter().map(|away| away.dot(sideways).atan2(away.dot(reference)));
    let (low, high) = (angles().fold(0.0, f64::max) - FRAC_PI_2, angles().fold(0.0, f64::min) + FRAC_PI_2);
    if low <= high { vec![arc(low, high)] } else { Vec::new() }
}

impl Arc {
    /// Returns the borders of one or two parts that are less than half a turn wide.
    fn parts(&self) -> impl Iterator<Item = [DVec3; 2]> {
        let [start, end] = self.borders;
        let is_wide = start.dot(end) < -0.7;
        let parts =
            if is_wide { [Some([start, self.middle]), Some([self.middle, end])] } else { [Some([start, end]), None] };
        parts.into_iter().flatten()
    }
}
