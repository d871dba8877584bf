//! Metrics from the mesh, or a formula, to the number: beside what is exact, at three resolutions.
//!
//! Each check makes its model, samples it on a growing number of rays, and holds what the public functions say to a value in
//! closed form, or one of another source, within a tolerance in pitches or as a share. A line for each says all three values,
//! how far they are off, and by which power of the pitch the error falls, which is seen with `--nocapture`.

#![expect(clippy::print_stdout, reason = "a line for each check, with what it found, is what this test is for, too")]

mod convergence;
mod distances;
mod paths;
mod rays;
mod scene;
mod topology;
