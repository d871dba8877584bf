//! Sweeps of rays made by hand, and of random ones compared with the truth at every depth.

use glam::DVec3;

use super::plan::Polarity;
use super::*;
use crate::grid::Grid;
use crate::ldi::image_from_bands;
use crate::testing::random::Congruential;

/// Upper bound of all depths.
const LENGTH: i32 = 32;

/// A sample and its triangle.
type Sample = (i32, u32);

fn grid(rays: usize) -> Grid {
    Grid::from_parts(DVec3::ZERO, 1.0, [rays as u32, 1, 8], 2, 32).unwrap()
}

/// Returns an image of one row of rays.
fn image(rays: &[Vec<Sample>]) -> Ldi {
    let grid = grid(rays.len());
    let image = image_from_bands(
        grid,
        Axis::Z,
        1,
        || (),
        |(), _, image| {
            for samples in rays {
                image.depths().extend(samples.iter().map(|sample| sample.0));
                image.triangles().extend(samples.iter().map(|sample| sample.1));
                image.end_ray();
            }
        },
    );
    image.unwrap()
}

/// Returns an image of one row of rays, without triangles.
fn bare(rays: &[Vec<i32>]) -> Ldi {
    let offsets = rays.iter().scan(0, |end, samples| {
        *end += samples.len() as u32;
        Some(*end)
    });
    let offsets = std::iter::once(0).chain(offsets).collect();
    Ldi::from_parts(grid(rays.len()), Axis::Z, offsets, rays.concat(), vec![]).unwrap()
}

fn operands(images: &[Ldi]) -> Vec<Operand<'_>> {
    images.iter().map(Operand::from).collect()
}

fn swept(text: &str, rays: &[&[i32]]) -> Vec<i32> {
    let names: Vec<String> = (0..rays.len()).map(|i| char::from(b'a' + i as u8).to_string()).collect();
    let plan = Plan::new(&Expression::parse(text, &names).unwrap(), Mode::Exact);
    let images: Vec<Ldi> = rays.iter().map(|ray| bare(&[ray.to_vec()])).collect();
    plan.sweep(&operands(&images)).unwrap().samples(0).to_vec()
}

#[test]
fn touching_intervals_unite_and_have_an_empty_intersection() {
    assert_eq!(swept("a | b", &[&[0, 4], &[4, 8]]), [0, 8]);
    assert_eq!(swept("a & b", &[&[0, 4], &[4, 8]]), [0; 0]);
    assert_eq!(swept("a - b", &[&[0, 4], &[4, 8]]), [0, 4]);
    assert_eq!(swept("a ^ b", &[&[0, 4], &[4, 8]]), [0, 8]);
    assert_eq!(swept("a | b | c", &[&[0, 4], &[8, 9], &[4, 8]]), [0, 9]);
}

#[test]
fn an_operand_may_hold_empty_and_touching_intervals() {
    assert_eq!(swept("a | b", &[&[0, 2, 2, 4, 6, 6], &[]]), [0, 4]);
    assert_eq!(swept("a & b", &[&[0, 2, 2, 4], &[1, 3]]), [1, 3]);
    assert_eq!(swept("a - b", &[&[0, 8], &[2, 4, 4, 4]]), [0, 2, 4, 8]);
    assert_eq!(swept("a - b", &[&[0, 8], &[0, 8]]), [0; 0]);
    assert_eq!(swept("a", &[&[0, 0, 3, 5, 5, 7]]), [3, 7]);
}

#[test]
fn rays_unclosed_in_any_operand_are_unclosed_in_the_result() {
    let grid = grid(3);
    let open = |ray| Ldi::from_parts(grid, Axis::Z, vec![0; 4], vec![], vec![ray]).unwrap();
    let [a, b, c] = [open(0), bare(&[vec![0, 4], vec![0, 4], vec![0, 4]]), open(2)];
    let plan = Plan::new(&Expression::of_inputs(BooleanOperation::Union, 3), Mode::Exact);
    let result = plan.sweep(&operands(&[a, b, c])).unwrap();
    assert_eq!((result.unclosed(), result.depths()), (&[0, 2][..], &[0, 4][..]));
}

#[test]
fn images_of_other_rays_are_refused() {
    let (a, b) = (bare(&[vec![]]), bare(&[vec![], vec![]]));
    assert!(matches!(merge(BooleanOperation::Union, &a, &b), Err(BooleanError::RaysDiffer { .. })));
    let along_x = Ldi::from_parts(grid(1), Axis::X, vec![0; 9], vec![], vec![]).unwrap();
    let refused = merge(BooleanOperation::Union, &a, &along_x);
    assert!(matches!(refused, Err(BooleanError::RaysDiffer { first: Axis::Z, second: Axis::X, .. })));
}

