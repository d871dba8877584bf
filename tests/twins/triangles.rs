//! Triangles of every size and shape, from those that a queue divides among workgroups to those that no ray meets.

use ldi_ops::grid::Axis;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::gpu::GpuOptions;
use ldi_ops::sampler::{Estimate, FillRule, Mode};

use crate::layers::plates;
use crate::on_lattice::{closed, grid};
use crate::soups::{self, Frame, Soup};
use crate::testing::random::Random;
use crate::twin::{self, ROUTES, Twin, compare_all, compare_along, compare_image, compare_intersections};

/// Returns the triangle and its reverse: closed, with nothing inside.
fn pillow(soup: &mut Soup, corners: [[i32; 3]; 3]) {
    let first = soup.positions.len() as u32;
    soup.positions.extend(corners);
    soup.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 1]]);
}

#[test]
fn triangles_over_the_whole_image_have_equal_images() {
    let frame = Frame { shift: 12, rays: [70, 90, 110] };
    let whole = soups::cuboid([0; 3], std::array::from_fn(|axis| frame.most(axis)));
    let inner = soups::octahedron([35 << 12, 45 << 12, 55 << 12], 33 << 12);
    let [whole, inner] = [whole, inner].map(|soup| closed(&soup));
    let grid = grid(&frame, 100);
    let [whole, inner] = [&whole, &inner].map(|mesh| grid.quantise(mesh).unwrap());
    compare_all("the whole frame", twin::all(), &whole);
    compare_all("an octahedron", twin::all(), &inner);
    compare_intersections("the frame and an octahedron", twin::all(), &whole, &inner, Axis::Y);
}

#[test]
fn hundreds_of_large_triangles_have_equal_images() {
    let frame = Frame { shift: 12, rays: [65, 66, 67] };
    for axis in Axis::ALL {
        let mesh = closed(&plates(&frame, axis, 60, 100, 1000, 12));
        let solid = grid(&frame, 1024).quantise(&mesh).unwrap();
        compare_along("60 plates", twin::plain(), &solid, axis);
    }
}

/// Thin triangles from one side of the image to the other give many blocks and few crossings: a binding that is large enough for
/// the crossings, and for the masks of all rays, is too small for the queue.
#[test]
fn a_full_queue_changes_no_image() {
    const BINDING: u64 = 64 << 10;
    let frame = Frame { shift: 12, rays: [100, 101, 102] };
    let mut random = Random::new(8);
    let mut soup = Soup::default();
    for _ in 0..400 {
        // From about one corner of the frame to about the opposite one.
        let mut ends: [[i32; 3]; 2] = [0, 1].map(|end| {
            std::array::from_fn(|axis| {
                let aside = random.even(0, 10 << frame.shift);
                if end == 0 { aside } else { frame.most(axis) - aside }
            })
        });
        let across = random.below(3);
        (ends[0][across], ends[1][across]) = (ends[1][across], ends[0][across]);
        let beside: [[i32; 3]; 2] = [(); 2].map(|()| {
            let width = random.choose(&[2, 100, 1000]);
            std::array::from_fn(|axis| (ends[1][axis] + random.even(-width, width)).clamp(0, frame.most(axis)))
        });
        soup.add(&soups::tetrahedron([ends[0], ends[1], beside[0], beside[1]]));
    }
    let mesh = closed(&soup);
    let solid = grid(&frame, 32).quantise(&mesh).unwrap();
    assert!(12 * soup.positions.len() as u64 <= BINDING, "the geometry is divided");
    for axis in Axis::ALL {
        let crossings = CpuSampler::default().list_stages(&solid, axis).unwrap().crossings.len() as u64;
        assert!(crossings > 1000 && 4 * crossings <= BINDING, "{crossings} crossings");
        let rows = |corners: [[i32; 3]; 3]| {
            let rows = corners.map(|corner| corner[axis.row()] >> frame.shift);
            (rows.iter().max().unwrap() - rows.iter().min().unwrap()) as u64
        };
        // A block has 8 rows, and takes 8 bytes in the queue.
        let blocks: u64 = soup.corners().map(|corners| rows(corners) / 8).sum();
        assert!(8 * blocks > BINDING, "{blocks} blocks");
    }
    let twins = ROUTES.map(|route| Twin::open(GpuOptions { route, binding: BINDING, ..GpuOptions::default() }));
    compare_all("400 thin tetrahedra", &twins, &solid);
}

