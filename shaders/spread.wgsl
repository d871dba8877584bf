// Turns changes into states: running parities along the rays of one axis, combined with those of other axes. A node is
// inside if a ray has it inside, and in the hull unless a ray has it beyond its crossings. One invocation per line of
// words.

@group(0) @binding(0) var<uniform> view: NodeView;
@group(0) @binding(1) var<storage, read> changes: array<u32>;
@group(0) @binding(2) var<storage, read> ends: array<u32>;
@group(0) @binding(3) var<storage, read_write> inside: array<u32>;
@group(0) @binding(4) var<storage, read_write> hull: array<u32>;

// Combines the result of one axis for the nodes of a word. The rays along x come first.
fn tell(at: u32, parity: u32, within: u32) {
    let now_inside = select(parity, ~parity, view.exterior_is_in != 0u);
    let now_hull = select(within, 0xffffffffu, view.exterior_is_in != 0u);
    if view.axis == AXIS_X {
        inside[at] = now_inside;
        hull[at] = now_hull;
    } else {
        inside[at] |= now_inside;
        hull[at] &= now_hull;
    }
}

// Spreads along x, through the bits of a row.
@compute @workgroup_size(WORKGROUP)
fn spread_rows(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
               @builtin(local_invocation_index) lane: u32) {
    let line = invocation_index(group, groups, lane);
    if line >= view.lines {
        return;
    }
    var before = vec2(0u);
    for (var word = 0u; word < view.steps; word++) {
        let at = line_start(line) + word * view.stride;
        let parity = prefix_parity(changes[at]) ^ before.x;
        let within = prefix_parity(ends[at]) ^ before.y;
        before = vec2(spread_top(parity), spread_top(within));
        tell(at, parity, within);
    }
}

// Spreads along y or z, word after word.
@compute @workgroup_size(WORKGROUP)
fn spread_lines(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
                @builtin(local_invocation_index) lane: u32) {
    let line = invocation_index(group, groups, lane);
    if line >= view.lines {
        return;
    }
    var state = vec2(0u);
    for (var step = 0u; step < view.steps; step++) {
        let at = line_start(line) + step * view.stride;
        state ^= vec2(changes[at], ends[at]);
        tell(at, state.x, state.y);
    }
}
