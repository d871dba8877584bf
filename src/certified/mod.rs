//! Certified volumes of expressions: intervals that are proved to contain the volume.
//!
//! The bounds hold for the solids of the meshes as they are given, in `f64`; nothing is snapped to a lattice.
//!
//! # The argument
//! 1. **Cells.** The box that contains the result is halved again and again, each cell across its longest side. The cells that
//!    are not halved fill the box and have no inner points in common, so that the bounds of their volumes add up to bounds of
//!    the whole.
//! 2. **Winding numbers.** A closed, consistently oriented shell has a winding number w at every point off its surface. Along
//!    a ray to +x it starts with 0 and grows by 1 at each triangle whose outer normal points to −x, and falls by 1 at the others.
//!    So its integral over a cell is a sum over the triangles in the cell and in the column below it, each triangle on its own
//!    (`flux`): no order, no ties, no topology. Every term depends continuously on the coordinates, and has a bound of its
//!    rounding error that is proved there.
//! 3. **Cells without surface.** A shell has one winding number in a cell whose inner points none of its triangles meets. A
//!    triangle is left out only if a plane parts it from the cell by more than the rounding error (`place`). The winding number
//!    is the integral divided by the volume, a whole number, and the error of the quotient is below ¼. So it is known exactly.
//! 4. **Divided cells.** [`prove_simple`](crate::mesh::prove_simple) proves with exact signs, of an operand or of each of its
//!    shells, that w takes no values but 0 and one of 1 and −1. The volume of the inside of such a shell in a cell is then the
//!    integral of w, up to its sign. An operand with other shells in the cell has a volume between 0 and that of the cell.
//! 5. **The expression.** A point is inside an operand by the fill rule, from the sum of the winding numbers of its shells. So
//!    in a cell the result is a Boolean function of the few sets that divide it, and its volume lies between bounds after
//!    Fréchet (`frechet`). Where at most one set divides the cell, the bounds differ by rounding alone.
//! 6. **Sums.** Bounds of cells are rounded outwards to multiples of 2⁻⁸⁰ and added as integers.
//!
//! The cells that two surfaces divide lie along curves: at a side h there are of the order of 1/h of them, with a volume of h³
//! each. So the width of the interval falls with h². It falls with h only where surfaces coincide in an area, and where the
//! winding numbers of an operand are not proved.
//!
//! # Refinement
//! A pass halves the cells whose uncertainty is above a threshold, down to a finest side. To reach a tolerance, passes with lower
//! thresholds follow one another: the largest uncertainties are halved first. A pass goes depth first and keeps the triangles
//! of the cells on its way alone, which bounds the memory. A pass with too many cells gives way to a coarser one, so that the
//! result depends neither on time nor on threads.

mod cell;
mod flux;
mod frechet;
mod half_space;
mod node;
mod offset;
mod place;
mod refine;
mod shells;
mod state;
#[cfg(test)]
mod tests;

use glam::DVec3;

use crate::boolean::Expression;
use crate::mesh::{Aabb, ClosedMesh};
use crate::sampler::FillRule;

use self::cell::Cell;
use self::node::Node;
use self::offset::{Offset, OffsetPass};
use self::refine::{Pass, Rule, Totals};
use self::shells::Shells;
use self::state::Scene;

/// The reason why a volume has no certified bounds.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CertifiedError {
    /// An operand has no winding numbers.
    #[error("the triangles of operand {operand} are not consistently oriented")]
    NotOriented {
        /// The index of the operand.
        operand: usize,
    },
    /// The winding numbers of a solid are not proved to be 0 and 1.
    #[error("triangles of the solid may meet elsewhere than in shared corners and sides")]
    NotSimple,
    /// The triangles of all operands cannot be numbered in 31 bits.
    #[error("all operands together have more than 2,147,483,647 triangles")]
    TooManyTriangles,
}

/// How far bounds are refined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refine {
    /// Until no cell is larger than a pitch.
    ToPitch(f64),
    /// Until the width is this share of the upper bound.
    ToTolerance(f64),
}

/// An interval that is proved to contain a volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CertifiedVolume {
    /// The lower bound, in cubic units of the operands.
    pub lower: f64,
    /// The upper bound.
    pub upper: f64,
    /// The longest side of the finest cells.
    pub finest: f64,
    /// The number of cells of the last pass.
    pub cells: u64,
    /// True if the requested pitch or tolerance was reached within the budget of cells.
    pub reached: bool,
}

/// Share of the longest side of the box that is the finest side for a tolerance.
const FINEST: f64 = 1.0 / (1u64 << 20) as f64;

/// Ratio of the thresholds of two passes.
const SHARPER: f64 = 1.0 / 8.0;

