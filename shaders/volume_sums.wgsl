// Computes the integer sums of images, one invocation per ray; the twin of `src/ldi/volume_sums.rs`. Rows beside the counted ones
// serve only for comparison. Samples may lie with gaps between the rays.

@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> counts: array<u32>;
@group(0) @binding(3) var<storage, read> samples: array<i32>;
@group(0) @binding(4) var<storage, read_write> levels: array<u32>;
// For each band, SUMS sums of 64 bits in two words each, then the largest number of samples of a ray and the number of all
// samples.
@group(0) @binding(5) var<storage, read_write> totals: array<atomic<u32>>;

var<workgroup> group_low: array<atomic<u32>, SUMS>;
var<workgroup> group_high: array<atomic<u32>, SUMS>;

var<workgroup> group_layers: atomic<u32>;
var<workgroup> group_samples: atomic<u32>;

// Returns the number of samples of a ray; an unclosed one has none.
fn count_of(ray: u32) -> u32 {
    let count = counts[ray];
    return select(count, 0u, count == UNCLOSED);
}

// Compares the samples of a ray with those of the next one, and marks those of the first, or else of the second, that lie
// at the same depth and have the same direction.
fn mark_level(a: u32, b: u32, mark: u32, marks_first: bool) {
    let first_a = first_loose(a);
    let end_a = first_a + count_of(a);
    let first_b = first_loose(b);
    let end_b = first_b + count_of(b);
    let is_paired = end_a - first_a == end_b - first_b;
    var reach = first_b;
    for (var i = first_a; i < end_a; i++) {
        let depth = samples[i];
        var j = first_b + (i - first_a);
        if !is_paired {
            while reach < end_b {
                if samples[reach] >= depth - view.level_tolerance {
                    break;
                }
                reach++;
            }
            // The first in reach with the same direction.
            j = reach + (((reach - first_b) ^ (i - first_a)) & 1u);
        }
        if j < end_b {
            if abs(depth - samples[j]) <= view.level_tolerance {
                levels[select(j, i, marks_first)] |= mark;
            }
        }
    }
}

// Adds a signed number of 32 bits to a sum.
fn add(sum: u32, signed_term: i32) {
    let term = bitcast<u32>(signed_term);
    if term == 0u {
        return;
    }
    let before = atomicAdd(&group_low[sum], term);
    atomicAdd(&group_high[sum], carry(before, term) + sign_word(signed_term));
}

fn add_residual(depth: i32, index: i32, level: u32, direction: i32) {
    let residual = depth - (index << view.shift);
    let half_pixel = 1 << (view.shift - 1u);
    if level == (ALONG_COLUMNS | ALONG_ROWS) {
        add(LEVEL_SUMS, direction * residual);
    } else if level != 0u && abs(abs(residual) - half_pixel) > THROUGH_NODES {
        add(LEVEL_SUMS + level, direction * residual);
    }
}

fn add_ray(ray: u32, band: u32) {
    let first = first_loose(ray);
    let end = first + count_of(ray);
    for (var at = first; at < end; at++) {
        levels[at] = 0u;
    }
    let columns = view.bands[band].columns;
    let own = ray - view.bands[band].first_ray;
    let row = own / columns;
    let column = own % columns;
    if column > 0u {
        mark_level(ray - 1u, ray, ALONG_COLUMNS, false);
    }
    if column + 1u < columns {
        mark_level(ray, ray + 1u, ALONG_COLUMNS, true);
    }
    if row > 0u {
        mark_level(ray - columns, ray, ALONG_ROWS, false);
    }
    if own + columns < view.bands[band].rays {
        mark_level(ray, ray + columns, ALONG_ROWS, true);
    }
    let parity = (column & 1u) + 2u * (bitcast<u32>(view.bands[band].first_row + i32(row)) & 1u);
    for (var at = first; at < end; at += 2u) {
        let near = samples[at];
        let far = samples[at + 1u];
        add(parity, far - near);
        let first_node = index_from(near);
        let end_node = index_from(far);
        // Of the first k indices, (k + 1) / 2 are even.
        let even = (end_node + 1) / 2 - (first_node + 1) / 2;
        add(NODE_SUMS + 2u * parity, even);
        add(NODE_SUMS + 2u * parity + 1u, end_node - first_node - even);
        add_residual(near, first_node, levels[at], -1);
        add_residual(far, end_node, levels[at + 1u], 1);
    }
    atomicMax(&group_layers, end - first);
    atomicAdd(&group_samples, end - first);
}

@compute @workgroup_size(WORKGROUP)
fn summarise(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
             @builtin(local_invocation_index) lane: u32) {
    if lane < SUMS {
        atomicStore(&group_low[lane], 0u);
        atomicStore(&group_high[lane], 0u);
    }
    if lane == 0u {
        atomicStore(&group_layers, 0u);
        atomicStore(&group_samples, 0u);
    }
    workgroupBarrier();
    let ray = invocation_index(group, groups, lane);
    let band = band_of(ray);
    if is_ray(ray, band) && is_counted(ray, band) {
        // Most rays of a scaffold's image miss it.
        if count_of(ray) > 0u {
            add_ray(ray, band);
        }
    }
    workgroupBarrier();
    if atomicLoad(&group_samples) == 0u {
        return;
    }
    let of_band = band * TOTALS_WORDS;
    if lane < SUMS {
        let low = atomicLoad(&group_low[lane]);
        let high = atomicLoad(&group_high[lane]);
        if (low | high) != 0u {
            let before = atomicAdd(&totals[of_band + 2u * lane], low);
            atomicAdd(&totals[of_band + 2u * lane + 1u], high + carry(before, low));
        }
    }
    if lane == 0u {
        atomicMax(&totals[of_band + 2u * SUMS], atomicLoad(&group_layers));
        atomicAdd(&totals[of_band + 2u * SUMS + 1u], atomicLoad(&group_samples));
    }
}
