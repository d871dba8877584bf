//! The facade: a builder of comparisons of solids in memory.

use std::time::Instant;

use super::rules::Rules;
use super::{Clashes, Part, Settings as Course, compare_parts, requirements};
use crate::driver::input::ready;
use crate::length::Length;
use crate::{Error, Settings, Solid};

/// Rays along the longest side of the box that two parts share, where their overlap is sampled.
const DEFAULT_RAYS: u32 = 128;

/// A comparison of the parts of an assembly: which overlap, touch, or come nearer than a clearance. Lengths are in the unit of
/// the solids.
///
/// ```
/// use glam::DVec3;
/// use ldi_ops::{Clash, Settings, Solid, solids};
///
/// let cuboid = |x: f64| {
///     let mesh = solids::cuboid(DVec3::X * x, DVec3::X * x + DVec3::ONE)?;
///     Ok::<Solid, Box<dyn std::error::Error>>(Solid::from_triangles(mesh.positions, mesh.triangles)?)
/// };
/// let clashes = Clash::of([("a", &cuboid(0.0)?), ("b", &cuboid(1.25)?)]).clearance(0.5).compare(&Settings::default())?;
/// let finding = clashes.findings().next().unwrap();
/// assert_eq!((clashes.names(finding), finding.relation.name()), (["a", "b"], "separate"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Clash {
    parts: Vec<(String, Solid)>,
    clearance: Option<f64>,
    touching: Option<f64>,
    resolution: u32,
    rules: Rules,
}

impl Clash {
    /// Returns the comparison of named solids.
    pub fn of<'s>(parts: impl IntoIterator<Item = (impl Into<String>, &'s Solid)>) -> Clash {
        let parts = parts.into_iter().map(|(name, solid)| (name.into(), solid.clone())).collect();
        Clash { parts, clearance: None, touching: None, resolution: DEFAULT_RAYS, rules: Rules::default() }
    }

    /// Sets the least distance that two parts must keep.
    pub fn clearance(mut self, distance: f64) -> Self {
        self.clearance = Some(distance);
        self
    }

    /// Sets the largest gap or depth that counts as touching; by default, the rounding of 32-bit coordinates.
    pub fn touching(mut self, distance: f64) -> Self {
        self.touching = Some(distance);
        self
    }

    /// Sets the rays along the longest side of the box that two parts share, where their overlap is sampled.
    pub fn rays(mut self, rays: u32) -> Self {
        self.resolution = rays;
        self
    }

    /// Sets what is allowed.
    pub fn rules(mut self, rules: Rules) -> Self {
        self.rules = rules;
        self
    }

    /// Compares the parts, by the fill rule, the threads and the memory limit of the settings.
    ///
    /// # Errors
    /// Fewer than two parts, solids that the fill rule does not allow, solids in several units of which one is unknown, and parts
    /// that would not fit into memory.
    pub fn compare(self, settings: &Settings) -> Result<Clashes, Error> {
        if self.resolution == 0 {
            return Err(Error::Usage("the resolution is 0; at least 1 ray is needed".to_owned()));
        }
        for length in [self.clearance, self.touching].into_iter().flatten() {
            if !(length >= 0.0 && length.is_finite()) {
                return Err(Error::Usage(format!("{length}: a clearance is a length, 0 or more")));
            }
        }
        let length = |value| Length { value, unit: None };
        let course = Course {
            fill: settings.fill_rule(),
            clearance: self.clearance.map(length),
            touching: self.touching.map(length),
            resolution: self.resolution,
            rules: self.rules,
            memory: settings.memory(),
        };
        settings.run(|monitor| {
            let start = Instant::now();
            let (names, mut solids): (Vec<String>, Vec<_>) =
                self.parts.into_iter().map(|(name, solid)| (name, solid.inner().clone())).unzip();
            let warnings = ready(&mut solids, requirements(None, course.fill))?;
            let parts =
                solids.into_iter().zip(names).map(|(solid, name)| Part { name, path: solid.path.clone(), solid });
            let mut clashes = compare_parts(parts.collect(), &course, monitor)?;
            clashes.warnings.splice(0..0, warnings);
            clashes.seconds.total = start.elapsed().as_secs_f64();
            Ok(clashes)
        })
    }
}
