// Exact integer coverage and depth; the twin of `src/fixed.rs`, which gives the reasons.
//
// f32 guesses, and integers decide. A guess of a first column is right to an eighth of a pixel, so that only the nearest ray is
// in doubt.

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

fn minor(a: i32, b: i32, c: i32, d: i32) -> Wide {
    return wide_difference(wide_product(a, d), wide_product(b, c));
}

// Returns whether a depth that is exactly odd counts as above: the sign of the first of the three that is not zero, in
// the order of the axes.
fn tie_goes_up(by_column: i32, by_row: i32, axis: u32) -> bool {
    switch axis {
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

// Returns the crossing of a triangle, which is not edge-on, with the ray at lattice position (column, row), which must pass
// through it.
//
// The depth is that of the first corner minus the quotient of two numbers of up to 93 and 61 bits. Slopes in f32 guess it; the
// error of the guess times the divisor, left over by the guess, is small although its terms are not, so that arithmetic modulo
// 2^64 finds it, and its quotient in f32 is the correction. Where the guess may be too far off (`is_hard` in
// `src/sampler/gpu/solid.rs`), long division by digits of 20 bits takes its place.
fn crossing_of(a: vec3<i32>, b: vec3<i32>, c: vec3<i32>, axis: u32, column: i32, row: i32) -> u32 {
    let u = b - a;
    let v = c - a;
    // With the two edges exchanged, the depth component changes sign.
    let is_turned = wide_sign(minor(u.x, u.y, v.x, v.y)) < 0;
    let first = select(u, v, is_turned);
    let second = select(v, u, is_turned);
    let by_column = minor(first.y, first.z, second.y, second.z);
    let by_row = minor(first.z, first.x, second.z, second.x);
    let by_depth = minor(first.x, first.y, second.x, second.y);
    // Along y the view's axes (x, z, y) are left-handed, so its normal points inwards.
    let leaves = select(0u, 1u, is_turned == (axis == AXIS_Y));

    let per_divisor = 1.0 / wide_to_f32(by_depth);
    let to_column = column - a.x;
    let to_row = row - a.y;
    var digits: i32;
    var left: Wide;
    if HARD {
        let across = long_sum(long_product(by_column, to_column), long_product(by_row, to_row));
        var long_left = long_difference(Long(), across);
        digits = i32(round(long_to_f32(long_left) * per_divisor));
        long_left = long_difference(long_left, long_product(by_depth, digits));
        let second_digit = i32(round(long_to_f32(long_left) * per_divisor));
        long_left = long_difference(long_left, long_product(by_depth, second_digit));
        digits += second_digit;
        left = wide_from_long(long_left);
    } else {
        let slope = vec2(wide_to_f32(by_column), wide_to_f32(by_row)) * -per_divisor;
        digits = i32(round(slope.x * f32(to_column) + slope.y * f32(to_row)));
        let across = wide_sum(wide_times(by_column, to_column), wide_times(by_row, to_row));
        left = wide_difference(Wide(), wide_sum(across, wide_times(by_depth, digits)));
    }
    let correction = i32(round(wide_to_f32(left) * per_divisor));
    left = wide_difference(left, wide_times(by_depth, correction));
    // The remainder is less than the divisor in absolute value.
    let side = wide_sign(left);
    let depth = a.z + digits + correction;
    if side != 0 {
        return crossing_between(depth - select(0, 1, side < 0), leaves);
    }
    let tie_up = tie_goes_up(-wide_sign(by_column), -wide_sign(by_row), axis);
    let above = select(0u, 1u + select(0u, 1u, tie_up), (depth & 1) != 0);
    return ((bitcast<u32>(depth) >> 1u) << 3u) | (above << 1u) | leaves;
}

// Returns the voxel of a crossing: min(floor / V, LOD-C - 1). The quotient is below 2^16, so that the guess is off by one at most.
fn crossing_voxel(crossing: u32, band: u32) -> u32 {
    let half_floor = crossing >> 3u;
    let half_voxel = view.bands[band].half_voxel;
    var voxel = u32(f32(half_floor) * view.bands[band].per_half_voxel);
    let rest = bitcast<i32>(half_floor - voxel * half_voxel);
    voxel += select(0u, 1u, rest >= bitcast<i32>(half_voxel));
    voxel -= select(0u, 1u, rest < 0);
    return min(voxel, view.last_voxel);
}
