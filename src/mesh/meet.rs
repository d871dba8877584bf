//! The exact test of whether two triangles meet elsewhere than in corners and sides that they share.
//!
//! Two triangles that share no corner meet in a point of a side of one of them, so six tests of a segment against a
//! triangle decide. Two that share a corner meet beyond it only if the opposite side of one meets the other. Two that
//! share a side meet beyond it only if they are folded flat. Coplanar triangles are tested by their outlines in the
//! same way. All of this depends only on the signs of volumes and areas, and those are exact (Shewchuk, Adaptive
//! precision floating-point arithmetic, 1997).

use glam::DVec3;
use robust::{Coord, Coord3D, orient2d, orient3d};

/// Returns true if a line separates the projections of two triangles along an axis, but for corners that they share;
/// false where no such line was found. `shared` holds, for each corner of `b`, the same corner of `a`, or 3.
///
/// The line is the projection of a plane, so the triangles meet only in what they share. Most triangles that share a
/// corner or a side are nearly coplanar, where this test is much faster than exact volumes.
pub(crate) fn are_parted(a: &[DVec3; 3], b: &[DVec3; 3], shared: [usize; 3], axis: usize) -> bool {
    let seen = |p: &DVec3| match axis {
        0 => [p.y, p.z],
        1 => [p.z, p.x],
        _ => [p.x, p.y],
    };
    let (a, b) = ([seen(&a[0]), seen(&a[1]), seen(&a[2])], [seen(&b[0]), seen(&b[1]), seen(&b[2])]);
    let mut back = [3; 3];
    for (j, &i) in shared.iter().enumerate() {
        if i < 3 {
            back[i] = j;
        }
    }
    a_side_parts(&a, &b, shared) || a_side_parts(&b, &a, back)
}

/// Returns true if the line of a side of `a` separates the two.
fn a_side_parts(a: &[[f64; 2]; 3], b: &[[f64; 2]; 3], shared: [usize; 3]) -> bool {
    for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
        let own = certain_turn(a[i], a[j], a[k]);
        if own == 0.0 {
            return false;
        }
        let is_beyond = |(corner, &place): (&[f64; 2], &usize)| match place {
            3 => certain_turn(a[i], a[j], *corner) * own < 0.0,
            _ => place != k,
        };
        if b.iter().zip(&shared).all(is_beyond) {
            return true;
        }
    }
    false
}

/// Returns twice the area of a triangle, with the right sign, or 0 where rounding might have changed the sign.
#[inline]
fn certain_turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    // The bound of stage A of Shewchuk's adaptive orient2d, (3 + 16 ε) ε, ε = 2^-53.
    const BOUND: f64 = 3.330_669_073_875_471_6e-16;
    let (left, right) = ((a[0] - c[0]) * (b[1] - c[1]), (a[1] - c[1]) * (b[0] - c[0]));
    let turn = left - right;
    if turn.abs() > BOUND * (left.abs() + right.abs()) { turn } else { 0.0 }
}

/// Returns, for each corner of `b`, the same corner of `a`, or 3: corners in the same place are one.
#[inline]
pub(crate) fn shared_corners(a: &[DVec3; 3], b: &[DVec3; 3]) -> [usize; 3] {
    let mut shared = [3; 3];
    for (place, corner) in shared.iter_mut().zip(b) {
        for (i, own) in a.iter().enumerate() {
            if own.x == corner.x && own == corner {
                *place = i;
            }
        }
    }
    shared
}

/// Returns whether two triangles meet elsewhere than in corners and sides that they share, by their places. `axis` is the one along
/// which the projection of `a` is largest.
#[inline]
pub(crate) fn meet_elsewhere(a: &[DVec3; 3], b: &[DVec3; 3], shared: [usize; 3], axis: usize) -> bool {
    if are_parted(a, b, shared, axis) {
        return false;
    }
    let numbers = [0, 1, 2].map(|j| if shared[j] < 3 { shared[j] as u32 } else { 3 + j as u32 });
    let place_of = |number: u32| if number < 3 { a[number as usize] } else { b[number as usize - 3] };
    meet([0, 1, 2], numbers, place_of)
}

