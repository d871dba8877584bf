//! Crossings of images, including those cut by regions.

use glam::DVec3;

use super::*;
use crate::grid::Grid;
use crate::ldi::Ldi;
use crate::mesh::Aabb;
use crate::metrics::Region;
use crate::solids;
use crate::testing::images::{surface_images_on, whole};

/// Returns the raster of the cube from 0 to 1.
fn unit_grid(resolution: u32) -> Grid {
    Grid::with_resolution(Aabb { min: DVec3::ZERO, max: DVec3::ONE }, resolution, 1024).unwrap()
}

/// Returns a ball of radius 0.4 in the middle of the cube.
fn ball(grid: &Grid) -> [Ldi; 3] {
    let mut mesh = solids::geodesic(0.4, 40).unwrap();
    mesh.positions.iter_mut().for_each(|position| *position += DVec3::splat(0.5));
    surface_images_on(grid, mesh)
}

fn total(crossings: &Crossings) -> usize {
    Axis::ALL.map(|axis| crossings.count(axis)).iter().sum()
}

#[test]
fn faces_cut_by_the_box_are_surface_only_with_a_border() {
    let grid = unit_grid(20);
    let region = Region::of_box(&grid, whole(&grid));
    let block = surface_images_on(&grid, solids::cuboid(DVec3::ZERO, DVec3::ONE).unwrap());
    for edges in [BoundaryCondition::Clip, BoundaryCondition::Periodic, BoundaryCondition::Border] {
        let crossings = Crossings::of_images(&block, &region, edges);
        assert_eq!(total(&crossings), 0, "{edges:?}");
        assert_eq!(crossings.walls().is_some(), edges == BoundaryCondition::Border);
        let field = DistanceField::of(&crossings, edges);
        let middle = (10 * 20 + 10) * 20 + 10;
        match edges {
            BoundaryCondition::Border => assert!((field.values()[middle] - 9.5).abs() < 1e-3),
            BoundaryCondition::Clip | BoundaryCondition::Periodic => assert!(field.values()[middle].is_infinite()),
        }
    }
}

#[test]
fn a_seam_between_solid_and_pore_is_surface() {
    let grid = unit_grid(20);
    let region = Region::of_box(&grid, whole(&grid));
    let half = surface_images_on(&grid, solids::cuboid(DVec3::ZERO, DVec3::new(0.5, 1.0, 1.0)).unwrap());
    for (edges, expected) in [
        (BoundaryCondition::Clip, &[9.5][..]),
        (BoundaryCondition::Periodic, &[-0.5, 9.5]),
        (BoundaryCondition::Border, &[9.5]),
    ] {
        let crossings = Crossings::of_images(&half, &region, edges);
        let row = crossings.row(Axis::X, 7 * 20 + 3);
        assert_eq!(row.len(), expected.len(), "{edges:?}: {row:?}");
        assert!(
            row.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-3),
            "{edges:?}: {row:?}"
        );
        assert_eq!(crossings.count(Axis::Y) + crossings.count(Axis::Z), 0);
    }
}

#[test]
fn a_solid_that_is_the_region_bounds_balls_with_border_alone() {
    let grid = unit_grid(30);
    let of_ball = ball(&grid);
    let region = Region::of_solid(&of_ball);
    assert_eq!(total(&Crossings::of_images(&of_ball, &region, BoundaryCondition::Clip)), 0);
    let block = surface_images_on(&grid, solids::cuboid(DVec3::ZERO, DVec3::ONE).unwrap());
    let bordered = Crossings::of_images(&block, &region, BoundaryCondition::Border);
    let field = DistanceField::of(&bordered, BoundaryCondition::Border);
    let middle = (15 * 30 + 15) * 30 + 15;
    let expected = 12.0 - 0.75f64.sqrt();
    assert!((f64::from(field.values()[middle]) - expected).abs() < 0.05, "{}", field.values()[middle]);
}

#[test]
fn distances_of_images_equal_those_to_the_nearest_crossing_and_slightly_exceed_true_ones() {
    let grid = unit_grid(30);
    let region = Region::of_box(&grid, whole(&grid));
    let crossings = Crossings::of_images(&ball(&grid), &region, BoundaryCondition::Clip);
    let field = check(&crossings, BoundaryCondition::Clip);
    for (index, node) in nodes([30; 3]).enumerate() {
        let exact = (distance(node.map(|i| i as f64), [14.5; 3]) - 12.0).abs();
        let found = f64::from(field.values()[index]);
        let most = (exact * exact + 0.75).sqrt();
        assert!(found > exact - 0.05 && found < most + 0.05, "{node:?}: {found}, and {exact} in truth");
    }
}
