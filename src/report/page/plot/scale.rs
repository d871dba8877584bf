//! Linear scales from values to positions, and the round values of ticks.

use crate::report::page::words;

/// A linear map from values to positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    values: [f64; 2],
    places: [f64; 2],
}

impl Scale {
    /// Creates a scale; an empty range of `values` is widened.
    pub fn new(values: [f64; 2], places: [f64; 2]) -> Scale {
        let [low, high] = values;
        let values = if high > low { values } else { [low, low + if low == 0.0 { 1.0 } else { low.abs() }] };
        Scale { values, places }
    }

    pub fn at(&self, value: f64) -> f64 {
        let [low, high] = self.values;
        let [from, to] = self.places;
        from + (value - low) / (high - low) * (to - from)
    }

    /// Returns [`Scale::at`] of the nearest value on the axis.
    pub fn within(&self, value: f64) -> f64 {
        self.at(value.clamp(self.values[0], self.values[1]))
    }

    pub fn places(&self) -> [f64; 2] {
        self.places
    }

    /// Returns round values on the axis, about `count` of them.
    pub fn ticks(&self, count: usize) -> Ticks {
        let [low, high] = self.values;
        let step = round_step((high - low) / count.max(1) as f64);
        // Rounding must not drop a tick at an end.
        let slack = 1e-9;
        let (first, last) = ((low / step - slack).ceil() as i64, (high / step + slack).floor() as i64);
        Ticks { values: (first..=last).map(|i| i as f64 * step).collect(), step }
    }
}

/// Tick values along an axis and their distance.
#[derive(Clone, Debug, PartialEq)]
pub struct Ticks {
    pub values: Vec<f64>,
    pub step: f64,
}

impl Ticks {
    /// Returns the labels, all with as many decimals as the step needs.
    pub fn labels(&self) -> Vec<String> {
        let largest = self.values.iter().fold(self.step, |largest: f64, value| largest.max(value.abs()));
        let power = self.step.log10().floor() as i32;
        if largest >= 1e6 || power < -5 {
            return self.values.iter().map(|&value| words::significant(value, 3)).collect();
        }
        let decimals = (-power).max(0) as usize;
        self.values.iter().map(|value| words::minus(&format!("{:.decimals$}", value + 0.0))).collect()
    }
}

/// Returns the nearest of 1, 2 and 5 times powers of ten.
fn round_step(step: f64) -> f64 {
    if !(step > 0.0 && step.is_finite()) {
        return 1.0;
    }
    let power = step.log10().floor() as i32;
    let mantissa = step / 10f64.powi(power);
    // The limits are geometric means of neighbouring steps.
    let factor =
        [(2f64.sqrt(), 1.0), (10f64.sqrt(), 2.0), (50f64.sqrt(), 5.0)].into_iter().find(|(end, _)| mantissa < *end);
    round(factor.map_or(10.0, |(_, factor)| factor), power)
}

/// Returns the largest of 1, 2 and 5 times powers of ten that is at most `length`.
pub fn round_length(length: f64) -> f64 {
    if !(length > 0.0 && length.is_finite()) {
        return 1.0;
    }
    let power = length.log10().floor() as i32;
    let lengths = (power - 1..=power).flat_map(|power| [1.0, 2.0, 5.0].map(|factor| round(factor, power)));
    lengths.filter(|&round| round <= length * (1.0 + 1e-9)).fold(0.0, f64::max)
}

/// Returns `factor`·10^`power`; dividing by a whole number is correctly rounded, multiplying by 0.001 is not.
fn round(factor: f64, power: i32) -> f64 {
    if power < 0 { factor / 10f64.powi(-power) } else { factor * 10f64.powi(power) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_on_the_axis() {
        let ticks = Scale::new([0.0, 0.83], [0.0, 100.0]).ticks(5);
        assert_eq!(ticks.labels(), ["0.0", "0.2", "0.4", "0.6", "0.8"]);
        assert_eq!(Scale::new([-3.0, 12.0], [0.0, 1.0]).ticks(4).labels(), ["0", "5", "10"]);
        assert_eq!(Scale::new([0.0, 300.0], [0.0, 1.0]).ticks(4).labels(), ["0", "100", "200", "300"]);
        assert_eq!(Scale::new([0.0, 2e-7], [0.0, 1.0]).ticks(2).labels(), ["0", "1 × 10⁻⁷", "2 × 10⁻⁷"]);
    }

    #[test]
    fn an_axis_without_extent_is_widened() {
        for value in [0.0, 7.5, -2.0] {
            let scale = Scale::new([value, value], [0.0, 100.0]);
            assert_eq!(scale.at(value), 0.0);
            assert!(scale.ticks(5).values.len() >= 2);
        }
    }

    #[test]
    fn round_lengths_fit() {
        for (length, round) in [(0.99, 0.5), (1.0, 1.0), (1.9, 1.0), (2.3, 2.0), (4.9, 2.0), (7.0, 5.0), (0.03, 0.02)] {
            assert!((round_length(length) - round).abs() < 1e-12, "{length}: {}", round_length(length));
        }
    }
}
