//! Estimates of permeability.
