// Triangles as they are seen along an axis, and the columns that they cover in a row.

// Returns a position by column, row and depth.
fn seen_along(axis: u32, position: vec3<i32>) -> vec3<i32> {
    return select(select(position, position.xzy, axis == AXIS_Y), position.yzx, axis == AXIS_X);
}

// A triangle seen along an axis, its corners sorted by row.
struct SeenTriangle {
    low: vec3<i32>,
    middle: vec3<i32>,
    high: vec3<i32>,
}

fn sorted_by_row(a: vec3<i32>, b: vec3<i32>, c: vec3<i32>) -> SeenTriangle {
    let ab_low = select(b, a, a.y <= b.y);
    let ab_high = select(a, b, a.y <= b.y);
    let below_both = c.y < ab_low.y;
    let above_both = c.y >= ab_high.y;
    let low = select(ab_low, c, below_both);
    let high = select(ab_high, c, above_both);
    let middle = select(select(c, ab_low, below_both), ab_high, above_both);
    return SeenTriangle(low, middle, high);
}

// Returns the rows of a band that a triangle may cover, from the first to the one after the last.
fn rows_in(band: u32, a: vec3<i32>, b: vec3<i32>, c: vec3<i32>) -> vec2<i32> {
    let least = min(min(a.xy, b.xy), c.xy);
    let greatest = max(max(a.xy, b.xy), c.xy);
    let first_column = max(index_from(least.x), view.bands[band].first_window_column);
    let end_column = min(index_from(greatest.x), view.bands[band].end_window_column);
    let first_row = max(index_from(least.y), view.bands[band].first_window_row);
    let end_row = min(index_from(greatest.y), view.bands[band].end_window_row);
    return vec2(first_row, select(first_row, end_row, first_column < end_column));
}

// Returns the columns of a band that a triangle covers in a row which it crosses, from the first to the one after the last.
fn columns_in(band: u32, seen: SeenTriangle, row: i32) -> vec2<i32> {
    let position = ray_position(row);
    let along_long = first_column(seen.low, seen.high, position);
    // From the row of the middle corner on, the second short edge bounds the triangle.
    let is_below = row < index_from(seen.middle.y);
    let start = select(seen.middle, seen.low, is_below);
    let stop = select(seen.high, seen.middle, is_below);
    let along_short = first_column(start, stop, position);
    let first = max(min(along_long, along_short), view.bands[band].first_window_column);
    let end = min(max(along_long, along_short), view.bands[band].end_window_column);
    return vec2(first, max(first, end));
}

// Returns the number of the ray of a row that would be in column 0.
fn ray_of_row(band: u32, row: i32) -> u32 {
    let before = u32(row - view.bands[band].first_row) * view.bands[band].columns;
    return view.bands[band].first_ray + before - u32(view.bands[band].first_column);
}
