//! Model solids: closed, outward-oriented, 2-manifold meshes whose volumes are known or can be computed.
//!
//! They serve as examples, as scaffolds to start from, and as test material. Lengths are millimetres by convention;
//! nothing depends on it. Every solid but [`cuboid`] has its centre at the origin, so that any two overlap.
//!
//! Simple shapes are tessellated directly ([`cuboid`], [`sphere`], [`cylinder`], [`torus`], [`hyperboloid`],
//! [`geodesic()`], [`ell`], [`hollow_box`], [`star()`], [`TorusKnot`], [`chain()`], [`chain_mail`], [`Weave`],
//! [`GeodesicFrame`], [`HyperboloidFrame`]). Minimal surfaces, merged lattices, the brush, the bones and the organic solids are
//! implicit solids {F < 0} that one contourer turns into a mesh, clipped by their box with planar caps ([`MinimalSurface`],
//! [`StrutLattice`], [`Brush`], [`LongBone`], [`TrabecularBone`], [`Organic`], [`Skull`]). [`Model`] lists them all
//! with the names and defaults that a command line needs. [`voxels()`] makes the solid of a voxel array.
//!
//! The mesh of a solid is bit for bit independent of the number of threads.

mod blend;
mod boxes;
mod brush;
mod chain;
mod chain_mail;
mod contour;
mod frame;
mod geodesic;
mod knot;
mod lattice;
mod long_bone;
mod minimal_surface;
mod model;
mod organic;
mod primitives;
mod skull;
mod star;
mod trabecular;
mod voxels;
mod weave;

#[cfg(test)]
mod closure;

pub use boxes::{ell, hollow_box};
pub use brush::Brush;
pub use chain::chain;
pub use chain_mail::chain_mail;
pub use frame::{GeodesicFrame, HyperboloidFrame};
pub use geodesic::geodesic;
pub use knot::TorusKnot;
pub use lattice::{LatticeForm, StrutLattice, StrutPattern};
pub use long_bone::LongBone;
pub use minimal_surface::{MinimalSurface, Part, Surface};
pub use model::{Model, ModelKind, Parameter};
pub use organic::Organic;
pub use primitives::{cuboid, cylinder, hyperboloid, sphere, torus};
pub use skull::Skull;
pub use star::star;
pub use trabecular::TrabecularBone;
pub use voxels::voxels;
pub use weave::Weave;

/// Largest number of triangles of a solid.
pub const MAX_TRIANGLES: u64 = 50_000_000;

/// The reason why a solid cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolidError {
    /// A parameter has a value for which there is no such solid.
    #[error("{parameter} is {value}, but must be {allowed}")]
    OutOfRange {
        /// The parameter's name.
        parameter: &'static str,
        /// Its value.
        value: f64,
        /// The allowed range, in words and numbers.
        allowed: String,
    },
    /// The mesh would be too large.
    #[error("{parameter} = {value} gives {triangles} triangles, but at most {limit} are allowed")]
    TooManyTriangles {
        /// The parameter to lower.
        parameter: &'static str,
        /// Its value.
        value: f64,
        /// Number of triangles required.
        triangles: u64,
        /// Number of triangles allowed.
        limit: u64,
    },
    /// The grid on which an implicit solid is sampled would be too large.
    #[error("{parameter} = {value} asks for {nodes} grid nodes, but at most {limit} are allowed")]
    TooManyNodes {
        /// The parameter to lower.
        parameter: &'static str,
        /// Its value.
        value: f64,
        /// Number of nodes required.
        nodes: u64,
        /// Number of nodes allowed.
        limit: u64,
    },
    /// The grid on which an implicit solid is sampled misses it.
    #[error("{parameter} = {value} is too coarse: no grid node lies inside the solid")]
    Empty {
        /// The parameter to raise.
        parameter: &'static str,
        /// Its value.
        value: f64,
    },
    /// No solid has this name.
    #[error("there is no model `{kind}`; the models are {known}")]
    UnknownKind {
        /// The name as given.
        kind: String,
        /// All names.
        known: String,
    },
    /// The solid has no parameter of this name.
    #[error("`{kind}` has no parameter `{parameter}`; its parameters are {known}")]
    UnknownParameter {
        /// The solid's name.
        kind: &'static str,
        /// The parameter's name as given.
        parameter: String,
        /// The names of its parameters.
        known: String,
    },
    /// Parameters that were not given take part in an error.
    #[error("{error}; {defaults} by default")]
    Default {
        /// The error.
        error: Box<SolidError>,
        /// The options of these parameters and their defaults, in words.
        defaults: String,
    },
    /// The text given for a parameter does not have the required form.
    #[error("{parameter} is `{text}`, but must be {expected}")]
    Unreadable {
        /// The parameter's name.
        parameter: &'static str,
        /// The text as given.
        text: String,
        /// The required form.
        expected: &'static str,
    },
}

