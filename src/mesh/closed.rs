//! The check that a mesh bounds a solid, fast enough to run on every mesh that is read.
//!
//! A mesh is closed when every edge has an even number of uses, identical coordinates being one vertex. Every ray then
//! has an even count of crossings; the mesh need be neither manifold nor oriented.
//!
//! # Method
//! The check builds no table of edges. Every undirected edge gets a 128-bit hash of its two end positions, and the
//! hashes of all edge uses are combined by XOR. Uses of the same edge cancel in pairs whatever their order, so a closed
//! mesh gives zero, always. A mesh that is not closed leaves the XOR of the hashes of its odd edges, which is zero with
//! a chance of about 2⁻¹²⁸ if the hash behaves like a random function. Three folds share one pass:
//! - XOR of edge hashes: zero ⇔ closed;
//! - wrapping sum of edge hashes, added for a use from the lower end to the higher and subtracted for the reverse:
//!   zero ⇔ every edge is used as often in one direction as in the other;
//! - XOR of a hash of the three corners of each triangle in any order: zero ⇔ every triangle occurs an even number of
//!   times.
//!
//! All three are commutative and associative, so the result depends neither on the thread count nor on the order of
//! triangles.
//!
//! # Why the hash may be trusted
//! XOR and sums are linear, so the hash of an edge must not be linear in anything its triangle shares: with
//! h(a) ⊕ h(b) for an edge, any triangle at all would cancel. Here two 64-bit lanes are computed apart, each a chain of
//! multiplications 64 × 64 → 128 bits whose halves are XORed (as in wyhash): positions are hashed with the coordinates
//! in a different order in either lane; an edge, like a triangle, adds the hashes of its ends, so that their order does
//! not matter, and multiplies the two lanes of the sum, with different constants for each lane of the result. The
//! constants are the hexadecimal digits of π. Equality of positions is equality of their hashes, which errs with the same
//! chance.
//!
//! There is no proof that such a mix is random, and someone who knows the constants could construct a mesh that defeats
//! it. Nothing depends on it alone: the sampler reports every ray whose count is odd, and [`super::check::check`]
//! decides with exact comparisons. The hash decides only that the exact check need not run.

use std::fmt;

use crate::parallel::*;
use glam::DVec3;

use super::check::{MeshReport, Severity, check, turns};
use super::hash::{Hash, PI, mix, position_hash};
use super::measure::{EMPTY, include};
use super::{Aabb, MassProperties, TriangleMesh};
use crate::cancel::checkpoint;

/// A mesh that bounds a solid: every edge has an even number of uses once identical coordinates are one vertex.
///
/// Also every index is in range, every position that a triangle uses is finite, and there is at least one triangle.
/// Positions that no triangle uses may hold anything. Degenerate triangles are allowed; they bound nothing.
#[derive(Clone, Debug)]
pub struct ClosedMesh {
    mesh: TriangleMesh,
    bounds: Aabb,
    oriented: bool,
    every_triangle_even: bool,
}

/// A mesh that is not closed, returned with all its defects.
#[derive(Clone)]
pub struct NotClosed {
    /// The unchanged mesh.
    pub mesh: TriangleMesh,
    /// All its defects.
    pub report: Box<MeshReport>,
}

impl TriangleMesh {
    /// Turns the shells of a closed, consistently oriented mesh that face the wrong way for their depth, once its vertices are placed
    /// anew.
    pub(crate) fn face_outwards(&mut self, place: impl Fn(DVec3) -> DVec3) {
        let positions = self.positions.iter().map(|&position| place(position)).collect();
        let placed = TriangleMesh { positions, triangles: std::mem::take(&mut self.triangles) };
        let turned = turns(&placed).unwrap_or_default();
        self.triangles = placed.triangles;
        turn(&mut self.triangles, &turned);
    }
}

/// Turns some triangles.
fn turn(triangles: &mut [[u32; 3]], turned: &[bool]) {
    let wrong = triangles.iter_mut().zip(turned).filter(|(_, turned)| **turned);
    wrong.for_each(|(triangle, _)| triangle.swap(1, 2));
}

