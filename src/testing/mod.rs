//! Meshes, images, distances and random numbers for unit tests, and for integration tests and benchmarks, which include this
//! folder.

// Each test binary that includes this module uses a part of it.
#![allow(dead_code)]

pub mod images;
pub mod meshes;
pub mod near;
pub mod random;
