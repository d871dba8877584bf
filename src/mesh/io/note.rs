//! What a reader did that its user should hear of.

use std::fmt;

/// A remark about a file that was read: something was put together, replaced or left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadNote {
    /// A text STL held several solids; they are one mesh now.
    SolidsMerged {
        /// How many solids had facets.
        count: usize,
    },
    /// The file held several objects; they are one mesh now.
    ObjectsMerged {
        /// How many objects had faces, counting each place an object stands in.
        count: usize,
    },
    /// Faces with more than three corners were cut into triangles.
    PolygonsTriangulated {
        /// How many such faces.
        count: usize,
    },
    /// Some of the faces that were cut cross themselves or are folded, so that their triangles may overlap.
    PolygonsNotSimple {
        /// How many such faces; they count as triangulated too.
        count: usize,
    },
    /// Points, lines and faces of fewer than three corners were left out.
    PointsOrLinesIgnored {
        /// How many.
        count: usize,
    },
    /// Free-form curves and surfaces were left out.
    FreeFormIgnored {
        /// How many.
        count: usize,
    },
    /// Weights of vertices, which matter to free-form surfaces alone, were left out.
    WeightsIgnored {
        /// How many vertices had a weight other than 1.
        count: usize,
    },
    /// Bytes after the last thing the header announces were left out.
    TrailingBytes {
        /// How many.
        count: usize,
    },
    /// Objects that a printer would build as supports were left out.
    SupportsSkipped {
        /// How many.
        count: usize,
    },
    /// The beams of beam lattices were left out; what is read is less than the file describes.
    BeamsLeftOut {
        /// How many.
        count: usize,
    },
    /// Meshes with skins or morph targets were read in their rest shape.
    DeformationIgnored {
        /// How many.
        count: usize,
    },
}

impl ReadNote {
    /// A short name that does not change, for programs.
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
            ReadNote::BeamsLeftOut { .. } => "beams-left-out",
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
            ReadNote::BeamsLeftOut { count } => write!(f, "beams of beam lattices left out: {count}"),
            ReadNote::DeformationIgnored { count } => {
                write!(f, "meshes with skins or morph targets read in their rest shape: {count}")
            }
        }
    }
}
