// Retrieval, the second geometry pass: each crossing finds its rank in O(1) and stores the least or the greatest depth
// there; the twin of `retrieve.rs`. The samples hold the values of `identities.wgsl`, which every depth replaces.

@group(0) @binding(4) var<storage, read> single: array<u32>;
@group(0) @binding(5) var<storage, read> pair: array<u32>;
@group(0) @binding(6) var<storage, read> ranks: array<u32>;
@group(0) @binding(7) var<storage, read> starts: array<u32>;
@group(0) @binding(8) var<storage, read_write> samples: array<atomic<i32>>;
@group(0) @binding(9) var<storage, read_write> tallies: array<Tally>;

const NEEDS_DEPTH = true;

fn keep(at: u32, rank: u32, crossing: u32) {
    if keeps_least(rank) {
        atomicMin(&samples[at + rank], crossing_floor(crossing));
    } else {
        atomicMax(&samples[at + rank], crossing_ceil(crossing));
    }
}

fn begin(lane: u32, count: u32) -> u32 {
    clear_tally(lane);
    return 0u;
}

// A job by masks has one band, to which all crossings of a workgroup belong.
fn cross(place: u32, ray: u32, band: u32, crossing: u32, triangle: u32) {
    let voxel = crossing_voxel(crossing, band);
    let word = (voxel / WORD_BITS) * view.rays + ray;
    let bit = 1u << (voxel % WORD_BITS);
    let singles = single[word];
    let pairs = pair[word];
    let rank = ranks[word] + countOneBits(singles & (bit - 1u)) + 2u * countOneBits(pairs & (bit - 1u));
    let is_single = (singles & bit) != 0u;
    if !TWO_SOLIDS && is_counted(ray, band) && ranks[ray] != UNCLOSED {
        add_winding(crossing, bitcast<i32>(voxel), is_single, (rank & 1u) == 0u);
    }
    let is_pair = (pairs & bit) != 0u;
    if !(is_single || is_pair) {
        return;
    }
    keep(starts[ray], rank, crossing);
    if is_pair {
        keep(starts[ray], rank + 1u, crossing);
    }
}

fn finish(lane: u32) {
    if !TWO_SOLIDS {
        add_to_tally(lane, 0u);
    }
}
