//! Resolution of `minkowski`, `offset`, `open` and `close`.

use ldi_ops::Error;
use ldi_ops::driver::job::{Input, Keep, MeshMethod, Operand, SumJob, SumOperation};
use ldi_ops::length::Length;
use ldi_ops::mesh::LengthUnit;

use super::{
    Command, DEFAULT_RESOLUTION, Invocation, Job, axes, can_be_refined, device, fill, image_target, invocation, lod,
    mode, report, spacing,
};
use crate::args::{BallArguments, MinkowskiArguments, OffsetArguments, SumArguments, SumPlacingArguments};

pub fn minkowski(arguments: MinkowskiArguments) -> Result<Invocation, Error> {
    let MinkowskiArguments { a, b, difference, reflect, placing, transform_b, rest } = arguments;
    let SumPlacingArguments { unit, transform_a } = placing;
    let operand = if reflect { Operand::Reflected } else { Operand::AsItIs };
    let operation = if difference { SumOperation::Difference(operand) } else { SumOperation::Sum(operand) };
    let inputs = [(a, transform_a), (b, transform_b)];
    let inputs = inputs.map(|(path, placement)| Input { name: None, path, placement });
    sum(operation, inputs.into(), unit, rest)
}

pub fn offset(arguments: OffsetArguments) -> Result<Invocation, Error> {
    let OffsetArguments { a, distance, placing: SumPlacingArguments { unit, transform_a }, rest } = arguments;
    if !distance.value.is_finite() || distance.value == 0.0 {
        return Err(Error::input(format!("--distance {distance} is not a finite length other than 0")));
    }
    let input = Input { name: None, path: a, placement: transform_a };
    sum(SumOperation::Offset(distance), vec![input], unit, rest)
}

pub fn ball(operation: fn(Length) -> SumOperation<Length>, arguments: BallArguments) -> Result<Invocation, Error> {
    let BallArguments { a, radius, placing: SumPlacingArguments { unit, transform_a }, rest } = arguments;
    if !(radius.value.is_finite() && radius.value > 0.0) {
        return Err(Error::input(format!("--radius {radius} is not a positive length")));
    }
    let input = Input { name: None, path: a, placement: transform_a };
    sum(operation(radius), vec![input], unit, rest)
}

fn sum(
    operation: SumOperation<Length>,
    inputs: Vec<Input>,
    unit: Option<LengthUnit>,
    rest: SumArguments,
) -> Result<Invocation, Error> {
    let SumArguments { sampling, method, certainty, writing, common } = rest;
    if let Some(refusal) = method.refusal() {
        return Err(Error::input(refusal));
    }
    let (backend, memory) = device(sampling.device)?;
    can_be_refined(&writing.finish, sampling.kind.mode)?;
    let target = image_target(writing, MeshMethod::Sampled, sampling.kind.axis)?;
    let report = report(&common)?;
    let job = SumJob {
        operation,
        unit,
        spacing: spacing(sampling.resolution, sampling.spacing, DEFAULT_RESOLUTION)?,
        lod: lod(sampling.kind.lod)?,
        axes: axes(sampling.kind.axis),
        mode: mode(sampling.kind.mode),
        fill: fill(sampling.fill.fill),
        backend,
        memory,
        hashes: report.has_json(),
        certainty: certainty.into(),
        keep: Keep::from(target.as_ref()),
    };
    Ok(invocation(Job::Sum(Command { job, inputs, target, report }), &common))
}
