// 64- and 96-bit integers on devices with native 64-bit integers; `wide_pair.wgsl` is the same without.

// A signed 64-bit integer.
alias Wide = i64;

// A signed 96-bit integer, high · 2^32 + low.
struct Long {
    high: i64,
    low: u32,
}

fn wide_product(a: i32, b: i32) -> Wide {
    return i64(a) * i64(b);
}

fn wide_sum(a: Wide, b: Wide) -> Wide {
    return a + b;
}

fn wide_difference(a: Wide, b: Wide) -> Wide {
    return a - b;
}

// Returns -1, 0 or 1.
fn wide_sign(a: Wide) -> i32 {
    return select(select(0, 1, a > 0li), -1, a < 0li);
}

// Returns a product modulo 2^64.
fn wide_times(a: Wide, b: i32) -> Wide {
    return a * i64(b);
}

// Converts to f32, to about 22 bits.
fn wide_to_f32(a: Wide) -> f32 {
    return f32(a);
}

// Returns the product of an integer below 2^61 and one below 2^31 in absolute value.
fn long_product(a: Wide, b: i32) -> Long {
    let low = (a & 0xffffffffli) * i64(b);
    return Long((a >> 32u) * i64(b) + (low >> 32u), u32(low & 0xffffffffli));
}

fn long_sum(a: Long, b: Long) -> Long {
    let low = a.low + b.low;
    return Long(a.high + b.high + select(0li, 1li, low < a.low), low);
}

fn long_difference(a: Long, b: Long) -> Long {
    return Long(a.high - b.high - select(0li, 1li, a.low < b.low), a.low - b.low);
}

// Converts to f32, to about 22 bits, by way of the absolute value: the words of a small negative number nearly cancel.
fn long_to_f32(a: Long) -> f32 {
    let negative = a.high < 0li;
    var absolute = a;
    if negative {
        absolute = long_difference(Long(), a);
    }
    let value = f32(absolute.high) * 4294967296.0 + f32(absolute.low);
    return select(value, -value, negative);
}

// Returns the lower 64 bits: the number itself where it fits.
fn wide_from_long(a: Long) -> Wide {
    // By way of u64: for u32 straight to i64, naga 30 emits a sign extension in SPIR-V.
    return (a.high << 32u) | i64(u64(a.low));
}
