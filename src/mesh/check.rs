//! The exact check of a mesh: all its defects, with counts and first places.
//!
//! Identical coordinates are one vertex (−0 and 0 are identical). A triangle whose indices are in range and whose
//! corners are three different vertices is a *face*; only faces have edges. The check compares coordinates and counts
//! exactly, except in three questions: whether corners are collinear, which it decides exactly with expansions of
//! floating-point numbers (Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric
//! predicates", 1997); and the sign of the volume of a shell and whether one shell lies inside another, where an answer
//! too close to call counts as no finding.
//!
//! # Shells and components
//! A component is a set of faces connected by shared edges. A shell is a part of a component that bounds something by
//! itself: faces are joined across every edge that has two uses. At an edge with more, the parts that meet there and do
//! not each have as many uses in one direction as in the other are sorted by their angle around the edge, and two are
//! joined where the solid lies between them. So two cubes that touch in an edge or a whole face are one component and
//! two shells, and one that is inside out is found although it touches the other.
//!
//! # Inside and outside
//! The depth of a closed shell is the number of closed shells that contain it, by the parity of the crossings of a ray
//! upwards from one of its vertices. The ray is perturbed symbolically and its crossings with edges are decided
//! exactly, so it can pass through edges and vertices; where it starts too near the other surface to call, another
//! point of the shell is tried. At even depth a shell should face outwards; at odd depth it is a cavity and should face
//! inwards.

use std::fmt;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::closed::position_hash;
use super::measure::{EMPTY, include};
use super::{Aabb, TriangleMesh};

/// Number of places of each kind of defect that are kept beside the count.
const FIRST: usize = 5;

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

/// The findings of [`check`] for one mesh.
#[derive(Clone, Debug)]
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
    /// Closed parts of the mesh that bound something by themselves; see the [module](self).
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
    /// See [`TriangleMesh::signed_volume`].
    pub signed_volume: f64,
    /// See [`TriangleMesh::area`].
    pub area: f64,
    /// See [`TriangleMesh::bounds`].
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

/// Checks a mesh with exact comparisons and reports all its defects.
///
/// The report does not depend on the thread count. It takes about a second for a million triangles; use
/// [`super::ClosedMesh::check`] where the question is only whether the mesh is closed.
pub fn check(mesh: &TriangleMesh) -> MeshReport {
    let mut report = MeshReport {
        triangles: mesh.triangles.len(),
        vertices: 0,
        edges: 0,
        components: 0,
        shells: 0,
        bad_indices: Findings::default(),
        bad_positions: Findings::default(),
        open_edges: Findings::default(),
        odd_edges: Findings::default(),
        unbalanced_edges: Findings::default(),
        non_manifold_edges: Findings::default(),
        non_manifold_vertices: Findings::default(),
        repeated_corners: Findings::default(),
        collinear: Findings::default(),
        duplicates: Findings::default(),
        opposed_duplicates: Findings::default(),
        every_triangle_even: false,
        inside_out: Findings::default(),
        solids_in_solids: Findings::default(),
        signed_volume: mesh.signed_volume(),
        area: mesh.area(),
        bounds: mesh.bounds(),
        euler_characteristic: 0,
        genus: None,
    };
    let (vertices, faces) = weld(mesh, &mut report);
    report.vertices = vertices.len();
    find_collinear(&vertices, &faces, &mut report);
    let uses = edge_uses(&faces);
    let shells = connect(&vertices, &faces, &uses, &mut report);
    judge(&vertices, &faces, &shells, &mut report);
    report
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
        if self.triangles > 0 && self.every_triangle_even {
            defects.push(Defect::AllDoubled);
        }
        if self.is_closed() && self.is_oriented() && self.signed_volume <= 0.0 {
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
        match self {
            Defect::NoTriangles => "no-triangles",
            Defect::BadIndices(_) => "index-out-of-range",
            Defect::BadPositions(_) => "coordinate-not-finite",
            Defect::OpenEdges(_) => "open-edge",
            Defect::OddEdges(_) => "odd-edge",
            Defect::UnbalancedEdges(_) => "unbalanced-edge",
            Defect::InsideOut(_) => "inside-out",
            Defect::AllDoubled => "all-doubled",
            Defect::NoVolume { .. } => "no-volume",
            Defect::SolidsInSolids(_) => "solid-in-solid",
            Defect::Duplicates(_) => "duplicate-triangle",
            Defect::OpposedDuplicates(_) => "opposed-duplicate-triangle",
            Defect::NonManifoldEdges(_) => "non-manifold-edge",
            Defect::NonManifoldVertices(_) => "non-manifold-vertex",
            Defect::RepeatedCorners(_) => "repeated-corner",
            Defect::Collinear(_) => "collinear-triangle",
        }
    }

    /// Returns the severity of the defect.
    pub fn severity(&self) -> Severity {
        match self {
            Defect::NoTriangles
            | Defect::BadIndices(_)
            | Defect::BadPositions(_)
            | Defect::OpenEdges(_)
            | Defect::OddEdges(_)
            | Defect::UnbalancedEdges(_)
            | Defect::InsideOut(_)
            | Defect::AllDoubled
            | Defect::NoVolume { .. } => Severity::Error,
            Defect::SolidsInSolids(_) | Defect::Duplicates(_) | Defect::OpposedDuplicates(_) => Severity::Warning,
            Defect::NonManifoldEdges(_)
            | Defect::NonManifoldVertices(_)
            | Defect::RepeatedCorners(_)
            | Defect::Collinear(_) => Severity::Note,
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

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Defect::NoTriangles => write!(f, "The mesh has no triangles."),
            Defect::BadIndices(found) => {
                found.lead(f, "index is out of range", "indices are out of range")?;
                found.name(f, |f, bad| write!(f, "{} in triangle {}", bad.index, bad.triangle))
            }
            Defect::BadPositions(found) => {
                found.lead(f, "position is not finite", "positions are not finite")?;
                found.name(f, |f, bad| {
                    write!(f, "position {} at {}, used by triangle {}", bad.index, Point(bad.position), bad.triangle)
                })
            }
            Defect::OpenEdges(found) => {
                found.lead(
                    f,
                    "edge is open, used by one triangle only",
                    "edges are open, used by one triangle only",
                )?;
                found.name(f, |f, edge| edge.name(f))
            }
            Defect::OddEdges(found) => {
                let (one, many) =
                    ("edge is used by an odd number of triangles", "edges are used by an odd number of triangles");
                found.lead(f, one, many)?;
                found.name(f, |f, edge| edge.name(f))
            }
            Defect::UnbalancedEdges(found) => {
                let one = "edge joins triangles that face opposite ways";
                found.lead(f, one, "edges join triangles that face opposite ways")?;
                found.name(f, |f, edge| edge.name(f))
            }
            Defect::InsideOut(found) => {
                found.lead(f, "shell is inside out", "shells are inside out")?;
                found.name(f, |f, shell| shell.name(f))
            }
            Defect::Duplicates(found) => {
                let one = "triangle repeats an earlier one";
                found.lead(f, one, "triangles repeat earlier ones")?;
                found.name(f, |f, duplicate| duplicate.name(f))
            }
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
                found.lead(f, one, "shells lie inside a solid and face outwards, as solids within a solid")?;
                found.name(f, |f, shell| shell.name(f))
            }
            Defect::OpposedDuplicates(found) => {
                let one = "triangle lies back to back with an earlier one";
                found.lead(f, one, "triangles lie back to back with earlier ones")?;
                found.name(f, |f, duplicate| duplicate.name(f))
            }
            Defect::NonManifoldEdges(found) => {
                found.lead(
                    f,
                    "edge is shared by more than two triangles",
                    "edges are shared by more than two triangles",
                )?;
                found.name(f, |f, edge| edge.name(f))
            }
            Defect::NonManifoldVertices(found) => {
                let one = "vertex joins parts of the surface that no edge joins";
                found.lead(f, one, "vertices join parts of the surface that no edge joins")?;
                found.name(f, |f, vertex| write!(f, "{}, where {} parts meet", Point(vertex.position), vertex.fans))
            }
            Defect::RepeatedCorners(found) => {
                found.lead(f, "triangle has identical corners", "triangles have identical corners")?;
                found.name(f, |f, place| place.name(f))
            }
            Defect::Collinear(found) => {
                let one = "triangle has no area, its corners being on a line";
                found.lead(f, one, "triangles have no area, their corners being on a line")?;
                found.name(f, |f, place| place.name(f))
            }
        }
    }
}

