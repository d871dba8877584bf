//! Chains of operations, each on the rounded result of the one before: tools that share faces leave no walls, and what lies on one
//! another within rounding does not grow.

use glam::{DAffine3, DQuat, DVec2, DVec3, EulerRot};
use ldi_ops::boolean::{BooleanOperation, Expression};
use ldi_ops::exact::Solution;
use ldi_ops::mesh::{ClosedMesh, Precision, TriangleMesh, convex_hull};
use ldi_ops::sampler::FillRule;
use ldi_ops::solids::{cuboid, cylinder, ell};
use ldi_ops::surface::Coordinates;
use ldi_ops::surface::manifold::ManifoldReport;

fn closed(mesh: TriangleMesh) -> ClosedMesh {
    ClosedMesh::check(mesh).unwrap()
}

/// Returns the mesh of an expression of two solids, rounded to a precision.
fn result(operation: BooleanOperation, operands: [&ClosedMesh; 2], precision: Precision) -> TriangleMesh {
    let solution = Solution::of(&operands, &Expression::of_inputs(operation, 2), FillRule::NonZero).unwrap();
    let mesh = solution.mesh(Coordinates { precision, offset: DVec3::ZERO }).mesh;
    let report = ManifoldReport::of(&mesh, precision);
    assert!(report.passed(), "{:?}", report.failures());
    mesh
}

/// Returns the way of a drill between two places, down to a height: a prism around both.
fn swept(ends: [DVec2; 2], height: f64) -> ClosedMesh {
    const RADIUS: f64 = 0.1;
    let around = (0..24).map(|i| DVec2::from_angle(f64::from(i) * std::f64::consts::TAU / 24.0 + 0.01));
    let points: Vec<DVec3> = ends
        .iter()
        .flat_map(|end| around.clone().map(move |direction| *end + RADIUS * direction))
        .flat_map(|point| [height, 0.55].map(|height| DVec3::new(point.x, height, point.y)))
        .collect();
    closed(convex_hull(&points).unwrap())
}

/// Drills a block along some ways, one after another, and compares what is left with what all of them leave at once.
fn drill(ways: &[ClosedMesh], precision: Precision) {
    let block = closed(cuboid(DVec3::splat(-0.5), DVec3::splat(0.5)).unwrap());
    let all: Vec<&ClosedMesh> = std::iter::once(&block).chain(ways).collect();
    let at_once = Expression::of_inputs(BooleanOperation::Difference, all.len());
    let at_once = Solution::of(&all, &at_once, FillRule::NonZero).unwrap();
    let expected = at_once.properties().mass;
    let mut left = block.clone();
    for (step, way) in ways.iter().enumerate() {
        left = closed(result(BooleanOperation::Difference, [&left, way], precision));
        let alone = Solution::of(&[&left], &Expression::input(0), FillRule::NonZero).unwrap();
        assert!(alone.properties().with_meeting_shells.is_empty(), "{precision:?}: crosses itself from step {step} on");
    }
    let rounding = if precision == Precision::Single { 1e-6 } else { 1e-11 };
    let found = left.mass_properties();
    let (volume, area) = (found.volume - expected.volume, found.area - expected.area);
    assert!(volume.abs() < rounding && area.abs() < 10.0 * rounding, "{precision:?}: off by {volume} and {area}");
    let triangles = at_once.mesh(Coordinates { precision, offset: DVec3::ZERO }).mesh.triangles.len();
    assert!(left.mesh().triangles.len() <= 3 * triangles, "{} {triangles}", left.mesh().triangles.len());
}

#[test]
fn a_drill_that_follows_a_path_leaves_what_all_its_ways_leave_at_once() {
    let place = |step: u32| {
        let t = f64::from(step);
        0.3 * DVec2::new((0.31 * t).cos(), (0.31 * t).sin()) + 0.05 * DVec2::new((1.7 * t).sin(), (2.3 * t).cos())
    };
    let ways: Vec<ClosedMesh> = (0..28).map(|step| swept([place(step), place(step + 1)], 0.35)).collect();
    drill(&ways, Precision::Double);
    drill(&ways, Precision::Single);
}

#[test]
fn a_drill_that_goes_deeper_turn_by_turn_leaves_no_folds() {
    let place = |step: u32| 0.3 * DVec2::new((0.17 * f64::from(step)).cos(), (0.29 * f64::from(step)).sin());
    let height = |step: u32| 0.401 - 0.06 * f64::from(step / 40);
    let ways: Vec<ClosedMesh> = (0..180).map(|step| swept([place(step), place(step + 1)], height(step))).collect();
    drill(&ways, Precision::Single);
}

