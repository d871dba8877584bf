//! Complete images of soups.

use ldi_ops::grid::Axis;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{FillRule, Mode, SampleError, Sampler};

use crate::lattice::{frame, generators, lod, region};
use crate::on_lattice::{closed, grid};
use crate::soups::{self, Frame};
use crate::testing::random::Random;
use crate::twin::{self, compare_all};

#[test]
fn soups_have_equal_images() {
    for (name, generator) in generators() {
        for seed in 0..6 {
            let mut random = Random::new(seed);
            let frame = frame(&mut random);
            let soup = generator(&mut random, &frame);
            let lod = lod(&mut random);
            let mesh = closed(&soup);
            let solid = grid(&frame, lod).quantise(&mesh).unwrap();
            assert_eq!(solid.positions(), soup.positions, "quantising moved a vertex that was on the lattice");
            compare_all(format_args!("{name}, seed {seed}, LOD-C {lod}"), twin::all(), &solid);
        }
    }
}

#[test]
fn soups_over_thirty_bits_have_equal_images() {
    for (name, generator) in generators() {
        for seed in 0..1 {
            let mut random = Random::new(1000 + seed);
            let frame = Frame { shift: 26, rays: [15; 3] };
            let mesh = closed(&generator(&mut random, &frame));
            let solid = grid(&frame, lod(&mut random)).quantise(&mesh).unwrap();
            compare_all(format_args!("{name}, seed {seed}"), twin::all(), &solid);
        }
    }
}

#[test]
fn soups_within_regions_have_equal_images() {
    for (name, generator) in generators() {
        let mut random = Random::new(2000);
        let frame = frame(&mut random);
        let mesh = closed(&generator(&mut random, &frame));
        let solid = grid(&frame, lod(&mut random)).quantise(&mesh).unwrap();
        for _ in 0..2 {
            let region = region(&mut random, &frame);
            compare_all(format_args!("{name} within {region:?}"), twin::all(), &solid.clone().within(&region));
        }
    }
}

#[test]
fn unoriented_meshes_give_equal_errors() {
    let frame = Frame { shift: 4, rays: [6; 3] };
    let mut soup = soups::cuboid([2; 3], [60; 3]);
    soup.triangles[0].swap(1, 2);
    let mesh = closed(&soup);
    let solid = grid(&frame, 64).quantise(&mesh).unwrap();
    let refused = CpuSampler::default().sample(&solid, Axis::X, Mode::Exact, FillRule::NonZero);
    assert_eq!(refused, Err(SampleError::NotOriented));
    compare_all("a box with a triangle turned over", twin::all(), &solid);
}
