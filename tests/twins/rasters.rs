//! Rasters of every shape and size.

use glam::{DAffine3, DVec3};
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::mesh::ClosedMesh;
use ldi_ops::picture::{Camera, Format, View, ViewBox};
use ldi_ops::sampler::{Estimate, FillRule, Mode};
use ldi_ops::solids;

use crate::lattice::lod;
use crate::on_lattice::{closed, grid};
use crate::soups::{self, Frame, Soup};
use crate::testing::random::Random;
use crate::twin::{self, Twin, compare_all, compare_along, compare_image, compare_intersections};

const OVER: Mode = Mode::Estimate(Estimate::Over);

/// Draws a soup that fits into any frame, even one of a single pixel.
fn soup(random: &mut Random, frame: &Frame) -> Soup {
    let mut soup = soups::nested_shells(random, frame);
    soup.add(&soups::tetrahedra(random, frame));
    soup.add(&soups::boxes(random, frame));
    soup.add(&soups::slivers(random, frame));
    soup
}

fn compare_raster(twins: &[Twin], shift: u32, rays: [u32; 3], lod: u32) {
    let mut random = Random::new(u64::from(rays[0] + 7 * rays[1] + 77 * rays[2]));
    let frame = Frame { shift, rays };
    let (a, b) = (closed(&soup(&mut random, &frame)), closed(&soup(&mut random, &frame)));
    let grid = grid(&frame, lod);
    let (a, b) = (grid.quantise(&a).unwrap(), grid.quantise(&b).unwrap());
    compare_all(format_args!("{rays:?}, LOD-C {lod}"), twins, &a);
    compare_intersections(format_args!("{rays:?}, LOD-C {lod}"), twins, &a, &b, random.choose(&Axis::ALL));
}

#[test]
fn rasters_of_one_ray_and_of_one_row_have_equal_images() {
    let mut random = Random::new(3);
    for rays in
        [[1, 1, 1], [2, 1, 1], [1, 2, 1], [1, 1, 2], [1, 64, 1], [65, 1, 1], [1, 1, 63], [1, 300, 1], [1, 5, 300]]
    {
        compare_raster(twin::all(), random.choose(&[2, 5, 12, 20]), rays, lod(&mut random));
    }
    for shift in [2, 20, 28, 29] {
        compare_raster(twin::all(), shift, [1; 3], 1024);
    }
}

/// Pictures of details: the solids begin before the first row and column and end behind the last ones.
#[test]
fn solids_that_extend_beyond_their_grid_have_equal_images() {
    let format = Format { width: 40, height: 30, supersampling: 1 };
    let mut random = Random::new(12);
    let models =
        [solids::cuboid(DVec3::ZERO, DVec3::new(9.0, 8.0, 7.0)), solids::geodesic(5.0, 9), solids::star(5.0, 1.5, 2)];
    for model in models {
        let mut mesh = model.unwrap();
        mesh.transform(&DAffine3::from_mat3(View::Isometric.rotation()));
        let solid = ClosedMesh::check(mesh.clone()).unwrap();
        mesh.triangles.pop();
        let (min, max) = (solid.bounds().min, solid.bounds().max);
        for _ in 0..6 {
            let corner = min + (max - min) * DVec3::new(0.8 * random.share(), 0.8 * random.share(), 0.0);
            let subject = ViewBox { min: corner, max: corner + 0.2 * (max - min) };
            let camera = Camera::aim(format, subject, ViewBox { min, max }).unwrap();
            let seen = camera.see(&camera.raster().quantise(&solid).unwrap());
            assert!((0..2).any(|i| seen.bounds().min[i] < 0));
            compare_along(format_args!("closed at {corner}"), twin::all(), &seen, Axis::Z);
            let open = camera.see(&camera.raster().quantise_open(&mesh).unwrap());
            compare_along(format_args!("open at {corner}"), twin::all(), &open, Axis::Z);
        }
    }
}

/// A workgroup of the prefix sum adds up 2048 counts.
#[test]
fn rasters_near_a_block_of_the_prefix_sum_have_equal_images() {
    for (columns, rows) in [(2047, 1), (2048, 1), (2049, 1), (4097, 1), (83, 79)] {
        compare_raster(twin::all(), 8, [columns, rows, 2], 33);
    }
}

/// The estimate of a first column has the fewest spare digits where an image has 2^16 columns.
#[test]
fn the_widest_rasters_have_equal_images() {
    for (rays, axis) in [([1 << 16, 2, 2], Axis::Z), ([2, 1 << 16, 2], Axis::X), ([2, 1, 1 << 16], Axis::Y)] {
        let mut random = Random::new(4);
        let frame = Frame { shift: 13, rays };
        let mut soup = soups::slivers(&mut random, &frame);
        soup.add(&soups::tetrahedra(&mut random, &frame));
        let mesh = closed(&soup);
        let solid = grid(&frame, 64).quantise(&mesh).unwrap();
        for mode in [Mode::Exact, OVER] {
            compare_image(format_args!("{rays:?}"), twin::plain(), &solid, axis, mode, FillRule::EvenOdd);
        }
    }
}

/// The prefix sum adds up 256 blocks at once; this raster has 300, and most rays are empty.
#[test]
fn more_than_half_a_million_rays_have_equal_images() {
    let frame = Frame { shift: 12, rays: [1024, 600, 4] };
    let mut soup = soups::cuboid([0; 3], [200 << 12, 500 << 12, 2 << 12]);
    // In the last block, which the second round adds up.
    soup.add(&soups::octahedron([1000 << 12, 590 << 12, 2 << 12], 2 << 12));
    soup.add(&soups::tetrahedron([[6, 8, 10], [1023 << 12, 20, 3000], [2000, 599 << 12, 9000], [900, 800, 4 << 12]]));
    let mesh = closed(&soup);
    for lod in [33, 100] {
        let solid = grid(&frame, lod).quantise(&mesh).unwrap();
        compare_image("600 × 1024", twin::plain(), &solid, Axis::Z, OVER, FillRule::EvenOdd);
    }
    let solid = grid(&frame, 64).quantise(&mesh).unwrap();
    compare_image("600 × 1024", twin::plain(), &solid, Axis::Z, Mode::Exact, FillRule::NonZero);
}

/// More rays, and more triangles, than the invocations along the first dimension of a dispatch.
#[test]
fn more_rays_and_triangles_than_a_dispatch_dimension_have_equal_images() {
    const ONE_DIMENSION: u32 = 64 * 32_768;
    let ring = ClosedMesh::check(solids::torus(3.0, 1.0, 1100, 1000).unwrap()).unwrap();
    assert!(ring.mesh().triangles.len() as u32 > ONE_DIMENSION);
    let grid = Grid::with_resolution(ring.bounds(), 1460, 32).unwrap();
    assert!(grid.rays()[0] * grid.rays()[1] > ONE_DIMENSION);
    let solid = grid.quantise(&ring).unwrap();
    compare_image("a ring", twin::plain(), &solid, Axis::Z, OVER, FillRule::EvenOdd);
}
