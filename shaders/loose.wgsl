// Samples in the places of the crossings that they come from, with gaps between the rays.

// Returns the place of the first sample of a ray. Those of two solids have room for the crossings of both.
fn first_loose(ray: u32) -> u32 {
    if TWO_LISTS {
        return starts[ray] + starts[view.rays + ray] - starts[view.rays];
    }
    return starts[ray];
}
