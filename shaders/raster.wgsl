// A geometry pass over the rays of a band.

// Triangles whose box covers more rays are large.
const MOST_ALONE = SMALL_BOX;

fn seen_in_pass(triangle: u32) -> SeenTriangle {
    return see(triangle);
}

fn ray_at(row: i32, column: i32) -> u32 {
    return u32(row - view.first_row) * view.columns + u32(column - view.first_column);
}
