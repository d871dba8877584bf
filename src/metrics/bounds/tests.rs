//! Bounds compared with points, exact overlap tests, and known volumes.

use glam::{DMat3, DVec3};

use super::*;
use crate::grid::{Axis, Grid, LatticeBox};
use crate::ldi::{Ldi, Mode, NodePlanes};
use crate::mesh::{ClosedMesh, TriangleMesh};
use crate::sampler::cpu::CpuSampler;
use crate::sampler::{FillRule, Sampler};
use crate::solids::{self, LatticeForm, StrutLattice, StrutPattern};
use crate::testing::images::whole;
use crate::testing::meshes::{cube, tetrahedron, together};
use crate::testing::random::Random;

fn grid_around(mesh: &TriangleMesh, resolution: u32) -> Grid {
    Grid::with_resolution(mesh.bounds().unwrap(), resolution, 1024).unwrap()
}

fn image(solid: &LatticeSolid, axis: Axis) -> Ldi {
    CpuSampler::default().sample_surface(solid, axis, FillRule::EvenOdd).unwrap()
}

/// Returns the volume bounds of a mesh within a box of the lattice.
fn volume_in(mesh: &TriangleMesh, grid: &Grid, bounds: LatticeBox) -> VolumeBounds {
    let closed = ClosedMesh::check(mesh.clone()).unwrap();
    let solid = grid.quantise(&closed).unwrap();
    let along_x = image(&solid, Axis::X);
    let inside = NodePlanes::new([&along_x], Mode::Exact).unwrap();
    VolumeBounds::of(&Sampled { solid: &solid, inside }, &Within::Box(bounds))
}

/// Returns the inner and outer nodes of a mesh within the box of its grid.
fn sets(mesh: &TriangleMesh, grid: &Grid) -> (NodeSet, SolidBounds) {
    let closed = ClosedMesh::check(mesh.clone()).unwrap();
    let solid = grid.quantise(&closed).unwrap();
    let along_x = image(&solid, Axis::X);
    let inside = NodeSet::of_planes(&NodePlanes::new([&along_x], Mode::Exact).unwrap());
    let region = Region::of_box(grid, whole(grid));
    let bounds = SolidBounds::of(&solid, &inside, &region);
    (inside, bounds)
}

fn tilted(mesh: TriangleMesh) -> TriangleMesh {
    let turn = DMat3::from_rotation_z(0.3) * DMat3::from_rotation_x(0.7);
    TriangleMesh { positions: mesh.positions.iter().map(|&p| turn * p).collect(), ..mesh }
}

#[test]
fn bounds_enclose_the_volume_and_converge_to_it() {
    let cuboid = tilted(solids::cuboid(DVec3::splat(-1.0), DVec3::new(1.0, 0.5, 0.2)).unwrap());
    let ball = solids::geodesic(1.0, 24).unwrap();
    let torus = solids::torus(1.0, 0.35, 64, 32).unwrap();
    for (name, mesh) in [("tilted box", cuboid), ("ball", ball), ("torus", torus)] {
        let volume = mesh.signed_volume();
        let mut widths = Vec::new();
        for resolution in [24, 48, 96] {
            let grid = grid_around(&mesh, resolution);
            let found = volume_in(&mesh, &grid, whole(&grid));
            assert!(found.solid.contains(volume), "{name} {resolution}: {volume} and {found:?}");
            let porosity = 1.0 - volume / found.region.lower;
            assert!(found.porosity().contains(porosity), "{name} {resolution}: {porosity} and {:?}", found.porosity());
            assert_eq!(found.porosity().width() > 0.0, found.solid.width() > 0.0);
            widths.push(found.solid.width() / volume);
        }
        let orders = widths.windows(2).map(|w| (w[0] / w[1]).log2()).collect::<Vec<f64>>();
        println!("{name}: widths {widths:.4?} of the volume, order {orders:.2?}");
        assert!(orders.iter().all(|order| (0.8..1.3).contains(order)), "{name} {orders:?}");
    }
}

