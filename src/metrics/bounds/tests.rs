//! Bounds against points, and against volumes that are known.
