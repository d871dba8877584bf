//! The certain interior of a sum on coarse voxels: primitives in it bound nothing and need not be sampled.
//!
//! Most primitives of two solids that are not convex lie inside their sum. If voxel `i` holds any point of A, and the eight
//! voxels about the corner `j` of B's lattice of voxels lie in B, then voxel `i + j` lies in A ⊕ B. So the **interior** is the
//! dilation of the voxels that A *touches* by those corners that B *fills*, and vice versa. Both are conservative: a voxel
//! counts as touched when its middle lies in the solid or it holds a point of a triangle, and as full when no triangle may
//! reach into it and its middle lies in the solid.
//!
//! The dilation works on runs of voxels along x: a run of `l` voxels adds the other set dilated by `l`, which is the union of
//! two shifts of the dilation by the largest power of two up to `l`. At 128 voxels that takes some ten million word operations.

use crate::parallel::*;

use super::{Exterior, Polyhedron, Primitives};
use crate::bits::is_set;
use crate::cancel::checkpoint;
use crate::fixed::{Crossing, Pixels};
use crate::grid::{Axis, Grid, LATTICE_MAX, LatticeBox};
use crate::sampler::cpu::CpuSampler;

/// Most voxels along the longest side of the sum; it has at least half of these.
const MOST_VOXELS: i32 = 128;

/// The width of a voxel is a power of two of lattice steps, with at least this exponent: below it a voxel holds no ray.
const LEAST_SHIFT: u32 = 3;

/// The coarse voxels of a sum that certainly lie in its interior.
pub struct Interior {
    shift: u32,
    voxels: VoxelSet,
}

/// A box of voxels with a bit each.
#[derive(Clone)]
struct VoxelSet {
    /// The index of the first voxel along x, y and z.
    first: [i32; 3],
    size: [usize; 3],
    words: usize,
    bits: Vec<u64>,
}

impl VoxelSet {
    fn new(first: [i32; 3], size: [usize; 3], of: bool) -> VoxelSet {
        let words = size[0].div_ceil(64);
        let mut set = VoxelSet { first, size, words, bits: vec![0; words * size[1] * size[2]] };
        if of {
            for row in set.bits.chunks_mut(words) {
                set_range(row, 0..size[0]);
            }
        }
        set
    }

    /// Returns the row of voxels at `y` and `z`, counted from the first.
    fn row(&self, y: usize, z: usize) -> &[u64] {
        &self.bits[(z * self.size[1] + y) * self.words..][..self.words]
    }

    fn row_mut(&mut self, y: usize, z: usize) -> &mut [u64] {
        &mut self.bits[(z * self.size[1] + y) * self.words..][..self.words]
    }

    /// Changes each word by that of a set of the same box.
    fn change(&mut self, by: &VoxelSet, change: impl Fn(&mut u64, u64)) {
        for (word, &by) in self.bits.iter_mut().zip(&by.bits) {
            change(word, by);
        }
    }

    /// Returns the runs of voxels along x, row by row: y and z counted from the first, and the range of x.
    fn runs(&self) -> Vec<(usize, usize, std::ops::Range<usize>)> {
        let mut runs = Vec::new();
        for z in 0..self.size[2] {
            for y in 0..self.size[1] {
                let row = self.row(y, z);
                let mut x = 0;
                while x < self.size[0] {
                    let start = x;
                    while x < self.size[0] && is_set(row, x) {
                        x += 1;
                    }
                    if x > start {
                        runs.push((y, z, start..x));
                    }
                    x += 1;
                }
            }
        }
        runs
    }

    /// Returns the corners all of whose eight voxels are set; corner `j` lies between voxels `j − 1` and `j`.
    fn full_corners(&self) -> VoxelSet {
        let mut corners = self.clone();
        for row in corners.bits.chunks_mut(self.words) {
            let mut carry = 0;
            for word in row {
                let moved = *word << 1 | carry;
                carry = *word >> 63;
                *word &= moved;
            }
        }
        for (step, count) in [(self.words, self.size[1]), (self.words * self.size[1], self.size[2])] {
            for chunk in corners.bits.chunks_mut(step * count) {
                for at in (0..chunk.len()).rev() {
                    chunk[at] &= if at >= step { chunk[at - step] } else { 0 };
                }
            }
        }
        corners
    }

