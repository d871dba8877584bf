//! Bounds of offsets compared with closed forms.

use std::f64::consts::PI;

use super::super::half_space;
use super::*;
use crate::solids;
use crate::testing::meshes::{cube, hollowed};

fn offset(mesh: &TriangleMesh, distance: f64, pitch: f64) -> CertifiedVolume {
    let found = certified_offset(&ClosedMesh::check(mesh.clone()).unwrap(), distance, pitch).unwrap();
    assert!(found.lower <= found.upper && found.lower >= 0.0 && found.reached, "{found:?}");
    found
}

/// Returns the volume of a box that is grown by a ball (Steiner).
fn grown(size: DVec3, radius: f64) -> f64 {
    let DVec3 { x, y, z } = size;
    let area = 2.0 * (x * y + y * z + z * x);
    x * y * z + area * radius + PI * radius * radius * (x + y + z) + 4.0 / 3.0 * PI * radius.powi(3)
}

#[test]
fn bounds_contain_the_volumes_of_offset_boxes() {
    let mut random = Random::new(21);
    for case in 0..300 {
        let size = DVec3::from_array([(); 3].map(|()| [1.0, 0.3, 1e-3][random.below(3)] * (0.5 + random.share())));
        let turn = if case % 3 == 0 { DMat3::IDENTITY } else { random_turn(&mut random) };
        let shift = DVec3::splat([0.0, 100.0][random.below(2)]);
        let mesh = moved(mapped(solids::cuboid(-0.5 * size, 0.5 * size).unwrap(), turn), shift);
        let radius = [0.02, 0.1, 0.4][random.below(3)];
        let pitch = [0.3, 0.1][random.below(2)];
        assert_contains(offset(&mesh, radius, pitch), grown(size, radius), 1.0 + shift.x, &(case, size, radius));
        let left = (size - 2.0 * radius).max(DVec3::ZERO).element_product();
        assert_contains(offset(&mesh, -radius, pitch), left, 1.0 + shift.x, &(case, size, -radius));
    }
}

#[test]
fn bounds_contain_the_volumes_of_offset_hollows() {
    let mesh = hollowed(cube(DVec3::ZERO, 3.0), &cube(DVec3::ONE, 1.0));
    let hollow = |radius: f64| (1.0 - 2.0 * radius).max(0.0).powi(3);
    for radius in [0.1, 0.3, 0.6] {
        let outwards = grown(DVec3::splat(3.0), radius) - hollow(radius);
        assert_contains(offset(&mesh, radius, 0.1), outwards, 27.0, &radius);
        let inwards = (3.0 - 2.0 * radius).powi(3) - grown(DVec3::ONE, radius);
        if radius < 0.5 {
            assert_contains(offset(&mesh, -radius, 0.1), inwards, 27.0, &-radius);
        }
    }
}

#[test]
fn the_width_of_an_offset_falls_with_the_square_of_the_pitch() {
    let solids = [
        ("cube", turned(cube(DVec3::splat(-0.5), 1.0), DVec3::new(1.0, 2.0, 3.0), 0.7)),
        ("torus", solids::torus(0.6, 0.2, 40, 20).unwrap()),
    ];
    for (name, mesh) in solids {
        for distance in [0.15, -0.15] {
            let widths = [1.0 / 16.0, 1.0 / 64.0].map(|pitch| {
                let found = offset(&mesh, distance, pitch);
                found.upper - found.lower
            });
            let order = (widths[0] / widths[1]).log2() / 2.0;
            println!("offset of a {name} by {distance}: {widths:?}, order {order:.3}");
            assert!(order > 1.5, "{name} {distance} {widths:?}");
        }
    }
}

#[test]
fn solids_whose_triangles_meet_are_refused() {
    let two = crate::testing::meshes::together(&[cube(DVec3::ZERO, 1.0), cube(DVec3::splat(0.5), 1.0)]);
    let refused = certified_offset(&ClosedMesh::check(two).unwrap(), 0.1, 0.1);
    assert_eq!(refused, Err(CertifiedError::NotSimple));
}

#[test]
fn shares_of_half_spaces_are_those_of_points() {
    let mut random = Random::new(22);
    for case in 0..400 {
        let half = DVec3::from_array([(); 3].map(|()| 0.1 + random.share()));
        let mut normal = DVec3::from_array([(); 3].map(|()| random.unit() * [1.0, 1e-3, 1e-9][random.below(3)]));
        normal /= normal.length().max(1e-300);
        let depth = 1.5 * random.unit();
        let [low, high] = half_space::share(normal, depth, half);
        let count = 24;
        let all = (0..count * count * count).map(|i| [i % count, i / count % count, i / count / count]);
        let inside = all.filter(|cell| {
            let at = DVec3::from_array(cell.map(|i| (2.0 * (f64::from(i) + 0.5) / f64::from(count)) - 1.0));
            normal.dot(at * half) <= depth
        });
        let share = inside.count() as f64 / f64::from(count).powi(3);
        // A slab of points is on either side of a plane across an axis.
        assert!(low - 0.05 <= share && share <= high + 0.05, "{case} {normal} {depth} {half}: {share} {low} {high}");
        assert!(high - low < 1e-3 && low <= high, "{low} {high}");
        let [back_low, back_high] = half_space::share(-normal, -depth, half);
        assert!(
            low + back_low <= 1.0 + 1e-15 && high + back_high >= 1.0 - 1e-15,
            "{low} {high} {back_low} {back_high}"
        );
    }
    let unit = DVec3::splat(0.5);
    let exact = |normal, depth| half_space::share(normal, depth, unit);
    for (normal, depth, known) in [
        (DVec3::X, 0.25, 0.75),
        (DVec3::new(0.6, 0.8, 0.0), 0.0, 0.5),
        (DVec3::ONE / 3f64.sqrt(), -0.5 / 3f64.sqrt(), 1.0 / 6.0),
    ] {
        let [low, high] = exact(normal, depth);
        assert!(low <= known && known <= high && high - low < 1e-9, "{normal} {depth}: {low} {high}");
    }
    assert_eq!((exact(DVec3::Y, 0.6), exact(DVec3::Y, -0.6)), ([1.0; 2], [0.0; 2]));
    assert_eq!(exact(DVec3::ZERO, -0.1), [0.0; 2]);
}
