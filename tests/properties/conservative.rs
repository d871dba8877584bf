//! Tests that under ⊆ exact ⊆ over on every ray, for single solids and for intersections found in masks.

use ldi_ops::grid::{Axis, LatticeSolid};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{Estimate, FillRule, MaskIntersection, Mode};
use proptest::prelude::*;
use rayon::prelude::*;

use super::images::{FILLS, OVER, UNDER, assert_within, escape, intersection, sample};
use super::material::{models, quantised, random_frame, random_lod};
use super::on_lattice::{grid, mesh};
use super::soups::{self, Frame, Soup, oriented};
use super::testing::images::{closed, grid_around};
use super::testing::random::Random;

fn assert_conservative(what: &str, solid: &LatticeSolid, axis: Axis, fill: FillRule) {
    let [under, exact, over] = [UNDER, Mode::Exact, OVER].map(|mode| sample(solid, axis, mode, fill));
    for (name, image) in [("under", &under), ("exact", &exact), ("over", &over)] {
        assert!(image.unclosed().is_empty(), "{what}: a closed solid has unclosed rays in {name}");
    }
    assert_within(&format!("{what}: under, exact"), &under, &exact);
    assert_within(&format!("{what}: exact, over"), &exact, &over);
}

/// Asserts the whole chain: under∩ ⊆ under_A ∩ under_B ⊆ exact ⊆ over_A ∩ over_B ⊆ over∩.
fn assert_conservative_intersection(what: &str, a: &LatticeSolid, b: &LatticeSolid, axis: Axis, fill: FillRule) {
    let merged = |mode| intersection(&sample(a, axis, mode, fill), &sample(b, axis, mode, fill));
    let masked = |estimate| CpuSampler::default().sample_intersection([a, b], axis, estimate, fill).unwrap();
    let chain = [
        ("under by masks", masked(Estimate::Under)),
        ("under by merge", merged(UNDER)),
        ("exact", merged(Mode::Exact)),
        ("over by merge", merged(OVER)),
        ("over by masks", masked(Estimate::Over)),
    ];
    for pair in chain.windows(2) {
        assert_within(&format!("{what}: {}, {}", pair[0].0, pair[1].0), &pair[0].1, &pair[1].1);
    }
}

#[test]
fn estimates_of_random_soups_enclose_the_exact_image() {
    oriented().into_par_iter().for_each(|(name, generator)| {
        for seed in 0..150 {
            let mut random = Random::new(10_000 + seed);
            let frame = random_frame(&mut random);
            let lod = random_lod(&mut random);
            let mesh = closed(mesh(&generator(&mut random, &frame)));
            let grid = grid(&frame, lod);
            let solid = quantised(&grid, &mesh);
            for axis in Axis::ALL {
                for fill in FILLS {
                    let what = format!("{name}, seed {seed}, LOD-C {lod}, {axis:?}, {fill:?}");
                    assert_conservative(&what, &solid, axis, fill);
                }
            }
        }
    });
}

#[test]
fn estimates_of_intersections_of_random_soups_enclose_the_exact_one() {
    oriented().into_par_iter().for_each(|(name, generator)| {
        for seed in 0..150 {
            let mut random = Random::new(20_000 + seed);
            let frame = random_frame(&mut random);
            let lod = random_lod(&mut random);
            let grid = grid(&frame, lod);
            let a = closed(mesh(&generator(&mut random, &frame)));
            let b = closed(mesh(&super::material::random_soup(&mut random, &frame)));
            let (a, b) = (quantised(&grid, &a), quantised(&grid, &b));
            for axis in Axis::ALL {
                for fill in FILLS {
                    let what = format!("{name}, seed {seed}, LOD-C {lod}, {axis:?}, {fill:?}");
                    assert_conservative_intersection(&what, &a, &b, axis, fill);
                }
            }
        }
    });
}

#[test]
fn estimates_of_models_and_their_intersections_enclose_the_exact_ones() {
    let models = models();
    let mut random = Random::new(3);
    for (i, (name, mesh)) in models.iter().enumerate() {
        for (j, (other_name, other)) in models.iter().enumerate().skip(i) {
            let resolution = random.between(40, 100) as u32;
            let lod = random_lod(&mut random);
            let grid = grid_around(&[mesh, other], resolution, lod);
            let (a, b) = (quantised(&grid, mesh), quantised(&grid, other));
            let axis = random.choose(&Axis::ALL);
            for fill in FILLS {
                let what = format!("{name} ∩ {other_name} at {resolution}, LOD-C {lod}, {axis:?}, {fill:?}");
                assert_conservative_intersection(&what, &a, &b, axis, fill);
                if i == j {
                    for axis in Axis::ALL {
                        assert_conservative(&what, &a, axis, fill);
                    }
                }
            }
        }
    }
}

/// Returns tetrahedra in a frame of 4 × 4 × 4 pixels of eight steps: small enough for a failure to shrink to a few corners.
fn tetrahedra() -> impl Strategy<Value = Vec<[[i32; 3]; 4]>> {
    let coordinate = (0..=16i32).prop_map(|half| 2 * half);
    prop::collection::vec(prop::array::uniform4(prop::array::uniform3(coordinate)), 1..5)
}

fn soup_of(tetrahedra: &[[[i32; 3]; 4]], inverted: usize) -> Soup {
    let mut soup = Soup::default();
    for (i, &corners) in tetrahedra.iter().enumerate() {
        let tetrahedron = soups::tetrahedron(corners);
        soup.add(&if inverted >> i & 1 == 1 { tetrahedron.inverted() } else { tetrahedron });
    }
    soup
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(3000) })]
    #[test]
    fn tetrahedra_have_nested_images(first in tetrahedra(), second in tetrahedra(), inverted in 0..16usize, lod in 32..80u32) {
        let frame = Frame { shift: 3, rays: [4; 3] };
        let grid = grid(&frame, lod);
        let (a, b) = (closed(mesh(&soup_of(&first, inverted))), closed(mesh(&soup_of(&second, 0))));
        let (a, b) = (quantised(&grid, &a), quantised(&grid, &b));
        for axis in Axis::ALL {
            for fill in FILLS {
                let of = |solid, mode| sample(solid, axis, mode, fill);
                prop_assert_eq!(escape(&of(&a, UNDER), &of(&a, Mode::Exact)), None);
                prop_assert_eq!(escape(&of(&a, Mode::Exact), &of(&a, OVER)), None);
                let exact = intersection(&of(&a, Mode::Exact), &of(&b, Mode::Exact));
                let masked = |estimate| CpuSampler::default().sample_intersection([&a, &b], axis, estimate, fill).unwrap();
                prop_assert_eq!(escape(&masked(Estimate::Under), &exact), None);
                prop_assert_eq!(escape(&exact, &masked(Estimate::Over)), None);
            }
        }
    }
}
