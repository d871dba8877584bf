//! Surface within regions, compared with closed forms; also the fixtures for tests of sums over rays and facets.

use super::*;
use glam::{DQuat, EulerRot};
use std::f64::consts::PI;

use crate::grid::{Axis, Grid, LatticeBox};
use crate::integrate::{AxisVolume, VolumeEstimate};
use crate::mesh::{Aabb, ClosedMesh, TriangleMesh};
use crate::sampler::cpu::CpuSampler;
use crate::sampler::{FillRule, Sampler};
use crate::solids::{self, LatticeForm, MinimalSurface, Part, StrutLattice, StrutPattern, Surface};
use crate::testing::images;
use crate::testing::meshes::together;

/// A mesh with its exact images.
pub(in crate::metrics) struct Sampled {
    pub mesh: TriangleMesh,
    pub images: [Ldi; 3],
    /// The box of the mesh.
    pub bounds: LatticeBox,
}

impl Sampled {
    /// Samples a mesh on a grid around it.
    pub fn of(mesh: TriangleMesh, resolution: u32) -> Sampled {
        let bounds = mesh.bounds().unwrap();
        Sampled::on(&Grid::with_resolution(bounds, resolution, 1024).unwrap(), mesh)
    }

    pub fn on(grid: &Grid, mesh: TriangleMesh) -> Sampled {
        let closed = ClosedMesh::check(mesh).unwrap();
        let solid = grid.quantise(&closed).unwrap();
        let images =
            Axis::ALL.map(|axis| CpuSampler::default().sample_surface(&solid, axis, FillRule::NonZero).unwrap());
        let bounds = *solid.bounds();
        Sampled { images, bounds, mesh: closed.into_mesh() }
    }

    pub fn facets(&self) -> Facets<'_> {
        Facets::of(&self.mesh.positions, &self.mesh.triangles)
    }

    pub fn grid(&self) -> &Grid {
        self.images[0].grid()
    }

    /// Returns the box of the mesh as a region.
    pub fn boxed(&self) -> Region<'static> {
        Region::of_box(self.grid(), self.bounds)
    }

    /// Returns the whole grid as a region.
    pub fn whole(&self) -> Region<'static> {
        whole(self.grid())
    }
}

pub(in crate::metrics) fn whole(grid: &Grid) -> Region<'static> {
    Region::of_box(grid, images::whole(grid))
}

/// Returns a grid around a box.
pub(in crate::metrics) fn grid_of(min: DVec3, max: DVec3, resolution: u32) -> Grid {
    Grid::with_resolution(Aabb { min, max }, resolution, 1024).unwrap()
}

pub(in crate::metrics) fn turned(mut mesh: TriangleMesh, turn: DQuat) -> TriangleMesh {
    mesh.positions.iter_mut().for_each(|p| *p = turn * *p);
    mesh
}

pub(in crate::metrics) fn cube(side: f64) -> TriangleMesh {
    solids::cuboid(DVec3::splat(-0.5 * side), DVec3::splat(0.5 * side)).unwrap()
}

/// Returns a periodic cell of side 1 with struts of radius 0.15 along the axes.
pub(in crate::metrics) fn struts(cells: u32, resolution: u32) -> TriangleMesh {
    let (form, cells) = (LatticeForm::Union { resolution }, [cells; 3]);
    StrutLattice { pattern: StrutPattern::Cubic, form, cells, cell_size: 1.0, radius: 0.15 }.build().unwrap()
}

pub(in crate::metrics) fn network(surface: Surface, cells: u32, resolution: u32) -> TriangleMesh {
    let part = Part::Network { fraction: 0.5 };
    MinimalSurface { surface, part, cells: [cells; 3], cell_size: 1.0, resolution }.build().unwrap()
}

/// Returns the order of convergence as a length is halved, from the first and the last of three errors.
pub(in crate::metrics) fn order(errors: [f64; 3]) -> f64 {
    0.5 * (errors[0] / errors[2]).abs().log2()
}

/// Returns evenly spread rotations.
pub(in crate::metrics) fn turns(count: u32) -> impl Iterator<Item = DQuat> {
    (0..count).map(|i| {
        let share = |step: f64| std::f64::consts::TAU * (f64::from(i) * step + 0.1).fract();
        DQuat::from_euler(EulerRot::ZYX, share(0.618034), share(0.754878), share(0.569840))
    })
}