impl ClosedMesh {
    /// Checks a mesh. There is no other way to make a `ClosedMesh` from one.
    pub fn check(mesh: TriangleMesh) -> Result<ClosedMesh, NotClosed> {
        let fold = Fold::of_mesh(&mesh);
        ClosedMesh::of_fold(mesh, fold)
    }

    /// Checks a mesh by the fold of its triangles, which its reader has made.
    pub(crate) fn of_fold(mesh: TriangleMesh, fold: Fold) -> Result<ClosedMesh, NotClosed> {
        if !(fold.sound && fold.edges == [0; 2]) || mesh.triangles.is_empty() {
            let report = check(&mesh);
            // The exact check decides: a position that is not finite is harmless where no triangle uses it.
            if !report.is_closed() {
                return Err(NotClosed { mesh, report: Box::new(report) });
            }
        }
        let (oriented, every_triangle_even) = (fold.directions == [0; 2], fold.triangles == [0; 2]);
        Ok(ClosedMesh { mesh, bounds: fold.bounds, oriented, every_triangle_even })
    }

    /// Returns the checked mesh.
    pub fn mesh(&self) -> &TriangleMesh {
        &self.mesh
    }

    /// Returns the checked mesh by value, to be modified.
    pub fn into_mesh(self) -> TriangleMesh {
        self.mesh
    }

    /// Returns whether every edge is used as often in one direction as in the other, so that the surface has an inner
    /// and an outer side and [`ClosedMesh::signed_volume`] does not depend on the origin.
    pub fn oriented(&self) -> bool {
        self.oriented
    }

    /// Turns triangles so that all are [consistently oriented](ClosedMesh::oriented), and returns how many.
    ///
    /// The solid under the even-odd rule stays the same. Shells face outwards, unless an odd number of others is around a
    /// vertex of theirs.
    ///
    /// # Errors
    /// The unchanged mesh, if it has a one-sided surface, or edges of more than two triangles at which the parts that meet
    /// are not oriented each by itself.
    pub fn orient(mut self) -> Result<(ClosedMesh, usize), ClosedMesh> {
        if self.oriented {
            return Ok((self, 0));
        }
        let Some(turned) = turns(&self.mesh) else { return Err(self) };
        turn(&mut self.mesh.triangles, &turned);
        if Fold::of_mesh(&self.mesh).directions == [0; 2] {
            let count = turned.iter().filter(|turned| **turned).count();
            return Ok((ClosedMesh { oriented: true, ..self }, count));
        }
        turn(&mut self.mesh.triangles, &turned);
        Err(self)
    }

    /// Returns the box of the positions that triangles use.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Returns [`TriangleMesh::signed_volume`]. It is summed anew at each call.
    pub fn signed_volume(&self) -> f64 {
        self.mesh.signed_volume_within(self.bounds)
    }

    /// Returns volume, area, centroid and inertia by sums over the triangles; those of the solid where
    /// [`prove_simple`](super::prove_simple) holds. They are summed anew at each call.
    pub fn mass_properties(&self) -> MassProperties {
        MassProperties::of(&self.mesh, self.bounds)
    }

    /// Returns whether every triangle, as a set of three positions, occurs an even number of times.
    ///
    /// Such a mesh is empty under the even-odd rule; the usual example is a file that holds everything twice. Triangles
    /// with a repeated position are left out, as they bound nothing under the rule either.
    pub fn every_triangle_even(&self) -> bool {
        self.every_triangle_even
    }
}

impl fmt::Debug for NotClosed {
    // The derived form would print every coordinate whenever a result is unwrapped.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("NotClosed").field("report", &self.report).finish_non_exhaustive()
    }
}

impl fmt::Display for NotClosed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the mesh is not closed")?;
        for (i, defect) in self.report.defects().iter().filter(|d| d.severity() == Severity::Error).enumerate() {
            write!(f, "{}{defect}", if i == 0 { ": " } else { " " })?;
        }
        Ok(())
    }
}

impl std::error::Error for NotClosed {}

/// Number of triangles or positions that one task folds.
const CHUNK: usize = 8192;

/// Number of triangles whose corners are hashed before their edges are folded.
pub(super) const BLOCK: usize = 128;

