//! One sweep along each ray over the samples of all operands.
//!
//! An event is a sample of one operand: its depth and its leaf in one word, so that ordered words are ordered events. The
//! samples of each operand are already sorted, so runs of events are merged pairwise. Each merge proceeds from both ends at
//! once and without a branch on the run that supplies the next event, which is unpredictable. The result is evaluated after all
//! events at one depth; that unites intervals that touch and drops empty ones.
//!
//! # Triangles
//! Where every operand knows the triangle of each sample, so does the result. At one depth several operands may toggle. If the
//! result toggles with them, then at least one goes in the same direction: it is entered where the result is entered and its
//! leaf counts positively, or left where its leaf counts negatively. Of the samples of those operands at that depth, the one of
//! the least input, and of that input the least triangle, represents the change. This is independent of the order of the
//! samples.
//!
//! # Rejected alternatives
//! - Sorting the events by the standard library instead of merging runs: takes half as long again as Booleans of two at a time,
//!   where merged runs take about as long.
//! - Dropping a toggle when the next one comes at the same depth: every event waits for the store of the last one.

use crate::parallel::*;

use super::BooleanError;
use super::network::Network;
use super::plan::{Leaf, Plan, Polarity};
use crate::ldi::{BandImage, Ldi, image_from_bands};

/// Rows swept by one task.
const BAND_ROWS: u32 = 16;

/// An image that takes part in a sweep.
#[derive(Clone, Copy, Debug)]
pub struct Operand<'a> {
    /// The image of a leaf.
    pub image: &'a Ldi,
    /// The offset of this input's triangle numbers in the result, which keeps the triangles of different inputs apart: the
    /// number of triangles of the inputs before this one.
    pub first_triangle: u32,
}

impl<'a> From<&'a Ldi> for Operand<'a> {
    /// Makes an operand of an image whose triangles keep their numbers.
    fn from(image: &'a Ldi) -> Operand<'a> {
        Operand { image, first_triangle: 0 }
    }
}

impl Plan {
    /// Computes the image of the expression from one image for each of [`leaves`](Plan::leaves), in their order, all of the
    /// same rays. A ray that is unclosed in any of them is unclosed in the result.
    ///
    /// The result has triangles if all images have them; an image without samples counts as having them.
    ///
    /// # Errors
    /// If rays differ, if triangles are too many to be numbered, or if the result is too large.
    ///
    /// # Panics
    /// If the number of images differs from that of the leaves.
    pub fn sweep(&self, operands: &[Operand]) -> Result<Ldi, BooleanError> {
        assert_eq!(operands.len(), self.leaves.len(), "there is one image for each leaf");
        same_rays(operands)?;
        match &self.table {
            Some(words) => self.sweep_with(&Table { words, state: 0 }, operands),
            None => self.sweep_with(&self.network, operands),
        }
    }

    fn sweep_with<T: Truth>(&self, truth: &T, operands: &[Operand]) -> Result<Ldi, BooleanError> {
        if operands.iter().all(|operand| operand.image.triangles().is_some()) {
            numbered(&self.leaves, operands)?;
            return image(operands, || Stage::new(truth, self), Stage::sweep_surface);
        }
        image(operands, || Stage::new(truth, self), Stage::sweep)
    }
}

/// Computes an image ray by ray.
fn image<S>(
    operands: &[Operand],
    new_stage: impl Fn() -> S + Sync + Send,
    sweep: impl Fn(&mut S, &[Operand], u32, &mut BandImage) + Sync + Send,
) -> Result<Ldi, BooleanError> {
    let first = operands[0].image;
    let (columns, _) = first.size();
    let open: Vec<&Ldi> = operands.iter().map(|operand| operand.image).filter(|i| !i.unclosed().is_empty()).collect();
    let image = image_from_bands(*first.grid(), first.axis(), BAND_ROWS, new_stage, |stage, rows, image| {
        for ray in rows.start * columns..rows.end * columns {
            if open.iter().any(|operand| operand.is_unclosed(ray)) {
                image.end_unclosed_ray();
            } else {
                sweep(stage, operands, ray, image);
                image.end_ray();
            }
        }
    })?;
    Ok(image)
}

/// Checks that all images have the same rays.
fn same_rays(operands: &[Operand]) -> Result<(), BooleanError> {
    let first = operands[0].image;
    let differs = |other: &&Operand| other.image.grid() != first.grid() || other.image.axis() != first.axis();
    match operands.iter().find(differs) {
        None => Ok(()),
        Some(Operand { image: other, .. }) => Err(BooleanError::RaysDiffer {
            first: first.axis(),
            first_pitch: first.grid().pitch(),
            second: other.axis(),
            second_pitch: other.grid().pitch(),
        }),
    }
}

