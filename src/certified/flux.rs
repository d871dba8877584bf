//! The share of a triangle in the integral of the winding number over a cell.
//!
//! Along +x the winding number grows by one where the outer normal of a triangle points to −x. So a triangle T adds
//! −∫ g(x) nₓ dA over its part between the planes of the cell across y and z, where g, the length of the ray within the cell
//! behind the crossing, is the side L of the cell for x below it, 0 beyond it, and falls from L to 0 within.
//!
//! # The error bound
//! With ε = 2⁻⁵³, *reach* m the largest coordinate relative to the cell's corner, *side* s the longest of the cell, and p the
//! lesser of the triangle's perimeter and 8 s:
//! - If the corners of a chain of triangles move by η at most, the integral of g dy∧dz over the part within the planes changes by
//!   no more than the volume that the chain sweeps within the cell, as d(g dy∧dz) = g′ dx∧dy∧dz with |g′| ≤ 1, and L times
//!   the area that its rim sweeps in the projection within the cell. The planes across y and z add nothing, as dy∧dz vanishes on
//!   them; and g is continuous. A triangle has at most the area 0.4 p s in a cell, a side at most the length p / 2 in it.
//! - The corners relative to the cell are rounded: η ≤ 2 ε m. The sides of the cell are rounded as well. Together less than
//!   20 ε m p s.
//! - Each of six cuts creates two points at most. One coordinate of them is that of the plane, and the others have errors
//!   below 14 ε m: η ≤ 24 ε m. They belong to 3 sides and at most 7 triangles of a fan. Both parts at a plane across x use the
//!   same points. Together less than 6 · 24 · (7 · 0.4 + 3 · 0.5) < 680 ε m p s.
//! - Areas and means of fans are rounded: less than 300 ε m p s.
//!
//! So an error of 2048 ε m p s is not exceeded, nor one of 32 ε m p s where nothing is cut.

use glam::DVec3;

use super::cell::Cell;

/// Error of a triangle that is cut, and of one that is not, as a share of m p s.
const CUT: f64 = 1024.0 * f64::EPSILON;
const WHOLE: f64 = 16.0 * f64::EPSILON;

/// A sum with a bound of its error.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sum {
    value: f64,
    /// The rounding of `value`, itself summed (Neumaier 1974).
    lost: f64,
    /// The sum of all magnitudes.
    magnitude: f64,
    error: f64,
}

impl Sum {
    pub fn add(&mut self, value: f64, error: f64) {
        let sum = self.value + value;
        let back = sum - self.value;
        self.lost += (self.value - (sum - back)) + (value - back);
        self.value = sum;
        self.magnitude += value.abs();
        self.error += error;
    }

    /// Returns the sum and a bound of its error.
    pub fn total(&self) -> (f64, f64) {
        // The errors are sums of fewer than 2³¹ rounded terms.
        (self.value + self.lost, (self.error + 4.0 * f64::EPSILON * self.magnitude) * (1.0 + 1e-6))
    }
}

/// Adds the share of a triangle in the integral of the winding number over a cell.
pub(super) fn add_share(sum: &mut Sum, corners: &[DVec3; 3], cell: &Cell) {
    let sides = cell.sides();
    let local = corners.map(|corner| corner - cell.min);
    let side = sides.max_element();
    let reach = local.iter().fold(sides, |reach, corner| reach.max(corner.abs())).max_element();
    let [a, b, c] = local;
    let perimeter = ((b - a).length() + (c - b).length() + (a - c).length()).min(8.0 * side);
    let scale = reach * perimeter * side;

    let (min, max) = (a.min(b).min(c), a.max(b).max(c));
    let is_within = |axis: usize| min[axis] >= 0.0 && max[axis] <= sides[axis];
    if is_within(1) && is_within(2) {
        if max.x <= 0.0 {
            return sum.add(-sides.x * shadow(a, b, c), WHOLE * scale);
        }
        if is_within(0) {
            return sum.add(-shadow(a, b, c) * (sides.x - (a.x + b.x + c.x) / 3.0), WHOLE * scale);
        }
    }
    let mut polygon = Polygon::of(local);
    for axis in [1, 2] {
        polygon = polygon.part(axis, 0.0, 1.0).part(axis, sides[axis], -1.0);
    }
    let mut share = 0.0;
    // A polygon in the plane is below, and only there.
    if min.x < 0.0 || max.x <= 0.0 {
        polygon.part(0, 0.0, -1.0).each_triangle(|a, b, c| share -= sides.x * shadow(a, b, c));
    }
    if max.x > 0.0 {
        let within = polygon.part(0, 0.0, 1.0).part(0, sides.x, -1.0);
        within.each_triangle(|a, b, c| share -= shadow(a, b, c) * (sides.x - (a.x + b.x + c.x) / 3.0));
    }
    sum.add(share, CUT * scale);
}

