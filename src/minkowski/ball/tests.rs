//! Resolved offsets of solids with known offsets, and of random ones compared with distances from all their triangles.

mod slivers;

use std::f64::consts::PI;

use glam::{DMat3, DQuat, DVec3};
use proptest::prelude::*;

use super::*;
use crate::closest::squared_distance;
use crate::fixed::{Crossing, TriangleHit};
use crate::grid::{Axis, Grid, offset_grid};
use crate::mesh::{ClosedMesh, TriangleMesh};
use crate::minkowski::{Exterior, Membership, resolve};
use crate::solids;
use crate::testing::meshes::{cube, reversed, tetrahedron, together};
use crate::testing::random::Congruential;

/// Distance from the boundary, in lattice steps, within which a point may be on either side.
const ROUNDED: f64 = 4.0;

/// A solid that has grown or shrunk.
struct Offset {
    grid: Grid,
    solid: Polyhedron,
    radius: f64,
    exterior: Exterior,
    membership: BallMembership,
    /// For each axis and ray the spans of the grown or shrunk solid.
    spans: [Vec<Vec<[i32; 2]>>; 3],
}

impl Offset {
    fn new(mesh: TriangleMesh, distance: f64, pitch: f64) -> Offset {
        let mesh = ClosedMesh::check(mesh).unwrap();
        let grid = offset_grid(mesh.bounds(), distance, pitch, 1024).unwrap();
        let solid = Polyhedron::new(&grid.quantise(&mesh).unwrap());
        let (solid, exterior) =
            if distance > 0.0 { (solid, Exterior::Out) } else { (solid.complement(), Exterior::In) };
        let radius = distance.abs() / grid.step();
        let membership = BallMembership::new(&grid, &solid, radius, exterior).unwrap();
        let patches = BallPatches::new(&solid, radius);
        let spans = Axis::ALL.map(|axis| patches.spans::<Crossing>(&grid, axis, exterior).unwrap());
        let resolved = resolve(&grid, spans, exterior, &membership, &|_, _| {}).unwrap();
        let spans = resolved.spans.map(|spans| {
            let of_ray = |ray| {
                let ends: Vec<i32> = spans.of_ray(ray).iter().map(|hit| hit.nearest()).collect();
                assert!(ends.len().is_multiple_of(2) && ends.is_sorted());
                ends.as_chunks().0.to_vec()
            };
            (0..spans.offsets.len() as u32 - 1).map(of_ray).collect()
        });
        let radius = patches.radius();
        Offset { grid, solid, radius, exterior, membership, spans }
    }

    /// Returns the volume along each axis, in world units.
    fn volumes(&self) -> [f64; 3] {
        let length = |spans: &Vec<[i32; 2]>| spans.iter().map(|[start, end]| f64::from(end - start)).sum::<f64>();
        let pitch = self.grid.pitch();
        [0, 1, 2].map(|i| self.spans[i].iter().map(length).sum::<f64>() * self.grid.step() * pitch * pitch)
    }

    fn each_volume_is(&self, expected: f64, share: f64) {
        for volume in self.volumes() {
            assert!((volume - expected).abs() <= share * expected, "{volume} {expected}");
        }
    }

    /// Returns whether a lattice position on a ray is in the grown or shrunk solid, by its spans.
    fn is_in(&self, axis: Axis, ray: u32, depth: i32) -> bool {
        self.spans[axis.depth()][ray as usize].iter().any(|&[start, end]| start < depth && depth < end)
    }

