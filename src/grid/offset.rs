//! The lattice of an offset solid.

use glam::DVec3;

use super::{Grid, GridError};
use crate::mesh::Aabb;

/// Returns a grid for the solid in a box, offset by a distance in world units: around the box enlarged by it on every
/// side, or around the box itself where the distance is negative. The solid is quantised on it directly.
pub fn offset_grid(bounds: Aabb, distance: f64, pitch: f64, lod: u32) -> Result<Grid, GridError> {
    let margin = DVec3::splat(distance.max(0.0));
    Grid::with_pitch(Aabb { min: bounds.min - margin, max: bounds.max + margin }, pitch, lod)
}
