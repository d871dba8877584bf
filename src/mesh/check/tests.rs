//! Tests of the check on meshes with known defects.

use glam::{DQuat, DVec2, EulerRot};
use proptest::prelude::*;

use super::exact::orientation;
use super::*;
use crate::mesh::Aabb;
use crate::testing::meshes::{cube, reversed, tetrahedron, together, unit_cube, unwelded};
use crate::testing::random::Congruential;

fn codes(report: &MeshReport) -> Vec<(&'static str, usize)> {
    report.defects().iter().map(|defect| (defect.code(), defect.count())).collect()
}

fn sentence(report: &MeshReport, code: &str) -> String {
    report.defects().iter().find(|defect| defect.code() == code).unwrap().to_string()
}

#[test]
fn cubes_are_solids_with_shared_or_separate_vertices() {
    for mesh in [unit_cube(), unwelded(&unit_cube())] {
        let report = check(&mesh);
        assert!(report.is_closed() && report.is_oriented() && report.is_solid());
        assert_eq!(codes(&report), []);
        assert_eq!((report.vertices, report.edges, report.triangles), (8, 18, 12));
        assert_eq!((report.components, report.shells), (1, 1));
        assert_eq!((report.euler_characteristic, report.genus), (2, Some(0)));
        assert_eq!((report.signed_volume, report.area), (1.0, 6.0));
        assert_eq!(report.bounds, Some(Aabb { min: DVec3::ZERO, max: DVec3::ONE }));
    }
}

#[test]
fn a_missing_triangle_leaves_three_open_edges() {
    let mut mesh = unit_cube();
    mesh.triangles.remove(0);
    let report = check(&mesh);
    assert!(!report.is_closed() && !report.is_oriented() && !report.is_solid());
    assert_eq!(codes(&report), [("open-edge", 3)]);
    assert_eq!((report.edges, report.euler_characteristic, report.genus), (18, 1, None));
    assert_eq!(
        sentence(&report, "open-edge"),
        "3 edges are open, used by one triangle only; the first is (0, 0, 0) to (0, 1, 1), of triangle 0."
    );
    let EdgePlace { ends, uses, forward, triangles } = &report.open_edges.first[2];
    assert_eq!((*ends, *uses, *forward), ([DVec3::new(0.0, 1.0, 1.0), DVec3::Z], 1, 1));
    assert_eq!(triangles, &[10]);
}

#[test]
fn an_extra_triangle_leaves_three_odd_edges() {
    let mut mesh = unit_cube();
    mesh.triangles.push(mesh.triangles[5]);
    let report = check(&mesh);
    assert_eq!(codes(&report), [("odd-edge", 3), ("duplicate-triangle", 1)]);
    assert_eq!(report.duplicates.first[0].triangle, 12);
    assert_eq!(report.duplicates.first[0].earlier, 5);
    assert!(sentence(&report, "odd-edge").contains("of triangles "), "{}", sentence(&report, "odd-edge"));
    assert!(!report.is_closed());
}

#[test]
fn faces_back_to_back_cancel_before_they_count_as_repeated() {
    let fin = |windings: &[bool]| {
        let mut mesh = unit_cube();
        mesh.triangles.extend(windings.iter().map(|forward| if *forward { [0, 3, 7] } else { [3, 0, 7] }));
        let report = check(&mesh);
        (report.duplicates.count, report.opposed_duplicates.count)
    };
    assert_eq!(fin(&[true]), (0, 0));
    assert_eq!(fin(&[true, false]), (0, 1));
    assert_eq!(fin(&[true, true]), (1, 0));
    assert_eq!(fin(&[true, false, true]), (0, 2));
    assert_eq!(fin(&[true, true, true]), (2, 0));
    assert_eq!(fin(&[false, true, true, true]), (1, 2));
}

#[test]
fn flat_shells_have_no_orientation() {
    // Back to back and oblique, so that rounding gives it some volume.
    let positions = vec![
        DVec3::new(47.263699, 36.56691, 12.565804),
        DVec3::new(47.306953, 36.352104, 12.790643),
        DVec3::new(47.344788, 36.110298, 12.987311),
    ];
    let flat = TriangleMesh { positions, triangles: vec![[0, 1, 2], [0, 2, 1]] };
    for around in [cube(DVec3::ZERO, 1.0), cube(DVec3::ZERO, 100.0)] {
        for flat in [flat.clone(), reversed(&flat)] {
            let report = check(&together(&[around.clone(), flat]));
            assert_eq!(codes(&report), [("opposed-duplicate-triangle", 1)]);
            assert!(report.is_solid());
        }
    }
}

