//! The cubes of a raster that the surface of a solid meets.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::parallel::*;

use super::MARGIN;
use crate::cancel::checkpoint;
use crate::grid::{LatticeBox, LatticeSolid};
use crate::metrics::nodes::words_between;

/// A triangle in lattice positions, cut by two planes.
type Polygon = crate::polygon::Polygon<6>;

/// The surface of a solid, prepared for intersection with the cubes of its raster.
pub(crate) struct SurfaceCubes<'a> {
    solid: &'a LatticeSolid<'a>,
    cut_by: Option<LatticeBox>,
    /// The first and the last plane of cubes that each triangle meets; an empty range for one that does not count.
    planes: Vec<[u32; 2]>,
}

impl<'a> SurfaceCubes<'a> {
    /// Prepares a surface; triangles in the faces of the box `cut_by` do not count.
    pub fn of(solid: &'a LatticeSolid<'a>, cut_by: Option<LatticeBox>) -> SurfaceCubes<'a> {
        let raster = Raster::of(solid);
        let planes = |triangle: &[u32; 3]| {
            let corners = triangle.map(|v| solid.positions()[v as usize]);
            match cut_by.is_some_and(|cut_by| lies_in_a_face(&corners, &cut_by)) {
                true => [1, 0],
                false => raster.cubes(&Polygon::of(corners), 2),
            }
        };
        let planes = solid.triangles().par_iter().with_min_len(1 << 12).map(planes).collect();
        SurfaceCubes { solid, cut_by, planes }
    }

    /// Returns the cubes met in some planes, a bit each, in words and rows as [`NodeSet`](crate::metrics::NodeSet) has them.
    pub fn slab(&self, planes: Range<usize>) -> Vec<u64> {
        let raster = Raster::of(self.solid);
        let [columns, rows, _] = raster.size;
        let words = columns.div_ceil(64);
        let bits: Vec<AtomicU64> = (0..planes.len() * rows * words).map(|_| AtomicU64::new(0)).collect();
        let set = |z: usize, y: usize, [first, last]: [u32; 2]| {
            if first > last {
                return;
            }
            let row = &bits[((z - planes.start) * rows + y) * words..][..words];
            for (word, mask) in words_between(first as usize, last as usize) {
                // Neighbouring triangles mostly meet the same cubes; reading is cheaper than writing an unchanged value.
                if row[word].load(Ordering::Relaxed) & mask != mask {
                    row[word].fetch_or(mask, Ordering::Relaxed);
                }
            }
        };
        let meets =
            |&[first, last]: &[u32; 2]| first <= last && planes.start <= last as usize && (first as usize) < planes.end;
        self.planes
            .par_iter()
            .zip(self.solid.triangles())
            .with_min_len(1 << 10)
            .filter(|(range, _)| meets(range))
            .for_each(|(&[low, high], triangle)| {
                checkpoint();
                let whole = Polygon::of(triangle.map(|v| self.solid.positions()[v as usize]));
                for z in (low as usize).max(planes.start)..(high as usize + 1).min(planes.end) {
                    let clipped;
                    let in_plane = match low == high {
                        true => &whole,
                        false => {
                            clipped = raster.cut(&whole, 2, z);
                            &clipped
                        }
                    };
                    let [first, last] = raster.cubes(in_plane, 1);
                    for y in first..=last {
                        let cubes = match first == last {
                            true => raster.cubes(in_plane, 0),
                            false => raster.cubes_in_row(in_plane, y as usize),
                        };
                        set(z, y as usize, cubes);
                    }
                }
            });
        let mut bits: Vec<u64> = bits.into_iter().map(AtomicU64::into_inner).collect();
        self.add_cubes_without_nodes(&mut bits, planes);
        bits
    }

    /// Adds the cubes into which the region's box extends without reaching their nodes: there the node does not represent the
    /// solid within the box.
    fn add_cubes_without_nodes(&self, bits: &mut [u64], planes: Range<usize>) {
        let Some(cut_by) = self.cut_by else { return };
        let Raster { size, .. } = Raster::of(self.solid);
        let grid = self.solid.grid();
        let is_without = |axis: usize, index: usize| {
            let (low, node) = ((index as i32) << grid.shift(), grid.node(index as u32));
            let high = low + (1 << grid.shift());
            low < cut_by.max[axis] && cut_by.min[axis] < high && !(cut_by.min[axis]..=cut_by.max[axis]).contains(&node)
        };
        let [columns, rows, _] = size;
        let words = columns.div_ceil(64);
        let without =
            [0, 1, 2].map(|axis| (0..size[axis]).filter(|&index| is_without(axis, index)).collect::<Vec<_>>());
        let mut fill = |z: usize, y: usize, first: usize, last: usize| {
            let row = &mut bits[((z - planes.start) * rows + y) * words..][..words];
            words_between(first, last).for_each(|(word, mask)| row[word] |= mask);
        };
        for z in planes.clone() {
            for y in 0..rows {
                if without[2].contains(&z) || without[1].contains(&y) {
                    fill(z, y, 0, columns - 1);
                } else {
                    without[0].iter().for_each(|&x| fill(z, y, x, x));
                }
            }
        }
    }
}

