// Classification: turns masks into classes and ranks, one invocation per ray; the twin of `classify.rs`. The classes
// replace the masks: `change` then holds the voxels of one sample, `any_in` (in an intersection: the second solid's
// `change`) those of two.

@group(0) @binding(1) var<storage, read_write> change: array<u32>;
@group(0) @binding(2) var<storage, read_write> any_in: array<u32>;
@group(0) @binding(3) var<storage, read_write> ranks: array<u32>;
@group(0) @binding(4) var<storage, read_write> counts: array<u32>;
@group(0) @binding(5) var<storage, read_write> tallies: array<Tally>;
@group(0) @binding(6) var<storage, read_write> change_b: array<u32>;
@group(0) @binding(7) var<storage, read_write> any_b: array<u32>;

// Records an unclosed ray: no class, no sample, and a mark in place of ranks.
fn end_unclosed(ray: u32, band: u32) {
    for (var word = 0u; word < view.words; word++) {
        let at = word * view.rays + ray;
        change[at] = 0u;
        ranks[at] = UNCLOSED;
        if TWO_SOLIDS {
            change_b[at] = 0u;
        } else {
            any_in[at] = 0u;
        }
    }
    counts[ray] = UNCLOSED;
    tell_unclosed(ray, band);
}

fn classify_ray(ray: u32, band: u32) {
    var samples = 0u;
    var changed = 0u;
    var inside = 0u;
    var inside_b = 0u;
    for (var word = 0u; word < view.words; word++) {
        let at = word * view.rays + ray;
        let touched = any_in[at];
        // T1: the inside state at the far face of each voxel.
        let far = prefix_parity(change[at]) ^ inside;
        var single = change[at];
        var pair = touched & ~single & select(far, ~far, OVER);
        if TWO_SOLIDS {
            let touched_b = any_b[at];
            let near = (far << 1u) | (inside & 1u);
            let far_b = prefix_parity(change_b[at]) ^ inside_b;
            let near_b = (far_b << 1u) | (inside_b & 1u);
            inside_b = spread_top(far_b);
            let both_far = far & far_b;
            let both_near = near & near_b;
            single = both_far ^ both_near;
            if OVER {
                pair = (far | near | touched) & (far_b | near_b | touched_b) & ~both_far & ~both_near;
            } else {
                pair = (touched | touched_b) & both_far & both_near;
            }
            change[at] = single;
            change_b[at] = pair;
        } else if pair != touched {
            any_in[at] = pair;
        }
        inside = spread_top(far);
        ranks[at] = samples;
        let singles = countOneBits(single);
        changed += singles;
        samples += singles + 2u * countOneBits(pair);
    }
    if (inside | inside_b) != 0u {
        end_unclosed(ray, band);
    } else {
        counts[ray] = samples;
        if is_counted(ray, band) {
            changes += changed;
        }
    }
}

@compute @workgroup_size(WORKGROUP)
fn classify(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
            @builtin(local_invocation_index) lane: u32) {
    if !TWO_SOLIDS {
        clear_tally(lane);
    }
    let ray = invocation_index(group, groups, lane);
    let band = band_of(ray);
    if ray < view.rays {
        classify_ray(ray, band);
    }
    if !TWO_SOLIDS {
        add_to_tally(lane, band);
    }
}
