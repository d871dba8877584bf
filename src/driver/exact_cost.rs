//! Forecast of the memory of an exact volume.
//!
//! The memory grows with the triangles, most for those in the box of another solid, and with the segments in which triangles of
//! different shells meet. The triangles are counted; the segments are counted between samples of the triangles, as finding
//! them all is most of the work. The bytes were measured as peak memory beyond the meshes (`/usr/bin/time -v ldi-ops intersect
//! --exact`): gyroids of 0.4 to 3.5 million triangles against a bone, themselves and themselves shifted, a lattice, chain mail,
//! brushes and frames, and combs of plates with up to 6 million segments between 14,000 triangles.

use crate::parallel::*;
use glam::DVec3;

use super::input::Solid;
use crate::box_tree::{Box32, FourBoxes};
use crate::mesh::{Aabb, TriangleMesh};

/// Bytes of any triangle: 80 to 93 were measured.
const BYTES_OF_TRIANGLE: f64 = 110.0;

/// Further bytes of a triangle in the box of another solid, or of one whose shells may be split: 30 to 100 were measured.
const BYTES_OF_NEAR_TRIANGLE: f64 = 110.0;

/// Bytes of a segment: 63 to 120 were measured. As not every pair that [`Triangle::may_meet`] meets, the forecast for combs of
/// plates is four times the peak, and for the others 1.5 to 2.5 times.
const BYTES_OF_SEGMENT: f64 = 128.0;

/// Further bytes of a triangle and of a segment for the mesh of the result: up to 20 and 100 were measured.
const BYTES_OF_MESH_TRIANGLE: f64 = 20.0;
const BYTES_OF_MESH_SEGMENT: f64 = 128.0;

/// Number of triangles that are drawn from a mesh.
const DRAWN: usize = 4096;

/// Number of triangles, of those that are drawn, that are compared with all that are drawn from another mesh.
const COMPARED: usize = 256;

/// The bytes that an exact result takes while it is found, beyond those that the process holds.
pub struct Costs {
    /// Of the volume.
    pub volume: f64,
    /// Of the volume and the mesh.
    pub mesh: f64,
}

impl Costs {
    /// Returns those of a number of triangles, of those that are near another solid, and of segments.
    fn of(triangles: f64, near: f64, segments: f64) -> Costs {
        let volume = BYTES_OF_TRIANGLE * triangles + BYTES_OF_NEAR_TRIANGLE * near + BYTES_OF_SEGMENT * segments;
        Costs { volume, mesh: volume + BYTES_OF_MESH_TRIANGLE * triangles + BYTES_OF_MESH_SEGMENT * segments }
    }
}

/// Returns the bytes that an exact volume of the solids and its mesh take.
pub fn costs(solids: &[&Solid]) -> Costs {
    let triangles: f64 = solids.iter().map(|solid| solid.mesh().triangles.len() as f64).sum();
    let drawn: Vec<Drawn> = solids.iter().map(|solid| Drawn::from(solid.mesh())).collect();
    let near: f64 = (0..solids.len()).map(|i| near_triangles(solids, &drawn, i)).sum();
    // Shells of one solid may meet, too.
    let segments: f64 = (0..solids.len())
        .flat_map(|i| (i..solids.len()).map(move |j| [i, j]))
        .map(|pair| expected_segments(pair.map(|i| (solids[i], &drawn[i]))))
        .sum();
    Costs::of(triangles, near, segments)
}

/// Returns a forecast of the same as if each triangle met each other one, without a look at them: for small solids [`costs`] takes as
/// long as the volume.
pub fn costs_if_all_meet(solids: &[&Solid]) -> Costs {
    let triangles: f64 = solids.iter().map(|solid| solid.mesh().triangles.len() as f64).sum();
    Costs::of(triangles, triangles, 0.5 * triangles * triangles)
}

/// Returns about how many triangles of a solid lie in the box of another; of a single solid all.
fn near_triangles(solids: &[&Solid], drawn: &[Drawn], i: usize) -> f64 {
    let others = solids.iter().enumerate().filter(|&(j, _)| j != i).map(|(_, other)| other.bounds());
    match others.reduce(Aabb::union) {
        Some(around) => {
            let near = drawn[i].touching(&around);
            near.scale * near.triangles.len() as f64
        }
        None => solids[i].mesh().triangles.len() as f64,
    }
}

