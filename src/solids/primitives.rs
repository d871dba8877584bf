//! Cuboid, sphere, cylinder, hyperboloid and torus, tessellated along their own parameters.
//!
//! Vertices lie on the true surface, so a curved solid is inscribed: its volume approaches the closed form from below
//! as segments grow (torus and hyperboloid approach it from either side).

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::{SolidError, check_length, check_range, check_triangles};
use crate::mesh::TriangleMesh;

/// Returns the box between two corners: 12 triangles.
///
/// # Errors
/// Fails if a coordinate of `max` is not above that of `min`, or is not finite.
pub fn cuboid(min: DVec3, max: DVec3) -> Result<TriangleMesh, SolidError> {
    for (parameter, low, high) in [("max x", min.x, max.x), ("max y", min.y, max.y), ("max z", min.z, max.z)] {
        if !(low.is_finite() && high.is_finite() && low < high) {
            let allowed = format!("finite and above the least coordinate {low}");
            return Err(SolidError::OutOfRange { parameter, value: high, allowed });
        }
    }
    let positions = (0..8)
        .map(|corner| {
            let pick = |axis: usize| if (corner >> axis) & 1 == 1 { max[axis] } else { min[axis] };
            DVec3::new(pick(0), pick(1), pick(2))
        })
        .collect();
    let mut triangles = Vec::with_capacity(12);
    for [a, b, c, d] in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    Ok(TriangleMesh { positions, triangles })
}

/// Returns a sphere about the origin with `segments` meridians and half as many zones; `2 segments (segments / 2 − 1)`
/// triangles.
///
/// Triangles crowd at the poles; those of [`geodesic`](super::geodesic()) are more even.
///
/// # Errors
/// Fails for a radius that is not a length, and `segments` below 4 or with too many triangles.
pub fn sphere(radius: f64, segments: u32) -> Result<TriangleMesh, SolidError> {
    check_length("radius", radius)?;
    check_range("segments", segments.into(), 4.0, 1e6)?;
    let zones = segments / 2;
    check_triangles("segments", segments, 2 * u64::from(segments) * u64::from(zones - 1))?;
    let profile = (1..zones).map(|i| {
        let (sin, cos) = (PI * f64::from(i) / f64::from(zones)).sin_cos();
        (radius * sin, -radius * cos)
    });
    Ok(revolve(profile, (-radius, radius), segments))
}

/// Returns a cylinder about the z axis, centred on the origin; `4 segments` triangles.
///
/// # Errors
/// Fails for a radius or height that is not a length, and `segments` below 3 or with too many triangles.
pub fn cylinder(radius: f64, height: f64, segments: u32) -> Result<TriangleMesh, SolidError> {
    check_length("radius", radius)?;
    check_length("height", height)?;
    check_range("segments", segments.into(), 3.0, 1e9)?;
    check_triangles("segments", segments, 4 * u64::from(segments))?;
    let half = height / 2.0;
    Ok(revolve([(radius, -half), (radius, half)].into_iter(), (-half, half), segments))
}

/// Returns the solid inside a hyperboloid of one sheet about the z axis, between planes: of radius `waist` in the
/// middle and `rim` at either end. It is saddle-shaped everywhere on its side. Its volume tends to π height (2 waist² +
/// rim²) / 3. `2 segments (zones + 1)` triangles.
///
/// # Errors
/// Fails for a radius or height that is not a length, a `waist` not below the `rim`, fewer than 3 segments or 2 zones,
/// and too many triangles.
pub fn hyperboloid(waist: f64, rim: f64, height: f64, segments: u32, zones: u32) -> Result<TriangleMesh, SolidError> {
    check_length("waist", waist)?;
    check_length("rim", rim)?;
    check_length("height", height)?;
    if waist >= rim {
        let allowed = format!("below the rim radius {rim}");
        return Err(SolidError::OutOfRange { parameter: "waist", value: waist, allowed });
    }
    check_range("segments", segments.into(), 3.0, 1e9)?;
    check_range("zones", zones.into(), 2.0, 1e9)?;
    check_triangles("segments", segments, 2 * u64::from(segments) * (u64::from(zones) + 1))?;
    let half = height / 2.0;
    let profile = (0..=zones).map(|i| {
        let t = 2.0 * f64::from(i) / f64::from(zones) - 1.0;
        ((waist * waist + t * t * (rim * rim - waist * waist)).sqrt(), t * half)
    });
    Ok(revolve(profile, (-half, half), segments))
}

