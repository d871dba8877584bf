//! Finer rasters whose rays include those of a coarser one.

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

    /// Returns the lattice position, on the grid [refined](Grid::refined) by some levels, of this grid's position 0.
    pub(crate) fn refined_by(&self, levels: u32) -> i32 {
        1 << (self.shift - levels - 1)
    }
}

impl LatticeSolid<'_> {
    /// Returns the same solid on a [refined](Grid::refined) grid, of which only some columns along an axis are left; nothing is rounded
    /// again. Only the columns of that axis are moved, so that only images along it can be made.
    ///
    /// # Errors
    /// Fails where there is no such grid.
    pub(crate) fn refined(&self, levels: u32, axis: Axis, columns: &Range<u32>) -> Result<LatticeSolid<'_>, GridError> {
        let fine = self.grid.refined(levels)?;
        let (across, start) = (axis.column(), (columns.start << fine.shift) as i32);
        let mut by = [self.grid.refined_by(levels); 3];
        by[across] -= start;
        let mut grid = fine;
        grid.rays[across] = columns.end - columns.start;
        grid.origin[across] += fine.pitch * f64::from(columns.start);
        let moved = |p: [i32; 3]| std::array::from_fn(|i| p[i] + by[i]);
        Ok(LatticeSolid {
            grid,
            positions: Cow::Owned(self.positions.par_iter().with_min_len(1 << 14).map(|&p| moved(p)).collect()),
            triangles: self.triangles,
            closure: self.closure,
            bounds: LatticeBox { min: moved(self.bounds.min), max: moved(self.bounds.max) },
            region: grid.whole(),
            identity: NEXT_IDENTITY.fetch_add(1, Ordering::Relaxed),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ldi::{FillRule, Mode};
    use crate::sampler::Sampler;
    use crate::sampler::cpu::CpuSampler;
    use crate::solids;
    use crate::testing::images::{closed, grid_around, images};

    #[test]
    fn the_rays_of_a_refined_raster_include_the_old_ones_to_the_bit() {
        let star = closed(solids::star(1.0, 0.3, 2).unwrap());
        for resolution in [17, 32] {
            let grid = grid_around(&[&star], resolution, 1024);
            let solid = grid.quantise(&star).unwrap();
            let coarse = images(&solid, Mode::Exact);
            for (levels, axis) in (1..=3).flat_map(|levels| Axis::ALL.map(|axis| (levels, axis))) {
                let whole = grid.refined(levels).unwrap().rays()[axis.column()];
                let mut compared = 0;
                for columns in [0..whole, whole / 3..whole / 2, whole - 9..whole] {
                    let solid = solid.refined(levels, axis, &columns).unwrap();
                    let fine = CpuSampler::default().sample(&solid, axis, Mode::Exact, FillRule::EvenOdd).unwrap();
                    let coarse = &coarse[axis.depth()];
                    assert!(fine.unclosed().is_empty());
                    let by = grid.refined_by(levels);
                    for ray in 0..coarse.rays() {
                        let old = coarse.size().0;
                        let [column, row] = [ray % old, ray / old].map(|i| (i << levels) + (1 << (levels - 1)));
                        if columns.contains(&column) {
                            let moved: Vec<i32> = coarse.samples(ray).iter().map(|d| d + by).collect();
                            assert_eq!(
                                fine.samples(row * fine.size().0 + column - columns.start),
                                moved,
                                "{axis:?} {ray}"
                            );
                            compared += moved.len();
                        }
                    }
                }
                assert!(compared > 100);
            }
        }
    }
}
