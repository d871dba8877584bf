//! Finer rasters whose rays include those of a coarser one, and boxes of their pixels.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::atomic::Ordering;

use glam::DVec3;

use super::{Axis, Grid, GridError, LatticeBox, LatticeSolid, NEXT_IDENTITY};
use crate::parallel::*;

impl Grid {
    /// Returns a grid whose rays lie 2^`levels` times closer together and include those of this grid: of the new numbers of rays
    /// along any axis, i · 2^`levels` + 2^(`levels` − 1) is old ray i. Its lattice has the same step and lies
    /// [`refined_by`](Grid::refined_by) further down, so that the old lattice's even positions are even.
    ///
    /// # Errors
    /// Fails if a pixel would have fewer than four lattice steps, or an image too many rays.
    pub(crate) fn refined(&self, levels: u32) -> Result<Grid, GridError> {
        if self.shift < levels + 2 {
            return Err(GridError::Shift { shift: self.shift.saturating_sub(levels) });
        }
        let rays = self.rays.map(|n| (u64::from(n) << levels) + 1);
        if let Some(&rays) = rays.iter().find(|&&n| n > u64::from(super::RAYS_MAX)) {
            return Err(GridError::Resolution { rays });
        }
        let origin = self.origin - self.step() * DVec3::splat(f64::from(self.refined_by(levels)));
        let pitch = self.pitch / f64::from(1u32 << levels);
        Grid::from_parts(origin, pitch, rays.map(|n| n as u32), self.shift - levels, self.lod)
    }

    /// Returns the grid of some of its pixels along each axis.
    pub(crate) fn part(&self, pixels: &[Range<u32>; 3]) -> Grid {
        let starts = DVec3::from_array(pixels.each_ref().map(|range| f64::from(range.start)));
        let rays = pixels.each_ref().map(|range| range.end - range.start);
        Grid { origin: self.origin + self.pitch * starts, rays, ..*self }
    }

    /// Returns the lattice position, on the grid [refined](Grid::refined) by some levels, of this grid's position 0.
    pub(crate) fn refined_by(&self, levels: u32) -> i32 {
        1 << (self.shift - levels - 1)
    }
}

/// A box of pixels of a finer raster: that of a grid whose pitch is halved some times, on the same lattice.
#[derive(Clone, Debug)]
pub(crate) struct FineBox {
    /// The finer raster, around everything.
    whole: Grid,
    /// The grid of the pixels in the box.
    grid: Grid,
    /// The pixels along x, y and z, numbered on the finer raster.
    pixels: [Range<u32>; 3],
}

impl FineBox {
    /// Creates the box of all pixels of a grid whose pitch is halved `levels` times.
    ///
    /// # Errors
    /// Those of [`Grid::refined`].
    pub fn all(coarse: &Grid, levels: u32) -> Result<FineBox, GridError> {
        let whole = coarse.refined(levels)?;
        Ok(FineBox { whole, grid: whole, pixels: whole.rays.map(|n| 0..n) })
    }

    /// Returns the box of some pixels of the same finer raster.
    pub fn with_pixels(&self, pixels: [Range<u32>; 3]) -> FineBox {
        FineBox { whole: self.whole, grid: self.whole.part(&pixels), pixels }
    }

    /// Returns the grid of the pixels in the box, on which its images lie.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Returns the finer raster, around everything.
    pub fn whole(&self) -> &Grid {
        &self.whole
    }

    /// Returns the pixels along x, y and z, numbered on the finer raster.
    pub fn pixels(&self) -> &[Range<u32>; 3] {
        &self.pixels
    }

    /// Returns the lattice position on the finer raster of the coarse grid's position 0, along each axis.
    pub fn refined_by(&self) -> i32 {
        1 << (self.whole.shift - 1)
    }

    /// Returns the lattice position of the coarse grid that is position 0 of the box.
    pub fn origin(&self) -> [i32; 3] {
        self.pixels.each_ref().map(|range| (range.start << self.whole.shift) as i32 - self.refined_by())
    }

    /// Returns the lattice positions of the finer raster between which the box lies along an axis.
    pub fn span(&self, axis: Axis) -> [i32; 2] {
        let Range { start, end } = self.pixels[axis.depth()];
        [start, end].map(|pixel| (pixel << self.whole.shift) as i32)
    }
}

