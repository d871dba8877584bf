//! Colours that are told apart by everyone, after Okabe & Ito's set for colour-blind readers, toned down for surfaces.

use super::canvas::Colour;

/// The tint of a solid that is alone.
pub fn alone() -> Colour {
    Colour::srgb(0xd0cabd)
}

/// The tint of one of several solids; after eight they begin anew.
pub fn tint(index: usize) -> Colour {
    const CODES: [u32; 8] = [0x5e97c6, 0xe5a544, 0x4fae8d, 0xd98cb3, 0xf0e06a, 0x3f6fa8, 0xd0693a, 0xa9a9a9];
    Colour::srgb(CODES[index % CODES.len()])
}

/// The face of a cut through a solid that is alone, or through the result of several.
pub fn cut() -> Colour {
    Colour::srgb(0xb5533c)
}

/// What belongs to the result of several solids, in a slice: dark, so that it stands out from all tints by lightness.
pub fn result() -> Colour {
    Colour::srgb(0x3b4a63)
}
