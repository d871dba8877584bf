//! Combinations that the device makes, against the sweep of the CPU's images.

use ldi_ops::boolean::{BooleanOperation, Diagram, Expression, Operand, Plan};
use ldi_ops::gpu::{Counters, DeviceError};
use ldi_ops::grid::{Axis, Grid, LatticeSolid};
use ldi_ops::ldi::{Ldi, VolumeSums};
use ldi_ops::mesh::ClosedMesh;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::gpu::{GpuOptions, GpuSampler};
use ldi_ops::sampler::{Combination, Combined, FillRule, Mode, SampleError, Sampler};
use ldi_ops::solids;

use crate::any_expression::random_expression;
use crate::comparison::assert_same;
use crate::lattice::{frame, generators, lod, region};
use crate::on_lattice::{closed, grid, mesh};
use crate::soups;
use crate::testing::random::Random;
use crate::twin::{ADAPTER, FILLS, MODES, Twin, all, is_software, plain};

/// The solid and the mode of each leaf of a plan.
fn leaves<'s>(plan: &Plan, solids: &[&'s LatticeSolid<'s>]) -> Vec<(&'s LatticeSolid<'s>, Mode)> {
    plan.leaves().iter().map(|leaf| (solids[leaf.input], leaf.mode)).collect()
}

/// Samples each leaf by itself on the CPU, and sweeps the images.
fn swept(plan: &Plan, solids: &[&LatticeSolid], axis: Axis, fill: FillRule) -> Result<Combined<Ldi>, SampleError> {
    let image = |&(solid, mode): &(&LatticeSolid, Mode)| CpuSampler::default().sample(solid, axis, mode, fill);
    let images = leaves(plan, solids).iter().map(image).collect::<Result<Vec<Ldi>, SampleError>>()?;
    let result = plan.sweep(&images.iter().map(Operand::from).collect::<Vec<_>>()).unwrap();
    Ok(Combined { result, windings: images.iter().map(Ldi::windings).collect() })
}

/// Compares a plan along an axis, under one fill rule: the image, its sums, and the windings of the leaves. The sums along two axes
/// are made together.
fn compare_plan(what: &str, twins: &[Twin], plan: &Plan, solids: &[&LatticeSolid], axis: Axis, fill: FillRule) {
    let axes = [axis, Axis::ALL[(axis.depth() + 1) % 3]];
    let expected = swept(plan, solids, axis, fill);
    let of_axis = |&axis: &Axis| {
        let Combined { result, windings } = swept(plan, solids, axis, fill)?;
        Ok(Combined { result: result.volume_sums(), windings })
    };
    let expected_sums = axes.iter().map(of_axis).collect::<Result<Vec<Combined<VolumeSums>>, SampleError>>();
    let leaves = leaves(plan, solids);
    let diagram = plan.diagram().unwrap();
    let combination = Combination::new(&leaves, &diagram);
    assert_eq!(CpuSampler::default().sample_combination(combination, axis, fill), Ok(None));
    for twin in twins {
        let what = format!("{what}, {axis:?}, {fill:?}; {}", twin.name());
        let found = twin.gpu.sample_combination(combination, axis, fill).map(|made| made.expect(&what));
        let windings = |made: &Result<Combined<Ldi>, SampleError>| made.clone().map(|made| made.windings);
        assert_eq!(windings(&found), windings(&expected), "{what}");
        assert_same(&what, &found.map(|made| made.result), &expected.clone().map(|made| made.result));
        let sums = twin.gpu.combination_sums_along(combination, &axes, fill).map(|made| made.expect(&what));
        assert_eq!(sums, expected_sums, "{what}");
    }
}

/// Compares an expression along an axis, in all modes and under both fill rules.
fn compare(what: &str, twins: &[Twin], expression: &Expression, solids: &[&LatticeSolid], axis: Axis) {
    for (mode, fill) in MODES.into_iter().flat_map(|mode| FILLS.map(|fill| (mode, fill))) {
        compare_plan(&format!("{what}, {mode:?}"), twins, &Plan::new(expression, mode), solids, axis, fill);
    }
}

