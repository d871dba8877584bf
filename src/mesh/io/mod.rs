//! Mesh files, one module a format.
