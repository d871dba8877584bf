//! Solids, and expressions over them.

use std::ffi::OsStr;
use std::path::PathBuf;

use glam::{DAffine3, DMat4, DVec3};
use ldi_ops::{Error, Sampled, solids};
use numpy::ndarray::ArrayView2;
use numpy::{Element, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::{PyTypeError, PyUserWarning};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};

use crate::error::{codes_and_messages, usage};
use crate::image::{Image, borrowed, dense, import_numpy};
use crate::keywords::{Call, parsed_unit};
use crate::metrics::{Metrics, measured};
use crate::volume::Volume;

/// The longest text of an expression.
const LONGEST: usize = 200;

/// An expression over solids: Booleans, Minkowski sums, offsets. Nothing is computed until a result is asked for.
///
/// `a & b`, `a | b`, `a - b` and `a ^ b` are intersection, union, difference and symmetric difference.
#[pyclass(frozen, subclass, module = "ldi_ops")]
pub struct Shape {
    pub shape: ldi_ops::Shape,
    text: String,
    units: Units,
}

/// Whether solids of an expression have a unit, and whether others have none.
#[derive(Clone, Copy)]
struct Units {
    known: bool,
    unknown: bool,
}

/// A closed mesh with name and unit.
#[pyclass(frozen, extends = Shape, module = "ldi_ops")]
pub struct Solid {
    pub solid: ldi_ops::Solid,
}

impl Shape {
    /// Returns the shape of an operation on this one and another.
    fn with(&self, other: &Shape, text: String, shape: ldi_ops::Shape) -> Shape {
        let units =
            Units { known: self.units.known || other.units.known, unknown: self.units.unknown || other.units.unknown };
        Shape { shape, text: shortened(text), units }
    }

    fn combined(
        &self,
        sign: &str,
        other: &Bound<'_, PyAny>,
        combine: impl FnOnce(&ldi_ops::Shape, &ldi_ops::Shape) -> ldi_ops::Shape,
    ) -> PyResult<Shape> {
        let Ok(other) = other.cast::<Shape>() else {
            let name = other.get_type().name()?;
            return Err(PyTypeError::new_err(format!(
                "{sign} takes a Shape, not a {name}; ldi_ops.load makes a Solid of a mesh"
            )));
        };
        let other = other.get();
        Ok(self.with(other, format!("({} {sign} {})", self.text, other.text), combine(&self.shape, &other.shape)))
    }

    /// The expression as text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns an offset, opening or closing.
    fn of_one(&self, name: &str, length: f64, shape: ldi_ops::Shape) -> Shape {
        Shape { shape, text: shortened(format!("{}.{name}({length})", self.text)), units: self.units }
    }

    /// Reads the settings of a call, and warns of solids without a unit among others.
    pub fn call(&self, py: Python<'_>, settings: Option<&Bound<'_, PyDict>>) -> PyResult<Call> {
        if self.units.known && self.units.unknown {
            let message = c"some solids state no unit and are taken to be in that of the others; pass unit= to load";
            PyErr::warn(py, &py.get_type::<PyUserWarning>(), message, 1)?;
        }
        Call::new(py, settings)
    }
}

fn checked_radius(py: Python<'_>, radius: f64) -> PyResult<f64> {
    match radius.is_finite() && radius > 0.0 {
        true => Ok(radius),
        false => Err(usage(py, format!("radius={radius}: a length above 0"))),
    }
}

/// Returns a text that is not longer than a line or two.
fn shortened(text: String) -> String {
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", text[..end].trim_end_matches('…')),
        None => text,
    }
}

#[pymethods]
impl Shape {
    /// The points in both shapes.
    fn __and__(&self, other: &Bound<'_, PyAny>) -> PyResult<Shape> {
        self.combined("&", other, |a, b| a & b)
    }

    /// The points in either shape.
    fn __or__(&self, other: &Bound<'_, PyAny>) -> PyResult<Shape> {
        self.combined("|", other, |a, b| a | b)
    }

    /// The points in exactly one of the shapes.
    fn __xor__(&self, other: &Bound<'_, PyAny>) -> PyResult<Shape> {
        self.combined("^", other, |a, b| a ^ b)
    }

    /// The points in this shape and not in the other.
    fn __sub__(&self, other: &Bound<'_, PyAny>) -> PyResult<Shape> {
        self.combined("-", other, |a, b| a - b)
    }

    /// The Minkowski sum: all sums of a point of this shape and a point of the other.
    fn minkowski(&self, other: &Shape) -> Shape {
        let text = format!("{}.minkowski({})", self.text, other.text);
        self.with(other, text, self.shape.minkowski_sum(&other.shape))
    }

