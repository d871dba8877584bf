// The second half of a counting sort of crossings by ray, one invocation per crossing; `counts` of each ray decrease to zero.
// The order on a ray is arbitrary. Does nothing where not all crossings have found room.

@group(0) @binding(1) var<storage, read> found: FoundRead;
@group(0) @binding(2) var<storage, read> starts: array<u32>;
@group(0) @binding(3) var<storage, read_write> counts: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read> found_rays: array<u32>;
@group(0) @binding(5) var<storage, read> found_crossings: array<u32>;
@group(0) @binding(6) var<storage, read> found_triangles: array<u32>;
@group(0) @binding(7) var<storage, read_write> crossings: array<u32>;
@group(0) @binding(8) var<storage, read_write> crossed: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn place(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
         @builtin(local_invocation_index) lane: u32) {
    let index = invocation_index(group, groups, lane);
    if found.total > view.capacity || index >= found.total {
        return;
    }
    let list = found_rays[index];
    let at = starts[list] + atomicSub(&counts[list], 1u) - 1u;
    crossings[at] = found_crossings[index];
    if KEEPS_TRIANGLES {
        crossed[at] = found_triangles[index];
    }
}