/// Checks that all triangles have a number in the result.
fn numbered(leaves: &[Leaf], operands: &[Operand]) -> Result<(), BooleanError> {
    for (leaf, &Operand { image, first_triangle: first }) in leaves.iter().zip(operands) {
        let greatest = image.triangles().and_then(|triangles| triangles.par_iter().copied().max());
        if let Some(triangle) = greatest.filter(|triangle| first.checked_add(*triangle).is_none()) {
            return Err(BooleanError::TooManyTriangles { input: leaf.input, first, triangle });
        }
    }
    Ok(())
}

/// The truth value of the result while leaves toggle.
trait Truth: Clone + Send + Sync {
    /// Toggles a leaf; returns whether the result is true.
    fn flip(&mut self, leaf: usize) -> bool;
    /// Returns whether a leaf is true.
    fn is_inside(&self, leaf: usize) -> bool;
}

impl Truth for Network {
    #[inline]
    fn flip(&mut self, leaf: usize) -> bool {
        Network::flip(self, leaf)
    }

    #[inline]
    fn is_inside(&self, leaf: usize) -> bool {
        Network::is_inside(self, leaf)
    }
}

/// The result for every state of a few leaves.
#[derive(Clone)]
struct Table<'p> {
    words: &'p [u64],
    state: usize,
}

impl Truth for Table<'_> {
    #[inline]
    fn flip(&mut self, leaf: usize) -> bool {
        self.state ^= 1 << leaf;
        self.words[self.state / 64] >> (self.state % 64) & 1 == 1
    }

    #[inline]
    fn is_inside(&self, leaf: usize) -> bool {
        self.state >> leaf & 1 == 1
    }
}

/// A depth plus one, and in the low word the leaf that toggles there.
type Event = u64;

/// Less than all events; precedes every run of them.
const BEFORE: Event = 0;

/// Greater than all events; follows every run of them.
const AFTER: Event = u64::MAX;

fn event(depth: i32, leaf: usize) -> Event {
    (depth as u64 + 1) << 32 | leaf as u64
}

fn depth_of(event: Event) -> i32 {
    (event >> 32) as i32 - 1
}

fn leaf_of(event: Event) -> usize {
    event as u32 as usize
}

fn at_one_depth(a: Event, b: Event) -> bool {
    a >> 32 == b >> 32
}

/// Runs of events in order, each enclosed by its two sentinels.
#[derive(Default)]
struct Runs {
    events: Vec<Event>,
    /// The end of each run, sentinels included.
    ends: Vec<usize>,
}

impl Runs {
    fn clear(&mut self) {
        self.events.clear();
        self.ends.clear();
    }

    fn push(&mut self, events: impl Iterator<Item = Event>) {
        self.events.push(BEFORE);
        self.events.extend(events);
        self.events.push(AFTER);
        self.ends.push(self.events.len());
    }

    /// Returns a run with its sentinels.
    fn run(&self, i: usize) -> &[Event] {
        let start = if i == 0 { 0 } else { self.ends[i - 1] };
        &self.events[start..self.ends[i]]
    }

    /// Appends the merge of two runs, each of an even number of events.
    fn push_merged(&mut self, a: &[Event], b: &[Event]) {
        let count = a.len() + b.len() - 4;
        self.events.push(BEFORE);
        let first = self.events.len();
        self.events.resize(first + count, AFTER);
        let merged = &mut self.events[first..];
        let (mut front_a, mut front_b, mut back_a, mut back_b) = (1, 1, a.len() - 2, b.len() - 2);
        for i in 0..count / 2 {
            let (x, y) = (a[front_a], b[front_b]);
            merged[i] = x.min(y);
            front_a += usize::from(x < y);
            front_b += usize::from(x >= y);
            let (x, y) = (a[back_a], b[back_b]);
            merged[count - 1 - i] = x.max(y);
            back_a -= usize::from(x > y);
            back_b -= usize::from(x <= y);
        }
        self.events.push(AFTER);
        self.ends.push(self.events.len());
    }
}

/// The state that a thread keeps from ray to ray.
struct Stage<'p, T> {
    truth: T,
    /// True for each leaf if the result is true where that leaf alone is.
    alone: Vec<bool>,
    polarities: &'p [Polarity],
    /// The events of a ray: one run or none after gathering.
    runs: Runs,
    merged: Runs,
    /// Buffer for the depths at which the result toggles.
    turns: Vec<i32>,
    /// The number of samples of each leaf already passed on this ray.
    passed: Vec<u32>,
}

