// Builds the masks of all rays in one geometry pass: W (one XOR per crossing) and ANY (one OR); the twin of `masks.rs`
// under the even-odd rule. Word w of ray r is at w · rays + r, so that neighbouring invocations read neighbouring
// words.

@group(0) @binding(4) var<storage, read_write> change: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> any_in: array<atomic<u32>>;

const NEEDS_DEPTH = true;

fn begin(lane: u32, count: u32) -> u32 {
    return 0u;
}

fn cross(place: u32, ray: u32, band: u32, crossing: u32, triangle: u32) {
    let voxel = crossing_voxel(crossing, band);
    let word = (voxel / WORD_BITS) * view.rays + ray;
    let bit = 1u << (voxel % WORD_BITS);
    atomicXor(&change[word], bit);
    atomicOr(&any_in[word], bit);
}

fn finish(lane: u32) {
}
