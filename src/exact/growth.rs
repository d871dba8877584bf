//! The directions in which the points of a body move while it grows.
//!
//! Where faces of two solids coincide, the result of a Boolean has no wall there if one of the two is displaced in the right
//! direction. For a union the first solid grows by an infinitesimal: faces that touch overlap, and faces that are flush are those of
//! the first solid. For an intersection or a difference it shrinks (E. Lalish, manifold3d, expands and shrinks vertices along their
//! normals in the same way). So each leaf of an expression has a rate, positive if the operations around it unite.
//!
//! A point moves towards the front of all its faces, if there is such a direction; at a saddle there may be none, and then coincident
//! faces may keep a wall or a gap of no thickness around that point.

use std::sync::OnceLock;

use glam::{DVec3, I64Vec3};

use super::bodies::Bodies;
use crate::boolean::{BooleanOperation, Expression};

/// The greatest component of a direction: large, so that one within a needle's corner stays there when it is rounded, and a multiple
/// of all numbers up to 16, so that one along an edge of a small grid stays in the planes of the faces there.
const LENGTH: f64 = 720_720.0;

/// The cosine of the angle to the nearest face from which the sum of the normals is the direction.
const LEAST_COSINE: f64 = 0.05;

/// Most faces of different planes at a point of which all threes are tried.
const MOST_PLANES: usize = 24;

/// A solid of an expression, or its complement if it is subtracted.
#[derive(Clone, Copy)]
struct Leaf {
    input: usize,
    is_complement: bool,
    /// The rate at which the solid, or its complement, grows.
    rate: i32,
}

/// Returns the rate at which each solid of an expression grows.
///
/// Faces that touch overlap if the sum of the rates is positive, as a union needs it, and part if it is negative, as an intersection
/// needs it. A difference is an intersection with complements. Expressions of several operations may ask for what contradicts
/// itself; then some pairs have a gap or a wall.
pub(super) fn rates(expression: &Expression, solids: usize) -> Vec<i32> {
    let leaves = expression.fold(
        |input| vec![Leaf { input, is_complement: false, rate: 0 }],
        |operation, operands: &[Vec<Leaf>]| match operation {
            BooleanOperation::Union | BooleanOperation::Xor => beside(operands.to_vec(), 1),
            BooleanOperation::Intersection => beside(operands.to_vec(), -1),
            BooleanOperation::Difference => {
                let mut operands = operands.to_vec();
                for leaf in operands.iter_mut().skip(1).flatten() {
                    *leaf = Leaf { input: leaf.input, is_complement: !leaf.is_complement, rate: -leaf.rate };
                }
                beside(operands, -1)
            }
        },
    );
    let mut rates = vec![0; solids];
    for Leaf { input, is_complement, rate } in leaves {
        rates[input] = if is_complement { -rate } else { rate };
    }
    rates
}

/// Returns the leaves of operands, with rates of which any two of different operands have a sum of a sign, where those within an
/// operand allow it.
fn beside(operands: Vec<Vec<Leaf>>, sign: i32) -> Vec<Leaf> {
    // The last of the single ones is the first to be added: of two, the second one rests.
    let (several, single): (Vec<_>, Vec<_>) = operands.into_iter().partition(|own| own.len() > 1);
    let mut all: Vec<Leaf> = Vec::new();
    for mut own in several.into_iter().chain(single.into_iter().rev()) {
        own.sort_by_key(|leaf| sign * leaf.rate);
        let may_grow = own.len() < 2 || sign * (own[0].rate + own[1].rate) > 0;
        if let (Some(greatest), true) = (all.iter().map(|leaf| leaf.rate.abs()).max(), may_grow) {
            let more = greatest + 1 - sign * own[0].rate;
            own.iter_mut().for_each(|leaf| leaf.rate += sign * more);
        }
        all.append(&mut own);
    }
    all
}

/// The directions in which points move. Each is found when it is first asked for, as few points need theirs.
#[derive(Debug, Default)]
pub(super) struct Directions {
    of_points: OnceLock<OfPoints>,
}

/// The faces at each point, and its direction once that is known.
#[derive(Debug)]
struct OfPoints {
    /// The faces by points.
    faces: Vec<u32>,
    /// The end of the faces of each point.
    ends: Vec<u32>,
    directions: Vec<OnceLock<[i32; 3]>>,
}

impl Directions {
    /// Returns the direction in which a point moves while its body grows.
    pub fn of(&self, bodies: &Bodies, point: u32) -> I64Vec3 {
        let of_points = self.of_points.get_or_init(|| OfPoints::new(bodies));
        let direction =
            of_points.directions[point as usize].get_or_init(|| direction(bodies, of_points.faces_at(point)));
        I64Vec3::from_array(direction.map(i64::from))
    }
}

impl OfPoints {
    fn new(bodies: &Bodies) -> OfPoints {
        let mut ends = vec![0u32; bodies.points.len()];
        bodies.faces.as_flattened().iter().for_each(|&point| ends[point as usize] += 1);
        let mut sum = 0;
        for end in &mut ends {
            let count = *end;
            *end = sum;
            sum += count;
        }
        let mut faces = vec![0; 3 * bodies.faces.len()];
        for (face, corners) in (0..).zip(&bodies.faces) {
            for &point in corners {
                faces[ends[point as usize] as usize] = face;
                ends[point as usize] += 1;
            }
        }
        let directions = ends.iter().map(|_| OnceLock::new()).collect();
        OfPoints { faces, ends, directions }
    }

