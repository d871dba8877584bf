//! Tests of changes that must not alter a bit of an image: the thread count, the order of triangles, corners and vertices, the
//! height of bands, repetition, a shift of everything by whole pitches, a scale by powers of two, a place far from the origin.

use std::num::NonZeroU32;

use glam::{DVec3, IVec3};
use ldi_ops::grid::{Axis, Grid, LatticeSolid};
use ldi_ops::integrate::{length, moments, volume};
use ldi_ops::ldi::Ldi;
use ldi_ops::mesh::{ClosedMesh, TriangleMesh};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{Estimate, FillRule, MaskIntersection, Mode, Sampler};
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;

use super::images::{FILLS, MODES, assert_close, assert_same, boolean, difference, sample};
use super::material::{models, moved, quantised, random_frame, random_lod, random_soup, renumbered, scaled, shuffled};
use super::on_lattice::{grid, mesh};
use super::soups::{Frame, oriented};
use super::testing::images::{closed, grid_around};
use super::testing::meshes::unwelded;
use super::testing::random::Random;

/// Returns every image that a sampler makes of two solids along one axis, with a name.
fn images(sampler: &CpuSampler, a: &LatticeSolid, b: &LatticeSolid, axis: Axis) -> Vec<(String, Ldi)> {
    let mut images = Vec::new();
    for fill in FILLS {
        for mode in MODES {
            images.push((format!("{mode:?}, {fill:?}"), sampler.sample(a, axis, mode, fill).unwrap()));
        }
        for estimate in [Estimate::Over, Estimate::Under] {
            let image = sampler.sample_intersection([a, b], axis, estimate, fill).unwrap();
            images.push((format!("{estimate:?} of the intersection, {fill:?}"), image));
        }
        let [a, b] = [a, b].map(|solid| sampler.sample_surface(solid, axis, fill).unwrap());
        images.push((format!("surface, {fill:?}"), a.clone()));
        images.push((format!("union, {fill:?}"), boolean(ldi_ops::boolean::BooleanOperation::Union, &a, &b)));
    }
    images
}

fn assert_same_images(what: &str, found: &[(String, Ldi)], expected: &[(String, Ldi)], with_triangles: bool) {
    assert_eq!(found.len(), expected.len());
    for ((name, found), (_, expected)) in found.iter().zip(expected) {
        assert_same(&format!("{what}: {name}"), found, expected);
        assert_eq!(found.offsets(), expected.offsets(), "{what}: {name}");
        if with_triangles {
            assert!(found.triangles() == expected.triangles(), "{what}: {name}: triangles");
        }
    }
}

#[test]
fn threads_bands_and_repetition_change_no_image_of_models() {
    let models = models();
    for (i, (name, a)) in models.iter().enumerate() {
        let (_, b) = &models[(i + 1) % models.len()];
        let grid = grid_around(&[a, b], 61 + i as u32, 300);
        let (a, b) = (quantised(&grid, a), quantised(&grid, b));
        let axis = Axis::ALL[i % 3];
        let expected = images(&CpuSampler::default(), &a, &b, axis);
        for threads in [1, 2, 8] {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let found = pool.install(|| images(&CpuSampler::default(), &a, &b, axis));
            assert_same_images(&format!("{name}, {threads} threads"), &found, &expected, true);
        }
        for rows in [1, 3, 8, 1000] {
            let sampler = CpuSampler::with_band_rows(NonZeroU32::new(rows).unwrap());
            assert_same_images(&format!("{name}, {rows} rows"), &images(&sampler, &a, &b, axis), &expected, true);
        }
        for repetition in 0..3 {
            let again = images(&CpuSampler::default(), &a, &b, axis);
            assert_same_images(&format!("{name}, repetition {repetition}"), &again, &expected, true);
        }
    }
}

