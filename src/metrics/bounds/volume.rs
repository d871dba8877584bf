//! Certified volumes, from cubes of a raster of any fineness.

use crate::parallel::*;

use super::cubes::SurfaceCubes;
use super::{Interval, MARGIN};
use crate::cancel::checkpoint;
use crate::grid::{Grid, LatticeBox, LatticeSolid};
use crate::ldi::{NodePlanes, NodeSlab};

/// Planes that a thread processes together, which bounds the memory.
const SLAB: usize = 16;

/// Relative error bound of a volume that was rounded a few times.
const ROUNDING: f64 = 1e-14;

/// A solid with the nodes inside by its exact images, on the raster of both.
#[derive(Clone, Copy, Debug)]
pub struct Sampled<'a> {
    /// The surface.
    pub solid: &'a LatticeSolid<'a>,
    /// The nodes of exact images; one image is enough, and one along x or y is processed fastest.
    pub inside: NodePlanes<'a>,
}

/// The region of the volumes.
#[derive(Clone, Copy, Debug)]
pub enum Within<'a> {
    /// A box, in lattice positions.
    Box(LatticeBox),
    /// Another solid, on the same raster.
    Solid(Sampled<'a>),
}

/// Certified bounds of the volumes of solid and pores in a region, in cubic world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeBounds {
    /// BV.
    pub solid: Interval,
    /// The volume of the region that is not solid.
    pub pore: Interval,
    /// TV; for a box its value.
    pub region: Interval,
}

impl VolumeBounds {
    /// Bounds a solid's volume within a region. The interval's width is the volume of the cubes that surfaces meet: of first
    /// order in the pitch. A finer raster gives tighter bounds ([`finer_grid`]); planes are processed a few at a time, so that
    /// the memory is that of `within` and `sampled`, 8 bytes a triangle, and about a slab of bits for each thread.
    ///
    /// The bounds hold for the solid of the mesh as read, under the fill rule of the images: they include the effect of
    /// snapping.
    ///
    /// # Panics
    /// If surface, images and region are not all on one raster.
    pub fn of(sampled: &Sampled, within: &Within) -> VolumeBounds {
        let grid = sampled.solid.grid();
        assert_eq!(grid, sampled.inside.grid(), "a solid and its nodes are on one raster");
        match within {
            Within::Box(bounds) => in_box(sampled, bounds),
            Within::Solid(region) => {
                let grids = [region.solid.grid(), region.inside.grid()];
                assert_eq!(grids, [grid; 2], "a solid and its region are on one raster");
                in_solid(sampled, region)
            }
        }
    }

    /// Returns the pores' share of the region, 1 − BV/TV.
    pub fn porosity(&self) -> Interval {
        let VolumeBounds { solid, pore, region } = self;
        if region.upper <= 0.0 {
            return Interval { lower: 0.0, upper: 1.0 };
        }
        // The region volumes within the bounds that minimise and maximise the pores' share.
        let allowed = |volume: f64| volume.clamp(region.lower, region.upper).max(f64::MIN_POSITIVE);
        let least = allowed(pore.lower + solid.upper);
        let most = allowed(pore.upper + solid.lower);
        Interval {
            lower: (pore.lower / least).max(1.0 - solid.upper / least).max(0.0),
            upper: (pore.upper / most).min(1.0 - solid.lower / most).min(1.0),
        }
    }

    /// Returns the same bounds with a more accurate volume of the region, as from its mesh.
    pub fn with_region_volume(self, volume: f64) -> VolumeBounds {
        VolumeBounds { region: Interval::exactly(volume), ..self }
    }
}

/// Returns the grid on the same lattice with 2ⁿ times the rays, the largest multiple with at most `most` rays along the longest
/// side; the grid itself, where it has more than half as many.
pub fn finer_grid(grid: &Grid, most: u32) -> Grid {
    let longest = grid.rays().into_iter().max().unwrap_or(1);
    // A cube must be much larger than the margin around it.
    let doublings = (most / longest).max(1).ilog2().min(grid.shift().saturating_sub(10));
    let rays = grid.rays().map(|n| n << doublings);
    let pitch = grid.pitch() / f64::from(1u32 << doublings);
    // If the rays exceed the limit of an image, the grid stays as it is.
    Grid::from_parts(grid.origin(), pitch, rays, grid.shift() - doublings, grid.lod()).unwrap_or(*grid)
}