impl<'m> LatticeSolid<'m> {
    /// Returns the same solid on the finer raster of a box, for its image along an axis of the pixels of the box across it. The rays run
    /// through all of the solid, of which nothing is rounded again.
    pub(crate) fn along(&self, axis: Axis, fine: &FineBox) -> LatticeSolid<'m> {
        let mut pixels = fine.pixels.clone();
        pixels[axis.depth()] = 0..fine.whole.rays[axis.depth()];
        self.moved(&fine.whole, fine.refined_by(), &pixels)
    }

    /// Returns the same solid for images along z of some of its grid's pixels along x and y. The rays run through all of the solid.
    pub(crate) fn within_pixels(&self, [columns, rows]: &[Range<u32>; 2]) -> LatticeSolid<'m> {
        self.moved(&self.grid, 0, &[columns.clone(), rows.clone(), 0..self.grid.rays[2]])
    }

    /// Returns the same solid on the grid of some pixels of a raster, beyond which it may extend. Its own positions on the raster are
    /// larger by `from`.
    fn moved(&self, raster: &Grid, from: i32, pixels: &[Range<u32>; 3]) -> LatticeSolid<'m> {
        let by = pixels.each_ref().map(|range| from - (range.start << raster.shift) as i32);
        let grid = raster.part(pixels);
        let moved = |p: [i32; 3]| std::array::from_fn(|i| p[i] + by[i]);
        LatticeSolid {
            grid,
            positions: Cow::Owned(self.positions.par_iter().with_min_len(1 << 14).map(|&p| moved(p)).collect()),
            triangles: self.triangles,
            closure: self.closure,
            bounds: LatticeBox { min: moved(self.bounds.min), max: moved(self.bounds.max) },
            region: grid.whole(),
            identity: NEXT_IDENTITY.fetch_add(1, Ordering::Relaxed),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ldi::{Estimate, FillRule, Mode};
    use crate::sampler::Sampler;
    use crate::sampler::cpu::CpuSampler;
    use crate::solids;
    use crate::testing::images::{closed, grid_around, images};
    use crate::testing::random::Random;

    #[test]
    fn the_rays_of_a_refined_raster_include_the_old_ones_to_the_bit() {
        let star = closed(solids::star(1.0, 0.3, 2).unwrap());
        for resolution in [17, 32] {
            let grid = grid_around(&[&star], resolution, 1024);
            let solid = grid.quantise(&star).unwrap();
            let coarse = images(&solid, Mode::Exact);
            for (levels, axis) in (1..=3).flat_map(|levels| Axis::ALL.map(|axis| (levels, axis))) {
                let whole = grid.refined(levels).unwrap().rays();
                let (across, [columns, rows]) = (axis.column(), [axis.column(), axis.row()].map(|i| whole[i]));
                let mut compared = 0;
                for columns in [0..columns, columns / 3..columns / 2, columns - 9..columns] {
                    let mut pixels = whole.map(|n| 0..n);
                    pixels[across] = columns.clone();
                    pixels[axis.row()] = 3..rows - 2;
                    let fine = FineBox::all(&grid, levels).unwrap().with_pixels(pixels.clone());
                    let solid = solid.along(axis, &fine);
                    let image = CpuSampler::default().sample(&solid, axis, Mode::Exact, FillRule::EvenOdd).unwrap();
                    let in_box = image.in_box(&fine);
                    let coarse = &coarse[axis.depth()];
                    assert!(image.unclosed().is_empty());
                    for ray in 0..coarse.rays() {
                        let old = coarse.size().0;
                        let [column, row] = [ray % old, ray / old].map(|i| (i << levels) + (1 << (levels - 1)));
                        if columns.contains(&column) && pixels[axis.row()].contains(&row) {
                            let [on_whole, on_box] = [fine.refined_by(), -fine.origin()[axis.depth()]]
                                .map(|by| coarse.samples(ray).iter().map(|d| d + by).collect::<Vec<_>>());
                            let ray_of_box = (row - 3) * image.size().0 + column - columns.start;
                            assert_eq!(image.samples(ray_of_box), on_whole, "{axis:?} {ray}");
                            assert_eq!(in_box.samples(ray_of_box), on_box, "{axis:?} {ray}");
                            compared += on_box.len();
                        }
                    }
                }
                assert!(compared > 100);
            }
        }
    }

    #[test]
    fn rays_of_some_pixels_are_those_of_the_whole_grid() {
        let star = closed(solids::star(1.0, 0.3, 2).unwrap());
        let grid = grid_around(&[&star], 90, 64);
        let solid = grid.quantise(&star).unwrap();
        let [columns, rows, _] = grid.rays();
        let mut random = Random::new(5);
        let mut some = |count: u32| {
            let start = random.below(count as usize) as u32;
            start..start + 1 + random.below((count - start) as usize) as u32
        };
        for _ in 0..40 {
            let pixels = [some(columns), some(rows)];
            let part = solid.within_pixels(&pixels);
            for mode in [Mode::Exact, Mode::Estimate(Estimate::Over), Mode::Estimate(Estimate::Under)] {
                let sample = |solid| CpuSampler::default().sample(solid, Axis::Z, mode, FillRule::EvenOdd).unwrap();
                let [whole, part] = [sample(&solid), sample(&part)];
                let [columns_of_part, _] = pixels.each_ref().map(|range| range.end - range.start);
                for (y, row) in pixels[1].clone().enumerate() {
                    for (x, column) in pixels[0].clone().enumerate() {
                        let ray = y as u32 * columns_of_part + x as u32;
                        assert_eq!(part.samples(ray), whole.samples(row * columns + column), "{pixels:?} {mode:?}");
                    }
                }
            }
        }
    }
}
