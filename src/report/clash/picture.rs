//! Pictures of a pair of parts: both parts with the region that they share, and a section through the place of the finding.

use glam::{DAffine3, DVec3};

use crate::Error;
use crate::boolean::{BooleanOperation, Expression, Operand, Plan};
use crate::driver::clash::{Clashes, Pair, Relation};
use crate::driver::memory::{Limit, admit_pictures};
use crate::driver::render::across;
use crate::grid::{Axis, LatticeSolid};
use crate::ldi::Ldi;
use crate::mesh::{Aabb, ClosedMesh, LengthUnit};
use crate::number::number;
use crate::picture::annotate::{Annotator, ScaleBar};
use crate::picture::{Background, Camera, Canvas, Colour, Facets, Format, Scene, Skin, View, ViewBox, palette, png};
use crate::picture::{shaded, slice};
use crate::sampler::cpu::CpuSampler;
use crate::sampler::{FillRule, Mode, Sampler};
use crate::unit;

const FORMAT: Format = Format { width: 640, height: 480, supersampling: 2 };

/// The longest side of both parts is shown at most this many times larger than in a picture of all of it.
const LARGEST_ZOOM: f64 = 8.0;

/// The share of the length that two boxes have in common, at either end, in which no section lies.
const RIM: f64 = 0.02;

/// The opacity of the shared region over the parts that hide it.
const SHINE: f32 = 0.8;

/// The pictures of a pair, as PNG files.
pub struct Pictures {
    /// Both parts.
    pub view: Vec<u8>,
    /// A section through the place of the finding.
    pub section: Vec<u8>,
    /// The axis that the section lies across.
    pub axis: Axis,
    /// The coordinate of the section.
    pub at: f64,
}

/// Returns the pictures of a pair.
pub fn pictures(clashes: &Clashes, pair: &Pair, (fill, memory): (FillRule, Option<u64>)) -> Result<Pictures, Error> {
    let solids = pair.parts.map(|part| clashes.parts[part].solid.closed().expect("parts are closed"));
    let boxes = solids.map(ClosedMesh::bounds);
    let all = boxes[0].union(boxes[1]);
    let view = Stage::new(solids, View::Isometric, [all; 2], memory)?.shaded(fill, clashes.unit)?;
    let axis = section_axis(pair, boxes);
    let place = match pair.relation {
        Relation::Overlapping(_) => clashes.place(pair),
        Relation::Touching { .. } | Relation::Separate { .. } => off_the_rim(clashes.place(pair), axis, boxes),
    };
    let stage = Stage::new(solids, across(axis), [frame(pair, all), all], memory)?;
    Ok(Pictures { view, section: stage.section(fill, place, clashes.unit)?, axis, at: place[axis.depth()] })
}

/// Returns a place moved along an axis from the rim of either box into both: of two faces the nearest points may be corners, and a
/// section through these shows nothing.
fn off_the_rim(mut place: DVec3, axis: Axis, [a, b]: [Aabb; 2]) -> DVec3 {
    let along = axis.depth();
    let (low, high) = (a.min[along].max(b.min[along]), a.max[along].min(b.max[along]));
    let margin = RIM * (high - low);
    if margin > 0.0 {
        place[along] = place[along].clamp(low + margin, high - margin);
    }
    place
}

/// Returns the axis that the section lies across: so that thin regions and gaps are seen from the side.
fn section_axis(pair: &Pair, [a, b]: [Aabb; 2]) -> Axis {
    let extent = match pair.relation {
        Relation::Overlapping(common) => common.bounds.extent(),
        Relation::Separate { points: [p, q], .. } => -(p - q).abs(),
        Relation::Touching { .. } => a.max.min(b.max) - a.min.max(b.min),
    };
    let [x, y, z] = extent.to_array();
    if z >= x.max(y) {
        Axis::Z
    } else if y >= x {
        Axis::Y
    } else {
        Axis::X
    }
}

/// Returns the part of the box of both parts that a section shows: about the finding.
fn frame(pair: &Pair, all: Aabb) -> Aabb {
    let finding = match pair.relation {
        Relation::Overlapping(common) => common.bounds,
        Relation::Separate { points: [p, q], .. } | Relation::Touching { points: [p, q], .. } => {
            Aabb { min: p.min(q), max: p.max(q) }
        }
    };
    let least = all.extent().max_element() / LARGEST_ZOOM;
    let half = DVec3::splat((0.75 * finding.extent().max_element()).max(0.5 * least));
    let middle = 0.5 * (finding.min + finding.max);
    Aabb { min: (middle - half).max(all.min), max: (middle + half).min(all.max) }
}

/// Both parts, turned to a view, and the camera.
struct Stage {
    meshes: [ClosedMesh; 2],
    rotation: DAffine3,
    camera: Camera,
    memory: Option<u64>,
}

impl Stage {
    fn new(
        solids: [&ClosedMesh; 2],
        view: View,
        [subject, all]: [Aabb; 2],
        memory: Option<u64>,
    ) -> Result<Stage, Error> {
        let rotation = DAffine3::from_mat3(view.rotation());
        let turned = |solid: &ClosedMesh| {
            let mut mesh = solid.mesh().clone();
            mesh.transform(&rotation);
            ClosedMesh::check(mesh).map_err(Error::input)
        };
        let meshes = [turned(solids[0])?, turned(solids[1])?];
        let boxes = [meshes[0].bounds(), meshes[1].bounds()];
        let around = boxes[0].union(boxes[1]);
        let subject = if subject == all { around } else { turned_box(&rotation, subject) };
        let view_box = |bounds: Aabb| ViewBox { min: bounds.min, max: bounds.max };
        let camera = Camera::aim(FORMAT, view_box(subject), view_box(around)).map_err(Error::input)?;
        Ok(Stage { meshes, rotation, camera, memory })
    }