#[test]
fn random_expressions_have_equal_images_and_sums() {
    let generators = generators();
    for seed in 0..24 {
        let mut random = Random::new(8_200 + seed);
        let frame = frame(&mut random);
        let grid = grid(&frame, lod(&mut random));
        let count = random.between(1, 4) as usize;
        let meshes: Vec<ClosedMesh> =
            (0..count).map(|_| closed(&random.choose(&generators).1(&mut random, &frame))).collect();
        let mut solids: Vec<LatticeSolid> = meshes.iter().map(|mesh| grid.quantise(mesh).unwrap()).collect();
        let expression = random_expression(&mut random, count);
        // Now and then within the boxes that matter, as commands do, or within any boxes.
        if random.chance(2) {
            let bounds: Vec<_> = solids.iter().map(|solid| *solid.bounds()).collect();
            let regions = expression.regions(&bounds);
            solids = solids.iter().zip(&regions).map(|(solid, region)| solid.clone().within(region)).collect();
        } else if random.chance(3) {
            solids = solids.into_iter().map(|solid| solid.within(&region(&mut random, &frame))).collect();
        }
        let solids: Vec<&LatticeSolid> = solids.iter().collect();
        compare(&format!("seed {seed}, {expression:?}"), all(), &expression, &solids, Axis::ALL[seed as usize % 3]);
    }
}

#[test]
fn open_meshes_and_many_leaves_have_equal_images() {
    let frame = soups::Frame { shift: 4, rays: [8, 7, 9] };
    let grid = grid(&frame, 100);
    let mut random = Random::new(77);
    let mut torn = soups::cuboid([10, 12, 14], [90, 80, 100]);
    torn.triangles.pop();
    let torn = mesh(&torn);
    let count = Diagram::MOST_LEAVES + 10;
    // Soups, and then boxes, as a software adapter ends the loops over many crossings of many leaves.
    let mut solid = |i: usize| match i {
        1..12 => closed(&soups::oriented()[0].1(&mut random, &frame)),
        _ => {
            let low: [i32; 3] = std::array::from_fn(|_| 2 * random.between(0, 25));
            closed(&soups::cuboid(low, low.map(|at| at + 2 * random.between(1, 30))))
        }
    };
    let meshes: Vec<ClosedMesh> = (1..count).map(&mut solid).collect();
    let mut solids: Vec<LatticeSolid> = meshes.iter().map(|mesh| grid.quantise(mesh).unwrap()).collect();
    solids.insert(11, grid.quantise_open(&torn).unwrap());
    let solids: Vec<&LatticeSolid> = solids.iter().collect();
    // A symmetric difference of estimates needs both of each solid.
    for (operation, first, count) in [
        (BooleanOperation::Union, 0, 12),
        (BooleanOperation::Difference, 0, 12),
        (BooleanOperation::Union, 11, 8),
        (BooleanOperation::Union, 11, 9),
        (BooleanOperation::Difference, 11, 33),
        (BooleanOperation::Xor, 32, 17),
        // With more than 62 leaves, two crossings of each are too many for a software adapter.
        (BooleanOperation::Union, 12, 62),
    ] {
        let expression = Expression::of_inputs(operation, count);
        compare(&format!("{operation:?} of {count}"), &all()[..2], &expression, &solids[first..first + count], Axis::Y);
    }
    assert_eq!(
        Plan::new(&Expression::of_inputs(BooleanOperation::Union, Diagram::MOST_LEAVES + 1), Mode::Exact).diagram(),
        None
    );
}

