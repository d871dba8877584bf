//! Triangle meshes as files hold them, and the check that turns them into solids.
//!
//! [`TriangleMesh`] is an unchecked mesh. [`ClosedMesh`] is a checked one: every edge has even valence once identical
//! coordinates are one vertex. Samplers accept nothing else.

#[cfg(feature = "3mf")]
mod beam;
pub mod check;
pub mod closed;
mod compact;
pub(crate) mod hash;
mod hull;
pub mod io;
pub(crate) mod mass;
pub(crate) mod measure;
pub(crate) mod meet;
mod transform;
mod weld;
mod winding;

use glam::DVec3;

pub use check::{Defect, MeshReport, Severity, check};
pub(crate) use closed::Fold;
pub use closed::{ClosedMesh, NotClosed};
pub(crate) use compact::renumber;
pub use hull::convex_hull;
pub use mass::MassProperties;
pub(crate) use weld::Weld;
pub(crate) use winding::prove_embedded;
pub use winding::{SelfCrossing, Unproved, first_crossing, prove_simple};

/// Triangles over shared positions, as a reader or a generator produced them; nothing about them has been checked.
///
/// Positions are in file units. A triangle lists three indices into `positions`, counter-clockwise seen from outside.
/// The fields are public because any value of them is a legitimate (perhaps broken) mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions in file units, in `f64` where the file has it.
    pub positions: Vec<DVec3>,
    /// Three indices into `positions` for each triangle.
    pub triangles: Vec<[u32; 3]>,
}

/// The smallest axis-aligned box around a set of points, in world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Least coordinates.
    pub min: DVec3,
    /// Greatest coordinates.
    pub max: DVec3,
}

impl Aabb {
    /// Returns the smallest box around both boxes.
    pub fn union(self, other: Aabb) -> Aabb {
        Aabb { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Returns the side lengths.
    pub fn extent(self) -> DVec3 {
        self.max - self.min
    }
}

/// The floating-point format of stored coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// `f32`: 24 significant bits.
    #[default]
    Single,
    /// `f64`: 53 significant bits.
    Double,
}

impl Precision {
    /// Returns the distance from 1 to the next larger number.
    pub fn epsilon(self) -> f64 {
        match self {
            Precision::Single => f64::from(f32::EPSILON),
            Precision::Double => f64::EPSILON,
        }
    }

    /// Rounds a position to the nearest one with coordinates of this precision.
    pub fn round(self, position: DVec3) -> DVec3 {
        match self {
            Precision::Single => position.as_vec3().as_dvec3(),
            Precision::Double => position,
        }
    }
}

/// The length of one file unit, where the file or the user states it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LengthUnit {
    /// 1e-6 m.
    Micrometre,
    /// 1e-3 m.
    Millimetre,
    /// 1e-2 m.
    Centimetre,
    /// 0.0254 m.
    Inch,
    /// 0.3048 m.
    Foot,
    /// 1 m.
    Metre,
}

impl LengthUnit {
    /// Returns the length of the unit in metres.
    pub fn metres(self) -> f64 {
        match self {
            LengthUnit::Micrometre => 1e-6,
            LengthUnit::Millimetre => 1e-3,
            LengthUnit::Centimetre => 1e-2,
            LengthUnit::Inch => 0.0254,
            LengthUnit::Foot => 0.3048,
            LengthUnit::Metre => 1.0,
        }
    }

    /// Returns the usual symbol: `um`, `mm`, `cm`, `in`, `ft`, `m`.
    pub fn symbol(self) -> &'static str {
        match self {
            LengthUnit::Micrometre => "um",
            LengthUnit::Millimetre => "mm",
            LengthUnit::Centimetre => "cm",
            LengthUnit::Inch => "in",
            LengthUnit::Foot => "ft",
            LengthUnit::Metre => "m",
        }
    }
}
