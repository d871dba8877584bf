//! Writing of mesh files: the precision, unit and limits of each format.

use std::io;
use std::path::Path;

use glam::DVec3;

use super::Format;
use super::error::WriteError;
use super::note::WriteNote;
use crate::mesh::{LengthUnit, Precision, TriangleMesh};
use crate::output;

/// A summary of a written file.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The length of one unit of the numbers in the file, where it is known.
    pub unit: Option<LengthUnit>,
    /// Notes for the user about how the file was written.
    pub notes: Vec<WriteNote>,
}

/// Writes a mesh, in the format of the path's extension.
///
/// | format | coordinates | unit |
/// |---|---|---|
/// | STL, binary | rounded to 32 bits | a remark in the header |
/// | OBJ, OFF, text | the same `f64` when read back | a remark |
/// | PLY, binary | `f64` | a remark |
/// | GLB | rounded to 32 bits | metres, glTF's only one, by the scale of the node; assumed if none is given |
/// | 3MF | the same `f64` when read back; lib3mf keeps 32 bits | its own; millimetres if none is given, the default of 3MF |
///
/// Remarks are for people: no program is known to read them. Vertices and triangles keep their order; in 3MF, vertices
/// with the same coordinates become one, since its readers go by indices ([`TriangleMesh::weld`] does it for other
/// formats). [`Written::notes`] lists visible rounding, an assumed unit and everything that the format cannot hold.
///
/// The file is written beside its target and renamed when it is complete, so that no other program ever sees half of
/// it. Memory for writing does not grow with the mesh, but for two words a vertex in 3MF.
pub fn write(path: &Path, mesh: &TriangleMesh, unit: Option<LengthUnit>) -> Result<Written, WriteError> {
    write_at(path, mesh, unit, DVec3::ZERO)
}

/// Writes a mesh whose coordinates are relative to `place`, as [`write()`] does. GLB and 3MF files hold the place as
/// the translation of their one node or item; the others hold the relative coordinates alone.
pub fn write_at(
    path: &Path,
    mesh: &TriangleMesh,
    unit: Option<LengthUnit>,
    place: DVec3,
) -> Result<Written, WriteError> {
    let format = Format::from_path(path)?;
    let target = Target { path, format, mesh };
    target.check_indices()?;
    let mut written = Written { unit, notes: Vec::new() };
    let done: io::Result<()> = match format {
        #[cfg(feature = "stl")]
        Format::Stl => {
            super::stl::check(path, mesh)?;
            target.check_single_precision()?;
            target.check_rounding()?;
            written.notes.extend(target.rounding());
            output::replace(path, |file| super::stl::write(file, mesh, unit))
        }
        #[cfg(feature = "obj")]
        Format::Obj => output::replace(path, |file| super::obj::write(file, mesh, unit)),
        #[cfg(feature = "ply")]
        Format::Ply => output::replace(path, |file| super::ply::write(file, mesh, unit)),
        #[cfg(feature = "off")]
        Format::Off => output::replace(path, |file| super::off::write(file, mesh, unit)),
        #[cfg(feature = "gltf")]
        Format::Glb => {
            let unit = written.unit_or(LengthUnit::Metre, format);
            target.check_finite()?;
            target.check_single_precision()?;
            target.check_rounding()?;
            written.notes.extend(target.rounding());
            written.unit = Some(LengthUnit::Metre);
            let file = super::gltf::Glb::new(mesh, unit.metres(), place);
            target.check_bytes(file.bytes())?;
            output::replace(path, |out| file.write(out))
        }
        #[cfg(feature = "3mf")]
        Format::ThreeMf => {
            let unit = written.unit_or(LengthUnit::Millimetre, format);
            target.check_finite()?;
            target.check_within(super::threemf::FARTHEST)?;
            let object = super::threemf::WrittenObject::new(mesh);
            let count = object.collapsed;
            written.notes.extend((count > 0).then_some(WriteNote::CollapsedLeftOut { count }));
            output::replace(path, |file| super::threemf::write(file, &object, unit, place))
        }
        #[cfg(not(feature = "cpu"))]
        _ if !format.is_built() => return Err(format.not_built(path).into()),
        _ => return Err(WriteError::NoWriter { path: path.to_path_buf(), format }),
    };
    done.map_err(|source| WriteError::Io { path: path.to_path_buf(), source })?;
    Ok(written)
}

impl Written {
    /// Returns the unit, or the default of the format, with a note.
    fn unit_or(&mut self, default: LengthUnit, format: Format) -> LengthUnit {
        if self.unit.is_none() {
            self.notes.push(WriteNote::UnitAssumed { format, unit: default });
        }
        *self.unit.get_or_insert(default)
    }
}

