//! The distance of two triangles, and where they meet.
//!
//! Whether two triangles meet is decided by exact signs (`mesh::meet`). The distance of two that do not is the least of
//! the distances between their features: a corner and a face, two sides, a corner and a side. Each is computed in pairs
//! of `f64`, because the parameters of nearly parallel sides and of slivers lose half their digits and more. Where a
//! foot lies on the end of a feature, a lower feature gives the same distance, so that a wrong decision there does not
//! change the value.

use glam::DVec3;
use robust::{Coord, orient2d};

use super::real::{Double, Real, Vector};
use crate::mesh::meet::{apart_meet, crosses, sides};

/// The corners of a triangle.
pub(super) type Corners = [DVec3; 3];

/// The sides of a triangle, by their corners.
const SIDES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// The distance of two objects, and a point of each at this distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// The distance; 0 where the objects meet.
    pub distance: f64,
    /// The nearest points.
    pub points: [DVec3; 2],
}

/// Returns the distance of two triangles that do not meet, to a few units in the last place.
pub(super) fn distance(a: &Corners, b: &Corners) -> Nearest {
    let Candidate { squared, points } = features::<Double>(a, b);
    Nearest { distance: squared.to_f64().max(0.0).sqrt(), points }
}

/// Returns the distance of two triangles that do not meet, but for an error of [`ROUGH_ERROR`] of their longest side.
pub(super) fn rough_distance(a: &Corners, b: &Corners) -> f64 {
    features::<f64>(a, b).squared.max(0.0).sqrt()
}

/// A bound of the error of [`rough_distance`], as a share of the longest side. Sides whose directions differ by less
/// than the root of the precision of `f64` count as parallel, and slivers thinner than that as their sides.
pub(super) const ROUGH_ERROR: f64 = 1e-7;

/// Returns whether two triangles meet, by exact signs.
pub(super) fn do_meet(a: &Corners, b: &Corners) -> bool {
    // The projection of coplanar triangles is chosen by the first.
    if is_degenerate(a) { !is_degenerate(b) && apart_meet(*b, *a) } else { apart_meet(*a, *b) }
}

/// Returns whether the corners of a triangle lie on a line.
fn is_degenerate([a, b, c]: &Corners) -> bool {
    let flat = |p: &DVec3, i: usize| Coord { x: p[i], y: p[(i + 1) % 3] };
    (0..3).all(|i| orient2d(flat(a, i), flat(b, i), flat(c, i)) == 0.0)
}

/// Calls `each` with the points in which the sides of either triangle cross the plane of the other within it.
pub(super) fn crossings(a: &Corners, b: &Corners, mut each: impl FnMut(DVec3)) {
    for (face, other) in [(a, b), (b, a)] {
        let heights = sides(*face, *other);
        for [i, j] in SIDES {
            if crosses(other[i], other[j], heights[i], heights[j], *face) {
                each(other[i].lerp(other[j], heights[i] / (heights[i] - heights[j])));
            }
        }
    }
}

/// A pair of features: the square of its distance, and a point on each.
struct Candidate<R> {
    squared: R,
    points: [DVec3; 2],
}

impl<R: Real> Candidate<R> {
    fn offer(&mut self, squared: R, points: impl FnOnce() -> [DVec3; 2]) {
        if squared < self.squared {
            *self = Candidate { squared, points: points() };
        }
    }
}

/// Returns the nearest pair of features of two triangles.
fn features<R: Real>(a: &Corners, b: &Corners) -> Candidate<R> {
    let mut best = Candidate { squared: Vector::between(a[0], b[0]).squared(), points: [a[0], b[0]] };
    for (one, other, is_swapped) in [(a, b, false), (b, a, true)] {
        let ordered = |of_one, of_other| if is_swapped { [of_other, of_one] } else { [of_one, of_other] };
        let along = SIDES.map(|[i, j]| Vector::<R>::between(one[i], one[j]));
        let normal = along[0].cross(along[1]);
        let area = normal.squared();
        for &corner in other {
            let to_corner = one.map(|own| Vector::<R>::between(own, corner));
            if area > R::ZERO && (0..3).all(|i| along[i].cross(to_corner[i]).dot(normal) >= R::ZERO) {
                let height = to_corner[0].dot(normal);
                best.offer(height * height / area, || {
                    let share = (height / area).to_f64();
                    ordered(corner - share * DVec3::from(normal.0.map(R::to_f64)), corner)
                });
            }
            for (i, [from, to]) in SIDES.into_iter().enumerate() {
                let (length, covered) = (along[i].squared(), along[i].dot(to_corner[from]));
                let (squared, share) = match covered > R::ZERO && covered < length {
                    true => {
                        let share = covered / length;
                        (to_corner[from].plus(R::ZERO - share, along[i]).squared(), share.to_f64())
                    }
                    // The other end is the start of the next side.
                    false => (to_corner[from].squared(), 0.0),
                };
                best.offer(squared, || ordered(one[from].lerp(one[to], share), corner));
            }
        }
    }
    for [i, j] in SIDES {
        let along_a = Vector::<R>::between(a[i], a[j]);
        for [k, l] in SIDES {
            let (along_b, across) = (Vector::<R>::between(b[k], b[l]), Vector::<R>::between(a[i], b[k]));
            let normal = along_a.cross(along_b);
            let scale = normal.squared();
            let (of_a, of_b) = (across.cross(along_b).dot(normal), across.cross(along_a).dot(normal));
            let is_inner = |share: R| share > R::ZERO && share < scale;
            if is_inner(of_a) && is_inner(of_b) {
                let height = across.dot(normal);
                best.offer(height * height / scale, || {
                    [a[i].lerp(a[j], (of_a / scale).to_f64()), b[k].lerp(b[l], (of_b / scale).to_f64())]
                });
            }
        }
    }
    best
}
