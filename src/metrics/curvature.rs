//! Integrals of curvature over a mesh.
//!
//! A polyhedron is bent at its edges and vertices alone. Steiner's formula for parallel bodies gives what they hold: an edge
//! of length ℓ and exterior angle β (0 where flat, negative where it is reflex) has ½·ℓ·β of ∫H dA, H = (k₁ + k₂)/2, and a
//! vertex with facets' angles α has 2π − Σα of ∫K dA. For a ball of radius R these tend to 4πR and are 4π; for a box of
//! sides a, b, c they are π(a + b + c) and 4π. Over a closed surface ∫K dA = 2πχ (Gauss and Bonnet), which on a mesh holds
//! but for rounding and is a check of what was summed up.
//!
//! # Where the box cuts
//! Facets in a face of the box are no surface, and where they meet it, at the *rim*, neither is the angle between them.
//! So edges and vertices of such facets are left out: sums are over edges whose two facets, and vertices all of whose
//! facets, are surface. That leaves ∫K open at the rim, which turns as it likes. Where the box is a cell that repeats
//! ([`Edges::Periodic`]) it closes: a vertex on the rim is one with its image in the opposite face, and together they have
//! 2π; one by itself has π, or π/2 in an edge of the box. Then ∫K dA is 2πχ of the surface in a cell, exactly. Edges of the
//! rim stay out of ∫H, since their other facet lies in another cell; they are as short, together, as the mesh is fine.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use rayon::prelude::*;

use super::elements::{BoxFaces, SurfaceError};
use super::{Edges, Facets, Region};

/// What the surface within a region is curved by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curvature {
    /// ∫H dA, in world units.
    pub mean: f64,
    /// ∫K dA, a pure number.
    pub gauss: f64,
    /// Σ (2π − Σα) over all vertices of the mesh, facets in faces of the box among them.
    pub gauss_of_mesh: f64,
    /// Vertices − edges + facets of the mesh, 1/2π of the former for a closed one.
    pub characteristic: i64,
    /// Edges of the surface that say nothing of its curvature: in an odd number of facets, or in facets that do not bound
    /// solid by turns. They are left out of `mean`.
    pub irregular_edges: u64,
    /// Facets without area, which have no normal. Their edges count as flat.
    pub degenerate_facets: u64,
}

/// The curvature of the surface within a box that holds the mesh. Positions are merged where they are equal to the bit.
///
/// # Errors
/// If the region is not a box, or does not hold the mesh.
pub fn curvature(facets: &Facets, region: &Region, edges: Edges) -> Result<Curvature, SurfaceError> {
    let faces = BoxFaces::of(region).ok_or(SurfaceError::NotABox)?;
    let surface = super::elements::SurfaceElements::of_facets(facets, region)?;
    let is_cut: Vec<bool> = surface.areas().iter().zip(&facets.areas).map(|(&counts, &all)| counts < all).collect();
    let vertices = merged(facets.positions);
    let corners: Vec<[u32; 3]> = facets.triangles.iter().map(|t| t.map(|v| vertices[v as usize])).collect();
    let Angles { all, of_surface, is_rim } = Angles::of(facets, &corners, &is_cut);

    let (mut gauss, mut gauss_of_mesh, mut used) = (0.0, 0.0, 0);
    for (vertex, &position) in facets.positions.iter().enumerate() {
        if all[vertex] == 0.0 {
            continue;
        }
        used += 1;
        gauss_of_mesh += TAU - all[vertex];
        gauss += match (is_rim[vertex], edges) {
            (false, _) => TAU - of_surface[vertex],
            (true, Edges::Periodic) if of_surface[vertex] > 0.0 => {
                TAU / f64::from(1 << faces.axes_on(position)) - of_surface[vertex]
            }
            (true, _) => 0.0,
        };
    }
    let half_edges = HalfEdge::all_of(&corners);
    let bends: Vec<Bend> = half_edges
        .par_chunk_by(|a, b| a.ends == b.ends)
        .map(|around| Bend::of(facets, around, |facet| is_cut[facet as usize]))
        .collect();
    let count = |wanted: fn(&Bend) -> bool| bends.iter().filter(|bend| wanted(bend)).count() as u64;
    let mean = bends.iter().map(|bend| if let Bend::Regular(integral) = bend { *integral } else { 0.0 }).sum();
    Ok(Curvature {
        mean,
        gauss,
        gauss_of_mesh,
        characteristic: used - bends.len() as i64 + corners.iter().filter(|&&c| is_triangle(c)).count() as i64,
        irregular_edges: count(|bend| matches!(bend, Bend::Irregular)),
        degenerate_facets: facets.areas.iter().filter(|&&area| area == 0.0).count() as u64,
    })
}

fn is_triangle([a, b, c]: [u32; 3]) -> bool {
    a != b && b != c && c != a
}

