//! How much longer paths through a phase are than straight ones, and how much slower diffusion is.
