//! The stages from a mesh to a volume, each separately: `cargo bench --bench sampling [-- FILTER]`.
//!
//! Throughput is in elements, triangles and crossings together, so that models of any size compare. All threads of the machine
//! run; `RAYON_NUM_THREADS=1` gives the cost on one.

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use ldi_ops::boolean::{BooleanOperation, merge};
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::integrate::{self, AxisVolume};
use ldi_ops::ldi::Ldi;
use ldi_ops::mesh::{ClosedMesh, TriangleMesh};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{Estimate, FillRule, MaskIntersection, Mode, Sampler};
use ldi_ops::solids::{Model, cuboid};

#[path = "../src/testing/mod.rs"]
mod testing;

use testing::meshes::{together, unwelded};

const RESOLUTION: u32 = 512;
const LOD: u32 = 1024;

fn closed(mesh: TriangleMesh) -> ClosedMesh {
    ClosedMesh::check(mesh).expect("the library's own solids are closed")
}

fn built(kind: &str, parameters: &[(&str, &str)]) -> TriangleMesh {
    let model = Model::from_parameters(kind, parameters).expect("the parameters exist");
    model.build().expect("the parameters are in range")
}

/// Builds a gyroid of some 870 000 triangles.
fn gyroid() -> TriangleMesh {
    built("gyroid", &[("resolution", "26")])
}

/// Builds a bone of some 33 000 triangles.
fn bone() -> TriangleMesh {
    built("bone", &[])
}

/// Builds many thin plates across z: deep along z, slivers along x and y.
fn plates() -> TriangleMesh {
    let plate = |z: f64| cuboid(DVec3::new(0.0, 0.0, z), DVec3::new(25.6, 25.6, z + 0.3)).expect("a box with extent");
    together(&(0..24).map(|i| plate(f64::from(i))).collect::<Vec<_>>())
}

fn grid_around(meshes: &[&ClosedMesh]) -> Grid {
    let bounds = meshes.iter().map(|mesh| mesh.bounds()).reduce(|a, b| a.union(b)).expect("there is a mesh");
    Grid::with_resolution(bounds, RESOLUTION, LOD).expect("the box has extent")
}

fn exact(sampler: &CpuSampler, mesh: &ClosedMesh, grid: &Grid, axis: Axis) -> Ldi {
    let solid = grid.quantise(mesh).expect("the grid is around the mesh");
    sampler.sample(&solid, axis, Mode::Exact, FillRule::EvenOdd).expect("the image is small")
}

fn sampling(criterion: &mut Criterion) {
    let models = [
        ("gyroid", gyroid()),
        ("bone", bone()),
        ("lattice", built("bcc", &[("cells", "6"), ("cell-size", "5"), ("radius", "0.5"), ("resolution", "20")])),
        ("box", built("cuboid", &[])),
        ("plates", plates()),
        ("brush", built("brush", &[])),
    ];
    let ways = [
        ("exact", Mode::Exact, FillRule::EvenOdd),
        ("over", Mode::Estimate(Estimate::Over), FillRule::EvenOdd),
        ("under", Mode::Estimate(Estimate::Under), FillRule::EvenOdd),
        ("nonzero", Mode::Exact, FillRule::NonZero),
    ];
    let sampler = CpuSampler::default();
    for (model, mesh) in models {
        let mesh = closed(mesh);
        let grid = grid_around(&[&mesh]);
        let solid = grid.quantise(&mesh).expect("the grid is around the mesh");
        let mut group = criterion.benchmark_group(format!("sample/{model}"));
        for axis in Axis::ALL {
            let crossings = exact(&sampler, &mesh, &grid, axis).depths().len();
            group.throughput(Throughput::Elements((mesh.mesh().triangles.len() + crossings) as u64));
            for (way, mode, fill) in ways {
                group.bench_function(BenchmarkId::new(way, axis.name()), |bencher| {
                    bencher.iter_with_large_drop(|| sampler.sample(&solid, axis, mode, fill));
                });
            }
        }
        group.finish();
    }
}

