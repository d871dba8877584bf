//! Images of a shape, and the results computed from them.

use std::path::Path;

use crate::parallel::*;
use glam::{DMat3, DVec3};

use crate::driver::bound::Bound;
use crate::driver::job::Finish;
#[cfg(feature = "npz")]
use crate::driver::job::{Content, ImageTarget};
use crate::driver::machine;
use crate::driver::measure::mean_moments;
use crate::driver::measured::{Measured, Seconds};
use crate::driver::memory::{self, Cost, Limit};
use crate::driver::surface::{self, SurfaceReport};
use crate::driver::write;
use crate::grid::{Axis, Grid};
use crate::integrate;
use crate::ldi::{Ldi, NodePlanes, coverage};
use crate::length::Length;
use crate::mesh::io::Format;
use crate::mesh::{LengthUnit, Precision, TriangleMesh};
use crate::metrics::distance::{Crossings, DistanceField};
use crate::metrics::thickness::local_thickness;
use crate::metrics::{BoundaryCondition, Region};
use crate::progress;
#[cfg(feature = "npz")]
use crate::voxels;
use crate::{Error, Estimate, Mode, Monitor, Progress, Warning};

/// The images of a shape along the requested axes, with their settings and inputs.
#[derive(Debug)]
pub struct Sampled {
    measured: Measured,
}

/// The first and second moments of a solid of unit density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidMoments {
    /// The centre of mass, in units of length; NaN where there is no volume.
    pub centroid: DVec3,
    /// The inertia about the centroid, in fifth powers of the unit of length.
    pub inertia: DMat3,
}

/// Bytes for each voxel: of its state with the bits of all images; of a share; of a thickness with the distances and the balls
/// behind it.
const BYTES_OF_VOXEL: f64 = 1.5;
const BYTES_OF_SHARE: f64 = 4.0;
const BYTES_OF_THICKNESS: f64 = 48.0;

/// Voxels: the inside state of each lattice node.
#[derive(Clone, Debug, PartialEq)]
pub struct Voxels {
    /// Voxels along x, y and z.
    pub size: [usize; 3],
    /// The centre of the first voxel.
    pub origin: DVec3,
    /// The distance between neighbouring centres.
    pub spacing: f64,
    /// 1 inside and 0 outside, of voxel (x, y, z) at `(x · size[1] + y) · size[2] + z`.
    pub values: Vec<u8>,
}

impl Sampled {
    pub(crate) fn new(measured: Measured) -> Sampled {
        Sampled { measured }
    }

    /// Returns the volume of the images.
    pub fn volume(&self) -> Estimate {
        self.measured.estimate()
    }

    /// Returns the surface area of the mesh of the images, in square units.
    ///
    /// # Errors
    /// Those of [`surface`](Sampled::surface).
    pub fn area(&self) -> Result<f64, Error> {
        Ok(self.surface()?.within(Bound::ZERO).mesh()?.area())
    }

    /// Returns the moments: the mean over the images.
    pub fn moments(&self) -> SolidMoments {
        let moments: Vec<_> = self.measured.images.iter().map(integrate::moments).collect();
        let (centroid, inertia) = mean_moments(&moments);
        SolidMoments { centroid, inertia }
    }

    /// Returns the image along an axis, if it was requested.
    pub fn image(&self, axis: Axis) -> Option<&Ldi> {
        self.measured.images.iter().find(|image| image.axis() == axis)
    }

    /// Returns the raster.
    pub fn grid(&self) -> &Grid {
        &self.measured.grid
    }

    /// Returns the unit of all lengths, where it is known.
    pub fn unit(&self) -> Option<LengthUnit> {
        self.measured.unit
    }

