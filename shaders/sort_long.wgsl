// Sorts lists of many crossings, one workgroup per list: runs by insertion, which are then merged in pairs, back and forth
// between two buffers. In a merge, each crossing finds its place by counting those of the other run that precede it.

@group(0) @binding(4) var<storage, read_write> spare: array<u32>;
@group(0) @binding(5) var<storage, read_write> spare_crossed: array<u32>;
@group(0) @binding(6) var<storage, read> long_lists: array<u32>;
@group(0) @binding(7) var<storage, read> found: FoundRead;

// Number of crossings that one invocation sorts by insertion.
const RUN = 16u;

fn crossing_at(at: u32, in_spare: bool) -> u32 {
    if in_spare {
        return spare[at];
    }
    return crossings[at];
}

fn triangle_at(at: u32, in_spare: bool) -> u32 {
    if !KEEPS_TRIANGLES {
        return 0u;
    }
    if in_spare {
        return spare_crossed[at];
    }
    return crossed[at];
}

fn store(at: u32, in_spare: bool, crossing: u32, triangle: u32) {
    if in_spare {
        spare[at] = crossing;
    } else {
        crossings[at] = crossing;
    }
    if KEEPS_TRIANGLES {
        if in_spare {
            spare_crossed[at] = triangle;
        } else {
            crossed[at] = triangle;
        }
    }
}

// Returns how many of the sorted crossings from `first` to `end` precede another; equal ones, which are identical in all words,
// precede it if their run is the first.
fn preceding(first: u32, end: u32, in_spare: bool, crossing: u32, triangle: u32, equal_precede: bool) -> u32 {
    var least = first;
    var most = end;
    while least < most {
        let middle = (least + most) / 2u;
        let other = crossing_at(middle, in_spare);
        var precedes = other < crossing;
        if other == crossing {
            let other_triangle = triangle_at(middle, in_spare);
            precedes = other_triangle < triangle || (other_triangle == triangle && equal_precede);
        }
        if precedes {
            least = middle + 1u;
        } else {
            most = middle;
        }
    }
    return least - first;
}

fn sort_runs(first: u32, count: u32, lane: u32) {
    for (var run = RUN * lane; run < count; run += RUN * LONG_WORKGROUP) {
        insertion_sort(first + run, first + min(run + RUN, count));
    }
    storageBarrier();
    var in_spare = false;
    for (var run = RUN; run < count; run *= 2u) {
        for (var each = lane; each < count; each += LONG_WORKGROUP) {
            let own = each / run;
            let other = min((own ^ 1u) * run, count);
            let other_end = min(other + run, count);
            let crossing = crossing_at(first + each, in_spare);
            let triangle = triangle_at(first + each, in_spare);
            let is_second = (own & 1u) == 1u;
            let before = preceding(first + other, first + other_end, in_spare, crossing, triangle, is_second);
            let place = (own & 0xfffffffeu) * run + (each - own * run) + before;
            store(first + place, !in_spare, crossing, triangle);
        }
        storageBarrier();
        in_spare = !in_spare;
    }
    if in_spare {
        for (var each = lane; each < count; each += LONG_WORKGROUP) {
            store(first + each, false, spare[first + each], triangle_at(first + each, true));
        }
    }
    storageBarrier();
}

@compute @workgroup_size(LONG_WORKGROUP)
fn sort_long(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    for (var each = group.x; each < found.long_lists; each += MOST_GROUPS) {
        let list = long_lists[each];
        let first = starts[list];
        sort_runs(first, starts[list + 1u] - first, lane);
    }
}
