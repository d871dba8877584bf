//! Exact volumes of the library against rational arithmetic that shares no code with it.
//!
//! Solids are unions, or overlapping shells, of convex pieces with small integer coordinates, so that coincident faces,
//! shared edges, touching vertices, identical and nested pieces are common. The volume of the common part of any convex pieces is a
//! divergence sum over their clipped faces, in rationals; inclusion–exclusion gives the volume of every cell of the
//! arrangement, and the fill rule and the expression decide which cells count.

mod chains;
mod convex;
mod crossed;
mod known;
mod voxels;

use convex::Piece;
use glam::DVec3;
use ldi_ops::boolean::{BooleanOperation, Expression};
use ldi_ops::exact::Solution;
use ldi_ops::mesh::{ClosedMesh, MassProperties, Precision, TriangleMesh};
use ldi_ops::sampler::FillRule;
use ldi_ops::surface::Coordinates;
use ldi_ops::surface::manifold::ManifoldReport;
use num_rational::BigRational;
use num_traits::{ToPrimitive, Zero};
use proptest::prelude::*;

/// A convex piece of a solid: which one, and whether its faces look inwards.
#[derive(Clone, Debug)]
struct Shell {
    solid: usize,
    piece: Piece,
    is_inverted: bool,
}

fn meshes(shells: &[Shell], solids: usize) -> Vec<ClosedMesh> {
    let of_solid = |solid: usize| {
        let mut mesh = TriangleMesh::default();
        for shell in shells.iter().filter(|shell| shell.solid == solid) {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(shell.piece.corners.iter().map(|c| DVec3::from_array(c.map(|x| x as f64))));
            mesh.triangles.extend(shell.piece.faces.iter().map(|&[a, b, c]| {
                let [b, c] = if shell.is_inverted { [c, b] } else { [b, c] };
                [a, b, c].map(|i| i as u32 + first)
            }));
        }
        // The library counts a copy once. With other corners first it is none, and all faces of equal solids coincide.
        mesh.triangles.iter_mut().for_each(|triangle| triangle.rotate_left(solid % 3));
        ClosedMesh::check(mesh).unwrap()
    };
    (0..solids).map(of_solid).collect()
}

/// Returns the volume of an expression: of every set of pieces, the part that lies in these and in no others.
fn rational_volume(shells: &[Shell], solids: usize, expression: &Expression, fill: FillRule) -> BigRational {
    let sets = 1usize << shells.len();
    let common: Vec<BigRational> = (0..sets)
        .map(|set| {
            let pieces: Vec<&Piece> =
                shells.iter().enumerate().filter(|(i, _)| set >> i & 1 != 0).map(|(_, shell)| &shell.piece).collect();
            if pieces.is_empty() { BigRational::zero() } else { convex::common_volume(&pieces) }
        })
        .collect();
    let mut volume = BigRational::zero();
    for set in 1..sets {
        let mut windings = vec![0; solids];
        for (i, shell) in shells.iter().enumerate().filter(|(i, _)| set >> i & 1 != 0) {
            let _ = i;
            windings[shell.solid] += if shell.is_inverted { -1 } else { 1 };
        }
        let is_inside = expression.holds(|solid| match fill {
            FillRule::EvenOdd => windings[solid] % 2 != 0,
            FillRule::NonZero => windings[solid] != 0,
        });
        if !is_inside {
            continue;
        }
        for larger in (set..sets).filter(|larger| larger & set == set) {
            match (larger ^ set).count_ones() % 2 {
                0 => volume += &common[larger],
                _ => volume -= &common[larger],
            }
        }
    }
    volume
}

fn exact(inputs: &[ClosedMesh], expression: &Expression, fill: FillRule) -> MassProperties {
    let inputs: Vec<&ClosedMesh> = inputs.iter().collect();
    let solution = Solution::of(&inputs, expression, fill).unwrap();
    let properties = solution.properties();
    let mass = properties.mass;
    // Both sides of an exclusive or touch along all curves in which the surfaces meet, and walls between them may stay.
    let is_xor = *expression == Expression::of_inputs(BooleanOperation::Xor, inputs.len());
    let knows_area =
        inputs.len() == 2 && properties.area_error == 0.0 && properties.with_meeting_shells.is_empty() && !is_xor;
    for precision in [Precision::Single, Precision::Double] {
        let found = solution.mesh(Coordinates { precision, ..Coordinates::default() });
        assert_eq!(found.mesh.triangles.len(), found.sources.len());
        if mass.volume <= mass.volume_rounding {
            // What has no volume may leave crumbs of rounding.
            assert!(found.mesh.signed_volume().abs() < 1e-5, "{}", found.mesh.signed_volume());
            continue;
        }
        let report = ManifoldReport::of(&found.mesh, precision);
        assert!(report.passed(), "{expression:?} {fill:?} {precision:?}: {:?}", report.failures());
        // Vertices that rounding lets fall together are moved by steps.
        let tolerance = if precision == Precision::Single { 1e-3 } else { 1e-10 };
        let difference = (found.mesh.signed_volume() - mass.volume).abs();
        assert!(difference < tolerance, "{expression:?} {fill:?} {precision:?}: off by {difference}");
        if knows_area && precision == Precision::Double {
            let (area, expected) = (found.mesh.area(), mass.area);
            assert!((area - expected).abs() <= 1e-9 * expected, "{expression:?} {fill:?}: area {area}, not {expected}");
        }
    }
    mass
}