#[test]
fn doubled_meshes_are_closed_and_not_solids() {
    let mesh = unit_cube();
    let report = check(&together(&[mesh.clone(), mesh.clone()]));
    assert!(report.is_closed() && report.is_oriented() && !report.is_solid());
    assert_eq!(codes(&report), [("all-doubled", 1), ("duplicate-triangle", 12), ("non-manifold-edge", 18)]);
    assert_eq!(report.duplicates.first.len(), 5);
    assert_eq!((report.components, report.signed_volume), (1, 2.0));

    let report = check(&together(&[mesh.clone(), reversed(&mesh)]));
    assert_eq!(codes(&report)[..3], [("inside-out", 1), ("all-doubled", 1), ("no-volume", 1)]);
    assert_eq!(codes(&report)[3..], [("opposed-duplicate-triangle", 12), ("non-manifold-edge", 18)]);
    assert!(report.is_closed() && report.is_oriented() && !report.is_solid());
}

#[test]
fn two_triangles_back_to_back_enclose_nothing() {
    let mesh = TriangleMesh { triangles: vec![[0, 1, 2], [0, 2, 1]], ..tetrahedron() };
    let report = check(&mesh);
    assert!(report.is_closed() && report.is_oriented() && !report.is_solid());
    assert_eq!(codes(&report), [("all-doubled", 1), ("no-volume", 1), ("opposed-duplicate-triangle", 1)]);
    assert_eq!(report.genus, Some(0));
}

#[test]
fn inside_out_cubes_are_found_alone_and_beside_others() {
    let inside_out = reversed(&unit_cube());
    let report = check(&inside_out);
    assert!(report.is_closed() && report.is_oriented() && !report.is_solid());
    assert_eq!(codes(&report), [("inside-out", 1), ("no-volume", 1)]);
    assert_eq!(report.inside_out.first[0].signed_volume, -1.0);
    for side in [0.5, 1.0, 3.0] {
        for corner in [DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::ONE, DVec3::splat(9.0)] {
            let report = check(&together(&[cube(corner, side), inside_out.clone()]));
            assert_eq!((report.inside_out.count, report.shells), (1, 2), "{side} {corner}");
            // Where the cubes have a face in common, its triangles face the same way and fit either cube.
            let ShellPlace { faces, signed_volume, bounds, .. } = report.inside_out.first[0];
            assert_eq!((faces, signed_volume, bounds), (12, -1.0, inside_out.bounds().unwrap()));
        }
    }
}

#[test]
fn coordinates_that_are_not_finite_are_named() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut mesh = unit_cube();
        mesh.positions[6].y = bad;
        mesh.positions[3].z = bad;
        let report = check(&mesh);
        assert_eq!(codes(&report), [("coordinate-not-finite", 2)]);
        assert!(!report.is_closed() && report.is_oriented() && !report.is_solid());
        assert_eq!((report.bad_positions.first[0].index, report.bad_positions.first[0].triangle), (6, 0));
    }
    let mut mesh = unit_cube();
    mesh.positions[6].y = f64::INFINITY;
    assert_eq!(
        sentence(&check(&mesh), "coordinate-not-finite"),
        "1 position is not finite: position 6 at (0, inf, 1), used by triangle 0."
    );
    let mut mesh = unit_cube();
    mesh.positions.push(DVec3::NAN);
    assert!(check(&mesh).is_solid());
    mesh.positions.pop();
    let mut nowhere = mesh.clone();
    nowhere.positions.iter_mut().for_each(|p| p.x = f64::NAN);
    let report = check(&together(&[mesh.clone(), nowhere, cube(DVec3::splat(0.25), 0.5)]));
    assert_eq!(codes(&report)[..2], [("coordinate-not-finite", 8), ("solid-in-solid", 1)]);
    assert_eq!((report.shells, report.inside_out.count), (2, 0));
}

#[test]
fn indices_out_of_range_are_named() {
    let mut mesh = unit_cube();
    mesh.triangles.push([8, 1, 900]);
    mesh.triangles.push([0, u32::MAX, 1]);
    let report = check(&mesh);
    assert_eq!(codes(&report), [("index-out-of-range", 3)]);
    assert!(!report.is_closed() && !report.is_solid());
    assert_eq!(report.bad_indices.first[1], BadIndex { triangle: 12, index: 900 });
    assert_eq!(sentence(&report, "index-out-of-range"), "3 indices are out of range; the first is 8 in triangle 12.");
}

