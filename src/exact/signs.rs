//! Exact signs of volumes of lattice points, in a world where no two bodies touch.
//!
//! Points are integers of up to 40 bits, stored as `f64`. For meshes, bodies grow by an infinitesimal: their points move by ε
//! times integer vectors (`growth`), so that faces that coincide part in the direction that suits the expression. Points of a body
//! that meets itself move by ε times vectors without a pattern (`crossed`). For volumes and areas all other bodies are at rest, as one of two faces that coincide then lies in front everywhere. What that leaves undecided,
//! translations decide that are smaller than any power of ε: body k moves by (ε₁, ε₂, ε₃) with ε₁ ≫ ε₂ ≫ ε₃ > 0, and every
//! component of a later body exceeds those of all earlier ones by any factor (a simulation of simplicity, Edelsbrunner and
//! Mücke 1990). All quantities below are polynomials in ε and linear in the translations, so the sign of a quantity that is
//! zero is that of the first coefficient that is not.
//!
//! A sign is first computed in `f64`. Differences of lattice points are exact; the determinant has at most five roundings in
//! each product. Where that bound does not decide, integers do: of 128 bits for one determinant (2^123 at most), of 512
//! bits for products of them; and where these are zero, polynomials of such integers.

use bnum::cast::As;
use bnum::types::I512;
use glam::{DVec3, I64Vec3};

use super::bodies::Bodies;
use super::polynomial::{Number, Polynomial};

/// Half a unit in the last place of 1.
pub(super) const HALF_ULP: f64 = f64::EPSILON / 2.0;

/// A bound on the relative rounding error of a determinant, as a share of the sum of its absolute products.
const DETERMINANT_ERROR: f64 = 8.0 * HALF_ULP;

/// The largest error of a crossing along an edge, as a share of the edge, with which `f64` is trusted.
const CROSSING_ERROR: f64 = 1.0 / (1u64 << 46) as f64;

/// A point of a body, or of a line that tests one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex<'b> {
    pub at: DVec3,
    pub body: u32,
    /// The bodies and the number of the point in them; `None` if it does not move with growth.
    source: Option<(&'b Bodies, u32)>,
}

impl<'b> Vertex<'b> {
    /// Returns a point that does not move with growth.
    pub fn still(at: DVec3, body: u32) -> Vertex<'b> {
        Vertex { at, body, source: None }
    }

    /// Returns a point of a body, by its number.
    pub fn of(bodies: &'b Bodies, number: u32, body: u32) -> Vertex<'b> {
        Vertex { at: bodies.points[number as usize], body, source: Some((bodies, number)) }
    }

    fn seen(&self, time: Time) -> Moving {
        let speed = match time {
            Time::Growing => self.speed(),
            Time::Resting => I64Vec3::ZERO,
        };
        Moving { at: self.at.as_i64vec3(), speed }
    }

    /// Returns the vector by which the point moves with growth.
    pub fn speed(&self) -> I64Vec3 {
        self.source.map_or(I64Vec3::ZERO, |(bodies, number)| bodies.growth(number, self.body))
    }

    fn grows(&self) -> bool {
        self.source.is_some_and(|(bodies, _)| bodies.grows(self.body))
    }

    /// Notes that this body touches itself in a point of this vertex's face or side.
    fn note_touching(&self) {
        if let Some((bodies, number)) = self.source {
            bodies.note_touching(number);
        }
    }
}

/// Whether bodies grow.
#[derive(Clone, Copy)]
pub(super) enum Time {
    /// Not yet; all powers of growth but the lowest are zero.
    Resting,
    Growing,
}

/// A vector that changes with growth.
#[derive(Clone, Copy)]
struct Moving {
    at: I64Vec3,
    speed: I64Vec3,
}

impl Moving {
    fn from(self, origin: Moving) -> Moving {
        Moving { at: self.at - origin.at, speed: self.speed - origin.speed }
    }

    /// Returns the coefficients of a product of vectors.
    fn cross(self, other: Moving) -> [[i128; 3]; 3] {
        let both = [cross(self.at, other.speed), cross(self.speed, other.at)];
        [cross(self.at, other.at), [0, 1, 2].map(|i| both[0][i] + both[1][i]), cross(self.speed, other.speed)]
    }

