//! Diffusion through a phase from end to end.

use crate::parallel::*;

use super::TortuosityError;
use super::aggregate::Cells;
use super::cycle::Hierarchy;
use super::geodesic::plane;
use super::krylov;
use super::operator::{Fine, Operator};
use super::spanning::{around, spanning};
use super::sums::sum;
use crate::bits::ones;
use crate::grid::Axis;
use crate::metrics::{BoundaryCondition, NodeSet};

/// Errors from the least that f64 can reach to the greatest that leaves a few digits.
const TOLERANCES: [f64; 2] = [1e-12, 1e-3];

/// Factor by which the error may exceed its estimate before the fluxes through the two ends are found to differ too much.
const DOUBT: f64 = 10.0;

/// The position at which the concentrations at the two ends are given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EndCondition {
    /// The faces of the box, half a pitch beyond the outermost nodes, whose distance is the number of nodes.
    Faces,
    /// The outermost nodes themselves, which are one pitch less apart; PoreSpy does the same.
    Nodes,
}

/// The result of diffusion through a phase from end to end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffusion {
    /// τ = φ D₀ / D_eff, at least 1 but for `error`, with the share φ of the conducting pieces: [`Diffusion::spanning_share`].
    pub tortuosity: f64,
    /// D₀ / D_eff.
    pub formation_factor: f64,
    /// D_eff / D₀.
    pub effective_diffusivity: f64,
    /// The share of the box that is of the phase, whether it conducts or not.
    pub share: f64,
    /// φ: the share of the box in pieces of the phase that reach from end to end.
    pub spanning_share: f64,
    /// Iterations of conjugate gradients.
    pub iterations: usize,
    /// The estimated excess of the diffusivity, as a share of it.
    pub error: f64,
}

