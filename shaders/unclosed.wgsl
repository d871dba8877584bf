// Counts an unclosed ray.
fn tell_unclosed(ray: u32, band: u32) {
    if is_counted(ray, band) {
        atomicAdd(&tallies[view.bands[band].tally].unclosed, 1u);
    }
}
