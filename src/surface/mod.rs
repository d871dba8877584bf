//! Surface reconstruction: three images of one solid, along x, y and z, to a closed, oriented 2-manifold with sharp edges.
//!
//! # Theory
//! Rays of the three axes meet in the nodes of a lattice, and the samples between two nodes are crossings of the surface with
//! an edge of it: Hermite data, if normals are known (Wang & Chen 2008, LDNI). The mesh is dual to the lattice (Ju et al., Dual
//! Contouring, 2002; Nielson, Dual Marching Cubes, 2004; Schaefer et al., Manifold Dual Contouring, 2007):
//! - a quadrilateral for each edge whose ends have different signs (`quads`);
//! - a vertex for each loop that the surface leaves on the faces of a cell (`cell`), so that two sheets in one cell
//!   stay apart and every edge of the mesh has two triangles, whatever the signs;
//! - each vertex at the minimum of its quadratic error function (`qef`), beyond its cell if necessary (`features`), and pulled
//!   back where triangles would cross one another (`resolve_self_intersections`).
//!
//! # Guarantees
//! - The mesh is closed, 2-manifold and consistently oriented, whatever the images hold.
//! - Sampled again on the same lattice it gives the same nodes: the surface has the topology of the lattice's signs, and
//!   of the planes at the crossings where signs leave a choice (`pairing`).
//! - Faces that all cross the lattice where they meet keep their edges and corners, to rounding.
//!
//! The second holds where normals are those of the surface that was sampled: others may move a vertex past a node.
//!
//! Walls and gaps finer than the lattice are kept where they extend over a cell or more (`cuts`): both surfaces then pass between
//! two nodes. Other detail finer than the lattice cancels: its crossings between two nodes are dropped in pairs. At a sharp edge the
//! mesh passes near them all the same. Pairs away from the mesh are lost, and counted (`lost`); where finer images can be made, cells
//! around them are replaced by finer ones (`refine`).
//! Triangles that cross one another are separated as far as pulling vertices back allows; remaining crossings are counted, and none
//! remained in any test of models, random nodes and walls thinner than a pitch.
//!
//! # Slabs
//! Layers of cells are processed in slabs, in parallel: the nodes of a slab from the images, its crossed edges with their
//! crossings, the vertices of its cells, and its triangles. Beyond the images, the mesh itself, finer cells and the edges that rays
//! cross twice or more nothing larger than a slab is held in memory, and the result depends neither on the height of slabs nor on threads.

mod apart;
mod bins;
mod border;
mod cells;
mod cones;
mod contract;
mod cuts;
mod edges;
mod fans;
mod feature;
mod features;
mod flat;
mod intersect;
mod lost;
pub mod manifold;
mod pairing;
mod part;
pub mod parts;
mod qef;
mod quads;
mod refine;
mod resolve_self_intersections;
pub mod simplify;
mod snap;

use crate::parallel::*;
use glam::DVec3;

use crate::cancel::checkpoint;
use crate::grid::{Axis, Grid};
use crate::ldi::{Ldi, Mode, NodePlanes, NodesError};
use crate::mesh::{Precision, TriangleMesh};
pub use apart::Apart;
pub(crate) use apart::take_apart;
use border::Border;
use cells::{CellLayer, OfBorder, world_from_cells};
use cuts::Cuts;
use edges::{Dropped, EdgeSlab, Source};
use feature::Feature;
use features::Features;
pub(crate) use flat::remove_flat;
pub use lost::SubResolution;
use pairing::JoinedFaces;
use part::Part;
use quads::{Cut, OpenQuad, Quad};
pub(crate) use refine::{FineImages, FineSampler, FineSource, contour_refined};
pub use refine::{FinerBlocks, MOST_LEVELS};
use resolve_self_intersections::{Tangle, View};
pub(crate) use snap::snap;

/// The coordinates that a mesh is made for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coordinates {
    /// The precision that they are stored with.
    pub precision: Precision,
    /// Subtracted from world coordinates.
    pub offset: DVec3,
}

