//! The image of what a job asks for, along one axis.

use std::time::Instant;

use ldi_ops::boolean::{BooleanOperation, merge};
use ldi_ops::grid::{Axis, LatticeSolid};
use ldi_ops::ldi::{Ldi, Summary, Windings};
use ldi_ops::sampler::{Fill, Mode, SampleError, Sampler};

use super::measure::Seconds;
use crate::exit::Failure;
use crate::resolve::Measurement;

/// Makes images along one axis, and keeps what else they tell.
pub struct ImageMaker<'a> {
    pub sampler: &'a dyn Sampler,
    pub axis: Axis,
    pub mode: Mode,
    pub fill: Fill,
    /// The time that goes into sampling and into operations is added here.
    pub seconds: &'a mut Seconds,
    /// Whether the fill rules agree in all images of each input alone; nothing where there was none.
    pub rules_agree: &'a mut [Option<bool>],
}

/// The most images along one axis that [`ImageMaker::image`] holds at the same time.
pub fn alive_at_once(measurement: Measurement, mode: Mode) -> u64 {
    match (measurement, mode) {
        (Measurement::Volume | Measurement::Sample, _) => 1,
        // Both estimates of either side, one result, and two differences with their union.
        (Measurement::Boolean(BooleanOperation::Xor), Mode::Estimate(_)) => 8,
        // Two operands and their result.
        (Measurement::Boolean(_), _) => 3,
    }
}

impl ImageMaker<'_> {
    /// The image of the measured solid. With estimates, an over-estimate takes under-estimates away.
    pub fn image(&mut self, measurement: Measurement, solids: &[LatticeSolid]) -> Result<Ldi, Failure> {
        let operation = match measurement {
            Measurement::Volume | Measurement::Sample => return self.sample(solids, 0, self.mode),
            Measurement::Boolean(operation) => operation,
        };
        match (operation, self.mode, solids) {
            (BooleanOperation::Intersection, Mode::Estimate(estimate), [a, b]) => {
                self.timed(|maker| maker.sampler.sample_intersection(a, b, maker.axis, estimate, maker.fill))
            }
            (BooleanOperation::Xor, Mode::Estimate(_), _) => self.estimate_xor(solids),
            (operation, mode, _) => {
                let taken = if operation == BooleanOperation::Difference { mode.opposite() } else { mode };
                let mut result = self.sample(solids, 0, mode)?;
                for i in 1..solids.len() {
                    let other = self.sample(solids, i, taken)?;
                    result = self.merge(operation, &result, &other)?;
                }
                Ok(result)
            }
        }
    }

    /// The summary of [`image`](Self::image), which the sampler makes by itself where it makes the whole image.
    pub fn summary(&mut self, measurement: Measurement, solids: &[LatticeSolid]) -> Result<Summary, Failure> {
        match (measurement, self.mode, solids) {
            (Measurement::Boolean(BooleanOperation::Intersection), Mode::Estimate(estimate), [a, b]) => {
                self.timed(|maker| maker.sampler.summarise_intersection(a, b, maker.axis, estimate, maker.fill))
            }
            (Measurement::Volume | Measurement::Sample, mode, [solid]) => {
                let summary = self.timed(|maker| maker.sampler.summarise(solid, maker.axis, mode, maker.fill))?;
                self.look_at(0, summary.windings());
                Ok(summary)
            }
            _ => {
                let image = self.image(measurement, solids)?;
                let start = Instant::now();
                let summary = image.summary();
                self.seconds.integrate += start.elapsed().as_secs_f64();
                Ok(summary)
            }
        }
    }

    /// What the sampler makes, its time added to that of sampling.
    fn timed<T>(&mut self, make: impl FnOnce(&Self) -> Result<T, SampleError>) -> Result<T, Failure> {
        let start = Instant::now();
        let made = make(self)?;
        self.seconds.sample += start.elapsed().as_secs_f64();
        Ok(made)
    }

    /// An estimate of A xor B as (A − B) ∪ (B − A), each difference with the opposite estimate of what it takes away.
    ///
    /// Of what lies to the left both estimates are carried along, as either is taken away from the next solid.
    fn estimate_xor(&mut self, solids: &[LatticeSolid]) -> Result<Ldi, Failure> {
        let modes = [self.mode, self.mode.opposite()];
        let mut left = [self.sample(solids, 0, modes[0])?, self.sample(solids, 0, modes[1])?];
        for i in 1..solids.len() {
            let right = [self.sample(solids, i, modes[0])?, self.sample(solids, i, modes[1])?];
            let wanted = self.merge_xor([&left[0], &left[1]], [&right[0], &right[1]])?;
            if i + 1 == solids.len() {
                return Ok(wanted);
            }
            let opposite = self.merge_xor([&left[1], &left[0]], [&right[1], &right[0]])?;
            left = [wanted, opposite];
        }
        let [only, _] = left;
        Ok(only)
    }

    /// One estimate of an xor, from that estimate of either operand and the opposite one.
    fn merge_xor(&mut self, left: [&Ldi; 2], right: [&Ldi; 2]) -> Result<Ldi, Failure> {
        let left_alone = self.merge(BooleanOperation::Difference, left[0], right[1])?;
        let right_alone = self.merge(BooleanOperation::Difference, right[0], left[1])?;
        self.merge(BooleanOperation::Union, &left_alone, &right_alone)
    }

    fn sample(&mut self, solids: &[LatticeSolid], i: usize, mode: Mode) -> Result<Ldi, Failure> {
        let image = self.timed(|maker| maker.sampler.sample(&solids[i], maker.axis, mode, maker.fill))?;
        self.look_at(i, image.windings());
        Ok(image)
    }

    /// Learns what an image of one input tells of the fill rules.
    fn look_at(&mut self, i: usize, windings: Option<Windings>) {
        if let Some(agree) = windings.map(Windings::fill_rules_agree) {
            self.rules_agree[i] = Some(agree && self.rules_agree[i] != Some(false));
        }
    }

    fn merge(&mut self, operation: BooleanOperation, a: &Ldi, b: &Ldi) -> Result<Ldi, Failure> {
        let start = Instant::now();
        let image = merge(operation, a, b)?;
        self.seconds.operate += start.elapsed().as_secs_f64();
        Ok(image)
    }
}
