//! Statistics of many values: mean, spread, percentiles, a histogram.

use crate::parallel::*;

/// Number of bins for weights: a percentile is accurate to a bin's width, the largest value's 1/65 536.
const BINS: usize = 1 << 16;

/// Values in one task. Part of the result, since it determines the order of additions.
const CHUNK: usize = 1 << 16;

/// Weighted non-negative values, in the unit of the input.
#[derive(Clone, Debug)]
pub struct Distribution {
    count: u64,
    weight: f64,
    mean: f64,
    deviation: f64,
    min: f64,
    max: f64,
    /// Weights by value, in equal bins from 0 to the largest.
    bins: Vec<f64>,
}

/// Equal bins with their share of the weight.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// The lower end of the first bin and the upper end of the last.
    pub range: [f64; 2],
    /// Shares of the whole weight, which add up to 1.
    pub shares: Vec<f64>,
}

impl Distribution {
    /// Gathers values with weights; `None` where the total weight is 0. Weights of 0 do not count.
    pub fn of_weighted(values: &[(f64, f64)]) -> Option<Distribution> {
        Distribution::gather(values.len(), |i| values[i])
    }

    /// Gathers the values of a map that are above 0, each times `scale` and with weight 1.
    pub fn of_map(values: &[f32], scale: f64) -> Option<Distribution> {
        Distribution::gather(values.len(), |i| {
            let value = values[i];
            (f64::from(value) * scale, f64::from(u8::from(value > 0.0)))
        })
    }

    /// Gathers `length` values with weights, each as `at` returns it.
    pub(super) fn gather(length: usize, at: impl Fn(usize) -> (f64, f64) + Sync) -> Option<Distribution> {
        let chunks = || (0..length.div_ceil(CHUNK)).into_par_iter().map(|c| c * CHUNK..length.min((c + 1) * CHUNK));
        let counted = |range: std::ops::Range<usize>| range.map(&at).filter(|&(_, weight)| weight > 0.0);
        let sums: Vec<[f64; 6]> = chunks()
            .map(|range| {
                counted(range).fold(
                    [0.0, 0.0, 0.0, f64::INFINITY, 0.0, 0.0],
                    |[n, w, wv, min, max, odd], (value, weight)| {
                        let odd = odd + f64::from(u8::from(weight != 1.0));
                        [n + 1.0, w + weight, wv + weight * value, min.min(value), max.max(value), odd]
                    },
                )
            })
            .collect();
        let [count, weight, moment, min, max, odd] =
            sums.into_iter().fold([0.0, 0.0, 0.0, f64::INFINITY, 0.0, 0.0], |[n, w, wv, min, max, odd], s| {
                [n + s[0], w + s[1], wv + s[2], f64::min(min, s[3]), f64::max(max, s[4]), odd + s[5]]
            });
        if weight <= 0.0 {
            return None;
        }
        let mean = moment / weight;
        let spread: Vec<f64> =
            chunks().map(|range| counted(range).map(|(value, weight)| weight * (value - mean).powi(2)).sum()).collect();
        let deviation = (spread.iter().sum::<f64>() / weight).sqrt();
        let scale = if max > 0.0 { BINS as f64 / max } else { 0.0 };
        let fill = |mut bins: Vec<f64>, range: std::ops::Range<usize>| {
            for (value, weight) in counted(range) {
                bins[((value * scale) as usize).min(BINS - 1)] += weight;
            }
            bins
        };
        let none = || vec![0.0; BINS];
        let bins = match odd == 0.0 {
            // Weights of 1 add up to the same in any order.
            true => chunks().fold(none, fill).reduce(none, |a, b| a.iter().zip(b).map(|(a, b)| a + b).collect()),
            false => fill(none(), 0..length),
        };
        Some(Distribution { count: count as u64, weight, mean, deviation, min, max, bins })
    }

    /// Returns the number of values.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Returns the total weight.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// Returns the weighted mean.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Returns the weighted standard deviation.
    pub fn deviation(&self) -> f64 {
        self.deviation
    }

    /// Returns the smallest value.
    pub fn min(&self) -> f64 {
        self.min
    }

    /// Returns the largest value.
    pub fn max(&self) -> f64 {
        self.max
    }

    /// Returns the value below which a share of the weight lies, 0 ≤ `share` ≤ 1, to 1/65 536 of the largest.
    pub fn quantile(&self, share: f64) -> f64 {
        let mut below = 0.0;
        let wanted = share * self.weight;
        for (bin, &weight) in self.bins.iter().enumerate().filter(|&(_, &weight)| weight > 0.0) {
            if below + weight >= wanted {
                let within = ((wanted - below) / weight).clamp(0.0, 1.0);
                return ((bin as f64 + within) * self.max / BINS as f64).clamp(self.min, self.max);
            }
            below += weight;
        }
        self.max
    }

    /// Returns the share of the weight whose values are at least `value`, to a bin.
    pub fn share_from(&self, value: f64) -> f64 {
        if value <= self.min || self.max == 0.0 {
            return 1.0;
        }
        let first = (value / self.max * BINS as f64).round() as usize;
        self.bins.iter().skip(first).sum::<f64>() / self.weight
    }

    /// Returns `count` equal bins from 0 to the largest value.
    ///
    /// # Panics
    /// If `count` is 0 or more than 65,536.
    pub fn histogram(&self, count: usize) -> Histogram {
        assert!((1..=BINS).contains(&count), "{count} bins");
        let mut shares = vec![0.0; count];
        for (bin, weight) in self.bins.iter().enumerate() {
            shares[bin * count / BINS] += weight / self.weight;
        }
        Histogram { range: [0.0, self.max], shares }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uniform_distribution_has_its_known_moments() {
        let values: Vec<(f64, f64)> = (0..100_000).map(|i| ((f64::from(i) + 0.5) * 1e-5, 2.0)).collect();
        let d = Distribution::of_weighted(&values).unwrap();
        assert_eq!((d.count(), d.weight()), (100_000, 200_000.0));
        assert!((d.mean() - 0.5).abs() < 1e-9 && (d.deviation() - (1.0f64 / 12.0).sqrt()).abs() < 1e-6);
        for share in [0.01, 0.05, 0.5, 0.95] {
            assert!((d.quantile(share) - share).abs() < 3e-5, "{share}: {}", d.quantile(share));
            assert!((d.share_from(share) - (1.0 - share)).abs() < 3e-5);
        }
        let histogram = d.histogram(10);
        assert!(histogram.shares.iter().all(|share| (share - 0.1).abs() < 1e-4), "{histogram:?}");
    }

    #[test]
    fn weights_scale_the_mean_and_zero_weights_are_ignored() {
        let d = Distribution::of_weighted(&[(1.0, 3.0), (5.0, 1.0), (9.0, 0.0)]).unwrap();
        assert_eq!((d.count(), d.mean(), d.min(), d.max()), (2, 2.0, 1.0, 5.0));
        assert!(Distribution::of_weighted(&[(1.0, 0.0)]).is_none());
        assert_eq!(Distribution::of_map(&[0.0, 2.0, 4.0], 0.5).unwrap().mean(), 1.5);
    }
}
