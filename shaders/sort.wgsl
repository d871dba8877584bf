// Sorts the crossings of a list in place: few by a network of comparisons in registers (`network.rs`), more by insertion.

@group(0) @binding(1) var<storage, read> starts: array<u32>;
@group(0) @binding(2) var<storage, read_write> crossings: array<u32>;
@group(0) @binding(3) var<storage, read_write> crossed: array<u32>;

// Returns whether the crossing at `at` sorts after another. Coincident crossings sort by triangle, so that their order never
// depends on arrival.
fn is_behind(at: u32, crossing: u32, triangle: u32) -> bool {
    if KEEPS_TRIANGLES && crossings[at] == crossing {
        return crossed[at] > triangle;
    }
    return crossings[at] > crossing;
}

fn insertion_sort(first: u32, end: u32) {
    for (var i = first + 1u; i < end; i++) {
        let crossing = crossings[i];
        var triangle = 0u;
        if KEEPS_TRIANGLES {
            triangle = crossed[i];
        }
        var place = i;
        while place > first {
            if !is_behind(place - 1u, crossing, triangle) {
                break;
            }
            crossings[place] = crossings[place - 1u];
            if KEEPS_TRIANGLES {
                crossed[place] = crossed[place - 1u];
            }
            place--;
        }
        crossings[place] = crossing;
        if KEEPS_TRIANGLES {
            crossed[place] = triangle;
        }
    }
}
