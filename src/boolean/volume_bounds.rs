//! Bounds of the volume of an expression from the volumes and boxes of its inputs, after Fréchet.

use glam::DVec3;

use super::{BooleanOperation, Expression};

/// Known bounds of the volume and position of a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeBounds {
    /// The least and the greatest possible volume of the solid.
    pub volume: [f64; 2],
    /// The least and the greatest corner of a box that contains the solid.
    pub corners: [DVec3; 2],
}

impl Expression {
    /// Returns bounds of the volume of the result from those of the inputs.
    ///
    /// If only the volumes a and b of the operands and that of the box around both are known, these bounds are the narrowest
    /// possible: max(0, a + b − box) ≤ |A ∩ B| ≤ min(a, b), max(a, b) ≤ |A ∪ B| ≤ min(box, a + b), and so on. No volume exceeds
    /// that of its box.
    pub fn volume_bounds(&self, inputs: impl Fn(usize) -> VolumeBounds) -> VolumeBounds {
        self.fold(inputs, |operation, operands| {
            let (first, others) = operands.split_first().expect("an operation has operands");
            others.iter().fold(*first, |a, &b| of_two(operation, a, b))
        })
    }

    /// Returns the least and the greatest corner of a box that contains the result, from those of boxes of the inputs; the least
    /// corner is not below the greatest if the result is empty.
    pub fn corners(&self, inputs: impl Fn(usize) -> [DVec3; 2]) -> [DVec3; 2] {
        self.fold(inputs, |operation, operands| {
            let (first, others) = operands.split_first().expect("an operation has operands");
            others.iter().fold(*first, |a, &b| corners_of_two(operation, a, b))
        })
    }
}

/// Returns the volume of a box; 0 if its least corner is not below the greatest.
pub(crate) fn box_volume([least, greatest]: [DVec3; 2]) -> f64 {
    let mut sides = (greatest - least).max(DVec3::ZERO).to_array();
    // The least side and the greatest first: the product of two small ones may be none.
    sides.sort_by(f64::total_cmp);
    sides[0] * sides[2] * sides[1]
}

fn corners_of_two(operation: BooleanOperation, a: [DVec3; 2], b: [DVec3; 2]) -> [DVec3; 2] {
    match operation {
        BooleanOperation::Intersection => [a[0].max(b[0]), a[1].min(b[1])],
        BooleanOperation::Union | BooleanOperation::Xor => [a[0].min(b[0]), a[1].max(b[1])],
        BooleanOperation::Difference => a,
    }
}

fn of_two(operation: BooleanOperation, a: VolumeBounds, b: VolumeBounds) -> VolumeBounds {
    let of_boxes = |operation| corners_of_two(operation, a.corners, b.corners);
    let space = box_volume(of_boxes(BooleanOperation::Union));
    let shared = box_volume(of_boxes(BooleanOperation::Intersection));
    let ([a_least, a_most], [b_least, b_most]) = (a.volume, b.volume);
    let in_both = [(a_least + b_least - space).max(0.0), a_most.min(b_most).min(shared)];
    let volume = match operation {
        BooleanOperation::Intersection => in_both,
        BooleanOperation::Union => {
            [a_least.max(b_least).max(a_least + b_least - in_both[1]), (a_most + b_most).min(space)]
        }
        BooleanOperation::Difference => {
            [(a_least - in_both[1]).max(a_least - b_most).max(0.0), a_most.min(space - b_least)]
        }
        // The volume in exactly one operand: both less twice the volume in both, and at most what both leave of the box.
        BooleanOperation::Xor => {
            let least = (a_least - b_most).max(b_least - a_most).max(a_least + b_least - 2.0 * in_both[1]).max(0.0);
            [least, (a_most + b_most).min(2.0 * space - a_least - b_least).min(space)]
        }
    };
    VolumeBounds { volume, corners: of_boxes(operation) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPERATIONS: [BooleanOperation; 4] =
        [BooleanOperation::Intersection, BooleanOperation::Union, BooleanOperation::Difference, BooleanOperation::Xor];

    /// Returns a solid of some of six unit cells in a row.
    fn of_cells(cells: f64) -> VolumeBounds {
        VolumeBounds { volume: [cells; 2], corners: [DVec3::ZERO, DVec3::new(6.0, 1.0, 1.0)] }
    }

    #[test]
    fn bounds_enclose_the_volumes_of_all_sets_of_cells_and_are_reached() {
        for operation in OPERATIONS {
            let expression = Expression::of_inputs(operation, 2);
            let mut reached = std::collections::BTreeMap::new();
            for (a, b) in (0u32..64).flat_map(|a| (0u32..64).map(move |b| (a, b))) {
                let sizes = [a.count_ones(), b.count_ones()].map(f64::from);
                let bounds = expression.volume_bounds(|i| of_cells(sizes[i])).volume;
                let cells = (0..6).filter(|cell| operation.holds(a >> cell & 1 == 1, b >> cell & 1 == 1)).count();
                let volume = cells as f64;
                assert!(
                    (bounds[0]..=bounds[1]).contains(&volume),
                    "{operation:?} {a:b} {b:b}: {volume} not in {bounds:?}"
                );
                let seen = reached.entry(sizes.map(f64::to_bits)).or_insert((bounds, volume, volume));
                (seen.1, seen.2) = (seen.1.min(volume), seen.2.max(volume));
            }
            assert!(reached.values().all(|&(bounds, least, most)| bounds == [least, most]), "{operation:?}");
        }
    }

    #[test]
    fn boxes_that_barely_overlap_give_tight_bounds() {
        let solid = |from: f64, volume: f64| VolumeBounds {
            volume: [volume; 2],
            corners: [DVec3::new(from, 0.0, 0.0), DVec3::new(from + 1.0, 1.0, 1.0)],
        };
        let of = |operation| Expression::of_inputs(operation, 2).volume_bounds(|i| solid(0.875 * i as f64, 0.5)).volume;
        assert_eq!(of(BooleanOperation::Intersection), [0.0, 0.125]);
        assert_eq!(of(BooleanOperation::Union), [0.875, 1.0]);
        assert_eq!(of(BooleanOperation::Difference), [0.375, 0.5]);
        assert_eq!(of(BooleanOperation::Xor), [0.75, 1.0]);
    }

    #[test]
    fn bounds_fold_three_operands_from_left_to_right() {
        let inputs = [[4.0, 5.0], [1.0, 2.0], [0.0, 1.0]];
        let bounds = Expression::of_inputs(BooleanOperation::Difference, 3)
            .volume_bounds(|i| VolumeBounds { volume: inputs[i], ..of_cells(0.0) });
        assert_eq!(bounds.volume, [1.0, 5.0]);
    }
}
