//! Leaves: blocks of cells in which the surface is one nearly flat sheet, with one vertex for all of them.
//!
//! Blocks are halved from the largest down, as in an octree, until a block is a leaf or a single cell. One is a leaf if
//! - **the surface is flat in it**: the planes of all its crossings are within the bound of one point, where they have it in
//!   common or nearest to their mean (`qef`), and their normals within 15° of the mean normal; and in the cells around it in
//!   its slab there is neither a sharp edge nor another sheet;
//! - **the surface is a disc in it**, and stays a manifold where cells of different size meet: at most one arc on each face of
//!   the block, no closed line, and at most one crossing on each of its twelve sides (the manifold criterion of Schaefer, Ju &
//!   Warren, Manifold Dual Contouring, 2007). The disc is known by its Euler characteristic, from the signs of nodes alone:
//!   cells that the surface passes less faces plus edges that it crosses in the interior.
//!
//! A quadrilateral whose cells belong to three different leaves or vertices of cells is a triangle, and to fewer, nothing. So
//! the mesh has vertices where the surface bends, and its manifold follows from that of single cells.

use std::ops::Range;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::cells::{MARGIN, grid_bounds};
use super::edges::EdgeSlab;
use super::qef::{Bounds, least_direction, minimum};
use crate::bits::{self, Ones, lowest};
use crate::cancel::checkpoint;
use crate::grid::Grid;

/// Longest side of a block, in cells.
pub const LARGEST: i32 = 32;

/// Least side of the largest blocks of a slab.
const LEAST_ROOT: i32 = 8;

/// The cosine of the angle to their mean, 15°, of the normals in a leaf.
const FLAT: f64 = 0.966;

/// The cosine of the angle to that mean, 25°, of the normals around a leaf.
const BENT: f64 = 0.906;

/// Share of the largest eigenvalue of the normals' moments below which a direction is undetermined: normals are within a third of
/// a degree.
const LEAST_SPREAD: f64 = 1e-5;

/// That share for the mean plane.
const ONE_PLANE: f64 = 0.5;

/// Greatest distance of the surface around a leaf from its plane, in pitches.
const LEVEL: f64 = 1.0;

/// The entry of a block that is no leaf, nor has any.
const NO_LEAF: u32 = u32::MAX;

/// Marks the entry of a leaf.
const IS_LEAF: u32 = 1 << 31;

/// A leaf: its cells, and its vertex.
#[derive(Clone, Copy, Debug)]
pub struct Leaf {
    /// The lowest cell.
    pub origin: [i32; 3],
    /// Cells along a side.
    pub size: i32,
    /// The vertex, in coordinates of cells.
    pub place: DVec3,
    /// The mean normal, outwards.
    pub facing: Vec3,
}

impl Leaf {
    /// Returns the box that the vertex is held in.
    pub fn bounds(&self, grid: &Grid) -> Bounds {
        let origin = DVec3::from_array(self.origin.map(f64::from));
        let of_grid = grid_bounds(grid, DVec3::ZERO);
        let (least, greatest) = (origin + MARGIN, origin + (f64::from(self.size) - MARGIN));
        Bounds { least: least.max(of_grid.least), greatest: greatest.min(of_grid.greatest) }
    }
}

/// The entries of the blocks under one of the largest.
#[derive(Debug)]
struct Tree {
    root: u32,
    halves: Vec<[u32; 8]>,
    /// The number of its first leaf.
    first: u32,
}

/// The leaves of a slab.
#[derive(Debug, Default)]
pub struct Leaves {
    layers: Range<i32>,
    /// Cells along the side of a largest block.
    size: i32,
    /// Largest blocks along x and y.
    blocks: [usize; 2],
    trees: Vec<Tree>,
    /// The vertex of the first leaf.
    first: u32,
    pub all: Vec<Leaf>,
}

