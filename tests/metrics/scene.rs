//! Models and their samples.

use glam::{DAffine3, DVec3};
use ldi_ops::grid::{Grid, LatticeBox};
use ldi_ops::ldi::{Ldi, Mode, NodePlanes};
use ldi_ops::mesh::{Aabb, ClosedMesh, TriangleMesh};
use ldi_ops::metrics::surface_area::SurfaceElements;
use ldi_ops::metrics::{Facets, NodeSet, Region};
use ldi_ops::solids::{self, LatticeForm, MinimalSurface, Part, StrutLattice, StrutPattern, Surface};

use crate::convergence::Measured;
use crate::testing::images::{closed, grid_around, surface_images, whole};

/// A solid and its exact images along x, y and z.
pub struct Scene {
    pub mesh: ClosedMesh,
    pub images: [Ldi; 3],
    /// The region.
    pub bounds: LatticeBox,
}

impl Scene {
    /// Samples a mesh in its own box, which is the region, with this number of rays along the longest side.
    pub fn of(mesh: TriangleMesh, resolution: u32) -> Scene {
        let mesh = closed(mesh);
        let grid = grid_around(&[&mesh], resolution, 1024);
        let bounds = *grid.quantise(&mesh).unwrap().bounds();
        Scene::sampled(mesh, &grid, bounds)
    }

    /// Samples a mesh in a box, which is the region. Each side of the box has a whole number of rays.
    pub fn within(mesh: TriangleMesh, bounds: Aabb, resolution: u32) -> Scene {
        let grid = Grid::with_resolution(bounds, resolution, 1024).unwrap();
        Scene::sampled(closed(mesh), &grid, whole(&grid))
    }

    fn sampled(mesh: ClosedMesh, grid: &Grid, bounds: LatticeBox) -> Scene {
        let images = surface_images(&grid.quantise(&mesh).unwrap());
        Scene { mesh, images, bounds }
    }

    pub fn grid(&self) -> &Grid {
        self.images[0].grid()
    }

    pub fn pitch(&self) -> f64 {
        self.grid().pitch()
    }

    pub fn region(&self) -> Region<'static> {
        Region::of_box(self.grid(), self.bounds)
    }

    /// Returns the nodes inside the solid.
    pub fn nodes(&self) -> NodeSet {
        NodeSet::of_planes(&NodePlanes::new(&self.images, Mode::Exact).unwrap())
    }

    /// Applies a function to the facets that are surface within the region.
    pub fn of_surface<T>(&self, of: impl FnOnce(&SurfaceElements) -> T) -> T {
        let mesh = self.mesh.mesh();
        let facets = Facets::of(&mesh.positions, &mesh.triangles);
        of(&SurfaceElements::within(&facets, &self.images, &self.region()))
    }

    pub fn measured(&self, value: f64) -> Measured {
        Measured { value, pitch: self.pitch() }
    }
}

/// Cubic cells of side 1 with struts through their middles; the mesh has `resolution` edges a cell.
pub fn struts(cells: u32, radius: f64, resolution: u32) -> TriangleMesh {
    let form = LatticeForm::Union { resolution };
    StrutLattice { pattern: StrutPattern::Cubic, form, cells: [cells; 3], cell_size: 1.0, radius }.build().unwrap()
}

/// One side of a minimal surface: half the volume of each cell of side 1.
pub fn network(surface: Surface, cells: u32, resolution: u32) -> TriangleMesh {
    let part = Part::Network { fraction: 0.5 };
    MinimalSurface { surface, part, cells: [cells; 3], cell_size: 1.0, resolution }.build().unwrap()
}

/// A ball about the origin whose radius is constant to about 10⁻⁵.
pub fn ball(radius: f64) -> TriangleMesh {
    solids::geodesic(radius, 96).unwrap()
}

pub fn moved(mut mesh: TriangleMesh, by: DAffine3) -> TriangleMesh {
    mesh.transform(&by);
    mesh
}

pub fn cuboid(size: DVec3) -> TriangleMesh {
    solids::cuboid(-0.5 * size, 0.5 * size).unwrap()
}
