// Sums of windings: by invocation, then by workgroup, then over all.

var<private> wound_low: u32;
var<private> wound_high: u32;
var<private> aligned: i32;
var<private> changes: u32;

var<workgroup> group_wound_low: atomic<u32>;
var<workgroup> group_wound_high: atomic<u32>;
var<workgroup> group_aligned: atomic<i32>;
var<workgroup> group_changes: atomic<u32>;

fn add_wound(length: i32) {
    let term = bitcast<u32>(length);
    wound_low += term;
    wound_high += select(0u, 1u, wound_low < term) + select(0u, 0xffffffffu, length < 0);
}

// Called by all invocations of a workgroup.
fn add_to_tally(lane: u32) {
    let low_before = atomicAdd(&group_wound_low, wound_low);
    atomicAdd(&group_wound_high, wound_high + select(0u, 1u, low_before + wound_low < wound_low));
    atomicAdd(&group_aligned, aligned);
    atomicAdd(&group_changes, changes);
    workgroupBarrier();
    if lane == 0u {
        let low = atomicLoad(&group_wound_low);
        let before = atomicAdd(&tally.wound_low, low);
        atomicAdd(&tally.wound_high, atomicLoad(&group_wound_high) + select(0u, 1u, before + low < low));
        atomicAdd(&tally.aligned, atomicLoad(&group_aligned));
        atomicAdd(&tally.changes, atomicLoad(&group_changes));
    }
}

// What one crossing of a ray that closes adds: where its group changes the parity, whether it goes the way that the parity
// does.
fn add_winding(crossing: u32, changes_parity: bool, becomes_inside: bool) {
    let winding = crossing_winding(crossing);
    add_wound(-winding * crossing_nearest(crossing));
    if changes_parity {
        aligned += select(-winding, winding, becomes_inside);
    }
}
