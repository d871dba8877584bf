//! What other processors have instead of `lanes`: nothing, for they cover one triangle after another.

use super::raster::Clip;

/// Nothing.
pub struct Places;

impl Places {
    /// Returns nothing.
    pub fn new(_: &Clip) -> Places {
        Places
    }
}
