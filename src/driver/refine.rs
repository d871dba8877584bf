//! Refinement: doubles the rays until the error estimate of the volume is small enough.

use super::measured::Refinement;
use crate::integrate::VolumeEstimate;
use crate::{Error, Warning};

/// First and last resolution of a refinement.
pub const COARSEST: u32 = 128;
const FINEST: u32 = 4096;

/// Least resolution at which a volume of zero is accepted, as a small solid may lie between few rays.
const ZERO_IS_CREDIBLE: u32 = 1024;

/// Doubles the resolution until the error estimate is within the tolerance. Where a round fails by the machine, as for lack of
/// memory, the result of the round before stands. Returns a warning if the tolerance was not reached.
///
/// Each result is held while the next is computed, beside which it is about a quarter as large.
///
/// # Errors
/// Those of the first round, and of later ones all but machine errors.
pub fn refine<R>(
    tolerance: f64,
    volume: impl Fn(&R) -> VolumeEstimate,
    mut round: impl FnMut(u32) -> Result<R, Error>,
) -> Result<(R, Refinement, Option<Warning>), Error> {
    let mut resolution = COARSEST;
    let mut result = round(resolution)?;
    loop {
        let VolumeEstimate { value, error } = volume(&result);
        let reached = match value == 0.0 {
            true => error == 0.0 && resolution >= ZERO_IS_CREDIBLE,
            false => error <= tolerance * value.abs(),
        };
        let came_to = if error == 0.0 { 0.0 } else { error / value.abs() };
        let refinement = Refinement { asked: tolerance, came_to, reached, resolution };
        if reached {
            return Ok((result, refinement, None));
        }
        let failure = match resolution < FINEST {
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
        let warning = Warning::new("tolerance-not-reached", format!("{refinement}{failure}"));
        return Ok((result, refinement, Some(warning)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Refines to one percent where the error is inversely proportional to the square of the rays; errors from `refused` rays on.
    fn refined(value: f64, share_at_first: f64, refused: u32, error: Error) -> (Result<u32, Error>, Vec<u32>, String) {
        let mut rounds = Vec::new();
        let volume = |rays: &u32| {
            let share = share_at_first * (f64::from(COARSEST) / f64::from(*rays)).powi(2);
            VolumeEstimate { value, error: share * value }
        };
        let result = refine(0.01, volume, |rays| {
            rounds.push(rays);
            if rays < refused { Ok(rays) } else { Err(error.clone()) }
        });
        let message = match &result {
            Ok((_, _, Some(warning))) => warning.message.clone(),
            _ => String::new(),
        };
        let result = result.map(|(rays, refinement, warning)| {
            assert_eq!((refinement.resolution, refinement.reached), (rays, warning.is_none()));
            rays
        });
        (result, rounds, message)
    }

    #[test]
    fn rays_double_until_the_error_is_small_enough() {
        let (result, rounds, message) = refined(-8.0, -0.1, u32::MAX, Error::Cancelled);
        assert_eq!((result, rounds, message), (Ok(512), vec![128, 256, 512], String::new()));
        let (result, rounds, message) = refined(8.0, 1e9, u32::MAX, Error::Cancelled);
        assert_eq!((result, rounds.len()), (Ok(4096), 6));
        assert!(message.starts_with("--tolerance 1 %: not reached with 4096 rays"), "{message}");
        // A result without volume may be one between the rays.
        assert_eq!(refined(0.0, 0.0, u32::MAX, Error::Cancelled).1, [128, 256, 512, 1024]);
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
