//! Metrics of rays and facets: volume, surface area, chords, intercepts, overhang, curvature, moments.

use std::f64::consts::{FRAC_1_SQRT_2, PI, SQRT_2, TAU};

use glam::{DAffine3, DQuat, DVec3, EulerRot};
use ldi_ops::grid::Axis;
use ldi_ops::integrate::{AxisVolume, VolumeEstimate};
use ldi_ops::metrics::anisotropy::{self, crossings_along};
use ldi_ops::metrics::chords::{Chords, Counted, Weighting};
use ldi_ops::metrics::curvature::curvature;
use ldi_ops::metrics::inertia::phase_moments;
use ldi_ops::metrics::overhang::{Plate, overhang};
use ldi_ops::metrics::profiles::profiles;
use ldi_ops::metrics::surface_area::{Scale, SurfaceElements};
use ldi_ops::metrics::{BoundaryCondition, Facets, Phase};
use ldi_ops::solids::{self, Surface};

use crate::convergence::{Within, converges};
use crate::scene::{Scene, ball, cuboid, moved, network, struts};
use crate::testing::meshes::together;

fn volume(scene: &Scene) -> f64 {
    VolumeEstimate::from_axes(&scene.images.each_ref().map(AxisVolume::of)).value
}

fn chords(scene: &Scene, phase: Phase) -> Chords {
    let region = scene.region();
    Chords::together(
        &scene.images.each_ref().map(|image| Chords::along(image, &region, phase, BoundaryCondition::Clip)),
    )
}

#[test]
fn volume_of_a_ball_converges() {
    converges("volume of a ball", 4.0 / 3.0 * PI, Within::Share(1e-3), [58, 96, 160], |n| {
        let scene = Scene::of(ball(1.0), n);
        scene.measured(volume(&scene))
    });
}

#[test]
fn volume_and_porosity_of_struts_converge() {
    let exact = 3.0 * PI * 0.15f64.powi(2) - 8.0 * SQRT_2 * 0.15f64.powi(3);
    assert!((exact - 0.173874).abs() < 1e-6);
    // Struts along the axes are a whole number of rays wide, or one more.
    converges("volume of struts", exact, Within::Share(5e-3), [32, 64, 128], |n| {
        let scene = Scene::of(struts(1, 0.15, n), n);
        scene.measured(volume(&scene))
    });
    converges("porosity of struts, by slices", 1.0 - exact, Within::Share(5e-3), [32, 64, 128], |n| {
        let scene = Scene::of(struts(1, 0.15, n), n);
        let means = profiles(&scene.images, &scene.region()).map(|profile| profile.mean());
        scene.measured(means.iter().sum::<f64>() / 3.0)
    });
}

#[test]
fn surface_area_of_struts_excludes_cut_faces() {
    let exact = 6.0 * PI * 0.15 - 24.0 * SQRT_2 * 0.15f64.powi(2);
    assert!((exact - 2.06376).abs() < 1e-5);
    converges("surface of struts", exact, Within::Share(0.01), [32, 64, 128], |n| {
        let scene = Scene::of(struts(1, 0.15, n), n);
        scene.measured(scene.of_surface(|surface| surface.area()))
    });
}

#[test]
fn area_of_minimal_surfaces_converges() {
    for (surface, exact) in [(Surface::Gyroid, 3.0917), (Surface::Primitive, 2.3526), (Surface::Diamond, 3.8380)] {
        converges(&format!("surface of {surface:?}"), exact, Within::Share(0.01), [24, 48, 96], |n| {
            let scene = Scene::of(network(surface, 1, n), n);
            scene.measured(scene.of_surface(|surface| surface.area()))
        });
    }
}

/// The area by ray hits along three axes, in any pose.
#[test]
fn area_of_turned_cubes_by_hits_converges() {
    let turns = |n: u32| DQuat::from_euler(EulerRot::XYZ, 0.71 * f64::from(n), 1.3 * f64::from(n), 0.37 * f64::from(n));
    for pose in 1..=6 {
        converges(&format!("surface of a cube by hits, pose {pose}"), 6.0, Within::Share(0.02), [48, 96, 192], |n| {
            let cube = moved(cuboid(DVec3::ONE), DAffine3::from_quat(turns(pose)));
            let scene = Scene::of(cube, n);
            let mesh = scene.mesh.mesh();
            let facets = Facets::of(&mesh.positions, &mesh.triangles);
            let hits = SurfaceElements::of_hits(&facets, &scene.images, &scene.region(), Scale::Counted);
            scene.measured(hits.area())
        });
    }
}

#[test]
fn mean_chord_of_a_ball_converges() {
    let lengths = |n| {
        let scene = Scene::of(ball(1.0), n);
        let lengths = chords(&scene, Phase::Solid).distribution(Weighting::Number, Counted::Complete).unwrap();
        (scene, lengths)
    };
    // The number of lattice rays that meet a disc differs a little from its area.
    converges("mean chord of a ball", 4.0 / 3.0, Within::Share(1e-2), [32, 64, 128], |n| {
        let (scene, lengths) = lengths(n);
        scene.measured(lengths.mean())
    });
    converges("SD of a ball's chords", SQRT_2 / 3.0, Within::Share(2e-2), [32, 64, 128], |n| {
        let (scene, lengths) = lengths(n);
        scene.measured(lengths.deviation())
    });
}

