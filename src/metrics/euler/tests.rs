//! Characteristics compared with counts of cells, Betti numbers with ranks of boundary maps, and solids with known numbers.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

use glam::DVec3;

use super::*;
use crate::grid::{Axis, Grid};
use crate::ldi::Ldi;
use crate::mesh::testing::{cube, soup, together};
use crate::mesh::{Aabb, ClosedMesh, TriangleMesh, check};
use crate::metrics::Region;
use crate::sampler::cpu::CpuSampler;
use crate::sampler::{FillRule, Sampler};
use crate::solids::{self, LatticeForm, MinimalSurface, Part, StrutLattice, StrutPattern, Surface};

/// Returns random nodes, a share of all.
fn random(size: [usize; 3], share: f64, seed: u64) -> NodeSet {
    NodeSet::from_fn(size, |[x, y, z]| {
        let mut bits = ((z * 1000 + y) * 1000 + x) as u64 ^ seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        for factor in [0xbf58_476d_1ce4_e5b9_u64, 0x94d0_49bb_1331_11eb] {
            bits = (bits ^ (bits >> 30)).wrapping_mul(factor);
        }
        ((bits ^ (bits >> 31)) as f64) < share * u64::MAX as f64
    })
}

/// A cell of a cubical complex: even coordinates are points, odd ones intervals between them.
type Cell = [i64; 3];

/// Returns the cells of a set, by dimension. For 26 neighbours: cubes with their boundaries. For 6: nodes as points, and all
/// cells whose points are in the set.
fn cells(set: &NodeSet, connectivity: Connectivity, edges: BoundaryCondition) -> [BTreeSet<Cell>; 4] {
    let size = set.size().map(|n| n as i64);
    let mut cells = [const { BTreeSet::new() }; 4];
    let placed = |cell: Cell| match edges {
        BoundaryCondition::Periodic => std::array::from_fn(|i| cell[i].rem_euclid(2 * size[i])),
        BoundaryCondition::Clip | BoundaryCondition::Border => cell,
    };
    let dimension = |cell: &Cell| cell.iter().filter(|&&i| i.rem_euclid(2) == 1).count();
    let has = |node: [i64; 3]| {
        let node: [i64; 3] = match edges {
            BoundaryCondition::Periodic => std::array::from_fn(|i| node[i].rem_euclid(size[i])),
            BoundaryCondition::Clip | BoundaryCondition::Border => node,
        };
        (0..3).all(|i| (0..size[i]).contains(&node[i])) && set.contains(node.map(|i| i as usize))
    };
    for z in 0..size[2] {
        for y in 0..size[1] {
            for x in (0..size[0]).filter(|&x| has([x, y, z])) {
                for step in 0..27 {
                    let step = [step % 3 - 1, step / 3 % 3 - 1, step / 9 - 1];
                    let node = [x, y, z];
                    let cell = match connectivity {
                        Connectivity::All => std::array::from_fn(|i| 2 * node[i] + 1 + step[i]),
                        Connectivity::Faces => {
                            let corner =
                                |k: usize| std::array::from_fn(|i| node[i] + if k >> i & 1 == 1 { step[i] } else { 0 });
                            if !(0..8).all(|k| has(corner(k))) {
                                continue;
                            }
                            std::array::from_fn(|i| 2 * node[i] + step[i])
                        }
                    };
                    cells[dimension(&cell)].insert(placed(cell));
                }
            }
        }
    }
    cells
}

/// Returns the boundary of a cell, with signs.
fn boundary(cell: Cell, size: [usize; 3], edges: BoundaryCondition) -> BTreeMap<Cell, i64> {
    let mut faces = BTreeMap::new();
    let mut sign = 1;
    for axis in (0..3).filter(|&axis| cell[axis].rem_euclid(2) == 1) {
        for step in [-1, 1] {
            let mut face = cell;
            face[axis] += step;
            if edges == BoundaryCondition::Periodic {
                face[axis] = face[axis].rem_euclid(2 * size[axis] as i64);
            }
            *faces.entry(face).or_insert(0) += sign * step;
        }
        sign = -sign;
    }
    faces
}

