//! Tests of expressions over any number of images: the laws of sets, chains of two, enclosing estimates, order and threads.

use ldi_ops::boolean::{BooleanOperation, Expression, Leaf, Operand, Plan};
use ldi_ops::grid::{Axis, LatticeSolid};
use ldi_ops::integrate::length;
use ldi_ops::ldi::Ldi;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{FillRule, Mode, Sampler};
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;

use super::any_expression::{OPERATIONS, random_expression};
use super::images::{FILLS, MODES, OVER, UNDER, assert_same, assert_within, boolean, sample};
use super::material::{models, quantised, random_frame, random_lod, random_soup};
use super::on_lattice::{grid, mesh};
use super::soups;
use super::testing::images::{closed, grid_around};
use super::testing::random::Random;

/// Evaluates an expression on exact images of its inputs.
fn swept(expression: &Expression, images: &[Ldi]) -> Ldi {
    let plan = Plan::new(expression, Mode::Exact);
    let operands: Vec<Operand> = plan.leaves().iter().map(|leaf| Operand::from(&images[leaf.input])).collect();
    plan.sweep(&operands).unwrap()
}

/// Applies an operation to images two at a time.
fn chained(operation: BooleanOperation, images: &[Ldi]) -> Ldi {
    images[1..].iter().fold(images[0].clone(), |left, right| boolean(operation, &left, right))
}

fn parsed(text: &str) -> Expression {
    let names: Vec<&str> = ["a", "b", "c", "u"].into_iter().filter(|&name| text.contains(name)).collect();
    Expression::parse(text, &names).unwrap()
}

#[test]
fn expressions_of_random_soups_obey_the_laws_of_sets() {
    (0..600u64).into_par_iter().for_each(|seed| {
        let mut random = Random::new(110_000 + seed);
        let frame = random_frame(&mut random);
        let grid = grid(&frame, random_lod(&mut random));
        let box_of_all = closed(mesh(&soups::cuboid([0; 3], [0, 1, 2].map(|i| grid.length(i)))));
        let meshes: [_; 3] = std::array::from_fn(|_| closed(mesh(&random_soup(&mut random, &frame))));
        let (axis, fill) = (random.choose(&Axis::ALL), random.choose(&FILLS));
        let of = |mesh| sample(&quantised(&grid, mesh), axis, Mode::Exact, fill);
        let images: Vec<Ldi> = meshes.iter().chain([&box_of_all]).map(of).collect();
        let made = |text: &str| swept(&parsed(text), &images);
        let what = |law: &str| format!("seed {seed}, {axis:?}, {fill:?}: {law}");
        // u is the box of everything, so that names are in the order of the images where all occur.
        let pairs = [
            ("u - (a | b | c)", "(u - a) & (u - b) & (u - c)"),
            ("u - (a & b & c)", "(u - a) | (u - b) | (u - c)"),
            ("u - (a - (b ^ c))", "(u - a) | (b ^ c)"),
            ("(a | b) & c | u & a", "a & c | b & c | a & u"),
            ("a ^ b ^ c ^ u", "u - (a ^ b ^ c)"),
        ];
        for (left, right) in pairs {
            assert_same(&what(left), &made(left), &made(right));
        }
        let [a, b] = [&images[0], &images[1]];
        let both = length(&made("a & b")) + length(&made("a | b"));
        assert_eq!(length(&made("a")) + length(&swept(&parsed("a"), &images[1..])), both, "{}", what("volumes"));
        assert_eq!(length(a) + length(b), both, "{}", what("volumes"));
        for operation in OPERATIONS {
            let all = swept(&Expression::of_inputs(operation, 4), &images);
            assert_same(&what("chains of two"), &all, &chained(operation, &images));
        }
    });
}

/// Evaluates the estimate of an expression from the images that it needs.
fn estimate(expression: &Expression, solids: &[LatticeSolid], axis: Axis, mode: Mode, fill: FillRule) -> Ldi {
    let plan = Plan::new(expression, mode);
    let image = |&Leaf { input, mode }: &Leaf| sample(&solids[input], axis, mode, fill);
    let images: Vec<Ldi> = plan.leaves().iter().map(image).collect();
    plan.sweep(&images.iter().map(Operand::from).collect::<Vec<_>>()).unwrap()
}

