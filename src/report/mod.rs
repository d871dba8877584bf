//! The scaffold report: metrics of a solid and its pores, and their files.
//!
//! `measure` (images, fields, metrics, named by [`id`]) → [`scaffold_report`] (all data, in world units) → `limits`, `write`
//! (metrics.json, metrics.csv, methods.txt) and `page` (report.html). No step after the report computes, and no step before it
//! formats. [`Report`] is the facade, [`files`] runs several solids, [`sweep`] the designs of a plan.
//! [`clash`] has the page and the tables of clashes.

mod build;
pub mod clash;
pub mod files;
#[cfg(test)]
mod fixture;
pub mod id;
mod limits;
mod measure;
mod page;
mod quantity;
pub mod scaffold_report;
pub mod sweep;
mod write;

use std::path::PathBuf;

pub use build::{Limits, Report, ReportBuilder};

use glam::DVec3;

use crate::driver::job::{Backend, Input, Openness, Spacing};
use crate::grid::RAYS_MAX;
use crate::length::Length;
use crate::mesh::LengthUnit;
use crate::metrics::BoundaryCondition;
use crate::sampler::FillRule;

/// Reports of several solids.
#[derive(Clone, Debug)]
pub struct ReportJob {
    /// The solids.
    pub solids: Vec<Input>,
    /// The region of interest; the box of each solid without it.
    pub roi: Option<Roi>,
    /// The design that the first solid is compared with.
    pub compare: Option<Input>,
    /// A file of limits that the metrics are checked against.
    pub limits: Option<PathBuf>,
    /// The folder of all files; none are written without it.
    pub folder: Option<PathBuf>,
    /// The unit of files that state none.
    pub unit: Option<LengthUnit>,
    /// The treatment of meshes that are not closed.
    pub openness: Openness,
    /// The settings of the measurement.
    pub settings: Settings,
    /// The command that asked for the report, for its provenance.
    pub command_line: String,
}

/// The boundary of the region of interest, its solid a file or in memory.
#[derive(Clone, Debug)]
pub enum Roi<S = Input> {
    /// A closed mesh.
    Solid(S),
    /// The convex hull of the solid.
    Hull,
    /// The solid with everything filled that a ball from outside cannot enter; the diameter of the ball, or a default.
    Wrap(Option<Length>),
}

impl<S> Roi<S> {
    /// Reads a region that follows the solid: `hull`, `wrap` or `wrap:2mm`; `None` of other texts, which name solids.
    ///
    /// # Errors
    /// A diameter that is not a positive length.
    pub fn following(text: &str) -> Result<Option<Roi<S>>, String> {
        let diameter = match text {
            "hull" => return Ok(Some(Roi::Hull)),
            "wrap" => return Ok(Some(Roi::Wrap(None))),
            _ => match text.strip_prefix("wrap:") {
                Some(diameter) => diameter.parse::<Length>()?,
                None => return Ok(None),
            },
        };
        match diameter.value.is_finite() && diameter.value > 0.0 {
            true => Ok(Some(Roi::Wrap(Some(diameter)))),
            false => Err("the diameter is not a positive number".to_owned()),
        }
    }
}

/// The names of directions.
pub const DIRECTIONS: [(&str, DVec3); 6] = [
    ("x", DVec3::X),
    ("y", DVec3::Y),
    ("z", DVec3::Z),
    ("-x", DVec3::NEG_X),
    ("-y", DVec3::NEG_Y),
    ("-z", DVec3::NEG_Z),
];

/// The settings of a measurement.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The fineness of the raster.
    pub spacing: Spacing<Length>,
    /// Rays along the longest side of the raster that diffusion is solved on.
    pub tortuosity_resolution: u32,
    /// The boundary condition at the faces of the region.
    pub edges: BoundaryCondition,
    /// The fill rule.
    pub fill: FillRule,
    /// The direction that is up in the printer.
    pub build: DVec3,
    /// The angle from the horizontal below which a facet overhangs, in degrees.
    pub overhang_angle: f64,
    /// K of Kozeny and Carman.
    pub kozeny: f64,
    /// The most bytes that the process may hold; a share of the free memory without it.
    pub memory: Option<u64>,
    /// The device that samples.
    pub backend: Backend,
    /// True if the solid is drawn for the page.
    pub is_drawn: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            spacing: crate::Settings::default().spacing(),
            tortuosity_resolution: 128,
            edges: BoundaryCondition::Border,
            fill: FillRule::EvenOdd,
            build: DVec3::Z,
            overhang_angle: 45.0,
            kozeny: 5.0,
            memory: None,
            backend: Backend::Auto,
            is_drawn: true,
        }
    }
}

impl Settings {
    /// Checks the ranges of all numbers, and that a region of interest goes with the boundary condition.
    fn check(&self, has_region: bool) -> Result<(), String> {
        let Settings { tortuosity_resolution, overhang_angle, kozeny, .. } = *self;
        if has_region && self.edges == BoundaryCondition::Periodic {
            return Err("periodic edges need a box that repeats, not a region; choose border or clip".to_owned());
        }
        if !(2..=RAYS_MAX).contains(&tortuosity_resolution) {
            return Err(format!("the resolution of tortuosity is {tortuosity_resolution}, not 2 to {RAYS_MAX} rays"));
        }
        if !(0.0..=90.0).contains(&overhang_angle) {
            return Err(format!("the overhang angle is {overhang_angle}, not 0 to 90 degrees"));
        }
        if !(kozeny.is_finite() && kozeny > 0.0) {
            return Err(format!("the constant of Kozeny and Carman is {kozeny}, not a positive number"));
        }
        Ok(())
    }
}