    /// The Minkowski difference: all displacements that move the other shape into this one.
    fn minkowski_difference(&self, other: &Shape) -> Shape {
        let text = format!("{}.minkowski_difference({})", self.text, other.text);
        self.with(other, text, self.shape.minkowski_difference(&other.shape))
    }

    /// All points within a distance of the shape; a negative distance removes all points within it of the outside.
    fn offset(&self, py: Python<'_>, distance: f64) -> PyResult<Shape> {
        match distance.is_finite() && distance != 0.0 {
            true => Ok(self.of_one("offset", distance, self.shape.offset(distance))),
            false => Err(usage(py, format!("distance={distance}: a length that is not 0"))),
        }
    }

    /// The union of all balls of a radius inside the shape: removes parts thinner than the ball.
    fn opening(&self, py: Python<'_>, radius: f64) -> PyResult<Shape> {
        Ok(self.of_one("opening", checked_radius(py, radius)?, self.shape.open(radius)))
    }

    /// All points outside all balls of a radius that avoid the shape: fills gaps narrower than the ball.
    fn closing(&self, py: Python<'_>, radius: f64) -> PyResult<Shape> {
        Ok(self.of_one("closing", checked_radius(py, radius)?, self.shape.close(radius)))
    }

    /// The best volume that can be found: exact where possible, else an estimate from images; `volume.method` says which.
    #[pyo3(signature = (**settings))]
    fn volume(&self, py: Python<'_>, settings: Option<&Bound<'_, PyDict>>) -> PyResult<Volume> {
        self.call(py, settings)?.run(py, |settings| self.shape.volume(settings)).map(Volume)
    }

    /// The images of the shape: entry and exit depths along the rays of a raster.
    #[pyo3(signature = (**settings))]
    fn sample(&self, py: Python<'_>, settings: Option<&Bound<'_, PyDict>>) -> PyResult<Image> {
        self.call(py, settings)?.run(py, |settings| self.shape.sample(settings)).map(Image::new)
    }

    /// The shape as a solid: itself, the exact mesh of a Boolean where there is one, or a mesh of images.
    #[pyo3(signature = (**settings))]
    fn solid(&self, py: Python<'_>, settings: Option<&Bound<'_, PyDict>>) -> PyResult<Py<Solid>> {
        let solid = self.call(py, settings)?.without_bounds().run(py, |settings| self.shape.solid(settings))?;
        Solid::new(py, solid.named(&self.text))
    }

    /// The mesh as vertices, float64 (n, 3), and faces, int64 (m, 3), counter-clockwise seen from outside: exact for Booleans
    /// of solids where possible, else from images.
    #[pyo3(signature = (**settings))]
    fn mesh<'py>(&self, py: Python<'py>, settings: Option<&Bound<'py, PyDict>>) -> PyResult<Arrays<'py>> {
        let solid = self.call(py, settings)?.without_bounds().run(py, |settings| self.shape.solid(settings))?;
        arrays(py, solid.mesh())
    }

    /// Writes the mesh to a file, in the format of its extension: .stl, .obj, .ply, .off, .3mf, .glb.
    #[pyo3(signature = (path, **settings))]
    fn save(&self, py: Python<'_>, path: PathBuf, settings: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.call(py, settings)?.without_bounds().run(py, |settings| {
            let solid = self.shape.solid(settings)?;
            settings.install(|| solid.write(&path))
        })
    }

    /// The metrics of the shape as a scaffold, within its box, or within a region: a shape; 'hull' for the convex hull; or 'wrap:2mm'
    /// for the shape with all pores filled that a ball of this diameter from outside cannot enter ('wrap' chooses one).
    ///
    /// `limits` is a TOML file, or a dict such as {'porosity': {'min': '50 %'}}. `view=False` leaves out the picture of the solid
    /// in the page of `Metrics.save`, which takes seconds.
    #[pyo3(signature = (region=None, limits=None, view=true, **settings))]
    fn metrics(
        &self,
        py: Python<'_>,
        region: Option<&Bound<'_, PyAny>>,
        limits: Option<&Bound<'_, PyAny>>,
        view: bool,
        settings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Metrics> {
        measured(py, self, [region, limits], view, settings)
    }

    /// The local thickness at each voxel, in units of length: the diameter of the largest ball in the shape that covers it, and 0
    /// outside. float32 [x, y, z].
    #[pyo3(signature = (**settings))]
    fn thickness<'py>(
        &self,
        py: Python<'py>,
        settings: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let (size, thickness) = self.call(py, settings)?.without_bounds().run(py, |settings| {
            let sampled: Sampled = self.shape.sample(settings)?;
            let thickness = settings.install(|| sampled.thickness())?;
            Ok((sampled.grid().rays().map(|n| n as usize), thickness))
        })?;
        dense(py, thickness, size)
    }

    /// The mesh as a `trimesh.Trimesh`.
    #[pyo3(signature = (**settings))]
    fn to_trimesh<'py>(&self, py: Python<'py>, settings: Option<&Bound<'py, PyDict>>) -> PyResult<Bound<'py, PyAny>> {
        py.import("ldi_ops._interop")?.call_method1("to_trimesh", self.mesh(py, settings)?)
    }

    /// The mesh as a `pyvista.PolyData`.
    #[pyo3(signature = (**settings))]
    fn to_pyvista<'py>(&self, py: Python<'py>, settings: Option<&Bound<'py, PyDict>>) -> PyResult<Bound<'py, PyAny>> {
        py.import("ldi_ops._interop")?.call_method1("to_pyvista", self.mesh(py, settings)?)
    }

    /// A copy is the shape itself, as shapes do not change.
    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(PyTypeError::new_err("a Shape cannot be pickled: send solids, or paths and parameters, and return numbers"))
    }

    fn __repr__(&self) -> String {
        format!("Shape({})", self.text)
    }

    fn __str__(&self) -> &str {
        &self.text
    }

    /// A picture, for notebooks.
    #[pyo3(signature = (width=600, height=450))]
    fn picture<'py>(&self, py: Python<'py>, width: u32, height: u32) -> PyResult<Bound<'py, PyBytes>> {
        let png = Call::new(py, None)?.run(py, |settings| {
            let solid = self.shape.solid(settings)?;
            settings.install(|| solid.picture(width, height))
        })?;
        Ok(PyBytes::new(py, &png))
    }

    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        self.picture(py, 600, 450)
    }
}

