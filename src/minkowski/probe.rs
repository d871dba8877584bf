//! Membership of boxes: one test decides the centre of a box, and often all of the box.

use crate::grid::LatticeBox;

/// The answer to a test of a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Probed {
    /// All of the box lies in the solid.
    Filled,
    /// The centre lies in the solid; the rest of the box is undecided.
    Inside,
    /// The centre lies outside; the rest of the box is undecided.
    Outside,
    /// All of the box lies outside.
    Empty,
}

/// An exact membership test that also decides boxes.
pub trait Probe: Sync {
    /// The memory of a thread from one test to the next. It makes tests faster where boxes lie close to one another, and never
    /// changes the state of a centre.
    type Memory: Default + Send;

    /// Tests a box on the lattice of the sum.
    fn probe(&self, bounds: &LatticeBox, memory: &mut Self::Memory) -> Probed;
}

/// Returns the odd position in the middle of a box, which no vertex occupies.
pub fn centre(bounds: &LatticeBox) -> [i32; 3] {
    std::array::from_fn(|i| (bounds.min[i] + (bounds.max[i] - bounds.min[i]) / 2) | 1)
}

/// Returns the corners of a box.
pub fn corners(bounds: &LatticeBox) -> [[i32; 3]; 8] {
    std::array::from_fn(|k| std::array::from_fn(|i| if k >> i & 1 == 0 { bounds.min[i] } else { bounds.max[i] }))
}
