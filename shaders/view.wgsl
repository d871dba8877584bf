// Functions of the view that every shader of the sampler needs.

// Returns the lattice position of ray `index`.
fn ray_position(index: i32) -> i32 {
    return (index << view.shift) + view.first_ray;
}

// Returns whether a ray of the band is counted, or serves only for comparison.
fn is_counted(ray: u32) -> bool {
    return ray >= view.first_counted && ray < view.end_counted;
}

// Returns the upper word of a signed number.
fn sign_word(term: i32) -> u32 {
    return select(0u, 0xffffffffu, term < 0);
}
