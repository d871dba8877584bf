//! The requirements of every output mesh, checked exactly, and fast enough for every output.
//!
//! A mesh passes the manifold check when every edge borders exactly two triangles that run along it in opposite directions, no two
//! triangles have the same corners, no triangle has a corner twice, every vertex has one fan of triangles, and the volume is
//! positive. Then it is a closed, oriented 2-manifold, *by its indices*. A file of triangles without indices, such as STL, has
//! only positions, in `f32`, and its readers weld equal positions. So no two vertices may have the same position once rounded
//! to the [`Precision`] of the file, or the mesh that is read is not the mesh that was written.
//!
//! # Method
//! [`mesh::check`](crate::mesh::check::check) answers more questions about arbitrary meshes, and sorts all edge uses by the
//! positions of their ends. Here identity is identity of indices, and all faults of edges, duplicates and fans follow from the
//! *star* of a vertex, the triangles around it, whose length is about six. A corner of a triangle at vertex v sees the edge
//! from v to its next corner and the edge from its previous corner to v. If the corners at v, each followed by the one whose
//! next is the previous of the former, make one cycle through all of them, then every edge at v is used once in either
//! direction, there is one fan, and no two triangles at v are the same (three or more corners make the cycle). That decides
//! nearly every vertex by a few comparisons; the others are examined one by one. Stars are listed by a counting sort of
//! corners; their order varies with the threads, the findings do not. Components come from a parallel union–find of vertices,
//! in which the lowest index is always the representative.

use std::fmt;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::parallel::*;
use glam::DVec3;

use super::parts::part_of_vertices;
use crate::cancel::checkpoint;
use crate::mesh::check::{BadIndex, BadPosition, DuplicatePlace, EdgePlace, Findings, TrianglePlace, VertexPlace};
use crate::mesh::{Precision, TriangleMesh};

/// The number of places of a kind that are kept beside the count.
const FIRST: usize = 5;

/// Vertices or triangles in one task.
const CHUNK: usize = 8192;

/// The results of all checks of an output mesh.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct ManifoldReport {
    /// Number of triangles in the mesh.
    pub triangles: usize,
    /// Number of positions that triangles use.
    pub vertices: usize,
    /// Number of vertex-connected parts of the mesh.
    pub components: usize,
    /// The sum of the genera of all components; `None` where the mesh is not a closed, oriented manifold.
    pub genus: Option<usize>,
    /// See [`TriangleMesh::signed_volume`].
    pub signed_volume: f64,
    /// Indices beyond the positions. Their triangles are excluded from all other checks.
    pub bad_indices: Findings<BadIndex>,
    /// Used positions that are infinite or not a number.
    pub bad_positions: Findings<BadPosition>,
    /// Triangles that name a vertex twice. They are excluded from all other checks.
    pub repeated_indices: Findings<TrianglePlace>,
    /// Edges that do not border exactly two triangles in opposite directions.
    pub edges: Findings<EdgePlace>,
    /// Triangles with the same three vertices as an earlier one, in any order.
    pub duplicates: Findings<DuplicatePlace>,
    /// Vertices with more than one fan of triangles.
    pub non_manifold_vertices: Findings<VertexPlace>,
    /// The precision that positions were rounded to for the checks that follow.
    pub precision: Precision,
    /// Triangles two corners of which are different vertices with the same rounded position.
    pub collapsed: Findings<TrianglePlace>,
    /// Vertices with the same rounded position as a vertex of lower index.
    pub welded: Findings<WeldedPlace>,
}

/// Two vertices that coincide once their positions are rounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeldedPlace {
    /// The vertex of higher index, which is the one counted.
    pub vertex: u32,
    /// The lowest index with this position.
    pub earlier: u32,
    /// The position of the vertex of higher index.
    pub position: DVec3,
}

