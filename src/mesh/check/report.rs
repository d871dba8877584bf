//! The report of the check: its counts, and the defects that follow from them.

use glam::DVec3;

use crate::mesh::Aabb;

/// Number of places of each kind of defect that are kept beside the count.
pub(super) const FIRST: usize = 5;

/// All findings of one kind: their count and the first few.
#[derive(Clone, Debug, PartialEq)]
pub struct Findings<Place> {
    /// Number of findings.
    pub count: usize,
    /// The first findings, at most five.
    pub first: Vec<Place>,
}

/// An index that is out of range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BadIndex {
    /// The triangle that holds it.
    pub triangle: usize,
    /// The index.
    pub index: u32,
}

/// A position, used by a triangle, that is infinite or not a number in some coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BadPosition {
    /// The first triangle that uses it.
    pub triangle: usize,
    /// Its index among the positions.
    pub index: u32,
    /// Its coordinates.
    pub position: DVec3,
}

/// An edge and the triangles that meet in it.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgePlace {
    /// The two ends, the one used by an earlier triangle first.
    pub ends: [DVec3; 2],
    /// Number of triangles that use it.
    pub uses: usize,
    /// Number of uses from the first end to the second.
    pub forward: usize,
    /// The first triangles that use it, at most five.
    pub triangles: Vec<usize>,
}

/// A vertex at which more than one fan of triangles meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexPlace {
    /// Where it is.
    pub position: DVec3,
    /// Number of fans of triangles, connected by edges, that meet in it.
    pub fans: usize,
}

/// A triangle and its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrianglePlace {
    /// The triangle.
    pub triangle: usize,
    /// Its corners.
    pub corners: [DVec3; 3],
}

/// A triangle with the same three corners as an earlier one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DuplicatePlace {
    /// The later triangle.
    pub triangle: usize,
    /// The first triangle with these corners.
    pub earlier: usize,
    /// The corners of the later one.
    pub corners: [DVec3; 3],
}

/// A closed shell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShellPlace {
    /// Its first triangle.
    pub triangle: usize,
    /// Number of its faces.
    pub faces: usize,
    /// The enclosed volume; negative where the shell faces inwards.
    pub signed_volume: f64,
    /// Number of other shells that contain it.
    pub depth: usize,
    /// The box around it.
    pub bounds: Aabb,
}

/// The findings of [`check`](super::check) for one mesh.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct MeshReport {
    /// Triangles in the mesh, good or bad.
    pub triangles: usize,
    /// Different positions that triangles use.
    pub vertices: usize,
    /// Different edges of faces, in either direction.
    pub edges: usize,
    /// Number of components: parts of the mesh connected by edges.
    pub components: usize,
    /// Closed parts of the mesh that bound something by themselves; see the [module](super).
    pub shells: usize,
    /// Indices beyond the positions.
    pub bad_indices: Findings<BadIndex>,
    /// Used positions that are infinite or not a number.
    pub bad_positions: Findings<BadPosition>,
    /// Edges with one use.
    pub open_edges: Findings<EdgePlace>,
    /// Edges with an odd number of uses, three or more.
    pub odd_edges: Findings<EdgePlace>,
    /// Edges with an even number of uses that differ in number between the two directions.
    pub unbalanced_edges: Findings<EdgePlace>,
    /// Edges with an even number of uses, four or more.
    pub non_manifold_edges: Findings<EdgePlace>,
    /// Vertices in which fans of triangles meet that no edge connects.
    pub non_manifold_vertices: Findings<VertexPlace>,
    /// Triangles two or three corners of which are identical.
    pub repeated_corners: Findings<TrianglePlace>,
    /// Faces whose corners lie on one line.
    pub collinear: Findings<TrianglePlace>,
    /// Faces with the corners and the winding of an earlier one, beyond those that lie back to back with another.
    pub duplicates: Findings<DuplicatePlace>,
    /// Faces with the corners of an earlier one, where as many have one winding as the other but for one at most.
    pub opposed_duplicates: Findings<DuplicatePlace>,
    /// True if every face occurs an even number of times, in any winding; true also where there are no faces.
    pub every_triangle_even: bool,
    /// Closed shells that face inwards and are not cavities.
    pub inside_out: Findings<ShellPlace>,
    /// Closed shells that lie inside a solid and face outwards.
    pub solids_in_solids: Findings<ShellPlace>,
    /// See [`TriangleMesh::signed_volume`](crate::mesh::TriangleMesh::signed_volume).
    pub signed_volume: f64,
    /// See [`TriangleMesh::area`](crate::mesh::TriangleMesh::area).
    pub area: f64,
    /// See [`TriangleMesh::bounds`](crate::mesh::TriangleMesh::bounds).
    pub bounds: Option<Aabb>,
    /// Vertices of faces − edges + faces.
    pub euler_characteristic: i64,
    /// The sum of the genera of all components, where the mesh is a closed, oriented manifold.
    pub genus: Option<usize>,
}

