//! Characteristics against counts of cells, and solids whose numbers are known.
