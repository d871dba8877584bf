//! Compares the GPU's sampler with the CPU's, byte for byte. Needs an adapter, be it a software one, and fails without one.
//!
//! The adapter is the first that is found, or the one that `LDI_ADAPTER` names. One function, in [`comparison`], compares all
//! images word for word; tests show that it fails where it should. Sums are compared by `==`.

#[path = "../oracle/any_expression.rs"]
mod any_expression;
mod arithmetic;
mod bands;
mod comparison;
mod corpus;
mod device;
mod expressions;
mod history;
mod images;
mod intersections;
mod lattice;
mod layers;
#[path = "../corpus/manifest.rs"]
mod manifest;
mod models;
#[path = "../oracle/on_lattice.rs"]
mod on_lattice;
mod open;
mod rasters;
mod resolve;
#[path = "../oracle/soups.rs"]
mod soups;
mod spans;
mod stages;
mod sums;
#[path = "../../src/testing/mod.rs"]
mod testing;
mod triangles;
mod twin;
mod volume_sums;
