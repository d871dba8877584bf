// The index of an invocation among all; a part of all shaders.

// Returns the index of a workgroup of a dispatch in two dimensions.
fn workgroup_index(group: vec3<u32>, groups: vec3<u32>) -> u32 {
    return group.y * groups.x + group.x;
}

// Returns the index of an invocation of such a dispatch.
fn invocation_index(group: vec3<u32>, groups: vec3<u32>, lane: u32) -> u32 {
    return workgroup_index(group, groups) * WORKGROUP + lane;
}

// Returns the carry of adding a word to another, whose value was `before`.
fn carry(before: u32, term: u32) -> u32 {
    return select(0u, 1u, before + term < term);
}
