//! Sums in boxes of finer pixels, for the parts of a mesh that need them.
//!
//! The rays through a box are those of a finer raster whose lattice has the same step, so that nothing is rounded again and the rays
//! of the coarse grid keep their crossings to the bit. A span that reaches beyond the box is cut off there; a gap that does begins or
//! ends in a span without length. Which gaps in the box are out is decided as on a whole raster: a set of nodes that the box cuts off
//! from certain inside and outside is one component more.

use crate::parallel::*;

use super::{Exterior, Membership, RaySpans, ResolveError, resolve};
use crate::cancel::checkpoint;
use crate::fixed::{Crossing, Hit, Pixels, TriangleHit};
use crate::grid::{Axis, FineBox, LatticeSolid};
use crate::ldi::{Ldi, TooManySamples};
use crate::sampler::Mode;
use crate::sampler::cpu::CpuSampler;
use crate::sampler::lists::{BandLists, ListSampler, RayLists};

/// The part of a ray in a box: positions on its lattice, and the nodes between them.
struct Segment {
    start: i32,
    end: i32,
    nodes: Pixels,
}

impl Segment {
    /// Appends the hits on a ray that lie in the segment. Where a span reaches beyond it, it ends there; where a gap does, it ends
    /// in a span without length. `cut` is scratch space.
    fn append<H: Hit>(&self, exterior: Exterior, hits: &[H], cut: &mut Vec<H>, kept: &mut Vec<H>) {
        let &Segment { start, end, nodes } = self;
        let before = hits.partition_point(|hit| hit.crossing().nearest() <= start);
        let until = hits.partition_point(|hit| hit.crossing().nearest() < end);
        // Of the hits beyond an end, those of the span or the gap that is cut there.
        let beyond = |passed: usize| match exterior {
            Exterior::Out if passed == 0 || passed == hits.len() => 0,
            Exterior::Out => 2 - passed % 2,
            Exterior::In => passed % 2,
        };
        let moved = |hit: &H| {
            let crossing = hit.crossing();
            let crossing = match crossing.nearest() {
                at if at <= start => Crossing::at(0.0, crossing.winding()),
                at if at >= end => Crossing::at(f64::from(end - start), crossing.winding()),
                _ => crossing.moved(-start),
            };
            H::new(crossing, hit.triangle().unwrap_or(0))
        };
        cut.clear();
        cut.extend(hits[before - beyond(before)..until + beyond(until)].iter().map(moved));
        exterior.keep_gaps(nodes, cut, kept);
    }
}

impl<H: Hit + Sync> RaySpans<H> {
    /// Returns the spans of the rays of a box of finer pixels, as far as they lie in it. `through` gives the hits of a ray by its column
    /// and row in the box, at depths on the finer raster.
    pub(super) fn in_box<'h>(
        fine: &FineBox,
        axis: Axis,
        exterior: Exterior,
        through: impl Fn([u32; 2]) -> &'h [H] + Sync,
    ) -> Result<RaySpans<H>, TooManySamples>
    where
        H: 'h,
    {
        let [start, end] = fine.span(axis);
        let segment = Segment { start, end, nodes: Pixels::new(fine.grid().shift()) };
        let (columns, rows) = fine.grid().image_size(axis);
        let of_row = |cut: &mut Vec<H>, row: u32| {
            checkpoint();
            let (mut ends, mut hits) = (Vec::with_capacity(columns as usize), Vec::new());
            for column in 0..columns {
                segment.append(exterior, through([column, row]), cut, &mut hits);
                ends.push(hits.len() as u32);
            }
            BandLists { ends, hits, crossings: 0 }
        };
        let of_rows = (0..rows).into_par_iter().with_min_len(4).map_init(Vec::new, of_row).collect();
        let RayLists { offsets, hits, .. } = RayLists::of_bands(axis, of_rows)?;
        Ok(RaySpans { axis, offsets, hits })
    }

    /// Computes the spans of primitives along an axis in a box of finer pixels of their grid.
    pub(crate) fn of_primitives_in_box(
        primitives: &LatticeSolid,
        fine: &FineBox,
        axis: Axis,
        exterior: Exterior,
    ) -> Result<RaySpans<H>, TooManySamples> {
        let primitives = primitives.along(axis, fine);
        let lists = CpuSampler::default().crossings(&primitives, axis, exterior.keep())?;
        let through = RaySpans { axis, offsets: lists.offsets, hits: lists.hits };
        let (columns, _) = primitives.grid().image_size(axis);
        RaySpans::in_box(fine, axis, exterior, |[column, row]| through.of_ray(row * columns + column))
    }
}

