//! Boxes with hollows, at random places against the raster.

use super::*;
use crate::solids::cuboid;
use crate::testing::meshes::{hollowed, together};
use crate::testing::random::Random;

/// The pitch of all rasters.
const PITCH: f64 = 0.1;

fn point(random: &mut Random, from: f64, to: f64) -> DVec3 {
    DVec3::from_array([(); 3].map(|()| from + (to - from) * random.share()))
}

/// A cube of side 1 with a hollow.
fn hollow(min: DVec3, max: DVec3) -> TriangleMesh {
    hollowed(cuboid(DVec3::ZERO, DVec3::ONE).unwrap(), &cuboid(min, max).unwrap())
}

#[test]
fn cavities_that_a_sum_leaves_between_the_rays_are_found_with_place_and_size() {
    let mut random = Random::new(1);
    let mut found = 0;
    for _ in 0..100 {
        let tool = point(&mut random, 0.01, 0.06);
        // What the tool leaves of the hollow: 0.15 to 0.9 pitches.
        let left = point(&mut random, 0.15 * PITCH, 0.9 * PITCH);
        let corner = point(&mut random, 0.42, 0.5);
        let b = cuboid(DVec3::ZERO, tool).unwrap();
        let search = of_sum(hollow(corner, corner + left + tool), b, Exterior::Out, PITCH);
        let (min, max) = (corner + tool, corner + tool + left);
        found += i32::from(search.is_found(false, min, max));
    }
    assert!((20..100).contains(&found), "{found}");
}

#[test]
fn cavities_that_an_offset_leaves_between_the_rays_are_found_with_place_and_size() {
    let mut random = Random::new(2);
    let mut found = 0;
    for _ in 0..100 {
        let radius = 0.01 + 0.03 * random.share();
        let left = point(&mut random, 0.15 * PITCH, 0.9 * PITCH);
        let corner = point(&mut random, 0.42, 0.5);
        let search = of_ball(hollow(corner, corner + left + 2.0 * radius), radius, PITCH);
        let (min, max) = (corner + radius, corner + radius + left);
        found += i32::from(search.is_found(false, min, max));
    }
    assert!((20..100).contains(&found), "{found}");
}

#[test]
fn cavities_that_vanish_are_not_reported() {
    let mut random = Random::new(3);
    for _ in 0..30 {
        let side = point(&mut random, 0.03, 0.09);
        let corner = point(&mut random, 0.42, 0.5);
        let radius = 0.52 * side.min_element();
        assert_eq!(of_ball(hollow(corner, corner + side), radius, PITCH).found.details, []);
        // The tool is larger than the hollow along x, and smaller along y and z.
        let b = cuboid(DVec3::ZERO, side * DVec3::new(1.05, 0.5, 0.5)).unwrap();
        let search = of_sum(hollow(corner, corner + side), b, Exterior::Out, PITCH);
        assert!(search.found.is_complete);
        assert_eq!(search.found.details, []);
    }
}

/// Two cubes: the first one shrinks to a core of known size, and the second one keeps the raster where it is.
fn two_cubes(min: DVec3, max: DVec3) -> TriangleMesh {
    together(&[cuboid(min, max).unwrap(), cuboid(DVec3::ZERO, DVec3::splat(0.6)).unwrap()])
}

#[test]
fn cores_that_shrinking_leaves_between_the_rays_are_found_with_place_and_size() {
    let mut random = Random::new(4);
    let mut found = 0;
    for round in 0..100 {
        let radius = 0.08 + 0.03 * random.share();
        let left = point(&mut random, 0.15 * PITCH, 0.9 * PITCH);
        let corner = point(&mut random, 1.0, 1.1);
        // By a ball, then by a box of the same reach.
        let solid = two_cubes(corner, corner + left + 2.0 * radius);
        let search = match round % 2 {
            0 => of_ball(solid, -radius, PITCH),
            _ => {
                let b = cuboid(DVec3::splat(-radius), DVec3::splat(radius)).unwrap();
                of_sum(solid, b, Exterior::In, PITCH)
            }
        };
        let (min, max) = (corner + radius, corner + radius + left);
        found += i32::from(search.is_found(true, min, max));
    }
    assert!((20..100).contains(&found), "{found}");
}

#[test]
fn cores_that_vanish_are_not_reported() {
    let mut random = Random::new(5);
    for _ in 0..30 {
        let (corner, side) = (point(&mut random, 1.0, 1.1), point(&mut random, 0.15, 0.25));
        let search = of_ball(two_cubes(corner, corner + side), -0.51 * side.min_element(), PITCH);
        assert_eq!(search.found.details, []);
    }
}

