//! The lattice nodes that are inside a solid, from its images along several axes.
//!
//! A node is inside an image when an odd number of the samples of its ray lie before it. The exact images of one solid
//! agree about every node (see [`sampler`](crate::sampler)); conservative ones may not, since each merges all crossings
//! in one voxel of *its* rays. Then a node is inside where any over-estimate has it inside, and where all under-estimates have.
//!
//! Nodes are bits: a row of nodes along x is a few words, and a plane is its rows one after another. Each sample flips
//! all nodes behind it, so an image is converted to nodes by flipping one bit per sample and taking a running parity,
//! along the words of a row for an image along x, and from row to row or plane to plane, 64 nodes at a time, for the
//! others.

use std::ops::Range;

use crate::parallel::*;

use super::{Ldi, Mode};
use crate::allocation::zeroed;
use crate::bits::{accumulate, accumulate_rows, flip, is_set, spread_row};
use crate::cancel::checkpoint;
use crate::fixed::Pixels;
use crate::grid::{Axis, Grid};

/// The reason why nodes could not be derived from images.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NodesError {
    /// There is no image.
    #[error("lattice nodes need at least one image")]
    NoImage,
    /// Two images lie on different grids, or along the same axis.
    #[error("images {first} and {second} do not lie on one grid along different axes")]
    Mismatch {
        /// Index of one of them.
        first: usize,
        /// Index of the other.
        second: usize,
    },
}

/// Images of one solid along different axes of one grid, as a source of nodes.
#[derive(Clone, Copy, Debug)]
pub struct NodePlanes<'a> {
    images: [Option<&'a Ldi>; 3],
    grid: &'a Grid,
    mode: Mode,
}

/// The axes of a plane's words and of the planes; rows follow one another along y.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Order {
    words: Axis,
    planes: Axis,
}

/// Words along x, and planes z after z.
const X_FIRST: Order = Order { words: Axis::X, planes: Axis::Z };

/// Words along z, and planes x after x.
const Z_FIRST: Order = Order { words: Axis::Z, planes: Axis::X };

/// Consecutive planes of nodes, z after z.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeSlab {
    order: Order,
    first: i32,
    margin: usize,
    rows: usize,
    words: usize,
    bits: Vec<u64>,
    /// Number of nodes in each plane about which the images disagree.
    disagreements: Vec<u64>,
}

/// Number of planes that are computed at a time where planes are requested one after another.
const SLAB: i32 = 32;