    /// Returns the set dilated along x by runs of 1, 2, 4 … up to `longest` voxels.
    fn dilated(self, longest: usize) -> Vec<VoxelSet> {
        let mut levels = vec![self];
        while 1 << levels.len() <= longest {
            let (last, reach) = (&levels[levels.len() - 1], 1 << (levels.len() - 1));
            let size = [last.size[0] + reach, last.size[1], last.size[2]];
            let mut next = VoxelSet::new(last.first, size, false);
            for z in 0..size[2] {
                for y in 0..size[1] {
                    or_shifted(next.row_mut(y, z), last.row(y, z), 0);
                    or_shifted(next.row_mut(y, z), last.row(y, z), reach);
                }
            }
            levels.push(next);
        }
        levels
    }

    /// Adds the dilation of `touched` by `corners`.
    fn add_dilation(&mut self, touched: &VoxelSet, corners: VoxelSet) {
        let runs = touched.runs();
        let longest = runs.iter().map(|(_, _, run)| run.len()).max().unwrap_or(1);
        let rows: Vec<(usize, usize)> = (0..corners.size[2])
            .flat_map(|z| (0..corners.size[1]).map(move |y| (y, z)))
            .filter(|&(y, z)| corners.row(y, z).iter().any(|&word| word != 0))
            .collect();
        let first_of_plane: Vec<usize> =
            (0..=corners.size[2]).map(|z| rows.partition_point(|&(_, row_z)| row_z < z)).collect();
        let levels = corners.dilated(longest);
        let (size, first, words) = (self.size, self.first, self.words);
        let place = |i: usize, a: usize, b: usize| {
            let at = a as i32 + touched.first[i] + b as i32 + levels[0].first[i] - first[i];
            (0..size[i] as i32).contains(&at).then_some(at as usize)
        };
        self.bits.par_chunks_mut(words * size[1]).enumerate().for_each(|(plane, bits)| {
            checkpoint();
            for (y, z, run) in &runs {
                let corner_z = plane as i32 + first[2] - touched.first[2] - *z as i32 - levels[0].first[2];
                if !(0..levels[0].size[2] as i32).contains(&corner_z) {
                    continue;
                }
                let level = run.len().ilog2() as usize;
                let source = &levels[level];
                let start = run.start as i32 + touched.first[0] + source.first[0] - first[0];
                for &(corner_y, row_z) in
                    &rows[first_of_plane[corner_z as usize]..first_of_plane[corner_z as usize + 1]]
                {
                    let Some(to_y) = place(1, *y, corner_y) else { continue };
                    let (row, to) = (source.row(corner_y, row_z), &mut bits[to_y * words..][..words]);
                    or_at(to, row, start);
                    or_at(to, row, start + (run.len() - (1 << level)) as i32);
                }
            }
        });
    }
}

/// Calls `change` with each word that has bits of a range, and those bits.
fn for_each_word(row: &mut [u64], range: std::ops::Range<usize>, change: impl Fn(&mut u64, u64)) {
    for (word, bits) in row.iter_mut().enumerate() {
        let (low, high) = (range.start.max(64 * word), range.end.min(64 * word + 64));
        if low < high {
            change(bits, (u64::MAX >> (64 - (high - low))) << (low - 64 * word));
        }
    }
}

/// Sets a range of bits.
fn set_range(row: &mut [u64], range: std::ops::Range<usize>) {
    for_each_word(row, range, |word, bits| *word |= bits);
}

/// Clears a range of bits.
fn clear_range(row: &mut [u64], range: std::ops::Range<usize>) {
    for_each_word(row, range, |word, bits| *word &= !bits);
}

/// Adds the bits of a row, shifted up by `by`; those beyond the end are lost.
fn or_shifted(to: &mut [u64], from: &[u64], by: usize) {
    let (words, bits) = (by / 64, by % 64);
    for (i, &word) in from.iter().enumerate() {
        if let Some(to) = to.get_mut(i + words) {
            *to |= word << bits;
        }
        if bits > 0
            && let Some(to) = to.get_mut(i + words + 1)
        {
            *to |= word >> (64 - bits);
        }
    }
}

/// Adds the bits of a row, shifted by `by` either way; those beyond the ends are lost.
fn or_at(to: &mut [u64], from: &[u64], by: i32) {
    if by >= 0 {
        return or_shifted(to, from, by as usize);
    }
    let (words, bits) = ((-by) as usize / 64, (-by) as usize % 64);
    for (i, to) in to.iter_mut().enumerate() {
        let low = from.get(i + words).copied().unwrap_or(0) >> bits;
        let high = if bits > 0 { from.get(i + words + 1).copied().unwrap_or(0) << (64 - bits) } else { 0 };
        *to |= low | high;
    }
}

/// Fewest triangles whose voxels one task finds: each task has sets of its own, most of them of some 256 KiB.
const TRIANGLES_PER_TASK: usize = 1 << 13;