/// Returns a torus about the z axis: a tube of radius `minor` whose centre lies on a circle of radius `major`, with
/// `around` segments along the large circle and `across` along the small one; `2 around across` triangles.
///
/// # Errors
/// Fails for a radius that is not a length, a `minor` radius not below the `major` one, fewer than 3 segments, and too
/// many triangles.
pub fn torus(major: f64, minor: f64, around: u32, across: u32) -> Result<TriangleMesh, SolidError> {
    check_length("major", major)?;
    check_length("minor", minor)?;
    if minor >= major {
        let allowed = format!("below the major radius {major}");
        return Err(SolidError::OutOfRange { parameter: "minor", value: minor, allowed });
    }
    check_range("around", around.into(), 3.0, 1e9)?;
    check_range("across", across.into(), 3.0, 1e9)?;
    check_triangles("around", around, 2 * u64::from(around) * u64::from(across))?;
    let mut positions = Vec::with_capacity(around as usize * across as usize);
    for i in 0..around {
        let out = DVec3::from((direction(i, around), 0.0));
        for j in 0..across {
            let section = direction(j, across);
            positions.push((major + minor * section.x) * out + minor * section.y * DVec3::Z);
        }
    }
    let at = |i: u32, j: u32| (i % around) * across + j % across;
    let mut triangles = Vec::with_capacity(2 * positions.len());
    for i in 0..around {
        for j in 0..across {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    Ok(TriangleMesh { positions, triangles })
}

/// Returns the unit vector at `step` of `steps` round the circle.
fn direction(step: u32, steps: u32) -> glam::DVec2 {
    glam::DVec2::from_angle(TAU * f64::from(step) / f64::from(steps))
}

/// Revolves a profile of (radius, z), z rising, about the z axis and closes it with a pole of given z at either end.
fn revolve(profile: impl Iterator<Item = (f64, f64)>, poles: (f64, f64), segments: u32) -> TriangleMesh {
    let mut positions = vec![DVec3::new(0.0, 0.0, poles.0), DVec3::new(0.0, 0.0, poles.1)];
    let mut rings = 0;
    for (radius, z) in profile {
        positions.extend((0..segments).map(|i| DVec3::from((radius * direction(i, segments), z))));
        rings += 1;
    }
    let at = |ring: u32, i: u32| 2 + ring * segments + i % segments;
    let mut triangles = Vec::with_capacity(2 * segments as usize * rings as usize);
    triangles.extend((0..segments).map(|i| [0, at(0, i + 1), at(0, i)]));
    for ring in 1..rings {
        for i in 0..segments {
            let (a, b, c, d) = (at(ring - 1, i), at(ring - 1, i + 1), at(ring, i + 1), at(ring, i));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    triangles.extend((0..segments).map(|i| [1, at(rings - 1, i), at(rings - 1, i + 1)]));
    TriangleMesh { positions, triangles }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::closure::{assert_solid, euler_characteristic, volume};

    #[test]
    fn cuboid_is_exact() {
        let mesh = cuboid(DVec3::new(-1.0, 0.5, 2.0), DVec3::new(2.0, 1.5, 4.0)).unwrap();
        assert_solid(&mesh);
        assert_eq!(volume(&mesh), 6.0);
        assert_eq!(euler_characteristic(&mesh), 2);
    }

    #[test]
    fn curved_solids_converge_to_their_closed_forms() {
        let cases: [(f64, &dyn Fn(u32) -> TriangleMesh); 4] = [
            (4.0 / 3.0 * PI * 8.0, &|n| sphere(2.0, n).unwrap()),
            (PI * 4.0 * 3.0, &|n| cylinder(2.0, 3.0, n).unwrap()),
            (PI * 4.0 * (2.0 * 1.0 + 4.0) / 3.0, &|n| hyperboloid(1.0, 2.0, 4.0, n, n).unwrap()),
            (2.0 * PI * PI * 3.0, &|n| torus(3.0, 1.0, n, n).unwrap()),
        ];
        for (exact, build) in cases {
            let errors = [16, 64].map(|n| {
                let mesh = build(n);
                assert_solid(&mesh);
                (volume(&mesh) / exact - 1.0).abs()
            });
            assert!(errors[1] < 0.005 && errors[1] < errors[0] / 12.0, "{errors:?}");
        }
    }

    #[test]
    fn coarsest_shapes_are_solids_of_the_right_genus() {
        for (mesh, chi) in [
            (sphere(1.0, 4).unwrap(), 2),
            (sphere(1.0, 5).unwrap(), 2),
            (cylinder(1.0, 1.0, 3).unwrap(), 2),
            (hyperboloid(1.0, 2.0, 1.0, 3, 2).unwrap(), 2),
            (torus(2.0, 1.0, 3, 3).unwrap(), 0),
        ] {
            assert_solid(&mesh);
            assert_eq!(euler_characteristic(&mesh), chi);
        }
    }

    #[test]
    fn triangle_counts_are_as_documented() {
        assert_eq!(sphere(1.0, 10).unwrap().triangles.len(), 2 * 10 * 4);
        assert_eq!(cylinder(1.0, 1.0, 10).unwrap().triangles.len(), 40);
        assert_eq!(hyperboloid(1.0, 2.0, 1.0, 10, 6).unwrap().triangles.len(), 140);
        assert_eq!(torus(2.0, 1.0, 10, 7).unwrap().triangles.len(), 140);
    }

    #[test]
    fn wrong_parameters_are_named_with_value_and_range() {
        let text = |result: Result<TriangleMesh, SolidError>| result.unwrap_err().to_string();
        assert!(
            text(cuboid(DVec3::ZERO, DVec3::new(1.0, 0.0, 1.0)))
                .starts_with("max y is 0, but must be finite and above")
        );
        assert_eq!(text(sphere(-1.0, 8)), "radius is -1, but must be from 0.000000001 to 1000000000");
        assert!(text(sphere(f64::NAN, 8)).starts_with("radius is NaN"));
        assert!(text(cylinder(1.0, 1.0, 2)).starts_with("segments is 2, but must be from 3"));
        assert_eq!(text(hyperboloid(2.0, 1.0, 1.0, 8, 8)), "waist is 2, but must be below the rim radius 1");
        assert_eq!(text(torus(1.0, 2.0, 8, 8)), "minor is 2, but must be below the major radius 1");
        assert_eq!(
            text(torus(2.0, 1.0, 10_000, 10_000)),
            "around = 10000 gives 200000000 triangles, but at most 50000000 are allowed"
        );
    }
}