impl Leaves {
    /// Finds the leaves of a slab, whose vertices are numbered from `first`. The surface may be `bound` pitches from its
    /// crossings. All blocks begin at a multiple of their size from the first layer. Low slabs, those of large rasters, have
    /// none: the blocks would outnumber what they save.
    pub fn find(slab: &EdgeSlab, grid: &Grid, barred: &Barred, bound: f64, first: u32) -> Leaves {
        let layers = slab.layers();
        let height = layers.len() as i32;
        let size = LARGEST.min(1 << height.ilog2());
        if size < LEAST_ROOT {
            return Leaves::default();
        }
        let cells = [(64 * slab.nodes.words()) as i32, slab.nodes.rows() as i32 - 1];
        let blocks = cells.map(|cells| (cells as usize).div_ceil(size as usize));
        let finder = Finder { slab, grid, barred, bound, rows: cells[1] };
        let count = blocks[0] * blocks[1] * (height as usize).div_ceil(size as usize);
        let of_block = |block: usize| {
            checkpoint();
            let place = [block % blocks[0], block / blocks[0] % blocks[1], block / (blocks[0] * blocks[1])];
            let mut origin = place.map(|i| i as i32 * size);
            origin[2] += layers.start;
            let (mut tree, mut found) = (Tree { root: NO_LEAF, halves: Vec::new(), first: 0 }, Vec::new());
            tree.root = finder.settle(origin, size, &mut tree.halves, &mut found, &mut Scratch::default());
            (tree, found)
        };
        let found: Vec<(Tree, Vec<Leaf>)> = (0..count).into_par_iter().map(of_block).collect();
        let mut leaves = Leaves { layers, size, blocks, trees: Vec::with_capacity(count), first, all: Vec::new() };
        for (tree, of_tree) in found {
            leaves.trees.push(Tree { first: leaves.all.len() as u32, ..tree });
            leaves.all.extend(of_tree);
        }
        leaves
    }

    /// Forgets the cells of the leaves.
    pub fn forget_cells(&mut self) {
        (self.layers, self.trees) = (0..0, Vec::new());
    }

    /// Returns the vertices of the leaves.
    pub fn vertices(&self) -> Range<u32> {
        self.first..self.first + self.all.len() as u32
    }

    /// Returns the vertex of the leaf that a cell belongs to.
    pub fn of_cell(&self, [x, y, z]: [i32; 3]) -> Option<u32> {
        if self.all.is_empty() || x < 0 || y < 0 || !self.layers.contains(&z) {
            return None;
        }
        let place = [x, y, z - self.layers.start];
        let [column, row, plane] = place.map(|i| (i / self.size) as usize);
        if column >= self.blocks[0] || row >= self.blocks[1] {
            return None;
        }
        let tree = &self.trees[(plane * self.blocks[1] + row) * self.blocks[0] + column];
        let (mut entry, mut half) = (tree.root, self.size / 2);
        while entry & IS_LEAF == 0 {
            let octant = (0..3).fold(0, |octant, i| octant | usize::from(place[i] & half != 0) << i);
            entry = tree.halves[entry as usize][octant];
            half /= 2;
        }
        (entry != NO_LEAF).then(|| self.first + tree.first + (entry & !IS_LEAF))
    }

    /// Returns whether a leaf is beside a cell or around it.
    pub fn touch(&self, [x, y, z]: [i32; 3]) -> bool {
        let near = |c: i32| c - 1..=c + 1;
        near(z).any(|z| near(y).any(|y| near(x).any(|x| self.of_cell([x, y, z]).is_some())))
    }
}

/// Cells that no leaf may hold or touch, in the layers of a slab.
#[derive(Debug)]
pub struct Barred {
    layers: Range<i32>,
    rows: usize,
    words: usize,
    /// Empty while there is none.
    bits: Vec<u64>,
}

impl Barred {
    pub fn new(slab: &EdgeSlab) -> Barred {
        Barred { layers: slab.layers(), rows: slab.nodes.rows(), words: slab.nodes.words(), bits: Vec::new() }
    }

    /// Bars a cell of the slab; one directly below it or above bars that of the slab next to it.
    pub fn add(&mut self, [x, y, z]: [i32; 3]) {
        let end = self.layers.end;
        let in_plane = (0..64 * self.words as i32).contains(&x) && (0..self.rows as i32).contains(&y);
        if !in_plane || !(self.layers.start - 1..=end).contains(&z) {
            return;
        }
        if self.bits.is_empty() {
            self.bits = vec![0; self.layers.len() * self.rows * self.words];
        }
        let layer = z.clamp(self.layers.start, end - 1) - self.layers.start;
        let row = (layer as usize * self.rows + y as usize) * self.words;
        self.bits[row + x as usize / 64] |= 1 << (x % 64);
    }