/// A triangle in lattice positions, cut by four planes.
type Polygon = crate::polygon::Polygon<13>;

/// The voxels that a solid touches and fills.
struct Occupancy {
    touched: VoxelSet,
    full: VoxelSet,
}

impl Occupancy {
    /// Computes the voxels of 2^`shift` steps about a solid, with a margin of `margin` voxels; `None` where it does not fit a
    /// lattice.
    fn new(
        solid: &Polyhedron,
        exterior: Exterior,
        shift: u32,
        margin: [usize; 3],
        sampler: &CpuSampler,
    ) -> Option<Occupancy> {
        let bounds = solid.bounds();
        if bounds.is_empty() {
            return None;
        }
        let rays = bounds.max.map(|p| (p >> shift) as u32 + 1);
        let grid = Grid::from_parts(glam::DVec3::ZERO, 1.0, rays, shift, 32).ok()?;
        let first = margin.map(|m| -(m as i32));
        let size = std::array::from_fn(|i| rays[i] as usize + 2 * margin[i]);
        let mut touched = VoxelSet::new(first, size, exterior == Exterior::In);
        // Spans enclosed by the surface, whatever its orientation.
        let as_triangles = Primitives { positions: solid.positions().to_vec(), triangles: solid.triangles().to_vec() };
        let lists = as_triangles.lists::<Crossing>(&grid, Axis::X, sampler, |sorted, kept| {
            let mut winding = 0;
            for crossing in sorted {
                let before = winding;
                winding += crossing.winding();
                if (before == 0) != (winding == 0) {
                    kept.push(*crossing);
                }
            }
        });
        let lists = lists.ok()?;
        let pixels = Pixels::new(shift);
        for (ray, range) in lists.offsets.windows(2).enumerate() {
            let (y, z) = (ray % rays[1] as usize + margin[1], ray / rays[1] as usize + margin[2]);
            for span in lists.hits[range[0] as usize..range[1] as usize].chunks_exact(2) {
                let node = |crossing: Crossing| pixels.index_from(crossing.nearest()) as usize + margin[0];
                let nodes = node(span[0])..node(span[1]);
                match exterior {
                    Exterior::Out => set_range(touched.row_mut(y, z), nodes),
                    Exterior::In => clear_range(touched.row_mut(y, z), nodes),
                }
            }
        }
        let mut full = touched.clone();
        let none = || [VoxelSet::new(first, size, false), VoxelSet::new(first, size, false)];
        let voxel = |i: usize, position: i32| ((position >> shift) + margin[i] as i32) as usize;
        // The voxels that triangles meet, and those that they may reach into.
        let add = |[mut met, mut reached]: [VoxelSet; 2], triangle: &[u32; 3]| {
            checkpoint();
            let polygon = Polygon::of(triangle.map(|v| solid.positions()[v as usize]));
            for_each_point(&polygon, shift, |point| {
                let [x, y, z] = std::array::from_fn(|i| voxel(i, point[i] as i32));
                set_range(met.row_mut(y, z), x..x + 1);
            });
            for_each_reached(&polygon, shift, |y, z, xs| {
                let at = |i: usize, index: i32| (index + margin[i] as i32).clamp(0, size[i] as i32 - 1) as usize;
                set_range(reached.row_mut(at(1, y), at(2, z)), at(0, xs.0)..at(0, xs.1) + 1);
            });
            [met, reached]
        };
        let union = |[mut met, mut reached]: [VoxelSet; 2], [more_met, more_reached]: [VoxelSet; 2]| {
            met.change(&more_met, |word, more| *word |= more);
            reached.change(&more_reached, |word, more| *word |= more);
            [met, reached]
        };
        let triangles = solid.triangles().par_iter().with_min_len(TRIANGLES_PER_TASK);
        let [met, reached] = triangles.fold(none, add).reduce(none, union);
        touched.change(&met, |word, met| *word |= met);
        full.change(&reached, |word, reached| *word &= !reached);
        Some(Occupancy { touched, full })
    }
}

/// Many times the displacement of a clipped corner or a point of a triangle by rounding, in lattice steps. Voxels that a
/// triangle comes this close to are not full.
const SLACK: f64 = 4.0;

