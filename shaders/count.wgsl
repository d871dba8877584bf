// The first half of a counting sort of crossings by ray; the second is `scatter.wgsl`. Together they are the twin of
// `raster.rs`.

@group(0) @binding(4) var<storage, read_write> counts: array<atomic<u32>>;

const NEEDS_DEPTH = false;

fn cross(ray: u32, crossing: u32, triangle: u32) {
    atomicAdd(&counts[ray], 1u);
}

fn finish(lane: u32) {
}