const OPERATIONS: [BooleanOperation; 4] =
    [BooleanOperation::Intersection, BooleanOperation::Union, BooleanOperation::Difference, BooleanOperation::Xor];

/// Checks all operations on the solids under both fill rules.
fn check(shells: &[Shell], solids: usize) {
    let inputs = meshes(shells, solids);
    let mut expressions = OPERATIONS.map(|operation| Expression::of_inputs(operation, solids)).to_vec();
    if solids == 3 {
        expressions.push(Expression::parse("a & (b | c) - (a ^ c)", &["a", "b", "c"]).unwrap());
    }
    for expression in &expressions {
        for fill in [FillRule::EvenOdd, FillRule::NonZero] {
            let found = exact(&inputs, expression, fill);
            let expected = rational_volume(shells, solids, expression, fill).to_f64().unwrap();
            let difference = (found.volume - expected).abs();
            assert!(
                difference <= found.volume_rounding && found.volume_rounding < 1e-10,
                "{expression:?} {fill:?}: {} instead of {expected}, with a bound of {} for {shells:?}",
                found.volume,
                found.volume_rounding,
            );
        }
    }
}

/// Random convex pieces, often aligned with one another.
fn piece() -> impl Strategy<Value = Piece> {
    let corner = || [0i128..5, 0i128..5, 0i128..5];
    let cuboid = (corner(), [1i128..4, 1i128..4, 1i128..4]).prop_map(|(low, size)| Piece::cuboid(low, size));
    let tetrahedron = [corner(), corner(), corner(), corner()].prop_filter_map("flat", Piece::tetrahedron);
    prop_oneof![cuboid, tetrahedron]
}

fn shells(solids: usize, count: impl Into<proptest::collection::SizeRange>) -> impl Strategy<Value = Vec<Shell>> {
    let shell = (0..solids, piece(), prop::bool::weighted(0.15));
    let shell = shell.prop_map(|(solid, piece, is_inverted)| Shell { solid, piece, is_inverted });
    prop::collection::vec(shell, count)
}

fn cases(count: u32) -> ProptestConfig {
    ProptestConfig { cases: count, max_shrink_iters: 200, ..ProptestConfig::default() }
}

#[test]
fn shells_on_which_a_result_does_not_depend_change_no_area() {
    let shell = |solid, piece, is_inverted| Shell { solid, piece, is_inverted };
    let touching = Piece::tetrahedron([[0, 1, 0], [0, 1, 1], [1, 1, 0], [0, 2, 4]]).unwrap();
    let shells = [
        shell(0, Piece::cuboid([0, 2, 0], [1, 2, 3]), true),
        // The other way out: as part of a whole, behind its faces is nothing, and in front of them less.
        shell(0, Piece::cuboid([0, 0, 0], [2, 1, 2]), false),
        shell(1, touching, true),
        shell(1, Piece::cuboid([0, 2, 0], [3, 1, 1]), false),
    ];
    check(&shells, 2);
}

proptest! {
    #![proptest_config(cases(1500))]

    #[test]
    fn two_convex_solids_have_their_rational_volume(a in piece(), b in piece()) {
        let shell = |solid, piece| Shell { solid, piece, is_inverted: false };
        check(&[shell(0, a), shell(1, b)], 2);
    }
}

/// A piece of which a corner lies among the others, and whose sides are a thousand to thousand million long.
fn large_piece() -> impl Strategy<Value = (Piece, i128)> {
    let sign = || prop_oneof![Just(-1i128), Just(1)];
    let corner = || [0i128..5, 0i128..5, 0i128..5];
    let scale = prop_oneof![Just(1_000i128), Just(1_000_000), Just(1_000_000_000)];
    let cuboid = (corner(), [sign(), sign(), sign()], scale.clone()).prop_map(|(corner, signs, scale)| {
        let low = [0, 1, 2].map(|i| if signs[i] < 0 { corner[i] - scale } else { corner[i] });
        (Piece::cuboid(low, [scale; 3]), scale)
    });
    let side = || [-5i128..6, -5i128..6, -5i128..6];
    let tetrahedron = (corner(), [side(), side(), side()], scale).prop_filter_map("flat", |(corner, sides, scale)| {
        let far = |side: [i128; 3]| [0, 1, 2].map(|i| corner[i] + scale * side[i] / 5);
        let [a, b, c] = sides.map(far);
        Some((Piece::tetrahedron([corner, a, b, c])?, scale))
    });
    prop_oneof![cuboid, tetrahedron]
}

