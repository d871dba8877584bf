//! Conversion of patches to the spans of rays, band by band.

use std::ops::Range;

use crate::parallel::*;

use super::view::{Footprint, View};
use super::{BallPatches, Patch};
use crate::cancel::checkpoint;
use crate::fixed::{Crossing, Hit};
use crate::grid::{Axis, FineBox, Grid};
use crate::ldi::TooManySamples;
use crate::minkowski::{Exterior, RaySpans};
use crate::sampler::cpu::{BandCrossings, Sorted, sort};
use crate::sampler::lists::{BandLists, RayLists};
use glam::DVec3;

/// Rows of a band: its crossings stay in the second-level cache, and few patches extend over many bands.
const BAND_ROWS: u32 = 16;

/// Patches that are sorted together.
const CHUNK: usize = 1 << 13;

impl BallPatches<'_> {
    /// Computes the spans of all rays along an axis of a grid that the polyhedron lies on; each hit has the number of its
    /// patch.
    ///
    /// With [`Exterior::Out`] the sum must lie in the grid, to rounding. With [`Exterior::In`] the solid must extend everywhere
    /// outside the grid.
    pub fn spans<H: Hit + Sync>(
        &self,
        grid: &Grid,
        axis: Axis,
        exterior: Exterior,
    ) -> Result<RaySpans<H>, TooManySamples> {
        Ok(self.counted_spans(grid, axis, exterior)?.0)
    }

    /// Computes the [`spans`](Self::spans), and the number of crossings that they were found from.
    pub fn counted_spans<H: Hit + Sync>(
        &self,
        grid: &Grid,
        axis: Axis,
        exterior: Exterior,
    ) -> Result<(RaySpans<H>, u64), TooManySamples> {
        self.spans_of_view(&View::new(grid, axis), exterior)
    }

    /// Computes the spans along an axis in a box of finer pixels of the grid that the polyhedron lies on.
    pub(crate) fn spans_in_box<H: Hit + Sync>(
        &self,
        grid: &Grid,
        fine: &FineBox,
        axis: Axis,
        exterior: Exterior,
    ) -> Result<RaySpans<H>, TooManySamples> {
        let (through, _) = self.spans_of_view::<H>(&View::in_box(grid, axis, fine), exterior)?;
        RaySpans::in_box(fine, axis, exterior, |[column, row]| {
            through.of_ray(row * fine.grid().image_size(axis).0 + column)
        })
    }

    /// Computes the spans of the rays of a view, and the number of their crossings.
    fn spans_of_view<H: Hit + Sync>(
        &self,
        view: &View,
        exterior: Exterior,
    ) -> Result<(RaySpans<H>, u64), TooManySamples> {
        let (axis, length, pixels) = (view.axis, view.length, view.nodes);
        let (columns, rows) = (view.columns.len() as u32, view.rows.len() as u32);
        let bands = rows.div_ceil(BAND_ROWS);
        let sorted = if self.covers_all(exterior) { Vec::new() } else { self.by_band(view, bands as usize) };
        let of_band = |crossings: &mut BandCrossings<H>, band: u32| {
            checkpoint();
            let rows = band * BAND_ROWS..rows.min((band + 1) * BAND_ROWS);
            crossings.begin(rows.len() * columns as usize);
            let [first_column, first_row] = [view.columns.start, view.rows.start + rows.start as i32];
            let seen_rows = first_row..first_row + rows.len() as i32;
            for patch in sorted.iter().flat_map(|chunk| chunk.of_band(band as usize)) {
                self.sweep(*patch, view, seen_rows.clone(), |column, row, depth, winding| {
                    let depth = match exterior {
                        Exterior::Out => depth.clamp(0.0, length),
                        // Beyond the grid everything is in.
                        Exterior::In if !(0.0..=length).contains(&depth) => return,
                        Exterior::In => depth,
                    };
                    let ray = (row - first_row) as u32 * columns + (column - first_column) as u32;
                    let crossing = Crossing::at(depth, winding).moved(view.nodes_by);
                    crossings.push(ray, H::new(crossing, *patch));
                });
            }
            crossings.sort_by_ray();
            let mut lists = BandLists { ends: Vec::new(), hits: Vec::new(), crossings: crossings.count() as u64 };
            for ray in 0..rows.len() as u32 * columns {
                let hits = crossings.on_ray(ray);
                sort(hits);
                exterior.keep_gaps(pixels, hits, &mut lists.hits);
                lists.ends.push(lists.hits.len() as u32);
            }
            lists
        };
        let bands: Vec<BandLists<H>> =
            (0..bands).into_par_iter().map_init(BandCrossings::<H>::default, of_band).collect();
        let RayLists { offsets, hits, crossings } = RayLists::of_bands(axis, bands)?;
        Ok((RaySpans { axis, offsets, hits }, crossings))
    }

    /// Returns whether the ball is so large that the sum covers everything: no point is farther than half the shortest side
    /// from the outside of a box.
    fn covers_all(&self, exterior: Exterior) -> bool {
        let bounds = self.solid.bounds();
        let shortest = (0..3).map(|i| i64::from(bounds.max[i]) - i64::from(bounds.min[i])).min().unwrap_or(0);
        exterior == Exterior::In && 2.0 * self.radius >= shortest as f64
    }

    /// Returns the patches that each band may meet, in chunks.
    fn by_band(&self, view: &View, bands: usize) -> Vec<Sorted<u32>> {
        let counts = self.counts();
        let patches = counts.facets + counts.tubes + counts.caps;
        let sort_chunk = |reaching: &mut Vec<(u32, u32, u32)>, chunk: usize| {
            reaching.clear();
            for patch in chunk * CHUNK..patches.min((chunk + 1) * CHUNK) {
                let patch = patch as u32;
                let Some(Footprint { rows, .. }) = self.footprint(patch, view).filter(|found| !found.is_empty()) else {
                    continue;
                };
                let band = |row: i32| (row - view.rows.start) as u32 / BAND_ROWS;
                reaching.push((patch, band(rows.start), band(rows.end - 1)));
            }
            Sorted::new(bands, reaching, |patch| patch)
        };
        (0..patches.div_ceil(CHUNK)).into_par_iter().map_init(Vec::new, sort_chunk).collect()
    }

    fn footprint(&self, patch: u32, view: &View) -> Option<Footprint> {
        match self.patch(patch) {
            Patch::Facet(facet) => (facet.normal != DVec3::ZERO).then(|| facet.footprint(view, self.radius)),
            Patch::Tube(tube) => Some(tube.seen(view, self.radius)?.footprint(view)),
            Patch::Cap(cap) => Some(cap.seen(view, self.radius).footprint(view)),
        }
    }

    #[inline]
    fn sweep(&self, patch: u32, view: &View, rows: Range<i32>, meet: impl FnMut(i32, i32, f64, i32)) {
        let within = |found: Range<i32>| found.start.max(rows.start)..found.end.min(rows.end);
        match self.patch(patch) {
            Patch::Facet(facet) => {
                facet.sweep(view, self.radius, within(facet.footprint(view, self.radius).rows), meet);
            }
            Patch::Tube(tube) => {
                if let Some(seen) = tube.seen(view, self.radius) {
                    seen.sweep(view, rows, meet);
                }
            }
            Patch::Cap(cap) => {
                let seen = cap.seen(view, self.radius);
                let (first, count) = (cap.spokes.0 as usize, cap.spokes.1 as usize);
                seen.sweep(view, &self.spokes[first..first + count], within(seen.footprint(view).rows), meet);
            }
        }
    }
}
