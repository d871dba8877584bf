//! Diffusion through a phase from end to end.

use crate::parallel::*;

use super::TortuosityError;
use super::aggregate::Cells;
use super::cycle::Hierarchy;
use super::geodesic::plane;
use super::krylov;
use super::operator::Fine;
use super::spanning::{around, spanning};
use super::sums::sum;
use crate::grid::Axis;
use crate::metrics::{BoundaryCondition, NodeSet};

/// Residuals from the least that f64 can reach to the greatest that leaves a few digits.
const TOLERANCES: [f64; 2] = [1e-12, 1e-3];

/// Most iterations, far more than needed: 30 suffice in practice.
const ITERATIONS: usize = 1000;

/// Greatest difference between the fluxes through the two ends, relative to the flux that enters.
const FLUX: f64 = 1e-4;

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
    /// τ = φ D₀ / D_eff, at least 1, with the share φ of the conducting pieces: [`Diffusion::spanning_share`].
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
    /// The norm of the residual over that of the right-hand side.
    pub residual: f64,
}

/// Computes the diffusive tortuosity of a phase in a box that is the whole raster, along `axis`, with the related quantities;
/// pure numbers. `None` where no piece of the phase reaches from end to end (the tortuosity is infinite).
///
/// With [`BoundaryCondition::Periodic`] the flux that leaves at a lateral face enters at the opposite one; otherwise those
/// faces are impermeable. `tolerance` is the accepted residual, over the right-hand side: 1e-8 gives fluxes to about as many
/// digits, from 1e-12 to 1e-3 are possible. `progress` is called with the share of the work that is done, from 0 to 1, by one
/// thread at a time.
///
/// Needs about 130 bytes for each conducting node, and 5 for each of the raster. The result does not depend on the number of
/// threads.
///
/// # Errors
/// No node along the axis, or one where the ends are nodes; a tolerance out of its range; no convergence; fluxes in and out
/// that differ by more than 1e-4.
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
        residual: flow.residual,
    }))
}

/// The flux for a concentration difference of 1 between the ends.
struct Flow {
    flux: f64,
    iterations: usize,
    residual: f64,
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
        let solved = krylov::solve(&operator, &mut hierarchy, &right, &mut x, tolerance, ITERATIONS, progress);
        let krylov::Solved { iterations, residual } = solved;
        if residual > tolerance {
            return Err(TortuosityError::NotConverged { iterations, residual, tolerance });
        }
        let into = direct + sum(x.len(), |i| right[i] * (1.0 - x[i]));
        let out = direct + sum(x.len(), |i| f64::from(operator.ends[i][1]) * x[i]);
        if (into - out).abs() > FLUX * into {
            return Err(TortuosityError::Flux { into, out, limit: FLUX });
        }
        progress(1.0);
        Ok(Flow { flux: 0.5 * (into + out), iterations, residual })
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
    let size = nodes.size();
    let mut numbers = vec![NONE; nodes.volume()];
    let mut places = Vec::with_capacity(nodes.count() as usize);
    for (index, number) in numbers.iter_mut().enumerate() {
        let node = [index % size[0], index / size[0] % size[1], index / (size[0] * size[1])];
        if nodes.contains(node) && is_unknown(node) {
            *number = places.len() as u32;
            places.push(node.map(|c| c as u16));
        }
    }
    (numbers, places)
}
