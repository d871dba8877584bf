//! The mesh around blocks of finer cells, and the meshes of these, in one.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::DVec3;

use super::super::cells::{MARGIN, grid_bounds, world_from_cells};
use super::super::edges::Dropped;
use super::super::features::{APART, Taken, holds_node};
use super::super::manifold::Stars;
use super::super::qef::Bounds;
use super::super::simplify::{crossing, crossing_pairs};
use super::super::{Contoured, SubResolution, Surface, SurfaceError};
use super::Refined;
use crate::closest::squared_distance;
use crate::mesh::{Precision, TriangleMesh};
use crate::parallel::*;

/// The mesh around blocks with those of the blocks.
pub struct Joined {
    /// Without vertices and triangles, with the counts of all.
    coarse: Contoured,
    /// The vertices in coordinates of cells.
    cells: Vec<DVec3>,
    /// In world coordinates.
    mesh: TriangleMesh,
    /// The block of each triangle that has a vertex in one or on its border.
    block_of: Vec<Option<u32>>,
    /// The vertices of borders.
    movers: Vec<Mover>,
    /// The crossings of edges whose quadrilaterals hold any of these, and the corners.
    beside: Vec<(DVec3, [u32; 4])>,
    stars: Stars,
}

/// A vertex of a border, with the places to which it may move, in coordinates of cells.
struct Mover {
    vertex: u32,
    mean: DVec3,
    target: Option<DVec3>,
}

impl Joined {
    /// Joins the mesh around blocks to theirs.
    ///
    /// # Errors
    /// More than 32 bits count.
    pub fn of(mut coarse: Contoured, blocks: &[&Refined]) -> Result<Joined, SurfaceError> {
        let mut own: Vec<Vec<u32>> = blocks.iter().map(|one| vec![0; one.block.border.vertices.len()]).collect();
        let mut cells = std::mem::take(&mut coarse.vertices);
        let mut triangles = std::mem::take(&mut coarse.triangles);
        let Bounds { least, greatest } = grid_bounds(&coarse.grid);
        let [least, greatest] = [least, greatest].map(|place| world_from_cells(&coarse.grid, place));
        let mut block_of_vertex = vec![None; cells.len()];
        let mut movers = Vec::new();
        for of in &coarse.of_borders {
            for i in 0..of.count {
                let (vertex, number) = (of.vertex + i, (of.first + i) as usize);
                own[of.block][number] = vertex;
                block_of_vertex[vertex as usize] = Some(of.block as u32);
                let of_border = &blocks[of.block].block.border.vertices[number];
                movers.push(Mover { vertex, mean: of_border.mean, target: of_border.target });
            }
        }
        let mut beside: Vec<_> = coarse.beside.iter().map(|quad| (quad.crossing_within(0.0), quad.corners)).collect();
        let near = |triangle: &[u32; 3]| triangle.iter().find_map(|&vertex| block_of_vertex[vertex as usize]);
        let mut block_of: Vec<Option<u32>> = triangles.iter().map(near).collect();
        let mut world: Vec<DVec3> = cells.iter().map(|&place| world_from_cells(&coarse.grid, place)).collect();
        for ((number, one), mut of_vertex) in (0..).zip(blocks).zip(own) {
            let (scale, mesh) = (one.block.border.scale, &one.mesh);
            for &place in &mesh.vertices[of_vertex.len()..] {
                of_vertex.push(cells.len() as u32);
                cells.push(scale.place(place));
                world.push(world_from_cells(&mesh.grid, place).clamp(least, greatest));
            }
            let joined = |vertex: u32| of_vertex[vertex as usize];
            let of_block = mesh.triangles.iter().map(|triangle| triangle.map(joined));
            triangles.extend(of_block.filter(|[a, b, c]| a != b && b != c && c != a));
            block_of.resize(triangles.len(), Some(number));
            let of_block = mesh.beside.iter();
            beside.extend(of_block.map(|quad| (scale.place(quad.crossing_within(0.0)), quad.corners.map(joined))));
            coarse.distance = coarse.distance.max(mesh.distance / scale.parts() as f32);
            coarse.moved += mesh.moved;
            coarse.stayed += mesh.stayed;
            coarse.pulled += mesh.pulled;
        }
        if u32::try_from(cells.len().max(3 * triangles.len())).is_err() {
            return Err(SurfaceError::TooLarge { limit: u32::MAX });
        }
        let mesh = TriangleMesh { positions: world, triangles };
        Ok(Joined { coarse, cells, stars: Stars::of(&mesh), mesh, block_of, movers, beside })
    }

