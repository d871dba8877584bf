// Sorts the short lists, one invocation per list, for stages that take them sorted.

@compute @workgroup_size(WORKGROUP)
fn sort_short(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
              @builtin(local_invocation_index) lane: u32) {
    let list = invocation_index(group, groups, lane);
    if list >= view.lists {
        return;
    }
    sort_list(starts[list], starts[list + 1u]);
}