/// The result of one pass over the triangles; combining is commutative and associative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fold {
    edges: Hash,
    directions: Hash,
    triangles: Hash,
    /// True if indices are in range and coordinates are finite. A position that is not used may make it false.
    sound: bool,
    bounds: Aabb,
}

impl Fold {
    pub(super) const EMPTY: Fold =
        Fold { edges: [0; 2], directions: [0; 2], triangles: [0; 2], sound: true, bounds: EMPTY };

    pub(super) fn of_mesh(mesh: &TriangleMesh) -> Fold {
        let TriangleMesh { positions, triangles } = mesh;
        // About six triangles use a position where the file shares it, and one in a soup, where a table of hashes would
        // only be more memory to read.
        if positions.len() >= 2 * triangles.len() {
            return Fold::of_triangles(mesh, |_, position| (position_hash(position), is_finite(position)));
        }
        let mut hashes = vec![[0; 2]; positions.len()];
        let finite = (hashes.par_chunks_mut(CHUNK), positions.par_chunks(CHUNK))
            .into_par_iter()
            .map(|(hashes, positions)| {
                checkpoint();
                let mut finite = true;
                for (hash, position) in hashes.iter_mut().zip(positions) {
                    *hash = position_hash(*position);
                    finite &= is_finite(*position);
                }
                finite
            })
            .reduce(|| true, |a, b| a & b);
        let fold = Fold::of_triangles(mesh, |index, _| (hashes[index as usize], true));
        Fold { sound: fold.sound & finite, ..fold }
    }

    /// Folds all triangles; `hash` returns the hash of a position and whether it is finite.
    fn of_triangles(mesh: &TriangleMesh, hash: impl Fn(u32, DVec3) -> (Hash, bool) + Sync) -> Fold {
        mesh.triangles
            .par_chunks(CHUNK)
            .map(|chunk| {
                checkpoint();
                let mut fold = Fold::EMPTY;
                let mut hashes = [[0; 2]; 3 * BLOCK];
                // Two loops over a block that stays in the L1 cache, because the data of both together does not fit
                // into the registers.
                for block in chunk.chunks(BLOCK) {
                    let (mut sound, mut bounds) = (fold.sound, fold.bounds);
                    for (slot, &index) in hashes.iter_mut().zip(block.as_flattened()) {
                        let Some(&position) = mesh.positions.get(index as usize) else {
                            sound = false;
                            continue;
                        };
                        let finite;
                        (*slot, finite) = hash(index, position);
                        sound &= finite;
                        bounds = include(bounds, position);
                    }
                    (fold.sound, fold.bounds) = (sound, bounds);
                    fold.add(&hashes.as_chunks().0[..block.len()]);
                }
                fold
            })
            .reduce(|| Fold::EMPTY, Fold::join)
    }

    /// Returns the hashes of positions that triangles use, in `hashes`, and includes them in the box.
    pub(super) fn include(&mut self, hashes: &mut [Hash], positions: impl Iterator<Item = DVec3>) {
        let (mut sound, mut bounds) = (self.sound, self.bounds);
        for (hash, position) in hashes.iter_mut().zip(positions) {
            *hash = position_hash(position);
            sound &= is_finite(position);
            bounds = include(bounds, position);
        }
        (self.sound, self.bounds) = (sound, bounds);
    }

    pub(super) fn join(self, other: Fold) -> Fold {
        let lanes = |a: Hash, b: Hash, op: fn(u64, u64) -> u64| [op(a[0], b[0]), op(a[1], b[1])];
        Fold {
            edges: lanes(self.edges, other.edges, |a, b| a ^ b),
            directions: lanes(self.directions, other.directions, u64::wrapping_add),
            triangles: lanes(self.triangles, other.triangles, |a, b| a ^ b),
            sound: self.sound & other.sound,
            bounds: self.bounds.union(other.bounds),
        }
    }

