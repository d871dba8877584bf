//! The raster and the integer lattice: the only place where world coordinates become integers.
//!
//! A [`Grid`] is a raster of cubic pixels of side [`pitch`](Grid::pitch) around the solids of a job, with a lattice
//! that is finer than the pixel by 2^[`shift`](Grid::shift) and serves the three axes and depth alike. Vertices snap to
//! even lattice positions, rays run through odd ones, so that no ray ever meets a vertex or an axis-parallel edge. All
//! guarantees of the toolkit hold for the solid after this one rounding, whose size is
//! [`quantisation`](Grid::quantisation).
//!
//! Ranges: lattice positions lie in `[0, 2^30)`, or in `(-2^30, 2^30)` for a solid on a part of its grid; differences fit 31 bits,
//! edge functions fit `i64`. At 512 rays a pixel holds 2^20 lattice steps.

mod offset;
mod refined;
mod sum;

use std::borrow::Cow;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::parallel::*;
use glam::DVec3;

use crate::allocation::vec_with_room;
use crate::mesh::{Aabb, ClosedMesh, TriangleMesh};

pub use offset::offset_grid;
pub(crate) use refined::FineBox;
pub use sum::SumGrid;

/// Largest lattice position, so that a depth and its flags fit 32 bits and edge functions fit `i64`.
pub const LATTICE_MAX: i32 = (1 << 30) - 2;

/// Largest number of rays along one side; a pixel then still holds 2^13 lattice steps.
pub const RAYS_MAX: u32 = 1 << 16;

/// Range of the number of voxels that a ray may be divided into (LOD-C).
pub const LOD_RANGE: std::ops::RangeInclusive<u32> = 32..=65_536;

/// One of the three coordinate axes; the direction of the rays of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Axis {
    /// Rays along +x; columns along y, rows along z.
    X,
    /// Rays along +y; columns along x, rows along z.
    Y,
    /// Rays along +z; columns along x, rows along y.
    Z,
}

impl Axis {
    /// x, y, z.
    pub const ALL: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

    /// Returns the coordinate along the rays: 0, 1 or 2.
    pub const fn depth(self) -> usize {
        self as usize
    }

    /// Returns the coordinate along the columns of the image: the lesser of the other two.
    pub const fn column(self) -> usize {
        match self {
            Axis::X => 1,
            Axis::Y | Axis::Z => 0,
        }
    }

    /// Returns the coordinate along the rows of the image: the greater of the other two.
    pub const fn row(self) -> usize {
        match self {
            Axis::X | Axis::Y => 2,
            Axis::Z => 1,
        }
    }

    /// Returns `x`, `y` or `z`.
    pub const fn name(self) -> &'static str {
        match self {
            Axis::X => "x",
            Axis::Y => "y",
            Axis::Z => "z",
        }
    }
}

/// The reason why a grid cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    /// The box has no extent, or one so small or large that f64 cannot hold its pitch or its volume.
    #[error(
        "no grid fits the solid: the longest side of its box is {longest:e}, and 64-bit numbers hold the volumes of sides from \
         about 3e-103 to 5e102; scale the solid, or measure it in another unit"
    )]
    NoExtent {
        /// The longest side of the box, in world units.
        longest: f64,
    },
    /// The resolution is zero or above [`RAYS_MAX`].
    #[error("{} rays along the longest side are outside 1 to {RAYS_MAX}", ray_count(*.rays))]
    Resolution {
        /// Requested rays along the longest side, saturated at `u64::MAX`.
        rays: u64,
    },
    /// An image would have more rays than 32 bits can count.
    #[error("too many rays: {columns} × {rows} (limit 4,294,967,295); lower the resolution")]
    Rays {
        /// Columns of the image.
        columns: u32,
        /// Rows of the image.
        rows: u32,
    },
    /// The pitch is not a positive finite number.
    #[error("a pitch of {pitch} is not a positive length")]
    Pitch {
        /// The requested pitch.
        pitch: f64,
    },
    /// The number of lattice steps in a pixel leaves no room between a vertex and a ray, or overflows.
    #[error("a pixel of 2^{shift} lattice steps is outside 2^2 to 2^29")]
    Shift {
        /// The requested exponent.
        shift: u32,
    },
    /// The origin is not finite.
    #[error("the origin {origin} is not finite")]
    Origin {
        /// The requested position.
        origin: DVec3,
    },
    /// Rays of this many lattice steps exceed the lattice.
    #[error("{rays} rays of 2^{shift} lattice steps exceed the limit of {LATTICE_MAX} steps; lower the resolution")]
    Lattice {
        /// Rays along one side.
        rays: u32,
        /// The requested exponent.
        shift: u32,
    },
    /// LOD-C is outside [`LOD_RANGE`].
    #[error("LOD-C {lod} is outside 32 to 65536 voxels per ray")]
    Lod {
        /// The requested value.
        lod: u32,
    },
}

