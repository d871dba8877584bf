//! A value that lies between two others.

/// A closed interval that contains a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The lower end, included.
    pub lower: f64,
    /// The upper end, included.
    pub upper: f64,
}

impl Interval {
    /// Returns the interval of a known value.
    pub fn exactly(value: f64) -> Interval {
        Interval { lower: value, upper: value }
    }

    /// Returns the difference of the ends.
    pub fn width(&self) -> f64 {
        self.upper - self.lower
    }

    /// Returns whether a value lies in the interval, ends included.
    pub fn contains(&self, value: f64) -> bool {
        (self.lower..=self.upper).contains(&value)
    }
}
