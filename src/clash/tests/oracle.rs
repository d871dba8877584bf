//! The distance of two triangles with integer corners in exact rational arithmetic, by its definition: the least over
//! all points, which is that of two features whose feet lie within both. Shares no code with the library.

type Point = [i128; 3];

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Point, b: Point) -> i128 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Returns the square of the distance of a point and a segment.
fn point_segment(p: Point, a: Point, b: Point) -> f64 {
    let (along, to) = (minus(b, a), minus(p, a));
    let (length, covered) = (dot(along, along), dot(to, along));
    if covered <= 0 || length == 0 {
        return dot(to, to) as f64;
    }
    if covered >= length {
        let to = minus(p, b);
        return dot(to, to) as f64;
    }
    // |to × along|² / |along|², in which nothing cancels.
    let area = cross(to, along);
    area.iter().map(|&side| side as f64 * side as f64).sum::<f64>() / length as f64
}

/// Returns the square of the distance of the lines of two segments, if their feet lie within both.
fn segment_segment([a, b]: [Point; 2], [c, d]: [Point; 2]) -> Option<f64> {
    let (u, v, r) = (minus(b, a), minus(d, c), minus(c, a));
    let normal = cross(u, v);
    let scale = dot(normal, normal);
    let (s, t) = (dot(cross(r, v), normal), dot(cross(r, u), normal));
    let is_within = |share: i128| scale > 0 && (0..=scale).contains(&share);
    (is_within(s) && is_within(t)).then(|| {
        let height = dot(r, normal) as f64;
        height * height / scale as f64
    })
}

/// Returns the square of the distance of a point and the plane of a triangle, if the foot lies within it.
fn point_face(p: Point, [a, b, c]: [Point; 3]) -> Option<f64> {
    let normal = cross(minus(b, a), minus(c, a));
    let is_left = |from: Point, to: Point| dot(cross(minus(to, from), minus(p, from)), normal) >= 0;
    (normal != [0; 3] && is_left(a, b) && is_left(b, c) && is_left(c, a)).then(|| {
        let height = dot(minus(p, a), normal) as f64;
        height * height / dot(normal, normal) as f64
    })
}

/// Returns whether a segment crosses the plane of a triangle within it.
fn pierces([p, q]: [Point; 2], [a, b, c]: [Point; 3]) -> bool {
    let normal = cross(minus(b, a), minus(c, a));
    let (from, to) = (dot(minus(p, a), normal), dot(minus(q, a), normal));
    if from.signum() * to.signum() >= 0 {
        // Ends in the plane are points whose distance is 0.
        return false;
    }
    let along = minus(q, p);
    let side = |i: Point, j: Point| dot(cross(minus(i, p), minus(j, p)), along).signum();
    let sides = [side(a, b), side(b, c), side(c, a)];
    !(sides.contains(&1) && sides.contains(&-1))
}

/// Returns the square of the distance of two triangles.
pub fn squared_distance(a: [[i64; 3]; 3], b: [[i64; 3]; 3]) -> f64 {
    let [a, b] = [a, b].map(|triangle| triangle.map(|corner| corner.map(i128::from)));
    let sides = |[a, b, c]: [Point; 3]| [[a, b], [b, c], [c, a]];
    let mut least = f64::INFINITY;
    for (one, other) in [(a, b), (b, a)] {
        for corner in other {
            least = least.min(point_face(corner, one).unwrap_or(f64::INFINITY));
            for [from, to] in sides(one) {
                least = least.min(point_segment(corner, from, to));
            }
        }
        if sides(other).into_iter().any(|side| pierces(side, one)) {
            return 0.0;
        }
    }
    for side in sides(a) {
        for other in sides(b) {
            least = least.min(segment_segment(side, other).unwrap_or(f64::INFINITY));
        }
    }
    least
}

#[test]
fn known_distances_are_found() {
    let flat = [[0, 0, 0], [4, 0, 0], [0, 4, 0]];
    let lifted = |z: i64| flat.map(|[x, y, _]| [x, y, z]);
    assert_eq!(squared_distance(flat, lifted(3)), 9.0);
    assert_eq!(squared_distance(flat, flat), 0.0);
    assert_eq!(squared_distance(flat, [[1, 1, -1], [1, 1, 5], [9, 9, 9]]), 0.0);
    assert_eq!(squared_distance(flat, [[4, 4, 0], [5, 5, 0], [5, 5, 7]]), 8.0);
}
