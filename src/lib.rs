//! Solid modelling on layered depth images.
//!
//! A **layered depth image** (LDI) of a solid lists, for every ray of a raster, the sorted depths at which the ray enters
//! and leaves it. Booleans of such images are merges of intervals, and volumes are sums; the cost of both does not depend on
//! the number of triangles. The sampling follows Leung & Wang, "Conservative Sampling of Solids in Image Space".
//!
//! # The way data flows
//! ```text
//! files → mesh → grid (quantise once) → sampler (crossings → masks → classes → samples) → Ldi
//!         two solids → minkowski (primitives → spans → resolved spans) → Ldi
//!         Ldi → boolean | integrate | metrics | surface | voxels | picture → numbers, files
//! ```
//! - [`mesh`] reads files and checks them: a [`mesh::ClosedMesh`] is the way into a sampler.
//! - [`grid`] lays a raster around the solids and rounds their vertices, once, to an integer lattice.
//! - [`sampler`] states what an image is, to the bit; [`sampler::cpu`] and, with the feature `gpu`, `sampler::gpu` make it.
//! - [`gpu`] finds and opens compute devices.
//! - [`ldi`] holds the image; [`boolean`] combines any number; [`integrate`] finds volume, area and moments.
//! - [`certified`] proves bounds of the volumes of expressions and offsets.
//! - [`minkowski`] makes the images of Minkowski sums, differences and offsets without a mesh of the result.
//! - [`metrics`] measures scaffolds and their pores: thickness, access, topology, paths.
//! - [`surface`] contours three images to a closed mesh, checks that it is a manifold, and simplifies it.
//! - [`voxels`] writes the inside state of all lattice nodes, for programs that read voxels.
//! - [`picture`] renders images as pictures.
//! - [`solids`] generates model solids.
//! - [`driver`] runs whole operations over these, for the types at the root; [`report`] measures scaffolds and writes pages.
//!
//! # The common volume of a scaffold and a bone
//! ```no_run
//! use ldi_ops::{Settings, Solid};
//!
//! let scaffold = Solid::open("scaffold.stl")?;
//! let bone = Solid::open("bone.stl")?;
//! let common = scaffold.intersect(&bone).sample(&Settings::rays(512))?;
//! println!("{}", common.volume());
//! common.surface()?.write("common.stl")?;
//! # Ok::<(), ldi_ops::Error>(())
//! ```
//! [`Solid`], [`Shape`], [`Settings`], [`Sampled`], [`Estimate`] and [`Report`] are all that most programs need. The modules
//! are the steps underneath.
//!
//! # The steps by themselves
//! ```
//! use ldi_ops::boolean::{BooleanOperation, merge};
//! use ldi_ops::grid::{Axis, Grid};
//! use ldi_ops::integrate::{AxisVolume, VolumeEstimate};
//! use ldi_ops::mesh::ClosedMesh;
//! use ldi_ops::sampler::cpu::CpuSampler;
//! use ldi_ops::sampler::{FillRule, Mode, Sampler};
//! use ldi_ops::solids;
//!
//! let ball = ClosedMesh::check(solids::geodesic(10.0, 24)?)?;
//! let ring = ClosedMesh::check(solids::torus(10.0, 3.0, 96, 48)?)?;
//!
//! let grid = Grid::with_resolution(ball.bounds().union(ring.bounds()), 256, 1024)?;
//! let (ball, ring) = (grid.quantise(&ball)?, grid.quantise(&ring)?);
//!
//! let sampler = CpuSampler::default();
//! let mut axes = Vec::new();
//! for axis in Axis::ALL {
//!     let a = sampler.sample(&ball, axis, Mode::Exact, FillRule::EvenOdd)?;
//!     let b = sampler.sample(&ring, axis, Mode::Exact, FillRule::EvenOdd)?;
//!     let common = merge(BooleanOperation::Intersection, &a, &b)?;
//!     assert!(common.unclosed().is_empty());
//!     axes.push(AxisVolume::of(&common));
//! }
//! let volume = VolumeEstimate::from_axes(&axes);
//! // The exact Boolean of the two meshes, by manifold3d, has 717.0199.
//! assert!((volume.value - 717.0199).abs() < volume.error, "{volume:?}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// Parts that only some formats and outputs use.
#![cfg_attr(not(feature = "cpu"), allow(dead_code, unused_imports, unused_mut, unused_variables, unreachable_code))]

// The name by which `testing` finds the library also from integration tests.
#[cfg(test)]
extern crate self as ldi_ops;

mod bits;
pub mod boolean;
mod box_tree;
mod cancel;
mod cell;
pub mod certified;
mod clash;
mod closest;
mod diagram;
pub mod driver;
mod error;
mod estimate;
pub mod exact;
mod face_tree;
pub mod fixed;
pub mod gpu;
pub mod grid;
pub mod integrate;
pub mod ldi;
pub mod mesh;
pub mod metrics;
pub mod minkowski;
mod parallel;
#[cfg(feature = "picture")]
pub mod picture;
mod polygon;
mod progress;
#[cfg(feature = "report")]
pub mod report;
mod sampled;
pub mod sampler;
mod settings;
mod shape;
mod solid;
pub mod solids;
pub mod surface;
#[cfg(test)]
mod testing;
mod union_find;
#[cfg(feature = "npz")]
pub mod voxels;
mod warning;

// The command line is a package of its own and shares these; they are no part of the library's interface.
#[doc(hidden)]
pub mod allocation;
#[doc(hidden)]
pub mod cubic;
#[doc(hidden)]
pub mod excerpt;
#[doc(hidden)]
pub mod input;
#[doc(hidden)]
pub mod length;
#[doc(hidden)]
pub mod number;
#[doc(hidden)]
pub mod output;
#[doc(hidden)]
pub mod placement;
#[doc(hidden)]
pub mod unit;

pub use driver::Bound;
pub use driver::certainty::Verdict;
pub use driver::clash::{Clash, ClashPlan, Clashes, ComparedPair};
pub use driver::job::Backend;
pub use driver::measured::{Method, Seconds};
pub use driver::surface::SurfaceReport;
pub use error::{Error, ErrorKind, OpenMesh};
pub use estimate::{Estimate, exact_text, rounded_outwards, with_error};
pub use grid::Axis;
pub use mesh::LengthUnit as Unit;
pub use progress::{Monitor, Progress};
#[cfg(feature = "report")]
pub use report::{Limits, Report};
pub use sampled::{Sampled, SolidMoments, SurfaceMesh, Voxels};
pub use sampler::{FillRule, Mode};
pub use settings::{Axes, Settings};
pub use shape::Shape;
pub use solid::Solid;
pub use warning::Warning;

// Compiles and runs the examples of the guide with the doc tests.
#[cfg(all(doctest, feature = "cpu"))]
#[doc = include_str!("../docs/library.md")]
struct LibraryGuide;
