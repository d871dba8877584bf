//! One sweep along each ray over the samples of all operands.
//!
//! An event is a sample of one operand: its depth and its leaf in one word, so that words in order are events in order. Of
//! what turns the result over twice at one depth nothing stays; that unites intervals that touch and drops empty ones,
//! whatever the order of the samples at one depth.
//!
//! # Triangles
//! Where every operand knows the triangle of each sample, so does the result. At one depth several operands may turn over.
//! If the result turns with them, then at least one goes the way that it goes: it is entered where the result is entered
//! and what it is in counts along, or left where it counts against. Of the samples of those operands at that depth the one
//! of the least input, and of that the least triangle, stands for the change. That depends on no order of the samples.
//!
//! # What was tried
//! Figures are those of `cargo bench --bench csg`, for five operands of some ten samples a ray. See `CHANGELOG.md`.

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
        match self.table {
            Some(table) => self.sweep_with(&Table { table, state: 0 }, operands),
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
struct Table {
    table: u64,
    state: u64,
}

impl Truth for Table {
    #[inline]
    fn flip(&mut self, leaf: usize) -> bool {
        self.state ^= 1 << leaf;
        self.table >> self.state & 1 == 1
    }

    #[inline]
    fn is_inside(&self, leaf: usize) -> bool {
        self.state >> leaf & 1 == 1
    }
}

/// A depth, and below it the leaf that turns over there.
type Event = u64;

fn event(depth: i32, leaf: usize) -> Event {
    (depth as u64) << 32 | leaf as u64
}

fn depth_of(event: Event) -> i32 {
    (event >> 32) as i32
}

fn leaf_of(event: Event) -> usize {
    event as u32 as usize
}

/// What a thread keeps from ray to ray.
struct Stage<'p, T> {
    truth: T,
    /// Whether the result holds where one leaf alone is true.
    alone: Vec<bool>,
    polarities: &'p [Polarity],
    events: Vec<Event>,
    merged: Vec<Event>,
    /// The depths at which the result turns over, after one that no sample has.
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
            events: Vec::new(),
            merged: Vec::new(),
            turns: vec![-1],
            passed: vec![0; plan.leaves.len()],
        }
    }

    /// Puts the events of a ray in order; none, where no two operands have samples and one alone makes no result.
    fn gather(&mut self, operands: &[Operand], ray: u32) {
        self.events.clear();
        let (mut runs, mut second, mut only) = (0, 0, 0);
        for (leaf, operand) in operands.iter().enumerate() {
            let samples = operand.image.samples(ray);
            if !samples.is_empty() {
                (runs, second, only) = (runs + 1, self.events.len(), leaf);
                self.events.extend(samples.iter().map(|&depth| event(depth, leaf)));
            }
        }
        match runs {
            0 => {}
            1 if self.alone[only] => {}
            1 => self.events.clear(),
            2 => {
                merge(&self.events[..second], &self.events[second..], &mut self.merged);
                std::mem::swap(&mut self.events, &mut self.merged);
            }
            _ => self.events.sort_unstable(),
        }
    }

    /// Appends the depths of the result on a ray.
    fn sweep(&mut self, operands: &[Operand], ray: u32, image: &mut BandImage) {
        self.gather(operands, ray);
        if self.turns.len() <= self.events.len() {
            self.turns.resize(self.events.len() + 1, -1);
        }
        // Without branches, as whether an event turns the result over cannot be guessed.
        let (mut end, mut holds) = (1, false);
        for &event in &self.events {
            let now = self.truth.flip(leaf_of(event));
            let depth = depth_of(event);
            let turns = now != holds;
            let turns_back = turns & (self.turns[end - 1] == depth);
            self.turns[end] = depth;
            end = end + usize::from(turns) - 2 * usize::from(turns_back);
            holds = now;
        }
        image.depths().extend_from_slice(&self.turns[1..end]);
    }

    /// Appends the depths of the result on a ray, and the triangle of each.
    fn sweep_surface(&mut self, operands: &[Operand], ray: u32, image: &mut BandImage) {
        self.gather(operands, ray);
        let mut holds = false;
        for together in self.events.chunk_by(|&a, &b| depth_of(a) == depth_of(b)) {
            let mut now = holds;
            for &event in together {
                now = self.truth.flip(leaf_of(event));
            }
            if now != holds {
                let of_one_leaf = together.chunk_by(|&a, &b| leaf_of(a) == leaf_of(b));
                let cause = of_one_leaf.into_iter().find(|events| self.turns_along(events, now));
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
        for &event in &self.events {
            self.passed[leaf_of(event)] = 0;
        }
    }

    /// Whether a leaf has turned over with its events at one depth, the way that makes the result what it is `now`.
    fn turns_along(&self, events: &[Event], now: bool) -> bool {
        let leaf = leaf_of(events[0]);
        let wanted = match self.polarities[leaf] {
            Polarity::Along => self.truth.is_inside(leaf) == now,
            Polarity::Against => self.truth.is_inside(leaf) != now,
            Polarity::Both => true,
        };
        events.len() % 2 == 1 && wanted
    }
}

/// Brings two runs into one order.
fn merge(a: &[Event], b: &[Event], merged: &mut Vec<Event>) {
    merged.clear();
    let (mut i, mut j) = (0, 0);
    while i < a.len() && j < b.len() {
        let is_first = a[i] < b[j];
        merged.push(if is_first { a[i] } else { b[j] });
        i += usize::from(is_first);
        j += usize::from(!is_first);
    }
    merged.extend_from_slice(&a[i..]);
    merged.extend_from_slice(&b[j..]);
}
