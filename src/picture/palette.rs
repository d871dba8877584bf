//! Colours that readers with colour-vision deficiency can distinguish, after Okabe & Ito, less saturated for surfaces.

use super::canvas::Colour;

/// Returns the tint of a single solid.
pub fn alone() -> Colour {
    Colour::srgb(0xd0cabd)
}

/// Returns the tint of one of several solids; the colours repeat after eight.
pub fn tint(index: usize) -> Colour {
    const CODES: [u32; 8] = [0x5e97c6, 0xe5a544, 0x4fae8d, 0xd98cb3, 0xf0e06a, 0x3f6fa8, 0xd0693a, 0xa9a9a9];
    Colour::srgb(CODES[index % CODES.len()])
}

/// Returns the colour of the face of a cut through a single solid, or through the result of several.
pub fn cut() -> Colour {
    Colour::srgb(0xb5533c)
}

/// Returns the colour of the region that two clashing parts share.
pub fn clash() -> Colour {
    Colour::srgb(0xb3261e)
}

/// Returns the colour of the result of several solids in a slice: dark, so that its lightness differs from all tints.
pub fn result() -> Colour {
    Colour::srgb(0x3b4a63)
}