/// Returns the rank of the boundary map of some cells, modulo a large prime.
fn rank(cells: &BTreeSet<Cell>, size: [usize; 3], edges: BoundaryCondition) -> usize {
    const PRIME: i64 = 1_000_003;
    let inverse = |a: i64| {
        let (mut result, mut base, mut power) = (1, a.rem_euclid(PRIME), PRIME - 2);
        while power > 0 {
            if power % 2 == 1 {
                result = result * base % PRIME;
            }
            base = base * base % PRIME;
            power /= 2;
        }
        result
    };
    let mut pivots: BTreeMap<Cell, BTreeMap<Cell, i64>> = BTreeMap::new();
    for &cell in cells {
        let mut row: BTreeMap<Cell, i64> = boundary(cell, size, edges).into_iter().filter(|&(_, v)| v != 0).collect();
        while let Some((&first, &value)) = row.iter().next() {
            let Some(pivot) = pivots.get(&first) else {
                let scale = inverse(value);
                row.values_mut().for_each(|v| *v = (*v * scale).rem_euclid(PRIME));
                pivots.insert(first, row);
                break;
            };
            for (&cell, &v) in pivot {
                let entry = row.entry(cell).or_insert(0);
                *entry = (*entry - value * v).rem_euclid(PRIME);
            }
            row.retain(|_, v| *v != 0);
        }
    }
    pivots.len()
}

#[test]
fn euler_numbers_agree_with_the_cell_complex() {
    let mut kinds = BTreeSet::new();
    let sizes = [[4, 3, 3], [5, 2, 3], [1, 4, 3], [3, 1, 1], [2, 2, 2], [3, 4, 2], [1, 1, 1], [5, 5, 4]];
    for (at, size) in sizes.into_iter().enumerate() {
        for share in [0.0, 0.15, 0.3, 0.5, 0.7, 0.9, 1.0] {
            let set = random(size, share, at as u64 + 11);
            for connectivity in [Connectivity::Faces, Connectivity::All] {
                for edges in [BoundaryCondition::Clip, BoundaryCondition::Periodic] {
                    let case = format!("{size:?} {share} {connectivity:?} {edges:?}");
                    let cells = cells(&set, connectivity, edges);
                    let counts = cells.each_ref().map(|cells| cells.len() as i64);
                    let chi = counts[0] - counts[1] + counts[2] - counts[3];
                    assert_eq!(characteristic(&set, connectivity, edges), chi, "{case}");
                    let ranks = cells.each_ref().map(|cells| rank(cells, size, edges));
                    let betti = |k: usize| cells[k].len() - ranks[k] - ranks.get(k + 1).copied().unwrap_or(0);
                    let found = Betti::of(&set, connectivity, edges);
                    let expected =
                        Betti { pieces: betti(0) as u64, tunnels: betti(1) as u64, cavities: betti(2) as u64 };
                    assert_eq!(found, expected, "{case}");
                    kinds.insert([found.pieces.min(2), found.tunnels.min(4), found.cavities.min(4)]);
                }
            }
        }
    }
    assert!(kinds.len() > 15, "{kinds:?}");
}

#[test]
fn rows_of_many_words_agree_with_the_cell_complex() {
    for size in [[63, 3, 3], [64, 3, 2], [65, 2, 3], [129, 2, 2]] {
        for connectivity in [Connectivity::Faces, Connectivity::All] {
            for edges in [BoundaryCondition::Clip, BoundaryCondition::Periodic] {
                let set = random(size, 0.5, 3);
                let counts = cells(&set, connectivity, edges).map(|cells| cells.len() as i64);
                let chi = counts[0] - counts[1] + counts[2] - counts[3];
                assert_eq!(characteristic(&set, connectivity, edges), chi, "{size:?} {connectivity:?} {edges:?}");
            }
        }
    }
}

/// Samples the nodes inside a mesh, in a box around it that is larger by some pitches on every side.
fn sampled(mesh: &TriangleMesh, resolution: u32, beyond: u32) -> ([Ldi; 3], NodeSet) {
    let closed = ClosedMesh::check(mesh.clone()).unwrap();
    let Aabb { min, max } = closed.bounds();
    let pitch = (max - min).max_element() / f64::from(resolution);
    let more = DVec3::splat(pitch * f64::from(beyond));
    let grid = Grid::with_pitch(Aabb { min: min - more, max: max + more }, pitch, 1024).unwrap();
    let images = images(mesh, &grid);
    let nodes = Region::of_solid(&images).nodes().clone();
    (images, nodes)
}

