//! Any number of layers on a ray.

use ldi_ops::gpu::DeviceError;
use ldi_ops::grid::Axis;
use ldi_ops::mesh::TriangleMesh;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{FillRule, Mode, SampleError, Sampler};

use crate::comparison::assert_same;
use crate::on_lattice::{closed, grid};
use crate::soups::{self, Frame, Soup};
use crate::testing::random::Random;
use crate::twin::{self, compare_along, compare_intersections};

/// Returns a stack of plates along `axis`, from `first` on; the last columns have no plates.
pub fn plates(frame: &Frame, axis: Axis, count: i32, thickness: i32, gap: i32, first: i32) -> Soup {
    let mut soup = Soup::default();
    let width = frame.most(axis.column()) - (1 << frame.shift) / 2 * 2;
    for plate in 0..count {
        let (mut from, mut to) = ([0; 3], [0; 3]);
        (to[axis.column()], to[axis.row()]) = (width, frame.most(axis.row()));
        from[axis.depth()] = first + plate * (thickness + gap);
        to[axis.depth()] = from[axis.depth()] + thickness;
        soup.add(&soups::cuboid(from, to));
    }
    soup
}

#[test]
fn a_mesh_without_triangles_gives_equal_images() {
    let empty = TriangleMesh::default();
    let frame = Frame { shift: 4, rays: [3, 4, 5] };
    let grid = grid(&frame, 64);
    let empty = grid.quantise_open(&empty).unwrap();
    let full = closed(&soups::cuboid([0; 3], [48, 64, 80]));
    let full = grid.quantise(&full).unwrap();
    for axis in Axis::ALL {
        compare_along("no triangle", twin::all(), &empty, axis);
        compare_along("everything", twin::all(), &full, axis);
        compare_intersections("nothing of everything", twin::all(), &full, &empty, axis);
        compare_intersections("nothing of nothing", twin::all(), &empty, &empty, axis);
    }
}

#[test]
fn stacks_of_plates_have_equal_images() {
    let mut random = Random::new(1);
    for (case, count) in
        [1, 2, 3, 4, 5, 8, 11, 12, 13, 16, 17, 31, 32, 33, 50, 64, 100, 127, 150].into_iter().enumerate()
    {
        let axis = Axis::ALL[case % 3];
        let frame = Frame { shift: 11, rays: [4, 3, 5] };
        for lod in [33, random.choose(&[100, 1024, 65_536])] {
            let grid = grid(&frame, lod);
            let gap = random.choose(&[0, 2, 2, 4, 20]);
            let thickness = random.choose(&[2, 2, 4, 20]);
            let room = frame.most(axis.depth()) - count * (thickness + gap);
            let stack = closed(&plates(&frame, axis, count, thickness, gap, random.even(0, room)));
            let other = closed(&plates(&frame, axis, count, gap + thickness, thickness, random.even(0, room / 4)));
            let what = format!("{count} plates of {thickness} and gaps of {gap}, LOD-C {lod}");
            let (stack, other) = (grid.quantise(&stack).unwrap(), grid.quantise(&other));
            compare_along(&what, twin::all(), &stack, axis);
            if let Ok(other) = other {
                compare_intersections(&what, twin::all(), &stack, &other, axis);
            }
        }
    }
}

#[test]
fn coincident_plates_have_equal_images() {
    for (case, count) in [2, 3, 7, 40, 150].into_iter().enumerate() {
        let axis = Axis::ALL[case % 3];
        let frame = Frame { shift: 10, rays: [3; 3] };
        let mut random = Random::new(count);
        let mut soup = Soup::default();
        for _ in 0..count {
            // All plates are at one place, or at one of two places that share a face; some are inside out.
            let plate = plates(&frame, axis, 1, 100, 0, random.choose(&[500, 500, 600]));
            soup.add(&if random.chance(3) { plate.inverted() } else { plate });
        }
        let mesh = closed(&soup);
        for lod in [32, 100, 1024] {
            let solid = grid(&frame, lod).quantise(&mesh).unwrap();
            compare_along(format_args!("{count} plates in two places"), twin::all(), &solid, axis);
            compare_intersections(format_args!("{count} plates in two places"), twin::all(), &solid, &solid, axis);
        }
    }
}

/// Rays with too many crossings for one invocation to sort: plates with random ends, in no order.
#[test]
fn thousands_of_crossings_on_a_ray_give_equal_images() {
    let count = if twin::is_software() { 1000 } else { 5000 };
    let frame = Frame { shift: 20, rays: [2, 3, 2] };
    for axis in Axis::ALL {
        let mut random = Random::new(9);
        let mut soup = Soup::default();
        for _ in 0..count {
            let thickness = random.choose(&[2, 1000, 100_000]);
            let first = random.even(0, frame.most(axis.depth()) - thickness);
            soup.add(&plates(&frame, axis, 1, thickness, 0, first));
        }
        let mesh = closed(&soup);
        for lod in [33, 65_536] {
            let solid = grid(&frame, lod).quantise(&mesh).unwrap();
            compare_along(format_args!("{count} plates, LOD-C {lod}"), twin::all(), &solid, axis);
        }
    }
}

/// llvmpipe, the software adapter of Mesa, silently leaves all loops of an invocation after 65 535 rounds together. The sampler
/// therefore refuses such a job on it.
#[test]
fn software_adapters_refuse_more_crossings_than_their_loops_support() {
    let frame = Frame { shift: 20, rays: [2, 3, 2] };
    let mesh = closed(&plates(&frame, Axis::Z, 1100, 2, 4, 0));
    let solid = grid(&frame, 1024).quantise(&mesh).unwrap();
    let expected = CpuSampler::default().sample(&solid, Axis::Z, Mode::Exact, FillRule::EvenOdd);
    for twin in twin::plain() {
        let found = twin.gpu.sample(&solid, Axis::Z, Mode::Exact, FillRule::EvenOdd);
        match twin::is_software() {
            true => assert!(
                matches!(found, Err(SampleError::Device(DeviceError::Inadequate { needed: 2200, .. }))),
                "{:?}",
                found.map(|image| image.layers())
            ),
            false => assert_same(twin.name(), &found, &expected),
        }
    }
}