#[test]
fn empty_meshes_are_not_solids() {
    let report = check(&TriangleMesh::default());
    assert_eq!(codes(&report), [("no-triangles", 1)]);
    assert!(!report.is_closed() && !report.is_solid());
}

#[test]
fn touching_cubes_are_two_shells_of_a_solid() {
    let touching = |corner| check(&together(&[unit_cube(), cube(corner, 1.0)]));
    let face = touching(DVec3::X);
    assert_eq!(codes(&face), [("opposed-duplicate-triangle", 2), ("non-manifold-edge", 5)]);
    assert_eq!((face.components, face.shells, face.euler_characteristic), (1, 2, 12 - 31 + 24));
    // With the common face cut along the other diagonal, only the sides of the square coincide.
    let mut other = cube(DVec3::X, 1.0);
    other.triangles[0] = [0, 4, 2];
    other.triangles[1] = [4, 6, 2];
    let across = check(&together(&[unit_cube(), other]));
    assert_eq!(codes(&across), [("non-manifold-edge", 4)]);
    assert_eq!((across.components, across.shells), (1, 2));
    let edge = touching(DVec3::new(1.0, 1.0, 0.0));
    assert_eq!(codes(&edge), [("non-manifold-edge", 1)]);
    assert_eq!((edge.components, edge.shells), (1, 2));
    let vertex = touching(DVec3::ONE);
    assert_eq!(codes(&vertex), [("non-manifold-vertex", 1)]);
    assert_eq!((vertex.components, vertex.shells), (2, 2));
    assert_eq!(vertex.non_manifold_vertices.first[0], VertexPlace { position: DVec3::ONE, fans: 2 });
    let apart = touching(DVec3::splat(2.0));
    assert_eq!(codes(&apart), []);
    assert_eq!((apart.components, apart.shells, apart.genus), (2, 2, Some(0)));
    for report in [face, across, edge, vertex, apart] {
        assert!(report.is_closed() && report.is_oriented() && report.is_solid());
        assert_eq!(report.signed_volume, 2.0);
    }
}

#[test]
fn cavities_face_inwards() {
    let (outer, inner, core) = (cube(DVec3::ZERO, 5.0), cube(DVec3::ONE, 3.0), cube(DVec3::splat(2.0), 1.0));
    let hollow = check(&together(&[outer.clone(), reversed(&inner)]));
    assert_eq!(codes(&hollow), []);
    assert!(hollow.is_solid());
    assert_eq!(hollow.signed_volume, 125.0 - 27.0);

    let wrong = check(&together(&[inner.clone(), outer.clone()]));
    assert_eq!(codes(&wrong), [("solid-in-solid", 1)]);
    assert_eq!((wrong.solids_in_solids.first[0].triangle, wrong.solids_in_solids.first[0].depth), (0, 1));

    let filled = check(&together(&[outer.clone(), reversed(&inner), core.clone()]));
    assert_eq!(codes(&filled), []);
    let filled = check(&together(&[outer.clone(), reversed(&inner), reversed(&core)]));
    assert_eq!(codes(&filled), [("inside-out", 1)]);
    assert_eq!(filled.inside_out.first[0].depth, 2);
    assert!(!filled.is_solid());
    let reversed_whole = check(&reversed(&together(&[outer, reversed(&inner)])));
    assert_eq!(codes(&reversed_whole), [("inside-out", 1), ("no-volume", 1), ("solid-in-solid", 1)]);
}

