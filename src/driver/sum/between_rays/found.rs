//! The details that a search found, and the warning that names them.

use std::collections::{HashMap, HashSet};
use std::f64::consts::PI;

use crate::parallel::*;
use glam::DVec3;

use super::box_of;
use super::refine::Extent;
use crate::grid::{Grid, LatticeBox};
use crate::mesh::LengthUnit;
use crate::number::digits;
use crate::union_find::UnionFind;
use crate::unit;
use crate::warning::Warning;

/// Most cubes whose part of a detail is measured; others count with the mean share of these.
const MEASURED: usize = 32;

/// Number of details that a warning describes.
const NAMED: usize = 3;

/// Part of a result that no ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detail {
    /// True for a piece of solid in void, false for a cavity in solid.
    pub is_solid: bool,
    /// The middle of its box, in world units.
    pub place: DVec3,
    /// The extent of its box, in world units.
    pub size: DVec3,
    /// An estimate of its volume, in cubic world units.
    pub volume: f64,
}

/// The details of a sum that lie between the rays.
#[derive(Clone, Debug, PartialEq)]
pub struct BetweenRays {
    /// The details, the largest first.
    pub details: Vec<Detail>,
    /// The distance between rays, in world units.
    pub pitch: f64,
    /// The number of cubes of the raster that primitives meet, but no surface that the rays see.
    pub candidates: u64,
    /// The side of the smallest cube that is certainly found in a cavity of a sum, in world units.
    pub searched_to: f64,
    /// True if the search did not use up its tests.
    pub is_complete: bool,
}

impl BetweenRays {
    /// Adds the details of one kind: sets of cubes that touch. `extent` measures the part of a cube.
    pub fn add(
        &mut self,
        grid: &Grid,
        cubes: &[[u32; 3]],
        is_solid: bool,
        extent: impl Fn([u32; 3]) -> Option<Extent> + Sync,
    ) {
        let measured: Vec<Option<Extent>> =
            cubes[..cubes.len().min(MEASURED)].par_iter().with_max_len(1).map(|&cube| extent(cube)).collect();
        let known: Vec<f64> = measured.iter().flatten().map(|part| part.share).collect();
        let mean = if known.is_empty() { 1.0 } else { known.iter().sum::<f64>() / known.len() as f64 };
        let sets = touching(cubes);
        let mut by_set: HashMap<u32, (LatticeBox, f64)> = HashMap::new();
        for (part, &set) in measured.iter().zip(&sets).filter_map(|(part, set)| Some((part.as_ref()?, set))) {
            let (bounds, share) = by_set.entry(set).or_insert((LatticeBox::EMPTY, 0.0));
            (*bounds, *share) = (bounds.hull(&part.bounds), *share + part.share);
        }
        // Parts too small to be measured add nothing to others, and lie somewhere in their cubes where there are no others.
        let are_measured: HashSet<u32> = by_set.keys().copied().collect();
        for (at, (&cube, &set)) in cubes.iter().zip(&sets).enumerate() {
            if at >= measured.len() || !are_measured.contains(&set) {
                let (bounds, share) = by_set.entry(set).or_insert((LatticeBox::EMPTY, 0.0));
                (*bounds, *share) = (bounds.hull(&box_of(grid, cube)), *share + mean);
            }
        }
        let world = |position: [i32; 3]| DVec3::from_array(position.map(f64::from)) * grid.step();
        self.details.extend(by_set.into_values().map(|(bounds, share)| {
            let (min, max) = (world(bounds.min), world(bounds.max));
            let place = grid.origin() + 0.5 * (min + max);
            Detail { is_solid, place, size: max - min, volume: share * grid.pitch().powi(3) }
        }));
    }

    /// Orders the details, the largest first.
    pub fn sort(&mut self) {
        let by_place = |a: &Detail, b: &Detail| a.place.to_array().partial_cmp(&b.place.to_array());
        self.details.sort_by(|a, b| {
            b.volume.total_cmp(&a.volume).then_with(|| by_place(a, b).unwrap_or(std::cmp::Ordering::Equal))
        });
    }

    /// Returns the volume of all details, in cubic world units. Those of a first step grow by the radius of the second: each is
    /// counted as a ball around its box.
    pub fn volume(&self, grown: f64) -> f64 {
        let ball = |detail: &Detail| 4.0 / 3.0 * PI * (grown + 0.5 * detail.size.length()).powi(3);
        self.details.iter().map(|detail| if grown > 0.0 { ball(detail) } else { detail.volume }).sum()
    }

    /// Returns a warning if there are details; `grown` is as in [`volume`](Self::volume).
    pub fn warning(&self, grown: f64, unit: Option<LengthUnit>) -> Option<Warning> {
        let (first, solids) = (self.details.first()?, self.details.iter().filter(|detail| detail.is_solid).count());
        let counts =
            [(self.details.len() - solids, "cavity", "cavities"), (solids, "piece of solid", "pieces of solid")];
        let counted = |&(count, one, many): &(usize, &str, &str)| match count {
            0 => None,
            1 => Some(format!("1 {one}")),
            _ => Some(format!("{count} {many}")),
        };
        let kinds: Vec<String> = counts.iter().filter_map(counted).collect();
        let named: Vec<String> = self.details.iter().take(NAMED).map(|detail| detail.text(unit)).collect();
        let others = match self.details.len().saturating_sub(NAMED) {
            0 => String::new(),
            others => format!(" and {others} more"),
        };
        let limit = match self.is_complete {
            true => String::new(),
            false => format!(
                "the search ended at its limit, and more details narrower than {} may exist; ",
                unit::rounded(self.searched_to, unit)
            ),
        };
        let least = self.details.iter().map(|detail| detail.size.min_element()).fold(first.size.x, f64::min);
        Some(Warning::new(
            "between-rays",
            format!(
                "{}no ray meets {} of the result: {}{others}; the images lack {}{}, about {}{} in total, which the error \
                 estimate includes; {limit}raise --resolution, or set --pitch to {} or less",
                if grown > 0.0 { "between the two steps: " } else { "" },
                kinds.join(" and "),
                named.join(", "),
                if self.details.len() == 1 { "it" } else { "them" },
                if grown > 0.0 { " and what the second step makes of that" } else { "" },
                digits(self.volume(grown), 2),
                unit::suffix(unit, 3),
                digits(0.5 * least, 2)
            ),
        ))
    }
}

impl Detail {
    fn text(&self, unit: Option<LengthUnit>) -> String {
        let kind = if self.is_solid { "solid" } else { "cavity" };
        let [x, y, z] = self.size.to_array().map(|side| digits(side, 2));
        let [at_x, at_y, at_z] = self.place.to_array().map(|at| digits(at, 5));
        format!("{kind} of about {x} × {y} × {z}{} at ({at_x}, {at_y}, {at_z})", unit::suffix(unit, 1))
    }
}

/// Returns a number for each cube that is the same for those of a set of cubes that touch.
fn touching(cubes: &[[u32; 3]]) -> Vec<u32> {
    let by_place: HashMap<[u32; 3], u32> = cubes.iter().copied().zip(0..).collect();
    let sets = UnionFind::new(cubes.len() as u32);
    for (&[x, y, z], at) in cubes.iter().zip(0..) {
        for k in 14..27u32 {
            // Half of the neighbours; the others find this one.
            let next = [x + k % 3, y + k / 3 % 3, z + k / 9].map(|c| c.checked_sub(1));
            if let [Some(x), Some(y), Some(z)] = next
                && let Some(&other) = by_place.get(&[x, y, z])
            {
                sets.join(at, other);
            }
        }
    }
    sets.roots()
}
