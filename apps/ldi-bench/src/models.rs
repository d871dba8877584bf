//! The solids that are timed, all made by the library itself.

use std::path::{Path, PathBuf};

use glam::DVec3;
use ldi_ops::mesh::{ClosedMesh, LengthUnit, TriangleMesh, io};
use ldi_ops::solids::{Model, cuboid};

use crate::BenchError;

/// A solid by name.
pub struct NamedSolid {
    /// What it is called in tables.
    pub name: &'static str,
    /// What it looks like, for the text under a table.
    pub about: &'static str,
    /// The checked mesh.
    pub mesh: ClosedMesh,
}

/// The solids of the sampling tables.
pub fn for_sampling() -> Result<Vec<NamedSolid>, BenchError> {
    let solid = |name, about, mesh: Result<TriangleMesh, BenchError>| {
        Ok(NamedSolid { name, about, mesh: closed(name, mesh?)? })
    };
    Ok(vec![
        solid("gyroid", "sheet scaffold of 4 × 4 × 4 cells", gyroid())?,
        solid("bone", "long bone", bone())?,
        solid("lattice", "body-centred struts, one surface", lattice())?,
        solid("brush", "64 bristles, one surface", build("brush", &[]))?,
        solid("box", "12 large triangles", build("cuboid", &[]))?,
        solid("plates", "24 thin plates across z: deep along z, slivers along x and y", plates())?,
    ])
}

/// Some 870 000 triangles.
fn gyroid() -> Result<TriangleMesh, BenchError> {
    build("gyroid", &[("resolution", "26")])
}

/// A gyroid scaffold in a fineness of choice, its wall thick enough for the coarsest of the growth table.
pub fn thick_gyroid(resolution: u32) -> Result<TriangleMesh, BenchError> {
    build("gyroid", &[("wall", "2"), ("resolution", &resolution.to_string())])
}

/// A checked mesh.
pub fn closed(name: &str, mesh: TriangleMesh) -> Result<ClosedMesh, BenchError> {
    ClosedMesh::check(mesh).map_err(|error| BenchError::model(name, error))
}

fn bone() -> Result<TriangleMesh, BenchError> {
    build("bone", &[])
}

/// A fine lattice, as scaffolds have them: many struts of few triangles each, some 800 000 in all.
fn lattice() -> Result<TriangleMesh, BenchError> {
    build("bcc", &[("cells", "6"), ("cell-size", "5"), ("radius", "0.5"), ("resolution", "20")])
}

fn build(kind: &str, parameters: &[(&str, &str)]) -> Result<TriangleMesh, BenchError> {
    let model = Model::from_parameters(kind, parameters).and_then(|model| model.build());
    model.map_err(|error| BenchError::model(kind, error))
}

/// Thin plates, one above the other.
fn plates() -> Result<TriangleMesh, BenchError> {
    let mut all = TriangleMesh::default();
    for i in 0..24 {
        let z = f64::from(i);
        let plate = cuboid(DVec3::new(0.0, 0.0, z), DVec3::new(25.6, 25.6, z + 0.3));
        let plate = plate.map_err(|error| BenchError::model("plates", error))?;
        let first = all.positions.len() as u32;
        all.positions.extend(plate.positions);
        all.triangles.extend(plate.triangles.iter().map(|triangle| triangle.map(|vertex| first + vertex)));
    }
    Ok(all)
}

/// How far the second lattice stands from the first, so that nothing coincides.
const SHIFT: DVec3 = DVec3::new(1.31, 2.17, 0.73);

/// A file of the whole-process benchmarks, in their folder.
pub fn file(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.stl"))
}

/// Writes the files of the whole-process benchmarks.
pub fn write_all(folder: &Path) -> Result<(), BenchError> {
    let write = |name: &str, mesh: &TriangleMesh| {
        io::write(&file(folder, name), mesh, Some(LengthUnit::Millimetre)).map_err(|e| BenchError::model(name, e))
    };
    let shifted = |mut mesh: TriangleMesh| {
        mesh.positions.iter_mut().for_each(|position| *position += SHIFT);
        mesh
    };
    let (gyroid, lattice) = (gyroid()?, lattice()?);
    write("gyroid", &gyroid)?;
    write("gyroid-shifted", &shifted(gyroid))?;
    write("bone", &bone()?)?;
    write("lattice", &lattice)?;
    write("lattice-shifted", &shifted(lattice))
}
