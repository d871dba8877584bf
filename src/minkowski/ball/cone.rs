//! The outward normals of a vertex, as a polygon on the unit sphere.

use glam::DVec3;

/// Returns the corners of the convex spherical polygon of the unit vectors n with n·d ≤ 0 for all of `directions`, which are
/// unit vectors; empty where there is no such n, or only a line of them. An approximation to about 1e-15.
pub fn polygon(directions: &[DVec3]) -> Vec<DVec3> {
    let Some((first, rest)) = directions.split_first() else { return Vec::new() };
    let by_slant = |a: &&DVec3, b: &&DVec3| first.dot(**a).abs().total_cmp(&first.dot(**b).abs());
    let second = rest.iter().min_by(by_slant).copied().unwrap_or(*first);
    let mut corners = match directions.iter().all(|direction| first.distance(*direction) < PARALLEL) {
        true => return hemisphere(*first),
        false => lune(*first, second),
    };
    let mut clipped = Vec::with_capacity(8);
    for &direction in directions {
        if direction != *first && direction != second {
            clip(&corners, direction, &mut clipped);
            std::mem::swap(&mut corners, &mut clipped);
        }
        if corners.len() < 3 {
            return Vec::new();
        }
    }
    corners
}

/// Distance below which unit vectors count as equal: those of edges on one line differ by rounding.
const PARALLEL: f64 = 1e-14;

/// Returns the corners of a half-space.
fn hemisphere(away_from: DVec3) -> Vec<DVec3> {
    let (u, v) = away_from.any_orthonormal_pair();
    vec![u, v, -u, -v]
}

/// Returns the intersection of two half-spaces.
fn lune(first: DVec3, second: DVec3) -> Vec<DVec3> {
    let Some(end) = first.cross(second).try_normalize() else { return Vec::new() };
    let cosine = first.dot(second);
    let in_plane = |of: DVec3, other: DVec3| (of * cosine - other).normalize_or_zero();
    vec![end, in_plane(first, second), -end, in_plane(second, first)]
}

/// Clips a polygon to n·direction ≤ 0.
fn clip(corners: &[DVec3], direction: DVec3, clipped: &mut Vec<DVec3>) {
    clipped.clear();
    for (i, &corner) in corners.iter().enumerate() {
        let next = corners[(i + 1) % corners.len()];
        let (above, then) = (corner.dot(direction), next.dot(direction));
        if above <= 0.0 {
            clipped.push(corner);
        }
        if above * then < 0.0 {
            clipped.push((corner * then.abs() + next * above.abs()).normalize_or_zero());
        }
    }
    // A side of nearly half a turn, all of it on the clipping plane, gets a corner in its middle.
    let long = (0..clipped.len()).find(|&i| clipped[i].dot(clipped[(i + 1) % clipped.len()]) < -0.7);
    if let Some(i) = long {
        let across = direction.cross(clipped[i]).normalize_or_zero();
        let inside: DVec3 = corners.iter().sum();
        clipped.insert(i + 1, if across.dot(inside) < 0.0 { -across } else { across });
    }
}

/// Returns the mean width of a polygon, in radians: zero for one that is a line.
pub fn width(corners: &[DVec3]) -> f64 {
    let pairs = || corners.iter().zip(corners.iter().cycle().skip(1));
    let area: DVec3 = pairs().map(|(a, b)| a.cross(*b)).sum();
    let perimeter: f64 = pairs().map(|(a, b)| a.distance(*b)).sum();
    if perimeter > 0.0 { area.length() / perimeter } else { 0.0 }
}

/// Returns a box around a polygon that bounds `directions` from below.
pub fn bounds(corners: &[DVec3], directions: &[DVec3]) -> (DVec3, DVec3) {
    let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        // A point of the arc between two corners is one of the chord, scaled by at most the factor in the middle.
        let half = (0.5 * (1.0 + a.dot(*b))).max(0.0).sqrt();
        let stretch = 1.0 / half.max(1e-3);
        let (low, high) = (a.min(*b), a.max(*b));
        least = least.min(low).min(low * stretch);
        most = most.max(high).max(high * stretch);
    }
    for axis in DVec3::AXES {
        let holds = |normal: DVec3| directions.iter().all(|direction| direction.dot(normal) <= 0.0);
        if holds(axis) {
            most = most.max(axis);
        }
        if holds(-axis) {
            least = least.min(-axis);
        }
    }
    (least.max(DVec3::NEG_ONE), most.min(DVec3::ONE))
}
