//! Tortuosity: the detour of paths through a phase, and the slowing of diffusion.
//!
//! Equations are solved on a raster of their own, as their cost grows faster than that of all other metrics; only in a box, as
//! flow needs flat ends.

use super::Study;
use super::record::Record;
use super::slices::node_ranges;
use crate::grid::{Axis, Grid};
use crate::ldi::{Mode, NodePlanes};
use crate::metrics::tortuosity::{EndCondition, diffusive, geodesic};
use crate::metrics::{BoundaryCondition, NodeSet, Phase, Region};
use crate::number::number;
use crate::parallel::*;
use crate::report::id;
use crate::sampler::Sampler;
use crate::{Error, Monitor};

/// The relative error of a diffusivity at which the solver stops.
const TOLERANCE: f64 = 1e-8;

/// Number of equations that are solved: one for each phase and axis.
pub const SOLUTIONS: usize = 6;

/// Records tortuosities. Counts its sampling and each solution as a step.
pub fn measure(study: &Study, sampler: &dyn Sampler, progress: &Monitor, record: &mut Record) -> Result<(), Error> {
    if !study.region.is_box() {
        let why = "tortuosity needs flat faces, and the region of interest is not a box";
        for family in [id::TORTUOSITY_PORE_GEODESIC, id::TORTUOSITY_PORE_DIFFUSIVE, id::TORTUOSITY_SOLID_DIFFUSIVE] {
            for id in family.all() {
                record.lacks(id, why);
            }
        }
        return progress.step();
    }
    let grid = coarse(study)?;
    let pitch = number(grid.pitch());
    let images = study.subject.sample(&grid, study.settings.fill, sampler)?;
    let planes = NodePlanes::new(&images.solid, Mode::Exact).expect("images along the three axes of one grid");
    let (solid, region) = (NodeSet::of_planes(&planes), images.region());
    let edges = study.settings.edges;
    let phases = Phase::BOTH.map(|phase| cropped(&phase.nodes(&solid, region.nodes()), &region));
    progress.step()?;
    if study.subject.roi.is_some() {
        progress.expect(SOLUTIONS)?;
    }
    let solve = |phase: Phase, axis: Axis| {
        progress.stage(format!("diffusion through the {} along {}", phase.name(), axis.name()))?;
        let solved = diffusive(&phases[phase as usize], axis, edges, EndCondition::Faces, TOLERANCE, &|_| {});
        progress.step()?;
        Ok::<_, Error>((phase, axis, solved))
    };
    // A path takes one thread: the paths run beside the equations, and beside one another where there are threads for it.
    let path = |axis| geodesic(&phases[Phase::Pore as usize], axis, edges);
    let (paths, solutions) = join(
        || Axis::ALL.into_par_iter().with_max_len(1).map(path).collect::<Vec<_>>(),
        || {
            let equations = Phase::BOTH.into_iter().flat_map(|phase| Axis::ALL.map(|axis| (phase, axis)));
            equations.map(|(phase, axis)| solve(phase, axis)).collect::<Result<Vec<_>, Error>>()
        },
    );
    let no_pore = "no pore reaches from face to face";
    for (phase, axis, solved) in solutions? {
        let (family, none) = match phase {
            Phase::Solid => (id::TORTUOSITY_SOLID_DIFFUSIVE, "no piece of the solid reaches from face to face"),
            Phase::Pore => (id::TORTUOSITY_PORE_DIFFUSIVE, no_pore),
        };
        let id = family.along(axis);
        match solved {
            Ok(Some(diffusion)) => {
                record.put(id, diffusion.tortuosity).with("D/D₀", number(diffusion.effective_diffusivity))
            }
            Ok(None) => record.lacks(id, none),
            Err(error) => record.lacks(id, error.to_string()),
        }
        .with("pitch", &pitch)
        .with("edges", edges.name());
    }
    for (axis, path) in Axis::ALL.into_iter().zip(paths) {
        let id = id::TORTUOSITY_PORE_GEODESIC.along(axis);
        match path {
            Ok(length) => record.put_or(id, length, no_pore),
            Err(error) => record.lacks(id, error.to_string()),
        }
        .with("pitch", &pitch)
        .with("edges", edges.name());
    }
    Ok(())
}

/// Returns the nodes of a box as a raster of its own.
fn cropped(nodes: &NodeSet, region: &Region) -> NodeSet {
    let ranges = node_ranges(region);
    let size = [0, 1, 2].map(|axis| ranges[axis].len());
    NodeSet::from_fn(size, |node| nodes.contains([0, 1, 2].map(|axis| ranges[axis].start + node[axis])))
}

/// Returns the raster for equations: that of the report, or one of a whole multiple of its pitch.
fn coarse(study: &Study) -> Result<Grid, Error> {
    let grid = study.region.grid();
    match multiple(grid.rays(), study.settings.tortuosity_resolution, study.settings.edges) {
        1 => Ok(*grid),
        times => study.subject.grid_of_pitch(f64::from(times) * grid.pitch()),
    }
}

/// Returns the pitch of the raster for equations as a multiple of that of a report with so many rays along each axis: the least that
/// gives at most `most` rays along the longest. A raster of a periodic cell must divide it: where none of half to all of `most` rays
/// does, or only one with a single ray, it is the next finer one that does.
pub fn multiple(rays: [u32; 3], most: u32, edges: BoundaryCondition) -> u32 {
    let longest = rays.into_iter().max().unwrap_or(1);
    let least = longest.div_ceil(most);
    if edges != BoundaryCondition::Periodic {
        return least;
    }
    let divides = |times: &u32| rays.iter().all(|count| count % times == 0);
    let coarsest = least.saturating_mul(2).min(longest / 2);
    (least..=coarsest).find(divides).or_else(|| (1..least).rev().find(divides)).unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_are_on_the_finest_raster_allowed_or_else_the_next_finer_one() {
        assert_eq!(multiple([256, 200, 9], 128, BoundaryCondition::Border), 2);
        assert_eq!(multiple([128, 128, 128], 128, BoundaryCondition::Periodic), 1);
        // 3 divides the first side, and not the others.
        assert_eq!(multiple([300, 200, 100], 128, BoundaryCondition::Periodic), 4);
        // Nothing from 5 to 10 divides all sides.
        assert_eq!(multiple([602, 400, 200], 128, BoundaryCondition::Periodic), 2);
        assert_eq!(multiple([301, 200, 100], 128, BoundaryCondition::Periodic), 1);
        // Nor does one below the whole cell, which would leave one node.
        assert_eq!(multiple([131, 131, 131], 128, BoundaryCondition::Periodic), 1);
        assert_eq!(multiple([262, 262, 262], 128, BoundaryCondition::Periodic), 2);
        assert_eq!(multiple([131, 131, 131], 2, BoundaryCondition::Periodic), 1);
        assert_eq!(multiple([5, 5, 5], 2, BoundaryCondition::Border), 3);
    }
}
