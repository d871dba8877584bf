//! Offsets by a true ball: solids grown and shrunk by a radius, with round edges and corners that no polyhedron stands for.
//!
//! A ⊕ ball is covered by three kinds of **patches**, those of a sum of polyhedra in the limit of ever finer balls:
//! facets of A, shifted by the radius along their normals; parts of **tubes** about convex edges, with normals between those
//! of the edge's two facets; and parts of spheres, **caps**, at vertices, with the normals n for which n·(u − v) ≤ 0 for all
//! neighbours u of the vertex v. So most edges and vertices of a smooth mesh give patches no larger than its facets, and
//! reflex edges and saddle points give none.
//!
//! Patches meet the rays in depths that are calculated in `f64`, each relative to its own feature, to a few millionths of a
//! lattice step. They are widened by a small part of a step, so that no ray slips through between two of them. That does no
//! harm: the whole tube and the whole sphere belong to the closed sum, and behind every one of their points lies the sum. What
//! a widened facet may stick out by is the square of that part over twice the radius. The radius is a whole even number of
//! lattice steps, as positions are. So no node lies on a sphere, since three odd squares do not add up to one that four divides,
//! nor on a shifted facet whose unit normal is rational, and no ray runs within a facet: what is regular does not meet the rays
//! in ties, and the three axes agree about nodes.
//!
//! What was tried first was to round shifted facets to the lattice and cover them exactly, as meshes are. The facets on two
//! sides of an edge are rounded by different amounts then, and through slits of one lattice step there went one ray in a
//! million: one for every few passes over a fine mesh, and one is enough to spoil a flood.
//!
//! Facets that rounding may have turned over are shifted to both sides, and edges at them carry all of the tube that supports
//! every facet there, as do edges at facets without area; see [`cull`](super::cull). Behind all of that lies the sum, too.
//!
//! Shrinking by a ball is growing the complement: patches of [`Polyhedron::complement`], with
//! [`Outer::In`](super::Outer::In). Shells that overlap unite as they grow, but cannot be shrunk: what of one lies inside
//! another has no complement behind it.

mod cap;
mod cone;
mod facet;
mod features;
mod gather;
mod membership;
#[cfg(test)]
mod tests;
mod tube;
mod view;

use glam::DVec3;
use rayon::prelude::*;

use super::Polyhedron;
use super::polyhedron::may_be_turned;
use crate::fixed::Pixels;
use crate::ldi::{Ldi, LdiError};
use cap::Cap;
use facet::Facet;
pub use membership::BallMembership;
use tube::Tube;

/// How far patches are widened, in lattice steps.
const WIDENED: f64 = 1.0 / 256.0;

/// The least widening where a patch is seen so obliquely that calculation is no better.
const LEAST_WIDENED: f64 = 1e-6;

/// A radius as it is used: an even number of lattice steps, and not zero.
pub fn rounded_radius(steps: f64) -> f64 {
    (2.0 * (0.5 * steps).round()).max(2.0)
}

/// The patches that cover the boundary of a polyhedron ⊕ a ball.
///
/// They are numbered: the facets as triangles of the polyhedron, then tubes, then caps, then facets once more that are seen
/// from behind.
#[derive(Debug)]
pub struct BallPatches<'s> {
    radius: f64,
    solid: &'s Polyhedron,
    /// By triangle; zero for one without area.
    normals: Vec<DVec3>,
    tubes: Vec<Tube>,
    caps: Vec<Cap>,
    /// Edge directions of caps.
    spokes: Vec<DVec3>,
    /// Triangles that count from behind, too, since rounding may have turned them over; ascending.
    backs: Vec<u32>,
}

/// A patch by what it is.
enum Patch<'p> {
    Facet(Facet),
    Tube(&'p Tube),
    Cap(&'p Cap),
}

/// How many patches there are of each kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PatchCounts {
    /// Facets, shifted; some to both sides.
    pub facets: usize,
    /// Parts of cylinders about convex edges.
    pub tubes: usize,
    /// Parts of spheres about vertices.
    pub caps: usize,
}

