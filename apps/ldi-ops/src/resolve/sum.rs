//! `minkowski`, `offset`, `open` and `close`, resolved.

use ldi_ops::grid::Axis;
use ldi_ops::mesh::LengthUnit;
use ldi_ops::sampler::{Fill, Mode};

use super::{
    Backend, ImageTarget, Input, Invocation, Job, Report, Spacing, axes, backend, fill, image_target, invocation, lod,
    mode, report, spacing,
};
use crate::args::{BallArguments, MemorySize, MinkowskiArguments, OffsetArguments, SumArguments, SumPlacingArguments};
use crate::exit::Failure;
use crate::length::Length;

/// A sum to be made.
#[derive(Debug)]
pub struct SumJob {
    pub operation: SumOperation<Length>,
    /// Two for sums and differences, one for all else.
    pub inputs: Vec<Input>,
    pub unit: Option<LengthUnit>,
    pub spacing: Spacing<Length>,
    pub lod: u32,
    /// Of the images that are measured and written.
    pub axes: Vec<Axis>,
    pub mode: Mode,
    pub fill: Fill,
    /// Where crossings are found and gaps settled.
    pub backend: Backend,
    /// The bytes that the process may hold, where they were given.
    pub memory: Option<u64>,
    /// Where the images go.
    pub images: Option<ImageTarget>,
    pub report: Report,
}

/// What is made of the inputs: with lengths as they are typed, or in the unit of the inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SumOperation<L = f64> {
    /// A ⊕ B.
    Sum(Operand),
    /// A ⊖ B.
    Difference(Operand),
    /// A grown by a distance, or shrunk by one below zero.
    Offset(L),
    /// Shrunk by a radius and grown again.
    Opening(L),
    /// Grown by a radius and shrunk again.
    Closing(L),
}

/// How the second input goes into a sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operand {
    AsItIs,
    /// Through the origin.
    Reflected,
}

impl SumOperation<Length> {
    /// Returns the operation with its length in a unit.
    pub fn in_unit(self, unit: Option<LengthUnit>) -> Result<SumOperation, Failure> {
        Ok(match self {
            SumOperation::Sum(operand) => SumOperation::Sum(operand),
            SumOperation::Difference(operand) => SumOperation::Difference(operand),
            SumOperation::Offset(distance) => SumOperation::Offset(distance.in_unit(unit, "--distance")?),
            SumOperation::Opening(radius) => SumOperation::Opening(radius.in_unit(unit, "--radius")?),
            SumOperation::Closing(radius) => SumOperation::Closing(radius.in_unit(unit, "--radius")?),
        })
    }
}

impl<L> SumOperation<L> {
    /// The name of the command.
    pub fn command(&self) -> &'static str {
        match self {
            SumOperation::Sum(_) | SumOperation::Difference(_) => "minkowski",
            SumOperation::Offset(_) => "offset",
            SumOperation::Opening(_) => "open",
            SumOperation::Closing(_) => "close",
        }
    }
}

pub fn minkowski(arguments: MinkowskiArguments) -> Result<Invocation, Failure> {
    let MinkowskiArguments { a, b, difference, reflect, placing, transform_b, rest } = arguments;
    let SumPlacingArguments { unit, transform_a } = placing;
    let operand = if reflect { Operand::Reflected } else { Operand::AsItIs };
    let operation = if difference { SumOperation::Difference(operand) } else { SumOperation::Sum(operand) };
    let inputs = [(a, transform_a), (b, transform_b)];
    let inputs = inputs.map(|(path, placement)| Input { name: None, path, placement });
    sum(operation, inputs.into(), unit, rest)
}

pub fn offset(arguments: OffsetArguments) -> Result<Invocation, Failure> {
    let OffsetArguments { a, distance, placing: SumPlacingArguments { unit, transform_a }, rest } = arguments;
    if !distance.value.is_finite() || distance.value == 0.0 {
        return Err(Failure::input(format!("--distance {distance} is no length to move a surface by")));
    }
    let input = Input { name: None, path: a, placement: transform_a };
    sum(SumOperation::Offset(distance), vec![input], unit, rest)
}

pub fn ball(operation: fn(Length) -> SumOperation<Length>, arguments: BallArguments) -> Result<Invocation, Failure> {
    let BallArguments { a, radius, placing: SumPlacingArguments { unit, transform_a }, rest } = arguments;
    if !(radius.value.is_finite() && radius.value > 0.0) {
        return Err(Failure::input(format!("--radius {radius} is not a positive length")));
    }
    let input = Input { name: None, path: a, placement: transform_a };
    sum(operation(radius), vec![input], unit, rest)
}

fn sum(
    operation: SumOperation<Length>,
    inputs: Vec<Input>,
    unit: Option<LengthUnit>,
    rest: SumArguments,
) -> Result<Invocation, Failure> {
    let SumArguments { sampling, writing, common } = rest;
    let backend = backend(sampling.backend, sampling.adapter)?;
    let images = image_target(writing, sampling.axis)?;
    let report = report(&common)?;
    let job = SumJob {
        operation,
        inputs,
        unit,
        spacing: spacing(sampling.resolution, sampling.pitch, None)?,
        lod: lod(sampling.lod)?,
        axes: axes(sampling.axis),
        mode: mode(sampling.mode),
        fill: fill(sampling.fill),
        backend,
        memory: sampling.memory.map(|MemorySize(bytes)| bytes),
        images,
        report,
    };
    Ok(invocation(Job::Sum(job), &common))
}
