//! Images of shapes, and what is computed from them.

use std::panic::resume_unwind;
use std::path::PathBuf;
use std::sync::OnceLock;
use std::thread;

use ldi_ops::{Axis, Bound as Within, Sampled, SolidMoments, SurfaceMesh};
use numpy::ndarray::{ArrayView, Dimension, Ix3};
use numpy::{Element, PyArray, PyArray1, PyArray3, PyArrayMethods};
use pyo3::PyClass;
use pyo3::prelude::*;
use pyo3::pyclass::boolean_struct::True;

use crate::error::{codes_and_messages, usage};
use crate::keywords::{Call, one_of};
use crate::shape::{Arrays, arrays};
use crate::volume::Volume;

/// The images of a shape: for every ray of a raster, the sorted depths at which it enters and leaves.
#[pyclass(frozen, module = "ldi_ops")]
pub struct Image {
    sampled: Sampled,
    moments: OnceLock<SolidMoments>,
}

impl Image {
    pub fn new(sampled: Sampled) -> Image {
        Image { sampled, moments: OnceLock::new() }
    }

    fn along(&self, py: Python<'_>, axis: &str) -> PyResult<&ldi_ops::ldi::Ldi> {
        let axis = one_of(py, "axis", axis, &[("x", Axis::X), ("y", Axis::Y), ("z", Axis::Z)])?;
        let image = self.sampled.image(axis);
        image.ok_or_else(|| usage(py, format!("there is no image along {}: sample with axes='all'", axis.name())))
    }

    fn moments(&self, py: Python<'_>) -> PyResult<SolidMoments> {
        match self.moments.get() {
            Some(moments) => Ok(*moments),
            None => {
                let moments = Call::new(py, None)?.install(py, || Ok(self.sampled.moments()))?;
                Ok(*self.moments.get_or_init(|| moments))
            }
        }
    }

    /// Runs a function of the surface.
    fn of_surface<T: Send>(
        &self,
        py: Python<'_>,
        surface_error: Option<&Bound<'_, PyAny>>,
        drop_parts: Option<f64>,
        refine: Option<u32>,
        work: impl FnOnce(&SurfaceMesh<'_>) -> Result<T, ldi_ops::Error> + Send,
    ) -> PyResult<T> {
        let bound = surface_error.map(|bound| -> PyResult<Within> {
            let text = bound.str()?.to_string();
            text.parse().map_err(|message| usage(py, format!("surface_error={text}: {message}")))
        });
        let bound = bound.transpose()?;
        if let Some(share) = drop_parts.filter(|share| !(0.0..1.0).contains(share)) {
            return Err(usage(py, format!("drop_parts={share}: a share of the volume, from 0 to below 1")));
        }
        if let Some(levels) = refine.filter(|levels| *levels > SurfaceMesh::MOST_LEVELS) {
            let most = SurfaceMesh::MOST_LEVELS;
            return Err(usage(py, format!("refine={levels}: the pitch is halved 0 to {most} times")));
        }
        Call::new(py, None)?.install(py, || {
            let mut surface = self.sampled.surface()?;
            if let Some(bound) = bound {
                surface = surface.within(bound);
            }
            if let Some(share) = drop_parts {
                surface = surface.without_parts_below(share);
            }
            if let Some(levels) = refine {
                surface = surface.refined(levels);
            }
            work(&surface)
        })
    }
}

#[pymethods]
impl Image {
    /// The volume of the images.
    fn volume(&self) -> Volume {
        Volume(self.sampled.volume())
    }

    /// The area of the mesh of the images, in square units.
    fn area(&self, py: Python<'_>) -> PyResult<f64> {
        Call::new(py, None)?.install(py, || self.sampled.area())
    }

    /// The centroid, (x, y, z).
    #[getter]
    fn centroid(&self, py: Python<'_>) -> PyResult<[f64; 3]> {
        Ok(self.moments(py)?.centroid.to_array())
    }

    /// The inertia about the centroid at unit density, 3 × 3, in fifth powers of the unit of length.
    #[getter]
    fn inertia(&self, py: Python<'_>) -> PyResult<[[f64; 3]; 3]> {
        Ok(self.moments(py)?.inertia.to_cols_array_2d())
    }

