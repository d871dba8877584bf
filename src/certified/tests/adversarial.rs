//! Solids on which sampling fails: walls and needles between rays, lattices in step with them, nested cavities.

use super::*;
use crate::solids::{self, LatticeForm, StrutLattice, StrutPattern};
use crate::testing::meshes::{cube, hollowed, reversed, together};

fn of_one(mesh: &TriangleMesh, fill: FillRule, pitch: f64) -> CertifiedVolume {
    certified(&Expression::input(0), &[mesh], fill, Refine::ToPitch(pitch))
}

/// 3,000 cases: cells of a raster of 10 to 20 pitches across, and a wall or needle far thinner at any angle.
#[test]
fn walls_and_needles_between_rays_are_certain() {
    let mut random = Random::new(11);
    for case in 0..1_000 {
        let thin = [1e-2, 1e-4, 1e-8][random.below(3)];
        let size = if case % 2 == 0 { DVec3::new(2.0, 1.5, thin) } else { DVec3::new(2.0, thin, thin) };
        let wall = solids::cuboid(-0.5 * size, 0.5 * size).unwrap();
        let turn = if case % 4 < 2 { DMat3::IDENTITY } else { random_turn(&mut random) };
        let shift = DVec3::from_array([(); 3].map(|()| 1e-2 * random.unit()));
        let wall = moved(mapped(wall, turn), shift);
        // The block contains it, or cuts it across its length in the middle.
        let block = cube(DVec3::splat(-2.0), 4.0);
        let half = moved(mapped(solids::cuboid(DVec3::new(0.0, -3.0, -3.0), DVec3::splat(3.0)).unwrap(), turn), shift);
        let volume = size.element_product();
        for (other, common) in [(&block, volume), (&half, 0.5 * volume)] {
            let found = of_two(BooleanOperation::Intersection, [&wall, other], 0.3);
            assert_contains(found, common, 1.0, &(case, common));
        }
        let found = of_two(BooleanOperation::Difference, [&block, &wall], 0.3);
        assert_contains(found, 64.0 - volume, 64.0, &case);
        // The sign of a volume below the rounding of its terms is not known.
        assert!(volume < 1e-14 || found.upper - found.lower < 1e-9, "{found:?}");
    }
}

#[test]
fn nested_cavities_are_certain_under_both_rules() {
    let shells: Vec<TriangleMesh> = (0..6)
        .map(|i| {
            let side = 6.0 - f64::from(i);
            let shell = cube(DVec3::splat(-0.5 * side), side);
            if i % 2 == 0 { shell } else { reversed(&shell) }
        })
        .collect();
    let volume: f64 = (0..6).map(|i| (6.0 - f64::from(i)).powi(3) * if i % 2 == 0 { 1.0 } else { -1.0 }).sum();
    let mesh = turned(together(&shells), DVec3::new(1.0, 1.0, 0.3), 0.4);
    for fill in [FillRule::EvenOdd, FillRule::NonZero] {
        let found = of_one(&mesh, fill, 0.5);
        assert_contains(found, volume, 216.0, &fill);
        assert!(found.upper - found.lower < 1e-9, "{found:?}");
    }
    // All shells outwards: even-odd cancels every other, and nonzero fills all.
    let outwards = together(
        &(0..6).map(|i| cube(DVec3::splat(-3.0 + 0.5 * f64::from(i)), 6.0 - f64::from(i))).collect::<Vec<_>>(),
    );
    assert_contains(of_one(&outwards, FillRule::EvenOdd, 0.5), volume, 216.0, &"even-odd");
    assert_contains(of_one(&outwards, FillRule::NonZero, 0.5), 216.0, 216.0, &"nonzero");
}

