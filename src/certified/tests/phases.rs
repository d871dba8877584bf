//! Random plates in step with the cells, nested cavities, and slivers: solids of known volume on which sampling fails.

use super::*;
use crate::solids::cuboid;
use crate::testing::meshes::{reversed, together};

/// The pitch of all cases, and the side of the cube that holds them.
const PITCH: f64 = 0.25;
const SIDE: f64 = 2.0;

/// Parallel plates across an axis, and their thickness in all.
fn plates(random: &mut Random, axis: usize) -> (TriangleMesh, f64) {
    let period = PITCH * random.choose(&[0.5, 1.0, 2.0]);
    let thick = period * random.choose(&[0.5, 1e-1, 1e-3, 1e-6]);
    let anywhere = random.share();
    let first = period * random.choose(&[0.0, 0.25, anywhere]);
    let count = 1 + random.below((SIDE / period) as usize - 1);
    let plate = |i: usize| {
        let (mut min, mut max) = (DVec3::ZERO, DVec3::splat(SIDE));
        min[axis] = first + i as f64 * period;
        max[axis] = min[axis] + thick;
        (cuboid(min, max).unwrap(), max[axis] - min[axis])
    };
    let (meshes, thickness): (Vec<TriangleMesh>, Vec<f64>) = (0..count).map(plate).unzip();
    (together(&meshes), thickness.iter().sum())
}

/// 2,000 cases: plates as far apart as cells are long, far thinner than these, along the axes and at any angle.
#[test]
fn bounds_contain_the_volumes_of_plates_in_step_with_the_cells() {
    let mut random = Random::new(41);
    for case in 0..500 {
        let axes = random.choose(&[[0, 1], [1, 2], [2, 0]]);
        let [(a, of_a), (b, of_b)] = axes.map(|axis| plates(&mut random, axis));
        let turn = if case % 4 == 0 { random_turn(&mut random) } else { DMat3::IDENTITY };
        let meshes = [a, b].map(|mesh| mapped(mesh, turn));
        let (one, other, common) = (of_a * SIDE * SIDE, of_b * SIDE * SIDE, of_a * of_b * SIDE);
        let known = [common, one + other - common, one - common, one + other - 2.0 * common];
        for (operation, volume) in OPERATIONS.into_iter().zip(known) {
            assert_contains(of_two(operation, [&meshes[0], &meshes[1]], PITCH), volume, 8.0, &(case, operation));
        }
    }
}

/// 1,000 cases: up to eight boxes within one another, some nearly as large as the next, which face outwards or alternate.
#[test]
fn bounds_contain_the_volumes_of_random_nested_cavities() {
    let mut random = Random::new(42);
    for case in 0..500 {
        let (mut min, mut max) = (DVec3::splat(-1.0), DVec3::ONE);
        let alternate = random.chance(2);
        let (mut shells, mut volumes) = (Vec::new(), Vec::new());
        for i in 0..2 + random.below(7) {
            let shell = cuboid(min, max).unwrap();
            shells.push(if alternate && i % 2 == 1 { reversed(&shell) } else { shell });
            volumes.push((max - min).element_product());
            let mut margin =
                || DVec3::from_array([(); 3].map(|()| random.choose(&[1e-9, 1e-4, 0.1]) * (0.5 + random.share())));
            (min, max) = (min + margin(), max - margin());
        }
        let turn = if case % 2 == 0 { DMat3::IDENTITY } else { random_turn(&mut random) };
        let mesh = mapped(together(&shells), turn);
        let every_other: f64 =
            volumes.iter().zip([1.0, -1.0].into_iter().cycle()).map(|(volume, sign)| sign * volume).sum();
        let non_zero = if alternate { every_other } else { volumes[0] };
        for (fill, known) in [(FillRule::EvenOdd, every_other), (FillRule::NonZero, non_zero)] {
            let found = certified(&Expression::input(0), &[&mesh], fill, Refine::ToPitch(PITCH));
            assert_contains(found, known, 8.0, &(case, fill));
        }
    }
}

/// Splits triangles at points that lie on or nearly on their sides.
fn with_slivers(mesh: &TriangleMesh, random: &mut Random) -> TriangleMesh {
    let mut split = TriangleMesh { positions: mesh.positions.clone(), ..TriangleMesh::default() };
    let mut open = mesh.triangles.clone();
    for _ in 0..40 {
        let [a, b, c] = open.swap_remove(random.below(open.len()));
        let [p, q, r] = [a, b, c].map(|i| split.positions[i as usize]);
        let (along, across) = (random.share(), random.choose(&[0.3, 1e-3, 1e-9, 1e-17]));
        let middle = split.positions.len() as u32;
        // The faces are across the axes, so that rounding leaves the point in them.
        split.positions.push(p + (q - p) * along * (1.0 - across) + (r - p) * across);
        open.extend([[a, b, middle], [b, c, middle], [c, a, middle]]);
    }
    split.triangles = open;
    split
}

/// 1,200 cases: boxes whose faces consist of slivers and of triangles without an area.
#[test]
fn bounds_contain_the_volumes_of_boxes_of_slivers() {
    let mut random = Random::new(43);
    for case in 0..300 {
        let boxes = [(); 2].map(|()| {
            let min = DVec3::from_array([(); 3].map(|()| random.unit()));
            [min, min + DVec3::from_array([(); 3].map(|()| random.choose(&[1.0, 0.3, 1e-4]) * (0.5 + random.share())))]
        });
        let meshes = boxes.map(|[min, max]| with_slivers(&cuboid(min, max).unwrap(), &mut random));
        let volume = |[min, max]: [DVec3; 2]| (max - min).max(DVec3::ZERO).element_product();
        let [a, b] = boxes;
        let (one, other, common) = (volume(a), volume(b), volume([a[0].max(b[0]), a[1].min(b[1])]));
        let known = [common, one + other - common, one - common, one + other - 2.0 * common];
        for (operation, volume) in OPERATIONS.into_iter().zip(known) {
            assert_contains(of_two(operation, [&meshes[0], &meshes[1]], PITCH), volume, 8.0, &(case, operation));
        }
    }
}
