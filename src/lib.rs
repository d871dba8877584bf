//! Solid modelling on layered depth images.

mod allocation;
pub mod boolean;
pub mod fixed;
pub mod grid;
pub mod integrate;
pub mod ldi;
pub mod mesh;
pub mod sampler;
pub mod solids;