impl<'a> NodePlanes<'a> {
    /// Returns the nodes of one, two or three images of a mode. Of three exact images most decide, which is unanimous for those
    /// of one solid; of two, both.
    pub fn new(images: impl IntoIterator<Item = &'a Ldi>, mode: Mode) -> Result<NodePlanes<'a>, NodesError> {
        let mut by_axis: [Option<(usize, &'a Ldi)>; 3] = [None; 3];
        let mut grid: Option<(usize, &'a Grid)> = None;
        for (second, image) in images.into_iter().enumerate() {
            let (first, common) = *grid.get_or_insert((second, image.grid()));
            if common != image.grid() {
                return Err(NodesError::Mismatch { first, second });
            }
            if let Some((first, _)) = by_axis[image.axis().depth()].replace((second, image)) {
                return Err(NodesError::Mismatch { first, second });
            }
        }
        let (_, grid) = grid.ok_or(NodesError::NoImage)?;
        Ok(NodePlanes { images: by_axis.map(|image| image.map(|(_, image)| image)), grid, mode })
    }

    /// Returns the image along an axis, if there is one.
    pub fn image(&self, axis: Axis) -> Option<&'a Ldi> {
        self.images[axis.depth()]
    }

    /// Returns the grid of the images.
    pub fn grid(&self) -> &'a Grid {
        self.grid
    }

    /// Returns all planes, z after z: rays along y times the words of a row.
    pub fn planes(&self) -> impl Iterator<Item = Vec<u64>> + '_ {
        let count = self.grid.rays()[2] as i32;
        (0..count).step_by(SLAB as usize).flat_map(move |first| {
            let slab = self.slab(first..count.min(first + SLAB), 0);
            let length = slab.rows * slab.words;
            slab.bits.chunks(length.max(1)).map(<[u64]>::to_vec).collect::<Vec<_>>()
        })
    }

    /// Returns 1 for each node inside and 0 for others, node (x, y, z) at `(x · rays[1] + y) · rays[2] + z`.
    pub fn to_bytes(&self) -> Vec<u8> {
        let size @ [planes, rows, length] = self.grid.rays().map(|n| n as usize);
        let nodes = self.slab_in(Z_FIRST, 0..planes as i32, 0);
        let mut bytes: Vec<u8> = zeroed(size.iter().product());
        let of_planes = bytes.par_chunks_mut((rows * length).max(1));
        of_planes.zip(nodes.bits.par_chunks((rows * nodes.words).max(1))).for_each(|(bytes, bits)| {
            checkpoint();
            let of_rows = bytes.chunks_mut(length).zip(bits.chunks(nodes.words));
            of_rows.for_each(|(bytes, row)| spread_row(row, bytes));
        });
        bytes
    }

    /// Counts the nodes about which the images disagree, and returns the first, z before y before x, or `None` where
    /// all agree.
    pub fn disagreements(&self) -> Option<(u64, [u32; 3])> {
        let count = self.grid.rays()[2] as i32;
        let (mut sum, mut first) = (0, None);
        for start in (0..count).step_by(SLAB as usize) {
            let planes = start..count.min(start + SLAB);
            let slab = self.slab(planes.clone(), 0);
            let here = slab.disagreements(planes.clone());
            if here > 0 && first.is_none() {
                first = self.first_disagreement(&slab, &planes);
            }
            sum += here;
        }
        first.map(|node| (sum, node))
    }

    fn first_disagreement(&self, slab: &NodeSlab, planes: &Range<i32>) -> Option<[u32; 3]> {
        let parts: Vec<Vec<u64>> = self.images.iter().flatten().map(|image| slab.of_image(image, planes)).collect();
        (0..slab.bits.len()).find_map(|at| {
            let differing = parts.iter().fold(0, |bits, part| bits | (part[at] ^ parts[0][at]));
            let (row, word) = (at / slab.words, at % slab.words);
            let node = [64 * word as u32 + differing.trailing_zeros(), (row % slab.rows) as u32];
            (differing != 0).then(|| [node[0], node[1], planes.start as u32 + (row / slab.rows) as u32])
        })
    }

    /// Returns the nodes of a range of planes, with `margin` more nodes on every side of a plane, which are outside; so
    /// are those of planes beyond the grid.
    pub fn slab(&self, planes: Range<i32>, margin: usize) -> NodeSlab {
        self.slab_in(X_FIRST, planes, margin)
    }

    fn slab_in(&self, order: Order, planes: Range<i32>, margin: usize) -> NodeSlab {
        let rays = self.grid.rays().map(|n| n as usize);
        let (words, rows) = ((rays[order.words.depth()] + 2 * margin).div_ceil(64), rays[1] + 2 * margin);
        let mut slab = NodeSlab {
            order,
            first: planes.start,
            margin,
            rows,
            words,
            bits: Vec::new(),
            disagreements: vec![0; planes.len()],
        };
        let parts: Vec<Vec<u64>> = self.images.iter().flatten().map(|image| slab.of_image(image, &planes)).collect();
        let mut parts = parts.into_iter();
        slab.bits = parts.next().expect("there is an image");
        let (second, third) = (parts.next(), parts.next());
        let (Some(second), length) = (second, rows * words) else { return slab };
        let combine = self.mode;
        slab.disagreements = slab
            .bits
            .par_chunks_mut(length.max(1))
            .enumerate()
            .map(|(plane, bits)| {
                let range = plane * length..(plane + 1) * length;
                let mut disagreements = 0;
                for (at, bits) in range.zip(bits) {
                    let (a, b) = (*bits, second[at]);
                    let c = third.as_ref().map(|third| third[at]);
                    disagreements += u64::from(((a ^ b) | c.map_or(0, |c| a ^ c)).count_ones());
                    *bits = match (combine, c) {
                        (Mode::OVER, c) => a | b | c.unwrap_or(0),
                        (Mode::UNDER, c) => a & b & c.unwrap_or(u64::MAX),
                        (Mode::Exact, Some(c)) => (a & b) | (b & c) | (c & a),
                        (Mode::Exact, None) => a & b,
                    };
                }
                disagreements
            })
            .collect();
        slab
    }
}

impl NodeSlab {
    /// Returns the plane after the last.
    pub fn end(&self) -> i32 {
        self.first + self.disagreements.len() as i32
    }

