//! Crossings of the surface with the lattice edges of a slab: Hermite data, found once and looked up in constant time.
//!
//! The crossed edges of a row of nodes are bits. The crossings of a row are stored in the order of those bits, so that the
//! crossing of an edge is found by a population count from one running rank per word — as sampling finds the rank of a voxel in
//! a mask.

use std::ops::Range;

use crate::parallel::*;
use glam::DVec3;

use super::cuts::Cuts;
use crate::bits::{after, is_set, ones};
use crate::fixed::Pixels;
use crate::ldi::{Ldi, Mode, NodePlanes, NodeSlab};

/// A crossing of the surface with a lattice edge, and its normal there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The distance from the lower end of the edge, as a share of its length: strictly between 0 and 1.
    pub at: f32,
    /// The unit normal, outwards; zero where unknown.
    pub normal: [f32; 3],
}

impl Crossing {
    /// Returns its place on the edge along `axis` from a node, in coordinates of cells.
    pub fn place(&self, axis: usize, node: [i32; 3]) -> DVec3 {
        let mut place = DVec3::from_array(node.map(f64::from));
        place[axis] += f64::from(self.at);
        place
    }
}

/// A lattice edge that its ray crosses an even number of times.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    pub axis: usize,
    /// The lower end of the edge.
    pub node: [i32; 3],
    /// The first crossing and the last.
    pub crossings: [Crossing; 2],
    /// Whether the ray enters the solid at the first crossing, so that it meets a wall; otherwise it meets a gap.
    pub enters: bool,
}

/// Two crossings of a lattice edge that follow one another and that no triangle is made for.
#[derive(Clone, Copy, Debug)]
pub struct DroppedPair {
    axis: u8,
    /// The lower end of the edge.
    node: [i32; 3],
    /// Distances from it, as shares of the edge.
    at: [f32; 2],
    /// Whether the ray enters the solid at the first crossing, so that it meets a wall; otherwise it meets a gap.
    pub is_wall: bool,
}

impl DroppedPair {
    /// Returns the edge: its axis and its lower end.
    pub fn edge(&self) -> (usize, [i32; 3]) {
        (usize::from(self.axis), self.node)
    }

    /// Returns the places of the crossings, in coordinates of cells.
    pub fn places(&self) -> [DVec3; 2] {
        self.at.map(|at| Crossing { at, ..UNKNOWN }.place(usize::from(self.axis), self.node))
    }
}

/// The parts of a slab that samples and triangles do not have in common.
#[derive(Debug, Default)]
pub struct Dropped {
    /// Crossings that cancel in pairs, between two neighbouring nodes.
    pub pairs: Vec<DroppedPair>,
    /// Edges that are crossed by the nodes' signs but whose own ray has no sample there, as may occur in conservative images.
    pub unsupported: u64,
}

impl Dropped {
    pub fn append(&mut self, mut other: Dropped) {
        self.pairs.append(&mut other.pairs);
        self.unsupported += other.unsupported;
    }
}

/// The midpoint of an edge, used where nothing better is known.
pub const UNKNOWN: Crossing = Crossing { at: 0.5, normal: [0.0; 3] };

/// The crossed edges of some rows, and their crossings.
#[derive(Debug, Default)]
struct EdgeRows {
    words: usize,
    /// The crossed edges as bits, row after row.
    crossed: Vec<u64>,
    /// The number of crossed edges before each word.
    ranks: Vec<u32>,
    crossings: Vec<Crossing>,
}

impl EdgeRows {
    /// Creates rows with crossed edges and no known crossings.
    fn new(words: usize, crossed: Vec<u64>) -> EdgeRows {
        let mut rank = 0;
        let count = |word: &u64| {
            let before = rank;
            rank += word.count_ones();
            before
        };
        let ranks = crossed.iter().map(count).collect();
        EdgeRows { words, crossed, ranks, crossings: vec![UNKNOWN; rank as usize] }
    }

    fn is_crossed(&self, row: usize, bit: usize) -> bool {
        is_set(&self.crossed[row * self.words..], bit)
    }

    fn place(&self, row: usize, bit: usize) -> usize {
        let word = row * self.words + bit / 64;
        debug_assert!(self.is_crossed(row, bit));
        let below = self.crossed[word] & ((1 << (bit % 64)) - 1);
        (self.ranks[word] + below.count_ones()) as usize
    }

    /// Returns the crossed edges of a row.
    fn row(&self, row: usize) -> impl Iterator<Item = usize> + '_ {
        ones(&self.crossed[row * self.words..][..self.words])
    }
}

