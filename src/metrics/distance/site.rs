//! What a transform carries with the distance of a node.

use bytemuck::Pod;

/// The crossing nearest to a node: its number, or nothing where distances alone are asked for.
pub(super) trait Site: Pod + Send + Sync {
    /// No crossing.
    const NONE: Self;
    /// Whether the crossing is known.
    const IS_KNOWN: bool;

    /// Returns the crossing of a number.
    fn numbered(number: u32) -> Self;

    /// Returns the number of the crossing; any where it is not known.
    fn number(self) -> u32;

    /// Returns the other one where all bits of `mask` are set, and this one where none is: compilers turn it into vectors.
    fn or(self, other: Self, mask: u32) -> Self;
}

impl Site for u32 {
    const NONE: u32 = u32::MAX;
    const IS_KNOWN: bool = true;

    #[inline(always)]
    fn numbered(number: u32) -> u32 {
        number
    }

    #[inline(always)]
    fn number(self) -> u32 {
        self
    }

    #[inline(always)]
    fn or(self, other: u32, mask: u32) -> u32 {
        self ^ (mask & (self ^ other))
    }
}

impl Site for () {
    const NONE: () = ();
    const IS_KNOWN: bool = false;

    #[inline(always)]
    fn numbered(_: u32) {}

    #[inline(always)]
    fn number(self) -> u32 {
        u32::NONE
    }

    #[inline(always)]
    fn or(self, (): (), _: u32) {}
}

/// Returns the lesser of two values with its site, of equal ones the first.
#[inline(always)]
pub(super) fn lesser<S: Site>((value, site): (f32, S), (other, of_other): (f32, S)) -> (f32, S) {
    (other.min(value), site.or(of_other, 0u32.wrapping_sub((other < value).into())))
}
