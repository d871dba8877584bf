//! Tests of meshes on which other programs fail: each gives a right answer or a refusal.

use glam::DVec3;
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::integrate::{length, volume};
use ldi_ops::ldi::Ldi;
use ldi_ops::mesh::{ClosedMesh, Defect, TriangleMesh};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{FillRule, MaskIntersection, Mode, SampleError, Sampler};
use ldi_ops::solids::{cuboid, geodesic};

use super::images::{
    FILLS, MODES, OVER, UNDER, assert_empty, assert_same, assert_same_set, assert_within, intersection, less, sample,
    union,
};
use super::material::{models, moved, quantised};
use super::testing::images::{closed, grid_around};
use super::testing::meshes::{reversed, together, unwelded};

fn cube_at(x: f64, y: f64, z: f64) -> TriangleMesh {
    let corner = DVec3::new(x, y, z);
    cuboid(corner, corner + 1.0).unwrap()
}

/// Returns a grid around both touching cubes, on which their common face lies between rays.
fn around(a: &ClosedMesh, b: &ClosedMesh) -> Grid {
    grid_around(&[a, b], 64, 1024)
}

fn defect_codes(mesh: TriangleMesh) -> Vec<&'static str> {
    let refused = ClosedMesh::check(mesh).expect_err("the mesh is refused");
    refused.report.defects().iter().map(Defect::code).collect()
}