#[test]
fn estimates_of_random_expressions_enclose_the_exact_result() {
    (0..800u64).into_par_iter().for_each(|seed| {
        let mut random = Random::new(120_000 + seed);
        let frame = random_frame(&mut random);
        let grid = grid(&frame, random_lod(&mut random));
        let inputs = 2 + random.below(6);
        let meshes: Vec<_> = (0..inputs).map(|_| closed(mesh(&random_soup(&mut random, &frame)))).collect();
        let solids: Vec<LatticeSolid> = meshes.iter().map(|mesh| quantised(&grid, mesh)).collect();
        let expression = random_expression(&mut random, inputs);
        let (axis, fill) = (random.choose(&Axis::ALL), random.choose(&FILLS));
        let images: Vec<Ldi> = solids.iter().map(|solid| sample(solid, axis, Mode::Exact, fill)).collect();
        let exact = swept(&expression, &images);
        let [under, over] = [UNDER, OVER].map(|mode| estimate(&expression, &solids, axis, mode, fill));
        let what = format!("seed {seed}, {axis:?}, {fill:?}, {expression:?}");
        assert_within(&format!("{what}: under, exact"), &under, &exact);
        assert_within(&format!("{what}: exact, over"), &exact, &over);
    });
}

#[test]
fn restricting_solids_to_their_regions_changes_no_result() {
    (0..600u64).into_par_iter().for_each(|seed| {
        let mut random = Random::new(130_000 + seed);
        let frame = random_frame(&mut random);
        let grid = grid(&frame, random_lod(&mut random));
        let inputs = 2 + random.below(5);
        let meshes: Vec<_> = (0..inputs).map(|_| closed(mesh(&random_soup(&mut random, &frame)))).collect();
        let solids: Vec<LatticeSolid> = meshes.iter().map(|mesh| quantised(&grid, mesh)).collect();
        let expression = random_expression(&mut random, inputs);
        let regions = expression.regions(&solids.iter().map(|solid| *solid.bounds()).collect::<Vec<_>>());
        let restricted: Vec<LatticeSolid> = solids.iter().cloned().zip(&regions).map(|(s, r)| s.within(r)).collect();
        let (axis, fill) = (random.choose(&Axis::ALL), random.choose(&FILLS));
        for mode in MODES {
            let made = |solids: &[LatticeSolid]| match mode {
                Mode::Exact => {
                    let images: Vec<Ldi> = solids.iter().map(|solid| sample(solid, axis, mode, fill)).collect();
                    swept(&expression, &images)
                }
                Mode::Estimate(_) => estimate(&expression, solids, axis, mode, fill),
            };
            let what = format!("seed {seed}, {axis:?}, {mode:?}, {fill:?}, {expression:?}");
            assert_same(&what, &made(&restricted), &made(&solids));
        }
    });
}

#[test]
fn thread_count_changes_no_bit_and_input_order_no_depth() {
    let models = models();
    let meshes: Vec<_> = models.iter().map(|(_, mesh)| mesh).collect();
    let grid = grid_around(&meshes, 70, 1024);
    let images: Vec<Ldi> = meshes
        .iter()
        .map(|mesh| CpuSampler::default().sample_surface(&quantised(&grid, mesh), Axis::X, FillRule::NonZero).unwrap())
        .collect();
    let mut random = Random::new(140_000);
    for round in 0..30 {
        let expression = random_expression(&mut random, images.len());
        let plan = Plan::new(&expression, Mode::Exact);
        let operands: Vec<Operand> = images.iter().map(Operand::from).collect();
        let made = |threads| {
            ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| plan.sweep(&operands).unwrap())
        };
        let one = made(1);
        assert_eq!(one.triangles().map(<[u32]>::len), Some(one.depths().len()));
        assert!(one == made(2) && one == made(8), "round {round}: {expression:?}");
    }
    for operation in [BooleanOperation::Intersection, BooleanOperation::Union, BooleanOperation::Xor] {
        let forward = swept(&Expression::of_inputs(operation, images.len()), &images);
        let reversed: Vec<Ldi> = images.iter().rev().cloned().collect();
        let backward = swept(&Expression::of_inputs(operation, images.len()), &reversed);
        assert_same(&format!("{operation:?} in reverse"), &backward, &forward);
        assert_same(&format!("{operation:?} two at a time"), &forward, &chained(operation, &images));
    }
}
