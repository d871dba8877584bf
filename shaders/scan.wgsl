// Computes the offset of the items of each list: the exclusive prefix sum of counts, in two dispatches whatever their number,
// followed by their sum. Sums that exceed 32 bits saturate, which the host detects, and an unclosed ray counts as empty. If the
// sum exceeds the capacity, all lists are empty.

@group(0) @binding(1) var<storage, read> counts: array<u32>;
@group(0) @binding(2) var<storage, read_write> block_sums: array<u32>;
@group(0) @binding(3) var<storage, read_write> starts: array<u32>;
@group(0) @binding(4) var<storage, read_write> found: Found;
// The lists that are too long for one invocation to sort.
@group(0) @binding(5) var<storage, read_write> long_lists: array<u32>;

// Invocations whose values one of them sums.
const PART = 16u;
const PARTS = SCAN_WORKGROUP / PART;

var<workgroup> sums: array<u32, SCAN_WORKGROUP>;
var<workgroup> part_sums: array<u32, PARTS + 1u>;
var<workgroup> greatest: atomic<u32>;

fn saturating_sum(a: u32, b: u32) -> u32 {
    let sum = a + b;
    return select(sum, 0xffffffffu, sum < a);
}

// Returns the sum of the values of all lanes before this one, and the sum of all.
fn exclusive_sum(lane: u32, value: u32) -> vec2<u32> {
    sums[lane] = value;
    workgroupBarrier();
    if lane < PARTS {
        var sum = 0u;
        for (var each = PART * lane; each < PART * lane + PART; each++) {
            let own = sums[each];
            sums[each] = sum;
            sum = saturating_sum(sum, own);
        }
        part_sums[lane] = sum;
    }
    workgroupBarrier();
    if lane == 0u {
        var sum = 0u;
        for (var part = 0u; part < PARTS; part++) {
            let own = part_sums[part];
            part_sums[part] = sum;
            sum = saturating_sum(sum, own);
        }
        part_sums[PARTS] = sum;
    }
    workgroupBarrier();
    let sum = vec2(saturating_sum(part_sums[lane / PART], sums[lane]), part_sums[PARTS]);
    workgroupBarrier();
    return sum;
}

fn count_of(list: u32) -> u32 {
    if list >= view.lists {
        return 0u;
    }
    let count = counts[list];
    return select(count, 0u, count == UNCLOSED);
}

fn block_count() -> u32 {
    return (view.lists + SCAN_BLOCK - 1u) / SCAN_BLOCK;
}

// Computes the sum of each block of SCAN_BLOCK counts, and the maximum of all.
@compute @workgroup_size(SCAN_WORKGROUP)
fn sum_blocks(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
              @builtin(local_invocation_index) lane: u32) {
    let block = workgroup_index(group, groups);
    if lane == 0u {
        atomicStore(&greatest, 0u);
    }
    workgroupBarrier();
    var sum = 0u;
    var most = 0u;
    for (var i = 0u; i < SCAN_ITEMS; i++) {
        let count = count_of(block * SCAN_BLOCK + i * SCAN_WORKGROUP + lane);
        sum = saturating_sum(sum, count);
        most = max(most, count);
    }
    if most > 0u {
        atomicMax(&greatest, most);
    }
    let all_lanes = exclusive_sum(lane, sum).y;
    if lane == 0u && block < block_count() {
        block_sums[block] = all_lanes;
        atomicMax(&found.greatest, atomicLoad(&greatest));
    }
}

// Computes the sum of all counts before each.
@compute @workgroup_size(SCAN_WORKGROUP)
fn spread_blocks(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
                 @builtin(local_invocation_index) lane: u32) {
    let block = workgroup_index(group, groups);
    // The sums of the blocks before this one, and of all.
    var before = 0u;
    var all_blocks = 0u;
    for (var each = lane; each < block_count(); each += SCAN_WORKGROUP) {
        let sum = block_sums[each];
        all_blocks = saturating_sum(all_blocks, sum);
        if each < block {
            before = saturating_sum(before, sum);
        }
    }
    let sum_before = exclusive_sum(lane, before).y;
    let sum_of_all = exclusive_sum(lane, all_blocks).y;

    let is_sound = sum_of_all <= view.capacity;
    let first = block * SCAN_BLOCK + lane * SCAN_ITEMS;
    var sum = 0u;
    for (var i = 0u; i < SCAN_ITEMS; i++) {
        sum = saturating_sum(sum, count_of(first + i));
    }
    var start = saturating_sum(sum_before, exclusive_sum(lane, sum).x);
    for (var i = 0u; i < SCAN_ITEMS; i++) {
        let list = first + i;
        if list < view.lists {
            starts[list] = select(0u, start, is_sound);
        }
        let count = count_of(list);
        start = saturating_sum(start, count);
        if is_sound && count > view.long_from {
            remember_long(list);
        }
    }
    if lane == 0u && block == 0u {
        starts[view.lists] = select(0u, sum_of_all, is_sound);
        found.total = sum_of_all;
        found.workgroups_y = 1u;
        found.workgroups_z = 1u;
    }
}

// Adds a list to the long ones, and a workgroup to the dispatch that sorts those.
fn remember_long(list: u32) {
    let at = atomicAdd(&found.long_lists, 1u);
    atomicMax(&found.workgroups_x, min(at + 1u, MOST_GROUPS));
    long_lists[at] = list;
}
