// The second half of a counting sort of crossings by ray: `counts` of each ray decrease to zero. The order on a ray is
// that of arrival; `sort.wgsl` sorts it.

@group(0) @binding(4) var<storage, read_write> counts: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read> starts: array<u32>;
@group(0) @binding(6) var<storage, read_write> crossings: array<u32>;
@group(0) @binding(7) var<storage, read_write> crossed: array<u32>;

const NEEDS_DEPTH = true;

fn cross(ray: u32, crossing: u32, triangle: u32) {
    let at = view.first_crossing + starts[ray] + atomicSub(&counts[ray], 1u) - 1u;
    crossings[at] = crossing;
    if KEEPS_TRIANGLES {
        crossed[at] = triangle;
    }
}

fn finish(lane: u32) {
}