fn images(mesh: &TriangleMesh, grid: &Grid) -> [Ldi; 3] {
    let closed = ClosedMesh::check(mesh.clone()).unwrap();
    let solid = grid.quantise(&closed).unwrap();
    Axis::ALL.map(|axis| CpuSampler::default().sample_surface(&solid, axis, FillRule::EvenOdd).unwrap())
}

fn mesh_of(parts: &[TriangleMesh]) -> TriangleMesh {
    together(parts)
}

#[test]
fn solids_have_their_known_euler_and_betti_numbers() {
    let bars = |corners: &[([f64; 3], [f64; 3])]| -> NodeSet {
        NodeSet::from_fn([48; 3], |node| {
            corners.iter().any(|(low, high)| (0..3).all(|i| (low[i]..high[i]).contains(&(node[i] as f64 / 48.0))))
        })
    };
    // The twelve edges of a cube, as in BoneJ's test.
    let mut frame = Vec::new();
    for axis in 0..3 {
        for corner in 0..4 {
            let (mut low, mut high) = ([0.1; 3], [0.2; 3]);
            let others = [(axis + 1) % 3, (axis + 2) % 3];
            for (bit, &other) in others.iter().enumerate() {
                if corner >> bit & 1 == 1 {
                    (low[other], high[other]) = (0.8, 0.9);
                }
            }
            high[axis] = 0.9;
            frame.push((low, high));
        }
    }
    let frame = bars(&frame);
    assert_eq!(characteristic(&frame, Connectivity::All, BoundaryCondition::Clip), -4);
    assert_eq!(
        Betti::of(&frame, Connectivity::All, BoundaryCondition::Clip),
        Betti { pieces: 1, tunnels: 5, cavities: 0 },
        "box frame"
    );
    // A circle with two bars across, as in BoneJ's test.
    let crossed = NodeSet::from_fn([64, 64, 5], |[x, y, z]| {
        let (x, y) = (x as f64 - 31.5, y as f64 - 31.5);
        let r = x.hypot(y);
        (1..4).contains(&z) && ((20.0..28.0).contains(&r) || (r < 28.0 && (x.abs() < 3.0 || y.abs() < 3.0)))
    });
    assert_eq!(characteristic(&crossed, Connectivity::All, BoundaryCondition::Clip), -3, "crossed circle");
    for resolution in [24, 36, 54] {
        let ball = solids::geodesic(1.0, 16).unwrap();
        let cavity = crate::mesh::testing::reversed(&solids::geodesic(0.6, 16).unwrap());
        let hollow = mesh_of(&[ball.clone(), cavity]);
        let torus = solids::torus(1.0, 0.4, 48, 32).unwrap();
        for (name, mesh, numbers) in
            [("ball", ball, [1, 0, 0]), ("hollow ball", hollow, [1, 0, 1]), ("torus", torus, [1, 1, 0])]
        {
            let (_, nodes) = sampled(&mesh, resolution, 2);
            let chi = numbers[0] - numbers[1] + numbers[2];
            assert_eq!(characteristic(&nodes, Connectivity::All, BoundaryCondition::Clip), chi, "{name} {resolution}");
            let betti = Betti::of(&nodes, Connectivity::All, BoundaryCondition::Clip);
            assert_eq!([betti.pieces, betti.tunnels, betti.cavities].map(|b| b as i64), numbers, "{name} {resolution}");
            let of_mesh = SurfaceCharacteristic::of(&mesh.positions, &mesh.triangles);
            assert_eq!(of_mesh.of_solid(), Some(chi as f64), "{name}");
        }
    }
}

fn struts(cells: u32) -> TriangleMesh {
    let form = LatticeForm::Union { resolution: 24 };
    StrutLattice { pattern: StrutPattern::Cubic, form, cells: [cells; 3], cell_size: 1.0, radius: 0.15 }
        .build()
        .unwrap()
}

/// Returns the box of a mesh as region, on a raster that is its box.
fn box_of(grid: &Grid) -> Region<'static> {
    Region::of_box(grid, crate::grid::LatticeBox { min: [0; 3], max: [0, 1, 2].map(|axis| grid.length(axis)) })
}

