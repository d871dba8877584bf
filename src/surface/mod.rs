//! From images back to surfaces, and what a surface must be.
//!
//! [`gates`] says whether a mesh may go out; [`simplify`] makes one of fewer triangles that still may.

pub mod gates;
pub mod simplify;
