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
use crate::report::id;
use crate::sampler::Sampler;
use crate::{Error, Monitor};

/// The residual at which the solver stops.
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
    for (phase, nodes) in Phase::BOTH.into_iter().zip(&phases) {
        for axis in Axis::ALL {
            progress.stage(format!("diffusion through the {} along {}", phase.name(), axis.name()))?;
            let (family, none) = match phase {
                Phase::Solid => (id::TORTUOSITY_SOLID_DIFFUSIVE, "no piece of the solid reaches from face to face"),
                Phase::Pore => (id::TORTUOSITY_PORE_DIFFUSIVE, "no pore reaches from face to face"),
            };
            let id = family.along(axis);
            match diffusive(nodes, axis, edges, EndCondition::Faces, TOLERANCE, &|_| {}) {
                Ok(Some(diffusion)) => {
                    record.put(id, diffusion.tortuosity).with("D/D₀", number(diffusion.effective_diffusivity))
                }
                Ok(None) => record.lacks(id, none),
                Err(error) => record.lacks(id, error.to_string()),
            }
            .with("pitch", &pitch)
            .with("edges", edges.name());
            if phase == Phase::Pore {
                let id = id::TORTUOSITY_PORE_GEODESIC.along(axis);
                match geodesic(nodes, axis, edges) {
                    Ok(length) => record.put_or(id, length, none),
                    Err(error) => record.lacks(id, error.to_string()),
                }
                .with("pitch", &pitch)
                .with("edges", edges.name());
            }
            progress.step()?;
        }
    }
    Ok(())
}

/// Returns the nodes of a box as a raster of its own.
fn cropped(nodes: &NodeSet, region: &Region) -> NodeSet {
    let ranges = node_ranges(region);
    let size = [0, 1, 2].map(|axis| ranges[axis].len());
    NodeSet::from_fn(size, |node| nodes.contains([0, 1, 2].map(|axis| ranges[axis].start + node[axis])))
}

/// Returns the raster for equations: that of the report, or one of a whole multiple of its pitch. A periodic cell must be whole
/// pitches of it, too.
fn coarse(study: &Study) -> Result<Grid, Error> {
    let grid = study.region.grid();
    let rays = grid.rays();
    let longest = rays.into_iter().max().unwrap_or(1);
    let most = study.settings.tortuosity_resolution;
    let fits = |times: &u32| {
        study.settings.edges != BoundaryCondition::Periodic || rays.iter().all(|count| count % times == 0)
    };
    let times = (longest.div_ceil(most)..=longest).find(fits).unwrap_or(1);
    if times == 1 { Ok(*grid) } else { study.subject.grid_of_pitch(f64::from(times) * grid.pitch()) }
}