#[test]
fn a_block_of_struts_has_k_cubed_nodes_and_the_struts_between_them() {
    // A node with struts to the six faces of its cell: k³ nodes, 3 k² (k − 1) struts between them, and ends at the box that
    // change nothing. As a part of an endless structure, each cell has one node and three struts: χ −2.
    for k in 1..=3 {
        let mesh = struts(k);
        let count = i64::from(k);
        let expected = count.pow(3) - 3 * count.pow(2) * (count - 1);
        let of_mesh = SurfaceCharacteristic::of(&mesh.positions, &mesh.triangles);
        assert_eq!(of_mesh.of_solid(), Some(expected as f64));
        for per_cell in [16, 24, 32] {
            let (images, nodes) = sampled(&mesh, per_cell * k, 0);
            let region = box_of(images[0].grid());
            let found = Topology::of(&nodes, &region, BoundaryCondition::Clip);
            assert_eq!(found.characteristic, expected, "{k} {per_cell}");
            assert_eq!(found.contribution, -2.0 * (count as f64).powi(3), "{k} {per_cell}");
            let density = (1.0 + 2.0 * f64::from(k).powi(3)) / f64::from(k).powi(3);
            assert!((found.connectivity_density / density - 1.0).abs() < 1e-6, "{k} {per_cell} {found:?}");
            let periodic = Topology::of(&nodes, &region, BoundaryCondition::Periodic);
            assert_eq!(periodic.characteristic, -2 * count.pow(3), "{k} {per_cell}");
            assert_eq!(periodic.betti.tunnels as i64, 1 + 2 * count.pow(3));
        }
    }
}

#[test]
fn struts_cut_by_a_region_count_half_in_its_boundary() {
    let block = struts(3);
    for resolution in [48, 60, 96] {
        let closed = ClosedMesh::check(block.clone()).unwrap();
        let grid = Grid::with_resolution(closed.bounds(), resolution, 1024).unwrap();
        let solid = Region::of_solid(&images(&block, &grid)).nodes().clone();
        // The cell in the middle, by a box and as a shape; a ball around its node; and all of the block.
        let cell = images(&solids::cuboid(DVec3::splat(-0.5), DVec3::splat(0.5)).unwrap(), &grid);
        let ball = images(&solids::geodesic(0.45, 12).unwrap(), &grid);
        for (images, name) in [(&cell, "cell"), (&ball, "ball")] {
            let region = Region::of_solid(images);
            let found = Topology::of(&solid, &region, BoundaryCondition::Clip);
            assert_eq!((found.characteristic, found.contribution), (1, -2.0), "{name} {resolution}");
        }
        let cell = Region::of_solid(&cell);
        let by_box = Region::of_box(&grid, cell.bounds());
        assert_eq!(contribution(&solid.and(by_box.nodes()), &by_box, BoundaryCondition::Clip), -2.0, "{resolution}");
        let whole = box_of(&grid);
        assert_eq!(contribution(&solid, &whole, BoundaryCondition::Border), -54.0, "{resolution}");
    }
}

#[test]
fn solids_off_the_box_contribute_all_of_their_characteristic() {
    let (images, nodes) = sampled(&solids::torus(1.0, 0.3, 48, 24).unwrap(), 40, 3);
    let found = Topology::of(&nodes, &box_of(images[0].grid()), BoundaryCondition::Clip);
    assert_eq!((found.characteristic, found.contribution), (0, 0.0));
    // A box full of solid: cut from a solid that fills space.
    let full = NodeSet::full(nodes.size());
    assert_eq!(contribution(&full, &box_of(images[0].grid()), BoundaryCondition::Clip), 1.0 - 3.0 + 3.0 - 1.0);
}

/// Returns f of the nodal surfaces at an angle.
fn nodal(surface: Surface, [x, y, z]: [f64; 3]) -> f64 {
    let ((sx, cx), (sy, cy), (sz, cz)) = (x.sin_cos(), y.sin_cos(), z.sin_cos());
    match surface {
        Surface::Gyroid => sx * cy + sy * cz + sz * cx,
        Surface::Primitive => cx + cy + cz,
        Surface::Diamond => sx * sy * sz + sx * cy * cz + cx * sy * cz + cx * cy * sz,
    }
}