    /// Returns the number of words of a row: node `x` is bit `x + margin`.
    pub fn words(&self) -> usize {
        self.words
    }

    /// Returns the number of rows of a plane: nodes at `y` are row `y + margin`.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns the words of a row, counted with the margin, of plane `z`.
    pub fn row(&self, row: usize, z: i32) -> &[u64] {
        let at = ((z - self.first) as usize * self.rows + row) * self.words;
        &self.bits[at..at + self.words]
    }

    /// Returns whether a node, with x and y counted with the margin, is inside; none beyond the slab is.
    pub fn is_inside(&self, [x, y, z]: [i32; 3]) -> bool {
        let has = |at: i32, count: usize| usize::try_from(at).is_ok_and(|at| at < count);
        (self.first..self.end()).contains(&z)
            && has(y, self.rows)
            && has(x, 64 * self.words)
            && is_set(self.row(y as usize, z), x as usize)
    }

    /// Returns the number of nodes of some planes about which the images disagree.
    pub fn disagreements(&self, planes: Range<i32>) -> u64 {
        planes.map(|plane| self.disagreements[(plane - self.first) as usize]).sum()
    }

    /// Returns the nodes of one image, plane after plane.
    fn of_image(&self, image: &Ldi, planes: &Range<i32>) -> Vec<u64> {
        match image.axis() {
            Axis::Y => self.of_planes(image, planes, |plane, bits| self.along_rows(image, plane, bits)),
            axis if axis == self.order.words => {
                self.of_planes(image, planes, |plane, bits| self.along_words(image, plane, bits))
            }
            _ => self.across_planes(image, planes),
        }
    }

    /// Fills each plane that lies in the grid.
    fn of_planes(&self, image: &Ldi, planes: &Range<i32>, fill: impl Fn(usize, &mut [u64]) + Sync) -> Vec<u64> {
        let mut bits = vec![0; planes.len() * self.rows * self.words];
        let inside = 0..image.grid().rays()[self.order.planes.depth()] as i32;
        let each = bits.par_chunks_mut(self.rows * self.words).zip(planes.clone().into_par_iter());
        each.filter(|(_, plane)| inside.contains(plane)).for_each(|(bits, plane)| fill(plane as usize, bits));
        bits
    }

    /// Fills a plane from an image whose rays are rows of nodes.
    fn along_words(&self, image: &Ldi, plane: usize, bits: &mut [u64]) {
        let pixels = Pixels::new(image.grid().shift());
        let [to_plane, to_row] = [self.order.planes, Axis::Y].map(|axis| stride(image, axis));
        for y in 0..image.grid().rays()[1] {
            let row = &mut bits[(y as usize + self.margin) * self.words..][..self.words];
            for &depth in image.samples(plane as u32 * to_plane + y * to_row) {
                flip(row, pixels.index_from(depth) as usize + self.margin);
            }
            accumulate(row);
        }
    }

    /// Fills a plane from an image along y, whose rays run from row to row.
    fn along_rows(&self, image: &Ldi, plane: usize, bits: &mut [u64]) {
        let pixels = Pixels::new(image.grid().shift());
        let [to_plane, to_bit] = [self.order.planes, self.order.words].map(|axis| stride(image, axis));
        for at in 0..image.grid().rays()[self.order.words.depth()] {
            for &depth in image.samples(plane as u32 * to_plane + at * to_bit) {
                let row = pixels.index_from(depth) as usize + self.margin;
                if row < self.rows {
                    flip(&mut bits[row * self.words..][..self.words], at as usize + self.margin);
                }
            }
        }
        accumulate_rows(bits, self.words);
    }

