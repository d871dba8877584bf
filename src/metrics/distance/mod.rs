//! The distance of every node from the surface, and the nearest point of the surface.
//!
//! A transform of voxels measures to the centres of voxels of the other phase, half a pitch off or more. Here distances are
//! measured to [`Crossings`]: the points where rows of nodes along x, y and z cross the surface, accurate to a millionth of a
//! pitch. Of this point cloud a [`DistanceField`] holds, for each node, the nearest point (its *site*) and the distance to it,
//! exactly. The distance is unsigned and serves solid and pores alike; sets of nodes define the phase of each node.
//!
//! The cloud lies on the surface, so the field is never less than the true distance d. If the foot of the node on the surface
//! is δ away from the nearest crossing, it is more by at most √(d² + δ²) − d ≤ δ²/2d where the surface is flat (δ ≤ 0.71 there,
//! where the row nearest to the foot passes through the surface), and by less where the surface bends towards the node.
//!
//! # Method
//! The distance to a cloud that lies on rows along one axis is separable: first the nearest crossing on each row, for each of
//! its nodes, then across the rows, along one axis and then along the other, the minimum of squares plus squared offsets, whose
//! lower envelope of parabolas is found in linear time (Felzenszwalb & Huttenlocher 2012; Meijster, Roerdink & Hesselink 2000;
//! the test without divisions is that of Maurer, Qi & Raghavan 2003). Each envelope carries the index of its crossing. The
//! clouds of the x and the y image both have their last step along z, so that they share it: five envelopes rather than six.
//! Steps within planes are done plane by plane, in cache; the step along z is done for blocks of neighbouring columns. Lines
//! along x are lowered at neighbouring places at once, others side by side (`lines`), so that nothing is transposed; a plane
//! sweeps along all rows along y, or z, together and keeps the crossings on either side of it (`rows`).

mod crossings;
mod envelope;
mod lines;
mod rows;
mod site;

use std::ops::Range;

use crate::parallel::*;

pub use crossings::Crossings;
use lines::{LANES, Lines, copy};
use rows::{NodeRows, Sweep};
use site::{Site, lesser};

use super::{BoundaryCondition, NodeSet};
use crate::allocation::zeroed;
use crate::cancel::checkpoint;
use crate::grid::Axis;

/// Tasks of neighbouring planes for each thread, and the fewest planes of one.
const SLABS: usize = 8;
const PLANES: usize = 4;

/// Sites from here on are the walls of a box: those across x, y, z, at its lower corner, then at its upper one.
const WALLS: u32 = u32::MAX - 6;

/// Returns the [values](DistanceField::values) of a [`DistanceField`] without its sites, in about two thirds of the time. Needs 4
/// bytes per node.
///
/// # Panics
/// If there are 2³² − 7 crossings or more.
pub fn distances(crossings: &Crossings, edges: BoundaryCondition) -> Vec<f32> {
    let (mut values, mut sites) = Transform::of(crossings, edges).run::<()>();
    if let Some(walls) = crossings.walls() {
        meet_walls(crossings.size(), walls, &mut values, &mut sites);
    }
    values
}

/// For each node the distance to the nearest crossing of the surface, and that crossing: its site.
#[derive(Clone, Debug)]
pub struct DistanceField {
    size: [usize; 3],
    edges: BoundaryCondition,
    values: Vec<f32>,
    sites: Vec<u32>,
    crossings: Vec<Crossing>,
    /// The first crossing of the rows along y, and of those along z.
    firsts: [u32; 2],
    walls: [[f32; 3]; 2],
}

/// A crossing of a row with the surface; its index determines the axis of the row.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    place: f32,
    column: u16,
    row: u16,
}

impl DistanceField {
    /// Computes the distances of all nodes. With [`BoundaryCondition::Periodic`] the raster repeats. Where there is no crossing
    /// at all, distances are infinite. Needs 8 bytes per node and 8 per crossing.
    ///
    /// # Panics
    /// If there are 2³² − 7 crossings or more.
    pub fn of(crossings: &Crossings, edges: BoundaryCondition) -> DistanceField {
        let transform = Transform::of(crossings, edges);
        let (values, sites) = transform.run();
        let Transform { size, firsts, .. } = transform;
        let (listed, walls) = (listed(crossings), Default::default());
        let mut field = DistanceField { size, edges, values, sites, crossings: listed, firsts, walls };
        if let Some(walls) = crossings.walls() {
            field.meet_walls(walls);
        }
        field
    }