#[test]
fn labyrinths_of_minimal_surfaces_have_their_known_genus() {
    // Genus 3 for each primitive cell, of which a cubic cell has two (gyroid), one (primitive) and four (diamond): the surface
    // has χ 2 − 2·3 in each, and either labyrinth half of it.
    for (surface, expected) in [(Surface::Gyroid, -4), (Surface::Primitive, -2), (Surface::Diamond, -8)] {
        for n in [24, 32, 48] {
            let inside = NodeSet::from_fn([n; 3], |node| {
                // Nodes that lie on no plane of symmetry.
                nodal(surface, std::array::from_fn(|i| TAU * (node[i] as f64 + 0.31 + 0.1 * i as f64) / n as f64)) < 0.0
            });
            let rest = NodeSet::full([n; 3]).minus(&inside);
            for labyrinth in [&inside, &rest] {
                for connectivity in [Connectivity::Faces, Connectivity::All] {
                    let chi = characteristic(labyrinth, connectivity, BoundaryCondition::Periodic);
                    assert_eq!(chi, expected, "{surface:?} {n} {connectivity:?}");
                }
                let betti = Betti::of(labyrinth, Connectivity::All, BoundaryCondition::Periodic);
                assert_eq!([betti.pieces, betti.cavities], [1, 0], "{surface:?} {n}");
                assert_eq!(betti.tunnels as i64, 1 - expected, "{surface:?} {n}");
            }
        }
    }
}

#[test]
fn meshed_networks_have_the_characteristic_of_their_labyrinth_and_sheets_twice_it() {
    for (surface, expected) in [(Surface::Gyroid, -4), (Surface::Primitive, -2), (Surface::Diamond, -8)] {
        for (part, times) in [(Part::Network { fraction: 0.5 }, 1), (Part::Sheet { wall: 0.15 }, 2)] {
            let mesh = MinimalSurface { surface, part, cells: [1; 3], cell_size: 1.0, resolution: 48 }.build().unwrap();
            for resolution in [40, 48, 64] {
                let (_, nodes) = sampled(&mesh, resolution, 0);
                let chi = characteristic(&nodes, Connectivity::All, BoundaryCondition::Periodic);
                assert_eq!(chi, times * expected, "{surface:?} {part:?} {resolution}");
            }
        }
    }
}

#[test]
fn surface_characteristics_agree_with_the_mesh_check() {
    let ring = solids::torus(2.0, 0.5, 24, 12).unwrap();
    let hollow = solids::hollow_box(DVec3::splat(2.0), DVec3::splat(1.0)).unwrap();
    let knot = StrutLattice {
        pattern: StrutPattern::BodyCentred,
        form: LatticeForm::Union { resolution: 16 },
        cells: [2, 1, 1],
        cell_size: 1.0,
        radius: 0.12,
    };
    for mesh in [ring, hollow, knot.build().unwrap(), together(&[cube(DVec3::ZERO, 1.0), cube(DVec3::ONE, 1.0)])] {
        let expected = check(&mesh).euler_characteristic;
        for mesh in [&soup(&mesh), &mesh] {
            assert_eq!(SurfaceCharacteristic::of(&mesh.positions, &mesh.triangles).of_surface(), expected);
        }
    }
    // −0 and 0 are one position, and a triangle with two corners in one position is no face.
    let mut flat = cube(DVec3::ZERO, 1.0);
    let count = flat.positions.len() as u32;
    flat.positions.push(DVec3::new(-0.0, 0.0, -0.0));
    flat.triangles.push([0, 1, count]);
    let found = SurfaceCharacteristic::of(&flat.positions, &flat.triangles);
    assert_eq!(found, SurfaceCharacteristic { corners: 8, edges: 18, faces: 12, irregular_edges: 0 });
    let beside = together(&[cube(DVec3::ZERO, 1.0), cube(DVec3::new(1.0, 1.0, 0.0), 1.0)]);
    let found = SurfaceCharacteristic::of(&beside.positions, &beside.triangles);
    assert_eq!((found.irregular_edges, found.of_solid()), (1, None));
}
