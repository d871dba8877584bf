//! The facade: a builder of comparisons of solids in memory.

use std::time::Instant;

use super::rules::Rules;
use super::{ClashPlan, Clashes, ComparedPair, Part, Settings as Course, requirements};
use crate::driver::input::{convert, ready};
use crate::driver::job::Spacing;
use crate::length::Length;
use crate::mesh::LengthUnit;
use crate::progress::Monitor;
use crate::{Error, Settings, Solid};

/// Rays along the longest side of the box that two parts share, where their overlap is sampled.
pub const DEFAULT_RAYS: u32 = 128;

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
    spacing: Spacing,
    rules: Rules,
    unit: Option<LengthUnit>,
}

impl Clash {
    /// Returns the comparison of named solids.
    pub fn of<'s>(parts: impl IntoIterator<Item = (impl Into<String>, &'s Solid)>) -> Clash {
        let parts = parts.into_iter().map(|(name, solid)| (name.into(), solid.clone())).collect();
        let rules = Rules::default();
        let spacing = Spacing::Resolution(DEFAULT_RAYS);
        Clash { parts, clearance: None, touching: None, spacing, rules, unit: None }
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
        self.spacing = Spacing::Resolution(rays);
        self
    }

    /// Sets the distance between neighbouring rays where an overlap is sampled.
    pub fn pitch(mut self, pitch: f64) -> Self {
        self.spacing = Spacing::Pitch(pitch);
        self
    }

    /// Sets the share of an overlap that the error estimate must fall below where it is sampled: rays double until it does, from 128
    /// along the longest side of both parts to 4096, or to 1024 where none meets the overlap, or to what fits into memory.
    pub fn tolerance(mut self, share: f64) -> Self {
        self.spacing = Spacing::Tolerance(share);
        self
    }

    /// Sets what is allowed.
    pub fn rules(mut self, rules: Rules) -> Self {
        self.rules = rules;
        self
    }

    /// Sets the unit that all parts are converted to; by default, that of the first part that has one. Parts without a unit are
    /// taken to be in it.
    pub fn unit(mut self, unit: LengthUnit) -> Self {
        self.unit = Some(unit);
        self
    }

    /// Compares the parts, by the fill rule, the device, the threads and the memory limit of the settings.
    ///
    /// # Errors
    /// Fewer than two parts, solids that the fill rule does not allow, solids in several units of which one is unknown, and parts
    /// that would not fit into memory.
    pub fn compare(self, settings: &Settings) -> Result<Clashes, Error> {
        let course = self.course(settings)?;
        settings.run(|monitor| self.planned(course)?.compare_all(monitor))
    }

    /// Finds the pairs to compare, by the fill rule and the memory limit of the settings.
    ///
    /// # Errors
    /// Those of [`compare`](Clash::compare), but for parts that would not fit into memory.
    pub fn plan(self, settings: &Settings) -> Result<ClashPlan, Error> {
        let course = self.course(settings)?;
        settings.run(|_: &Monitor| self.planned(course))
    }

    /// Checks the settings.
    fn course(&self, settings: &Settings) -> Result<Course, Error> {
        self.spacing.check()?;
        for length in [self.clearance, self.touching].into_iter().flatten() {
            if !(length >= 0.0 && length.is_finite()) {
                return Err(Error::Usage(format!("{length}: a clearance is a length, 0 or more")));
            }
        }
        let length = |value| Length { value, unit: None };
        Ok(Course {
            fill: settings.fill_rule(),
            clearance: self.clearance.map(length),
            touching: self.touching.map(length),
            spacing: self.spacing.of_inputs(),
            backend: settings.device().clone(),
            rules: self.rules.clone(),
            memory: settings.memory(),
        })
    }

    fn planned(self, course: Course) -> Result<ClashPlan, Error> {
        let start = Instant::now();
        let requirements = requirements(None, course.fill);
        let (names, mut solids): (Vec<String>, Vec<_>) =
            self.parts.into_iter().map(|(name, solid)| (name, solid.inner().clone())).unzip();
        if let Some(unit) = self.unit {
            for solid in &mut solids {
                convert(solid, unit, requirements)?;
            }
        }
        let warnings = ready(&mut solids, requirements)?;
        let parts = solids.into_iter().zip(names).map(|(solid, name)| Part { name, path: solid.path.clone(), solid });
        ClashPlan::new(parts.collect(), warnings, course, start)
    }
}

