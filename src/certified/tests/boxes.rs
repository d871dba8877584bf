//! Random unions of unit cells of a common grid, sheared and turned: their volumes are whole numbers of cells.

use super::*;
use crate::testing::meshes::{reversed, together};

/// Returns the surface of a set of unit cells; where cells share a face, it has none.
fn surface(size: i32, is_in: &dyn Fn([i32; 3]) -> bool) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let within = |cell: [i32; 3]| cell.iter().all(|&i| (0..size).contains(&i)) && is_in(cell);
    for cell in (0..size.pow(3)).map(|i| [i % size, i / size % size, i / size / size]) {
        for axis in (0..3).filter(|_| within(cell)) {
            for step in [-1, 1] {
                let mut beyond = cell;
                beyond[axis] += step;
                if within(beyond) {
                    continue;
                }
                let first = mesh.positions.len() as u32;
                let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
                for (di, dj) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                    let mut corner = cell.map(f64::from);
                    corner[axis] += f64::from((step + 1) / 2);
                    (corner[i], corner[j]) = (corner[i] + f64::from(di), corner[j] + f64::from(dj));
                    mesh.positions.push(DVec3::from_array(corner));
                }
                let quad = [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v| first + v));
                mesh.triangles.extend(if step > 0 { quad } else { quad.map(|[a, b, c]| [a, c, b]) });
            }
        }
    }
    mesh
}

/// Draws cells until there is one.
fn random_cells(random: &mut Random, size: i32) -> Vec<bool> {
    loop {
        let one_in = 2 + random.below(3);
        let cells: Vec<bool> = (0..size.pow(3)).map(|_| random.chance(one_in)).collect();
        if cells.contains(&true) {
            return cells;
        }
    }
}

/// 6,000 cases with coincident faces, shared edges, touching corners, identical solids and open checkerboards.
#[test]
fn bounds_contain_the_volumes_of_sets_of_cells() {
    const SIZE: i32 = 3;
    let mut random = Random::new(1);
    for case in 0..1_500 {
        let sets = [(); 2].map(|()| random_cells(&mut random, SIZE));
        let index = |[x, y, z]: [i32; 3]| (x + SIZE * (y + SIZE * z)) as usize;
        let map = match case % 3 {
            0 => DMat3::from_diagonal(DVec3::new(1.0, 0.5, 0.25)),
            1 => random_turn(&mut random),
            _ => DMat3::from_cols(DVec3::new(1.0, 0.3, 0.1), DVec3::new(-0.2, 0.7, 0.6), DVec3::new(0.5, 0.0, 0.9)),
        };
        let mut meshes = [0, 1].map(|i| mapped(surface(SIZE, &|cell| sets[i][index(cell)]), map));
        if case % 5 == 0 {
            meshes[1] = reversed(&meshes[1]);
        }
        let pitch = [3.0, 0.7][random.below(2)];
        for operation in OPERATIONS {
            let cells = (0..sets[0].len()).filter(|&i| operation.holds(sets[0][i], sets[1][i])).count();
            let found = of_two(operation, [&meshes[0], &meshes[1]], pitch);
            assert_contains(found, cells as f64 * map.determinant().abs(), 27.0, &(case, operation));
        }
    }
}

/// Returns a box that is turned about its centre.
fn random_box(random: &mut Random) -> ([DVec3; 2], TriangleMesh) {
    let min = DVec3::from_array([(); 3].map(|()| random.unit()));
    // Now and then a plate or a needle.
    let side = |random: &mut Random| (0.05 + random.share()) * [1.0, 1.0, 1.0, 1e-3, 1e-7][random.below(5)];
    let max = min + DVec3::from_array([(); 3].map(|()| side(random)));
    ([min, max], crate::solids::cuboid(min, max).unwrap())
}

/// 6,000 cases: plates, needles and boxes in any common orientation.
#[test]
fn bounds_contain_the_volumes_of_boxes() {
    let mut random = Random::new(2);
    for case in 0..1_500 {
        let [(a, mesh_a), (b, mesh_b)] = [(); 2].map(|()| random_box(&mut random));
        let turn = if case % 2 == 0 { DMat3::IDENTITY } else { random_turn(&mut random) };
        // Far from the origin, now and then; by a whole number, so that the sides keep most of their digits.
        let far = DVec3::splat([0.0, 4096.0][random.below(2)]);
        let meshes = [mesh_a, mesh_b].map(|mesh| moved(mapped(mesh, turn), far));
        let volume = |[min, max]: [DVec3; 2]| (max - min).max(DVec3::ZERO).element_product();
        let (one, other) = (volume(a), volume(b));
        let common = volume([a[0].max(b[0]), a[1].min(b[1])]);
        for (operation, known) in
            OPERATIONS.into_iter().zip([common, one + other - common, one - common, one + other - 2.0 * common])
        {
            let found = of_two(operation, [&meshes[0], &meshes[1]], [0.3, 0.05][case % 2]);
            assert_contains(found, known, 1.0 + far.x, &(case, operation));
        }
    }
}

/// 1,800 cases: overlapping boxes in one mesh, whose exact volume under either rule is that of the cells between their coordinates.
#[test]
fn bounds_contain_the_volumes_of_overlapping_shells_under_both_rules() {
    let mut random = Random::new(3);
    for case in 0..900 {
        let count = 2 + random.below(4);
        let corners: Vec<[[i32; 3]; 2]> = (0..count)
            .map(|_| {
                let low = random.point(0..8);
                [low, low.map(|i| i + random.between(1, 6))]
            })
            .collect();
        let signs: Vec<i32> = (0..count).map(|_| if case % 3 == 0 { random.choose(&[1, -1]) } else { 1 }).collect();
        let parts = corners.iter().zip(&signs).map(|(corners, &sign)| {
            let [min, max] = corners.map(|corner| DVec3::from_array(corner.map(f64::from)));
            let mesh = crate::solids::cuboid(min, max).unwrap();
            if sign > 0 { mesh } else { reversed(&mesh) }
        });
        let turn = if case % 2 == 0 { DMat3::IDENTITY } else { random_turn(&mut random) };
        let mesh = mapped(together(&parts.collect::<Vec<_>>()), turn);
        let winding = |[x, y, z]: [i32; 3]| -> i32 {
            let holds = |[low, high]: &[[i32; 3]; 2]| {
                [x, y, z].iter().zip(low).zip(high).all(|((&at, &low), &high)| low <= at && at < high)
            };
            corners.iter().zip(&signs).filter(|(corners, _)| holds(corners)).map(|(_, sign)| sign).sum()
        };
        let cells = |is_in: &dyn Fn(i32) -> bool| {
            let all = (0..14 * 14 * 14).map(|i| [i % 14, i / 14 % 14, i / 196]);
            all.filter(|&cell| is_in(winding(cell))).count() as f64
        };
        for (fill, known) in [(FillRule::EvenOdd, cells(&|w| w % 2 != 0)), (FillRule::NonZero, cells(&|w| w != 0))] {
            let found = certified(&Expression::input(0), &[&mesh], fill, Refine::ToPitch([4.0, 1.0][case % 2]));
            assert_contains(found, known, 1e3, &(case, fill));
        }
    }
}
