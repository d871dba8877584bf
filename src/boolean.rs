//! Boolean operations on images: a merge of the intervals of each ray.
//!
//! Intervals are half-open and read as point sets: touching ones unite, empty ones vanish, and the result of any
//! operation lists the maximal spans of each ray with strictly increasing depths. In integers
//! |A| + |B| = |A ∪ B| + |A ∩ B|, to the last lattice step.
//!
//! A merge of over-estimates is an over-estimate of the union and of the intersection. For a difference that holds if
//! what is taken away is under-estimated.

use crate::grid::Axis;
use crate::ldi::{BandImage, Ldi, TooManySamples, image_from_bands};

/// An operation on two point sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BooleanOperation {
    /// In both.
    Intersection,
    /// In either.
    Union,
    /// In the first and not in the second.
    Difference,
    /// In exactly one.
    Xor,
}

impl BooleanOperation {
    /// Whether a point is in the result, given whether it is in each operand.
    #[inline]
    pub fn holds(self, in_a: bool, in_b: bool) -> bool {
        match self {
            BooleanOperation::Intersection => in_a & in_b,
            BooleanOperation::Union => in_a | in_b,
            BooleanOperation::Difference => in_a & !in_b,
            BooleanOperation::Xor => in_a ^ in_b,
        }
    }
}

/// Why two images could not be combined.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BooleanError {
    /// The images have different rays.
    #[error("the images lie on different rays: along {first} at pitch {first_pitch} and along {second} at pitch {second_pitch}",
        first = first.name(), second = second.name())]
    RaysDiffer {
        /// Direction of the first image.
        first: Axis,
        /// Pitch of its grid.
        first_pitch: f64,
        /// Direction of the second image.
        second: Axis,
        /// Pitch of its grid.
        second_pitch: f64,
    },
    /// The result is too large.
    #[error(transparent)]
    TooManySamples(#[from] TooManySamples),
}

/// Rows merged by one task.
const BAND_ROWS: u32 = 16;

/// The result of an operation on two images of the same rays. A ray that is unclosed in either operand is unclosed in
/// the result.
pub fn merge(operation: BooleanOperation, a: &Ldi, b: &Ldi) -> Result<Ldi, BooleanError> {
    if a.grid() != b.grid() || a.axis() != b.axis() {
        return Err(BooleanError::RaysDiffer {
            first: a.axis(),
            first_pitch: a.grid().pitch(),
            second: b.axis(),
            second_pitch: b.grid().pitch(),
        });
    }
    let (columns, _) = a.size();
    let image = image_from_bands(
        *a.grid(),
        a.axis(),
        BAND_ROWS,
        || (),
        |(), rows, image: &mut BandImage| {
            for ray in rows.start * columns..rows.end * columns {
                if a.is_unclosed(ray) || b.is_unclosed(ray) {
                    image.end_unclosed_ray();
                } else {
                    merge_ray(operation, a.samples(ray), b.samples(ray), image.depths());
                    image.end_ray();
                }
            }
        },
    )?;
    Ok(image)
}

/// Appends the spans of the result on one ray.
fn merge_ray(operation: BooleanOperation, a: &[i32], b: &[i32], result: &mut Vec<i32>) {
    let (mut passed_a, mut passed_b, mut inside) = (0, 0, false);
    while passed_a < a.len() || passed_b < b.len() {
        let next = |samples: &[i32], passed: usize| samples.get(passed).copied().unwrap_or(i32::MAX);
        let depth = next(a, passed_a).min(next(b, passed_b));
        // All samples at one depth are passed before the state counts: that unites touching intervals.
        while next(a, passed_a) == depth {
            passed_a += 1;
        }
        while next(b, passed_b) == depth {
            passed_b += 1;
        }
        let now = operation.holds(passed_a % 2 == 1, passed_b % 2 == 1);
        if now != inside {
            result.push(depth);
            inside = now;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn merged(operation: BooleanOperation, a: &[i32], b: &[i32]) -> Vec<i32> {
        let mut result = Vec::new();
        merge_ray(operation, a, b, &mut result);
        result
    }

    #[test]
    fn touching_intervals_unite_and_intersect_in_nothing() {
        assert_eq!(merged(BooleanOperation::Union, &[0, 4], &[4, 8]), [0, 8]);
        assert_eq!(merged(BooleanOperation::Intersection, &[0, 4], &[4, 8]), [0; 0]);
        assert_eq!(merged(BooleanOperation::Difference, &[0, 4], &[4, 8]), [0, 4]);
        assert_eq!(merged(BooleanOperation::Xor, &[0, 4], &[4, 8]), [0, 8]);
    }

    #[test]
    fn an_operand_may_hold_empty_and_touching_intervals() {
        assert_eq!(merged(BooleanOperation::Union, &[0, 2, 2, 4, 6, 6], &[]), [0, 4]);
        assert_eq!(merged(BooleanOperation::Intersection, &[0, 2, 2, 4], &[1, 3]), [1, 3]);
        assert_eq!(merged(BooleanOperation::Difference, &[0, 8], &[2, 4, 4, 4]), [0, 2, 4, 8]);
        assert_eq!(merged(BooleanOperation::Difference, &[0, 8], &[0, 8]), [0; 0]);
    }
}