/// The nodes and the crossed edges of consecutive layers of cells.
///
/// Nodes, edges and cells have a margin of one on each side in x and y: node x of the grid is bit x + 1 of a row, and cell or
/// edge i lies between nodes i and i + 1 counted with the margin. Planes and layers are counted by the grid; layer k lies
/// between planes k and k + 1.
pub struct EdgeSlab {
    pub nodes: NodeSlab,
    layers: Range<i32>,
    /// Along x and y by plane, along z by row.
    along: [Vec<EdgeRows>; 3],
    /// Without that of the last plane.
    pub dropped: Dropped,
}

/// The input from which the edges of a slab are found.
#[derive(Clone, Copy)]
pub struct Source<'a> {
    pub planes: NodePlanes<'a>,
    pub images: [&'a Ldi; 3],
    pub normals: Option<&'a [[f32; 3]]>,
    pub mode: Mode,
    /// All nodes, with a margin of one; `None` where they are too many, and each is looked for on its rays.
    pub nodes: Option<&'a NodeSlab>,
}

impl EdgeSlab {
    /// Finds the edges of layers of cells; the nodes extend one plane further.
    pub fn new(source: &Source, cuts: &Cuts, layers: Range<i32>) -> EdgeSlab {
        let nodes = source.planes.slab(layers.start..layers.end + 2, 1);
        let planes = layers.start..layers.end + 1;
        let made = join(
            || -> (Vec<_>, Vec<_>) {
                let of_plane = |plane| (along_x(source, cuts, &nodes, plane), along_y(source, cuts, &nodes, plane));
                planes.clone().into_par_iter().map(of_plane).unzip()
            },
            || -> Vec<_> {
                let rows = (0..nodes.rows()).into_par_iter().with_min_len(4);
                rows.map(|row| along_z(source, cuts, &nodes, row, &layers)).collect()
            },
        );
        let ((x, y), z) = made;
        let mut dropped = Dropped::default();
        // The last plane is the first of the next slab, which counts it.
        let last = planes.len() - 1;
        let along = [(x, last), (y, last), (z, usize::MAX)].map(|(rows, counted)| {
            let keep = |(at, (rows, of_rows)): (usize, (EdgeRows, Dropped))| {
                if at < counted {
                    dropped.append(of_rows);
                }
                rows
            };
            rows.into_iter().enumerate().map(keep).collect()
        });
        EdgeSlab { nodes, layers, along, dropped }
    }

    pub fn layers(&self) -> Range<i32> {
        self.layers.clone()
    }

    /// Returns the rows that hold the edge from a node along `axis`, its row among them, and its bit.
    fn find(&self, axis: usize, [x, y, z]: [i32; 3]) -> (&EdgeRows, usize, usize) {
        let plane = (z - self.layers.start) as usize;
        match axis {
            2 => (&self.along[2][y as usize], plane, x as usize),
            _ => (&self.along[axis][plane], y as usize, x as usize),
        }
    }

    /// Returns the crossing of an edge along `axis` from the given node, which must be crossed.
    pub fn crossing(&self, axis: usize, node: [i32; 3]) -> Crossing {
        let (rows, row, bit) = self.find(axis, node);
        rows.crossings[rows.place(row, bit)]
    }

    /// Returns the crossed edges along x and y in a plane, or along z in a layer, by their lower nodes.
    pub fn crossed_in(&self, axis: usize, z: i32) -> impl Iterator<Item = [i32; 3]> + '_ {
        (0..self.nodes.rows() as i32).flat_map(move |y| {
            let (rows, row, _) = self.find(axis, [0, y, z]);
            rows.row(row).map(move |x| [x as i32, y, z])
        })
    }

    pub fn is_inside(&self, node: [i32; 3]) -> bool {
        self.nodes.is_inside(node)
    }
}

/// Returns the crossed edges of a row of nodes: bit i compares node i with the next.
fn differences(row: &[u64]) -> impl Iterator<Item = u64> + '_ {
    (0..row.len()).map(|word| row[word] ^ after(row, word))
}

/// Returns the nodes of a row that differ from those of another.
fn unlike<'a>(row: &'a [u64], other: &'a [u64]) -> impl Iterator<Item = u64> + 'a {
    row.iter().zip(other).map(|(a, b)| a ^ b)
}

