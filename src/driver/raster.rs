//! The raster of an operation: around its solids, at the spacing of the job.

use std::fmt::Display;

use super::input::Solid;
use super::job::Spacing;
use crate::Error;
use crate::grid::{Grid, GridError, RAYS_MAX};
use crate::mesh::Aabb;
use crate::number::rounded_up;

/// The greatest resolution at which the images of a cube have fewer than 2³² rays.
const RAYS_FITTING: u32 = RAYS_MAX - 1;

/// Lays a raster around the box of `name`, which errors state.
///
/// # Errors
/// Boxes that no lattice can hold at this spacing.
pub fn lay(bounds: Aabb, spacing: Spacing, lod: u32, name: impl Display) -> Result<Grid, Error> {
    let grid = match spacing {
        Spacing::Resolution(rays) => Grid::with_resolution(bounds, rays, lod),
        Spacing::Pitch(pitch) => Grid::with_pitch(bounds, pitch, lod),
        Spacing::Tolerance(_) => unreachable!("a refinement lays rasters by their resolution"),
    };
    grid.map_err(|error| match (spacing, &error) {
        (Spacing::Pitch(_), _) => refused_pitch(&error, bounds.extent().max_element(), name),
        (_, GridError::Rays { .. }) => Error::input(format!("{name}: {error} to {RAYS_FITTING}")),
        _ => Error::input(format!("{name}: {error}")),
    })
}

/// Returns the refusal of a pitch, and the least one where it gives too many rays along the longest side.
pub fn refused_pitch(error: &GridError, longest: f64, name: impl Display) -> Error {
    match error {
        GridError::Resolution { .. } => {
            let least = rounded_up(longest / f64::from(RAYS_FITTING));
            Error::input(format!("{name}: {error}; the least --pitch is {least}"))
        }
        _ => Error::input(format!("{name}: {error}")),
    }
}

/// Returns the box around all solids.
pub fn common_box(solids: &[Solid]) -> Aabb {
    solids.iter().map(Solid::bounds).reduce(|a, b| a.union(b)).expect("an operation has an input")
}

/// Returns the names of all solids, for messages.
pub fn names(solids: &[Solid]) -> String {
    solids.iter().map(|solid| solid.name().to_string()).collect::<Vec<_>>().join(", ")
}
