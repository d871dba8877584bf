// The geometry pass: which rays a triangle crosses. A stage that makes such a pass defines `cross`, which is called once for
// every crossing, and `finish`, which is called once by every invocation of a workgroup, in uniform control flow.
//
// A thread a triangle serves the small ones. A large one is cut into blocks of BLOCK_ROWS rows that go to a queue, from which
// a second dispatch takes them, a workgroup a block. Where the queue has no room the block is left out; `plan.wgsl` tells the
// host, which makes smaller bands.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> positions: array<i32>;
@group(0) @binding(2) var<storage, read> triangles: array<u32>;
@group(0) @binding(3) var<storage, read_write> queue: Queue;

struct Queue {
    blocks: atomic<u32>,
    unused: u32,
    items: array<Block>,
}

// Rows of a triangle, from `first_row` on.
struct Block {
    triangle: u32,
    first_row: i32,
}

// A triangle as the view sees it, its corners by row.
struct SeenTriangle {
    triangle: u32,
    low: vec3<i32>,
    middle: vec3<i32>,
    high: vec3<i32>,
    // The rows and columns of its box that lie in the window.
    first_row: i32,
    end_row: i32,
    first_column: i32,
    end_column: i32,
}

// The plane of the triangle that this invocation is busy with; most triangles lie between the rays and never need it.
var<private> seen_plane: DepthPlane;
var<private> has_plane: bool;

fn corner(triangle: u32, i: u32) -> vec3<i32> {
    let at = 3u * triangles[3u * triangle + i];
    return vec3(positions[at + view.column_axis], positions[at + view.row_axis], positions[at + view.axis]);
}

fn see(triangle: u32) -> SeenTriangle {
    let a = corner(triangle, 0u);
    let b = corner(triangle, 1u);
    let c = corner(triangle, 2u);
    var seen: SeenTriangle;
    seen.triangle = triangle;
    let ab_low = select(b, a, a.y <= b.y);
    let ab_high = select(a, b, a.y <= b.y);
    let below_both = c.y < ab_low.y;
    let above_both = c.y >= ab_high.y;
    seen.low = select(ab_low, c, below_both);
    seen.high = select(ab_high, c, above_both);
    seen.middle = select(select(c, ab_low, below_both), ab_high, above_both);
    let least = min(min(a.x, b.x), c.x);
    let greatest = max(max(a.x, b.x), c.x);
    seen.first_row = max(index_from(seen.low.y), view.first_window_row);
    seen.end_row = min(index_from(seen.high.y), view.end_window_row);
    seen.first_column = max(index_from(least), view.first_window_column);
    seen.end_column = min(index_from(greatest), view.end_window_column);
    has_plane = false;
    return seen;
}

// The crossings of a triangle in one row; of the columns, those that `lane` of `lanes` has to do.
fn cover_row(seen: SeenTriangle, row: i32, lane: i32, lanes: i32) {
    let position = ray_position(row);
    let along_long = first_column(seen.low, seen.high, position);
    // From the row of the middle corner on, the second short edge bounds the triangle.
    let is_below = row < index_from(seen.middle.y);
    let start = select(seen.middle, seen.low, is_below);
    let stop = select(seen.high, seen.middle, is_below);
    let along_short = first_column(start, stop, position);
    let first = max(min(along_long, along_short), view.first_window_column);
    let end = min(max(along_long, along_short), view.end_window_column);
    for (var column = first + lane; column < end; column += lanes) {
        if NEEDS_DEPTH && !has_plane {
            let triangle = seen.triangle;
            seen_plane = depth_plane(corner(triangle, 0u), corner(triangle, 1u), corner(triangle, 2u));
            has_plane = true;
        }
        let ray = u32(row - view.first_row) * view.columns + u32(column - view.first_column);
        var crossing = 0u;
        if NEEDS_DEPTH {
            crossing = plane_crossing(seen_plane, ray_position(column), position);
        }
        cross(ray, crossing, view.first_triangle + seen.triangle);
    }
}

fn cover_small(triangle: u32) {
    let seen = see(triangle);
    let rows = seen.end_row - seen.first_row;
    let columns = seen.end_column - seen.first_column;
    if rows <= 0 || columns <= 0 {
        return;
    }
    // Sides are at most 2^16 rays, so that the product of two may need 32 bits.
    if u32(rows) * u32(columns) <= SMALL_BOX {
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

// One invocation a triangle.
@compute @workgroup_size(WORKGROUP)
fn cover_triangles(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
                   @builtin(local_invocation_index) lane: u32) {
    let triangle = (group.y * groups.x + group.x) * WORKGROUP + lane;
    if triangle < view.triangles {
        cover_small(triangle);
    }
    finish(lane);
}

// One workgroup a block; as many lanes a row.
@compute @workgroup_size(WORKGROUP)
fn cover_blocks(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
                @builtin(local_invocation_index) lane: u32) {
    let index = group.y * groups.x + group.x;
    if index < min(atomicLoad(&queue.blocks), view.queue_capacity) {
        let block = queue.items[index];
        let seen = see(block.triangle);
        let row = block.first_row + i32(lane) / BLOCK_LANES;
        if row < seen.end_row {
            cover_row(seen, row, i32(lane) % BLOCK_LANES, BLOCK_LANES);
        }
    }
    finish(lane);
}
