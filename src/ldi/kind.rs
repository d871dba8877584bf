//! The kinds of images: exact or conservative, and the rule for what is inside.

/// The kind of image of a solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mode {
    /// Every crossing, at the nearest lattice depth; nothing merged.
    Exact,
    /// A conservative image; see [`Estimate`].
    Estimate(Estimate),
}

/// The side of the exact image on which a conservative one lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Estimate {
    /// On every ray the image encloses the solid.
    Over,
    /// On every ray the image lies inside the solid.
    Under,
}

impl Estimate {
    /// Returns the estimate of a complement: the one to subtract from an estimate so that the result stays on its side.
    pub fn opposite(self) -> Estimate {
        match self {
            Estimate::Over => Estimate::Under,
            Estimate::Under => Estimate::Over,
        }
    }
}

impl Mode {
    /// The over-estimate.
    pub const OVER: Mode = Mode::Estimate(Estimate::Over);
    /// The under-estimate.
    pub const UNDER: Mode = Mode::Estimate(Estimate::Under);
    /// All modes.
    pub const ALL: [Mode; 3] = [Mode::Exact, Mode::OVER, Mode::UNDER];

    /// Returns its name in files and options: `exact`, `over` or `under`.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Exact => "exact",
            Mode::OVER => "over",
            Mode::UNDER => "under",
        }
    }

    /// Returns [`Mode::Exact`] for itself, the other estimate for an estimate.
    pub fn opposite(self) -> Mode {
        match self {
            Mode::Exact => Mode::Exact,
            Mode::Estimate(estimate) => Mode::Estimate(estimate.opposite()),
        }
    }
}

/// The fill rule: which points are inside where shells overlap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FillRule {
    /// A point is inside when a ray from it crosses the mesh an odd number of times: overlapping shells cancel.
    EvenOdd,
    /// A point is inside when its winding number is not zero: overlapping shells unite. Needs an oriented mesh.
    NonZero,
}

impl FillRule {
    /// Returns whether a point with a winding number is inside.
    #[inline]
    pub(crate) fn is_inside(self, winding: i32) -> bool {
        match self {
            FillRule::EvenOdd => winding & 1 != 0,
            FillRule::NonZero => winding != 0,
        }
    }
}
