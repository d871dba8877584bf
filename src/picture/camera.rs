//! Cameras: a rotation that turns the direction of sight onto an axis, and the raster behind the pixels of a picture.
//!
//! In the coordinates of a view x points right, y up and z towards the eye, so that rays along +z, as in images, run towards
//! the eye and the *last* sample of a ray is visible. The projection is orthographic: a scale bar holds everywhere in the
//! picture.
//!
//! Solids are placed on a raster around all of them. Images lie on the part of it that the picture shows: a detail of large solids
//! has no more rays than all of them.

use std::f64::consts::FRAC_1_SQRT_2;
use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use glam::{DMat3, DVec3};

use crate::grid::{Axis, Grid, GridError, LATTICE_MAX, LatticeSolid, RAYS_MAX};

/// The direction that a solid is seen from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum View {
    /// From the direction (1, −1, 1), so that the three axes look equally long.
    Isometric,
    /// From the positive end of an axis.
    From(Axis),
    /// From the negative end of an axis.
    FromBelow(Axis),
    /// From a direction given by two angles in degrees.
    Angles {
        /// The angle about z, from +x towards +y.
        azimuth: f64,
        /// The angle above the plane of x and y.
        elevation: f64,
    },
}

/// A text that is not a view.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{text}` is not a view; views are iso, x, y, z, -x, -y, -z, or degrees as 'azimuth,elevation', the latter from -90 to 90"
)]
pub struct ViewError {
    text: String,
}

impl FromStr for View {
    type Err = ViewError;

    fn from_str(text: &str) -> Result<View, ViewError> {
        match text {
            "iso" => return Ok(View::Isometric),
            "x" | "+x" => return Ok(View::From(Axis::X)),
            "y" | "+y" => return Ok(View::From(Axis::Y)),
            "z" | "+z" => return Ok(View::From(Axis::Z)),
            "-x" => return Ok(View::FromBelow(Axis::X)),
            "-y" => return Ok(View::FromBelow(Axis::Y)),
            "-z" => return Ok(View::FromBelow(Axis::Z)),
            _ => {}
        }
        let angles = text.split_once(',').and_then(|(azimuth, elevation)| {
            Some((azimuth.trim().parse::<f64>().ok()?, elevation.trim().parse::<f64>().ok()?))
        });
        match angles {
            Some((azimuth, elevation)) if azimuth.is_finite() && (-90.0..=90.0).contains(&elevation) => {
                Ok(View::Angles { azimuth, elevation })
            }
            _ => Err(ViewError { text: text.to_owned() }),
        }
    }
}

impl fmt::Display for View {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            View::Isometric => write!(f, "iso"),
            View::From(axis) => write!(f, "{}", axis.name()),
            View::FromBelow(axis) => write!(f, "-{}", axis.name()),
            View::Angles { azimuth, elevation } => write!(f, "{azimuth},{elevation}"),
        }
    }
}

impl View {
    /// Returns the rotation from world coordinates to those of the view. Along an axis it is a permutation with signs, which
    /// causes no rounding.
    pub fn rotation(self) -> DMat3 {
        let rows = |right, up, eye| DMat3::from_cols(right, up, eye).transpose();
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        match self {
            View::From(Axis::X) => rows(y, z, x),
            View::FromBelow(Axis::X) => rows(-y, z, -x),
            View::From(Axis::Y) => rows(-x, z, y),
            View::FromBelow(Axis::Y) => rows(x, z, -y),
            View::From(Axis::Z) => rows(x, y, z),
            View::FromBelow(Axis::Z) => rows(-x, y, -z),
            View::Isometric => {
                let right = DVec3::new(FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0);
                let eye = DVec3::new(1.0, -1.0, 1.0).normalize();
                rows(right, eye.cross(right), eye)
            }
            View::Angles { azimuth, elevation } => {
                let ((sin_a, cos_a), (sin_e, cos_e)) =
                    (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
                let right = DVec3::new(-sin_a, cos_a, 0.0);
                let eye = DVec3::new(cos_a * cos_e, sin_a * cos_e, sin_e);
                rows(right, eye.cross(right), eye)
            }
        }
    }
}

/// A box in the coordinates of a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewBox {
    /// Least coordinates.
    pub min: DVec3,
    /// Greatest coordinates.
    pub max: DVec3,
}