/// A gate that a mesh does not pass; displayed as a sentence with the count of faults and the first place.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum ManifoldFailure {
    /// See [`ManifoldReport::bad_indices`].
    BadIndices(Findings<BadIndex>),
    /// See [`ManifoldReport::bad_positions`].
    BadPositions(Findings<BadPosition>),
    /// See [`ManifoldReport::repeated_indices`].
    RepeatedIndices(Findings<TrianglePlace>),
    /// See [`ManifoldReport::edges`].
    Edges(Findings<EdgePlace>),
    /// See [`ManifoldReport::duplicates`].
    Duplicates(Findings<DuplicatePlace>),
    /// See [`ManifoldReport::non_manifold_vertices`].
    NonManifoldVertices(Findings<VertexPlace>),
    /// See [`ManifoldReport::collapsed`].
    Collapsed(Findings<TrianglePlace>, Precision),
    /// See [`ManifoldReport::welded`].
    Welded(Findings<WeldedPlace>, Precision),
    /// There are triangles, but they enclose no positive volume.
    NoVolume {
        /// See [`ManifoldReport::signed_volume`].
        signed_volume: f64,
    },
}

impl ManifoldReport {
    /// Checks a mesh whose positions will be rounded to a precision. The result does not depend on the thread count.
    ///
    /// Needs about 24 bytes of memory per triangle and 8 per vertex, and about 0.1 s for a million triangles on one core.
    ///
    /// # Panics
    /// If corners cannot be numbered by 32 bits: beyond 1.4 × 10⁹ triangles.
    pub fn of(mesh: &TriangleMesh, precision: Precision) -> ManifoldReport {
        let faults = Faults::of(mesh);
        let corners = |triangle: u32| mesh.triangles[triangle as usize].map(|index| mesh.positions[index as usize]);
        let triangle_place =
            |&triangle: &u32| TrianglePlace { triangle: triangle as usize, corners: corners(triangle) };
        let welded = welded(mesh, &faults.used, precision);
        let collapsed = collapsed(mesh, precision);
        let used = faults.used.par_iter().filter(|used| **used).count();
        let is_manifold = faults.edges.is_empty()
            && faults.vertices.is_empty()
            && faults.repeated_indices.is_empty()
            && faults.bad_indices.is_empty();
        // V − E + F, with three half-edges a triangle; every component has 2 − 2 × its genus.
        let euler = used as i64 - mesh.triangles.len() as i64 / 2;
        let genus = faults.components as i64 - euler / 2;
        ManifoldReport {
            triangles: mesh.triangles.len(),
            vertices: used,
            components: faults.components,
            genus: is_manifold.then_some(genus as usize),
            signed_volume: mesh.signed_volume(),
            bad_indices: findings(&faults.bad_indices, |place| *place),
            bad_positions: bad_positions(mesh, &faults.used),
            repeated_indices: findings(&faults.repeated_indices, triangle_place),
            edges: findings(&faults.edges, |edge| EdgePlace {
                ends: edge.ends.map(|vertex| mesh.positions[vertex as usize]),
                uses: edge.forward + edge.backward,
                forward: edge.forward,
                triangles: edge.triangles.clone(),
            }),
            duplicates: findings(&faults.duplicates, |&[earlier, triangle]| DuplicatePlace {
                triangle: triangle as usize,
                earlier: earlier as usize,
                corners: corners(triangle),
            }),
            non_manifold_vertices: findings(&faults.vertices, |&(vertex, fans)| VertexPlace {
                position: mesh.positions[vertex as usize],
                fans,
            }),
            precision,
            collapsed: findings(&collapsed, triangle_place),
            welded: findings(&welded, |&[earlier, vertex]| WeldedPlace {
                vertex,
                earlier,
                position: mesh.positions[vertex as usize],
            }),
        }
    }

    /// Returns whether the mesh passes the check. A mesh without triangles passes: it is an empty surface.
    pub fn passed(&self) -> bool {
        self.failures().is_empty()
    }

    /// Returns the failures of the check.
    pub fn failures(&self) -> Vec<ManifoldFailure> {
        fn add<P: Clone>(
            failures: &mut Vec<ManifoldFailure>,
            kind: impl FnOnce(Findings<P>) -> ManifoldFailure,
            found: &Findings<P>,
        ) {
            if found.count > 0 {
                failures.push(kind(found.clone()));
            }
        }
        let mut failures = Vec::new();
        add(&mut failures, ManifoldFailure::BadIndices, &self.bad_indices);
        add(&mut failures, ManifoldFailure::BadPositions, &self.bad_positions);
        add(&mut failures, ManifoldFailure::RepeatedIndices, &self.repeated_indices);
        add(&mut failures, ManifoldFailure::Edges, &self.edges);
        add(&mut failures, ManifoldFailure::Duplicates, &self.duplicates);
        add(&mut failures, ManifoldFailure::NonManifoldVertices, &self.non_manifold_vertices);
        add(&mut failures, |found| ManifoldFailure::Collapsed(found, self.precision), &self.collapsed);
        add(&mut failures, |found| ManifoldFailure::Welded(found, self.precision), &self.welded);
        // Written so that a NaN volume fails.
        let is_positive = self.signed_volume > 0.0;
        if self.triangles > 0 && !is_positive {
            failures.push(ManifoldFailure::NoVolume { signed_volume: self.signed_volume });
        }
        failures
    }
}

