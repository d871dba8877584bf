//! Slabs of planes of nodes, and the sets that their gaps belong to.

use std::ops::Range;

use super::ResolveError;
use super::layer::{Layer, Raster, find_runs, link, link_row};
use super::masks::{Masks, RayGap, Rays};
use super::sets::{IN, OUT, Sets};
use crate::cancel::checkpoint;
use crate::fixed::Hit;
use crate::minkowski::spans::RayEnds;
use crate::minkowski::{Exterior, RaySpans};

/// The data kept of a slab.
#[derive(Debug)]
pub struct SlabSets {
    /// A node of each set except those of certain outside and inside, from set 2 on.
    pub set_nodes: Vec<[u32; 3]>,
    /// The first plane.
    pub first: Border,
    /// The last plane.
    pub last: Border,
    /// Gaps that begin in the slab, by axis.
    pub gaps: [SlabGaps; 3],
    /// The number of all gaps that begin in the slab.
    pub gap_count: u64,
    /// Number of nodes that are neither certainly in nor out.
    pub open_nodes: u64,
}

/// Gaps of one axis by the hits that begin them; those that are certainly out are omitted.
#[derive(Debug, Default)]
pub struct SlabGaps {
    /// Gaps that are certainly in.
    pub inside: Vec<u32>,
    /// Gaps with their sets, in if the set is.
    pub open: Vec<(u32, u32)>,
    /// Gaps between two nodes, each with a point in it.
    pub thin: Vec<(u32, [i32; 3])>,
}

/// A plane at an end of a slab.
#[derive(Debug)]
pub struct Border {
    /// The index of the plane in the grid.
    pub plane: usize,
    /// Crossings between it and the plane before.
    pub walls: Vec<u64>,
    open: Vec<u64>,
    inside: Vec<u64>,
    starts: Vec<u64>,
    elements: Vec<u32>,
    /// The sets of its elements, from the first on.
    sets: Vec<u32>,
}

impl Border {
    /// Returns its nodes.
    pub fn layer(&self) -> Layer<'_> {
        Layer { open: &self.open, inside: &self.inside, starts: &self.starts, elements: &self.elements }
    }

    /// Returns the set of an element of its layer.
    pub fn set(&self, element: u32) -> u32 {
        match element {
            OUT | IN => element,
            _ => self.sets[(element - self.elements[0] - 1) as usize],
        }
    }
}

/// A gap with a node in it: its axis, the hit that begins it, and a word and bit of the slab.
struct NodeGap {
    axis: usize,
    hit: u32,
    word: u32,
    bit: u32,
}

/// A slab under construction.
struct Slab<'a, H> {
    raster: &'a Raster,
    planes: Range<usize>,
    spans: &'a [RaySpans<H>; 3],
    exterior: Exterior,
    open: Vec<u64>,
    inside: Vec<u64>,
    starts: Vec<u64>,
    elements: Vec<u32>,
    walls_z: Vec<u64>,
    sets: Sets,
    node_gaps: Vec<NodeGap>,
    gaps: [SlabGaps; 3],
}

/// Returns a point in a gap between two nodes of the ray through `node`; `hit` begins the gap.
pub fn point_between<H: Hit>(raster: &Raster, spans: &RaySpans<H>, node: [usize; 3], hit: u32) -> [i32; 3] {
    let hits = &spans.hits[hit as usize..];
    let [before, after] = [hits[0].crossing().ceil(), hits[1].crossing().floor()];
    debug_assert!(before < after, "a gap from {before} to {after} has no lattice step in it");
    let mut point = node.map(|index| raster.pixels.ray(index as i32));
    point[spans.axis.depth()] = (before + (after - before) / 2) | 1;
    point
}