    /// Compares points on all rays with a distance, in steps and negative inside, from the solid that is grown, or from the
    /// complement of the shrunk one: a point is in where its distance is less than the radius.
    fn agrees_with(&self, mut signed_distance: impl FnMut(DVec3) -> f64) {
        let mut looked_at = 0;
        let mut random = Congruential::new(1);
        for axis in Axis::ALL {
            let (columns, rows) = self.grid.image_size(axis);
            let length = self.grid.length(axis.depth());
            for ray in 0..columns * rows {
                let ends = self.spans[axis.depth()][ray as usize].iter().flatten();
                let near_ends = ends.flat_map(|&end| [-4001, -13, 13, 4001].map(|by: i32| end + by));
                let mut depths: Vec<i32> = near_ends.collect();
                for _ in 0..3 {
                    depths.push(random.below(length as usize) as i32);
                }
                for depth in depths.into_iter().filter(|depth| (1..length).contains(depth)) {
                    let point = point_on(&self.grid, axis, ray, depth);
                    let distance = signed_distance(exact(point));
                    if (distance - self.radius).abs() < ROUNDED {
                        continue;
                    }
                    let expected = distance < self.radius;
                    looked_at += 1;
                    assert_eq!(self.membership.contains(point, &mut ()), expected, "{axis:?} {point:?} {distance}");
                    let is_in_sum = self.is_in(axis, ray, depth) == (self.exterior == Exterior::Out);
                    assert_eq!(is_in_sum, expected, "{axis:?} {ray} {point:?} {}", distance - self.radius);
                }
            }
        }
        assert!(looked_at > 200, "{looked_at}");
    }

    /// Returns the distance from all triangles by brute force.
    fn unsigned_distance(&self, point: DVec3) -> f64 {
        let corners = |triangle: &[u32; 3]| triangle.map(|vertex| exact(self.solid.positions()[vertex as usize]));
        let squared = self.solid.triangles().iter().map(|triangle| squared_distance(point, corners(triangle)));
        squared.fold(f64::INFINITY, f64::min).sqrt()
    }

    /// Returns the same distance, negative inside by the crossing parity along a direction in general position.
    fn signed_distance(&self, point: DVec3) -> f64 {
        let direction = DVec3::new(0.31234, 0.51237, 0.79);
        let winding: i32 = self
            .solid
            .triangles()
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.map(|vertex| exact(self.solid.positions()[vertex as usize]) - point);
                let sides = [a.cross(b), b.cross(c), c.cross(a)].map(|side| side.dot(direction));
                let normal = (b - a).cross(c - a);
                let ahead = a.dot(normal) * normal.dot(direction) > 0.0;
                let through = sides.iter().all(|side| *side > 0.0) || sides.iter().all(|side| *side < 0.0);
                if ahead && through { normal.dot(direction).signum() as i32 } else { 0 }
            })
            .sum();
        let distance = self.unsigned_distance(point);
        if (winding != 0) == (self.exterior == Exterior::Out) { -distance } else { distance }
    }

    fn agrees_with_all_triangles(&self) {
        self.agrees_with(|point| self.signed_distance(point));
    }
}

/// Returns the lattice position on a ray at a depth.
fn point_on(grid: &Grid, axis: Axis, ray: u32, depth: i32) -> [i32; 3] {
    let (columns, _) = grid.image_size(axis);
    let mut point = [depth; 3];
    point[axis.column()] = grid.node(ray % columns);
    point[axis.row()] = grid.node(ray / columns);
    point
}

/// Returns V + S r + M r² + 4 π r³ / 3 of a convex mesh.
fn steiner(mesh: &TriangleMesh, radius: f64) -> f64 {
    let corners = |triangle: &[u32; 3]| triangle.map(|vertex| mesh.positions[vertex as usize]);
    let normals: Vec<DVec3> = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = corners(t);
            (b - a).cross(c - a)
        })
        .collect();
    let volume: f64 = mesh.triangles.iter().zip(&normals).map(|(t, n)| corners(t)[0].dot(*n) / 6.0).sum();
    let area: f64 = normals.iter().map(|n| 0.5 * n.length()).sum();
    let mut facet_of = std::collections::HashMap::new();
    for (&[a, b, c], normal) in mesh.triangles.iter().zip(&normals) {
        facet_of.extend([[a, b], [b, c], [c, a]].map(|edge| (edge, *normal)));
    }
    let curvature: f64 = facet_of
        .iter()
        .map(|([a, b], normal)| {
            let length = mesh.positions[*a as usize].distance(mesh.positions[*b as usize]);
            // Each edge is met twice, and M is half the sum.
            0.25 * length * normal.angle_between(facet_of[&[*b, *a]])
        })
        .sum();
    volume + area * radius + curvature * radius.powi(2) + 4.0 / 3.0 * PI * radius.powi(3)
}

