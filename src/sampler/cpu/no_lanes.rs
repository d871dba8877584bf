//! Stands in for `lanes` on processors that cover one triangle after another.

use super::raster::Clip;

/// Needs no room.
pub struct Places;

impl Places {
    /// Returns the places of an image.
    pub fn new(_: &Clip) -> Places {
        Places
    }
}