impl<'p, T: Truth> Stage<'p, T> {
    fn new(truth: &T, plan: &'p Plan) -> Stage<'p, T> {
        let mut truth = truth.clone();
        let leaves = 0..plan.leaves.len();
        let alone = leaves.map(|leaf| {
            let holds = truth.flip(leaf);
            truth.flip(leaf);
            holds
        });
        Stage {
            alone: alone.collect(),
            truth,
            polarities: &plan.polarities,
            runs: Runs::default(),
            merged: Runs::default(),
            turns: Vec::new(),
            passed: vec![0; plan.leaves.len()],
        }
    }

    /// Gathers the events of a ray into one run; into none if there are none or if they are those of one leaf alone that makes
    /// no result.
    fn gather(&mut self, operands: &[Operand], ray: u32) {
        self.runs.clear();
        let mut last = 0;
        for (leaf, operand) in operands.iter().enumerate() {
            let samples = operand.image.samples(ray);
            if !samples.is_empty() {
                last = leaf;
                self.runs.push(samples.iter().map(|&depth| event(depth, leaf)));
            }
        }
        if self.runs.ends.len() == 1 && !self.alone[last] {
            self.runs.clear();
        }
        while self.runs.ends.len() > 1 {
            self.merged.clear();
            let count = self.runs.ends.len();
            for i in (0..count - 1).step_by(2) {
                self.merged.push_merged(self.runs.run(i), self.runs.run(i + 1));
            }
            if count % 2 == 1 {
                self.merged.events.extend_from_slice(self.runs.run(count - 1));
                self.merged.ends.push(self.merged.events.len());
            }
            std::mem::swap(&mut self.runs, &mut self.merged);
        }
    }

    /// Appends the depths of the result on a ray.
    fn sweep(&mut self, operands: &[Operand], ray: u32, image: &mut BandImage) {
        self.gather(operands, ray);
        let [BEFORE, events @ ..] = &self.runs.events[..] else { return };
        if self.turns.len() < events.len() {
            self.turns.resize(events.len(), 0);
        }
        // Without branches, as whether an event toggles the result is unpredictable.
        let (mut end, mut holds) = (0, false);
        for pair in events.windows(2) {
            let [event, next] = [pair[0], pair[1]];
            let now = self.truth.flip(leaf_of(event));
            let turns = (now != holds) & !at_one_depth(event, next);
            self.turns[end] = depth_of(event);
            end += usize::from(turns);
            holds ^= turns;
        }
        image.depths().extend_from_slice(&self.turns[..end]);
    }

    /// Appends the depths of the result on a ray, and the triangle of each.
    fn sweep_surface(&mut self, operands: &[Operand], ray: u32, image: &mut BandImage) {
        self.gather(operands, ray);
        let [BEFORE, events @ .., AFTER] = &self.runs.events[..] else { return };
        let mut holds = false;
        for together in events.chunk_by(|&a, &b| at_one_depth(a, b)) {
            let mut now = holds;
            for &event in together {
                now = self.truth.flip(leaf_of(event));
            }
            if now != holds {
                let of_one_leaf = together.chunk_by(|&a, &b| leaf_of(a) == leaf_of(b));
                let cause =
                    of_one_leaf.into_iter().find(|events| turns_along(&self.truth, self.polarities, events, now));
                let events = cause.expect("some leaf turns over the way the result does");
                let leaf = leaf_of(events[0]);
                let Operand { image: operand, first_triangle } = operands[leaf];
                let first = (operand.offsets()[ray as usize] + self.passed[leaf]) as usize;
                let triangles = operand.triangles().expect("all operands have triangles");
                let least = triangles[first..first + events.len()].iter().min();
                image.depths().push(depth_of(together[0]));
                image.triangles().push(first_triangle + least.expect("a leaf has events"));
                holds = now;
            }
            for &event in together {
                self.passed[leaf_of(event)] += 1;
            }
        }
        for &event in events {
            self.passed[leaf_of(event)] = 0;
        }
    }
}

/// Returns whether a leaf has toggled with its events at one depth, in the direction that makes the result `now`.
fn turns_along(truth: &impl Truth, polarities: &[Polarity], events: &[Event], now: bool) -> bool {
    let leaf = leaf_of(events[0]);
    let wanted = match polarities[leaf] {
        Polarity::Along => truth.is_inside(leaf) == now,
        Polarity::Against => truth.is_inside(leaf) != now,
        Polarity::Both => true,
    };
    events.len() % 2 == 1 && wanted
}
