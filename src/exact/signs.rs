//! Exact signs of volumes of lattice points, in a world where no two bodies touch.
//!
//! Points are integers of up to 40 bits, stored as `f64`. Each body is moved by an infinitesimal vector of its own: body
//! k by (ε₁, ε₂, ε₃) with ε₁ ≫ ε₂ ≫ ε₃ > 0, and every component of a later body exceeds those of all earlier ones by
//! any factor (a simulation of simplicity, Edelsbrunner and Mücke 1990, by translations). All quantities below are
//! linear in these vectors, so the sign of a quantity that is zero is that of the first coefficient that is not.
//!
//! A sign is first computed in `f64`. Differences of points are exact; the determinant has at most five roundings in
//! each product. Where that bound does not decide, integers do: of 128 bits for one determinant (2^123 at most), of 512
//! bits for products of them.

use bnum::cast::As;
use bnum::types::I512;
use glam::{DVec3, I64Vec3};

/// Half a unit in the last place of 1.
const HALF_ULP: f64 = f64::EPSILON / 2.0;

/// A bound on the relative rounding error of a determinant, as a share of the sum of its absolute products.
const DETERMINANT_ERROR: f64 = 8.0 * HALF_ULP;

/// The largest error of a crossing along an edge, as a share of the edge, with which `f64` is trusted.
const CROSSING_ERROR: f64 = 1.0 / (1u64 << 46) as f64;

/// A triangle's plane: its corners, its body, and its normal in `f64`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub corners: [DVec3; 3],
    pub body: u32,
    /// (b − a) × (c − a), rounded.
    normal: DVec3,
    /// The sums of the absolute products in `normal`.
    magnitude: DVec3,
}

/// A point, and a bound of its distance from the true one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Located {
    pub at: DVec3,
    pub error: f64,
}

impl Located {
    /// Returns a point that is exact.
    pub fn exactly(at: DVec3) -> Located {
        Located { at, error: 0.0 }
    }
}

/// Six times the volume of a tetrahedron in `f64`, and a bound of its error.
#[derive(Clone, Copy, Debug)]
struct Rounded {
    value: f64,
    error: f64,
}

impl Rounded {
    /// Returns whether the value is positive, if that is certain.
    #[inline]
    fn is_positive(self) -> Option<bool> {
        (self.value.abs() > self.error).then_some(self.value > 0.0)
    }
}

impl Plane {
    #[inline]
    pub fn new(corners: [DVec3; 3], body: u32) -> Plane {
        let (u, v) = (corners[1] - corners[0], corners[2] - corners[0]);
        let (s, t) = (u.abs(), v.abs());
        let magnitude = DVec3::new(s.y * t.z + s.z * t.y, s.z * t.x + s.x * t.z, s.x * t.y + s.y * t.x);
        Plane { corners, body, normal: u.cross(v), magnitude }
    }

    /// Returns whether the corners lie on a line.
    pub fn is_flat(&self) -> bool {
        self.normal.abs().cmple(DETERMINANT_ERROR * self.magnitude).all() && self.exact_normal() == [0; 3]
    }

    /// Returns the normal, of length 1.
    pub fn unit_normal(&self) -> DVec3 {
        self.normal.normalize_or_zero()
    }

    #[inline]
    fn rounded_height(&self, point: DVec3) -> Rounded {
        let w = point - self.corners[0];
        Rounded { value: self.normal.dot(w), error: DETERMINANT_ERROR * self.magnitude.dot(w.abs()) }
    }

    /// Returns whether a point of another body lies in front, where the normal points to.
    #[inline]
    pub fn is_in_front(&self, point: DVec3, body: u32) -> bool {
        self.rounded_height(point).is_positive().unwrap_or_else(|| self.is_exactly_in_front(point, body))
    }

    #[cold]
    fn is_exactly_in_front(&self, point: DVec3, body: u32) -> bool {
        let height = self.height(point);
        if height != 0 { height > 0 } else { first_is_positive(self.exact_normal()) == (body > self.body) }
    }

    /// Returns (b − a) × (c − a) · (p − a).
    fn height(&self, point: DVec3) -> i128 {
        let ([a, b, c], p) = (self.corners.map(integer), integer(point));
        dot(cross(b - a, c - a), wide(p - a))
    }

    fn exact_normal(&self) -> [i128; 3] {
        let [a, b, c] = self.corners.map(integer);
        cross(b - a, c - a)
    }