impl ClashPlan {
    /// Compares pairs of parts, on the threads of the settings; fill rule, memory limit and device are those of the plan. The pairs
    /// may be others than the [near ones](ClashPlan::pairs); the smaller number of a pair comes first.
    ///
    /// # Errors
    /// Numbers that no parts have, and parts that would not fit into memory.
    pub fn compare(&self, pairs: &[[usize; 2]], settings: &Settings) -> Result<Vec<ComparedPair>, Error> {
        settings.run(|monitor| self.compared(pairs, monitor))
    }
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DVec3};

    use super::*;
    use crate::testing::random::Random;
    use crate::{Unit, solids};

    /// Returns cubes and balls of several sizes, some of them in centimetres or without a unit; a pair of balls lies in itself twice,
    /// so that its fill rules differ.
    fn assembly() -> Vec<(String, Solid)> {
        let mut random = Random::new(5);
        let mut place = || 6.0 * DVec3::new(random.share(), random.share(), random.share()).round() / 2.0;
        let solid = |i: usize, place: DVec3| {
            let mut mesh = match i % 3 {
                0 => solids::cuboid(DVec3::ZERO, DVec3::splat(1.0 + (i % 4) as f64)).unwrap(),
                _ => solids::geodesic(0.5 + (i % 5) as f64 * 0.25, 4).unwrap(),
            };
            if i == 4 {
                let count = mesh.positions.len() as u32;
                mesh.positions.extend(mesh.positions.clone().iter().map(|p| *p + DVec3::X * 0.3));
                mesh.triangles.extend(mesh.triangles.clone().iter().map(|t| t.map(|corner| corner + count)));
            }
            let solid = Solid::from_triangles(mesh.positions, mesh.triangles).unwrap().named(format!("part {i}"));
            let solid = solid.transformed(DAffine3::from_translation(place));
            match i % 6 {
                2 => solid.transformed(DAffine3::from_scale(DVec3::splat(0.1))).unit(Unit::Centimetre),
                5 => solid,
                _ => solid.unit(Unit::Millimetre),
            }
        };
        (0..16).map(|i| (format!("part {i}"), solid(i, place()))).collect()
    }

    fn clash(parts: &[(String, Solid)]) -> Clash {
        let ignored = vec!["part 1*:part 3".parse().unwrap(), "nut:bolt".parse().unwrap()];
        let rules = Rules { ignored, ..Rules::default() };
        Clash::of(parts.iter().map(|(name, solid)| (name.as_str(), solid))).clearance(0.4).rules(rules)
    }

    /// Returns all of a result but its times.
    fn facts(clashes: &Clashes) -> String {
        format!("{:?} {} {:?} {:?}", clashes.pairs, clashes.ignored, clashes.warnings, clashes.unit)
    }

    #[test]
    fn the_join_of_any_partition_is_the_comparison_of_all_pairs() {
        let (parts, settings) = (assembly(), Settings::default());
        let whole = clash(&parts).compare(&settings).unwrap();
        assert!(whole.pairs.len() > 20 && whole.ignored > 0, "{} {}", whole.pairs.len(), whole.ignored);
        let codes: Vec<&str> = whole.warnings.iter().map(|warning| warning.code).collect();
        assert!(codes.contains(&"fill-rules-differ") && codes.contains(&"ignores-nothing"), "{codes:?}");
        let plan = clash(&parts).plan(&settings).unwrap();
        let mut random = Random::new(3);
        for count in [1, 2, 5, 100] {
            let mut compared: Vec<ComparedPair> =
                plan.tiles(count).iter().flat_map(|tile| plan.compare(tile, &settings).unwrap()).collect();
            for i in 1..compared.len() {
                compared.swap(i, random.below(i + 1));
            }
            assert_eq!(facts(&plan.clone().join(compared).unwrap()), facts(&whole));
        }
    }

    #[test]
    fn parts_of_a_tile_alone_have_the_fingerprints_and_relations_of_the_assembly() {
        let (parts, settings) = (assembly(), Settings::default());
        let plan = clash(&parts).plan(&settings).unwrap();
        let (all, unit) = (plan.fingerprints(), plan.unit().unwrap());
        assert!(all.iter().enumerate().all(|(i, one)| !all[..i].contains(one)));
        for &[i, j] in plan.pairs() {
            let two = [parts[i].clone(), parts[j].clone()];
            let alone = Clash::of(two.iter().map(|(name, solid)| (name.as_str(), solid))).unit(unit);
            let alone = alone.plan(&settings).unwrap();
            assert_eq!(alone.fingerprints(), [all[i], all[j]]);
            let [here, there] = [plan.compare(&[[i, j]], &settings), alone.compare(&[[0, 1]], &settings)];
            let ([here], [there]) = (&here.unwrap()[..], &there.unwrap()[..]) else { panic!("one pair each") };
            assert_eq!((&here.relation, &here.warnings), (&there.relation, &there.warnings));
        }
    }

    #[test]
    fn pairs_that_are_missing_or_twice_are_refused() {
        let (parts, settings) = (assembly(), Settings::default());
        let plan = clash(&parts).plan(&settings).unwrap();
        let compared = plan.compare(plan.pairs(), &settings).unwrap();
        let refused = |pairs: Vec<ComparedPair>| matches!(plan.clone().join(pairs), Err(Error::Usage(_)));
        assert!(refused(compared[1..].to_vec()));
        assert!(refused([&compared[..], &compared[..1]].concat()));
        assert!(!refused(compared));
        for wrong in [[1, 0], [2, 2], [0, 99]] {
            assert!(matches!(plan.compare(&[wrong], &settings), Err(Error::Usage(_))), "{wrong:?}");
        }
    }

    #[test]
    fn warnings_of_other_processes_have_known_codes() {
        use crate::driver::clash::Relation;
        let relation = Relation::Touching { distance: 0.0, depth_bound: 0.0, points: [DVec3::ZERO; 2] };
        let received = |code: &str| ComparedPair::received([0, 1], relation, [(code.to_owned(), "text".to_owned())]);
        for code in ["fill-rules-differ", "parts-inside-out", "within-rounding"] {
            assert_eq!(received(code).unwrap().warnings[0].code, code);
        }
        assert!(received("other").is_err());
    }
}