    /// Returns the nodes of an image whose rays run from plane to plane. Each row of nodes is converted separately.
    fn across_planes(&self, image: &Ldi, planes: &Range<i32>) -> Vec<u64> {
        let pixels = Pixels::new(image.grid().shift());
        let rays = image.grid().rays();
        let [to_row, to_bit] = [Axis::Y, self.order.words].map(|axis| stride(image, axis));
        let (words, margin) = (self.words, self.margin);
        let by_row: Vec<Vec<u64>> = (0..rays[1])
            .into_par_iter()
            .with_min_len(8)
            .map(|row| {
                let mut bits = vec![0; planes.len() * words];
                for at in 0..rays[self.order.words.depth()] {
                    let samples = image.samples(row * to_row + at * to_bit);
                    let before = samples.partition_point(|&depth| pixels.index_from(depth) <= planes.start);
                    let bit = at as usize + margin;
                    if before % 2 == 1 {
                        flip(&mut bits[..words], bit);
                    }
                    for &depth in &samples[before..] {
                        let plane = pixels.index_from(depth);
                        if plane >= planes.end {
                            break;
                        }
                        flip(&mut bits[(plane - planes.start) as usize * words..][..words], bit);
                    }
                }
                accumulate_rows(&mut bits, words);
                bits
            })
            .collect();
        // Images whose samples reach the end of the grid close behind its last node.
        let in_grid = 0..rays[self.order.planes.depth()] as i32;
        self.of_planes(image, planes, |plane, bits| {
            debug_assert!(in_grid.contains(&(plane as i32)));
            let at = (plane as i32 - planes.start) as usize * words;
            for (row, from) in by_row.iter().enumerate() {
                bits[(row + margin) * words..][..words].copy_from_slice(&from[at..at + words]);
            }
        })
    }
}

/// Returns by how much the number of an image's ray grows from node to node along an axis.
fn stride(image: &Ldi, axis: Axis) -> u32 {
    if axis.depth() == image.axis().column() { 1 } else { image.size().0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bits::is_set;
    use crate::sampler::{Estimate, Mode};
    use crate::solids;
    use crate::testing::images::images_of;

    /// Returns whether a node is inside an image, sample by sample.
    fn is_inside(image: &Ldi, node: [u32; 3]) -> bool {
        let axis = image.axis();
        let (columns, _) = image.size();
        let samples = image.samples(node[axis.row()] * columns + node[axis.column()]);
        let position = image.grid().node(node[axis.depth()]);
        samples.iter().filter(|&&depth| depth < position).count() % 2 == 1
    }

    fn bit(slab: &NodeSlab, [x, y, z]: [i32; 3], margin: i32) -> bool {
        is_set(slab.row((y + margin) as usize, z), (x + margin) as usize)
    }

    #[test]
    fn node_states_agree_with_the_rays() {
        // 130 nodes along x: three words, the last of them short.
        let exact = images_of(solids::torus(3.0, 1.0, 31, 17).unwrap(), 130, 1024, Mode::Exact);
        let rays = exact[0].grid().rays().map(|n| n as i32);
        for margin in [0, 1] {
            for chosen in [&exact[..1], &exact[1..2], &exact[2..], &exact[..]] {
                let planes = NodePlanes::new(chosen, Mode::Exact).unwrap();
                let slab = planes.slab(-1..rays[2] + 1, margin);
                assert_eq!((slab.disagreements(-1..rays[2] + 1), slab.end()), (0, rays[2] + 1));
                let inside = |node: [i32; 3]| {
                    let on_grid = (0..3).all(|i| (0..rays[i]).contains(&node[i]));
                    on_grid && is_inside(&chosen[0], node.map(|i| i as u32))
                };
                let across = |i: usize| -(margin as i32)..rays[i] + margin as i32;
                for z in -1..=rays[2] {
                    for y in across(1) {
                        for x in across(0) {
                            assert_eq!(bit(&slab, [x, y, z], margin as i32), inside([x, y, z]), "{x} {y} {z}");
                        }
                    }
                }
                // A part of the planes gives the same.
                let part = planes.slab(7..19, margin);
                (7..19).for_each(|z| (0..part.rows()).for_each(|row| assert_eq!(part.row(row, z), slab.row(row, z))));
            }
        }
        let planes = NodePlanes::new(&exact, Mode::Exact).unwrap();
        assert_eq!(planes.disagreements(), None);
        let slab = planes.slab(0..rays[2], 0);
        assert_eq!(planes.planes().collect::<Vec<_>>().concat(), slab.bits);
    }

    #[test]
    fn bytes_are_the_nodes() {
        for chosen in [0..1, 1..2, 2..3, 0..3] {
            let exact = images_of(solids::torus(3.0, 1.0, 31, 17).unwrap(), 70, 256, Mode::Exact);
            let planes = NodePlanes::new(&exact[chosen], Mode::Exact).unwrap();
            let [columns, rows, layers] = exact[0].grid().rays().map(|n| n as i32);
            assert!(layers % 8 != 0, "{layers}: the last byte of a row is not whole");
            let (slab, bytes) = (planes.slab(0..layers, 0), planes.to_bytes());
            assert_eq!(bytes.len() as i32, columns * rows * layers);
            for (at, byte) in (0..).zip(bytes) {
                let node = [at / layers / rows, at / layers % rows, at % layers];
                assert_eq!(byte, u8::from(bit(&slab, node, 0)), "{node:?}");
            }
        }
    }

    #[test]
    fn estimates_may_disagree_and_are_combined() {
        // Voxels as long as many pixels, so that a gap closes in some images and not in others.
        let mesh = || solids::torus(3.0, 1.0, 31, 17).unwrap();
        let over = images_of(mesh(), 150, 32, Mode::Estimate(Estimate::Over));
        let rays = over[0].grid().rays();
        let slab = |combine| NodePlanes::new(&over, combine).unwrap().slab(0..rays[2] as i32, 0);
        let [any, all, most] = [Mode::OVER, Mode::UNDER, Mode::Exact].map(slab);
        let sum = any.disagreements(0..rays[2] as i32);
        assert!(sum > 0);
        let (count, first) = NodePlanes::new(&over, Mode::OVER).unwrap().disagreements().unwrap();
        let disagree = |node| over.iter().any(|image| is_inside(image, node) != is_inside(&over[0], node));
        let nodes = (0..rays[2]).flat_map(|z| (0..rays[1]).flat_map(move |y| (0..rays[0]).map(move |x| [x, y, z])));
        assert_eq!((count, Some(first)), (sum, nodes.into_iter().find(|node| disagree(*node))));
        for z in 0..rays[2] {
            for y in 0..rays[1] {
                for x in 0..rays[0] {
                    let said = over.iter().filter(|image| is_inside(image, [x, y, z])).count();
                    let found = [&any, &all, &most].map(|slab| bit(slab, [x, y, z].map(|i| i as i32), 0));
                    assert_eq!(found, [said > 0, said == 3, said > 1]);
                }
            }
        }
    }

    #[test]
    fn images_of_different_grids_or_axes_are_refused() {
        let a = images_of(solids::torus(3.0, 1.0, 31, 17).unwrap(), 20, 64, Mode::Exact);
        let b = images_of(solids::torus(3.0, 1.0, 31, 17).unwrap(), 21, 64, Mode::Exact);
        assert_eq!(NodePlanes::new([], Mode::OVER).unwrap_err(), NodesError::NoImage);
        let mismatch = NodesError::Mismatch { first: 0, second: 1 };
        assert_eq!(NodePlanes::new([&a[0], &b[1]], Mode::OVER).unwrap_err(), mismatch);
        assert_eq!(NodePlanes::new([&a[0], &a[0]], Mode::OVER).unwrap_err(), mismatch);
    }
}
