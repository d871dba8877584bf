//! Connected pieces of a set of nodes.
