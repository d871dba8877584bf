// Combines the images of leaves, one invocation per ray; the twin of `src/boolean/sweep.rs`. The leaves that
// a depth lies in are those whose samples before it are odd in number; the result changes where it differs between the leaves on
// either side of all samples of one depth.

// The images of the leaves follow one another, with gaps between the rays.
@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> samples: array<i32>;
@group(0) @binding(3) var<storage, read> leaf_counts: array<u32>;
// The first node, then three numbers of each from node 2 on: its leaf, where to go outside it, and inside. Node 0 is outside the
// result, and node 1 inside.
@group(0) @binding(4) var<storage, read> diagram: array<u32>;
@group(0) @binding(5) var<storage, read_write> loose: array<i32>;
@group(0) @binding(6) var<storage, read_write> counts: array<u32>;
@group(0) @binding(7) var<storage, read_write> tallies: array<Tally>;

// Behind the depths of all samples.
const BEHIND_ALL = 0x7fffffff;

// The next sample of each leaf, and the end of its samples on the ray.
var<private> next: array<u32, MOST_LEAVES>;
var<private> end: array<u32, MOST_LEAVES>;

// The leaves that a depth lies in.
var<private> within: array<u32, MOST_LEAVES / WORD_BITS>;

// Returns whether the points in these leaves alone are in the result.
fn is_in_result() -> bool {
    var node = diagram[0];
    while node > 1u {
        let at = 3u * node - 5u;
        let leaf = diagram[at];
        node = diagram[at + 1u + ((within[leaf / WORD_BITS] >> (leaf % WORD_BITS)) & 1u)];
    }
    return node == 1u;
}

fn combine_ray(ray: u32, band: u32) {
    var has_samples = false;
    for (var leaf = 0u; leaf < view.solids; leaf++) {
        let list = leaf * view.rays + ray;
        let count = leaf_counts[list];
        if count == UNCLOSED {
            counts[ray] = UNCLOSED;
            tell_unclosed(ray, band);
            return;
        }
        next[leaf] = starts[list];
        end[leaf] = starts[list] + count;
        has_samples |= count > 0u;
    }
    if !has_samples {
        counts[ray] = 0u;
        return;
    }
    let first = first_loose(ray);
    var place = first;
    for (var word = 0u; word < MOST_LEAVES / WORD_BITS; word++) {
        within[word] = 0u;
    }
    var holds = false;
    loop {
        var depth = BEHIND_ALL;
        for (var leaf = 0u; leaf < view.solids; leaf++) {
            if next[leaf] < end[leaf] {
                depth = min(depth, samples[next[leaf]]);
            }
        }
        if depth == BEHIND_ALL {
            break;
        }
        for (var leaf = 0u; leaf < view.solids; leaf++) {
            while next[leaf] < end[leaf] {
                if samples[next[leaf]] != depth {
                    break;
                }
                within[leaf / WORD_BITS] ^= 1u << (leaf % WORD_BITS);
                next[leaf]++;
            }
        }
        let now = is_in_result();
        if now != holds {
            loose[place] = depth;
            place++;
            holds = now;
        }
    }
    counts[ray] = place - first;
}

@compute @workgroup_size(WORKGROUP)
fn combine(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
           @builtin(local_invocation_index) lane: u32) {
    let ray = invocation_index(group, groups, lane);
    if ray < view.rays {
        combine_ray(ray, band_of(ray));
    }
}
