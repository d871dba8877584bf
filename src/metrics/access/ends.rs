//! The two ends of a region along an axis.

use std::ops::Range;

use crate::bits::is_set;
use crate::grid::Axis;
use crate::metrics::{NodeSet, Region};

/// The share of its extent that counts as an end of a region which is not a box: such a region may end in a single node.
const END: f64 = 1.0 / 20.0;

/// The two ends of a region that a spanning path connects: the nodes of planes across an axis.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ends {
    pub(super) axis: Axis,
    pub(super) low: Range<usize>,
    pub(super) high: Range<usize>,
    /// The planes across each axis that hold nodes of the region, where it is a box.
    pub(super) sides: Option<[Range<usize>; 3]>,
}

impl Ends {
    /// Returns the ends of a raster that is a box as a whole: its first plane and its last.
    pub fn of_raster(size: [usize; 3], axis: Axis) -> Ends {
        Ends::of_box(size.map(|side| 0..side), axis)
    }

    /// Returns the ends of a region. For a box, the plane of nodes at either face; for another region, the nodes in the lowest
    /// and the highest twentieth of its extent along the axis, at least a plane each. `None` for a region without nodes.
    pub fn of_region(region: &Region<'_>, axis: Axis) -> Option<Ends> {
        let sides = extent(region.nodes())?;
        if region.is_box() {
            return Some(Ends::of_box(sides, axis));
        }
        let Range { start, end } = sides[axis.depth()];
        let planes = (((end - start) as f64 * END).round() as usize).max(1);
        Some(Ends { axis, low: start..start + planes, high: end - planes..end, sides: None })
    }

    fn of_box(sides: [Range<usize>; 3], axis: Axis) -> Ends {
        let Range { start, end } = sides[axis.depth()];
        Ends { axis, low: start..start + 1, high: end.saturating_sub(1)..end, sides: Some(sides) }
    }

    /// Returns the axis between the ends.
    pub fn axis(&self) -> Axis {
        self.axis
    }

    /// Returns the nodes of a set that are in planes of a range across the axis.
    pub(super) fn nodes_in<'a>(
        &self,
        nodes: &'a NodeSet,
        planes: Range<usize>,
    ) -> impl Iterator<Item = [usize; 3]> + use<'a> {
        let size = nodes.size();
        let mut ranges = size.map(|side| 0..side);
        ranges[self.axis.depth()] = planes;
        let [xs, ys, zs] = ranges;
        zs.flat_map(move |z| {
            let xs = xs.clone();
            ys.clone().flat_map(move |y| xs.clone().map(move |x| [x, y, z]))
        })
        .filter(|&node| nodes.contains(node))
    }
}

/// Returns the planes across x, y and z between which all nodes of a set lie; `None` for an empty set.
fn extent(nodes: &NodeSet) -> Option<[Range<usize>; 3]> {
    let size = nodes.size();
    let mut columns = vec![0u64; nodes.words()];
    let (mut rows, mut planes) = (vec![false; size[1]], vec![false; size[2]]);
    for (z, plane) in planes.iter_mut().enumerate() {
        for (y, row) in rows.iter_mut().enumerate() {
            let words = nodes.row(y, z);
            columns.iter_mut().zip(words).for_each(|(column, word)| *column |= word);
            let holds = words.iter().any(|&word| word != 0);
            *row |= holds;
            *plane |= holds;
        }
    }
    let columns: Vec<bool> = (0..size[0]).map(|x| is_set(&columns, x)).collect();
    let range = |held: &[bool]| Some(held.iter().position(|&h| h)?..held.iter().rposition(|&h| h)? + 1);
    Some([range(&columns)?, range(&rows)?, range(&planes)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extent_encloses_the_nodes() {
        let size = [130, 5, 6];
        let block = NodeSet::from_fn(size, |[x, y, z]| (62..68).contains(&x) && y > 0 && z > 1);
        assert_eq!(extent(&block), Some([62..68, 1..5, 2..6]));
        assert_eq!(extent(&NodeSet::empty(size)), None);
    }
}
