//! Quadrilaterals of crossed edges, cut along the diagonal that fits the crossing's normal better.

use glam::{DVec3, Vec3};

use super::edges::{Crossing, EdgeSlab};
use crate::cell::{UPPER, edge_at};

/// A quadrilateral of which at least one vertex may still move: it is cut when all vertices are final.
#[derive(Clone, Copy, Debug)]
pub struct OpenQuad {
    /// The first of its two consecutive triangles.
    pub triangle: u32,
    pub quad: Quad,
}

/// Four vertices, counter-clockwise seen from outside, around the crossing of an edge.
#[derive(Clone, Copy, Debug)]
pub struct Quad {
    pub corners: [u32; 4],
    /// Lower end of the edge.
    node: [i32; 3],
    axis: u8,
    crossing: Crossing,
    /// The diagonal that it must be cut along, if not either: the first, between its first corner and its third, or the second.
    forced: Option<bool>,
}

impl Quad {
    /// Returns the quadrilateral around an edge along `axis` from `node`, whose ends differ. `vertex_of` returns the vertex of the loop
    /// of a cell that one of its crossings belongs to.
    pub fn around(slab: &EdgeSlab, axis: usize, node: [i32; 3], vertex_of: impl Fn([i32; 3], usize) -> u32) -> Quad {
        Quad::at(axis, node, slab.crossing(axis, node), slab.is_inside(node), 0, vertex_of)
    }

    /// Returns the quadrilaterals around the two crossings of a cut edge, whose ends are inside or outside.
    pub fn around_cut(
        axis: usize,
        node: [i32; 3],
        [lower, upper]: [Crossing; 2],
        is_inside: bool,
        vertex_of: impl Fn([i32; 3], usize) -> u32,
    ) -> [Quad; 2] {
        let lower = Quad::at(axis, node, lower, is_inside, 0, &vertex_of);
        let upper = Quad::at(axis, node, upper, !is_inside, UPPER, &vertex_of);
        // At a rim both may have the same vertices on one diagonal, which is then an edge of neither.
        let are_shared = |i: usize, j: usize| [i, j].iter().all(|&at| upper.corners.contains(&lower.corners[at]));
        let forced = |of_lower: bool| match (are_shared(0, 2), are_shared(1, 3)) {
            (true, _) => Some(!of_lower),
            (_, true) => Some(of_lower),
            _ => None,
        };
        // One runs around the edge the other way, from another corner, so that the first diagonal of one is the second of the other.
        [Quad { forced: forced(true), ..lower }, Quad { forced: forced(false), ..upper }]
    }

