//! Exact predicates under a small movement: crossings of triangles, and winding numbers of a surface around a point.
//!
//! A *movable* position is one that stands for itself + ε, ε₁ ≫ ε₂ ≫ ε₃ > 0. All coordinates are below 2^30 in magnitude, and
//! so are the differences of fixed ones; differences of a fixed and a movable one are below 2^31. Normals are then below 2^61
//! and fit `i64`, and their products with differences are summed in `i128`.

use crate::grid::{Axis, LatticeBox};

/// The corners of a triangle.
pub type Corners = [[i32; 3]; 3];

type Vector = [i64; 3];

/// Relative error bound of a rounded sum of three products of integers that were rounded to `f64`, in units of the sum of their
/// magnitudes: five roundings of 2^-53 affect each of its terms.
const DOUBT: f64 = 1.0 / (1u64 << 50) as f64;

#[inline]
fn difference([x, y, z]: [i32; 3], [from_x, from_y, from_z]: [i32; 3]) -> Vector {
    let along = |to: i32, from: i32| i64::from(to) - i64::from(from);
    [along(x, from_x), along(y, from_y), along(z, from_z)]
}

#[inline]
fn product([ax, ay, az]: Vector, [bx, by, bz]: Vector) -> Vector {
    [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]
}

/// Returns (b − a) × (c − a).
#[inline]
fn normal([a, b, c]: &Corners) -> Vector {
    product(difference(*b, *a), difference(*c, *a))
}

/// Returns the sign of n·(d + ε): 1 or −1, and 0 if n is zero.
#[inline]
fn moved_sign(normal: Vector, difference: Vector) -> i32 {
    let term = |i: usize| normal[i] as f64 * difference[i] as f64;
    let terms = [term(0), term(1), term(2)];
    let sum = terms[0] + terms[1] + terms[2];
    if sum.abs() > (terms[0].abs() + terms[1].abs() + terms[2].abs()) * DOUBT {
        return if sum > 0.0 { 1 } else { -1 };
    }
    exact_moved_sign(normal, difference)
}

#[cold]
fn exact_moved_sign(normal: Vector, difference: Vector) -> i32 {
    let sum: i128 = (0..3).map(|i| i128::from(normal[i]) * i128::from(difference[i])).sum();
    match sum.signum() as i32 {
        0 => normal.iter().map(|n| n.signum() as i32).find(|&sign| sign != 0).unwrap_or(0),
        sign => sign,
    }
}

/// Returns whether a triangle may come within a lattice step of a box: false only if its plane misses the box.
#[inline]
pub fn may_reach(corners: &Corners, bounds: &LatticeBox) -> bool {
    let normal = normal(corners).map(|n| n as f64);
    let along = |i: usize| {
        let (low, high) = (f64::from(bounds.min[i]), f64::from(bounds.max[i]));
        // From the corner to the middle of the box, along the normal; the contribution of the box, and two steps.
        let middle = 0.5 * (low + high) - f64::from(corners[0][i]);
        (normal[i] * middle, normal[i].abs() * (0.5 * (high - low) + 2.0), (normal[i] * middle).abs())
    };
    let terms = [along(0), along(1), along(2)];
    let sum = |part: fn(&(f64, f64, f64)) -> f64| terms.iter().map(part).sum::<f64>();
    sum(|term| term.0).abs() <= sum(|term| term.1) + sum(|term| term.2) * DOUBT
}

/// Returns the sides of the plane of a fixed triangle that the corners of a movable one lie on; all 0 if the former has no
/// area.
#[inline]
fn sides_of_moved(normal: Vector, corner: [i32; 3], [a, b, c]: &Corners) -> [i32; 3] {
    let side = |position: &[i32; 3]| moved_sign(normal, difference(*position, corner));
    [side(a), side(b), side(c)]
}

/// Returns the sides of the plane of a movable triangle that the corners of a fixed one lie on; all 0 if the former has no
/// area.
#[inline]
fn sides_of_fixed(normal: Vector, corner: [i32; 3], [a, b, c]: &Corners) -> [i32; 3] {
    let side = |position: &[i32; 3]| -moved_sign(normal, difference(corner, *position));
    [side(a), side(b), side(c)]
}

/// The position of a triangle relative to a plane.
#[derive(Clone, Copy)]
enum Split {
    /// All on one side.
    No,
    /// This corner is on one side, and the others are on the other.
    Lone(usize),
    /// The plane is undefined, as its triangle has no area.
    NoPlane,
}

impl Split {
    fn of(sides: [i32; 3]) -> Split {
        match sides {
            [0, ..] => Split::NoPlane,
            [a, b, c] if a == b && b == c => Split::No,
            [a, b, _] if a == b => Split::Lone(2),
            [a, _, c] if a == c => Split::Lone(1),
            _ => Split::Lone(0),
        }
    }
}

/// Corners at the ends of an edge.
type Edge = [usize; 2];

const EDGES: [Edge; 3] = [[0, 1], [1, 2], [2, 0]];

/// Returns the edges from a corner.
fn edges_from(corner: usize) -> [Edge; 2] {
    [[corner, (corner + 1) % 3], [corner, (corner + 2) % 3]]
}

