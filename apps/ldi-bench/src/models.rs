//! The benchmark models, all built by the library itself.

use std::path::{Path, PathBuf};

use glam::DVec3;
use ldi_ops::grid::{Axis, Grid, LatticeSolid};
use ldi_ops::mesh::{ClosedMesh, LengthUnit, TriangleMesh, io};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{FillRule, Mode, Sampler};
use ldi_ops::solids::{Model, cuboid};

use crate::BenchError;
use crate::table::{Table, count, number};

/// A solid with its name.
pub struct NamedSolid {
    /// Its name in tables.
    pub name: &'static str,
    /// Its appearance, for the text under a table.
    pub about: &'static str,
    /// The checked mesh.
    pub mesh: ClosedMesh,
}

/// Returns the solids of the sampling tables.
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

/// Builds a gyroid of some 870 000 triangles.
fn gyroid() -> Result<TriangleMesh, BenchError> {
    build("gyroid", &[("resolution", "26")])
}

/// Builds a gyroid scaffold of a given resolution, with a wall thick enough for the coarsest one of the growth table.
pub fn thick_gyroid(resolution: u32) -> Result<TriangleMesh, BenchError> {
    build("gyroid", &[("wall", "2"), ("resolution", &resolution.to_string())])
}

/// Returns a checked mesh.
pub fn closed(name: &str, mesh: TriangleMesh) -> Result<ClosedMesh, BenchError> {
    ClosedMesh::check(mesh).map_err(|error| BenchError::model(name, error))
}

fn bone() -> Result<TriangleMesh, BenchError> {
    build("bone", &[])
}

/// Builds a fine lattice like those of scaffolds: many struts of few triangles each, some 800 000 in all.
fn lattice() -> Result<TriangleMesh, BenchError> {
    build("bcc", &[("cells", "6"), ("cell-size", "5"), ("radius", "0.5"), ("resolution", "20")])
}

/// Builds a solid of the library by name and parameters.
pub fn build(kind: &str, parameters: &[(&str, &str)]) -> Result<TriangleMesh, BenchError> {
    let model = Model::from_parameters(kind, parameters).and_then(|model| model.build());
    model.map_err(|error| BenchError::model(kind, error))
}

/// Builds thin plates, one above the other.
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

/// A solid of the kind and size of one that Leung and Wang timed, with their published figures.
///
/// Y.-S. Leung and C. C. L. Wang, Conservative Sampling of Solids in Image Space, IEEE Computer Graphics and Applications
/// 33(1), 2013.
pub struct SeedModel {
    /// Our solid.
    pub solid: NamedSolid,
    /// Number of triangles of theirs.
    pub triangles: u32,
    /// Most samples of theirs on a ray of any axis, at 512 rays along the longest side.
    pub layers: u32,
    /// Milliseconds of their sampling along three axes on a GeForce GTX 580, at 512² rays and LOD-C 1024.
    pub milliseconds: f64,
}

/// Returns solids like the six that Leung and Wang timed, within 5 % of their triangles and 30 % of their layers.
pub fn seed_models() -> Result<Vec<SeedModel>, BenchError> {
    seed_models_named(|_| true)
}

/// Returns those of [`seed_models`] whose names are wanted, and builds no others.
pub fn seed_models_named(is_wanted: impl Fn(&str) -> bool) -> Result<Vec<SeedModel>, BenchError> {
    let seed = |name, about, kind, parameters: &[(&str, &str)], triangles, layers, milliseconds| {
        let wanted = is_wanted(name).then(|| closed(name, build(kind, parameters)?)).transpose()?;
        Ok(wanted.map(|mesh| SeedModel { solid: NamedSolid { name, about, mesh }, triangles, layers, milliseconds }))
    };
    let models = [
        seed(
            "trabecular bone",
            "rods and plates from a random field",
            "trabecular",
            &[("size", "9,9,26"), ("fraction", "0.32"), ("stretch", "1"), ("resolution", "8")],
            876_000,
            42,
            206.0,
        )?,
        seed(
            "hyperboloid",
            "two families of 90 straight bars",
            "hyperboloid-frame",
            &[("waist", "10"), ("height", "40"), ("bars", "90"), ("crossings", "30"), ("depth", "0.4")],
            130_000,
            32,
            20.5,
        )?,
        seed(
            "nylon lattice",
            "8 layers of woven cloth",
            "weave",
            &[("yarns", "13"), ("layers", "8"), ("radius", "0.34"), ("segments", "12"), ("steps", "10")],
            654_000,
            40,
            30.2,
        )?,
        seed(
            "chain",
            "chain mail of 24 × 6 flat rings and those between them",
            "chain-mail",
            &[("columns", "24"), ("rows", "6"), ("around", "25"), ("across", "20")],
            402_000,
            192,
            35.5,
        )?,
        seed(
            "brush",
            "50 × 12 bristles",
            "brush",
            &[("bristles", "50,12"), ("resolution", "4"), ("radius", "0.6"), ("length", "7.5")],
            278_000,
            100,
            63.7,
        )?,
        seed(
            "geodesic structure",
            "frame along the edges of a geodesic sphere",
            "geodesic-frame",
            &[("frequency", "12"), ("window", "0.8"), ("depth", "0.2")],
            51_200,
            24,
            62.3,
        )?,
    ];
    Ok(models.into_iter().flatten().collect())
}

