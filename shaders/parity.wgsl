// The inside state of 32 voxels at once.

// Returns the prefix parity: bit z is the parity of bits 0 to z.
fn prefix_parity(word: u32) -> u32 {
    var parity = word;
    parity ^= parity << 1u;
    parity ^= parity << 2u;
    parity ^= parity << 4u;
    parity ^= parity << 8u;
    parity ^= parity << 16u;
    return parity;
}

// Returns a word with all bits equal to the top one: the state that one word passes to the next.
fn spread_top(word: u32) -> u32 {
    return bitcast<u32>(bitcast<i32>(word) >> 31u);
}
