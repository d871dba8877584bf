// Fills samples with the value that every depth replaces, by the parity of its rank. All rays have even counts, so that
// the parity of a sample's rank is that of its place.

@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read_write> samples: array<i32>;

@compute @workgroup_size(WORKGROUP)
fn identities(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
              @builtin(local_invocation_index) lane: u32) {
    let at = invocation_index(group, groups, lane);
    if at < starts[view.rays] {
        samples[at] = identity(at);
    }
}