    /// Returns the faces at a point.
    fn faces_at(&self, point: u32) -> &[u32] {
        let start = point.checked_sub(1).map_or(0, |before| self.ends[before as usize]);
        &self.faces[start as usize..self.ends[point as usize] as usize]
    }
}

/// Returns the direction in which a point moves, given the faces at it.
fn direction(bodies: &Bodies, faces: &[u32]) -> [i32; 3] {
    let mut normals: Vec<DVec3> = Vec::new();
    for &face in faces.iter().filter(|&&face| !bodies.plane(face).is_flat()) {
        let [a, b, c] = bodies.corners(face);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        // A plane counts once, however many faces it has.
        if normals.iter().all(|other| other.dot(normal) < 1.0 - 1e-12) {
            normals.push(normal);
        }
    }
    whole(in_front(&normals))
}

/// Returns a direction in whole numbers.
fn whole(direction: DVec3) -> [i32; 3] {
    let longest = direction.abs().max_element();
    if longest < 1e-9 { [0; 3] } else { (direction * (LENGTH / longest)).round().as_ivec3().to_array() }
}

/// Returns a direction towards the front of all planes at a point, of their unit normals; of none if there is none.
fn in_front(normals: &[DVec3]) -> DVec3 {
    let sum: DVec3 = normals.iter().sum();
    let cosine = |direction: DVec3| normals.iter().map(|normal| normal.dot(direction)).fold(f64::INFINITY, f64::min);
    let mean = sum.normalize_or_zero();
    let mut best = (cosine(mean), mean);
    if best.0 >= LEAST_COSINE {
        return mean;
    }
    // The best direction is as far from three planes, or from two.
    let few = &normals[..normals.len().min(MOST_PLANES)];
    for (i, &a) in few.iter().enumerate() {
        for (j, &b) in few.iter().enumerate().skip(i + 1) {
            let between = [a + b].into_iter();
            let beside = few[j + 1..].iter().map(|&c| (b - a).cross(c - a) * a.dot(b.cross(c)).signum());
            for direction in between.chain(beside).map(DVec3::normalize_or_zero) {
                let found = cosine(direction);
                if found > best.0 {
                    best = (found, direction);
                }
            }
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_of_sharp_corners_have_all_faces_behind_them() {
        let corner = |normals: &[[f64; 3]]| {
            let normals: Vec<DVec3> = normals.iter().map(|&n| DVec3::from_array(n).normalize()).collect();
            normals.iter().map(|normal| normal.dot(in_front(&normals))).fold(f64::INFINITY, f64::min)
        };
        assert!(corner(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]) > 0.5);
        // A needle, and a blade.
        assert!(corner(&[[1.0, 0.0, 0.01], [-1.0, 1.0, 0.01], [-1.0, -1.0, 0.01]]) > 0.005);
        assert!(corner(&[[1.0, 0.0, 0.01], [-1.0, 0.0, 0.01], [0.0, 1.0, 1.0], [0.0, -1.0, 0.5]]) > 0.005);
        // A saddle has none.
        assert!(corner(&[[1.0, 0.0, 0.1], [-1.0, 0.0, 0.1], [0.0, 1.0, -0.1], [0.0, -1.0, -0.1]]) <= 0.0);
    }

    #[test]
    fn where_four_faces_meet_points_move_along_the_edge() {
        for edge in [[1, -2, 0], [3, 1, -7], [-5, 0, 16]].map(|edge: [i32; 3]| DVec3::from_array(edge.map(f64::from))) {
            let normals = [DVec3::new(0.3, 1.0, 0.2), DVec3::new(-1.0, 0.1, 0.4)].map(|n| n.cross(edge).normalize());
            let all = [normals[0], -normals[0], normals[1], -normals[1], edge.normalize()];
            let direction = I64Vec3::from_array(whole(in_front(&all)).map(i64::from)).as_dvec3();
            assert_eq!(direction.cross(edge), DVec3::ZERO, "{edge}");
        }
    }

    #[test]
    fn what_unites_grows_and_what_cuts_shrinks() {
        let of = |text: &str| {
            let names: Vec<&str> = ["a", "b", "c", "d"].into_iter().filter(|name| text.contains(name)).collect();
            rates(&Expression::parse(text, &names).unwrap(), names.len())
        };
        let sums = |text: &str, signs: [i32; 4]| {
            let rates: Vec<i32> = of(text).iter().zip(signs).map(|(rate, sign)| rate * sign).collect();
            [0, 1, 2].map(|i| (i + 1..4).map(|j| rates[i] + rates[j]).collect::<Vec<i32>>()).concat()
        };
        for text in ["a | b | c | d", "(a | b) | (c | d)", "a | (b | (c | d))"] {
            assert!(sums(text, [1; 4]).iter().all(|&sum| sum > 0), "{text}: {:?}", of(text));
        }
        assert!(sums("a & b & c & d", [1; 4]).iter().all(|&sum| sum < 0));
        for text in ["a - b - c - d", "a - (b | c | d)", "(a & b) - (c | d)"] {
            let signs = if text.contains('&') { [1, 1, -1, -1] } else { [1, -1, -1, -1] };
            assert!(sums(text, signs).iter().all(|&sum| sum < 0), "{text}: {:?}", of(text));
        }
        let [a, b, c] = of("(a & b) | c")[..] else { panic!("three solids") };
        assert!(a + b < 0 && a + c > 0 && b + c > 0);
        assert_eq!(of("a | b"), [1, 0]);
        assert_eq!(of("a - b"), [-1, 0]);
    }
}