#[test]
fn integrals_have_the_same_bits_for_any_number_of_threads() {
    for (name, mesh) in models() {
        let grid = grid_around(&[&mesh], 83, 1024);
        let solid = quantised(&grid, &mesh);
        let all = |threads| {
            ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
                let image = sample(&solid, Axis::X, Mode::Exact, FillRule::NonZero);
                let moments = moments(&image);
                let bits = [moments.centroid.to_array().to_vec(), moments.inertia.to_cols_array().to_vec()].concat();
                (length(&image), volume(&image).to_bits(), bits.into_iter().map(f64::to_bits).collect::<Vec<_>>())
            })
        };
        let one = all(1);
        assert!(one == all(2) && one == all(8), "{name}");
    }
}

/// Returns meshes of the same surface with other orders of triangles, corners and positions, welded and not.
fn arrangements(random: &mut Random, mesh: &TriangleMesh) -> Vec<(&'static str, ClosedMesh)> {
    let both = shuffled(random, mesh);
    let both = renumbered(random, &both);
    let soup = unwelded(&shuffled(random, mesh));
    vec![("shuffled", closed(shuffled(random, mesh))), ("both", closed(both)), ("soup", closed(soup))]
}

#[test]
fn rearranging_random_soups_changes_no_image() {
    oriented().into_par_iter().for_each(|(name, generator)| {
        for seed in 0..40 {
            let mut random = Random::new(60_000 + seed);
            let frame = random_frame(&mut random);
            let grid = grid(&frame, random_lod(&mut random));
            let soup = generator(&mut random, &frame);
            let (a, welded) = (closed(mesh(&soup)), closed(mesh(&soup.welded())));
            let b = closed(mesh(&random_soup(&mut random, &frame)));
            let (axis, b) = (random.choose(&Axis::ALL), quantised(&grid, &b));
            let expected = images(&CpuSampler::default(), &quantised(&grid, &a), &b, axis);
            for (how, other) in arrangements(&mut random, a.mesh()).into_iter().chain([("welded", welded)]) {
                let rows = random.choose(&[1, 3, 8, 1000]);
                let sampler = CpuSampler::with_band_rows(NonZeroU32::new(rows).unwrap());
                let found = images(&sampler, &quantised(&grid, &other), &b, axis);
                let what = format!("{name}, seed {seed}, {how}, {rows} rows");
                assert_same_images(&what, &found, &expected, false);
            }
        }
    });
}

#[test]
fn rearranging_models_changes_no_image() {
    let mut random = Random::new(7);
    for (name, mesh) in models() {
        let grid = grid_around(&[&mesh], 64, 1024);
        let solid = quantised(&grid, &mesh);
        for (how, other) in arrangements(&mut random, mesh.mesh()) {
            assert_eq!(grid_around(&[&other], 64, 1024), grid, "{name}, {how}");
            let other = quantised(&grid, &other);
            for axis in Axis::ALL {
                for mode in MODES {
                    let [a, b] = [&solid, &other].map(|solid| sample(solid, axis, mode, FillRule::NonZero));
                    assert_same(&format!("{name}, {how}, {axis:?}, {mode:?}"), &b, &a);
                }
            }
        }
    }
}

#[test]
fn a_shift_of_mesh_and_grid_changes_no_bit() {
    (0..600u64).into_par_iter().for_each(|seed| {
        let mut random = Random::new(70_000 + seed);
        let frame = random_frame(&mut random);
        let grid = grid(&frame, random_lod(&mut random));
        let mesh = closed(mesh(&random_soup(&mut random, &frame)));
        let pixels = IVec3::from_array(std::array::from_fn(|_| random.between(-1000, 1000)));
        let by = pixels.as_dvec3() * grid.pitch();
        let there = Grid::from_parts(by, grid.pitch(), grid.rays(), grid.shift(), grid.lod()).unwrap();
        let moved = closed(moved(mesh.mesh(), by));
        let (axis, mode, fill) = (random.choose(&Axis::ALL), random.choose(&MODES), random.choose(&FILLS));
        let what = format!("seed {seed}, by {pixels}, {axis:?}, {mode:?}, {fill:?}");
        let found = sample(&quantised(&there, &moved), axis, mode, fill);
        assert_same(&what, &found, &sample(&quantised(&grid, &mesh), axis, mode, fill));
    });
}

