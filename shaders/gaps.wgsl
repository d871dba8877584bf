// Counts how often each of the sorted crossings of all rays is kept: as an end of a gap, and as an end of its ray. One
// invocation per crossing, so that long rays cause no long loops; the twin of `Keep::append` in `src/sampler/lists.rs`.

@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> crossings: array<u32>;
@group(0) @binding(3) var<storage, read_write> counts: array<u32>;

// Returns whether there may be a gap between a crossing and the next.
fn is_gap(before: u32, after: u32) -> bool {
    let has_room = crossing_ceil(before) < crossing_floor(after);
    let holds_node = index_from(crossing_nearest(before)) < index_from(crossing_nearest(after));
    return crossing_winding(before) < 0 && crossing_winding(after) > 0 && (has_room || holds_node);
}

@compute @workgroup_size(WORKGROUP)
fn gaps(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
        @builtin(local_invocation_index) lane: u32) {
    let index = invocation_index(group, groups, lane);
    if index >= starts[view.rays] {
        if index < view.capacity {
            counts[index] = 0u;
        }
        return;
    }
    let ray = ray_of(index);
    let is_first = index == starts[ray];
    let is_last = index + 1u == starts[ray + 1u];
    let crossing = crossings[index];
    var kept = 0u;
    if !is_first {
        kept += select(0u, 1u, is_gap(crossings[index - 1u], crossing));
    }
    if !is_last {
        kept += select(0u, 1u, is_gap(crossing, crossings[index + 1u]));
    }
    if KEEPS_ENDS {
        kept += select(0u, 1u, is_first) + select(0u, 1u, is_last);
    }
    counts[index] = kept;
}