#[test]
fn lattices_in_step_with_the_cells_are_certain() {
    for resolution in [16, 32] {
        let form = LatticeForm::Union { resolution: 8 };
        let block = StrutLattice { pattern: StrutPattern::Cubic, form, cells: [2; 3], cell_size: 1.0, radius: 0.15 };
        let mesh = block.build().unwrap();
        let known = mesh.signed_volume();
        let bounds = ClosedMesh::check(mesh.clone()).unwrap().bounds();
        let around = solids::cuboid(bounds.min, bounds.max).unwrap();
        let pitch = 2.0 / f64::from(resolution);
        let found = of_two(BooleanOperation::Intersection, [&mesh, &around], pitch);
        assert_contains(found, known, 8.0, &resolution);
        let found = of_two(BooleanOperation::Difference, [&around, &mesh], pitch);
        assert_contains(found, bounds.extent().element_product() - known, 8.0, &resolution);
        // Identical solids.
        for (operation, volume) in OPERATIONS.into_iter().zip([known, known, 0.0, 0.0]) {
            assert_contains(of_two(operation, [&mesh, &mesh], 2.0 * pitch), volume, 8.0, &operation);
        }
    }
}

#[test]
fn a_cavity_of_any_size_is_certain() {
    for side in [1.0, 1e-2, 1e-6] {
        let mesh = hollowed(cube(DVec3::ZERO, 3.0), &cube(DVec3::splat(1.000_3), side));
        assert_contains(of_one(&mesh, FillRule::EvenOdd, 0.5), 27.0 - side.powi(3), 27.0, &side);
        let plug = cube(DVec3::splat(1.000_3), side);
        let found = of_two(BooleanOperation::Union, [&mesh, &plug], 0.2);
        assert_contains(found, 27.0, 27.0, &side);
    }
}

/// A mesh whose triangles cross one another has no proof of its winding numbers: its bounds are those of the cells.
#[test]
fn shells_that_cross_themselves_have_bounds_from_cells() {
    // A cube with a corner pulled through the opposite face.
    let mut mesh = cube(DVec3::ZERO, 1.0);
    mesh.positions[7] = DVec3::new(0.4, 0.45, -0.6);
    let sampled = |fill: FillRule, pitch| of_one(&mesh, fill, pitch);
    for fill in [FillRule::EvenOdd, FillRule::NonZero] {
        let [coarse, fine] = [0.2, 0.025].map(|pitch| sampled(fill, pitch));
        assert!(coarse.lower <= fine.lower && fine.upper <= coarse.upper, "{coarse:?} {fine:?}");
        assert!(fine.upper - fine.lower < 0.2 * (coarse.upper - coarse.lower), "{coarse:?} {fine:?}");
        let known = by_points(&mesh, fill);
        assert!(fine.lower <= known + 0.01 && known - 0.01 <= fine.upper, "{known} {fine:?}");
    }
}

/// Estimates a volume from points of a fine grid, by crossings along +x.
fn by_points(mesh: &TriangleMesh, fill: FillRule) -> f64 {
    let (count, min, side) = (120, DVec3::splat(-0.7), 1.8);
    let step = side / f64::from(count);
    let mut inside = 0u32;
    for (j, k) in (0..count).flat_map(|j| (0..count).map(move |k| (j, k))) {
        let at = |i: i32| (f64::from(i) + 0.503) * step;
        let (y, z) = (min.y + at(j), min.z + at(k));
        let mut crossings: Vec<(f64, i32)> = Vec::new();
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|v| mesh.positions[v as usize] - DVec3::new(0.0, y, z));
            let [wa, wb, wc] = [(b, c), (c, a), (a, b)].map(|(p, q)| p.y * q.z - p.z * q.y);
            if (wa > 0.0) == (wb > 0.0) && (wb > 0.0) == (wc > 0.0) {
                let sum = wa + wb + wc;
                crossings.push(((wa * a.x + wb * b.x + wc * c.x) / sum, if sum > 0.0 { -1 } else { 1 }));
            }
        }
        for i in 0..count {
            let x = min.x + at(i);
            let winding: i32 = crossings.iter().filter(|(depth, _)| *depth < x).map(|(_, sign)| sign).sum();
            inside += u32::from(if fill == FillRule::EvenOdd { winding % 2 != 0 } else { winding != 0 });
        }
    }
    f64::from(inside) * step.powi(3)
}

