// The geometry pass: finds the rays that each triangle crosses, in all bands of a job. Before it comes a stage that defines
// `begin`, which every invocation of a workgroup calls with the number of its crossings, in uniform control flow; `cross`, which
// takes each of those by its number; and `finish`, which every invocation calls at the end.
//
// An invocation takes a triangle that covers few rays, or a row of a larger one: the host has listed the rows of those in blocks.
// It counts before it computes depths, so that a workgroup makes room for all of its crossings at once.

@group(0) @binding(1) var<storage, read> positions: array<i32>;
// The corners; the top bit of corner i is set where a triangle is covered by its rows along axis i.
@group(0) @binding(2) var<storage, read> triangles: array<u32>;
// A triangle, and the axis and the first row of the block: row · 4 + axis.
@group(0) @binding(3) var<storage, read> blocks: array<vec2<u32>>;

fn corner(triangle: u32, i: u32) -> vec3<i32> {
    let at = 3u * (triangles[3u * triangle + i] & 0x7fffffffu);
    return vec3(positions[at], positions[at + 1u], positions[at + 2u]);
}

// Takes the crossings of a triangle, seen along the axis of a band, in the columns that it covers in a row; `first` is the number
// of the first of them.
fn take_row(first: u32, band: u32, a: vec3<i32>, b: vec3<i32>, c: vec3<i32>, row: i32, covered: vec2<i32>, triangle: u32) {
    let row_ray = ray_of_row(band, row);
    for (var column = covered.x; column < covered.y; column++) {
        var crossing = 0u;
        if NEEDS_DEPTH {
            crossing = crossing_of(a, b, c, view.bands[band].axis, ray_position(column), ray_position(row));
        }
        let place = first + u32(column - covered.x);
        cross(place, row_ray + u32(column), band, crossing, view.first_triangle + triangle);
    }
}

// Covers triangles by themselves, one invocation for each.
@compute @workgroup_size(WORKGROUP)
fn cover_triangles(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
                   @builtin(local_invocation_index) lane: u32) {
    let triangle = invocation_index(group, groups, lane);
    var x: vec3<i32>;
    var y: vec3<i32>;
    var z: vec3<i32>;
    var band_count = 0u;
    var count = 0u;
    if triangle < view.triangles {
        x = corner(triangle, 0u);
        y = corner(triangle, 1u);
        z = corner(triangle, 2u);
        band_count = view.band_count;
    }
    for (var band = 0u; band < band_count; band++) {
        let axis = view.bands[band].axis;
        if (triangles[3u * triangle + axis] >> 31u) == 0u {
            let a = seen_along(axis, x);
            let b = seen_along(axis, y);
            let c = seen_along(axis, z);
            let seen = sorted_by_row(a, b, c);
            let rows = rows_in(band, a, b, c);
            for (var row = rows.x; row < rows.y; row++) {
                let covered = columns_in(band, seen, row);
                count += u32(covered.y - covered.x);
            }
        }
    }
    var place = begin(lane, count);
    if count == 0u {
        band_count = 0u;
    }
    for (var band = 0u; band < band_count; band++) {
        let axis = view.bands[band].axis;
        if (triangles[3u * triangle + axis] >> 31u) == 0u {
            let a = seen_along(axis, x);
            let b = seen_along(axis, y);
            let c = seen_along(axis, z);
            let seen = sorted_by_row(a, b, c);
            let rows = rows_in(band, a, b, c);
            for (var row = rows.x; row < rows.y; row++) {
                let covered = columns_in(band, seen, row);
                take_row(place, band, a, b, c, row, covered, triangle);
                place += u32(covered.y - covered.x);
            }
        }
    }
    finish(lane);
}

// Covers rows of triangles, one invocation for each.
@compute @workgroup_size(WORKGROUP)
fn cover_rows(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
              @builtin(local_invocation_index) lane: u32) {
    let index = invocation_index(group, groups, lane);
    var block = vec2(0u);
    var band = 0u;
    var row = 0;
    var a: vec3<i32>;
    var b: vec3<i32>;
    var c: vec3<i32>;
    var covered = vec2(0);
    if index / BLOCK_ROWS < view.blocks {
        block = blocks[index / BLOCK_ROWS];
        // A triangle may begin before the first row.
        row = (bitcast<i32>(block.y) >> 2u) + i32(index % BLOCK_ROWS);
        let axis = block.y & 3u;
        a = seen_along(axis, corner(block.x, 0u));
        b = seen_along(axis, corner(block.x, 1u));
        c = seen_along(axis, corner(block.x, 2u));
        for (var each = 0u; each < view.band_count; each++) {
            if view.bands[each].axis == axis {
                let rows = rows_in(each, a, b, c);
                if row >= rows.x && row < rows.y {
                    band = each;
                    covered = columns_in(each, sorted_by_row(a, b, c), row);
                }
            }
        }
    }
    let place = begin(lane, u32(covered.y - covered.x));
    take_row(place, band, a, b, c, row, covered, block.x);
    finish(lane);
}
