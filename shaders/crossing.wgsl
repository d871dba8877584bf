// Crossings in the format of `Crossing` in `src/fixed.rs`.

// Returns the largest even lattice position that is not above the true depth.
fn crossing_floor(crossing: u32) -> i32 {
    return bitcast<i32>((crossing >> 3u) << 1u);
}

// Returns the least even lattice position that is not below the true depth.
fn crossing_ceil(crossing: u32) -> i32 {
    return crossing_floor(crossing) + select(0, 2, (crossing & 6u) != 0u);
}

// Returns the even lattice position nearest to the true depth.
fn crossing_nearest(crossing: u32) -> i32 {
    return crossing_floor(crossing) + bitcast<i32>((crossing >> 1u) & 2u);
}

// Returns +1 where the ray enters, -1 where it leaves.
fn crossing_winding(crossing: u32) -> i32 {
    return 1 - 2 * bitcast<i32>(crossing & 1u);
}
