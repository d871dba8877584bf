// Even-odd estimates of one solid by tiles of TILE_SIDE × TILE_SIDE rays, one workgroup per tile and one lane per ray.
// The masks of a tile never leave workgroup memory: its triangles, which `bin.wgsl` has found, are marked there, the
// lanes classify their rays, and each crossing finds its rank. The crossings of most tiles are kept from the first pass
// to the second; where there are too many, the triangles are processed once more.
//
// The samples of a tile take the next free place in `loose`, whose order among tiles is not predictable. Where there is
// no room left nothing is written; the host, which learns from the counts how much is needed, makes room and runs this
// again.

@group(0) @binding(3) var<storage, read> starts: array<u32>;
@group(0) @binding(4) var<storage, read> binned: array<u32>;
@group(0) @binding(5) var<storage, read_write> counts: array<u32>;
// The offset of the samples of each ray.
@group(0) @binding(6) var<storage, read_write> places: array<u32>;
@group(0) @binding(7) var<storage, read_write> loose: array<atomic<i32>>;
@group(0) @binding(8) var<storage, read_write> tally: Tally;
@group(0) @binding(9) var<storage, read_write> next_place: atomic<u32>;

const NEEDS_DEPTH = true;

// Word w of ray r of the tile is at w · WORKGROUP + r. The masks become classes as in `classify.wgsl`.
var<workgroup> change: array<atomic<u32>, WORKGROUP * TILE_WORDS>;
var<workgroup> any_in: array<atomic<u32>, WORKGROUP * TILE_WORDS>;
// Ranks of two words of a ray in one; they are at most 2^11.
var<workgroup> ranks: array<u32, WORKGROUP * TILE_WORDS / 2u>;
const RANK_BITS = 16u;

// The crossings of the tile, in any order, and their rays, four in a word.
var<workgroup> crossings: atomic<u32>;
var<workgroup> kept: array<u32, TILE_CROSSINGS>;
var<workgroup> kept_rays: array<atomic<u32>, TILE_CROSSINGS / 4u>;

// The offset of the samples of each ray, relative to those of the tile.
var<workgroup> tile_places: array<u32, WORKGROUP>;
var<workgroup> tile_samples: atomic<u32>;
var<workgroup> tile_place: u32;

// The first ray of the tile.
var<private> tile_row: i32;
var<private> tile_column: i32;
// True while crossings are processed a second time.
var<private> is_second: bool;

fn ray_at(row: i32, column: i32) -> u32 {
    return u32(row - tile_row) * TILE_SIDE + u32(column - tile_column);
}

// Returns the index in the band of a ray of the tile.
fn ray_in_band(ray: u32) -> u32 {
    let row = u32(tile_row - view.first_row) + ray / TILE_SIDE;
    return row * view.columns + u32(tile_column - view.first_column) + ray % TILE_SIDE;
}

fn keep(at: u32, rank: u32, crossing: u32) {
    if keeps_least(rank) {
        atomicMin(&loose[at + rank], crossing_floor(crossing));
    } else {
        atomicMax(&loose[at + rank], crossing_ceil(crossing));
    }
}

fn cross(ray: u32, crossing: u32, triangle: u32) {
    if is_second {
        retrieve(ray, crossing);
        return;
    }
    let voxel = crossing_voxel(crossing);
    let at = voxel / WORD_BITS * WORKGROUP + ray;
    let bit = 1u << (voxel % WORD_BITS);
    atomicXor(&change[at], bit);
    atomicOr(&any_in[at], bit);
    let index = atomicAdd(&crossings, 1u);
    if index < TILE_CROSSINGS {
        kept[index] = crossing;
        atomicOr(&kept_rays[index / 4u], ray << (8u * (index % 4u)));
    }
}

fn retrieve(ray: u32, crossing: u32) {
    let voxel = crossing_voxel(crossing);
    let word = voxel / WORD_BITS;
    let at = word * WORKGROUP + ray;
    let bit = 1u << (voxel % WORD_BITS);
    if tile_places[ray] == UNCLOSED {
        return;
    }
    let singles = atomicLoad(&change[at]);
    let pairs = atomicLoad(&any_in[at]);
    let before = (ranks[(word / 2u) * WORKGROUP + ray] >> (RANK_BITS * (word & 1u))) & ((1u << RANK_BITS) - 1u);
    let rank = before + countOneBits(singles & (bit - 1u)) + 2u * countOneBits(pairs & (bit - 1u));
    let is_single = (singles & bit) != 0u;
    let is_pair = (pairs & bit) != 0u;
    if is_counted(ray_in_band(ray)) {
        add_winding(crossing, bitcast<i32>(voxel), is_single, (rank & 1u) == 0u);
    }
    let place = tile_place + tile_places[ray];
    if is_single || is_pair {
        keep(place, rank, crossing);
    }
    if is_pair {
        keep(place, rank + 1u, crossing);
    }
}

