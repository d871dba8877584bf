// Sets the seeds of the flood: `hull` becomes its complement, the nodes that are certainly outside. Padding is outside.
// One invocation per word.

@group(0) @binding(0) var<uniform> view: NodeView;
@group(0) @binding(1) var<storage, read_write> inside: array<u32>;
@group(0) @binding(2) var<storage, read_write> hull: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn seeds(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
         @builtin(local_invocation_index) lane: u32) {
    let at = invocation_index(group, groups, lane);
    if at < view.all_words {
        let none = padding(at % view.words);
        inside[at] &= ~none;
        hull[at] = ~hull[at] | none;
    }
}
