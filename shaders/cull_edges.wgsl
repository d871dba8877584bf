// Finds the edges of two solids that can carry the boundary of a sum; one invocation per pair. The twin of
// `edges_on_edges` in `src/minkowski/cull/mod.rs`.

@group(0) @binding(0) var<uniform> view: PairView;
// For each edge: its direction, the offset of its sides, the offset of those of facets that run backwards, and their
// end. The second offset is beyond the end where the facing of its facets is unknown.
@group(0) @binding(1) var<storage, read> edges: array<u32>;
@group(0) @binding(2) var<storage, read> sides: array<u32>;
@group(0) @binding(3) var<storage, read> edges_b: array<u32>;
@group(0) @binding(4) var<storage, read> sides_b: array<u32>;
@group(0) @binding(5) var<storage, read_write> kept: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> kept_count: array<atomic<u32>>;

// Facets of an edge lie on both sides of a plane.
const BOTH_SIDES = 2;

struct Edge {
    along: Direction,
    first_side: u32,
    turn: u32,
    end_side: u32,
}

// Returns a word of an edge, of either solid.
fn edge_word(of_b: bool, at: u32) -> u32 {
    if of_b {
        return edges_b[at];
    }
    return edges[at];
}

fn side_word(of_b: bool, at: u32) -> u32 {
    if of_b {
        return sides_b[at];
    }
    return sides[at];
}

fn edge_of(of_b: bool, index: u32) -> Edge {
    let at = index * (DIRECTION_WORDS + 3u);
    let exact = vec3(edge_word(of_b, at), edge_word(of_b, at + 1u), edge_word(of_b, at + 2u));
    let rounded = vec3(edge_word(of_b, at + 3u), edge_word(of_b, at + 4u), edge_word(of_b, at + 5u));
    var edge: Edge;
    edge.along.exact = bitcast<vec3<i32>>(exact);
    edge.along.rounded = bitcast<vec3<f32>>(rounded);
    edge.along.size = bitcast<f32>(edge_word(of_b, at + 6u));
    edge.first_side = edge_word(of_b, at + DIRECTION_WORDS);
    edge.turn = edge_word(of_b, at + DIRECTION_WORDS + 1u);
    edge.end_side = edge_word(of_b, at + DIRECTION_WORDS + 2u);
    return edge;
}

fn side_part(of_b: bool, at: u32) -> Wide {
    return wide_from_words(side_word(of_b, at), side_word(of_b, at + 1u));
}

fn side_of(of_b: bool, index: u32) -> Normal {
    let at = index * NORMAL_WORDS;
    let rounded = vec3(side_word(of_b, at + 6u), side_word(of_b, at + 7u), side_word(of_b, at + 8u));
    var side: Normal;
    side.x = side_part(of_b, at);
    side.y = side_part(of_b, at + 2u);
    side.z = side_part(of_b, at + 4u);
    side.rounded = bitcast<vec3<f32>>(rounded);
    side.size = bitcast<f32>(side_word(of_b, at + 9u));
    return side;
}

// Returns the side of the plane through an edge and another direction on which its facets lie: -1, 0 (in it), 1, or
// BOTH_SIDES.
fn heights(of_b: bool, edge: Edge, other: Direction) -> i32 {
    var all = 0;
    for (var side = edge.first_side; side < edge.end_side; side++) {
        let height = sign_along(side_of(of_b, side), other);
        if height != 0 {
            if all != 0 && all != height {
                return BOTH_SIDES;
            }
            all = height;
        }
    }
    return all;
}

fn minor(a: i32, b: i32, c: i32, d: i32) -> i32 {
    return wide_sign(wide_difference(wide_product(a, d), wide_product(b, c)));
}

// Returns whether a facet at an edge, all of which are parallel to the plane of both edges, faces outwards. For
// parallel vectors any nonzero component decides: that of `part`, in which the outward normal has the given sign.
fn has_facet_towards(of_b: bool, edge: Edge, part: u32, outward: i32) -> bool {
    // The facing of the facets is unknown, or there are none.
    if edge.turn > edge.end_side {
        return true;
    }
    for (var side = edge.first_side; side < edge.end_side; side++) {
        // The sides of facets that run forward are the opposites of their normals.
        let facing = wide_sign(side_part(of_b, side * NORMAL_WORDS + 2u * part)) * select(1, -1, side < edge.turn);
        if facing == outward {
            return true;
        }
    }
    return false;
}

@compute @workgroup_size(WORKGROUP)
fn cull_edges(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
              @builtin(local_invocation_index) lane: u32) {
    let pair = invocation_index(group, groups, lane);
    if pair >= view.pairs {
        return;
    }
    let index_a = view.first + pair / view.others;
    let index_b = pair % view.others;
    let edge_a = edge_of(false, index_a);
    let edge_b = edge_of(true, index_b);
    let in_a = heights(false, edge_a, edge_b.along);
    if in_a == BOTH_SIDES {
        return;
    }
    // With the edges exchanged the normal is the opposite one.
    let in_b = -heights(true, edge_b, edge_a.along);
    if in_b == -BOTH_SIDES || in_a * in_b < 0 {
        return;
    }
    let u = edge_a.along.exact;
    let v = edge_b.along.exact;
    let normal = vec3(minor(u.y, u.z, v.y, v.z), minor(u.z, u.x, v.z, v.x), minor(u.x, u.y, v.x, v.y));
    if all(normal == vec3(0)) {
        return;
    }
    var part = 0u;
    while normal[part] == 0 {
        part++;
    }
    for (var turned = 0u; turned < 2u; turned++) {
        let below = select(-1, 1, turned == 1u);
        let outward = -below * normal[part];
        let supports_a = in_a == below || (in_a == 0 && has_facet_towards(false, edge_a, part, outward));
        let supports_b = in_b == below || (in_b == 0 && has_facet_towards(true, edge_b, part, outward));
        if supports_a && supports_b {
            keep_pair(index_a, 2u * index_b + turned);
        }
    }
}
