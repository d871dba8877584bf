//! Certified volumes, from cubes of whatever raster there is time for.

use rayon::prelude::*;

use super::cubes::SurfaceCubes;
use super::{Interval, MARGIN};
use crate::grid::{Grid, LatticeBox, LatticeSolid};
use crate::ldi::{NodePlanes, NodeSlab};

/// Planes that are looked at together: what bounds the memory.
const SLAB: usize = 64;

/// By how much a volume may be off that was rounded a few times.
const ROUNDING: f64 = 1e-14;

/// A solid with the nodes that exact images of it have inside, on the raster of both.
#[derive(Clone, Copy, Debug)]
pub struct Sampled<'a> {
    /// The surface.
    pub solid: &'a LatticeSolid<'a>,
    /// From exact images, one being enough; one along x or y is the fastest to go through.
    pub inside: NodePlanes<'a>,
}

/// Within what volumes are taken.
#[derive(Clone, Copy, Debug)]
pub enum Within<'a> {
    /// A box, in lattice positions.
    Box(LatticeBox),
    /// Another solid, on the same raster.
    Solid(Sampled<'a>),
}

/// What the volumes of solid and pores in a region certainly lie between, in cubic world units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeBounds {
    /// BV.
    pub solid: Interval,
    /// The volume of the region that is not solid.
    pub pore: Interval,
    /// TV; of a box its value.
    pub region: Interval,
}

impl VolumeBounds {
    /// Bounds of a solid's volume within a region, which differ by the volume of the cubes that surfaces meet: of first order
    /// in the pitch. A finer raster gives tighter ones ([`finer_grid`]); planes are gone through a few at a time, so that the
    /// memory is that of `within` and `sampled`, 8 bytes a triangle, and a slab of bits.
    ///
    /// They hold for the solid of the mesh as read, under the fill rule of the images: snapping is allowed for.
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

    /// The pores' share of the region, 1 − BV/TV.
    pub fn porosity(&self) -> Interval {
        let VolumeBounds { solid, pore, region } = self;
        if region.upper <= 0.0 {
            return Interval { lower: 0.0, upper: 1.0 };
        }
        // Of all regions that the bounds allow, the one that leaves the pores the least share, and the most.
        let allowed = |volume: f64| volume.clamp(region.lower, region.upper).max(f64::MIN_POSITIVE);
        let least = allowed(pore.lower + solid.upper);
        let most = allowed(pore.upper + solid.lower);
        Interval {
            lower: (pore.lower / least).max(1.0 - solid.upper / least).max(0.0),
            upper: (pore.upper / most).min(1.0 - solid.lower / most).min(1.0),
        }
    }

    /// The same with a region whose volume is known better, as from its mesh.
    pub fn with_region_volume(self, volume: f64) -> VolumeBounds {
        VolumeBounds { region: Interval::exactly(volume), ..self }
    }
}

/// The grid on the same lattice with as many times more rays, a power of two, as leave `most` of them along the longest side;
/// the grid itself, where it has more than half as many.
pub fn finer_grid(grid: &Grid, most: u32) -> Grid {
    let longest = grid.rays().into_iter().max().unwrap_or(1);
    // A cube is to be much larger than the margin around it.
    let doublings = (most / longest).max(1).ilog2().min(grid.shift().saturating_sub(10));
    let rays = grid.rays().map(|n| n << doublings);
    let pitch = grid.pitch() / f64::from(1u32 << doublings);
    // More rays than an image can have leave the grid as it is.
    Grid::from_parts(grid.origin(), pitch, rays, grid.shift() - doublings, grid.lod()).unwrap_or(*grid)
}

fn in_box(sampled: &Sampled, bounds: &LatticeBox) -> VolumeBounds {
    let grid = sampled.solid.grid();
    // Faces in those of the box do not count, and may lie a step from them before they are snapped: of what is as near as that
    // to a face of the box nothing certainly is solid, and all may be.
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

/// The volume of a box, in cubic lattice steps.
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

    /// A row of words that are by plane, row and word.
    fn row<'b>(&self, bits: &'b [u64], y: usize, z: usize) -> &'b [u64] {
        &bits[((z - self.first) * self.rows + y) * self.words..][..self.words]
    }

    /// The sums over all rows.
    fn sums<const N: usize>(&self, of_row: impl Fn(usize, usize) -> [u128; N] + Sync) -> [u128; N] {
        let of_plane = |z: usize| (0..self.rows).map(|y| of_row(y, z)).fold([0; N], plus);
        self.range().into_par_iter().map(of_plane).reduce(|| [0; N], plus)
    }
}

fn row(nodes: &NodeSlab, y: usize, z: usize) -> &[u64] {
    nodes.row(y, z as i32)
}

/// The sums over all slabs of a raster.
fn sums<const N: usize>(grid: &Grid, of_slab: impl Fn(Slab) -> [u128; N]) -> [u128; N] {
    let [columns, rows, planes] = grid.rays().map(|n| n as usize);
    let slab = |first: usize| Slab { first, end: planes.min(first + SLAB), rows, words: columns.div_ceil(64) };
    (0..planes).step_by(SLAB).map(|first| of_slab(slab(first))).fold([0; N], plus)
}

fn plus<const N: usize>(a: [u128; N], b: [u128; N]) -> [u128; N] {
    std::array::from_fn(|i| a[i] + b[i])
}

/// What of each cube lies in a box.
struct Cubes {
    /// The whole side of a cube.
    side: u64,
    /// Cubes along x of which all lies in the box, a bit each.
    whole: Vec<u64>,
    /// Those of which a part does.
    partial: Vec<Partial>,
    /// How much of each row and plane of cubes lies in the box, in lattice steps.
    across: [Vec<u64>; 2],
}

/// A cube of a row that reaches out of the box.
struct Partial {
    word: usize,
    bit: u64,
    /// Of its part within, along x, in lattice steps.
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

    /// How long the cubes of a word of a row are together, within the box along x, in lattice steps. Bits beyond the last cube
    /// do not count.
    fn along(&self, word: usize, bits: u64) -> u128 {
        let whole = u64::from((bits & self.whole[word]).count_ones()) * self.side;
        let partial = self.partial.iter().filter(|partial| partial.word == word && partial.bit & bits != 0);
        u128::from(whole + partial.map(|partial| partial.length).sum::<u64>())
    }

    /// How much of a row of cubes lies in the box across x, in square lattice steps.
    fn across(&self, y: usize, z: usize) -> u128 {
        u128::from(self.across[0][y]) * u128::from(self.across[1][z])
    }
}

/// A volume in cubic lattice steps, in cubic world units.
fn world(grid: &Grid, steps: u128) -> f64 {
    let step = grid.step();
    steps as f64 * step * step * step
}

fn interval(grid: &Grid, least: u128, most: u128) -> Interval {
    Interval { lower: world(grid, least) * (1.0 - ROUNDING), upper: world(grid, most) * (1.0 + ROUNDING) }
}
