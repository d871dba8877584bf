// Exact integer coverage and depth; the twin of `src/fixed.rs`, which gives the reasons.
//
// f32 guesses, and integers decide. A guess of a first column is right to an eighth of a pixel, so that only the
// nearest ray is in doubt; a depth is computed by long division of 93 bits by 61 with quotient digits guessed to 20
// bits, each corrected by the next.

// Returns the first column in a row, given by its lattice position, of the edge from `low` up to `high`, which must
// cross it: the least column whose ray is not left of the edge.
fn first_column(low: vec3<i32>, high: vec3<i32>, row: i32) -> i32 {
    let run = high.x - low.x;
    let rise = high.y - low.y;
    let reach = f32(low.x - view.first_ray) + f32(row - low.y) * (f32(run) / f32(rise));
    let column = i32(round(reach * view.pixels_per_step));
    let side = wide_difference(wide_product(ray_position(column) - low.x, rise), wide_product(row - low.y, run));
    return column + select(0, 1, wide_sign(side) < 0);
}

// The plane of a triangle, its normal oriented so that its depth component is positive.
struct DepthPlane {
    vertex: vec3<i32>,
    by_column: Wide,
    by_row: Wide,
    by_depth: Wide,
    per_divisor: f32,
    tie_up: bool,
    leaves: u32,
    // The edges are so short that the whole computation fits 64 bits.
    is_small: bool,
}

// Edges shorter than this, in lattice steps, have normals below 2^41 and with a ray of the triangle products below
// 2^61.
const SMALL_EDGE = 1 << 20u;

fn minor(a: i32, b: i32, c: i32, d: i32) -> Wide {
    return wide_difference(wide_product(a, d), wide_product(b, c));
}

// Returns the plane of a triangle that is not edge-on.
fn depth_plane(a: vec3<i32>, b: vec3<i32>, c: vec3<i32>) -> DepthPlane {
    let u = b - a;
    let v = c - a;
    // With the two edges exchanged, the depth component changes sign.
    let depth_sign = wide_sign(minor(u.x, u.y, v.x, v.y));
    let first = select(v, u, depth_sign > 0);
    let second = select(u, v, depth_sign > 0);
    var plane: DepthPlane;
    plane.vertex = a;
    plane.by_column = minor(first.y, first.z, second.y, second.z);
    plane.by_row = minor(first.z, first.x, second.z, second.x);
    plane.by_depth = minor(first.x, first.y, second.x, second.y);
    // Along y the view's axes (x, z, y) are left-handed, so its normal points inwards.
    plane.leaves = select(0u, 1u, (depth_sign > 0) != (view.axis == AXIS_Y));
    plane.per_divisor = 1.0 / wide_to_f32(plane.by_depth);
    let reach = max(abs(u), abs(v));
    plane.is_small = max(max(reach.x, reach.y), reach.z) < SMALL_EDGE;
    plane.tie_up = tie_goes_up(-wide_sign(plane.by_column), -wide_sign(plane.by_row));
    return plane;
}

// Returns whether a depth that is exactly odd counts as above: the sign of the first of the three that is not zero, in
// the order of the axes.
fn tie_goes_up(by_column: i32, by_row: i32) -> bool {
    switch view.axis {
        case AXIS_X: {
            return false;
        }
        case AXIS_Y: {
            return by_column > 0;
        }
        default: {
            return by_column > 0 || (by_column == 0 && by_row > 0);
        }
    }
}

// Returns the crossing at a depth strictly between `below` and `below + 1`: the parity of `below` decides which even
// neighbour is nearer.
fn crossing_between(below: i32, leaves: u32) -> u32 {
    let depth = bitcast<u32>(below);
    return ((depth >> 1u) << 3u) | ((1u + (depth & 1u)) << 1u) | leaves;
}

// Returns the crossing with the ray at lattice position (column, row), which must pass through the triangle.
fn plane_crossing(plane: DepthPlane, column: i32, row: i32) -> u32 {
    let by_column = column - plane.vertex.x;
    let by_row = row - plane.vertex.y;
    var digits: i32;
    var left: Wide;
    if plane.is_small {
        left = wide_sum(wide_times(plane.by_column, by_column), wide_times(plane.by_row, by_row));
        left = wide_difference(Wide(), left);
        digits = i32(round(wide_to_f32(left) * plane.per_divisor));
        left = wide_difference(left, wide_times(plane.by_depth, digits));
        let second_digit = i32(round(wide_to_f32(left) * plane.per_divisor));
        left = wide_difference(left, wide_times(plane.by_depth, second_digit));
        digits += second_digit;
    } else {
        let across =
            long_sum(long_product(plane.by_column, by_column), long_product(plane.by_row, by_row));
        var long_left = long_difference(Long(), across);
        digits = i32(round(long_to_f32(long_left) * plane.per_divisor));
        long_left = long_difference(long_left, long_product(plane.by_depth, digits));
        let second_digit = i32(round(long_to_f32(long_left) * plane.per_divisor));
        long_left = long_difference(long_left, long_product(plane.by_depth, second_digit));
        digits += second_digit;
        left = wide_from_long(long_left);
    }
    // The remainder is less than the divisor in absolute value.
    let side = wide_sign(left);
    let depth = plane.vertex.z + digits;
    if side != 0 {
        return crossing_between(depth - select(0, 1, side < 0), plane.leaves);
    }
    let above = select(0u, 1u + select(0u, 1u, plane.tie_up), (depth & 1) != 0);
    return ((bitcast<u32>(depth) >> 1u) << 3u) | (above << 1u) | plane.leaves;
}

// Returns the voxel of a crossing: min(floor / V, LOD-C - 1).
fn crossing_voxel(crossing: u32) -> u32 {
    return min((crossing >> 3u) / view.half_voxel, view.last_voxel);
}