    /// The unit of all lengths, such as 'mm'; None if it is not known.
    #[getter]
    fn unit(&self) -> Option<&'static str> {
        self.sampled.unit().map(|unit| unit.symbol())
    }

    /// Voxels along x, y and z.
    #[getter]
    fn shape(&self) -> (u32, u32, u32) {
        self.sampled.grid().rays().into()
    }

    /// The centre of voxel (0, 0, 0).
    #[getter]
    fn origin(&self) -> [f64; 3] {
        let grid = self.sampled.grid();
        grid.origin().to_array().map(|corner| corner + grid.step() * f64::from(grid.node(0)))
    }

    /// The distance between the centres of neighbouring voxels: the pitch.
    #[getter]
    fn spacing(&self) -> f64 {
        self.sampled.grid().pitch()
    }

    /// The corner of the raster, from which depths count.
    #[getter]
    fn corner(&self) -> [f64; 3] {
        self.sampled.grid().origin().to_array()
    }

    /// The length of a step of depths: `corner[axis] + step * depths` are coordinates.
    #[getter]
    fn step(&self) -> f64 {
        self.sampled.grid().step()
    }

    /// The depths along an axis, int32, ray after ray: the samples of ray r are `depths[offsets[r]:offsets[r + 1]]`, entries
    /// and exits by turns. A view.
    fn depths<'py>(slf: &Bound<'py, Self>, axis: &str) -> PyResult<Bound<'py, PyArray1<i32>>> {
        borrowed(slf, &slf.get().along(slf.py(), axis)?.depths().into())
    }

    /// The place of the first sample of each ray in `depths`, uint32, and the number of samples at the end. A view.
    ///
    /// Along z, ray r is at x = r % shape[0] and y = r // shape[0]; along x at y = r % shape[1] and z = r // shape[1]; along y at
    /// x = r % shape[0] and z = r // shape[0].
    fn offsets<'py>(slf: &Bound<'py, Self>, axis: &str) -> PyResult<Bound<'py, PyArray1<u32>>> {
        borrowed(slf, &slf.get().along(slf.py(), axis)?.offsets().into())
    }

    /// The voxels whose centre is inside, bool [x, y, z]. Programs that index [z, y, x] take the transpose.
    fn to_numpy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let voxels = Call::new(py, None)?.install(py, || self.sampled.try_voxels())?;
        dense(py, voxels.values, voxels.size)?.call_method1("view", ("bool",))
    }

    /// The share of each voxel that is inside, along the rays through its centre; the mean over the axes. float32 [x, y, z].
    fn coverage<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let shares = Call::new(py, None)?.install(py, || self.sampled.coverage())?;
        dense(py, shares, self.sampled.grid().rays().map(|n| n as usize))
    }

    /// The mesh as vertices, float64 (n, 3), and faces, int64 (m, 3): closed and oriented, without self-intersections.
    ///
    /// `surface_error` is the distance within which triangles are removed, 0.05 pitches without it: a length in `unit`, or a text such
    /// as '0.1h' for a share of the pitch, or '20um'; 0 keeps all. `drop_parts` drops components below a share of the volume. Where walls
    /// and gaps are thinner than the pitch, it is halved up to `refine` times, 3 without it, except for over- and under-estimates.
    #[pyo3(signature = (surface_error=None, drop_parts=None, refine=None))]
    fn mesh<'py>(
        &self,
        py: Python<'py>,
        surface_error: Option<&Bound<'py, PyAny>>,
        drop_parts: Option<f64>,
        refine: Option<u32>,
    ) -> PyResult<Arrays<'py>> {
        let mesh = self.of_surface(py, surface_error, drop_parts, refine, |surface| surface.mesh())?;
        arrays(py, &mesh)
    }

    /// Writes the mesh (.stl, .obj, .ply, .off, .3mf, .glb), the images (.npz) or the voxels (.vti, .npy), by the extension.
    #[pyo3(signature = (path, surface_error=None, drop_parts=None, refine=None))]
    fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        surface_error: Option<&Bound<'_, PyAny>>,
        drop_parts: Option<f64>,
        refine: Option<u32>,
    ) -> PyResult<()> {
        if surface_error.is_none() && drop_parts.is_none() && refine.is_none() {
            return Call::new(py, None)?.install(py, || self.sampled.write(&path));
        }
        self.of_surface(py, surface_error, drop_parts, refine, |surface| surface.write(&path).map(drop))
    }

    /// The mesh as a `trimesh.Trimesh`.
    #[pyo3(signature = (surface_error=None, drop_parts=None, refine=None))]
    fn to_trimesh<'py>(
        &self,
        py: Python<'py>,
        surface_error: Option<&Bound<'py, PyAny>>,
        drop_parts: Option<f64>,
        refine: Option<u32>,
    ) -> PyResult<Bound<'py, PyAny>> {
        py.import("ldi_ops._interop")?.call_method1("to_trimesh", self.mesh(py, surface_error, drop_parts, refine)?)
    }

    /// The mesh as a `pyvista.PolyData`.
    #[pyo3(signature = (surface_error=None, drop_parts=None, refine=None))]
    fn to_pyvista<'py>(
        &self,
        py: Python<'py>,
        surface_error: Option<&Bound<'py, PyAny>>,
        drop_parts: Option<f64>,
        refine: Option<u32>,
    ) -> PyResult<Bound<'py, PyAny>> {
        py.import("ldi_ops._interop")?.call_method1("to_pyvista", self.mesh(py, surface_error, drop_parts, refine)?)
    }

    /// The voxels as an `xarray.DataArray` with coordinates.
    fn to_xarray<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("ldi_ops._interop")?.call_method1("to_xarray", (slf,))
    }

    /// Warnings about the solids and the result: codes and sentences.
    #[getter]
    fn warnings(&self) -> Vec<(&'static str, String)> {
        codes_and_messages(self.sampled.warnings())
    }

    fn __repr__(&self) -> String {
        let (x, y, z) = self.shape();
        let unit = self.unit().map_or(String::new(), |unit| format!(" {unit}"));
        format!("Image({x} × {y} × {z} rays, pitch {}{unit}, volume {})", self.spacing(), self.sampled.volume())
    }
}