/// Returns an L of two boxes, 3 × 1 × 1 and 1 × 3 × 1.
fn l_solid() -> TriangleMesh {
    let profile = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 3], [0, 3]].map(|[x, y]| [f64::from(x), f64::from(y)]);
    let at = |z: f64| profile.map(|[x, y]| DVec3::new(x, y, z));
    let positions = [at(0.0), at(1.0)].concat();
    let lid = [[3, 4, 5], [3, 5, 0], [3, 0, 1], [3, 1, 2]];
    let mut triangles: Vec<[u32; 3]> = lid.iter().map(|&[a, b, c]| [a, c, b]).collect();
    triangles.extend(lid.map(|triangle| triangle.map(|vertex| vertex + 6)));
    for i in 0..6 {
        let j = (i + 1) % 6;
        triangles.extend([[i, j, j + 6], [i, j + 6, i + 6]]);
    }
    TriangleMesh { positions, triangles }
}

fn turned(mut mesh: TriangleMesh, axis: DVec3, angle: f64) -> TriangleMesh {
    let turn = DMat3::from_quat(DQuat::from_axis_angle(axis.normalize(), angle));
    mesh.positions.iter_mut().for_each(|position| *position = turn * *position);
    mesh
}

/// Returns a box with a cavity.
fn hollow(side: f64, wall: f64) -> TriangleMesh {
    together(&[cube(DVec3::ZERO, side), reversed(&cube(DVec3::splat(wall), side - 2.0 * wall))])
}

#[test]
fn growing_a_cube_rounds_its_edges_and_corners() {
    for (distance, pitch) in [(0.5, 0.021), (0.02, 0.017), (3.0, 0.07)] {
        let offset = Offset::new(cube(DVec3::new(1.0, -2.0, 3.0), 2.0), distance, pitch);
        offset.each_volume_is(steiner(&cube(DVec3::ZERO, 2.0), distance), 2e-3);
        let side = f64::from(offset.solid.bounds().max[0] - offset.solid.bounds().min[0]);
        let corner = exact(offset.solid.bounds().min);
        offset.agrees_with(|point| {
            let beyond = (point - corner - 0.5 * side).abs() - 0.5 * side;
            beyond.max(DVec3::ZERO).length() + beyond.max_element().min(0.0)
        });
    }
}

#[test]
fn shrinking_a_cube_gives_a_cube() {
    let offset = Offset::new(cube(DVec3::ZERO, 2.0), -0.25, 0.0625);
    // Pitch, side and distance are powers of two, and all ends are exact.
    let (near, far) = (offset.radius as i32, offset.grid.length(0) - offset.radius as i32);
    assert_eq!(near, 4 << offset.grid.shift());
    for axis in Axis::ALL {
        for (ray, spans) in (0u32..).zip(&offset.spans[axis.depth()]) {
            let within = [ray % 32, ray / 32].iter().all(|place| (4..28).contains(place));
            assert_eq!(*spans, if within { vec![[near, far]] } else { Vec::new() });
        }
    }
}

#[test]
fn a_faceted_ball_has_the_volume_of_steiner() {
    let mesh = || turned(solids::geodesic(1.0, 9).unwrap(), DVec3::new(1.0, 2.0, 3.0), 0.7);
    for distance in [0.01, 0.3, 1.5] {
        let offset = Offset::new(mesh(), distance, (1.0 + distance) / 64.0);
        offset.each_volume_is(steiner(&mesh(), distance), 1e-3);
    }
    // When shrunk, the facets move in and every edge and vertex stays sharp.
    let offset = Offset::new(mesh(), -0.2, 1.0 / 24.0);
    offset.agrees_with_all_triangles();
}

