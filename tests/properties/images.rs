//! Comparisons of images, and tests that each of them can fail.

use ldi_ops::boolean::{BooleanOperation, merge};
use ldi_ops::grid::{Axis, LatticeSolid};
use ldi_ops::ldi::{Ldi, Spans};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{Estimate, FillRule, Mode, Sampler};

pub const FILLS: [FillRule; 2] = [FillRule::EvenOdd, FillRule::NonZero];
pub const OVER: Mode = Mode::Estimate(Estimate::Over);
pub const UNDER: Mode = Mode::Estimate(Estimate::Under);
pub const MODES: [Mode; 3] = [Mode::Exact, OVER, UNDER];

/// Returns the image of one solid by a sampler with its defaults.
pub fn sample(solid: &LatticeSolid, axis: Axis, mode: Mode, fill: FillRule) -> Ldi {
    CpuSampler::default().sample(solid, axis, mode, fill).unwrap()
}

pub fn boolean(operation: BooleanOperation, a: &Ldi, b: &Ldi) -> Ldi {
    merge(operation, a, b).unwrap()
}

pub fn intersection(a: &Ldi, b: &Ldi) -> Ldi {
    boolean(BooleanOperation::Intersection, a, b)
}

pub fn union(a: &Ldi, b: &Ldi) -> Ldi {
    boolean(BooleanOperation::Union, a, b)
}

pub fn less(a: &Ldi, b: &Ldi) -> Ldi {
    boolean(BooleanOperation::Difference, a, b)
}

/// Returns where two images differ sample by sample, with both sides; `None` where they are equal. Grids may differ in their
/// place and pitch, not in their rays.
pub fn difference(found: &Ldi, expected: &Ldi) -> Option<String> {
    if (found.axis(), found.size()) != (expected.axis(), expected.size()) {
        return Some(format!("{:?} of {:?} rays against {:?}", found.axis(), found.size(), expected.size()));
    }
    if found.unclosed() != expected.unclosed() {
        return Some(format!("unclosed rays {:?} against {:?}", found.unclosed(), expected.unclosed()));
    }
    (0..found.rays())
        .find(|&ray| found.samples(ray) != expected.samples(ray))
        .map(|ray| format!("ray {ray}: {:?} against {:?}", found.samples(ray), expected.samples(ray)))
}

/// Returns where two images differ as point sets: intervals of no length and ends that touch do not count.
pub fn set_difference(found: &Ldi, expected: &Ldi) -> Option<String> {
    if (found.axis(), found.size()) != (expected.axis(), expected.size()) {
        return Some(format!("{:?} of {:?} rays against {:?}", found.axis(), found.size(), expected.size()));
    }
    (0..found.rays())
        .find(|&ray| !Spans::new(found.samples(ray)).eq(Spans::new(expected.samples(ray))))
        .map(|ray| format!("ray {ray}: {:?} against {:?}", found.samples(ray), expected.samples(ray)))
}

/// Returns the first ray where `inner` covers something that `outer` does not.
pub fn escape(inner: &Ldi, outer: &Ldi) -> Option<String> {
    if (inner.axis(), inner.size()) != (outer.axis(), outer.size()) {
        return Some(format!("{:?} of {:?} rays against {:?}", inner.axis(), inner.size(), outer.size()));
    }
    (0..inner.rays())
        .find(|&ray| {
            let holds = |(start, end): (i32, i32)| {
                Spans::new(outer.samples(ray)).any(|(outer_start, outer_end)| outer_start <= start && end <= outer_end)
            };
            !Spans::new(inner.samples(ray)).all(holds)
        })
        .map(|ray| format!("ray {ray}: {:?} is not within {:?}", inner.samples(ray), outer.samples(ray)))
}

#[track_caller]
pub fn assert_same(what: &str, found: &Ldi, expected: &Ldi) {
    if let Some(difference) = difference(found, expected) {
        panic!("{what}: {difference}");
    }
}

#[track_caller]
pub fn assert_same_set(what: &str, found: &Ldi, expected: &Ldi) {
    if let Some(difference) = set_difference(found, expected) {
        panic!("{what}: {difference}");
    }
}

#[track_caller]
pub fn assert_within(what: &str, inner: &Ldi, outer: &Ldi) {
    if let Some(escape) = escape(inner, outer) {
        panic!("{what}: {escape}");
    }
}

#[track_caller]
pub fn assert_empty(what: &str, image: &Ldi) {
    assert_eq!(image.depths(), [0; 0], "{what}");
}

#[track_caller]
pub fn assert_close(what: &str, found: f64, expected: f64, relative: f64) {
    assert!(is_close(found, expected, relative), "{what}: {found} is not {expected} within {relative:e} of it");
}

