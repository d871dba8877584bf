//! Volume sums that the device computes.

use ldi_ops::grid::{Axis, Grid};
use ldi_ops::ldi::VolumeSums;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::gpu::{GpuOptions, Route};
use ldi_ops::sampler::{Estimate, FillRule, MaskIntersection, Mode, Sampler};
use ldi_ops::solids;

use crate::comparison::assert_same;
use crate::lattice::{frame, generators, lod};
use crate::on_lattice::{closed, grid};
use crate::testing::random::Random;
use crate::twin::{ESTIMATES, FILLS, MODES, ROUTES, Twin, all, plain};

/// Compares all volume sums of a solid, and of its intersection with another.
fn compare(what: &str, twins: &[Twin], a: &ldi_ops::grid::LatticeSolid, b: &ldi_ops::grid::LatticeSolid) {
    let cpu = CpuSampler::default();
    for axis in Axis::ALL {
        for fill in FILLS {
            for twin in twins {
                let name = twin.name();
                for mode in MODES {
                    let (found, expected) =
                        (twin.gpu.volume_sums(a, axis, mode, fill), cpu.volume_sums(a, axis, mode, fill));
                    assert_same(format_args!("{what}, {axis:?}, {mode:?}, {fill:?}; {name}"), &found, &expected);
                    let [found, expected]: [&dyn Sampler; 2] = [&twin.gpu, &cpu];
                    let [found, expected] =
                        [found, expected].map(|sampler| sampler.solid_sums_along(a, &[axis], mode, fill));
                    assert_eq!(found, expected, "{what}, {axis:?}, {mode:?}, {fill:?}, moments; {name}");
                }
                for estimate in ESTIMATES {
                    // Two axes, so that the bands of both share workgroups and buffers.
                    let axes = [axis, Axis::ALL[(axis.depth() + 1) % 3]];
                    let of_axis = |sums: Vec<VolumeSums>| sums[0];
                    let found = twin.gpu.intersection_sums_along([a, b], &axes, estimate, fill).map(of_axis);
                    let expected = cpu.intersection_sums_along([a, b], &axes, estimate, fill).map(of_axis);
                    assert_same(
                        format_args!("{what}, {axis:?}, {estimate:?}, {fill:?}, two; {name}"),
                        &found,
                        &expected,
                    );
                }
            }
        }
    }
}

#[test]
fn soups_have_equal_summaries_in_bands_of_any_size() {
    let small =
        [(50, Route::Masks), (23, Route::Lists), (5, Route::Masks), (37, Route::Lists)].map(|(band_rays, route)| {
            let binding = 1 << 20;
            Twin::open(GpuOptions { band_rays, route, binding, prefill: Some(0xa5a5_a5a5), ..GpuOptions::default() })
        });
    for (i, (name, generator)) in generators().into_iter().enumerate() {
        let mut random = Random::new(31 + i as u64);
        let frame = frame(&mut random);
        let (a, b) = (closed(&generator(&mut random, &frame)), closed(&generator(&mut random, &frame)));
        let grid = grid(&frame, lod(&mut random));
        let (a, b) = (grid.quantise(&a).unwrap(), grid.quantise(&b).unwrap());
        compare(name, &small, &a, &b);
        compare(name, &all()[..ROUTES.len()], &a, &b);
    }
}

#[test]
fn solids_have_equal_summaries() {
    // Flat faces along the axes are level, diagonal ones pass through nodes, and round ones do neither.
    let meshes = [
        solids::cuboid(glam::DVec3::new(-3.1, -2.0, -1.3), glam::DVec3::new(2.9, 2.0, 1.1)).unwrap(),
        solids::torus(3.0, 1.0, 64, 32).unwrap(),
        solids::geodesic(3.0, 6).unwrap(),
    ];
    let meshes = meshes.map(|mesh| ldi_ops::mesh::ClosedMesh::check(mesh).unwrap());
    for resolution in [40, 97] {
        let bounds = meshes.iter().map(|mesh| mesh.bounds()).reduce(|a, b| a.union(b)).unwrap();
        let grid = Grid::with_resolution(bounds, resolution, 256).unwrap();
        let solids: Vec<_> = meshes.iter().map(|mesh| grid.quantise(mesh).unwrap()).collect();
        for (i, solid) in solids.iter().enumerate() {
            compare(&format!("solid {i} at {resolution}"), plain(), solid, &solids[(i + 1) % 3]);
        }
    }
}

#[test]
fn device_summaries_equal_those_of_the_image() {
    let mesh = ldi_ops::mesh::ClosedMesh::check(solids::torus(3.0, 1.0, 64, 32).unwrap()).unwrap();
    let grid = Grid::with_resolution(mesh.bounds(), 64, 1024).unwrap();
    let solid = grid.quantise(&mesh).unwrap();
    let mode = Mode::Estimate(Estimate::Over);
    for twin in plain() {
        let image = twin.gpu.sample(&solid, Axis::Z, mode, FillRule::EvenOdd).unwrap();
        let volume_sums = twin.gpu.volume_sums(&solid, Axis::Z, mode, FillRule::EvenOdd).unwrap();
        assert_eq!(volume_sums.length(), ldi_ops::integrate::length(&image));
        assert_eq!(volume_sums, image.volume_sums());
    }
}