/// Returns the samples of the result of exact images of one ray; the triangles of each input are numbered from 100 more.
fn with_triangles(operation: BooleanOperation, rays: &[&[Sample]]) -> Vec<Sample> {
    let plan = Plan::new(&Expression::of_inputs(operation, rays.len()), Mode::Exact);
    let images: Vec<Ldi> = rays.iter().map(|ray| image(&[ray.to_vec()])).collect();
    let operand = |(i, image)| Operand { image, first_triangle: 100 * i as u32 };
    let result = plan.sweep(&images.iter().enumerate().map(operand).collect::<Vec<_>>()).unwrap();
    result.samples(0).iter().copied().zip(result.triangles().unwrap().iter().copied()).collect()
}

#[test]
fn triangle_numbers_continue_from_operand_to_operand() {
    let (a, b) = (&[(0, 7), (8, 3)][..], &[(4, 5), (12, 6)][..]);
    assert_eq!(with_triangles(BooleanOperation::Union, &[a, b]), [(0, 7), (12, 106)]);
    assert_eq!(with_triangles(BooleanOperation::Intersection, &[a, b]), [(4, 105), (8, 3)]);
    assert_eq!(with_triangles(BooleanOperation::Difference, &[a, b]), [(0, 7), (4, 105)]);
    assert_eq!(with_triangles(BooleanOperation::Xor, &[a, b]), [(0, 7), (4, 105), (8, 3), (12, 106)]);
    assert_eq!(with_triangles(BooleanOperation::Union, &[&[], b]), [(4, 105), (12, 106)]);
}

#[test]
fn samples_at_one_depth_keep_the_least_triangle_of_the_right_direction() {
    // B enters where A leaves: the end of the intersection with C is A's, whatever comes first.
    let (a, b, c) = (&[(0, 9), (4, 9)][..], &[(4, 1), (8, 1)][..], &[(0, 2), (8, 2)][..]);
    assert_eq!(with_triangles(BooleanOperation::Intersection, &[b, c]), [(4, 1), (8, 1)]);
    assert_eq!(with_triangles(BooleanOperation::Difference, &[c, a, b]), []);
    assert_eq!(with_triangles(BooleanOperation::Difference, &[c, a]), [(4, 109), (8, 2)]);
    // A difference ends where A ends and B begins, both of which end it.
    assert_eq!(with_triangles(BooleanOperation::Difference, &[a, b]), [(0, 9), (4, 9)]);
    // A toggles twice at 4 and stays inside, so only B's sample can represent the start there.
    let twice = &[(0, 1), (4, 0), (4, 0), (8, 1)][..];
    assert_eq!(with_triangles(BooleanOperation::Intersection, &[twice, b]), [(4, 101), (8, 1)]);
    // Of three samples of one solid the least triangle.
    let thrice = &[(0, 5), (0, 3), (0, 4), (8, 1)][..];
    assert_eq!(with_triangles(BooleanOperation::Union, &[thrice, b]), [(0, 3), (8, 1)]);
}

#[test]
fn results_have_triangles_only_if_all_operands_have() {
    let plan = Plan::new(&Expression::of_inputs(BooleanOperation::Union, 2), Mode::Exact);
    let (with, without) = (image(&[vec![(0, 1), (4, 2)]]), bare(&[vec![6, 8]]));
    assert_eq!(plan.sweep(&operands(&[with.clone(), without])).unwrap().triangles(), None);
    assert_eq!(plan.sweep(&operands(&[with, bare(&[vec![]])])).unwrap().triangles(), Some(&[1, 2][..]));
}

#[test]
fn triangles_beyond_32_bits_are_refused() {
    let plan = Plan::new(&Expression::of_inputs(BooleanOperation::Union, 2), Mode::Exact);
    let images = [image(&[vec![(0, 1), (4, 2)]]), image(&[vec![(0, 1), (4, 3)]])];
    let from = |first_triangle| {
        let second = Operand { image: &images[1], first_triangle };
        plan.sweep(&[Operand::from(&images[0]), second])
    };
    assert!(from(u32::MAX - 3).is_ok());
    let refused = BooleanError::TooManyTriangles { input: 1, first: u32::MAX - 2, triangle: 3 };
    assert_eq!(from(u32::MAX - 2), Err(refused));
}

#[test]
fn the_state_of_a_point_is_that_of_the_expression() {
    let mut random = Inputs::new(3);
    for inputs in 1..=8 {
        for _ in 0..200 {
            let expression = random.expression(inputs);
            // The last input is used by no expression.
            let mut inside = vec![false; inputs + 1];
            let mut state = State::of(&expression, inputs + 1);
            for _ in 0..20 {
                let input = random.below(inputs + 1);
                inside[input] ^= true;
                state.flip(input);
                assert_eq!(state.holds(), expression.holds(|input| inside[input]), "{expression:?}, {inside:?}");
            }
        }
    }
}

