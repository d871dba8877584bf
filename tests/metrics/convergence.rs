//! Compares a metric with its exact value at three resolutions.

/// The tolerance of a value.
#[derive(Clone, Copy, Debug)]
pub enum Within {
    /// A number of pitches.
    Pitches(f64),
    /// A share of the exact value.
    Share(f64),
    /// An absolute difference, in the unit of the value.
    Difference(f64),
}

/// A measured value and the pitch of the raster.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    pub value: f64,
    pub pitch: f64,
}

impl Within {
    /// Returns the error of a value and the tolerance, both in the unit of the tolerance.
    fn off(self, Measured { value, pitch }: Measured, exact: f64) -> (f64, f64) {
        let off = value - exact;
        match self {
            Within::Pitches(allowed) => (off / pitch, allowed),
            Within::Share(allowed) => (off / exact, allowed),
            Within::Difference(allowed) => (off, allowed),
        }
    }

    fn describe(self) -> String {
        match self {
            Within::Pitches(allowed) => format!("{allowed} h"),
            Within::Share(allowed) => format!("{} %", 100.0 * allowed),
            Within::Difference(allowed) => format!("{allowed}"),
        }
    }
}

/// Measures at three resolutions, prints a line, and asserts that every value is within the tolerance of the exact value.
pub fn converges(
    metric: &str,
    exact: f64,
    within: Within,
    resolutions: [u32; 3],
    mut measure: impl FnMut(u32) -> Measured,
) {
    let found = resolutions.map(&mut measure);
    let off = found.map(|found| within.off(found, exact));
    let shown = |i: usize| {
        let off = match within {
            Within::Pitches(_) => format!("{:+.3} h", off[i].0),
            Within::Share(_) => format!("{:+.3} %", 100.0 * off[i].0),
            Within::Difference(_) => format!("{:+.1e}", off[i].0),
        };
        format!("{:.5} ({off}) at {}", found[i].value, resolutions[i])
    };
    let order = order(found.map(|each| (each.value - exact).abs()), found.map(|each| each.pitch));
    println!(
        "| {metric} | {exact:.5} ± {} | {} | {} | {} | {order} |",
        within.describe(),
        shown(0),
        shown(1),
        shown(2)
    );
    for ((off, allowed), resolution) in off.into_iter().zip(resolutions) {
        assert!(off.abs() <= allowed, "{metric} at {resolution}: off by {off}, where {allowed} is allowed: {found:?}");
    }
}

/// Returns the power of the pitch by which the error falls from the first to the last resolution; a word where the errors are
/// mere rounding.
fn order(errors: [f64; 3], pitches: [f64; 3]) -> String {
    if errors[2] <= 1e-9 * pitches[2] {
        return "exact".to_owned();
    }
    format!("order {:.1}", (errors[0] / errors[2]).ln() / (pitches[0] / pitches[2]).ln())
}

#[test]
#[should_panic(expected = "off by 0.0200")]
fn values_beyond_the_tolerance_panic() {
    converges("a test of this", 1.0, Within::Share(0.01), [1, 2, 4], |n| Measured {
        value: 1.0 + 0.02 / f64::from(n),
        pitch: f64::from(n).recip(),
    });
}

#[test]
#[should_panic(expected = "off by NaN")]
fn nan_values_panic() {
    converges("a test of this", 1.0, Within::Pitches(9.0), [1, 2, 4], |_| Measured { value: f64::NAN, pitch: 1.0 });
}