/// Returns about how many pairs of triangles of two solids, or of one, meet, with two standard deviations of the sample.
fn expected_segments([(first, of_first), (second, of_second)]: [(&Solid, &Drawn); 2]) -> f64 {
    let is_same = std::ptr::eq(first, second);
    if !touch(&first.bounds(), &second.bounds()) {
        return 0.0;
    }
    let [a, b] = [(of_first, second), (of_second, first)].map(|(own, other)| own.touching(&other.bounds()));
    let compared = &a.triangles[..a.triangles.len().min(COMPARED)];
    let boxes = |some: &[Triangle]| FourBoxes::of(some.iter().map(|triangle| Box32::of(triangle.extent)));
    let fours: Vec<FourBoxes> = b.triangles.chunks(4).map(boxes).collect();
    let met_by = |f: &Triangle| -> usize {
        let extent = FourBoxes::repeating(&Box32::of(f.extent));
        let of_four = |(four, some): (&FourBoxes, &[Triangle])| match four.touching(&extent) {
            0 => 0,
            _ => some.iter().filter(|g| f.may_meet(g) && !f.shares_a_corner_with(g)).count(),
        };
        fours.iter().zip(b.triangles.chunks(4)).map(of_four).sum()
    };
    let met: usize = compared.par_iter().map(met_by).sum();
    let share = compared.len().max(1) as f64 / a.triangles.len().max(1) as f64;
    let each_way = if is_same { 2.0 } else { 1.0 };
    (met as f64 + 2.0 * (met as f64).sqrt()) * a.scale * b.scale / share / each_way
}

/// Returns whether two boxes have a common point.
fn touch(one: &Aabb, other: &Aabb) -> bool {
    one.min.cmple(other.max).all() && one.max.cmpge(other.min).all()
}

/// A sample of the triangles of a mesh.
struct Drawn {
    triangles: Vec<Triangle>,
    /// Number of triangles of the mesh for each that was drawn.
    scale: f64,
}

impl Drawn {
    /// Draws triangles evenly, in a fixed order without a period.
    fn from(mesh: &TriangleMesh) -> Drawn {
        let all = mesh.triangles.len();
        let count = all.min(DRAWN);
        // The multiples of the golden ratio, modulo 1, fill an interval evenly.
        let at = |i: usize| match all <= DRAWN {
            true => i,
            false => ((i as f64 * 0.618_033_988_749_894_9).fract() * all as f64) as usize % all,
        };
        let triangle = |i| Triangle::new(mesh.triangles[at(i)].map(|vertex| mesh.positions[vertex as usize]));
        let triangles = (0..count).into_par_iter().map(triangle).collect();
        Drawn { triangles, scale: all as f64 / count.max(1) as f64 }
    }

    /// Returns those that touch a box.
    fn touching(&self, around: &Aabb) -> Drawn {
        let triangles = self.triangles.iter().filter(|triangle| triangle.touches(around)).copied().collect();
        Drawn { triangles, scale: self.scale }
    }
}

/// A triangle with its box.
#[derive(Clone, Copy)]
struct Triangle {
    corners: [DVec3; 3],
    extent: Aabb,
}

impl Triangle {
    fn new(corners: [DVec3; 3]) -> Triangle {
        let [a, b, c] = corners;
        Triangle { corners, extent: Aabb { min: a.min(b).min(c), max: a.max(b).max(c) } }
    }

    fn touches(&self, around: &Aabb) -> bool {
        touch(&self.extent, around)
    }

    /// Returns whether triangles are neighbours, in one mesh or in two that coincide, where [`BYTES_OF_NEAR_TRIANGLE`] includes
    /// their segments.
    fn shares_a_corner_with(&self, other: &Triangle) -> bool {
        self.corners.iter().any(|corner| other.corners.contains(corner))
    }

