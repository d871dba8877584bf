//! Compute devices: the basis of the GPU forms of operations. This module knows nothing of rays or solids.
//!
//! [`adapters`] lists the adapters, [`Device::open`] opens one, a `Kernel` is one compiled entry point of a shader, a
//! `Recorder` collects dispatches, and a `Pool` keeps buffers from one job to the next. All errors are returned as
//! [`DeviceError`]s; nothing panics when a driver does. Without the feature `gpu` there is only the error type.

#[cfg(feature = "gpu")]
mod adapter;
#[cfg(feature = "gpu")]
mod costs;
#[cfg(feature = "gpu")]
mod device;
mod error;
#[cfg(feature = "gpu")]
mod kernel;
#[cfg(feature = "gpu")]
mod pool;
#[cfg(feature = "gpu")]
mod recorder;
#[cfg(feature = "gpu")]
mod shared;
#[cfg(feature = "gpu")]
mod stage;
#[cfg(all(test, feature = "gpu"))]
pub(crate) mod validation;

#[cfg(feature = "gpu")]
pub use adapter::{Adapter, AdapterKind, AdapterLimits, adapters, choose};
#[cfg(feature = "gpu")]
pub use costs::Costs;
#[cfg(feature = "gpu")]
pub(crate) use device::held;
#[cfg(feature = "gpu")]
pub use device::{Counters, Device, Needs, StageTime};
pub use error::DeviceError;
#[cfg(feature = "gpu")]
pub(crate) use kernel::{Access, Kernel};
#[cfg(feature = "gpu")]
pub(crate) use pool::{Pool, bytes_of};
#[cfg(feature = "gpu")]
pub(crate) use recorder::{Recorder, WORKGROUP, Workgroups, counted, workgroups};
#[cfg(feature = "gpu")]
pub(crate) use shared::shared_struct;
#[cfg(feature = "gpu")]
pub(crate) use stage::{Stage, StageKernels};
