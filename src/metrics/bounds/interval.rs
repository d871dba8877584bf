//! A value that lies between two others.

/// The ends of what a value may be, both included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// The least that it can be.
    pub lower: f64,
    /// The most that it can be.
    pub upper: f64,
}

impl Interval {
    /// A value that is known.
    pub fn exactly(value: f64) -> Interval {
        Interval { lower: value, upper: value }
    }

    /// How far the ends are apart.
    pub fn width(&self) -> f64 {
        self.upper - self.lower
    }

    /// Whether a value lies between the ends, or is one.
    pub fn contains(&self, value: f64) -> bool {
        (self.lower..=self.upper).contains(&value)
    }
}