/// Random expressions and rays.
struct Inputs(Congruential);

impl Inputs {
    fn new(seed: u64) -> Inputs {
        Inputs(Congruential::new(seed))
    }

    fn below(&mut self, count: usize) -> usize {
        self.0.below(count)
    }

    fn expression(&mut self, inputs: usize) -> Expression {
        const OPERATIONS: [BooleanOperation; 4] = [
            BooleanOperation::Intersection,
            BooleanOperation::Union,
            BooleanOperation::Difference,
            BooleanOperation::Xor,
        ];
        let mut parts: Vec<Expression> = (0..inputs).map(Expression::input).collect();
        for _ in 0..self.below(4) {
            parts.push(Expression::input(self.below(inputs)));
        }
        while parts.len() > 1 {
            let count = 2 + self.below(2).min(parts.len() - 2);
            let operands: Vec<Expression> = (0..count).map(|_| parts.swap_remove(self.below(parts.len()))).collect();
            parts.push(Expression::combine(OPERATIONS[self.below(4)], operands));
        }
        parts.remove(0)
    }

    /// Returns samples in any order within a depth, with touching and empty intervals; triangles count up.
    fn ray(&mut self) -> Vec<Sample> {
        let mut depths: Vec<i32> = (0..2 * self.below(8)).map(|_| self.below(LENGTH as usize) as i32).collect();
        depths.sort_unstable();
        depths.into_iter().map(|depth| (depth, self.below(20) as u32)).collect()
    }
}

/// Returns whether a depth, and the interval from it to the next, is inside.
fn inside(samples: &[i32], depth: i32) -> bool {
    samples.iter().filter(|&&sample| sample <= depth).count() % 2 == 1
}

/// Returns the maximal spans of a set of depths.
fn spans(holds: impl Fn(i32) -> bool) -> Vec<i32> {
    (0..=LENGTH).filter(|&depth| holds(depth) != (depth > 0 && holds(depth - 1))).collect()
}

#[test]
fn random_expressions_agree_with_pointwise_evaluation() {
    let mut random = Inputs::new(1);
    for round in 0..400 {
        // Some have a table and some do not.
        let inputs = 1 + random.below(16);
        let expression = random.expression(inputs);
        let rays: Vec<Vec<Vec<Sample>>> = (0..inputs).map(|_| (0..20).map(|_| random.ray()).collect()).collect();
        let images: Vec<Ldi> = rays.iter().map(|rays| image(rays)).collect();
        let plan = Plan::new(&expression, Mode::Exact);
        let number = |(input, image)| Operand { image, first_triangle: 20 * input as u32 };
        let surface = plan.sweep(&images.iter().enumerate().map(number).collect::<Vec<_>>()).unwrap();
        let depths_alone: Vec<Ldi> = rays
            .iter()
            .map(|rays| bare(&rays.iter().map(|ray| ray.iter().map(|s| s.0).collect()).collect::<Vec<_>>()))
            .collect();
        let diagram = plan.diagram().unwrap();
        // Exact images without triangles, and the same ones as both estimates.
        let plain = plan.sweep(&operands(&depths_alone)).unwrap();
        for ray in 0..20 {
            let samples: Vec<&[i32]> = images.iter().map(|image| image.samples(ray)).collect();
            let holds = |depth| expression.holds(|input| inside(samples[input], depth));
            let expected = spans(holds);
            let decides = |depth| diagram.holds(|leaf| inside(samples[plan.leaves()[leaf].input], depth));
            assert_eq!(spans(decides), expected, "round {round}: {expression:?} of {samples:?}");
            assert_eq!(plain.samples(ray), expected, "round {round}: {expression:?} of {samples:?}");
            assert_eq!(surface.samples(ray), expected, "round {round}: {expression:?} of {samples:?}");
            let first = surface.offsets()[ray as usize] as usize;
            for (i, &depth) in expected.iter().enumerate() {
                let at = |input: usize| rays[input][ray as usize].iter().filter(move |sample| sample.0 == depth);
                let stands = (0..inputs).find(|&input| {
                    let enters = inside(samples[input], depth);
                    let wanted = match plan.polarities[input] {
                        Polarity::Along => enters == (i % 2 == 0),
                        Polarity::Against => enters != (i % 2 == 0),
                        Polarity::Both => true,
                    };
                    at(input).count() % 2 == 1 && wanted
                });
                let input = stands.expect("some input makes the result turn");
                let least = at(input).map(|sample| sample.1).min().unwrap();
                let found = surface.triangles().unwrap()[first + i];
                assert_eq!(found, 20 * input as u32 + least, "round {round}: {expression:?} of {samples:?}");
            }
        }
    }
}

