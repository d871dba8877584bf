//! The position of the vertex of a loop: the point that is nearest to the planes of its crossings.
//!
//! The quadratic error function is the sum of squared distances to those planes (Ju et al. 2002). Its minimum is sought from
//! the mean of the crossings, in the directions that the normals determine: eigenvectors of the normals' moments, except those
//! of small eigenvalue. On a smooth surface one direction is left and the vertex is the mean, moved onto the mean plane; on an
//! edge two, on a corner three, and then the vertex lies on the edge or the corner itself, to rounding, because depths and
//! normals are those of the lattice triangles and have no noise.
//!
//! That point may lie **beyond the cell**. A corner whose tip lies in the next cell without reaching a node of it leaves no
//! sign there, and every cell that sees its three faces lies beside it. A vertex that is held in its cell cuts such a tip off,
//! by up to half a pitch; `features` moves it later. An edge, however, often passes through the cell itself although the
//! nearest point to the mean does not lie in it. Then the vertex is held on the edge. (Placing it there at first is worse: near
//! a corner the line continues where the edge has ended.)

use glam::{DMat3, DVec3};

use super::edges::Crossing;

/// Directions whose eigenvalue is below this share of the largest are undetermined: the planes on two sides of an edge of 169°
/// or more count as one.
const LEAST_EIGENVALUE: f64 = 0.01;

/// Mean square of the sines between normals and their mean below which a surface is smooth without an eigenanalysis.
const SMOOTH: f64 = 0.002;

/// Distance from the faces of its cell, in pitches, kept by a vertex that slides along an edge into it, if possible: vertices
/// of two cells that slide to the face between them stay apart.
const WELL_INSIDE: f64 = 0.02;

/// The placement of a vertex, in coordinates of its cell, which extends from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The position held in the cell.
    pub held: DVec3,
    /// The unconstrained position, if that is beyond the cell and on a feature.
    pub beyond: Option<DVec3>,
    /// The mean of the crossings, held in the cell.
    pub mean: DVec3,
    /// The direction of the sum of the normals; zero where none is known.
    pub facing: DVec3,
    /// True if all normals are within [`GENTLE`] of `facing`, or none is known.
    pub is_gentle: bool,
}

/// The cosine of the angle to the mean normal, 40°, within which normals are those of one gently bent sheet.
const GENTLE: f64 = 0.766;

/// A box that a vertex may not leave: least and greatest coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    pub least: DVec3,
    pub greatest: DVec3,
}

impl Bounds {
    /// Returns the box in coordinates from a point.
    pub fn from(&self, base: DVec3) -> Bounds {
        Bounds { least: self.least - base, greatest: self.greatest - base }
    }

    fn hold(&self, point: DVec3) -> DVec3 {
        point.clamp(self.least, self.greatest)
    }

    /// Returns the point nearest to `point` on a line through it that lies inside, well inside if possible.
    fn slide(&self, point: DVec3, along: DVec3) -> Option<DVec3> {
        [WELL_INSIDE, 0.0].into_iter().find_map(|margin| {
            let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
            for axis in 0..3 {
                let ends = [self.least[axis] + margin - point[axis], self.greatest[axis] - margin - point[axis]];
                if along[axis].abs() > 1e-9 {
                    let [a, b] = ends.map(|end| end / along[axis]);
                    (from, to) = (from.max(a.min(b)), to.min(a.max(b)));
                } else if ends[0] > 0.0 || ends[1] < 0.0 {
                    return None;
                }
            }
            (from <= to).then(|| self.hold(point + along * 0f64.clamp(from, to)))
        })
    }
}

/// Most crossings of a loop.
pub const MOST_CROSSINGS: usize = 12;

/// The crossings of one loop with their normals and weights.
#[derive(Clone, Copy, Debug, Default)]
pub struct Loop {
    points: [DVec3; MOST_CROSSINGS],
    normals: [DVec3; MOST_CROSSINGS],
    weights: [f64; MOST_CROSSINGS],
    count: usize,
}

impl Loop {
    /// Returns the loop of some crossings: places, normals and weights. Of more than [`MOST_CROSSINGS`], some are left out evenly.
    pub fn of(crossings: &[(DVec3, [f32; 3], f64)]) -> Loop {
        let mut of_loop = Loop::default();
        let step = crossings.len().div_ceil(MOST_CROSSINGS).max(1);
        crossings.iter().step_by(step).for_each(|&(point, normal, weight)| of_loop.add_at(point, normal, weight));
        of_loop
    }

