//! Open and closed pores.

use crate::parallel::*;

use super::{Components, Connectivity, reached};
use crate::bits::{after, before};
use crate::metrics::{BoundaryCondition, NodeSet};

/// Returns the pores that a fluid can enter from outside; the rest are closed. Porosity of either is its share of the region's
/// nodes.
///
/// Pores are connected by faces (6 neighbours). With [`BoundaryCondition::Clip`] and [`BoundaryCondition::Border`] pores are
/// open that reach the [`rim`] of the region, and a pore that the region cuts counts as open, since nothing is known of its
/// continuation. A periodic cell has no outside: there ([`BoundaryCondition::Periodic`], where the region must be the whole
/// raster) pores are open that are endless in at least one direction. The faces of the cell would be a wrong source, as a
/// bubble that happens to lie across one is as closed as any other.
///
/// `pore` are nodes of the region; others do not count.
///
/// # Panics
/// If the sets are of rasters of different sizes.
pub fn open_pores(pore: &NodeSet, region: &NodeSet, edges: BoundaryCondition) -> NodeSet {
    let pore = pore.and(region);
    match edges {
        BoundaryCondition::Clip | BoundaryCondition::Border => reached(&pore, Connectivity::Faces, edges, &rim(region)),
        BoundaryCondition::Periodic => {
            let pieces = Components::of(&pore, Connectivity::Faces, edges);
            pieces.nodes(|piece| pieces.directions(piece) > 0)
        }
    }
}

/// Returns the nodes of a region with one of their 6 neighbours outside it: for a box its outermost layers. Outside the raster
/// is outside the region.
pub fn rim(region: &NodeSet) -> NodeSet {
    let size = region.size();
    let none = vec![0; region.words()];
    let row = |y: usize, z: usize| match y < size[1] && z < size[2] {
        true => region.row(y, z),
        false => &none[..],
    };
    let rows: Vec<u64> = (0..size[1] * size[2])
        .into_par_iter()
        .with_min_len(64)
        .flat_map_iter(|at| {
            let (y, z) = (at % size[1], at / size[1]);
            let own = row(y, z);
            let across = [row(y.wrapping_sub(1), z), row(y + 1, z), row(y, z.wrapping_sub(1)), row(y, z + 1)];
            (0..own.len()).map(move |word| {
                let along = before(own, word) & after(own, word);
                own[word] & !across.iter().fold(along, |all, row| all & row[word])
            })
        })
        .collect();
    let mut rim = NodeSet::empty(size);
    for (at, words) in rows.chunks(region.words().max(1)).enumerate() {
        rim.row_mut(at % size[1], at / size[1]).copy_from_slice(words);
    }
    rim
}
