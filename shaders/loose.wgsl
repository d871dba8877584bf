// Samples in the places of the crossings that they come from, with gaps between the rays.

// Returns the place of the first sample of a ray. Those of several solids have room for the crossings of all.
fn first_loose(ray: u32) -> u32 {
    var place = starts[ray];
    for (var list = view.rays; list < view.solids * view.rays; list += view.rays) {
        place += starts[list + ray] - starts[list];
    }
    return place;
}