/// Writes the solids of [`seed_models`] to a folder and returns a table of them beside those of the publication.
pub fn write_seeds(folder: &Path) -> Result<Table, BenchError> {
    let mut table =
        Table::new(&["model", "triangles", "published", "layers x", "y", "z", "published", "ms on a GTX 580"]);
    for seed in seed_models()? {
        let NamedSolid { name, mesh, .. } = &seed.solid;
        io::write(&file(folder, &name.replace(' ', "-")), mesh.mesh(), Some(LengthUnit::Millimetre))
            .map_err(|error| BenchError::model(name, error))?;
        let [x, y, z] = layers(name, mesh)?.map(|most| count(most.into()));
        table.row(vec![
            (*name).to_owned(),
            count(mesh.mesh().triangles.len() as u64),
            count(seed.triangles.into()),
            x,
            y,
            z,
            count(seed.layers.into()),
            number(seed.milliseconds),
        ]);
    }
    Ok(table)
}

/// Lays a raster of `resolution` rays along the longest side around a model.
pub fn grid_around(name: &str, mesh: &ClosedMesh, resolution: u32, lod: u32) -> Result<Grid, BenchError> {
    Grid::with_resolution(mesh.bounds(), resolution, lod).map_err(|error| BenchError::model(name, error))
}

/// Rounds a model to the lattice of a raster.
pub fn quantise<'m>(name: &str, mesh: &'m ClosedMesh, grid: &Grid) -> Result<LatticeSolid<'m>, BenchError> {
    grid.quantise(mesh).map_err(|error| BenchError::model(name, error))
}

/// Returns the most samples on a ray along each axis, at 512 rays along the longest side.
fn layers(name: &str, mesh: &ClosedMesh) -> Result<[u32; 3], BenchError> {
    let solid = quantise(name, mesh, &grid_around(name, mesh, 512, 1024)?)?;
    let images = Axis::ALL.map(|axis| CpuSampler::default().sample(&solid, axis, Mode::Exact, FillRule::EvenOdd));
    Ok(images.map(|image| image.expect("the model is closed").layers()))
}

/// The offset of the second lattice from the first, so that nothing coincides.
const SHIFT: DVec3 = DVec3::new(1.31, 2.17, 0.73);

/// Returns the path of a file of the whole-process benchmarks.
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
    write("lattice-shifted", &shifted(lattice))?;
    Ok(())
}

/// Writes the files of the benchmarks `exact` and `meshes`: of the solids of [`seed_models`], those that it needs.
pub fn write_for_exact(folder: &Path) -> Result<(), BenchError> {
    let write = |name: &str, mesh: &TriangleMesh| {
        io::write(&file(folder, name), mesh, Some(LengthUnit::Millimetre)).map_err(|e| BenchError::model(name, e))
    };
    write("gyroid", &gyroid()?)?;
    write("bone", &bone()?)?;
    write("organic", &build("organic", &[("resolution", "75")])?)?;
    for SeedModel { solid, .. } in seed_models()? {
        match solid.name {
            "geodesic structure" => drop(write("geodesic", solid.mesh.mesh())?),
            "brush" | "chain" => drop(write(solid.name, solid.mesh.mesh())?),
            _ => {}
        }
    }
    let mut lattice = build("bcc", &[("cells", "6"), ("cell-size", "5"), ("radius", "0.5"), ("resolution", "18")])?;
    write("lattice", &lattice)?;
    lattice.positions.iter_mut().for_each(|position| *position += SHIFT);
    write("lattice-shifted", &lattice)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seed_models_are_of_the_published_sizes() {
        let seeds = seed_models().unwrap();
        assert_eq!(seeds.len(), 6);
        for SeedModel { solid: NamedSolid { name, mesh, .. }, triangles, layers: published, .. } in &seeds {
            let ratio = mesh.mesh().triangles.len() as f64 / f64::from(*triangles);
            assert!((ratio - 1.0).abs() < 0.05, "{name}: {} triangles", mesh.mesh().triangles.len());
            let most = layers(name, mesh).unwrap().into_iter().max().unwrap();
            assert!((f64::from(most) / f64::from(*published) - 1.0).abs() < 0.3, "{name}: {most} layers");
        }
    }
}