    /// Returns the coefficients of the volume of three vectors.
    fn volume(self, v: Moving, w: Moving) -> [i128; 4] {
        self.along(v.cross(w))
    }

    /// Returns the coefficients of the product with a vector, given its own.
    fn along(self, vector: [[i128; 3]; 3]) -> [i128; 4] {
        let (at, speed) = (wide(self.at), wide(self.speed));
        let by = |own: [i128; 3], power: usize| dot(own, vector[power]);
        [by(at, 0), by(at, 1) + by(speed, 0), by(at, 2) + by(speed, 1), by(speed, 2)]
    }
}

/// Returns the sign of the first coefficient that is not zero.
fn first_sign(coefficients: impl IntoIterator<Item = i128>) -> Option<bool> {
    coefficients.into_iter().find(|&c| c != 0).map(|c| c > 0)
}

/// Returns the sign of the product of a vector with a translation: of its first component that is not zero.
fn is_along_translation(vector: [[i128; 3]; 3]) -> bool {
    first_sign((0..3).flat_map(|axis| vector.map(|coefficients| coefficients[axis]))).unwrap_or(false)
}

/// A triangle's plane: its corners, its body, and its normal in `f64`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane<'b> {
    pub corners: [Vertex<'b>; 3],
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

impl<'b> Plane<'b> {
    #[inline]
    pub fn new(corners: [Vertex<'b>; 3]) -> Plane<'b> {
        let [a, b, c] = corners.map(|corner| corner.at);
        let (u, v) = (b - a, c - a);
        let (s, t) = (u.abs(), v.abs());
        let magnitude = DVec3::new(s.y * t.z + s.z * t.y, s.z * t.x + s.x * t.z, s.x * t.y + s.y * t.x);
        Plane { corners, body: corners[0].body, normal: u.cross(v), magnitude }
    }

    /// Returns the positions of the corners.
    #[inline]
    pub fn positions(&self) -> [DVec3; 3] {
        self.corners.map(|corner| corner.at)
    }

    /// Returns whether the corners lie on a line.
    pub fn is_flat(&self) -> bool {
        self.normal.abs().cmple(DETERMINANT_ERROR * self.magnitude).all()
            && self.exact_normal(Time::Resting)[0] == [0; 3]
    }

    /// Returns the normal, of length 1.
    pub fn unit_normal(&self) -> DVec3 {
        self.normal.normalize_or_zero()
    }

    #[inline]
    fn rounded_height(&self, point: DVec3) -> Rounded {
        let w = point - self.corners[0].at;
        Rounded { value: self.normal.dot(w), error: DETERMINANT_ERROR * self.magnitude.dot(w.abs()) }
    }

    /// Returns whether another face certainly lies on one side.
    #[inline]
    pub fn is_beside(&self, other: &Plane) -> bool {
        let sides = other.corners.map(|corner| self.rounded_height(corner.at).is_positive());
        sides[0].is_some() && sides == [sides[0]; 3]
    }

    /// Returns whether a point lies in front, where the normal points to. It is one of another body, or of one that meets itself.
    #[inline]
    pub fn is_in_front(&self, point: &Vertex) -> bool {
        self.rounded_height(point.at).is_positive().unwrap_or_else(|| self.is_exactly_in_front(point))
    }

    #[cold]
    fn is_exactly_in_front(&self, point: &Vertex) -> bool {
        match self.resting_height(point) {
            0 => {}
            height => return height > 0,
        }
        let grown = (self.corners[0].grows() || point.grows()).then(|| self.is_in_front_grown(point)).flatten();
        grown.unwrap_or_else(|| {
            if point.body == self.body {
                point.note_touching();
            }
            self.faces_translation() == (point.body > self.body)
        })
    }

    /// Returns whether a point in the plane at rest lies in front once bodies grow; `None` if it stays in the plane.
    fn is_in_front_grown(&self, point: &Vertex) -> Option<bool> {
        // The first coefficient of the height of a point that leaves a corner is that of its speed relative to the corner.
        let leaves = |corner: &Vertex| {
            let speed = (point.speed() - corner.speed()).as_dvec3();
            Rounded { value: self.normal.dot(speed), error: DETERMINANT_ERROR * self.magnitude.dot(speed.abs()) }
        };
        let certain = self.corner_at(point.at).and_then(|corner| leaves(corner).is_positive());
        certain.or_else(|| first_sign(self.height(point, Time::Growing)))
    }

    /// Returns whether a body that is translated later moves to the front.
    fn faces_translation(&self) -> bool {
        let along_x = Rounded { value: self.normal.x, error: DETERMINANT_ERROR * self.magnitude.x };
        along_x.is_positive().unwrap_or_else(|| is_along_translation(self.exact_normal(Time::Growing)))
    }

    /// Returns the corner at a position.
    fn corner_at(&self, position: DVec3) -> Option<&Vertex<'b>> {
        self.corners.iter().find(|corner| corner.at == position)
    }

    /// Returns (b − a) × (c − a) · (p − a) at rest.
    fn resting_height(&self, point: &Vertex) -> i128 {
        match self.corner_at(point.at) {
            Some(_) => 0,
            None => self.height(point, Time::Resting)[0],
        }
    }

    /// Returns the coefficients of (b − a) × (c − a) · (p − a).
    fn height(&self, point: &Vertex, time: Time) -> [i128; 4] {
        let ([a, b, c], p) = (self.corners.each_ref().map(|corner| corner.seen(time)), point.seen(time));
        p.from(a).volume(b.from(a), c.from(a))
    }

    fn exact_normal(&self, time: Time) -> [[i128; 3]; 3] {
        let [a, b, c] = self.corners.each_ref().map(|corner| corner.seen(time));
        b.from(a).cross(c.from(a))
    }

    /// Returns the point at which an edge whose ends lie on different sides crosses the plane. Its rounding depends on the
    /// order of the ends.
    pub fn crossing(&self, [u, v]: [&Vertex; 2]) -> Located {
        let (from, to) = (self.rounded_height(u.at), self.rounded_height(v.at));
        let (mut above, mut below) = (from.value, to.value);
        let mut error = from.error + to.error;
        if error >= CROSSING_ERROR * (above - below).abs() {
            (above, below) = self.exact_heights([u, v]);
            error = 0.0;
        }
        let share = above / (above - below);
        let (u, v) = (u.at, v.at);
        let at = if share <= 0.5 { u + share * (v - u) } else { v + (below / (below - above)) * (u - v) };
        let share_error = 1.01 * error / (above - below).abs() + 4.0 * HALF_ULP;
        Located { at, error: share_error * (v - u).length() + HALF_ULP * (at.length() + 1.0) }
    }

    /// Returns the heights of the ends of an edge that crosses the plane, in the lowest power of growth in which they differ.
    fn exact_heights(&self, ends: [&Vertex; 2]) -> (f64, f64) {
        let resting = ends.map(|end| self.resting_height(end));
        if resting != [0; 2] {
            return (resting[0] as f64, resting[1] as f64);
        }
        let [above, below] = ends.map(|end| self.height(end, Time::Growing));
        // If all are zero, translation decides about the sides, and it is the same at both ends; so some differ.
        let power = (1..4).find(|&power| above[power] != 0 || below[power] != 0).unwrap_or(0);
        (above[power] as f64, below[power] as f64)
    }

    /// Returns whether the corners of a face lie in this plane.
    pub fn contains(&self, corners: &[Vertex; 3]) -> bool {
        let may_contain = |point: &Vertex| self.rounded_height(point.at).is_positive().is_none();
        corners.iter().all(|corner| may_contain(corner) && self.resting_height(corner) == 0)
    }

    /// Returns whether the crossing of an edge of another body and `through`, a plane of a third body or of this plane's,
    /// lies in front. `u_in_front` tells whether the edge's first end lies in front of `through`.
    pub fn has_crossing_in_front(&self, edge: [&Vertex; 2], through: &Plane, u_in_front: bool) -> bool {
        let [u, v] = edge;
        let [d, e] = [through.rounded_height(u.at), through.rounded_height(v.at)];
        let [g, h] = [self.rounded_height(u.at), self.rounded_height(v.at)];
        let value = d.value * h.value - e.value * g.value;
        let product = |a: Rounded, b: Rounded| a.value.abs() * b.error + b.value.abs() * a.error + a.error * b.error;
        let rounding = 4.0 * HALF_ULP * (d.value * h.value).abs().max((e.value * g.value).abs());
        let error = 1.01 * (product(d, h) + product(e, g) + rounding);
        let is_positive = Rounded { value, error }.is_positive();
        is_positive.unwrap_or_else(|| self.exact_product_is_positive(edge, through)) == u_in_front
    }

    /// Returns the sign of D(u) H(v) − D(v) H(u), D being the height above `through` and H that above this plane.
    #[cold]
    fn exact_product_is_positive(&self, [u, v]: [&Vertex; 2], through: &Plane) -> bool {
        let heights = |time: Time| [through, self].map(|plane| [u, v].map(|end| plane.height(end, time)));
        if let Some(sign) = turn(&heights(Time::Resting)) {
            return sign;
        }
        let growing = heights(Time::Growing);
        turn(&growing).unwrap_or_else(|| {
            // Moving the edge by s and the planes by s₁, s₂ adds n₁ · (s − s₁) to D and n₂ · (s − s₂) to H.
            let [along_through, along_own] =
                [through, self].map(|plane| components::<Polynomial>(plane.exact_normal(Time::Growing)));
            let rise = |[u, v]: [[i128; 4]; 2]| Polynomial::of(&[0, 1, 2, 3].map(|power| v[power] - u[power]));
            let (of_through, of_own) = (rise(growing[1]), rise(growing[0]));
            let of = |body: u32, normal, factor, is_negative| Move { body, normal, factor, is_negative };
            let (along_through, along_own) = (along_through.each_ref(), along_own.each_ref());
            let moves = [
                of(u.body, along_through, &of_through, false),
                of(u.body, along_own, &of_own, true),
                of(through.body, along_through, &of_through, true),
                of(self.body, along_own, &of_own, false),
            ];
            first_move_is_positive(&moves).unwrap_or_else(|| {
                self.note_touching();
                false
            })
        })
    }

    /// Returns the coefficients of the normal n, and of the offset o = n · x of the plane's points.
    pub fn equation(&self, time: Time) -> ([[i128; 3]; 3], [i128; 4]) {
        let (normal, corner) = (self.exact_normal(time), self.corners[0].seen(time));
        (normal, corner.along(normal))
    }

    /// Returns whether a point that is known within an error lies in front, if that is certain.
    pub fn is_certainly_in_front(&self, point: &Located) -> Option<bool> {
        let Rounded { value, error } = self.rounded_height(point.at);
        // The difference from the corner is rounded, too. Where the normal's components cancel, they are less than their rounding.
        let of_point = self.magnitude.length() * (point.error + HALF_ULP * (point.at - self.corners[0].at).length());
        Rounded { value, error: 2.0 * (error + of_point) }.is_positive()
    }

    /// Notes that the body touches itself here.
    pub fn note_touching(&self) {
        self.corners[0].note_touching();
    }
}

/// Returns a vector by components from its coefficients by powers.
pub(super) fn components<T: Number>(coefficients: [[i128; 3]; 3]) -> [T; 3] {
    [0, 1, 2].map(|axis| T::of(&coefficients.map(|power| power[axis])))
}

/// Returns the sign of D(u) H(v) − D(v) H(u), given the coefficients of both D and both H: power by power, as the first decides.
fn turn([[d, e], [g, h]]: &[[[i128; 4]; 2]; 2]) -> Option<bool> {
    (0..7usize).find_map(|power| {
        let mut sum = I512::default();
        for (i, j) in (0..4).filter_map(|i| Some((i, power.checked_sub(i).filter(|&j| j < 4)?))) {
            let mut add = |one: i128, other: i128, is_negative: bool| {
                // Most are zero, and it takes a while to widen them.
                if one != 0 && other != 0 {
                    sum.add_product(&one.as_(), &other.as_(), is_negative);
                }
            };
            add(d[i], h[j], false);
            add(e[i], g[j], true);
        }
        sum.sign()
    })
}

/// Returns the sign of the volume of two edges of different bodies, or of one that meets itself: of (v − u) · ((r − u) × (s − u)).
#[inline]
pub(super) fn edges_turn(edge: [&Vertex; 2], other: [&Vertex; 2]) -> bool {
    let ([u, v], [r, s]) = (edge.map(|end| end.at), other.map(|end| end.at));
    let (a, b, c) = (v - u, r - u, s - u);
    let (p, q, k) = (a.abs(), b.abs(), c.abs());
    let value = a.dot(b.cross(c));
    let magnitude = p.x * (q.y * k.z + q.z * k.y) + p.y * (q.z * k.x + q.x * k.z) + p.z * (q.x * k.y + q.y * k.x);
    let rounded = Rounded { value, error: DETERMINANT_ERROR * magnitude };
    rounded.is_positive().unwrap_or_else(|| edges_turn_exactly(edge, other))
}

#[cold]
fn edges_turn_exactly(edge: [&Vertex; 2], other: [&Vertex; 2]) -> bool {
    let volume = |time: Time| {
        let ([u, v], [r, s]) = (edge.map(|end| end.seen(time)), other.map(|end| end.seen(time)));
        v.from(u).volume(r.from(u), s.from(u))
    };
    // Edges with a common end have no volume at rest.
    let have_common_end = edge.iter().any(|end| other.iter().any(|of_other| of_other.at == end.at));
    let resting = if have_common_end { None } else { first_sign(volume(Time::Resting)) };
    let grow = edge[0].grows() || other[0].grows();
    let sign = resting.or_else(|| grow.then(|| first_sign(volume(Time::Growing))).flatten());
    sign.unwrap_or_else(|| {
        if edge[0].body == other[0].body {
            edge[0].note_touching();
        }
        let [[u, v], [r, s]] = [edge, other].map(|ends| ends.map(|end| end.seen(Time::Growing)));
        is_along_translation(s.from(r).cross(v.from(u))) == (other[0].body > edge[0].body)
    })
}

/// Returns whether a point lies to the left of the line from a to b, seen against the x axis, where the line belongs to
/// another body.
pub(super) fn is_left_of(point: &Vertex, [a, b]: [&Vertex; 2]) -> bool {
    let (u, w) = (b.at - a.at, point.at - a.at);
    let (left, right) = (u.y * w.z, u.z * w.y);
    let rounded = Rounded { value: left - right, error: 4.0 * HALF_ULP * (left.abs() + right.abs()) };
    rounded.is_positive().unwrap_or_else(|| {
        let along_x = |time: Time| {
            let [a, b, p] = [a, b, point].map(|end| end.seen(time));
            b.from(a).cross(p.from(a)).map(|power| power[0])
        };
        let sign = first_sign(along_x(Time::Resting)).or_else(|| first_sign(along_x(Time::Growing)));
        sign.unwrap_or_else(|| {
            let u = b.seen(Time::Growing).from(a.seen(Time::Growing));
            let along = [u.at, u.speed, I64Vec3::ZERO].map(|u| [0, -i128::from(u.z), i128::from(u.y)]);
            is_along_translation(along) == (point.body > a.body)
        })
    })
}

/// Returns whether the way from a point to the first end of an edge turns left to the second, seen against the z axis. All are of one
/// body.
pub(super) fn turns_left(point: &Vertex, ends: [&Vertex; 2]) -> bool {
    let [p, a, b] = [point, ends[0], ends[1]].map(|end| end.seen(Time::Growing));
    let turn = a.from(p).cross(b.from(p)).map(|power| power[2]);
    first_sign(turn).unwrap_or_else(|| {
        point.note_touching();
        false
    })
}

/// A product of a vector, which is a normal times a factor, with the translation of a body.
pub(super) struct Move<'a> {
    pub body: u32,
    pub normal: [&'a Polynomial; 3],
    pub factor: &'a Polynomial,
    /// True if the product is subtracted.
    pub is_negative: bool,
}

/// Returns the sign of a sum of products with the translations of bodies. `None` for parallel lines and planes, which do not cross, and
/// where all that meets is of one body.
pub(super) fn first_move_is_positive(moves: &[Move]) -> Option<bool> {
    let mut order: Vec<&Move> = moves.iter().collect();
    order.sort_by_key(|of| std::cmp::Reverse(of.body));
    order.chunk_by(|one, other| one.body == other.body).find_map(|same| {
        (0..3).find_map(|axis| {
            let mut sum = Polynomial::of(&[]);
            same.iter().for_each(|of| sum.add_product(of.normal[axis], of.factor, of.is_negative));
            sum.sign()
        })
    })
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

#[cfg(test)]
pub(super) mod tests {
    use proptest::array::uniform3;
    use proptest::prelude::*;

    use super::super::bodies::{Lattice, Region, Wholeness};
    use super::*;
    use crate::mesh::{Aabb, ClosedMesh, TriangleMesh};

    /// Returns the volume of three vectors by Sarrus' rule.
    fn volume([u, v, w]: [[i128; 3]; 3]) -> i128 {
        let along = |i: usize| u[i % 3] * v[(i + 1) % 3] * w[(i + 2) % 3];
        let against = |i: usize| u[i % 3] * v[(i + 2) % 3] * w[(i + 1) % 3];
        (0..3).map(along).sum::<i128>() - (0..3).map(against).sum::<i128>()
    }

    fn point(at: [i128; 3], body: u32) -> Vertex<'static> {
        Vertex::still(DVec3::from_array(at.map(|c| c as f64)), body)
    }

    fn beyond(scale: i128, along: [i128; 3], [x, y, z]: [i128; 3]) -> [i128; 3] {
        [scale * along[0] + x, scale * along[1] + y, scale * along[2] + z]
    }

    fn step() -> impl Strategy<Value = [i128; 3]> {
        uniform3(-2i128..=2)
    }

    /// Returns consecutive denominators of a continued fraction, whose turn is 1 or −1.
    fn neighbors(quotients: &[i128]) -> [[i128; 2]; 2] {
        quotients.iter().fold([[1, 0], [0, 1]], |[last, one], q| [one, [last[0] + q * one[0], last[1] + q * one[1]]])
    }

    /// Returns tetrahedra as bodies that grow at some rates.
    pub fn growing(corners: &[[[i128; 3]; 4]], rates: &[i32]) -> Bodies {
        let closed = |corners: &[[i128; 3]; 4]| {
            let positions = corners.map(|at| DVec3::from_array(at.map(|c| c as f64))).to_vec();
            let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
            ClosedMesh::check(TriangleMesh { positions, triangles }).unwrap()
        };
        let meshes: Vec<ClosedMesh> = corners.iter().map(closed).collect();
        let bounds = meshes.iter().map(ClosedMesh::bounds).reduce(Aabb::union).unwrap();
        let lattice = Lattice::around(bounds);
        let mut bodies = Bodies::with_room_for(&meshes.iter().collect::<Vec<_>>(), Region::default());
        for (solid, (mesh, rate)) in meshes.iter().zip(rates).enumerate() {
            bodies.add(solid, mesh, &lattice, Wholeness::Whole, Some(*rate)).unwrap();
        }
        bodies
    }

    pub fn tetrahedron() -> impl Strategy<Value = [[i128; 3]; 4]> {
        let from = |a: [i128; 3], b: [i128; 3]| [0, 1, 2].map(|i| b[i] - a[i]);
        let is_solid = move |&[a, b, c, d]: &[[i128; 3]; 4]| volume([b, c, d].map(|point| from(a, point))) != 0;
        prop::array::uniform4(uniform3(0i128..3)).prop_filter("flat", is_solid)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]

        /// Of few positions, so that most bodies have common corners and edges.
        #[test]
        fn bodies_with_common_corners_have_the_signs_of_all_coefficients(
            first in tetrahedron(), second in tetrahedron(), rates in prop::array::uniform2(-2i32..3),
        ) {
            let bodies = growing(&[first, second], &rates);
            for (own, other) in [(0..4u32, 4..8u32), (4..8, 0..4)] {
                let planes = || own.clone().map(|face| bodies.plane(face));
                for (plane, beside) in planes().flat_map(|plane| other.clone().map(move |face| (plane, face))) {
                    let beside = bodies.plane(beside);
                    for point in &beside.corners {
                        let height = |time| first_sign(plane.height(point, time));
                        let expected = height(Time::Resting).or_else(|| height(Time::Growing)).unwrap_or_else(|| {
                            is_along_translation(plane.exact_normal(Time::Growing)) == (point.body > plane.body)
                        });
                        prop_assert_eq!(plane.is_in_front(point), expected);
                        prop_assert_eq!(plane.resting_height(point), plane.height(point, Time::Resting)[0]);
                    }
                    for (i, j) in (0..9).map(|pair| (pair / 3, pair % 3)) {
                        let [u, v] = [&plane.corners[i], &plane.corners[(i + 1) % 3]];
                        let [r, s] = [&beside.corners[j], &beside.corners[(j + 1) % 3]];
                        let volume = |time| {
                            let [u, v, r, s] = [u, v, r, s].map(|end| end.seen(time));
                            first_sign(v.from(u).volume(r.from(u), s.from(u)))
                        };
                        let expected = volume(Time::Resting).or_else(|| volume(Time::Growing)).unwrap_or_else(|| {
                            let [u, v, r, s] = [u, v, r, s].map(|end| end.seen(Time::Growing));
                            is_along_translation(s.from(r).cross(v.from(u))) == (beside.body > plane.body)
                        });
                        prop_assert_eq!(edges_turn([u, v], [r, s]), expected);
                    }
                }
            }
        }

        /// Four points a few steps from a long line: the products of their coordinates are 2^70 times the volume.
        #[test]
        fn volumes_that_rounding_hides_have_their_signs(
            long in uniform3(-(1i128 << 36)..(1 << 36)), (v, w) in (step(), step()), (k, m) in (1i128..8, 1i128..8),
        ) {
            let [a, b, c, d] = [[0; 3], long, beyond(k, long, v), beyond(-m, long, w)];
            let expected = volume([long, v, w]);
            prop_assume!(expected != 0);
            let plane = Plane::new([a, b, c].map(|at| point(at, 0)));
            // (b − a) × (c − a) · (d − a) does not change with multiples of the long vector.
            prop_assert_eq!(plane.is_in_front(&point(d, 1)), expected > 0);
            let [from, to, r, s] = [(a, 0), (b, 0), (c, 1), (d, 1)].map(|(at, body)| point(at, body));
            prop_assert_eq!(edges_turn([&from, &to], [&r, &s]), expected > 0);
            // An edge crosses another plane in d, which is as near to the first.
            let across = |sign: i128| point(beyond(sign, [1 << 37, -(1 << 36) - 3, (1 << 35) + 5], d), 1);
            let ends = [across(1), across(-1)];
            let through = Plane::new([d, beyond(1, d, [1, 1 << 37, 0]), beyond(1, d, [2, 3, 1 << 37])].map(|at| point(at, 2)));
            let heights = ends.each_ref().map(|end| through.is_in_front(end));
            prop_assert_eq!(heights[0], !heights[1]);
            let found = plane.has_crossing_in_front(ends.each_ref(), &through, heights[0]);
            prop_assert_eq!(found, expected > 0);
        }

        /// Two vectors of 37 bits whose turn is one unit, which `f64` takes for none; never for one of the other sign, as both
        /// products are rounded once.
        #[test]
        fn turns_that_rounding_hides_have_their_signs(quotients in prop::collection::vec(1i128..4, 24..60), k in 1i128..4) {
            let quotients: Vec<i128> = quotients;
            let fits = |&n: &usize| neighbors(&quotients[..n]).as_flattened().iter().all(|&c| c < 1 << 37);
            let most = (0..=quotients.len()).rev().find(fits);
            let [u, v] = neighbors(&quotients[..most.unwrap()]);
            let of = |[y, z]: [i128; 2], body: u32| point([7, y, z], body);
            let far = [k * u[0] + v[0], k * u[1] + v[1]];
            let turn = u[0] * v[1] - u[1] * v[0];
            prop_assert!(turn.abs() == 1);
            prop_assert_eq!(is_left_of(&of(far, 1), [&of([0, 0], 0), &of(u, 0)]), turn > 0);
        }
    }
}
