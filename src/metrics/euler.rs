//! The Euler characteristic of a set of nodes, and what follows from it.
