//! Tests of properties that every image has, whatever the solid: nesting of the three modes, the algebra of sets, equal bits
//! however the work is divided, shifts and scales; and volumes with closed forms, degenerate meshes included.
//!
//! These tests do not depend on how a sampler works. The oracle test defines every single sample; these test all samples
//! together, also on solids that are too large for the oracle.

mod algebra;
#[path = "../oracle/any_expression.rs"]
mod any_expression;
mod closed_forms;
mod conservative;
mod degeneracies;
mod expressions;
mod images;
mod invariance;
mod material;
mod nodes;
#[path = "../oracle/on_lattice.rs"]
mod on_lattice;
#[path = "../oracle/soups.rs"]
mod soups;
#[path = "../../src/testing/mod.rs"]
mod testing;