/// Returns a count of rays in words; `u64::MAX` stands for any greater one.
fn ray_count(rays: u64) -> String {
    if rays == u64::MAX { "more than 10^19".to_owned() } else { rays.to_string() }
}

/// A vertex of a mesh lies outside the grid on which it is quantised.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("vertex {vertex} at {position} lies outside the grid")]
pub struct OutsideGrid {
    /// Index of the first such vertex.
    pub vertex: usize,
    /// Its world position.
    pub position: DVec3,
}

/// A raster of rays and the integer lattice under it. Cheap to copy; images on equal grids are comparable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    origin: DVec3,
    pitch: f64,
    rays: [u32; 3],
    shift: u32,
    lod: u32,
}

impl Grid {
    /// Returns a grid around `bounds` with `resolution` pixels along its longest side and LOD-C `lod`.
    pub fn with_resolution(bounds: Aabb, resolution: u32, lod: u32) -> Result<Grid, GridError> {
        if !(1..=RAYS_MAX).contains(&resolution) {
            return Err(GridError::Resolution { rays: u64::from(resolution) });
        }
        let longest = bounds.extent().max_element();
        Grid::lay(bounds, longest / f64::from(resolution), lod)
    }

    /// Returns a grid around `bounds` with the given distance between rays, in world units.
    pub fn with_pitch(bounds: Aabb, pitch: f64, lod: u32) -> Result<Grid, GridError> {
        if !(pitch.is_finite() && pitch > 0.0) {
            return Err(GridError::Pitch { pitch });
        }
        Grid::lay(bounds, pitch, lod)
    }

    fn lay(bounds: Aabb, pitch: f64, lod: u32) -> Result<Grid, GridError> {
        if !LOD_RANGE.contains(&lod) {
            return Err(GridError::Lod { lod });
        }
        let extent = bounds.extent();
        let longest = extent.max_element();
        // Volumes must be normal numbers, too.
        let is_measurable = (longest * longest * longest).is_normal();
        if !(is_measurable && longest > 0.0 && pitch.is_finite() && bounds.min.is_finite()) {
            return Err(GridError::NoExtent { longest });
        }
        // A side that is a whole number of pitches to within rounding gets no extra ray.
        let counts = extent.to_array().map(|side| (side / pitch - 1e-9).ceil().max(1.0));
        let most = counts.into_iter().fold(1.0, f64::max);
        if most > f64::from(RAYS_MAX) {
            return Err(GridError::Resolution { rays: most as u64 });
        }
        let rays = counts.map(|count| count as u32);
        countable(rays)?;
        let shift = (LATTICE_MAX as u32 / most as u32).ilog2();
        let side = DVec3::new(f64::from(rays[0]), f64::from(rays[1]), f64::from(rays[2])) * pitch;
        let origin = bounds.min + 0.5 * (extent - side);
        Ok(Grid { origin, pitch, rays, shift, lod })
    }

