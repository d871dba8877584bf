// Computes the offset of the kept crossings of each ray, one invocation per ray and one after the last.

@group(0) @binding(1) var<storage, read> starts: array<u32>;
// The place of the copies of each crossing, and after the last their end.
@group(0) @binding(2) var<storage, read> places: array<u32>;
@group(0) @binding(3) var<storage, read_write> offsets: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn offset_rays(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
               @builtin(local_invocation_index) lane: u32) {
    let ray = invocation_index(group, groups, lane);
    if ray <= view.rays {
        offsets[ray] = places[starts[ray]];
    }
}