#[test]
fn node_sets_and_volumes_give_equal_bounds() {
    let mesh = solids::torus(1.0, 0.35, 64, 32).unwrap();
    let grid = grid_around(&mesh, 70);
    let (inside, SolidBounds { inner, outer }) = sets(&mesh, &grid);
    assert!(inner.minus(&inside).is_empty() && inside.minus(&outer).is_empty());
    let found = volume_in(&mesh, &grid, whole(&grid));
    let cube = grid.pitch().powi(3);
    // To the margin at the faces of the box.
    assert!((inner.count() as f64 * cube / found.solid.lower - 1.0).abs() < 1e-6);
    assert!((outer.count() as f64 * cube / found.solid.upper - 1.0).abs() < 1e-6);
}

#[test]
fn plates_between_rays_are_in_the_outer_set_alone() {
    let grid = Grid::from_parts(DVec3::ZERO, 1.0, [20; 3], 20, 1024).unwrap();
    for thickness in [0.3, 0.01, 1e-5] {
        let plate = solids::cuboid(DVec3::new(2.0, 2.0, 7.1), DVec3::new(18.0, 18.0, 7.1 + thickness)).unwrap();
        let (inside, SolidBounds { inner, outer }) = sets(&plate, &grid);
        assert!(inside.is_empty() && inner.is_empty(), "{thickness}");
        // Its sides lie in faces of cubes and touch those beyond.
        assert_eq!(
            outer,
            NodeSet::from_fn([20; 3], |[x, y, z]| z == 7 && (1..19).contains(&x) && (1..19).contains(&y))
        );
        let found = volume_in(&plate, &grid, whole(&grid));
        assert!(found.solid.lower == 0.0 && found.solid.contains(plate.signed_volume()), "{found:?}");
    }
}

#[test]
fn faces_cut_by_the_box_do_not_widen_the_bounds() {
    for resolution in [16, 24, 32] {
        let cuboid = solids::cuboid(DVec3::splat(1.0), DVec3::new(3.0, 2.0, 2.5)).unwrap();
        let grid = grid_around(&cuboid, resolution);
        let (_, SolidBounds { inner, .. }) = sets(&cuboid, &grid);
        assert_eq!(inner, NodeSet::full(inner.size()), "{resolution}");
        let found = volume_in(&cuboid, &grid, whole(&grid));
        assert!(found.solid.contains(3.0) && found.solid.width() < 1e-5, "{found:?}");
    }
    // Sides that are not a whole number of pitches: the box ends within cubes, some of them with their nodes beyond.
    for resolution in [11, 17, 31] {
        let form = LatticeForm::Union { resolution: 24 };
        let (cells, cell_size, radius) = ([3, 2, 1], 1.0, 0.2);
        let block = StrutLattice { pattern: StrutPattern::Cubic, form, cells, cell_size, radius }.build().unwrap();
        let closed = ClosedMesh::check(block.clone()).unwrap();
        let grid = grid_around(&block, resolution);
        let bounds = *grid.quantise(&closed).unwrap().bounds();
        let found = volume_in(&block, &grid, bounds);
        assert!(found.solid.contains(block.signed_volume()), "{found:?}");
        assert!((found.region.lower / 6.0 - 1.0).abs() < 1e-5, "{found:?}");
        // A box that cuts struts where no face of the mesh lies, an eighth of one cell and of its node.
        let middle = [1, 2, 3].map(|i| grid.length(i - 1) / 2);
        let octant = LatticeBox { min: middle, max: bounds.max };
        let share = volume_in(&block, &grid, octant).solid;
        assert!(share.contains(block.signed_volume() / 8.0), "{resolution} {share:?} {}", block.signed_volume() / 8.0);
    }
}

/// Returns random tetrahedra as one mesh; they overlap, and every other layer is inside.
fn shards(count: usize, seed: u64) -> (TriangleMesh, Vec<[DVec3; 4]>) {
    let mut random = Random::new(seed);
    let mut point = || DVec3::from_array([(); 3].map(|()| random.share()));
    let corners: Vec<[DVec3; 4]> = (0..count)
        .map(|at| {
            let (centre, size) = (point(), if at % 3 == 0 { 0.9 } else { 0.15 });
            std::array::from_fn(|_| centre + size * (point() - 0.5))
        })
        .collect();
    let shape = tetrahedron();
    let meshes: Vec<TriangleMesh> =
        corners.iter().map(|corners| TriangleMesh { positions: corners.to_vec(), ..shape.clone() }).collect();
    (together(&meshes), corners)
}