    /// Returns a grid from its parts, as a file or a test gives them: rays of 2^`shift` lattice steps each, 2 ≤ shift ≤
    /// 29, with no side longer than [`LATTICE_MAX`], and of a pitch and a size for which f64 can compute volumes.
    pub fn from_parts(origin: DVec3, pitch: f64, rays: [u32; 3], shift: u32, lod: u32) -> Result<Grid, GridError> {
        if !LOD_RANGE.contains(&lod) {
            return Err(GridError::Lod { lod });
        }
        if !origin.is_finite() {
            return Err(GridError::Origin { origin });
        }
        let step_is_normal = (pitch / f64::from(1u32 << 30)).is_normal();
        if !(pitch.is_finite() && pitch > 0.0 && step_is_normal) {
            return Err(GridError::Pitch { pitch });
        }
        if !(2..=29).contains(&shift) {
            return Err(GridError::Shift { shift });
        }
        countable(rays)?;
        for n in rays {
            if !(1..=RAYS_MAX).contains(&n) {
                return Err(GridError::Resolution { rays: u64::from(n) });
            }
            if u64::from(n) << shift > LATTICE_MAX as u64 {
                return Err(GridError::Lattice { rays: n, shift });
            }
        }
        let longest = f64::from(rays[0].max(rays[1]).max(rays[2])) * pitch;
        match (longest * longest * longest).is_normal() {
            true => Ok(Grid { origin, pitch, rays, shift, lod }),
            false => Err(GridError::NoExtent { longest }),
        }
    }

    /// Returns the same grid, translated.
    pub fn translated(self, by: DVec3) -> Grid {
        Grid { origin: self.origin + by, ..self }
    }

    /// Returns the world position of lattice position (0, 0, 0).
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Returns the distance between neighbouring rays, in world units (h).
    pub fn pitch(&self) -> f64 {
        self.pitch
    }

    /// Returns the number of pixels along x, y and z.
    pub fn rays(&self) -> [u32; 3] {
        self.rays
    }

    /// Returns the exponent of the pixel size: a pixel is 2^shift lattice steps wide.
    pub fn shift(&self) -> u32 {
        self.shift
    }

    /// Returns LOD-C: the number of voxels that a ray is divided into for the over- and under-estimate.
    pub fn lod(&self) -> u32 {
        self.lod
    }

    /// Returns the world length of one lattice step, h / 2^shift.
    pub fn step(&self) -> f64 {
        self.pitch / f64::from(1u32 << self.shift)
    }

    /// Returns the largest distance by which snapping moves a vertex along one axis, in world units: one lattice step.
    pub fn quantisation(&self) -> f64 {
        self.step()
    }

    /// Returns the length of the grid along `coordinate`, in lattice steps.
    pub fn length(&self, coordinate: usize) -> i32 {
        (self.rays[coordinate] << self.shift) as i32
    }

    /// Returns the lattice length of one voxel along `axis`: even, and such that LOD-C of them span the whole grid.
    pub fn voxel(&self, axis: Axis) -> u32 {
        2 * (self.length(axis.depth()) as u32).div_ceil(2 * self.lod)
    }

    /// Returns the lattice position of the ray or node in pixel `index` of any axis; always odd.
    pub fn node(&self, index: u32) -> i32 {
        ((index << self.shift) + (1 << (self.shift - 1)) + 1) as i32
    }

    /// Returns the numbers of columns and rows of the image along `axis`.
    pub fn image_size(&self, axis: Axis) -> (u32, u32) {
        (self.rays[axis.column()], self.rays[axis.row()])
    }

