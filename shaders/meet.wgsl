// Computes the estimate of the intersection of two solids from the sorted crossings of each, one invocation per ray:
// the same result as masks, classes and retrieval of two solids.

// The lists of the second solid follow those of the first.
@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> crossings: array<u32>;
@group(0) @binding(3) var<storage, read_write> loose: array<u32>;
@group(0) @binding(4) var<storage, read_write> counts: array<u32>;
@group(0) @binding(5) var<storage, read_write> tallies: array<Tally>;

// Returns the least and the greatest depth of the crossings, in a voxel, of each solid that is touched there.
fn span_of(a: Voxel, b: Voxel) -> vec2<i32> {
    if !a.touched {
        return vec2(b.least, b.greatest);
    }
    if !b.touched {
        return vec2(a.least, a.greatest);
    }
    return vec2(min(a.least, b.least), max(a.greatest, b.greatest));
}

fn voxel_at(at: u32, end: u32, band: u32) -> u32 {
    if at == end {
        return 0xffffffffu;
    }
    return crossing_voxel(crossings[at], band);
}

fn meet_ray(ray: u32, band: u32) {
    var a = Voxel(starts[ray], 0, false, 0, 0);
    var b = Voxel(starts[view.rays + ray], 0, false, 0, 0);
    let end_a = starts[ray + 1u];
    let end_b = starts[view.rays + ray + 1u];
    if !closes(a.end, end_a) || !closes(b.end, end_b) {
        counts[ray] = UNCLOSED;
        tell_unclosed(ray, band);
        return;
    }
    let first_sample = first_loose(ray);
    var samples = first_sample;
    while a.end < end_a || b.end < end_b {
        let voxel = min(voxel_at(a.end, end_a, band), voxel_at(b.end, end_b, band));
        let near_a = a.winding != 0;
        let near_b = b.winding != 0;
        a = take_voxel(a.end, end_a, band, voxel, a.winding);
        b = take_voxel(b.end, end_b, band, voxel, b.winding);
        let far_a = a.winding != 0;
        let far_b = b.winding != 0;
        let near = near_a && near_b;
        let far = far_a && far_b;
        let span = span_of(a, b);
        let both_occupied = (near_a || far_a || a.touched) && (near_b || far_b || b.touched);
        if near != far {
            loose[samples] = bitcast<u32>(select(span.y, span.x, far == OVER));
            samples++;
        } else if near != OVER && select(a.touched || b.touched, both_occupied, OVER) {
            loose[samples] = bitcast<u32>(span.x);
            loose[samples + 1u] = bitcast<u32>(span.y);
            samples += 2u;
        }
    }
    counts[ray] = samples - first_sample;
}

@compute @workgroup_size(WORKGROUP)
fn meet(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
        @builtin(local_invocation_index) lane: u32) {
    let ray = invocation_index(group, groups, lane);
    if ray < view.rays {
        meet_ray(ray, band_of(ray));
    }
}
