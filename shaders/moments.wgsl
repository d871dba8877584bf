// Computes the sums of images from which moments follow, one invocation per ray; the twin of `src/integrate/moments.rs`. Samples may
// lie with gaps between the rays. Numbers have 128 bits, in four words from the lowest on.

@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> counts: array<u32>;
@group(0) @binding(3) var<storage, read> samples: array<u32>;
// For each band MOMENTS sums, then the number of samples at the depth of the one before on their ray.
@group(0) @binding(4) var<storage, read_write> totals: array<atomic<u32>>;

var<workgroup> group_sums: array<atomic<u32>, MOMENT_WORDS>;

fn plus(a: vec4<u32>, b: vec4<u32>) -> vec4<u32> {
    var sum = a + b;
    var carried = 0u;
    for (var word = 0u; word < 4u; word++) {
        let before = sum[word];
        sum[word] = before + carried;
        // At most one of the two additions overflows.
        carried = select(0u, 1u, before < b[word]) + carry(before, carried);
    }
    return sum;
}

fn times(a: vec4<u32>, b: u32) -> vec4<u32> {
    var product = vec4(0u);
    var carried = 0u;
    for (var word = 0u; word < 4u; word++) {
        let low = a[word] * b;
        product[word] = low + carried;
        carried = upper_product(a[word], b) + carry(low, carried);
    }
    return product;
}

fn of_word(word: u32) -> vec4<u32> {
    return vec4(word, 0u, 0u, 0u);
}

fn add(sum: u32, term: vec4<u32>) {
    var carried = 0u;
    for (var word = 0u; word < 4u; word++) {
        let value = term[word] + carried;
        carried = carry(term[word], carried);
        if value != 0u {
            carried += carry(atomicAdd(&group_sums[4u * sum + word], value), value);
        }
    }
}

fn add_to_totals(first: u32, term: vec4<u32>) {
    var carried = 0u;
    for (var word = 0u; word < 4u; word++) {
        let value = term[word] + carried;
        carried = carry(term[word], carried);
        if value != 0u {
            carried += carry(atomicAdd(&totals[first + word], value), value);
        }
    }
}

fn add_ray(ray: u32, band: u32, count: u32) {
    let first = first_loose(ray);
    var lengths = 0u;
    var squares = vec4(0u);
    var cubes = vec4(0u);
    var coincident = 0u;
    var before = 0xffffffffu;
    for (var at = first; at < first + count; at += 2u) {
        let near = samples[at];
        let far = samples[at + 1u];
        let length = far - near;
        let square = plus(plus(times(of_word(far), far), times(of_word(far), near)), times(of_word(near), near));
        lengths += length;
        squares = plus(squares, times(of_word(far + near), length));
        cubes = plus(cubes, times(square, length));
        coincident += select(0u, 1u, near == before) + select(0u, 1u, length == 0u);
        before = far;
    }
    let own = ray - view.bands[band].first_ray;
    let columns = view.bands[band].columns;
    let column = 2u * (own % columns) + 1u;
    let row = 2u * (bitcast<u32>(view.bands[band].first_row) + own / columns) + 1u;
    let of_columns = times(of_word(lengths), column);
    let of_rows = times(of_word(lengths), row);
    add(0u, of_word(lengths));
    add(1u, of_columns);
    add(2u, of_rows);
    add(3u, squares);
    add(4u, times(of_columns, column));
    add(5u, times(of_rows, row));
    add(6u, cubes);
    add(7u, times(of_columns, row));
    add(8u, times(squares, column));
    add(9u, times(squares, row));
    atomicAdd(&group_sums[4u * MOMENTS], coincident);
}

@compute @workgroup_size(WORKGROUP)
fn sum_moments(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
               @builtin(local_invocation_index) lane: u32) {
    if lane < MOMENT_WORDS {
        atomicStore(&group_sums[lane], 0u);
    }
    workgroupBarrier();
    let ray = invocation_index(group, groups, lane);
    let band = band_of(ray);
    if is_ray(ray, band) && is_counted(ray, band) {
        let count = counts[ray];
        if count != 0u && count != UNCLOSED {
            add_ray(ray, band, count);
        }
    }
    workgroupBarrier();
    let of_band = band * MOMENT_WORDS;
    if lane < MOMENTS {
        var sum = vec4(0u);
        for (var word = 0u; word < 4u; word++) {
            sum[word] = atomicLoad(&group_sums[4u * lane + word]);
        }
        add_to_totals(of_band + 4u * lane, sum);
    }
    if lane == MOMENTS {
        let coincident = atomicLoad(&group_sums[4u * MOMENTS]);
        if coincident != 0u {
            atomicAdd(&totals[of_band + 4u * MOMENTS], coincident);
        }
    }
}
