//! Integrals of curvature over a mesh.
//!
//! A polyhedron is bent at its edges and vertices alone. Steiner's formula for parallel bodies gives their contributions: an
//! edge of length ℓ and exterior angle β (0 where flat, negative where it is reflex) contributes ½·ℓ·β to ∫H dA, H = (k₁ +
//! k₂)/2, and a vertex with facets' angles α contributes 2π − Σα to ∫K dA. For a ball of radius R these tend to 4πR and are 4π;
//! for a box of sides a, b, c they are π(a + b + c) and 4π. Over a closed surface ∫K dA = 2πχ (Gauss and Bonnet), which on a
//! mesh holds to rounding and checks the sums.
//!
//! # Cuts by the box
//! Facets in a face of the box are not surface, and where they meet it, at the *rim*, neither is the angle between them. So
//! edges and vertices of such facets are omitted: sums are over edges whose two facets, and vertices all of whose facets, are
//! surface. That leaves ∫K open at the rim, whose total turning is arbitrary. Where the box is a periodic cell
//! ([`BoundaryCondition::Periodic`]) it closes: a vertex on the rim is identified with its image in the opposite face, and
//! together they have 2π; one by itself has π, or π/2 in an edge of the box. Then ∫K dA is 2πχ of the surface in a cell,
//! exactly. Edges of the rim are excluded from ∫H, since their other facet lies in another cell, and with them the surface
//! within half an edge of the rim: an error that falls with the length of edges (in a primitive cell of 32 edges to a side 0.3,
//! where a ball of as much surface has 5.4).

use std::f64::consts::{PI, TAU};

use crate::parallel::*;
use glam::DVec3;

use super::surface_area::{BoxFaces, SurfaceError, cut_facets};
use super::{BoundaryCondition, Facets, Region};

/// The integrals of curvature of the surface within a region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curvature {
    /// ∫H dA, in world units.
    pub mean: f64,
    /// ∫K dA, a pure number.
    pub gauss: f64,
    /// Σ (2π − Σα) over all vertices of the mesh, including facets in faces of the box.
    pub gauss_of_mesh: f64,
    /// Vertices − edges + facets of the mesh; for a closed one `gauss_of_mesh` / 2π.
    pub characteristic: i64,
    /// Edges of the surface with undefined curvature: with an odd number of facets, or with facets that do not alternately
    /// enter and leave solid. They are omitted from `mean`.
    pub irregular_edges: u64,
    /// Facets without area, which have no normal. Their edges count as flat.
    pub degenerate_facets: u64,
}