/// The mean chord is 2φ/P_L, where P_L counts crossings per length along the rays.
#[test]
fn mean_chord_of_pores_follows_from_the_crossing_density() {
    for (name, mesh) in [Surface::Gyroid, Surface::Primitive].map(|surface| (surface, network(surface, 1, 64))) {
        let closed = Scene::of(mesh.clone(), 128);
        let crossings = closed.of_surface(|surface| {
            DVec3::AXES.map(|axis| crossings_along(surface, 1.0, axis)).iter().sum::<f64>() / 3.0
        });
        let porosity = 1.0 - closed.mesh.mesh().signed_volume();
        converges(
            &format!("mean pore chord of {name:?}"),
            2.0 * porosity / crossings,
            Within::Share(0.01),
            [48, 96, 192],
            |n| {
                let scene = Scene::of(mesh.clone(), n);
                scene.measured(chords(&scene, Phase::Pore).mean().unwrap())
            },
        );
    }
}

#[test]
fn intercepts_of_an_ellipsoid_converge() {
    let axes = DVec3::new(3.0, 2.0, 1.0);
    let turn = DQuat::from_euler(EulerRot::XYZ, 0.4, 1.1, 2.3);
    // Only the mesh decides the value; the resolution is that of the mesh.
    let measured = |n: u32| {
        let mesh = moved(solids::geodesic(1.0, n).unwrap(), DAffine3::from_quat(turn) * DAffine3::from_scale(axes));
        let scene = Scene::of(mesh, 48);
        let fitted = scene.of_surface(|surface| anisotropy::Crossings::of(surface, 1.0).ellipsoid()).unwrap();
        (f64::from(n).recip(), fitted)
    };
    type Ratio = fn(&anisotropy::Anisotropy) -> f64;
    let ratios: [(&str, f64, Ratio); 3] = [
        ("MIL of an ellipsoid, a/c", 3.0, |fitted| fitted.half_axes[0] / fitted.half_axes[2]),
        ("MIL of an ellipsoid, b/c", 2.0, |fitted| fitted.half_axes[1] / fitted.half_axes[2]),
        ("DA of an ellipsoid", 1.0 - 1.0 / 9.0, |fitted| fitted.degree),
    ];
    for (name, exact, ratio) in ratios {
        converges(name, exact, Within::Difference(1e-3), [64, 96, 128], |n| {
            let (pitch, fitted) = measured(n);
            crate::convergence::Measured { value: ratio(&fitted), pitch }
        });
    }
}

#[test]
fn plates_are_anisotropic_and_a_cubic_lattice_is_isotropic() {
    // BoneJ asserts 1 ± 1e-4 for plates.
    converges("DA of plates", 1.0, Within::Difference(1e-4), [16, 32, 64], |n| {
        let plate = |z| moved(cuboid(DVec3::new(1.0, 1.0, 0.1)), DAffine3::from_translation(DVec3::new(0.0, 0.0, z)));
        let scene = Scene::of(together(&[-0.45, 0.0, 0.45].map(plate)), n);
        let fitted = scene.of_surface(|surface| anisotropy::Crossings::of(surface, 1.0).ellipsoid()).unwrap();
        scene.measured(fitted.degree)
    });
    converges("DA of rods along x, y and z", 0.0, Within::Difference(1e-3), [16, 32, 64], |n| {
        let rods = DVec3::AXES.map(|axis| {
            let turn = DQuat::from_rotation_arc(DVec3::Z, axis);
            let beside = turn * DVec3::new(0.25, 0.25, 0.0);
            moved(solids::cylinder(0.1, 1.0, 4 * n).unwrap(), DAffine3::from_rotation_translation(turn, beside))
        });
        let scene = Scene::of(together(&rods), 48);
        let fitted = scene.of_surface(|surface| anisotropy::Crossings::of(surface, 1.0).ellipsoid()).unwrap();
        crate::convergence::Measured { value: fitted.degree, pitch: f64::from(n).recip() }
    });
    // The mesh of merged struts is less symmetric between the axes than the struts; it approaches their symmetry as it is
    // refined.
    converges("DA of a cubic lattice", 0.0, Within::Difference(2e-2), [16, 32, 64], |n| {
        let scene = Scene::of(struts(2, 0.15, n), 2 * n);
        let fitted = scene.of_surface(|surface| anisotropy::Crossings::of(surface, 1.0).ellipsoid()).unwrap();
        scene.measured(fitted.degree)
    });
}

