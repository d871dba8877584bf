//! The details finer than the lattice that a surface lacks.
//!
//! Crossings of one lattice edge are dropped in pairs. At a sharp edge that the surface has it passes near them all the same. So a
//! pair is lost only where one of its crossings is away from the surface.

use crate::parallel::*;
use glam::DVec3;

use super::edges::{Dropped, DroppedPair};
use super::features::CellFilter;
use super::intersect::{cells_of, key};
use crate::cancel::checkpoint;
use crate::closest::squared_distance;

/// Details finer than the lattice that a surface lacks, and crossings that conservative images leave open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SubResolution {
    /// Pairs of crossings with walls: a ray enters and leaves between two neighbouring nodes, and one of both crossings is more than a
    /// twentieth of the pitch from the surface.
    pub walls: u64,
    /// Pairs of crossings with gaps: a ray leaves and enters between two neighbouring nodes, and one of both crossings is as far away.
    pub gaps: u64,
    /// Edges that are crossed by the nodes' signs but whose own ray has no sample there, as may occur in conservative images.
    pub unsupported: u64,
}

/// Greatest distance from the surface, in pitches, at which a crossing is not lost: as far as simplification moves a surface by
/// default.
pub(super) const NEAR: f64 = 0.05;

impl SubResolution {
    /// Counts the pairs that a surface, in coordinates of cells, is away from.
    pub(super) fn of(dropped: &Dropped, vertices: &[DVec3], triangles: &[[u32; 3]]) -> SubResolution {
        let places: Vec<[DVec3; 2]> = dropped.pairs.iter().map(DroppedPair::places).collect();
        SubResolution::of_lost(dropped, &lost(&places, NEAR, vertices, triangles))
    }

    /// Counts the lost ones of dropped pairs, by number.
    pub(super) fn of_lost(dropped: &Dropped, lost: &[usize]) -> SubResolution {
        let walls = lost.iter().filter(|&&pair| dropped.pairs[pair].is_wall).count();
        SubResolution { walls: walls as u64, gaps: (lost.len() - walls) as u64, unsupported: dropped.unsupported }
    }
}

