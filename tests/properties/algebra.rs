//! Tests of the laws of set algebra, in exact integers.

use ldi_ops::boolean::BooleanOperation;
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::integrate::length;
use ldi_ops::ldi::Ldi;
use rayon::prelude::*;

use super::images::{
    FILLS, MODES, assert_empty, assert_same, assert_same_set, boolean, intersection, less, sample, union,
};
use super::material::{models, quantised, random_frame, random_lod, random_soup};
use super::on_lattice::{grid, mesh};
use super::soups;
use super::testing::images::{closed, grid_around};
use super::testing::random::Random;

/// Returns the image of every point of the grid.
fn everything(grid: &Grid, axis: Axis) -> Ldi {
    let (columns, rows) = grid.image_size(axis);
    let rays = columns * rows;
    let length = grid.length(axis.depth());
    let depths = (0..rays).flat_map(|_| [0, length]).collect();
    Ldi::from_parts(*grid, axis, (0..=rays).map(|ray| 2 * ray).collect(), depths, vec![]).unwrap()
}

fn xor(a: &Ldi, b: &Ldi) -> Ldi {
    boolean(BooleanOperation::Xor, a, b)
}

fn assert_laws(what: &str, a: &Ldi, b: &Ldi, c: &Ldi) {
    let (both, either) = (intersection(a, b), union(a, b));
    assert_eq!(length(a) + length(b), length(&either) + length(&both), "{what}: |A| + |B| = |A ∪ B| + |A ∩ B|");
    assert_eq!(length(&less(a, b)), length(a) - length(&both), "{what}: |A − B| = |A| − |A ∩ B|");
    assert_eq!(length(&xor(a, b)), length(&either) - length(&both), "{what}: |A xor B| = |A ∪ B| − |A ∩ B|");

    assert_empty(&format!("{what}: A − A"), &less(a, a));
    assert_empty(&format!("{what}: A xor A"), &xor(a, a));
    assert_same_set(&format!("{what}: A ∪ A"), &union(a, a), a);
    assert_same_set(&format!("{what}: A ∩ A"), &intersection(a, a), a);

    for operation in [BooleanOperation::Intersection, BooleanOperation::Union, BooleanOperation::Xor] {
        let commutes = format!("{what}: {operation:?} commutes");
        assert_same(&commutes, &boolean(operation, a, b), &boolean(operation, b, a));
        let left = boolean(operation, &boolean(operation, a, b), c);
        let right = boolean(operation, a, &boolean(operation, b, c));
        assert_same(&format!("{what}: {operation:?} associates"), &left, &right);
    }
    assert_same(&format!("{what}: A xor B"), &xor(a, b), &less(&either, &both));
    assert_same(&format!("{what}: A − B, A ∩ B, B − A"), &either, &union(&union(&less(a, b), &both), &less(b, a)));
    assert_same(&format!("{what}: absorption"), &union(a, &both), &union(a, a));

    let all = everything(a.grid(), a.axis());
    let complement = |image: &Ldi| less(&all, image);
    let (not_a, not_b) = (complement(a), complement(b));
    assert_same(&format!("{what}: De Morgan of ∪"), &complement(&either), &intersection(&not_a, &not_b));
    assert_same(&format!("{what}: De Morgan of ∩"), &complement(&both), &union(&not_a, &not_b));
    assert_same(&format!("{what}: A − B = A ∩ ¬B"), &less(a, b), &intersection(a, &not_b));
    assert_same_set(&format!("{what}: ¬¬A"), &complement(&not_a), a);

    let distributed = union(&intersection(a, b), &intersection(a, c));
    assert_same(&format!("{what}: ∩ distributes"), &intersection(a, &union(b, c)), &distributed);
}

#[test]
fn random_soups_obey_the_laws_of_sets() {
    (0..2000u64).into_par_iter().for_each(|seed| {
        let mut random = Random::new(30_000 + seed);
        let frame = random_frame(&mut random);
        let grid = grid(&frame, random_lod(&mut random));
        let meshes: [_; 3] = std::array::from_fn(|_| closed(mesh(&random_soup(&mut random, &frame))));
        let (axis, mode, fill) = (random.choose(&Axis::ALL), random.choose(&MODES), random.choose(&FILLS));
        let [a, b, c] = meshes.each_ref().map(|mesh| sample(&quantised(&grid, mesh), axis, mode, fill));
        assert_laws(&format!("seed {seed}, {axis:?}, {mode:?}, {fill:?}"), &a, &b, &c);
    });
}

#[test]
fn models_obey_the_laws_of_sets() {
    let models = models();
    let meshes: Vec<_> = models.iter().map(|(_, mesh)| mesh).collect();
    let grid = grid_around(&meshes, 90, 1024);
    for mode in MODES {
        let images: Vec<Ldi> = meshes.iter().map(|m| sample(&quantised(&grid, m), Axis::Y, mode, FILLS[1])).collect();
        for i in 0..images.len() {
            let [a, b, c] = [0, 1, 2].map(|k| &images[(i + k) % images.len()]);
            assert_laws(&format!("{} and the next, {mode:?}", models[i].0), a, b, c);
        }
    }
}

/// The image of several shells in one mesh is the union of their images, or by even-odd the symmetric difference.
#[test]
fn shells_in_one_mesh_unite_or_cancel_by_the_fill_rule() {
    (0..1000u64).into_par_iter().for_each(|seed| {
        let mut random = Random::new(40_000 + seed);
        let frame = random_frame(&mut random);
        let grid = grid(&frame, 1024);
        let parts: Vec<_> = (0..2 + random.below(3)).map(|_| soups::tetrahedra(&mut random, &frame)).collect();
        let mut all = soups::Soup::default();
        parts.iter().for_each(|part| all.add(part));
        let (whole, parts) = (closed(mesh(&all)), parts.iter().map(|p| closed(mesh(p))).collect::<Vec<_>>());
        let axis = random.choose(&Axis::ALL);
        for (fill, operation) in FILLS.into_iter().zip([BooleanOperation::Xor, BooleanOperation::Union]) {
            let of = |mesh| sample(&quantised(&grid, mesh), axis, ldi_ops::sampler::Mode::Exact, fill);
            let folded = parts.iter().map(of).reduce(|a, b| boolean(operation, &a, &b)).unwrap();
            assert_same_set(&format!("seed {seed}, {axis:?}, {fill:?}"), &of(&whole), &folded);
        }
    });
}

#[test]
fn different_images_break_a_law() {
    let frame = soups::Frame { shift: 4, rays: [8; 3] };
    let grid = grid(&frame, 64);
    let of = |from, to| {
        let mesh = closed(mesh(&soups::cuboid(from, to)));
        sample(&quantised(&grid, &mesh), Axis::Z, MODES[0], FILLS[0])
    };
    let (a, b) = (of([0; 3], [64; 3]), of([32; 3], [100; 3]));
    assert_laws("boxes", &a, &b, &a);
    assert_ne!(length(&a), length(&b));
    // Different images break the law that compares them.
    let broken = || assert_same("", &less(&a, &b), &intersection(&a, &b));
    assert!(std::panic::catch_unwind(broken).is_err());
}