/// A torus, a box and a ball on one grid.
fn three_solids() -> (Grid, [ClosedMesh; 3]) {
    let meshes = [
        solids::torus(3.0, 1.0, 64, 32).unwrap(),
        solids::cuboid(glam::DVec3::new(-3.1, -2.0, -1.3), glam::DVec3::new(2.9, 2.0, 1.1)).unwrap(),
        solids::geodesic(3.0, 6).unwrap(),
    ];
    let meshes = meshes.map(|mesh| ClosedMesh::check(mesh).unwrap());
    let bounds = meshes.iter().map(|mesh| mesh.bounds()).reduce(|a, b| a.union(b)).unwrap();
    (Grid::with_resolution(bounds, 40, 256).unwrap(), meshes)
}

#[test]
fn bands_of_any_size_give_equal_results() {
    let (grid, meshes) = three_solids();
    let solids = meshes.each_ref().map(|mesh| grid.quantise(mesh).unwrap());
    let solids = solids.each_ref();
    let expression = Expression::parse("(a - b) ^ c", &["a", "b", "c"]).unwrap();
    let prefill = Some(0xa5a5_a5a5);
    // Of 333, 130 and 17 rays with three leaves, and the last are parts of rows. The geometry of the three takes 80 kB.
    let options = [1000, 390, 51].map(|band_rays| GpuOptions { band_rays, prefill, ..GpuOptions::default() });
    let others = [
        GpuOptions { memory: 200 << 10, prefill, ..GpuOptions::default() },
        GpuOptions { binding: 1 << 12, prefill, ..GpuOptions::default() },
    ];
    let twins: Vec<Twin> = options.into_iter().chain(others).map(Twin::open).collect();
    compare("three solids", &twins, &expression, &solids, Axis::X);
    compare("three solids", plain(), &expression, &solids, Axis::Z);
}

/// Where a device cannot take all leaves at once, the caller combines their images.
#[test]
fn combinations_without_room_are_left_to_the_caller() {
    let (grid, meshes) = three_solids();
    let solids = meshes.each_ref().map(|mesh| grid.quantise(mesh).unwrap());
    let solids = solids.each_ref();
    let plan = Plan::new(&Expression::of_inputs(BooleanOperation::Union, 3), Mode::Exact);
    let leaves = leaves(&plan, &solids);
    let diagram = plan.diagram().unwrap();
    let combination = Combination::new(&leaves, &diagram);
    let small = Twin::open(GpuOptions { memory: 10 << 10, ..GpuOptions::default() }).gpu;
    assert_eq!(small.sample_combination(combination, Axis::X, FillRule::EvenOdd), Ok(None));

    let expected = swept(&plan, &solids, Axis::X, FillRule::EvenOdd);
    let (mut made, mut left) = (0, 0);
    for checks in 0..24 {
        let gpu = GpuSampler::open(&ADAPTER, GpuOptions::default()).unwrap();
        let adapter = gpu.device().adapter().name.clone();
        gpu.device().fail_after(checks, DeviceError::OutOfMemory { adapter, reason: "a test took it all".to_owned() });
        match gpu.sample_combination(combination, Axis::X, FillRule::EvenOdd).transpose() {
            None => {
                for &(solid, mode) in &leaves {
                    let [found, expected]: [&dyn Sampler; 2] = [&gpu, &CpuSampler::default()];
                    let [found, expected] =
                        [found, expected].map(|by| by.sample(solid, Axis::X, mode, FillRule::EvenOdd));
                    assert_eq!(found, expected, "after {checks} checks");
                }
                left += 1;
            }
            Some(found) => {
                assert_eq!(found, expected, "after {checks} checks");
                made += 1;
            }
        }
    }
    assert!(made > 0 && left > 0, "{made} made, {left} left");
}