/// Calls `meet` with points of a triangle, its corners among them, that are at most a voxel apart along each axis.
fn for_each_point(triangle: &Polygon, shift: u32, mut meet: impl FnMut([f64; 3])) {
    let [a, b, c] = [0, 1, 2].map(|i| triangle.corners()[i]);
    let reach = |p: [f64; 3], q: [f64; 3]| (0..3).map(|i| (p[i] - q[i]).abs()).fold(0.0, f64::max);
    let steps = (reach(a, b).max(reach(b, c)).max(reach(c, a)) / f64::from(1u32 << shift)).ceil().max(1.0) as u32;
    for i in 0..=steps {
        for j in 0..=steps - i {
            let (of_b, of_c) = (f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
            meet(std::array::from_fn(|k| a[k] + of_b * (b[k] - a[k]) + of_c * (c[k] - a[k])));
        }
    }
}

/// Calls `reach` with each row of voxels that a triangle reaches into, and the first and last voxel there.
fn for_each_reached(triangle: &Polygon, shift: u32, mut reach: impl FnMut(i32, i32, (i32, i32))) {
    let side = f64::from(1u32 << shift);
    let range = |polygon: &Polygon, i: usize| {
        let along = || polygon.corners().iter().map(|corner| corner[i]);
        let (low, high) = (along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max));
        (((low - SLACK) / side).floor() as i32, ((high + SLACK) / side).floor() as i32)
    };
    // A polygon within one layer of voxels is not cut.
    let slab = |polygon: &Polygon, i: usize, index: i32, (first, last): (i32, i32)| match first == last {
        true => *polygon,
        false => {
            let low = f64::from(index) * side - SLACK;
            polygon.above(i, low, 1.0).above(i, low + side + 2.0 * SLACK, -1.0)
        }
    };
    let planes = range(triangle, 2);
    for z in planes.0..=planes.1 {
        let in_plane = slab(triangle, 2, z, planes);
        if in_plane.corners().is_empty() {
            continue;
        }
        let rows = range(&in_plane, 1);
        for y in rows.0..=rows.1 {
            let in_row = slab(&in_plane, 1, y, rows);
            if !in_row.corners().is_empty() {
                reach(y, z, range(&in_row, 0));
            }
        }
    }
}

impl Interior {
    /// Finds the voxels of `grid`, that of the sum, which certainly lie in the interior of A ⊕ B. Empty where the voxels needed
    /// do not fit a lattice.
    pub fn new(grid: &Grid, a: &Polyhedron, exterior_a: Exterior, b: &Polyhedron, sampler: &CpuSampler) -> Interior {
        let longest = (0..3).map(|i| grid.length(i)).max().unwrap_or(LATTICE_MAX);
        let mut shift = LEAST_SHIFT;
        while longest >> shift >= MOST_VOXELS {
            shift += 1;
        }
        let size = std::array::from_fn(|i| (grid.length(i) >> shift) as usize + 1);
        let mut voxels = VoxelSet::new([0; 3], size, false);
        let extent = |solid: &Polyhedron| solid.bounds().max.map(|p| (p.max(0) >> shift) as usize + 2);
        let margin_a = if exterior_a == Exterior::In { extent(b) } else { [1; 3] };
        let of_a = Occupancy::new(a, exterior_a, shift, margin_a, sampler);
        let of_b = Occupancy::new(b, Exterior::Out, shift, [1; 3], sampler);
        if let (Some(of_a), Some(of_b)) = (of_a, of_b) {
            voxels.add_dilation(&of_a.touched, of_b.full.full_corners());
            voxels.add_dilation(&of_b.touched, of_a.full.full_corners());
        }
        Interior { shift, voxels }
    }

    /// Returns whether all of a box lies in the interior.
    pub fn holds(&self, bounds: &LatticeBox) -> bool {
        let first = bounds.min.map(|p| (p >> self.shift) as usize);
        let last = bounds.max.map(|p| (p >> self.shift) as usize);
        if (0..3).any(|i| last[i] >= self.voxels.size[i]) {
            return false;
        }
        (first[2]..=last[2]).all(|z| {
            (first[1]..=last[1]).all(|y| {
                let row = self.voxels.row(y, z);
                (first[0]..=last[0]).all(|x| is_set(row, x))
            })
        })
    }

    /// Returns the number of voxels.
    pub fn count(&self) -> u64 {
        self.voxels.bits.iter().map(|word| u64::from(word.count_ones())).sum()
    }
}

