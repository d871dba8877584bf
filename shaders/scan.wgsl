// Computes the offset of the items of each ray: the exclusive prefix sum of counts, in three dispatches whatever their
// number, followed by their sum and their maximum. Sums that exceed 32 bits saturate, which the host detects. An
// unclosed ray counts as empty.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> counts: array<u32>;
// The sum of each block, and after those the maximum of each.
@group(0) @binding(2) var<storage, read_write> block_sums: array<u32>;
@group(0) @binding(3) var<storage, read_write> starts: array<u32>;

var<workgroup> sums: array<u32, SCAN_WORKGROUP>;
var<workgroup> greatest: atomic<u32>;

fn saturating_sum(a: u32, b: u32) -> u32 {
    let sum = a + b;
    return select(sum, 0xffffffffu, sum < a);
}

// Returns the sum of the values of all lanes before this one; leaves the sum of all in the last of `sums`.
fn exclusive_sum(lane: u32, value: u32) -> u32 {
    sums[lane] = value;
    workgroupBarrier();
    for (var reach = 1u; reach < SCAN_WORKGROUP; reach *= 2u) {
        var before = 0u;
        if lane >= reach {
            before = sums[lane - reach];
        }
        workgroupBarrier();
        sums[lane] = saturating_sum(sums[lane], before);
        workgroupBarrier();
    }
    if lane == 0u {
        return 0u;
    }
    return sums[lane - 1u];
}

fn count_of(ray: u32) -> u32 {
    if ray >= view.rays || counts[ray] == UNCLOSED {
        return 0u;
    }
    return counts[ray];
}

fn block_count() -> u32 {
    return (view.rays + SCAN_BLOCK - 1u) / SCAN_BLOCK;
}

// Computes the sum and the maximum of each block of SCAN_BLOCK counts.
@compute @workgroup_size(SCAN_WORKGROUP)
fn sum_blocks(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var sum = 0u;
    var most = 0u;
    for (var i = 0u; i < SCAN_ITEMS; i++) {
        let count = count_of(group.x * SCAN_BLOCK + i * SCAN_WORKGROUP + lane);
        sum = saturating_sum(sum, count);
        most = max(most, count);
    }
    atomicMax(&greatest, most);
    exclusive_sum(lane, sum);
    if lane == 0u {
        block_sums[group.x] = sums[SCAN_WORKGROUP - 1u];
        block_sums[block_count() + group.x] = atomicLoad(&greatest);
    }
}

// Computes the sum of all blocks before each, and after the last the sum of all; one workgroup.
@compute @workgroup_size(SCAN_WORKGROUP)
fn scan_blocks(@builtin(local_invocation_index) lane: u32) {
    let blocks = block_count();
    var before = 0u;
    for (var first = 0u; first < blocks; first += SCAN_WORKGROUP) {
        let block = first + lane;
        var value = 0u;
        if block < blocks {
            value = block_sums[block];
            atomicMax(&greatest, block_sums[blocks + block]);
        }
        let sum = exclusive_sum(lane, value);
        if block < blocks {
            block_sums[block] = saturating_sum(before, sum);
        }
        before = saturating_sum(before, sums[SCAN_WORKGROUP - 1u]);
        workgroupBarrier();
    }
    workgroupBarrier();
    if lane == 0u {
        starts[view.rays] = before;
        starts[view.rays + 1u] = atomicLoad(&greatest);
    }
}

// Computes the sum of all counts before each.
@compute @workgroup_size(SCAN_WORKGROUP)
fn spread_blocks(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let first = group.x * SCAN_BLOCK + lane * SCAN_ITEMS;
    var sum = 0u;
    for (var i = 0u; i < SCAN_ITEMS; i++) {
        sum = saturating_sum(sum, count_of(first + i));
    }
    var before = saturating_sum(block_sums[group.x], exclusive_sum(lane, sum));
    for (var i = 0u; i < SCAN_ITEMS; i++) {
        let ray = first + i;
        if ray < view.rays {
            starts[ray] = before;
        }
        before = saturating_sum(before, count_of(ray));
    }
}