    /// Returns the surface of the solid, which can be written or returned as a mesh. It is not computed yet.
    ///
    /// # Errors
    /// Images that do not cover all three axes.
    pub fn surface(&self) -> Result<SurfaceMesh<'_>, Error> {
        match self.measured.images.len() {
            3 => Ok(SurfaceMesh { measured: &self.measured, finish: Finish::default(), progress: None }),
            _ => Err(Error::Usage("a surface needs images along all axes: keep all axes in Settings::axes".to_owned())),
        }
    }

    /// Returns the inside state of all lattice nodes, as dense voxels.
    pub fn voxels(&self) -> Voxels {
        let planes = NodePlanes::new(&self.measured.images, self.measured.mode).expect("the images are of one grid");
        let grid = self.grid();
        let origin = grid.origin() + DVec3::splat(grid.step() * f64::from(grid.node(0)));
        let size = grid.rays().map(|n| n as usize);
        Voxels { size, origin, spacing: grid.pitch(), values: planes.to_bytes() }
    }

    /// Returns the inside state of all lattice nodes, unless they do not fit into memory.
    ///
    /// # Errors
    /// Voxels that do not fit into memory.
    pub fn try_voxels(&self) -> Result<Voxels, Error> {
        self.admit(BYTES_OF_VOXEL)?;
        Ok(self.voxels())
    }

    /// Returns for each voxel the share of it that is inside along the rays through its centre, the mean over the images; in the
    /// order of [`Voxels::values`].
    ///
    /// # Errors
    /// Voxels that do not fit into memory.
    pub fn coverage(&self) -> Result<Vec<f32>, Error> {
        self.admit(BYTES_OF_SHARE)?;
        Ok(coverage(&self.measured.images))
    }

    /// Refuses results with so many bytes for each voxel that do not fit into memory.
    fn admit(&self, bytes: f64) -> Result<(), Error> {
        let [x, y, z] = self.grid().rays();
        let voxels = f64::from(x) * f64::from(y) * f64::from(z);
        let cost = Cost { fixed: machine::held_memory() as f64 + bytes * voxels, ..Cost::default() };
        let subject = format_args!("the values of {x} × {y} × {z} voxels");
        memory::admit(&[cost], Limit::new(self.measured.memory), subject, |_| "sample fewer rays".to_owned())
    }

    /// Returns the local thickness at each voxel inside, and 0 at others: the diameter of the largest ball in the solid that
    /// covers it. In units of length, in the order of [`Voxels::values`].
    ///
    /// Source: Hildebrand & Rüegsegger 1997, with balls whose centres lie between voxels.
    ///
    /// # Errors
    /// Images that are not exact or do not cover all three axes, and maps that do not fit into memory.
    pub fn thickness(&self) -> Result<Vec<f32>, Error> {
        let images =
            <&[Ldi; 3]>::try_from(&self.measured.images[..]).ok().filter(|_| self.measured.mode == Mode::Exact);
        let Some(images) = images else {
            return Err(Error::Usage(
                "a thickness needs exact images along all axes: keep axes and mode as they are".to_owned(),
            ));
        };
        self.admit(BYTES_OF_THICKNESS)?;
        let solid = Region::of_solid(images);
        if solid.nodes().is_empty() {
            return Ok(vec![0.0; solid.nodes().volume()]);
        }
        let region = Region::of_box(self.grid(), solid.bounds());
        let edges = BoundaryCondition::Border;
        let field = DistanceField::of(&Crossings::of_images(images, &region, edges), edges);
        let along_x = local_thickness(&field, solid.nodes());
        let [columns, rows, layers] = solid.nodes().size();
        let pitch = self.grid().pitch() as f32;
        let mut thickness = vec![0.0; along_x.len()];
        thickness.par_chunks_mut((rows * layers).max(1)).enumerate().for_each(|(x, plane)| {
            for (at, thickness) in plane.iter_mut().enumerate() {
                let (y, z) = (at / layers, at % layers);
                *thickness = pitch * along_x[(z * rows + y) * columns + x];
            }
        });
        Ok(thickness)
    }

    /// Writes the images (`.npz`), the voxels (`.vti`, `.npy`) or the surface (mesh formats), by the extension of the file.
    /// The file is written completely or not at all.
    ///
    /// # Errors
    /// Unknown extensions, files that cannot be written, and surfaces that cannot be contoured.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let path = path.as_ref();
        #[cfg(feature = "npz")]
        {
            let extension =
                path.extension().map(|extension| extension.to_string_lossy().to_lowercase()).unwrap_or_default();
            let content = match voxels::Format::from_extension(&extension) {
                Some(format) => Some(Content::Voxels(format)),
                None => (extension == "npz").then_some(Content::Images),
            };
            if let Some(content) = content {
                let target = ImageTarget { path: path.to_path_buf(), content };
                return write::images(&target, &self.measured.imaged(), &Monitor::new(None)).map(drop);
            }
        }
        Format::from_path(path).map_err(Error::input)?;
        self.surface()?.write(path).map(drop)
    }

    /// Returns warnings about the solids and the result.
    pub fn warnings(&self) -> &[Warning] {
        &self.measured.warnings
    }

    /// Returns the times by stage.
    pub fn timings(&self) -> &Seconds {
        &self.measured.seconds
    }
}