/// A membership test on the lattice of a box of finer pixels.
struct InBox<'m, M> {
    membership: &'m M,
    /// The position on the test's lattice that is position 0 of the box.
    origin: [i32; 3],
}

impl<M: Membership> Membership for InBox<'_, M> {
    type Memory = M::Memory;

    fn contains(&self, point: [i32; 3], memory: &mut M::Memory) -> bool {
        self.membership.contains([0, 1, 2].map(|i| point[i] + self.origin[i]), memory)
    }
}

/// Returns the images of a sum in a box of finer pixels from its spans there; `None` where rays contradict one another.
/// `membership` is the test on the coarse grid's lattice, also of points between its rays.
pub(crate) fn images_in_box(
    fine: &FineBox,
    spans: [RaySpans<TriangleHit>; 3],
    exterior: Exterior,
    membership: &impl Membership,
) -> Result<Option<[Ldi; 3]>, TooManySamples> {
    let membership = InBox { membership, origin: fine.origin() };
    let resolved = match resolve(fine.grid(), spans, exterior, &membership, &|_, _| ()) {
        Ok(resolved) => resolved,
        Err(ResolveError::Contradiction { .. }) => return Ok(None),
        Err(error @ ResolveError::Mismatch { .. }) => unreachable!("the spans are those of the box: {error}"),
    };
    let sampler = CpuSampler::default();
    let [x, y, z] = resolved.spans.map(|spans| spans.image(fine.grid(), Mode::Exact, &sampler));
    Ok(Some([x?, y?, z?]))
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use glam::{DAffine3, DVec3};

    use super::*;
    use crate::grid::{Grid, SumGrid, offset_grid};
    use crate::mesh::ClosedMesh;
    use crate::minkowski::ball::{BallMembership, BallPatches, BallProbe};
    use crate::minkowski::{Polyhedron, Primitives, SumMembership, cull};
    use crate::solids;
    use crate::testing::images::closed;
    use crate::testing::random::Random;

    const BOTH: [Exterior; 2] = [Exterior::Out, Exterior::In];

    /// Returns images along x, y and z.
    fn resolved(
        grid: &Grid,
        spans: [RaySpans<TriangleHit>; 3],
        exterior: Exterior,
        membership: &impl Membership,
    ) -> [Ldi; 3] {
        let resolved = resolve(grid, spans, exterior, membership, &|_, _| ()).unwrap();
        resolved.spans.map(|spans| spans.image(grid, Mode::Exact, &CpuSampler::default()).unwrap())
    }

    /// Returns boxes of pixels of the finer raster: one around everything, others anywhere.
    fn boxes(fine: &Grid, random: &mut Random) -> Vec<[Range<u32>; 3]> {
        let mut some = || {
            fine.rays().map(|rays| {
                let start = random.below(rays as usize - 5) as u32;
                start..(start + 3 + random.below(rays as usize / 2) as u32).min(rays)
            })
        };
        let mut boxes: Vec<_> = (0..6).map(|_| some()).collect();
        boxes.push(fine.rays().map(|rays| 0..rays));
        boxes
    }

    /// Compares the images in a box with the coarse ones, on the rays that both have, and, as `same` does, with those of the whole
    /// finer raster. Returns the numbers of samples compared.
    fn compare(
        fine: &FineBox,
        levels: u32,
        in_box: &[Ldi; 3],
        (coarse, whole): (&[Ldi; 3], &[Ldi; 3]),
        same: impl Fn(&Ldi, &Ldi),
    ) -> [usize; 2] {
        let mut counts = [0; 2];
        let window = |image: &Ldi, pixels: &[Range<u32>; 3]| image.window(*fine.grid(), pixels);
        let all = fine.pixels().each_ref().map(|range| 0..range.end - range.start);
        for ((in_box, coarse), whole) in in_box.iter().zip(coarse).zip(whole) {
            let (in_box, whole) = (window(in_box, &all), window(whole, fine.pixels()));
            same(&in_box, &whole);
            counts[0] += in_box.depths().len();
            let (axis, end) = (in_box.axis(), fine.grid().length(in_box.axis().depth()));
            for ray in 0..coarse.rays() {
                let across =
                    [ray % coarse.size().0, ray / coarse.size().0].map(|i| (i << levels) + (1 << (levels - 1)));
                let [columns, rows] = [axis.column(), axis.row()].map(|i| &fine.pixels()[i]);
                if columns.contains(&across[0]) && rows.contains(&across[1]) {
                    let ray = (across[1] - rows.start) * in_box.size().0 + across[0] - columns.start;
                    let by = fine.origin()[axis.depth()];
                    let within = |samples: &[i32], by: i32| -> Vec<i32> {
                        samples.iter().map(|depth| depth - by).filter(|&depth| 0 < depth && depth < end).collect()
                    };
                    let samples = within(in_box.samples(ray), 0);
                    assert_eq!(samples, within(coarse.samples(ray_of(coarse, across, levels)), by), "{axis:?} {ray}");
                    counts[1] += samples.len();
                }
            }
        }
        counts
    }

    /// Returns the ray of a coarse image that is a column and a row of the finer raster.
    fn ray_of(coarse: &Ldi, [column, row]: [u32; 2], levels: u32) -> u32 {
        (row >> levels) * coarse.size().0 + (column >> levels)
    }

    /// Compares two images, but for the triangles of samples where they are cut off: those of crossings further on.
    fn are_same(a: &Ldi, b: &Ldi) {
        assert_eq!((a.offsets(), a.depths()), (b.offsets(), b.depths()));
        let [of_a, of_b] = [a, b].map(|image| image.triangles().unwrap());
        let end = a.grid().length(a.axis().depth());
        for (i, depth) in a.depths().iter().enumerate().filter(|&(_, &depth)| 0 < depth && depth < end) {
            assert_eq!(of_a[i], of_b[i], "{depth}");
        }
    }

    fn star() -> ClosedMesh {
        closed(solids::star(1.0, 0.3, 2).unwrap())
    }

    #[test]
    fn a_box_of_a_sum_is_a_part_of_the_sum_on_finer_rays() {
        let mut small = solids::star(0.3, 0.1, 1).unwrap();
        small.transform(&DAffine3::from_rotation_x(0.3));
        let (a, b, mut random) = (star(), closed(small), Random::new(4));
        let mut counts = [0; 2];
        for exterior in BOTH {
            let grids = SumGrid::with_pitch(a.bounds(), b.bounds(), 0.11, 1024).unwrap();
            let of = |grid: &Grid, mesh: &ClosedMesh| Polyhedron::new(&grid.quantise(mesh).unwrap());
            let (mut one, other, grid) = (of(&grids.a, &a), of(&grids.b, &b), grids.sum);
            if exterior == Exterior::In {
                one = one.complement();
            }
            let ((primitives, _), sampler) = (cull(&one, &other), CpuSampler::default());
            let membership = SumMembership::new(&one, exterior, &other);
            let along = |axis| primitives.spans(&grid, axis, exterior, &sampler).unwrap().0;
            let coarse = resolved(&grid, Axis::ALL.map(along), exterior, &membership);
            let lattice = LatticeSolid::of_primitives(&grid, &primitives.positions, &primitives.triangles);
            for levels in 1..=3 {
                let (fine, by) = (grid.refined(levels).unwrap(), grid.refined_by(levels));
                let moved = Primitives {
                    positions: primitives.positions.iter().map(|p| p.map(|at| at + by)).collect(),
                    ..primitives.clone()
                };
                let membership_there = InBox { membership: &membership, origin: [-by; 3] };
                let along = |axis| moved.spans(&fine, axis, exterior, &sampler).unwrap().0;
                let whole = resolved(&fine, Axis::ALL.map(along), exterior, &membership_there);
                for pixels in boxes(&fine, &mut random) {
                    let fine = FineBox::all(&grid, levels).unwrap().with_pixels(pixels);
                    let along = |axis| RaySpans::of_primitives_in_box(&lattice, &fine, axis, exterior).unwrap();
                    let in_box = images_in_box(&fine, Axis::ALL.map(along), exterior, &membership).unwrap().unwrap();
                    let compared = compare(&fine, levels, &in_box, (&coarse, &whole), are_same);
                    (0..2).for_each(|i| counts[i] += compared[i]);
                }
            }
        }
        assert!(counts[0] > 30_000 && counts[1] > 3000, "{counts:?}");
    }

    #[test]
    fn a_box_of_an_offset_is_a_part_of_the_offset_on_finer_rays() {
        let (mesh, mut random, mut counts) = (star(), Random::new(5), [0; 2]);
        for (exterior, distance) in BOTH.into_iter().zip([0.2, -0.1]) {
            let grid = offset_grid(mesh.bounds(), distance, 0.09, 1024).unwrap();
            let mut solid = Polyhedron::new(&grid.quantise(&mesh).unwrap());
            if exterior == Exterior::In {
                solid = solid.complement();
            }
            let radius = distance.abs() / grid.step();
            let (patches, membership) =
                (BallPatches::new(&solid, radius), BallMembership::new(&grid, &solid, radius, exterior).unwrap());
            let probe = BallProbe::new(&membership, &solid);
            let along = |axis| patches.spans(&grid, axis, exterior).unwrap();
            let coarse = resolved(&grid, Axis::ALL.map(along), exterior, &membership);
            for levels in 1..=3 {
                let (fine, by) = (grid.refined(levels).unwrap(), grid.refined_by(levels));
                let positions = solid.positions().iter().map(|p| p.map(|at| at + by)).collect();
                let moved = Polyhedron::from_parts(positions, solid.triangles().to_vec());
                let (patches_there, membership_there) =
                    (BallPatches::new(&moved, radius), BallMembership::new(&fine, &moved, radius, exterior).unwrap());
                let along = |axis| patches_there.spans(&fine, axis, exterior).unwrap();
                let whole = resolved(&fine, Axis::ALL.map(along), exterior, &membership_there);
                for pixels in boxes(&fine, &mut random) {
                    let fine = FineBox::all(&grid, levels).unwrap().with_pixels(pixels);
                    let along = |axis| patches.spans_in_box(&grid, &fine, axis, exterior).unwrap();
                    let in_box = images_in_box(&fine, Axis::ALL.map(along), exterior, &probe).unwrap().unwrap();
                    // Depths are calculated in `f64` at other places.
                    let same = |a: &Ldi, b: &Ldi| {
                        assert_eq!(a.offsets(), b.offsets());
                        assert!(a.depths().iter().zip(b.depths()).all(|(a, b)| (a - b).abs() <= 2));
                    };
                    let compared = compare(&fine, levels, &in_box, (&coarse, &whole), same);
                    (0..2).for_each(|i| counts[i] += compared[i]);
                    let (numbered, normals) = patches.sample_normals_from(fine.origin(), in_box).unwrap();
                    normals_lead_to_the_surface(&numbered, &normals, &fine, &membership, radius);
                }
            }
        }
        assert!(counts[0] > 30_000 && counts[1] > 3000, "{counts:?}");
    }

    /// Asserts that the foot of each sample, along its normal, is on the solid itself, unless the sample lies at an end of the box.
    fn normals_lead_to_the_surface(
        images: &[Ldi],
        normals: &[[f32; 3]],
        fine: &FineBox,
        membership: &BallMembership,
        radius: f64,
    ) {
        let (pixels, origin) = (Pixels::new(fine.grid().shift()), fine.origin());
        for image in images {
            let (axis, end) = (image.axis(), fine.grid().length(image.axis().depth()));
            for ray in 0..image.rays() {
                let first = image.offsets()[ray as usize] as usize;
                let numbers = &image.triangles().unwrap()[first..];
                for (&depth, &number) in
                    image.samples(ray).iter().zip(numbers).filter(|(depth, _)| (1..end).contains(*depth))
                {
                    let mut point = origin;
                    point[axis.column()] += pixels.ray((ray % image.size().0) as i32);
                    point[axis.row()] += pixels.ray((ray / image.size().0) as i32);
                    point[axis.depth()] += depth;
                    let normal = DVec3::from_array(normals[number as usize].map(f64::from));
                    let foot = DVec3::from_array(point.map(f64::from)) - radius * normal;
                    let beside = membership.distance(foot);
                    assert!(beside < 1e-5 * radius, "{axis:?} {ray} {depth}: {beside} of {radius}");
                }
            }
        }
    }

    /// States of nodes: in, in a gap, or beyond everything.
    #[test]
    fn nodes_of_a_segment_have_the_state_that_they_have_on_the_ray() {
        let (mut random, nodes) = (Random::new(6), Pixels::new(4));
        let state = |hits: &[Crossing], node: i32, exterior: Exterior| {
            let before = hits.iter().filter(|hit| hit.nearest() < node).count();
            match (exterior, before % 2) {
                (Exterior::Out, 0) if before == 0 || before == hits.len() => 0,
                (Exterior::Out, 0) | (Exterior::In, 1) => 1,
                _ => 2,
            }
        };
        let mut counts = [0; 3];
        for case in 0..4000 {
            let exterior = BOTH[case % 2];
            let mut depths: Vec<i32> = (0..2 * random.below(5)).map(|_| 2 * random.below(250) as i32).collect();
            depths.sort_unstable();
            let first = if exterior == Exterior::Out { 1 } else { -1 };
            let winding = |i: usize| if i.is_multiple_of(2) { first } else { -first };
            let hits: Vec<Crossing> =
                depths.iter().enumerate().map(|(i, &depth)| Crossing::at(f64::from(depth), winding(i))).collect();
            let mut kept = Vec::new();
            exterior.keep_gaps(nodes, &hits, &mut kept);
            let pixel = random.below(20) as i32;
            let [start, end] = [pixel, pixel + 1 + random.below(12) as i32].map(|pixel| pixel << 4);
            let mut cut = Vec::new();
            Segment { start, end, nodes }.append(exterior, &kept, &mut Vec::new(), &mut cut);
            assert!(cut.len().is_multiple_of(2) && cut.is_sorted(), "{kept:?} {cut:?}");
            for index in 0..(end - start) >> 4 {
                let node = nodes.ray(index);
                let expected = state(&kept, node + start, exterior);
                assert_eq!(state(&cut, node, exterior), expected, "{kept:?} {cut:?} {start} {node}");
                counts[expected] += 1;
            }
        }
        assert!(counts.iter().all(|&count| count > 1000), "{counts:?}");
    }

    #[test]
    fn points_between_rays_are_in_an_offset_by_their_distance() {
        let ball = closed(solids::geodesic(1.0, 8).unwrap());
        // With the smaller radius, nodes are too far away from many points.
        for (exterior, distance) in BOTH.into_iter().flat_map(|exterior| [0.25, 0.12].map(|radius| (exterior, radius)))
        {
            let distance: f64 = if exterior == Exterior::Out { distance } else { -distance };
            let grid = offset_grid(ball.bounds(), distance, 0.2, 1024).unwrap();
            let mut solid = Polyhedron::new(&grid.quantise(&ball).unwrap());
            if exterior == Exterior::In {
                solid = solid.complement();
            }
            let radius = distance.abs() / grid.step();
            let membership = BallMembership::between_rays(&grid, &solid, radius, exterior).unwrap();
            let (probe, mut random) = (BallProbe::new(&membership, &solid), Random::new(7));
            for _ in 0..2000 {
                let point = [0, 1, 2].map(|i| random.below(grid.length(i) as usize) as i32 | 1);
                let place = grid.origin() + grid.step() * DVec3::from_array(point.map(f64::from));
                let beyond = place.length() - (1.0 + distance);
                // The facets lie within the ball by less.
                if beyond.abs() > 0.03 {
                    let is_in = (beyond < 0.0) == (exterior == Exterior::Out);
                    assert_eq!(probe.contains(point, &mut ()), is_in, "{exterior:?} {place}");
                }
            }
        }
    }
}
