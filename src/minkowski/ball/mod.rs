//! Offsets by a true ball: solids grown and shrunk by a radius, with round edges and corners that no polyhedron represents.
//!
//! A ⊕ ball is covered by three kinds of **patches**, those of a sum of polyhedra in the limit of ever finer balls:
//! facets of A, shifted by the radius along their normals; parts of **tubes** about convex edges, with normals between those
//! of the edge's two facets; and parts of spheres, **caps**, at vertices, with the normals n for which n·(u − v) ≤ 0 for all
//! neighbours u of the vertex v. So most edges and vertices of a smooth mesh give patches no larger than its facets, and
//! reflex edges and saddle points give none.
//!
//! Crossings of patches with rays are calculated in `f64`, each relative to its own feature, to a few millionths of a lattice
//! step. Patches are widened by a small part of a step, so that no ray slips through between two of them. That is harmless: the
//! whole tube and the whole sphere belong to the closed sum, and the sum lies behind every one of their points. A widened facet
//! may protrude by the square of that part over twice the radius. The radius is an even number of lattice steps, as positions
//! are. So no node lies on a sphere, since three odd squares do not add up to a multiple of four, nor on a shifted facet whose
//! unit normal is rational, and no ray runs within a facet: regular solids meet the rays without ties, and the three axes agree
//! about nodes.
//!
//! Rounding to the lattice can flip a triangle that is only a few steps high, as surfaces made of cells have them by the dozen.
//! The edges on both of its sides are then reflex by their facets' normals, although these very edges are nearest to outside
//! points: a tube is missing, and a ray passes through the gap. Around such **doubtful** vertices the outer side of a facet is
//! not used. Every edge carries the tube of the normals that lead away from both of its facets, and thin or folded facets are
//! shifted to either side. These are more patches than necessary and harmless, for the same reason as widening.
//!
//! A rejected first design rounded shifted facets to the lattice and covered them exactly, as meshes are. The facets on two
//! sides of an edge are then rounded by different amounts, and one ray in a million passed through slits of one lattice step:
//! one for every few passes over a fine mesh, and one is enough to spoil a flood.
//!
//! Shrinking by a ball is growing the complement: patches of [`Polyhedron::complement`], with [`Exterior::In`](super::Exterior::In).
//! Shells that overlap unite as they grow, but cannot be shrunk: the part of one inside another has no complement behind it.

mod cap;
mod cone;
mod cubes;
mod facet;
mod features;
mod gather;
mod membership;
mod probe;
#[cfg(test)]
mod tests;
mod tube;
mod view;

use crate::parallel::*;
use glam::DVec3;

use super::Polyhedron;
use crate::fixed::Pixels;
use crate::ldi::{Ldi, LdiError};
use cap::Cap;
use facet::Facet;
use features::Features;
pub use membership::BallMembership;
pub use probe::BallProbe;
use tube::Tube;

/// Widening of patches, in lattice steps.
const WIDENED: f64 = 1.0 / 256.0;

/// The least widening where a patch is seen so obliquely that the calculation is no more accurate.
const LEAST_WIDENED: f64 = 1e-6;

/// The height, in lattice steps, below which the normal of a triangle is unreliable: rounding has moved its corners by a step
/// or two, and where a file had them in `f32`, by dozens.
const THIN: f64 = 256.0;

/// Rounds a radius to an even number of lattice steps, and at least two.
pub fn rounded_radius(steps: f64) -> f64 {
    (2.0 * (0.5 * steps).round()).max(2.0)
}

/// The patches that cover the boundary of a polyhedron ⊕ a ball.
///
/// They are numbered: the facets as triangles of the polyhedron, then those shifted to the other side, then tubes, then caps.
#[derive(Debug)]
pub struct BallPatches<'s> {
    radius: f64,
    solid: &'s Polyhedron,
    /// By triangle; zero for one without area.
    normals: Vec<DVec3>,
    /// Triangles that are also shifted to their other side.
    turned: Vec<u32>,
    tubes: Vec<Tube>,
    caps: Vec<Cap>,
    /// Edge directions of caps.
    spokes: Vec<DVec3>,
}

/// A patch of any kind.
enum Patch<'p> {
    Facet(Facet),
    Tube(&'p Tube),
    Cap(&'p Cap),
}

/// Number of patches of each kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PatchCounts {
    /// Facets, shifted; some of them to both sides.
    pub facets: usize,
    /// Parts of cylinders about convex edges.
    pub tubes: usize,
    /// Parts of spheres about vertices.
    pub caps: usize,
}

