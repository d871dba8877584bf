//! The volume that two parts share.

use super::Settings;
use crate::boolean::{BooleanOperation, Expression};
use crate::driver::backend::Backends;
use crate::driver::certainty::Certainty;
use crate::driver::exact_cost;
use crate::driver::input::Solid;
use crate::driver::job::{Backend, Boolean, Keep, MeasureJob, Measurement, Openness, Spacing, VolumeMethod, Wording};
use crate::driver::measure::measure;
use crate::driver::measured::{IMPRECISE, NOT_RESOLVED, Volume};
use crate::driver::memory::{self, Limit};
use crate::driver::raster;
use crate::driver::refine::TOLERANCE_NOT_REACHED;
use crate::exact;
use crate::grid::Axis;
use crate::length::Length;
use crate::mesh::Aabb;
use crate::progress::Monitor;
use crate::sampler::Mode;
use crate::{Error, Warning};

/// A volume that two parts share.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "report", derive(serde::Serialize))]
pub struct Overlap {
    /// The volume, in cubic units of the parts.
    pub value: f64,
    /// The lower end of the range in which it lies.
    pub lower: f64,
    /// The upper end of that range.
    pub upper: f64,
    /// The method.
    pub method: OverlapMethod,
}

impl Overlap {
    /// Returns the distance of the value from the farther end of its range.
    pub fn error(&self) -> f64 {
        (self.value - self.lower).max(self.upper - self.value)
    }
}

/// The method of a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "report", derive(serde::Serialize), serde(rename_all = "kebab-case"))]
pub enum OverlapMethod {
    /// From the triangles; the range is the rounding.
    Exact,
    /// From images; the range is an estimate.
    Estimate,
}

/// Largest number of rays along the longest side of both parts, for each ray along that of the box that they share: an image
/// has an entry for each of its rays, also where it is empty.
const RAYS_OF_BOTH: f64 = 4.0;

/// Largest resolution at which pairs are sampled side by side: 1024 rays along both parts, so that the offsets of an image take 4 MB.
const FEW_RAYS: u32 = 256;

/// Voxels along a ray, which exact images do not have.
const LOD: u32 = 1024;

/// The volume that two parts share, and how their shells and fill rules matter to it.
pub struct Found {
    pub volume: Overlap,
    /// The places, in the pair, of the parts whose shells overlap or touch.
    pub with_meeting_shells: Vec<usize>,
    /// Warnings of an estimate.
    pub warnings: Vec<Warning>,
}

/// The memory for the common volume of a pair.
#[derive(Clone, Copy)]
pub struct Room {
    /// The bytes that the process held before the comparison.
    pub held: u64,
    pub limit: Limit,
    /// The number of other pairs that are compared at the same time. The forecast of an exact volume allows for as much memory for
    /// each; images are admitted by what the process holds when they are made.
    pub beside: usize,
}

/// Returns the volume that two parts share: exactly, or from images where a part is not oriented or there is no room. Returns
/// `None` if it does not fit beside other pairs that take as much memory, or has to be sampled with no other beside it.
///
/// # Errors
/// Parts that no lattice holds at the spacing of the settings, and images that do not fit into memory.
pub fn overlap(
    parts: [&Solid; 2],
    names: [&str; 2],
    common: Aabb,
    (settings, backends): (&Settings, &Backends),
    room: Room,
) -> Result<Option<Found>, Error> {
    let expression = Expression::of_inputs(BooleanOperation::Intersection, 2);
    let excess = |bytes: f64| {
        let subject = format_args!("the exact common volume of {} and {}", names[0], names[1]);
        memory::excess(subject, room.held, bytes * (room.beside + 1) as f64, room.limit)
    };
    // For small parts the forecast would take as long as the volume.
    let forecast = || excess(exact_cost::costs(&parts).volume);
    if let Some(excess) = excess(exact_cost::costs_if_all_meet(&parts).volume).and_then(|_| forecast()) {
        if room.beside > 0 {
            return Ok(None);
        }
        let message = format!("{excess}, so it is estimated; a larger --memory gives the exact one");
        let mut found = sampled(parts, names, common, expression, (settings, backends))?;
        found.warnings.push(Warning::new("exact-volume-memory", message));
        return Ok(Some(found));
    }
    let closed = parts.map(|part| part.closed().expect("parts are closed"));
    match exact::mass_properties(&closed, &expression, settings.fill) {
        Ok(found) => {
            let [lower, upper] = found.possible;
            let volume = Overlap { value: found.mass.volume, lower, upper, method: OverlapMethod::Exact };
            Ok(Some(Found { volume, with_meeting_shells: found.with_meeting_shells, warnings: Vec::new() }))
        }
        Err(_) if room.beside > 0 && is_sampled_alone(settings) => Ok(None),
        Err(_) => match sampled(parts, names, common, expression, (settings, backends)) {
            Err(Error::Machine(_)) if room.beside > 0 => Ok(None),
            found => found.map(Some),
        },
    }
}

/// Returns whether a pair is sampled with no other beside it: a GPU makes one image at a time, on which all threads wait, and
/// images of a pitch, of a tolerance or of many rays may take all of the memory.
fn is_sampled_alone(settings: &Settings) -> bool {
    let has_small_images = matches!(settings.spacing, Spacing::Resolution(rays) if rays <= FEW_RAYS);
    matches!(settings.backend, Backend::Gpu(_)) || !has_small_images
}

