//! The box, volume and area of a triangle mesh, bit for bit independent of the thread count.
//!
//! Sums run over chunks of a fixed number of triangles, each summed in order with compensation (Knuth's two-sum), and the
//! chunk totals are added in order, again with compensation. Volume is the divergence sum ⅙ Σ a · (b × c), with the
//! corners taken relative to the centre of the box, so that a mesh far from the origin loses nothing to cancellation, and
//! scaled by a power of two, so that the cube of a very large or small coordinate neither overflows nor underflows before
//! the result itself does.

use crate::parallel::*;
use glam::DVec3;

use super::{Aabb, TriangleMesh};

/// Number of triangles that one task sums. It decides the order of additions: changing it changes bits of the result.
const CHUNK: usize = 8192;

impl TriangleMesh {
    /// Returns the box of the positions that triangles use, or `None` where no triangle uses a comparable position.
    ///
    /// Positions that no triangle uses do not count, nor do triangles with an index out of range, nor coordinates that
    /// are NaN.
    pub fn bounds(&self) -> Option<Aabb> {
        let bounds = self
            .triangles
            .par_chunks(CHUNK)
            .map(|chunk| {
                let corners = chunk.iter().filter_map(|triangle| self.corners(triangle)).flatten();
                corners.fold(EMPTY, include)
            })
            .reduce(|| EMPTY, Aabb::union);
        bounds.min.cmple(bounds.max).all().then_some(bounds)
    }

    /// Returns the enclosed volume, negative where the triangles face inwards: the divergence sum over all triangles.
    ///
    /// It is a volume only for a closed, oriented mesh; overlapping shells count as often as they overlap. Triangles
    /// with an index out of range are left out. The result is NaN where a coordinate is not finite.
    pub fn signed_volume(&self) -> f64 {
        self.signed_volume_in(self.frame())
    }

    /// Returns the same, for a mesh whose [`bounds`](TriangleMesh::bounds) are known: finding them takes as long as the
    /// sum.
    pub(super) fn signed_volume_within(&self, bounds: Aabb) -> f64 {
        self.signed_volume_in(Frame::of(Some(bounds)))
    }

    fn signed_volume_in(&self, frame: Frame) -> f64 {
        let sum = self.sum(|a, b, c| {
            let [a, b, c] = [frame.local(a), frame.local(b), frame.local(c)];
            a.dot(b.cross(c))
        });
        sum / 6.0 * frame.unit * frame.unit * frame.unit
    }

    /// Returns the total area of the triangles, each counted as often as it occurs.
    ///
    /// Triangles with an index out of range are left out. The result is NaN where a coordinate is not finite.
    pub fn area(&self) -> f64 {
        let frame = self.frame();
        let sum = self.sum(|a, b, c| {
            let [a, b, c] = [frame.local(a), frame.local(b), frame.local(c)];
            (b - a).cross(c - a).length()
        });
        sum / 2.0 * frame.unit * frame.unit
    }

    /// Returns the three positions of a triangle, or `None` where an index is out of range.
    #[inline]
    pub(super) fn corners(&self, triangle: &[u32; 3]) -> Option<[DVec3; 3]> {
        let position = |index: u32| self.positions.get(index as usize).copied();
        Some([position(triangle[0])?, position(triangle[1])?, position(triangle[2])?])
    }

    /// Sums `term` over the triangles with indices in range, in an order that does not depend on the thread count.
    fn sum(&self, term: impl Fn(DVec3, DVec3, DVec3) -> f64 + Sync) -> f64 {
        self.sums(|[a, b, c]| [term(a, b, c)])[0]
    }

    /// Sums several terms at once.
    pub(super) fn sums<const N: usize>(&self, terms: impl Fn([DVec3; 3]) -> [f64; N] + Sync) -> [f64; N] {
        let totals: Vec<Sums<N>> = self
            .triangles
            .par_chunks(CHUNK)
            .map(|chunk| {
                let mut sums = Sums::default();
                chunk.iter().filter_map(|triangle| self.corners(triangle)).for_each(|corners| sums.add(terms(corners)));
                sums
            })
            .collect();
        let mut total = Sums::default();
        totals.into_iter().for_each(|part| total.join(part));
        total.totals()
    }

    fn frame(&self) -> Frame {
        Frame::of(self.bounds())
    }
}

impl Frame {
    /// Returns the frame of a mesh with these bounds.
    pub(crate) fn of(bounds: Option<Aabb>) -> Frame {
        let Some(Aabb { min, max }) = bounds else { return Frame { centre: DVec3::ZERO, unit: 1.0 } };
        let farthest = min.abs().max(max.abs()).max_element();
        // The power of two at or below the farthest coordinate; the clamp keeps it and its reciprocal normal numbers.
        let exponent = ((farthest.to_bits() >> 52) as i64 - 1023).clamp(-1000, 1000);
        let unit = f64::from_bits(((exponent + 1023) as u64) << 52);
        Frame { centre: (min / unit) * 0.5 + (max / unit) * 0.5, unit }
    }
}

/// Local coordinates for sums: centred on the box, in a unit that brings all of it near 1.
pub(crate) struct Frame {
    /// Centre of the box, in `unit`.
    centre: DVec3,
    /// A power of two, so that scaling by it is exact.
    unit: f64,
}

impl Frame {
    /// Returns the frame in which the origin is `centre` · `unit`, `unit` being a power of two.
    pub(crate) fn new(centre: DVec3, unit: f64) -> Frame {
        Frame { centre, unit }
    }

