//! Which edges and vertices carry tubes and caps.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;
use rayon::prelude::*;

use super::cap::Cap;
use super::tube::Tube;
use super::{WIDENED, cone, difference};
use crate::minkowski::Polyhedron;

/// Patches narrower than this, in lattice steps, are left out: their neighbours are widened by more on both sides, even where
/// dozens of them meet.
const NARROW: f64 = WIDENED / 64.0;

/// Vertices that are looked at together.
const CHUNK: usize = 1 << 11;

/// Tubes and caps, in the order of vertices.
#[derive(Debug, Default)]
pub struct Features {
    pub tubes: Vec<Tube>,
    pub caps: Vec<Cap>,
    pub spokes: Vec<DVec3>,
}

/// The tubes and caps of a solid whose triangles have the given unit normals, or zero; those of `backs`, ascending, may have
/// been turned over.
pub fn find(solid: &Polyhedron, normals: &[DVec3], backs: &[u32], radius: f64) -> Features {
    let fans = Fans::new(solid);
    let vertices = solid.positions().len();
    let chunks: Vec<Features> = (0..vertices.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let mut found = Around { solid, normals, backs, radius, spokes: Vec::new(), all: Features::default() };
            for vertex in chunk * CHUNK..vertices.min((chunk + 1) * CHUNK) {
                found.add_vertex(vertex as u32, fans.of(vertex));
            }
            found.all
        })
        .collect();
    let mut all = Features::default();
    for chunk in chunks {
        let first = all.spokes.len() as u32;
        all.tubes.extend_from_slice(&chunk.tubes);
        all.spokes.extend_from_slice(&chunk.spokes);
        all.caps.extend(chunk.caps.iter().map(|cap| Cap { spokes: (first + cap.spokes.0, cap.spokes.1), ..*cap }));
    }
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
        // Each start stands at the end of its fan now, and filling backwards moves it to the beginning.
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

/// An edge at a vertex, as one of its facets has it.
#[derive(Clone, Copy)]
struct Spoke {
    /// The other end of the edge.
    to: u32,
    /// Whether the facet has the edge on its way from the vertex.
    leads_away: bool,
    normal: DVec3,
    /// Whether rounding may have turned the facet over.
    may_be_turned: bool,
}

/// Unit normals across an edge, from one border to the other.
struct Arc {
    borders: [DVec3; 2],
    middle: DVec3,
}

/// What an edge carries.
struct Tubes {
    /// Nothing where it is not convex.
    arcs: Vec<Arc>,
    /// How many of the three edges that a cap needs it stands for: all, if it may be of a sheet or a needle.
    counts: usize,
}

/// The features around one vertex after another.
struct Around<'s> {
    solid: &'s Polyhedron,
    normals: &'s [DVec3],
    backs: &'s [u32],
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
            let may_be_turned = self.backs.binary_search(&triangle).is_ok();
            spokes.push(Spoke { to: next, leads_away: true, normal, may_be_turned });
            spokes.push(Spoke { to: last, leads_away: false, normal, may_be_turned });
        }
        spokes.sort_unstable_by_key(|spoke| (spoke.to, !spoke.leads_away));
        let first = self.all.spokes.len();
        let mut convex = 0;
        for edge in spokes.chunk_by(|a, b| a.to == b.to) {
            let [from, to] = [vertex, edge[0].to].map(|v| self.solid.positions()[v as usize]);
            let along = difference(from, to);
            let length = along.length();
            let direction = along / length;
            self.all.spokes.push(direction);
            let Tubes { arcs, counts } = tubes(edge, direction, self.radius);
            convex += counts;
            if vertex < edge[0].to {
                let tube = |borders: [DVec3; 2]| Tube { start: from, direction, length, borders };
                let parts = arcs.iter().flat_map(|arc| arc.parts());
                self.all.tubes.extend(parts.map(tube));
            }
        }
        // A cap has three sides at the least, each of which is that of a convex edge; but two at the corner of a sheet, and one at
        // the end of a needle.
        if convex < 3 || !self.add_cap(vertex, first) {
            self.all.spokes.truncate(first);
        }
        self.spokes = spokes;
    }

    /// Adds the cap of the edge directions from `first` on, of which only those stay that bound it, if there is one.
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

/// The tubes of an edge with the given facets.
fn tubes(edge: &[Spoke], direction: DVec3, radius: f64) -> Tubes {
    // Away from each facet, in its plane.
    let away = |spoke: &Spoke| {
        let across = direction.cross(spoke.normal);
        if spoke.leads_away { across } else { -across }
    };
    let is_known = |spoke: &Spoke| spoke.normal != DVec3::ZERO && !spoke.may_be_turned;
    match edge {
        [a, b] if a.leads_away && !b.leads_away && is_known(a) && is_known(b) => {
            let (sine, cosine) = (b.normal.dot(away(a)), b.normal.dot(a.normal));
            // Of two facets that are folded onto each other nobody knows on which side the solid is.
            let is_convex = if cosine > 0.0 { radius * sine > NARROW } else { sine > -1e-12 };
            let is_folded = cosine < 0.0 && sine <= 1e-12;
            let middle = if cosine > 0.0 { a.normal + b.normal } else { away(a) + away(b) };
            let arc = || Arc { borders: [a.normal, b.normal], middle: middle.normalize_or_zero() };
            let counts = if is_folded { 3 } else { 1 };
            Tubes { arcs: is_convex.then(arc).into_iter().collect(), counts: if is_convex { counts } else { 0 } }
        }
        _ => {
            let known: Vec<DVec3> = edge.iter().filter(|spoke| spoke.normal != DVec3::ZERO).map(away).collect();
            let arcs = unbound_arcs(&known, direction);
            Tubes { counts: if arcs.is_empty() { 0 } else { 3 }, arcs }
        }
    }
}

/// All unit normals across an edge that are within a quarter turn of these: a superset of those that are needed where
/// it is not known which facet goes with which.
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
    /// The borders of one or two parts that are less than half a turn wide.
    fn parts(&self) -> impl Iterator<Item = [DVec3; 2]> {
        let [start, end] = self.borders;
        let is_wide = start.dot(end) < -0.7;
        let parts =
            if is_wide { [Some([start, self.middle]), Some([self.middle, end])] } else { [Some([start, end]), None] };
        parts.into_iter().flatten()
    }
}