/// Tetrahedra with a face in a face of a cube, which is turned, so that `f32` moves their corners to either side of it.
#[test]
fn shells_that_touch_another_are_on_the_side_of_their_other_corners() {
    let single = |mesh: TriangleMesh, turn: DQuat| TriangleMesh {
        positions: mesh.positions.iter().map(|&p| (turn * p).as_vec3().as_dvec3()).collect(),
        triangles: mesh.triangles,
    };
    for i in 0..100 {
        let at = f64::from(i);
        let turn = DQuat::from_euler(EulerRot::XYZ, 0.1 + 0.3 * at, 0.2 * at, 0.7 * at);
        let base = [[1.0, 1.0], [2.0, 1.1], [1.2, 1.9]].map(|[x, y]| DVec3::new(x, y, 4.0));
        let on_face = |height: f64| {
            let apex = DVec3::new(1.4, 1.3, 4.0 + height);
            let [a, b, c] = [0, 1, 2].map(|corner| (corner + i) % 3);
            let mesh = TriangleMesh {
                positions: base.into_iter().chain([apex]).collect(),
                triangles: vec![[a, b, c], [b, a, 3], [c, b, 3], [a, c, 3]],
            };
            if height < 0.0 { mesh } else { reversed(&mesh) }
        };
        let findings = |height: f64, faces_inwards: bool| {
            let shell = if faces_inwards { reversed(&on_face(height)) } else { on_face(height) };
            let report = check(&single(together(&[cube(DVec3::ZERO, 4.0), shell]), turn));
            assert_eq!(report.shells, 2);
            (report.inside_out.count, report.solids_in_solids.count)
        };
        assert_eq!([findings(0.5, false), findings(0.5, true)], [(0, 0), (1, 0)], "{i}");
        assert_eq!([findings(-0.5, false), findings(-0.5, true)], [(0, 1), (0, 0)], "{i}");
    }
}

#[test]
fn a_cavity_that_touches_the_outside_is_a_cavity() {
    // The cavity has none, one, two or three of its faces in faces of the cube.
    let outer = cube(DVec3::ZERO, 4.0);
    for i in 0..27 {
        let corner = DVec3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9));
        let report = check(&together(&[outer.clone(), reversed(&cube(corner, 2.0))]));
        assert_eq!((report.inside_out.count, report.solids_in_solids.count), (0, 0), "{corner}");
        let report = check(&together(&[outer.clone(), cube(corner, 2.0)]));
        assert_eq!((report.inside_out.count, report.solids_in_solids.count), (0, 1), "{corner}");
    }
}

#[test]
fn a_shell_in_the_box_of_another_but_not_inside_it_is_outside() {
    // A small cube in the notch between the slope of a tetrahedron and the corner of its box.
    let mut tetrahedron = tetrahedron();
    tetrahedron.positions.iter_mut().for_each(|p| *p *= 10.0);
    let report = check(&together(&[tetrahedron.clone(), cube(DVec3::splat(6.0), 1.0)]));
    assert_eq!(codes(&report), []);
    let report = check(&together(&[tetrahedron.clone(), reversed(&cube(DVec3::splat(6.0), 1.0))]));
    assert_eq!(codes(&report), [("inside-out", 1)]);
    let report = check(&together(&[tetrahedron, reversed(&cube(DVec3::splat(0.5), 1.0))]));
    assert_eq!(codes(&report), []);
}

#[test]
fn all_edges_of_a_random_soup_are_open() {
    let mut random = Congruential::new(1);
    let positions = (0..300).map(|_| DVec3::from_array([(); 3].map(|()| random.share()))).collect();
    let triangles = (0..100).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let report = check(&TriangleMesh { positions, triangles });
    assert_eq!(codes(&report), [("open-edge", 300)]);
    assert_eq!((report.components, report.vertices, report.edges), (100, 300, 300));
    assert_eq!(report.open_edges.first.len(), 5);
}

#[test]
fn a_flipped_triangle_unbalances_three_edges() {
    let mut mesh = unit_cube();
    mesh.triangles[7].swap(0, 1);
    let report = check(&mesh);
    assert!(report.is_closed() && !report.is_oriented() && !report.is_solid());
    assert_eq!(codes(&report), [("unbalanced-edge", 3)]);
    assert_eq!(report.genus, None);
    let place = &report.unbalanced_edges.first[0];
    assert!(place.uses == 2 && place.forward != 1 && place.triangles.contains(&7));
}

#[test]
fn triangles_without_area_give_notes() {
    let mut mesh = unit_cube();
    mesh.triangles.extend([[0, 0, 0], [0, 0, 5], [3, 5, 3]]);
    // The edge from 0 to 1 gets a vertex in its middle on one side only, and a sliver that closes the gap.
    mesh.positions.push(DVec3::new(0.5, 0.0, 0.0));
    let base = mesh.triangles.iter().position(|t| *t == [0, 1, 5]).unwrap();
    mesh.triangles[base] = [0, 8, 5];
    mesh.triangles.extend([[8, 1, 5], [0, 1, 8]]);
    let report = check(&mesh);
    assert_eq!(codes(&report), [("repeated-corner", 3), ("collinear-triangle", 1)]);
    assert!(report.is_solid());
    assert_eq!((report.euler_characteristic, report.genus), (2, Some(0)));
    assert_eq!(report.collinear.first[0].triangle, 16);
    assert_eq!(
        sentence(&report, "collinear-triangle"),
        "1 triangle has no area, its corners being on a line: triangle 16 with corners (0, 0, 0), (1, 0, 0), \
         (0.5, 0, 0)."
    );
}