    #[inline]
    pub(crate) fn local(&self, position: DVec3) -> DVec3 {
        // The same as a division, as the unit is a power of two; the reciprocal is computed once.
        position * (1.0 / self.unit) - self.centre
    }

    /// Returns the world position of local coordinates.
    pub(crate) fn world(&self, local: DVec3) -> DVec3 {
        (local + self.centre) * self.unit
    }

    /// Returns the length of a local unit.
    pub(crate) fn unit(&self) -> f64 {
        self.unit
    }
}

/// Running sums with their accumulated rounding errors, side by side, so that several are added by one instruction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sums<const N: usize> {
    values: [f64; N],
    lost: [f64; N],
}

impl<const N: usize> Default for Sums<N> {
    fn default() -> Self {
        Sums { values: [0.0; N], lost: [0.0; N] }
    }
}

impl<const N: usize> Sums<N> {
    /// Adds a term to each.
    #[inline]
    pub(crate) fn add(&mut self, terms: [f64; N]) {
        let Sums { values, lost } = self;
        let former = *values;
        for i in 0..N {
            let value = former[i] + terms[i];
            let kept = value - former[i];
            lost[i] += (former[i] - (value - kept)) + (terms[i] - kept);
            values[i] = value;
        }
    }

    /// Adds the terms of other sums.
    pub(crate) fn join(&mut self, other: Sums<N>) {
        self.add(other.values);
        self.add(other.lost);
    }

    /// Returns the sums.
    pub(crate) fn totals(self) -> [f64; N] {
        std::array::from_fn(|i| self.values[i] + self.lost[i])
    }
}

/// One such sum.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sum(Sums<1>);

impl Sum {
    #[inline]
    pub(crate) fn add(&mut self, term: f64) {
        self.0.add([term]);
    }

    /// Adds the terms of another sum.
    pub(crate) fn join(&mut self, other: Sum) {
        self.0.join(other.0);
    }

    /// Returns the sum.
    pub(crate) fn total(self) -> f64 {
        self.0.totals()[0]
    }
}

/// The empty box, which any union replaces.
pub(crate) const EMPTY: Aabb = Aabb { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

/// Grows a box to include a position; a NaN coordinate leaves it unchanged.
#[inline]
pub(crate) fn include(bounds: Aabb, position: DVec3) -> Aabb {
    // Written out because the comparison then compiles to one instruction, and a NaN leaves the box unchanged.
    let least = |p: f64, b: f64| if p < b { p } else { b };
    let most = |p: f64, b: f64| if p > b { p } else { b };
    let (p, Aabb { min, max }) = (position, bounds);
    Aabb {
        min: DVec3::new(least(p.x, min.x), least(p.y, min.y), least(p.z, min.z)),
        max: DVec3::new(most(p.x, max.x), most(p.y, max.y), most(p.z, max.z)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::meshes::{cube, tetrahedron, together};

    #[test]
    fn volume_and_area_of_a_cube_are_exact_at_any_place() {
        for (corner, side) in [(0.0, 1.0), (1e6, 3.0), (-1e15, 2.0), (0.0, 2f64.powi(100)), (0.0, 2f64.powi(-330))] {
            let mesh = cube(DVec3::splat(corner), side);
            assert_eq!(mesh.signed_volume(), side * side * side, "{corner} {side}");
            assert_eq!(mesh.area(), 6.0 * side * side, "{corner} {side}");
        }
        for side in [1e-30, 1e30, 1e100] {
            let ratio = cube(DVec3::splat(-side), side).signed_volume() / side.powi(3);
            assert!((ratio - 1.0).abs() < 1e-15, "{side} {ratio}");
        }
    }

    #[test]
    fn bounds_enclose_used_positions_only() {
        let mut mesh = tetrahedron();
        let bounds = mesh.bounds();
        assert_eq!(bounds, Some(Aabb { min: DVec3::ZERO, max: DVec3::ONE }));
        mesh.positions.push(DVec3::splat(9.0));
        assert_eq!(mesh.bounds(), bounds);
        mesh.triangles.push([0, 1, 77]);
        assert_eq!(mesh.bounds(), bounds);
        mesh.triangles.clear();
        assert_eq!(mesh.bounds(), None);
        assert_eq!((mesh.signed_volume(), mesh.area()), (0.0, 0.0));
    }

    #[test]
    fn coordinates_that_are_not_finite_give_nan() {
        for bad in [f64::NAN, f64::INFINITY] {
            let mut mesh = tetrahedron();
            mesh.positions[1].x = bad;
            assert!(mesh.signed_volume().is_nan() && mesh.area().is_nan());
        }
    }

    #[test]
    fn volume_and_area_do_not_depend_on_the_thread_count() {
        let cubes: Vec<_> = (0..5000)
            .map(|i| {
                let corner = DVec3::new(f64::from(i) * 0.37, f64::from(i % 71) * 1.1, f64::from(i % 13) / 3.0);
                cube(corner, 0.1 + f64::from(i % 7) / 9.0)
            })
            .collect();
        let mesh = together(&cubes);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| (mesh.signed_volume().to_bits(), mesh.area().to_bits(), mesh.bounds()))
        };
        assert_eq!(with(1), with(3));
        let exact: f64 = (0..5000).map(|i| (0.1 + f64::from(i % 7) / 9.0f64).powi(3)).sum();
        assert!((mesh.signed_volume() / exact - 1.0).abs() < 1e-12);
    }
}
