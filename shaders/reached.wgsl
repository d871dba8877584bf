// Counts the nodes that neither state has reached, and detects nodes that both have. One invocation per word.

@group(0) @binding(0) var<uniform> view: NodeView;
@group(0) @binding(1) var<storage, read> inside: array<u32>;
@group(0) @binding(2) var<storage, read> outside: array<u32>;
@group(0) @binding(3) var<storage, read_write> tally: NodeTally;

var<workgroup> group_open: atomic<u32>;

@compute @workgroup_size(WORKGROUP)
fn reached(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
           @builtin(local_invocation_index) lane: u32) {
    if lane == 0u {
        atomicStore(&group_open, 0u);
    }
    workgroupBarrier();
    let at = invocation_index(group, groups, lane);
    if at < view.all_words {
        atomicAdd(&group_open, countOneBits(~(inside[at] | outside[at])));
        if (inside[at] & outside[at]) != 0u {
            atomicOr(&tally.contradictory, 1u);
        }
    }
    workgroupBarrier();
    if lane == 0u {
        let open = atomicLoad(&group_open);
        let before = atomicAdd(&tally.open_low, open);
        atomicAdd(&tally.open_high, carry(before, open));
    }
}
