//! Expressions over solids.

use std::collections::HashMap;
use std::ops::{BitAnd, BitOr, BitXor, Sub};
use std::sync::Arc;
use std::{mem, slice};

use crate::boolean::{BooleanOperation, Expression};
use crate::driver::backend::Backends;
use crate::driver::input::{self, InputRequirements, Sides, ready};
use crate::driver::job::{
    Boolean, Finish, Keep, MeasureJob, Measurement, Openness, Operand, SumJob, SumOperation, VolumeMethod, Wording,
};
use crate::driver::measure::measure;
use crate::driver::measured::Measured;
use crate::driver::sum::{SumBackend, sum};
use crate::driver::surface;
use crate::length::Length;
use crate::mesh::{ClosedMesh, Precision};
use crate::{Error, Estimate, Monitor, Sampled, Settings, Solid, Warning, excerpt};

/// An expression over solids: Booleans, Minkowski sums and differences, offsets, openings and closings. Cheap to clone.
///
/// [`sample`](Shape::sample) and [`volume`](Shape::volume) compute the expression. They evaluate nested Booleans in one pass over
/// all images. A sum or an offset within another operation is first contoured into a mesh, on the raster of the settings; a Boolean
/// within a sum or an offset becomes its exact mesh where it has one.
///
/// ```no_run
/// # fn main() -> Result<(), ldi_ops::Error> {
/// use ldi_ops::{Settings, Shape, Solid};
///
/// let [a, b, c] = [Solid::open("a.stl")?, Solid::open("b.stl")?, Solid::open("c.stl")?];
/// let part = (&a & &b) - &c;
/// let same = Shape::parse("a & b - c", [("a", &a), ("b", &b), ("c", &c)])?;
/// println!("{} {}", part.volume(&Settings::rays(512))?, same.volume(&Settings::rays(512))?);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Shape {
    node: Arc<Node>,
    /// The number of sums and offsets one within another.
    depth: u32,
}

/// The most sums and offsets one within another: each is evaluated within the call of the next.
const DEEPEST: u32 = 64;

#[derive(Debug)]
enum Node {
    Solid(input::Solid),
    /// An expression over operands by their indices.
    Boolean(Boolean, Vec<Shape>),
    /// An operation on one operand or on two.
    Sum(SumOperation<Length>, Vec<Shape>),
}

/// Drops the operands iteratively, as the recursion of a long chain of operations could overflow the stack.
impl Drop for Node {
    fn drop(&mut self) {
        let mut pending = self.take_operands();
        while let Some(shape) = pending.pop() {
            if let Some(mut node) = Arc::into_inner(shape.node) {
                pending.append(&mut node.take_operands());
            }
        }
    }
}

impl Node {
    fn take_operands(&mut self) -> Vec<Shape> {
        match self {
            Node::Solid(_) => Vec::new(),
            Node::Boolean(_, operands) | Node::Sum(_, operands) => mem::take(operands),
        }
    }
}

impl From<&Solid> for Shape {
    fn from(solid: &Solid) -> Shape {
        Shape::clone(solid)
    }
}

impl From<Solid> for Shape {
    fn from(solid: Solid) -> Shape {
        Shape::clone(&solid)
    }
}

impl From<&Shape> for Shape {
    fn from(shape: &Shape) -> Shape {
        shape.clone()
    }
}

fn deepest(shapes: &[Shape]) -> u32 {
    shapes.iter().map(|shape| shape.depth).max().unwrap_or(0)
}

impl Shape {
    pub(crate) fn of_solid(solid: input::Solid) -> Shape {
        Shape { node: Arc::new(Node::Solid(solid)), depth: 0 }
    }

    /// Reads an expression of named shapes: `a & (b | c) - d`, with `&`, `|`, `-`, `^` and parentheses.
    ///
    /// # Errors
    /// Fails for invalid expressions, with the place, and for names that are not operands.
    pub fn parse<'n, S: Into<Shape>>(
        text: &str,
        operands: impl IntoIterator<Item = (&'n str, S)>,
    ) -> Result<Shape, Error> {
        let (names, shapes): (Vec<&str>, Vec<Shape>) =
            operands.into_iter().map(|(name, shape)| (name, shape.into())).unzip();
        let expression = Expression::parse(text, &names).map_err(|error| match error.at() {
            Some(at) => Error::Usage(format!(
                "the expression, at character {}: {error}\n{}",
                at + 1,
                excerpt::pointing_at(text, at)
            )),
            None => Error::Usage(error.to_string()),
        })?;
        let boolean = Boolean { expression, wording: Wording::Typed(text.to_owned()) };
        Ok(Shape { depth: deepest(&shapes), node: Arc::new(Node::Boolean(boolean, shapes)) })
    }