// Covers the triangles from `first` to `end` within the tile: one lane per triangle, or for few triangles one lane per
// row.
fn cover_tile(first: u32, end: u32, lane: u32) {
    let lanes = select(1u, TILE_SIDE, (end - first) * TILE_SIDE <= 2u * WORKGROUP);
    let side = i32(TILE_SIDE);
    for (var at = first + lane / lanes; at < end; at += WORKGROUP / lanes) {
        var seen = see(binned[at]);
        seen.first_row = max(seen.first_row, tile_row);
        seen.end_row = min(seen.end_row, tile_row + side);
        seen.first_column = max(seen.first_column, tile_column);
        seen.end_column = min(seen.end_column, tile_column + side);
        for (var row = seen.first_row + i32(lane % lanes); row < seen.end_row; row += i32(lanes)) {
            cover_row(seen, row, 0, 1);
        }
    }
}

// Returns the number of samples of a ray; its masks become classes.
fn classify_ray(ray: u32) -> u32 {
    var samples = 0u;
    var changed = 0u;
    var inside = 0u;
    for (var word = 0u; word < view.words; word++) {
        let at = word * WORKGROUP + ray;
        let single = atomicLoad(&change[at]);
        let touched = atomicLoad(&any_in[at]);
        let far = prefix_parity(single) ^ inside;
        let pair = touched & ~single & select(far, ~far, OVER);
        atomicStore(&any_in[at], pair);
        ranks[(word / 2u) * WORKGROUP + ray] |= samples << (RANK_BITS * (word & 1u));
        inside = spread_top(far);
        let singles = countOneBits(single);
        changed += singles;
        samples += singles + 2u * countOneBits(pair);
    }
    if inside != 0u {
        tell_unclosed(ray_in_band(ray));
        return UNCLOSED;
    }
    if is_counted(ray_in_band(ray)) {
        changes += changed;
    }
    return samples;
}

@compute @workgroup_size(WORKGROUP)
fn sample_tiles(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
                @builtin(local_invocation_index) lane: u32) {
    let tile = workgroup_index(group, groups);
    let across = (view.columns + TILE_SIDE - 1u) / TILE_SIDE;
    let rows = view.rays / view.columns;
    tile_row = view.first_row + i32(TILE_SIDE * (tile / across));
    tile_column = view.first_column + i32(TILE_SIDE * (tile % across));
    let row = TILE_SIDE * (tile / across) + lane / TILE_SIDE;
    let column = TILE_SIDE * (tile % across) + lane % TILE_SIDE;
    let is_ray = row < rows && column < view.columns;
    var first = 0u;
    var end = 0u;
    if TILE_SIDE * (tile / across) < rows {
        first = starts[tile];
        end = starts[tile + 1u];
    }

    cover_tile(first, end, lane);
    workgroupBarrier();

    var count = 0u;
    if first < end && is_ray {
        count = classify_ray(lane);
    }
    tile_places[lane] = UNCLOSED;
    if count != UNCLOSED {
        tile_places[lane] = atomicAdd(&tile_samples, count);
    }
    workgroupBarrier();

    let samples = atomicLoad(&tile_samples);
    if lane == 0u && samples > 0u {
        tile_place = atomicAdd(&next_place, samples);
    }
    workgroupBarrier();

    let place = tile_place;
    let room = arrayLength(&loose);
    let fits = samples <= room && place <= room - samples;
    if is_ray {
        counts[ray_in_band(lane)] = count;
        places[ray_in_band(lane)] = place + tile_places[lane];
    }
    if fits {
        // All rays have even counts, so that the parity of a sample's rank is that of its place.
        for (var at = lane; at < samples; at += WORKGROUP) {
            atomicStore(&loose[place + at], identity(at));
        }
    }
    storageBarrier();
    workgroupBarrier();

    let all = atomicLoad(&crossings);
    if fits && all <= TILE_CROSSINGS {
        for (var index = lane; index < all; index += WORKGROUP) {
            retrieve((atomicLoad(&kept_rays[index / 4u]) >> (8u * (index % 4u))) & 0xffu, kept[index]);
        }
    } else if fits {
        is_second = true;
        cover_tile(first, end, lane);
    }
    add_to_tally(lane);
}
