// Computes the number of workgroups for the blocks of large triangles in the queue: arguments of an indirect dispatch.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> blocks: array<u32>;
@group(0) @binding(2) var<storage, read_write> planned: Planned;

@compute @workgroup_size(1)
fn plan() {
    let count = min(blocks[0], view.queue_capacity);
    planned.workgroups_x = min(count, MOST_WORKGROUPS);
    planned.workgroups_y = (count + MOST_WORKGROUPS - 1u) / MOST_WORKGROUPS;
    planned.workgroups_z = 1u;
    planned.left_out = max(planned.left_out, blocks[0] - count);
}