    /// Returns whether any cell from the lowest up to the greatest is barred.
    fn any(&self, low: [i32; 3], high: [i32; 3]) -> bool {
        let rows = || (low[2]..high[2]).flat_map(|z| (low[1]..high[1].min(self.rows as i32)).map(move |y| (y, z)));
        let count = (high[0] - low[0]) as u32;
        !self.bits.is_empty()
            && rows().any(|(y, z)| {
                let row = ((z - self.layers.start) as usize * self.rows + y as usize) * self.words;
                bits::from(&self.bits[row..row + self.words], low[0] as usize, count) != 0
            })
    }
}

/// A crossing near a block, relative to the block's lowest node.
struct Near {
    point: DVec3,
    normal: DVec3,
    /// True in the block or on its boundary.
    is_of_block: bool,
}

/// The crossings and the nodes in and around a block.
#[derive(Default)]
struct Scratch {
    near: Vec<Near>,
    rows: Vec<u64>,
}

/// The search for leaves.
struct Finder<'a> {
    slab: &'a EdgeSlab,
    grid: &'a Grid,
    barred: &'a Barred,
    bound: f64,
    /// The number of rows of cells.
    rows: i32,
}

impl Finder<'_> {
    /// Returns the entry of a block, and appends its leaves.
    fn settle(
        &self,
        origin: [i32; 3],
        size: i32,
        halves: &mut Vec<[u32; 8]>,
        found: &mut Vec<Leaf>,
        scratch: &mut Scratch,
    ) -> u32 {
        let [_, y, z] = origin;
        if z >= self.slab.layers().end || y >= self.rows || !self.is_passed(origin, size) {
            return NO_LEAF;
        }
        if z + size <= self.slab.layers().end
            && let Some(leaf) = self.leaf(origin, size, scratch)
        {
            found.push(leaf);
            return IS_LEAF | (found.len() - 1) as u32;
        }
        if size == 2 {
            return NO_LEAF;
        }
        let half = size / 2;
        let mut entries = [NO_LEAF; 8];
        for (octant, entry) in entries.iter_mut().enumerate() {
            let corner = [0, 1, 2].map(|i| origin[i] + half * (octant >> i & 1) as i32);
            *entry = self.settle(corner, half, halves, found, scratch);
        }
        if entries == [NO_LEAF; 8] {
            return NO_LEAF;
        }
        halves.push(entries);
        (halves.len() - 1) as u32
    }

    /// Returns whether the nodes of a block differ.
    fn is_passed(&self, [x, y, z]: [i32; 3], size: i32) -> bool {
        let last_plane = self.slab.layers().end;
        let row = |y: i32, z: i32| self.nodes(x, y, z, size as u32 + 1);
        let first = row(y, z);
        (first != 0 && first != lowest(size as u32 + 1))
            || (z..=(z + size).min(last_plane)).any(|z| (y..=y + size).any(|y| row(y, z) != first))
    }

    /// Returns the nodes of a row from one of them on; those beyond the rows are outside.
    fn nodes(&self, x: i32, y: i32, z: i32, count: u32) -> u64 {
        if y > self.rows { 0 } else { bits::from(self.slab.nodes.row(y as usize, z), x as usize, count) }
    }

    /// Returns the leaf of a block, if the surface is flat in it and a disc.
    fn leaf(&self, origin: [i32; 3], size: i32, scratch: &mut Scratch) -> Option<Leaf> {
        let layers = self.slab.layers();
        // The nodes of the cells in the block and around it.
        let low = [(origin[0] - 1).max(0), (origin[1] - 1).max(0), (origin[2] - 1).max(layers.start)];
        let end = origin.map(|i| i + size + 1);
        let high = [end[0], end[1], end[2].min(layers.end)];
        if self.barred.any(low, high) {
            return None;
        }
        let [columns, rows, planes] = [0, 1, 2].map(|i| (high[i] - low[i] + 1) as usize);
        let Scratch { near, rows: bits } = scratch;
        bits.clear();
        for z in low[2]..=high[2] {
            let row = |y: i32| self.nodes(low[0], y, z, columns as u32);
            bits.extend((low[1]..=high[1]).map(row));
        }
        let node = |y: usize, z: usize| bits[z * rows + y];
        let directions = self.gather(origin, size, (low, [columns, rows, planes]), node, near)?;
        let fit = fit(near, self.bound)?;
        // The crossings along the axis that the surface faces most all lead out of the solid, or all into it.
        let axis = fit.facing.abs().max_position();
        let facing = match directions[axis] {
            [_, 0] => fit.facing * fit.facing[axis].signum(),
            [0, _] => fit.facing * -fit.facing[axis].signum(),
            _ => return None,
        };
        if !is_plain(node, columns, rows, planes) {
            return None;
        }
        let [dx, dy, dz] = [0, 1, 2].map(|i| (origin[i] - low[i]) as usize);
        let of_block = |y: usize, z: usize| node(y + dy, z + dz) >> dx & lowest(size as u32 + 1);
        if !is_disc(of_block, size as usize) {
            return None;
        }
        let base = DVec3::from_array(origin.map(f64::from));
        let leaf = Leaf { origin, size, place: base + fit.place, facing: facing.as_vec3() };
        let place = leaf.bounds(self.grid).hold(leaf.place);
        let holds = |near: &Near| near.is_within(place - base, fit.facing, self.bound);
        near.iter().all(holds).then_some(Leaf { place, ..leaf })
    }

    /// Collects the crossings between some nodes, and counts those along each axis that leave and that enter the solid.
    /// `None` where their normals differ too much.
    fn gather(
        &self,
        origin: [i32; 3],
        size: i32,
        (low, [columns, rows, planes]): ([i32; 3], [usize; 3]),
        node: impl Fn(usize, usize) -> u64,
        near: &mut Vec<Near>,
    ) -> Option<[[u32; 2]; 3]> {
        near.clear();
        let mut directions = [[0; 2]; 3];
        let mut first: Option<DVec3> = None;
        let of_block = |value: i32, axis: usize| (0..=size).contains(&(value - origin[axis]));
        for z in 0..planes {
            for y in 0..rows {
                let row = node(y, z);
                let crossed = [
                    (row ^ row >> 1) & lowest(columns as u32 - 1),
                    if y + 1 < rows { row ^ node(y + 1, z) } else { 0 },
                    if z + 1 < planes { row ^ node(y, z + 1) } else { 0 },
                ];
                for (axis, crossed) in crossed.into_iter().enumerate() {
                    for bit in Ones(crossed) {
                        let lower = [low[0] + bit as i32, low[1] + y as i32, low[2] + z as i32];
                        let crossing = self.slab.crossing(axis, lower);
                        let normal = DVec3::from_array(crossing.normal.map(f64::from));
                        let like = *first.get_or_insert(normal);
                        // Two normals are at most 50° apart, or all are unknown.
                        if normal.dot(like) < 0.64 * like.length_squared() || (like == DVec3::ZERO && normal != like) {
                            return None;
                        }
                        let mut upper = lower;
                        upper[axis] += 1;
                        let mut point = DVec3::from_array([0, 1, 2].map(|i| f64::from(lower[i] - origin[i])));
                        point[axis] += f64::from(crossing.at);
                        let is_of_block = (0..3).all(|i| of_block(lower[i], i) && of_block(upper[i], i));
                        near.push(Near { point, normal, is_of_block });
                        directions[axis][usize::from(row >> bit & 1 == 0)] += 1;
                    }
                }
            }
        }
        Some(directions)
    }
}