    /// Adds the crossing of the edge from `corner` along `axis`.
    pub fn add(&mut self, corner: DVec3, axis: usize, crossing: &Crossing) {
        let mut point = corner;
        point[axis] += f64::from(crossing.at);
        self.add_at(point, crossing.normal, 1.0);
    }

    fn add_at(&mut self, point: DVec3, normal: [f32; 3], weight: f64) {
        self.points[self.count] = point;
        self.weights[self.count] = weight;
        self.normals[self.count] = DVec3::from_array(normal.map(f64::from));
        self.count += 1;
    }

    /// Returns the mean of the crossings.
    pub fn mean(&self) -> DVec3 {
        let weights = &self.weights[..self.count];
        let points = self.points.iter().zip(weights).map(|(&point, &weight)| point * weight);
        points.sum::<DVec3>() / weights.iter().sum::<f64>()
    }

    /// Places the vertex: held within `cell`, and unconstrained if that is not further away than `reach`.
    pub fn place(&self, cell: &Bounds, reach: f64) -> Place {
        let mean = self.mean();
        let normals = self.normals.iter().zip(&self.weights[..self.count]).map(|(&normal, &weight)| normal * weight);
        let facing = normals.sum::<DVec3>().normalize_or_zero();
        let (best, directions, edge) = self.nearest_to_planes(mean, facing);
        let away = (best - cell.hold(best)).abs().max_element();
        let slid = if directions == 2 && away > 0.0 { cell.slide(best, edge) } else { None };
        let held = slid.unwrap_or_else(|| cell.hold(best));
        let beyond = (directions > 1 && away > 0.0 && away <= reach).then_some(best);
        let mean = cell.hold(mean);
        let is_gentle =
            facing == DVec3::ZERO || self.normals[..self.count].iter().all(|normal| normal.dot(facing) >= GENTLE);
        Place { held: if away > reach { mean } else { held }, beyond, mean, facing, is_gentle }
    }

    /// Returns the minimum of the error function nearest to `mean`, given the mean normal `facing`; the number of determined
    /// directions; and the last undetermined one, which is that of the edge where two are determined.
    fn nearest_to_planes(&self, mean: DVec3, facing: DVec3) -> (DVec3, usize, DVec3) {
        let planes = || (0..self.count).map(|i| (self.points[i], self.normals[i], self.weights[i]));
        if facing == DVec3::ZERO {
            return (mean, 0, DVec3::ZERO);
        }
        let (mut along, mut all, mut off) = (0.0, 0.0, 0.0);
        for (point, normal, weight) in planes() {
            let cosine = normal.dot(facing);
            along += weight * cosine * cosine;
            all += weight * normal.length_squared();
            off += weight * cosine * normal.dot(point - mean);
        }
        if all - along < SMOOTH * all {
            return (mean + facing * (off / along), 1, DVec3::ZERO);
        }
        let mut moments = DMat3::ZERO;
        let mut pull = DVec3::ZERO;
        for (point, normal, weight) in planes() {
            let weighted = normal * weight;
            moments += DMat3::from_cols(weighted * normal.x, weighted * normal.y, weighted * normal.z);
            pull += weighted * normal.dot(point - mean);
        }
        let (values, vectors) = eigen(moments);
        let largest = values.max_element();
        let mut best = mean;
        let (mut directions, mut free) = (0, DVec3::ZERO);
        for i in 0..3 {
            let vector = vectors.col(i);
            if values[i] > LEAST_EIGENVALUE * largest {
                best += vector * (vector.dot(pull) / values[i]);
                directions += 1;
            } else {
                free = vector;
            }
        }
        (best, directions, free)
    }
}