#[test]
fn hits_give_the_area_of_a_turned_cube_without_bias() {
    for (resolution, allowed) in [(64, [5e-3, 6e-2]), (128, [2e-3, 2e-2]), (256, [1e-3, 7e-3])] {
        let areas: Vec<f64> = turns(40)
            .map(|turn| {
                let cube = Sampled::of(turned(cube(1.0), turn), resolution);
                let facets = cube.facets();
                let hits = SurfaceElements::of_hits(&facets, &cube.images, &cube.whole(), Scale::Counted);
                assert_eq!(hits.source(), Source::Hits);
                hits.area()
            })
            .collect();
        let mean = areas.iter().sum::<f64>() / 40.0;
        let worst = areas.iter().map(|area| (area - 6.0).abs()).fold(0.0, f64::max);
        println!("cube at {resolution}: mean {mean:.5}, worst off by {worst:.5}");
        assert!((mean - 6.0).abs() < allowed[0] && worst < allowed[1], "{resolution}: {mean} {worst}");
    }
}

#[test]
fn struts_have_their_closed_form_area_and_volume_per_cell() {
    let (r, root) = (0.15f64, 2.0f64.sqrt());
    let [area, volume] = [6.0 * PI * r - 24.0 * root * r * r, 3.0 * PI * r * r - 8.0 * root * r.powi(3)];
    assert!((area - 2.06376).abs() < 1e-5 && (volume - 0.173874).abs() < 1e-6);
    // Contoured: their creases are rounded off by a cell of the contour.
    let errors = [24, 48, 96].map(|resolution| {
        let cell = Sampled::of(struts(1, resolution), 16);
        let facets = cell.facets();
        let found = SurfaceElements::within(&facets, &cell.images, &cell.boxed());
        assert_eq!(found.source(), Source::Facets);
        println!("struts of {resolution} to a cell: BS {:.5}", found.area());
        found.area() / area - 1.0
    });
    println!("contoured struts, BS: order {:.2}", order(errors));
    assert!(errors[2].abs() < 5e-3 && order(errors) > 0.6, "{errors:?}");
    // As a heap of cylinders, whose union is known to rays alone.
    let form = LatticeForm::Overlapping { segments: 256 };
    let heap = StrutLattice { pattern: StrutPattern::Cubic, form, cells: [1; 3], cell_size: 1.0, radius: r };
    let errors = [64, 128, 256].map(|resolution| {
        let cell = Sampled::of(heap.build().unwrap(), resolution);
        let facets = cell.facets();
        let found = SurfaceElements::within(&facets, &cell.images, &cell.boxed());
        assert_eq!(found.source(), Source::Hits);
        let of_rays = VolumeEstimate::from_axes(&cell.images.each_ref().map(AxisVolume::of)).value;
        println!("struts at {resolution} rays: BS {:.5}, BV {of_rays:.6}", found.area());
        [found.area() / area - 1.0, of_rays / volume - 1.0]
    });
    println!("struts, BS and BV: orders {:.2?}", [0, 1].map(|k| order(errors.map(|error| error[k]))));
    assert!(errors[2][0].abs() < 5e-3 && errors[2][1].abs() < 1e-3, "{errors:?}");
}

#[test]
fn minimal_surfaces_have_their_known_area_per_cell() {
    for (surface, exact) in [(Surface::Gyroid, 3.0917), (Surface::Primitive, 2.3526), (Surface::Diamond, 3.8380)] {
        let errors = [16, 32, 64].map(|resolution| {
            let cell = Sampled::of(network(surface, 1, resolution), 64);
            let of_facets = SurfaceElements::of_facets(&cell.facets(), &cell.boxed()).unwrap().area();
            let counted = Scale::Counted;
            let of_hits = SurfaceElements::of_hits(&cell.facets(), &cell.images, &cell.boxed(), counted).area();
            println!("{surface:?} of {resolution} to a cell: {of_facets:.5} by facets, {of_hits:.5} by hits");
            assert!((of_hits / of_facets - 1.0).abs() < 1e-2);
            of_facets - exact
        });
        println!("{surface:?}, BS: order {:.2}", order(errors));
        assert!(errors[2].abs() < 2e-3 * exact, "{surface:?} {errors:?}");
    }
}