    /// Returns the point at which an edge whose ends lie on different sides crosses the plane. Its rounding depends on the
    /// order of the ends.
    pub fn crossing(&self, [u, v]: [DVec3; 2]) -> Located {
        let (from, to) = (self.rounded_height(u), self.rounded_height(v));
        let (mut above, mut below) = (from.value, to.value);
        let mut error = from.error + to.error;
        if error > CROSSING_ERROR * (above - below).abs() {
            (above, below) = (self.height(u) as f64, self.height(v) as f64);
            error = 0.0;
        }
        // If both heights are zero, the displacement decides about the sides, and it is the same at both ends; so the
        // divisor is not zero.
        let share = above / (above - below);
        let at = if share <= 0.5 { u + share * (v - u) } else { v + (below / (below - above)) * (u - v) };
        let share_error = 1.01 * error / (above - below).abs() + 4.0 * HALF_ULP;
        Located { at, error: share_error * (v - u).length() + HALF_ULP * (at.length() + 1.0) }
    }

    /// Returns whether the corners of a face lie in this plane.
    pub fn contains(&self, corners: [DVec3; 3]) -> bool {
        let may_contain = |point| self.rounded_height(point).is_positive().is_none();
        corners.into_iter().all(|corner| may_contain(corner) && self.height(corner) == 0)
    }

    /// Returns whether the crossing of an edge of another body and `through`, a plane of a third body or of this plane's,
    /// lies in front. `u_in_front` tells whether the edge's first end lies in front of `through`.
    pub fn has_crossing_in_front(&self, edge: [DVec3; 2], body: u32, through: &Plane, u_in_front: bool) -> bool {
        let [u, v] = edge;
        let [d, e] = [through.rounded_height(u), through.rounded_height(v)];
        let [g, h] = [self.rounded_height(u), self.rounded_height(v)];
        let value = d.value * h.value - e.value * g.value;
        let product = |a: Rounded, b: Rounded| a.value.abs() * b.error + b.value.abs() * a.error + a.error * b.error;
        let rounding = 4.0 * HALF_ULP * (d.value * h.value).abs().max((e.value * g.value).abs());
        let error = 1.01 * (product(d, h) + product(e, g) + rounding);
        let is_positive = Rounded { value, error }.is_positive();
        is_positive.unwrap_or_else(|| self.exact_product_is_positive(edge, body, through)) == u_in_front
    }

    /// Returns the sign of D(u) H(v) − D(v) H(u), D being the height above `through` and H that above this plane.
    #[cold]
    fn exact_product_is_positive(&self, [u, v]: [DVec3; 2], body: u32, through: &Plane) -> bool {
        let big = |x: i128| -> I512 { x.as_() };
        let [d, e] = [through.height(u), through.height(v)].map(big);
        let [g, h] = [self.height(u), self.height(v)].map(big);
        let value = d * h - e * g;
        if !value.is_zero() {
            return value.is_positive();
        }
        // Moving the edge by s and the planes by s₁, s₂ adds n₁ · (s − s₁) to D and n₂ · (s − s₂) to H.
        let along_through = through.exact_normal().map(|n| big(n) * (h - g));
        let along_self = self.exact_normal().map(|n| big(n) * (d - e));
        let of_edge = [0, 1, 2].map(|i| along_through[i] + along_self[i]);
        let moves = [(body, of_edge), (through.body, along_through.map(|c| -c)), (self.body, along_self.map(|c| -c))];
        first_move_is_positive(moves)
    }
}

/// Returns the sign of the volume of two edges of different bodies: of (v − u) · ((r − u) × (s − u)).
#[inline]
pub(super) fn edges_turn([u, v]: [DVec3; 2], body: u32, [r, s]: [DVec3; 2], other: u32) -> bool {
    let (a, b, c) = (v - u, r - u, s - u);
    let (p, q, k) = (a.abs(), b.abs(), c.abs());
    let value = a.dot(b.cross(c));
    let magnitude = p.x * (q.y * k.z + q.z * k.y) + p.y * (q.z * k.x + q.x * k.z) + p.z * (q.x * k.y + q.y * k.x);
    let rounded = Rounded { value, error: DETERMINANT_ERROR * magnitude };
    rounded.is_positive().unwrap_or_else(|| edges_turn_exactly([u, v], [r, s], other > body))
}

#[cold]
fn edges_turn_exactly(edge: [DVec3; 2], other: [DVec3; 2], other_is_moved: bool) -> bool {
    let ([u, v], [r, s]) = (edge.map(integer), other.map(integer));
    let value = dot(cross(r - u, s - u), wide(v - u));
    if value != 0 { value > 0 } else { first_is_positive(cross(s - r, v - u)) == other_is_moved }
}