impl Near {
    /// Returns whether the crossing allows a vertex on a plane.
    fn is_within(&self, place: DVec3, facing: DVec3, bound: f64) -> bool {
        let away = place - self.point;
        let (height, is_known) = (facing.dot(away).abs(), self.normal != DVec3::ZERO);
        match (self.is_of_block, is_known) {
            (true, true) => self.normal.dot(away).abs() <= bound && self.normal.dot(facing) >= FLAT,
            (true, false) => height <= bound,
            (false, _) => height <= LEVEL && (!is_known || self.normal.dot(facing) >= BENT),
        }
    }
}

/// A vertex and the mean normal, of either sign where no normal is known.
struct Fit {
    place: DVec3,
    facing: DVec3,
}

/// Returns the vertex that fits the crossings of a block: on the planes of all where they have a point in common, as at an
/// edge of a few degrees, or on their mean plane.
fn fit(near: &[Near], bound: f64) -> Option<Fit> {
    let of_block = || near.iter().filter(|near| near.is_of_block);
    let count = of_block().count() as f64;
    let mean = of_block().map(|near| near.point).sum::<DVec3>() / count;
    let sum: DVec3 = of_block().map(|near| near.normal).sum();
    let fits = |fit: &Fit| near.iter().all(|near| near.is_within(fit.place, fit.facing, bound));
    if sum == DVec3::ZERO {
        let facing = least_direction(of_block().map(|near| near.point - mean));
        return Some(Fit { place: mean, facing }).filter(fits);
    }
    let facing = sum.normalize();
    let planes = of_block().map(|near| (near.normal, near.normal.dot(near.point - mean)));
    [LEAST_SPREAD, ONE_PLANE].into_iter().find_map(|least| {
        let (place, ..) = minimum(planes.clone(), least);
        let place = mean + place;
        Some(Fit { place, facing }).filter(fits)
    })
}

