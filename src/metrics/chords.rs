//! Chords: the stretches of rays within a phase.
