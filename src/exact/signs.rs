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
//! A sign is first computed in `f64`. Differences of points are exact; the determinant has at most five roundings in
//! each product. Where that bound does not decide, integers do: of 128 bits for one determinant (2^123 at most), of 512
//! bits for products of them; and where these are zero, polynomials of such integers.

use bnum::types::I512;
use glam::{DVec3, I64Vec3};

use super::bodies::Bodies;
use super::polynomial::{Number, Polynomial};

/// Half a unit in the last place of 1.
const HALF_ULP: f64 = f64::EPSILON / 2.0;

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

    fn speed(&self) -> I64Vec3 {
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
enum Time {
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
        let product = v.cross(w);
        let (at, speed) = (wide(self.at), wide(self.speed));
        let by = |vector: [i128; 3], power: usize| dot(vector, product[power]);
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
    fn exact_product_is_positive(&self, edge: [&Vertex; 2], through: &Plane) -> bool {
        let product = self.product::<I512>(edge, through, Time::Resting);
        if let Some(sign) = product.value().sign() {
            return sign;
        }
        let product = self.product::<Polynomial>(edge, through, Time::Growing);
        product.value().sign().unwrap_or_else(|| {
            // Moving the edge by s and the planes by s₁, s₂ adds n₁ · (s − s₁) to D and n₂ · (s − s₂) to H.
            let Product { above_through: [d, e], above_own: [g, h] } = product;
            let normal = |plane: &Plane| vector::<Polynomial>(plane.exact_normal(Time::Growing));
            let along_through = normal(through).map(|n| n.times(h.minus(g)));
            let along_own = normal(self).map(|n| n.times(d.minus(e)));
            let of_edge = [0, 1, 2].map(|i| along_through[i].plus(along_own[i]));
            let turned = |vector: [Polynomial; 3]| vector.map(|c| Polynomial::of(&[]).minus(c));
            let moves =
                [(edge[0].body, of_edge), (through.body, turned(along_through)), (self.body, turned(along_own))];
            first_move_is_positive(moves).unwrap_or_else(|| {
                self.corners[0].note_touching();
                false
            })
        })
    }

    fn product<T: Number>(&self, [u, v]: [&Vertex; 2], through: &Plane, time: Time) -> Product<T> {
        let above = |plane: &Plane| [u, v].map(|end| T::of(&plane.height(end, time)));
        Product { above_through: above(through), above_own: above(self) }
    }
}

/// The heights of the ends of an edge above two planes.
struct Product<T> {
    above_through: [T; 2],
    above_own: [T; 2],
}

impl<T: Number> Product<T> {
    fn value(&self) -> T {
        let ([d, e], [g, h]) = (self.above_through, self.above_own);
        d.times(h).minus(e.times(g))
    }
}

/// Returns a vector by components from its coefficients by powers.
fn vector<T: Number>(coefficients: [[i128; 3]; 3]) -> [T; 3] {
    [0, 1, 2].map(|axis| T::of(&coefficients.map(|power| power[axis])))
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

/// Returns whether the point common to three planes lies in front of a fourth. No two of the planes may be parallel to the
/// line of the others; see [`common_point`].
pub(super) fn common_point_is_in_front(planes: [&Plane; 3], fourth: &Plane) -> bool {
    let resting = Common::<I512>::of(planes, Time::Resting);
    if let (Some(above), Some(orientation)) = (resting.height(fourth, Time::Resting).sign(), resting.determinant.sign())
    {
        return above == orientation;
    }
    let growing = Common::<Polynomial>::of(planes, Time::Growing);
    let is_positive = growing.height(fourth, Time::Growing).sign().unwrap_or_else(|| {
        let minors = growing.minors(fourth, Time::Growing);
        let all = [planes[0], planes[1], planes[2], fourth];
        let normal = |i: usize| Equation::<Polynomial>::of(all[i], Time::Growing).normal;
        let moves = [0, 1, 2, 3].map(|i| (all[i].body, normal(i).map(|n| n.times(minors[i]))));
        first_move_is_positive(moves).unwrap_or_else(|| {
            fourth.corners[0].note_touching();
            false
        })
    });
    Some(is_positive) == growing.determinant.sign()
}

/// Returns the point common to three planes, rounded once; `None` where they are parallel to a line.
pub(super) fn common_point(planes: [&Plane; 3]) -> Option<Located> {
    let resting = Common::<I512>::of(planes, Time::Resting);
    let at = match resting.determinant.sign() {
        Some(_) => resting.point(),
        None => {
            let growing = Common::<Polynomial>::of(planes, Time::Growing);
            growing.determinant.sign()?;
            growing.point()
        }
    };
    Some(Located { at, error: 4.0 * HALF_ULP * at.length() })
}

/// A plane n · x = o in integers.
#[derive(Clone, Copy)]
struct Equation<T> {
    normal: [T; 3],
    offset: T,
}

impl<T: Number> Equation<T> {
    fn of(plane: &Plane, time: Time) -> Equation<T> {
        let normal = vector::<T>(plane.exact_normal(time));
        let corner = plane.corners[0].seen(time);
        let (at, speed) = (wide(corner.at), wide(corner.speed));
        let along = |axis: usize| normal[axis].times(T::of(&[at[axis], speed[axis]]));
        Equation { normal, offset: along(0).plus(along(1)).plus(along(2)) }
    }

    fn crossed(&self, other: &Equation<T>) -> [T; 3] {
        let (a, b) = (&self.normal, &other.normal);
        [[1, 2], [2, 0], [0, 1]].map(|[i, j]| a[i].times(b[j]).minus(a[j].times(b[i])))
    }

    fn normal_volume(&self, b: &Equation<T>, c: &Equation<T>) -> T {
        let (n, m) = (&self.normal, b.crossed(c));
        n[0].times(m[0]).plus(n[1].times(m[1])).plus(n[2].times(m[2]))
    }
}

/// The point common to three planes.
struct Common<T> {
    planes: [Equation<T>; 3],
    determinant: T,
}

impl<T: Number> Common<T> {
    fn of(planes: [&Plane; 3], time: Time) -> Common<T> {
        let planes = planes.map(|plane| Equation::of(plane, time));
        Common { planes, determinant: planes[0].normal_volume(&planes[1], &planes[2]) }
    }

    /// Returns the point by Cramer's rule.
    fn point(&self) -> DVec3 {
        let [f, g, h] = &self.planes;
        let sides = [g.crossed(h), h.crossed(f), f.crossed(g)];
        let of = |i: usize| {
            let terms = [f.offset.times(sides[0][i]), g.offset.times(sides[1][i]), h.offset.times(sides[2][i])];
            terms[0].plus(terms[1]).plus(terms[2]).quotient(self.determinant)
        };
        DVec3::from_array([0, 1, 2].map(of))
    }

    /// Returns the factors of the offsets in the height above a fourth plane.
    fn minors(&self, fourth: &Plane, time: Time) -> [T; 4] {
        let ([f, g, h], k) = (&self.planes, &Equation::of(fourth, time));
        let negative = |value: T| T::of(&[0]).minus(value);
        [g.normal_volume(h, k), negative(h.normal_volume(k, f)), k.normal_volume(f, g), negative(self.determinant)]
    }

    /// Returns the height above a fourth plane, times the determinant: the heights are n · x − o, and with Cramer's rule that is
    /// the sum of the offsets times their minors.
    fn height(&self, fourth: &Plane, time: Time) -> T {
        let minors = self.minors(fourth, time);
        let [f, g, h] = &self.planes;
        let offsets = [f.offset, g.offset, h.offset, Equation::of(fourth, time).offset];
        (0..4).fold(T::of(&[0]), |sum, i| sum.plus(offsets[i].times(minors[i])))
    }
}

/// Returns the sign of a sum of products of vectors with the translations of bodies. `None` for parallel lines and planes, which do
/// not cross, and where all that meets is of one body.
fn first_move_is_positive<const N: usize>(moves: [(u32, [Polynomial; 3]); N]) -> Option<bool> {
    let mut order: [usize; N] = std::array::from_fn(|i| i);
    order.sort_by_key(|&i| std::cmp::Reverse(moves[i].0));
    for same in order.chunk_by(|&i, &j| moves[i].0 == moves[j].0) {
        for axis in 0..3 {
            let sum = same.iter().fold(Polynomial::of(&[]), |sum, &i| sum.plus(moves[i].1[axis]));
            if let Some(sign) = sum.sign() {
                return Some(sign);
            }
        }
    }
    None
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
mod tests {
    use proptest::array::uniform3;
    use proptest::prelude::*;

    use super::super::bodies::{Lattice, Region, Wholeness};
    use super::*;
    use crate::mesh::{ClosedMesh, TriangleMesh};

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

    /// Returns two tetrahedra as bodies that grow at some rates.
    fn growing(corners: [[[i128; 3]; 4]; 2], rates: [i32; 2]) -> Bodies {
        let [first, second] = corners.map(|corners| {
            let positions = corners.map(|at| DVec3::from_array(at.map(|c| c as f64))).to_vec();
            let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
            ClosedMesh::check(TriangleMesh { positions, triangles }).unwrap()
        });
        let lattice = Lattice::around(first.bounds().union(second.bounds()));
        let mut bodies = Bodies::with_room_for(&[&first, &second], Region::default());
        for (solid, mesh) in [first, second].iter().enumerate() {
            bodies.add(solid, mesh, &lattice, Wholeness::Whole, Some(rates[solid])).unwrap();
        }
        bodies
    }

    fn tetrahedron() -> impl Strategy<Value = [[i128; 3]; 4]> {
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
            let bodies = growing([first, second], rates);
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