/// A file to be written, and the checks before that.
struct Target<'a> {
    path: &'a Path,
    format: Format,
    mesh: &'a TriangleMesh,
}

/// Rounding by more than this fraction of a mesh's size is noted.
const ROUNDING_TOLD: f64 = 1e-5;

/// Rounding that changes the volume by more than this fraction is refused.
const VOLUME_CHANGED: f64 = 1e-3;

/// Rounding that collapses more than this fraction of the triangles is refused.
const COLLAPSED: f64 = 1e-2;

/// A volume below this fraction of the product of area and size is ignored: the mesh is open and flat, or encloses
/// nothing.
const NO_VOLUME: f64 = 1e-6;

impl Target<'_> {
    fn check_indices(&self) -> Result<(), WriteError> {
        let count = self.mesh.positions.len();
        for (triangle, corners) in self.mesh.triangles.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&index| index as usize >= count) {
                return Err(WriteError::IndexOutOfRange { path: self.path.to_path_buf(), triangle, index, count });
            }
        }
        Ok(())
    }

    /// Returns the first coordinate for which `is_wrong` is true, and its position.
    fn first(&self, is_wrong: impl Fn(f64) -> bool) -> Option<(usize, f64)> {
        self.mesh.positions.iter().enumerate().find_map(|(position, p)| {
            p.to_array().into_iter().find(|&value| is_wrong(value)).map(|value| (position, value))
        })
    }

    fn check_finite(&self) -> Result<(), WriteError> {
        match self.first(|value| !value.is_finite()) {
            None => Ok(()),
            Some((position, value)) => {
                Err(WriteError::NotFinite { path: self.path.to_path_buf(), format: self.format, position, value })
            }
        }
    }

    /// Checks that finite coordinates stay finite as 32-bit numbers.
    fn check_single_precision(&self) -> Result<(), WriteError> {
        match self.first(|value| value.is_finite() && !(value as f32).is_finite()) {
            None => Ok(()),
            Some((position, value)) => {
                Err(WriteError::Overflow { path: self.path.to_path_buf(), format: self.format, position, value })
            }
        }
    }

    fn check_within(&self, limit: f64) -> Result<(), WriteError> {
        match self.first(|value| value.abs() > limit) {
            None => Ok(()),
            Some((position, value)) => {
                Err(WriteError::TooFar { path: self.path.to_path_buf(), format: self.format, position, value, limit })
            }
        }
    }

    fn check_bytes(&self, bytes: u64) -> Result<(), WriteError> {
        let limit = u64::from(u32::MAX);
        if bytes <= limit {
            return Ok(());
        }
        Err(WriteError::TooManyBytes { path: self.path.to_path_buf(), format: self.format, bytes, limit })
    }

    /// Checks that rounding to 32 bits preserves the shape of the mesh.
    fn check_rounding(&self) -> Result<(), WriteError> {
        let Some(WriteNote::CoordinatesRounded { moved, size, .. }) = self.rounding() else { return Ok(()) };
        let mut rounded = self.mesh.clone();
        rounded.positions.iter_mut().for_each(|p| *p = Precision::Single.round(*p));
        let is_collapsed = |mesh: &TriangleMesh, triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
            a == b || b == c || c == a
        };
        let triangles = &self.mesh.triangles;
        let collapsed = triangles.iter().filter(|t| is_collapsed(&rounded, t) && !is_collapsed(self.mesh, t)).count();
        let (before, after) = (self.mesh.signed_volume(), rounded.signed_volume());
        let is_solid = before.abs() > NO_VOLUME * self.mesh.area() * size;
        let is_changed = is_solid && (after - before).abs() > VOLUME_CHANGED * before.abs();
        if collapsed as f64 <= COLLAPSED * triangles.len() as f64 && !is_changed {
            return Ok(());
        }
        let (path, format) = (self.path.to_path_buf(), self.format);
        Err(WriteError::Rounded { path, format, moved, collapsed, triangles: triangles.len(), before, after })
    }

    /// Returns a note about rounding to 32 bits, if that visibly moves the vertices: in meshes that are small compared
    /// with their distance from the origin.
    fn rounding(&self) -> Option<WriteNote> {
        let bounds = self.mesh.bounds()?;
        let farthest = bounds.min.abs().max(bounds.max.abs()).max_element();
        // Half a unit in the last place of 24 bits, or of the least numbers.
        let least = f64::from(f32::MIN_POSITIVE);
        let moved = if farthest > 0.0 { farthest.max(least) * f64::from(f32::EPSILON) / 2.0 } else { 0.0 };
        let size = bounds.extent().max_element();
        let format = self.format;
        (moved > ROUNDING_TOLD * size).then_some(WriteNote::CoordinatesRounded { format, moved, size })
    }
}