/// Integrates the curvature of the surface within a box that holds the mesh. Positions are merged where they are bitwise equal.
///
/// # Errors
/// If the region is not a box, or does not hold the mesh.
pub fn curvature(facets: &Facets, region: &Region, edges: BoundaryCondition) -> Result<Curvature, SurfaceError> {
    let faces = BoxFaces::of(region).ok_or(SurfaceError::NotABox)?;
    let is_cut = cut_facets(facets, region)?;
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
            (true, BoundaryCondition::Periodic) if of_surface[vertex] > 0.0 => {
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

/// Returns for each position the first that is bitwise equal to it; the two zeros are equal.
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
    /// The angles of facets that are surface.
    of_surface: Vec<f64>,
    /// True if a facet at the vertex is not surface.
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
        // Facets that collapsed when positions were merged bound nothing and have no angles.
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

/// An edge of one facet.
#[derive(Clone, Copy, Debug)]
struct HalfEdge {
    /// Vertices, the lesser first.
    ends: [u32; 2],
    facet: u32,
    /// True if the facet runs from the lesser to the greater.
    forward: bool,
}

impl HalfEdge {
    /// Returns the half-edges of all facets, sorted by edge.
    fn all_of(corners: &[[u32; 3]]) -> Vec<HalfEdge> {
        let of_facet = |(facet, &c): (usize, &[u32; 3])| {
            [0, 1, 2].map(|i| {
                let (a, b) = (c[i], c[(i + 1) % 3]);
                HalfEdge { ends: [a.min(b), a.max(b)], facet: facet as u32, forward: a < b }
            })
        };
        let triangles = corners.par_iter().enumerate().filter(|&(_, &corners)| is_triangle(corners));
        let mut all: Vec<HalfEdge> = triangles.flat_map_iter(of_facet).collect();
        let edge = |[lesser, greater]: [u32; 2]| u64::from(lesser) << 32 | u64::from(greater);
        all.par_sort_unstable_by_key(|half| (edge(half.ends), half.facet));
        all
    }
}

/// The contribution of an edge to ∫H dA.
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

/// Returns the sum of the exterior angles of all wedges of solid that meet in an edge, if its facets alternately enter and
/// leave solid.
///
/// Seen against the edge's direction, solid lies clockwise of a facet that runs forward and counter-clockwise of one that runs
/// backward, so that a wedge extends from the latter to the next of the former.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriangleMesh;
    use crate::metrics::surface_area::tests::{Sampled, cube, grid_of, network, order, struts, turned, turns, whole};
    use crate::solids::{self, Surface};
    use crate::testing::meshes::together;

    /// Returns the curvature of a mesh in a box that does not touch it.
    fn of(mesh: &TriangleMesh) -> Curvature {
        let bounds = mesh.bounds().unwrap();
        let grid = grid_of(bounds.min - DVec3::ONE, bounds.max + DVec3::ONE, 16);
        curvature(&Facets::of(&mesh.positions, &mesh.triangles), &whole(&grid), BoundaryCondition::Clip).unwrap()
    }

    #[test]
    fn mean_curvature_of_a_box_is_that_of_its_edges() {
        let sides = DVec3::new(1.0, 2.0, 5.0);
        let corner = solids::cuboid(DVec3::ZERO, sides).unwrap();
        for turn in turns(10) {
            let found = of(&turned(corner.clone(), turn));
            assert!((found.mean - PI * sides.element_sum()).abs() < 1e-12 * found.mean);
            assert!((found.gauss - 4.0 * PI).abs() < 1e-12 && found.gauss == found.gauss_of_mesh);
            assert_eq!((found.characteristic, found.irregular_edges, found.degenerate_facets), (2, 0, 0));
        }
    }

    #[test]
    fn balls_shells_and_rings_have_their_known_curvatures() {
        let errors = [8, 16, 32].map(|frequency| {
            let ball = of(&solids::geodesic(3.0, frequency).unwrap());
            assert!((ball.gauss - 4.0 * PI).abs() < 1e-9);
            println!("ball of frequency {frequency}: ∫H dA = {:.5} (4πR = {:.5})", ball.mean, 12.0 * PI);
            ball.mean / (12.0 * PI) - 1.0
        });
        println!("ball, ∫H: order {:.2}", order(errors));
        assert!(errors[2].abs() < 1e-3 && order(errors) > 1.8, "{errors:?}");
        let errors = [16, 32, 64].map(|n| {
            let ring = of(&solids::torus(3.0, 1.0, 3 * n, n).unwrap());
            assert!(ring.gauss.abs() < 1e-9 && ring.characteristic == 0);
            ring.mean / (2.0 * PI * PI * 3.0) - 1.0
        });
        println!("ring, ∫H = 2π²R: order {:.2}, off by {errors:?}", order(errors));
        assert!(errors[2].abs() < 2e-3 && order(errors) > 1.8, "{errors:?}");
        let hollow = of(&solids::hollow_box(DVec3::splat(3.0), DVec3::splat(1.0)).unwrap());
        assert!((hollow.mean - PI * (9.0 - 3.0)).abs() < 1e-12 && (hollow.gauss - 8.0 * PI).abs() < 1e-12);
        assert_eq!(hollow.characteristic, 4);
    }

    #[test]
    fn gauss_curvature_of_periodic_cells_gives_their_characteristic() {
        let networks = [(Surface::Gyroid, -4), (Surface::Primitive, -2), (Surface::Diamond, -8)];
        let cells = networks.map(|(surface, chi)| (network(surface, 1, 24), chi)).into_iter();
        for (mesh, chi) in cells.chain([(struts(1, 24), -2), (struts(2, 16), -16)]) {
            let cell = Sampled::of(mesh, 16);
            let found = curvature(&cell.facets(), &cell.boxed(), BoundaryCondition::Periodic).unwrap();
            // The surface has twice the characteristic of the solid in the cell.
            let expected = TAU * f64::from(2 * chi);
            println!("χ {chi}: ∫K dA = {:.6} ({expected:.6}), ∫H dA = {:.4}", found.gauss, found.mean);
            assert!((found.gauss - expected).abs() < 1e-9, "{found:?} {expected}");
            assert!((found.gauss_of_mesh - TAU * found.characteristic as f64).abs() < 1e-9, "{found:?}");
            assert_eq!((found.irregular_edges, found.degenerate_facets), (0, 0));
        }
    }

    #[test]
    fn mean_curvature_of_half_networks_vanishes() {
        // Pores and solid are congruent, so ∫H = 0; a ball of as much surface would have about 6. The rest is due to the rim.
        for surface in [Surface::Gyroid, Surface::Primitive, Surface::Diamond] {
            let found = [16, 32, 64].map(|resolution| {
                let cell = Sampled::of(network(surface, 1, resolution), 16);
                curvature(&cell.facets(), &cell.boxed(), BoundaryCondition::Clip).unwrap().mean
            });
            println!("{surface:?}: ∫H dA = {found:.4?}, order {:.2}", order(found));
            assert!(found[2].abs() < 0.2 && (found[0].abs() < 0.05 || order(found) > 0.7), "{surface:?} {found:?}");
        }
    }

    #[test]
    fn a_rod_through_the_box_has_only_its_side() {
        for (height, segments) in [(2.0, 32), (4.0, 32), (4.0, 96)] {
            let rod = solids::cylinder(0.5, height, segments).unwrap();
            let half = DVec3::new(1.0, 1.0, 0.5 * height);
            let rod = Sampled::on(&grid_of(-half, half, 32), rod);
            let found = curvature(&rod.facets(), &rod.whole(), BoundaryCondition::Clip).unwrap();
            // ∫H = 2πrL/(2r), which the edges of a prism have, too.
            assert!((found.mean - PI * height).abs() < 1e-9 && found.gauss.abs() < 1e-9, "{found:?}");
            let periodic = curvature(&rod.facets(), &rod.whole(), BoundaryCondition::Periodic).unwrap();
            assert!(periodic.gauss.abs() < 1e-9, "{periodic:?}");
        }
    }

    #[test]
    fn solids_that_touch_in_an_edge_have_the_sum_of_their_curvatures() {
        let other = solids::cuboid(DVec3::new(0.5, 0.5, -0.5), DVec3::new(1.5, 1.5, 0.5)).unwrap();
        let pair = together(&[cube(1.0), other]);
        let found = of(&pair);
        assert!((found.mean - 6.0 * PI).abs() < 1e-12, "{found:?}");
        assert_eq!(found.irregular_edges, 0);
        // Two vertices and an edge are shared.
        assert_eq!(found.characteristic, 16 - 2 - (36 - 1) + 24);
    }

    #[test]
    fn regions_other_than_boxes_that_hold_the_mesh_are_refused() {
        let ball = Sampled::of(solids::geodesic(1.0, 4).unwrap(), 16);
        let region = Region::of_solid(&ball.images);
        assert_eq!(curvature(&ball.facets(), &region, BoundaryCondition::Clip), Err(SurfaceError::NotABox));
        let mut bounds = ball.bounds;
        bounds.max[0] /= 2;
        let half = Region::of_box(ball.grid(), bounds);
        assert!(matches!(curvature(&ball.facets(), &half, BoundaryCondition::Clip), Err(SurfaceError::Beyond { .. })));
    }
}