    /// Snaps a checked mesh to the lattice: the only rounding of the input.
    pub fn quantise<'m>(&self, mesh: &'m ClosedMesh) -> Result<LatticeSolid<'m>, OutsideGrid> {
        self.snap_mesh(mesh.mesh(), Some(mesh.bounds()), Closure::Closed { oriented: mesh.oriented() })
    }

    /// Snaps a mesh that did not pass the check. Its rays may be unclosed; the image then lists them.
    ///
    /// # Panics
    /// Panics if a triangle's index is out of range.
    pub fn quantise_open<'m>(&self, mesh: &'m TriangleMesh) -> Result<LatticeSolid<'m>, OutsideGrid> {
        self.snap_mesh(mesh, mesh.bounds(), Closure::Open)
    }

    fn snap_mesh<'m>(
        &self,
        mesh: &'m TriangleMesh,
        bounds: Option<Aabb>,
        closure: Closure,
    ) -> Result<LatticeSolid<'m>, OutsideGrid> {
        let any_outside = AtomicBool::new(false);
        let scale = 1.0 / (2.0 * self.step());
        let mut positions = vec_with_room(mesh.positions.len());
        let snap = |world: &DVec3| {
            self.snap(*world, scale).unwrap_or_else(|| {
                any_outside.store(true, Ordering::Relaxed);
                [0; 3]
            })
        };
        mesh.positions.par_iter().with_min_len(1 << 14).map(snap).collect_into_vec(&mut positions);
        if any_outside.into_inner() {
            // Positions that no triangle uses do not count.
            let used = mesh.triangles.iter().flatten().map(|&v| v as usize);
            if let Some(vertex) = used.filter(|&v| self.snap(mesh.positions[v], scale).is_none()).min() {
                return Err(OutsideGrid { vertex, position: mesh.positions[vertex] });
            }
        }
        // Snapping is monotone, so the box of the snapped positions is the snapped box.
        let corner = |world: DVec3| self.snap(world, scale).unwrap_or_default();
        let bounds = bounds.map_or_else(LatticeBox::default, |b| LatticeBox { min: corner(b.min), max: corner(b.max) });
        let identity = NEXT_IDENTITY.fetch_add(1, Ordering::Relaxed);
        Ok(LatticeSolid {
            grid: *self,
            positions: Cow::Owned(positions),
            triangles: &mesh.triangles,
            closure,
            bounds,
            region: self.whole(),
            identity,
        })
    }

    /// Returns the box of the whole grid.
    fn whole(&self) -> LatticeBox {
        LatticeBox { min: [0; 3], max: [self.length(0), self.length(1), self.length(2)] }
    }

    /// Returns the even lattice position nearest to a world position, or `None` outside the grid. `scale` is the
    /// reciprocal of the even step.
    #[inline]
    fn snap(&self, world: DVec3, scale: f64) -> Option<[i32; 3]> {
        // Adding 3·2^51 rounds to an integer and leaves it in the low bits; a call to `round` costs ten times that.
        const MAGIC: f64 = 3.0 * (1u64 << 51) as f64;
        let half = (world - self.origin) * scale;
        let inside = |i: usize| half[i] > -0.5 && half[i] < f64::from(self.length(i) / 2) + 0.5;
        let even = |i: usize| 2 * (half[i] + MAGIC).to_bits() as i32;
        (inside(0) & inside(1) & inside(2)).then(|| [even(0), even(1), even(2)])
    }
}

/// Checks that the rays of every image can be counted in 32 bits.
fn countable(rays: [u32; 3]) -> Result<(), GridError> {
    let images = Axis::ALL.map(|axis| (rays[axis.column()], rays[axis.row()]));
    match images.into_iter().find(|&(columns, rows)| columns.checked_mul(rows).is_none()) {
        Some((columns, rows)) => Err(GridError::Rays { columns, rows }),
        None => Ok(()),
    }
}

/// A box on the lattice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LatticeBox {
    /// Least positions.
    pub min: [i32; 3],
    /// Greatest positions.
    pub max: [i32; 3],
}

impl LatticeBox {
    /// The empty box.
    pub const EMPTY: LatticeBox = LatticeBox { min: [0; 3], max: [-1; 3] };

    /// Returns whether the box is empty: a greatest position lies below a least.
    pub fn is_empty(&self) -> bool {
        (0..3).any(|i| self.max[i] < self.min[i])
    }

    /// Returns the smallest box around both; an empty one adds nothing.
    pub fn hull(&self, other: &LatticeBox) -> LatticeBox {
        match (self.is_empty(), other.is_empty()) {
            (true, _) => *other,
            (_, true) => *self,
            (false, false) => LatticeBox {
                min: std::array::from_fn(|i| self.min[i].min(other.min[i])),
                max: std::array::from_fn(|i| self.max[i].max(other.max[i])),
            },
        }
    }

    /// Returns the intersection of both boxes; it is empty, with a greatest position below a least, where they are
    /// disjoint.
    pub fn intersection(&self, other: &LatticeBox) -> LatticeBox {
        LatticeBox {
            min: std::array::from_fn(|i| self.min[i].max(other.min[i])),
            max: std::array::from_fn(|i| self.max[i].min(other.max[i])),
        }
    }
}