#[test]
fn hits_give_the_surface_area_within_a_region() {
    // A slanted plate through a ball: its two sides have circles in common with the ball.
    let turn = turns(4).last().unwrap();
    let plate = turned(solids::cuboid(DVec3::new(-3.0, -3.0, -0.2), DVec3::new(3.0, 3.0, 0.2)).unwrap(), turn);
    let exact = 2.0 * PI * (1.0 - 0.04);
    for (resolution, allowed) in [(64, 0.03), (128, 0.01), (256, 0.005)] {
        let grid = grid_of(DVec3::splat(-4.5), DVec3::splat(4.5), resolution);
        let [plate, ball] = [plate.clone(), solids::geodesic(1.0, 32).unwrap()].map(|m| Sampled::on(&grid, m));
        let facets = plate.facets();
        let region = Region::of_solid(&ball.images);
        assert!(matches!(SurfaceElements::of_facets(&facets, &region), Err(SurfaceError::NotABox)));
        let errors = [Scale::Counted, Scale::ToMesh]
            .map(|scale| SurfaceElements::of_hits(&facets, &plate.images, &region, scale).area() / exact - 1.0);
        println!("plate in a ball at {resolution}: off by {errors:?}");
        assert!(errors.iter().all(|error| error.abs() < allowed), "{errors:?}");
        let within = SurfaceElements::within(&facets, &plate.images, &region);
        assert_eq!((within.source(), within.area() / exact - 1.0), (Source::Hits, errors[1]));
    }
}

#[test]
fn cut_faces_are_no_surface_and_facets_across_the_region_count_by_hits() {
    let rod = Sampled::of(solids::cuboid(DVec3::ZERO, DVec3::new(1.0, 2.0, 8.0)).unwrap(), 64);
    let grid = *rod.grid();
    let facets = rod.facets();
    let none = SurfaceElements::of_facets(&facets, &rod.boxed()).unwrap();
    assert_eq!(none.area(), 0.0);
    assert_eq!(SurfaceElements::of_hits(&facets, &rod.images, &rod.boxed(), Scale::Counted).area(), 0.0);
    // The same rod in a box that is as high but wider: its ends were cut.
    let wide = grid_of(DVec3::new(-4.0, -4.0, 0.0), DVec3::new(4.0, 4.0, 8.0), 64);
    let in_wide = Sampled::on(&wide, rod.mesh.clone());
    let sides = SurfaceElements::within(&facets, &in_wide.images, &in_wide.whole());
    assert_eq!((sides.source(), sides.area()), (Source::Facets, 48.0));
    // And in the middle half of that box.
    let mut bounds = in_wide.whole().bounds();
    bounds.min[2] = wide.length(2) / 4;
    bounds.max[2] -= bounds.min[2];
    let half = Region::of_box(&wide, bounds);
    assert!(matches!(SurfaceElements::of_facets(&facets, &half), Err(SurfaceError::Beyond { .. })));
    let sides = SurfaceElements::within(&facets, &in_wide.images, &half);
    assert_eq!((sides.source(), sides.area()), (Source::Hits, 24.0));
    assert_eq!(grid.rays()[2], 64);
}

#[test]
fn overlapping_shells_are_counted_by_hits() {
    let pair = together(&[cube(2.0), solids::cuboid(DVec3::ZERO, DVec3::splat(2.0)).unwrap()]);
    let grid = grid_of(DVec3::splat(-1.5), DVec3::splat(2.5), 64);
    let pair = Sampled::on(&grid, pair);
    let facets = pair.facets();
    let found = SurfaceElements::within(&facets, &pair.images, &pair.whole());
    assert_eq!(found.source(), Source::Hits);
    // Two cubes of side 2 less the surface of their overlap, a cube of side 1.
    assert!((found.area() - (48.0 - 6.0)).abs() < 0.5, "{}", found.area());
}

#[test]
fn areas_do_not_depend_on_the_thread_count() {
    let cell = Sampled::of(network(Surface::Gyroid, 1, 24), 40);
    let ball = Sampled::on(cell.grid(), solids::geodesic(0.4, 12).unwrap());
    let [one, two] = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let region = Region::of_solid(&ball.images);
        pool.install(|| SurfaceElements::within(&cell.facets(), &cell.images, &region).areas().to_vec())
    });
    assert!(one == two && one.iter().any(|&area| area > 0.0));
}