impl Primitives {
    /// Keeps the primitives that are not wholly in the interior.
    pub fn outside(self, interior: &Interior) -> Primitives {
        let reaches_out = |triangle: &&[u32; 3]| {
            let point = |v: u32| self.positions[v as usize];
            let [a, b, c] = triangle.map(point);
            let bounds = LatticeBox {
                min: std::array::from_fn(|i| a[i].min(b[i]).min(c[i])),
                max: std::array::from_fn(|i| a[i].max(b[i]).max(c[i])),
            };
            !interior.holds(&bounds)
        };
        let triangles: Vec<[u32; 3]> = self.triangles.par_iter().filter(reaches_out).copied().collect();
        Primitives { positions: self.positions, triangles }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Box3 = [[i32; 3]; 2];

    /// Returns boxes as one polyhedron whose shells overlap.
    fn heap(boxes: &[Box3]) -> Polyhedron {
        const FACES: [[u32; 4]; 6] =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for corners in boxes {
            let first = positions.len() as u32;
            positions.extend((0..8usize).map(|k| std::array::from_fn(|i| corners[k >> i & 1][i])));
            triangles.extend(
                FACES
                    .iter()
                    .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
                    .map(|triangle| triangle.map(|v| v + first)),
            );
        }
        Polyhedron::from_parts(positions, triangles)
    }

    fn grid(side: i32) -> Grid {
        Grid::from_parts(glam::DVec3::ZERO, 1.0, [(side >> 4) as u32; 3], 4, 32).unwrap()
    }

    /// Asserts that `holds` is true at some points of every voxel of the interior, corners among them.
    fn assert_all(interior: &Interior, holds: impl Fn([i32; 3]) -> bool) {
        for (y, z, run) in interior.voxels.runs() {
            for x in run {
                for k in 0..125 {
                    let step = [k % 5, k / 5 % 5, k / 25];
                    let point = std::array::from_fn(|i| {
                        (([x, y, z][i] as i32) << interior.shift) + (step[i] << interior.shift) / 4
                    });
                    assert!(holds(point), "voxel {:?}, {point:?}", [x, y, z]);
                }
            }
        }
    }

    fn within(bounds: &Box3, point: [i32; 3]) -> bool {
        (0..3).all(|i| bounds[0][i] <= point[i] && point[i] <= bounds[1][i])
    }

    #[test]
    fn most_of_a_sum_of_boxes_and_nothing_outside_is_interior() {
        let a = [[[0, 0, 0], [300, 300, 100]], [[200, 0, 0], [300, 300, 300]], [[0, 0, 260], [40, 40, 300]]];
        let b = [[[0, 0, 0], [180, 60, 40]], [[100, 0, 0], [140, 200, 200]]];
        let sums: Vec<Box3> = a
            .iter()
            .flat_map(|p| b.iter().map(|q| std::array::from_fn(|k| std::array::from_fn(|i| p[k][i] + q[k][i]))))
            .collect();
        let interior = Interior::new(&grid(512), &heap(&a), Exterior::Out, &heap(&b), &CpuSampler::default());
        assert_all(&interior, |point| sums.iter().any(|sum| within(sum, point)));
        let volume = interior.count() << (3 * interior.shift);
        // By inclusion and exclusion over a lattice of 4 steps.
        let inside = |k: usize| {
            let point = [k % 128, k / 128 % 128, k / 128 / 128].map(|c| 4 * c as i32 + 2);
            sums.iter().any(|sum| within(sum, point))
        };
        let all = (0..128 * 128 * 128).filter(|&k| inside(k)).count() as u64 * 64;
        assert!(volume * 10 > all * 7, "{volume} of {all}");
    }

    #[test]
    fn the_interior_of_a_complement_surrounds_the_difference() {
        let a = [[[100, 100, 100], [400, 400, 400]]];
        let b = [[[0, 0, 0], [40, 60, 80]]];
        let solid = heap(&a).complement();
        let interior = Interior::new(&grid(512), &solid, Exterior::In, &heap(&b), &CpuSampler::default());
        // complement(A) ⊕ B leaves [140, 400] × [160, 400] × [180, 400].
        assert_all(&interior, |point| !(0..3).all(|i| a[0][0][i] + b[0][1][i] < point[i] && point[i] < 400));
        let far = LatticeBox { min: [0; 3], max: [90; 3] };
        assert!(interior.holds(&far));
        assert!(!interior.holds(&LatticeBox { min: [200; 3], max: [300; 3] }));
    }

    #[test]
    fn sums_of_a_thin_and_a_thick_solid_have_an_interior() {
        let sheet = [[[0, 0, 0], [300, 300, 2]]];
        let cube = [[[0, 0, 0], [200, 200, 200]]];
        let interior = Interior::new(&grid(512), &heap(&sheet), Exterior::Out, &heap(&cube), &CpuSampler::default());
        assert!(interior.holds(&LatticeBox { min: [20, 20, 20], max: [480, 480, 180] }));
        assert_all(&interior, |point| within(&[[0; 3], [500, 500, 202]], point));
    }
}