#[test]
fn collinearity_is_exact() {
    let line = [DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.2, 0.4, 0.6), DVec3::new(0.4, 0.8, 1.2)];
    for scale in [1.0, 2f64.powi(-500), 2f64.powi(500), 2f64.powi(-900), 2f64.powi(1000)] {
        let points = line.map(|p| p * scale);
        assert!(are_collinear(points), "{scale}");
        for corner in 0..3 {
            for axis in 0..3 {
                let mut points = points;
                points[corner][axis] = points[corner][axis].next_up();
                assert!(!are_collinear(points), "{scale} {corner} {axis}");
            }
        }
    }
    assert!(!are_collinear([DVec3::ZERO, DVec3::X, DVec3::new(0.5, 5e-324, 0.0)]));
    assert!(!are_collinear([DVec3::ZERO, DVec3::X * 1e300, DVec3::new(0.5, 0.0, 1e-300)]));
}

#[test]
fn reports_of_many_shells_do_not_depend_on_the_thread_count() {
    let mut parts = vec![cube(DVec3::splat(-1.0), 60.0)];
    for i in 0..1000u32 {
        let corner = DVec3::new(f64::from(i % 10), f64::from(i / 10 % 10), f64::from(i / 100)) * 5.0;
        let part = cube(corner, 2.0);
        parts.push(if i % 3 == 0 { part } else { reversed(&part) });
    }
    let mesh = together(&parts);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| format!("{:?}", check(&mesh)))
    };
    assert_eq!(with(1), with(3));
    assert_eq!(codes(&check(&mesh)), [("solid-in-solid", 334)]);
    parts.remove(0);
    assert_eq!(codes(&check(&together(&parts)))[0], ("inside-out", 666));
}

proptest! {
    #[test]
    fn orientation_agrees_with_integers(c in prop::array::uniform6(-30_000_000_000_000i64..30_000_000_000_000), t in -8..8i64, s in -3..3i64) {
        // Points on a line with integer coordinates, or one step beside it.
        let (a, d) = ([c[0], c[1]], [c[2] / 16, c[3] / 16]);
        let b = [a[0] + d[0], a[1] + d[1]];
        let p = [a[0] + t * d[0] + s, a[1] + t * d[1]];
        let exact = i128::from(b[0] - a[0]) * i128::from(p[1] - a[1]) - i128::from(b[1] - a[1]) * i128::from(p[0] - a[0]);
        let float = |p: [i64; 2]| DVec2::new(p[0] as f64, p[1] as f64);
        let sign = orientation(float(a), float(b), float(p));
        prop_assert_eq!((sign > 0.0, sign < 0.0), (exact > 0, exact < 0));
    }

    #[test]
    fn triangle_order_changes_no_count(picks in prop::collection::vec((0..6u32, 0..6u32, 0..6u32), 1..30)) {
        let positions: Vec<DVec3> =
            (0..6).map(|i| DVec3::new(f64::from(i), f64::from(i * i), f64::from(i % 2))).collect();
        let triangles: Vec<[u32; 3]> = picks.iter().map(|&(a, b, c)| [a, b, c]).collect();
        let backwards = triangles.iter().rev().map(|&[a, b, c]| [b, c, a]).collect();
        let one = check(&TriangleMesh { positions: positions.clone(), triangles });
        let other = check(&TriangleMesh { positions, triangles: backwards });
        let counts = |report: &MeshReport| {
            let edges = (report.open_edges.count, report.odd_edges.count, report.unbalanced_edges.count);
            let all = report.duplicates.count + report.opposed_duplicates.count;
            (edges, all, report.components, report.non_manifold_edges.count, report.euler_characteristic)
        };
        prop_assert_eq!(counts(&one), counts(&other));
        prop_assert_eq!(one.repeated_corners.count, other.repeated_corners.count);
    }
}
