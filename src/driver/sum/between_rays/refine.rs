//! Halving of cubes: which have a cavity, and how large it is.

use crate::parallel::*;

use super::{Searched, Tests, box_of};
use crate::cancel::checkpoint;
use crate::fixed::Hit;
use crate::grid::{Grid, LatticeBox};
use crate::minkowski::{Probe, Probed};

/// Boxes that are tested between two checkpoints.
const BATCH: usize = 64;

/// A box within a candidate.
type Part = (u32, LatticeBox);

/// The part of a cube that a detail takes up.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    /// The box around it.
    pub bounds: LatticeBox,
    /// Its volume, in cubes.
    pub share: f64,
}

/// Returns the cubes whose node is in and that have a point outside, and the number of halvings after which the search ended:
/// at most `halvings`, fewer where the tests were used up.
pub fn cubes_with_cavities<H: Hit + Sync, P: Probe>(
    searched: &Searched<H, P>,
    cubes: &[[u32; 3]],
    halvings: u32,
) -> (Vec<[u32; 3]>, u32) {
    let Tests(mut left) = searched.tests;
    let mut has_cavity = vec![false; cubes.len()];
    let mut open: Vec<Part> = cubes.iter().zip(0..).map(|(&cube, at)| (at, box_of(searched.grid, cube))).collect();
    let mut reached = halvings;
    for level in 0..=halvings {
        if open.len() > left {
            // The boxes of the level before were tested.
            reached = level.saturating_sub(1);
            break;
        }
        left -= open.len();
        let mut answers = vec![Probed::Filled; open.len()];
        let batches = answers.par_chunks_mut(BATCH).zip(open.par_chunks(BATCH));
        batches.for_each_init(Default::default, |memory, (answers, parts)| {
            checkpoint();
            for (answer, (_, bounds)) in answers.iter_mut().zip(parts) {
                *answer = searched.probe.probe(bounds, memory);
            }
        });
        for ((cube, _), answer) in open.iter().zip(&answers) {
            has_cavity[*cube as usize] |= matches!(answer, Probed::Outside | Probed::Empty);
        }
        let undecided = open.into_iter().zip(answers).filter(|(_, answer)| *answer == Probed::Inside);
        open = undecided
            .map(|(part, _)| part)
            .filter(|(cube, _)| !has_cavity[*cube as usize])
            .flat_map(|(cube, bounds)| halves(&bounds).map(|half| (cube, half)))
            .collect();
    }
    (cubes.iter().zip(has_cavity).filter(|(_, has)| *has).map(|(&cube, _)| cube).collect(), reached)
}

/// Returns the part of a cube that lies in the sum, or outside, to `halvings` halvings; `None` if no centre lies there.
pub fn extent_in_cube<P: Probe>(
    grid: &Grid,
    probe: &P,
    cube: [u32; 3],
    is_of_sum: bool,
    halvings: u32,
) -> Option<Extent> {
    let mut memory = P::Memory::default();
    let mut found = Extent { bounds: LatticeBox::EMPTY, share: 0.0 };
    let mut open = vec![(0, box_of(grid, cube))];
    while let Some((level, bounds)) = open.pop() {
        checkpoint();
        let answer = probe.probe(&bounds, &mut memory);
        match (answer, is_of_sum) {
            (Probed::Filled, false) | (Probed::Empty, true) => continue,
            (Probed::Filled, true) | (Probed::Empty, false) => found.add(bounds, level),
            _ if level < halvings => open.extend(halves(&bounds).map(|half| (level + 1, half))),
            (Probed::Inside, true) | (Probed::Outside, false) => found.add(bounds, level),
            _ => {}
        }
    }
    (found.share > 0.0).then_some(found)
}

impl Extent {
    fn add(&mut self, bounds: LatticeBox, level: u32) {
        self.bounds = self.bounds.hull(&bounds);
        self.share += 0.125f64.powi(level as i32);
    }
}

/// Returns the eight halves of a box whose sides are powers of two.
fn halves(bounds: &LatticeBox) -> [LatticeBox; 8] {
    let side = (bounds.max[0] - bounds.min[0]) / 2;
    std::array::from_fn(|k| {
        let min = std::array::from_fn(|i| bounds.min[i] + side * (k >> i & 1) as i32);
        LatticeBox { min, max: min.map(|low| low + side) }
    })
}
