//! The solid's surface within a region, prepared for sums over it: facets, each with the part of its area that counts.
//!
//! # From facets and from hits
//! Where the region is a box that holds the whole mesh, every facet counts with its area ([`Source::Facets`]), except those
//! that lie in a face of the box: the solid was cut there, and they are not surface.
//!
//! Otherwise rays determine the areas. A surface element of area a meets a·|n·d|/h² rays along the axis d, and the squares of a
//! unit normal's components sum to one; so h²·Σ |n·d| over the hits of rays along all three axes is an unbiased estimate of the
//! area, and each hit lies either in the region or beyond ([`Source::Hits`]). Hits are gathered by facet, so that both methods
//! give the same data, and as integers, so that threads change no bit of it. A sum over a few facets has the noise of a count;
//! one over a whole scaffold at 256 rays is accurate to a few tenths of a percent.
//!
//! Where the images show every facet, as they do unless shells overlap or the image is that of a Boolean, the hits of *all*
//! facets estimate an area that is known. [`Scale::ToMesh`] multiplies by the ratio of the two, which removes most of the
//! noise.

#[cfg(test)]
pub(super) mod tests;

use std::sync::atomic::{AtomicU32, Ordering};

use crate::parallel::*;
use glam::DVec3;

use super::segments::flush;
use super::{Facets, Region};
use crate::cancel::checkpoint;
use crate::integrate::shows_every_facet;
use crate::ldi::Ldi;

/// Facets in one task. Part of the result, since it determines the order of additions.
const CHUNK: usize = 1 << 13;

/// The source of the areas of facets within a region.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Source {
    /// The mesh: the whole area of a facet that is not in a face of the box.
    Facets,
    /// The hits of rays within the region.
    Hits,
}

/// The factor that hits are multiplied by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scale {
    /// No factor: an unbiased estimate for any images.
    Counted,
    /// The area of the mesh over that estimated from all hits, within the region or not: less noise. For images of all rays
    /// (not [`within`](crate::grid::LatticeSolid::within) a box), whose samples are all crossings of the mesh: under the
    /// even-odd rule or without overlaps.
    ToMesh,
}

/// The reason why the facets of a mesh are not the surface within a region.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// The region is bounded by a mesh, which may cut facets anywhere.
    #[error("the region is not a box")]
    NotABox,
    /// A facet extends beyond the box.
    #[error("facet {facet} has a corner at {position}, outside the box of the region")]
    Beyond {
        /// Index of the first such facet.
        facet: usize,
        /// The corner.
        position: DVec3,
    },
}

/// The facets of a mesh with the areas that they have within a region.
#[derive(Clone, Debug)]
pub struct SurfaceElements<'a> {
    facets: &'a Facets<'a>,
    areas: Vec<f64>,
    source: Source,
}

impl<'a> SurfaceElements<'a> {
    /// Returns the surface within a region by the better method: facets where a box holds the mesh and the images show every
    /// facet, else hits. The images must contain all rays, including those beyond the region.
    ///
    /// # Panics
    /// As [`of_hits`](Self::of_hits).
    pub fn within(facets: &'a Facets<'a>, images: &[Ldi; 3], region: &Region) -> SurfaceElements<'a> {
        match images.iter().all(shows_every_facet) {
            true => SurfaceElements::of_facets(facets, region)
                .unwrap_or_else(|_| SurfaceElements::of_hits(facets, images, region, Scale::ToMesh)),
            false => SurfaceElements::of_hits(facets, images, region, Scale::Counted),
        }
    }

    /// Returns the surface within a box that holds the whole mesh: every facet that does not lie in a face of the box.
    ///
    /// # Errors
    /// If the region is not a box, or does not hold the mesh.
    pub fn of_facets(facets: &'a Facets<'a>, region: &Region) -> Result<SurfaceElements<'a>, SurfaceError> {
        let is_cut = cut_facets(facets, region)?;
        let areas = facets.areas.iter().zip(is_cut).map(|(&area, is_cut)| if is_cut { 0.0 } else { area }).collect();
        Ok(SurfaceElements { facets, areas, source: Source::Facets })
    }

    /// Returns the surface within any region, from the exact images along x, y and z: h²·|n·d| for each hit strictly inside. Of
    /// samples at one depth only an odd number bounds the solid, and hits in the region's boundary do not count.
    ///
    /// # Panics
    /// If the images were sampled without triangles, or name triangles that are not among the facets.
    pub fn of_hits(facets: &'a Facets<'a>, images: &[Ldi; 3], region: &Region, scale: Scale) -> SurfaceElements<'a> {
        let mut areas = vec![0.0; facets.areas.len()];
        let mut all = 0.0;
        for image in images {
            let Hits { within, of_all } = Hits::of(image, region, facets.areas.len());
            let (section, depth) = (image.grid().pitch() * image.grid().pitch(), image.axis().depth());
            let weight = |facet: usize| section * facets.normals[facet][depth].abs();
            areas.par_iter_mut().enumerate().with_min_len(CHUNK).for_each(|(facet, area)| {
                *area += weight(facet) * f64::from(within[facet]);
            });
            all += in_chunks(of_all.len(), &|facet| weight(facet) * f64::from(of_all[facet]));
        }
        if scale == Scale::ToMesh && all > 0.0 {
            let ratio = in_chunks(facets.areas.len(), &|facet| facets.areas[facet]) / all;
            areas.par_iter_mut().with_min_len(CHUNK).for_each(|area| *area *= ratio);
        }
        SurfaceElements { facets, areas, source: Source::Hits }
    }

    /// Returns BS, the area of the surface within the region, in square world units.
    pub fn area(&self) -> f64 {
        in_chunks(self.areas.len(), &|facet| self.areas[facet])
    }

    /// Returns the area of each facet within the region, in square world units.
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// Returns the facets.
    pub fn facets(&self) -> &'a Facets<'a> {
        self.facets
    }

    /// Returns the source of the areas.
    pub fn source(&self) -> Source {
        self.source
    }
}

