//! The contents of a picture: one image of the result, the skins that its samples lie on, and optionally a cutting plane.

use glam::{DVec3, Vec3};

use super::camera::Camera;
use super::canvas::Colour;
use crate::ldi::Ldi;

/// The surface of one input as plain arrays, independent of the mesh type.
#[derive(Clone, Copy, Debug)]
pub struct Skin<'a> {
    /// Lattice positions on the camera's grid.
    pub positions: &'a [[i32; 3]],
    /// Three indices into `positions` for each triangle.
    pub triangles: &'a [[u32; 3]],
    /// The colour of the surface.
    pub tint: Colour,
}

/// A plane in the coordinates of the view. The side that its normal points to is removed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    normal: DVec3,
    offset: f64,
}

impl Cut {
    /// Creates the plane of all p with `normal` · p = `offset`, oriented so that the side of the eye is removed.
    pub fn facing_the_eye(normal: DVec3, offset: f64) -> Cut {
        let sign = if normal.z < 0.0 { -1.0 } else { 1.0 };
        Cut { normal: sign * normal, offset: sign * offset }
    }

    pub(super) fn normal(&self) -> Vec3 {
        self.normal.normalize_or_zero().as_vec3()
    }
}

/// The input of a picture. Nothing in it depends on the backend that sampled the image.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// The camera whose grid the image lies on.
    pub camera: &'a Camera,
    /// The exact image of the result along z on the camera's grid, each sample with its triangle; triangles are numbered
    /// consecutively over all skins in their order.
    pub image: &'a Ldi,
    /// The inputs.
    pub skins: &'a [Skin<'a>],
    /// A plane that cuts the solid open.
    pub cut: Option<Cut>,
    /// The colour of the cut face.
    pub cut_tint: Colour,
}

/// The first visible point of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Hit {
    /// The sample with this index.
    Sample { depth: i32, sample: u32 },
    /// The plane of the cut, inside the solid.
    Cut { depth: i32 },
}

impl Hit {
    pub fn depth(self) -> i32 {
        match self {
            Hit::Sample { depth, .. } | Hit::Cut { depth } => depth,
        }
    }
}

impl Scene<'_> {
    /// Returns the triangle of a sample.
    pub(super) fn triangle(&self, sample: u32) -> u32 {
        let triangles = self.image.triangles().expect("an image that is shaded knows its triangles");
        triangles[sample as usize]
    }

    /// Returns the depth up to which a ray is kept.
    pub(super) fn limit(&self, ray: u32) -> i32 {
        let Some(Cut { normal, offset }) = self.cut else { return i32::MAX };
        let grid = self.camera.grid();
        let (columns, _) = self.image.size();
        let at = |index: u32, i: usize| grid.origin()[i] + f64::from(grid.node(index)) * grid.step();
        let rest = offset - normal.x * at(ray % columns, 0) - normal.y * at(ray / columns, 1);
        // A plane parallel to the line of sight removes whole rays.
        let depth = if normal.z > 1e-12 { rest / normal.z } else { rest.signum() * f64::INFINITY };
        ((depth - grid.origin().z) / grid.step()).clamp(f64::from(i32::MIN), f64::from(i32::MAX)) as i32
    }

    /// Returns the visible point of a ray.
    pub(super) fn hit(&self, ray: u32) -> Option<Hit> {
        let samples = self.image.samples(ray);
        if samples.is_empty() {
            return None;
        }
        let (limit, first) = (self.limit(ray), self.image.offsets()[ray as usize]);
        let spans = samples.chunks_exact(2).enumerate().rev();
        // Spans of zero length are two coincident faces, which are invisible.
        spans
            .filter(|(_, span)| span[0] < span[1] && span[0] < limit)
            .map(|(i, span)| match span[1] > limit {
                true => Hit::Cut { depth: limit },
                false => Hit::Sample { depth: span[1], sample: first + 2 * i as u32 + 1 },
            })
            .next()
    }
}