#[test]
fn centroid_and_moments_of_a_box_converge() {
    let size = DVec3::new(1.0, 2.0, 3.0);
    let middle = DVec3::new(0.3, -0.2, 5.0);
    let placed = |turn: DQuat| moved(cuboid(size), DAffine3::from_rotation_translation(turn, middle));
    let exact = 6.0 / 12.0 * (size.y * size.y + size.z * size.z);
    for (name, turn) in [("a box", DQuat::IDENTITY), ("a turned box", DQuat::from_euler(EulerRot::XYZ, 0.5, 0.3, 1.0))]
    {
        let moments = |n| {
            let scene = Scene::of(placed(turn), n);
            let moments = phase_moments(&scene.images, &scene.region(), Phase::Solid);
            (scene, moments)
        };
        converges(&format!("m(b² + c²)/12 of {name}"), exact, Within::Share(5e-3), [48, 96, 192], |n| {
            let (scene, moments) = moments(n);
            let axis = turn * DVec3::X;
            scene.measured(axis.dot(moments.inertia * axis))
        });
        converges(&format!("centroid of {name}, off by"), 0.0, Within::Pitches(0.05), [48, 96, 192], |n| {
            let (scene, moments) = moments(n);
            scene.measured(moments.centroid.distance(middle))
        });
    }
}

#[test]
fn overhang_of_a_ball_and_a_lying_cylinder_converges() {
    let shared = |scene: &Scene, build| {
        scene.of_surface(|surface| overhang(surface, build, 45.0, Plate::Counted)).unwrap().share
    };
    let exact = 0.5 * (1.0 - FRAC_1_SQRT_2);
    assert!((exact - 0.1464).abs() < 1e-4);
    // Each facet counts as a whole, so the error is that of a polygon's edge.
    converges("overhang of a ball", exact, Within::Difference(2e-3), [32, 64, 128], |n| {
        let scene = Scene::of(solids::geodesic(1.0, n).unwrap(), 48);
        crate::convergence::Measured { value: shared(&scene, DVec3::new(0.3, 0.2, 1.0)), pitch: f64::from(n).recip() }
    });
    converges("overhang of a lying cylinder", 0.25, Within::Difference(6e-3), [180, 360, 720], |n| {
        let scene = Scene::of(solids::cylinder(0.5, 2.0, n).unwrap(), 48);
        crate::convergence::Measured { value: shared(&scene, DVec3::new(0.31, 0.95, 0.0)), pitch: f64::from(n).recip() }
    });
}

/// ∫K dA = 2πχ of the surface, which is twice the χ of the solid; checked on a periodic cell and on a ball.
#[test]
fn gauss_curvature_gives_the_euler_characteristic() {
    let of = |scene: &Scene, edges| {
        let mesh = scene.mesh.mesh();
        curvature(&Facets::of(&mesh.positions, &mesh.triangles), &scene.region(), edges).unwrap()
    };
    let cells = [
        ("gyroid", -4.0, [16, 24, 32].map(|n| network(Surface::Gyroid, 1, n))),
        ("primitive", -2.0, [16, 24, 32].map(|n| network(Surface::Primitive, 1, n))),
        ("diamond", -8.0, [16, 24, 32].map(|n| network(Surface::Diamond, 1, n))),
        ("struts", -2.0, [16, 24, 32].map(|n| struts(1, 0.15, n))),
    ];
    for (name, exact, meshes) in cells {
        let mut meshes = meshes.into_iter();
        converges(&format!("∫K/4π of a cell, {name}"), exact, Within::Difference(1e-6), [16, 24, 32], |_| {
            let scene = Scene::of(meshes.next().unwrap(), 32);
            scene.measured(of(&scene, BoundaryCondition::Periodic).gauss / (2.0 * TAU))
        });
    }
    converges("∫K/4π of a ball", 1.0, Within::Difference(1e-9), [8, 16, 32], |n| {
        let scene = Scene::of(solids::geodesic(2.0, n).unwrap(), 32);
        scene.measured(of(&scene, BoundaryCondition::Clip).gauss / (2.0 * TAU))
    });
    converges("∫H of a ball of radius 2", 8.0 * PI, Within::Share(5e-3), [8, 16, 32], |n| {
        let scene = Scene::of(solids::geodesic(2.0, n).unwrap(), 32);
        crate::convergence::Measured { value: of(&scene, BoundaryCondition::Clip).mean, pitch: f64::from(n).recip() }
    });
}

/// Each ray through a slab at right angles to it has one chord, and the box cuts none of these chords.
#[test]
fn chords_of_a_slab_equal_its_thickness() {
    converges("chords along z of a slab", 0.3, Within::Pitches(1e-4), [16, 32, 64], |n| {
        let ball = |x: f64| moved(ball(0.1), DAffine3::from_translation(DVec3::new(x, 0.0, x)));
        let scene = Scene::of(together(&[cuboid(DVec3::new(1.0, 1.0, 0.3)), ball(0.8), ball(-0.8)]), n);
        let chords =
            Chords::along(&scene.images[Axis::Z.depth()], &scene.region(), Phase::Solid, BoundaryCondition::Clip);
        scene.measured(chords.distribution(Weighting::Length, Counted::Complete).unwrap().quantile(0.9))
    });
}
