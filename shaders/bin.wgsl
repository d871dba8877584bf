// A geometry pass over the tiles of a band: finds the tiles of which a triangle may cross a ray. Rows and columns are
// those of tiles, an item is a tile, and the triangle takes the place of a crossing.

// Triangles whose box covers more tiles are large.
const MOST_ALONE = SMALL_BOX_IN_TILES;

// Returns the box of a triangle in tiles; empty where it is empty in rays.
fn seen_in_pass(triangle: u32) -> SeenTriangle {
    var seen = see(triangle);
    if seen.first_row >= seen.end_row || seen.first_column >= seen.end_column {
        seen.end_row = seen.first_row;
        return seen;
    }
    let side = i32(TILE_SIDE);
    seen.first_row = (seen.first_row - view.first_row) / side;
    seen.end_row = (seen.end_row - view.first_row + side - 1) / side;
    seen.first_column = (seen.first_column - view.first_column) / side;
    seen.end_column = (seen.end_column - view.first_column + side - 1) / side;
    return seen;
}

// Covers the tiles of one row of which a triangle may cross a ray; of them, those that `lane` of `lanes` has to
// process.
//
// The columns of an edge's crossings are monotone from row to row, so that those of all rows of a tile lie between
// those of the first row and of the last, and of the two rows beside the middle corner.
fn cover_row(seen: SeenTriangle, tile_row: i32, lane: i32, lanes: i32) {
    let side = i32(TILE_SIDE);
    let top = view.first_row + tile_row * side;
    var row = max(top, max(index_from(seen.low.y), view.first_window_row));
    let last = min(top + side, min(index_from(seen.high.y), view.end_window_row)) - 1;
    let middle = index_from(seen.middle.y);
    var first = view.end_window_column;
    var end = view.first_window_column;
    while row <= last {
        let span = span_of_row(seen, row);
        first = min(first, span.x);
        end = max(end, span.y);
        let far = select(select(row, last, row >= middle), min(middle - 1, last), row < middle - 1);
        row = max(row + 1, far);
    }
    first = max(first, view.first_window_column);
    end = min(end, view.end_window_column);
    if first >= end {
        return;
    }
    let across = (view.columns + TILE_SIDE - 1u) / TILE_SIDE;
    let end_tile = (end - view.first_column + side - 1) / side;
    for (var column = (first - view.first_column) / side + lane; column < end_tile; column += lanes) {
        cross(u32(tile_row) * across + u32(column), seen.triangle, seen.triangle);
    }
}