/// There are more blocks than one dimension of a dispatch has workgroups.
#[test]
fn tens_of_thousands_of_blocks_have_equal_images() {
    let frame = Frame { shift: 16, rays: [9, 8192, 2] };
    let mesh = closed(&plates(&frame, Axis::Z, 12, 100, 1000, 12));
    let solid = grid(&frame, 33).quantise(&mesh).unwrap();
    for mode in [Mode::Exact, Mode::Estimate(Estimate::Over)] {
        compare_image("12 high plates", twin::plain(), &solid, Axis::Z, mode, FillRule::EvenOdd);
    }
}

#[test]
fn long_thin_triangles_have_equal_images() {
    let mut random = Random::new(5);
    for shift in [3, 12, 22] {
        let frame = Frame { shift, rays: [150, 170, 130] };
        let mut soup = Soup::default();
        for _ in 0..40 {
            let ends: [[i32; 3]; 2] = std::array::from_fn(|end| {
                std::array::from_fn(|axis| match random.below(3) {
                    0 => random.even(0, frame.most(axis)),
                    _ => [0, frame.most(axis)][(end + random.below(2)) % 2],
                })
            });
            let beside = std::array::from_fn(|axis| {
                let width = random.choose(&[2, 4, 1 << shift, 4 << shift]);
                (ends[1][axis] + random.even(-width, width)).clamp(0, frame.most(axis))
            });
            let last = std::array::from_fn(|axis| (beside[axis] + random.even(-4, 4)).clamp(0, frame.most(axis)));
            soup.add(&soups::tetrahedron([ends[0], ends[1], beside, last]));
        }
        let mesh = closed(&soup);
        let solid = grid(&frame, 100).quantise(&mesh).unwrap();
        compare_all(format_args!("long triangles, pixels of 2^{shift}"), twin::all(), &solid);
    }
}

#[test]
fn triangles_that_no_ray_meets_have_equal_images() {
    let frame = Frame { shift: 6, rays: [12, 11, 13] };
    let mut random = Random::new(6);
    let mut soup = Soup::default();
    let anywhere = |random: &mut Random| std::array::from_fn(|axis| random.even(0, frame.most(axis)));
    for _ in 0..300 {
        let [a, mut b, mut c]: [[i32; 3]; 3] = [(); 3].map(|()| anywhere(&mut random));
        let axis = random.below(3);
        match random.below(5) {
            // No area: the same corner two or three times, or three corners on a line.
            0 => (b, c) = (a, random.choose(&[a, c])),
            1 => c = std::array::from_fn(|axis| (a[axis] / 4 + b[axis] / 4) * 2),
            // Edge-on for two of the views.
            2 => (b[axis], c[axis]) = (a[axis], a[axis]),
            // On one line of the view along an axis, but not in space.
            3 => {
                b = std::array::from_fn(|i| if i == axis { b[i] } else { a[i] / 4 * 2 });
                c = std::array::from_fn(|i| if i == axis { c[i] } else { (a[i] - b[i]) / 2 * 2 + b[i] });
            }
            // Within a pixel, beside its ray.
            _ => {
                let corner: [i32; 3] = std::array::from_fn(|axis| a[axis] >> 6 << 6);
                let near = |random: &mut Random| corner.map(|position| position + random.even(0, 32));
                (b, c) = (near(&mut random), near(&mut random));
                pillow(&mut soup, [near(&mut random), b, c]);
                continue;
            }
        }
        pillow(&mut soup, [a, b, c]);
    }
    let alone = closed(&soup);
    soup.add(&soups::octahedron([340; 3], 300));
    let with_others = closed(&soup);
    for mesh in [alone, with_others] {
        let solid = grid(&frame, 100).quantise(&mesh).unwrap();
        compare_all("pillows", twin::all(), &solid);
    }
}

#[test]
fn meshes_far_smaller_than_a_pixel_have_equal_images() {
    let frame = Frame { shift: 20, rays: [5; 3] };
    let ray = (2 << 20) + (1 << 19) + 1;
    for from in [ray - 1, ray + 1, 0, ray - 3] {
        let small = soups::cuboid([from; 3], [from + 2; 3]);
        let tetrahedron =
            soups::tetrahedron([[from; 3], [from + 4, from, from], [from, from + 4, from], [from, from, from + 4]]);
        for soup in [small, tetrahedron] {
            let mesh = closed(&soup);
            let solid = grid(&frame, 1024).quantise(&mesh).unwrap();
            compare_all(format_args!("a few steps from {from} on"), twin::all(), &solid);
        }
    }
}