    /// Adds triangles, given the hashes of their corners.
    #[inline(never)]
    pub(super) fn add(&mut self, triangles: &[[Hash; 3]]) {
        let (mut edges, mut directions, mut shapes) = (self.edges, self.directions, self.triangles);
        // The sum of hashes in any order, mixed into two lanes.
        let mixed =
            |[s, t]: Hash, keys: &[u64]| [mix(s ^ keys[0], t ^ keys[1]), mix(s ^ keys[2], t.rotate_left(32) ^ keys[3])];
        let sum = |a: Hash, b: Hash| [a[0].wrapping_add(b[0]), a[1].wrapping_add(b[1])];
        for &[a, b, c] in triangles {
            // Identical ends make no edge, and the other two sides are then one edge, there and back again.
            if same(a, b) | same(b, c) | same(c, a) {
                continue;
            }
            for (from, to) in [(a, b), (b, c), (c, a)] {
                // A mask rather than a branch: which end is lower is random, so a branch would be mispredicted half the
                // time.
                let upwards = u64::from(wide(from) < wide(to)).wrapping_neg();
                let hash = mixed(sum(from, to), &PI[8..12]);
                for lane in 0..2 {
                    edges[lane] ^= hash[lane];
                    directions[lane] = directions[lane].wrapping_add((hash[lane] ^ upwards).wrapping_sub(upwards));
                }
            }
            let hash = mixed(sum(sum(a, b), c), &PI[12..16]);
            shapes = [shapes[0] ^ hash[0], shapes[1] ^ hash[1]];
        }
        (self.edges, self.directions, self.triangles) = (edges, directions, shapes);
    }
}

fn same(a: Hash, b: Hash) -> bool {
    ((a[0] ^ b[0]) | (a[1] ^ b[1])) == 0
}

fn wide(hash: Hash) -> u128 {
    u128::from(hash[0]) | u128::from(hash[1]) << 64
}

