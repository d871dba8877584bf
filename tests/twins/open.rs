//! Meshes that are not closed: CPU and GPU list the same rays as unclosed.

use ldi_ops::grid::Axis;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{FillRule, Mode, Sampler};

use crate::lattice::{frame, generators, lod, region};
use crate::on_lattice::{closed, grid, mesh};
use crate::testing::random::Random;
use crate::twin::{self, compare_all, compare_intersections};

#[test]
fn open_soups_have_equal_unclosed_rays() {
    let mut unclosed = 0;
    for (name, generator) in generators() {
        for seed in 0..3 {
            let mut random = Random::new(seed);
            let frame = frame(&mut random);
            let mut soup = generator(&mut random, &frame);
            for _ in 0..=random.below(2) {
                soup.triangles.remove(random.below(soup.triangles.len()));
            }
            let mesh = mesh(&soup);
            let solid = grid(&frame, lod(&mut random)).quantise_open(&mesh).unwrap();
            compare_all(format_args!("{name} less a triangle, seed {seed}"), twin::all(), &solid);
            let image = CpuSampler::default().sample(&solid, Axis::Z, Mode::Exact, FillRule::NonZero);
            unclosed += image.unwrap().unclosed().len();
        }
    }
    assert!(unclosed > 100, "only {unclosed} unclosed rays");
}

#[test]
fn rays_unclosed_in_either_solid_are_unclosed_in_the_intersection() {
    for (name, generator) in generators() {
        for seed in 10..12 {
            let mut random = Random::new(seed);
            let frame = frame(&mut random);
            let grid = grid(&frame, lod(&mut random));
            let [a, b] = [(); 2].map(|()| {
                let mut soup = generator(&mut random, &frame);
                soup.triangles.remove(random.below(soup.triangles.len()));
                mesh(&soup)
            });
            let whole = closed(&generator(&mut random, &frame));
            let [a, b] = [&a, &b].map(|mesh| grid.quantise_open(mesh).unwrap());
            let whole = grid.quantise(&whole).unwrap();
            let restricted = b.clone().within(&region(&mut random, &frame));
            let axis = random.choose(&Axis::ALL);
            for (what, a, b) in [
                ("both open", &a, &b),
                ("the first open", &a, &whole),
                ("the second open", &whole, &a),
                ("within", &a, &restricted),
            ] {
                compare_intersections(format_args!("{name}, seed {seed}, {what}"), twin::all(), a, b, axis);
            }
        }
    }
}
