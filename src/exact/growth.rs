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

/// The greatest component of a direction.
const LENGTH: f64 = 1023.0;

/// Most steps to a direction that has all faces behind it.
const STEPS: usize = 32;

/// The cosine of the angle to the nearest face below which a direction is turned.
const LEAST_COSINE: f64 = 0.05;

/// Returns the rate at which each solid of an expression grows.
///
/// Faces that touch overlap if the sum of the rates is positive, as a union needs it, and part if it is negative, as an intersection
/// and a difference need it. Of faces that are flush, the one with the greater rate lies in front, and that of a solid that is
/// subtracted must. Expressions of several operations may ask for what contradicts itself; then some pairs have a gap or a wall.
pub(super) fn rates(expression: &Expression, solids: usize) -> Vec<i32> {
    let found = expression.fold(
        |input| vec![(input, 0)],
        |operation, operands| {
            let (first, others) = operands.split_first().expect("an operation has operands");
            match operation {
                BooleanOperation::Union | BooleanOperation::Xor => beside(operands, 1),
                BooleanOperation::Intersection => beside(operands, -1),
                BooleanOperation::Difference => {
                    let mut all = beside(others, 1);
                    let greatest = greatest(&all);
                    match first[..] {
                        [(input, _)] => all.push((input, -greatest - 1)),
                        _ => {
                            // What is subtracted lies in front.
                            let front = first.iter().map(|&(_, rate)| rate).max().unwrap_or(0);
                            let least = all.iter().map(|&(_, rate)| rate).min().unwrap_or(0);
                            all.iter_mut().for_each(|(_, rate)| *rate += front + 1 - least);
                            all.extend_from_slice(first);
                        }
                    }
                    all
                }
            }
        },
    );
    let mut rates = vec![0; solids];
    found.into_iter().for_each(|(input, rate)| rates[input] = rate);
    rates
}

fn greatest(rates: &[(usize, i32)]) -> i32 {
    rates.iter().map(|(_, rate)| rate.abs()).max().unwrap_or(0)
}

/// Returns the rates of operands whose single solids grow, or shrink, more than all before.
fn beside(operands: &[Vec<(usize, i32)>], sign: i32) -> Vec<(usize, i32)> {
    let mut all: Vec<(usize, i32)> = operands.iter().filter(|own| own.len() > 1).flatten().copied().collect();
    // The last of the single ones is the first to be added: of two, the second one rests.
    for own in operands.iter().rev().filter(|own| own.len() == 1) {
        let rate = if all.is_empty() { 0 } else { sign * (greatest(&all) + 1) };
        all.push((own[0].0, rate));
    }
    all
}

/// The faces at each point, once they are needed.
#[derive(Debug, Default)]
pub(super) struct Stars {
    stars: OnceLock<(Vec<u32>, Vec<u32>)>,
}

impl Stars {
    /// Returns the faces at a point.
    fn at(&self, bodies: &Bodies, point: u32) -> &[u32] {
        let (ends, faces) = self.stars.get_or_init(|| sorted(bodies));
        let start = point.checked_sub(1).map_or(0, |before| ends[before as usize]);
        &faces[start as usize..ends[point as usize] as usize]
    }

    /// Returns the direction in which a point moves while its body grows.
    pub fn direction(&self, bodies: &Bodies, point: u32) -> I64Vec3 {
        let mut normals: Vec<DVec3> = Vec::new();
        for &face in self.at(bodies, point) {
            let [a, b, c] = bodies.corners(face);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            // A plane counts once, however many faces it has.
            if normals.iter().all(|other| other.dot(normal) < 1.0 - 1e-12) {
                normals.push(normal);
            }
        }
        let mut direction: DVec3 = normals.iter().sum();
        for _ in 0..STEPS {
            let length = direction.length();
            let nearest = normals.iter().min_by(|a, b| a.dot(direction).total_cmp(&b.dot(direction)));
            let Some(nearest) = nearest.filter(|nearest| nearest.dot(direction) < LEAST_COSINE * length.max(1e-9))
            else {
                break;
            };
            direction += (0.5 * length + 0.1) * *nearest;
        }
        let longest = direction.abs().max_element();
        if longest < 1e-9 { I64Vec3::ZERO } else { (direction * (LENGTH / longest)).round().as_i64vec3() }
    }
}

/// Returns the faces by points, and the end of those of each point.
fn sorted(bodies: &Bodies) -> (Vec<u32>, Vec<u32>) {
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
    (ends, faces)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_unites_grows_and_what_cuts_shrinks() {
        let of = |text: &str| rates(&Expression::parse(text, &["a", "b", "c"]).unwrap(), 3);
        assert_eq!(of("a | b | c"), [2, 1, 0]);
        assert_eq!(of("a & b & c"), [-2, -1, 0]);
        assert_eq!(of("a - b - c")[0], -2);
        let [a, b, c] = of("(a & b) | c")[..] else { panic!("three solids") };
        assert!(a + b < 0 && a + c > 0 && b + c > 0);
        let [a, b, c] = of("(a | b) - c")[..] else { panic!("three solids") };
        assert!(a + b > 0 && c > a && c > b);
    }
}