/// Returns the image with every ray and depth moved by whole pixels, as an image on a larger grid.
fn shifted(image: &Ldi, to: &Grid, by: [u32; 3]) -> Ldi {
    let axis = image.axis();
    let (columns, rows) = to.image_size(axis);
    let (small_columns, small_rows) = image.size();
    let (mut offsets, mut depths) = (vec![0], Vec::new());
    for row in 0..rows {
        for column in 0..columns {
            let place = (column.wrapping_sub(by[axis.column()]), row.wrapping_sub(by[axis.row()]));
            if place.0 < small_columns && place.1 < small_rows {
                let moved = image.samples(place.1 * small_columns + place.0).iter();
                depths.extend(moved.map(|depth| depth + (by[axis.depth()] << to.shift()) as i32));
            }
            offsets.push(depths.len() as u32);
        }
    }
    Ldi::from_parts(*to, axis, offsets, depths, vec![]).unwrap()
}

#[test]
fn shifting_a_solid_by_whole_pixels_shifts_its_samples() {
    (0..600u64).into_par_iter().for_each(|seed| {
        let mut random = Random::new(80_000 + seed);
        // Voxels that divide a pixel, so that whole pixels are whole voxels in either grid.
        let frame = Frame { shift: random.choose(&[3, 5, 9]), rays: [8; 3] };
        let (small, large) = (grid(&frame, 32), grid(&Frame { rays: [16; 3], ..frame }, 64));
        assert!(Axis::ALL.iter().all(|&axis| small.voxel(axis) == large.voxel(axis)));
        // A crossing at the far end of a grid belongs to the last voxel, elsewhere to one voxel more; so the far end is kept
        // free.
        let mesh = closed(mesh(&random_soup(&mut random, &Frame { rays: [7; 3], ..frame })));
        let by: [u32; 3] = std::array::from_fn(|_| random.below(9) as u32);
        let moved = closed(moved(mesh.mesh(), DVec3::from(by.map(f64::from)) * small.pitch()));
        for axis in Axis::ALL {
            for (mode, fill) in MODES.into_iter().flat_map(|mode| FILLS.map(|fill| (mode, fill))) {
                let expected = shifted(&sample(&quantised(&small, &mesh), axis, mode, fill), &large, by);
                let found = sample(&quantised(&large, &moved), axis, mode, fill);
                assert_same(&format!("seed {seed}, by {by:?}, {axis:?}, {mode:?}, {fill:?}"), &found, &expected);
            }
        }
    });
}

#[test]
fn a_shift_by_half_a_pixel_changes_the_image() {
    let frame = Frame { shift: 5, rays: [8; 3] };
    let grid = grid(&frame, 32);
    let of = |by: f64| {
        let mesh = closed(moved(&mesh(&super::soups::octahedron([120; 3], 60)), DVec3::splat(by)));
        sample(&quantised(&grid, &mesh), Axis::Z, Mode::Exact, FillRule::EvenOdd)
    };
    assert!(difference(&of(16.0), &of(0.0)).is_some());
    assert!(difference(&shifted(&of(0.0), &grid, [0, 0, 1]), &of(0.0)).is_some());
}