/// Returns whether two triangles, by their vertices, meet elsewhere than in vertices and sides that they share.
pub(crate) fn meet(one: [u32; 3], other: [u32; 3], place_of: impl Fn(u32) -> DVec3) -> bool {
    let at = |triangle: [u32; 3]| triangle.map(&place_of);
    let shared = |vertex: &u32, triangle: &[u32; 3]| triangle.contains(vertex);
    match one.iter().filter(|vertex| shared(vertex, &other)).count() {
        0 => apart_meet(at(one), at(other)),
        1 => {
            let first = |triangle: [u32; 3], than: [u32; 3]| {
                let turn = triangle.iter().position(|vertex| shared(vertex, &than)).unwrap_or(0);
                [0, 1, 2].map(|i| triangle[(turn + i) % 3])
            };
            corner_meet(at(first(one, other)), at(first(other, one)))
        }
        2 => {
            let last = |triangle: [u32; 3], than: [u32; 3]| {
                let turn = triangle.iter().position(|vertex| !shared(vertex, &than)).unwrap_or(0);
                [1, 2, 0].map(|i| triangle[(turn + i) % 3])
            };
            side_meet(at(last(one, other)), at(last(other, one))[2])
        }
        _ => true,
    }
}

/// Returns the sign of the volume of a tetrahedron.
fn side(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    orient3d(a, b, c, d)
}

/// Returns the sides of a plane on which the corners of a triangle lie.
pub(crate) fn sides(plane: [DVec3; 3], of: [DVec3; 3]) -> [f64; 3] {
    of.map(|point| side(plane[0], plane[1], plane[2], point))
}

/// Returns whether triangles that share no corner by its number meet; the first is not degenerate.
pub(crate) fn apart_meet(a: [DVec3; 3], b: [DVec3; 3]) -> bool {
    let b_of_a = sides(a, b);
    if one_sided(&b_of_a) {
        return false;
    }
    let a_of_b = sides(b, a);
    if one_sided(&a_of_b) {
        return false;
    }
    if b_of_a == [0.0; 3] && a_of_b == [0.0; 3] {
        return flat_meet(a, b);
    }
    (0..3).any(|i| {
        let j = (i + 1) % 3;
        crosses(b[i], b[j], b_of_a[i], b_of_a[j], a) || crosses(a[i], a[j], a_of_b[i], a_of_b[j], b)
    })
}

fn one_sided(sides: &[f64]) -> bool {
    sides.iter().all(|&side| side > 0.0) || sides.iter().all(|&side| side < 0.0)
}

/// Returns whether a segment meets a triangle, given the sides of the triangle's plane on which its ends lie; false for
/// a segment in the plane.
pub(crate) fn crosses(p: DVec3, q: DVec3, of_p: f64, of_q: f64, [a, b, c]: [DVec3; 3]) -> bool {
    if one_sided(&[of_p, of_q]) || (of_p == 0.0 && of_q == 0.0) {
        return false;
    }
    let turns = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
    turns.iter().all(|&turn| turn >= 0.0) || turns.iter().all(|&turn| turn <= 0.0)
}

/// Returns whether triangles that share their first corner meet elsewhere.
fn corner_meet(a: [DVec3; 3], b: [DVec3; 3]) -> bool {
    let of = |plane: [DVec3; 3], p, q| [side(plane[0], plane[1], plane[2], p), side(plane[0], plane[1], plane[2], q)];
    let b_of_a = of(a, b[1], b[2]);
    if one_sided(&b_of_a) {
        return false;
    }
    let a_of_b = of(b, a[1], a[2]);
    if one_sided(&a_of_b) {
        return false;
    }
    if b_of_a == [0.0; 2] && a_of_b == [0.0; 2] {
        let (a, b) = flat(a, b);
        let [a, b] = [a, b].map(counter_clockwise);
        let within = |[tip, from, to]: [Coord<f64>; 3], p| orient2d(tip, from, p) >= 0.0 && orient2d(tip, p, to) >= 0.0;
        return within(a, b[1]) || within(a, b[2]) || within(b, a[1]) || within(b, a[2]);
    }
    crosses(b[1], b[2], b_of_a[0], b_of_a[1], a) || crosses(a[1], a[2], a_of_b[0], a_of_b[1], b)
}

/// Returns whether two triangles that share a side meet elsewhere, the second given by its third corner.
fn side_meet(a: [DVec3; 3], other: DVec3) -> bool {
    if side(a[0], a[1], a[2], other) != 0.0 {
        return false;
    }
    let (a, b) = flat(a, [a[0], a[1], other]);
    orient2d(a[0], a[1], a[2]) * orient2d(b[0], b[1], b[2]) >= 0.0
}

/// Returns whether coplanar triangles meet: no side of either separates them.
fn flat_meet(a: [DVec3; 3], b: [DVec3; 3]) -> bool {
    let (a, b) = flat(a, b);
    let [a, b] = [a, b].map(counter_clockwise);
    let parts = |a: [Coord<f64>; 3], b: [Coord<f64>; 3]| {
        (0..3).any(|i| b.iter().all(|&p| orient2d(a[i], a[(i + 1) % 3], p) < 0.0))
    };
    !parts(a, b) && !parts(b, a)
}

