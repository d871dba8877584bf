// Counts a ray that did not close.
fn tell_unclosed(ray: u32) {
    if is_counted(ray) {
        atomicAdd(&tally.unclosed, 1u);
    }
}
