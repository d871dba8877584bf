//! Meshes broken by hand, one for each gate, and random ones against the exact check.

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::mesh::check;
use crate::solids;
use crate::testing::meshes::{cube, reversed, tetrahedron, together, unit_cube, unwelded};

/// Returns the messages of the failures of a mesh.
fn sentences(mesh: &TriangleMesh) -> Vec<String> {
    ManifoldReport::of(mesh, Precision::Single).failures().iter().map(ManifoldFailure::to_string).collect()
}

#[test]
fn good_meshes_pass_with_their_genus() {
    let (cube, torus) = (unit_cube(), solids::torus(10.0, 3.0, 24, 12).unwrap());
    let mut apart = together(&[cube.clone(), torus.clone(), torus.clone()]);
    for position in &mut apart.positions[8 + torus.positions.len()..] {
        position.z += 50.0;
    }
    for (mesh, components, genus) in [(&cube, 1, 0), (&torus, 1, 1), (&apart, 3, 2)] {
        let manifold = ManifoldReport::of(mesh, Precision::Single);
        assert!(manifold.passed(), "{:?}", manifold.failures());
        assert_eq!((manifold.components, manifold.genus), (components, Some(genus)));
        assert_eq!((manifold.triangles, manifold.vertices), (mesh.triangles.len(), mesh.positions.len()));
        assert_eq!(manifold.signed_volume, mesh.signed_volume());
    }
    let nothing = ManifoldReport::of(&TriangleMesh::default(), Precision::Single);
    assert!(nothing.passed() && nothing.genus == Some(0) && nothing.components == 0);
}

#[test]
fn unused_positions_are_ignored() {
    let mut mesh = unit_cube();
    mesh.positions.extend([DVec3::ZERO, DVec3::NAN]);
    let manifold = ManifoldReport::of(&mesh, Precision::Single);
    assert!(manifold.passed(), "{:?}", manifold.failures());
    assert_eq!((manifold.vertices, manifold.components, manifold.genus), (8, 1, Some(0)));
}

#[test]
fn flipped_and_missing_faces_each_leave_three_bad_edges() {
    let mut flipped = unit_cube();
    flipped.triangles[3].swap(0, 1);
    let manifold = ManifoldReport::of(&flipped, Precision::Single);
    assert_eq!((manifold.edges.count, manifold.genus), (3, None));
    assert!(manifold.edges.first.iter().all(|edge| edge.uses == 2 && edge.forward != 1 && edge.triangles.contains(&3)));

    let mut missing = unit_cube();
    missing.triangles.remove(3);
    let manifold = ManifoldReport::of(&missing, Precision::Single);
    assert_eq!((manifold.edges.count, manifold.non_manifold_vertices.count), (3, 0));
    assert!(manifold.edges.first.iter().all(|edge| edge.uses == 1));
    assert_eq!(manifold.failures().len(), 1);
}

#[test]
fn doubled_triangles_are_found_in_any_rotation_and_order() {
    let [a, b, c] = unit_cube().triangles[5];
    for copy in [[a, b, c], [b, c, a], [c, a, b], [b, a, c], [a, c, b], [c, b, a]] {
        let mut mesh = unit_cube();
        mesh.triangles.push(copy);
        let manifold = ManifoldReport::of(&mesh, Precision::Single);
        assert_eq!((manifold.duplicates.count, manifold.edges.count), (1, 3));
        let place = manifold.duplicates.first[0];
        assert_eq!((place.earlier, place.triangle), (5, 12));
    }
    // Two triangles back to back border each other properly but enclose no volume.
    let flat = TriangleMesh { positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y], triangles: vec![[0, 1, 2], [0, 2, 1]] };
    let manifold = ManifoldReport::of(&flat, Precision::Single);
    assert_eq!((manifold.edges.count, manifold.duplicates.count, manifold.non_manifold_vertices.count), (0, 1, 0));
    assert_eq!(manifold.failures().len(), 2, "{:?}", manifold.failures());
}

