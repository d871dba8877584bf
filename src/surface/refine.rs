//! Blocks of finer cells where a surface lacks details.
//!
//! Where pairs of crossings between two nodes are lost, the cells around are replaced by finer ones, from images whose rays lie 2, 4
//! or 8 times closer together and include the old ones; nothing is rounded again, so that the signs of the old nodes stay as they are.
//! The meshes of both are joined by the loops of the cells around each block (`border`).
//!
//! A block is taken at the finest level that brings its mesh near more of the pairs that were dropped in its cells. Where triangles
//! cross at its border, the vertices there go back to the means of their crossings; then those that belong to sharp edges beyond their
//! cells go there (`joined`). A block whose triangles cross others all the same is taken at a coarser level, or not at all. Large groups
//! whose finer cells would be more than those of the whole surface are left out. If the volume moves away from the images'
//! estimate by more than the error of it, vertices do not go beyond their cells, and if that does not help, all blocks are given up.

mod groups;
mod joined;
mod window;

use std::cell::LazyCell;
use std::collections::VecDeque;

use glam::DVec3;

use super::border::{Border, Scale, Sides};
use super::cuts::Cuts;
use super::edges::{Dropped, DroppedPair, Source};
use super::lost::{NEAR, lost};
use super::manifold::ManifoldReport;
use super::part::{Block, Blocks, Part};
use super::{Contoured, Coordinates, MOST_LAYERS, SubResolution, Surface, SurfaceError, contour_part, source_of};
use crate::grid::FineBox;
use crate::integrate::{AxisVolume, VolumeEstimate};
use crate::ldi::{Ldi, Mode};
use crate::parallel::*;
use groups::{Group, groups};
use joined::Joined;
use window::{Batch, Window};
pub(crate) use window::{FineImages, FineSampler};

/// A solid that can be sampled in boxes of finer pixels.
pub(crate) struct FineSource<S> {
    /// The sampler: see [`FineSampler`].
    pub sample: S,
    /// The number of triangles that it looks at for each image.
    pub triangles: usize,
}

/// Contours the solid of three exact images like [`contour_in`](super::contour_in), with finer cells where it has details finer than
/// the lattice: halved up to `levels` times.
///
/// # Errors
/// Those of `contour_in` and of the sampler.
pub(crate) fn contour_refined<E: From<SurfaceError>>(
    images: [&Ldi; 3],
    normals: Option<&[[f32; 3]]>,
    coordinates: Coordinates,
    levels: u32,
    from: FineSource<impl FnMut(&FineBox) -> Result<Option<FineImages>, E>>,
) -> Result<Surface, E> {
    let source = source_of(images, normals, Mode::Exact)?;
    let plain = contour_part(source, Part::Whole, coordinates, MOST_LAYERS)?;
    let lost = lost(&places(&plain.dropped), NEAR, &plain.vertices, &plain.triangles);
    let sub_resolution = SubResolution::of_lost(&plain.dropped, &lost);
    if levels == 0 || lost.is_empty() {
        return Ok(plain.into_surface_that_lacks(sub_resolution));
    }
    let estimate = LazyCell::new(|| VolumeEstimate::from_axes(&images.map(AxisVolume::of)));
    let groups = groups(&source, &plain.dropped.pairs, &lost);
    let mut blocks = refined(&source, &groups, coordinates, levels.min(MOST_LEVELS), from)?;
    // A block that crosses the mesh around it is made coarser, and given up in the end.
    for round in 0.. {
        blocks.retain(|levels| !levels.is_empty());
        if blocks.is_empty() {
            break;
        }
        let chosen: Vec<&Refined> = blocks.iter().filter_map(|levels| levels.last()).collect();
        let around = Blocks::new(chosen.iter().map(|one| &one.block).collect());
        let coarse = contour_part(source, Part::Around(&around), coordinates, MOST_LAYERS)?;
        let mut joined = Joined::of(coarse, &chosen)?;
        let crossed = joined.part(coordinates.precision);
        if crossed.is_empty() {
            let finest = chosen.iter().map(|one| 1 << one.block.border.scale.levels).max().unwrap_or(0);
            let blocks = FinerBlocks { count: chosen.len() as u64, finest };
            let is_near = |volume: f64| is_near_volume(&estimate, plain.volume(), volume);
            joined.move_beyond(coordinates.precision, |volume| !is_near(volume));
            let surface = Surface { blocks, ..joined.into_surface(&plain.dropped, coordinates.precision) };
            let SubResolution { walls, gaps, .. } = surface.sub_resolution;
            let is_manifold = || ManifoldReport::of(&surface.mesh, coordinates.precision).failures().is_empty();
            if walls + gaps < lost.len() as u64 && is_near(surface.mesh.signed_volume()) && is_manifold() {
                return Ok(surface);
            }
            break;
        }
        for block in crossed {
            blocks[block].pop();
            if round >= ROUNDS {
                blocks[block].clear();
            }
        }
    }
    Ok(plain.into_surface_that_lacks(sub_resolution))
}