impl<P> Default for Findings<P> {
    fn default() -> Self {
        Findings { count: 0, first: Vec::new() }
    }
}

impl<P> Findings<P> {
    fn add(&mut self, place: impl FnOnce() -> P) {
        self.count += 1;
        if self.first.len() < FIRST {
            self.first.push(place());
        }
    }

    /// Writes the beginning of a sentence: the count.
    fn lead(&self, f: &mut fmt::Formatter<'_>, one: &str, many: &str) -> fmt::Result {
        write!(f, "{} {}", self.count, if self.count == 1 { one } else { many })
    }

    /// Writes the end of a sentence: the first place.
    fn name(
        &self,
        f: &mut fmt::Formatter<'_>,
        name: impl Fn(&mut fmt::Formatter<'_>, &P) -> fmt::Result,
    ) -> fmt::Result {
        if let Some(place) = self.first.first() {
            f.write_str(if self.count == 1 { ": " } else { "; the first is " })?;
            name(f, place)?;
        }
        f.write_str(".")
    }
}

/// A number in its shortest exact form: with an exponent where it would be mostly zeros without.
struct Number(f64);

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
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

impl fmt::Display for Point {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Point(DVec3 { x, y, z }) = *self;
        write!(f, "({}, {}, {})", Number(x), Number(y), Number(z))
    }
}

impl EdgePlace {
    fn name(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
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

impl TrianglePlace {
    fn name(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b, c] = self.corners.map(Point);
        write!(f, "triangle {} with corners {a}, {b}, {c}", self.triangle)
    }
}

impl DuplicatePlace {
    fn name(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b, c] = self.corners.map(Point);
        write!(f, "triangles {} and {} with corners {a}, {b}, {c}", self.earlier, self.triangle)
    }
}

impl ShellPlace {
    fn name(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ShellPlace { triangle, faces, .. } = self;
        let (volume, min, max) = (Number(self.signed_volume), Point(self.bounds.min), Point(self.bounds.max));
        write!(f, "{faces} triangles from triangle {triangle} on, volume {volume}, between {min} and {max}")
    }
}

/// A triangle that has edges: its corners are three different vertices.
struct Face {
    triangle: usize,
    corners: [u32; 3],
}

/// Welds identical positions into vertices, numbered in the order of use, and separates the triangles that have no
/// edges.
fn weld(mesh: &TriangleMesh, report: &mut MeshReport) -> (Vec<DVec3>, Vec<Face>) {
    const UNSEEN: u32 = u32::MAX;
    let TriangleMesh { positions, triangles } = mesh;
    let most = positions.len().min(3 * triangles.len());
    let mut table = vec![UNSEEN; (2 * most).next_power_of_two()];
    let mask = table.len() - 1;
    let mut vertices: Vec<DVec3> = Vec::new();
    let mut vertex_from_index = vec![UNSEEN; positions.len()];
    let mut faces = Vec::with_capacity(triangles.len());
    let bits = |position: DVec3| position.to_array().map(f64::to_bits);
    for (triangle, indices) in triangles.iter().enumerate() {
        let mut in_range = true;
        let corners = indices.map(|index| {
            let Some(&position) = positions.get(index as usize) else {
                report.bad_indices.add(|| BadIndex { triangle, index });
                in_range = false;
                return UNSEEN;
            };
            if vertex_from_index[index as usize] != UNSEEN {
                return vertex_from_index[index as usize];
            }
            if !position.is_finite() {
                report.bad_positions.add(|| BadPosition { triangle, index, position });
            }
            // Adding +0 turns −0 into +0 and changes no other number.
            let position = position + DVec3::ZERO;
            let mut slot = position_hash(position)[0] as usize & mask;
            let vertex = loop {
                let vertex = table[slot];
                if vertex == UNSEEN {
                    table[slot] = vertices.len() as u32;
                    vertices.push(position);
                    break table[slot];
                }
                if bits(vertices[vertex as usize]) == bits(position) {
                    break vertex;
                }
                slot = (slot + 1) & mask;
            };
            vertex_from_index[index as usize] = vertex;
            vertex
        });
        if !in_range {
            continue;
        }
        let [a, b, c] = corners;
        if a == b || b == c || c == a {
            let corners = corners.map(|vertex| vertices[vertex as usize]);
            report.repeated_corners.add(|| TrianglePlace { triangle, corners });
        } else {
            faces.push(Face { triangle, corners });
        }
    }
    (vertices, faces)
}

fn find_collinear(vertices: &[DVec3], faces: &[Face], report: &mut MeshReport) {
    let collinear: Vec<&Face> =
        faces.par_iter().filter(|face| are_collinear(face.corners.map(|v| vertices[v as usize]))).collect();
    for face in collinear {
        let corners = face.corners.map(|v| vertices[v as usize]);
        report.collinear.add(|| TrianglePlace { triangle: face.triangle, corners });
    }
}

/// One use of an edge by a face. Sorting brings the uses of an edge together, in the order of faces.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Use {
    /// The lower vertex in the high half, the higher in the low half.
    edge: u64,
    /// Face, then side, then direction: (3 · face + side) · 2 + 1 where the use goes from the lower vertex to the higher.
    at: u64,
}

impl Use {
    fn face(self) -> usize {
        self.corner() / 3
    }

    /// Returns three times the face plus the corner that the side starts from.
    fn corner(self) -> usize {
        (self.at >> 1) as usize
    }

    fn is_forward(self) -> bool {
        self.at & 1 == 1
    }

    /// Returns the corners at the lower and the higher vertex.
    fn corners(self) -> [usize; 2] {
        let from = self.corner();
        let to = if from % 3 == 2 { from - 2 } else { from + 1 };
        if self.is_forward() { [from, to] } else { [to, from] }
    }
}

fn edge_uses(faces: &[Face]) -> Vec<Use> {
    let mut uses: Vec<Use> = faces
        .par_iter()
        .enumerate()
        .flat_map_iter(|(face, Face { corners, .. })| {
            (0..3).map(move |side| {
                let (from, to) = (u64::from(corners[side]), u64::from(corners[(side + 1) % 3]));
                let edge = from.min(to) << 32 | from.max(to);
                Use { edge, at: (3 * face + side) as u64 * 2 + u64::from(from < to) }
            })
        })
        .collect();
    uses.par_sort_unstable();
    uses
}

