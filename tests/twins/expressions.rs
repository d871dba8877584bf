//! Expressions that the device evaluates, against the sweep of the CPU's images.

use ldi_ops::boolean::{BooleanOperation, Expression, Plan};
use ldi_ops::gpu::Counters;
use ldi_ops::grid::{Axis, Grid, LatticeSolid};
use ldi_ops::ldi::Ldi;
use ldi_ops::mesh::ClosedMesh;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::gpu::{GpuOptions, GpuSampler};
use ldi_ops::sampler::{Evaluated, FillRule, Mode, SampleError, Sampler};
use ldi_ops::solids;

use crate::any_expression::random_expression;
use crate::comparison::assert_same;
use crate::lattice::{frame, generators, lod, region};
use crate::on_lattice::{closed, grid, mesh};
use crate::soups;
use crate::testing::random::Random;
use crate::twin::{ADAPTER, FILLS, MODES, Twin, all, plain};

/// Compares an expression along an axis, in all modes and under both fill rules: its image, its sums, and what is told of leaves.
/// The sums along two axes are made together.
fn compare(what: &str, twins: &[Twin], expression: &Expression, solids: &[&LatticeSolid], axis: Axis) {
    let cpu = CpuSampler::default();
    let axes = [axis, Axis::ALL[(axis.depth() + 1) % 3]];
    for (mode, fill) in MODES.into_iter().flat_map(|mode| FILLS.map(|fill| (mode, fill))) {
        let plan = Plan::new(expression, mode);
        let expected = cpu.sample_expression(&plan, solids, axis, fill);
        let sums = cpu.expression_sums_along(&plan, solids, &axes, fill);
        // Neither the route nor the arithmetic matters to the evaluation, but every one has to come to it.
        for twin in twins {
            assert!(twin.gpu.evaluates(&plan) && !cpu.evaluates(&plan));
            let what = format!("{what}, {axis:?}, {mode:?}, {fill:?}; {}", twin.name());
            let found = twin.gpu.sample_expression(&plan, solids, axis, fill);
            let windings = |made: &Result<Evaluated<Ldi>, SampleError>| made.clone().map(|made| made.windings);
            assert_eq!(windings(&found), windings(&expected), "{what}");
            assert_same(&what, &found.map(|made| made.result), &expected.clone().map(|made| made.result));
            assert_eq!(twin.gpu.expression_sums_along(&plan, solids, &axes, fill), sums, "{what}");
        }
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
        // As the driver does, and as no expression could ask for.
        let expression = random_expression(&mut random, count);
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
fn open_meshes_and_a_dozen_leaves_have_equal_images() {
    let frame = soups::Frame { shift: 4, rays: [8, 7, 9] };
    let grid = grid(&frame, 100);
    let mut random = Random::new(77);
    let mut torn = soups::cuboid([10, 12, 14], [90, 80, 100]);
    torn.triangles.pop();
    let torn = mesh(&torn);
    let meshes: Vec<ClosedMesh> = (0..11).map(|_| closed(&soups::oriented()[0].1(&mut random, &frame))).collect();
    let mut solids: Vec<LatticeSolid> = meshes.iter().map(|mesh| grid.quantise(mesh).unwrap()).collect();
    solids.push(grid.quantise_open(&torn).unwrap());
    let solids: Vec<&LatticeSolid> = solids.iter().collect();
    for operation in [BooleanOperation::Union, BooleanOperation::Difference] {
        let expression = Expression::of_inputs(operation, 12);
        compare(&format!("{operation:?} of twelve"), &all()[..2], &expression, &solids, Axis::Y);
    }
    // One more than has a table is swept on the host.
    let more: Vec<&LatticeSolid> = solids.iter().chain([&solids[0]]).copied().collect();
    let plan = Plan::new(&Expression::of_inputs(BooleanOperation::Union, 13), Mode::Exact);
    let cpu = CpuSampler::default().sample_expression(&plan, &more, Axis::Z, FillRule::EvenOdd);
    let gpu = &all()[0].gpu;
    assert!(!gpu.evaluates(&plan));
    assert_eq!(gpu.sample_expression(&plan, &more, Axis::Z, FillRule::EvenOdd), cpu);
}

#[test]
fn bands_of_any_size_give_equal_results() {
    let meshes = [
        solids::torus(3.0, 1.0, 64, 32).unwrap(),
        solids::cuboid(glam::DVec3::new(-3.1, -2.0, -1.3), glam::DVec3::new(2.9, 2.0, 1.1)).unwrap(),
        solids::geodesic(3.0, 6).unwrap(),
    ];
    let meshes = meshes.map(|mesh| ClosedMesh::check(mesh).unwrap());
    let bounds = meshes.iter().map(|mesh| mesh.bounds()).reduce(|a, b| a.union(b)).unwrap();
    let grid = Grid::with_resolution(bounds, 40, 256).unwrap();
    let solids: Vec<_> = meshes.iter().map(|mesh| grid.quantise(mesh).unwrap()).collect();
    let solids: Vec<&LatticeSolid> = solids.iter().collect();
    let expression = Expression::parse("(a - b) ^ c", &["a", "b", "c"]).unwrap();
    let twins = [1000, 130, 41]
        .map(|band_rays| Twin::open(GpuOptions { band_rays, prefill: Some(0xa5a5_a5a5), ..GpuOptions::default() }));
    compare("three solids", &twins, &expression, &solids, Axis::X);
    compare("three solids", plain(), &expression, &solids, Axis::Z);
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
        gpu.device().take_counters();
        gpu.expression_sums_along(plan, &solids, &Axis::ALL, FillRule::EvenOdd).unwrap();
        let sums = gpu.device().take_counters();
        let image = gpu.sample_expression(plan, &solids, Axis::Z, FillRule::EvenOdd).unwrap().result;
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