impl Solid {
    pub fn new(py: Python<'_>, solid: ldi_ops::Solid) -> PyResult<Py<Solid>> {
        let units = Units { known: solid.length_unit().is_some(), unknown: solid.length_unit().is_none() };
        let shape = Shape { shape: ldi_ops::Shape::from(&solid), text: solid.name().to_string(), units };
        Py::new(py, PyClassInitializer::from(shape).add_subclass(Solid { solid }))
    }
}

/// Vertices and faces.
pub type Arrays<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<i64>>);

/// Returns the arrays of a mesh.
pub fn arrays<'py>(py: Python<'py>, mesh: &ldi_ops::mesh::TriangleMesh) -> PyResult<Arrays<'py>> {
    import_numpy(py)?;
    let positions: Vec<f64> = mesh.positions.iter().flat_map(DVec3::to_array).collect();
    let faces: Vec<i64> = mesh.triangles.iter().flatten().map(|&index| i64::from(index)).collect();
    let positions = numpy::PyArray1::from_vec(py, positions).reshape([mesh.positions.len(), 3])?;
    Ok((positions, numpy::PyArray1::from_vec(py, faces).reshape([mesh.triangles.len(), 3])?))
}

#[pymethods]
impl Solid {
    /// Reads a mesh file (.stl, .obj, .ply, .off, .gltf, .glb, .3mf) or images (.npz).
    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Py<Solid>> {
        let solid = Call::new(py, None)?.install(py, || ldi_ops::Solid::open(path))?;
        Solid::new(py, solid)
    }

    /// Reads several files at the same time, as `open` reads one.
    #[staticmethod]
    fn open_all(py: Python<'_>, paths: Vec<PathBuf>) -> PyResult<Vec<Py<Solid>>> {
        let solids = Call::new(py, None)?.run(py, |settings| ldi_ops::Solid::open_all(&paths, settings))?;
        solids.into_iter().map(|solid| Solid::new(py, solid)).collect()
    }

    /// Takes vertices, float64 (n, 3), and faces, int64 (m, 3).
    #[staticmethod]
    fn from_arrays(
        py: Python<'_>,
        vertices: PyReadonlyArray2<'_, f64>,
        faces: PyReadonlyArray2<'_, i64>,
    ) -> PyResult<Py<Solid>> {
        if vertices.as_array().ncols() != 3 || faces.as_array().ncols() != 3 {
            return Err(usage(py, "vertices have the shape (n, 3), and faces (m, 3)"));
        }
        let (positions, indices) = (vertices.as_slice()?, faces.as_slice()?);
        let solid = Call::new(py, None)?.install(py, || {
            let triangles: Option<Vec<[u32; 3]>> = indices.chunks_exact(3).map(triangle).collect();
            let Some(triangles) = triangles else {
                return Err(Error::Usage(format!("a face has a vertex that is not between 0 and {}", u32::MAX)));
            };
            ldi_ops::Solid::from_triangles(positions.chunks_exact(3).map(DVec3::from_slice), triangles)
        })?;
        Solid::new(py, solid)
    }