/// Finds the sets of a slab.
pub fn resolve<H: Hit>(
    raster: &Raster,
    planes: Range<usize>,
    (spans, ends_along_z): (&[RaySpans<H>; 3], &RayEnds),
    exterior: Exterior,
) -> Result<SlabSets, ResolveError> {
    let length = planes.len() * raster.plane();
    let bits = || vec![0; length];
    let mut slab = Slab {
        raster,
        planes,
        spans,
        exterior,
        open: bits(),
        inside: bits(),
        starts: bits(),
        elements: vec![0; length],
        walls_z: bits(),
        sets: Sets::new(0),
        node_gaps: Vec::new(),
        gaps: Default::default(),
    };
    slab.cast_along_z(ends_along_z);
    let mut masks = Masks::default();
    let mut walls_x = vec![0; raster.plane()];
    for z in slab.planes.clone() {
        slab.cast_along_y(z, &mut masks);
        slab.cast_along_x(z, &mut walls_x);
        slab.open_plane(z, &walls_x)?;
        slab.link_plane(z, &walls_x, &masks.walls)?;
    }
    Ok(slab.finish())
}

impl<H: Hit> Slab<'_, H> {
    /// Returns the words of a plane.
    fn words_of(&self, z: usize) -> Range<usize> {
        let at = (z - self.planes.start) * self.raster.plane();
        at..at + self.raster.plane()
    }

    /// Returns some words of the slab as a layer.
    fn layer(&self, words: Range<usize>) -> Layer<'_> {
        Layer {
            open: &self.open[words.clone()],
            inside: &self.inside[words.clone()],
            starts: &self.starts[words.clone()],
            elements: &self.elements[words],
        }
    }

    /// Records a gap of the ray through a node along an axis.
    fn add_gap(&mut self, axis: usize, mut node: [usize; 3], gap: RayGap) {
        let RayGap { hit, nodes: (from, to) } = gap;
        if from < to {
            node[axis] = from;
            let [x, y, z] = node;
            let row = (z - self.planes.start) * self.raster.nodes[1] + y;
            let word = (row * self.raster.words + x / 64) as u32;
            self.node_gaps.push(NodeGap { axis, hit, word, bit: (x % 64) as u32 });
        } else {
            let point = point_between(self.raster, &self.spans[axis], node, hit);
            self.gaps[axis].thin.push((hit, point));
        }
    }

    /// Applies the rays along z to all planes: their hull is kept in `open` until the other rays are applied.
    fn cast_along_z(&mut self, ends: &RayEnds) {
        let [columns, rows, _] = self.raster.nodes;
        let (words, plane) = (self.raster.words, self.raster.plane());
        let rays = Rays::new(self.raster, &self.spans[2], self.exterior).with_ends(ends);
        let planes = self.planes.clone();
        let mut masks = Masks::default();
        for y in 0..rows {
            masks.cast(&rays, (y * columns) as u32, planes.clone(), |x, gap| self.add_gap(2, [x, y, 0], gap));
            for at in 0..planes.len() {
                let (from, to) = (at * words..(at + 1) * words, at * plane + y * words);
                self.inside[to..to + words].copy_from_slice(&masks.inside[from.clone()]);
                self.open[to..to + words].copy_from_slice(&masks.hull[from.clone()]);
                self.walls_z[to..to + words].copy_from_slice(&masks.walls[from]);
            }
        }
    }

    /// Applies the rays along y to one plane.
    fn cast_along_y(&mut self, z: usize, masks: &mut Masks) {
        let [columns, rows, _] = self.raster.nodes;
        let rays = Rays::new(self.raster, &self.spans[1], self.exterior);
        masks.cast(&rays, (z * columns) as u32, 0..rows, |x, gap| self.add_gap(1, [x, 0, z], gap));
        for (at, word) in self.words_of(z).enumerate() {
            self.inside[word] |= masks.inside[at];
            self.open[word] &= masks.hull[at];
        }
    }

    /// Applies the rays along x to one plane.
    fn cast_along_x(&mut self, z: usize, walls: &mut [u64]) {
        checkpoint();
        let (rows, words) = (self.raster.nodes[1], self.raster.words);
        let rays = Rays::new(self.raster, &self.spans[0], self.exterior);
        let (mut inside, mut hull) = (vec![0; words], vec![0; words]);
        let first = self.words_of(z).start;
        for (y, walls) in walls.chunks_mut(words).enumerate() {
            [&mut *walls, &mut inside, &mut hull].into_iter().for_each(|bits| bits.fill(0));
            rays.row((z * rows + y) as u32, [&mut inside, &mut hull, walls], |gap| self.add_gap(0, [0, y, z], gap));
            for at in 0..words {
                self.inside[first + y * words + at] |= inside[at];
                self.open[first + y * words + at] &= hull[at];
            }
        }
    }

    /// Converts hulls to open nodes and their runs, in one plane to which all rays have been applied.
    fn open_plane(&mut self, z: usize, walls: &[u64]) -> Result<(), ResolveError> {
        let words = self.words_of(z);
        for word in words.clone() {
            let (hull, inside) = (self.open[word], self.inside[word]);
            if inside & !hull != 0 {
                let bit = (inside & !hull).trailing_zeros();
                return Err(self.raster.contradiction(z, word - words.start, bit));
            }
            self.open[word] = hull & !inside;
        }
        let mut next = self.sets.len();
        for (row, walls) in words.step_by(self.raster.words).zip(walls.chunks(self.raster.words)) {
            let row = row..row + self.raster.words;
            let (starts, elements) = (&mut self.starts[row.clone()], &mut self.elements[row.clone()]);
            next = find_runs(&self.open[row], walls, starts, elements, next);
        }
        self.sets.grow(next);
        Ok(())
    }

    /// Unites the runs of a plane with their neighbours in it and in the plane before.
    fn link_plane(&mut self, z: usize, walls_x: &[u64], walls_y: &[u64]) -> Result<(), ResolveError> {
        let (words, plane, row) = (self.words_of(z), self.raster.plane(), self.raster.words);
        let mut sets = std::mem::replace(&mut self.sets, Sets::new(0));
        let mut unite = |a, b| sets.unite(a, b);
        for (at, walls) in walls_x.chunks(row).enumerate() {
            let first = words.start + at * row;
            link_row(self.layer(first..first + row), walls, &mut unite)
                .map_err(|(word, bit)| self.raster.contradiction(z, at * row + word, bit))?;
        }
        let [before, after] = [words.start..words.end - row, words.start + row..words.end];
        link(self.layer(before), self.layer(after), &walls_y[row..], &mut unite)
            .map_err(|(word, bit)| self.raster.contradiction(z, word + row, bit))?;
        if z > self.planes.start {
            let before = self.layer(words.start - plane..words.start);
            link(before, self.layer(words.clone()), &self.walls_z[words], &mut unite)
                .map_err(|(word, bit)| self.raster.contradiction(z, word, bit))?;
        }
        self.sets = sets;
        Ok(())
    }

    /// Numbers the sets, and keeps the data that other slabs need.
    fn finish(mut self) -> SlabSets {
        let (sets, least) = std::mem::replace(&mut self.sets, Sets::new(0)).number();
        let whole = self.layer(0..self.open.len());
        let set_nodes = least
            .into_iter()
            .map(|element| {
                let (word, bit) = whole.start_of(element);
                self.raster.node(self.planes.start, word, bit)
            })
            .collect();
        let gap_count = (self.node_gaps.len() + self.gaps.iter().map(|gaps| gaps.thin.len()).sum::<usize>()) as u64;
        let mut of_sets: [SlabGaps; 3] = Default::default();
        for &NodeGap { axis, hit, word, bit } in &self.node_gaps {
            match sets[whole.element(word as usize, bit) as usize] {
                OUT => {}
                IN => of_sets[axis].inside.push(hit),
                set => of_sets[axis].open.push((hit, set)),
            }
        }
        for (gaps, of_sets) in self.gaps.iter_mut().zip(of_sets) {
            (gaps.inside, gaps.open) = (of_sets.inside, of_sets.open);
        }
        SlabSets {
            set_nodes,
            first: self.border(self.planes.start, &sets),
            last: self.border(self.planes.end - 1, &sets),
            gap_count,
            open_nodes: self.open.iter().map(|word| u64::from(word.count_ones())).sum(),
            gaps: self.gaps,
        }
    }

    fn border(&self, z: usize, sets: &[u32]) -> Border {
        let words = self.words_of(z);
        let elements = self.elements[words.clone()].to_vec();
        let end = self.elements.get(words.end).map_or(sets.len(), |&before| before as usize + 1);
        Border {
            plane: z,
            walls: self.walls_z[words.clone()].to_vec(),
            open: self.open[words.clone()].to_vec(),
            inside: self.inside[words.clone()].to_vec(),
            starts: self.starts[words].to_vec(),
            sets: sets[elements[0] as usize + 1..end].to_vec(),
            elements,
        }
    }
}