impl fmt::Display for ManifoldFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ManifoldFailure::BadIndices(found) => {
                let name = |place: &BadIndex| format!("{} in triangle {}", place.index, place.triangle);
                sentence(f, found, ["index lies beyond the vertices", "indices lie beyond the vertices"], name)
            }
            ManifoldFailure::BadPositions(found) => {
                let name = |place: &BadPosition| format!("vertex {} at {}", place.index, place.position);
                sentence(f, found, ["vertex has a non-finite position", "vertices have non-finite positions"], name)
            }
            ManifoldFailure::RepeatedIndices(found) => {
                let name = |place: &TrianglePlace| format!("triangle {} at {}", place.triangle, place.corners[0]);
                sentence(f, found, ["triangle uses a vertex twice", "triangles use a vertex twice"], name)
            }
            ManifoldFailure::Edges(found) => {
                let name = |place: &EdgePlace| {
                    let ([from, to], backward) = (place.ends, place.uses - place.forward);
                    format!("{from} to {to}, used {} times that way and {backward} times the other", place.forward)
                };
                let kinds = [
                    "edge does not border two triangles in opposite directions",
                    "edges do not border two triangles in opposite directions",
                ];
                sentence(f, found, kinds, name)
            }
            ManifoldFailure::Duplicates(found) => {
                let name = |place: &DuplicatePlace| {
                    format!("triangle {} like triangle {} at {}", place.triangle, place.earlier, place.corners[0])
                };
                sentence(f, found, ["triangle occurs twice", "triangles repeat earlier ones"], name)
            }
            ManifoldFailure::NonManifoldVertices(found) => {
                let name = |place: &VertexPlace| format!("{}, where {} meet", place.position, place.fans);
                let kinds = ["vertex joins fans that no edge joins", "vertices join fans that no edge joins"];
                sentence(f, found, kinds, name)
            }
            ManifoldFailure::Collapsed(found, precision) => {
                let name = |place: &TrianglePlace| format!("triangle {} at {}", place.triangle, place.corners[0]);
                let kinds = match precision {
                    Precision::Single => ["triangle has no extent in f32", "triangles have no extent in f32"],
                    Precision::Double => ["triangle has no extent", "triangles have no extent"],
                };
                sentence(f, found, kinds, name)
            }
            ManifoldFailure::Welded(found, precision) => {
                let name = |place: &WeldedPlace| {
                    format!("vertex {} on vertex {} at {}", place.vertex, place.earlier, place.position)
                };
                let kinds = match precision {
                    Precision::Single => ["vertex falls on another in f32", "vertices fall on others in f32"],
                    Precision::Double => ["vertex falls on another", "vertices fall on others"],
                };
                sentence(f, found, kinds, name)
            }
            ManifoldFailure::NoVolume { signed_volume } => {
                write!(f, "The mesh encloses no positive volume: {signed_volume:e}.")
            }
        }
    }
}

fn sentence<P>(
    f: &mut fmt::Formatter<'_>,
    found: &Findings<P>,
    [one, many]: [&str; 2],
    name: impl Fn(&P) -> String,
) -> fmt::Result {
    write!(f, "{} {}", found.count, if found.count == 1 { one } else { many })?;
    if let Some(place) = found.first.first() {
        write!(f, "{}{}", if found.count == 1 { ": " } else { "; the first is " }, name(place))?;
    }
    f.write_str(".")
}

fn findings<T, P>(all: &[T], place: impl Fn(&T) -> P) -> Findings<P> {
    Findings { count: all.len(), first: all.iter().take(FIRST).map(place).collect() }
}

/// An edge that does not border two triangles in opposite directions.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct EdgeFault {
    /// Its vertices, the lower first.
    pub ends: [u32; 2],
    /// Uses from the lower to the higher.
    pub forward: usize,
    /// Uses from the higher to the lower.
    pub backward: usize,
    /// The first triangles that use it.
    triangles: Vec<usize>,
}

