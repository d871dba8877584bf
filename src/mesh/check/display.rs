//! Defects as English sentences.

use std::fmt::{Display, Formatter, Result};

use glam::DVec3;

use super::report::{
    BadIndex, BadPosition, Defect, DuplicatePlace, EdgePlace, Findings, ShellPlace, TrianglePlace, VertexPlace,
};

impl Display for Defect {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Defect::NoTriangles => write!(f, "The mesh has no triangles."),
            Defect::BadIndices(found) => sentence(f, found, "index is out of range", "indices are out of range"),
            Defect::BadPositions(found) => sentence(f, found, "position is not finite", "positions are not finite"),
            Defect::OpenEdges(found) => {
                let one = "edge is open, used by one triangle only";
                sentence(f, found, one, "edges are open, used by one triangle only")
            }
            Defect::OddEdges(found) => {
                let one = "edge is used by an odd number of triangles";
                sentence(f, found, one, "edges are used by an odd number of triangles")
            }
            Defect::UnbalancedEdges(found) => {
                let one = "edge joins triangles that face opposite ways";
                sentence(f, found, one, "edges join triangles that face opposite ways")
            }
            Defect::InsideOut(found) => sentence(f, found, "shell is inside out", "shells are inside out"),
            Defect::AllDoubled => {
                write!(
                    f,
                    "Every triangle occurs an even number of times, so the even-odd fill rule cancels all of them."
                )
            }
            Defect::NoVolume { signed_volume } => {
                write!(f, "The mesh is closed but encloses no positive volume: {}.", Number(*signed_volume))
            }
            Defect::SolidsInSolids(found) => {
                let one = "shell lies inside a solid and faces outwards, as a solid within a solid";
                sentence(f, found, one, "shells lie inside a solid and face outwards, as solids within a solid")
            }
            Defect::Duplicates(found) => {
                sentence(f, found, "triangle repeats an earlier one", "triangles repeat earlier ones")
            }
            Defect::OpposedDuplicates(found) => {
                let one = "triangle lies back to back with an earlier one";
                sentence(f, found, one, "triangles lie back to back with earlier ones")
            }
            Defect::NonManifoldEdges(found) => {
                let one = "edge is shared by more than two triangles";
                sentence(f, found, one, "edges are shared by more than two triangles")
            }
            Defect::NonManifoldVertices(found) => {
                let one = "vertex joins parts of the surface that no edge joins";
                sentence(f, found, one, "vertices join parts of the surface that no edge joins")
            }
            Defect::RepeatedCorners(found) => {
                sentence(f, found, "triangle has identical corners", "triangles have identical corners")
            }
            Defect::Collinear(found) => {
                let one = "triangle has no area, its corners being on a line";
                sentence(f, found, one, "triangles have no area, their corners being on a line")
            }
        }
    }
}

/// A place of a defect.
trait Named {
    /// Writes the place within a sentence.
    fn name(&self, f: &mut Formatter<'_>) -> Result;
}

/// Writes a sentence: the count and the first place.
fn sentence<P: Named>(f: &mut Formatter<'_>, found: &Findings<P>, one: &str, many: &str) -> Result {
    write!(f, "{} {}", found.count, if found.count == 1 { one } else { many })?;
    if let Some(place) = found.first.first() {
        f.write_str(if found.count == 1 { ": " } else { "; the first is " })?;
        place.name(f)?;
    }
    f.write_str(".")
}

/// A number in its shortest exact form: with an exponent where it would be mostly zeros without.
struct Number(f64);

impl Display for Number {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let Number(number) = *self;
        if number == 0.0 || !number.is_finite() || (1e-5..1e16).contains(&number.abs()) {
            write!(f, "{number}")
        } else {
            write!(f, "{number:e}")
        }
    }
}

/// A position as (x, y, z).
struct Point(DVec3);

impl Display for Point {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let Point(DVec3 { x, y, z }) = *self;
        write!(f, "({}, {}, {})", Number(x), Number(y), Number(z))
    }
}

impl Named for BadIndex {
    fn name(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "{} in triangle {}", self.index, self.triangle)
    }
}

impl Named for BadPosition {
    fn name(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "position {} at {}, used by triangle {}", self.index, Point(self.position), self.triangle)
    }
}

impl Named for VertexPlace {
    fn name(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "{}, where {} parts meet", Point(self.position), self.fans)
    }
}

impl Named for EdgePlace {
    fn name(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "{} to {}, of ", Point(self.ends[0]), Point(self.ends[1]))?;
        f.write_str(if self.uses == 1 { "triangle " } else { "triangles " })?;
        for (i, triangle) in self.triangles.iter().enumerate() {
            let last = i + 1 == self.uses;
            f.write_str(if i == 0 {
                ""
            } else if last {
                " and "
            } else {
                ", "
            })?;
            write!(f, "{triangle}")?;
        }
        match self.uses - self.triangles.len() {
            0 => Ok(()),
            more => write!(f, " and {more} more"),
        }
    }
}

impl Named for TrianglePlace {
    fn name(&self, f: &mut Formatter<'_>) -> Result {
        let [a, b, c] = self.corners.map(Point);
        write!(f, "triangle {} with corners {a}, {b}, {c}", self.triangle)
    }
}

impl Named for DuplicatePlace {
    fn name(&self, f: &mut Formatter<'_>) -> Result {
        let [a, b, c] = self.corners.map(Point);
        write!(f, "triangles {} and {} with corners {a}, {b}, {c}", self.earlier, self.triangle)
    }
}

impl Named for ShellPlace {
    fn name(&self, f: &mut Formatter<'_>) -> Result {
        let ShellPlace { triangle, faces, .. } = self;
        let (volume, min, max) = (Number(self.signed_volume), Point(self.bounds.min), Point(self.bounds.max));
        write!(f, "{faces} triangles from triangle {triangle} on, volume {volume}, between {min} and {max}")
    }
}
