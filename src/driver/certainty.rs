//! Certified bounds of volumes, and assertions that are decided by them.

use std::fmt;
use std::time::Instant;

use super::input::Solid;
use super::job::{MeasureJob, Spacing, SumJob};
use super::measured::{Method, Volume};
use crate::boolean::Expression;
use crate::certified::{CertifiedError, CertifiedVolume, Refine, certified_offset, certified_volume};
use crate::cubic::TypedVolume;
use crate::mesh::LengthUnit;
use crate::number::number;
use crate::progress::Monitor;
use crate::{Error, Warning, unit};

/// What a job has to prove about its volume.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Certainty {
    /// True if certified bounds are requested.
    pub bounds: bool,
    /// The assertions, which need bounds.
    pub assertions: Vec<Assertion>,
}

impl Certainty {
    /// Returns whether bounds are needed.
    pub fn needs_bounds(&self) -> bool {
        self.bounds || !self.assertions.is_empty()
    }
}

/// An assertion about a volume.
#[derive(Clone, Debug, PartialEq)]
pub struct Assertion {
    /// The side of the limit on which the volume should lie.
    pub side: Side,
    /// The limit.
    pub limit: TypedVolume,
}

/// The side of a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Less than the limit.
    Below,
    /// Greater than the limit.
    Above,
}

impl Side {
    /// Returns `below` or `above`.
    pub fn name(self) -> &'static str {
        match self {
            Side::Below => "below",
            Side::Above => "above",
        }
    }
}

/// The result of an assertion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Every volume within the bounds has the asserted property.
    Certain,
    /// No volume within the bounds has it.
    CertainlyNot,
    /// The bounds contain volumes with the property and without.
    Undecided,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Verdict::Certain => "certainly",
            Verdict::CertainlyNot => "certainly not",
            Verdict::Undecided => "not decided",
        })
    }
}

impl Verdict {
    /// Decides whether a volume within bounds is certainly below or above a limit, which itself lies between two numbers.
    pub fn of(side: Side, [lower, upper]: [f64; 2], [least, most]: [f64; 2]) -> Verdict {
        let (is_certain, is_certainly_not) = match side {
            Side::Below => (upper < least, lower >= most),
            Side::Above => (lower > most, upper <= least),
        };
        match (is_certain, is_certainly_not) {
            (true, _) => Verdict::Certain,
            (false, true) => Verdict::CertainlyNot,
            (false, false) => Verdict::Undecided,
        }
    }
}

/// An assertion with its verdict.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// The side of the limit.
    pub side: Side,
    /// The limit, in cubic units of the result.
    pub limit: f64,
    /// The verdict.
    pub verdict: Verdict,
    /// True if the bounds are the rounding of an exact value, which no finer pitch narrows.
    pub is_exact: bool,
}

/// The verdict, with the reason where nothing is decided.
impl fmt::Display for Judged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.verdict.fmt(f)?;
        f.write_str(match (self.verdict, self.is_exact) {
            (Verdict::Undecided, true) => " within rounding",
            (Verdict::Undecided, false) => " at this pitch",
            _ => "",
        })
    }
}

/// Certified bounds, and the verdicts that follow.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Certified {
    /// Bounds of the volume, in cubic units of the result; `None` if they were not requested.
    pub bounds: Option<[f64; 2]>,
    /// The verdicts, in the order of the assertions.
    pub judged: Vec<Judged>,
}

impl Certified {
    /// Judges assertions by bounds that depend on the pitch.
    pub(super) fn of(certainty: &Certainty, bounds: [f64; 2], unit: Option<LengthUnit>) -> Result<Certified, Error> {
        let judge = |assertion: &Assertion| {
            let limits = assertion.limit.in_cubed(unit, &format!("--assert-{}", assertion.side.name()))?;
            let verdict = Verdict::of(assertion.side, bounds, limits);
            Ok(Judged { side: assertion.side, limit: 0.5 * (limits[0] + limits[1]), verdict, is_exact: false })
        };
        let judged = certainty.assertions.iter().map(judge).collect::<Result<_, Error>>()?;
        Ok(Certified { bounds: Some(bounds), judged })
    }

    /// Returns whether every assertion certainly holds.
    pub fn holds(&self) -> bool {
        self.judged.iter().all(|judged| judged.verdict == Verdict::Certain)
    }
}

