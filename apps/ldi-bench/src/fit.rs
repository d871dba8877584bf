//! Least-squares fits: the cost of a triangle, a crossing and a ray, and the growth of a cost.

use serde::Serialize;

/// One measurement: the size of a case and its time.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Observation {
    /// Number of triangles of the mesh.
    pub triangles: f64,
    /// Number of crossings of rays with triangles.
    pub crossings: f64,
    /// Number of rays.
    pub rays: f64,
    /// Seconds.
    pub seconds: f64,
}

/// A linear cost model, in nanoseconds per item.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct LinearCost {
    /// Cost of a triangle.
    pub per_triangle: f64,
    /// Cost of a crossing.
    pub per_crossing: f64,
    /// Cost of a ray.
    pub per_ray: f64,
    /// Root of the mean square of (model − measured) / measured.
    pub residual: f64,
    /// Greatest |model − measured| / measured.
    pub worst: f64,
}

/// Fits the cost t = a·triangles + b·crossings + c·rays with the least sum of squared *relative* errors, so that large models
/// do not dominate; none of a, b, c is below zero. `None` for fewer than three observations.
pub fn linear_cost(observations: &[Observation]) -> Option<LinearCost> {
    if observations.len() < 3 {
        return None;
    }
    let rows: Vec<[f64; 3]> =
        observations.iter().map(|o| [o.triangles, o.crossings, o.rays].map(|n| n / o.seconds)).collect();
    let error = |solution: &[f64; 3]| -> f64 { rows.iter().map(|row| (dot(row, solution) - 1.0).powi(2)).sum() };
    // With three unknowns, all choices of the zero ones can be tried.
    let free_sets = (1..8u8).map(|bits| [bits & 1 != 0, bits & 2 != 0, bits & 4 != 0]);
    let candidates = free_sets.filter_map(|free| solve(&rows, free)).filter(|s| s.iter().all(|&x| x >= 0.0));
    let best = candidates.min_by(|a, b| error(a).total_cmp(&error(b)))?;
    let worst = rows.iter().map(|row| (dot(row, &best) - 1.0).abs()).fold(0.0, f64::max);
    let [a, b, c] = best.map(|seconds| 1e9 * seconds);
    let residual = (error(&best) / rows.len() as f64).sqrt();
    Some(LinearCost { per_triangle: a, per_crossing: b, per_ray: c, residual, worst })
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the least-squares solution of `rows · x = 1` where only the free unknowns differ from zero, by normal equations with
/// columns scaled to unit length.
fn solve(rows: &[[f64; 3]], free: [bool; 3]) -> Option<[f64; 3]> {
    let scale: [f64; 3] = std::array::from_fn(|i| rows.iter().map(|row| row[i] * row[i]).sum::<f64>().sqrt());
    let mut m = [[0.0; 4]; 3];
    for i in 0..3 {
        if !free[i] || scale[i] == 0.0 {
            m[i][i] = 1.0;
            continue;
        }
        for j in (0..3).filter(|&j| free[j] && scale[j] != 0.0) {
            m[i][j] = rows.iter().map(|row| row[i] / scale[i] * (row[j] / scale[j])).sum();
        }
        m[i][3] = rows.iter().map(|row| row[i] / scale[i]).sum();
    }
    for i in 0..3 {
        // The matrix is positive semidefinite, so pivots on the diagonal suffice.
        if m[i][i] < 1e-12 {
            return None;
        }
        let pivot = m[i];
        for (k, row) in m.iter_mut().enumerate().filter(|(k, _)| *k != i) {
            let factor = row[i] / pivot[i];
            debug_assert_ne!(k, i);
            row.iter_mut().zip(pivot).for_each(|(x, p)| *x -= factor * p);
        }
    }
    Some(std::array::from_fn(|i| if scale[i] == 0.0 { 0.0 } else { m[i][3] / m[i][i] / scale[i] }))
}

/// Returns the exponent p of y ∝ x^p: the slope of the least-squares line through the logarithms.
///
/// # Panics
/// If there are fewer than two points.
pub fn exponent(points: &[(f64, f64)]) -> f64 {
    assert!(points.len() > 1, "a slope needs two points");
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|&(x, y)| (x.ln(), y.ln())).collect();
    let (mean_x, mean_y) = logs.iter().fold((0.0, 0.0), |(sx, sy), (x, y)| (sx + x / n, sy + y / n));
    let (over, under) = logs
        .iter()
        .fold((0.0, 0.0), |(o, u), (x, y)| (o + (x - mean_x) * (y - mean_y), u + (x - mean_x) * (x - mean_x)));
    over / under
}

#[cfg(test)]
mod tests {
    use super::*;

    fn observed(cost: impl Fn(f64, f64, f64) -> f64) -> Vec<Observation> {
        let counts = [(1e6, 1e5, 1e4), (1e6, 1.6e6, 1.6e5), (12.0, 5e5, 2.5e5), (3e4, 2e4, 1e6), (2e3, 9e6, 6e4)];
        counts
            .into_iter()
            .map(|(triangles, crossings, rays)| Observation {
                triangles,
                crossings,
                rays,
                seconds: 1e-9 * cost(triangles, crossings, rays),
            })
            .collect()
    }

    #[test]
    fn a_linear_cost_is_found_again() {
        let cost = linear_cost(&observed(|t, f, r| 20.0 * t + 8.0 * f + 3.0 * r)).unwrap();
        assert!((cost.per_triangle - 20.0).abs() < 1e-6, "{cost:?}");
        assert!((cost.per_crossing - 8.0).abs() < 1e-6, "{cost:?}");
        assert!((cost.per_ray - 3.0).abs() < 1e-6, "{cost:?}");
        assert!(cost.worst < 1e-9, "{cost:?}");
    }

    #[test]
    fn no_cost_is_negative_and_what_does_not_fit_shows_in_the_residual() {
        let cost = linear_cost(&observed(|t, f, r| (20.0 * t + 8.0 * f - 0.5 * r).max(1.0))).unwrap();
        assert!(cost.per_ray >= 0.0 && cost.residual > 0.01, "{cost:?}");
        assert!(linear_cost(&observed(|t, _, _| t)[..2]).is_none());
    }

    #[test]
    fn an_exponent_is_found_again() {
        let points: Vec<_> = [1.0, 2.0, 7.0].map(|x: f64| (x, 3.0 * x.powf(1.5))).into();
        assert!((exponent(&points) - 1.5).abs() < 1e-12);
    }
}