#[test]
fn cubes_that_are_joined_and_taken_away_leave_nothing_between_them() {
    let cells: Vec<DVec3> =
        (0..27).map(|i| DVec3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9))).collect();
    let cubes: Vec<ClosedMesh> = cells.iter().map(|&cell| closed(cuboid(cell, cell + 1.0).unwrap())).collect();
    // Those that touch in edges alone come first.
    let (even, odd): (Vec<&ClosedMesh>, Vec<&ClosedMesh>) =
        cubes.iter().partition(|cube| cube.bounds().min.element_sum() as i32 % 2 == 0);
    let mut whole = even[0].clone();
    for cube in even[1..].iter().chain(&odd) {
        whole = closed(result(BooleanOperation::Union, [&whole, cube], Precision::Double));
    }
    // Vertices of inputs stay where they are needed no more: two triangles for each side of a cube.
    assert_eq!((whole.mass_properties().volume, whole.mesh().triangles.len()), (27.0, 108));
    for cube in even.iter().chain(&odd[..odd.len() - 1]) {
        whole = closed(result(BooleanOperation::Difference, [&whole, cube], Precision::Double));
    }
    let last = odd[odd.len() - 1];
    assert_eq!((whole.bounds(), whole.mesh().triangles.len()), (last.bounds(), 12));
}

#[test]
fn drills_that_touch_the_walls_of_pockets_leave_no_folds() {
    let drill = cylinder(4.0, 40.0, 64).unwrap();
    let pocket = ell(DVec3::splat(12.0), [5.0, 5.0]).unwrap();
    let counterbore = DAffine3::from_scale(DVec3::new(1.3, 1.3, 0.25));
    let turned = |degrees: f64| DAffine3::from_rotation_x(f64::to_radians(degrees));
    let tools = [
        (&drill, DAffine3::IDENTITY, DVec3::new(30.0, 40.0, 15.0)),
        (&drill, DAffine3::IDENTITY, DVec3::new(41.0, 40.0, 15.0)),
        (&drill, DAffine3::IDENTITY, DVec3::new(52.0, 40.0, 15.0)),
        (&drill, counterbore, DVec3::new(52.0, 40.0, 25.0)),
        (&pocket, turned(270.0), DVec3::new(36.0, 50.0, 0.0)),
        (&pocket, turned(0.0), DVec3::new(48.0, 50.0, 0.0)),
        (&pocket, turned(90.0), DVec3::new(60.0, 50.0, 0.0)),
        (&pocket, turned(180.0), DVec3::new(72.0, 50.0, 0.0)),
    ];
    let precision = Precision::Single;
    let mut left = closed(cuboid(DVec3::ZERO, DVec3::new(100.0, 60.0, 30.0)).unwrap());
    for (step, (tool, placement, at)) in tools.into_iter().enumerate() {
        let mut tool = tool.clone();
        tool.positions.iter_mut().for_each(|p| *p = precision.round(placement.transform_point3(*p) + at));
        let tool = closed(tool);
        let solution =
            Solution::of(&[&left, &tool], &Expression::of_inputs(BooleanOperation::Difference, 2), FillRule::NonZero);
        let expected = solution.unwrap().properties();
        assert!(expected.with_meeting_shells.is_empty(), "crosses itself before step {step}");
        left = closed(result(BooleanOperation::Difference, [&left, &tool], precision));
        let volume = left.mass_properties().volume;
        assert!((volume - expected.mass.volume).abs() < 1e-2, "step {step}: {volume}, not {}", expected.mass.volume);
    }
    assert!(left.mesh().triangles.len() <= 2000, "{}", left.mesh().triangles.len());
}

#[test]
fn turned_cubes_that_touch_but_for_rounding_leave_one_of_them() {
    for (turns, precision) in
        [([1.7528, 2.7126, 2.0459], Precision::Single), ([2.4018, 1.2314, 0.4523], Precision::Double)]
    {
        let rotation = DQuat::from_euler(EulerRot::XYZ, turns[0], turns[1], turns[2]);
        let cube = |i: u32| {
            let low = DVec3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9));
            let mut mesh = cuboid(low, low + 1.0).unwrap();
            mesh.positions.iter_mut().for_each(|p| *p = precision.round(rotation * *p));
            closed(mesh)
        };
        // Each cube once, in an order in which many touch in edges alone.
        let order = |i: u32| 10 * i % 27;
        let joined = (1..27).map(|i| (BooleanOperation::Union, order(i)));
        let taken = (0..26).map(|i| (BooleanOperation::Difference, order(26 - i)));
        let (mut whole, mut volume) = (cube(order(0)), 1.0);
        for (step, (operation, i)) in joined.chain(taken).enumerate() {
            whole = closed(result(operation, [&whole, &cube(i)], precision));
            volume += if operation == BooleanOperation::Union { 1.0 } else { -1.0 };
            let (found, triangles) = (whole.mass_properties().volume, whole.mesh().triangles.len());
            let rounding = if precision == Precision::Single { 1e-5 } else { 1e-10 };
            assert!((found - volume).abs() < rounding, "{precision:?}, step {step}: {found} {volume}");
            assert!(triangles <= 300, "{precision:?}, step {step}: {triangles} triangles");
        }
    }
}

#[test]
fn a_tool_of_a_million_times_the_size_leaves_the_other_half() {
    let cube = closed(cuboid(DVec3::ZERO, DVec3::ONE).unwrap());
    let tool = closed(cuboid(DVec3::new(0.5, -1e6, -1e6), DVec3::splat(1e6)).unwrap());
    for precision in [Precision::Single, Precision::Double] {
        let left = result(BooleanOperation::Difference, [&cube, &tool], precision);
        assert_eq!((left.signed_volume(), left.area(), left.triangles.len()), (0.5, 4.0, 12), "{precision:?}");
    }
}
