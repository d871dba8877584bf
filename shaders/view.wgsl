// What every shader needs of its view and of its place among the invocations; a part of all of them.

// The least index whose ray lies at or above an even lattice position. May be one past the last ray. The twin of
// `Pixels::index_from` in `src/fixed.rs`.
fn index_from(position: i32) -> i32 {
    return (position - view.first_ray + (1 << view.shift) - 1) >> view.shift;
}

// The lattice position of ray `index`.
fn ray_position(index: i32) -> i32 {
    return (index << view.shift) + view.first_ray;
}

// Whether a ray of the band counts, or is there to be compared with.
fn is_counted(ray: u32) -> bool {
    return ray >= view.first_counted && ray < view.end_counted;
}

// The number of a workgroup of a dispatch in two dimensions.
fn workgroup_index(group: vec3<u32>, groups: vec3<u32>) -> u32 {
    return group.y * groups.x + group.x;
}

// The number of an invocation of such a dispatch.
fn invocation_index(group: vec3<u32>, groups: vec3<u32>, lane: u32) -> u32 {
    return workgroup_index(group, groups) * WORKGROUP + lane;
}

// What adding a word to another carries: `before` is what the other was.
fn carry(before: u32, term: u32) -> u32 {
    return select(0u, 1u, before + term < term);
}

// The upper word of a number that has a sign.
fn sign_word(term: i32) -> u32 {
    return select(0u, 0xffffffffu, term < 0);
}
