//! Solids: checked closed meshes with name, unit and placement.

use std::fmt;
use std::ops::Deref;
use std::path::Path;

use glam::{DAffine3, DVec3};

use crate::driver::input::{self, InputRequirements, Sides, load, load_all, solid_of_mesh};
use crate::driver::job::{Input, Openness};
#[cfg(feature = "picture")]
use crate::driver::render;
use crate::driver::surface::write_error;
use crate::mesh::{Aabb, LengthUnit, TriangleMesh, io};
use crate::sampler::FillRule;
use crate::{Error, Settings, Shape, Warning};

/// The requirements on a mesh before its fill rule and its operation are known.
const CLOSED: InputRequirements = InputRequirements {
    unit: None,
    openness: Openness::Refused,
    sides: Sides::NotNeeded,
    fill: FillRule::EvenOdd,
    hashes: false,
};

/// A checked closed mesh with name, unit and placement. Cheap to clone.
///
/// A solid dereferences to a [`Shape`] and has all its operations.
///
/// ```
/// use ldi_ops::{Settings, Solid, Unit, solids};
///
/// let ring = solids::torus(10.0, 3.0, 96, 48)?;
/// let ring = Solid::from_triangles(ring.positions, ring.triangles)?.unit(Unit::Millimetre);
/// assert_eq!(ring.volume(&Settings::default())?.to_string(), "1770.195 mm³ (exact)");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Solid {
    inner: input::Solid,
    shape: Shape,
}

impl Solid {
    /// Reads a mesh file (`.stl`, `.obj`, `.ply`, `.off`, `.gltf`, `.glb`, `.3mf`) or images (`.npz`), whose surface is the mesh,
    /// and checks that the mesh is closed.
    ///
    /// # Errors
    /// Files that cannot be read, and meshes that are not closed, with all their defects ([`Error::NotClosed`]).
    pub fn open(path: impl AsRef<Path>) -> Result<Solid, Error> {
        let input = Input { name: None, path: path.as_ref().to_path_buf(), placement: None };
        Ok(Solid::from_inner(load(&input, CLOSED)?))
    }

    /// Reads several files at the same time, as [`open`](Solid::open) reads one, on the threads and within the memory limit of the
    /// settings.
    ///
    /// # Errors
    /// Those of [`open`](Solid::open), of the first file that has one, and files whose meshes would not fit into memory.
    pub fn open_all(paths: &[impl AsRef<Path>], settings: &Settings) -> Result<Vec<Solid>, Error> {
        let input = |path: &Path| Input { name: None, path: path.to_path_buf(), placement: None };
        let inputs: Vec<Input> = paths.iter().map(|path| input(path.as_ref())).collect();
        let solids = settings.run(|monitor| load_all(&inputs, CLOSED, settings.memory(), monitor))?;
        Ok(solids.into_iter().map(Solid::from_inner).collect())
    }

    /// Returns the solid of a mesh, its triangles counter-clockwise seen from outside. Equal positions are one vertex.
    ///
    /// # Errors
    /// Meshes that are not closed, with all their defects ([`Error::NotClosed`]).
    pub fn from_triangles(
        positions: impl IntoIterator<Item = impl Into<DVec3>>,
        triangles: impl IntoIterator<Item = [u32; 3]>,
    ) -> Result<Solid, Error> {
        let positions = positions.into_iter().map(Into::into).collect();
        let mesh = TriangleMesh { positions, triangles: triangles.into_iter().collect() };
        Ok(Solid::from_inner(solid_of_mesh(mesh, Path::new("mesh"), CLOSED)?))
    }

    pub(crate) fn from_inner(inner: input::Solid) -> Solid {
        Solid { shape: Shape::of_solid(inner.clone()), inner }
    }

    pub(crate) fn inner(&self) -> &input::Solid {
        &self.inner
    }

    /// Returns the solid with a name for messages and reports.
    pub fn named(mut self, name: impl AsRef<Path>) -> Solid {
        self.inner.path = name.as_ref().to_path_buf();
        Solid::from_inner(self.inner)
    }

    /// Returns the solid with the unit of its coordinates, which stay the same. A unit that the file states takes precedence.
    pub fn unit(mut self, unit: LengthUnit) -> Solid {
        self.inner.unit = self.inner.stated_unit.or(Some(unit));
        Solid::from_inner(self.inner)
    }

    /// Returns the solid placed by an affine map of its coordinates.
    ///
    /// # Errors
    /// Maps that bring coordinates beyond the range of `f64`.
    pub fn try_transformed(mut self, placement: DAffine3) -> Result<Solid, Error> {
        input::map(&mut self.inner, &placement, CLOSED)?;
        self.inner.volume = self.inner.mesh().signed_volume();
        Ok(Solid::from_inner(self.inner))
    }

    /// Returns the solid placed by an affine map of its coordinates.
    ///
    /// # Panics
    /// If the map brings coordinates beyond the range of `f64`; see [`try_transformed`](Solid::try_transformed).
    pub fn transformed(self, placement: DAffine3) -> Solid {
        self.try_transformed(placement).unwrap_or_else(|error| panic!("{error}"))
    }

    /// Returns the name: that of the file.
    pub fn name(&self) -> impl fmt::Display + '_ {
        self.inner.name()
    }

    /// Returns the unit of the coordinates, where it is known.
    pub fn length_unit(&self) -> Option<LengthUnit> {
        self.inner.unit
    }

    /// Returns the mesh.
    pub fn mesh(&self) -> &TriangleMesh {
        self.inner.mesh()
    }

    /// Returns the box around the mesh.
    pub fn bounds(&self) -> Aabb {
        self.inner.bounds()
    }

    /// Returns warnings about the file, the placement and the making of the solid.
    pub fn warnings(&self) -> &[Warning] {
        &self.inner.warnings
    }

    /// Writes the mesh, in the format of the extension. The file is written completely or not at all.
    ///
    /// # Errors
    /// Unknown extensions, files that cannot be written, and formats of 32 bits that would change the shape.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        io::write(path.as_ref(), self.mesh(), self.inner.unit).map(drop).map_err(write_error)
    }

    /// Returns a picture of the solid from the direction (1, −1, 1) with axes and a scale bar, as a PNG file.
    ///
    /// # Errors
    /// Sides that are not between 16 and 16384 pixels, and pictures that do not fit into memory.
    #[cfg(feature = "picture")]
    pub fn picture(&self, width: u32, height: u32) -> Result<Vec<u8>, Error> {
        render::picture(&self.inner, [width, height])
    }
}

impl Deref for Solid {
    type Target = Shape;

    fn deref(&self) -> &Shape {
        &self.shape
    }
}

impl fmt::Debug for Solid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let triangles = self.mesh().triangles.len();
        write!(f, "Solid({}: {triangles} triangles)", self.name())
    }
}
