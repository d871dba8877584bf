// The crossings of all rays, in the order in which they are found: the first half of a counting sort by ray. The second is
// `place.wgsl`. Together they are the twin of `raster.rs`.

@group(0) @binding(4) var<storage, read_write> counts: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> found: Found;
@group(0) @binding(6) var<storage, read_write> found_rays: array<u32>;
@group(0) @binding(7) var<storage, read_write> found_crossings: array<u32>;
@group(0) @binding(8) var<storage, read_write> found_triangles: array<u32>;

const NEEDS_DEPTH = true;

var<workgroup> group_count: atomic<u32>;
var<workgroup> group_place: u32;

// Makes room for the crossings of a workgroup, and returns the place of the first of this invocation.
fn begin(lane: u32, count: u32) -> u32 {
    if lane == 0u {
        atomicStore(&group_count, 0u);
    }
    workgroupBarrier();
    var at = 0u;
    if count > 0u {
        at = atomicAdd(&group_count, count);
    }
    workgroupBarrier();
    if lane == 0u {
        group_place = atomicAdd(&found.next, atomicLoad(&group_count));
    }
    workgroupBarrier();
    return group_place + at;
}

// Counts a crossing, and stores it where there is room.
fn cross(place: u32, ray: u32, band: u32, crossing: u32, triangle: u32) {
    let list = view.first_list + ray;
    atomicAdd(&counts[list], 1u);
    if place < view.capacity {
        found_rays[place] = list;
        found_crossings[place] = crossing;
        if KEEPS_TRIANGLES {
            found_triangles[place] = triangle;
        }
    }
}

fn finish(lane: u32) {
}