/// All faults of the indices of a mesh, without limit.
#[derive(Debug, Default)]
pub(super) struct Faults {
    pub bad_indices: Vec<BadIndex>,
    /// Triangles that name a vertex twice.
    pub repeated_indices: Vec<u32>,
    /// Faulty edges in the order of their lower vertices.
    pub edges: Vec<EdgeFault>,
    /// Duplicates: the earlier triangle and the later one.
    pub duplicates: Vec<[u32; 2]>,
    /// Vertices with two or more fans, and their numbers of fans.
    pub vertices: Vec<(u32, usize)>,
    /// Number of vertex-connected parts.
    pub components: usize,
    /// For each position, whether triangles use it.
    pub used: Vec<bool>,
}

impl Faults {
    /// Returns whether every star is one cycle of triangles.
    pub(super) fn are_none(&self) -> bool {
        self.bad_indices.is_empty()
            && self.repeated_indices.is_empty()
            && self.edges.is_empty()
            && self.duplicates.is_empty()
            && self.vertices.is_empty()
    }

    pub(super) fn of(mesh: &TriangleMesh) -> Faults {
        assert!(mesh.triangles.len() < u32::MAX as usize / 3, "corners are numbered by 32 bits");
        let stars = Stars::of(mesh);
        let mut faults = Faults { components: components(mesh, &stars), ..Faults::default() };
        (faults.bad_indices, faults.repeated_indices) = (stars.bad_indices.clone(), stars.repeated_indices.clone());
        let vertices = mesh.positions.len();
        faults.used = (0..vertices).into_par_iter().map(|vertex| !stars.corners_at(vertex).is_empty()).collect();
        let found: Vec<Faults> = (0..vertices.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                checkpoint();
                let mut faults = Faults::default();
                for vertex in chunk * CHUNK..vertices.min((chunk + 1) * CHUNK) {
                    let star = stars.corners_at(vertex);
                    if !star.is_empty() && !is_one_cycle(mesh, star) {
                        faults.sort_out(mesh, vertex as u32, star);
                    }
                }
                faults
            })
            .collect();
        for part in found {
            faults.edges.extend(part.edges);
            faults.duplicates.extend(part.duplicates);
            faults.vertices.extend(part.vertices);
        }
        faults
    }

    /// Finds all faults of a star by sorting. Edges and triangles are reported at their lowest vertex only.
    fn sort_out(&mut self, mesh: &TriangleMesh, vertex: u32, star: &[u32]) {
        let mut star = star.to_vec();
        star.sort_unstable();
        let sides: Vec<(u32, u32)> = star.iter().map(|&corner| sides(mesh, corner)).collect();

        let mut uses: Vec<(u32, bool, usize)> = Vec::with_capacity(2 * star.len());
        for (i, &(next, previous)) in sides.iter().enumerate() {
            uses.extend([(next, true, i), (previous, false, i)]);
        }
        uses.sort_unstable_by_key(|&(other, away, i)| (other, i, away));
        let mut parents: Vec<usize> = (0..star.len()).collect();
        let mut fans = star.len();
        for run in uses.chunk_by(|a, b| a.0 == b.0) {
            for pair in run.windows(2) {
                let (a, b) = (root(&mut parents, pair[0].2), root(&mut parents, pair[1].2));
                fans -= usize::from(a != b);
                parents[a.max(b)] = a.min(b);
            }
            let forward = run.iter().filter(|use_| use_.1).count();
            let backward = run.len() - forward;
            if (forward, backward) != (1, 1) && vertex < run[0].0 {
                let triangles = run.iter().take(FIRST).map(|use_| star[use_.2] as usize / 3).collect();
                self.edges.push(EdgeFault { ends: [vertex, run[0].0], forward, backward, triangles });
            }
        }
        if fans > 1 {
            self.vertices.push((vertex, fans));
        }

        let lowest = sides.iter().zip(&star).filter(|((next, previous), _)| vertex < *next && vertex < *previous);
        let mut shapes: Vec<(u32, u32, u32)> =
            lowest.map(|(&(a, b), corner)| (a.min(b), a.max(b), corner / 3)).collect();
        shapes.sort_unstable();
        for run in shapes.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            self.duplicates.extend(run[1..].iter().map(|later| [run[0].2, later.2]));
        }
    }
}

