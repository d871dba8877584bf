// Triangles in view coordinates. The items that they cover, rays or tiles, are defined by the files after this one.

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> positions: array<i32>;
@group(0) @binding(2) var<storage, read> triangles: array<u32>;

// A triangle in view coordinates, its corners sorted by row.
struct SeenTriangle {
    triangle: u32,
    low: vec3<i32>,
    middle: vec3<i32>,
    high: vec3<i32>,
    // The rows and columns of its box that lie in the window.
    first_row: i32,
    end_row: i32,
    first_column: i32,
    end_column: i32,
}

fn corner(triangle: u32, i: u32) -> vec3<i32> {
    let at = 3u * triangles[3u * triangle + i];
    return vec3(positions[at + view.column_axis], positions[at + view.row_axis], positions[at + view.axis]);
}

fn see(triangle: u32) -> SeenTriangle {
    let a = corner(triangle, 0u);
    let b = corner(triangle, 1u);
    let c = corner(triangle, 2u);
    var seen: SeenTriangle;
    seen.triangle = triangle;
    let ab_low = select(b, a, a.y <= b.y);
    let ab_high = select(a, b, a.y <= b.y);
    let below_both = c.y < ab_low.y;
    let above_both = c.y >= ab_high.y;
    seen.low = select(ab_low, c, below_both);
    seen.high = select(ab_high, c, above_both);
    seen.middle = select(select(c, ab_low, below_both), ab_high, above_both);
    let least = min(min(a.x, b.x), c.x);
    let greatest = max(max(a.x, b.x), c.x);
    seen.first_row = max(index_from(seen.low.y), view.first_window_row);
    seen.end_row = min(index_from(seen.high.y), view.end_window_row);
    seen.first_column = max(index_from(least), view.first_window_column);
    seen.end_column = min(index_from(greatest), view.end_window_column);
    return seen;
}

// Returns the first column of a triangle in one row, and the one after its last; not yet clipped to the window.
fn span_of_row(seen: SeenTriangle, row: i32) -> vec2<i32> {
    let position = ray_position(row);
    let along_long = first_column(seen.low, seen.high, position);
    // From the row of the middle corner on, the second short edge bounds the triangle.
    let is_below = row < index_from(seen.middle.y);
    let start = select(seen.middle, seen.low, is_below);
    let stop = select(seen.high, seen.middle, is_below);
    let along_short = first_column(start, stop, position);
    return vec2(min(along_long, along_short), max(along_long, along_short));
}