/// Returns whether a triangle lies in a face of a box.
fn lies_in_a_face(corners: &[[i32; 3]; 3], faces: &LatticeBox) -> bool {
    (0..3).any(|axis| {
        [faces.min[axis], faces.max[axis]].iter().any(|face| corners.iter().all(|corner| corner[axis] == *face))
    })
}

/// The layout of the cubes.
#[derive(Clone, Copy)]
struct Raster {
    size: [usize; 3],
    /// The side of a cube, in lattice steps.
    side: f64,
}

impl Raster {
    fn of(solid: &LatticeSolid) -> Raster {
        let grid = solid.grid();
        Raster { size: grid.rays().map(|n| n as usize), side: f64::from(1u32 << grid.shift()) }
    }

    /// Returns the first and the last cube along an axis that a polygon meets; an empty range for an empty polygon.
    fn cubes(&self, polygon: &Polygon, axis: usize) -> [u32; 2] {
        let corners = polygon.corners().iter().map(|corner| corner[axis]);
        self.between(corners.fold(NOTHING, extended), axis)
    }

    /// Returns the first and the last cube along x that the part of a polygon in a row of cubes along x meets, the row's coordinate
    /// along y given; an empty range if there is no such part.
    fn cubes_in_row(&self, polygon: &Polygon, row: usize) -> [u32; 2] {
        let [low, high] = self.layer(row);
        let corners = polygon.corners();
        let mut extent = NOTHING;
        for (at, &[x, y, _]) in corners.iter().enumerate() {
            let [next_x, next_y, _] = corners[(at + 1) % corners.len()];
            if low <= y && y <= high {
                extent = extended(extent, x);
            }
            for side in [low, high] {
                if (y < side) != (next_y < side) {
                    extent = extended(extent, x + (side - y) / (next_y - y) * (next_x - x));
                }
            }
        }
        self.between(extent, 0)
    }

    /// Returns the first and the last cube along an axis that an interval meets, and the margin around it.
    fn between(&self, [least, most]: [f64; 2], axis: usize) -> [u32; 2] {
        if least > most {
            return [1, 0];
        }
        let cube = |at: f64| (at / self.side) as u32;
        let last = self.size[axis] as u32 - 1;
        [cube((least - f64::from(MARGIN)).max(0.0)).min(last), cube(most + f64::from(MARGIN)).min(last)]
    }

    /// Returns the lower and the upper side of a layer of cubes with the margin around it.
    fn layer(&self, layer: usize) -> [f64; 2] {
        let low = layer as f64 * self.side;
        [low - f64::from(MARGIN), low + self.side + f64::from(MARGIN)]
    }

    /// Clips a polygon to a layer of cubes across an axis.
    fn cut(&self, polygon: &Polygon, axis: usize, layer: usize) -> Polygon {
        let [low, high] = self.layer(layer);
        polygon.above(axis, low, 1.0).above(axis, high, -1.0)
    }
}

/// The extent of no point: its lower end is above its upper one.
const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// Extends an interval to a point.
fn extended([least, most]: [f64; 2], point: f64) -> [f64; 2] {
    [least.min(point), most.max(point)]
}