/// Returns the representative of an element of a union–find.
fn root(parents: &mut [usize], mut element: usize) -> usize {
    while parents[element] != element {
        parents[element] = parents[parents[element]];
        element = parents[element];
    }
    element
}

/// The corners of triangles at every vertex. Triangles with a bad or repeated index have none.
pub(super) struct Stars {
    /// The first corner of each vertex, and the end of the last.
    starts: Vec<u32>,
    /// Corners by vertex, in no order: three times the triangle, plus the index in it.
    corners: Vec<u32>,
    bad_indices: Vec<BadIndex>,
    repeated_indices: Vec<u32>,
}

impl Stars {
    pub(super) fn of(mesh: &TriangleMesh) -> Stars {
        let vertices = mesh.positions.len();
        // Counted at the entry of the next vertex; then prefix sums; then every corner takes the last free place.
        let cursors: Vec<AtomicU32> = (0..vertices + 1).into_par_iter().map(|_| AtomicU32::new(0)).collect();
        let refused: Vec<(Vec<BadIndex>, Vec<u32>)> = mesh
            .triangles
            .par_chunks(CHUNK)
            .enumerate()
            .map(|(chunk, triangles)| {
                let (mut bad, mut repeated) = (Vec::new(), Vec::new());
                for (i, &indices) in triangles.iter().enumerate() {
                    let triangle = chunk * CHUNK + i;
                    if has_vertices(indices, vertices) {
                        indices.iter().for_each(|&vertex| {
                            cursors[vertex as usize].fetch_add(1, Ordering::Relaxed);
                        });
                        continue;
                    }
                    let beyond = indices.into_iter().filter(|&index| index as usize >= vertices);
                    let before = bad.len();
                    bad.extend(beyond.map(|index| BadIndex { triangle, index }));
                    if bad.len() == before {
                        repeated.push(triangle as u32);
                    }
                }
                (bad, repeated)
            })
            .collect();
        let mut sum = 0;
        let mut starts = Vec::with_capacity(vertices + 1);
        for cursor in &cursors {
            starts.push(sum);
            sum += cursor.load(Ordering::Relaxed);
            cursor.store(sum, Ordering::Relaxed);
        }
        let corners: Vec<AtomicU32> = (0..sum).into_par_iter().map(|_| AtomicU32::new(0)).collect();
        mesh.triangles.par_iter().enumerate().filter(|(_, indices)| has_vertices(**indices, vertices)).for_each(
            |(triangle, indices)| {
                for (side, &vertex) in indices.iter().enumerate() {
                    let place = cursors[vertex as usize].fetch_sub(1, Ordering::Relaxed) - 1;
                    corners[place as usize].store((3 * triangle + side) as u32, Ordering::Relaxed);
                }
            },
        );
        let corners = corners.into_iter().map(AtomicU32::into_inner).collect();
        let (bad_indices, repeated_indices): (Vec<_>, Vec<_>) = refused.into_iter().unzip();
        Stars { starts, corners, bad_indices: bad_indices.concat(), repeated_indices: repeated_indices.concat() }
    }

    /// Returns the corners at a vertex, in no order: three times the triangle, plus the index in it.
    pub(super) fn corners_at(&self, vertex: usize) -> &[u32] {
        &self.corners[self.starts[vertex] as usize..self.starts[vertex + 1] as usize]
    }
}

/// Returns whether a triangle has three different vertices.
fn has_vertices([a, b, c]: [u32; 3], vertices: usize) -> bool {
    (a.max(b).max(c) as usize) < vertices && a != b && b != c && c != a
}

/// Returns the vertices after and before a corner in its triangle.
pub(super) fn sides(mesh: &TriangleMesh, corner: u32) -> (u32, u32) {
    let indices = mesh.triangles[corner as usize / 3];
    match corner % 3 {
        0 => (indices[1], indices[2]),
        1 => (indices[2], indices[0]),
        _ => (indices[0], indices[1]),
    }
}