#[test]
fn offsets_of_an_l_agree_with_all_triangles() {
    for (mesh, distance) in [
        (l_solid(), 0.4),
        (l_solid(), 1.7),
        (l_solid(), -0.3),
        (turned(l_solid(), DVec3::new(1.0, 2.0, -1.0), 0.8), 0.6),
        (turned(l_solid(), DVec3::new(1.0, 2.0, -1.0), 0.8), -0.35),
        // Edges within a millionth of parallel to the rays.
        (turned(l_solid(), DVec3::new(1.0, 2.0, -1.0), 1e-6), 0.6),
        (turned(l_solid(), DVec3::Z, PI / 4.0), 0.3),
    ] {
        let offset = Offset::new(mesh, distance, 0.1);
        offset.agrees_with_all_triangles();
    }
}

#[test]
fn a_grown_l_is_the_union_of_two_rounded_boxes() {
    let offset = Offset::new(l_solid(), 0.5, 0.0625);
    let unit = 1.0 / offset.grid.step();
    let corner = exact(offset.solid.bounds().min);
    let from_box = |point: DVec3, side: DVec3| (point - point.clamp(corner, corner + side * unit)).length();
    offset.agrees_with(|point| {
        let (x, y) = (from_box(point, DVec3::new(3.0, 1.0, 1.0)), from_box(point, DVec3::new(1.0, 3.0, 1.0)));
        x.min(y)
    });
}

#[test]
fn growing_closes_the_hole_of_a_torus() {
    let torus = || solids::torus(3.0, 1.0, 20, 12).unwrap();
    for (distance, is_closed) in [(1.7, false), (2.1, true)] {
        let offset = Offset::new(torus(), distance, 0.34);
        let (columns, rows) = offset.grid.image_size(Axis::Z);
        let middle = offset.grid.length(2) / 2;
        assert_eq!(offset.is_in(Axis::Z, rows / 2 * columns + columns / 2, middle), is_closed);
        offset.agrees_with_all_triangles();
    }
}

#[test]
fn shrinking_removes_thin_walls() {
    let wall = || turned(solids::cuboid(DVec3::ZERO, DVec3::new(4.0, 3.0, 0.2)).unwrap(), DVec3::ONE, 0.3);
    let kept = Offset::new(wall(), -0.09, 0.05);
    kept.each_volume_is(3.82 * 2.82 * 0.02, 0.02);
    assert_eq!(Offset::new(wall(), -0.11, 0.05).volumes(), [0.0; 3]);
    // A radius larger than the whole.
    assert_eq!(Offset::new(wall(), -9.0, 0.05).volumes(), [0.0; 3]);
}

/// Returns a two-sided rectangle of zero thickness, with different diagonals on its two sides.
fn sheet(sides: [f64; 2]) -> TriangleMesh {
    let [x, y] = sides;
    let positions = vec![DVec3::ZERO, DVec3::X * x, DVec3::new(x, y, 0.0), DVec3::Y * y];
    TriangleMesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]] }
}

#[test]
fn grown_sheets_have_steiners_volume() {
    let radius = 0.5;
    let expected = 2.0 * radius * 12.0 + 7.0 * PI * radius * radius + 4.0 / 3.0 * PI * radius.powi(3);
    for angle in [0.0, 0.3] {
        let grown = Offset::new(turned(sheet([4.0, 3.0]), DVec3::new(1.0, 2.0, 0.5), angle), radius, 0.0625);
        grown.each_volume_is(expected, 1e-2);
        grown.agrees_with_all_triangles();
    }
}

#[test]
fn grown_needles_agree_with_all_triangles() {
    let mut mesh = cube(DVec3::ZERO, 1.0);
    mesh.positions.extend([DVec3::splat(2.0), DVec3::splat(3.0)]);
    mesh.triangles.extend([[7, 8, 9], [7, 9, 8]]);
    Offset::new(mesh, 0.4, 0.07).agrees_with_all_triangles();
}

