//! Nodes near crossings, compared with a look at every edge between two nodes.

use super::*;
use crate::testing::random::Random;

#[test]
fn nodes_near_crossings_are_those_with_one_among_the_27_nodes_about_them() {
    let mut random = Random::new(21);
    let rays = [70usize, 9, 7];
    let grid = Grid::from_parts(DVec3::ZERO, 1.0, rays.map(|n| n as u32), 8, 1024).unwrap();
    for share in [40, 400] {
        // For each axis and node, true if the ray along the axis crosses between the node before and this one.
        let mut crossed = std::collections::HashSet::new();
        let spans = Axis::ALL.map(|axis| {
            let (columns, rows) = grid.image_size(axis);
            let (mut offsets, mut hits) = (vec![0], Vec::new());
            for ray in 0..columns * rows {
                for index in 0..=rays[axis.depth()] {
                    if random.chance(share) {
                        let mut node = [0; 3];
                        (node[axis.column()], node[axis.row()]) = ((ray % columns) as usize, (ray / columns) as usize);
                        node[axis.depth()] = index;
                        crossed.insert((axis.depth(), node));
                        hits.push(Crossing::at(f64::from(((index as i32) << 8) - 20), 1));
                    }
                }
                offsets.push(hits.len() as u32);
            }
            RaySpans { axis, offsets, hits }
        });
        let is_near = |node: [usize; 3]| {
            (0..81).any(|k: usize| {
                let (axis, k) = (k / 27, k % 27);
                let mut at: [isize; 3] =
                    std::array::from_fn(|i| node[i] as isize + (k / 3usize.pow(i as u32) % 3) as isize - 1);
                // Along the axis, two intervals: those before and behind the node.
                if k / 3usize.pow(axis as u32) % 3 == 2 {
                    return false;
                }
                at[axis] += 1;
                let at = at.map(usize::try_from);
                matches!(at, [Ok(x), Ok(y), Ok(z)] if crossed.contains(&(axis, [x, y, z])))
            })
        };
        let mut seen = [0; 2];
        for planes in [0..7, 0..3, 3..5, 5..7] {
            let bits = near_crossings(&grid, (&spans, &spans[2].ends(Pixels::new(grid.shift()))), planes.clone());
            for z in planes.clone() {
                for y in 0..rays[1] {
                    for x in 0..rays[0] {
                        let found = bits[((z - planes.start) * rays[1] + y) * 2 + x / 64] >> (x % 64) & 1 == 1;
                        assert_eq!(found, is_near([x, y, z]), "{planes:?} {:?}", [x, y, z]);
                        seen[usize::from(found)] += 1;
                    }
                }
            }
        }
        assert!(seen.iter().all(|&seen| seen > 100), "{seen:?}");
    }
}