/// Returns both estimates of an operation from those of its operands, each as (same, opposite).
fn estimate(operation: BooleanOperation, operands: &[(bool, bool)]) -> (bool, bool) {
    let (first, others) = operands.split_first().unwrap();
    others.iter().fold(*first, |(same, opposite), &(other_same, other_opposite)| match operation {
        BooleanOperation::Intersection => (same && other_same, opposite && other_opposite),
        BooleanOperation::Union => (same || other_same, opposite || other_opposite),
        BooleanOperation::Difference => (same && !other_opposite, opposite && !other_same),
        BooleanOperation::Xor => (
            (same && !other_opposite) || (other_same && !opposite),
            (opposite && !other_same) || (other_opposite && !same),
        ),
    })
}

#[test]
fn random_estimates_agree_with_pointwise_bounds_of_their_inputs() {
    let mut random = Inputs::new(2);
    for round in 0..600 {
        let inputs = 1 + random.below(8);
        let expression = random.expression(inputs);
        // At each depth an input is in neither estimate, in the larger or in both.
        let known: Vec<Vec<usize>> = (0..inputs).map(|_| (0..LENGTH).map(|_| random.below(3)).collect()).collect();
        for mode in [Mode::OVER, Mode::UNDER] {
            let plan = Plan::new(&expression, mode);
            let in_input = |input: usize, mode: Mode, depth: i32| {
                depth < LENGTH && known[input][depth as usize] + usize::from(mode == Mode::OVER) >= 2
            };
            let images: Vec<Ldi> = plan
                .leaves()
                .iter()
                .map(|leaf| bare(&[spans(|depth| in_input(leaf.input, leaf.mode, depth))]))
                .collect();
            let found = plan.sweep(&operands(&images)).unwrap();
            let holds = |depth| {
                let both = |input| (in_input(input, mode, depth), in_input(input, mode.opposite(), depth));
                expression.fold(both, estimate).0
            };
            assert_eq!(found.samples(0), spans(holds), "round {round}: {expression:?}");
            let diagram = plan.diagram().unwrap();
            let decides = |depth| {
                diagram.holds(|leaf| {
                    let Leaf { input, mode } = plan.leaves()[leaf];
                    in_input(input, mode, depth)
                })
            };
            assert_eq!(spans(decides), spans(holds), "round {round}: {expression:?}");
        }
    }
}

#[test]
fn diagrams_grow_with_the_expression_and_end_at_their_limits() {
    let diagram = |expression: &Expression, mode| Plan::new(expression, mode).diagram();
    for (operation, mode, nodes) in [
        (BooleanOperation::Union, Mode::Exact, 64),
        (BooleanOperation::Difference, Mode::OVER, 64),
        // Two for each leaf but the first: the number of leaves before it is even or odd.
        (BooleanOperation::Xor, Mode::Exact, 127),
    ] {
        let found = diagram(&Expression::of_inputs(operation, 64), mode).unwrap();
        assert_eq!((found.words().len(), found.leaves()), (1 + 3 * nodes, 64), "{operation:?}");
        assert_eq!(diagram(&Expression::of_inputs(operation, 65), mode), None);
    }
    // Which of the first half are inside matters until the last is known.
    let pairs = |count: usize| {
        let names: Vec<String> = (0..2 * count).map(|i| format!("s{i:02}")).collect();
        let text: Vec<String> = (0..count).map(|i| format!("s{i:02} & s{:02}", i + count)).collect();
        Expression::parse(&text.join(" | "), &names).unwrap()
    };
    assert!(diagram(&pairs(8), Mode::Exact).unwrap().holds(|leaf| leaf == 3 || leaf == 11));
    assert_eq!(diagram(&pairs(32), Mode::Exact), None);
    // Small operands whose combination takes more choices than nodes.
    let names: Vec<String> = (0..54).map(|i| format!("s{i:02}")).collect();
    let union = |from: usize| {
        let pairs: Vec<String> =
            (0..13).map(|i| format!("s{:02} & s{:02}", 2 * i + from, 2 * (i + 13) + from)).collect();
        pairs.join(" | ")
    };
    let text = format!("(({} ) & s52 | s53) & ((({}) - s52) | s53)", union(0), union(1));
    assert_eq!(diagram(&Expression::parse(&text, &names).unwrap(), Mode::Exact), None);
    for mode in [Mode::Exact, Mode::OVER] {
        let deep = format!("{}a{}", "a ^ (b | ".repeat(50_000), ")".repeat(50_000));
        assert!(diagram(&Expression::parse(&deep, &["a", "b"]).unwrap(), mode).unwrap().words().len() < 50);
    }
}