/// Greatest share of the volume by which finer cells may take that of a mesh further from the estimate than its error.
const FURTHER: f64 = 1e-3;

/// Returns whether the volume of a refined mesh is within the error of an estimate, or not clearly further from it than before: thin
/// walls that end at blocks on all sides fall apart.
fn is_near_volume(estimate: &VolumeEstimate, before: f64, after: f64) -> bool {
    let away = |volume: f64| ((volume - estimate.value).abs() - estimate.error).max(0.0);
    away(after) <= away(before) + FURTHER * estimate.value.max(before)
}

/// The most levels of finer cells.
pub const MOST_LEVELS: u32 = 4;

/// Rounds after which a block that still crosses others is given up.
const ROUNDS: usize = 1;

/// The most cells of blocks, by the area of the finest, where those of the whole raster are fewer.
const FEW_CELLS: u64 = 1 << 16;

/// The number of cells up to which a group whose triangles cross is tried with finer ones.
const FEW: usize = 128;

/// The most finer rays of a level, where eight times those of the raster are fewer.
const FEW_RAYS: u64 = 1 << 22;

/// The blocks of finer cells of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FinerBlocks {
    /// Their number.
    pub count: u64,
    /// How many of the finest cells fit into a pitch; 0 without blocks.
    pub finest: u32,
}

/// Returns the places of dropped pairs of crossings, in coordinates of cells.
fn places(dropped: &Dropped) -> Vec<[DVec3; 2]> {
    dropped.pairs.iter().map(DroppedPair::places).collect()
}

/// A block of finer cells with its mesh.
struct Refined {
    block: Block,
    mesh: Contoured,
    /// The pairs of crossings that it still lacks.
    lost: usize,
}

/// Returns each group at the levels that lose less than the one before.
fn refined<E: From<SurfaceError>>(
    source: &Source,
    groups: &[Group],
    coordinates: Coordinates,
    levels: u32,
    mut from: FineSource<impl FnMut(&FineBox) -> Result<Option<FineImages>, E>>,
) -> Result<Vec<Vec<Refined>>, E> {
    // Of the cells of a block, the surface passes a share; on the whole raster about a third as many as rays cross it.
    let crossings: u64 = source.images.iter().map(|image| image.depths().len() as u64).sum();
    let most_cells = FEW_CELLS.max(2 * crossings);
    let most_rays = FEW_RAYS.max(8 * source.images.iter().map(|image| u64::from(image.rays())).sum::<u64>());
    // Sampling looks at each triangle, at a part of the cost of a ray.
    let rays_of_image = from.triangles as u64 / 4;
    let mut blocks: Vec<Vec<Refined>> = groups.iter().map(|_| Vec::new()).collect();
    let mut open: Vec<usize> = (0..groups.len()).collect();
    for levels in 1..=levels {
        // The smallest first, as far as there is room.
        open.sort_by_key(|&group| groups[group].cells.len());
        let mut cells = 0;
        open.retain(|&group| {
            cells += (groups[group].cells.len() as u64) << (2 * levels);
            cells <= most_cells
        });
        if open.is_empty() {
            break;
        }
        let windows = open.iter().filter_map(|&group| {
            let window = Window::around(&groups[group], source.planes.grid(), levels)?;
            Some((group, window))
        });
        let (of_windows, windows): (Vec<usize>, Vec<Window>) = windows.unzip();
        open.clear();
        let mut batches = Batch::of(&windows, rays_of_image);
        batches.sort_by_key(Batch::rays);
        let mut rays = 0;
        batches.retain(|batch| {
            rays += batch.rays();
            rays <= most_rays
        });
        let mut batches = VecDeque::from(batches);
        while let Some(batch) = batches.pop_front() {
            let Some(FineImages { images, normals }) = (from.sample)(&batch.fine(&windows))? else {
                // The solid may be ambiguous around one window alone.
                batches.extend(batch.halves(&windows).into_iter().flatten());
                continue;
            };
            let normals = normals.as_deref().or(source.normals);
            let refine = |&number: &usize| {
                let (window, group) = (&windows[number], &groups[of_windows[number]]);
                let images = batch.of_window(&images, window);
                let fine = source_of(images.each_ref(), normals, Mode::Exact)?;
                let nodes = fine.planes.slab(0..fine.planes.grid().rays()[2] as i32, 1);
                let fine = Source { nodes: Some(&nodes), ..fine };
                let one = match agree(source, &fine, window.scale, group) {
                    true => Some(refine(source, group, window.scale, fine, coordinates)?),
                    false => None,
                };
                Ok((of_windows[number], one))
            };
            let refined: Vec<(usize, Option<Refined>)> =
                batch.windows.par_iter().map(refine).collect::<Result<_, SurfaceError>>()?;
            for (group, one) in refined.into_iter().filter_map(|(group, one)| Some((group, one?))) {
                let (lost, before) = (one.lost, blocks[group].last().map_or(groups[group].lost, |last| last.lost));
                let is_sound = one.mesh.crossing_pairs == 0;
                if is_sound && lost < before {
                    blocks[group].push(one);
                }
                // Large groups that cross themselves do so all the more on finer cells.
                if lost > 0 && is_sound || !is_sound && groups[group].cells.len() <= FEW {
                    open.push(group);
                }
            }
        }
    }
    Ok(blocks)
}