/// Returns whether each cell between some nodes has at most one loop, whichever faces are joined.
fn is_plain(node: impl Fn(usize, usize) -> u64, columns: usize, rows: usize, planes: usize) -> bool {
    let cells = lowest(columns as u32 - 1);
    let is_diagonal = |a: u64, b: u64, c: u64, d: u64| !(a ^ c) & !(b ^ d) & (a ^ b);
    let plain = |y: usize, z: usize| {
        let at = |y: usize, z: usize| if y < rows && z < planes { node(y, z) } else { 0 };
        let corners = [at(y, z), at(y + 1, z), at(y, z + 1), at(y + 1, z + 1)];
        let [a, b, c, d] = corners;
        let upper = corners.map(|row| row >> 1);
        let (is_row, is_plane) = (y + 1 < rows, z + 1 < planes);
        let mut bad = 0;
        if is_row {
            bad |= is_diagonal(a, b, upper[1], upper[0]) & cells;
        }
        if is_plane {
            bad |= is_diagonal(a, c, upper[2], upper[0]) & cells;
        }
        if is_row && is_plane {
            bad |= is_diagonal(a, b, d, c) & lowest(columns as u32);
            // Two opposite corners of a cell, and no others.
            let all = [a, b, c, d, upper[0], upper[1], upper[2], upper[3]];
            for (i, j) in [(0, 7), (1, 6), (2, 5), (3, 4)] {
                let others = || (0..8).filter(|&k| k != i && k != j).map(|k| all[k]);
                let any = others().fold(0, |any, row| any | row);
                let every = others().fold(u64::MAX, |every, row| every & row);
                bad |= ((all[i] & all[j] & !any) | (!(all[i] | all[j]) & every)) & cells;
            }
        }
        bad == 0
    };
    (0..planes).all(|z| (0..rows).all(|y| plain(y, z)))
}

