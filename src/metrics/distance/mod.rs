//! Distances from nodes to where rays cross the surface.