#[test]
fn bad_and_repeated_indices_are_counted_separately() {
    let mut mesh = unit_cube();
    mesh.triangles.extend([[0, 1, 8], [9, 9, 3], [2, 2, 5]]);
    let manifold = ManifoldReport::of(&mesh, Precision::Single);
    assert_eq!(manifold.bad_indices.count, 3);
    assert_eq!(manifold.bad_indices.first[0], BadIndex { triangle: 12, index: 8 });
    assert_eq!((manifold.repeated_indices.count, manifold.repeated_indices.first[0].triangle), (1, 14));
    assert_eq!((manifold.edges.count, manifold.genus), (0, None));
}

#[test]
fn cubes_that_share_an_edge_or_a_vertex_by_index_are_not_manifold() {
    let (a, b) = (unit_cube(), cube(DVec3::new(1.0, 1.0, 0.0), 1.0));
    let mut by_edge = together(&[a.clone(), b.clone()]);
    // Vertices 3 and 7 of the first coincide with 0 and 4 of the second.
    by_edge.triangles.as_flattened_mut().iter_mut().for_each(|index| match *index {
        8 => *index = 3,
        12 => *index = 7,
        _ => {}
    });
    let manifold = ManifoldReport::of(&by_edge, Precision::Single);
    assert_eq!((manifold.edges.count, manifold.edges.first[0].uses, manifold.edges.first[0].forward), (1, 4, 2));
    assert_eq!((manifold.components, manifold.vertices, manifold.genus), (1, 14, None));
    assert_eq!((manifold.non_manifold_vertices.count, manifold.welded.count), (0, 0));

    let mut by_vertex = together(&[a, cube(DVec3::ONE, 1.0)]);
    by_vertex.triangles.as_flattened_mut().iter_mut().filter(|index| **index == 8).for_each(|index| *index = 7);
    let manifold = ManifoldReport::of(&by_vertex, Precision::Single);
    assert_eq!((manifold.edges.count, manifold.non_manifold_vertices.count), (0, 1));
    let place = manifold.non_manifold_vertices.first[0];
    assert_eq!((place.position, place.fans, manifold.components), (DVec3::ONE, 2, 1));
}

#[test]
fn positions_equal_in_f32_are_reported_as_welded() {
    // By position alone two cubes that touch in a corner are welded there, even if they only seem to touch.
    for gap in [0.0, 1e-9] {
        let mesh = together(&[unit_cube(), cube(DVec3::splat(1.0 + gap), 1.0)]);
        let manifold = ManifoldReport::of(&mesh, Precision::Single);
        assert_eq!((manifold.welded.count, manifold.collapsed.count), (1, 0));
        let place = WeldedPlace { vertex: 8, earlier: 7, position: DVec3::splat(1.0 + gap) };
        assert_eq!(manifold.welded.first, [place]);
    }
    assert!(ManifoldReport::of(&together(&[unit_cube(), cube(DVec3::splat(1.001), 1.0)]), Precision::Single).passed());
    // A thin cube far from the origin: its four long edges remain.
    let manifold = ManifoldReport::of(&cube(DVec3::new(1e6, 0.0, 0.0), 1e-3), Precision::Single);
    assert_eq!((manifold.welded.count, manifold.collapsed.count), (4, 8));
    // Three vertices in one place weld two; minus zero equals zero.
    let mut three = unit_cube();
    three.positions[1] = DVec3::new(-0.0, 1e-60, 0.0);
    three.positions[2] = DVec3::ZERO;
    assert_eq!(ManifoldReport::of(&three, Precision::Single).welded.count, 2);
    assert_eq!(ManifoldReport::of(&unwelded(&unit_cube()), Precision::Single).welded.count, 36 - 8);
}

#[test]
fn inside_out_meshes_and_invalid_positions_fail() {
    let manifold = ManifoldReport::of(&reversed(&tetrahedron()), Precision::Single);
    assert!(matches!(manifold.failures()[..], [ManifoldFailure::NoVolume { signed_volume }] if signed_volume < 0.0));
    let mut mesh = unit_cube();
    mesh.positions[5].y = f64::NAN;
    let manifold = ManifoldReport::of(&mesh, Precision::Single);
    assert_eq!((manifold.bad_positions.count, manifold.bad_positions.first[0].index), (1, 5));
    assert_eq!(manifold.failures().len(), 2);
}