/// Certifies the volume of a Boolean or of one solid, if the job requests it. An exact value has its own error bound.
pub(super) fn certify(
    job: &MeasureJob,
    solids: &[Solid],
    volume: &Volume,
    (pitch, spacing): (f64, Spacing),
    warnings: &mut Vec<Warning>,
    progress: &Monitor,
) -> Result<Certified, Error> {
    if !job.certainty.needs_bounds() {
        return Ok(Certified::default());
    }
    let unit = solids[0].unit;
    if volume.method == Method::Exact {
        let [lower, upper] = volume.possible;
        // Zero without rounding is zero.
        let bounds = [lower.next_down().max(0.0), if upper > 0.0 { upper.next_up() } else { upper }];
        let mut certified = Certified::of(&job.certainty, bounds, unit)?;
        certified.judged.iter_mut().for_each(|judged| judged.is_exact = true);
        return Ok(certified);
    }
    progress.stage("certifying bounds")?;
    let start = Instant::now();
    let closed = |solid| Solid::closed(solid).ok_or_else(|| not_closed(solid));
    let operands = solids.iter().map(closed).collect::<Result<Vec<_>, Error>>()?;
    let refine = match spacing {
        Spacing::Tolerance(share) => Refine::ToTolerance(share),
        Spacing::Resolution(_) | Spacing::Pitch(_) => Refine::ToPitch(pitch),
    };
    let whole = Expression::input(0);
    let expression = job.measurement.expression().unwrap_or(&whole);
    let found = certified_volume(expression, &operands, job.fill, refine).map_err(|error| match error {
        CertifiedError::NotOriented { operand } => Error::input(format!(
            "{}: the triangles are not consistently oriented, so bounds of its volume cannot be certified; orient them, or remove \
             --bounds and the assertions",
            solids[operand].name()
        )),
        error => Error::input(error),
    })?;
    judged(&job.certainty, unit, found, start, warnings, progress)
}

/// Certifies the volume of an offset; `within` narrows the bounds by other knowledge.
pub(super) fn certify_offset(
    job: &SumJob,
    solid: &Solid,
    (distance, pitch): (f64, f64),
    within: impl Fn([f64; 2]) -> [f64; 2],
    warnings: &mut Vec<Warning>,
    progress: &Monitor,
) -> Result<Certified, Error> {
    progress.stage("certifying bounds")?;
    let start = Instant::now();
    let closed = solid.closed().ok_or_else(|| not_closed(solid))?;
    let mut found = certified_offset(closed, distance, pitch).map_err(|error| {
        Error::input(format!(
            "{}: {error}, so bounds of the volume cannot be certified; remove --bounds and the assertions",
            solid.name()
        ))
    })?;
    [found.lower, found.upper] = within([found.lower, found.upper]);
    judged(&job.certainty, solid.unit, found, start, warnings, progress)
}

fn not_closed(solid: &Solid) -> Error {
    Error::input(format!(
        "{}: the mesh is not closed, so bounds of its volume cannot be certified; close it, or remove --bounds and the assertions",
        solid.name()
    ))
}

/// Judges assertions by certified bounds, and warns of bounds that are wider than requested.
fn judged(
    certainty: &Certainty,
    unit: Option<LengthUnit>,
    found: CertifiedVolume,
    start: Instant,
    warnings: &mut Vec<Warning>,
    progress: &Monitor,
) -> Result<Certified, Error> {
    let CertifiedVolume { lower, upper, finest, cells, reached } = found;
    progress.detail(format_args!(
        "bounds certified in {:.4} s: {cells} cells, the finest {} long",
        start.elapsed().as_secs_f64(),
        number(finest)
    ));
    if !reached {
        let message = format!(
            "the certified bounds are wider than requested: their cells are {} long, as finer ones would be too many; an operand \
             whose triangles meet, or surfaces that coincide, may cause this",
            unit::rounded(finest, unit)
        );
        warnings.push(Warning::new("bounds-not-reached", message));
    }
    Certified::of(certainty, [lower, upper], unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_are_certain_only_if_no_volume_within_the_bounds_contradicts_them() {
        let of = |side, bounds, limit: f64| Verdict::of(side, bounds, [limit, limit]);
        for (bounds, limit, below, above) in [
            ([1.0, 2.0], 3.0, Verdict::Certain, Verdict::CertainlyNot),
            ([1.0, 2.0], 2.0, Verdict::Undecided, Verdict::CertainlyNot),
            ([1.0, 2.0], 1.5, Verdict::Undecided, Verdict::Undecided),
            ([1.0, 2.0], 1.0, Verdict::CertainlyNot, Verdict::Undecided),
            ([1.0, 2.0], 0.5, Verdict::CertainlyNot, Verdict::Certain),
            ([2.0, 2.0], 2.0, Verdict::CertainlyNot, Verdict::CertainlyNot),
        ] {
            assert_eq!((of(Side::Below, bounds, limit), of(Side::Above, bounds, limit)), (below, above), "{limit}");
        }
        assert_eq!(Verdict::of(Side::Below, [1.0, 2.0], [1.9, 2.1]), Verdict::Undecided);
        assert_eq!(Verdict::of(Side::Above, [2.0, 3.0], [1.9, 2.1]), Verdict::Undecided);
    }
}