/// The severity of a defect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// For information; results are right.
    Note,
    /// The mesh is a solid, but perhaps not the intended one.
    Warning,
    /// The mesh is not a solid.
    Error,
}

/// One kind of defect, with all its findings.
///
/// Displays as an English sentence that counts them and names the first.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Defect {
    /// The mesh has no triangles.
    NoTriangles,
    /// See [`MeshReport::bad_indices`].
    BadIndices(Findings<BadIndex>),
    /// See [`MeshReport::bad_positions`].
    BadPositions(Findings<BadPosition>),
    /// See [`MeshReport::open_edges`].
    OpenEdges(Findings<EdgePlace>),
    /// See [`MeshReport::odd_edges`].
    OddEdges(Findings<EdgePlace>),
    /// See [`MeshReport::unbalanced_edges`].
    UnbalancedEdges(Findings<EdgePlace>),
    /// See [`MeshReport::inside_out`].
    InsideOut(Findings<ShellPlace>),
    /// See [`MeshReport::every_triangle_even`]. Such a mesh is empty under the even-odd rule.
    AllDoubled,
    /// The mesh is closed and oriented, and its signed volume is zero or negative.
    NoVolume {
        /// See [`MeshReport::signed_volume`].
        signed_volume: f64,
    },
    /// See [`MeshReport::solids_in_solids`].
    SolidsInSolids(Findings<ShellPlace>),
    /// See [`MeshReport::duplicates`].
    Duplicates(Findings<DuplicatePlace>),
    /// See [`MeshReport::opposed_duplicates`].
    OpposedDuplicates(Findings<DuplicatePlace>),
    /// See [`MeshReport::non_manifold_edges`].
    NonManifoldEdges(Findings<EdgePlace>),
    /// See [`MeshReport::non_manifold_vertices`].
    NonManifoldVertices(Findings<VertexPlace>),
    /// See [`MeshReport::repeated_corners`].
    RepeatedCorners(Findings<TrianglePlace>),
    /// See [`MeshReport::collinear`].
    Collinear(Findings<TrianglePlace>),
}

impl<P> Default for Findings<P> {
    fn default() -> Self {
        Findings { count: 0, first: Vec::new() }
    }
}

impl<P> Findings<P> {
    pub(super) fn add(&mut self, place: impl FnOnce() -> P) {
        self.count += 1;
        if self.first.len() < FIRST {
            self.first.push(place());
        }
    }
}

impl MeshReport {
    /// Returns whether the mesh has triangles, all indices are in range, all used coordinates finite, and all edges of
    /// even valence: the requirements of a sampler.
    pub fn is_closed(&self) -> bool {
        self.triangles > 0
            && self.bad_indices.count == 0
            && self.bad_positions.count == 0
            && self.open_edges.count == 0
            && self.odd_edges.count == 0
    }

    /// Returns whether every edge is used as often in one direction as in the other.
    pub fn is_oriented(&self) -> bool {
        self.open_edges.count == 0 && self.odd_edges.count == 0 && self.unbalanced_edges.count == 0
    }

    /// Returns whether the mesh bounds a solid as it stands: no defect is an error.
    pub fn is_solid(&self) -> bool {
        self.defects().iter().all(|defect| defect.severity() < Severity::Error)
    }

