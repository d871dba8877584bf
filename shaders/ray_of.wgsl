// The ray of a crossing in lists that are sorted by ray.

// Returns the last ray that does not begin after the crossing.
fn ray_of(crossing: u32) -> u32 {
    var least = 0u;
    var most = view.rays - 1u;
    while least < most {
        let middle = (least + most + 1u) / 2u;
        if starts[middle] <= crossing {
            least = middle;
        } else {
            most = middle - 1u;
        }
    }
    return least;
}
