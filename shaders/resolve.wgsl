// Turns the sorted crossings of each ray into its samples, one invocation per ray; the twin of `exact.rs`, and of
// masks, classes and retrieval where those are not made. Samples replace the crossings that they come from, which are
// never fewer; `compact.wgsl` closes the gaps.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read_write> crossings: array<u32>;
@group(0) @binding(3) var<storage, read_write> crossed: array<u32>;
@group(0) @binding(4) var<storage, read_write> counts: array<u32>;
@group(0) @binding(5) var<storage, read_write> tally: Tally;

var<private> next_sample: u32;
var<private> counts_ray: bool;

fn emit(depth: i32) {
    crossings[next_sample] = bitcast<u32>(depth);
    next_sample++;
}

fn emit_crossing(at: u32) {
    if KEEPS_TRIANGLES {
        crossed[next_sample] = crossed[at];
    }
    emit(crossing_nearest(crossings[at]));
}

// Adds a group of crossings, those of one depth or of one voxel, to the windings: `position` is that depth or voxel.
// `parity` is that before the group.
fn add_group(first: u32, end: u32, position: i32, parity: u32) {
    if !counts_ray {
        return;
    }
    let is_odd = ((end - first) & 1u) == 1u;
    for (var at = first; at < end; at++) {
        add_winding(crossings[at], position, is_odd, parity == 0u);
    }
    changes += select(0u, 1u, is_odd);
}

fn resolve_exact(first: u32, end: u32) {
    var winding = 0;
    var at = first;
    while at < end {
        let depth = crossing_nearest(crossings[at]);
        var group_end = at;
        var step = 0;
        while group_end < end {
            let crossing = crossings[group_end];
            if crossing_nearest(crossing) != depth {
                break;
            }
            step += crossing_winding(crossing);
            group_end++;
        }
        add_group(at, group_end, depth, (at - first) & 1u);
        if !NON_ZERO {
            for (var each = at; each < group_end; each++) {
                emit_crossing(each);
            }
        } else if (winding != 0) != (winding + step != 0) {
            // The first with the direction of the sample.
            var along = at;
            while crossing_winding(crossings[along]) != sign(step) {
                along++;
            }
            emit_crossing(along);
        }
        winding += step;
        at = group_end;
    }
}

fn resolve_estimate(first: u32, end: u32) {
    var winding = 0;
    var at = first;
    while at < end {
        let index = crossing_voxel(crossings[at]);
        let voxel = take_voxel(at, end, index, winding);
        add_group(at, voxel.end, bitcast<i32>(index), (at - first) & 1u);
        let inside = winding != 0;
        let then_inside = voxel.winding != 0;
        if inside != then_inside {
            emit(select(voxel.greatest, voxel.least, then_inside == OVER));
        } else if voxel.touched && inside != OVER {
            emit(voxel.least);
            emit(voxel.greatest);
        }
        winding = voxel.winding;
        at = voxel.end;
    }
}

fn resolve_ray(ray: u32) {
    let first = starts[ray];
    let end = starts[ray + 1u];
    if !closes(first, end) {
        counts[ray] = UNCLOSED;
        tell_unclosed(ray);
        return;
    }
    next_sample = first;
    counts_ray = is_counted(ray);
    if EXACT {
        resolve_exact(first, end);
    } else {
        resolve_estimate(first, end);
    }
    counts[ray] = next_sample - first;
}

@compute @workgroup_size(WORKGROUP)
fn resolve(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
           @builtin(local_invocation_index) lane: u32) {
    let ray = invocation_index(group, groups, lane);
    if ray < view.rays {
        resolve_ray(ray);
    }
    add_to_tally(lane);
}
