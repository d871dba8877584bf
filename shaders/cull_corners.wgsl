// Finds the facets of one solid and corners of the other that can carry the boundary of a sum; one invocation per pair.
// The twin of `facets_on_corners` in `src/minkowski/cull/mod.rs`.

@group(0) @binding(0) var<uniform> view: PairView;
@group(0) @binding(1) var<storage, read> facets: array<u32>;
// The offset of the spokes of each corner, and their end.
@group(0) @binding(2) var<storage, read> corners: array<u32>;
@group(0) @binding(3) var<storage, read> spokes: array<u32>;
@group(0) @binding(4) var<storage, read_write> kept: array<vec2<u32>>;
@group(0) @binding(5) var<storage, read_write> kept_count: array<atomic<u32>>;

fn normal_of(facet: u32) -> Normal {
    let at = facet * NORMAL_WORDS;
    var normal: Normal;
    normal.x = wide_from_words(facets[at], facets[at + 1u]);
    normal.y = wide_from_words(facets[at + 2u], facets[at + 3u]);
    normal.z = wide_from_words(facets[at + 4u], facets[at + 5u]);
    normal.rounded = bitcast<vec3<f32>>(vec3(facets[at + 6u], facets[at + 7u], facets[at + 8u]));
    normal.size = bitcast<f32>(facets[at + 9u]);
    return normal;
}

fn direction_of(spoke: u32) -> Direction {
    let at = spoke * DIRECTION_WORDS;
    var along: Direction;
    along.exact = bitcast<vec3<i32>>(vec3(spokes[at], spokes[at + 1u], spokes[at + 2u]));
    along.rounded = bitcast<vec3<f32>>(vec3(spokes[at + 3u], spokes[at + 4u], spokes[at + 5u]));
    along.size = bitcast<f32>(spokes[at + 6u]);
    return along;
}

@compute @workgroup_size(WORKGROUP)
fn cull_corners(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
                @builtin(local_invocation_index) lane: u32) {
    let pair = invocation_index(group, groups, lane);
    if pair >= view.pairs {
        return;
    }
    let facet = view.first + pair / view.others;
    let corner = pair % view.others;
    let normal = normal_of(facet);
    let end = corners[2u * corner + 1u];
    for (var spoke = corners[2u * corner]; spoke < end; spoke++) {
        if sign_along(normal, direction_of(spoke)) > 0 {
            return;
        }
    }
    keep_pair(facet, corner);
}
