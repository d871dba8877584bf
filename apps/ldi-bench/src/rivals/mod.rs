//! Earlier methods that sample a solid into layers, built for comparison with ours: their passes, their time and what they lose.
//!
//! All run on one thread of the CPU and draw by the same exact rasteriser, [`for_each_fragment`], which stands for the graphics
//! hardware of the papers. It covers one triangle after another, where [`CpuSampler`] covers small ones eight side by side. Their
//! depths are those of the lattice, finer than the 24 bits of a depth buffer, so that what they lose here is the least that they
//! lose. A fair comparison times [`CpuSampler`] in a pool of one thread.
//!
//! Two more are not built. Coherent layer peeling (N. Carr, R. Měch and G. Miller, Graphics Hardware 2008) peels several layers a
//! pass where the triangles are already sorted; see US patent 8,217,934. D. Wexler and others (GPU-accelerated high-quality
//! hidden surface removal, Graphics Hardware 2005) peel batches of a scene.

mod bucket;
mod contact;
mod freepipe;
mod kbuffer;
mod peeling;
mod stencil;
mod voxels;

use std::ops::Range;

use ldi_ops::fixed::{Crossing, DepthPlane, Pixels, for_each_run};
use ldi_ops::grid::{Axis, LatticeSolid};
use ldi_ops::ldi::Ldi;
#[cfg(doc)]
use ldi_ops::sampler::cpu::CpuSampler;
use serde::Serialize;

pub use contact::contact_volume;
pub use freepipe::FreePipe;
pub use peeling::DepthPeeling;
pub use stencil::StencilBuffer;

/// A method that samples a solid along an axis.
pub trait Rival: Sync {
    /// Returns the name in tables, with the limits that the method has.
    fn name(&self) -> &'static str;

    /// Returns the layers of all rays.
    fn sample(&self, solid: &LatticeSolid, axis: Axis) -> Layers;

    /// Returns the largest distance from a crossing to its layer, in lattice steps.
    fn tolerance(&self, _solid: &LatticeSolid, _axis: Axis) -> i32 {
        0
    }
}

/// Returns all rivals, each with its limits as published and, where it has another form, without them.
pub fn all() -> Vec<Box<dyn Rival>> {
    vec![
        Box::new(StencilBuffer::AS_PUBLISHED),
        Box::new(StencilBuffer::UNCAPPED),
        Box::new(FreePipe::FIXED),
        Box::new(FreePipe::COMPACT),
        Box::new(DepthPeeling),
        Box::new(bucket::BucketPeeling),
        Box::new(kbuffer::KBuffer::ONE_PASS),
        Box::new(kbuffer::KBuffer::ALL_PASSES),
        Box::new(stencil::RoutedABuffer::ONE_PASS),
        Box::new(stencil::RoutedABuffer::ALL_PASSES),
        Box::new(voxels::Voxelisation::PARITY),
        Box::new(voxels::Voxelisation::CONSERVATIVE),
    ]
}

/// The layers that a rival found: for each ray, crossings in the order of their depths.
pub struct Layers {
    offsets: Vec<u32>,
    crossings: Vec<Crossing>,
    /// How often the triangles were drawn.
    pub passes: u32,
}

impl Layers {
    /// Gathers the crossings found on `rays` rays, each with its ray, and sorts those of each ray.
    fn gather(rays: usize, found: &[(u32, Crossing)], passes: u32) -> Layers {
        let mut counts = vec![0; rays];
        found.iter().for_each(|&(ray, _)| counts[ray as usize] += 1);
        let mut layers = Layers::with_room(&counts, passes);
        counts.fill(0);
        for &(ray, crossing) in found {
            layers.put(ray as usize, &mut counts, crossing);
        }
        layers.sorted()
    }

    /// Returns layers with room for as many crossings on each ray as `counts` says.
    fn with_room(counts: &[u32], passes: u32) -> Layers {
        let mut sum = 0;
        let ends = counts.iter().map(|count| {
            sum += count;
            sum
        });
        let offsets: Vec<u32> = std::iter::once(0).chain(ends).collect();
        let crossings = vec![Crossing::default(); *offsets.last().expect("offsets start with 0") as usize];
        Layers { offsets, crossings, passes }
    }

    /// Stores a crossing behind those that its ray has by now, which `filled` counts.
    #[inline]
    fn put(&mut self, ray: usize, filled: &mut [u32], crossing: Crossing) {
        self.crossings[(self.offsets[ray] + filled[ray]) as usize] = crossing;
        filled[ray] += 1;
    }

    fn sorted(mut self) -> Layers {
        for ends in self.offsets.windows(2) {
            self.crossings[ends[0] as usize..ends[1] as usize].sort_unstable();
        }
        self
    }