fn counter_clockwise([a, b, c]: [Coord<f64>; 3]) -> [Coord<f64>; 3] {
    if orient2d(a, b, c) < 0.0 { [a, c, b] } else { [a, b, c] }
}

/// Returns the ends, rounded, of the segment in which two triangles cross: each has corners on both sides of the other's plane, and more
/// than a point is common. `None` where they touch, lie on one another or are apart.
pub(crate) fn crossing(a: [DVec3; 3], b: [DVec3; 3]) -> Option<[DVec3; 2]> {
    let (a, side_of_a) = alone_first(a, sides(b, a))?;
    let (b, side_of_b) = alone_first(b, sides(a, b))?;
    // Either triangle has a part of the line in which the planes meet, from one of its first sides to the other. The sign of a
    // volume tells which of two ends comes first; all four have the same sign if one part comes wholly before the other.
    let ends = [(1, 1), (1, 2), (2, 1), (2, 2)];
    let orders = ends.map(|(i, j)| side(a[0], a[i], b[0], b[j]));
    if !has_both_signs(&orders) {
        return None;
    }
    let end = |of: &[DVec3; 3], sides: &[f64; 3], i: usize| of[0].lerp(of[i], sides[0] / (sides[0] - sides[i]));
    let mut found = [end(&a, &side_of_a, 1), end(&a, &side_of_a, 2), end(&b, &side_of_b, 1), end(&b, &side_of_b, 2)];
    let along = found[1] - found[0];
    found.sort_by(|p, q| along.dot(*p).total_cmp(&along.dot(*q)));
    Some([found[1], found[2]])
}

fn has_both_signs(values: &[f64]) -> bool {
    values.iter().any(|&value| value > 0.0) && values.iter().any(|&value| value < 0.0)
}

/// Turns a triangle with corners on both sides of a plane so that no other corner is on the side of the first.
fn alone_first(corners: [DVec3; 3], sides: [f64; 3]) -> Option<([DVec3; 3], [f64; 3])> {
    if !has_both_signs(&sides) {
        return None;
    }
    // Products of volumes would underflow.
    let is_with = |i: usize, j: usize| (sides[i] > 0.0 && sides[j] > 0.0) || (sides[i] < 0.0 && sides[j] < 0.0);
    let alone = (0..3).find(|&i| sides[i] != 0.0 && (1..3).all(|turn| !is_with(i, (i + turn) % 3)))?;
    let turned = [0, 1, 2].map(|i| (alone + i) % 3);
    Some((turned.map(|i| corners[i]), turned.map(|i| sides[i])))
}

/// Returns the axis along which the projection of a triangle is largest.
#[inline]
pub(crate) fn widest_axis([a, b, c]: [DVec3; 3]) -> usize {
    let normal = (b - a).cross(c - a).abs();
    if normal.x >= normal.y.max(normal.z) {
        0
    } else if normal.y >= normal.z {
        1
    } else {
        2
    }
}

