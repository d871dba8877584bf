//! A CSG of five solids, `gyroid & (bone | torus | sphere) - cylinder`, and its parts: `cargo bench --bench csg [-- FILTER]`.
//!
//! *sample* makes the five images, *sweep* the result from them, *chain* the result by Booleans of two operands with
//! intermediate images, and *whole* all of it. Elements are the samples of the five images; a sweep is one pass over them.
//! *read once* only passes over them and adds the depths up. `RAYON_NUM_THREADS=1` gives the cost on one thread.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use ldi_ops::boolean::{BooleanOperation, Expression, Operand, Plan, merge};
use ldi_ops::grid::{Axis, Grid, LatticeSolid};
use ldi_ops::ldi::Ldi;
use ldi_ops::mesh::ClosedMesh;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{Estimate, FillRule, Mode, Sampler};
use ldi_ops::solids::Model;

const RESOLUTION: u32 = 512;
const NAMES: [&str; 5] = ["gyroid", "bone", "torus", "sphere", "cylinder"];
const EXPRESSION: &str = "gyroid & (bone | torus | sphere) - cylinder";

/// Returns the five solids about one centre, the gyroid of some 870 000 triangles.
fn solids() -> Vec<ClosedMesh> {
    let built = |kind: &str, parameters: &[(&str, &str)], size: f64| {
        let model = Model::from_parameters(kind, parameters).expect("the parameters exist");
        let mut mesh = model.build().expect("the parameters are in range");
        let bounds = mesh.bounds().expect("a model has corners");
        let (middle, scale) = (0.5 * (bounds.min + bounds.max), size / bounds.extent().max_element());
        mesh.positions.iter_mut().for_each(|position| *position = (*position - middle) * scale);
        ClosedMesh::check(mesh).expect("the library's own solids are closed")
    };
    vec![
        built("gyroid", &[("resolution", "26")], 40.0),
        built("bone", &[], 60.0),
        built("torus", &[], 38.0),
        built("sphere", &[], 28.0),
        built("cylinder", &[], 30.0),
    ]
}

fn sample(solid: &LatticeSolid, mode: Mode) -> Ldi {
    CpuSampler::default().sample(solid, Axis::Z, mode, FillRule::EvenOdd).expect("the image is small")
}

fn surface(solid: &LatticeSolid) -> Ldi {
    CpuSampler::default().sample_surface(solid, Axis::Z, FillRule::EvenOdd).expect("the image is small")
}

fn sweep(plan: &Plan, images: &[Ldi]) -> Ldi {
    plan.sweep(&images.iter().map(Operand::from).collect::<Vec<_>>()).expect("the images are of one grid")
}

/// Evaluates the CSG by Booleans of two operands.
fn chain(images: &[Ldi]) -> Ldi {
    let two = |operation, a: &Ldi, b: &Ldi| merge(operation, a, b).expect("the images are of one grid");
    let either = two(BooleanOperation::Union, &images[1], &images[2]);
    let any = two(BooleanOperation::Union, &either, &images[3]);
    let common = two(BooleanOperation::Intersection, &images[0], &any);
    two(BooleanOperation::Difference, &common, &images[4])
}

fn five(criterion: &mut Criterion) {
    let meshes = solids();
    let bounds = meshes.iter().map(|mesh| mesh.bounds()).reduce(|a, b| a.union(b)).expect("there are five");
    let grid = Grid::with_resolution(bounds, RESOLUTION, 1024).expect("the box has extent");
    let solids: Vec<LatticeSolid> =
        meshes.iter().map(|mesh| grid.quantise(mesh).expect("the grid is around all")).collect();
    let expression = Expression::parse(EXPRESSION, &NAMES).expect("it is right");
    let (exact, estimate) = (Plan::new(&expression, Mode::Exact), Plan::new(&expression, Mode::OVER));
    let images: Vec<Ldi> = solids.iter().map(|solid| sample(solid, Mode::Exact)).collect();
    let surfaces: Vec<Ldi> = solids.iter().map(surface).collect();
    assert_eq!(sweep(&exact, &images), chain(&images));
    let over = Mode::Estimate(Estimate::Over);
    let estimates = |solids: &[LatticeSolid]| -> Vec<Ldi> {
        let mode = |input| if input == 4 { over.opposite() } else { over };
        solids.iter().enumerate().map(|(input, solid)| sample(solid, mode(input))).collect()
    };

    let mut group = criterion.benchmark_group("csg/five");
    group.throughput(Throughput::Elements(images.iter().map(|image| image.depths().len() as u64).sum()));
    group.bench_function("sample", |bencher| {
        bencher.iter_with_large_drop(|| solids.iter().map(|solid| sample(solid, Mode::Exact)).collect::<Vec<_>>());
    });
    group.bench_function("read once", |bencher| {
        bencher.iter(|| -> i64 {
            let rays = 0..images[0].rays();
            let on_ray = |ray| images.iter().flat_map(move |image: &Ldi| image.samples(ray));
            black_box(rays.map(|ray| on_ray(ray).map(|&depth| i64::from(depth)).sum::<i64>()).sum())
        });
    });
    group.bench_function("sweep", |bencher| bencher.iter_with_large_drop(|| sweep(&exact, &images)));
    group.bench_function("sweep with triangles", |bencher| {
        bencher.iter_with_large_drop(|| sweep(&exact, &surfaces));
    });
    group.bench_function("chain", |bencher| bencher.iter_with_large_drop(|| chain(&images)));
    group.bench_function("whole, exact", |bencher| {
        bencher.iter_with_large_drop(|| {
            sweep(&exact, &solids.iter().map(|solid| sample(solid, Mode::Exact)).collect::<Vec<_>>())
        });
    });
    group.bench_function("whole, over", |bencher| {
        bencher.iter_with_large_drop(|| sweep(&estimate, &estimates(&solids)));
    });
    group.finish();
}

/// Measures the cost of each operation on a number of shifted copies of a gyroid.
fn copies(criterion: &mut Criterion) {
    let model = Model::from_parameters("gyroid", &[("resolution", "16")]).expect("the parameters exist");
    let mesh = model.build().expect("the parameters are in range");
    let shifted = (0..16).map(|i| {
        let mut mesh = mesh.clone();
        let by = f64::from(i) * DVec3::new(0.131, 0.217, 0.373);
        mesh.positions.iter_mut().for_each(|position| *position += by);
        ClosedMesh::check(mesh).expect("the library's own solids are closed")
    });
    let meshes: Vec<ClosedMesh> = shifted.collect();
    let bounds = meshes.iter().map(|mesh| mesh.bounds()).reduce(|a, b| a.union(b)).expect("there are some");
    let grid = Grid::with_resolution(bounds, RESOLUTION, 1024).expect("the box has extent");
    let solids = meshes.iter().map(|mesh| grid.quantise(mesh).expect("the grid is around all"));
    let images: Vec<Ldi> = solids.map(|solid| sample(&solid, Mode::Exact)).collect();
    let mut group = criterion.benchmark_group("csg/xor of gyroids");
    for count in [1, 2, 3, 6, 7, 16] {
        let images = &images[..count];
        let plan = Plan::new(&Expression::of_inputs(BooleanOperation::Xor, count), Mode::Exact);
        group.throughput(Throughput::Elements(images.iter().map(|image| image.depths().len() as u64).sum()));
        group.bench_function(format!("{count}"), |bencher| bencher.iter_with_large_drop(|| sweep(&plan, images)));
    }
    group.finish();
}

criterion_group! {
    name = csg;
    config = Criterion::default().sample_size(10).warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1));
    targets = five, copies
}
criterion_main!(csg);
