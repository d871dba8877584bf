//! The share of each cell of a raster that lies inside, along the rays through its node.

use std::ops::Range;

use crate::parallel::*;

use super::{Ldi, Spans};
use crate::cancel::checkpoint;

/// The number of cells along x that a task fills.
const SLICES: usize = 16;

/// Returns for each cell the length of its rays that is inside, as a share: the mean over the axes of the images. Cell (x, y, z)
/// is at `(x · size[1] + y) · size[2] + z`.
///
/// # Panics
/// If there is no image, or the images are not of one grid.
pub fn coverage(images: &[Ldi]) -> Vec<f32> {
    let grid = images[0].grid();
    assert!(images.iter().all(|image| image.grid() == grid), "images of one grid");
    let size @ [_, rows, layers] = grid.rays().map(|n| n as usize);
    let mut cells = vec![0.0; size.iter().product()];
    cells.par_chunks_mut((SLICES * rows * layers).max(1)).enumerate().for_each(|(part, cells)| {
        let first = part * SLICES;
        let along_x = first..first + cells.len() / (rows * layers);
        for image in images {
            add_image(image, &along_x, cells, images.len() as f32);
        }
    });
    cells
}

/// Adds the shares of an image to the cells of a range of x, divided by the number of images.
fn add_image(image: &Ldi, along_x: &Range<usize>, cells: &mut [f32], images: f32) {
    let [columns, rows, layers] = image.grid().rays().map(|n| n as usize);
    let mut ranges = [along_x.clone(), 0..rows, 0..layers];
    let axis = image.axis();
    let depths = std::mem::replace(&mut ranges[axis.depth()], 0..1);
    debug_assert!(along_x.end <= columns);
    let (width, shift) = (image.size().0, image.grid().shift());
    let scale = 1.0 / (images * (1u64 << shift) as f32);
    for x in ranges[0].clone() {
        checkpoint();
        for y in ranges[1].clone() {
            for z in ranges[2].clone() {
                let mut node = [x, y, z];
                let ray = node[axis.row()] as u32 * width + node[axis.column()] as u32;
                for span in Spans::new(image.samples(ray)) {
                    each_share(span, shift, &depths, |depth, length| {
                        node[axis.depth()] = depth;
                        let [x, y, z] = node;
                        cells[((x - along_x.start) * rows + y) * layers + z] += length as f32 * scale;
                    });
                }
            }
        }
    }
}

/// Calls `add` with each cell in a range that a span meets, and the length of the span in it, in steps.
fn each_share((enter, leave): (i32, i32), shift: u32, cells: &Range<usize>, mut add: impl FnMut(usize, i32)) {
    let edge = |cell: usize| (cell as i32) << shift;
    let (enter, leave) = (enter.max(edge(cells.start)), leave.min(edge(cells.end)));
    let mut at = enter;
    while at < leave {
        let cell = (at >> shift) as usize;
        let end = leave.min(edge(cell + 1));
        add(cell, end - at);
        at = end;
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::grid::{Axis, Grid};
    use crate::sampler::cpu::CpuSampler;
    use crate::sampler::{FillRule, Mode, Sampler};
    use crate::solids;
    use crate::testing::images::closed;

    #[test]
    fn cells_have_the_share_that_a_cuboid_covers_along_their_rays() {
        // Cells of side 1; the cuboid covers all, three quarters or nothing of a cell along each ray.
        let cuboid = closed(solids::cuboid(DVec3::new(1.0, 2.0, 0.25), DVec3::new(37.75, 4.0, 3.0)).unwrap());
        let grid = Grid::from_parts(DVec3::ZERO, 1.0, [40, 5, 4], 8, 64).unwrap();
        let solid = grid.quantise(&cuboid).unwrap();
        let images =
            Axis::ALL.map(|axis| CpuSampler::default().sample(&solid, axis, Mode::Exact, FillRule::EvenOdd).unwrap());
        let share = |cell: usize, [low, high]: [f64; 2]| (high.min(cell as f64 + 1.0) - low.max(cell as f64)).max(0.0);
        let node = |cell: usize, [low, high]: [f64; 2]| f64::from(low < cell as f64 + 0.5 && cell as f64 + 0.5 < high);
        let sides = [[1.0, 37.75], [2.0, 4.0], [0.25, 3.0]];
        for chosen in [&images[..], &images[..1], &images[1..2], &images[2..]] {
            let cells = coverage(chosen);
            for (index, &cell) in cells.iter().enumerate() {
                let at = [index / 20, index / 4 % 5, index % 4];
                let along = |axis: usize| -> f64 {
                    let factor = |i: usize| if i == axis { share(at[i], sides[i]) } else { node(at[i], sides[i]) };
                    (0..3).map(factor).product()
                };
                let sum: f64 = chosen.iter().map(|image| along(image.axis().depth())).sum();
                assert!((f64::from(cell) - sum / chosen.len() as f64).abs() < 1e-6, "{at:?}: {cell}");
            }
        }
    }
}