/// Returns whether the surface between the nodes of a block, `size` cells along a side, is a disc that meets each face in one
/// arc at most and each side in one point at most. Its cells have one loop each, and it has no part without boundary.
fn is_disc(node: impl Fn(usize, usize) -> u64, size: usize) -> bool {
    let cells = lowest(size as u32);
    // Without the first node and the last.
    let interior = cells & !1;
    let ends = [0, size];
    let is_end = |i: usize| i == 0 || i == size;
    let count = |bits: u64| i64::from(bits.count_ones());
    let mut characteristic = 0;
    // For each face of the block the cells less the edges that the surface passes on it, and whether it passes any.
    let mut arcs = [[0i64; 2]; 3];
    let mut passes = [[false; 2]; 3];
    // Whether edges on a face, along the axis after the face's and the one before it, lead out of the solid and into it.
    let mut leads = [[[[false; 2]; 2]; 2]; 3];
    // The crossings of the sides: along z by their positions in x and y, and so on.
    let mut sides = [[[0i64; 2]; 2]; 3];
    for z in 0..=size {
        for y in 0..=size {
            let row = node(y, z);
            let next = if y < size { node(y + 1, z) } else { row };
            let above = if z < size { node(y, z + 1) } else { row };
            let beyond = if y < size && z < size { node(y + 1, z + 1) } else { row };
            let [along_x, along_y, along_z] = [(row ^ row >> 1) & cells, row ^ next, row ^ above];
            let passed = |one: u64, other: u64| {
                let (any, all) = (one | other, one & other);
                (any | any >> 1) & !(all & all >> 1) & cells
            };
            // Cells and faces; those across z lie between y and y + 1, those across y between z and z + 1.
            let across_z = if y < size { passed(row, next) } else { 0 };
            let across_y = if z < size { passed(row, above) } else { 0 };
            if y < size && z < size {
                let (any, all) = (row | next | above | beyond, row & next & above & beyond);
                characteristic += count((any | any >> 1) & !(all & all >> 1) & cells);
                let across_x = any & !all;
                characteristic -= count(across_x & interior);
                for side in 0..2 {
                    arcs[0][side] += i64::from(across_x >> ends[side] & 1 == 1);
                    passes[0][side] |= across_x >> ends[side] & 1 == 1;
                }
            }
            match ends.iter().position(|&end| end == z) {
                Some(side) => {
                    arcs[2][side] += count(across_z);
                    passes[2][side] |= across_z != 0;
                }
                None => characteristic -= count(across_z),
            }
            match ends.iter().position(|&end| end == y) {
                Some(side) => {
                    arcs[1][side] += count(across_y);
                    passes[1][side] |= across_y != 0;
                }
                None => characteristic -= count(across_y),
            }
            // Edges: in the interior, on a face, or on a side of the block.
            let side_of = |i: usize| usize::from(i == size);
            let mut lead = |face: usize, side: usize, axis: usize, crossed: u64| {
                let of_axis = &mut leads[face][side][usize::from(axis == (face + 2) % 3)];
                of_axis[0] |= crossed & row != 0;
                of_axis[1] |= crossed & !row != 0;
            };
            if is_end(y) && !is_end(z) {
                lead(1, side_of(y), 0, along_x);
            }
            if is_end(z) && !is_end(y) {
                lead(2, side_of(z), 0, along_x);
            }
            for (axis, crossed, at) in [(1, along_y, z), (2, along_z, y)] {
                if is_end(at) {
                    lead(3 - axis, side_of(at), axis, crossed & interior);
                } else {
                    ends.iter().enumerate().for_each(|(x, &end)| lead(0, x, axis, crossed & 1 << end));
                }
            }
            match (is_end(y), is_end(z)) {
                (false, false) => characteristic += count(along_x),
                (true, false) => arcs[1][side_of(y)] -= count(along_x),
                (false, true) => arcs[2][side_of(z)] -= count(along_x),
                (true, true) => sides[0][side_of(y)][side_of(z)] += count(along_x),
            }
            for (axis, crossed, at) in [(1, along_y, z), (2, along_z, y)] {
                // The other axis that the face or side is known by.
                let other = 3 - axis;
                let inner = count(crossed & interior);
                if is_end(at) {
                    arcs[other][side_of(at)] -= inner;
                } else {
                    characteristic += inner;
                }
                for (x, &end) in ends.iter().enumerate() {
                    let is_crossed = i64::from(crossed >> end & 1 == 1);
                    if is_end(at) {
                        sides[axis][x][side_of(at)] += is_crossed;
                    } else {
                        arcs[0][x] -= is_crossed;
                    }
                }
            }
        }
    }
    let crossed: i64 = sides.iter().flatten().flatten().sum();
    let arcs_fit = (0..3).all(|axis| (0..2).all(|side| arcs[axis][side] == i64::from(passes[axis][side])));
    // A closed line on a face has edges of both directions along both axes.
    let is_closed = leads.iter().flatten().any(|axes| *axes == [[true; 2]; 2]);
    characteristic == 1
        && crossed >= 3
        && arcs_fit
        && !is_closed
        && sides.iter().flatten().flatten().all(|&count| count <= 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns whether the surface between nodes that are inside below a height is a disc, for each position in x and y.
    fn is_disc_below(size: usize, height: impl Fn(usize, usize) -> usize) -> bool {
        let node = |y: usize, z: usize| (0..=size).fold(0, |row, x| row | u64::from(z < height(x, y)) << x);
        is_disc(node, size)
    }

    #[test]
    fn planes_are_discs_and_other_surfaces_are_not() {
        for size in [2, 4, 8, 32] {
            assert!(is_disc_below(size, |_, _| size / 2));
            assert!(is_disc_below(size, |x, y| (x + y).min(size)));
            // A corner is cut off; then two.
            let corner = |x: usize, y: usize| usize::from(x + y == 0);
            assert!(is_disc_below(size, corner));
            assert!(!is_disc_below(size, |x, y| usize::from(x + y == 0 || x + y == 2 * size)));
            // A bump on a face, and two sheets.
            assert!(!is_disc_below(size, |x, y| usize::from((x, y) == (size / 2, size / 2))));
            assert!(!is_disc(|_, z| if z == 1 { lowest(size as u32 + 1) } else { 0 }, size));
        }
    }

    #[test]
    fn a_sheet_with_a_hole_and_an_island_is_no_disc() {
        // Its Euler characteristic is 1, and its open arcs are those of a disc.
        let height = |x: usize, y: usize| match (x, y) {
            (2, 4) => 0,
            (7, 4) => 1,
            _ => usize::from(x <= 4),
        };
        assert!(is_disc_below(8, |x, _| usize::from(x <= 4)));
        assert!(!is_disc_below(8, height));
    }
}
