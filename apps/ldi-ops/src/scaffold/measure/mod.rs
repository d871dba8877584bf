//! Measuring: from meshes to all that a report says.

pub mod catalogue;
mod record;