#[test]
fn messages_count_the_faults_and_name_the_first() {
    let mut mesh = unit_cube();
    mesh.triangles.remove(0);
    assert_eq!(
        sentences(&mesh),
        [
            "3 edges do not border two triangles in opposite directions; the first is [0, 0, 0] to [0, 0, 1], used 0 times \
          that way and 1 times the other."
        ]
    );
    let touching = together(&[unit_cube(), cube(DVec3::ONE, 1.0)]);
    assert_eq!(sentences(&touching), ["1 vertex falls on another in f32: vertex 8 on vertex 7 at [1, 1, 1]."]);
}

#[test]
fn vertices_with_long_stars_are_checked() {
    // A double cone whose two tips have stars longer than the fast path accepts.
    let mut mesh = solids::cylinder(1.0, 2.0, 100).unwrap();
    let manifold = ManifoldReport::of(&mesh, Precision::Single);
    assert!(manifold.passed() && manifold.genus == Some(0), "{:?}", manifold.failures());
    mesh.triangles.remove(7);
    assert_eq!(ManifoldReport::of(&mesh, Precision::Single).edges.count, 3);
}

#[test]
fn failures_do_not_depend_on_the_thread_count() {
    let mut mesh = solids::torus(10.0, 3.0, 200, 100).unwrap();
    for i in (0..mesh.triangles.len()).step_by(97) {
        mesh.triangles[i].swap(0, 2);
    }
    mesh.triangles.extend_from_within(300..400);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| format!("{:?}", ManifoldReport::of(&mesh, Precision::Single)))
    };
    assert_eq!(with(1), with(4));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]
    /// With different positions for all vertices, identity of indices is identity of positions.
    #[test]
    fn gates_agree_with_the_exact_check(
        picks in prop::collection::vec((0..6u32, 0..6u32, 0..6u32), 0..14),
        solids in prop::collection::vec((0..4u32, any::<bool>()), 0..3),
    ) {
        let positions = (0..11).map(|i| DVec3::new(f64::from(i), f64::from(i * i % 7), f64::from(i * i * i % 5)));
        let mut mesh = TriangleMesh { positions: positions.collect(), triangles: Vec::new() };
        mesh.triangles.extend(picks.iter().filter(|_| picks.len() > 5).map(|&(a, b, c)| [a, b, c]));
        for (first, facing_in) in solids {
            let solid = tetrahedron();
            let solid = if facing_in { reversed(&solid) } else { solid };
            mesh.triangles.extend(solid.triangles.iter().map(|indices| indices.map(|index| index + 2 * first)));
        }
        let (manifold, report) = (ManifoldReport::of(&mesh, Precision::Single), check(&mesh));
        prop_assert_eq!(manifold.repeated_indices.count, report.repeated_corners.count);
        prop_assert_eq!(manifold.duplicates.count, report.duplicates.count + report.opposed_duplicates.count);
        prop_assert_eq!(&manifold.non_manifold_vertices.count, &report.non_manifold_vertices.count);
        let bad_edges = report.open_edges.count + report.odd_edges.count + report.non_manifold_edges.count;
        let unbalanced_pairs = mesh_edges(&mesh).into_iter().filter(|&(forward, all)| all == 2 && forward != 1).count();
        prop_assert_eq!(manifold.edges.count, bad_edges + unbalanced_pairs);
        if manifold.genus.is_some() && report.genus.is_some() {
            prop_assert_eq!(manifold.genus, report.genus);
            prop_assert_eq!(manifold.components, report.components);
        }
        let is_clean = manifold.edges.count == 0 && manifold.repeated_indices.count == 0 && manifold.non_manifold_vertices.count == 0;
        prop_assert_eq!(manifold.genus.is_some(), is_clean);
    }
}

/// Returns for every edge the number of its upward uses and of all its uses.
fn mesh_edges(mesh: &TriangleMesh) -> Vec<(usize, usize)> {
    let mut edges = std::collections::BTreeMap::new();
    for &[a, b, c] in mesh.triangles.iter().filter(|[a, b, c]| a != b && b != c && c != a) {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let uses = edges.entry((from.min(to), from.max(to))).or_insert((0, 0));
            *uses = (uses.0 + usize::from(from < to), uses.1 + 1);
        }
    }
    edges.into_values().collect()
}