/// Returns whether the corners of a star, three or more, follow each other in one cycle. Returns false for long stars.
fn is_one_cycle(mesh: &TriangleMesh, star: &[u32]) -> bool {
    const LONGEST: usize = 24;
    if star.len() < 3 || star.len() > LONGEST {
        return false;
    }
    let (mut nexts, mut previous) = ([0; LONGEST], [0; LONGEST]);
    for (i, &corner) in star.iter().enumerate() {
        (nexts[i], previous[i]) = sides(mesh, corner);
    }
    let (nexts, mut at) = (&nexts[..star.len()], 0);
    for step in 1.. {
        let Some(after) = nexts.iter().position(|next| *next == previous[at]) else { return false };
        if after == 0 || step == star.len() {
            return after == 0 && step == star.len();
        }
        at = after;
    }
    false
}

/// Counts the vertex-connected parts of the mesh.
fn components(mesh: &TriangleMesh, stars: &Stars) -> usize {
    let parts = part_of_vertices(mesh);
    let is_lowest = |vertex: &usize| parts[*vertex] == *vertex as u32;
    let lowest = (0..parts.len()).into_par_iter().filter(is_lowest);
    lowest.filter(|&vertex| !stars.corners_at(vertex).is_empty()).count()
}

/// Returns the bits of a rounded position; −0 and 0 are the same coordinate.
fn rounded(position: DVec3, precision: Precision) -> [u64; 3] {
    precision.round(position).to_array().map(|coordinate| (coordinate + 0.0).to_bits())
}

fn collapsed(mesh: &TriangleMesh, precision: Precision) -> Vec<u32> {
    let collapsed = |&(_, &indices): &(usize, &[u32; 3])| {
        has_vertices(indices, mesh.positions.len()) && {
            let [a, b, c] = indices.map(|index| rounded(mesh.positions[index as usize], precision));
            a == b || b == c || c == a
        }
    };
    mesh.triangles.par_iter().enumerate().filter(collapsed).map(|(triangle, _)| triangle as u32).collect()
}

/// Returns the vertices whose rounded position equals that of one of lower index, each after the lowest such one, in order of
/// index.
pub(super) fn welded(mesh: &TriangleMesh, used: &[bool], precision: Precision) -> Vec<[u32; 2]> {
    let vertices = (mesh.positions.par_iter(), used).into_par_iter().enumerate().filter(|(_, (_, used))| **used);
    // Half a hash above the index: the few runs of equal halves after sorting are compared in full.
    let mut keys: Vec<u64> =
        vertices.map(|(i, (position, _))| hash(rounded(*position, precision)) & !0xffff_ffff | i as u64).collect();
    keys.par_sort_unstable();
    let mut welded: Vec<[u32; 2]> = Vec::new();
    for run in keys.chunk_by(|a, b| a >> 32 == b >> 32).filter(|run| run.len() > 1) {
        let mut positions: Vec<([u64; 3], u32)> =
            run.iter().map(|&key| (rounded(mesh.positions[key as u32 as usize], precision), key as u32)).collect();
        positions.sort_unstable();
        for same in positions.chunk_by(|a, b| a.0 == b.0) {
            welded.extend(same[1..].iter().map(|later| [same[0].1, later.1]));
        }
    }
    welded.sort_unstable_by_key(|&[_, vertex]| vertex);
    welded
}

/// Returns a hash whose upper half differs for most different positions.
fn hash(position: [u64; 3]) -> u64 {
    // Multiplication by odd digits of π carries upwards, so the upper halves are folded down in between.
    position.into_iter().fold(0, |hash: u64, bits| {
        let mixed = (hash ^ bits).wrapping_mul(0x243f_6a88_85a3_08d3);
        (mixed ^ mixed >> 32).wrapping_mul(0x1319_8a2e_0370_7345)
    })
}

fn bad_positions(mesh: &TriangleMesh, used: &[bool]) -> Findings<BadPosition> {
    let is_bad = |vertex: &usize| used[*vertex] && !mesh.positions[*vertex].is_finite();
    let bad: Vec<usize> = (0..mesh.positions.len()).into_par_iter().filter(is_bad).collect();
    findings(&bad, |&vertex| {
        let uses = |indices: &[u32; 3]| {
            has_vertices(*indices, mesh.positions.len()) && indices.iter().any(|index| *index as usize == vertex)
        };
        let triangle = mesh.triangles.iter().position(uses).expect("a used vertex has a triangle");
        BadPosition { triangle, index: vertex as u32, position: mesh.positions[vertex] }
    })
}

#[cfg(test)]
mod tests;