/// Computes the diffusive tortuosity of a phase in a box that is the whole raster, along `axis`, with the related quantities;
/// pure numbers. `None` where no piece of the phase reaches from end to end (the tortuosity is infinite).
///
/// With [`BoundaryCondition::Periodic`] the flux that leaves at a lateral face enters at the opposite one; otherwise those
/// faces are impermeable. `tolerance` is the accepted error of the diffusivity, as a share of it, from 1e-12 to 1e-3. The diffusivity
/// is too large by the energy of the error of the concentrations (Dirichlet's principle), which is estimated from the last steps, not
/// bounded. `progress` is called with the share of the work that is done, from 0 to 1, by one thread at a time.
///
/// Needs about 130 bytes for each conducting node, and 5 for each of the raster. The result does not depend on the number of
/// threads.
///
/// # Errors
/// No node along the axis, or one where the ends are nodes; a tolerance out of its range; no convergence; fluxes in and out
/// that differ by more than the error allows.
///
/// # Panics
/// If there are 2³² nodes or more, or more than 65,535 along an axis.
pub fn diffusive(
    nodes: &NodeSet,
    axis: Axis,
    edges: BoundaryCondition,
    condition: EndCondition,
    tolerance: f64,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Option<Diffusion>, TortuosityError> {
    let side = nodes.size()[axis.depth()];
    let least = if condition == EndCondition::Faces { 1 } else { 2 };
    if side < least {
        return Err(TortuosityError::TooThin { axis, nodes: side, least });
    }
    if !(TOLERANCES[0]..=TOLERANCES[1]).contains(&tolerance) {
        return Err(TortuosityError::Tolerance { tolerance, least: TOLERANCES[0], most: TOLERANCES[1] });
    }
    let spanning = spanning(nodes, axis, edges);
    if spanning.is_empty() {
        return Ok(None);
    }
    // In a worker thread, so that each of the many loops need not be handed over to one.
    let flow = rayon::scope(|_| Flow::solve(&spanning, axis, edges, condition, tolerance, progress))?;
    let area = nodes.volume() / side;
    let distance = if condition == EndCondition::Faces { side } else { side - 1 };
    let effective = flow.flux * distance as f64 / area as f64;
    let share_of = |set: &NodeSet| set.count() as f64 / nodes.volume() as f64;
    let spanning_share = share_of(&spanning);
    Ok(Some(Diffusion {
        tortuosity: spanning_share / effective,
        formation_factor: 1.0 / effective,
        effective_diffusivity: effective,
        share: share_of(nodes),
        spanning_share,
        iterations: flow.iterations,
        error: flow.error,
    }))
}

/// The flux for a concentration difference of 1 between the ends.
struct Flow {
    flux: f64,
    iterations: usize,
    error: f64,
}

impl Flow {
    fn solve(
        spanning: &NodeSet,
        axis: Axis,
        edges: BoundaryCondition,
        condition: EndCondition,
        tolerance: f64,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Flow, TortuosityError> {
        let System { operator, cells, mut x, direct } = System::new(spanning, axis, edges, condition);
        let right: Vec<f64> = operator.ends.iter().map(|&[near, _]| f64::from(near)).collect();
        let mut hierarchy = Hierarchy::new(&operator, cells);
        let whole = direct + sum(x.len(), |i| right[i]);
        let solved = krylov::solve(&operator, &mut hierarchy, (&right, whole), &mut x, tolerance, progress);
        let krylov::Solved { iterations, error } = solved;
        if error.is_nan() || error > tolerance {
            return Err(TortuosityError::NotConverged { iterations, error, tolerance });
        }
        let into = direct + sum(x.len(), |i| right[i] * (1.0 - x[i]));
        let out = direct + sum(x.len(), |i| f64::from(operator.ends[i][1]) * x[i]);
        // With the work of the residuals the flux is stationary at the solution: what is left is of the second order.
        let flux = into - sum(x.len(), |i| (right[i] - operator.row(i, &x)) * x[i]);
        // The fluxes in and out differ by the energy product of the error and 1, at most the product of their norms.
        let of_one = sum(x.len(), |i| f64::from(operator.end(i)));
        let limit = (DOUBT * tolerance * of_one / flux).sqrt();
        if (into - out).abs() > limit * flux {
            return Err(TortuosityError::Flux { into, out, limit });
        }
        progress(1.0);
        Ok(Flow { flux, iterations, error })
    }
}

/// The linear system of the unknowns.
struct System {
    operator: Fine,
    cells: Cells,
    /// The initial guess: falling linearly from end to end, as in straight pores.
    x: Vec<f64>,
    /// The flux from end to end that passes no unknown.
    direct: f64,
}

/// The number of a node that is not an unknown.
const NONE: u32 = u32::MAX;

impl System {
    /// Sets up the system of nodes that all belong to pieces which reach from end to end.
    fn new(spanning: &NodeSet, axis: Axis, edges: BoundaryCondition, condition: EndCondition) -> System {
        let size = spanning.size();
        assert!(size.iter().all(|&side| side <= usize::from(u16::MAX)), "{size:?} nodes; at most 65,535 along an axis");
        let (depth, side) = (axis.depth(), size[axis.depth()]);
        let is_unknown = |at: usize| condition == EndCondition::Faces || (at > 0 && at + 1 < side);
        let (numbers, places) = numbered(spanning, |node| is_unknown(node[depth]));
        let number = |[x, y, z]: [usize; 3]| numbers[(z * size[1] + y) * size[0] + x];
        let rows = places.par_iter().enumerate().with_min_len(1 << 12).map(|(own, place)| {
            let node = place.map(usize::from);
            let beside = around(size, axis, edges, node);
            let neighbours = beside.map(|other| other.map(number).filter(|&n| n != NONE).unwrap_or(own as u32));
            let end = |beyond: Option<[usize; 3]>| match condition {
                EndCondition::Faces => {
                    if beyond.is_none() {
                        2.0
                    } else {
                        0.0
                    }
                }
                EndCondition::Nodes => {
                    beyond.is_some_and(|other| !is_unknown(other[depth]) && spanning.contains(other)) as u8 as f32
                }
            };
            (neighbours, [end(beside[2 * depth]), end(beside[2 * depth + 1])])
        });
        let (neighbours, ends) = rows.unzip();
        let fall = |at: u16| match condition {
            EndCondition::Faces => 1.0 - (f64::from(at) + 0.5) / side as f64,
            EndCondition::Nodes => 1.0 - f64::from(at) / (side - 1) as f64,
        };
        let x = places.iter().map(|place| fall(place[depth])).collect();
        // Two planes of nodes at given concentrations face each other.
        let direct = if condition == EndCondition::Nodes && side == 2 {
            let pairs = plane(size, axis, 0).filter(|&node| {
                let mut other = node;
                other[depth] = 1;
                spanning.contains(node) && spanning.contains(other)
            });
            pairs.count() as f64
        } else {
            0.0
        };
        let operator = Fine::new(neighbours, ends);
        System { operator, cells: Cells { size: size.map(|side| side as u32), of: places }, x, direct }
    }
}

/// Returns the numbers of unknowns by node, in the order of nodes, and their positions.
fn numbered(nodes: &NodeSet, is_unknown: impl Fn([usize; 3]) -> bool) -> (Vec<u32>, Vec<[u16; 3]>) {
    let [columns, rows, planes] = nodes.size();
    let mut numbers = vec![NONE; nodes.volume()];
    let mut places = Vec::with_capacity(nodes.count() as usize);
    for (z, y) in (0..planes).flat_map(|z| (0..rows).map(move |y| (z, y))) {
        let row = &mut numbers[(z * rows + y) * columns..][..columns];
        for x in ones(nodes.row(y, z)).filter(|&x| is_unknown([x, y, z])) {
            row[x] = places.len() as u32;
            places.push([x, y, z].map(|c| c as u16));
        }
    }
    (numbers, places)
}
