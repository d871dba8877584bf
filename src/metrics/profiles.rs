//! Porosity, slice by slice.