#[test]
fn a_missing_triangle_is_refused_and_leaves_only_the_rays_through_the_hole_unclosed() {
    for (name, model) in models() {
        let grid = grid_around(&[&model], 60, 1024);
        let whole = quantised(&grid, &model);
        let triangles = model.mesh().triangles.len();
        for missing in [0, triangles / 3, triangles - 1] {
            let mut open = model.mesh().clone();
            open.triangles.remove(missing);
            assert!(defect_codes(open.clone()).contains(&"open-edge"), "{name}");
            let open = grid.quantise_open(&open).unwrap();
            for axis in Axis::ALL {
                // Under even-odd an image keeps every crossing, so exactly the rays through the hole have a sample of it.
                let surface = CpuSampler::default().sample_surface(&whole, axis, FillRule::EvenOdd).unwrap();
                let hole: Vec<u32> = (0..surface.rays())
                    .filter(|&ray| {
                        let samples =
                            surface.offsets()[ray as usize] as usize..surface.offsets()[ray as usize + 1] as usize;
                        surface.triangles().unwrap()[samples].contains(&(missing as u32))
                    })
                    .collect();
                for mode in MODES {
                    for fill in FILLS {
                        let found = sample(&open, axis, mode, fill);
                        let what = format!("{name} without triangle {missing}, {axis:?}, {mode:?}, {fill:?}");
                        assert_eq!(found.unclosed(), hole, "{what}");
                        let expected = sample(&whole, axis, mode, fill);
                        let elsewhere = |ray: &u32| !found.is_unclosed(*ray);
                        for ray in (0..found.rays()).filter(elsewhere) {
                            assert_eq!(found.samples(ray), expected.samples(ray), "{what}, ray {ray}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn a_hole_across_an_axis_leaves_rays_unclosed_along_that_axis_alone() {
    let mut open = cube_at(0.0, 0.0, 0.0);
    open.triangles.remove(0);
    let grid = grid_around(&[&closed(cube_at(0.0, 0.0, 0.0))], 64, 1024);
    let open = grid.quantise_open(&open).unwrap();
    let unclosed = Axis::ALL.map(|axis| sample(&open, axis, Mode::Exact, FillRule::EvenOdd).unclosed().len());
    // One triangle is half of the face at the least x; the tie rule decides which half owns the diagonal.
    assert!((64 * 63 / 2..=64 * 65 / 2).contains(&unclosed[0]), "{unclosed:?}");
    assert_eq!(unclosed[1..], [0, 0]);
}

#[test]
fn doubled_triangles_are_reported_and_cancel_under_even_odd_alone() {
    for (name, model) in models() {
        let mesh = model.mesh();
        let doubled = closed(together(&[mesh.clone(), mesh.clone()]));
        assert!(doubled.every_triangle_even() && doubled.oriented(), "{name}");
        assert!(!model.every_triangle_even(), "{name}");
        let grid = grid_around(&[&model], 50, 1024);
        for axis in Axis::ALL {
            let of = |mesh, fill| sample(&quantised(&grid, mesh), axis, Mode::Exact, fill);
            assert_same_set(name, &of(&doubled, FillRule::NonZero), &of(&model, FillRule::NonZero));
            assert_eq!(length(&of(&doubled, FillRule::EvenOdd)), 0, "{name}");
            assert_eq!(length(&sample(&quantised(&grid, &doubled), axis, UNDER, FillRule::EvenOdd)), 0, "{name}");
        }
        // Twice and facing both ways, the mesh bounds nothing by either rule.
        let cancelled = closed(together(&[mesh.clone(), reversed(mesh)]));
        assert!(cancelled.every_triangle_even(), "{name}");
        let image = sample(&quantised(&grid, &cancelled), Axis::Z, Mode::Exact, FillRule::NonZero);
        assert_eq!(length(&image), 0, "{name}");
    }
}

#[test]
fn a_solid_turned_inside_out_has_the_same_image_by_either_rule() {
    for (name, model) in models() {
        let turned = closed(reversed(model.mesh()));
        assert!(turned.oriented() && turned.signed_volume() == -model.signed_volume(), "{name}");
        let grid = grid_around(&[&model], 50, 1024);
        for (axis, mode) in Axis::ALL.into_iter().flat_map(|axis| MODES.map(|mode| (axis, mode))) {
            for fill in FILLS {
                let [found, expected] = [&turned, &model].map(|m| sample(&quantised(&grid, m), axis, mode, fill));
                assert_same(&format!("{name}, {axis:?}, {mode:?}, {fill:?}"), &found, &expected);
            }
        }
    }
}

#[test]
fn a_turned_triangle_changes_nothing_under_even_odd_and_is_refused_by_nonzero() {
    for (name, model) in models() {
        let mut mesh = model.mesh().clone();
        mesh.triangles[7].swap(0, 1);
        let turned = closed(mesh);
        assert!(!turned.oriented(), "{name}");
        let grid = grid_around(&[&model], 50, 1024);
        let solid = quantised(&grid, &turned);
        for mode in MODES {
            let expected = sample(&quantised(&grid, &model), Axis::Z, mode, FillRule::EvenOdd);
            assert_same(name, &sample(&solid, Axis::Z, mode, FillRule::EvenOdd), &expected);
            let refused = CpuSampler::default().sample(&solid, Axis::Z, mode, FillRule::NonZero);
            assert_eq!(refused, Err(SampleError::NotOriented), "{name}");
        }
    }
}

#[test]
fn coordinates_that_are_not_finite_are_refused_by_name_and_place() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for vertex in 0..8 {
            for axis in 0..3 {
                for whole in [cube_at(1.0, 2.0, 3.0), unwelded(&cube_at(1.0, 2.0, 3.0))] {
                    let mut mesh = whole;
                    let corner = mesh.positions[vertex];
                    // Every copy of the corner, so that the mesh would be closed but for the invalid number.
                    for position in mesh.positions.iter_mut().filter(|position| **position == corner) {
                        position[axis] = bad;
                    }
                    let refused = ClosedMesh::check(mesh).unwrap_err();
                    let Some(Defect::BadPositions(found)) =
                        refused.report.defects().into_iter().find(|d| d.code() == "coordinate-not-finite")
                    else {
                        panic!("the position is not named")
                    };
                    assert!(found.count >= 1 && !found.first.is_empty());
                }
            }
        }
    }
}

#[test]
fn unwelded_soups_have_the_images_of_the_welded_mesh() {
    for (name, model) in models() {
        let soup = closed(unwelded(model.mesh()));
        assert_eq!(soup.mesh().positions.len(), 3 * soup.mesh().triangles.len());
        let grid = grid_around(&[&model], 50, 1024);
        for axis in Axis::ALL {
            let of = |mesh| sample(&quantised(&grid, mesh), axis, OVER, FillRule::NonZero);
            assert_same(name, &of(&soup), &of(&model));
        }
    }
}

#[test]
fn touching_cubes_share_no_volume_and_unite_without_loss() {
    let a = closed(cube_at(0.0, 0.0, 0.0));
    let touching = [
        ("face", cube_at(1.0, 0.0, 0.0)),
        ("part of a face", cube_at(0.25, -1.0, 0.5)),
        ("edge", cube_at(1.0, 0.0, -1.0)),
        ("part of an edge", cube_at(0.375, 1.0, 1.0)),
        ("vertex", cube_at(-1.0, 1.0, -1.0)),
    ];
    for (name, other) in touching {
        let b = closed(other);
        let grid = around(&a, &b);
        for axis in Axis::ALL {
            for fill in FILLS {
                let what = format!("{name}, {axis:?}, {fill:?}");
                let [first, second] = [&a, &b].map(|mesh| sample(&quantised(&grid, mesh), axis, Mode::Exact, fill));
                assert_empty(&format!("{what}: ∩"), &intersection(&first, &second));
                assert_same_set(&format!("{what}: −"), &less(&first, &second), &first);
                assert_eq!(length(&union(&first, &second)), length(&first) + length(&second), "{what}: ∪");
                // As two shells of one mesh the cubes give the same union by either rule.
                let both = closed(together(&[a.mesh().clone(), b.mesh().clone()]));
                let image = sample(&quantised(&grid, &both), axis, Mode::Exact, fill);
                assert_same_set(&format!("{what}: one mesh"), &image, &union(&first, &second));
            }
        }
    }
}

#[test]
fn windings_distinguish_overlapping_touching_and_inverted_shells() {
    let of = |shells: &[TriangleMesh], axis, mode, fill| {
        let mesh = closed(together(shells));
        sample(&quantised(&grid_around(&[&mesh], 64, 1024), &mesh), axis, mode, fill).windings().unwrap()
    };
    let cube = cube_at(0.0, 0.0, 0.0);
    for (axis, mode) in Axis::ALL.into_iter().flat_map(|axis| MODES.map(|mode| (axis, mode))) {
        for fill in FILLS {
            let what = format!("{axis:?}, {mode:?}, {fill:?}");
            let abutting = [cube_at(1.0, 0.0, 0.0), cube_at(0.0, 1.0, 0.0), cube_at(0.0, 0.0, 1.0)];
            for other in abutting {
                let windings = of(&[cube.clone(), other], axis, mode, fill);
                assert!(windings.fill_rules_agree() && windings.aligned == windings.changes, "{what}: {windings:?}");
                assert!(windings.changes > 0 && windings.wound > 0, "{what}: {windings:?}");
            }
            // A cube in general position, a cube with coplanar faces, and a cube that occurs twice.
            for other in [cube_at(0.5, 0.25, 0.125), cube_at(0.5, 0.0, 0.0), cube.clone()] {
                let overlapping = of(&[cube_at(2.0, 0.0, 0.0), cube.clone(), other], axis, mode, fill);
                assert!(!overlapping.fill_rules_agree(), "{what}: {overlapping:?}");
            }
            let turned = of(&[reversed(&cube)], axis, mode, fill);
            assert!(turned.fill_rules_agree() && turned.aligned == -turned.changes, "{what}: {turned:?}");
            assert!(turned.changes > 0 && turned.wound < 0, "{what}: {turned:?}");
            // One of the two cubes is inside out.
            let mixed = of(&[cube.clone(), reversed(&cube_at(1.5, 0.25, 0.125))], axis, mode, fill);
            assert!(!mixed.fill_rules_agree(), "{what}: {mixed:?}");
        }
    }
}

#[test]
fn shells_wind_once_around_the_inside_where_the_fill_rules_agree() {
    for (name, model) in models().into_iter().filter(|(name, _)| *name != "heap of struts") {
        for mesh in [model.mesh().clone(), reversed(model.mesh())].map(closed) {
            let solid = quantised(&grid_around(&[&mesh], 50, 1024), &mesh);
            for (axis, mode) in Axis::ALL.into_iter().flat_map(|axis| MODES.map(|mode| (axis, mode))) {
                let windings = sample(&solid, axis, mode, FillRule::EvenOdd).windings().unwrap();
                assert!(windings.fill_rules_agree(), "{name}, {axis:?}, {mode:?}: {windings:?}");
                let exact = length(&sample(&solid, axis, Mode::Exact, FillRule::EvenOdd));
                assert_eq!(windings.wound.abs(), exact, "{name}, {axis:?}, {mode:?}");
            }
        }
    }
}

#[test]
fn booleans_of_coincident_solids_are_exact() {
    let mut solids = models();
    solids.push(("cube", closed(cube_at(0.0, 0.0, 0.0))));
    for (name, model) in solids {
        let grid = grid_around(&[&model], 64, 1024);
        for (axis, mode) in Axis::ALL.into_iter().flat_map(|axis| MODES.map(|mode| (axis, mode))) {
            let solid = quantised(&grid, &model);
            let a = sample(&solid, axis, mode, FillRule::NonZero);
            // Another mesh of the same solid: the same faces cut along other lines, in another order.
            let again = closed(unwelded(model.mesh()));
            let b = sample(&quantised(&grid, &again), axis, mode, FillRule::NonZero);
            assert_same_set(name, &intersection(&a, &b), &a);
            assert_same_set(name, &union(&a, &b), &a);
            assert_empty(name, &less(&a, &b));
        }
        let exact = sample(&quantised(&grid, &model), Axis::Z, Mode::Exact, FillRule::NonZero);
        for (estimate, inner) in [(ldi_ops::sampler::Estimate::Over, false), (ldi_ops::sampler::Estimate::Under, true)]
        {
            let solid = quantised(&grid, &model);
            let sampler = CpuSampler::default();
            let masked = sampler.sample_intersection([&solid, &solid], Axis::Z, estimate, FillRule::NonZero).unwrap();
            match inner {
                true => assert_within(name, &masked, &exact),
                false => assert_within(name, &exact, &masked),
            }
        }
    }
}

#[test]
fn nearly_coincident_cubes_differ_by_less_than_a_slice() {
    let a = closed(cube_at(0.0, 0.0, 0.0));
    for offset in [1e-3, 1e-6, 1e-9, 1e-12] {
        let b = closed(moved(a.mesh(), DVec3::splat(offset)));
        let grid = around(&a, &b);
        for axis in Axis::ALL {
            let [first, second] =
                [&a, &b].map(|mesh| sample(&quantised(&grid, mesh), axis, Mode::Exact, FillRule::EvenOdd));
            let difference = volume(&less(&first, &second));
            // A slice across the rays, one pixel wider than the cube; the other two faces fall between the same rays.
            let slice = 1.05 * offset + 2.0 * grid.step();
            assert!((0.0..=slice).contains(&difference), "{offset}: {difference}");
        }
    }
}

#[test]
fn nested_shells_are_cavities_or_solid_by_their_orientation() {
    let outer = geodesic(2.0, 12).unwrap();
    let inner = geodesic(1.0, 12).unwrap();
    let grid = Grid::with_resolution(outer.bounds().unwrap(), 80, 1024).unwrap();
    let of = |mesh: &ClosedMesh, fill| sample(&quantised(&grid, mesh), Axis::Y, Mode::Exact, fill);
    let [whole, core] = [&outer, &inner].map(|mesh| of(&closed(mesh.clone()), FillRule::EvenOdd));
    let hollow = closed(together(&[outer.clone(), reversed(&inner)]));
    let filled = closed(together(&[outer, inner]));
    let shell: Ldi = less(&whole, &core);
    assert_same_set("a cavity, even-odd", &of(&hollow, FillRule::EvenOdd), &shell);
    assert_same_set("a cavity, nonzero", &of(&hollow, FillRule::NonZero), &shell);
    assert_same_set("a solid in a solid, even-odd", &of(&filled, FillRule::EvenOdd), &shell);
    assert_same_set("a solid in a solid, nonzero", &of(&filled, FillRule::NonZero), &whole);
}
