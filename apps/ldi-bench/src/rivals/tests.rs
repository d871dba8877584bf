//! Rivals on solids of known layers.

use glam::DVec3;
use ldi_ops::boolean::{BooleanOperation, merge};
use ldi_ops::grid::{Grid, LatticeBox};
use ldi_ops::integrate::volume;
use ldi_ops::mesh::{ClosedMesh, TriangleMesh};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{FillRule, Mode, Sampler};
use ldi_ops::solids::cuboid;

use super::bucket::BucketPeeling;
use super::kbuffer::KBuffer;
use super::stencil::RoutedABuffer;
use super::voxels::Voxelisation;
use super::*;
use crate::models;

/// Boxes of 4 × 4 one above the other, between the given depths.
fn boxes(between: impl IntoIterator<Item = (f64, f64)>) -> ClosedMesh {
    let mut all = TriangleMesh::default();
    for (low, high) in between {
        let one = cuboid(DVec3::new(0.0, 0.0, low), DVec3::new(4.0, 4.0, high)).unwrap();
        let first = all.positions.len() as u32;
        all.positions.extend(one.positions);
        all.triangles.extend(one.triangles.iter().map(|triangle| triangle.map(|vertex| first + vertex)));
    }
    ClosedMesh::check(all).unwrap()
}

fn plates(count: u32, thickness: f64) -> ClosedMesh {
    boxes((0..count).map(f64::from).map(|z| (z, z + thickness)))
}

fn ball() -> ClosedMesh {
    models::closed("ball", models::build("geodesic", &[("radius", "2"), ("frequency", "5")]).unwrap()).unwrap()
}

/// Rays along z of solids of 4 × 4, at a pitch of 1.
const RAYS: u64 = 16;

fn exact(solid: &LatticeSolid, axis: Axis) -> Ldi {
    CpuSampler::default().sample(solid, axis, Mode::Exact, FillRule::EvenOdd).unwrap()
}

/// Compares a rival with the exact image along z, at a pitch of 1.
fn compare(rival: &dyn Rival, mesh: &ClosedMesh) -> Comparison {
    let grid = Grid::with_pitch(mesh.bounds(), 1.0, 1024).unwrap();
    let solid = grid.quantise(mesh).unwrap();
    let layers = rival.sample(&solid, Axis::Z);
    Comparison::new(&exact(&solid, Axis::Z), &layers, rival.tolerance(&solid, Axis::Z))
}

#[test]
fn uncapped_rivals_find_the_exact_image() {
    let rivals: [&dyn Rival; 5] =
        [&StencilBuffer::UNCAPPED, &FreePipe::COMPACT, &DepthPeeling, &KBuffer::ALL_PASSES, &RoutedABuffer::ALL_PASSES];
    for (mesh, resolution) in [(plates(300, 0.3), 128), (ball(), 64)] {
        let grid = Grid::with_resolution(mesh.bounds(), resolution, 1024).unwrap();
        let whole = grid.quantise(&mesh).unwrap();
        let LatticeBox { min, max } = *whole.bounds();
        let middle = std::array::from_fn(|i| min[i].midpoint(max[i]));
        let solids = [whole.clone(), whole.within(&LatticeBox { min, max: middle })];
        let cases = rivals.into_iter().flat_map(|rival| Axis::ALL.map(|axis| (rival, axis)));
        for ((rival, axis), solid) in cases.flat_map(|case| solids.each_ref().map(|solid| (case, solid))) {
            let (exact, layers) = (exact(solid, axis), rival.sample(solid, axis));
            assert!(exact.layers() > 0, "{}", rival.name());
            assert_eq!(layers.offsets, exact.offsets(), "{} along {}", rival.name(), axis.name());
            let depths: Vec<i32> = layers.crossings.iter().map(|crossing| crossing.nearest()).collect();
            assert_eq!(depths, exact.depths(), "{} along {}", rival.name(), axis.name());
        }
    }
}

#[test]
fn passes_grow_with_layers_as_each_method_says() {
    let mesh = plates(300, 0.3);
    let passes = |rival: &dyn Rival| compare(rival, &mesh).passes;
    assert_eq!(passes(&StencilBuffer::UNCAPPED), 1 + 600);
    assert_eq!(passes(&StencilBuffer::AS_PUBLISHED), 1 + 255);
    assert_eq!(passes(&DepthPeeling), 600 + 1);
    assert_eq!(passes(&FreePipe::COMPACT), 2);
    assert_eq!(passes(&KBuffer::ALL_PASSES), 600 / 8);
    assert_eq!(passes(&RoutedABuffer::ALL_PASSES), 600 / 8);
}

#[test]
fn capped_rivals_lose_the_layers_past_their_capacity() {
    let mesh = plates(300, 0.3);
    let rivals: [(&dyn Rival, u64); 5] = [
        (&StencilBuffer::AS_PUBLISHED, 255),
        (&FreePipe::FIXED, 32),
        (&KBuffer::ONE_PASS, 8),
        (&RoutedABuffer::ONE_PASS, 8),
        // 600 fragments fill every bucket.
        (&BucketPeeling, 32),
    ];
    for (rival, kept) in rivals {
        let found = compare(rival, &mesh);
        assert_eq!((found.lost, found.extra), (RAYS * (600 - kept), 0), "{}", rival.name());
        assert_eq!((found.unclosed, found.differing), (RAYS * (kept % 2), RAYS), "{}", rival.name());
    }
}

