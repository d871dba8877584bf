// The ray of a crossing, of those that lie sorted by ray.

// The last that does not begin behind it.
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
