//! Distances against exact rational arithmetic, and hierarchies against all pairs.

mod distances;
mod oracle;
