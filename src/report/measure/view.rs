//! The shaded view of a solid.

use glam::DAffine3;

use super::raster::Subject;
use crate::Error;
use crate::boolean::{BooleanOperation, Expression, Operand, Plan};
use crate::driver::memory::{Limit, admit_pictures};
use crate::grid::Axis;
use crate::ldi::Ldi;
use crate::mesh::{ClosedMesh, TriangleMesh};
use crate::number::number;
use crate::picture::annotate::{Annotator, ScaleBar};
use crate::picture::{Background, Camera, Facets, Format, Scene, Skin, View, ViewBox, palette, png, shaded};
use crate::sampler::{FillRule, Mode, Sampler};
use crate::unit;

const FORMAT: Format = Format { width: 1000, height: 760, supersampling: 2 };

/// Largest ratio of the size of the scene to that of the region of interest at which the picture is framed on the region.
const NEAR: f64 = 3.0;

/// Renders a shaded view of the solid, or of its part within the region of interest, as PNG.
pub fn view(subject: Subject, (fill, limit): (FillRule, Limit), sampler: &dyn Sampler) -> Result<Vec<u8>, Error> {
    let length = subject.solid.unit;
    let rotation = DAffine3::from_mat3(View::Isometric.rotation());
    let solids: Vec<_> = [Some(subject.solid), subject.roi].into_iter().flatten().collect();
    let turned: Vec<TriangleMesh> = solids
        .iter()
        .map(|solid| {
            let mut mesh = solid.mesh().clone();
            mesh.transform(&rotation);
            mesh
        })
        .collect();
    let boxes: Vec<ViewBox> = turned
        .iter()
        .filter_map(TriangleMesh::bounds)
        .map(|bounds| ViewBox { min: bounds.min, max: bounds.max })
        .collect();
    let region = *boxes.last().expect("a solid has a box");
    let all = boxes.iter().copied().reduce(|a, b| ViewBox { min: a.min.min(b.min), max: a.max.max(b.max) });
    let all = all.expect("a solid has a box");
    // Rays have the spacing of the picture everywhere, also outside of it.
    let is_near = (all.max - all.min).max_element() <= NEAR * (region.max - region.min).max_element();
    let camera = Camera::aim(FORMAT, if is_near { region } else { all }, all).map_err(Error::input)?;
    let closed: Vec<Result<ClosedMesh, TriangleMesh>> =
        turned.into_iter().map(|mesh| ClosedMesh::check(mesh).map_err(|open| open.mesh)).collect();
    let lattice = closed.iter().map(|mesh| match mesh {
        Ok(closed) => camera.raster().quantise(closed),
        Err(open) => camera.raster().quantise_open(open),
    });
    let lattice = lattice.map(|solid| Ok(camera.see(&solid.map_err(Error::input)?)));
    let lattice = lattice.collect::<Result<Vec<_>, Error>>()?;
    admit_pictures(camera.grid(), &lattice, limit, "raise --memory")?;
    let images = lattice.iter().map(|solid| sampler.sample_surface(solid, Axis::Z, fill));
    let images = images.collect::<Result<Vec<Ldi>, _>>()?;
    let plan = Plan::new(&Expression::of_inputs(BooleanOperation::Intersection, images.len()), Mode::Exact);
    let firsts = [0, lattice[0].triangles().len() as u32];
    let operands: Vec<Operand> = plan
        .leaves()
        .iter()
        .map(|leaf| Operand { image: &images[leaf.input], first_triangle: firsts[leaf.input] })
        .collect();
    let image = plan.sweep(&operands)?;
    let skins: Vec<Skin> = lattice
        .iter()
        .enumerate()
        .map(|(i, solid)| Skin {
            positions: solid.positions(),
            triangles: solid.triangles(),
            tint: if lattice.len() == 1 { palette::alone() } else { palette::tint(i) },
        })
        .collect();
    let scene = Scene { camera: &camera, image: &image, skins: &skins, cut: None, cut_tint: palette::cut() };
    let mut canvas = shaded(&scene, Facets::Smooth, Background::Transparent);
    let bar = ScaleBar::of(&camera);
    Annotator::new(&mut canvas).scale_bar(bar, &format!("{}{}", number(bar.length), unit::suffix(length, 1)));
    let mut bytes = Vec::new();
    png::write(&canvas, &mut bytes)
        .map_err(|error| Error::machine(format!("the picture cannot be encoded: {error}")))?;
    Ok(bytes)
}
