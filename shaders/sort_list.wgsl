// Sorts a list; one with more than SORTED_ALONE crossings is left to `sort_long.wgsl`.
fn sort_list(first: u32, end: u32) {
    let count = end - first;
    if count < 2u {
        return;
    }
    if count <= NETWORK {
        sort_few(first, count);
    } else if count <= SORTED_ALONE {
        insertion_sort(first, end);
    }
}
