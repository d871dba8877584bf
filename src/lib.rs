//! Solid modelling on layered depth images.

pub mod fixed;
pub mod grid;
pub mod ldi;
pub mod mesh;
pub mod sampler;
pub mod solids;
