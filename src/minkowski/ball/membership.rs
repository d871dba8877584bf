//! Point membership in an offset solid.

use crate::parallel::*;
use glam::DVec3;

use super::{exact, rounded_radius};
use crate::closest::ClosestTriangle;
use crate::fixed::Pixels;
use crate::grid::{Axis, Grid, LatticeSolid};
use crate::ldi::Ldi;
use crate::minkowski::{Exterior, Membership, Polyhedron};
use crate::sampler::cpu::CpuSampler;
use crate::sampler::{FillRule, Mode, SampleError, Sampler};

/// The exact membership test of a polyhedron dilated by a ball.
///
/// Near the surface a tree of triangles decides; a point farther from every triangle than the radius is in or out with the
/// polyhedron itself, which its exact images decide.
pub struct BallMembership {
    pub(super) radius: f64,
    pub(super) exterior: Exterior,
    /// `None` where there are no triangles.
    pub(super) surface: Option<ClosestTriangle>,
    /// The exact images of the polyhedron, along x, y and z or along z alone.
    images: Vec<Ldi>,
}

impl BallMembership {
    /// Builds the test for the sum of a polyhedron on a grid, with the [`Exterior`] side around it, and a ball with a radius of
    /// `radius_steps` lattice steps, subject to [rounding](rounded_radius).
    pub fn new(
        grid: &Grid,
        solid: &Polyhedron,
        radius_steps: f64,
        exterior: Exterior,
    ) -> Result<BallMembership, SampleError> {
        BallMembership::with_images(&Axis::ALL, grid, solid, (radius_steps, exterior))
    }

    /// Builds the same with an image along z alone, which decides about nodes. Only a [`BallProbe`](super::BallProbe) of it tests points
    /// that lie on any rays.
    pub(crate) fn between_rays(
        grid: &Grid,
        solid: &Polyhedron,
        radius_steps: f64,
        exterior: Exterior,
    ) -> Result<BallMembership, SampleError> {
        BallMembership::with_images(&[Axis::Z], grid, solid, (radius_steps, exterior))
    }

    fn with_images(
        axes: &[Axis],
        grid: &Grid,
        solid: &Polyhedron,
        (radius_steps, exterior): (f64, Exterior),
    ) -> Result<BallMembership, SampleError> {
        let corner = |&vertex: &u32| exact(solid.positions()[vertex as usize]);
        let triangles = || solid.triangles().par_iter().map(|triangle| [0, 1, 2].map(|i| corner(&triangle[i])));
        let surface = || {
            let triangles: Vec<[DVec3; 3]> = triangles().collect();
            (!triangles.is_empty()).then(|| ClosestTriangle::new(&triangles))
        };
        let sample = || -> Result<Vec<Ldi>, SampleError> {
            let lattice = LatticeSolid::of_primitives(grid, solid.positions(), solid.triangles());
            let sampler = CpuSampler::default();
            let image = |&axis: &Axis| sampler.sample(&lattice, axis, Mode::Exact, FillRule::NonZero);
            axes.iter().map(image).collect()
        };
        let (surface, images) = join(surface, sample);
        Ok(BallMembership { radius: rounded_radius(radius_steps), exterior, surface, images: images? })
    }

    /// Returns whether a point is no farther than the radius from a triangle.
    pub(super) fn is_near(&self, point: [i32; 3]) -> bool {
        self.surface.as_ref().is_some_and(|surface| surface.any_within(exact(point), self.radius))
    }

    /// Returns the distance of a point from the nearest triangle.
    #[cfg(test)]
    pub(in crate::minkowski) fn distance(&self, point: DVec3) -> f64 {
        self.surface.as_ref().map_or(f64::INFINITY, |surface| surface.of(point, 0).squared.sqrt())
    }

    /// Returns whether a point that is farther than the radius from every triangle is in the polyhedron, without its outer side: as the
    /// node next to it is, if that is nearer than the radius, by a step for rounding. `None` if it is not.
    pub(super) fn inside_by_node(&self, point: [i32; 3]) -> Option<bool> {
        let grid = self.images.first()?.grid();
        let pixels = Pixels::new(grid.shift());
        let node = [0, 1, 2].map(|i| {
            let index = (point[i] - pixels.first + (1 << (pixels.shift - 1))) >> pixels.shift;
            pixels.ray(index.clamp(0, grid.rays()[i] as i32 - 1))
        });
        (exact(node).distance(exact(point)) < self.radius - 1.0).then(|| self.inside_by_rays(node))?
    }

    /// Returns whether a point is in the polyhedron, without its outer side; `None` for one that lies on no ray.
    pub(super) fn inside_by_rays(&self, point: [i32; 3]) -> Option<bool> {
        let pixels = Pixels::new(self.images.first()?.grid().shift());
        let ray_of = |coordinate: usize| {
            let index = pixels.index_from(point[coordinate]);
            (pixels.ray(index) == point[coordinate]).then_some(index as u32)
        };
        let ray_in = |image: &Ldi| {
            let axis = image.axis();
            let (columns, _) = image.size();
            Some((ray_of(axis.row())? * columns + ray_of(axis.column())?, point[axis.depth()]))
        };
        let (image, ray, depth) =
            self.images.iter().find_map(|image| ray_in(image).map(|(ray, depth)| (image, ray, depth)))?;
        let is_within = image.samples(ray).partition_point(|&sample| sample < depth) % 2 == 1;
        Some(is_within != (self.exterior == Exterior::In))
    }
}

impl Membership for BallMembership {
    type Memory = ();

    fn contains(&self, point: [i32; 3], (): &mut ()) -> bool {
        self.is_near(point) || self.inside_by_rays(point).expect("the point is on a ray")
    }
}