    /// Makes the faces of a box walls, given as its lower and upper corner in pitches. They need no transform: the field of
    /// [`BoundaryCondition::Clip`] becomes that of [`BoundaryCondition::Border`].
    ///
    /// # Panics
    /// If the field repeats, or has walls.
    pub fn between(mut self, walls: [[f32; 3]; 2]) -> DistanceField {
        assert!(self.edges == BoundaryCondition::Clip, "walls are added once, to a field that does not repeat");
        self.edges = BoundaryCondition::Border;
        self.meet_walls(walls);
        self
    }

    /// Returns the nodes that are nearer to a wall of the box than to a crossing.
    pub(super) fn beside_walls(&self) -> NodeSet {
        let [columns, rows, _] = self.size;
        NodeSet::from_fn(self.size, |[x, y, z]| (WALLS..u32::MAX).contains(&self.sites[(z * rows + y) * columns + x]))
    }

    /// Returns the number of nodes along x, y and z.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Returns the boundary condition that the field was computed with.
    pub fn edges(&self) -> BoundaryCondition {
        self.edges
    }

    /// Returns the distances in pitches, of node (x, y, z) at `(z · size[1] + y) · size[0] + x`.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Returns the distances, and drops the sites.
    pub fn into_values(self) -> Vec<f32> {
        self.values
    }

    /// Returns the point of the surface nearest to a node, in pitches; `None` where there is none. With
    /// [`BoundaryCondition::Periodic`] it is the nearest of its repetitions, which may lie outside of the raster.
    pub fn site(&self, index: usize) -> Option<[f32; 3]> {
        let [columns, rows, _] = self.size;
        self.site_of([index % columns, index / columns % rows, index / columns / rows])
    }

    /// Returns a number that only nodes with one and the same site share; `None` where sites repeat or the site is a wall's.
    #[inline]
    pub(super) fn site_number(&self, index: usize) -> Option<u32> {
        let site = self.sites[index];
        (site < WALLS && self.edges != BoundaryCondition::Periodic).then_some(site)
    }

    /// Returns the [`site`](Self::site) of the node at a position.
    #[inline]
    pub(super) fn site_of(&self, node @ [x, y, z]: [usize; 3]) -> Option<[f32; 3]> {
        let site = self.sites[(z * self.size[1] + y) * self.size[0] + x];
        if site >= WALLS {
            return (site < u32::MAX).then(|| {
                let mut place = node.map(|i| i as f32);
                let wall = (site - WALLS) as usize;
                place[wall % 3] = self.walls[wall / 3][wall % 3];
                place
            });
        }
        let Crossing { place, column, row } = self.crossings[site as usize];
        let (column, row) = (f32::from(column), f32::from(row));
        let mut site = match (site < self.firsts[0], site < self.firsts[1]) {
            (true, _) => [place, column, row],
            (_, true) => [column, place, row],
            _ => [column, row, place],
        };
        if self.edges == BoundaryCondition::Periodic {
            for axis in 0..3 {
                let (period, from) = (self.size[axis] as f32, node[axis] as f32);
                site[axis] -= period * ((site[axis] - from) / period).round();
            }
        }
        Some(site)
    }

    /// Applies walls.
    fn meet_walls(&mut self, walls: [[f32; 3]; 2]) {
        self.walls = walls;
        meet_walls(self.size, walls, &mut self.values, &mut self.sites);
    }
}

/// Applies walls to the distances of nodes.
fn meet_walls<S: Site>([columns, rows, _]: [usize; 3], walls: [[f32; 3]; 2], values: &mut [f32], sites: &mut [S]) {
    let planes = values.par_chunks_mut(columns * rows).zip(sites.par_chunks_mut(columns * rows));
    planes.enumerate().for_each(|(z, (values, sites))| {
        for (i, (value, site)) in values.iter_mut().zip(sites).enumerate() {
            let node = [i % columns, i / columns, z];
            for wall in 0..6 {
                let distance = (node[wall % 3] as f32 - walls[wall / 3][wall % 3]).abs();
                if distance < *value {
                    (*value, *site) = (distance, S::numbered(WALLS + wall as u32));
                }
            }
        }
    });
}