/// The surface of sampled images: a closed, oriented 2-manifold.
#[derive(Clone)]
pub struct SurfaceMesh<'s> {
    measured: &'s Measured,
    finish: Finish,
    progress: Option<&'s dyn Progress>,
}

impl<'s> SurfaceMesh<'s> {
    /// How often the pitch may be halved.
    pub const MOST_LEVELS: u32 = Finish::MOST_LEVELS;

    /// Simplifies the mesh within a distance, in the unit of the solid; 0 keeps all triangles. Without one, the distance is 0.05
    /// pitches.
    pub fn simplified(self, distance: f64) -> Self {
        self.within(Bound::Length(Length { value: distance, unit: None }))
    }

    /// Simplifies the mesh within a bound, such as a share of the pitch.
    pub fn within(mut self, bound: Bound) -> Self {
        self.finish.surface_error = Some(bound);
        self
    }

    /// Halves the pitch up to this many times where the mesh lacks walls and gaps that are thinner than it, instead of three times; 0
    /// keeps the cells of the raster, and more than [`MOST_LEVELS`](SurfaceMesh::MOST_LEVELS) are as many. The shape is sampled again
    /// there; meshes of over- and under-estimates keep the cells of their raster.
    pub fn refined(mut self, levels: u32) -> Self {
        self.finish.refine = Some(levels);
        self
    }

    /// Drops parts with less than a share of the volume, between 0 and 1.
    pub fn without_parts_below(mut self, share: f64) -> Self {
        self.finish.least_part = Some(share);
        self
    }

    /// Sets the listener that receives the progress and may stop the operation.
    pub fn progress(mut self, progress: &'s dyn Progress) -> Self {
        self.progress = Some(progress);
        self
    }

    /// Returns the mesh, in `f64`.
    ///
    /// # Errors
    /// Meshes that do not fit into memory, and results whose mesh is not a manifold.
    pub fn mesh(&self) -> Result<TriangleMesh, Error> {
        self.run(|monitor| Ok(surface::mesh(&self.measured.imaged(), self.finish, Precision::Double, monitor)?.0))
    }

    /// Writes the mesh, in the format of the extension. The file is written completely or not at all.
    ///
    /// # Errors
    /// Those of [`mesh`](SurfaceMesh::mesh), files that cannot be written, and meshes that are empty or whose volume is far
    /// from that of the images.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<SurfaceReport, Error> {
        let path = path.as_ref();
        let (report, warnings) =
            self.run(|monitor| surface::write(&self.measured.imaged(), path, self.finish, monitor))?;
        match (&report.path, warnings.last()) {
            (None, Some(refusal)) => Err(Error::input(refusal)),
            _ => Ok(report),
        }
    }

    fn run<T: Send>(&self, work: impl FnOnce(&Monitor) -> Result<T, Error> + Send) -> Result<T, Error> {
        progress::run(self.progress, 0, work)
    }
}