    /// Returns the quadrilateral around a crossing, with the solid below it or above; `number` is the crossing's number minus
    /// the edge's.
    fn at(
        axis: usize,
        node: [i32; 3],
        crossing: Crossing,
        is_below: bool,
        number: usize,
        vertex_of: impl Fn([i32; 3], usize) -> u32,
    ) -> Quad {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(du, dv)| {
            let mut cell = node;
            cell[u] -= 1 - du;
            cell[v] -= 1 - dv;
            vertex_of(cell, edge_at(axis, 1 - du as usize, 1 - dv as usize) + number)
        });
        if !is_below {
            corners.reverse();
        }
        Quad { corners, node, axis: axis as u8, crossing, forced: None }
    }

    /// Chooses the diagonal where some corners are of cells beside a block of finer ones: two of those may have other edges in common.
    pub fn beside_block(self, is_of_border: impl Fn(u32) -> bool) -> Quad {
        let [a, b, c, d] = self.corners;
        let forced = match [a, b, c, d].map(is_of_border) {
            // A triangle: a corner occurs twice.
            _ if a == b || b == c || c == d || d == a => Some(true),
            [true, _, true, _] => Some(false),
            [_, true, _, true] => Some(true),
            _ => self.forced,
        };
        Quad { forced, ..self }
    }

    /// Returns the corners relative to the lower end of the edge: near it 32 bits are sufficient.
    fn see(&self, corners: [u32; 4], vertices: &[DVec3]) -> [Vec3; 4] {
        let base = DVec3::from_array(self.node.map(f64::from));
        corners.map(|vertex| (vertices[vertex as usize] - base).as_vec3())
    }

    fn crossing_from_node(&self) -> Vec3 {
        let mut crossing = Vec3::ZERO;
        crossing[usize::from(self.axis)] = self.crossing.at;
        crossing
    }

    /// Returns the crossing of the edge, no nearer to its ends than a share of its length.
    pub fn crossing_within(&self, margin: f64) -> DVec3 {
        let mut place = DVec3::from_array(self.node.map(f64::from));
        place[usize::from(self.axis)] += f64::from(self.crossing.at).clamp(margin, 1.0 - margin);
        place
    }

    /// Returns the distance of the crossing from the triangles of another quadrilateral, in pitches.
    pub fn distance(&self, other: &Quad, vertices: &[DVec3]) -> f32 {
        let triangles = other.cut(vertices).triangles;
        let point = self.crossing_from_node();
        let of_triangle = |triangle: [u32; 3]| {
            let [a, b, c, _] = self.see([triangle[0], triangle[1], triangle[2], triangle[0]], vertices);
            nearest(point, [a, b, c]).distance(point)
        };
        of_triangle(triangles[0]).min(of_triangle(triangles[1]))
    }

    /// Cuts it into two triangles along the better diagonal.
    pub fn cut(&self, vertices: &[DVec3]) -> Cut {
        let (corners, [one, other]) = self.fits(vertices);
        let first = self.forced.unwrap_or_else(|| one.is_better(&other));
        self.cut_along(first, corners, one.is_regular() && other.is_regular())
    }

    /// Returns the [`cut`](Quad::cut) along the other diagonal, if that fits the normal nearly as well.
    pub fn cut_otherwise(&self, vertices: &[DVec3]) -> Option<Cut> {
        let (corners, [one, other]) = self.fits(vertices);
        let fits = self.forced.is_none() && (one.cosine - other.cosine).abs() < NEARLY;
        fits.then(|| self.cut_along(!one.is_better(&other), corners, one.is_regular() && other.is_regular()))
    }

    /// Returns the corners, and the fit of the triangles of either diagonal.
    fn fits(&self, vertices: &[DVec3]) -> ([Vec3; 4], [Fit; 2]) {
        let corners @ [a, b, c, d] = self.see(self.corners, vertices);
        let fit = |triangles| Fit::of(&triangles, self.crossing.normal);
        (corners, [fit([[a, b, c], [a, c, d]]), fit([[a, b, d], [b, c, d]])])
    }

    /// Cuts along the first diagonal or the second.
    fn cut_along(&self, first: bool, [a, b, c, d]: [Vec3; 4], is_regular: bool) -> Cut {
        let crossing = self.crossing_from_node();
        let [p, q, r, s] = self.corners;
        let (triangles, distance) = match first {
            true => ([[p, q, r], [p, r, s]], distance(crossing, [[a, b, c], [a, c, d]])),
            false => ([[p, q, s], [q, r, s]], distance(crossing, [[a, b, d], [b, c, d]])),
        };
        Cut { triangles, distance, is_regular }
    }

    /// Returns whether the triangles of all its corners face a direction.
    pub fn faces(&self, direction: Vec3, vertices: &[DVec3]) -> bool {
        let corners = self.see(self.corners, vertices);
        (0..4).all(|i| {
            let [a, b, c] = [3, 0, 1].map(|j| corners[(i + j) % 4]);
            let cross = (b - a).cross(c - b);
            cross.dot(direction) > LEAST_AREA * cross.length().max(1.0)
        })
    }
}

/// A quadrilateral cut into triangles.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    pub triangles: [[u32; 3]; 2],
    /// The distance of the crossing from the triangles, in pitches.
    pub distance: f32,
    /// True if the triangles of all four corners are within [`REGULAR`] of the crossing's normal.
    pub is_regular: bool,
}