    /// Returns all defects, errors first.
    pub fn defects(&self) -> Vec<Defect> {
        fn add<P: Clone>(defects: &mut Vec<Defect>, kind: fn(Findings<P>) -> Defect, findings: &Findings<P>) {
            if findings.count > 0 {
                defects.push(kind(findings.clone()));
            }
        }
        let mut defects = Vec::new();
        if self.triangles == 0 {
            defects.push(Defect::NoTriangles);
        }
        add(&mut defects, Defect::BadIndices, &self.bad_indices);
        add(&mut defects, Defect::BadPositions, &self.bad_positions);
        add(&mut defects, Defect::OpenEdges, &self.open_edges);
        add(&mut defects, Defect::OddEdges, &self.odd_edges);
        add(&mut defects, Defect::UnbalancedEdges, &self.unbalanced_edges);
        add(&mut defects, Defect::InsideOut, &self.inside_out);
        if self.every_triangle_even && self.repeated_corners.count < self.triangles {
            defects.push(Defect::AllDoubled);
        }
        let has_volume = self.signed_volume > 0.0 && self.repeated_corners.count < self.triangles;
        if self.is_closed() && self.is_oriented() && !has_volume {
            defects.push(Defect::NoVolume { signed_volume: self.signed_volume });
        }
        add(&mut defects, Defect::SolidsInSolids, &self.solids_in_solids);
        add(&mut defects, Defect::Duplicates, &self.duplicates);
        add(&mut defects, Defect::OpposedDuplicates, &self.opposed_duplicates);
        add(&mut defects, Defect::NonManifoldEdges, &self.non_manifold_edges);
        add(&mut defects, Defect::NonManifoldVertices, &self.non_manifold_vertices);
        add(&mut defects, Defect::RepeatedCorners, &self.repeated_corners);
        add(&mut defects, Defect::Collinear, &self.collinear);
        defects
    }
}

impl Defect {
    /// Returns a stable name for scripts.
    pub fn code(&self) -> &'static str {
        self.kind().0
    }

    /// Returns the severity of the defect.
    pub fn severity(&self) -> Severity {
        self.kind().1
    }

    fn kind(&self) -> (&'static str, Severity) {
        match self {
            Defect::NoTriangles => ("no-triangles", Severity::Error),
            Defect::BadIndices(_) => ("index-out-of-range", Severity::Error),
            Defect::BadPositions(_) => ("coordinate-not-finite", Severity::Error),
            Defect::OpenEdges(_) => ("open-edge", Severity::Error),
            Defect::OddEdges(_) => ("odd-edge", Severity::Error),
            Defect::UnbalancedEdges(_) => ("unbalanced-edge", Severity::Error),
            Defect::InsideOut(_) => ("inside-out", Severity::Error),
            Defect::AllDoubled => ("all-doubled", Severity::Error),
            Defect::NoVolume { .. } => ("no-volume", Severity::Error),
            Defect::SolidsInSolids(_) => ("solid-in-solid", Severity::Warning),
            Defect::Duplicates(_) => ("duplicate-triangle", Severity::Warning),
            Defect::OpposedDuplicates(_) => ("opposed-duplicate-triangle", Severity::Warning),
            Defect::NonManifoldEdges(_) => ("non-manifold-edge", Severity::Note),
            Defect::NonManifoldVertices(_) => ("non-manifold-vertex", Severity::Note),
            Defect::RepeatedCorners(_) => ("repeated-corner", Severity::Note),
            Defect::Collinear(_) => ("collinear-triangle", Severity::Note),
        }
    }

    /// Returns the number of findings; 1 for defects of the mesh as a whole.
    pub fn count(&self) -> usize {
        match self {
            Defect::NoTriangles | Defect::AllDoubled | Defect::NoVolume { .. } => 1,
            Defect::BadIndices(findings) => findings.count,
            Defect::BadPositions(findings) => findings.count,
            Defect::OpenEdges(findings)
            | Defect::OddEdges(findings)
            | Defect::UnbalancedEdges(findings)
            | Defect::NonManifoldEdges(findings) => findings.count,
            Defect::NonManifoldVertices(findings) => findings.count,
            Defect::InsideOut(findings) | Defect::SolidsInSolids(findings) => findings.count,
            Defect::Duplicates(findings) | Defect::OpposedDuplicates(findings) => findings.count,
            Defect::RepeatedCorners(findings) | Defect::Collinear(findings) => findings.count,
        }
    }
}
