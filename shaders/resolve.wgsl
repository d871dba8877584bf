// Sorts the crossings of each ray with one solid, and turns them into its samples, one invocation per ray; the twin of `exact.rs`, and of
// masks, classes and retrieval where those are not made. Samples replace the crossings that they come from, which are never
// fewer; `compact.wgsl` closes the gaps.

@group(0) @binding(4) var<storage, read_write> counts: array<u32>;
@group(0) @binding(5) var<storage, read_write> tallies: array<Tally>;

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

// Adds a group of crossings at one depth to the windings; `sum` is that of their windings, `parity` that before the group.
fn add_depth(count: u32, sum: i32, depth: i32, parity: u32) {
    if (count & 1u) == 1u {
        aligned += select(-sum, sum, parity == 0u);
        changes++;
        return;
    }
    for (var each = abs(sum); each > 0; each--) {
        unpaired = wide_term(unpaired, -sign(sum) * depth);
    }
}

// Every crossing is a sample.
fn resolve_even_odd(first: u32, end: u32) {
    var group = first;
    var depth = 0;
    var sum = 0;
    for (var at = first; at < end; at++) {
        let crossing = crossings[at];
        let nearest = crossing_nearest(crossing);
        let winding = crossing_winding(crossing);
        if nearest != depth {
            add_depth(at - group, sum, depth, (group - first) & 1u);
            group = at;
            sum = 0;
        }
        depth = nearest;
        sum += winding;
        wound = wide_term(wound, -winding * nearest);
        crossings[at] = bitcast<u32>(nearest);
    }
    add_depth(end - group, sum, depth, (group - first) & 1u);
}

fn resolve_non_zero(first: u32, end: u32) {
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
        if (winding != 0) != (winding + step != 0) {
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

fn resolve_estimate(first: u32, end: u32, band: u32) {
    var winding = 0;
    var at = first;
    while at < end {
        let index = crossing_voxel(crossings[at], band);
        let voxel = take_voxel(at, end, band, index, winding);
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

fn resolve_ray(ray: u32, band: u32) {
    let list = view.first_list + ray;
    let first = starts[list];
    let end = starts[list + 1u];
    sort_list(first, end);
    if !closes(first, end) {
        counts[list] = UNCLOSED;
        tell_unclosed(ray, band);
        return;
    }
    if EXACT && !NON_ZERO {
        resolve_even_odd(first, end);
        counts[list] = end - first;
        if !is_counted(ray, band) {
            wound = vec2(0u);
            unpaired = vec2(0u);
            aligned = 0;
            changes = 0u;
        }
        return;
    }
    next_sample = first;
    counts_ray = is_counted(ray, band);
    if EXACT {
        resolve_non_zero(first, end);
    } else {
        resolve_estimate(first, end, band);
    }
    counts[list] = next_sample - first;
}

@compute @workgroup_size(WORKGROUP)
fn resolve(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
           @builtin(local_invocation_index) lane: u32) {
    let first_of_group = workgroup_index(group, groups) * WORKGROUP;
    let ray = first_of_group + lane;
    if first_of_group >= view.rays {
        return;
    }
    // Most rays of a scaffold's image miss it.
    let first_list = view.first_list + first_of_group;
    if starts[first_list] == starts[first_list + WORKGROUP] {
        counts[view.first_list + ray] = 0u;
        return;
    }
    clear_tally(lane);
    let band = band_of(first_of_group);
    resolve_ray(ray, band);
    add_to_tally(lane, band);
}