    fn combined(operation: BooleanOperation, a: &Shape, b: Shape) -> Shape {
        let boolean =
            Boolean { expression: Expression::of_inputs(operation, 2), wording: Wording::Operation(operation) };
        Shape { depth: a.depth.max(b.depth), node: Arc::new(Node::Boolean(boolean, vec![a.clone(), b])) }
    }

    fn summed(operation: SumOperation<Length>, operands: Vec<Shape>) -> Shape {
        Shape { depth: 1 + deepest(&operands), node: Arc::new(Node::Sum(operation, operands)) }
    }

    /// Returns the intersection: the points in both shapes.
    pub fn intersect(&self, other: impl Into<Shape>) -> Shape {
        Shape::combined(BooleanOperation::Intersection, self, other.into())
    }

    /// Returns the union: the points in either shape.
    pub fn union(&self, other: impl Into<Shape>) -> Shape {
        Shape::combined(BooleanOperation::Union, self, other.into())
    }

    /// Returns the difference: the points in this shape and not in the other.
    pub fn difference(&self, other: impl Into<Shape>) -> Shape {
        Shape::combined(BooleanOperation::Difference, self, other.into())
    }

    /// Returns the symmetric difference: the points in exactly one of the shapes.
    pub fn xor(&self, other: impl Into<Shape>) -> Shape {
        Shape::combined(BooleanOperation::Xor, self, other.into())
    }

    /// Returns the Minkowski sum: all sums of a point of this shape and a point of the other.
    pub fn minkowski_sum(&self, other: impl Into<Shape>) -> Shape {
        Shape::summed(SumOperation::Sum(Operand::AsItIs), vec![self.clone(), other.into()])
    }

    /// Returns the Minkowski difference: all displacements that move the other shape into this one.
    pub fn minkowski_difference(&self, other: impl Into<Shape>) -> Shape {
        Shape::summed(SumOperation::Difference(Operand::AsItIs), vec![self.clone(), other.into()])
    }

    /// Returns the offset: all points within a distance of the shape. A negative distance removes all points within it of the
    /// outside. The distance is in the unit of the solid.
    pub fn offset(&self, distance: f64) -> Shape {
        Shape::summed(SumOperation::Offset(Length { value: distance, unit: None }), vec![self.clone()])
    }

    /// Returns the opening: the union of all balls of a radius inside the shape. It removes parts thinner than the ball.
    pub fn open(&self, radius: f64) -> Shape {
        Shape::summed(SumOperation::Opening(Length { value: radius, unit: None }), vec![self.clone()])
    }

    /// Returns the closing: all points outside all balls of a radius that avoid the shape. It fills gaps narrower than the ball.
    pub fn close(&self, radius: f64) -> Shape {
        Shape::summed(SumOperation::Closing(Length { value: radius, unit: None }), vec![self.clone()])
    }

    /// Samples the shape: makes its images.
    ///
    /// # Errors
    /// Solids that the fill rule or the operation does not allow, rasters that do not fit into memory, devices that are missing
    /// or fail, and operations that the caller stops.
    pub fn sample(&self, settings: &Settings) -> Result<Sampled, Error> {
        let measured = settings.run(|monitor| self.measured(settings, Keep::ImagesWithTriangles, false, monitor))?;
        Ok(Sampled::new(measured))
    }

    /// Returns the best available volume: exact where possible, else an estimate from images; [`Estimate::method`] states which.
    ///
    /// # Errors
    /// Those of [`sample`](Shape::sample).
    pub fn volume(&self, settings: &Settings) -> Result<Estimate, Error> {
        Ok(settings.run(|monitor| self.measured(settings, Keep::Sums, true, monitor))?.estimate())
    }

    /// Returns the shape as a solid: itself, the exact mesh of a Boolean where there is one, or a mesh of images.
    /// [`Solid::warnings`] has what was lost.
    ///
    /// # Errors
    /// Those of [`sample`](Shape::sample), meshes that are not manifolds, and shapes without a point.
    pub fn solid(&self, settings: &Settings) -> Result<Solid, Error> {
        let solid = settings.run(|monitor| {
            let mut warnings = Vec::new();
            let mut solid = self.to_solid(settings, monitor, &mut warnings)?;
            solid.warnings.extend(warnings);
            Ok(solid)
        });
        solid.map(Solid::from_inner)
    }