    /// Returns false only for triangles whose boxes are apart, or of which one lies on one side of the other's plane.
    fn may_meet(&self, other: &Triangle) -> bool {
        self.touches(&other.extent) && self.straddles(other) && other.straddles(self)
    }

    /// Returns whether there are corners on both sides of the plane of another triangle.
    fn straddles(&self, other: &Triangle) -> bool {
        let [a, b, c] = other.corners;
        let normal = (b - a).cross(c - a);
        let sides = self.corners.map(|corner| normal.dot(corner - a));
        sides.iter().any(|&side| side > 0.0) && sides.iter().any(|&side| side < 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::ClosedMesh;
    use crate::solids;

    fn solid(boxes: impl Iterator<Item = [DVec3; 2]>) -> Solid {
        let mut all = TriangleMesh::default();
        for [min, max] in boxes {
            let cuboid = solids::cuboid(min, max).unwrap();
            let first = all.positions.len() as u32;
            all.positions.extend(cuboid.positions);
            all.triangles.extend(cuboid.triangles.iter().map(|triangle| triangle.map(|vertex| first + vertex)));
        }
        Solid::from_closed(ClosedMesh::check(all).unwrap(), "boxes")
    }

    fn segments(pair: [&Solid; 2]) -> f64 {
        let drawn = pair.map(|solid| Drawn::from(solid.mesh()));
        expected_segments([(pair[0], &drawn[0]), (pair[1], &drawn[1])])
    }

    fn near(solids: &[&Solid], i: usize) -> f64 {
        let drawn: Vec<Drawn> = solids.iter().map(|solid| Drawn::from(solid.mesh())).collect();
        near_triangles(solids, &drawn, i)
    }

    /// Plates across x or y, in a cube of side `count`.
    fn comb(count: usize, axis: usize) -> Solid {
        let side = count as f64;
        solid((0..count).map(|i| {
            let (mut min, mut max) = (DVec3::splat(-0.1), DVec3::splat(side + 0.1));
            (min[axis], max[axis]) = (i as f64 + 0.1, i as f64 + 0.6);
            (min.z, max.z) = (min.z - 0.01 * axis as f64, max.z + 0.02 * axis as f64);
            [min, max]
        }))
    }

    #[test]
    fn segments_of_combs_are_counted_exactly_and_by_samples() {
        // Each face across x meets each face across y in a line through two triangles of both, and the ends of the shorter plates.
        for (count, tolerance) in [(8, 0.0), (60, 0.5), (1500, 0.5)] {
            let combs = [comb(count, 0), comb(count, 1)];
            let plates = (count * count) as f64;
            let found = segments([&combs[0], &combs[1]]) / plates;
            assert!((12.0 * (1.0 - tolerance)..=40.0).contains(&found), "{count}: {found} a pair of plates");
        }
    }

    #[test]
    fn solids_apart_have_no_segments_and_crossing_shells_of_one_solid_have() {
        let at = |x: f64| [DVec3::new(x, 0.0, 0.0), DVec3::new(x + 1.0, 1.0 + 0.1 * x, 1.0 + 0.1 * x)];
        let [a, b] = [solid([at(0.0)].into_iter()), solid([at(5.0)].into_iter())];
        assert_eq!(segments([&a, &b]), 0.0);
        assert_eq!(segments([&a, &a]), 0.0);
        let crossing = solid([at(0.0), at(0.5)].into_iter());
        assert!((4.0..60.0).contains(&segments([&crossing, &crossing])));
    }

    #[test]
    fn only_triangles_in_the_box_of_another_solid_are_near() {
        let combs = [comb(40, 0), solid([[DVec3::splat(-1.0), DVec3::splat(9.05)]].into_iter())];
        let solids = combs.each_ref();
        assert_eq!(near(&solids, 1), 6.0);
        let found = near(&solids, 0);
        assert!((60.0..120.0).contains(&found), "{found}");
        assert_eq!(near(&solids[..1], 0), 480.0);
        let Costs { volume, mesh } = costs(&solids);
        assert!(mesh > volume && volume > 492.0 * BYTES_OF_TRIANGLE && volume < costs_if_all_meet(&solids).volume);
    }
}