/// The size of a picture and its supersampling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    /// Pixels from left to right.
    pub width: u32,
    /// Pixels from top to bottom.
    pub height: u32,
    /// Rays along one side of a pixel; a pixel is the mean of the square of this number of rays.
    pub supersampling: u32,
}

/// The possible sides of a picture, in pixels.
pub const SIDES: std::ops::RangeInclusive<u32> = 16..=16_384;

/// The possible numbers of rays along one side of a pixel.
pub const SUPERSAMPLING: std::ops::RangeInclusive<u32> = 1..=8;

/// The reason why a picture cannot be taken.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// A side of the picture is too short or too long.
    #[error("a picture of {width} × {height} pixels is outside {} to {} pixels a side", SIDES.start(), SIDES.end())]
    Size {
        /// Pixels from left to right.
        width: u32,
        /// Pixels from top to bottom.
        height: u32,
    },
    /// Too few or too many rays along a side of a pixel.
    #[error("{rays} rays along a side of a pixel are outside {} to {}", SUPERSAMPLING.start(), SUPERSAMPLING.end())]
    Supersampling {
        /// The requested number.
        rays: u32,
    },
    /// The picture shows no part of the solids.
    #[error("the subject of the picture lies outside of all solids")]
    Outside,
    /// No grid is possible.
    #[error(transparent)]
    Grid(#[from] GridError),
}

/// The share of a picture's shorter side that is left free all around.
const MARGIN: f64 = 0.05;

/// The share of the picture's height that is left for the scale bar below.
const FOOT: f64 = 0.07;

/// The rays behind a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    format: Format,
    /// A raster around all solids.
    raster: Grid,
    /// Its columns and rows that the picture shows.
    window: [Range<u32>; 2],
    /// The grid of these.
    grid: Grid,
    /// Column and row of the ray at the lower left corner of the picture; they lie outside the grid where the raster ends.
    corner: [i64; 2],
}

impl Camera {
    /// Aims a camera so that its picture shows `subject` as large as possible, on a raster around `all` solids.
    pub fn aim(format: Format, subject: ViewBox, all: ViewBox) -> Result<Camera, CameraError> {
        let Format { width, height, supersampling } = format;
        if !(SIDES.contains(&width) && SIDES.contains(&height)) {
            return Err(CameraError::Size { width, height });
        }
        if !SUPERSAMPLING.contains(&supersampling) {
            return Err(CameraError::Supersampling { rays: supersampling });
        }
        let margin = MARGIN * f64::from(width.min(height));
        let foot = FOOT * f64::from(height);
        let room = [f64::from(width) - 2.0 * margin, f64::from(height) - 2.0 * margin - foot];
        let extent = subject.max - subject.min;
        let longest = extent.max_element();
        let pixel = (extent.x / room[0]).max(extent.y / room[1]).max(1e-6 * longest);
        if !(pixel.is_normal() && pixel > 0.0) {
            return Err(GridError::NoExtent { longest }.into());
        }
        let pitch = pixel / f64::from(supersampling);
        let raster = lay(all, pitch)?;
        let middle = 0.5 * (subject.min + subject.max);
        let pixels = [0.5 * f64::from(width), 0.5 * (f64::from(height) + foot)];
        let corner = [0, 1].map(|i| {
            ((middle[i] - raster.origin()[i]) / pitch).round() as i64
                - (pixels[i] * f64::from(supersampling)).round() as i64
        });
        let window = [0, 1].map(|i| {
            let shown = i64::from([width, height][i]) * i64::from(supersampling);
            let within = |at: i64| at.clamp(0, i64::from(raster.rays()[i])) as u32;
            within(corner[i])..within(corner[i] + shown)
        });
        if window.iter().any(Range::is_empty) {
            return Err(CameraError::Outside);
        }
        let [columns, rows] = window.clone();
        let corner = [0, 1].map(|i| corner[i] - i64::from(window[i].start));
        let grid = raster.part(&[columns, rows, 0..raster.rays()[2]]);
        Ok(Camera { format, raster, window, grid, corner })
    }