fn along_x(source: &Source, cuts: &Cuts, nodes: &NodeSlab, plane: i32) -> (EdgeRows, Dropped) {
    let image = source.images[0];
    let crossed = (0..nodes.rows()).flat_map(|row| differences(nodes.row(row, plane))).collect();
    let mut filler = Filler::new(source, cuts, 0, EdgeRows::new(nodes.words(), crossed));
    let (columns, rows) = image.size();
    if (0..rows as i32).contains(&plane) {
        for column in 0..columns {
            let row = column as usize + 1;
            let inside = |bit: i32| is_set(nodes.row(row, plane), bit as usize);
            filler.fill_ray(plane as u32 * columns + column, 0..i32::MAX, |edge| (row, edge as usize), inside);
        }
    }
    filler.finish()
}

fn along_y(source: &Source, cuts: &Cuts, nodes: &NodeSlab, plane: i32) -> (EdgeRows, Dropped) {
    let image = source.images[1];
    let last = nodes.rows() - 1;
    let crossed = (0..last).flat_map(|row| unlike(nodes.row(row, plane), nodes.row(row + 1, plane)));
    let crossed = crossed.chain(std::iter::repeat_n(0, nodes.words())).collect();
    let mut filler = Filler::new(source, cuts, 1, EdgeRows::new(nodes.words(), crossed));
    let (columns, rows) = image.size();
    if (0..rows as i32).contains(&plane) {
        for column in 0..columns {
            let bit = column as usize + 1;
            let inside = |row: i32| is_set(nodes.row(row as usize, plane), bit);
            filler.fill_ray(plane as u32 * columns + column, 0..i32::MAX, |edge| (edge as usize, bit), inside);
        }
    }
    filler.finish()
}

fn along_z(source: &Source, cuts: &Cuts, nodes: &NodeSlab, row: usize, layers: &Range<i32>) -> (EdgeRows, Dropped) {
    let image = source.images[2];
    let crossed = layers.clone().flat_map(|layer| unlike(nodes.row(row, layer), nodes.row(row, layer + 1))).collect();
    let mut filler = Filler::new(source, cuts, 2, EdgeRows::new(nodes.words(), crossed));
    let (columns, rows) = image.size();
    if let Some(image_row) = row.checked_sub(1).filter(|&row| row < rows as usize) {
        for column in 0..columns {
            let bit = column as usize + 1;
            // Along z, as along the other axes, edges are counted from the one before node 0.
            let inside = |edge: i32| is_set(nodes.row(row, edge - 1), bit);
            let place = |edge: i32| ((edge - 1 - layers.start) as usize, bit);
            let ray = image_row as u32 * columns + column;
            filler.fill_ray(ray, layers.start + 1..layers.end + 1, place, inside);
        }
    }
    filler.finish()
}

/// Fills the crossings of rows, ray by ray.
struct Filler<'a> {
    source: &'a Source<'a>,
    cuts: &'a Cuts,
    axis: usize,
    pixels: Pixels,
    rows: EdgeRows,
    filled: u64,
    dropped: Dropped,
}

