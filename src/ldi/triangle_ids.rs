//! The triangle of each sample of an image that was made without triangles.
//!
//! The depths of conservative images, and of images derived from them, are those of crossings, rounded outwards or
//! inwards by no more than one even lattice step. So a sample's triangle is that of the exact crossing beside it, and
//! images need not carry triangles through masks and merges.

use crate::parallel::*;

use super::{Ldi, LdiError};

/// The index for a sample without a known triangle.
pub const NO_TRIANGLE: u32 = u32::MAX;

/// Largest distance of a sample from its crossing, in lattice steps.
const ROUNDED: i32 = 2;

/// Number of rays that one task processes.
const RAYS: usize = 1 << 12;

impl Ldi {
    /// Returns the same image with triangles: those of the nearest samples of exact images of the same rays, which
    /// [carry them](Ldi::triangles). Each exact image comes with an offset that is added to its triangle indices. A
    /// sample without a neighbour gets [`NO_TRIANGLE`]; of several at the same distance, that of the first image and
    /// the least depth counts.
    pub fn with_triangles_of(mut self, exact: &[(&Ldi, u32)]) -> Result<Ldi, LdiError> {
        for (image, _) in exact {
            if image.grid() != self.grid() || image.axis() != self.axis() {
                return Err(LdiError::RaysDiffer);
            }
            let found = image.triangles.len();
            if found != image.depths.len() {
                return Err(LdiError::TriangleCount { found, samples: image.depths.len() });
            }
        }
        let mut triangles = vec![NO_TRIANGLE; self.depths.len()];
        let mut rest = &mut triangles[..];
        let mut parts = Vec::new();
        for first in (0..self.rays() as usize).step_by(RAYS) {
            let end = (first + RAYS).min(self.rays() as usize);
            let (part, after) = rest.split_at_mut((self.offsets[end] - self.offsets[first]) as usize);
            parts.push((first as u32..end as u32, part));
            rest = after;
        }
        parts.into_par_iter().for_each(|(rays, part)| {
            let base = self.offsets[rays.start as usize] as usize;
            for ray in rays {
                let place = self.offsets[ray as usize] as usize - base;
                for (triangle, &depth) in part[place..].iter_mut().zip(self.samples(ray)) {
                    *triangle = nearest(exact, ray, depth);
                }
            }
        });
        self.triangles = triangles;
        Ok(self)
    }
}

/// Returns the triangle of the sample that is nearest to a depth on one ray.
fn nearest(exact: &[(&Ldi, u32)], ray: u32, depth: i32) -> u32 {
    let mut best = (ROUNDED + 1, NO_TRIANGLE);
    for (image, first) in exact {
        let samples = image.samples(ray);
        let from = samples.partition_point(|&sample| sample < depth - ROUNDED);
        for (at, &sample) in samples.iter().enumerate().skip(from).take_while(|(_, sample)| **sample <= depth + ROUNDED)
        {
            let apart = (sample - depth).abs();
            if apart < best.0 {
                best = (apart, first + image.triangles[image.offsets[ray as usize] as usize + at]);
            }
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boolean::{BooleanOperation, merge};
    use crate::grid::{Axis, Grid};
    use crate::mesh::ClosedMesh;
    use crate::sampler::cpu::CpuSampler;
    use crate::sampler::{Estimate, FillRule, MaskIntersection, Mode, Sampler};
    use crate::solids;

    #[test]
    fn samples_of_an_estimate_have_the_triangle_of_their_crossing() {
        let torus = ClosedMesh::check(solids::torus(3.0, 1.0, 31, 17).unwrap()).unwrap();
        let ball = ClosedMesh::check(solids::geodesic(2.9, 6).unwrap()).unwrap();
        let grid = Grid::with_resolution(torus.bounds().union(ball.bounds()), 50, 64).unwrap();
        let solids = [&torus, &ball].map(|mesh| grid.quantise(mesh).unwrap());
        let sampler = CpuSampler::default();
        for axis in Axis::ALL {
            let exact = solids.each_ref().map(|solid| sampler.sample_surface(solid, axis, FillRule::EvenOdd).unwrap());
            for estimate in [Estimate::Over, Estimate::Under] {
                let mode = Mode::Estimate(estimate);
                let [a, b] =
                    solids.each_ref().map(|solid| sampler.sample(solid, axis, mode, FillRule::EvenOdd).unwrap());
                let merged = merge(BooleanOperation::Union, &a, &b).unwrap();
                let [solid_a, solid_b] = &solids;
                let masks = sampler.sample_intersection([solid_a, solid_b], axis, estimate, FillRule::EvenOdd).unwrap();
                for image in [merged, masks] {
                    let depths = image.depths().to_vec();
                    let image = image.with_triangles_of(&[(&exact[0], 0), (&exact[1], 10_000)]).unwrap();
                    assert_eq!(image.depths(), depths);
                    let triangles = image.triangles().unwrap();
                    assert!(triangles.iter().any(|&t| t < 10_000) && triangles.iter().any(|&t| t >= 10_000));
                    for ray in 0..image.rays() {
                        let range = image.offsets()[ray as usize] as usize..image.offsets()[ray as usize + 1] as usize;
                        for (&depth, &triangle) in depths[range.clone()].iter().zip(&triangles[range]) {
                            assert_ne!(triangle, NO_TRIANGLE);
                            let (image, number) = match triangle < 10_000 {
                                true => (&exact[0], triangle),
                                false => (&exact[1], triangle - 10_000),
                            };
                            let first = image.offsets()[ray as usize] as usize;
                            let of_ray = (first..).zip(image.samples(ray));
                            let mut of_ray = of_ray.filter(|(at, _)| image.triangles().unwrap()[*at] == number);
                            assert!(of_ray.any(|(_, sample)| (sample - depth).abs() <= ROUNDED));
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn images_of_other_rays_or_without_triangles_are_refused() {
        let torus = ClosedMesh::check(solids::torus(3.0, 1.0, 31, 17).unwrap()).unwrap();
        let grid = Grid::with_resolution(torus.bounds(), 20, 64).unwrap();
        let solid = grid.quantise(&torus).unwrap();
        let plain = |axis| CpuSampler::default().sample(&solid, axis, Mode::Exact, FillRule::EvenOdd).unwrap();
        let along_y = CpuSampler::default().sample_surface(&solid, Axis::Y, FillRule::EvenOdd).unwrap();
        assert_eq!(plain(Axis::X).with_triangles_of(&[(&along_y, 0)]).unwrap_err(), LdiError::RaysDiffer);
        let without = plain(Axis::X).with_triangles_of(&[(&plain(Axis::X), 0)]).unwrap_err();
        assert!(matches!(without, LdiError::TriangleCount { found: 0, .. }));
        let none = plain(Axis::X).with_triangles_of(&[]).unwrap();
        assert!(none.triangles().unwrap().iter().all(|&triangle| triangle == NO_TRIANGLE));
    }
}
