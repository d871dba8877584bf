//! Whole sums: culled, crossed and resolved on the device, and on the CPU.

use ldi_ops::fixed::{Crossing, TriangleHit};
use ldi_ops::grid::{Axis, SumGrid};
use ldi_ops::mesh::{ClosedMesh, TriangleMesh};
use ldi_ops::minkowski::resolve::gpu::GpuResolver;
use ldi_ops::minkowski::{Exterior, Polyhedron, RaySpans, ResolveCounts, SumMembership, cull, resolve};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::solids;

use crate::testing::meshes::hollowed;
use crate::twin;

/// Computes a sum on both; if `exterior` is in, the first operand is all that lies outside of A.
fn compare(what: &str, a: TriangleMesh, b: TriangleMesh, pitch: f64, exterior: Exterior) -> ResolveCounts {
    let [a, b] = [a, b].map(|mesh| ClosedMesh::check(mesh).unwrap());
    let SumGrid { sum, a: grid_a, b: grid_b } = SumGrid::with_pitch(a.bounds(), b.bounds(), pitch, 256).unwrap();
    let [mut a, b] = [(grid_a, &a), (grid_b, &b)].map(|(grid, mesh)| Polyhedron::new(&grid.quantise(mesh).unwrap()));
    if exterior == Exterior::In {
        a = a.complement();
    }
    let (cpu, gpu) = (CpuSampler::default(), &twin::plain()[0].gpu);
    let membership = SumMembership::new(&a, exterior, &b);

    let (by_cpu, _) = cull(&a, &b);
    let spans: [RaySpans<TriangleHit>; 3] = Axis::ALL.map(|axis| by_cpu.spans(&sum, axis, exterior, &cpu).unwrap().0);
    for axis in Axis::ALL {
        let (found, count) = by_cpu.spans::<TriangleHit, _>(&sum, axis, exterior, gpu).unwrap();
        assert!(found == spans[axis.depth()], "{what}, {axis:?}: other spans");
        let (found, found_count) = by_cpu.spans::<Crossing, _>(&sum, axis, exterior, gpu).unwrap();
        assert_eq!(found_count, count, "{what}, {axis:?}");
        assert!(found == by_cpu.spans(&sum, axis, exterior, &cpu).unwrap().0, "{what}, {axis:?}: other crossings");
    }

    let expected = resolve(&sum, spans.clone(), exterior, &membership, &|_, _| {}).unwrap();
    let found = GpuResolver::new(gpu.device()).resolve(&sum, spans, exterior, &membership, &|_, _| {}).unwrap();
    assert_eq!(found.counts, expected.counts, "{what}");
    assert!(found.spans == expected.spans, "{what}: resolved otherwise");
    found.counts
}

#[test]
fn sums_of_rings_and_balls_are_equal() {
    let ring = || solids::torus(3.0, 1.0, 24, 12).unwrap();
    let ball = |radius: f64| solids::geodesic(radius, 2).unwrap();
    let all = [
        compare("a ring and a ball", ring(), ball(0.7), 0.2, Exterior::Out),
        compare("two rings", ring(), ring(), 0.25, Exterior::Out),
        compare("around a ring and a ball", ring(), ball(0.5), 0.2, Exterior::In),
    ];
    let sum = |of: fn(&ResolveCounts) -> u64| all.iter().map(of).sum::<u64>();
    assert!(sum(|counts| counts.gaps_out) > 1000 && sum(|counts| counts.open_nodes) > 1000, "{all:?}");
    assert!(sum(|counts| counts.gaps) > sum(|counts| counts.gaps_out) + 100, "{all:?}");
    assert!(sum(|counts| counts.gaps_tested) > 30, "{all:?}");
}

#[test]
fn cavities_of_sums_are_equal() {
    let box_mesh = |from: f64, to: f64| solids::cuboid([from; 3].into(), [to; 3].into()).unwrap();
    let hollow = |inner: f64| hollowed(box_mesh(0.0, 4.0), &box_mesh(2.0 - inner, 2.0 + inner));
    let kept = compare("a hollow cube and a small one", hollow(1.0), box_mesh(0.0, 0.7), 0.15, Exterior::Out);
    assert_eq!((kept.components, kept.cavities), (1, 1), "{kept:?}");
    let filled = compare("a hollow cube and a large one", hollow(0.5), box_mesh(0.0, 1.3), 0.15, Exterior::Out);
    assert_eq!(filled.cavities, 0, "{filled:?}");
}
