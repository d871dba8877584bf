//! Notes of readers and writers for the user.

use std::fmt;

use super::Format;
use crate::mesh::LengthUnit;

/// A note about a file that was read: something was merged, replaced or left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadNote {
    /// A text STL held several solids; they were merged into one mesh.
    SolidsMerged {
        /// Number of solids with facets.
        count: usize,
    },
    /// The file held several objects; they were merged into one mesh.
    ObjectsMerged {
        /// Number of objects with faces, each instance counted.
        count: usize,
    },
    /// Faces with more than three corners were cut into triangles.
    PolygonsTriangulated {
        /// Number of such faces.
        count: usize,
    },
    /// Some of the triangulated faces have self-intersections or are folded, so that their triangles may overlap.
    PolygonsNotSimple {
        /// Number of such faces; they count as triangulated too.
        count: usize,
    },
    /// Points, lines and faces of fewer than three corners were left out.
    PointsOrLinesIgnored {
        /// Number of them.
        count: usize,
    },
    /// Free-form curves and surfaces were left out.
    FreeFormIgnored {
        /// Number of them.
        count: usize,
    },
    /// Weights of vertices, which apply only to free-form surfaces, were left out.
    WeightsIgnored {
        /// Number of vertices with a weight other than 1.
        count: usize,
    },
    /// Bytes after the last element that the header announces were left out.
    TrailingBytes {
        /// Number of bytes.
        count: usize,
    },
    /// Objects that a printer would build as supports were left out.
    SupportsSkipped {
        /// Number of objects.
        count: usize,
    },
    /// The beams and balls of beam lattices were meshed. Each is a closed shell of its own and overlaps its neighbours,
    /// so that only the non-zero fill rule gives the solid that the file describes.
    BeamsMeshed {
        /// Number of beams and balls, each instance counted.
        count: usize,
    },
    /// Beams shorter than the minimum length of their lattice were left out, as the format demands.
    BeamsTooShort {
        /// Number of beams, each instance counted.
        count: usize,
    },
    /// Meshes that stand in for beam lattices on displays were left out; the lattices themselves were read.
    RepresentationsIgnored {
        /// Number of meshes.
        count: usize,
    },
    /// Meshes with skins or morph targets were read in their rest shape.
    DeformationIgnored {
        /// Number of meshes.
        count: usize,
    },
}

impl ReadNote {
    /// Returns a short, stable name, for programs.
    pub fn code(&self) -> &'static str {
        match self {
            ReadNote::SolidsMerged { .. } => "solids-merged",
            ReadNote::ObjectsMerged { .. } => "objects-merged",
            ReadNote::PolygonsTriangulated { .. } => "polygons-triangulated",
            ReadNote::PolygonsNotSimple { .. } => "polygons-not-simple",
            ReadNote::PointsOrLinesIgnored { .. } => "points-or-lines-ignored",
            ReadNote::FreeFormIgnored { .. } => "free-form-ignored",
            ReadNote::WeightsIgnored { .. } => "weights-ignored",
            ReadNote::TrailingBytes { .. } => "trailing-bytes",
            ReadNote::SupportsSkipped { .. } => "supports-skipped",
            ReadNote::BeamsMeshed { .. } => "beams-meshed",
            ReadNote::BeamsTooShort { .. } => "beams-too-short",
            ReadNote::RepresentationsIgnored { .. } => "representations-ignored",
            ReadNote::DeformationIgnored { .. } => "deformation-ignored",
        }
    }
}

impl fmt::Display for ReadNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ReadNote::SolidsMerged { count } => write!(f, "solids merged into one mesh: {count}"),
            ReadNote::ObjectsMerged { count } => write!(f, "objects merged into one mesh: {count}"),
            ReadNote::PolygonsTriangulated { count } => write!(f, "polygons triangulated: {count}"),
            ReadNote::PolygonsNotSimple { count } => {
                write!(f, "polygons that cross themselves or are folded: {count}")
            }
            ReadNote::PointsOrLinesIgnored { count } => write!(f, "points and lines ignored: {count}"),
            ReadNote::FreeFormIgnored { count } => write!(f, "free-form curves and surfaces ignored: {count}"),
            ReadNote::WeightsIgnored { count } => write!(f, "vertex weights other than 1 ignored: {count}"),
            ReadNote::TrailingBytes { count } => write!(f, "bytes ignored after the last element: {count}"),
            ReadNote::SupportsSkipped { count } => write!(f, "support objects skipped: {count}"),
            ReadNote::BeamsMeshed { count } => {
                write!(f, "beams and balls of beam lattices meshed, each a shell that overlaps others: {count}")
            }
            ReadNote::BeamsTooShort { count } => {
                write!(f, "beams shorter than their lattice's least length left out: {count}")
            }
            ReadNote::RepresentationsIgnored { count } => {
                write!(f, "meshes that only display a beam lattice ignored: {count}")
            }
            ReadNote::DeformationIgnored { count } => {
                write!(f, "meshes with skins or morph targets read in their rest shape: {count}")
            }
        }
    }
}

/// A note about a file that was written: its contents differ from the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WriteNote {
    /// The format has a unit, and none was given.
    UnitAssumed {
        /// The format.
        format: Format,
        /// The assumed unit of the coordinates.
        unit: LengthUnit,
    },
    /// Rounding to 32 bits moved vertices by more than a hundred-thousandth of the mesh's size.
    CoordinatesRounded {
        /// The format.
        format: Format,
        /// The largest change of a coordinate, in units of the mesh.
        moved: f64,
        /// The longest side of the mesh's box, in units of the mesh.
        size: f64,
    },
    /// Triangles with two corners in one position were left out, since 3MF does not allow them. They have no area, and
    /// leaving them out opens no edge.
    CollapsedLeftOut {
        /// Number of triangles.
        count: usize,
    },
}

impl WriteNote {
    /// Returns a short, stable name, for programs.
    pub fn code(&self) -> &'static str {
        match self {
            WriteNote::UnitAssumed { .. } => "unit-assumed",
            WriteNote::CoordinatesRounded { .. } => "coordinates-rounded",
            WriteNote::CollapsedLeftOut { .. } => "collapsed-left-out",
        }
    }
}

impl fmt::Display for WriteNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            WriteNote::UnitAssumed { format, unit } => {
                write!(
                    f,
                    "{format} files state a unit and none is known: lengths are taken to be in {} (set --unit)",
                    unit.symbol()
                )
            }
            WriteNote::CoordinatesRounded { format, moved, size } => write!(
                f,
                "{format} holds 32-bit coordinates, which move vertices by up to {moved:.1e} in a mesh of size {size:.1e}; \
                 write .obj, .ply, .off or .3mf for 64 bits"
            ),
            WriteNote::CollapsedLeftOut { count } => {
                write!(f, "triangles with two corners at one position left out (3MF does not allow them): {count}")
            }
        }
    }
}