/// Returns a sum over facets, in an order that does not depend on the number of threads.
pub(super) fn in_chunks(length: usize, term: &(dyn Fn(usize) -> f64 + Sync)) -> f64 {
    let chunk = |c: usize| {
        checkpoint();
        (c * CHUNK..length.min((c + 1) * CHUNK)).map(term).sum::<f64>()
    };
    let sums: Vec<f64> = (0..length.div_ceil(CHUNK)).into_par_iter().map(chunk).collect();
    sums.iter().sum()
}

/// Returns for each facet whether it lies in a face of a box that holds the whole mesh.
pub(super) fn cut_facets(facets: &Facets, region: &Region) -> Result<Vec<bool>, SurfaceError> {
    let faces = BoxFaces::of(region).ok_or(SurfaceError::NotABox)?;
    let all = || (0..facets.triangles.len()).into_par_iter().with_min_len(CHUNK);
    let beyond = |facet: usize| facets.corners(facet).into_iter().find(|&p| !faces.hold(p)).map(|p| (facet, p));
    match all().find_map_first(beyond) {
        Some((facet, position)) => Err(SurfaceError::Beyond { facet, position }),
        None => Ok(all().map(|facet| faces.contain(facets.corners(facet))).collect()),
    }
}

/// The faces of a box, in world units, and the tolerance within which a position lies in one.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxFaces {
    min: DVec3,
    max: DVec3,
    tolerance: f64,
}

impl BoxFaces {
    /// Returns the faces of a region that is a box.
    pub fn of(region: &Region) -> Option<BoxFaces> {
        let (grid, bounds) = (region.grid(), region.bounds());
        let place = |corner: [i32; 3]| grid.origin() + grid.step() * DVec3::from_array(corner.map(f64::from));
        let faces = || BoxFaces {
            min: place(bounds.min),
            max: place(bounds.max),
            tolerance: grid.step() * f64::from(flush(grid)),
        };
        region.is_box().then(faces)
    }

    /// Returns whether a position lies in the box or on it.
    pub fn hold(&self, p: DVec3) -> bool {
        p.cmpge(self.min - self.tolerance).all() && p.cmple(self.max + self.tolerance).all()
    }

    /// Returns the number of axes on which a position lies in a face.
    pub fn axes_on(&self, p: DVec3) -> u32 {
        (0..3).map(|axis| u32::from(self.is_on(axis, self.min, p) || self.is_on(axis, self.max, p))).sum()
    }

    /// Returns whether a facet lies in one face.
    pub fn contain(&self, corners: [DVec3; 3]) -> bool {
        (0..3).any(|axis| [self.min, self.max].iter().any(|&face| corners.iter().all(|&p| self.is_on(axis, face, p))))
    }

    fn is_on(&self, axis: usize, face: DVec3, p: DVec3) -> bool {
        (p[axis] - face[axis]).abs() <= self.tolerance
    }
}

/// The numbers of hits of each facet, by the rays of an image, where it bounds the solid.
struct Hits {
    within: Vec<u32>,
    of_all: Vec<u32>,
}

impl Hits {
    fn of(image: &Ldi, region: &Region, facets: usize) -> Hits {
        let triangles = image.triangles().expect("the image was sampled with triangles");
        let counts = || -> Vec<AtomicU32> { (0..facets).map(|_| AtomicU32::new(0)).collect() };
        let (within, of_all) = (counts(), counts());
        let (columns, rows) = image.size();
        let flush = flush(image.grid());
        (0..rows).into_par_iter().for_each(|row| {
            checkpoint();
            for ray in row * columns..(row + 1) * columns {
                let (mut at, samples) = (image.offsets()[ray as usize] as usize, image.samples(ray));
                let mut spans = region.spans(image.axis(), ray).peekable();
                for at_one_depth in samples.chunk_by(|a, b| a == b) {
                    let (depth, facet) = (at_one_depth[0], triangles[at] as usize);
                    at += at_one_depth.len();
                    if at_one_depth.len() % 2 == 0 {
                        continue;
                    }
                    // Counts are integers: their order does not matter.
                    of_all[facet].fetch_add(1, Ordering::Relaxed);
                    while spans.next_if(|&(_, end)| end <= depth).is_some() {}
                    if spans.peek().is_some_and(|&(start, end)| start + flush < depth && depth < end - flush) {
                        within[facet].fetch_add(1, Ordering::Relaxed);
                    }
                }
            }
        });
        let read = |counts: Vec<AtomicU32>| counts.into_iter().map(AtomicU32::into_inner).collect();
        Hits { within: read(within), of_all: read(of_all) }
    }
}