#[test]
fn expressions_of_several_operands_are_certain() {
    let slab = |axis: usize, from: f64, to: f64| {
        let (mut min, mut max) = (DVec3::splat(-1.0), DVec3::splat(1.0));
        (min[axis], max[axis]) = (from, to);
        solids::cuboid(min, max).unwrap()
    };
    let names = ["a", "b", "c", "d"];
    let mut random = Random::new(12);
    for text in
        ["a & (b | c) - d", "a ^ b ^ c ^ d", "(a - b) | (c & d)", "a & b & c & d", "a | b | c | d", "a - (a - b) ^ c"]
    {
        let operands = if text.contains('d') { &names[..] } else { &names[..3] };
        let expression = Expression::parse(text, operands).unwrap();
        for _ in 0..12 {
            let turn = random_turn(&mut random);
            // Slabs across the three axes, whose cells have volumes that are products.
            let cuts: Vec<(usize, [f64; 2])> = (0..operands.len())
                .map(|i| {
                    let from = random.unit();
                    (i % 3, [from.min(0.9), (from + 0.2 + random.share()).min(1.0)])
                })
                .collect();
            let meshes: Vec<TriangleMesh> =
                cuts.iter().map(|&(axis, [from, to])| mapped(slab(axis, from, to), turn)).collect();
            let mut coordinates: [Vec<f64>; 3] = std::array::from_fn(|_| vec![-1.0, 1.0]);
            for &(axis, ends) in &cuts {
                coordinates[axis].extend(ends);
            }
            coordinates.iter_mut().for_each(|ends| ends.sort_by(f64::total_cmp));
            let mut known = 0.0;
            for x in coordinates[0].windows(2) {
                for y in coordinates[1].windows(2) {
                    for z in coordinates[2].windows(2) {
                        let middle = [x, y, z].map(|ends| 0.5 * (ends[0] + ends[1]));
                        let is_in = |i: usize| {
                            let (axis, [from, to]) = cuts[i];
                            from < middle[axis] && middle[axis] < to
                        };
                        if expression.holds(is_in) {
                            known += (x[1] - x[0]) * (y[1] - y[0]) * (z[1] - z[0]);
                        }
                    }
                }
            }
            let meshes: Vec<&TriangleMesh> = meshes.iter().collect();
            let found = certified(&expression, &meshes, FillRule::NonZero, Refine::ToPitch(0.2));
            assert_contains(found, known, 8.0, &text);
        }
    }
}

#[test]
fn meshes_without_winding_numbers_are_refused() {
    let mut mesh = cube(DVec3::ZERO, 1.0);
    mesh.triangles[0].swap(1, 2);
    let closed = ClosedMesh::check(mesh).unwrap();
    let refused = certified_volume(&Expression::input(0), &[&closed], FillRule::EvenOdd, Refine::ToPitch(0.1));
    assert_eq!(refused, Err(CertifiedError::NotOriented { operand: 0 }));
}

#[test]
fn sizes_from_tiny_to_huge_give_the_same_bounds() {
    let meshes = [cube(DVec3::ZERO, 1.0), turned(cube(DVec3::splat(0.2), 1.0), DVec3::ONE, 0.3)];
    let unit = of_two(BooleanOperation::Intersection, [&meshes[0], &meshes[1]], 0.05);
    for power in [-90, -10, 10, 90] {
        let scale = f64::from(power).exp2();
        let scaled = [0, 1].map(|i| mapped(meshes[i].clone(), DMat3::from_diagonal(DVec3::splat(scale))));
        let found = of_two(BooleanOperation::Intersection, [&scaled[0], &scaled[1]], 0.05 * scale);
        let cubed = scale * scale * scale;
        assert_eq!((found.lower / cubed, found.upper / cubed), (unit.lower, unit.upper), "{power}");
    }
}
