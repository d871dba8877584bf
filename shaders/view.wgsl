// The input of a job: a raster, and bands of rays of it along one axis or more. Rays are numbered through all bands; those of each
// begin with a multiple of WORKGROUP, so that the invocations of a workgroup have rays of one band.

@group(0) @binding(0) var<uniform> view: View;

// Returns the lattice position of ray `index` of a row or column.
fn ray_position(index: i32) -> i32 {
    return (index << view.shift) + view.first_ray;
}

// Returns the band of a ray.
fn band_of(ray: u32) -> u32 {
    return select(0u, 1u, ray >= view.bands[1].first_ray) + select(0u, 1u, ray >= view.bands[2].first_ray);
}

// Returns whether there is a ray of this number: not behind the last one of its band.
fn is_ray(ray: u32, band: u32) -> bool {
    return ray < view.rays && ray - view.bands[band].first_ray < view.bands[band].rays;
}

// Returns whether a ray of the band is counted, or serves only for comparison.
fn is_counted(ray: u32, band: u32) -> bool {
    return ray >= view.bands[band].first_counted && ray < view.bands[band].end_counted;
}

// Returns the upper word of a signed number.
fn sign_word(term: i32) -> u32 {
    return select(0u, 0xffffffffu, term < 0);
}