    /// Measures the shape; `is_volume` asks for the best volume instead of images.
    fn measured(&self, settings: &Settings, keep: Keep, is_volume: bool, monitor: &Monitor) -> Result<Measured, Error> {
        if self.depth > DEEPEST {
            return Err(Error::Usage(format!(
                "{} sums or offsets lie one within another (limit {DEEPEST}); make a solid of the inner ones first, by Shape::solid",
                self.depth
            )));
        }
        let method = match (is_volume, keep) {
            (true, _) | (_, Keep::Mesh(_)) => VolumeMethod::Best,
            _ => VolumeMethod::Estimate,
        };
        let (measurement, operands) = match &*self.node {
            Node::Solid(_) if is_volume => (Measurement::Volume, slice::from_ref(self)),
            Node::Solid(_) => (Measurement::Sample, slice::from_ref(self)),
            Node::Boolean(boolean, _) => {
                let (expression, operands) = self.flattened();
                let boolean = Boolean { expression, wording: boolean.wording.clone() };
                let job = settings.measure_job(Measurement::Boolean(boolean), method, keep)?;
                return booleans(&job, settings, &operands, monitor);
            }
            Node::Sum(operation, operands) => {
                check_length(*operation)?;
                return sums(&settings.sum_job(*operation, keep)?, settings, operands, monitor);
            }
        };
        booleans(&settings.measure_job(measurement, method, keep)?, settings, operands, monitor)
    }

    /// Returns the expression of a Boolean, and its operands.
    fn boolean(&self) -> Option<(&Expression, &[Shape])> {
        match &*self.node {
            Node::Boolean(boolean, operands) => Some((&boolean.expression, operands)),
            Node::Solid(_) | Node::Sum(..) => None,
        }
    }

    /// Returns nested Booleans as one expression, and its other operands, each once.
    fn flattened(&self) -> (Expression, Vec<Shape>) {
        let mut indices = HashMap::new();
        let mut operands = Vec::new();
        let mut pending = vec![self];
        while let Some(shape) = pending.pop() {
            match shape.boolean() {
                Some((_, inputs)) => pending.extend(inputs.iter().rev()),
                None => drop(indices.entry(Arc::as_ptr(&shape.node)).or_insert_with(|| {
                    operands.push(shape.clone());
                    operands.len() - 1
                })),
            }
        }
        (Expression::of_tree(self, Shape::boolean, |shape| indices[&Arc::as_ptr(&shape.node)]), operands)
    }

    /// Returns a solid: the shape itself, or its mesh, which is exact for Booleans of solids.
    fn to_solid(
        &self,
        settings: &Settings,
        monitor: &Monitor,
        warnings: &mut Vec<Warning>,
    ) -> Result<input::Solid, Error> {
        if let Node::Solid(solid) = &*self.node {
            return Ok(solid.clone());
        }
        if settings.needs_bounds() {
            return Err(Error::Usage(
                "no bounds can be certified for a sum or an offset within another operation, as its mesh is approximate".to_owned(),
            ));
        }
        let whole = settings.clone().axes(crate::Axes::All).mode(crate::Mode::Exact);
        // Its own error should not come on top.
        let finish = if let Node::Sum(..) = &*self.node { Finish::of_operand() } else { Finish::full() };
        let precision = Precision::Double;
        let mut measured = self.measured(&whole, Keep::Mesh(finish.request(precision)), false, monitor)?;
        let exact = measured.exact_mesh.take();
        let is_exact = exact.is_some();
        let (mesh, report) = match exact {
            Some(exact) => exact.finished(finish, monitor)?,
            None => surface::mesh(&measured.imaged(), finish, precision, monitor)?,
        };
        warnings.extend(measured.warnings);
        warnings.extend(surface::warnings(&report, true));
        if mesh.triangles.is_empty() {
            return Err(Error::input(match is_exact {
                true => "the shape, or an operand of it, is empty",
                false => "the shape, or an operand of it, is empty on this raster; raise the resolution",
            }));
        }
        let closed = ClosedMesh::check(mesh).map_err(Error::input)?;
        Ok(input::Solid { unit: measured.unit, ..input::Solid::from_closed(closed, "operand") })
    }
}

