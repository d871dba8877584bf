//! Solid modelling on layered depth images.

pub mod mesh;
pub mod solids;
