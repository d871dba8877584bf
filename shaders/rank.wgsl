// The depth that a sample keeps, by the parity of its rank; the twin of `keeps_least` and `identity` in `retrieve.rs`.

// Returns whether a rank keeps the least depth. Even ranks enter and odd ones leave; the over-estimate enters at the
// least and leaves at the greatest depth.
fn keeps_least(rank: u32) -> bool {
    return ((rank & 1u) == 0u) == OVER;
}

// Returns the value that every depth replaces.
fn identity(rank: u32) -> i32 {
    return select(i32(0x80000000u), 0x7fffffff, keeps_least(rank));
}
