// Exact signs of the dot products of normals and directions. f32 decides most: three products of numbers that were
// rounded once, rounded once more themselves and in two sums, have an error of less than 15.1 units of 2^-24, relative
// to the largest components.

const GUESS_ERROR = 1.0 / f32(1 << 20u);

// The cross product of two differences of positions: components below 2^61 in absolute value, the same in f32, and the
// largest of these.
struct Normal {
    x: Wide,
    y: Wide,
    z: Wide,
    rounded: vec3<f32>,
    size: f32,
}

// A difference of positions: components below 2^30 in absolute value.
struct Direction {
    exact: vec3<i32>,
    rounded: vec3<f32>,
    size: f32,
}

// Returns the sign of their dot product: -1, 0 or 1.
fn sign_along(normal: Normal, along: Direction) -> i32 {
    let guess = dot(normal.rounded, along.rounded);
    let slack = GUESS_ERROR * normal.size * along.size;
    if guess > slack {
        return 1;
    }
    if guess < -slack {
        return -1;
    }
    let x = long_product(normal.x, along.exact.x);
    let y = long_product(normal.y, along.exact.y);
    return long_sign(long_sum(long_sum(x, y), long_product(normal.z, along.exact.z)));
}

// Keeps a pair, if there is room; the host detects from the count whether there was.
fn keep_pair(first: u32, second: u32) {
    let at = atomicAdd(&kept_count[0], 1u);
    if at < view.capacity {
        kept[at] = vec2(first, second);
    }
}
