//! Eigenvalues and directions of symmetric 3 × 3 matrices.

use glam::{DMat3, DVec3};

/// Most rounds of rotations, after which nothing is left off the diagonal; three to five are needed.
const ROUNDS: usize = 32;

/// The principal values of a symmetric matrix and their directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Principal {
    /// The values, ascending.
    pub values: [f64; 3],
    /// Orthonormal, right-handed, in the order of the values.
    pub directions: [DVec3; 3],
}

impl Principal {
    /// Computes them by Jacobi rotations, exact to rounding, also for equal values; entries below the diagonal are not read.
    /// Where an entry is not finite, nor are values.
    pub fn of(matrix: DMat3) -> Principal {
        let mut a = [0, 1, 2].map(|row| [0, 1, 2].map(|column| matrix.col(row.max(column))[row.min(column)]));
        let mut vectors = DVec3::AXES;
        for _ in 0..ROUNDS {
            for (p, q) in [(0, 1), (0, 2), (1, 2)] {
                if a[p][q] == 0.0 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = 1.0f64.copysign(theta) / (theta.abs() + theta.hypot(1.0));
                let c = 1.0 / t.hypot(1.0);
                let s = t * c;
                let r = 3 - p - q;
                (a[p][p], a[q][q]) = (a[p][p] - t * a[p][q], a[q][q] + t * a[p][q]);
                (a[p][q], a[q][p]) = (0.0, 0.0);
                let (rp, rq) = (a[r][p], a[r][q]);
                (a[r][p], a[r][q]) = (c * rp - s * rq, s * rp + c * rq);
                (a[p][r], a[q][r]) = (a[r][p], a[r][q]);
                (vectors[p], vectors[q]) = (c * vectors[p] - s * vectors[q], s * vectors[p] + c * vectors[q]);
            }
        }
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| a[i][i].total_cmp(&a[j][j]));
        let [first, second, _] = order.map(|i| vectors[i].normalize());
        Principal { values: order.map(|i| a[i][i]), directions: [first, second, first.cross(second)] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    #[test]
    fn eigenvalues_and_eigenvectors_reconstruct_the_matrix() {
        let cases = [[1.0, 2.0, 3.0], [1.0, 1.0, 4.0], [0.0, 0.0, 1.0], [-5.0, 1e-9, 1e3], [7.0, 7.0, 7.0]];
        for (i, values) in cases.into_iter().enumerate() {
            for turn in 0..20 {
                let axis = DVec3::new(1.0, 0.3 * f64::from(turn), i as f64 - 1.5).normalize();
                let turned = DMat3::from_quat(DQuat::from_axis_angle(axis, f64::from(turn)));
                let matrix = turned * DMat3::from_diagonal(DVec3::from_array(values)) * turned.transpose();
                let found = Principal::of(matrix);
                let largest = values.iter().fold(0.0f64, |m, v| m.max(v.abs()));
                for (value, expected) in found.values.iter().zip(values) {
                    assert!((value - expected).abs() < 1e-14 * largest, "{found:?} {values:?}");
                }
                for (value, direction) in found.values.iter().zip(found.directions) {
                    assert!((matrix * direction - value * direction).length() < 1e-14 * largest, "{found:?}");
                }
                let [x, y, z] = found.directions;
                assert!((x.cross(y).dot(z) - 1.0).abs() < 1e-14);
            }
        }
    }
}