/// Returns whether the nodes around a group have the same sides in finer images, which they may not where a solid is ambiguous, as
/// one whose surface crosses itself is.
fn agree(source: &Source, fine: &Source, scale: Scale, group: &Group) -> bool {
    group.cells.iter().chain(&group.beside).all(|cell| {
        (0..8).all(|corner| {
            let node = [0, 1, 2].map(|i| cell[i] + (corner >> i & 1));
            source.is_inside(node) == fine.is_inside(scale.fine(node))
        })
    })
}

/// Contours the finer cells of a group.
fn refine(
    source: &Source,
    group: &Group,
    scale: Scale,
    fine: Source,
    coordinates: Coordinates,
) -> Result<Refined, SurfaceError> {
    let grid = source.planes.grid();
    // Which edges may be cut depends on the cells alone.
    let empty = Block { cells: group.cells.clone(), border: Border::empty(scale, grid) };
    let cuts = Cuts::of_thin(&fine, Part::Within(&empty));
    let sides = Sides { source, grid, replaced: &group.cells, fine: &fine, scale };
    let mut block = Block { border: Border::new(&sides, &group.beside, &cuts), ..empty };
    let mesh = contour_part(fine, Part::Within(&block), coordinates, MOST_LAYERS)?;
    block.border.take_places(&mesh.vertices);
    let fine_place = |pair: &[DVec3; 2]| pair.map(|place| scale.fine_place(place));
    let pairs: Vec<[DVec3; 2]> = group.pairs.iter().map(fine_place).collect();
    let lost = lost(&pairs, NEAR * f64::from(scale.parts()), &mesh.vertices, &mesh.triangles);
    Ok(Refined { block, mesh, lost: lost.len() })
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;
    use crate::grid::{Axis, Grid, LatticeSolid};
    use crate::ldi::{FillRule, NodePlanes};
    use crate::mesh::{ClosedMesh, Precision, TriangleMesh};
    use crate::sampler::Sampler;
    use crate::sampler::cpu::CpuSampler;
    use crate::surface::simplify::crossing_pairs;
    use crate::testing::images::{closed, grid_around, images, surface_images};
    use crate::testing::meshes::{cube, reversed, together};
    use crate::testing::random::Random;

    fn refined(mesh: &ClosedMesh, grid: &Grid, levels: u32) -> Surface {
        let solid = grid.quantise(mesh).unwrap();
        refined_by(&solid, &solid, levels, |_| true)
    }

    /// Refines a solid by finer images of another one, in boxes in which there are any.
    fn refined_by(
        of: &LatticeSolid,
        solid: &LatticeSolid,
        levels: u32,
        mut has_images: impl FnMut(&FineBox) -> bool,
    ) -> Surface {
        let (coarse, normals) = (surface_images(of), of.normals());
        let sample = |fine: &FineBox| {
            if !has_images(fine) {
                return Ok(None);
            }
            let images = Axis::ALL.map(|axis| {
                let solid = solid.along(axis, fine);
                CpuSampler::default().sample_surface(&solid, axis, FillRule::EvenOdd).unwrap().in_box(fine)
            });
            Ok::<_, SurfaceError>(Some(FineImages { images, normals: None }))
        };
        let from = FineSource { sample, triangles: normals.len() };
        contour_refined(coarse.each_ref(), Some(&normals), Coordinates::default(), levels, from).unwrap()
    }

    /// Checks the mesh as any output, and that it has the nodes of the raster. Returns the number of its parts.
    fn check(surface: &Surface, of: &ClosedMesh, grid: &Grid) -> usize {
        let mesh = &surface.mesh;
        let report = ManifoldReport::of(mesh, Precision::Single);
        assert!(report.failures().is_empty(), "{:?}", report.failures());
        assert_eq!(crossing_pairs(mesh, Precision::Single), surface.crossing_pairs);
        let nodes = |mesh: &ClosedMesh| {
            let images = images(&grid.quantise(mesh).unwrap(), Mode::Exact);
            NodePlanes::new(images.iter(), Mode::Exact).unwrap().planes().collect::<Vec<_>>()
        };
        assert_eq!(nodes(&closed(mesh.clone())), nodes(of));
        report.components
    }

    /// Returns copies of a solid around the origin, of random places, sizes and directions in the unit cube.
    fn scattered(solid: &TriangleMesh, count: usize, size: f64, seed: u64) -> TriangleMesh {
        let mut random = Random::new(seed);
        let mut one = || {
            let mut one = solid.clone();
            let mut vector = || DVec3::from_array([0; 3].map(|_| random.share()));
            let (axis, to, share) = ((vector() - 0.5).normalize(), vector(), vector());
            let turn = DAffine3::from_axis_angle(axis, 3.0 * share.x);
            let scale = DAffine3::from_scale(DVec3::splat(size * (0.2 + share.y)));
            one.transform(&(DAffine3::from_translation(to) * turn * scale));
            one
        };
        together(&(0..count).map(|_| one()).collect::<Vec<_>>())
    }

    /// Returns cubes of random places, sizes and directions in the unit cube.
    fn random_cubes(count: usize, size: f64, seed: u64) -> TriangleMesh {
        scattered(&cube(DVec3::splat(-0.5), 1.0), count, size, seed)
    }

    /// Returns a cube, and a grid around it.
    fn block_on_20_rays() -> (TriangleMesh, Grid) {
        let block = cube(DVec3::ZERO, 1.0);
        let grid = grid_around(&[&closed(block.clone())], 20, 1024);
        (block, grid)
    }

    /// Returns a cavity from a place on, cubic and of a size, in pitches.
    fn bubble(grid: &Grid, at: [f64; 3], size: f64) -> TriangleMesh {
        reversed(&cube(grid.origin() + grid.pitch() * DVec3::from_array(at), size * grid.pitch()))
    }

    #[test]
    fn specks_and_bubbles_between_nodes_are_there() {
        let (block, grid) = block_on_20_rays();
        let bubble = |at, size| bubble(&grid, at, size);
        // Around the middle of an edge along x, and of one along z.
        let mesh = closed(together(&[block, bubble([8.85, 10.35, 10.35], 0.3), bubble([4.35, 4.35, 5.8], 0.35)]));
        let lost = |gaps| SubResolution { gaps, ..SubResolution::default() };
        let plain = refined(&mesh, &grid, 0);
        assert_eq!(
            (plain.sub_resolution, plain.blocks, check(&plain, &mesh, &grid)),
            (lost(2), FinerBlocks::default(), 1)
        );
        for levels in 1..=3 {
            let surface = refined(&mesh, &grid, levels);
            let blocks = FinerBlocks { count: 2, finest: 2 };
            assert_eq!((surface.sub_resolution, surface.blocks, check(&surface, &mesh, &grid)), (lost(0), blocks, 3));
            let volume = mesh.mesh().signed_volume();
            assert!((surface.mesh.signed_volume() - volume).abs() < 1e-6 * volume);
        }
    }

    #[test]
    fn groups_stay_as_they_are_where_finer_images_lack_or_have_other_nodes() {
        let (block, grid) = block_on_20_rays();
        let bubble = |at, size| bubble(&grid, at, size);
        let [one, two] = [[3.85, 3.35, 3.35], [14.35, 14.35, 14.85]];
        let mesh = closed(together(&[block.clone(), bubble(one, 0.3), bubble(two, 0.35)]));
        let solid = grid.quantise(&mesh).unwrap();
        let plain = refined(&mesh, &grid, 0);
        // A bubble around some nodes takes the place of the second.
        let other = closed(together(&[block, bubble(one, 0.3), bubble(two, 1.3)]));
        let surface = refined_by(&solid, &grid.quantise(&other).unwrap(), 2, |_| true);
        assert_eq!((surface.blocks.count, surface.sub_resolution.gaps), (1, 1));
        check(&surface, &mesh, &grid);
        // Images of both bubbles are missing, those of each by itself only for the second.
        let has_second = |fine: &FineBox| (0..3).all(|i| fine.pixels()[i].end > 30);
        let surface = refined_by(&solid, &solid, 1, |fine| !has_second(fine));
        assert_eq!((surface.blocks.count, surface.sub_resolution.gaps), (1, 1));
        let surface = refined_by(&solid, &solid, 2, |_| false);
        assert_eq!((surface.blocks, surface.sub_resolution), (FinerBlocks::default(), plain.sub_resolution));
        assert_eq!(surface.mesh, plain.mesh);
    }

    #[test]
    fn random_specks_are_found_level_by_level() {
        let (mut before, mut after, mut parts) = (0, 0, 0);
        for seed in 0..4 {
            let mesh = closed(random_cubes(60, 0.05, seed));
            let grid = grid_around(&[&mesh], 40, 1024);
            let counts = (0..=3).map(|levels| {
                let surface = refined(&mesh, &grid, levels);
                let components = check(&surface, &mesh, &grid);
                (surface.sub_resolution.walls + surface.sub_resolution.gaps, components)
            });
            let counts: Vec<(u64, usize)> = counts.collect();
            assert!(counts.is_sorted_by(|a, b| a.0 >= b.0), "{counts:?}");
            (before, after, parts) = (before + counts[0].0, after + counts[3].0, parts + counts[3].1);
        }
        assert!(before > 150 && after < before / 6 && parts > 220, "{before} {after} {parts}");
    }

    /// Blades, whose edges are thinner than the pitch and run from cells through blocks into cells.
    #[test]
    fn sharp_edges_that_pass_through_blocks_stay_sharp_beside_them() {
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let ends = [-0.8, 0.8].map(|x| [at(x, -0.5, -0.09), at(x, -0.5, 0.09), at(x, 0.5, 0.0)]);
        let positions = ends.as_flattened().to_vec();
        let triangles = vec![[0, 2, 1], [3, 4, 5], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]];
        let blade = reversed(&TriangleMesh { positions, triangles });
        let (mut before, mut after) = (0, 0);
        for seed in 0..6 {
            let mesh = closed(scattered(&blade, 3, 0.7, seed));
            let grid = grid_around(&[&mesh], 24, 1024);
            let counts = [0, 3].map(|levels| {
                let surface = refined(&mesh, &grid, levels);
                check(&surface, &mesh, &grid);
                surface.sub_resolution.walls + surface.sub_resolution.gaps
            });
            (before, after) = (before + counts[0], after + counts[1]);
        }
        assert!(before > 80 && 8 * after < 3 * before, "{before} {after}");
    }

    #[test]
    fn volumes_are_near_within_the_error_of_the_estimate() {
        let estimate = VolumeEstimate { value: 10.0, error: 0.2 };
        for (before, after, expected) in [
            (10.0, 10.19, true),
            (10.0, 9.81, true),
            (10.0, 10.22, false),
            (10.0, 9.78, false),
            (10.5, 10.505, true),
            (10.5, 10.52, false),
            (10.5, 9.75, true),
        ] {
            assert_eq!(is_near_volume(&estimate, before, after), expected, "{before} {after}");
        }
    }

    /// Crowds of cubes, most of which pass through others or reach beyond their blocks, on rasters down to one ray.
    #[test]
    fn whatever_is_refined_stays_a_manifold_around_the_same_nodes() {
        for (case, &(count, size, rays)) in
            [(250, 0.08, 20), (40, 0.3, 16), (300, 0.05, 24), (30, 0.5, 5), (10, 0.4, 2), (5, 0.4, 1)]
                .iter()
                .enumerate()
        {
            let mesh = closed(random_cubes(count, size, case as u64));
            let grid = grid_around(&[&mesh], rays, 1024);
            let plain = refined(&mesh, &grid, 0);
            for levels in [1, 2, 4] {
                let surface = refined(&mesh, &grid, levels);
                if !surface.mesh.triangles.is_empty() {
                    check(&surface, &mesh, &grid);
                }
                assert!(surface.crossing_pairs <= plain.crossing_pairs, "{} {}", case, levels);
            }
        }
    }

    #[test]
    fn threads_change_no_bit_of_a_refined_mesh() {
        let mesh = closed(random_cubes(150, 0.06, 7));
        let grid = grid_around(&[&mesh], 30, 1024);
        let with_threads = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| refined(&mesh, &grid, 2))
        };
        let (one, three) = (with_threads(1), with_threads(3));
        assert!(one.blocks.count > 5);
        assert_eq!((one.mesh, one.blocks), (three.mesh, three.blocks));
    }
}