fn in_box(sampled: &Sampled, bounds: &LatticeBox) -> VolumeBounds {
    let grid = sampled.solid.grid();
    // Facets in the faces of the box do not count, and may lie a step from them before they are snapped: within that distance
    // of a face of the box nothing is certainly solid, and all may be.
    let certain = LatticeBox { min: bounds.min.map(|low| low + MARGIN), max: bounds.max.map(|high| high - MARGIN) };
    let cubes = Cubes::in_box(grid, &certain);
    let surface = SurfaceCubes::of(sampled.solid, Some(*bounds));
    let [inner, outer] = sums(grid, |slab| {
        let (nodes, met) = (sampled.inside.slab(slab.planes(), 0), surface.slab(slab.range()));
        slab.sums(|y, z| {
            let mut along = [0; 2];
            for (word, (&n, &met)) in row(&nodes, y, z).iter().zip(slab.row(&met, y, z)).enumerate() {
                along[0] += cubes.along(word, n & !met);
                along[1] += cubes.along(word, n | met);
            }
            along.map(|along| along * cubes.across(y, z))
        })
    });
    let [whole, within] = [bounds, &certain].map(steps);
    let solid = interval(grid, inner, outer + (whole - within));
    let volume = world(grid, whole);
    let pore = Interval { lower: (volume - solid.upper).max(0.0), upper: (volume - solid.lower).max(0.0) };
    VolumeBounds { solid, pore, region: Interval::exactly(volume) }
}

/// Returns the volume of a box, in cubic lattice steps.
fn steps(bounds: &LatticeBox) -> u128 {
    let side = |axis: usize| i64::from(bounds.max[axis]) - i64::from(bounds.min[axis]);
    (0..3).map(|axis| side(axis).max(0) as u128).product()
}

fn in_solid(sampled: &Sampled, region: &Sampled) -> VolumeBounds {
    let grid = sampled.solid.grid();
    let whole = LatticeBox { min: [0; 3], max: [0, 1, 2].map(|axis| grid.length(axis)) };
    let cubes = Cubes::in_box(grid, &whole);
    let [surface, boundary] = [sampled, region].map(|of| SurfaceCubes::of(of.solid, None));
    let [solid, solid_most, pore, pore_most, least, most] = sums(grid, |slab| {
        let [nodes, within] = [sampled, region].map(|of| of.inside.slab(slab.planes(), 0));
        let [met, cut] = [&surface, &boundary].map(|of| of.slab(slab.range()));
        slab.sums(|y, z| {
            let mut along = [0; 6];
            let of_solid = row(&nodes, y, z).iter().zip(slab.row(&met, y, z));
            let of_region = row(&within, y, z).iter().zip(slab.row(&cut, y, z));
            for (word, ((&n, &met), (&r, &cut))) in of_solid.zip(of_region).enumerate() {
                let (inner, outer) = (n & !met, n | met);
                let (least, most) = (r & !cut, r | cut);
                let sets = [inner & least, outer & most, !outer & least, !inner & most, least, most];
                along.iter_mut().zip(sets).for_each(|(along, set)| *along += cubes.along(word, set));
            }
            along.map(|along| along * cubes.across(y, z))
        })
    });
    VolumeBounds {
        solid: interval(grid, solid, solid_most),
        pore: interval(grid, pore, pore_most),
        region: interval(grid, least, most),
    }
}

/// Consecutive planes.
#[derive(Clone, Copy)]
struct Slab {
    first: usize,
    end: usize,
    rows: usize,
    words: usize,
}

impl Slab {
    fn range(&self) -> std::ops::Range<usize> {
        self.first..self.end
    }

    fn planes(&self) -> std::ops::Range<i32> {
        self.first as i32..self.end as i32
    }

