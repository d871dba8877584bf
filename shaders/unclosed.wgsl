// Counts an unclosed ray.
fn tell_unclosed(ray: u32) {
    if is_counted(ray) {
        atomicAdd(&tally.unclosed, 1u);
    }
}
