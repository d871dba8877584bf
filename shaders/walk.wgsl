// A walk over the sorted crossings of a ray, voxel by voxel.

// The result of the crossings of one solid in one voxel of a ray.
struct Voxel {
    // The first crossing after the voxel.
    end: u32,
    // The winding number after it; under the even-odd rule its parity, 0 or 1.
    winding: i32,
    // The surface may lie in the voxel.
    touched: bool,
    least: i32,
    greatest: i32,
}

// Takes the crossings from `first` on that lie in `voxel` of a ray of a band, possibly none; `winding` is that before it.
fn take_voxel(first: u32, end: u32, band: u32, voxel: u32, winding: i32) -> Voxel {
    var taken = Voxel(first, winding, false, 0, 0);
    if first == end {
        return taken;
    }
    if crossing_voxel(crossings[first], band) != voxel {
        return taken;
    }
    taken.least = crossing_floor(crossings[first]);
    while taken.end < end {
        let crossing = crossings[taken.end];
        if crossing_voxel(crossing, band) != voxel {
            break;
        }
        if NON_ZERO {
            take_group(&taken, end);
        } else {
            taken.winding ^= 1;
            taken.touched = true;
            taken.end++;
        }
    }
    taken.greatest = crossing_ceil(crossings[taken.end - 1u]);
    return taken;
}

// Takes the crossings of equal floor from `taken.end` on. Their order is unknown, so that any winding number between
// all leaving first and all entering first may occur.
fn take_group(taken: ptr<function, Voxel>, end: u32) {
    let half_floor = crossings[(*taken).end] >> 3u;
    var entering = 0;
    var leaving = 0;
    while (*taken).end < end {
        let crossing = crossings[(*taken).end];
        if (crossing >> 3u) != half_floor {
            break;
        }
        leaving += bitcast<i32>(crossing & 1u);
        entering += 1 - bitcast<i32>(crossing & 1u);
        (*taken).end++;
    }
    let winding = (*taken).winding;
    if winding - leaving <= 0 && winding + entering >= 0 {
        (*taken).touched = true;
    }
    (*taken).winding = winding + entering - leaving;
}

// Returns whether the crossings from `first` to `end` close.
fn closes(first: u32, end: u32) -> bool {
    if !NON_ZERO {
        return ((end - first) & 1u) == 0u;
    }
    var sum = 0;
    for (var at = first; at < end; at++) {
        sum += crossing_winding(crossings[at]);
    }
    return sum == 0;
}