impl<'s> BallPatches<'s> {
    /// The patches of a solid and a ball whose radius is `radius_steps` lattice steps but for [rounding](rounded_radius).
    pub fn new(solid: &'s Polyhedron, radius_steps: f64) -> BallPatches<'s> {
        let radius = rounded_radius(radius_steps);
        let normal = |&[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(|vertex| solid.positions()[vertex as usize]);
            facet::unit_normal(a, b, c)
        };
        let normals: Vec<DVec3> = solid.triangles().par_iter().with_min_len(1 << 12).map(normal).collect();
        let is_back = |&triangle: &u32| {
            may_be_turned(solid.triangles()[triangle as usize].map(|vertex| solid.positions()[vertex as usize]))
        };
        let triangles = (0..solid.triangles().len() as u32).into_par_iter().with_min_len(1 << 12);
        let backs: Vec<u32> = triangles.filter(is_back).collect();
        let features::Features { tubes, caps, spokes } = features::find(solid, &normals, &backs, radius);
        BallPatches { radius, solid, normals, tubes, caps, spokes, backs }
    }

    /// The radius, in lattice steps.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// How many patches there are.
    pub fn counts(&self) -> PatchCounts {
        PatchCounts { facets: self.normals.len() + self.backs.len(), tubes: self.tubes.len(), caps: self.caps.len() }
    }

    /// The unit normal, away from the polyhedron, of a patch at a lattice position on it.
    pub fn normal(&self, patch: u32, point: DVec3) -> DVec3 {
        match self.kind(patch) {
            Patch::Facet(facet) => facet.normal,
            Patch::Tube(tube) => tube.normal(point),
            Patch::Cap(cap) => cap.normal(point),
        }
    }

    /// The patch of a number.
    #[inline]
    fn kind(&self, patch: u32) -> Patch<'_> {
        let patch = patch as usize;
        let Some(tube) = patch.checked_sub(self.normals.len()) else { return Patch::Facet(self.facet(patch)) };
        let Some(cap) = tube.checked_sub(self.tubes.len()) else { return Patch::Tube(&self.tubes[tube]) };
        match cap.checked_sub(self.caps.len()) {
            None => Patch::Cap(&self.caps[cap]),
            Some(back) => Patch::Facet(self.facet(self.backs[back] as usize).reversed()),
        }
    }

    fn facet(&self, triangle: usize) -> Facet {
        let corners = self.solid.triangles()[triangle].map(|vertex| self.solid.positions()[vertex as usize]);
        Facet { corners, normal: self.normals[triangle] }
    }

    /// Normals for the samples of images whose [`triangles`](Ldi::triangles) are patches: each sample gets a number of its
    /// own, across the images, in place of its patch's, and a unit normal in world axes under that number. Samples of images
    /// without triangles get the normal zero.
    pub fn sample_normals(&self, images: [Ldi; 3]) -> Result<([Ldi; 3], Vec<[f32; 3]>), LdiError> {
        let mut normals = Vec::with_capacity(images.iter().map(|image| image.depths().len()).sum());
        let mut numbered = Vec::with_capacity(3);
        for image in images {
            let first = normals.len() as u32;
            self.append_normals(&image, &mut normals);
            numbered.push(image.with_triangles((first..normals.len() as u32).collect())?);
        }
        Ok((numbered.try_into().expect("three images went in"), normals))
    }

    fn append_normals(&self, image: &Ldi, normals: &mut Vec<[f32; 3]>) {
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
                    let mut point = DVec3::ZERO;
                    point[axis.column()] = f64::from(pixels.ray(column as i32));
                    point[axis.row()] = f64::from(pixels.ray(row as i32));
                    point[axis.depth()] = f64::from(depth);
                    found.push(self.normal(*patch, point).as_vec3().to_array());
                }
            }
            found
        };
        let rows: Vec<Vec<[f32; 3]>> = (0..rows).into_par_iter().map(of_row).collect();
        rows.iter().for_each(|row| normals.extend_from_slice(row));
    }
}

/// A lattice position, or the difference of two, exactly.
fn exact([x, y, z]: [i32; 3]) -> DVec3 {
    DVec3::new(f64::from(x), f64::from(y), f64::from(z))
}

/// From one lattice position to another, exactly.
fn difference(from: [i32; 3], to: [i32; 3]) -> DVec3 {
    exact(to) - exact(from)
}
