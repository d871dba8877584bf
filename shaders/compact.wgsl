// Closes the gaps between the samples of the rays, one invocation per ray.

@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> loose: array<u32>;
@group(0) @binding(3) var<storage, read> offsets: array<u32>;
@group(0) @binding(4) var<storage, read_write> samples: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn compact(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
           @builtin(local_invocation_index) lane: u32) {
    let ray = invocation_index(group, groups, lane);
    if ray >= view.rays {
        return;
    }
    var source = first_loose(ray);
    for (var to = offsets[ray]; to < offsets[ray + 1u]; to++) {
        samples[to] = loose[source];
        source++;
    }
}
