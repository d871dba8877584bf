// Stores the kept crossings contiguously, each as often as it is kept; one invocation per crossing.

@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> places: array<u32>;
@group(0) @binding(3) var<storage, read> crossings: array<u32>;
@group(0) @binding(4) var<storage, read> crossed: array<u32>;
@group(0) @binding(5) var<storage, read_write> kept: array<u32>;
@group(0) @binding(6) var<storage, read_write> kept_crossed: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn keep(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
        @builtin(local_invocation_index) lane: u32) {
    let index = invocation_index(group, groups, lane);
    if index >= starts[view.rays] {
        return;
    }
    let end = min(places[index + 1u], view.capacity);
    for (var to = places[index]; to < end; to++) {
        kept[to] = crossings[index];
        if KEEPS_TRIANGLES {
            kept_crossed[to] = crossed[index];
        }
    }
}