fn is_in([a, b, c, d]: &[DVec3; 4], p: DVec3) -> bool {
    let side = |a: DVec3, b: DVec3, c: DVec3, p: DVec3| (b - a).cross(c - a).dot(p - a) > 0.0;
    let faces = [(a, b, c, d), (a, b, d, c), (a, c, d, b), (b, c, d, a)];
    faces.iter().all(|&(a, b, c, other)| side(*a, *b, *c, p) == side(*a, *b, *c, *other))
}

#[test]
fn points_inside_are_in_outer_cubes_and_points_outside_in_no_inner_cubes() {
    let mut seen = [0; 3];
    for seed in 0..12 {
        let (mesh, parts) = shards(8, seed);
        let grid = grid_around(&mesh, 20 + seed as u32);
        let (_, SolidBounds { inner, outer }) = sets(&mesh, &grid);
        let mut random = Random::new(seed + 100);
        for _ in 0..20_000 {
            let extent = DVec3::from_array(grid.rays().map(f64::from)) * grid.pitch();
            let p = grid.origin() + extent * DVec3::from_array([(); 3].map(|()| random.share()));
            let cube = ((p - grid.origin()) / grid.pitch()).to_array().map(|x| x as usize);
            let inside = parts.iter().filter(|part| is_in(part, p)).count() % 2 == 1;
            match inside {
                true => assert!(outer.contains(cube), "{seed} {p} {cube:?}"),
                false => assert!(!inner.contains(cube), "{seed} {p} {cube:?}"),
            }
            seen[0] += usize::from(inner.contains(cube));
            seen[1] += usize::from(outer.contains(cube) && !inside);
            seen[2] += usize::from(!outer.contains(cube));
        }
    }
    assert!(seen.iter().all(|&seen| seen > 300), "{seen:?}");
}

