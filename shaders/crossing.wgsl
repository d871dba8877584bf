// Crossings as `Crossing` in `src/fixed.rs` has them.

// The largest even lattice position that is not above the true depth.
fn crossing_floor(crossing: u32) -> i32 {
    return bitcast<i32>((crossing >> 3u) << 1u);
}

// The least even lattice position that is not below the true depth.
fn crossing_ceil(crossing: u32) -> i32 {
    return crossing_floor(crossing) + select(0, 2, (crossing & 6u) != 0u);
}

// The even lattice position nearest to the true depth.
fn crossing_nearest(crossing: u32) -> i32 {
    return crossing_floor(crossing) + bitcast<i32>((crossing >> 1u) & 2u);
}

// +1 where the ray enters, -1 where it leaves.
fn crossing_winding(crossing: u32) -> i32 {
    return 1 - 2 * bitcast<i32>(crossing & 1u);
}
