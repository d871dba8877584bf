//! The image of a job's result along one axis.

use std::time::Instant;

use super::job::{Boolean, Measurement};
use super::measured::Seconds;
use crate::Error;
use crate::boolean::{Expression, Leaf, Operand, Plan};
use crate::grid::{Axis, LatticeSolid};
use crate::ldi::{Ldi, VolumeSums, Windings};
use crate::sampler::{Combination, Combined, Estimate, FillRule, MaskIntersection, Mode, SampleError, SolidSums};

/// A maker of images along one axis, which also records times and the agreement of the fill rules.
pub struct ImageMaker<'a> {
    pub sampler: &'a dyn MaskIntersection,
    pub axis: Axis,
    pub mode: Mode,
    pub fill: FillRule,
    pub triangles: Triangles,
    /// The stage times, to which the maker adds.
    pub seconds: &'a mut Seconds,
    /// For each input: true if the fill rules agree in all its images; `None` without an image of this input alone.
    pub rules_agree: &'a mut [Option<bool>],
}

/// The choice whether samples keep the numbers of their triangles, which count through all inputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Triangles {
    Wanted,
    NotWanted,
}

/// Returns the largest number of images along one axis that [`ImageMaker::image`] holds at the same time.
pub fn alive_at_once(measurement: &Measurement, mode: Mode) -> u64 {
    match measurement {
        Measurement::Volume | Measurement::Sample => 1,
        Measurement::Boolean(Boolean { expression, .. }) => match masked(expression, mode) {
            Some(_) => 1,
            // The swept images and the result.
            None => Plan::new(expression, mode).leaves().len() as u64 + 1,
        },
    }
}

/// Returns the two inputs and the estimate, if the sampler itself intersects the inputs, in masks.
fn masked(expression: &Expression, mode: Mode) -> Option<([usize; 2], Estimate)> {
    match mode {
        Mode::Exact => None,
        Mode::Estimate(estimate) => Some((expression.intersection_of_two()?, estimate)),
    }
}

/// Returns the number of the first triangle of each input; numbers count through all inputs.
pub fn first_triangles(solids: &[LatticeSolid]) -> impl Iterator<Item = u32> {
    solids.iter().scan(0u32, |next, solid| {
        let first = *next;
        *next = next.saturating_add(solid.triangles().len() as u32);
        Some(first)
    })
}