/// The loops over all leaves of a ray take more rounds than a software adapter is certain to complete long before the list of any
/// leaf is too long.
#[test]
fn rays_of_many_crossings_with_several_leaves_are_right_or_left() {
    let mut plates = soups::Soup::default();
    let frame = soups::Frame { shift: 12, rays: [4, 4, 400] };
    for i in 0..350 {
        plates.add(&soups::cuboid([3000, 3000, 4000 * i + 100], [9000, 9000, 4000 * i + 300]));
    }
    let grid = grid(&frame, 1024);
    let moved = |by: i32| {
        let mut soup = plates.clone();
        soup.positions.iter_mut().for_each(|position| position[2] += by);
        closed(&soup)
    };
    let meshes: [ClosedMesh; 6] = std::array::from_fn(|i| moved(400 * i as i32));
    let solids = meshes.each_ref().map(|mesh| grid.quantise(mesh).unwrap());
    let solids = solids.each_ref();
    let mut left = 0;
    for count in 1..=6 {
        let plan = Plan::new(&Expression::of_inputs(BooleanOperation::Xor, count), Mode::Exact);
        let expected = swept(&plan, &solids, Axis::Z, FillRule::EvenOdd);
        let leaves = leaves(&plan, &solids);
        let diagram = plan.diagram().unwrap();
        let combination = Combination::new(&leaves, &diagram);
        for twin in plain() {
            match twin.gpu.sample_combination(combination, Axis::Z, FillRule::EvenOdd).transpose() {
                None => left += 1,
                Some(found) => assert_eq!(found, expected, "{count} leaves"),
            }
            let sums = twin.gpu.combination_sums_along(combination, &[Axis::Z], FillRule::EvenOdd).unwrap();
            let expected = expected.clone().unwrap().result.volume_sums();
            assert!(sums.is_none_or(|sums| sums[0].result == expected), "{count} leaves");
        }
    }
    assert_eq!(left > 0, is_software(), "{left} left");
}

/// Where only numbers are asked for, nothing of an image leaves the device, and where an image is, the result alone.
#[test]
fn expressions_move_their_result_alone() {
    let ball = |x: f64| {
        let mut mesh = solids::geodesic(1.0, 24).unwrap();
        mesh.positions.iter_mut().for_each(|at| at.x += x);
        ClosedMesh::check(mesh).unwrap()
    };
    let meshes = [0.0, 0.3, 0.6, 0.9, 1.2].map(ball);
    let bounds = meshes.iter().map(|mesh| mesh.bounds()).reduce(|a, b| a.union(b)).unwrap();
    let grid = Grid::with_resolution(bounds, 128, 1024).unwrap();
    let solids: Vec<_> = meshes.iter().map(|mesh| grid.quantise(mesh).unwrap()).collect();
    let solids: Vec<&LatticeSolid> = solids.iter().collect();
    let gpu = GpuSampler::open(&ADAPTER, GpuOptions::default()).unwrap();
    let counted = |plan: &Plan| -> [Counters; 2] {
        let leaves = leaves(plan, &solids);
        let diagram = plan.diagram().unwrap();
        let combination = Combination::new(&leaves, &diagram);
        gpu.device().take_counters();
        gpu.combination_sums_along(combination, &Axis::ALL, FillRule::EvenOdd).unwrap().unwrap();
        let sums = gpu.device().take_counters();
        let image = gpu.sample_combination(combination, Axis::Z, FillRule::EvenOdd).unwrap().unwrap().result;
        let words = image.depths().len() + image.offsets().len();
        let image = gpu.device().take_counters();
        assert!(image.read_back < 4 * words as u64 + 2048, "{words} words: {image:?}");
        [sums, image]
    };
    for (names, text) in [("abcde", "a | b | c | d | e"), ("abcde", "(a - b) ^ (c & d) - e"), ("ab", "a & b")] {
        let names: Vec<&str> = names.split("").filter(|name| !name.is_empty()).collect();
        let plan = Plan::new(&Expression::parse(text, &names).unwrap(), Mode::Exact);
        counted(&plan);
        let [sums, image] = counted(&plan);
        assert!(sums.submissions == 1 && sums.read_back < 2048 && sums.uploaded <= 8, "{text}: {sums:?}");
        assert!(image.submissions == 2 && image.uploaded <= 8, "{text}: {image:?}");
    }
}