    /// Returns the triangles around a vertex, in no order.
    fn around(&self, vertex: u32) -> impl Iterator<Item = u32> + '_ {
        self.stars.corners_at(vertex as usize).iter().map(|corner| corner / 3)
    }

    /// Separates triangles that cross one another: vertices of borders go back to their means, if no node changes its side. Returns the
    /// blocks whose triangles cross others all the same, in descending order.
    pub fn part(&mut self, precision: Precision) -> Vec<usize> {
        let all = self.beside_blocks();
        let mut pairs = crossing(&self.mesh, [&all, &all], precision);
        while !pairs.is_empty() {
            let mut back = Vec::new();
            for mover in self.movers_of(&pairs) {
                let Mover { vertex, mean, .. } = self.movers[mover];
                if self.cells[vertex as usize].distance(mean) > MARGIN && self.may_go(mover, mean) {
                    self.place(mover, mean);
                    back.push(mover);
                }
            }
            if back.is_empty() {
                let crossed = pairs.as_flattened().iter().filter_map(|&t| Some(self.block_of[t as usize]? as usize));
                return crossed.collect::<BTreeSet<_>>().into_iter().rev().collect();
            }
            pairs = self.crossing_after(&back, &pairs, &all, precision);
        }
        Vec::new()
    }

    /// Returns for each triangle whether it has a vertex in a block or on its border.
    fn beside_blocks(&self) -> Vec<bool> {
        self.block_of.iter().map(Option::is_some).collect()
    }

    /// Moves vertices whose features lie beyond their cells there, unless nodes are in the way, triangles would cross, or the volume
    /// `is_wrong` after all moves.
    pub fn move_beyond(&mut self, precision: Precision, is_wrong: impl Fn(f64) -> bool) {
        let moved = self.moved_beyond(precision);
        if is_wrong(self.mesh.signed_volume()) {
            moved.into_iter().for_each(|(mover, before)| self.place(mover, before));
        }
    }

    /// Moves vertices to their targets; returns those that stay there, and where they were before.
    fn moved_beyond(&mut self, precision: Precision) -> BTreeMap<usize, DVec3> {
        let all = self.beside_blocks();
        let targets: Vec<DVec3> = self.movers.iter().filter_map(|mover| mover.target).collect();
        let mut taken = Taken::near(&targets, &self.cells, |_| true);
        let way = |mover: &usize| {
            let Mover { vertex, target, .. } = self.movers[*mover];
            target.map_or(0.0, |target| target.distance_squared(self.cells[vertex as usize]))
        };
        let mut waiting: Vec<usize> = (0..self.movers.len()).filter(|&i| self.movers[i].target.is_some()).collect();
        waiting.sort_by(|a, b| way(a).total_cmp(&way(b)));
        let mut moved: BTreeMap<usize, DVec3> = BTreeMap::new();
        for mover in waiting {
            let Mover { vertex, target: Some(target), .. } = self.movers[mover] else { continue };
            if !taken.holds(target) && self.may_go(mover, target) {
                taken.add(target);
                moved.insert(mover, self.cells[vertex as usize]);
                self.place(mover, target);
            }
        }
        let mut changed: Vec<usize> = moved.keys().copied().collect();
        let mut pairs = Vec::new();
        while !changed.is_empty() {
            pairs = self.crossing_after(&changed, &pairs, &all, precision);
            if pairs.is_empty() {
                break;
            }
            changed = Vec::new();
            for mover in self.movers_of(&pairs) {
                if let Some(&before) = moved.get(&mover)
                    && self.may_go(mover, before)
                {
                    self.place(mover, before);
                    changed.push(mover);
                }
            }
            if changed.is_empty() {
                // What moved side by side returns together.
                changed = self.side_by_side(&moved, &pairs);
                changed.iter().for_each(|mover| self.place(*mover, moved[mover]));
            }
            for mover in &changed {
                moved.remove(mover);
            }
        }
        moved
    }

    /// Returns those that moved among the corners of triangles, and all that moved beside them; all that moved if none did.
    fn side_by_side(&self, moved: &BTreeMap<usize, DVec3>, pairs: &[[u32; 2]]) -> Vec<usize> {
        let of_vertex: HashMap<u32, usize> = moved.keys().map(|&mover| (self.movers[mover].vertex, mover)).collect();
        let mut open: Vec<usize> =
            self.movers_of(pairs).into_iter().filter(|mover| moved.contains_key(mover)).collect();
        if open.is_empty() {
            return moved.keys().copied().collect();
        }
        let mut found: BTreeSet<usize> = open.iter().copied().collect();
        while let Some(mover) = open.pop() {
            let around = self.around(self.movers[mover].vertex);
            let corners = around.flat_map(|triangle| self.mesh.triangles[triangle as usize]);
            let beside = corners.filter_map(|corner| of_vertex.get(&corner).copied());
            open.extend(beside.filter(|&other| found.insert(other)));
        }
        found.into_iter().collect()
    }

    /// Returns whether a vertex may move to a place without a change of any node's side.
    fn may_go(&self, mover: usize, to: DVec3) -> bool {
        let vertex = self.movers[mover].vertex;
        let from = self.cells[vertex as usize];
        self.around(vertex).all(|triangle| {
            let others = self.mesh.triangles[triangle as usize].into_iter().filter(|&other| other != vertex);
            let mut corners = [from, to, DVec3::ZERO, DVec3::ZERO];
            corners[2..].iter_mut().zip(others).for_each(|(corner, other)| *corner = self.cells[other as usize]);
            corners[2..].iter().all(|other| other.distance(to) > APART) && !holds_node(corners, MARGIN)
        })
    }

    fn place(&mut self, mover: usize, at: DVec3) {
        let vertex = self.movers[mover].vertex as usize;
        self.cells[vertex] = at;
        self.mesh.positions[vertex] = world_from_cells(&self.coarse.grid, at);
    }

    /// Returns the vertices of borders among the corners of triangles, in ascending order.
    fn movers_of(&self, pairs: &[[u32; 2]]) -> Vec<usize> {
        let corners = |&triangle: &u32| self.mesh.triangles[triangle as usize];
        let corners: BTreeSet<u32> = pairs.as_flattened().iter().flat_map(corners).collect();
        (0..self.movers.len()).filter(|&mover| corners.contains(&self.movers[mover].vertex)).collect()
    }

    /// Returns the pairs of triangles that cross after some vertices have moved, of which the pairs `before` did.
    fn crossing_after(
        &self,
        moved: &[usize],
        before: &[[u32; 2]],
        all: &[bool],
        precision: Precision,
    ) -> Vec<[u32; 2]> {
        let mut is_changed = vec![false; self.mesh.triangles.len()];
        let around = moved.iter().flat_map(|&mover| self.around(self.movers[mover].vertex));
        let changed = around.chain(before.as_flattened().iter().copied());
        changed.for_each(|triangle| is_changed[triangle as usize] = true);
        crossing(&self.mesh, [all, &is_changed], precision)
    }

    /// Returns the distance of a crossing from the triangles around the corners of its quadrilateral.
    fn distance(&self, (crossing, corners): &(DVec3, [u32; 4])) -> f64 {
        let around = corners.iter().flat_map(|&vertex| self.around(vertex));
        let places = |triangle: u32| self.mesh.triangles[triangle as usize].map(|vertex| self.cells[vertex as usize]);
        let squared = around.map(|triangle| squared_distance(*crossing, places(triangle)));
        squared.fold(f64::INFINITY, f64::min).sqrt()
    }

    /// Returns the surface; of the pairs of crossings that were dropped before there were blocks, it counts those that it lacks.
    pub fn into_surface(mut self, dropped: &Dropped, precision: Precision) -> Surface {
        let distance = self.beside.par_iter().map(|quad| self.distance(quad)).reduce(|| 0.0, f64::max);
        self.coarse.distance = self.coarse.distance.max(distance as f32);
        if self.coarse.crossing_pairs > 0 {
            // Those beside blocks cross no more.
            self.coarse.crossing_pairs = crossing_pairs(&self.mesh, precision);
        }
        let sub_resolution = SubResolution::of(dropped, &self.cells, &self.mesh.triangles);
        self.coarse.triangles = self.mesh.triangles;
        self.coarse.with_positions(self.mesh.positions, sub_resolution)
    }
}
