// Finds the rays that a triangle crosses, row by row. The files after this one define the index of a ray (`ray_at`) and
// take the crossings (`cross`), with or without their depths (NEEDS_DEPTH).

// The plane of the triangle that this invocation is processing; most triangles lie between the rays and never need it.
var<private> seen_plane: DepthPlane;
var<private> plane_triangle: u32 = 0xffffffffu;

// Finds the crossings of a triangle in one row; of the columns, those that `lane` of `lanes` has to process.
fn cover_row(seen: SeenTriangle, row: i32, lane: i32, lanes: i32) {
    let span = span_of_row(seen, row);
    let end = min(span.y, seen.end_column);
    for (var column = max(span.x, seen.first_column) + lane; column < end; column += lanes) {
        if NEEDS_DEPTH && plane_triangle != seen.triangle {
            plane_triangle = seen.triangle;
            seen_plane = depth_plane(corner(plane_triangle, 0u), corner(plane_triangle, 1u), corner(plane_triangle, 2u));
        }
        var crossing = 0u;
        if NEEDS_DEPTH {
            crossing = plane_crossing(seen_plane, ray_position(column), ray_position(row));
        }
        cross(ray_at(row, column), crossing, view.first_triangle + seen.triangle);
    }
}
