// 64- and 96-bit integers in 32-bit words, for devices without 64-bit integers; `wide_native.wgsl` is the same with
// them.

// A signed 64-bit integer, high · 2^32 + low.
struct Wide {
    low: u32,
    high: i32,
}

// A signed 96-bit integer, high · 2^64 + middle · 2^32 + low.
struct Long {
    low: u32,
    middle: u32,
    high: i32,
}

fn wide_product(a: i32, b: i32) -> Wide {
    let ua = bitcast<u32>(a);
    let ub = bitcast<u32>(b);
    // A negative factor counts as itself plus 2^32.
    let extra = select(0u, ub, a < 0) + select(0u, ua, b < 0);
    return Wide(ua * ub, bitcast<i32>(upper_product(ua, ub) - extra));
}

fn wide_sum(a: Wide, b: Wide) -> Wide {
    let low = a.low + b.low;
    return Wide(low, a.high + b.high + select(0, 1, low < a.low));
}

fn wide_difference(a: Wide, b: Wide) -> Wide {
    return Wide(a.low - b.low, a.high - b.high - select(0, 1, a.low < b.low));
}

// Returns -1, 0 or 1.
fn wide_sign(a: Wide) -> i32 {
    return select(select(0, 1, a.high > 0 || a.low > 0u), -1, a.high < 0);
}

// Returns a product modulo 2^64.
fn wide_times(a: Wide, b: i32) -> Wide {
    let product = wide_product(bitcast<i32>(a.low), b);
    // The low word counts as signed there; where its top bit is set, that is 2^32 times b too little.
    let extra = select(0, b, bitcast<i32>(a.low) < 0);
    return Wide(product.low, product.high + a.high * b + extra);
}

// Converts to f32, to about 22 bits, by way of the absolute value: the words of a small negative number nearly cancel.
fn wide_to_f32(a: Wide) -> f32 {
    let negative = a.high < 0;
    var absolute = a;
    if negative {
        absolute = wide_difference(Wide(), a);
    }
    let value = f32(absolute.high) * 4294967296.0 + f32(absolute.low);
    return select(value, -value, negative);
}

// Returns the product of an integer below 2^61 and one below 2^31 in absolute value.
fn long_product(a: Wide, b: i32) -> Long {
    let ub = bitcast<u32>(b);
    let low = a.low * ub;
    let upper = upper_product(a.low, ub);
    // The upper words of low · b and the product of high and b; a negative b counts as itself plus 2^32.
    let high = wide_product(a.high, b);
    let middle = upper + high.low;
    let carry = select(0, 1, middle < upper);
    let extra = select(0u, a.low, b < 0);
    let borrow = select(0, 1, middle < extra);
    return Long(low, middle - extra, high.high + carry - borrow);
}

fn long_sum(a: Long, b: Long) -> Long {
    let low = a.low + b.low;
    let carry = select(0u, 1u, low < a.low);
    let middle = a.middle + b.middle;
    let with_carry = middle + carry;
    let up = select(0, 1, middle < a.middle) + select(0, 1, with_carry < middle);
    return Long(low, with_carry, a.high + b.high + up);
}

fn long_difference(a: Long, b: Long) -> Long {
    let borrow = select(0u, 1u, a.low < b.low);
    let middle = a.middle - b.middle;
    let down = select(0, 1, a.middle < b.middle) + select(0, 1, middle < borrow);
    return Long(a.low - b.low, middle - borrow, a.high - b.high - down);
}

// Converts to f32, to about 22 bits, by way of the absolute value: the words of a small negative number nearly cancel.
fn long_to_f32(a: Long) -> f32 {
    let negative = a.high < 0;
    var absolute = a;
    if negative {
        absolute = long_difference(Long(), a);
    }
    let value = (f32(absolute.high) * 4294967296.0 + f32(absolute.middle)) * 4294967296.0 + f32(absolute.low);
    return select(value, -value, negative);
}

// Returns the lower 64 bits: the number itself where it fits.
fn wide_from_long(a: Long) -> Wide {
    return Wide(a.low, bitcast<i32>(a.middle));
}
