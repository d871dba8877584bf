//! From solids to results: plan → grid → sample → operate → measure.
//!
//! [`job`] describes an operation; [`input`] reads, places and checks its solids; [`measure`](mod@measure) and [`sum`](mod@sum) run it;
//! [`surface`](mod@surface) and `write` make files of the images. `refine` repeats a measurement with more rays, `memory` forecasts
//! and admits, [`backend`] chooses the device.

pub mod backend;
pub(crate) mod bound;
mod bytes;
pub mod certainty;
pub mod clash;
pub mod device;
mod exact_cost;
mod fill;
mod finer;
#[cfg_attr(not(feature = "gpu"), path = "no_gpu.rs")]
pub mod gpu;
mod image;
#[cfg(feature = "npz")]
pub mod image_file;
pub mod input;
pub mod job;
pub mod machine;
pub mod measure;
pub mod measured;
pub(crate) mod memory;
pub mod output;
pub(crate) mod raster;
mod refine;
#[cfg(feature = "picture")]
pub mod render;
pub mod size;
pub mod sum;
pub mod surface;
pub(crate) mod work;
pub mod write;

pub use bound::Bound;
pub use fill::FillDifference;