/// A closed part of the surface; see the module's docs.
struct Shell {
    faces: Vec<usize>,
    bounds: Aabb,
    signed_volume: f64,
    /// The sum of the absolute values of all products in the volume, to tell a volume from its rounding.
    volume_scale: f64,
}

/// Finds everything that edges determine: their defects, duplicates, components, genus. Returns the closed shells.
fn connect(vertices: &[DVec3], faces: &[Face], uses: &[Use], report: &mut MeshReport) -> Vec<Shell> {
    let mut components = Sets::new(faces.len());
    let mut shells = Sets::new(faces.len());
    let mut fans = Sets::new(3 * faces.len());
    let position = |vertex: u64| vertices[vertex as u32 as usize];
    let (mut duplicates, mut even) = (Vec::new(), 0);
    for run in uses.chunk_by(|a, b| a.edge == b.edge) {
        report.edges += 1;
        let (count, forward) = (run.len(), run.iter().filter(|u| u.is_forward()).count());
        let place = || EdgePlace {
            ends: [position(run[0].edge >> 32), position(run[0].edge)],
            uses: count,
            forward,
            triangles: run.iter().take(FIRST).map(|u| faces[u.face()].triangle).collect(),
        };
        match count {
            1 => report.open_edges.add(place),
            _ if !count.is_multiple_of(2) => report.odd_edges.add(place),
            _ => {
                if 2 * forward != count {
                    report.unbalanced_edges.add(place);
                }
                if count > 2 {
                    report.non_manifold_edges.add(place);
                }
            }
        }
        for pair in run.windows(2) {
            components.join(pair[0].face(), pair[1].face());
            let (first, second) = (pair[0].corners(), pair[1].corners());
            fans.join(first[0], second[0]);
            fans.join(first[1], second[1]);
        }
        if count == 2 {
            shells.join(run[0].face(), run[1].face());
        }
        if count > 1 {
            even += find_duplicates(faces, run, &mut duplicates);
        }
    }
    report_duplicates(vertices, faces, duplicates, report);
    report.every_triangle_even = even == faces.len();

    // Joining whole shells keeps balanced shells balanced, so that earlier runs stay balanced.
    for run in uses.chunk_by(|a, b| a.edge == b.edge).filter(|run| run.len() > 2) {
        join_around(vertices, faces, run, &mut shells);
    }
    let mut closed = vec![true; faces.len()];
    for run in uses.chunk_by(|a, b| a.edge == b.edge) {
        match run {
            [a, b] if a.is_forward() != b.is_forward() => {}
            _ => balance(run, &mut shells).iter().filter(|b| !b.is_balanced()).for_each(|b| closed[b.shell] = false),
        }
    }

    if report.bad_positions.count > 0 {
        // Faces without a finite position bound nothing.
        let is_nowhere = |face: &Face| face.corners.iter().any(|&vertex| !vertices[vertex as usize].is_finite());
        for face in (0..faces.len()).filter(|&face| is_nowhere(&faces[face])) {
            closed[shells.root(face)] = false;
        }
    }
    report.components = components.count();
    count_fans(vertices, faces, &mut fans, report);
    let mut shell_from_root = vec![usize::MAX; faces.len()];
    let mut face_lists: Vec<Vec<usize>> = Vec::new();
    for face in 0..faces.len() {
        let root = shells.root(face);
        if !closed[root] {
            continue;
        }
        if shell_from_root[root] == usize::MAX {
            shell_from_root[root] = face_lists.len();
            face_lists.push(Vec::new());
        }
        face_lists[shell_from_root[root]].push(face);
    }
    report.shells = face_lists.len();
    face_lists.into_par_iter().map(|list| Shell::new(vertices, faces, list)).collect()
}

/// The uses of an edge by a shell: their number, and the excess of forward over backward ones.
struct Balance {
    shell: usize,
    uses: usize,
    excess: isize,
}

impl Balance {
    /// Returns whether the edge would be closed and balanced if there were only this shell.
    fn is_balanced(&self) -> bool {
        self.excess == 0 && self.uses.is_multiple_of(2)
    }
}

/// Returns the balance of each shell that meets in an edge.
fn balance(run: &[Use], shells: &mut Sets) -> Vec<Balance> {
    let mut uses: Vec<(usize, bool)> = run.iter().map(|u| (shells.root(u.face()), u.is_forward())).collect();
    uses.sort_unstable();
    let of_shell = |uses: &[(usize, bool)]| {
        let forward = uses.iter().filter(|(_, forward)| *forward).count();
        Balance { shell: uses[0].0, uses: uses.len(), excess: 2 * forward as isize - uses.len() as isize }
    };
    uses.chunk_by(|a, b| a.0 == b.0).map(of_shell).collect()
}

/// Joins shells across an edge of more than two uses, where the solid lies between two faces.
fn join_around(vertices: &[DVec3], faces: &[Face], run: &[Use], shells: &mut Sets) {
    let unbalanced = balance(run, shells).iter().filter(|b| !b.is_balanced()).map(|b| b.shell).collect::<Vec<_>>();
    if unbalanced.is_empty() {
        return;
    }
    let position = |vertex: u32| vertices[vertex as usize];
    let foot = position((run[0].edge >> 32) as u32);
    let along = (position(run[0].edge as u32) - foot).normalize_or_zero();
    let right = along.any_orthonormal_vector();
    let up = along.cross(right);
    // A number that grows with the angle, from 0 to 4 for a full turn. It is rounded so that coplanar faces are equal.
    let turn = |face: &Face, corner: usize| {
        let arm = position(face.corners[(corner + 2) % 3]) - foot;
        let (x, y) = (arm.dot(right), arm.dot(up));
        let quarter = if y >= 0.0 { 1.0 - x / (x.abs() + y) } else { 3.0 + x / (x.abs() - y) };
        (quarter * f64::from(1 << 28)).round() as i64 % (4 << 28)
    };
    // Going round, the solid begins behind a face that uses the edge backwards and ends at one that uses it forwards.
    // Of faces at the same angle those that end a solid come first, or touching solids would be one. Among those that
    // also face the same way, any pairing is right that is the same at all their edges, whichever way these run: the
    // order of faces where solids begin and the reverse where they end, as brackets nest.
    let mut around: Vec<(i64, bool, i64, Use)> = run
        .iter()
        .filter(|u| unbalanced.binary_search(&shells.root(u.face())).is_ok())
        .map(|u| {
            let rank = u.face() as i64;
            let rank = if u.is_forward() { -rank } else { rank };
            (turn(&faces[u.face()], u.corner() % 3), !u.is_forward(), rank, *u)
        })
        .collect();
    around.sort_unstable();
    let (mut begun, mut left): (Vec<usize>, Vec<usize>) = (Vec::new(), Vec::new());
    for (_, begins, _, u) in around {
        if begins {
            begun.push(u.face());
        } else if let Some(other) = begun.pop() {
            shells.join(u.face(), other);
        } else {
            left.push(u.face());
        }
    }
    for end in left {
        // A solid that began before the turn was over ends after its start.
        if let Some(other) = begun.pop() {
            shells.join(end, other);
        }
    }
}

/// A face that has the corners of an earlier one.
struct Duplicate {
    face: usize,
    earlier: usize,
    opposed: bool,
}

