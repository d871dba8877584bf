// Winding sums (`Windings` in `src/ldi/mod.rs`): by invocation, then by workgroup, then over all. Sums of 64 bits are
// in two words, whose carries do not depend on the order in which their terms arrive.

var<private> wound: vec2<u32>;
var<private> unpaired: vec2<u32>;
var<private> aligned: i32;
var<private> changes: u32;

var<workgroup> group_wound_low: atomic<u32>;
var<workgroup> group_wound_high: atomic<u32>;
var<workgroup> group_unpaired_low: atomic<u32>;
var<workgroup> group_unpaired_high: atomic<u32>;
var<workgroup> group_aligned: atomic<i32>;
var<workgroup> group_changes: atomic<u32>;

// Adds a signed term to a sum in two words, low and high.
fn wide_term(sum: vec2<u32>, signed_term: i32) -> vec2<u32> {
    let term = bitcast<u32>(signed_term);
    let low = sum.x + term;
    return vec2(low, sum.y + carry(sum.x, term) + sign_word(signed_term));
}

// Adds one crossing of a closed ray. Its group, at `position`, either changes the parity, and the crossing has the
// direction that parity implies or the opposite one, or the group has an even number of crossings.
fn add_winding(crossing: u32, position: i32, changes_parity: bool, becomes_inside: bool) {
    let winding = crossing_winding(crossing);
    wound = wide_term(wound, -winding * crossing_nearest(crossing));
    if changes_parity {
        aligned += select(-winding, winding, becomes_inside);
    } else {
        unpaired = wide_term(unpaired, -winding * position);
    }
}

// Clears the sums of a workgroup; all its invocations must call it first.
fn clear_tally(lane: u32) {
    if lane == 0u {
        atomicStore(&group_wound_low, 0u);
        atomicStore(&group_wound_high, 0u);
        atomicStore(&group_unpaired_low, 0u);
        atomicStore(&group_unpaired_high, 0u);
        atomicStore(&group_aligned, 0);
        atomicStore(&group_changes, 0u);
    }
    workgroupBarrier();
}

// Adds the sums of an invocation to the tally of a band; all invocations of a workgroup must call it. Most have nothing to add
// where triangles lie between the rays.
fn add_to_tally(lane: u32, band: u32) {
    if changes != 0u || aligned != 0 || any((wound | unpaired) != vec2(0u)) {
        let wound_before = atomicAdd(&group_wound_low, wound.x);
        atomicAdd(&group_wound_high, wound.y + carry(wound_before, wound.x));
        let unpaired_before = atomicAdd(&group_unpaired_low, unpaired.x);
        atomicAdd(&group_unpaired_high, unpaired.y + carry(unpaired_before, unpaired.x));
        atomicAdd(&group_aligned, aligned);
        atomicAdd(&group_changes, changes);
    }
    workgroupBarrier();
    if lane == 0u {
        let tally = view.bands[band].tally;
        let wound_sum = vec2(atomicLoad(&group_wound_low), atomicLoad(&group_wound_high));
        let unpaired_sum = vec2(atomicLoad(&group_unpaired_low), atomicLoad(&group_unpaired_high));
        if any(wound_sum != vec2(0u)) {
            let before = atomicAdd(&tallies[tally].wound_low, wound_sum.x);
            atomicAdd(&tallies[tally].wound_high, wound_sum.y + carry(before, wound_sum.x));
        }
        if any(unpaired_sum != vec2(0u)) {
            let before = atomicAdd(&tallies[tally].unpaired_low, unpaired_sum.x);
            atomicAdd(&tallies[tally].unpaired_high, unpaired_sum.y + carry(before, unpaired_sum.x));
        }
        // The sum of one workgroup fits 32 bits; that of a band with many crossings in each voxel does not.
        let aligned_sum = wide_term(vec2(0u), atomicLoad(&group_aligned));
        if any(aligned_sum != vec2(0u)) {
            let before = atomicAdd(&tallies[tally].aligned_low, aligned_sum.x);
            atomicAdd(&tallies[tally].aligned_high, aligned_sum.y + carry(before, aligned_sum.x));
        }
        let changes_sum = atomicLoad(&group_changes);
        if changes_sum != 0u {
            atomicAdd(&tallies[tally].changes, changes_sum);
        }
    }
}