/// The cosine of the angle to the crossing's normal, 50°, within which a quadrilateral is not folded. Together with the 40°
/// between the normals of a gently bent sheet and their mean it stays within 90°.
const REGULAR: f32 = 0.643;

/// Triangles of half this area, in square pitches, may flip when rounded to 32 bits. Also the cosine to a direction above which
/// a triangle faces it.
const LEAST_AREA: f32 = 1e-3;

/// Difference below which cosines are nearly equal.
const NEARLY: f32 = 0.05;

/// The fit of two triangles to a normal.
struct Fit {
    /// The cosine between the normal and that of the triangle that is further from it; negative if that triangle is flipped.
    cosine: f32,
    /// The square of the diagonal's length.
    diagonal: f32,
    /// Twice the area of the smaller triangle.
    area: f32,
}

/// Difference below which cosines count as equal; then the shorter diagonal is taken.
const SAME: f32 = 1e-4;

impl Fit {
    fn of(triangles: &[[Vec3; 3]; 2], normal: [f32; 3]) -> Fit {
        let crosses = triangles.map(|[a, b, c]| (b - a).cross(c - a));
        let normal = match Vec3::from_array(normal) {
            // Without a known normal, that of the whole quadrilateral.
            Vec3::ZERO => (crosses[0] + crosses[1]).normalize_or_zero(),
            normal => normal,
        };
        let cosine = |cross: Vec3| {
            let length = cross.length();
            if length > 1e-12 { cross.dot(normal) / length } else { -1.0 }
        };
        // The first triangle of either pair begins where the diagonal does or ends there.
        let [[a, _, c], [p, q, _]] = *triangles;
        let diagonal = if a == p { a.distance_squared(c) } else { p.distance_squared(q) };
        let area = crosses[0].length().min(crosses[1].length());
        Fit { cosine: cosine(crosses[0]).min(cosine(crosses[1])), diagonal, area }
    }

    fn is_regular(&self) -> bool {
        self.cosine >= REGULAR && self.area > LEAST_AREA
    }

    fn is_better(&self, other: &Fit) -> bool {
        match (self.cosine - other.cosine).abs() > SAME {
            true => self.cosine > other.cosine,
            false => self.diagonal <= other.diagonal,
        }
    }
}

/// Returns the distance of a point from two triangles.
fn distance(point: Vec3, triangles: [[Vec3; 3]; 2]) -> f32 {
    let [one, other] = triangles.map(|triangle| nearest(point, triangle).distance_squared(point));
    one.min(other).sqrt()
}

/// Returns the point of a triangle nearest to another point (Ericson, Real-Time Collision Detection, 2005, section 5.1.5).
fn nearest(point: Vec3, [a, b, c]: [Vec3; 3]) -> Vec3 {
    let (ab, ac, ap) = (b - a, c - a, point - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = point - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = point - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let share = 1.0 / (va + vb + vc);
    a + ab * (vb * share) + ac * (vc * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_other_point_of_a_triangle_is_nearer_than_the_nearest() {
        let triangle = [Vec3::new(0.1, 0.2, 0.0), Vec3::new(1.0, 0.3, 0.4), Vec3::new(0.2, 1.1, -0.3)];
        for i in 0..343 {
            let point = Vec3::new((i % 7) as f32, (i / 7 % 7) as f32, (i / 49) as f32) * 0.4 - 0.8;
            let found = nearest(point, triangle);
            let mut least = f32::INFINITY;
            for j in 0..=100 {
                for k in 0..=100 - j {
                    let (u, v) = (j as f32 / 100.0, k as f32 / 100.0);
                    let on = triangle[0] + (triangle[1] - triangle[0]) * u + (triangle[2] - triangle[0]) * v;
                    least = least.min(on.distance(point));
                }
            }
            let distance = found.distance(point);
            assert!(distance <= least + 1e-6 && distance > least - 0.02, "{point}: {distance} {least}");
        }
    }
}