/// Finds the faces of an edge that have the third corner in common. Each is found at one of its edges only, the one
/// between its two lower vertices. Returns the number of faces that occur an even number of times.
fn find_duplicates(faces: &[Face], run: &[Use], duplicates: &mut Vec<Duplicate>) -> usize {
    let apex = |u: &Use| faces[u.face()].corners[(u.corner() + 2) % 3];
    if let [a, b] = run
        && apex(a) != apex(b)
    {
        return 0;
    }
    let high = run[0].edge as u32;
    let mut sorted: Vec<(u32, Use)> = run.iter().map(|u| (apex(u), *u)).filter(|(apex, _)| *apex > high).collect();
    sorted.sort_unstable();
    let mut even = 0;
    for same in sorted.chunk_by(|a, b| a.0 == b.0) {
        even += if same.len().is_multiple_of(2) { same.len() } else { 0 };
        let forward = same.iter().filter(|(_, u)| u.is_forward()).count();
        // The surplus after faces back to back have cancelled, without the one that would be right.
        let mut surplus = forward.abs_diff(same.len() - forward).saturating_sub(1);
        let is_surplus = |u: Use| u.is_forward() == (2 * forward > same.len());
        for (_, later) in same[1..].iter().rev() {
            let opposed = surplus == 0 || !is_surplus(*later);
            surplus -= usize::from(!opposed);
            duplicates.push(Duplicate { face: later.face(), earlier: same[0].1.face(), opposed });
        }
    }
    even
}

fn report_duplicates(vertices: &[DVec3], faces: &[Face], mut duplicates: Vec<Duplicate>, report: &mut MeshReport) {
    duplicates.sort_unstable_by_key(|duplicate| duplicate.face);
    for Duplicate { face, earlier, opposed } in duplicates {
        let findings = if opposed { &mut report.opposed_duplicates } else { &mut report.duplicates };
        findings.add(|| DuplicatePlace {
            triangle: faces[face].triangle,
            earlier: faces[earlier].triangle,
            corners: faces[face].corners.map(|vertex| vertices[vertex as usize]),
        });
    }
}

/// Counts the fans of faces at every vertex, then classifies the surface by its Euler characteristic.
fn count_fans(vertices: &[DVec3], faces: &[Face], fans: &mut Sets, report: &mut MeshReport) {
    let mut at_vertex = vec![0; vertices.len()];
    for corner in 0..3 * faces.len() {
        if fans.root(corner) == corner {
            at_vertex[faces[corner / 3].corners[corner % 3] as usize] += 1;
        }
    }
    for (&position, &fans) in vertices.iter().zip(&at_vertex) {
        if fans > 1 {
            report.non_manifold_vertices.add(|| VertexPlace { position, fans });
        }
    }
    let used = at_vertex.iter().filter(|fans| **fans > 0).count();
    report.euler_characteristic = used as i64 - report.edges as i64 + faces.len() as i64;
    let manifold = report.non_manifold_edges.count == 0 && report.non_manifold_vertices.count == 0;
    if report.is_closed() && report.is_oriented() && manifold {
        // A closed, oriented surface of genus g has the characteristic 2 − 2g, so the difference is even.
        report.genus = Some((2 * report.components as i64 - report.euler_characteristic) as usize / 2);
    }
}

impl Shell {
    fn new(vertices: &[DVec3], faces: &[Face], list: Vec<usize>) -> Shell {
        let corners = |face: &usize| faces[*face].corners.map(|vertex| vertices[vertex as usize]);
        let bounds = list.iter().flat_map(corners).fold(EMPTY, include);
        let centre = bounds.min * 0.5 + bounds.max * 0.5;
        let (mut signed_volume, mut volume_scale) = (0.0, 0.0);
        for face in &list {
            let [a, b, c] = corners(face).map(|corner| corner - centre);
            signed_volume += a.dot(b.cross(c)) / 6.0;
            let [a, b, c] = [a.abs(), b.abs(), c.abs()];
            let products = DVec3::new(b.y * c.z + b.z * c.y, b.z * c.x + b.x * c.z, b.x * c.y + b.y * c.x);
            volume_scale += a.dot(products) / 6.0;
        }
        Shell { faces: list, bounds, signed_volume, volume_scale }
    }