/// Imports NumPy, as each function must that makes an array.
///
/// At the first array the crate `numpy` looks for NumPy's functions, and panics where that fails. It runs some Python, which a
/// signal may interrupt; but only in the main thread, so that another one looks for them.
pub fn import_numpy(py: Python<'_>) -> PyResult<()> {
    static IS_FOUND: OnceLock<()> = OnceLock::new();
    py.import("numpy")?;
    if IS_FOUND.get().is_none() {
        let first_array = || Python::attach(|py| drop(PyArray1::<u8>::from_vec(py, Vec::new())));
        py.detach(|| thread::spawn(first_array).join()).unwrap_or_else(|panic| resume_unwind(panic));
        IS_FOUND.get_or_init(|| ());
    }
    Ok(())
}

/// Returns dense values as an array, without a copy.
pub fn dense<'py, T: Element>(
    py: Python<'py>,
    values: Vec<T>,
    size: [usize; 3],
) -> PyResult<Bound<'py, PyArray<T, Ix3>>> {
    import_numpy(py)?;
    PyArray1::from_vec(py, values).reshape(size)
}

/// Returns an array of numbers that an object owns, which cannot be written to.
pub fn borrowed<'py, C, T, D>(
    owner: &Bound<'py, C>,
    numbers: &ArrayView<'_, T, D>,
) -> PyResult<Bound<'py, PyArray<T, D>>>
where
    C: PyClass<Frozen = True>,
    T: Element,
    D: Dimension,
{
    import_numpy(owner.py())?;
    // SAFETY: the array keeps its owner alive, which is frozen, so that its numbers neither move nor change.
    let array = unsafe { PyArray::borrow_from_array(numbers, owner.clone().into_any()) };
    array.call_method1("setflags", (false,))?;
    Ok(array)
}