/// A mesh made from images, and counts of the samples and vertices that it does not represent exactly.
#[derive(Clone, Debug)]
pub struct Surface {
    /// In world units, less the requested offset; empty where no node is inside.
    pub mesh: TriangleMesh,
    /// Details finer than the lattice, which the mesh lacks.
    pub sub_resolution: SubResolution,
    /// The blocks of finer cells that it has.
    pub blocks: FinerBlocks,
    /// Nodes about which the images disagree; zero for exact images.
    pub disagreements: u64,
    /// An upper bound of the distance from the mesh of the samples that it rests on, in world units; it exceeds the largest
    /// distance where triangles that are not the sample's own are nearer.
    pub distance: f64,
    /// Vertices of edges and corners that lie beyond their cells.
    pub moved: u64,
    /// Vertices that belong beyond their cells but had to stay, as the signs of nodes would have changed.
    pub stayed: u64,
    /// Vertices that were pulled back from their targets, as triangles would have crossed one another.
    pub pulled: u64,
    /// Pairs of triangles that still cross one another.
    pub crossing_pairs: u64,
}

/// The reason why no surface can be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// An image along one of the axes is missing.
    #[error("a surface needs images along x, y and z; the one along {axis} is missing", axis = axis.name())]
    MissingAxis {
        /// The axis.
        axis: Axis,
    },
    /// The images do not belong together.
    #[error(transparent)]
    Nodes(#[from] NodesError),
    /// More triangles than 32 bits count.
    #[error("the surface has more than {limit} vertices or triangles; lower the resolution")]
    TooLarge {
        /// The limit of either.
        limit: u32,
    },
}

/// Most layers of cells in a slab.
const MOST_LAYERS: i32 = 32;

/// Most words of the planes of a slab, for each kind of array separately: on large rasters slabs have fewer layers.
const SLAB_WORDS: u64 = 1 << 22;

/// Contours the solid of three images for world coordinates in `f32`: [`contour_in`] with the default.
pub fn contour(images: [&Ldi; 3], normals: Option<&[[f32; 3]]>, mode: Mode) -> Result<Surface, SurfaceError> {
    contour_in(images, normals, mode, Coordinates::default())
}

/// Contours the solid of three images for the given coordinates: triangles do not cross one another, whether exact or rounded.
///
/// `normals` holds the unit normal of each triangle that the images' [`triangles`](Ldi::triangles) refer to, in world axes and
/// of either sign. Without them, or without triangles in an image, vertices are the mean of their crossings, and sharp edges
/// are cut off.
pub fn contour_in(
    images: [&Ldi; 3],
    normals: Option<&[[f32; 3]]>,
    mode: Mode,
    coordinates: Coordinates,
) -> Result<Surface, SurfaceError> {
    contour_by_slabs(images, normals, mode, coordinates, MOST_LAYERS)
}

/// Contours the solid of three images by slabs of at most some layers.
fn contour_by_slabs(
    images: [&Ldi; 3],
    normals: Option<&[[f32; 3]]>,
    mode: Mode,
    coordinates: Coordinates,
    most_layers: i32,
) -> Result<Surface, SurfaceError> {
    let source = source_of(images, normals, mode)?;
    Ok(contour_part(source, Part::Whole, coordinates, most_layers)?.into_surface())
}

/// Returns images as the source of a contour.
fn source_of<'a>(
    images: [&'a Ldi; 3],
    normals: Option<&'a [[f32; 3]]>,
    mode: Mode,
) -> Result<Source<'a>, SurfaceError> {
    let planes = NodePlanes::new(images, mode)?;
    let along = |axis| planes.image(axis).ok_or(SurfaceError::MissingAxis { axis });
    let images = [along(Axis::X)?, along(Axis::Y)?, along(Axis::Z)?];
    Ok(Source { planes, images, normals, mode, nodes: None })
}

