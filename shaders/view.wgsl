// What every shader of the sampler needs of its view.

// The lattice position of ray `index`.
fn ray_position(index: i32) -> i32 {
    return (index << view.shift) + view.first_ray;
}

// Whether a ray of the band counts, or is there to be compared with.
fn is_counted(ray: u32) -> bool {
    return ray >= view.first_counted && ray < view.end_counted;
}

// The upper word of a number that has a sign.
fn sign_word(term: i32) -> u32 {
    return select(0u, 0xffffffffu, term < 0);
}