/// Returns the sense in which an edge of a movable triangle passes one of a fixed triangle; 0 if they are parallel.
fn passing(fixed: &Corners, [from, to]: Edge, moved: &Corners, [moved_from, moved_to]: Edge) -> i32 {
    let edge = difference(fixed[to], fixed[from]);
    let moved_edge = difference(moved[moved_to], moved[moved_from]);
    moved_sign(product(edge, moved_edge), difference(moved[moved_from], fixed[from]))
}

fn all_same(signs: impl IntoIterator<Item = i32>) -> bool {
    let mut signs = signs.into_iter();
    let first = signs.next();
    signs.all(|sign| Some(sign) == first)
}

/// Returns whether a fixed triangle and a movable one cross. Either may have no area, and is then a segment; two segments never
/// cross.
pub fn do_cross(fixed: &Corners, moved: &Corners) -> bool {
    let of_moved = Split::of(sides_of_moved(normal(fixed), fixed[0], moved));
    if let Split::No = of_moved {
        return false;
    }
    let of_fixed = Split::of(sides_of_fixed(normal(moved), moved[0], fixed));
    match (of_fixed, of_moved) {
        (Split::Lone(i), Split::Lone(j)) => spans_overlap(fixed, i, moved, j),
        // A segment crosses a triangle if it crosses the plane and passes all edges in the same sense.
        (Split::Lone(i), Split::NoPlane) => {
            edges_from(i).iter().any(|&edge| all_same(EDGES.map(|other| passing(fixed, edge, moved, other))))
        }
        (Split::NoPlane, Split::Lone(j)) => {
            edges_from(j).iter().any(|&edge| all_same(EDGES.map(|other| passing(fixed, other, moved, edge))))
        }
        _ => false,
    }
}

/// Returns whether two triangles that meet one another's planes meet one another. Each meets the intersection line of the
/// planes in a span between two edges, those from its lone corner. All four pairs of edges pass in the same sense if and only
/// if one span ends before the other begins: the sense shows which of the two edges meets the line first, since the edges from
/// a corner cross the other plane in the same direction.
fn spans_overlap(fixed: &Corners, i: usize, moved: &Corners, j: usize) -> bool {
    let of_edge = |edge| edges_from(j).into_iter().map(move |other| passing(fixed, edge, moved, other));
    !all_same(edges_from(i).into_iter().flat_map(of_edge))
}

/// Returns the contribution of a triangle to the winding number around a movable point, counted on the ray from there upwards
/// or downwards along an axis: 1 where the ray leaves the triangle's solid, −1 where it enters.
pub fn winding(triangle: &Corners, point: [i32; 3], ray: Ray) -> i32 {
    let axis = ray.axis.depth();
    let turn = turn_around(triangle, point, axis);
    if turn == 0 {
        return 0;
    }
    let [a, b, c] = triangle.map(|corner| corner[axis]);
    // The point's true height is slightly greater than its coordinate.
    let is_above = match point[axis] {
        height if height < a.min(b).min(c) => true,
        height if height >= a.max(b).max(c) => false,
        // The point is above the plane if it is on the side of the normal and the normal points up, or neither.
        _ => moved_sign(normal(triangle), difference(point, triangle[0])) != turn,
    };
    match (ray.way, is_above) {
        (Way::Up, true) => turn,
        (Way::Down, false) => -turn,
        _ => 0,
    }
}

/// A ray along an axis.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Its axis.
    pub axis: Axis,
    /// The direction along the axis.
    pub way: Way,
}

impl Ray {
    /// Returns whether the ray from a movable point meets a box.
    #[inline]
    pub fn meets(&self, bounds: &LatticeBox, point: [i32; 3]) -> bool {
        let is_within = |i: usize| (bounds.min[i] <= point[i]) & (point[i] < bounds.max[i]);
        let depth = self.axis.depth();
        let is_ahead = match self.way {
            Way::Up => point[depth] < bounds.max[depth],
            Way::Down => bounds.min[depth] <= point[depth],
        };
        is_ahead & is_within(self.axis.column()) & is_within(self.axis.row())
    }
}

/// A direction along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// To greater coordinates.
    Up,
    /// To lesser coordinates.
    Down,
}

/// Returns the sign of the triangle's normal along the axis if the line through a movable point meets the triangle, and 0
/// otherwise.
fn turn_around(triangle: &Corners, point: [i32; 3], axis: usize) -> i32 {
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let turn_at = |[from, to]: Edge| {
        let edge = difference(triangle[to], triangle[from]);
        let to_point = difference(point, triangle[from]);
        let sign = (edge[i] * to_point[j] - edge[j] * to_point[i]).signum() as i32;
        let tie = |coordinate: usize| if coordinate == j { edge[i].signum() as i32 } else { -edge[j].signum() as i32 };
        [sign, tie(i.min(j)), tie(i.max(j))].into_iter().find(|&sign| sign != 0).unwrap_or(0)
    };
    let turns = EDGES.map(turn_at);
    if all_same(turns) { turns[0] } else { 0 }
}