/// Contours some of the cells by slabs of at most some layers.
fn contour_part(
    source: Source,
    part: Part,
    coordinates: Coordinates,
    most_layers: i32,
) -> Result<Contoured, SurfaceError> {
    let whole = source.planes.grid();
    let mut contour = Contour::new(source, part, whole.translated(-coordinates.offset), coordinates.precision);
    let layers = whole.rays()[2] as i32;
    let [columns, rows, _] = whole.rays().map(u64::from);
    let plane = (columns + 2).div_ceil(64) * (rows + 2);
    let height = (SLAB_WORDS / plane).clamp(1, most_layers as u64) as i32;
    for first in (-1..layers).step_by(height as usize) {
        contour.add_layers(first..layers.min(first + height))?;
    }
    Ok(contour.finish())
}

/// The triangles of a contour, in coordinates of its cells.
struct Contoured {
    grid: Grid,
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// The vertices beside blocks of finer cells, and the quadrilaterals that hold any.
    of_borders: Vec<OfBorder>,
    beside: Vec<Quad>,
    dropped: Dropped,
    disagreements: u64,
    /// The bound of the samples' distance, in pitches.
    distance: f32,
    moved: u64,
    stayed: u64,
    pulled: u64,
    crossing_pairs: u64,
}

impl Contoured {
    /// Converts to world coordinates.
    fn into_surface(self) -> Surface {
        let sub_resolution = SubResolution::of(&self.dropped, &self.vertices, &self.triangles);
        self.into_surface_that_lacks(sub_resolution)
    }

    /// Converts to world coordinates where what the surface lacks is known.
    fn into_surface_that_lacks(mut self, sub_resolution: SubResolution) -> Surface {
        let grid = self.grid;
        let mut positions = std::mem::take(&mut self.vertices);
        positions.par_iter_mut().for_each(|vertex| *vertex = world_from_cells(&grid, *vertex));
        self.with_positions(positions, sub_resolution)
    }

    /// Returns the volume in world units.
    fn volume(&self) -> f64 {
        let corners = |triangle: &[u32; 3]| triangle.map(|vertex| self.vertices[vertex as usize] - self.vertices[0]);
        let sixth = |triangle: &[u32; 3]| {
            let [a, b, c] = corners(triangle);
            a.dot(b.cross(c)) / 6.0
        };
        self.triangles.iter().map(sixth).sum::<f64>() * self.grid.pitch().powi(3)
    }

    /// Returns the surface with the given world coordinates.
    fn with_positions(self, positions: Vec<DVec3>, sub_resolution: SubResolution) -> Surface {
        Surface {
            mesh: TriangleMesh { positions, triangles: self.triangles },
            sub_resolution,
            blocks: FinerBlocks::default(),
            disagreements: self.disagreements,
            distance: f64::from(self.distance) * self.grid.pitch(),
            moved: self.moved,
            stayed: self.stayed,
            pulled: self.pulled,
            crossing_pairs: self.crossing_pairs,
        }
    }
}

/// Greatest distance, in lattice steps, of a surface from its position before its vertices were rounded to the lattice.
const LATTICE_STEPS: f64 = 4.0;

/// The state of a surface under construction.
struct Contour<'a> {
    source: Source<'a>,
    part: Part<'a>,
    /// The grid of the mesh.
    grid: Grid,
    precision: Precision,
    joined: JoinedFaces,
    cuts: Cuts,
    /// The last layer of the previous slab, and its first vertex.
    before: (CellLayer, u32),
    /// Vertices in coordinates of cells.
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    features: Vec<Feature>,
    /// For each vertex the number of its feature plus one, or zero.
    marks: Vec<u32>,
    open: Vec<OpenQuad>,
    /// First triangles of closed quadrilaterals that are turned away from their crossing's normal.
    irregular: Vec<u32>,
    distance: f32,
    of_borders: Vec<OfBorder>,
    dropped: Dropped,
    disagreements: u64,
}

/// The triangles of the edges of one plane or layer.
#[derive(Default)]
struct Patch {
    triangles: Vec<[u32; 3]>,
    open: Vec<OpenQuad>,
    irregular: Vec<u32>,
    distance: f32,
}