impl<'a> Filler<'a> {
    fn new(source: &'a Source<'a>, cuts: &'a Cuts, axis: usize, rows: EdgeRows) -> Filler<'a> {
        Filler {
            source,
            cuts,
            axis,
            pixels: Pixels::new(source.images[axis].grid().shift()),
            rows,
            filled: 0,
            dropped: Dropped::default(),
        }
    }

    fn finish(mut self) -> (EdgeRows, Dropped) {
        self.dropped.unsupported = self.rows.crossings.len() as u64 - self.filled;
        (self.rows, self.dropped)
    }

    /// Processes the samples of a ray, edge by edge, for the edges in a range. Edge i ends at node i of the grid; `place`
    /// returns its position in the rows, and `inside` whether it begins inside.
    fn fill_ray(
        &mut self,
        ray: u32,
        edges: Range<i32>,
        place: impl Fn(i32) -> (usize, usize),
        inside: impl Fn(i32) -> bool,
    ) {
        let (source, axis, pixels) = (self.source, self.axis, self.pixels);
        let image = source.images[axis];
        let samples = image.samples(ray);
        let first = image.offsets()[ray as usize] as usize;
        let edge_of = |&depth: &i32| pixels.index_from(depth);
        let mut from = match edges.start {
            0 => 0,
            start => samples.partition_point(|depth| edge_of(depth) < start),
        };
        while let Some(edge) = samples.get(from).map(edge_of).filter(|&edge| edge < edges.end) {
            let count = samples[from..].iter().take_while(|depth| edge_of(depth) == edge).count();
            let (row, bit) = place(edge);
            let node = || source.node(axis, ray, edge);
            let end = from + count;
            if count % 2 == 1 && self.rows.is_crossed(row, bit) {
                let enters = !inside(edge);
                let kept = match count {
                    1 => from,
                    _ => {
                        let mode = match source.mode {
                            Mode::Exact => self.cuts.mode_beside(axis, node()),
                            mode => mode,
                        };
                        from + kept(mode, &samples[from..end], enters)
                    }
                };
                let place = self.rows.place(row, bit);
                self.rows.crossings[place] = source.crossing(axis, first + kept, edge, enters);
                self.filled += 1;
                self.drop_pairs(ray, edge, from..kept);
                self.drop_pairs(ray, edge, kept + 1..end);
            } else if self.cuts.has_thin(axis, node()) {
                // Triangles pass through the first and the last.
                self.drop_pairs(ray, edge, from + 1..end - 1);
            } else {
                self.drop_pairs(ray, edge, from..end);
            }
            from = end;
        }
    }

    /// Drops samples of an edge of a ray, two by two; they are numbered within the ray.
    fn drop_pairs(&mut self, ray: u32, edge: i32, samples: Range<usize>) {
        let (axis, node) = (self.axis as u8, self.source.node(self.axis, ray, edge));
        let depths = self.source.images[self.axis].samples(ray);
        let pair = |first: usize| {
            let at = [first, first + 1].map(|sample| share_of_edge(self.pixels, depths[sample], edge));
            DroppedPair { axis, node, at, is_wall: first.is_multiple_of(2) }
        };
        self.dropped.pairs.extend((samples.start..samples.end.saturating_sub(1)).step_by(2).map(pair));
    }
}

/// Returns the index of the one sample that is kept of an odd number in one edge; all others are dropped in pairs.
fn kept(mode: Mode, samples: &[i32], enters: bool) -> usize {
    let last = samples.len() - 1;
    match (mode, enters) {
        (Mode::OVER, true) | (Mode::UNDER, false) => 0,
        (Mode::OVER, false) | (Mode::UNDER, true) => last,
        // The sample that changes the length inside least.
        (Mode::Exact, _) => {
            let lost = |kept: usize| -> i64 {
                let pairs = samples[..kept].chunks_exact(2).chain(samples[kept + 1..].chunks_exact(2));
                pairs.map(|pair| i64::from(pair[1] - pair[0])).sum()
            };
            (0..=last).step_by(2).min_by_key(|&kept| lost(kept)).unwrap_or(0)
        }
    }
}

/// Returns the distance of a depth from the lower end of an edge of its ray, as a share of the edge.
fn share_of_edge(pixels: Pixels, depth: i32, edge: i32) -> f32 {
    (depth - pixels.ray(edge - 1)) as f32 / (1i64 << pixels.shift) as f32
}

/// Returns the outward normal at a sample of an image: a triangle may face either way, but the ray knows whether it enters.
fn normal_at(image: &Ldi, normals: Option<&[[f32; 3]]>, sample: usize, enters: bool) -> [f32; 3] {
    let triangle = image.triangles().map(|triangles| triangles[sample] as usize);
    let Some(&normal) = triangle.and_then(|triangle| normals?.get(triangle)) else { return [0.0; 3] };
    let against = normal[image.axis().depth()] < 0.0;
    if against == enters { normal } else { normal.map(|n| -n) }
}

impl Source<'_> {
    /// Returns the crossing at a sample, counted through all rays, of an edge of its ray.
    fn crossing(&self, axis: usize, sample: usize, edge: i32, enters: bool) -> Crossing {
        let image = self.images[axis];
        let pixels = Pixels::new(image.grid().shift());
        Crossing {
            at: share_of_edge(pixels, image.depths()[sample], edge),
            normal: normal_at(image, self.normals, sample, enters),
        }
    }

    /// Returns the lattice edges that their ray crosses an even number of times.
    pub fn pairs(&self) -> Vec<Pair> {
        let of_image = |axis: usize| {
            let image = self.images[axis];
            let (columns, rows) = image.size();
            let pixels = Pixels::new(image.grid().shift());
            let of_ray = move |ray: u32| {
                let samples = image.samples(ray);
                let first = image.offsets()[ray as usize] as usize;
                let mut found = Vec::new();
                let mut from = 0;
                while from < samples.len() {
                    let edge = pixels.index_from(samples[from]);
                    let count = samples[from..].iter().take_while(|&&depth| pixels.index_from(depth) == edge).count();
                    let enters = from % 2 == 0;
                    if count % 2 == 0 {
                        let crossing = |at: usize, enters: bool| self.crossing(axis, first + at, edge, enters);
                        let node = self.node(axis, ray, edge);
                        let crossings = [crossing(from, enters), crossing(from + count - 1, !enters)];
                        found.push(Pair { axis, node, crossings, enters });
                    }
                    from += count;
                }
                found
            };
            (0..columns * rows).into_par_iter().with_min_len(1024).flat_map_iter(of_ray)
        };
        (0..3).flat_map(|axis| of_image(axis).collect::<Vec<_>>()).collect()
    }