impl ImageMaker<'_> {
    /// Returns the image of the measured solid.
    pub fn image(&mut self, measurement: &Measurement, solids: &[LatticeSolid]) -> Result<Ldi, Error> {
        let expression = match measurement {
            Measurement::Volume | Measurement::Sample => {
                let image = self.sample(&solids[0], 0, self.mode)?;
                return self.with_triangles(image, solids);
            }
            Measurement::Boolean(Boolean { expression, .. }) => expression,
        };
        let image = match masked(expression, self.mode) {
            Some(([a, b], estimate)) => self.timed(|maker| {
                maker.sampler.sample_intersection([&solids[a], &solids[b]], maker.axis, estimate, maker.fill)
            })?,
            None => self.sweep(expression, solids)?,
        };
        self.with_triangles(image, solids)
    }

    /// Returns the image with the triangle of each sample, if triangles are requested. A sample of an estimate gets the triangle
    /// of an exact crossing beside it; exact images have triangles already.
    fn with_triangles(&mut self, image: Ldi, solids: &[LatticeSolid]) -> Result<Ldi, Error> {
        if self.triangles == Triangles::NotWanted || self.mode == Mode::Exact {
            return Ok(image);
        }
        // Only the even-odd rule keeps every crossing.
        let sample = |solid| self.timed(|maker| maker.sampler.sample_surface(solid, maker.axis, FillRule::EvenOdd));
        let exact = solids.iter().map(sample).collect::<Result<Vec<Ldi>, Error>>()?;
        let start = Instant::now();
        let image = image.with_triangles_of(&exact.iter().zip(first_triangles(solids)).collect::<Vec<_>>());
        self.seconds.operate += start.elapsed().as_secs_f64();
        image.map_err(Error::input)
    }

    /// Returns whether a device may sum the images along all axes together.
    pub fn sums_together(measurement: &Measurement, mode: Mode) -> bool {
        match measurement {
            Measurement::Boolean(Boolean { expression, .. }) => {
                masked(expression, mode).is_some() || Plan::new(expression, mode).diagram().is_some()
            }
            Measurement::Volume | Measurement::Sample => true,
        }
    }

    /// Returns all sums of the images of the only solid along some axes.
    pub fn solid_sums(&mut self, solid: &LatticeSolid, axes: &[Axis]) -> Result<Vec<SolidSums>, Error> {
        let sums = self.timed(|maker| maker.sampler.solid_sums_along(solid, axes, maker.mode, maker.fill))?;
        sums.iter().for_each(|sums| self.record_windings(0, sums.volume.windings()));
        Ok(sums)
    }

    /// Returns the volume sums of the [`image`](Self::image) along each of some axes.
    pub fn volume_sums(
        &mut self,
        measurement: &Measurement,
        solids: &[LatticeSolid],
        axes: &[Axis],
    ) -> Result<Vec<VolumeSums>, Error> {
        let mode = self.mode;
        let Measurement::Boolean(Boolean { expression, .. }) = measurement else {
            let sums = self.timed(|maker| maker.sampler.volume_sums_along(&solids[0], axes, mode, maker.fill))?;
            sums.iter().for_each(|sums| self.record_windings(0, sums.windings()));
            return Ok(sums);
        };
        if let Some(([a, b], estimate)) = masked(expression, mode) {
            let solids = [&solids[a], &solids[b]];
            return self.timed(|maker| maker.sampler.intersection_sums_along(solids, axes, estimate, maker.fill));
        }
        let plan = Plan::new(expression, mode);
        let sums = |maker: &Self, combination: Combination| {
            maker.sampler.combination_sums_along(combination, axes, maker.fill)
        };
        if let Some(sums) = self.combined(&plan, solids, sums)? {
            let result = |sums: Combined<VolumeSums>| self.recorded(&plan, sums);
            return Ok(sums.into_iter().map(result).collect());
        }
        let along = |&axis: &Axis| {
            self.axis = axis;
            let image = self.swept(&plan, solids)?;
            let start = Instant::now();
            let volume_sums = image.volume_sums();
            self.seconds.integrate += start.elapsed().as_secs_f64();
            Ok(volume_sums)
        };
        axes.iter().map(along).collect()
    }

    /// Returns the image of an expression.
    fn sweep(&mut self, expression: &Expression, solids: &[LatticeSolid]) -> Result<Ldi, Error> {
        let plan = Plan::new(expression, self.mode);
        if self.triangles == Triangles::NotWanted {
            let image = |maker: &Self, combination: Combination| {
                maker.sampler.sample_combination(combination, maker.axis, maker.fill)
            };
            if let Some(image) = self.combined(&plan, solids, image)? {
                return Ok(self.recorded(&plan, image));
            }
        }
        self.swept(&plan, solids)
    }

    /// Samples each solid once for each mode that a plan needs, and sweeps all images together.
    fn swept(&mut self, plan: &Plan, solids: &[LatticeSolid]) -> Result<Ldi, Error> {
        let leaves = plan.leaves().iter().map(|leaf| self.sample(&solids[leaf.input], leaf.input, leaf.mode));
        let leaves = leaves.collect::<Result<Vec<Ldi>, Error>>()?;
        let start = Instant::now();
        let first: Vec<u32> = first_triangles(solids).collect();
        let operand = |(image, leaf): (_, &Leaf)| Operand { image, first_triangle: first[leaf.input] };
        let image = plan.sweep(&leaves.iter().zip(plan.leaves()).map(operand).collect::<Vec<_>>())?;
        self.seconds.operate += start.elapsed().as_secs_f64();
        Ok(image)
    }

    /// Has the sampler combine the images of an expression, if it does and the expression has a diagram.
    fn combined<T>(
        &mut self,
        plan: &Plan,
        solids: &[LatticeSolid],
        make: impl FnOnce(&Self, Combination) -> Result<Option<T>, SampleError>,
    ) -> Result<Option<T>, Error> {
        let Some(diagram) = plan.diagram() else { return Ok(None) };
        let leaves: Vec<_> = plan.leaves().iter().map(|leaf| (&solids[leaf.input], leaf.mode)).collect();
        self.timed(|maker| make(maker, Combination::new(&leaves, &diagram)))
    }

    /// Returns a combined result, after it has recorded whether the fill rules agree in the images of its leaves.
    fn recorded<T>(&mut self, plan: &Plan, combined: Combined<T>) -> T {
        for (leaf, windings) in plan.leaves().iter().zip(combined.windings) {
            self.record_windings(leaf.input, windings);
        }
        combined.result
    }

    /// Runs the sampler and adds its time to the sampling time.
    fn timed<T>(&mut self, make: impl FnOnce(&Self) -> Result<T, SampleError>) -> Result<T, Error> {
        let start = Instant::now();
        let result = make(self)?;
        self.seconds.sample += start.elapsed().as_secs_f64();
        Ok(result)
    }

    /// Returns the image of one input.
    fn sample(&mut self, solid: &LatticeSolid, input: usize, mode: Mode) -> Result<Ldi, Error> {
        let image = self.timed(|maker| match (maker.triangles, mode) {
            (Triangles::Wanted, Mode::Exact) => maker.sampler.sample_surface(solid, maker.axis, maker.fill),
            _ => maker.sampler.sample(solid, maker.axis, mode, maker.fill),
        })?;
        self.record_windings(input, image.windings());
        Ok(image)
    }

    /// Records whether the fill rules agree in an image of one input.
    fn record_windings(&mut self, input: usize, windings: Option<Windings>) {
        if let Some(agree) = windings.map(Windings::fill_rules_agree) {
            self.rules_agree[input] = Some(agree && self.rules_agree[input] != Some(false));
        }
    }
}
