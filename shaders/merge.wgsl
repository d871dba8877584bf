// Sorts rays of many crossings: each dispatch merges sorted runs of `view.run` crossings in pairs, one invocation per
// crossing, which finds its place by counting those of the other run that precede it. All crossings move to the other
// buffer, those of short rays in the same order.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> crossings: array<u32>;
@group(0) @binding(3) var<storage, read> crossed: array<u32>;
@group(0) @binding(4) var<storage, read_write> merged: array<u32>;
@group(0) @binding(5) var<storage, read_write> merged_crossed: array<u32>;

// Returns whether the crossing at `a` precedes that at `b`; of equal ones, which are identical in all words, the first
// does.
fn comes_before(a: u32, b: u32, a_is_first: bool) -> bool {
    if crossings[a] != crossings[b] {
        return crossings[a] < crossings[b];
    }
    if KEEPS_TRIANGLES {
        if crossed[a] != crossed[b] {
            return crossed[a] < crossed[b];
        }
    }
    return a_is_first;
}

@compute @workgroup_size(WORKGROUP)
fn merge(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
         @builtin(local_invocation_index) lane: u32) {
    let index = invocation_index(group, groups, lane);
    if index >= starts[view.rays] {
        return;
    }
    let ray = ray_of(index);
    let first = starts[ray];
    let count = starts[ray + 1u] - first;
    let own = view.first_crossing + index;
    var place = own;
    if count > SORTED_ALONE {
        let run = (index - first) / view.run;
        let is_first = (run & 1u) == 0u;
        let other = min((run ^ 1u) * view.run, count);
        let other_first = view.first_crossing + first + other;
        var least = 0u;
        var most = min(view.run, count - other);
        // Counts those of the other run that precede this one.
        while least < most {
            let middle = (least + most) / 2u;
            if comes_before(other_first + middle, own, !is_first) {
                least = middle + 1u;
            } else {
                most = middle;
            }
        }
        let pair = (run & 0xfffffffeu) * view.run;
        place = view.first_crossing + first + pair + (index - first - run * view.run) + least;
    }
    merged[place] = crossings[own];
    if KEEPS_TRIANGLES {
        merged_crossed[place] = crossed[own];
    }
}