#[test]
fn a_slot_between_the_rays_is_one_detail_over_all_its_length() {
    let mut random = Random::new(6);
    let mut found = 0;
    for _ in 0..60 {
        let radius = 0.02;
        let thin = point(&mut random, 0.2 * PITCH, 0.8 * PITCH);
        let left = DVec3::new(0.45, thin.y, thin.z);
        let corner = DVec3::new(0.25, 0.45, 0.45) + point(&mut random, 0.0, PITCH);
        let (min, max) = (corner + radius, corner + radius + left);
        for search in [
            of_ball(hollow(corner, corner + left + 2.0 * radius), radius, PITCH),
            of_sum(
                hollow(corner, corner + left + 2.0 * radius),
                cuboid(DVec3::splat(-radius), DVec3::splat(radius)).unwrap(),
                Exterior::Out,
                PITCH,
            ),
        ] {
            if !search.is_met(min, max) {
                search.is_one(false, min, max);
                found += 1;
            }
        }
    }
    assert!(found > 10, "{found}");
}

#[test]
fn a_wall_between_two_hidden_voids_lies_within_the_box_of_both() {
    let (corner, side, wall, radius) = (DVec3::new(0.46, 0.46, 0.46), 0.02, 0.01, 0.004);
    let first = cuboid(corner, corner + side).unwrap();
    let next = corner + DVec3::X * (side + wall);
    let second = cuboid(next, next + side).unwrap();
    let search = of_ball(hollowed(hollow(corner, corner + side), &second), radius, PITCH);
    assert!(first.triangles.len() == 12 && !search.is_met(corner, next + side));
    let (min, max) = (corner + radius, next + side - radius);
    assert_eq!(search.found.details.len(), 1);
    let detail = search.found.details[0];
    let near = |a: DVec3, b: DVec3| (a - b).abs().max_element() <= PITCH / 16.0;
    assert!(near(detail.place, 0.5 * (min + max)) && near(detail.size, max - min), "{detail:?}");
    // The wall is not part of the volume.
    assert!(detail.volume < 0.8 * (max - min).element_product() + PITCH.powi(3) / 512.0, "{detail:?}");
}

/// A plate with a square hole, as eight boxes would be, but one surface.
fn plate_with_hole(min: [f64; 2], max: [f64; 2]) -> TriangleMesh {
    let (low, high) = (DVec3::ZERO, DVec3::new(1.2, 1.2, 0.6));
    let square = |a: [f64; 2], b: [f64; 2], z: f64| {
        [[a[0], a[1]], [b[0], a[1]], [b[0], b[1]], [a[0], b[1]]].map(|[x, y]| DVec3::new(x, y, z))
    };
    let mut positions = Vec::new();
    for z in [low.z, high.z] {
        positions.extend(square([low.x, low.y], [high.x, high.y], z));
        positions.extend(square(min, max, z));
    }
    let mut triangles = Vec::new();
    for i in 0..4u32 {
        let j = (i + 1) % 4;
        let mut side = |a: u32, b: u32, c: u32, d: u32| triangles.extend([[a, b, c], [a, c, d]]);
        // Below, above, outside, inside the hole.
        side(j, i, 4 + i, 4 + j);
        side(8 + i, 8 + j, 12 + j, 12 + i);
        side(i, j, 8 + j, 8 + i);
        side(4 + j, 4 + i, 12 + i, 12 + j);
    }
    TriangleMesh { positions, triangles }
}

#[test]
fn a_pinhole_through_a_plate_is_found_where_it_is_far_from_the_faces() {
    let mut random = Random::new(7);
    let ell = crate::solids::ell(DVec3::splat(0.03), [0.02, 0.01]).unwrap();
    let (bounds, mut found) = (ell.bounds().unwrap(), 0);
    for _ in 0..40 {
        let corner = point(&mut random, 0.5, 0.6);
        let min = [corner.x, corner.y];
        let max = min.map(|low| low + 0.06);
        let search = of_sum(plate_with_hole(min, max), ell.clone(), Exterior::Out, PITCH);
        // The ell is as long as its box along x and y.
        let left = DVec3::new(min[0], min[1], 0.0) + bounds.max;
        let right = DVec3::new(max[0], max[1], 0.6) + bounds.min;
        if !search.is_met(left, right) {
            assert_eq!(search.found.details.len(), 1, "{min:?} {:?}", search.found);
            let detail = search.found.details[0];
            assert!(
                !detail.is_solid && detail.size.z > 0.3 && detail.size.max_element() == detail.size.z,
                "{detail:?}"
            );
            found += 1;
        }
    }
    assert!(found > 10, "{found}");
}
