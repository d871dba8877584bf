//! Estimates of the intersection of two solids.

use ldi_ops::grid::Axis;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{Estimate, FillRule, MaskIntersection, SampleError};

use crate::lattice::{frame, generators, lod, region};
use crate::on_lattice::{closed, grid};
use crate::soups::{self, Frame};
use crate::testing::random::Random;
use crate::twin::{self, compare_intersections};

#[test]
fn two_soups_have_equal_intersections() {
    let generators = generators();
    for (i, (name_a, a)) in generators.iter().enumerate() {
        for (j, (name_b, b)) in generators.iter().enumerate() {
            let mut random = Random::new((i * generators.len() + j) as u64);
            let frame = frame(&mut random);
            let (a, b) = (closed(&a(&mut random, &frame)), closed(&b(&mut random, &frame)));
            let grid = grid(&frame, lod(&mut random));
            let (mut a, b) = (grid.quantise(&a).unwrap(), grid.quantise(&b).unwrap());
            let what = format!("{name_a} and {name_b}");
            if random.chance(3) {
                a = a.within(&region(&mut random, &frame));
            }
            compare_intersections(what, twin::all(), &a, &b, Axis::ALL[(i + j) % 3]);
        }
    }
}

#[test]
fn a_solid_with_itself_has_equal_intersections() {
    for (name, generator) in generators() {
        let mut random = Random::new(77);
        let frame = frame(&mut random);
        let mesh = closed(&generator(&mut random, &frame));
        let solid = grid(&frame, lod(&mut random)).quantise(&mesh).unwrap();
        for axis in Axis::ALL {
            compare_intersections(name, twin::all(), &solid, &solid, axis);
        }
    }
}

#[test]
fn solids_on_different_grids_give_equal_errors() {
    let mesh = closed(&soups::cuboid([2; 3], [60; 3]));
    let solids = [(4, 64), (4, 65), (5, 64)]
        .map(|(shift, lod)| grid(&Frame { shift, rays: [6; 3] }, lod).quantise(&mesh).unwrap());
    for (i, a) in solids.iter().enumerate() {
        for (j, b) in solids.iter().enumerate() {
            let outcome = CpuSampler::default().sample_intersection([a, b], Axis::Y, Estimate::Over, FillRule::EvenOdd);
            assert_eq!(matches!(outcome, Err(SampleError::GridsDiffer { .. })), i != j);
            compare_intersections(format_args!("grids {i} and {j}"), twin::all(), a, b, Axis::Y);
        }
    }
}

#[test]
fn unoriented_second_solids_give_equal_errors() {
    let frame = Frame { shift: 4, rays: [6; 3] };
    let sound = soups::cuboid([2; 3], [60; 3]);
    let mut turned = sound.clone();
    turned.triangles[0].swap(1, 2);
    let (sound, turned) = (closed(&sound), closed(&turned));
    let (sound, turned) = (grid(&frame, 64).quantise(&sound).unwrap(), grid(&frame, 64).quantise(&turned).unwrap());
    for (a, b) in [(&sound, &turned), (&turned, &sound)] {
        let refused = CpuSampler::default().sample_intersection([a, b], Axis::X, Estimate::Over, FillRule::NonZero);
        assert_eq!(refused, Err(SampleError::NotOriented));
        compare_intersections("one of the two has no orientation", twin::all(), a, b, Axis::X);
    }
}