    /// Returns a row of words that are stored by plane, row and word.
    fn row<'b>(&self, bits: &'b [u64], y: usize, z: usize) -> &'b [u64] {
        &bits[((z - self.first) * self.rows + y) * self.words..][..self.words]
    }

    /// Returns the sums over all rows.
    fn sums<const N: usize>(&self, of_row: impl Fn(usize, usize) -> [u128; N] + Sync) -> [u128; N] {
        let of_plane = |z: usize| {
            checkpoint();
            (0..self.rows).map(|y| of_row(y, z)).fold([0; N], plus)
        };
        self.range().into_par_iter().map(of_plane).reduce(|| [0; N], plus)
    }
}

fn row(nodes: &NodeSlab, y: usize, z: usize) -> &[u64] {
    nodes.row(y, z as i32)
}

/// Returns the sums over all slabs of a raster.
fn sums<const N: usize>(grid: &Grid, of_slab: impl Fn(Slab) -> [u128; N] + Sync) -> [u128; N] {
    let [columns, rows, planes] = grid.rays().map(|n| n as usize);
    let slab = |number: usize| {
        let first = number * SLAB;
        Slab { first, end: planes.min(first + SLAB), rows, words: columns.div_ceil(64) }
    };
    let slabs = (0..planes.div_ceil(SLAB)).into_par_iter().with_max_len(1);
    slabs.map(|number| of_slab(slab(number))).reduce(|| [0; N], plus)
}

fn plus<const N: usize>(a: [u128; N], b: [u128; N]) -> [u128; N] {
    std::array::from_fn(|i| a[i] + b[i])
}

/// The parts of cubes that lie in a box.
struct Cubes {
    /// The whole side of a cube.
    side: u64,
    /// Cubes along x that lie entirely in the box, a bit each.
    whole: Vec<u64>,
    /// Cubes that lie partly in the box.
    partial: Vec<Partial>,
    /// The extent within the box of each row and plane of cubes, in lattice steps.
    across: [Vec<u64>; 2],
}

/// A cube of a row that extends out of the box.
struct Partial {
    word: usize,
    bit: u64,
    /// The length of its part in the box along x, in lattice steps.
    length: u64,
}

impl Cubes {
    fn in_box(grid: &Grid, bounds: &LatticeBox) -> Cubes {
        let side = 1 << grid.shift();
        let lengths = [0, 1, 2].map(|axis| {
            let length = |index: u32| {
                let low = (index << grid.shift()) as i32;
                i64::from((low + side).min(bounds.max[axis])) - i64::from(low.max(bounds.min[axis]))
            };
            (0..grid.rays()[axis]).map(|index| length(index).max(0) as u64).collect::<Vec<u64>>()
        });
        let [columns, rows, planes] = lengths;
        let side = side as u64;
        let mut whole = vec![0; columns.len().div_ceil(64)];
        let mut partial = Vec::new();
        for (x, &length) in columns.iter().enumerate() {
            let (word, bit) = (x / 64, 1 << (x % 64));
            if length == side {
                whole[word] |= bit;
            } else if length > 0 {
                partial.push(Partial { word, bit, length });
            }
        }
        Cubes { side, whole, partial, across: [rows, planes] }
    }

    /// Returns the total length within the box along x of the cubes of a word of a row, in lattice steps. Bits beyond the last
    /// cube do not count.
    fn along(&self, word: usize, bits: u64) -> u128 {
        let whole = u64::from((bits & self.whole[word]).count_ones()) * self.side;
        let partial = self.partial.iter().filter(|partial| partial.word == word && partial.bit & bits != 0);
        u128::from(whole + partial.map(|partial| partial.length).sum::<u64>())
    }

    /// Returns the cross-section across x of a row of cubes within the box, in square lattice steps.
    fn across(&self, y: usize, z: usize) -> u128 {
        u128::from(self.across[0][y]) * u128::from(self.across[1][z])
    }
}

/// Converts a volume from cubic lattice steps to cubic world units.
fn world(grid: &Grid, steps: u128) -> f64 {
    let step = grid.step();
    steps as f64 * step * step * step
}

fn interval(grid: &Grid, least: u128, most: u128) -> Interval {
    Interval { lower: world(grid, least) * (1.0 - ROUNDING), upper: world(grid, most) * (1.0 + ROUNDING) }
}