/// Returns whether a point lies to the left of the line from a to b, seen against the x axis, where the line belongs to
/// another body.
pub(super) fn is_left_of(point: DVec3, body: u32, [a, b]: [DVec3; 2], other: u32) -> bool {
    let (u, w) = (b - a, point - a);
    let (left, right) = (u.y * w.z, u.z * w.y);
    let rounded = Rounded { value: left - right, error: 4.0 * HALF_ULP * (left.abs() + right.abs()) };
    rounded.is_positive().unwrap_or_else(|| {
        let ([a, b], p) = ([a, b].map(integer), integer(point));
        let (u, w) = (wide(b - a), wide(p - a));
        let value = u[1] * w[2] - u[2] * w[1];
        match value {
            0 => first_is_positive([0, -u[2], u[1]]) == (body > other),
            value => value > 0,
        }
    })
}

/// Returns whether the point common to three planes lies in front of a fourth. No two of the planes may be parallel to the
/// line of the others; see [`has_common_point`].
pub(super) fn common_point_is_in_front(planes: [&Plane; 3], fourth: &Plane) -> bool {
    let [f, g, h] = planes.map(Equation::of);
    let k = Equation::of(fourth);
    let triple = |a: &Equation, b: &Equation, c: &Equation| a.normal_volume(b, c);
    // The heights are n · x − o. Cramer's rule for the first three gives the point; its height above the fourth, times
    // their determinant, is the sum of the offsets times these minors.
    let minors = [triple(&g, &h, &k), -triple(&h, &k, &f), triple(&k, &f, &g), -triple(&f, &g, &h)];
    let determinant = -minors[3];
    let all = [&f, &g, &h, &k];
    let offset = |i: usize| all[i].offset * minors[i];
    let value = offset(0) + offset(1) + offset(2) + offset(3);
    let bodies = [planes[0].body, planes[1].body, planes[2].body, fourth.body];
    let is_positive = if value.is_zero() {
        first_move_is_positive([0, 1, 2, 3].map(|i| (bodies[i], all[i].normal.map(|n| n * minors[i]))))
    } else {
        value.is_positive()
    };
    is_positive == determinant.is_positive()
}

/// Returns the point common to three planes, rounded once; `None` where they are parallel to a line.
pub(super) fn common_point(planes: [&Plane; 3]) -> Option<Located> {
    let [f, g, h] = planes.map(Equation::of);
    let determinant = f.normal_volume(&g, &h);
    if determinant.is_zero() {
        return None;
    }
    let sides = [g.crossed(&h), h.crossed(&f), f.crossed(&g)];
    let of = |i: usize| f.offset * sides[0][i] + g.offset * sides[1][i] + h.offset * sides[2][i];
    let divisor: f64 = determinant.as_();
    let at = DVec3::from_array([0, 1, 2].map(|i| {
        let numerator: f64 = of(i).as_();
        numerator / divisor
    }));
    Some(Located { at, error: 4.0 * HALF_ULP * at.length() })
}

/// A plane n · x = o in integers.
struct Equation {
    normal: [I512; 3],
    offset: I512,
}

impl Equation {
    fn of(plane: &Plane) -> Equation {
        let normal = plane.exact_normal();
        let offset = dot(normal, wide(integer(plane.corners[0])));
        Equation { normal: normal.map(|n| n.as_()), offset: offset.as_() }
    }

    fn crossed(&self, other: &Equation) -> [I512; 3] {
        let (a, b) = (&self.normal, &other.normal);
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    }

    fn normal_volume(&self, b: &Equation, c: &Equation) -> I512 {
        let (n, m) = (&self.normal, b.crossed(c));
        n[0] * m[0] + n[1] * m[1] + n[2] * m[2]
    }
}

/// Returns the sign of a sum of products of vectors with the displacements of bodies.
fn first_move_is_positive<const N: usize>(moves: [(u32, [I512; 3]); N]) -> bool {
    let mut order: [usize; N] = std::array::from_fn(|i| i);
    order.sort_by_key(|&i| std::cmp::Reverse(moves[i].0));
    for same in order.chunk_by(|&i, &j| moves[i].0 == moves[j].0) {
        for axis in 0..3 {
            let sum = same.iter().fold(I512::default(), |sum, &i| sum + moves[i].1[axis]);
            if !sum.is_zero() {
                return sum.is_positive();
            }
        }
    }
    // Only for parallel lines and planes, which do not cross.
    false
}

/// Returns whether the first component that is not zero is positive.
fn first_is_positive(components: [i128; 3]) -> bool {
    components.into_iter().find(|&c| c != 0).is_some_and(|c| c > 0)
}

fn integer(point: DVec3) -> I64Vec3 {
    point.as_i64vec3()
}

fn wide(v: I64Vec3) -> [i128; 3] {
    v.to_array().map(i128::from)
}

fn cross(a: I64Vec3, b: I64Vec3) -> [i128; 3] {
    let (a, b) = (wide(a), wide(b));
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [i128; 3], b: [i128; 3]) -> i128 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