/// Returns whether two numbers are close; a NaN never is.
pub fn is_close(found: f64, expected: f64, relative: f64) -> bool {
    (found - expected).abs() <= relative * expected.abs()
}

mod tests {
    use glam::DVec3;
    use ldi_ops::grid::Grid;

    use super::*;

    /// Returns an image of 2 × 1 rays; the first has the samples, the second none.
    fn image(samples: &[i32], axis: Axis) -> Ldi {
        let rays = if axis == Axis::Z { [2, 1, 4] } else { [2, 4, 1] };
        let grid = Grid::from_parts(DVec3::ZERO, 16.0, rays, 4, 32).unwrap();
        let n = samples.len() as u32;
        Ldi::from_parts(grid, axis, vec![0, n, n], samples.to_vec(), vec![]).unwrap()
    }

    fn along_z(samples: &[i32]) -> Ldi {
        image(samples, Axis::Z)
    }

    #[test]
    fn equal_images_compare_equal_and_unequal_ones_do_not() {
        let base = along_z(&[4, 8, 20, 30]);
        assert_eq!(difference(&base, &base.clone()), None);
        assert_eq!(set_difference(&base, &base.clone()), None);
        for other in [&[4, 8, 20, 32][..], &[2, 8, 20, 30], &[4, 8], &[], &[4, 30]] {
            assert!(difference(&base, &along_z(other)).is_some(), "{other:?}");
            assert!(difference(&along_z(other), &base).is_some(), "{other:?}");
            assert!(set_difference(&base, &along_z(other)).is_some(), "{other:?}");
            assert!(set_difference(&along_z(other), &base).is_some(), "{other:?}");
        }
        let sideways = image(&[4, 8, 20, 30], Axis::Y);
        assert!(difference(&base, &sideways).is_some() && set_difference(&base, &sideways).is_some());
        assert!(escape(&base, &sideways).is_some());
        let unclosed = Ldi::from_parts(*base.grid(), Axis::Z, vec![0; 3], vec![], vec![1]).unwrap();
        let empty = along_z(&[]);
        assert!(difference(&unclosed, &empty).is_some());
        // The same samples on another ray.
        let moved = Ldi::from_parts(*base.grid(), Axis::Z, vec![0, 0, 4], vec![4, 8, 20, 30], vec![]).unwrap();
        assert!(difference(&base, &moved).is_some() && set_difference(&base, &moved).is_some());
        assert!(escape(&base, &moved).is_some());
    }

    #[test]
    fn set_comparison_ignores_empty_and_touching_intervals() {
        let whole = along_z(&[4, 12]);
        for same in [&[4, 8, 8, 12][..], &[2, 2, 4, 12], &[4, 12, 14, 14]] {
            assert_eq!(set_difference(&whole, &along_z(same)), None);
            assert!(difference(&whole, &along_z(same)).is_some());
        }
    }

    #[test]
    fn samples_outside_the_outer_image_are_found() {
        let outer = along_z(&[4, 8, 8, 20, 24, 30]);
        for inner in [&[][..], &[4, 20], &[6, 10, 24, 30], &[4, 4, 31, 31]] {
            assert_eq!(escape(&along_z(inner), &outer), None, "{inner:?}");
        }
        for inner in [&[2, 20][..], &[4, 22], &[10, 26], &[24, 30, 30, 32], &[0, 2], &[20, 24]] {
            assert!(escape(&along_z(inner), &outer).is_some(), "{inner:?}");
        }
    }

    #[test]
    fn assertions_fail_on_differences_and_nan() {
        let (a, b) = (along_z(&[4, 8]), along_z(&[4, 10]));
        let failing: [(&str, &(dyn Fn() + std::panic::RefUnwindSafe)); 5] = [
            ("assert_same", &|| assert_same("", &a, &b)),
            ("assert_same_set", &|| assert_same_set("", &a, &b)),
            ("assert_within", &|| assert_within("", &b, &a)),
            ("assert_empty", &|| assert_empty("", &a)),
            ("assert_close", &|| assert_close("", 1.0, 1.1, 0.01)),
        ];
        for (name, assertion) in failing {
            assert!(std::panic::catch_unwind(assertion).is_err(), "{name}");
        }
        assert!(!is_close(f64::NAN, 1.0, 1.0) && !is_close(1.0, f64::NAN, 1.0) && !is_close(0.0, 1.0, 0.5));
        assert!(!is_close(1.0, 0.0, 1.0) && is_close(1.0, 1.0, 0.0));
    }
}