/// For each position the first that equals it to the bit; the two zeros are one.
fn merged(positions: &[DVec3]) -> Vec<u32> {
    let bits = |v: u32| (positions[v as usize] + 0.0).to_array().map(f64::to_bits);
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.par_sort_unstable_by_key(|&v| (bits(v), v));
    let mut first = vec![0; positions.len()];
    for equal in order.chunk_by(|&a, &b| bits(a) == bits(b)) {
        equal.iter().for_each(|&v| first[v as usize] = equal[0]);
    }
    first
}

/// The angles of facets about each vertex.
struct Angles {
    all: Vec<f64>,
    /// Of facets that are surface.
    of_surface: Vec<f64>,
    /// Whether a facet at the vertex is not.
    is_rim: Vec<bool>,
}

impl Angles {
    fn of(facets: &Facets, corners: &[[u32; 3]], is_cut: &[bool]) -> Angles {
        let by_facet: Vec<[f64; 3]> = (0..corners.len())
            .into_par_iter()
            .with_min_len(1 << 12)
            .map(|facet| {
                let p = facets.corners(facet);
                [0, 1, 2].map(|i| {
                    let (u, v) = (p[(i + 1) % 3] - p[i], p[(i + 2) % 3] - p[i]);
                    u.cross(v).length().atan2(u.dot(v))
                })
            })
            .collect();
        let n = facets.positions.len();
        let mut angles = Angles { all: vec![0.0; n], of_surface: vec![0.0; n], is_rim: vec![false; n] };
        // Facets that a merged edge has folded away bound nothing and have no angles.
        let triangles = corners.iter().enumerate().filter(|&(_, &corners)| is_triangle(corners));
        for (facet, corners) in triangles {
            for (&vertex, &angle) in corners.iter().zip(&by_facet[facet]) {
                angles.all[vertex as usize] += angle;
                match is_cut[facet] {
                    true => angles.is_rim[vertex as usize] = true,
                    false => angles.of_surface[vertex as usize] += angle,
                }
            }
        }
        angles
    }
}

/// An edge as one facet has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct HalfEdge {
    /// Vertices, the lesser first.
    ends: [u32; 2],
    facet: u32,
    /// Whether the facet runs from the lesser to the greater.
    forward: bool,
}

impl HalfEdge {
    /// Those of all facets, by edge.
    fn all_of(corners: &[[u32; 3]]) -> Vec<HalfEdge> {
        let of_facet = |(facet, &c): (usize, &[u32; 3])| {
            [0, 1, 2].map(|i| {
                let (a, b) = (c[i], c[(i + 1) % 3]);
                HalfEdge { ends: [a.min(b), a.max(b)], facet: facet as u32, forward: a < b }
            })
        };
        let triangles = corners.par_iter().enumerate().filter(|&(_, &corners)| is_triangle(corners));
        let mut all: Vec<HalfEdge> = triangles.flat_map_iter(of_facet).collect();
        all.par_sort_unstable();
        all
    }
}

/// What an edge adds to ∫H dA.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Bend {
    /// A facet at the edge is not surface.
    Cut,
    /// ½·ℓ·β, summed over the wedges of solid at the edge.
    Regular(f64),
    Irregular,
}

impl Bend {
    fn of(facets: &Facets, around: &[HalfEdge], is_cut: impl Fn(u32) -> bool) -> Bend {
        if around.iter().any(|half| is_cut(half.facet)) {
            return Bend::Cut;
        }
        let [from, to] = around[0].ends.map(|v| facets.positions[v as usize]);
        let along = to - from;
        let normal = |half: &HalfEdge| facets.normals[half.facet as usize];
        let exterior = match around {
            [a, b] if a.forward != b.forward => {
                let (a, b) = if a.forward { (a, b) } else { (b, a) };
                let (n, m) = (normal(a), normal(b));
                Some(n.cross(m).dot(along.normalize_or_zero()).atan2(n.dot(m)))
            }
            _ => exterior_of_wedges(around, along.normalize_or_zero(), normal),
        };
        exterior.map_or(Bend::Irregular, |exterior| Bend::Regular(0.5 * along.length() * exterior))
    }
}

/// The exterior angles of all wedges of solid that meet in an edge, if its facets enter and leave solid by turns.
///
/// Seen against the edge's direction, solid lies clockwise of a facet that runs forward and counter-clockwise of one that
/// runs backward, so that a wedge reaches from the latter to the next of the former.
fn exterior_of_wedges(around: &[HalfEdge], along: DVec3, normal: impl Fn(&HalfEdge) -> DVec3) -> Option<f64> {
    let across = along.any_orthonormal_vector();
    let (x, y) = (across, along.cross(across));
    let mut facets: Vec<(f64, bool)> = around
        .iter()
        .map(|half| {
            let run = if half.forward { along } else { -along };
            let inward = normal(half).cross(run);
            (inward.dot(y).atan2(inward.dot(x)), half.forward)
        })
        .collect();
    facets.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
    let pairs = || facets.iter().zip(facets.iter().cycle().skip(1));
    if facets.len() % 2 == 1 || pairs().any(|(a, b)| a.1 == b.1) {
        return None;
    }
    Some(pairs().filter(|(a, _)| !a.1).map(|(start, end)| PI - (end.0 - start.0).rem_euclid(TAU)).sum())
}