impl SolidError {
    /// Returns the words that may name parameters: those of the parameter that the error is about, and of its limit.
    fn words(&self) -> impl Iterator<Item = &str> {
        let (parameter, limit) = match self {
            SolidError::OutOfRange { parameter, allowed, .. } => (*parameter, allowed.as_str()),
            SolidError::TooManyTriangles { parameter, .. }
            | SolidError::TooManyNodes { parameter, .. }
            | SolidError::Empty { parameter, .. } => (*parameter, ""),
            _ => ("", ""),
        };
        parameter.split(' ').chain(limit.split(|c: char| !c.is_alphanumeric()))
    }
}

/// Checks that a length is positive, finite, and of a size at which squares neither overflow nor underflow.
fn check_length(parameter: &'static str, value: f64) -> Result<(), SolidError> {
    check_range(parameter, value, 1e-9, 1e9)
}

/// The relative rounding error of a computed limit. Users type decimals: 0.3 is within a limit of 1.5 · 0.2.
const ROUNDING: f64 = 1e-10;

/// Checks that `low <= value <= high`, where the limits may be off by [`ROUNDING`].
fn check_range(parameter: &'static str, value: f64, low: f64, high: f64) -> Result<(), SolidError> {
    if value >= low - ROUNDING * low.abs() && value <= high + ROUNDING * high.abs() {
        Ok(())
    } else {
        let allowed = format!("from {} to {}", rounded(low), rounded(high));
        Err(SolidError::OutOfRange { parameter, value, allowed })
    }
}

/// Rounds a limit to eleven digits for a message: [`check_range`] accepts every limit that a message shows.
fn rounded(limit: f64) -> f64 {
    format!("{limit:.10e}").parse().expect("a float that was printed is one")
}

/// Checks a number of triangles against [`MAX_TRIANGLES`] before memory is allocated for them.
fn check_triangles(parameter: &'static str, value: u32, triangles: u64) -> Result<(), SolidError> {
    if triangles <= MAX_TRIANGLES {
        Ok(())
    } else {
        Err(SolidError::TooManyTriangles { parameter, value: value.into(), triangles, limit: MAX_TRIANGLES })
    }
}

/// Checks the cells of a periodic solid along each axis, and their size and resolution; returns the box that they fill.
fn periodic_block(cells: [u32; 3], cell_size: f64, resolution: u32) -> Result<contour::Block, SolidError> {
    check_length("cell_size", cell_size)?;
    check_range("resolution", resolution.into(), 4.0, 1024.0)?;
    for n in cells {
        check_range("cells", n.into(), 1.0, 10_000.0)?;
    }
    let extent = cell_size * glam::DVec3::from_array(cells.map(f64::from));
    Ok(contour::Block {
        min: -extent / 2.0,
        spacing: cell_size / f64::from(resolution),
        cells: cells.map(|n| n as usize * resolution as usize),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printed_limits_are_accepted() {
        for low in [1.5 * (5.0 / 25.0), 0.1 + 0.2, 1.0 / 3.0, 2.0f64.sqrt(), 0.95 * 10.0 / 3.0917] {
            assert_eq!(check_range("x", rounded(low), low, 10.0), Ok(()), "{low}");
            assert_eq!(check_range("x", rounded(low), 0.0, low), Ok(()), "{low}");
            assert!(check_range("x", low * (1.0 - 1e-9), low, 10.0).is_err());
            assert!(check_range("x", f64::NAN, 0.0, low).is_err());
        }
        let error = check_range("x", 0.2, 0.1 + 0.2, 0.1 + 0.6).unwrap_err();
        assert_eq!(error.to_string(), "x is 0.2, but must be from 0.3 to 0.7");
    }
}
