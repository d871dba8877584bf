//! What a sum will hold, told before it is made, and whether there is room for it.
//!
//! Three parts grow apart. What is there already, meshes and primitives, does not change with the pitch. Rays and the ends
//! of spans and gaps on them go with 1/h², and lattice nodes with 1/h³. So a figure at one pitch tells the pitch at
//! which a limit is met.

use std::fmt;

use crate::Error;
use crate::driver::machine;
use crate::grid::{Axis, Grid};
use crate::number::number;

/// The share of the free memory that is taken where nobody says how much may be.
const SHARE_OF_FREE: f64 = 0.8;

/// How far below the limit a pitch must stay to be called fitting: the figure is an estimate, and what the process holds
/// already is not the same from run to run.
const MARGIN: f64 = 0.9;

/// Bytes that a job is expected to hold at most, at one pitch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Whatever the pitch.
    pub fixed: f64,
    /// Grows with the number of rays.
    pub of_rays: f64,
    /// Grows with the number of nodes.
    pub of_nodes: f64,
}

impl Cost {
    /// The bytes at a pitch `factor` times as long.
    fn at(&self, factor: f64) -> f64 {
        self.fixed + self.of_rays / factor.powi(2) + self.of_nodes / factor.powi(3)
    }

    pub fn bytes(&self) -> u64 {
        self.at(1.0) as u64
    }

    /// The least factor of the pitch, above 1, at which the cost is below a limit; nothing where no pitch is coarse enough.
    fn fitting(&self, limit: f64) -> Option<f64> {
        let (mut fits, mut low) = (2.0, 1.0);
        while self.at(fits) > limit {
            (low, fits) = (fits, 2.0 * fits);
            if fits > COARSEST {
                return None;
            }
        }
        // A thousandth of the pitch is nearer than the estimate.
        while fits - low > 1e-3 * low {
            let middle = 0.5 * (low + fits);
            match self.at(middle) > limit {
                true => low = middle,
                false => fits = middle,
            }
        }
        Some(fits)
    }
}

/// A pitch longer by more than this leaves nothing of a raster.
const COARSEST: f64 = 1e5;

/// How much memory may be taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// It was given.
    Asked(u64),
    /// A share of what is free, and what is held already.
    Free(u64),
    /// The system does not say how much there is.
    Unknown,
}

impl Limit {
    /// The limit that was given, or what there is now.
    pub fn new(asked: Option<u64>) -> Limit {
        match (asked, machine::free_memory()) {
            (Some(bytes), _) => Limit::Asked(bytes),
            (None, Some(free)) => {
                Limit::Free((SHARE_OF_FREE * free as f64) as u64 + machine::memory_bytes().unwrap_or(0))
            }
            (None, None) => Limit::Unknown,
        }
    }

    pub fn bytes(self) -> Option<u64> {
        match self {
            Limit::Asked(bytes) | Limit::Free(bytes) => Some(bytes),
            Limit::Unknown => None,
        }
    }
}

/// For people.
impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Limit::Asked(bytes) => write!(f, "--memory allows {}", megabytes(*bytes)),
            Limit::Free(bytes) => write!(
                f,
                "{} is allowed, 80 % of what is free and what is held already (--memory changes that)",
                megabytes(*bytes)
            ),
            Limit::Unknown => f.write_str("nothing is known of the memory"),
        }
    }
}

/// Refuses a job that is above the limit; `longest` is the side that a resolution counts along.
pub fn admit(cost: &Cost, limit: Limit, grid: &Grid, longest: f64) -> Result<(), Error> {
    let Some(most) = limit.bytes().filter(|most| cost.bytes() > *most) else { return Ok(()) };
    let way_out = match cost.fitting(MARGIN * most as f64) {
        Some(factor) => {
            let pitch = factor * grid.pitch();
            let rays = (longest / pitch).floor();
            match rays >= 1.0 {
                true => format!("--resolution {rays}, a pitch of {}, would fit", number(longest / rays)),
                false => "no raster would fit".to_owned(),
            }
        }
        None => format!("no raster would fit, as {} do not depend on it", megabytes(cost.fixed as u64)),
    };
    Err(Error::machine(format!("about {} are needed, and {limit}; {way_out}", megabytes(cost.bytes()))))
}

fn megabytes(bytes: u64) -> String {
    format!("{} MB", number((bytes as f64 / 1e5).round() / 10.0))
}

/// Rays of the images along all axes.
pub fn rays(grid: &Grid) -> f64 {
    let of = |axis: &Axis| {
        let (columns, rows) = grid.image_size(*axis);
        f64::from(columns) * f64::from(rows)
    };
    Axis::ALL.iter().map(of).sum()
}

/// Lattice nodes.
pub fn nodes(grid: &Grid) -> f64 {
    grid.rays().iter().map(|&n| f64::from(n)).product()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Aabb;

    const COST: Cost = Cost { fixed: 10e6, of_rays: 600e6, of_nodes: 400e6 };

    fn grid() -> Grid {
        let bounds = Aabb { min: glam::DVec3::ZERO, max: glam::DVec3::new(10.0, 8.0, 6.0) };
        Grid::with_resolution(bounds, 100, 1024).unwrap()
    }

    #[test]
    fn what_is_called_fitting_fits() {
        for limit in [20e6, 100e6, 900e6] {
            let factor = COST.fitting(limit).unwrap();
            assert!(COST.at(factor) <= limit && COST.at(0.99 * factor) > limit, "{limit}: {factor}");
        }
        assert_eq!(COST.fitting(9e6), None);
    }

    #[test]
    fn refusals_carry_the_figure_the_limit_and_a_way_out() {
        assert_eq!(admit(&COST, Limit::Asked(1_010_000_000), &grid(), 10.0), Ok(()));
        assert_eq!(admit(&COST, Limit::Unknown, &grid(), 10.0), Ok(()));
        let message = |limit| admit(&COST, Limit::Asked(limit), &grid(), 10.0).unwrap_err().to_string();
        let said = message(500_000_000);
        for words in
            ["1010 MB are needed", "--memory allows 500 MB", "--resolution 70, a pitch of 0.1428571, would fit"]
        {
            assert!(said.contains(words), "no `{words}` in: {said}");
        }
        assert!(message(5_000_000).contains("no raster would fit, as 10 MB"));
    }
}
