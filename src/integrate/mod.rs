//! Integrals over the inside of an image: volume and its error estimate, moments, surface area.
//!
//! Every ray represents a column of square section h × h around it; the solid is assumed constant across the section. Sums are
//! integers; world units enter once, at the end, in `f64`.

mod area;
mod moments;
mod volume;

pub use area::{SurfaceHits, shows_every_facet, sums_show_every_facet, surface_hits};
pub use moments::{Moments, moments, moments_of_sums};
pub use volume::{AxisVolume, CHECK_PITCHES, VolumeEstimate};

use crate::parallel::*;

use crate::grid::Grid;
use crate::ldi::Ldi;

/// Returns the total length of all rays inside the solid, in lattice steps.
pub fn length(image: &Ldi) -> i64 {
    // Every ray has an even count, so pairs never straddle two rays.
    image
        .depths()
        .par_chunks(1 << 16)
        .map(|depths| depths.chunks_exact(2).map(|span| i64::from(span[1] - span[0])).sum::<i64>())
        .sum()
}

/// Returns the volume of the solid in an image, h²·Σ(out − in), in cubic world units.
pub fn volume(image: &Ldi) -> f64 {
    volume_of_length(image.grid(), length(image))
}

fn volume_of_length(grid: &Grid, length: i64) -> f64 {
    grid.pitch() * grid.pitch() * (grid.step() * length as f64)
}