    /// Returns outwards, inwards, or neither where the volume is zero to within rounding, or NaN.
    fn facing(&self) -> Facing {
        if self.signed_volume > 1e-12 * self.volume_scale {
            Facing::Outwards
        } else if self.signed_volume < -1e-12 * self.volume_scale {
            Facing::Inwards
        } else {
            Facing::Neither
        }
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Facing {
    Outwards,
    Inwards,
    Neither,
}

/// Finds shells that face the wrong way for their depth.
fn judge(vertices: &[DVec3], faces: &[Face], shells: &[Shell], report: &mut MeshReport) {
    let cells = Cells::new(shells);
    let contents: Vec<Vec<usize>> = (0..shells.len())
        .into_par_iter()
        .map(|outer| {
            let Aabb { min, max } = shells[outer].bounds;
            let nested = |&shell: &usize| {
                let inner = shells[shell].bounds;
                shell != outer && inner.min.cmpge(min).all() && inner.max.cmple(max).all()
            };
            // A shell inside another has its box inside the other's box.
            let candidates = cells.near(&shells[outer].bounds).filter(nested).collect();
            contained(vertices, faces, &shells[outer], shells, candidates)
        })
        .collect();
    let mut depths = vec![0usize; shells.len()];
    contents.iter().flatten().for_each(|&inner| depths[inner] += 1);
    for (shell, depth) in shells.iter().zip(depths) {
        let findings = match (shell.facing(), depth % 2) {
            (Facing::Inwards, 0) => &mut report.inside_out,
            (Facing::Outwards, 1) => &mut report.solids_in_solids,
            _ => continue,
        };
        findings.add(|| ShellPlace {
            triangle: faces[shell.faces[0]].triangle,
            faces: shell.faces.len(),
            signed_volume: shell.signed_volume,
            depth,
            bounds: shell.bounds,
        });
    }
}

/// Shells by the lower corners of their boxes, in about as many cells as there are shells.
struct Cells {
    origin: DVec3,
    size: DVec3,
    side: usize,
    /// The offset of the shells of each cell, and the end of the last.
    starts: Vec<usize>,
    shells: Vec<usize>,
}

impl Cells {
    fn new(shells: &[Shell]) -> Cells {
        let bounds = shells.iter().fold(EMPTY, |bounds, shell| include(bounds, shell.bounds.min));
        let side = (shells.len() as f64).cbrt().ceil() as usize;
        let size = (bounds.max - bounds.min) / side as f64;
        let mut cells = Cells { origin: bounds.min, size, side, starts: Vec::new(), shells: Vec::new() };
        let mut order: Vec<(usize, usize)> = shells
            .iter()
            .enumerate()
            .map(|(shell, Shell { bounds, .. })| {
                let [x, y, z] = cells.cell(bounds.min);
                ((z * side + y) * side + x, shell)
            })
            .collect();
        order.sort_unstable();
        cells.starts = (0..=side.pow(3)).map(|cell| order.partition_point(|(c, _)| *c < cell)).collect();
        cells.shells = order.into_iter().map(|(_, shell)| shell).collect();
        cells
    }

    /// Returns the cell of a point, or the nearest one. It is monotone in every coordinate, which is sufficient.
    fn cell(&self, point: DVec3) -> [usize; 3] {
        // Where all lie in one plane the quotient is NaN, which becomes cell 0.
        let quotient = (point - self.origin) / self.size;
        quotient.to_array().map(|q| (q as usize).min(self.side.saturating_sub(1)))
    }

    /// Returns a superset of the shells whose boxes have their lower corners inside the box.
    fn near(&self, bounds: &Aabb) -> impl Iterator<Item = usize> + '_ {
        let (low, high) = (self.cell(bounds.min), self.cell(bounds.max));
        let rows =
            (low[2]..=high[2]).flat_map(move |z| (low[1]..=high[1]).map(move |y| (z * self.side + y) * self.side));
        rows.flat_map(move |row| &self.shells[self.starts[row + low[0]]..self.starts[row + high[0] + 1]]).copied()
    }
}

/// Returns the candidates that lie inside `outer`.
fn contained(
    vertices: &[DVec3],
    faces: &[Face],
    outer: &Shell,
    shells: &[Shell],
    mut candidates: Vec<usize>,
) -> Vec<usize> {
    const TRIES: usize = 8;
    let mut inside = Vec::new();
    for attempt in 0..TRIES {
        if candidates.is_empty() {
            break;
        }
        let point = |shell: usize| {
            let list = &shells[shell].faces;
            let [a, b, c] = faces[list[attempt * list.len() / TRIES]].corners.map(|vertex| vertices[vertex as usize]);
            // Where every vertex lies on the other surface, the middle of some face may not.
            if attempt % 2 == 0 { a } else { a / 3.0 + b / 3.0 + c / 3.0 }
        };
        let mut queries: Vec<Query> = candidates
            .iter()
            .map(|&shell| Query { shell, point: point(shell), crossings: 0, too_near: false })
            .collect();
        cast(vertices, faces, outer, &mut queries);
        candidates = queries.iter().filter(|query| query.too_near).map(|query| query.shell).collect();
        inside.extend(queries.iter().filter(|q| !q.too_near && q.crossings % 2 == 1).map(|q| q.shell));
    }
    inside
}

/// Distance, relative to the size of a surface, within which a point counts as lying on it.
const NEAR: f64 = 1e-12;

/// A point of a shell, and the crossings of the ray upwards from it with another shell.
struct Query {
    shell: usize,
    point: DVec3,
    crossings: usize,
    too_near: bool,
}

/// Counts, for every query, the crossings of its ray with a shell.
fn cast(vertices: &[DVec3], faces: &[Face], shell: &Shell, queries: &mut [Query]) {
    if queries.is_empty() {
        return;
    }
    queries.sort_unstable_by(|a, b| a.point.x.total_cmp(&b.point.x).then(a.shell.cmp(&b.shell)));
    let margin = (shell.bounds.max - shell.bounds.min).max_element() * NEAR;
    for &face in &shell.faces {
        let [a, b, c] = faces[face].corners.map(|vertex| vertices[vertex as usize]);
        let (min, max) = (a.min(b).min(c) - margin, a.max(b).max(c) + margin);
        let start = queries.partition_point(|query| query.point.x < min.x);
        for query in queries[start..].iter_mut().take_while(|query| query.point.x <= max.x) {
            let p = query.point;
            if p.y < min.y || p.y > max.y || p.z > max.z {
                continue;
            }
            let above = above(a, b, c, p);
            if above == 0 && p.z >= min.z {
                query.too_near = true;
                continue;
            }
            let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| side(from.truncate(), to.truncate(), p.truncate()));
            if sides[0] != 0 && sides[0] == sides[1] && sides[1] == sides[2] && above * sides[0] >= 0 {
                query.crossings += 1;
            }
        }
    }
}

/// Returns the side of a line on which an infinitesimally displaced point lies: 1 left, −1 right, 0 only if the ends
/// are identical.
///
/// The displacement is (ε, ε²), the same for every line, so that the sides of one point never contradict one another.
fn side(from: DVec2, to: DVec2, point: DVec2) -> i32 {
    let sign_of = |x: f64| i32::from(x > 0.0) - i32::from(x < 0.0);
    // Comparisons instead of differences, which could underflow.
    let compare = |a: f64, b: f64| i32::from(a > b) - i32::from(a < b);
    [sign_of(orientation(from, to, point)), compare(from.y, to.y), compare(to.x, from.x)]
        .into_iter()
        .find(|sign| *sign != 0)
        .unwrap_or(0)
}

/// Compares the plane through a, b, c with a point. Returns 1 if it is above the point and they turn left seen from
/// above, −1 if it is below or they turn right, 0 if the distance is a negligible part of their size.
fn above(a: DVec3, b: DVec3, c: DVec3, point: DVec3) -> i32 {
    let [a, b, c] = [a - point, b - point, c - point];
    let (bc, ca, ab) = (b.truncate(), c.truncate(), a.truncate());
    let cross = |u: DVec2, v: DVec2| (u.x * v.y, u.y * v.x);
    let terms = [(a.z, cross(bc, ca)), (b.z, cross(ca, ab)), (c.z, cross(ab, bc))];
    let value: f64 = terms.iter().map(|(z, (p, q))| z * (p - q)).sum();
    let size: f64 = terms.iter().map(|(z, (p, q))| z.abs() * (p.abs() + q.abs())).sum();
    // Far above the rounding, which is at most (7 + 56ε)ε of the size with ε = 2⁻⁵³; the second term covers underflow.
    let bound = NEAR * size + 1e-290;
    i32::from(value > bound) - i32::from(value < -bound)
}

/// Returns whether three positions lie on one line, exactly.
fn are_collinear([a, b, c]: [DVec3; 3]) -> bool {
    let (u, v) = (b - a, c - a);
    let products = (DVec3::new(u.y * v.z, u.z * v.x, u.x * v.y), DVec3::new(u.z * v.y, u.x * v.z, u.y * v.x));
    let bound = (products.0.abs() + products.1.abs()) * (8.0 * f64::EPSILON) + DVec3::splat(1e-290);
    if (products.0 - products.1).abs().cmpgt(bound).any() {
        return false;
    }
    let flat = |axes: fn(DVec3) -> DVec2| orientation(axes(a), axes(b), axes(c)) == 0.0;
    flat(|p| DVec2::new(p.x, p.y)) && flat(|p| DVec2::new(p.y, p.z)) && flat(|p| DVec2::new(p.z, p.x))
}

/// Returns a number with the sign of the turn from a by b to c: positive to the left, zero if and only if they are on
/// one line.
///
/// Exact unless finite coordinates along one axis differ in magnitude by a factor of more than 2⁴⁰⁰; NaN where
/// coordinates are not finite.
fn orientation(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let (left, right) = ((b.x - a.x) * (c.y - a.y), (b.y - a.y) * (c.x - a.x));
    let bound = 4.0 * f64::EPSILON * (left.abs() + right.abs()) + 1e-290;
    if (left - right).abs() > bound {
        return left - right;
    }
    // Collinearity does not change when an axis is scaled. Powers of two that bring the largest coordinate near 2⁴⁵⁰
    // leave room for the products and for their rounding errors.
    let scale = |largest: f64| {
        let exponent = (largest.to_bits() >> 52) as i64 - 1023;
        let half = |shift: i64| f64::from_bits(((1023 + shift) as u64) << 52);
        let shift = 450 - exponent;
        (half(shift / 2), half(shift - shift / 2))
    };
    let (x1, x2) = scale(a.x.abs().max(b.x.abs()).max(c.x.abs()));
    let (y1, y2) = scale(a.y.abs().max(b.y.abs()).max(c.y.abs()));
    let [a, b, c] = [a, b, c].map(|p| DVec2::new(p.x * x1 * x2, p.y * y1 * y2));
    let mut sum = Expansion::default();
    for (p, q) in [(a, b), (b, c), (c, a)] {
        sum.add_product(p.x, q.y);
        sum.add_product(-p.y, q.x);
    }
    sum.sign()
}

