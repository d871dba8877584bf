// Positions on the lattice; `view` is the input of the stage.

// Returns the least index whose ray lies at or above an even lattice position. May be one past the last ray. The twin
// of `Pixels::index_from` in `src/fixed.rs`.
fn index_from(position: i32) -> i32 {
    return (position - view.first_ray + (1 << view.shift) - 1) >> view.shift;
}