/// A cube with a sliver at each of its edges, which rounding may flip.
#[test]
fn slivers_at_edges_open_no_boundary() {
    for seed in 0..4 {
        let mut mesh = cube(DVec3::ZERO, 2.0);
        for i in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.triangles[i];
            let middle = mesh.positions.len() as u32;
            let share = 0.3 + 0.03 * i as f64;
            mesh.positions.push(mesh.positions[a as usize].lerp(mesh.positions[b as usize], share));
            mesh.triangles[i] = [a, middle, c];
            mesh.triangles.extend([[middle, b, c], [a, b, middle]]);
        }
        let mesh = turned(mesh, DVec3::new(1.0, 2.0, -1.0), 0.4 + 0.3 * f64::from(seed));
        let expected = steiner(&cube(DVec3::ZERO, 2.0), 0.5);
        let grown = Offset::new(mesh, 0.5, 0.07);
        grown.each_volume_is(expected, 2e-3);
        grown.agrees_with_all_triangles();
    }
}

#[test]
fn growing_shrinks_and_closes_cavities() {
    let round = |distance| steiner(&cube(DVec3::ZERO, 4.0), distance);
    Offset::new(hollow(4.0, 1.0), 0.5, 0.0625).each_volume_is(round(0.5) - 1.0, 2e-3);
    Offset::new(hollow(4.0, 1.0), 1.01, 0.07).each_volume_is(round(1.01), 2e-3);
    // Inwards the cavity grows round.
    let grown = steiner(&cube(DVec3::ZERO, 2.0), 0.25);
    Offset::new(hollow(4.0, 1.0), -0.25, 0.0625).each_volume_is(3.5f64.powi(3) - grown, 3e-3);
    // Walls vanish first, then the rest of edges and corners.
    assert!(Offset::new(hollow(4.0, 1.0), -0.51, 0.0625).volumes()[0] > 0.0);
    assert_eq!(Offset::new(hollow(4.0, 1.0), -0.7, 0.0625).volumes(), [0.0; 3]);
}

#[test]
fn samples_have_normals_of_length_one() {
    let mesh = ClosedMesh::check(turned(l_solid(), DVec3::new(1.0, 2.0, -1.0), 0.8)).unwrap();
    let grid = offset_grid(mesh.bounds(), 0.6, 0.1, 1024).unwrap();
    let solid = Polyhedron::new(&grid.quantise(&mesh).unwrap());
    let patches = BallPatches::new(&solid, 0.6 / grid.step());
    let images = Axis::ALL.map(|axis| {
        let spans = patches.spans::<TriangleHit>(&grid, axis, Exterior::Out).unwrap();
        let depths = spans.hits.iter().map(|hit| crate::fixed::Hit::crossing(*hit).nearest()).collect();
        let image = Ldi::from_parts(grid, axis, spans.offsets, depths, Vec::new()).unwrap();
        image.with_triangles(spans.hits.iter().map(|hit| hit.triangle).collect()).unwrap()
    });
    let (images, normals) = patches.sample_normals(images).unwrap();
    for image in &images {
        for ray in 0..image.rays() {
            let first = image.offsets()[ray as usize] as usize;
            let numbers = &image.triangles().unwrap()[first..];
            for (rank, (&depth, &number)) in image.samples(ray).iter().zip(numbers).enumerate() {
                let normal = DVec3::from_array(normals[number as usize].map(f64::from));
                assert!((normal.length() - 1.0).abs() < 1e-6);
                assert_eq!(normal[image.axis().depth()] < 0.0, rank % 2 == 0);
                // The solid lies back along the normal from the sample, or behind a shifted facet.
                let point = exact(point_on(&grid, image.axis(), ray, depth)) - normal * patches.radius();
                let corners = |t: &[u32; 3]| t.map(|vertex| exact(solid.positions()[vertex as usize]));
                let squared = solid.triangles().iter().map(|t| squared_distance(point, corners(t)));
                let distance = squared.fold(f64::INFINITY, f64::min).sqrt();
                assert!(distance < 1e-6 * patches.radius() + 4.0, "{distance}");
            }
        }
    }
}