/// Projects coplanar triangles along the axis in which the projection of the first is largest.
fn flat(a: [DVec3; 3], b: [DVec3; 3]) -> ([Coord<f64>; 3], [Coord<f64>; 3]) {
    let axis = widest_axis(a);
    let seen = |p: DVec3| Coord { x: p[(axis + 1) % 3], y: p[(axis + 2) % 3] };
    (a.map(seen), b.map(seen))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

    /// Points that rounding takes for points of a line, or for points of its other side (Kettner et al., "Classroom examples of
    /// robustness problems in geometric computations", 2008).
    #[test]
    fn a_turn_is_certain_only_with_its_exact_sign() {
        let ([b, c], mut uncertain, mut certain) = ([[12.0, 12.0], [24.0, 24.0]], 0, 0);
        for (i, j) in (0..256).flat_map(|i| (0..256).map(move |j| (f64::from(i), f64::from(j)))) {
            let a = [0.5 + i * f64::EPSILON / 2.0, 0.5 + j * f64::EPSILON / 2.0];
            let [p, q, r] = [a, b, c].map(|[x, y]| Coord { x, y });
            let turns = [certain_turn(a, b, c), certain_turn(b, c, a), certain_turn(c, a, b)];
            for turn in turns {
                assert!(turn == 0.0 || (turn > 0.0) == (orient2d(p, q, r) > 0.0) && i != j, "{i} {j} {turn}");
                uncertain += usize::from(turn == 0.0 && i != j);
                certain += usize::from(turn != 0.0);
            }
        }
        assert!(uncertain > 0 && certain > 0, "{uncertain} {certain}");
    }

    #[test]
    fn triangles_cross_in_a_segment_in_every_order() {
        let points = |corners: [[f64; 3]; 3]| corners.map(DVec3::from_array);
        let flat = points([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
        let upright = |from: f64, to: f64| points([[from, 1.0, -1.0], [from, 1.0, 1.0], [to, 1.0, 0.0]]);
        let crossing_at = [
            (upright(-2.0, 2.0), Some([0.0, 2.0])),
            (upright(1.0, 2.0), Some([1.0, 2.0])),
            (upright(2.0, 9.0), Some([2.0, 3.0])),
            (upright(3.0, 9.0), None),
            (upright(9.0, 3.0), None),
            (upright(4.0, 9.0), None),
            (upright(0.0, -2.0), None),
            // They share a corner.
            (points([[0.0, 0.0, 0.0], [4.0, 2.0, 2.0], [4.0, 2.0, -2.0]]), Some([0.0, 8.0 / 3.0])),
            (points([[0.0, 0.0, 0.0], [-4.0, -2.0, 2.0], [-4.0, -2.0, -2.0]]), None),
            // They share a side, lie on one another, or touch in a corner or a side.
            (points([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [1.0, 1.0, 1.0]]), None),
            (points([[1.0, 1.0, 0.0], [9.0, 1.0, 0.0], [1.0, 9.0, 0.0]]), None),
            (points([[1.0, 1.0, 0.0], [9.0, 1.0, 2.0], [1.0, 9.0, 2.0]]), None),
            (points([[1.0, 1.0, 0.0], [2.0, 1.0, 0.0], [1.0, 1.0, 2.0]]), None),
        ];
        for (other, expected) in crossing_at {
            let orders = ORDERS.into_iter().flat_map(|one| ORDERS.into_iter().map(move |of| (one, of)));
            for ((one, of), scale) in orders.flat_map(|orders| [1.0, 2f64.powi(-240)].map(|scale| (orders, scale))) {
                let (a, b) = (one.map(|i| flat[i] * scale), of.map(|i| other[i] * scale));
                for found in [crossing(a, b), crossing(b, a)] {
                    let found = found.map(|[p, q]| [p.x.min(q.x) / scale, p.x.max(q.x) / scale]);
                    let is_near = |[from, to]: [f64; 2], [low, high]: [f64; 2]| {
                        (from - low).abs() < 1e-12 && (to - high).abs() < 1e-12
                    };
                    let is_right =
                        found.zip(expected).map_or(found == expected, |(found, expected)| is_near(found, expected));
                    assert!(is_right, "{other:?}: {found:?}, not {expected:?}");
                }
            }
        }
    }

    #[test]
    fn triangles_that_touch_in_a_point_meet_in_every_order() {
        let points = |corners: [[f64; 3]; 3]| corners.map(DVec3::from_array);
        let flat = points([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
        let tips = [[2.0, 0.0, 0.0], [1.0, 1.0, 0.0], [4.0, 0.0, 0.0], [2.0, 2.0, 0.0]];
        let above = tips.map(|tip| points([tip, [5.0, 5.0, 3.0], [5.0, 9.0, 2.0]]));
        let through_a_side = points([[2.0, -1.0, -1.0], [2.0, 1.0, 1.0], [9.0, -9.0, 9.0]]);
        let beside = [2.0f64.next_down(), 2.0, 2.0f64.next_up()];
        let all = above.into_iter().chain([through_a_side]);
        for (touching, one, other) in all.flat_map(|other| {
            ORDERS.into_iter().flat_map(move |one| ORDERS.into_iter().map(move |of| (other, one, of)))
        }) {
            let (a, b) = (one.map(|i| flat[i]), other.map(|i| touching[i]));
            assert!(apart_meet(a, b) && apart_meet(b, a), "{a:?} {b:?}");
            assert!(!(0..3).any(|axis| are_parted(&a, &b, [3; 3], axis)), "{a:?} {b:?}");
        }
        // Within the longest side by a step of rounding, on it, and beyond it.
        for (x, meets) in beside.into_iter().zip([true, true, false]) {
            let tip = points([[x, 2.0, 0.0], [5.0, 5.0, 3.0], [5.0, 9.0, 2.0]]);
            assert_eq!(apart_meet(flat, tip), meets, "{x}");
        }
    }
}