#[inline(always)]
fn is_finite(position: DVec3) -> bool {
    // Without short-circuiting: a branch per coordinate would cost more than the comparison.
    position.x.is_finite() & position.y.is_finite() & position.z.is_finite()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::f64::consts::TAU;

    use proptest::prelude::*;

    use super::*;
    use crate::testing::meshes::{cube, hollowed, reversed, tetrahedron, together, unwelded};
    use crate::testing::random::Congruential;

    /// Returns a torus of quads, each cut in two.
    fn torus(around: u32, across: u32) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        for i in 0..around {
            for j in 0..across {
                let (u, v) = (f64::from(i) / f64::from(around), f64::from(j) / f64::from(across));
                let ((su, cu), (sv, cv)) = ((u * TAU).sin_cos(), (v * TAU).sin_cos());
                mesh.positions.push(DVec3::new((3.0 + cv) * cu, (3.0 + cv) * su, sv));
                let at = |i, j| (i % around) * across + j % across;
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        mesh
    }

    fn both_forms(mesh: &TriangleMesh) -> [TriangleMesh; 2] {
        [mesh.clone(), unwelded(mesh)]
    }

    #[test]
    fn closed_meshes_pass_with_shared_or_separate_vertices() {
        for mesh in [cube(DVec3::ZERO, 1.0), tetrahedron(), torus(300, 200)] {
            for mesh in both_forms(&mesh) {
                let bounds = mesh.bounds().unwrap();
                let closed = ClosedMesh::check(mesh.clone()).unwrap();
                assert!(closed.oriented() && !closed.every_triangle_even());
                assert_eq!(closed.bounds(), bounds);
                assert_eq!(closed.signed_volume(), mesh.signed_volume());
                assert_eq!(closed.into_mesh(), mesh);
            }
        }
    }

    #[test]
    fn turned_triangles_are_turned_back() {
        let block = cube(DVec3::ZERO, 4.0);
        let meshes = [
            torus(30, 20),
            // A part in a cavity; blocks that touch in an edge.
            together(&[hollowed(block.clone(), &cube(DVec3::ONE, 2.0)), cube(DVec3::splat(1.5), 0.5)]),
            together(&[block.clone(), cube(DVec3::new(4.0, 4.0, 0.0), 4.0)]),
        ];
        let mut random = Congruential::new(4);
        for mesh in meshes.iter().flat_map(both_forms) {
            for _ in 0..20 {
                let mut turned = mesh.clone();
                let mut count = 0;
                for triangle in &mut turned.triangles {
                    if random.below(3) == 0 {
                        triangle.swap(1, 2);
                        count += 1;
                    }
                }
                let (oriented, back) = ClosedMesh::check(turned).unwrap().orient().unwrap();
                assert!(oriented.oriented() && back == count && oriented.mesh() == &mesh);
            }
        }
    }

    #[test]
    fn blocks_with_a_common_wall_are_oriented_or_stay_as_they_are() {
        let block = cube(DVec3::ZERO, 4.0);
        let mesh = together(&[block.clone(), cube(DVec3::new(4.0, 0.0, 0.0), 4.0)]);
        for triangle in 0..mesh.triangles.len() {
            let mut turned = mesh.clone();
            turned.triangles[triangle].swap(1, 2);
            match ClosedMesh::check(turned.clone()).unwrap().orient() {
                Ok((oriented, _)) => assert!(check(oriented.mesh()).is_oriented()),
                Err(same) => assert!(!same.oriented() && same.mesh() == &turned),
            }
        }
    }

    #[test]
    fn surfaces_with_one_side_stay_as_they_are() {
        // The projective plane, of as few triangles as it can have.
        let triangles = [
            [0, 1, 4],
            [0, 1, 5],
            [0, 2, 3],
            [0, 2, 5],
            [0, 3, 4],
            [1, 2, 3],
            [1, 2, 4],
            [1, 3, 5],
            [2, 4, 5],
            [3, 4, 5],
        ];
        let positions = [[0, 0, 0], [5, 0, 1], [1, 5, 0], [0, 1, 5], [5, 4, 2], [2, 5, 5]];
        let positions = positions.map(|place: [i32; 3]| DVec3::from(place.map(f64::from))).to_vec();
        let mesh = TriangleMesh { positions, triangles: triangles.to_vec() };
        let same = ClosedMesh::check(mesh.clone()).unwrap().orient().unwrap_err();
        assert!(!same.oriented() && same.mesh() == &mesh);
    }

    #[test]
    fn every_missing_triangle_is_found() {
        let mesh = torus(30, 20);
        for missing in 0..mesh.triangles.len() {
            for mut mesh in both_forms(&mesh) {
                mesh.triangles.remove(missing);
                let refused = ClosedMesh::check(mesh.clone()).unwrap_err();
                assert!(!refused.report.is_closed());
                assert_eq!(refused.mesh, mesh);
            }
        }
    }

    #[test]
    fn every_corner_moved_by_one_ulp_is_found() {
        let mesh = unwelded(&torus(20, 10));
        for corner in 0..mesh.positions.len() {
            for axis in 0..3 {
                let mut mesh = mesh.clone();
                mesh.positions[corner][axis] = mesh.positions[corner][axis].next_up();
                assert!(ClosedMesh::check(mesh).is_err());
            }
        }
    }

    #[test]
    fn negative_zero_equals_zero() {
        let mut mesh = unwelded(&tetrahedron());
        for coordinate in mesh.positions.iter_mut().step_by(2).flat_map(|p| p.as_mut()) {
            if *coordinate == 0.0 {
                *coordinate = -0.0;
            }
        }
        assert!(ClosedMesh::check(mesh).unwrap().oriented());
    }

    #[test]
    fn a_flipped_triangle_leaves_a_mesh_closed_but_not_oriented() {
        for mut mesh in both_forms(&torus(30, 20)) {
            mesh.triangles[77].swap(0, 1);
            let closed = ClosedMesh::check(mesh).unwrap();
            assert!(!closed.oriented() && !closed.every_triangle_even());
        }
    }

    #[test]
    fn a_doubled_mesh_is_closed_but_empty() {
        let mesh = cube(DVec3::ONE, 2.0);
        for second in [mesh.clone(), reversed(&mesh)] {
            let closed = ClosedMesh::check(together(&[mesh.clone(), second])).unwrap();
            assert!(closed.oriented() && closed.every_triangle_even());
        }
        // An open mesh that occurs twice is closed, by the same count.
        let open = TriangleMesh { triangles: vec![[0, 1, 2]], ..mesh.clone() };
        assert!(ClosedMesh::check(together(&[open.clone(), open.clone()])).unwrap().every_triangle_even());
        let tripled = ClosedMesh::check(together(&[mesh.clone(), mesh.clone(), mesh.clone()])).unwrap();
        assert!(!tripled.every_triangle_even());
    }

    #[test]
    fn degenerate_triangles_bound_nothing() {
        for mut mesh in both_forms(&cube(DVec3::ZERO, 1.0)) {
            mesh.triangles.extend([[0, 0, 0], [0, 0, 5], [3, 5, 3]]);
            let closed = ClosedMesh::check(mesh.clone()).unwrap();
            assert!(closed.oriented() && !closed.every_triangle_even());
            // No two of them share three corners, yet without the cube the mesh bounds nothing.
            mesh.triangles.drain(..12);
            assert!(ClosedMesh::check(mesh).unwrap().every_triangle_even());
        }
    }

    #[test]
    fn empty_non_finite_and_out_of_range_meshes_are_refused() {
        assert!(ClosedMesh::check(TriangleMesh::default()).is_err());
        for mesh in both_forms(&tetrahedron()) {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut mesh = mesh.clone();
                for y in mesh.positions.iter_mut().map(|p| &mut p.y).filter(|y| **y == 1.0) {
                    *y = bad;
                }
                assert!(ClosedMesh::check(mesh).is_err());
            }
            let mut far = mesh.clone();
            far.triangles.push([0, 1, 1000]);
            assert!(ClosedMesh::check(far).is_err());
            let mut unused = mesh;
            unused.positions.push(DVec3::NAN);
            let closed = ClosedMesh::check(unused).unwrap();
            assert!(closed.oriented() && closed.bounds().max == DVec3::ONE);
        }
    }

    /// Answers the same questions with tables: closed, oriented, every triangle even.
    fn exactly(mesh: &TriangleMesh) -> (bool, bool, bool) {
        let key = |i: u32| mesh.positions[i as usize].to_array().map(|c| (c + 0.0).to_bits());
        let (mut edges, mut triangles) = (BTreeMap::new(), BTreeMap::new());
        for triangle in &mesh.triangles {
            let mut keys = triangle.map(key);
            for (a, b) in [(keys[0], keys[1]), (keys[1], keys[2]), (keys[2], keys[0])] {
                if a != b {
                    let uses = edges.entry((a.min(b), a.max(b))).or_insert((0, 0));
                    uses.0 += 1;
                    uses.1 += if a < b { 1 } else { -1 };
                }
            }
            keys.sort_unstable();
            if keys[0] != keys[1] && keys[1] != keys[2] {
                *triangles.entry(keys).or_insert(0) += 1;
            }
        }
        (
            edges.values().all(|uses| uses.0 % 2 == 0),
            edges.values().all(|uses| uses.1 == 0),
            triangles.values().all(|n| n % 2 == 0),
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]
        #[test]
        fn edge_hashes_agree_with_edge_tables(
            places in prop::collection::vec((0..2u8, 0..2u8, 0..2u8), 4..6),
            picks in prop::collection::vec((0..4u32, 0..4u32, 0..4u32), 1..10),
            solids in prop::collection::vec((0..3u8, any::<bool>()), 0..3),
        ) {
            // Few positions, some of them identical, so that edges coincide often; and whole solids, so that many
            // meshes close.
            let mut mesh = TriangleMesh {
                positions: places.iter().map(|&(x, y, z)| DVec3::new(x.into(), y.into(), z.into())).collect(),
                triangles: picks.iter().map(|&(a, b, c)| [a, b, c]).collect(),
            };
            if picks.len() > 6 {
                mesh.triangles.clear();
            }
            for (at, facing_in) in solids {
                let solid = cube(DVec3::X * f64::from(at), 1.0);
                mesh = together(&[mesh, if facing_in { reversed(&solid) } else { solid }]);
            }
            prop_assume!(!mesh.triangles.is_empty());
            let exact = exactly(&mesh);
            for mesh in both_forms(&mesh) {
                let fold = Fold::of_mesh(&mesh);
                prop_assert!(fold.sound);
                prop_assert_eq!((fold.edges == [0; 2], fold.directions == [0; 2], fold.triangles == [0; 2]), exact);
                let report = check(&mesh);
                prop_assert_eq!((report.is_closed(), report.is_oriented(), report.every_triangle_even), exact);
                prop_assert_eq!(ClosedMesh::check(mesh).is_ok(), exact.0);
            }
        }
    }
}