    /// Returns the first crossing of the ray along `axis` from a node on; `None` if it has none before the next node. A vertex is
    /// placed by another one where the ray crosses the edge three times or more.
    pub fn first_crossing(&self, axis: usize, node: [i32; 3]) -> Option<Crossing> {
        let image = self.images[axis];
        let mut next = node;
        next[axis] += 1;
        // Before the grid lie no samples.
        let (sample, [x, y, z]) = self.before(axis, node).map_or((0, next), |before| (before, node));
        let ray = self.ray(axis, [x - 1, y - 1, z]);
        let pixels = Pixels::new(image.grid().shift());
        let &depth = image.samples(ray).get(sample)?;
        let edge = next[axis] - i32::from(axis < 2);
        let first = image.offsets()[ray as usize] as usize;
        (pixels.index_from(depth) == edge).then(|| self.crossing(axis, first + sample, edge, sample % 2 == 0))
    }

    /// Returns the lower end of an edge of a ray.
    fn node(&self, axis: usize, ray: u32, edge: i32) -> [i32; 3] {
        let columns = self.images[axis].size().0;
        let (column, row) = ((ray % columns) as i32, (ray / columns) as i32);
        match axis {
            0 => [edge, column + 1, row],
            1 => [column + 1, edge, row],
            _ => [column + 1, row + 1, edge - 1],
        }
    }

    /// Returns whether a node is inside.
    pub fn is_inside(&self, node: [i32; 3]) -> bool {
        if let Some(nodes) = self.nodes {
            return nodes.is_inside(node);
        }
        let inside = (0..3).filter(|&axis| self.before(axis, node).is_some_and(|before| before % 2 == 1)).count();
        match self.mode {
            Mode::OVER => inside > 0,
            Mode::UNDER => inside == 3,
            Mode::Exact => inside > 1,
        }
    }

    /// Returns the corners of a cell that are inside, as bits.
    pub fn corners_inside(&self, [x, y, z]: [i32; 3]) -> u8 {
        let corner = |c: i32| self.is_inside([x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)]);
        (0..8).fold(0, |bits, c| bits | u8::from(corner(c)) << c)
    }

    /// Returns the number of samples before a node on the ray along `axis` through it; `None` beyond the grid.
    fn before(&self, axis: usize, [x, y, z]: [i32; 3]) -> Option<usize> {
        let (image, at) = (self.images[axis], [x - 1, y - 1, z]);
        let rays = image.grid().rays();
        if (0..3).any(|i| at[i] < 0 || at[i] >= rays[i] as i32) {
            return None;
        }
        let place = image.grid().node(at[axis] as u32);
        Some(image.samples(self.ray(axis, at)).partition_point(|&depth| depth < place))
    }

    /// Returns the ray along `axis` through a node of the grid.
    fn ray(&self, axis: usize, at: [i32; 3]) -> u32 {
        let image = self.images[axis];
        at[image.axis().row()] as u32 * image.size().0 + at[image.axis().column()] as u32
    }

    /// Intersects the line from a node, along `axis` or against it, with the planes of the surface beside the node. Returns the
    /// least distance in pitches and the normal of that plane; `None` where no plane ends.
    pub fn tip(&self, axis: usize, node: [i32; 3], is_along: bool) -> Option<(f32, [f32; 3])> {
        let at = [node[0] - 1, node[1] - 1, node[2]];
        let mut tip: Option<(f32, [f32; 3])> = None;
        for beside in [(axis + 1) % 3, (axis + 2) % 3] {
            let image = self.images[beside];
            let before = self.before(beside, node).filter(|before| before % 2 == 1)?;
            let ray = self.ray(beside, at);
            let place = image.grid().node(at[beside] as u32);
            for (sample, enters) in [(before - 1, true), (before, false)] {
                let depth = image.samples(ray).get(sample)?;
                let away = (depth - place) as f32 / (1i64 << image.grid().shift()) as f32;
                let normal = normal_at(image, self.normals, image.offsets()[ray as usize] as usize + sample, enters);
                let rise = if is_along { normal[axis] } else { -normal[axis] };
                let end = away * normal[beside] / rise;
                if rise > 0.0 && tip.is_none_or(|(least, _)| end < least) {
                    tip = Some((end, normal));
                }
            }
        }
        tip
    }
}