/// Returns eigenvalues and eigenvectors of a symmetric matrix, by Jacobi rotations.
fn eigen(mut a: DMat3) -> (DVec3, DMat3) {
    let mut vectors = DMat3::IDENTITY;
    for _ in 0..12 {
        let off = a.y_axis.x.abs().max(a.z_axis.x.abs()).max(a.z_axis.y.abs());
        let scale = a.x_axis.x.abs().max(a.y_axis.y.abs()).max(a.z_axis.z.abs());
        if off <= 1e-15 * scale {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let apq = a.col(q)[p];
            if apq == 0.0 {
                continue;
            }
            let theta = (a.col(q)[q] - a.col(p)[p]) / (2.0 * apq);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            let (vp, vq) = (vectors.col(p), vectors.col(q));
            *vectors.col_mut(p) = c * vp - s * vq;
            *vectors.col_mut(q) = s * vp + c * vq;
            let (ap, aq) = (a.col(p), a.col(q));
            *a.col_mut(p) = c * ap - s * aq;
            *a.col_mut(q) = s * ap + c * aq;
            for col in 0..3 {
                let (x, y) = (a.col(col)[p], a.col(col)[q]);
                a.col_mut(col)[p] = c * x - s * y;
                a.col_mut(col)[q] = s * x + c * y;
            }
        }
    }
    (DVec3::new(a.x_axis.x, a.y_axis.y, a.z_axis.z), vectors)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CELL: Bounds = Bounds { least: DVec3::ZERO, greatest: DVec3::ONE };

    /// Returns a loop of crossings with planes: each a corner of the cell, an axis and a plane (unit normal, offset) that meets
    /// the edge.
    fn of_planes(crossings: &[(DVec3, usize, DVec3, f64)]) -> Loop {
        let mut of_loop = Loop::default();
        for &(corner, axis, normal, offset) in crossings {
            let at = (offset - normal.dot(corner)) / normal[axis];
            assert!((0.0..=1.0).contains(&at), "{at}");
            of_loop.add(corner, axis, &Crossing { at: at as f32, normal: normal.to_array().map(|n| n as f32) });
        }
        of_loop
    }

    #[test]
    fn corners_are_found_inside_and_outside_the_cell() {
        let (a, b, c) = (DVec3::new(0.9, 0.3, 0.3), DVec3::new(0.2, 0.9, -0.4), DVec3::new(0.3, -0.3, 0.9));
        let [a, b, c] = [a, b, c].map(DVec3::normalize);
        for corner in [DVec3::new(0.4, 0.5, 0.6), DVec3::new(0.5, 0.6, 1.15)] {
            let of_loop = of_planes(&[
                (DVec3::Y, 0, a, a.dot(corner)),
                (DVec3::Z, 1, b, b.dot(corner)),
                (DVec3::X, 2, c, c.dot(corner)),
            ]);
            let place = of_loop.place(&CELL, 1.0);
            let found = place.beyond.unwrap_or(place.held);
            assert!(found.distance(corner) < 1e-6, "{found} {corner}");
            assert_eq!(place.beyond.is_some(), corner.z > 1.0);
            assert!(place.held.cmple(DVec3::ONE).all());
            // A point that is too far away is rejected.
            assert_eq!(of_loop.place(&CELL, 0.1).beyond, None);
        }
    }

    #[test]
    fn the_vertex_is_the_mean_on_a_plane_and_on_the_edge_at_an_edge() {
        let plane = DVec3::new(0.1, 0.2, 1.0).normalize();
        let offset = plane.dot(DVec3::splat(0.5));
        let four = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y].map(|corner| (corner, 2, plane, offset));
        let flat = of_planes(&four);
        assert!(flat.place(&CELL, 1.0).held.distance(flat.mean()) < 1e-6);

        let (a, b) = (DVec3::new(0.4, 0.1, 0.8).normalize(), DVec3::new(-0.4, 0.1, 0.8).normalize());
        let through = DVec3::new(0.5, 0.5, 0.6);
        let edge = of_planes(
            &[
                (DVec3::ZERO, 2, a, a.dot(through)),
                (DVec3::Y, 2, a, a.dot(through)),
                (DVec3::X, 2, b, b.dot(through)),
                (DVec3::X + DVec3::Y, 2, b, b.dot(through)),
            ]
            .map(|(corner, axis, normal, offset)| (corner, axis, normal, offset)),
        );
        let found = edge.place(&CELL, 1.0);
        let found = found.beyond.unwrap_or(found.held);
        assert!((a.dot(found - through)).abs() < 1e-6 && b.dot(found - through).abs() < 1e-6, "{found}");
    }

    #[test]
    fn eigenvectors_diagonalise_the_matrix() {
        let columns = [DVec3::new(4.0, 1.0, -2.0), DVec3::new(1.0, 3.0, 0.5), DVec3::new(-2.0, 0.5, 5.0)];
        let matrix = DMat3::from_cols(columns[0], columns[1], columns[2]);
        let (values, vectors) = eigen(matrix);
        for i in 0..3 {
            let vector = vectors.col(i);
            assert!((matrix * vector - values[i] * vector).length() < 1e-12 && (vector.length() - 1.0).abs() < 1e-12);
        }
        // A multiple of the identity needs no rotation.
        assert_eq!(eigen(DMat3::IDENTITY * 3.0).0, DVec3::splat(3.0));
    }
}
