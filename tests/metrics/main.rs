//! Compares metrics of meshes and formulas with exact values at three resolutions.
//!
//! Each test builds a model, samples it with three growing numbers of rays, and compares the results of the public functions with
//! a value in closed form, or with one of another source. The tolerance is in pitches or a share. Each test prints a line with
//! the three values, their errors, and the power of the pitch by which the error falls; `--nocapture` shows it.

#![expect(clippy::print_stdout, reason = "a line for each check, with what it found, is what this test is for, too")]

mod convergence;
mod distances;
mod paths;
mod rays;
mod scene;
#[path = "../../src/testing/mod.rs"]
mod testing;
mod topology;