/// Lists all crossings: those of the rows along x, then y, then z.
fn listed(crossings: &Crossings) -> Vec<Crossing> {
    let size = crossings.size();
    let mut all = Vec::with_capacity(Axis::ALL.map(|axis| crossings.count(axis)).iter().sum());
    for axis in Axis::ALL {
        let columns = size[axis.column()];
        let of_line = |line: usize| {
            let (column, row) = ((line % columns) as u16, (line / columns) as u16);
            crossings.row(axis, line).iter().map(move |&place| Crossing { place, column, row })
        };
        let lines = (0..columns * size[axis.row()]).into_par_iter().with_min_len(1 << 10);
        all.par_extend(lines.flat_map_iter(of_line));
    }
    all
}

/// The input of the transform.
#[derive(Clone, Copy)]
struct Transform<'a> {
    crossings: &'a Crossings,
    size: [usize; 3],
    repeats: bool,
    firsts: [u32; 2],
}

/// The buffers of a task: a row along x, and the rows of a plane across z, side by side in blocks.
struct Scratch<'a, S> {
    sweep: Sweep<'a>,
    row: Lines<S>,
    blocks: Vec<Lines<S>>,
}

impl<'a> Transform<'a> {
    fn of(crossings: &'a Crossings, edges: BoundaryCondition) -> Transform<'a> {
        let counts = Axis::ALL.map(|axis| crossings.count(axis) as u64);
        assert!(counts.iter().sum::<u64>() < u64::from(WALLS), "fewer crossings than indices of 32 bits");
        let firsts = [counts[0] as u32, (counts[0] + counts[1]) as u32];
        Transform { crossings, size: crossings.size(), repeats: edges == BoundaryCondition::Periodic, firsts }
    }

    /// Returns the distance of each node and its site.
    fn run<S: Site>(&self) -> (Vec<f32>, Vec<S>) {
        let nodes = self.size.iter().product();
        // The first step sets them.
        let (mut values, mut sites) = (zeroed(nodes), zeroed(nodes));
        if nodes > 0 {
            self.across_x_and_y(&mut values, &mut sites);
            self.along_columns(&mut values, &mut sites);
            self.across_z(&mut values, &mut sites);
        }
        (values, sites)
    }

    fn scratch<S: Site>(&self, axis: Axis) -> Scratch<'a, S> {
        let [width, height, _] = self.size;
        Scratch {
            sweep: Sweep::new(self.rows(axis)),
            row: Lines::new(width, 1, self.repeats),
            blocks: (0..width.div_ceil(LANES)).map(|_| Lines::new(height, LANES, self.repeats)).collect(),
        }
    }