    /// Returns both parts within the picture, if their images fit into memory.
    fn lattice(&self) -> Result<Vec<LatticeSolid<'_>>, Error> {
        let seen = |mesh| Ok(self.camera.see(&self.camera.raster().quantise(mesh).map_err(Error::input)?));
        let lattice = self.meshes.iter().map(seen).collect::<Result<Vec<LatticeSolid>, Error>>()?;
        admit_pictures(self.camera.grid(), &lattice, Limit::new(self.memory), "raise --memory")?;
        Ok(lattice)
    }

    /// Returns both parts, and the shared region shining through them.
    fn shaded(&self, fill: FillRule, length: Option<LengthUnit>) -> Result<Vec<u8>, Error> {
        let lattice = self.lattice()?;
        let sampler = CpuSampler::default();
        let sample = |solid| sampler.sample_surface(solid, Axis::Z, fill);
        let images = lattice.iter().map(sample).collect::<Result<Vec<Ldi>, _>>()?;
        let mut canvas = self.scene(&lattice, &images, BooleanOperation::Union, [0, 1].map(palette::tint))?;
        let common = self.scene(&lattice, &images, BooleanOperation::Intersection, [palette::clash(); 2])?;
        canvas.lay_over(&common, SHINE);
        self.finished(canvas, length, None)
    }

    fn scene(
        &self,
        lattice: &[LatticeSolid],
        images: &[Ldi],
        operation: BooleanOperation,
        tints: [Colour; 2],
    ) -> Result<Canvas, Error> {
        let plan = Plan::new(&Expression::of_inputs(operation, 2), Mode::Exact);
        let firsts = [0, lattice[0].triangles().len() as u32];
        let operand = |input: usize| Operand { image: &images[input], first_triangle: firsts[input] };
        let operands: Vec<Operand> = plan.leaves().iter().map(|leaf| operand(leaf.input)).collect();
        let image = plan.sweep(&operands)?;
        let skins: Vec<Skin> = lattice
            .iter()
            .zip(tints)
            .map(|(solid, tint)| Skin { positions: solid.positions(), triangles: solid.triangles(), tint })
            .collect();
        let scene = Scene { camera: &self.camera, image: &image, skins: &skins, cut: None, cut_tint: palette::cut() };
        Ok(shaded(&scene, Facets::Smooth, Background::Transparent))
    }

    /// Returns the section across the line of sight through a place, with a ring about the place.
    fn section(&self, fill: FillRule, place: DVec3, length: Option<LengthUnit>) -> Result<Vec<u8>, Error> {
        let sampler = CpuSampler::default();
        let sample = |solid: LatticeSolid| sampler.sample(&solid, Axis::Z, Mode::Exact, fill);
        let images = self.lattice()?.into_iter().map(sample).collect::<Result<Vec<Ldi>, _>>()?;
        let images: Vec<&Ldi> = images.iter().collect();
        let turned = self.rotation.transform_point3(place);
        let colours = |inputs: u32| match inputs {
            1 => palette::tint(0),
            2 => palette::tint(1),
            _ => palette::clash(),
        };
        let background = Background::White;
        let canvas = slice(&self.camera, &images, turned.z, &colours, background.ink(), background);
        self.finished(canvas, length, Some(turned))
    }

    /// Adds the scale bar and the ring, and encodes a picture.
    fn finished(&self, mut canvas: Canvas, length: Option<LengthUnit>, ring: Option<DVec3>) -> Result<Vec<u8>, Error> {
        let bar = ScaleBar::of(&self.camera);
        let mut annotator = Annotator::new(&mut canvas);
        let label = format!("{}{}", number(bar.length), unit::suffix(length, 1));
        // A section fills the picture to its edges.
        if ring.is_some() {
            annotator.plate(bar, &label);
        }
        annotator.scale_bar(bar, &label);
        if let Some(place) = ring {
            annotator.ring(self.camera.place(place), RING);
        }
        let mut bytes = Vec::new();
        png::write(&canvas, &mut bytes)
            .map_err(|error| Error::machine(format!("the picture cannot be encoded: {error}")))?;
        Ok(bytes)
    }
}

/// The radius of the ring about a finding, in pixels.
const RING: f64 = 14.0;

/// Returns the box around the corners of a box, once they have been turned.
fn turned_box(rotation: &DAffine3, bounds: Aabb) -> Aabb {
    let corner = |i: usize| {
        let at = |k: usize| if i >> k & 1 == 1 { bounds.max[k] } else { bounds.min[k] };
        rotation.transform_point3(DVec3::new(at(0), at(1), at(2)))
    };
    let point = |at: DVec3| Aabb { min: at, max: at };
    (1..8).fold(point(corner(0)), |around, i| around.union(point(corner(i))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_avoid_the_rims_of_both_parts() {
        let boxes = [[0.0, 4.0], [2.0, 12.0]].map(|[min, max]| Aabb { min: DVec3::splat(min), max: DVec3::splat(max) });
        let at = |z: f64| off_the_rim(DVec3::new(4.0, 4.0, z), Axis::Z, boxes);
        assert_eq!([4.0, 2.0, 3.0].map(|z| at(z).z), [3.96, 2.04, 3.0]);
        assert_eq!(at(4.0).truncate().to_array(), [4.0, 4.0]);
        // Boxes that share no length.
        let apart = [boxes[0], Aabb { min: DVec3::splat(5.0), max: DVec3::splat(6.0) }];
        assert_eq!(off_the_rim(DVec3::splat(4.5), Axis::X, apart), DVec3::splat(4.5));
    }
}