/// An exact sum of up to twelve numbers, as non-overlapping numbers of increasing magnitude.
#[derive(Default)]
struct Expansion {
    parts: [f64; 12],
    len: usize,
}

impl Expansion {
    fn add_product(&mut self, a: f64, b: f64) {
        let product = a * b;
        self.add(a.mul_add(b, -product));
        self.add(product);
    }

    fn add(&mut self, term: f64) {
        let (mut carried, mut kept) = (term, 0);
        for i in 0..self.len {
            let sum = carried + self.parts[i];
            let back = sum - carried;
            let lost = (carried - (sum - back)) + (self.parts[i] - back);
            carried = sum;
            if lost != 0.0 {
                self.parts[kept] = lost;
                kept += 1;
            }
        }
        if carried != 0.0 {
            self.parts[kept] = carried;
            kept += 1;
        }
        self.len = kept;
    }

    /// Returns the largest part, which has the sign of the sum.
    fn sign(&self) -> f64 {
        if self.len == 0 { 0.0 } else { self.parts[self.len - 1] }
    }
}

/// Disjoint sets (union–find) of the numbers below some bound.
struct Sets {
    parents: Vec<usize>,
}

impl Sets {
    fn new(len: usize) -> Sets {
        Sets { parents: (0..len).collect() }
    }

    /// Returns the least member of the set, so that it does not depend on the order of joining.
    fn root(&mut self, mut member: usize) -> usize {
        while self.parents[member] != member {
            self.parents[member] = self.parents[self.parents[member]];
            member = self.parents[member];
        }
        member
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.parents[a.max(b)] = a.min(b);
    }

