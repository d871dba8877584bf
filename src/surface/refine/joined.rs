//! The mesh around blocks of finer cells, and the meshes of these, in one.

use std::collections::BTreeSet;
use std::mem::take;

use glam::DVec3;

use super::super::cells::{grid_bounds, world_from_cells};
use super::super::edges::Dropped;
use super::super::qef::Bounds;
use super::super::simplify::crossing;
use super::super::{Contoured, SubResolution, Surface, SurfaceError};
use super::Refined;
use crate::mesh::{Precision, TriangleMesh};

/// The mesh around blocks with those of the blocks.
pub struct Joined {
    /// With the triangles and counts of all.
    coarse: Contoured,
    /// The vertices in coordinates of cells, and in world coordinates.
    cells: Vec<DVec3>,
    world: Vec<DVec3>,
    /// The block of each triangle that has a vertex in one or on its border.
    block_of: Vec<Option<u32>>,
}

impl Joined {
    /// Joins the mesh around blocks to theirs.
    ///
    /// # Errors
    /// More than 32 bits count.
    pub fn of(mut coarse: Contoured, blocks: &[&Refined]) -> Result<Joined, SurfaceError> {
        let mut own: Vec<Vec<u32>> = blocks.iter().map(|one| vec![0; one.block.border.vertices.len()]).collect();
        let mut cells = std::mem::take(&mut coarse.vertices);
        let Bounds { least, greatest } = grid_bounds(&coarse.grid);
        let [least, greatest] = [least, greatest].map(|place| world_from_cells(&coarse.grid, place));
        let mut block_of_vertex = vec![None; cells.len()];
        for of in &coarse.of_borders {
            for i in 0..of.count {
                own[of.block][(of.first + i) as usize] = of.vertex + i;
                block_of_vertex[(of.vertex + i) as usize] = Some(of.block as u32);
            }
        }
        let near = |triangle: &[u32; 3]| triangle.iter().find_map(|&vertex| block_of_vertex[vertex as usize]);
        let mut block_of: Vec<Option<u32>> = coarse.triangles.iter().map(near).collect();
        let mut world: Vec<DVec3> = cells.iter().map(|&place| world_from_cells(&coarse.grid, place)).collect();
        for ((number, one), mut of_vertex) in (0..).zip(blocks).zip(own) {
            let (scale, mesh) = (one.block.border.scale, &one.mesh);
            for &place in &mesh.vertices[of_vertex.len()..] {
                of_vertex.push(cells.len() as u32);
                cells.push(scale.place(place));
                world.push(world_from_cells(&mesh.grid, place).clamp(least, greatest));
            }
            let triangles = mesh.triangles.iter().map(|triangle| triangle.map(|vertex| of_vertex[vertex as usize]));
            coarse.triangles.extend(triangles.filter(|[a, b, c]| a != b && b != c && c != a));
            block_of.resize(coarse.triangles.len(), Some(number));
            coarse.distance = coarse.distance.max(mesh.distance / scale.parts() as f32);
            coarse.moved += mesh.moved;
            coarse.stayed += mesh.stayed;
            coarse.pulled += mesh.pulled;
        }
        match u32::try_from(cells.len().max(coarse.triangles.len())) {
            Ok(_) => Ok(Joined { coarse, cells, world, block_of }),
            Err(_) => Err(SurfaceError::TooLarge { limit: u32::MAX }),
        }
    }

    /// Returns the blocks whose triangles cross others, in descending order.
    pub fn crossed(&mut self, precision: Precision) -> Vec<usize> {
        let (positions, triangles) = (take(&mut self.world), take(&mut self.coarse.triangles));
        let mesh = TriangleMesh { positions, triangles };
        let is_tested: Vec<bool> = self.block_of.iter().map(Option::is_some).collect();
        let pairs = crossing(&mesh, [&is_tested, &is_tested], None, precision);
        (self.world, self.coarse.triangles) = (mesh.positions, mesh.triangles);
        let blocks: BTreeSet<usize> =
            pairs.as_flattened().iter().filter_map(|&t| Some(self.block_of[t as usize]? as usize)).collect();
        blocks.into_iter().rev().collect()
    }

    /// Returns the surface; of the pairs of crossings that were dropped before there were blocks, it counts those that it lacks.
    pub fn into_surface(self, dropped: &Dropped) -> Surface {
        let sub_resolution = SubResolution::of(dropped, &self.cells, &self.coarse.triangles);
        self.coarse.with_positions(self.world, sub_resolution)
    }
}