/// Returns the area of a triangle's shadow along x, positive where its normal points to +x.
fn shadow(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    0.5 * ((b.y - a.y) * (c.z - a.z) - (b.z - a.z) * (c.y - a.y))
}

/// Most corners of a triangle that is cut by six planes.
///
/// Along each axis the coordinates of the corners, taken round the polygon, rise from their least to their greatest and fall
/// back, never otherwise: those of a triangle do; leaving out a corner does not change it; nor does adding one between two
/// neighbours, whose coordinates lie between theirs, as those of a cut do even after rounding. So the corners strictly outside
/// of a plane are consecutive. A cut that removes any replaces them, one or more, by two at most. It adds one corner, six cuts
/// add six. A triangle in the plane of a regular hexagon across a cube, which cuts off every other corner of it, has all nine.
const CORNERS: usize = 3 + 6;

/// A polygon, nearly plane and convex.
#[derive(Clone, Copy)]
struct Polygon {
    corners: [DVec3; CORNERS],
    count: usize,
}

impl Polygon {
    fn of([a, b, c]: [DVec3; 3]) -> Polygon {
        let mut corners = [DVec3::ZERO; CORNERS];
        corners[..3].copy_from_slice(&[a, b, c]);
        Polygon { corners, count: 3 }
    }

    /// Returns the part above a plane across an axis, or below it for a `sign` of −1 (Sutherland and Hodgman 1974). Corners in
    /// the plane belong to both parts, and the points of a cut are the same for both.
    fn part(&self, axis: usize, plane: f64, sign: f64) -> Polygon {
        let mut part = Polygon { corners: [DVec3::ZERO; CORNERS], count: 0 };
        let mut keep = |corner: DVec3| {
            part.corners[part.count] = corner;
            part.count += 1;
        };
        let corners = &self.corners[..self.count];
        for (at, &corner) in corners.iter().enumerate() {
            let next = corners[(at + 1) % corners.len()];
            let (here, there) = (corner[axis] - plane, next[axis] - plane);
            if sign * here >= 0.0 {
                keep(corner);
            }
            if here < 0.0 && there > 0.0 || here > 0.0 && there < 0.0 {
                // From the lower end, so that both parts have the same point.
                let (low, high, depth) = if here < 0.0 { (corner, next, here) } else { (next, corner, there) };
                let cut = low + (high - low) * (depth / -(here - there).abs());
                // Rounding may take it beyond an end, which is nearer to the true point then.
                let mut cut = cut.clamp(low.min(high), low.max(high));
                cut[axis] = plane;
                keep(cut);
            }
        }
        part
    }

    fn each_triangle(&self, mut visit: impl FnMut(DVec3, DVec3, DVec3)) {
        for at in 2..self.count {
            visit(self.corners[0], self.corners[at - 1], self.corners[at]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random::Random;

    /// Cuts a triangle by the six planes of a box at the origin; returns the counts of corners.
    fn counts(corners: [DVec3; 3], sides: DVec3) -> Vec<usize> {
        let mut polygon = Polygon::of(corners);
        let mut counts = Vec::new();
        for axis in [1, 2, 0] {
            for (plane, sign) in [(0.0, 1.0), (sides[axis], -1.0)] {
                polygon = polygon.part(axis, plane, sign);
                counts.push(polygon.count);
            }
        }
        counts
    }

    #[test]
    fn each_of_six_cuts_adds_a_corner_to_a_triangle_across_a_cube() {
        // In the plane x + y + z = 1.5, whose section of the cube is a regular hexagon.
        let corner = |x: f64, y: f64, z: f64| DVec3::splat(0.5) - 1.7 * DVec3::new(x, y, z);
        let corners = [corner(0.5, -0.5, 0.0), corner(0.0, 0.5, -0.5), corner(-0.5, 0.0, 0.5)];
        assert_eq!(counts(corners, DVec3::ONE).last(), Some(&CORNERS));
    }

    #[test]
    fn no_cut_adds_more_than_a_corner() {
        let mut random = Random::new(31);
        let mut most = 0;
        for case in 0..200_000 {
            let sides =
                DVec3::from_array([(); 3].map(|()| [1.0, 1e-3, 1e-9][random.below(3)] * (0.5 + random.share())));
            let mut point = || {
                let size = [2.0, 1.0, 1e-6][random.below(3)];
                sides * (DVec3::splat(0.5) + size * DVec3::from_array([(); 3].map(|()| random.unit())))
            };
            let mut corners = [(); 3].map(|()| point());
            if case % 2 == 0 {
                // A sliver, whose cuts lie within rounding of one another.
                let share = random.share();
                corners[2] = corners[0].lerp(corners[1], share) + 1e-15 * sides * random.unit();
            }
            let counts = counts(corners, sides);
            assert!(
                counts
                    .iter()
                    .scan(3, |before, &count| Some(count <= std::mem::replace(before, count) + 1))
                    .all(|is| is)
            );
            most = most.max(counts[5]);
        }
        assert!(most >= CORNERS - 1, "{most}");
    }
}
