// How many workgroups take the blocks of large triangles from the queue: arguments of an indirect dispatch.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> blocks: array<u32>;
@group(0) @binding(2) var<storage, read_write> workgroups: array<u32>;

@compute @workgroup_size(1)
fn plan() {
    let count = min(blocks[0], view.queue_capacity);
    let across = min(count, MOST_WORKGROUPS);
    workgroups[0] = across;
    workgroups[1] = (count + MOST_WORKGROUPS - 1u) / MOST_WORKGROUPS;
    workgroups[2] = 1u;
}
