// The geometry pass: finds the items of a raster, rays or tiles, that a triangle covers. After it come `raster.wgsl` or
// `bin.wgsl`, which define the items, and a stage that defines `cross`, which is called once for every covered item,
// and `finish`, which is called once by every invocation of a workgroup, in uniform control flow.
//
// One thread processes a small triangle. A large one is divided into blocks of BLOCK_ROWS rows that go to a queue, from
// which a second dispatch takes them, one workgroup per block. Where the queue has no room the block is left out;
// `plan.wgsl` reports that to the host, which makes smaller bands.

@group(0) @binding(3) var<storage, read_write> queue: Queue;

struct Queue {
    blocks: atomic<u32>,
    unused: u32,
    items: array<Block>,
}

// A block of rows of a triangle, starting with `first_row`.
struct Block {
    triangle: u32,
    first_row: i32,
}

fn cover_small(triangle: u32) {
    let seen = seen_in_pass(triangle);
    let rows = seen.end_row - seen.first_row;
    let columns = seen.end_column - seen.first_column;
    if rows <= 0 || columns <= 0 {
        return;
    }
    // Sides are at most 2^16 rays, so that the product of two may need 32 bits.
    if u32(rows) * u32(columns) <= MOST_ALONE {
        for (var row = seen.first_row; row < seen.end_row; row++) {
            cover_row(seen, row, 0, 1);
        }
        return;
    }
    let blocks = u32(rows + BLOCK_ROWS - 1) / u32(BLOCK_ROWS);
    let at = atomicAdd(&queue.blocks, blocks);
    let room = view.queue_capacity - min(at, view.queue_capacity);
    for (var block = 0u; block < min(blocks, room); block++) {
        queue.items[at + block] = Block(triangle, seen.first_row + i32(block) * BLOCK_ROWS);
    }
}

// Covers small triangles and queues large ones, one invocation per triangle.
@compute @workgroup_size(WORKGROUP)
fn cover_triangles(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
                   @builtin(local_invocation_index) lane: u32) {
    let triangle = invocation_index(group, groups, lane);
    if triangle < view.triangles {
        cover_small(triangle);
    }
    finish(lane);
}

// Covers queued blocks, one workgroup per block; the lanes are divided equally among its rows.
@compute @workgroup_size(WORKGROUP)
fn cover_blocks(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
                @builtin(local_invocation_index) lane: u32) {
    let index = workgroup_index(group, groups);
    if index < min(atomicLoad(&queue.blocks), view.queue_capacity) {
        let block = queue.items[index];
        let seen = seen_in_pass(block.triangle);
        let row = block.first_row + i32(lane) / BLOCK_LANES;
        if row < seen.end_row {
            cover_row(seen, row, i32(lane) % BLOCK_LANES, BLOCK_LANES);
        }
    }
    finish(lane);
}