#[test]
fn buckets_lose_only_fragments_that_collide() {
    // The faces lie at multiples of half a unit, and a bucket is 15.5 / 32 units long.
    assert_eq!(compare(&BucketPeeling, &plates(16, 0.5)).lost, 0);
    // A bucket is one unit long; the two plates in the middle each lie within one.
    let plates = boxes([(0.0, 1.5), (2.05, 2.1), (10.1, 10.2), (31.0, 32.0)]);
    assert_eq!(compare(&BucketPeeling, &plates).lost, RAYS * 2);
}

#[test]
fn peeling_by_depth_loses_one_of_two_equal_depths() {
    // Depths 0, 1, 1, 2, 2, 3, 3, 4, 4, 5: the eighth and the ninth are equal.
    let stack = plates(5, 1.0);
    let peeled = compare(&DepthPeeling, &stack);
    assert_eq!((peeled.lost, peeled.extra, peeled.unclosed), (4 * RAYS, 0, 0));
    let in_eights = compare(&KBuffer::ALL_PASSES, &stack);
    assert_eq!((in_eights.lost, in_eights.extra, in_eights.unclosed), (RAYS, 0, RAYS));
    assert_eq!(compare(&RoutedABuffer::ALL_PASSES, &stack).lost, 0);
}

#[test]
fn voxels_round_depths_and_merge_what_one_voxel_holds() {
    let mesh = boxes([(1.25, 1.5), (4.5, 8.25), (10.25, 10.5), (10.75, 12.25), (31.25, 31.5)]);
    let grid = Grid::from_parts(DVec3::ZERO, 1.0, [4, 4, 32], 10, 32).unwrap();
    let solid = grid.quantise(&mesh).unwrap();
    let exact = exact(&solid, Axis::Z);
    for (rival, expected, lost, length) in [
        (Voxelisation::PARITY, &[4, 8, 10, 12][..], 6, 6),
        (Voxelisation::CONSERVATIVE, &[1, 2, 4, 9, 10, 13, 31, 32][..], 2, 10),
    ] {
        let layers = rival.sample(&solid, Axis::Z);
        for ray in 0..RAYS as usize {
            let faces: Vec<i32> = layers.on_ray(ray).iter().map(|crossing| crossing.nearest() >> 10).collect();
            assert_eq!(faces, expected, "{}", rival.name());
        }
        let found = Comparison::new(&exact, &layers, rival.tolerance(&solid, Axis::Z));
        assert_eq!((found.lost, found.extra, found.unclosed), (RAYS * lost, 0, 0), "{}", rival.name());
        assert_eq!(found.length, (RAYS as i64 * length) << 10, "{}", rival.name());
        assert_eq!(found.exact_length, (RAYS as i64 * 6) << 10);
    }
}

#[test]
fn runs_of_voxels_go_on_over_words_and_end_with_the_ray() {
    let mesh = boxes([(4.5, 8.25), (31.5, 32.0)]);
    let grid = Grid::from_parts(DVec3::ZERO, 1.0, [4, 4, 32], 10, 256).unwrap();
    let solid = grid.quantise(&mesh).unwrap();
    for (rival, expected) in
        [(Voxelisation::PARITY, [36, 66, 252, 255]), (Voxelisation::CONSERVATIVE, [36, 67, 252, 256])]
    {
        let layers = rival.sample(&solid, Axis::Z);
        let faces: Vec<i32> = layers.on_ray(0).iter().map(|crossing| crossing.nearest() >> 7).collect();
        assert_eq!(faces, expected, "{}", rival.name());
    }
}

#[test]
fn lost_samples_and_extra_layers_are_told_apart() {
    assert_eq!(matches(&[1, 5, 5, 9], &[1, 5, 8], 0), 2);
    assert_eq!(matches(&[1, 5, 5, 9], &[1, 5, 8], 1), 3);
    assert_eq!(matches(&[], &[3], 9), 0);
}

#[test]
fn contact_volumes_are_those_of_images_until_depths_coincide() {
    let [a, b] = [(0.0, 4.0), (1.0, 3.0)].map(|between| boxes([between]));
    let stack = boxes([(1.0, 2.0), (2.0, 3.0)]);
    let grid = Grid::with_resolution(a.bounds(), 8, 32).unwrap();
    let [a, b, stack] = [&a, &b, &stack].map(|mesh| grid.quantise(mesh).unwrap());
    assert_eq!(contact_volume([&a, &b]), 32.0);
    assert!((contact_volume([&a, &stack]) - 32.0).abs() > 1.0);

    let (ball, mut other) = (ball(), models::build("geodesic", &[("radius", "1.5")]).unwrap());
    other.positions.iter_mut().for_each(|position| position.x += 1.0);
    let other = ClosedMesh::check(other).unwrap();
    let grid = Grid::with_resolution(ball.bounds().union(other.bounds()), 40, 1024).unwrap();
    let solids = [&ball, &other].map(|mesh| grid.quantise(mesh).unwrap());
    let ours = Axis::ALL.map(|axis| {
        let [a, b] = solids.each_ref().map(|solid| exact(solid, axis));
        volume(&merge(BooleanOperation::Intersection, &a, &b).unwrap())
    });
    let ours = ours.iter().sum::<f64>() / 3.0;
    assert!(ours > 1.0);
    assert!((contact_volume(solids.each_ref()) / ours - 1.0).abs() < 1e-12);
}