#[test]
fn scaling_models_by_powers_of_two_changes_no_bit() {
    for (name, mesh) in models() {
        let expected = grid_around(&[&mesh], 40, 64);
        let expected = Axis::ALL.map(|axis| sample(&quantised(&expected, &mesh), axis, Mode::Exact, FillRule::NonZero));
        (-100..=100i32).into_par_iter().filter(|k| k % 10 == 0 || k.abs() < 4).for_each(|k| {
            let factor = f64::from(k).exp2();
            let scaled = closed(scaled(mesh.mesh(), factor));
            let grid = grid_around(&[&scaled], 40, 64);
            let solid = quantised(&grid, &scaled);
            for (axis, expected) in Axis::ALL.into_iter().zip(&expected) {
                let found = sample(&solid, axis, Mode::Exact, FillRule::NonZero);
                let what = format!("{name} × 2^{k}, {axis:?}");
                assert_same(&what, &found, expected);
                assert_eq!(volume(&found), volume(expected) * factor.powi(3), "{what}");
            }
        });
    }
}

#[test]
fn scaling_random_soups_by_powers_of_two_changes_no_bit() {
    (-100..=100i32).into_par_iter().for_each(|k| {
        let mut random = Random::new(90_000 + k.unsigned_abs() as u64);
        let frame = Frame { shift: 12, rays: [8; 3] };
        let (soup, factor) = (mesh(&random_soup(&mut random, &frame)), f64::from(k).exp2());
        // A soup may be flat or a point, around which no grid can be laid.
        let Ok(grid) = Grid::with_resolution(closed(soup.clone()).bounds(), 24, 1024) else { return };
        let (mesh, scaled) = (closed(soup.clone()), closed(scaled(&soup, factor)));
        let there = Grid::with_resolution(scaled.bounds(), 24, 1024).unwrap();
        for mode in MODES {
            let found = sample(&quantised(&there, &scaled), Axis::Y, mode, FillRule::NonZero);
            let expected = sample(&quantised(&grid, &mesh), Axis::Y, mode, FillRule::NonZero);
            assert_same(&format!("2^{k}, {mode:?}"), &found, &expected);
        }
    });
}

#[test]
fn very_small_and_very_large_solids_keep_their_scaled_volumes() {
    for (name, mesh) in models() {
        let of = |mesh: &ClosedMesh| {
            let grid = grid_around(&[mesh], 64, 1024);
            volume(&sample(&quantised(&grid, mesh), Axis::Z, Mode::Exact, FillRule::NonZero))
        };
        let expected = of(&mesh);
        for factor in [1e-30, 1e-9, 1e9, 1e30] {
            let found = of(&closed(scaled(mesh.mesh(), factor))) / factor / factor / factor;
            // Coordinates are rounded anew, so some crossings move to the next lattice position.
            assert_close(&format!("{name} × {factor:e}"), found, expected, 1e-6);
        }
    }
}

#[test]
fn solids_far_from_the_origin_have_the_same_samples() {
    (0..300u64).into_par_iter().for_each(|seed| {
        let mut random = Random::new(100_000 + seed);
        // Whole numbers below 2^12, and pixels of whole numbers: nothing is rounded at 2^32 or at 2^50.
        let frame = Frame { shift: 9, rays: [8; 3] };
        let near = closed(mesh(&random_soup(&mut random, &frame)));
        let extent = near.bounds().extent().max_element();
        let Ok(grid) = Grid::with_pitch(near.bounds(), (extent / 16.0).ceil(), 256) else { return };
        let signs = DVec3::from(std::array::from_fn(|_| random.choose(&[-1.0, 0.0, 1.0])));
        let size = random.choose(&[20.0f64, 30.0, 38.0]).exp2() * 4096.0;
        let far = closed(moved(near.mesh(), signs * size));
        let there = Grid::with_pitch(far.bounds(), grid.pitch(), 256).unwrap();
        assert_eq!((there.rays(), there.origin()), (grid.rays(), grid.origin() + signs * size));
        let (axis, mode, fill) = (random.choose(&Axis::ALL), random.choose(&MODES), random.choose(&FILLS));
        let found = sample(&quantised(&there, &far), axis, mode, fill);
        let expected = sample(&quantised(&grid, &near), axis, mode, fill);
        assert_same(&format!("seed {seed}, at {}, {axis:?}, {mode:?}, {fill:?}", signs * size), &found, &expected);
    });
}
