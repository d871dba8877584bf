//! Mean intercept lengths, their ellipsoid, the degree of anisotropy.