/// Measures the over-estimate of an intersection in one pass of masks, against two images and a merge; then exact.
fn intersection(criterion: &mut Criterion) {
    let (a, b) = (closed(gyroid()), closed(bone()));
    let grid = grid_around(&[&a, &b]);
    let (solid_a, solid_b) = (grid.quantise(&a).expect("inside"), grid.quantise(&b).expect("inside"));
    let sampler = CpuSampler::default();
    let crossings: usize = [&a, &b].map(|mesh| exact(&sampler, mesh, &grid, Axis::Z).depths().len()).iter().sum();
    let triangles = a.mesh().triangles.len() + b.mesh().triangles.len();
    let mut group = criterion.benchmark_group("intersect/gyroid-bone");
    group.throughput(Throughput::Elements((triangles + crossings) as u64));
    group.bench_function("over by masks", |bencher| {
        bencher.iter_with_large_drop(|| {
            sampler.sample_intersection([&solid_a, &solid_b], Axis::Z, Estimate::Over, FillRule::EvenOdd)
        });
    });
    for (name, mode) in [("over by merge", Mode::Estimate(Estimate::Over)), ("exact by merge", Mode::Exact)] {
        group.bench_function(name, |bencher| {
            bencher.iter_with_large_drop(|| {
                let [a, b] = [&solid_a, &solid_b]
                    .map(|solid| sampler.sample(solid, Axis::Z, mode, FillRule::EvenOdd).expect("the image is small"));
                merge(BooleanOperation::Intersection, &a, &b)
            });
        });
    }
    group.finish();
}

/// Measures operations on images; elements are samples.
fn images(criterion: &mut Criterion) {
    let a = closed(gyroid());
    let mut shifted = gyroid();
    shifted.positions.iter_mut().for_each(|position| *position += DVec3::new(1.31, 2.17, 0.73));
    let b = closed(shifted);
    let grid = grid_around(&[&a, &b]);
    let sampler = CpuSampler::default();
    let (image_a, image_b) = (exact(&sampler, &a, &grid, Axis::Z), exact(&sampler, &b, &grid, Axis::Z));
    let mut group = criterion.benchmark_group("image/gyroid");
    group.throughput(Throughput::Elements((image_a.depths().len() + image_b.depths().len()) as u64));
    let operations = [
        ("intersection", BooleanOperation::Intersection),
        ("union", BooleanOperation::Union),
        ("difference", BooleanOperation::Difference),
        ("xor", BooleanOperation::Xor),
    ];
    for (name, operation) in operations {
        group.bench_function(format!("merge {name}"), |bencher| {
            bencher.iter_with_large_drop(|| merge(operation, &image_a, &image_b));
        });
    }
    group.throughput(Throughput::Elements(image_a.depths().len() as u64));
    group.bench_function("volume", |bencher| bencher.iter(|| integrate::volume(black_box(&image_a))));
    group.bench_function("volume and its error", |bencher| bencher.iter(|| AxisVolume::of(black_box(&image_a))));
    group.bench_function("moments", |bencher| bencher.iter(|| integrate::moments(black_box(&image_a))));
    group.finish();
}

/// Measures operations on meshes before sampling; elements are triangles. STL files hold a soup.
fn meshes(criterion: &mut Criterion) {
    let shared = gyroid();
    let soup = unwelded(&shared);
    for (name, mesh) in [("shared", shared), ("soup", soup)] {
        let mut group = criterion.benchmark_group(format!("mesh/gyroid-{name}"));
        group.throughput(Throughput::Elements(mesh.triangles.len() as u64));
        let mut held = Some(mesh);
        group.bench_function("check", |bencher| {
            bencher.iter(|| {
                // The check takes and returns the mesh, so that no copy is timed.
                let mesh = held.take().expect("every round gives the mesh back");
                held = Some(closed(mesh).into_mesh());
            });
        });
        let mesh = closed(held.take().expect("every round gives the mesh back"));
        let grid = grid_around(&[&mesh]);
        group.bench_function("quantise", |bencher| bencher.iter_with_large_drop(|| grid.quantise(&mesh)));
        group.bench_function("signed volume", |bencher| bencher.iter(|| black_box(&mesh).signed_volume()));
        group.finish();
    }
}

criterion_group! {
    name = stages;
    config = Criterion::default().sample_size(10).warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1));
    targets = sampling, intersection, images, meshes
}
criterion_main!(stages);