    /// Takes voxels, uint8 [x, y, z], that are inside where they are not 0; `origin` is the centre of voxel (0, 0, 0).
    #[staticmethod]
    fn from_voxels(
        py: Python<'_>,
        voxels: PyReadonlyArray3<'_, u8>,
        spacing: [f64; 3],
        origin: [f64; 3],
    ) -> PyResult<Py<Solid>> {
        let (size, values) = (voxels.as_array().dim().into(), voxels.as_slice()?);
        let solid = Call::new(py, None)?.install(py, || {
            let mesh = solids::voxels(size, values, DVec3::from(origin), DVec3::from(spacing));
            let mesh = mesh.map_err(|error| Error::Usage(error.to_string()))?;
            Ok(ldi_ops::Solid::from_triangles(mesh.positions, mesh.triangles)?.named("voxels"))
        })?;
        Solid::new(py, solid)
    }

    /// The same solid with a name, for messages and reports.
    fn named(&self, py: Python<'_>, name: &str) -> PyResult<Py<Solid>> {
        Solid::new(py, self.solid.clone().named(OsStr::new(name)))
    }

    /// The same coordinates in a unit: mm, um, cm, m, in, ft. A unit that the file states takes precedence.
    fn with_unit(&self, py: Python<'_>, unit: &str) -> PyResult<Py<Solid>> {
        Solid::new(py, self.solid.clone().unit(parsed_unit(py, unit)?))
    }

    /// The solid placed by an affine map, a matrix of 4 × 4 or 3 × 4 for column vectors.
    fn transformed(&self, py: Python<'_>, matrix: Vec<[f64; 4]>) -> PyResult<Py<Solid>> {
        let rows: [[f64; 4]; 4] = match matrix[..] {
            [a, b, c] => [a, b, c, [0.0, 0.0, 0.0, 1.0]],
            [a, b, c, last @ [0.0, 0.0, 0.0, 1.0]] => [a, b, c, last],
            _ => return Err(usage(py, "a placement is a matrix of 4 × 4 whose last row is 0, 0, 0, 1, or of 3 × 4")),
        };
        let map = DAffine3::from_mat4(DMat4::from_cols_array_2d(&rows).transpose());
        let solid = Call::new(py, None)?.install(py, || self.solid.clone().try_transformed(map))?;
        Solid::new(py, solid)
    }

    /// The name: that of the file.
    #[getter]
    fn name(&self) -> String {
        self.solid.name().to_string()
    }

    /// The unit of the coordinates, such as 'mm'; None if it is not known.
    #[getter]
    fn unit(&self) -> Option<String> {
        self.solid.length_unit().map(|unit| unit.symbol().to_owned())
    }

    /// The vertices, float64 (n, 3): a view.
    #[getter]
    fn vertices<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows(slf, bytemuck::cast_slice(&slf.get().solid.mesh().positions))
    }

    /// The faces, uint32 (m, 3), counter-clockwise seen from outside: a view.
    #[getter]
    fn faces<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        rows(slf, bytemuck::cast_slice(&slf.get().solid.mesh().triangles))
    }

    /// The least and the greatest coordinates.
    #[getter]
    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let bounds = self.solid.bounds();
        (bounds.min.to_array(), bounds.max.to_array())
    }

    /// Warnings about the file and the making of the solid: codes and sentences.
    #[getter]
    fn warnings(&self) -> Vec<(&'static str, String)> {
        codes_and_messages(self.solid.warnings())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let restore = slf.py().import("ldi_ops._load")?.getattr("restore")?;
        let solid = slf.get();
        let parts = (Self::vertices(slf)?, Self::faces(slf)?, solid.name(), solid.unit());
        Ok((restore, parts.into_pyobject(slf.py())?))
    }

    fn __repr__(&self) -> String {
        let unit = self.unit().map_or_else(|| "no unit".to_owned(), |unit| format!("in {unit}"));
        format!("Solid({}: {} triangles, {unit})", self.name(), self.solid.mesh().triangles.len())
    }

    fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
        py.import("ldi_ops._html")?.call_method1("solid", (Solid::new(py, self.solid.clone())?,))?.extract()
    }
}

fn triangle(corners: &[i64]) -> Option<[u32; 3]> {
    let corner = |at: usize| u32::try_from(corners[at]).ok();
    Some([corner(0)?, corner(1)?, corner(2)?])
}

/// Returns a view of numbers that a solid owns, in rows of three.
fn rows<'py, T: Element>(owner: &Bound<'py, Solid>, numbers: &[T]) -> PyResult<Bound<'py, PyArray2<T>>> {
    borrowed(owner, &ArrayView2::from_shape((numbers.len() / 3, 3), numbers).expect("rows of three"))
}
