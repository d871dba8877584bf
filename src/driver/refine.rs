//! Refinement: doubles the rays until the error estimate of the volume is small enough.

use super::measured::{Refinement, Volume};
use crate::{Error, Warning};

/// First and last resolution of a refinement.
pub const COARSEST: u32 = 128;
pub const FINEST: u32 = 4096;

/// Rays along the longest side up to which a refinement looks for a volume that no ray meets.
pub const UNMET: u32 = 1024;

/// The code of the warning that a tolerance was not reached.
pub const TOLERANCE_NOT_REACHED: &str = "tolerance-not-reached";

/// The end of a refinement.
#[derive(Debug)]
pub struct RefinementEnd {
    /// The greatest error that was asked for, as a share of the volume.
    pub tolerance: f64,
    /// Rays along the longest side of the last raster.
    pub resolution: u32,
    /// The estimate of these rays; bounds may narrow it.
    pub volume: Volume,
    /// The reason why finer rays failed, for a message.
    pub failure: String,
}

impl RefinementEnd {
    /// Compares the error of the estimate with the tolerance. Returns a warning if that is not reached.
    pub fn judge(&self) -> (Refinement, Option<Warning>) {
        let refinement = Refinement::of(self.tolerance, &self.volume, 0.0, self.resolution);
        let warning = || Warning::new(TOLERANCE_NOT_REACHED, format!("{refinement}{}", self.failure));
        (refinement, (!refinement.reached).then(warning))
    }
}

/// Doubles the resolution until the error estimate is within the tolerance. A volume of zero is within it only if its error is
/// zero. `most` returns the most rays along the longest side that are worth a try after a result: [`UNMET`] where no ray meets it,
/// as a small solid may lie between few of them. Where a round fails by the machine, as for lack of memory, the result of the round
/// before stands.
///
/// Each result is held while the next is computed, beside which it is about a quarter as large, but for the solids of a sum.
///
/// # Errors
/// Those of the first round, and of later ones all but machine errors.
pub fn refine<R>(
    tolerance: f64,
    most: impl Fn(&R) -> u32,
    volume: impl Fn(&R) -> Volume,
    mut round: impl FnMut(u32) -> Result<R, Error>,
) -> Result<(R, RefinementEnd), Error> {
    let mut resolution = COARSEST;
    let mut result = round(resolution)?;
    loop {
        let volume = volume(&result);
        let is_reached = Refinement::of(tolerance, &volume, 0.0, resolution).reached;
        let failure = match !is_reached && resolution < most(&result) {
            true => match round(2 * resolution) {
                Ok(finer) => {
                    (result, resolution) = (finer, 2 * resolution);
                    continue;
                }
                Err(Error::Machine(why)) => format!("; with twice as many: {why}"),
                Err(error) => return Err(error),
            },
            false => String::new(),
        };
        return Ok((result, RefinementEnd { tolerance, resolution, volume, failure }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::VolumeEstimate;

    /// Returns a volume that may be twice as large.
    fn volume(value: f64, error: f64) -> Volume {
        Volume::estimate(VolumeEstimate { value, error }, [0.0, 2.0 * value], None)
    }

    /// Refines to one percent where the error is inversely proportional to the square of the rays; errors from `refused` rays on.
    fn refined(value: f64, share_at_first: f64, refused: u32, error: Error) -> (Result<u32, Error>, Vec<u32>, String) {
        let mut rounds = Vec::new();
        let of_rays = |rays: &u32| {
            let share = share_at_first * (f64::from(COARSEST) / f64::from(*rays)).powi(2);
            volume(value, share * value)
        };
        let round = |rays| {
            rounds.push(rays);
            if rays < refused { Ok(rays) } else { Err(error.clone()) }
        };
        let result = refine(0.01, |_| FINEST, of_rays, round);
        let mut message = String::new();
        let result = result.map(|(rays, end)| {
            let (refinement, warning) = end.judge();
            assert_eq!((refinement.resolution, refinement.reached), (rays, warning.is_none()));
            message = warning.map_or_else(String::new, |warning| warning.message);
            rays
        });
        (result, rounds, message)
    }

    #[test]
    fn rays_double_until_the_error_is_small_enough() {
        let (result, rounds, message) = refined(8.0, 0.1, u32::MAX, Error::Cancelled);
        assert_eq!((result, rounds, message), (Ok(512), vec![128, 256, 512], String::new()));
        let (result, rounds, message) = refined(8.0, 1e9, u32::MAX, Error::Cancelled);
        assert_eq!((result, rounds.len()), (Ok(4096), 6));
        assert!(message.starts_with("--tolerance 1 %: not reached with 4096 rays"), "{message}");
    }

    #[test]
    fn a_volume_of_zero_is_reached_only_without_error() {
        let refined = |greatest, most| {
            let rays = VolumeEstimate { value: 0.0, error: 0.0 };
            let of_rays = |_: &u32| Volume::estimate(rays, [0.0, greatest], None);
            let (rays, end) = refine(0.01, |_| most, of_rays, Ok).unwrap();
            let (refinement, warning) = end.judge();
            (rays, refinement.reached, warning.map(|warning| warning.message))
        };
        assert_eq!(refined(0.0, 1024), (128, true, None));
        let message = "--tolerance 1 %: not reached with 1024 rays along the longest side, which resolve no volume";
        assert_eq!(refined(8.0, 1024), (1024, false, Some(message.to_owned())));
        assert_eq!(refined(8.0, 128).0, 128);
    }

    #[test]
    fn a_volume_that_bounds_narrow_is_judged_again() {
        let judged = |value: f64, error: f64, bounds| {
            let (_, mut end) = refine(0.01, |_| COARSEST, |_| volume(value, error), Ok).unwrap();
            let was_reached = end.judge().0.reached;
            end.volume.narrow(bounds);
            let (refinement, warning) = end.judge();
            assert_eq!(refinement.reached, warning.is_none());
            (was_reached, warning.map(|warning| warning.message))
        };
        assert_eq!(judged(8.0, 1.0, [7.99, 8.01]), (false, None));
        // Bounds beyond the estimate prove its error too small.
        let message = "--tolerance 1 %: not reached with 128 rays along the longest side, where the estimate is";
        assert_eq!(judged(8.0, 0.01, [9.0, 10.0]), (true, Some(format!("{message} 11.11111 % of the volume"))));
    }

    #[test]
    fn the_last_result_stands_where_the_machine_fails() {
        let full = Error::machine("the images need about 9 GB");
        let (result, rounds, message) = refined(8.0, 1.0, 512, full.clone());
        assert_eq!((result, rounds), (Ok(256), vec![128, 256, 512]));
        assert!(message.ends_with("% of the volume; with twice as many: the images need about 9 GB"), "{message}");
        assert_eq!(refined(8.0, 1.0, 1, full.clone()).0, Err(full));
        assert_eq!(refined(8.0, 1.0, 512, Error::Cancelled).0, Err(Error::Cancelled));
    }
}