impl<'s> BallPatches<'s> {
    /// Finds the patches of a solid and a ball whose radius is `radius_steps` lattice steps, subject to
    /// [rounding](rounded_radius).
    pub fn new(solid: &'s Polyhedron, radius_steps: f64) -> BallPatches<'s> {
        let radius = rounded_radius(radius_steps);
        let normal = |&[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(|vertex| solid.positions()[vertex as usize]);
            let (normal, height) = facet::normal_and_height(a, b, c);
            (normal, height < THIN)
        };
        let (mut normals, mut is_thin) = (Vec::new(), Vec::new());
        let found = solid.triangles().par_iter().with_min_len(1 << 12).map(normal);
        found.unzip_into_vecs(&mut normals, &mut is_thin);
        let Features { turned, tubes, caps, spokes } = features::find(solid, &normals, &is_thin, radius);
        BallPatches { radius, solid, normals, turned, tubes, caps, spokes }
    }

    /// Returns the radius, in lattice steps.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Returns the number of patches of each kind.
    pub fn counts(&self) -> PatchCounts {
        let facets = self.normals.len() + self.turned.len();
        PatchCounts { facets, tubes: self.tubes.len(), caps: self.caps.len() }
    }

    /// Returns the unit normal, away from the polyhedron, of a patch at a lattice position on it.
    pub fn normal(&self, patch: u32, point: DVec3) -> DVec3 {
        match self.patch(patch) {
            Patch::Facet(facet) => facet.normal,
            Patch::Tube(tube) => tube.normal(point),
            Patch::Cap(cap) => cap.normal(point),
        }
    }

    /// Returns the patch with a number.
    fn patch(&self, number: u32) -> Patch<'_> {
        let number = number as usize;
        let Some(after) = number.checked_sub(self.normals.len()) else { return Patch::Facet(self.facet(number)) };
        let Some(tube) = after.checked_sub(self.turned.len()) else {
            return Patch::Facet(self.facet(self.turned[after] as usize).turned());
        };
        match tube.checked_sub(self.tubes.len()) {
            None => Patch::Tube(&self.tubes[tube]),
            Some(cap) => Patch::Cap(&self.caps[cap]),
        }
    }

    fn facet(&self, triangle: usize) -> Facet {
        let corners = self.solid.triangles()[triangle].map(|vertex| self.solid.positions()[vertex as usize]);
        Facet { corners, normal: self.normals[triangle] }
    }

    /// Computes normals for the samples of images whose [`triangles`](Ldi::triangles) are patches: each sample gets a number of
    /// its own, across the images, in place of its patch's, and a unit normal in world axes under that number. Samples of
    /// images without triangles get the normal zero.
    pub fn sample_normals(&self, images: [Ldi; 3]) -> Result<([Ldi; 3], Vec<[f32; 3]>), LdiError> {
        self.sample_normals_from([0; 3], images)
    }

    /// Computes the same for images whose lattice begins at a position of the polyhedron's, such as those of a box of finer pixels.
    pub(crate) fn sample_normals_from(
        &self,
        origin: [i32; 3],
        images: [Ldi; 3],
    ) -> Result<([Ldi; 3], Vec<[f32; 3]>), LdiError> {
        let mut normals = Vec::with_capacity(images.iter().map(|image| image.depths().len()).sum());
        let mut numbered = Vec::with_capacity(3);
        for image in images {
            let first = normals.len() as u32;
            self.append_normals(origin, &image, &mut normals);
            numbered.push(image.with_triangles((first..normals.len() as u32).collect())?);
        }
        Ok((numbered.try_into().expect("three images went in"), normals))
    }

    fn append_normals(&self, origin: [i32; 3], image: &Ldi, normals: &mut Vec<[f32; 3]>) {
        let Some(patches) = image.triangles() else {
            return normals.resize(normals.len() + image.depths().len(), [0.0; 3]);
        };
        let (axis, (columns, rows)) = (image.axis(), image.size());
        let pixels = Pixels::new(image.grid().shift());
        let of_row = |row: u32| -> Vec<[f32; 3]> {
            let mut found = Vec::new();
            for column in 0..columns {
                let ray = row * columns + column;
                let first = image.offsets()[ray as usize] as usize;
                for (patch, &depth) in patches[first..].iter().zip(image.samples(ray)) {
                    let mut point = origin;
                    point[axis.column()] += pixels.ray(column as i32);
                    point[axis.row()] += pixels.ray(row as i32);
                    point[axis.depth()] += depth;
                    found.push(self.normal(*patch, exact(point)).as_vec3().to_array());
                }
            }
            found
        };
        let rows: Vec<Vec<[f32; 3]>> = (0..rows).into_par_iter().map(of_row).collect();
        rows.iter().for_each(|row| normals.extend_from_slice(row));
    }
}

/// Converts a lattice position, or the difference of two, exactly.
fn exact([x, y, z]: [i32; 3]) -> DVec3 {
    DVec3::new(f64::from(x), f64::from(y), f64::from(z))
}

/// Returns the difference from one lattice position to another, exactly.
fn difference(from: [i32; 3], to: [i32; 3]) -> DVec3 {
    exact(to) - exact(from)
}
