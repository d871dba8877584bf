//! Local thickness: the largest ball within a phase that holds a point.