    fn count(&self) -> usize {
        self.parents.iter().enumerate().filter(|(member, parent)| member == *parent).count()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::mesh::testing::{cube, reversed, soup, tetrahedron, together};

    fn codes(report: &MeshReport) -> Vec<(&'static str, usize)> {
        report.defects().iter().map(|defect| (defect.code(), defect.count())).collect()
    }

    fn sentence(report: &MeshReport, code: &str) -> String {
        report.defects().iter().find(|defect| defect.code() == code).unwrap().to_string()
    }

    fn unit_cube() -> TriangleMesh {
        cube(DVec3::ZERO, 1.0)
    }

    #[test]
    fn cubes_are_solids_with_shared_or_separate_vertices() {
        for mesh in [unit_cube(), soup(&unit_cube())] {
            let report = check(&mesh);
            assert!(report.is_closed() && report.is_oriented() && report.is_solid());
            assert_eq!(codes(&report), []);
            assert_eq!((report.vertices, report.edges, report.triangles), (8, 18, 12));
            assert_eq!((report.components, report.shells), (1, 1));
            assert_eq!((report.euler_characteristic, report.genus), (2, Some(0)));
            assert_eq!((report.signed_volume, report.area), (1.0, 6.0));
            assert_eq!(report.bounds, Some(Aabb { min: DVec3::ZERO, max: DVec3::ONE }));
        }
    }

    #[test]
    fn a_missing_triangle_leaves_three_open_edges() {
        let mut mesh = unit_cube();
        mesh.triangles.remove(0);
        let report = check(&mesh);
        assert!(!report.is_closed() && !report.is_oriented() && !report.is_solid());
        assert_eq!(codes(&report), [("open-edge", 3)]);
        assert_eq!((report.edges, report.euler_characteristic, report.genus), (18, 1, None));
        assert_eq!(
            sentence(&report, "open-edge"),
            "3 edges are open, used by one triangle only; the first is (0, 0, 0) to (0, 1, 1), of triangle 0."
        );
        let EdgePlace { ends, uses, forward, triangles } = &report.open_edges.first[2];
        assert_eq!((*ends, *uses, *forward), ([DVec3::new(0.0, 1.0, 1.0), DVec3::Z], 1, 1));
        assert_eq!(triangles, &[10]);
    }

    #[test]
    fn an_extra_triangle_leaves_three_odd_edges() {
        let mut mesh = unit_cube();
        mesh.triangles.push(mesh.triangles[5]);
        let report = check(&mesh);
        assert_eq!(codes(&report), [("odd-edge", 3), ("duplicate-triangle", 1)]);
        assert_eq!(report.duplicates.first[0].triangle, 12);
        assert_eq!(report.duplicates.first[0].earlier, 5);
        assert!(sentence(&report, "odd-edge").contains("of triangles "), "{}", sentence(&report, "odd-edge"));
        assert!(!report.is_closed());
    }

    #[test]
    fn faces_back_to_back_cancel_before_they_count_as_repeated() {
        let fin = |windings: &[bool]| {
            let mut mesh = unit_cube();
            mesh.triangles.extend(windings.iter().map(|forward| if *forward { [0, 3, 7] } else { [3, 0, 7] }));
            let report = check(&mesh);
            (report.duplicates.count, report.opposed_duplicates.count)
        };
        assert_eq!(fin(&[true]), (0, 0));
        assert_eq!(fin(&[true, false]), (0, 1));
        assert_eq!(fin(&[true, true]), (1, 0));
        assert_eq!(fin(&[true, false, true]), (0, 2));
        assert_eq!(fin(&[true, true, true]), (2, 0));
        assert_eq!(fin(&[false, true, true, true]), (1, 2));
    }

    #[test]
    fn flat_shells_have_no_orientation() {
        // Back to back and oblique, so that rounding gives it some volume.
        let positions = vec![
            DVec3::new(47.263699, 36.56691, 12.565804),
            DVec3::new(47.306953, 36.352104, 12.790643),
            DVec3::new(47.344788, 36.110298, 12.987311),
        ];
        let flat = TriangleMesh { positions, triangles: vec![[0, 1, 2], [0, 2, 1]] };
        for around in [cube(DVec3::ZERO, 1.0), cube(DVec3::ZERO, 100.0)] {
            for flat in [flat.clone(), reversed(&flat)] {
                let report = check(&together(&[around.clone(), flat]));
                assert_eq!(codes(&report), [("opposed-duplicate-triangle", 1)]);
                assert!(report.is_solid());
            }
        }
    }

    #[test]
    fn doubled_meshes_are_closed_and_not_solids() {
        let mesh = unit_cube();
        let report = check(&together(&[mesh.clone(), mesh.clone()]));
        assert!(report.is_closed() && report.is_oriented() && !report.is_solid());
        assert_eq!(codes(&report), [("all-doubled", 1), ("duplicate-triangle", 12), ("non-manifold-edge", 18)]);
        assert_eq!(report.duplicates.first.len(), 5);
        assert_eq!((report.components, report.signed_volume), (1, 2.0));

        let report = check(&together(&[mesh.clone(), reversed(&mesh)]));
        assert_eq!(codes(&report)[..3], [("inside-out", 1), ("all-doubled", 1), ("no-volume", 1)]);
        assert_eq!(codes(&report)[3..], [("opposed-duplicate-triangle", 12), ("non-manifold-edge", 18)]);
        assert!(report.is_closed() && report.is_oriented() && !report.is_solid());
    }

    #[test]
    fn two_triangles_back_to_back_enclose_nothing() {
        let mesh = TriangleMesh { triangles: vec![[0, 1, 2], [0, 2, 1]], ..tetrahedron() };
        let report = check(&mesh);
        assert!(report.is_closed() && report.is_oriented() && !report.is_solid());
        assert_eq!(codes(&report), [("all-doubled", 1), ("no-volume", 1), ("opposed-duplicate-triangle", 1)]);
        assert_eq!(report.genus, Some(0));
    }

    #[test]
    fn inside_out_cubes_are_found_alone_and_beside_others() {
        let inside_out = reversed(&unit_cube());
        let report = check(&inside_out);
        assert!(report.is_closed() && report.is_oriented() && !report.is_solid());
        assert_eq!(codes(&report), [("inside-out", 1), ("no-volume", 1)]);
        assert_eq!(report.inside_out.first[0].signed_volume, -1.0);
        for side in [0.5, 1.0, 3.0] {
            for corner in [DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::ONE, DVec3::splat(9.0)] {
                let report = check(&together(&[cube(corner, side), inside_out.clone()]));
                assert_eq!((report.inside_out.count, report.shells), (1, 2), "{side} {corner}");
                // Where the cubes have a face in common, its triangles face the same way and fit either cube.
                let ShellPlace { faces, signed_volume, bounds, .. } = report.inside_out.first[0];
                assert_eq!((faces, signed_volume, bounds), (12, -1.0, inside_out.bounds().unwrap()));
            }
        }
    }

    #[test]
    fn coordinates_that_are_not_finite_are_named() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut mesh = unit_cube();
            mesh.positions[6].y = bad;
            mesh.positions[3].z = bad;
            let report = check(&mesh);
            assert_eq!(codes(&report), [("coordinate-not-finite", 2)]);
            assert!(!report.is_closed() && report.is_oriented() && !report.is_solid());
            assert_eq!((report.bad_positions.first[0].index, report.bad_positions.first[0].triangle), (6, 0));
        }
        let mut mesh = unit_cube();
        mesh.positions[6].y = f64::INFINITY;
        assert_eq!(
            sentence(&check(&mesh), "coordinate-not-finite"),
            "1 position is not finite: position 6 at (0, inf, 1), used by triangle 0."
        );
        let mut mesh = unit_cube();
        mesh.positions.push(DVec3::NAN);
        assert!(check(&mesh).is_solid());
        mesh.positions.pop();
        let mut nowhere = mesh.clone();
        nowhere.positions.iter_mut().for_each(|p| p.x = f64::NAN);
        let report = check(&together(&[mesh.clone(), nowhere, cube(DVec3::splat(0.25), 0.5)]));
        assert_eq!(codes(&report)[..2], [("coordinate-not-finite", 8), ("solid-in-solid", 1)]);
        assert_eq!((report.shells, report.inside_out.count), (2, 0));
    }

    #[test]
    fn indices_out_of_range_are_named() {
        let mut mesh = unit_cube();
        mesh.triangles.push([8, 1, 900]);
        mesh.triangles.push([0, u32::MAX, 1]);
        let report = check(&mesh);
        assert_eq!(codes(&report), [("index-out-of-range", 3)]);
        assert!(!report.is_closed() && !report.is_solid());
        assert_eq!(report.bad_indices.first[1], BadIndex { triangle: 12, index: 900 });
        assert_eq!(
            sentence(&report, "index-out-of-range"),
            "3 indices are out of range; the first is 8 in triangle 12."
        );
    }

    #[test]
    fn empty_meshes_are_not_solids() {
        let report = check(&TriangleMesh::default());
        assert_eq!(codes(&report), [("no-triangles", 1)]);
        assert!(!report.is_closed() && !report.is_solid());
    }

    #[test]
    fn touching_cubes_are_two_shells_of_a_solid() {
        let touching = |corner| check(&together(&[unit_cube(), cube(corner, 1.0)]));
        let face = touching(DVec3::X);
        assert_eq!(codes(&face), [("opposed-duplicate-triangle", 2), ("non-manifold-edge", 5)]);
        assert_eq!((face.components, face.shells, face.euler_characteristic), (1, 2, 12 - 31 + 24));
        // With the common face cut along the other diagonal, only the sides of the square coincide.
        let mut other = cube(DVec3::X, 1.0);
        other.triangles[0] = [0, 4, 2];
        other.triangles[1] = [4, 6, 2];
        let across = check(&together(&[unit_cube(), other]));
        assert_eq!(codes(&across), [("non-manifold-edge", 4)]);
        assert_eq!((across.components, across.shells), (1, 2));
        let edge = touching(DVec3::new(1.0, 1.0, 0.0));
        assert_eq!(codes(&edge), [("non-manifold-edge", 1)]);
        assert_eq!((edge.components, edge.shells), (1, 2));
        let vertex = touching(DVec3::ONE);
        assert_eq!(codes(&vertex), [("non-manifold-vertex", 1)]);
        assert_eq!((vertex.components, vertex.shells), (2, 2));
        assert_eq!(vertex.non_manifold_vertices.first[0], VertexPlace { position: DVec3::ONE, fans: 2 });
        let apart = touching(DVec3::splat(2.0));
        assert_eq!(codes(&apart), []);
        assert_eq!((apart.components, apart.shells, apart.genus), (2, 2, Some(0)));
        for report in [face, across, edge, vertex, apart] {
            assert!(report.is_closed() && report.is_oriented() && report.is_solid());
            assert_eq!(report.signed_volume, 2.0);
        }
    }

    #[test]
    fn cavities_face_inwards() {
        let (outer, inner, core) = (cube(DVec3::ZERO, 5.0), cube(DVec3::ONE, 3.0), cube(DVec3::splat(2.0), 1.0));
        let hollow = check(&together(&[outer.clone(), reversed(&inner)]));
        assert_eq!(codes(&hollow), []);
        assert!(hollow.is_solid());
        assert_eq!(hollow.signed_volume, 125.0 - 27.0);

        let wrong = check(&together(&[inner.clone(), outer.clone()]));
        assert_eq!(codes(&wrong), [("solid-in-solid", 1)]);
        assert_eq!((wrong.solids_in_solids.first[0].triangle, wrong.solids_in_solids.first[0].depth), (0, 1));

        let filled = check(&together(&[outer.clone(), reversed(&inner), core.clone()]));
        assert_eq!(codes(&filled), []);
        let filled = check(&together(&[outer.clone(), reversed(&inner), reversed(&core)]));
        assert_eq!(codes(&filled), [("inside-out", 1)]);
        assert_eq!(filled.inside_out.first[0].depth, 2);
        assert!(!filled.is_solid());
        let reversed_whole = check(&reversed(&together(&[outer, reversed(&inner)])));
        assert_eq!(codes(&reversed_whole), [("inside-out", 1), ("no-volume", 1), ("solid-in-solid", 1)]);
    }

    #[test]
    fn a_cavity_that_touches_the_outside_is_a_cavity() {
        // The cavity has none, one, two or three of its faces in faces of the cube.
        let outer = cube(DVec3::ZERO, 4.0);
        for i in 0..27 {
            let corner = DVec3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9));
            let report = check(&together(&[outer.clone(), reversed(&cube(corner, 2.0))]));
            assert_eq!((report.inside_out.count, report.solids_in_solids.count), (0, 0), "{corner}");
            let report = check(&together(&[outer.clone(), cube(corner, 2.0)]));
            assert_eq!((report.inside_out.count, report.solids_in_solids.count), (0, 1), "{corner}");
        }
    }

    #[test]
    fn a_shell_in_the_box_of_another_but_not_inside_it_is_outside() {
        // A small cube in the notch between the slope of a tetrahedron and the corner of its box.
        let mut tetrahedron = tetrahedron();
        tetrahedron.positions.iter_mut().for_each(|p| *p *= 10.0);
        let report = check(&together(&[tetrahedron.clone(), cube(DVec3::splat(6.0), 1.0)]));
        assert_eq!(codes(&report), []);
        let report = check(&together(&[tetrahedron.clone(), reversed(&cube(DVec3::splat(6.0), 1.0))]));
        assert_eq!(codes(&report), [("inside-out", 1)]);
        let report = check(&together(&[tetrahedron, reversed(&cube(DVec3::splat(0.5), 1.0))]));
        assert_eq!(codes(&report), []);
    }

    #[test]
    fn all_edges_of_a_random_soup_are_open() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let positions = (0..300).map(|_| DVec3::new(random(), random(), random())).collect();
        let triangles = (0..100).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let report = check(&TriangleMesh { positions, triangles });
        assert_eq!(codes(&report), [("open-edge", 300)]);
        assert_eq!((report.components, report.vertices, report.edges), (100, 300, 300));
        assert_eq!(report.open_edges.first.len(), 5);
    }

    #[test]
    fn a_flipped_triangle_unbalances_three_edges() {
        let mut mesh = unit_cube();
        mesh.triangles[7].swap(0, 1);
        let report = check(&mesh);
        assert!(report.is_closed() && !report.is_oriented() && !report.is_solid());
        assert_eq!(codes(&report), [("unbalanced-edge", 3)]);
        assert_eq!(report.genus, None);
        let place = &report.unbalanced_edges.first[0];
        assert!(place.uses == 2 && place.forward != 1 && place.triangles.contains(&7));
    }

    #[test]
    fn triangles_without_area_give_notes() {
        let mut mesh = unit_cube();
        mesh.triangles.extend([[0, 0, 0], [0, 0, 5], [3, 5, 3]]);
        // The edge from 0 to 1 gets a vertex in its middle on one side only, and a sliver that closes the gap.
        mesh.positions.push(DVec3::new(0.5, 0.0, 0.0));
        let base = mesh.triangles.iter().position(|t| *t == [0, 1, 5]).unwrap();
        mesh.triangles[base] = [0, 8, 5];
        mesh.triangles.extend([[8, 1, 5], [0, 1, 8]]);
        let report = check(&mesh);
        assert_eq!(codes(&report), [("repeated-corner", 3), ("collinear-triangle", 1)]);
        assert!(report.is_solid());
        assert_eq!((report.euler_characteristic, report.genus), (2, Some(0)));
        assert_eq!(report.collinear.first[0].triangle, 16);
        assert_eq!(
            sentence(&report, "collinear-triangle"),
            "1 triangle has no area, its corners being on a line: triangle 16 with corners (0, 0, 0), (1, 0, 0), \
             (0.5, 0, 0)."
        );
    }

    #[test]
    fn collinearity_is_exact() {
        let line = [DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.2, 0.4, 0.6), DVec3::new(0.4, 0.8, 1.2)];
        for scale in [1.0, 2f64.powi(-500), 2f64.powi(500), 2f64.powi(-900), 2f64.powi(1000)] {
            let points = line.map(|p| p * scale);
            assert!(are_collinear(points), "{scale}");
            for corner in 0..3 {
                for axis in 0..3 {
                    let mut points = points;
                    points[corner][axis] = points[corner][axis].next_up();
                    assert!(!are_collinear(points), "{scale} {corner} {axis}");
                }
            }
        }
        assert!(!are_collinear([DVec3::ZERO, DVec3::X, DVec3::new(0.5, 5e-324, 0.0)]));
        assert!(!are_collinear([DVec3::ZERO, DVec3::X * 1e300, DVec3::new(0.5, 0.0, 1e-300)]));
    }

    #[test]
    fn reports_of_many_shells_do_not_depend_on_the_thread_count() {
        let mut parts = vec![cube(DVec3::splat(-1.0), 60.0)];
        for i in 0..1000u32 {
            let corner = DVec3::new(f64::from(i % 10), f64::from(i / 10 % 10), f64::from(i / 100)) * 5.0;
            let part = cube(corner, 2.0);
            parts.push(if i % 3 == 0 { part } else { reversed(&part) });
        }
        let mesh = together(&parts);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| format!("{:?}", check(&mesh)))
        };
        assert_eq!(with(1), with(3));
        assert_eq!(codes(&check(&mesh)), [("solid-in-solid", 334)]);
        parts.remove(0);
        assert_eq!(codes(&check(&together(&parts)))[0], ("inside-out", 666));
    }

    proptest! {
        #[test]
        fn orientation_agrees_with_integers(c in prop::array::uniform6(-30_000_000_000_000i64..30_000_000_000_000), t in -8..8i64, s in -3..3i64) {
            // Points on a line with integer coordinates, or one step beside it.
            let (a, d) = ([c[0], c[1]], [c[2] / 16, c[3] / 16]);
            let b = [a[0] + d[0], a[1] + d[1]];
            let p = [a[0] + t * d[0] + s, a[1] + t * d[1]];
            let exact = i128::from(b[0] - a[0]) * i128::from(p[1] - a[1]) - i128::from(b[1] - a[1]) * i128::from(p[0] - a[0]);
            let float = |p: [i64; 2]| DVec2::new(p[0] as f64, p[1] as f64);
            let sign = orientation(float(a), float(b), float(p));
            prop_assert_eq!((sign > 0.0, sign < 0.0), (exact > 0, exact < 0));
            // The filter decides most cases; the expansion alone must agree.
            let mut sum = Expansion::default();
            for (p, q) in [(a, b), (b, p), (p, a)].map(|(p, q)| (float(p), float(q))) {
                sum.add_product(p.x, q.y);
                sum.add_product(-p.y, q.x);
            }
            prop_assert_eq!((sum.sign() > 0.0, sum.sign() < 0.0), (exact > 0, exact < 0));
        }

        #[test]
        fn triangle_order_changes_no_count(picks in prop::collection::vec((0..6u32, 0..6u32, 0..6u32), 1..30)) {
            let positions: Vec<DVec3> =
                (0..6).map(|i| DVec3::new(f64::from(i), f64::from(i * i), f64::from(i % 2))).collect();
            let triangles: Vec<[u32; 3]> = picks.iter().map(|&(a, b, c)| [a, b, c]).collect();
            let backwards = triangles.iter().rev().map(|&[a, b, c]| [b, c, a]).collect();
            let one = check(&TriangleMesh { positions: positions.clone(), triangles });
            let other = check(&TriangleMesh { positions, triangles: backwards });
            let counts = |report: &MeshReport| {
                let edges = (report.open_edges.count, report.odd_edges.count, report.unbalanced_edges.count);
                let all = report.duplicates.count + report.opposed_duplicates.count;
                (edges, all, report.components, report.non_manifold_edges.count, report.euler_characteristic)
            };
            prop_assert_eq!(counts(&one), counts(&other));
            prop_assert_eq!(one.repeated_corners.count, other.repeated_corners.count);
        }
    }
}
