// Combines the images of leaves, one invocation per ray; the twin of `src/boolean/sweep.rs`. The leaves that
// a depth lies in are those whose samples before it are odd in number; the result changes where it differs between the leaves on
// either side of all samples of one depth.

// The images of the leaves follow one another, with gaps between the rays.
@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read> samples: array<i32>;
@group(0) @binding(3) var<storage, read> leaf_counts: array<u32>;
// Of few leaves a bit for each set of them, in the order of the sets as numbers: whether a point in these alone is in the result.
// Of many a decision diagram: the first node, then three numbers of each from node 2 on: its leaf, where to go outside it, and
// inside. Node 0 is outside the result, and node 1 inside.
@group(0) @binding(4) var<storage, read> results: array<u32>;
@group(0) @binding(5) var<storage, read_write> loose: array<i32>;
@group(0) @binding(6) var<storage, read_write> counts: array<u32>;
@group(0) @binding(7) var<storage, read_write> tallies: array<Tally>;

// Behind the depths of all samples.
const BEHIND_ALL = 0x7fffffff;

const LEAVES = select(FEW_LEAVES, MOST_LEAVES, MANY_LEAVES);
const LEAF_WORDS = (LEAVES + WORD_BITS - 1u) / WORD_BITS;

// The leaves with samples on the ray; the next sample of each, and the end of its samples.
var<private> met: array<u32, LEAVES>;
var<private> next: array<u32, LEAVES>;
var<private> end: array<u32, LEAVES>;

// The leaves that a depth lies in.
var<private> within: array<u32, LEAF_WORDS>;

// Returns whether the points in these leaves alone are in the result.
fn is_in_result() -> bool {
    if !MANY_LEAVES {
        return ((results[within[0] / WORD_BITS] >> (within[0] % WORD_BITS)) & 1u) == 1u;
    }
    var node = results[0];
    while node > 1u {
        let at = 3u * node - 5u;
        let leaf = results[at];
        node = results[at + 1u + ((within[leaf / WORD_BITS] >> (leaf % WORD_BITS)) & 1u)];
    }
    return node == 1u;
}

fn combine_ray(ray: u32, band: u32) {
    var leaves = 0u;
    var depth = BEHIND_ALL;
    for (var leaf = 0u; leaf < view.solids; leaf++) {
        let list = leaf * view.rays + ray;
        let count = leaf_counts[list];
        if count == UNCLOSED {
            counts[ray] = UNCLOSED;
            tell_unclosed(ray, band);
            return;
        }
        if count > 0u {
            met[leaves] = leaf;
            next[leaves] = starts[list];
            end[leaves] = starts[list] + count;
            depth = min(depth, samples[starts[list]]);
            leaves++;
        }
    }
    let first = first_loose(ray);
    var place = first;
    var holds = false;
    while depth != BEHIND_ALL {
        var following = BEHIND_ALL;
        for (var i = 0u; i < leaves; i++) {
            while next[i] < end[i] {
                let sample = samples[next[i]];
                if sample != depth {
                    following = min(following, sample);
                    break;
                }
                within[met[i] / WORD_BITS] ^= 1u << (met[i] % WORD_BITS);
                next[i]++;
            }
        }
        if is_in_result() != holds {
            loose[place] = depth;
            place++;
            holds = !holds;
        }
        depth = following;
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