/// Returns the pairs of points, by number, of which a surface is further than `near_by` from one.
pub(super) fn lost(pairs: &[[DVec3; 2]], near_by: f64, vertices: &[DVec3], triangles: &[[u32; 3]]) -> Vec<usize> {
    if pairs.is_empty() {
        return Vec::new();
    }
    let mut cells = CellFilter::new(4 * pairs.len());
    let cells_near = |point| cells_of(point - near_by, point + near_by);
    pairs.iter().flatten().flat_map(|&point| cells_near(point)).for_each(|cell| cells.add(cell));
    let corners = |triangle: u32| triangles[triangle as usize].map(|vertex| vertices[vertex as usize]);
    // The triangles near the pairs, by cell.
    let of_triangle = |triangle: u32| {
        let [a, b, c] = corners(triangle);
        let touched = cells_of(a.min(b).min(c), a.max(b).max(c));
        touched.filter(|&cell| cells.may_be(cell)).map(move |cell| (key(cell), triangle))
    };
    checkpoint();
    let all = (0..triangles.len() as u32).into_par_iter().with_min_len(1 << 12);
    let mut near: Vec<(u64, u32)> = all.flat_map_iter(of_triangle).collect();
    near.par_sort_unstable();
    let is_near = |point: DVec3| {
        cells_near(point).any(|cell| {
            let in_cell = &near[near.partition_point(|place| place.0 < key(cell))..];
            let mut in_cell = in_cell.iter().take_while(|place| place.0 == key(cell));
            in_cell.any(|&(_, triangle)| squared_distance(point, corners(triangle)) <= near_by * near_by)
        })
    };
    checkpoint();
    let is_lost = |&pair: &usize| !pairs[pair].into_iter().all(is_near);
    (0..pairs.len()).into_par_iter().with_min_len(64).filter(is_lost).collect()
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;
    use crate::ldi::{Mode, NodePlanes};
    use crate::mesh::TriangleMesh;
    use crate::surface::contour;
    use crate::surface::cuts::Cuts;
    use crate::surface::edges::{EdgeSlab, Source};
    use crate::surface::part::Part;
    use crate::testing::images::{closed, grid_around, surface_images};
    use crate::testing::meshes::{cube, reversed, together};
    use crate::testing::random::Random;

    #[test]
    fn pairs_at_sharp_edges_are_not_lost_and_those_around_specks_are() {
        let mut turned = cube(DVec3::ZERO, 1.0);
        turned.transform(&DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.5));
        let turned = closed(turned);
        let grid = grid_around(&[&turned], 50, 1024);
        // A cube of 0.3 pitches around the middle of the lattice edge along x from a node.
        let speck = |node: [u32; 3]| {
            let node = DVec3::from_array(node.map(|i| f64::from(grid.node(i)))) * grid.step() + grid.origin();
            cube(node + grid.pitch() * (DVec3::new(0.5, 0.0, 0.0) - 0.15), 0.3 * grid.pitch())
        };
        let [wall, gap] = [speck([1, 1, 1]), reversed(&speck(grid.rays().map(|rays| rays / 2)))];
        for (others, lost) in [(vec![], [0, 0]), (vec![wall.clone()], [1, 0]), (vec![wall, gap], [1, 1])] {
            let mesh = closed(together(&[vec![turned.mesh().clone()], others].concat()));
            let solid = grid.quantise(&mesh).unwrap();
            let (images, normals) = (surface_images(&solid), solid.normals());
            let images = images.each_ref();
            let planes = NodePlanes::new(images, Mode::Exact).unwrap();
            let source = Source { planes, images, normals: Some(&normals), mode: Mode::Exact, nodes: None };
            let slab = EdgeSlab::new(&source, &Cuts::of_thin(&source, Part::Whole), -1..grid.rays()[2] as i32);
            assert!(slab.dropped.pairs.len() > 20, "{}", slab.dropped.pairs.len());
            let surface = contour(images, Some(&normals), Mode::Exact).unwrap();
            assert_eq!(surface.sub_resolution, SubResolution { walls: lost[0], gaps: lost[1], unsupported: 0 });
        }
    }

    /// Random cubes of a size of the pitch, whose rays cross many edges three times and more; some edges are cut.
    #[test]
    fn each_sample_belongs_to_a_triangle_or_is_dropped() {
        let mut random = Random::new(7);
        let cubes: Vec<TriangleMesh> =
            (0..3000).map(|_| cube(DVec3::from_array([0; 3].map(|_| random.share())), 0.08 * random.share())).collect();
        let mesh = closed(together(&cubes));
        let grid = grid_around(&[&mesh], 20, 1024);
        let solid = grid.quantise(&mesh).unwrap();
        let (images, normals) = (surface_images(&solid), solid.normals());
        let images = images.each_ref();
        let planes = NodePlanes::new(images, Mode::Exact).unwrap();
        let source = Source { planes, images, normals: Some(&normals), mode: Mode::Exact, nodes: None };
        let (cuts, layers) = (Cuts::of_thin(&source, Part::Whole), -1..grid.rays()[2] as i32);
        let slab = EdgeSlab::new(&source, &cuts, layers.clone());
        let kept = layers.clone().flat_map(|k| (0..3).map(move |axis| (axis, k)));
        let [crossed, cut] = kept.fold([0, 0], |[crossed, cut], (axis, k)| {
            [crossed + slab.crossed_in(axis, k).count(), cut + cuts.in_layer(axis, k).count()]
        });
        let samples: usize = images.iter().map(|image| image.depths().len()).sum();
        let dropped = slab.dropped.pairs.len();
        assert_eq!((samples, slab.dropped.unsupported), (crossed + 2 * cut + 2 * dropped, 0));
        assert!(crossed > 1000 && cut > 10 && dropped > 1000, "{crossed} crossed, {cut} cut, {dropped} dropped");
        let walls = slab.dropped.pairs.iter().filter(|pair| pair.is_wall).count();
        assert!(walls > 100 && dropped - walls > 100, "{walls} walls");
        assert!(slab.dropped.pairs.iter().all(|pair| {
            let [lower, upper] = pair.places().map(|place| place - place.floor()).map(|at| at.max_element());
            lower <= upper
        }));
    }
}