    /// Returns the rows along an axis.
    fn rows(&self, axis: Axis) -> NodeRows<'a> {
        let period = self.repeats.then_some(self.size[axis.depth()] as f32);
        let number = [0, self.firsts[0], self.firsts[1]][axis.depth()];
        NodeRows { crossings: self.crossings, axis, number, period }
    }

    /// Computes, within each plane across z, the minimum of the squared distances to crossings of rows along x and along y.
    fn across_x_and_y<S: Site>(&self, values: &mut [f32], sites: &mut [S]) {
        let [width, height, _] = self.size;
        let along_x = self.rows(Axis::X);
        let planes = values.par_chunks_mut(width * height).zip(sites.par_chunks_mut(width * height)).enumerate();
        planes.for_each_init(
            || self.scratch(Axis::Y),
            |Scratch { sweep, row, blocks }, (z, (values, sites))| {
                checkpoint();
                sweep.begin(z * width..(z + 1) * width, 0);
                for y in 0..height {
                    sweep.nearest(0..width, y, row.part(0..width));
                    row.lower(1, |x, squared, nearest| {
                        let here = y * width + x..y * width + x + squared.len();
                        copy(squared, &mut values[here.clone()]);
                        copy(nearest, &mut sites[here]);
                    });
                }
                for y in 0..height {
                    let (squared, nearest) = row.part(0..width);
                    along_x.along(z * height + y, (&mut *squared, &mut *nearest));
                    let parts = squared.chunks(LANES).zip(nearest.chunks(LANES));
                    blocks.iter_mut().zip(parts).for_each(|(block, (squared, nearest))| block.set(y, squared, nearest));
                }
                lower_blocks(blocks, width, |here, squared, nearest| {
                    least(squared, nearest, &mut values[here.clone()], &mut sites[here]);
                });
            },
        );
    }

    /// Replaces the values of planes by their lower envelopes along z.
    fn along_columns<S: Site>(&self, values: &mut [f32], sites: &mut [S]) {
        let [width, height, depth] = self.size;
        let walls = rows_by_wall(values, width, height).into_par_iter().zip(rows_by_wall(sites, width, height));
        walls.for_each_init(
            || Lines::new(depth, LANES, self.repeats),
            |block, (mut values, mut sites)| {
                for first in (0..width).step_by(LANES) {
                    checkpoint();
                    let some = first..width.min(first + LANES);
                    for (z, (values, sites)) in values.iter().zip(&sites).enumerate() {
                        block.set(z, &values[some.clone()], &sites[some.clone()]);
                    }
                    block.lower(some.len(), |z, squared, nearest| {
                        copy(squared, &mut values[z][some.clone()]);
                        copy(nearest, &mut sites[z][some.clone()]);
                    });
                }
            },
        );
    }

    /// Adds the crossings of rows along z, and takes the roots.
    fn across_z<S: Site>(&self, values: &mut [f32], sites: &mut [S]) {
        let [width, height, depth] = self.size;
        let plane = width * height;
        let planes = depth.div_ceil(SLABS * rayon::current_num_threads()).max(PLANES);
        let slabs = values.par_chunks_mut(planes * plane).zip(sites.par_chunks_mut(planes * plane)).enumerate();
        slabs.for_each_init(
            || self.scratch(Axis::Z),
            |Scratch { sweep, row, blocks }, (slab, (values, sites))| {
                sweep.begin(0..plane, slab * planes);
                let each = values.chunks_mut(plane).zip(sites.chunks_mut(plane));
                for (z, (values, sites)) in (slab * planes..).zip(each) {
                    checkpoint();
                    for y in 0..height {
                        sweep.nearest(y * width..(y + 1) * width, z, row.part(0..width));
                        row.lower(1, |x, squared, nearest| blocks[x / LANES].set(y, squared, nearest));
                    }
                    lower_blocks(blocks, width, |here, squared, nearest| {
                        let values = &mut values[here.clone()];
                        least(squared, nearest, values, &mut sites[here]);
                        values.iter_mut().for_each(|value| *value = value.sqrt());
                    });
                }
            },
        );
    }
}

/// Lowers the lines along y of a plane, and passes the values in rows of it.
fn lower_blocks<S: Site>(blocks: &mut [Lines<S>], width: usize, mut put: impl FnMut(Range<usize>, &[f32], &[S])) {
    for (first, block) in (0..width).step_by(LANES).zip(blocks) {
        let lines = LANES.min(width - first);
        block.lower(lines, |y, squared, nearest| {
            put(y * width + first..y * width + first + lines, squared, nearest);
        });
    }
}

/// Returns the rows along x of each of the planes across y, in the order of z.
fn rows_by_wall<T>(array: &mut [T], width: usize, height: usize) -> Vec<Vec<&mut [T]>> {
    let mut walls: Vec<Vec<&mut [T]>> = (0..height).map(|_| Vec::new()).collect();
    for plane in array.chunks_mut(width * height) {
        plane.chunks_mut(width).zip(&mut walls).for_each(|(row, wall)| wall.push(row));
    }
    walls
}

/// Keeps the lesser of the present and the new values.
fn least<S: Site>(squared: &[f32], nearest: &[S], values: &mut [f32], sites: &mut [S]) {
    for (((&squared, &nearest), value), site) in squared.iter().zip(nearest).zip(values).zip(sites) {
        (*value, *site) = lesser((*value, *site), (squared, nearest));
    }
}

#[cfg(test)]
mod tests;