    /// Returns the crossings on a ray.
    pub fn on_ray(&self, ray: usize) -> &[Crossing] {
        &self.crossings[self.offsets[ray] as usize..self.offsets[ray + 1] as usize]
    }
}

/// Returns the number of rays of the image along an axis.
fn rays(solid: &LatticeSolid, axis: Axis) -> usize {
    let (columns, rows) = solid.grid().image_size(axis);
    columns as usize * rows as usize
}

/// Calls `emit` with the ray and the crossing of every fragment within the region of the solid, in the order of the triangles.
pub fn for_each_fragment(solid: &LatticeSolid, axis: Axis, mut emit: impl FnMut(usize, Crossing)) {
    if solid.region().is_empty() {
        return;
    }
    let pixels = Pixels::new(solid.grid().shift());
    let width = solid.grid().image_size(axis).0 as i32;
    let within = |i: usize| pixels.index_from(solid.region().min[i])..pixels.index_from(solid.region().max[i]);
    let (columns, rows) = (within(axis.column()), within(axis.row()));
    for triangle in solid.triangles() {
        let seen = triangle.map(|vertex| {
            let position = solid.positions()[vertex as usize];
            [axis.column(), axis.row(), axis.depth()].map(|i| position[i])
        });
        let ends = |i: usize, within: &Range<i32>| {
            let [a, b, c] = seen.map(|corner| corner[i]);
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            pixels.index_from(low).max(within.start)..pixels.index_from(high).min(within.end)
        };
        if ends(0, &columns).is_empty() | ends(1, &rows).is_empty() {
            continue;
        }
        let mut plane = None;
        for_each_run(&seen, pixels, &rows, |row, covered| {
            let plane: &DepthPlane = plane.get_or_insert_with(|| DepthPlane::new(&seen, axis));
            for column in covered.start.max(columns.start)..covered.end.min(columns.end) {
                emit((row * width + column) as usize, plane.crossing(pixels.ray(column), pixels.ray(row)));
            }
        });
    }
}

/// The difference between a rival's layers and the exact image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Comparison {
    /// Samples of the exact image without a layer.
    pub lost: u64,
    /// Layers without a sample of the exact image.
    pub extra: u64,
    /// Rays with an odd number of layers.
    pub unclosed: u64,
    /// Rays with lost samples or extra layers.
    pub differing: u64,
    /// Length inside the solid in lattice steps, on the rays that close.
    pub length: i64,
    /// The same in the exact image, on the same rays.
    pub exact_length: i64,
    /// How often the triangles were drawn.
    pub passes: u32,
}

impl Comparison {
    /// Compares layers with the exact image of the same solid. A layer matches a sample no further than `tolerance` away.
    pub fn new(exact: &Ldi, layers: &Layers, tolerance: i32) -> Comparison {
        let mut all = Comparison { passes: layers.passes, ..Comparison::default() };
        for ray in 0..exact.rays() {
            let ours = exact.samples(ray);
            let theirs: Vec<i32> = layers.on_ray(ray as usize).iter().map(|crossing| crossing.nearest()).collect();
            let matches = matches(ours, &theirs, tolerance);
            let (lost, extra) = (ours.len() - matches, theirs.len() - matches);
            all.lost += lost as u64;
            all.extra += extra as u64;
            all.differing += u64::from(lost + extra > 0);
            if theirs.len().is_multiple_of(2) {
                all.length += length(&theirs);
                all.exact_length += length(ours);
            } else {
                all.unclosed += 1;
            }
        }
        all
    }

    /// Returns the sums over two images.
    pub fn plus(self, other: Comparison) -> Comparison {
        Comparison {
            lost: self.lost + other.lost,
            extra: self.extra + other.extra,
            unclosed: self.unclosed + other.unclosed,
            differing: self.differing + other.differing,
            length: self.length + other.length,
            exact_length: self.exact_length + other.exact_length,
            passes: self.passes + other.passes,
        }
    }
}

/// Returns how many depths of two sorted lists pair up within a tolerance, each depth once.
fn matches(a: &[i32], b: &[i32], tolerance: i32) -> usize {
    let (mut i, mut j, mut count) = (0, 0, 0);
    while i < a.len() && j < b.len() {
        let difference = a[i] - b[j];
        let is_match = difference.abs() <= tolerance;
        count += usize::from(is_match);
        i += usize::from(is_match || difference < 0);
        j += usize::from(is_match || difference > 0);
    }
    count
}

/// Returns the length inside the solid, of an even number of sorted depths.
fn length(depths: &[i32]) -> i64 {
    depths.chunks_exact(2).map(|pair| i64::from(pair[1] - pair[0])).sum()
}

#[cfg(test)]
mod tests;