/// Generates tetrahedra that overlap, share vertices and lie in planes of the lattice.
fn tetrahedra() -> impl Strategy<Value = Vec<TriangleMesh>> {
    let corner = || (0..7u8, 0..7u8, 0..7u8).prop_map(|(x, y, z)| DVec3::new(x.into(), y.into(), z.into()));
    let one = [corner(), corner(), corner(), corner()].prop_filter_map("flat", |positions| {
        let [a, b, c, d] = positions;
        let volume = (b - a).cross(c - a).dot(d - a);
        let mesh = TriangleMesh { positions: positions.to_vec(), ..tetrahedron() };
        (volume != 0.0).then(|| if volume > 0.0 { mesh } else { reversed(&mesh) })
    });
    prop::collection::vec(one, 1..4)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(48) })]

    #[test]
    fn offset_tetrahedra_match_all_triangles(all in tetrahedra(), distance in -0.5..2.5f64, angle in prop::option::of(0.0..2.0)) {
        prop_assume!(distance.abs() > 1e-3);
        // Overlapping solids can only grow.
        let mesh = if distance > 0.0 { together(&all) } else { all[0].clone() };
        let mesh = match angle {
            Some(angle) => turned(mesh, DVec3::new(2.0, 1.0, 3.0), angle),
            None => mesh,
        };
        let longest = mesh.bounds().unwrap().extent().max_element() + 2.0 * distance.max(0.0);
        Offset::new(mesh, distance, longest / 17.3).agrees_with_all_triangles();
    }
}

#[test]
fn round_cubes_are_the_same_in_slabs_of_any_height() {
    let ell = solids::ell(DVec3::splat(1.0), [0.4, 0.3]).unwrap();
    let torus = solids::torus(1.0, 0.35, 24, 12).unwrap();
    for (mesh, distance, pitch) in [(ell, 0.2, 0.05), (torus, -0.1, 0.05), (cube(DVec3::ZERO, 1.0), 5.0, 0.3)] {
        let Offset { grid, solid, radius, .. } = Offset::new(mesh, distance, pitch);
        let patches = BallPatches::new(&solid, radius);
        let round = patches.round_cubes(&grid);
        let [columns, rows, planes] = grid.rays().map(|n| n as usize);
        let plane = rows * columns.div_ceil(64);
        // Some cubes are there already, and stay.
        let begun: Vec<u64> = (0..planes * plane).map(|at| (at % 5 == 0).into()).collect();
        let mut all = begun.clone();
        round.add_to(&mut all, 0..planes);
        let count: u32 = all.iter().map(|bits| bits.count_ones()).sum();
        assert!(count > 500 && all.iter().zip(&begun).all(|(all, begun)| all & begun == *begun), "{count} cubes");
        for height in [1, 5, 32] {
            let mut slabs = begun.clone();
            for (slab, bits) in slabs.chunks_mut(height * plane).enumerate() {
                round.add_to(bits, slab * height..slab * height + bits.len() / plane);
            }
            assert!(slabs == all, "{distance}: slabs of {height} planes");
        }
    }
}

#[test]
fn rays_and_winding_numbers_agree_about_nodes() {
    let hollow = together(&[cube(DVec3::ZERO, 1.0), reversed(&cube(DVec3::splat(0.3), 0.4))]);
    let torus = solids::torus(1.0, 0.35, 24, 12).unwrap();
    for (mesh, distance) in [(hollow.clone(), 0.1), (hollow, -0.1), (torus.clone(), 0.1), (torus, -0.1)] {
        let Offset { grid, solid, membership, exterior, .. } = Offset::new(mesh, distance, 0.07);
        let shell = crate::minkowski::membership::Shell::new(&solid);
        let [columns, rows, planes] = grid.rays();
        let mut counts = [0; 2];
        for at in 0..columns * rows * planes {
            let node = [at % columns, at / columns % rows, at / columns / rows].map(|index| grid.node(index));
            let is_inside = shell.winds_around(node) != (exterior == Exterior::In);
            assert_eq!(membership.inside_by_rays(node), Some(is_inside), "{distance}: {node:?}");
            counts[usize::from(is_inside)] += 1;
            assert_eq!(membership.inside_by_rays(node.map(|at| at + (1 << (grid.shift() - 2)))), None);
        }
        assert!(counts.iter().all(|&count| count > 100), "{counts:?}");
    }
}
