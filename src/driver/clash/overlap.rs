//! The volume that two parts share.

use super::raster;
use crate::boolean::{BooleanOperation, Expression};
use crate::driver::backend::Backends;
use crate::driver::certainty::Certainty;
use crate::driver::input::Solid;
use crate::driver::job::{Backend, Boolean, Keep, MeasureJob, Measurement, Openness, Spacing, VolumeMethod, Wording};
use crate::driver::measure::measure;
use crate::driver::measured::Method;
use crate::grid::Axis;
use crate::length::Length;
use crate::mesh::Aabb;
use crate::progress::Monitor;
use crate::sampler::{FillRule, Mode};
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

/// Voxels along a ray, which exact images do not have.
const LOD: u32 = 1024;

/// Returns the volume that two parts share. Where it is sampled, it is by `resolution` rays along the longest side of the box
/// `common` around it, or by fewer where both parts are more than four times as long.
///
/// # Errors
/// Parts that no lattice holds.
pub fn overlap(
    parts: [&Solid; 2],
    common: Aabb,
    fill: FillRule,
    resolution: u32,
    memory: Option<u64>,
) -> Result<(Overlap, Vec<Warning>), Error> {
    let solids: Vec<Solid> = parts.into_iter().cloned().collect();
    let longest = raster::common_box(&solids).extent().max_element();
    let rays = f64::from(resolution);
    let pitch = (common.extent().max_element() / rays).max(longest / (RAYS_OF_BOTH * rays));
    let operation = BooleanOperation::Intersection;
    let boolean = Boolean { expression: Expression::of_inputs(operation, 2), wording: Wording::Operation(operation) };
    let job = MeasureJob {
        measurement: Measurement::Boolean(boolean),
        unit: None,
        openness: Openness::Refused,
        spacing: Spacing::Pitch(Length { value: pitch, unit: None }),
        lod: LOD,
        axes: Axis::ALL.to_vec(),
        mode: Mode::Exact,
        fill,
        backend: Backend::Cpu,
        memory,
        method: VolumeMethod::Best,
        hashes: false,
        certainty: Certainty::default(),
        keep: Keep::Sums,
    };
    let measured = measure(&job, solids, &Backends::open(&job.backend)?, &Monitor::new(None))?;
    let method = match measured.volume.method {
        Method::Exact => OverlapMethod::Exact,
        Method::Estimate(_) => OverlapMethod::Estimate,
    };
    // The corners of the common box are rounded, so it bounds an estimate but not an exact volume.
    let most = match method {
        OverlapMethod::Exact => f64::INFINITY,
        OverlapMethod::Estimate => common.extent().element_product(),
    };
    let value = measured.volume.value.min(most);
    let (lower, upper) = ((value - measured.volume.error).max(0.0), (value + measured.volume.error).min(most));
    let warnings = measured.warnings.into_iter().filter(|warning| warning.code == "fill-rules-differ").collect();
    Ok((Overlap { value, lower, upper, method }, warnings))
}