    /// Returns the size of the picture.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Returns the grid that solids are quantised on, to be [seen](Camera::see) by this camera.
    pub fn raster(&self) -> &Grid {
        &self.raster
    }

    /// Returns a solid on the grid of this camera, from one on its [raster](Camera::raster).
    pub fn see<'m>(&self, solid: &LatticeSolid<'m>) -> LatticeSolid<'m> {
        assert!(solid.grid() == &self.raster, "the solid lies on the camera's raster");
        solid.within_pixels(&self.window)
    }

    /// Returns the grid that images of this camera are sampled on, along [`Axis::Z`].
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Returns the side of a pixel, in world units.
    pub fn pixel(&self) -> f64 {
        self.grid.pitch() * f64::from(self.format.supersampling)
    }

    /// Returns the position of a point of the view in the picture, in pixels to the right and downwards.
    pub fn place(&self, point: DVec3) -> [f64; 2] {
        let s = f64::from(self.format.supersampling);
        let at = |i: usize| ((point[i] - self.grid.origin()[i]) / self.grid.pitch() - self.corner[i] as f64) / s;
        [at(0), f64::from(self.format.height) - at(1)]
    }

    /// Returns the ray of subpixel (`x`, `y`), counted from the upper left corner of the picture; `None` outside the grid.
    pub fn ray(&self, x: u32, y: u32) -> Option<u32> {
        let from_below = i64::from(self.format.height * self.format.supersampling - 1 - y);
        let (column, row) = (i64::from(x) + self.corner[0], from_below + self.corner[1]);
        let (columns, rows) = self.grid.image_size(Axis::Z);
        let inside = (0..i64::from(columns)).contains(&column) && (0..i64::from(rows)).contains(&row);
        inside.then(|| row as u32 * columns + column as u32)
    }
}

/// Level of detail of the grid. Images of a camera are exact, which needs no voxels; grids have them all the same.
const LOD: u32 = 1024;

