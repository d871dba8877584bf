// One sweep of the flood, along one axis and back: the inside and the outside state spread to neighbours that no
// crossing separates from them. One invocation per line of words, which no other one accesses.

@group(0) @binding(0) var<uniform> view: NodeView;
// Bit b: there is a crossing between the node and the one before it.
@group(0) @binding(1) var<storage, read> walls: array<u32>;
@group(0) @binding(2) var<storage, read_write> inside: array<u32>;
@group(0) @binding(3) var<storage, read_write> outside: array<u32>;
@group(0) @binding(4) var<storage, read_write> tally: NodeTally;

var<private> is_changed: bool;

// Returns both states of 32 nodes.
fn states(at: u32) -> vec2<u32> {
    return vec2(inside[at], outside[at]);
}

fn change_to(at: u32, before: vec2<u32>, now: vec2<u32>) {
    if any(before != now) {
        inside[at] = now.x;
        outside[at] = now.y;
        is_changed = true;
    }
}

fn tell_change() {
    if is_changed {
        atomicOr(&tally.changed, 1u);
    }
}

// Spreads bits upwards through a word, to each that is joined to the one below, in steps that double (Kogge & Stone
// 1973).
fn spread_up(state: vec2<u32>, joined: u32) -> vec2<u32> {
    var spread = state;
    var way = vec2(joined);
    for (var reach = 1u; reach < WORD_BITS; reach *= 2u) {
        spread |= way & (spread << vec2(reach));
        way &= way << vec2(reach);
    }
    return spread;
}

// Spreads bits downwards; `joined` has a bit for each that is joined to the one above.
fn spread_down(state: vec2<u32>, joined: u32) -> vec2<u32> {
    var spread = state;
    var way = vec2(joined);
    for (var reach = 1u; reach < WORD_BITS; reach *= 2u) {
        spread |= way & (spread >> vec2(reach));
        way &= way >> vec2(reach);
    }
    return spread;
}

// Returns the nodes of a word of a row that are joined to the ones before them. Padding is separate from the last node.
fn joined_in_row(at: u32, word: u32) -> u32 {
    return ~(walls[at] | padding(word));
}

// Sweeps along x, through the bits of a row.
@compute @workgroup_size(WORKGROUP)
fn flood_rows(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
              @builtin(local_invocation_index) lane: u32) {
    let line = invocation_index(group, groups, lane);
    if line >= view.lines {
        return;
    }
    let first = line_start(line);
    var before = vec2(0u);
    for (var word = 0u; word < view.steps; word++) {
        let at = first + word;
        let joined = joined_in_row(at, word);
        let state = states(at);
        let now = spread_up(state | ((before >> vec2(WORD_BITS - 1u)) & vec2(joined)), joined);
        change_to(at, state, now);
        before = now;
    }
    // The state of the words after this one, and whether their first node is joined to the last of this word.
    var behind = vec2(0u);
    var joined_behind = 0u;
    for (var word = view.steps; word > 0u; word--) {
        let at = first + word - 1u;
        let joined = joined_in_row(at, word - 1u);
        let state = states(at);
        let joined_above = (joined >> 1u) | (joined_behind << (WORD_BITS - 1u));
        let top = (behind << vec2(WORD_BITS - 1u)) & vec2(joined_above);
        let now = spread_down(state | top, joined_above);
        change_to(at, state, now);
        behind = now;
        joined_behind = joined & 1u;
    }
    tell_change();
}

// Sweeps along y or z, word after word.
@compute @workgroup_size(WORKGROUP)
fn flood_lines(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
               @builtin(local_invocation_index) lane: u32) {
    let line = invocation_index(group, groups, lane);
    if line >= view.lines {
        return;
    }
    let first = line_start(line);
    var before = states(first);
    for (var step = 1u; step < view.steps; step++) {
        let at = first + step * view.stride;
        let state = states(at);
        let now = state | (before & vec2(~walls[at]));
        change_to(at, state, now);
        before = now;
    }
    for (var step = view.steps - 1u; step > 0u; step--) {
        let at = first + (step - 1u) * view.stride;
        let state = states(at);
        let now = state | (before & vec2(~walls[at + view.stride]));
        change_to(at, state, now);
        before = now;
    }
    tell_change();
}
