//! One sweep along each ray over the samples of all operands.
//!
//! An event is a sample of one operand: its depth and its leaf in one word, so that words in order are events in order.
//! The samples of each operand are in order already, so runs of events are merged two by two, and each merge from both
//! ends at once and without a branch on which run gives the next event, which cannot be guessed. All events at one depth
//! are passed before the result counts; that unites intervals that touch and drops empty ones.
//!
//! # Triangles
//! Where every operand knows the triangle of each sample, so does the result. At one depth several operands may turn over.
//! If the result turns with them, then at least one goes the way that it goes: it is entered where the result is entered
//! and what it is in counts along, or left where it counts against. Of the samples of those operands at that depth the one
//! of the least input, and of that the least triangle, stands for the change. That depends on no order of the samples.
//!
//! # What was tried
//! - Sorting the events by the standard library instead of merging runs: half as long again as Booleans of two at a time,
//!   where merged runs take about as long.
//! - Dropping a turn when the next one comes at the same depth: every event waits for what the last one stored.

use rayon::prelude::*;

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
    /// What the number of a triangle is counted from in the result, so that the triangles of different inputs are told
    /// apart: as many as the inputs before this one have.
    pub first_triangle: u32,
}

impl<'a> From<&'a Ldi> for Operand<'a> {
    /// An image whose triangles keep their numbers.
    fn from(image: &'a Ldi) -> Operand<'a> {
        Operand { image, first_triangle: 0 }
    }
}

impl Plan {
    /// The image of the expression, from one image for each of [`leaves`](Plan::leaves) and in their order, which do all
    /// have the same rays. A ray that is unclosed in any of them is unclosed in the result.
    ///
    /// Where all of them have triangles, the result has them; an image without samples does.
    ///
    /// # Errors
    /// If rays differ, if triangles are too many to be numbered, or if the result is too large.
    ///
    /// # Panics
    /// If there are not as many images as leaves.
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

/// Makes an image ray by ray.
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

/// All images are of the same rays.
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

/// All triangles have a number in the result.
fn numbered(leaves: &[Leaf], operands: &[Operand]) -> Result<(), BooleanError> {
    for (leaf, &Operand { image, first_triangle: first }) in leaves.iter().zip(operands) {
        let greatest = image.triangles().and_then(|triangles| triangles.par_iter().copied().max());
        if let Some(triangle) = greatest.filter(|triangle| first.checked_add(*triangle).is_none()) {
            return Err(BooleanError::TooManyTriangles { input: leaf.input, first, triangle });
        }
    }
    Ok(())
}

/// Whether the result holds while leaves turn over.
trait Truth: Clone + Send + Sync {
    /// Turns a leaf over; whether the result holds now.
    fn flip(&mut self, leaf: usize) -> bool;
    /// Whether a leaf is true.
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

/// The result for every state of few leaves.
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

/// One more than a depth, and below it the leaf that turns over there.
type Event = u64;

/// Comes before all events, and stands before every run of them.
const BEFORE: Event = 0;

/// Comes after all events, and stands behind every run of them.
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

/// Runs of events in order, each between its two ends.
#[derive(Default)]
struct Runs {
    events: Vec<Event>,
    /// Where each run ends, with its ends.
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

    /// A run with its ends.
    fn run(&self, i: usize) -> &[Event] {
        let start = if i == 0 { 0 } else { self.ends[i - 1] };
        &self.events[start..self.ends[i]]
    }

    /// Appends two runs, each of an even number of events, as one.
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

/// What a thread keeps from ray to ray.
struct Stage<'p, T> {
    truth: T,
    /// Whether the result holds where one leaf alone is true.
    alone: Vec<bool>,
    polarities: &'p [Polarity],
    /// The events of a ray: at last one run or none.
    runs: Runs,
    merged: Runs,
    /// Room for the depths at which the result turns over.
    turns: Vec<i32>,
    /// The samples of each leaf that were passed on this ray.
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

    /// Brings the events of a ray into one run; into none, where there are none or those of one leaf alone, which makes no
    /// result.
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
        // Without branches, as whether an event turns the result over cannot be guessed.
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

/// Whether a leaf has turned over with its events at one depth, the way that makes the result what it is `now`.
fn turns_along(truth: &impl Truth, polarities: &[Polarity], events: &[Event], now: bool) -> bool {
    let leaf = leaf_of(events[0]);
    let wanted = match polarities[leaf] {
        Polarity::Along => truth.is_inside(leaf) == now,
        Polarity::Against => truth.is_inside(leaf) != now,
        Polarity::Both => true,
    };
    events.len() % 2 == 1 && wanted
}
