// Marks, for the ends of spans along one axis, the nodes where the state along the ray changes, the first and last
// crossing of each ray, and the neighbouring nodes between which there is any crossing. One invocation per crossing.

@group(0) @binding(0) var<uniform> view: NodeView;
@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> crossings: array<u32>;
@group(0) @binding(3) var<storage, read_write> changes: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read_write> ends: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> walls: array<atomic<u32>>;

// Returns the word and the bit of a node from its position on its ray and the column and row of the ray.
fn place_of(node: u32, column: u32, row: u32) -> vec2<u32> {
    switch view.axis {
        case AXIS_X: {
            return vec2((row * view.nodes_y + column) * view.words + node / WORD_BITS, node % WORD_BITS);
        }
        case AXIS_Y: {
            return vec2((row * view.nodes_y + node) * view.words + column / WORD_BITS, column % WORD_BITS);
        }
        default: {
            return vec2((node * view.nodes_y + row) * view.words + column / WORD_BITS, column % WORD_BITS);
        }
    }
}

@compute @workgroup_size(WORKGROUP)
fn cast_spans(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
              @builtin(local_invocation_index) lane: u32) {
    let index = invocation_index(group, groups, lane);
    if index >= starts[view.rays] {
        return;
    }
    let ray = ray_of(index);
    let node = bitcast<u32>(index_from(crossing_nearest(crossings[index])));
    // Behind the last node there is none to mark.
    if node >= view.ray_nodes {
        return;
    }
    let place = place_of(node, ray % view.columns, ray / view.columns);
    let bit = 1u << place.y;
    atomicXor(&changes[place.x], bit);
    atomicOr(&walls[place.x], bit);
    if index == starts[ray] {
        atomicXor(&ends[place.x], bit);
    }
    if index + 1u == starts[ray + 1u] {
        atomicXor(&ends[place.x], bit);
    }
}