/// Returns whether a triangle meets a closed box, exactly: no axis separates them (Akenine-Möller 2001).
fn overlap(triangle: [[i32; 3]; 3], low: [i64; 3], high: [i64; 3]) -> bool {
    // All coordinates doubled, relative to the middle of the box.
    let corners: [[i128; 3]; 3] =
        triangle.map(|p| std::array::from_fn(|i| i128::from(2 * i64::from(p[i]) - low[i] - high[i])));
    let half: [i128; 3] = std::array::from_fn(|i| i128::from(high[i] - low[i]));
    let minus = |a: [i128; 3], b: [i128; 3]| -> [i128; 3] { std::array::from_fn(|i| a[i] - b[i]) };
    let cross =
        |a: [i128; 3], b: [i128; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let edges = [0, 1, 2].map(|i| minus(corners[(i + 1) % 3], corners[i]));
    let units = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    let mut axes = units.to_vec();
    axes.push(cross(edges[0], edges[1]));
    axes.extend(edges.iter().flat_map(|&edge| units.map(|unit| cross(edge, unit))));
    axes.into_iter().all(|axis| {
        let along = corners.map(|p| (0..3).map(|i| p[i] * axis[i]).sum::<i128>());
        let reach: i128 = (0..3).map(|i| half[i] * axis[i].abs()).sum();
        along.iter().min().unwrap() <= &reach && along.iter().max().unwrap() >= &-reach
    })
}

#[test]
fn cubes_agree_with_exact_overlaps_within_the_margin() {
    let mut met_cubes = 0;
    for seed in 0..6 {
        let (mesh, _) = shards(6, seed + 40);
        // The second lattice is so coarse that the margin is a substantial part of a cube.
        for shift in [20, 6] {
            let bounds = mesh.bounds().unwrap();
            let pitch = bounds.extent().max_element() / 12.0;
            let grid = Grid::from_parts(bounds.min - 0.2 * pitch, pitch, [13; 3], shift, 1024).unwrap();
            let closed = ClosedMesh::check(mesh.clone()).unwrap();
            let solid = grid.quantise(&closed).unwrap();
            let surface = SurfaceCubes::of(&solid, None);
            let met: Vec<u64> = (0..13).step_by(5).flat_map(|z| surface.slab(z..13.min(z + 5))).collect();
            let side = 1i64 << shift;
            for cube in 0..13 * 13 * 13 {
                let at = [cube % 13, cube / 13 % 13, cube / 169];
                let meets = |margin: i64| {
                    let low = at.map(|i| i as i64 * side - margin);
                    let high = at.map(|i| (i as i64 + 1) * side + margin);
                    solid.triangles().iter().any(|t| overlap(t.map(|v| solid.positions()[v as usize]), low, high))
                };
                let found = met[at[2] * 13 + at[1]] >> at[0] & 1 == 1;
                assert!(found || !meets(i64::from(MARGIN) - 1), "{seed} {shift} {at:?} is met");
                assert!(!found || meets(i64::from(MARGIN) + 1), "{seed} {shift} {at:?} is not met");
                met_cubes += usize::from(found);
            }
        }
    }
    assert!(met_cubes > 1000, "{met_cubes}");
}

#[test]
fn finer_rasters_on_the_lattice_give_tighter_bounds() {
    let mesh = solids::torus(1.0, 0.35, 64, 32).unwrap();
    let grid = grid_around(&mesh, 30);
    assert_eq!(finer_grid(&grid, 59), grid);
    let finer = finer_grid(&grid, 128);
    assert_eq!(finer.rays(), grid.rays().map(|n| 4 * n));
    assert_eq!((finer.step(), whole(&finer)), (grid.step(), whole(&grid)));
    let [coarse, fine] = [grid, finer].map(|grid| volume_in(&mesh, &grid, whole(&grid)));
    assert!(coarse.solid.lower <= fine.solid.lower && fine.solid.upper <= coarse.solid.upper);
    assert!(fine.solid.width() < 0.3 * coarse.solid.width() && fine.solid.contains(mesh.signed_volume()));
}

#[test]
fn within_a_solid_region_both_surfaces_are_uncertain() {
    let mesh = tilted(cube(DVec3::ZERO, 2.0));
    let shape = tilted(cube(DVec3::new(0.9, 0.8, 0.7), 2.0));
    let shared = 1.1 * 1.2 * 1.3;
    let mut widths = Vec::new();
    for resolution in [30, 60, 120] {
        let grid = grid_around(&together(&[mesh.clone(), shape.clone()]), resolution);
        let [closed, closed_shape] = [&mesh, &shape].map(|mesh| ClosedMesh::check(mesh.clone()).unwrap());
        let [solid, region] = [&closed, &closed_shape].map(|closed| grid.quantise(closed).unwrap());
        let [image, image_of_region] = [image(&solid, Axis::X), image(&region, Axis::Y)];
        let [inside, within] = [&image, &image_of_region].map(|image| NodePlanes::new([image], Mode::Exact).unwrap());
        let region = Sampled { solid: &region, inside: within };
        let found = VolumeBounds::of(&Sampled { solid: &solid, inside }, &Within::Solid(region));
        for (interval, value) in [(found.solid, shared), (found.pore, 8.0 - shared), (found.region, 8.0)] {
            assert!(interval.contains(value), "{resolution} {value} {interval:?}");
        }
        let known = found.with_region_volume(8.0).porosity();
        for porosity in [found.porosity(), known] {
            assert!(porosity.contains(1.0 - shared / 8.0), "{resolution} {porosity:?}");
        }
        assert!(known.width() <= found.porosity().width());
        widths.push(known.width());
    }
    println!("porosity within a solid: widths {widths:.4?}");
    assert!(widths.windows(2).all(|w| (0.3..0.7).contains(&(w[1] / w[0]))), "{widths:?}");
}

#[test]
fn bounds_do_not_depend_on_the_thread_count() {
    let (mesh, _) = shards(20, 3);
    let grid = grid_around(&mesh, 70);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| (volume_in(&mesh, &grid, whole(&grid)), sets(&mesh, &grid).1))
    };
    assert_eq!(with(1), with(4));
}