/// Runs a Boolean, or measures one solid.
fn booleans(job: &MeasureJob, settings: &Settings, operands: &[Shape], monitor: &Monitor) -> Result<Measured, Error> {
    let (solids, warnings) = solids_of(operands, settings, Sides::NotNeeded, monitor)?;
    let backends = Backends::open(settings.device())?;
    finished(measure(job, solids, &backends, monitor)?, warnings)
}

/// Runs a sum, a difference or an offset.
fn sums(job: &SumJob, settings: &Settings, operands: &[Shape], monitor: &Monitor) -> Result<Measured, Error> {
    let (solids, warnings) = solids_of(operands, settings, Sides::Needed, monitor)?;
    finished(sum(job, solids, &SumBackend::open(settings.device())?, monitor)?, warnings)
}

fn solids_of(
    operands: &[Shape],
    settings: &Settings,
    sides: Sides,
    monitor: &Monitor,
) -> Result<(Vec<input::Solid>, Vec<Warning>), Error> {
    let mut warnings = Vec::new();
    let solids = operands.iter().map(|operand| operand.to_solid(settings, monitor, &mut warnings));
    let mut solids = solids.collect::<Result<Vec<_>, Error>>()?;
    let (openness, fill) = (Openness::Refused, settings.fill_rule());
    warnings.extend(ready(&mut solids, InputRequirements { unit: None, openness, sides, fill, hashes: false })?);
    Ok((solids, warnings))
}

fn finished(mut measured: Measured, mut warnings: Vec<Warning>) -> Result<Measured, Error> {
    warnings.append(&mut measured.warnings);
    measured.warnings = warnings;
    measured.add_warnings();
    Ok(measured)
}

fn check_length(operation: SumOperation<Length>) -> Result<(), Error> {
    let (length, is_radius) = match operation {
        SumOperation::Offset(length) => (length.value, false),
        SumOperation::Opening(length) | SumOperation::Closing(length) => (length.value, true),
        SumOperation::Sum(_) | SumOperation::Difference(_) => return Ok(()),
    };
    match length.is_finite() && length != 0.0 && (length > 0.0 || !is_radius) {
        true => Ok(()),
        false => {
            Err(Error::Usage(format!("{length} is not a valid distance or radius of an offset, opening or closing")))
        }
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $operation:ident, [$(($left:ty, $right:ty)),* $(,)?]) => {$(
        impl $trait<$right> for $left {
            type Output = Shape;

            fn $method(self, other: $right) -> Shape {
                self.$operation(other)
            }
        }
    )*};
}

macro_rules! operators {
    ($($trait:ident, $method:ident, $operation:ident;)*) => {$(
        operator!($trait, $method, $operation, [
            (&Solid, &Solid), (&Solid, &Shape), (&Solid, Shape),
            (&Shape, &Solid), (&Shape, &Shape), (&Shape, Shape),
            (Shape, &Solid), (Shape, &Shape), (Shape, Shape),
        ]);
    )*};
}

operators! {
    BitAnd, bitand, intersect;
    BitOr, bitor, union;
    BitXor, bitxor, xor;
    Sub, sub, difference;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::meshes::tetrahedron;

    #[test]
    fn chains_of_many_operands_are_flattened_and_dropped() {
        const SOLIDS: usize = 1000;
        let solid = input::Solid::from_closed(ClosedMesh::check(tetrahedron()).unwrap(), "tetrahedron");
        let solids: Vec<Shape> = (0..SOLIDS).map(|_| Shape::of_solid(solid.clone())).collect();
        let operands = (0..200_000).map(|i| &solids[i % SOLIDS]);
        let left = operands.clone().fold(solids[0].clone(), |chain, solid| chain | solid);
        let right = operands.fold(solids[0].clone(), |chain, solid| solid | chain);
        let first = left.flattened().1;
        assert!(first.iter().zip(&solids).all(|(operand, solid)| Arc::ptr_eq(&operand.node, &solid.node)));
        for chain in [left, right] {
            let (expression, operands) = chain.flattened();
            assert_eq!((operands.len(), expression.inputs()), (SOLIDS, SOLIDS));
            assert!(expression.holds(|input| input == 7) && !expression.holds(|_| false));
        }
    }

    #[test]
    fn chains_of_many_offsets_are_refused_and_dropped() {
        let solid = input::Solid::from_closed(ClosedMesh::check(tetrahedron()).unwrap(), "tetrahedron");
        let chain = (0..200_000).fold(Shape::of_solid(solid), |shape, _| shape.offset(0.1));
        assert!(matches!(chain.volume(&Settings::rays(4)), Err(Error::Usage(_))));
        drop(chain);
    }
}
