//! Integrals of curvature over a mesh.