/// Returns a grid around a box, one ray wider than it on every side so that rounding leaves nothing outside.
fn lay(all: ViewBox, pitch: f64) -> Result<Grid, GridError> {
    let mut rays = [0; 3];
    for (i, rays) in rays.iter_mut().enumerate() {
        let count = ((all.max[i] - all.min[i]) / pitch).ceil() + 2.0;
        if count.is_nan() || count > f64::from(RAYS_MAX) {
            return Err(GridError::Resolution { rays: count as u64 });
        }
        *rays = count as u32;
    }
    let most = rays[0].max(rays[1]).max(rays[2]);
    let shift = (LATTICE_MAX as u32 / most).ilog2();
    Grid::from_parts(all.min - DVec3::splat(pitch), pitch, rays, shift, LOD)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL_AXES: [View; 6] = [
        View::From(Axis::X),
        View::From(Axis::Y),
        View::From(Axis::Z),
        View::FromBelow(Axis::X),
        View::FromBelow(Axis::Y),
        View::FromBelow(Axis::Z),
    ];

    #[test]
    fn every_view_is_a_rotation() {
        let angles = [(0.0, 0.0), (30.0, 20.0), (200.0, -90.0), (-45.0, 90.0)];
        let angles = angles.map(|(azimuth, elevation)| View::Angles { azimuth, elevation });
        for view in ALL_AXES.into_iter().chain(angles).chain([View::Isometric]) {
            let rotation = view.rotation();
            assert!((rotation.determinant() - 1.0).abs() < 1e-12, "{view:?}");
            let unit = rotation * rotation.transpose();
            assert!(unit.abs_diff_eq(DMat3::IDENTITY, 1e-12), "{view:?}");
        }
    }

    #[test]
    fn the_eye_lies_in_the_direction_of_the_view() {
        let eye = |view: View| view.rotation().transpose() * DVec3::Z;
        assert_eq!(eye(View::From(Axis::Y)), DVec3::Y);
        assert_eq!(eye(View::FromBelow(Axis::X)), -DVec3::X);
        assert!(eye(View::Isometric).abs_diff_eq(DVec3::new(1.0, -1.0, 1.0).normalize(), 1e-12));
        let isometric = View::Angles { azimuth: -45.0, elevation: 0.5_f64.sqrt().atan().to_degrees() };
        assert!(isometric.rotation().abs_diff_eq(View::Isometric.rotation(), 1e-12));
        let along_x = View::Angles { azimuth: 0.0, elevation: 0.0 };
        assert!(along_x.rotation().abs_diff_eq(View::From(Axis::X).rotation(), 1e-12));
    }

    #[test]
    fn views_are_parsed() {
        assert_eq!("iso".parse(), Ok(View::Isometric));
        assert_eq!("-y".parse(), Ok(View::FromBelow(Axis::Y)));
        assert_eq!("30, -12.5".parse(), Ok(View::Angles { azimuth: 30.0, elevation: -12.5 }));
        for wrong in ["", "w", "30", "30,91", "nan,0", "1,2,3"] {
            assert!(wrong.parse::<View>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_subject_lies_within_the_margins() {
        let format = Format { width: 400, height: 300, supersampling: 2 };
        let all = ViewBox { min: DVec3::new(-5.0, -5.0, 0.0), max: DVec3::new(5.0, 5.0, 3.0) };
        let subject = ViewBox { min: DVec3::new(0.0, 1.0, 0.0), max: DVec3::new(2.0, 4.0, 3.0) };
        let camera = Camera::aim(format, subject, all).unwrap();
        let ([left, bottom], [right, top]) = (camera.place(subject.min), camera.place(subject.max));
        assert!(((left + right) / 2.0 - 200.0).abs() < 1.0 && left > 15.0);
        assert!((top - 15.0).abs() < 1.0 && (bottom - (285.0 - 21.0)).abs() < 1.0, "{top} {bottom}");
        // The ray of a subpixel runs where the subpixel is.
        let (x, y) = (right as u32 * 2, top as u32 * 2);
        let ray = camera.ray(x, y).unwrap();
        let (columns, _) = camera.grid().image_size(Axis::Z);
        let world = camera.grid().origin().x + (f64::from(ray % columns) + 0.5) * camera.grid().pitch();
        assert!((camera.place(DVec3::new(world, 0.0, 0.0))[0] - f64::from(x) / 2.0 - 0.25).abs() < 1e-6);
    }

    #[test]
    fn images_have_the_rays_of_the_picture_alone() {
        let format = Format { width: 64, height: 48, supersampling: 2 };
        let all = ViewBox { min: DVec3::ZERO, max: DVec3::splat(100.0) };
        for corner in [0.0, 40.0, 98.0] {
            let subject = ViewBox { min: DVec3::splat(corner), max: DVec3::splat(corner + 2.0) };
            let camera = Camera::aim(format, subject, all).unwrap();
            let [width, height, depth] = camera.grid().rays();
            assert!(width <= 128 && height <= 96 && depth == camera.raster().rays()[2]);
            // Where solids may be, subpixels have rays.
            let [x, y] = camera.place(DVec3::splat(corner + 1.0)).map(|at| 2 * at as u32);
            let ray = camera.ray(x, y).unwrap();
            let column = f64::from(ray % width) + 0.5;
            let world = camera.grid().origin().x + column * camera.grid().pitch();
            assert!((world - corner - 1.0).abs() < camera.pixel(), "{world}");
        }
        let beside = ViewBox { min: DVec3::splat(200.0), max: DVec3::splat(202.0) };
        assert_eq!(Camera::aim(format, beside, all), Err(CameraError::Outside));
    }

    #[test]
    fn impossible_picture_sizes_and_subjects_are_refused() {
        let cube = ViewBox { min: DVec3::ZERO, max: DVec3::ONE };
        let aim = |width, supersampling| Camera::aim(Format { width, height: 100, supersampling }, cube, cube);
        assert_eq!(aim(8, 1), Err(CameraError::Size { width: 8, height: 100 }));
        assert_eq!(aim(100, 9), Err(CameraError::Supersampling { rays: 9 }));
        let point = ViewBox { min: DVec3::ONE, max: DVec3::ONE };
        assert!(matches!(
            Camera::aim(Format { width: 100, height: 100, supersampling: 1 }, point, cube),
            Err(CameraError::Grid(GridError::NoExtent { .. }))
        ));
    }
}