proptest! {
    #![proptest_config(cases(1000))]

    #[test]
    fn beside_a_far_larger_solid_volumes_lose_only_what_its_corners_round(a in piece(), (b, scale) in large_piece()) {
        let shells = [a, b].into_iter().enumerate();
        let shells: Vec<Shell> = shells.map(|(solid, piece)| Shell { solid, piece, is_inverted: false }).collect();
        let inputs = meshes(&shells, 2);
        for operation in [BooleanOperation::Intersection, BooleanOperation::Difference] {
            let expression = Expression::of_inputs(operation, 2);
            let solution = Solution::of(&[&inputs[0], &inputs[1]], &expression, FillRule::NonZero).unwrap();
            let MassProperties { volume, volume_rounding, .. } = solution.properties().mass;
            let expected = rational_volume(&shells, 2, &expression, FillRule::NonZero).to_f64().unwrap();
            assert!(
                (volume - expected).abs() <= volume_rounding && volume_rounding < 1e-12 * scale as f64,
                "{operation:?}: {volume} instead of {expected}, with a bound of {volume_rounding} for {shells:?}",
            );
        }
    }
}

/// The unit of small pieces whose corners mostly lie between the points of a lattice around a far larger one.
const UNIT: i128 = 1_000_003;

/// A cuboid of which a corner lies among those of small pieces, in their unit, and whose sides are 2^44 to 2^49 long.
fn far_larger_cuboid() -> impl Strategy<Value = (Piece, f64)> {
    let corner = [0..5 * UNIT, 0..5 * UNIT, 0..5 * UNIT];
    (corner, [any::<bool>(), any::<bool>(), any::<bool>()], 44u32..50).prop_map(|(corner, is_below, bits)| {
        let side = (1i128 << bits) - 1;
        let low = [0, 1, 2].map(|i| if is_below[i] { corner[i] - side } else { corner[i] });
        // Of 2^40 steps along twice the side, at most.
        (Piece::cuboid(low, [side; 3]), 2f64.powi(bits as i32 + 1 - 39))
    })
}

proptest! {
    #![proptest_config(cases(150))]

    #[test]
    fn corners_between_lattice_points_move_volumes_by_no_more_than_the_bound(
        first in shells(1, 1..3), second in piece(), (larger, step) in far_larger_cuboid(),
    ) {
        let others = [second.scaled(UNIT), larger].into_iter().zip(1..);
        let others = others.map(|(piece, solid)| Shell { solid, piece, is_inverted: false });
        let first = first.into_iter().map(|shell| Shell { piece: shell.piece.scaled(UNIT), ..shell });
        let shells: Vec<Shell> = first.chain(others).collect();
        let inputs = meshes(&shells, 3);
        let inputs: Vec<&ClosedMesh> = inputs.iter().collect();
        for text in ["(a | b) & c", "(a ^ b) - c", "a & b & c", "a & (b | c)", "(a - c) ^ (b & c)"] {
            let expression = Expression::parse(text, &["a", "b", "c"]).unwrap();
            for fill in [FillRule::EvenOdd, FillRule::NonZero] {
                let found = Solution::of(&inputs, &expression, fill).unwrap().properties();
                let MassProperties { volume, volume_rounding: bound, .. } = found.mass;
                let expected = rational_volume(&shells, 3, &expression, fill).to_f64().unwrap();
                let [least, greatest] = found.possible;
                assert!(
                    (volume - expected).abs() <= bound && (least..=greatest).contains(&expected),
                    "{text} {fill:?}: {volume} instead of {expected}, with a bound of {bound}, for {shells:?}"
                );
                // Few faces move, each by less than a step, in a region that the small pieces limit.
                let widest = 5.0 * UNIT as f64 + step;
                assert!(bound <= 200.0 * step * widest * widest && greatest <= 1.01 * widest.powi(3), "{text}: {bound}");
            }
        }
    }
}

proptest! {
    #![proptest_config(cases(400))]

    #[test]
    fn three_convex_solids_have_their_rational_volume(a in piece(), b in piece(), c in piece()) {
        let shell = |solid, piece| Shell { solid, piece, is_inverted: false };
        check(&[shell(0, a), shell(1, b), shell(2, c)], 3);
    }

    #[test]
    fn overlapping_shells_have_their_rational_volume(shells in shells(1, 2..5)) {
        check(&shells, 1);
    }

    #[test]
    fn solids_of_overlapping_shells_have_their_rational_volume(first in piece(), second in piece(), more in shells(2, 1..4)) {
        let mut shells = more;
        for (solid, piece) in [first, second].into_iter().enumerate() {
            shells.push(Shell { solid, piece, is_inverted: false });
        }
        check(&shells, 2);
    }
}