impl<'a> Contour<'a> {
    fn new(source: Source<'a>, part: Part<'a>, grid: Grid, precision: Precision) -> Contour<'a> {
        let cuts = Cuts::of_thin(&source, part);
        // The first vertices of a block are those of its border.
        let (features, vertices): (Vec<Feature>, Vec<DVec3>) =
            part.border().into_iter().flat_map(Border::features).unzip();
        Contour {
            source,
            part,
            grid,
            precision,
            joined: JoinedFaces::of(part),
            cuts,
            before: (CellLayer::default(), 0),
            marks: (1..=features.len() as u32).collect(),
            vertices,
            triangles: Vec::new(),
            features,
            of_borders: Vec::new(),
            open: Vec::new(),
            irregular: Vec::new(),
            distance: 0.0,
            dropped: Dropped::default(),
            disagreements: 0,
        }
    }

    /// Adds the vertices of some layers of cells, and the triangles of their edges except those of their last plane.
    fn add_layers(&mut self, range: std::ops::Range<i32>) -> Result<(), SurfaceError> {
        checkpoint();
        let mut slab = EdgeSlab::new(&self.source, &self.cuts, range.clone());
        self.dropped.append(std::mem::take(&mut slab.dropped));
        self.disagreements += slab.nodes.disagreements(range.start + 1..range.end + 1);
        self.cuts.add_necks(&self.source, &slab, self.part);
        self.joined.decide(&self.source, &slab, &self.cuts, self.part);
        let layers: Vec<CellLayer> = range
            .clone()
            .into_par_iter()
            .map(|k| CellLayer::new(&slab, &self.joined, &self.cuts, &self.grid, self.part, k))
            .collect();
        let mut firsts = Vec::with_capacity(layers.len());
        for layer in &layers {
            let first = u32::try_from(self.vertices.len()).map_err(|_| SurfaceError::TooLarge { limit: u32::MAX })?;
            firsts.push(first);
            self.vertices.extend_from_slice(&layer.vertices);
            self.marks.resize(self.vertices.len(), 0);
            let of_borders = layer.of_borders.iter();
            self.of_borders.extend(of_borders.map(|of| OfBorder { vertex: first + of.vertex, ..*of }));
            for feature in &layer.features {
                let feature = Feature { vertex: first + feature.vertex, ..*feature };
                self.features.push(feature);
                self.marks[feature.vertex as usize] = self.features.len() as u32;
            }
        }
        let layer_of = |k: i32| match k - range.start {
            -1 => (&self.before.0, self.before.1),
            at => (&layers[at as usize], firsts[at as usize]),
        };
        let part = self.part;
        let vertex_of = |cell: [i32; 3], crossing: usize| {
            part.border_vertex(cell, crossing).unwrap_or_else(|| {
                let (layer, first) = layer_of(cell[2]);
                first + layer.vertex(cell[0], cell[1], crossing)
            })
        };
        let patches: Vec<Patch> = range
            .clone()
            .into_par_iter()
            .map(|k| {
                let mut patch = Patch::default();
                checkpoint();
                for axis in 0..3 {
                    for node in slab.crossed_in(axis, k).filter(|&node| part.has_edge(axis, node)) {
                        self.add_quad(&mut patch, Quad::around(&slab, axis, node, vertex_of));
                    }
                    let of_part = |(node, _): &([i32; 3], _)| part.has_edge(axis, *node);
                    for (node, crossings) in self.cuts.in_layer(axis, k).filter(of_part) {
                        for quad in Quad::around_cut(axis, node, crossings, slab.is_inside(node), vertex_of) {
                            self.add_quad(&mut patch, quad);
                        }
                    }
                }
                patch
            })
            .collect();
        for patch in patches {
            let base = u32::try_from(self.triangles.len()).map_err(|_| SurfaceError::TooLarge { limit: u32::MAX })?;
            self.triangles.extend_from_slice(&patch.triangles);
            self.open.extend(patch.open.iter().map(|open| OpenQuad { triangle: base + open.triangle, ..*open }));
            self.irregular.extend(patch.irregular.iter().map(|triangle| base + triangle));
            self.distance = self.distance.max(patch.distance);
        }
        let last = layers.into_iter().next_back().zip(firsts.pop());
        self.before = last.expect("a slab has a layer");
        Ok(())
    }

    /// Cuts a quadrilateral, or leaves it open where one of its vertices may still move.
    fn add_quad(&self, patch: &mut Patch, quad: Quad) {
        let triangle = patch.triangles.len() as u32;
        if quad.corners.iter().any(|&vertex| self.marks[vertex as usize] != 0) {
            let quad = match self.part.border() {
                Some(border) => quad.beside_block(|vertex| (vertex as usize) < border.vertices.len()),
                None => quad,
            };
            patch.open.push(OpenQuad { triangle, quad });
            patch.triangles.extend([[0; 3]; 2]);
        } else {
            let Cut { triangles, distance, is_regular } = quad.cut(&self.vertices);
            if !is_regular {
                patch.irregular.push(triangle);
            }
            patch.triangles.extend(triangles);
            patch.distance = patch.distance.max(distance);
        }
    }

    /// Moves vertices beyond their cells, cuts open quadrilaterals, and separates triangles that cross one another.
    fn finish(mut self) -> Contoured {
        let features = Features::new(&self.features, &self.marks, &self.open);
        let rounding = LATTICE_STEPS / f64::from(1u32 << self.grid.shift());
        let stayed = features.resolve(rounding, &mut self.vertices);
        let see = View { grid: &self.grid, precision: self.precision };
        let parted =
            Tangle::new(&features, see, rounding, &mut self.vertices, &mut self.triangles).part(&self.irregular);
        for (open, &distance) in self.open.iter().zip(&parted.distances) {
            if distance > self.distance {
                self.distance = self.distance.max(features.distance(open, &self.vertices));
            }
        }
        let is_beside = |quad: &Quad| features.features_of(quad).any(|feature| self.features[feature].is_between);
        let beside = self.open.iter().map(|open| open.quad).filter(is_beside).collect();
        drop(features);
        let movers = self.features.iter().filter(|feature| feature.target.is_some()).count() as u64;
        Contoured {
            grid: self.grid,
            vertices: self.vertices,
            triangles: self.triangles,
            of_borders: self.of_borders,
            beside,
            dropped: self.dropped,
            disagreements: self.disagreements,
            distance: self.distance,
            moved: movers - stayed,
            stayed,
            pulled: parted.pulled,
            crossing_pairs: parted.left,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;
    use crate::solids;
    use crate::testing::images::{closed, grid_around, surface_images};
    use crate::testing::meshes::{cube, together};
    use crate::testing::random::Random;

    /// Spikes with ambiguous faces and walls, boxes that touch in an edge, so that there are necks, and specks finer than the lattice.
    #[test]
    fn surfaces_do_not_depend_on_the_height_of_slabs() {
        let star = solids::star(1.0, 0.3, 2).unwrap();
        let boxes = [DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0)].map(|from| solids::cuboid(from, from + 1.0).unwrap());
        let mut random = Random::new(16);
        let specks: Vec<TriangleMesh> = (0..3000)
            .map(|_| cube(DVec3::from_array([0; 3].map(|_| random.share())), 0.01 + 0.03 * random.share()))
            .collect();
        let mut lost = 0;
        for (mut mesh, most) in [(star, 60), (together(&boxes), 40), (together(&specks), 20)] {
            mesh.transform(&DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.5));
            let mesh = closed(mesh);
            let grid = grid_around(&[&mesh], most, 1024);
            let solid = grid.quantise(&mesh).unwrap();
            let (images, normals) = (surface_images(&solid), solid.normals());
            let of_height = |height| {
                let images = images.each_ref();
                contour_by_slabs(images, Some(&normals), Mode::Exact, Coordinates::default(), height).unwrap()
            };
            let whole = of_height(i32::MAX);
            lost += whole.sub_resolution.walls.min(whole.sub_resolution.gaps);
            for height in [1, 2, 7, MOST_LAYERS] {
                let found = of_height(height);
                assert!(found.mesh == whole.mesh, "{height} layers");
                assert_eq!(found.sub_resolution, whole.sub_resolution, "{height} layers");
            }
        }
        assert!(lost > 50, "{lost}");
    }
}
