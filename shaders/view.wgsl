// How lattice positions relate to columns and rows; the twin of `Pixels` in `src/fixed.rs`, and a part of every shader.

// The least index whose ray lies at or above an even lattice position. May be one past the last ray.
fn index_from(position: i32) -> i32 {
    return (position - view.first_ray + (1 << view.shift) - 1) >> view.shift;
}

// The lattice position of ray `index`.
fn ray_position(index: i32) -> i32 {
    return (index << view.shift) + view.first_ray;
}