/// Returns certified bounds of the volume of an expression over closed meshes.
///
/// # Errors
/// Operands that are not consistently oriented.
///
/// # Panics
/// If the expression has more inputs than there are operands.
pub fn certified_volume(
    expression: &Expression,
    operands: &[&ClosedMesh],
    fill: FillRule,
    refine: Refine,
) -> Result<CertifiedVolume, CertifiedError> {
    if let Some(operand) = operands.iter().position(|operand| !operand.oriented()) {
        return Err(CertifiedError::NotOriented { operand });
    }
    let [min, max] = expression.corners(|i| {
        let Aabb { min, max } = operands[i].bounds();
        [min, max]
    });
    let longest = (max - min).max_element();
    if (max - min).min_element() <= 0.0 {
        return Ok(CertifiedVolume { lower: 0.0, upper: 0.0, finest: 0.0, cells: 0, reached: true });
    }
    let scale = scale(longest);
    let scene = Scene { shells: Shells::of(operands, scale)?, expression, fill };
    let root = Node::root(&scene.shells, Cell { min: min * scale, max: max * scale });
    let (totals, finest, cells, reached) = match refine {
        Refine::ToPitch(pitch) => to_pitch(&scene, &root, pitch * scale),
        Refine::ToTolerance(share) => to_tolerance(&scene, &root, share),
    };
    Ok(CertifiedVolume::of(&totals, scale, (finest, cells, reached)))
}

/// Returns certified bounds of the volume of the offset of a solid by a ball: outwards, or inwards for a negative distance.
///
/// The argument is in the module `offset`. The width falls with the square of the pitch where that is below the distance.
///
/// # Errors
/// Solids whose winding numbers are not proved to be 0 and 1.
pub fn certified_offset(solid: &ClosedMesh, distance: f64, pitch: f64) -> Result<CertifiedVolume, CertifiedError> {
    let Aabb { min, max } = solid.bounds();
    // Outwards, with more than the rounding of the sum.
    let grown = DVec3::splat(distance.max(0.0) * (1.0 + 1e-9)) + (max - min).max_element() * 1e-9;
    let (min, max) = (min - grown, max + grown);
    let scale = scale((max - min).max_element());
    let shells = Shells::of(&[solid], scale)?;
    if !shells.are_simple() {
        return Err(CertifiedError::NotSimple);
    }
    let root = Node::root(&shells, Cell { min: min * scale, max: max * scale });
    let near: Vec<u32> = (0..shells.triangles() as u32).collect();
    let offset = Offset { shells, radius: distance.abs() * scale, is_outwards: distance > 0.0 };
    let mut finest = pitch * scale;
    loop {
        let pass = OffsetPass::new(&offset, finest);
        if let Some(totals) = pass.sum(&root, &near) {
            return Ok(CertifiedVolume::of(&totals, scale, (finest, pass.visited(), finest == pitch * scale)));
        }
        finest *= 2.0;
    }
}

/// Returns a power of two that brings a length near 1, so that products are exact or far from the limits of f64.
fn scale(longest: f64) -> f64 {
    (-longest.log2().floor()).exp2()
}

impl CertifiedVolume {
    fn of(totals: &Totals, scale: f64, (finest, cells, reached): (f64, u64, bool)) -> CertifiedVolume {
        let unit = 1.0 / (scale * scale * scale);
        let [lower, upper] = totals.bounds().map(|bound| bound * unit);
        CertifiedVolume { lower, upper, finest: finest / scale, cells, reached }
    }
}

/// Refines to a pitch, or to the least power of two times it that keeps the budget.
fn to_pitch(scene: &Scene, root: &Node, pitch: f64) -> (Totals, f64, u64, bool) {
    let mut finest = pitch;
    loop {
        let pass = Pass::new(scene, Rule { finest, negligible: 0.0 });
        if let Some(totals) = pass.sum(root) {
            return (totals, finest, pass.visited(), finest == pitch);
        }
        finest *= 2.0;
    }
}

/// Refines until the width is a share of the upper bound.
fn to_tolerance(scene: &Scene, root: &Node, share: f64) -> (Totals, f64, u64, bool) {
    let finest = FINEST * root.cell.longest_side();
    let mut negligible = root.cell.volume().0;
    let mut best = None;
    loop {
        let pass = Pass::new(scene, Rule { finest, negligible });
        let Some(totals) = pass.sum(root) else {
            return best.expect("the first pass has one cell");
        };
        let [lower, upper] = totals.bounds();
        let reached = upper - lower <= share * upper;
        best = Some((totals, finest, pass.visited(), reached));
        // What cells above the threshold do not account for, lies in cells that are not halved: rounding, or the finest side.
        let is_final = pass.visited() as f64 * negligible < 0.01 * (upper - lower);
        if reached || is_final {
            return best.expect("it was set");
        }
        negligible *= SHARPER;
    }
}
