// Operations whose times are measured: dispatches that do nothing, atomic additions, and products of 64-bit integers.

@group(0) @binding(0) var<uniform> view: CostView;
@group(0) @binding(1) var<storage, read_write> words: array<atomic<u32>>;

// Each addition goes to a word without relation to the one before; where `view.last_word` is zero, all go to one word.
@compute @workgroup_size(WORKGROUP)
fn add(@builtin(global_invocation_id) id: vec3<u32>) {
    var at = id.x * 747796405u + 2891336453u;
    for (var round = 0u; round < view.rounds; round++) {
        // The low bits of such a generator have short periods.
        atomicAdd(&words[(at >> 7u) & view.last_word], 1u);
        at = at * 1664525u + 1013904223u;
    }
}

// Each product needs the one before.
@compute @workgroup_size(WORKGROUP)
fn multiply(@builtin(global_invocation_id) id: vec3<u32>) {
    var product = wide_product(bitcast<i32>(id.x) + 3, 0x12345677);
    for (var round = 0u; round < view.rounds; round++) {
        product = wide_times(product, 0x2545f491);
    }
    if wide_sign(product) == 0 {
        atomicAdd(&words[0], 1u);
    }
}