/// The known properties of the edges of a quantised mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Closure {
    /// Every edge has even valence, so every ray has an even count.
    Closed {
        /// Every edge is used as often in one direction as in the other, so winding numbers are defined.
        oriented: bool,
    },
    /// Nothing is known; rays may be unclosed.
    Open,
}

impl Closure {
    /// Returns whether winding numbers are known to be defined.
    pub fn is_oriented(self) -> bool {
        self == Closure::Closed { oriented: true }
    }
}

/// A mesh on the lattice of a [`Grid`]: the input of samplers.
///
/// [`Grid::quantise`] and [`Grid::quantise_open`] create one, so its positions are even, inside the grid, and identical where the
/// input's were. One that is moved to a part of its grid, as by a camera that shows a detail, extends beyond that by less than 2^30.
#[derive(Clone, Debug)]
pub struct LatticeSolid<'m> {
    grid: Grid,
    positions: Cow<'m, [[i32; 3]]>,
    triangles: &'m [[u32; 3]],
    closure: Closure,
    bounds: LatticeBox,
    region: LatticeBox,
    identity: u64,
}

/// The identity of the next solid.
static NEXT_IDENTITY: AtomicU64 = AtomicU64::new(0);

impl LatticeSolid<'_> {
    /// Wraps triangles that bound nothing by themselves: even positions inside `grid`, and indices into them.
    pub(crate) fn of_primitives<'p>(
        grid: &Grid,
        positions: &'p [[i32; 3]],
        triangles: &'p [[u32; 3]],
    ) -> LatticeSolid<'p> {
        let point = |&p: &[i32; 3]| LatticeBox { min: p, max: p };
        let bounds = positions.iter().map(point).fold(LatticeBox::EMPTY, |all, one| all.hull(&one));
        let identity = NEXT_IDENTITY.fetch_add(1, Ordering::Relaxed);
        LatticeSolid {
            grid: *grid,
            positions: Cow::Borrowed(positions),
            triangles,
            closure: Closure::Open,
            bounds,
            region: grid.whole(),
            identity,
        }
    }

    /// Returns the grid on which it was quantised.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Returns the even lattice positions; those that could not be placed belong to no triangle.
    pub fn positions(&self) -> &[[i32; 3]] {
        &self.positions
    }

    /// Returns three indices into [`positions`](Self::positions) for each triangle.
    pub fn triangles(&self) -> &[[u32; 3]] {
        self.triangles
    }

    /// Returns the box of the positions that its triangles use.
    pub fn bounds(&self) -> &LatticeBox {
        &self.bounds
    }

    /// Restricts sampling to the rays that meet a box; the other rays stay empty without being sampled. A solid that is
    /// intersected with a smaller one, or subtracted from it, need not be sampled beyond that one.
    pub fn within(mut self, region: &LatticeBox) -> Self {
        self.region = self.region.intersection(region);
        self
    }

    /// Returns the box outside of which rays stay empty.
    pub fn region(&self) -> &LatticeBox {
        &self.region
    }

    /// Returns the cosine of the angle between a triangle's normal and `axis`: |n·axis| of the unit normal; 0 for a
    /// triangle without area.
    #[inline]
    pub fn facing(&self, triangle: u32, axis: Axis) -> f64 {
        let [a, b, c] = self.triangles[triangle as usize].map(|v| {
            let p = self.positions[v as usize];
            DVec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]))
        });
        (b - a).cross(c - a).normalize_or_zero()[axis.depth()].abs()
    }

    /// Returns the unit normal of each triangle, (b − a) × (c − a), in world axes; zero for a triangle without area.
    pub fn normals(&self) -> Vec<[f32; 3]> {
        let normal = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|v| self.positions[v as usize]);
            let [u, v] = [b, c].map(|p| DVec3::from_array(std::array::from_fn(|i| f64::from(p[i] - a[i]))));
            u.cross(v).normalize_or_zero().as_vec3().to_array()
        };
        self.triangles.par_iter().with_min_len(1 << 12).map(normal).collect()
    }

    /// Returns a number that only copies of this solid share, whatever region they are restricted to. A cache of its
    /// geometry recognises the solid by that.
    pub fn identity(&self) -> u64 {
        self.identity
    }

    /// Returns the result of the mesh check for its edges.
    pub fn closure(&self) -> Closure {
        self.closure
    }
}