/// Returns the volume from images. A resolution is that along the longest side of the box `common` around it, or less where both
/// parts are more than four times as long.
///
/// # Errors
/// A pitch that gives more rays than a lattice holds, and images that do not fit into memory.
fn sampled(
    parts: [&Solid; 2],
    names: [&str; 2],
    common: Aabb,
    expression: Expression,
    (settings, backends): (&Settings, &Backends),
) -> Result<Found, Error> {
    let pair = || format!("{} and {}", names[0], names[1]);
    let solids: Vec<Solid> = parts.into_iter().cloned().collect();
    let spacing = match settings.spacing {
        Spacing::Resolution(rays) => {
            let longest = raster::common_box(&solids).extent().max_element();
            let rays = f64::from(rays);
            let pitch = (common.extent().max_element() / rays).max(longest / (RAYS_OF_BOTH * rays));
            Spacing::Pitch(Length { value: pitch, unit: None })
        }
        spacing => spacing,
    };
    let boolean = Boolean { expression, wording: Wording::Operation(BooleanOperation::Intersection) };
    let job = MeasureJob {
        measurement: Measurement::Boolean(boolean),
        unit: None,
        openness: Openness::Refused,
        spacing,
        lod: LOD,
        axes: Axis::ALL.to_vec(),
        mode: Mode::Exact,
        fill: settings.fill,
        backend: settings.backend.clone(),
        memory: settings.memory,
        method: VolumeMethod::Estimate,
        hashes: false,
        certainty: Certainty::default(),
        keep: Keep::Sums,
    };
    let mut measured = measure(&job, solids, backends, &Monitor::new(None)).map_err(|error| match error {
        Error::Machine(why) => Error::machine(format!("{}: {why}", pair())),
        other => other,
    })?;
    // The corners of the common box are rounded, but by less than an estimate errs.
    measured.volume.narrow([0.0, common.extent().element_product()]);
    let Volume { value, error, possible: [least, greatest], .. } = measured.volume;
    let (lower, upper) = ((value - error).max(least), (value + error).min(greatest));
    let volume = Overlap { value, lower, upper, method: OverlapMethod::Estimate };
    measured.requested = settings.spacing;
    measured.warnings.extend(measured.imprecise());
    let about_overlap = |warning: Warning| match warning.code {
        "fill-rules-differ" => Some(warning),
        IMPRECISE | NOT_RESOLVED | TOLERANCE_NOT_REACHED => {
            Some(Warning::new(warning.code, format!("{}: {}", pair(), warning.message)))
        }
        _ => None,
    };
    let warnings = measured.warnings.into_iter().filter_map(about_overlap).collect();
    Ok(Found { volume, with_meeting_shells: Vec::new(), warnings })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use glam::DVec3;

    use super::*;
    use crate::Unit;
    use crate::driver::clash::requirements;
    use crate::driver::clash::rules::Rules;
    use crate::driver::input::solid_of_mesh;
    use crate::mesh::TriangleMesh;
    use crate::sampler::FillRule;
    use crate::testing::meshes::cube;

    /// Returns a closed surface with one side, whose triangles no turning orients: it has no exact volume.
    fn one_sided() -> TriangleMesh {
        let positions =
            [[0.0, 0.0, 0.0], [1.0, 0.0, 0.1], [0.2, 1.0, 0.0], [0.0, 0.1, 1.0], [1.0, 0.9, 0.3], [0.3, 1.0, 1.0]];
        let triangles = [
            [0, 1, 4],
            [0, 1, 5],
            [0, 2, 3],
            [0, 2, 5],
            [0, 3, 4],
            [1, 2, 3],
            [1, 2, 4],
            [1, 3, 5],
            [2, 4, 5],
            [3, 4, 5],
        ];
        TriangleMesh { positions: positions.map(DVec3::from).to_vec(), triangles: triangles.to_vec() }
    }

    /// Returns the common volume of a cube and a surface with one side, with other pairs beside it.
    fn found(spacing: Spacing<Length>, limit: Limit, beside: usize) -> Result<Option<Found>, Error> {
        let settings = Settings {
            fill: FillRule::EvenOdd,
            clearance: None,
            touching: None,
            spacing,
            backend: Backend::Cpu,
            rules: Rules::default(),
            memory: limit.bytes(),
        };
        let requirements = requirements(Some(Unit::Millimetre), settings.fill);
        let solid = |mesh, name| solid_of_mesh(mesh, Path::new(name), requirements).unwrap();
        let [a, b] = [solid(cube(DVec3::ZERO, 2.0), "a"), solid(one_sided(), "b")];
        let backends = Backends::open(&settings.backend).unwrap();
        overlap([&a, &b], ["a", "b"], b.bounds(), (&settings, &backends), Room { held: 0, limit, beside })
    }

    #[test]
    fn images_that_may_be_large_wait_for_other_pairs() {
        let pitch = Spacing::Pitch(Length { value: 0.1, unit: None });
        for spacing in [pitch, Spacing::Tolerance(0.1), Spacing::Resolution(FEW_RAYS + 1)] {
            assert!(found(spacing, Limit::Unknown, 1).unwrap().is_none(), "{spacing:?}");
            let alone = found(spacing, Limit::Unknown, 0).unwrap().unwrap();
            assert_eq!(alone.volume.method, OverlapMethod::Estimate);
        }
        assert!(found(Spacing::Resolution(FEW_RAYS), Limit::Unknown, 1).unwrap().is_some());
    }

    #[test]
    fn images_without_room_wait_for_other_pairs_and_are_refused_alone() {
        let few = Spacing::Resolution(FEW_RAYS);
        assert!(found(few, Limit::Asked(1000), 1).unwrap().is_none());
        let refusal = found(few, Limit::Asked(1000), 0).err().unwrap().to_string();
        assert!(refusal.starts_with("a and b: the images of "), "{refusal}");
    }
}
