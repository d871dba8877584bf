//! The cells of the tree, with the triangles that matter in each.

use super::cell::Cell;
use super::flux::{Sum, add_share};
use super::place::{Place, place};
use super::shells::Shells;
use crate::cancel::checkpoint;
use crate::sampler::FillRule;

/// A triangle in the column of a cell.
#[derive(Clone, Copy)]
pub(super) struct Entry {
    pub triangle: u32,
    /// True if it may meet the cell.
    pub is_inside: bool,
}

/// A cell with all that determines the winding numbers in it.
pub(super) struct Node {
    pub cell: Cell,
    /// The triangles that may meet the cell, and those of the column below of which it is not known that every ray crosses
    /// them, or none; by shell. Shells without a triangle in the cell have no entries.
    entries: Vec<Entry>,
    /// For each shell where it is not zero, the winding number in the cell without that of the entries.
    windings: Vec<(u32, i32)>,
}

impl Node {
    /// Returns the whole space that matters.
    pub fn root(shells: &Shells, cell: Cell) -> Node {
        let entries = (0..shells.triangles() as u32).map(|triangle| Entry { triangle, is_inside: true }).collect();
        Node { cell, entries, windings: Vec::new() }.part(shells, cell)
    }

    /// Returns the node of a cell within this one.
    pub fn part(&self, shells: &Shells, cell: Cell) -> Node {
        let mut part = Node { cell, entries: Vec::new(), windings: Vec::new() };
        let mut windings = self.windings.iter().copied().peekable();
        for entries in self.by_shell(shells) {
            let shell = shells.shell_of(entries[0].triangle);
            while let Some(other) = windings.next_if(|&(other, _)| other < shell) {
                part.windings.push(other);
            }
            let mut winding = windings.next_if(|&(other, _)| other == shell).map_or(0, |(_, winding)| winding);
            let first = part.entries.len();
            for &Entry { triangle, is_inside } in checked(entries) {
                match place(&shells.corners(triangle), &cell, is_inside) {
                    Place::Off => {}
                    Place::Across(change) => winding += change,
                    Place::Below => part.entries.push(Entry { triangle, is_inside: false }),
                    Place::Inside => part.entries.push(Entry { triangle, is_inside: true }),
                }
            }
            if !part.entries[first..].iter().any(|entry| entry.is_inside)
                && let Some(change) = constant_winding(shells, &part.entries[first..], &cell)
            {
                winding += change;
                part.entries.truncate(first);
            }
            if winding != 0 {
                part.windings.push((shell, winding));
            }
        }
        part.windings.extend(windings);
        part
    }

    /// Returns the entries of each shell that has any.
    pub fn by_shell<'n>(&'n self, shells: &'n Shells) -> impl Iterator<Item = &'n [Entry]> {
        self.entries.chunk_by(|a, b| shells.shell_of(a.triangle) == shells.shell_of(b.triangle))
    }

    /// Returns the winding numbers, where they are not zero, of shells by number; for shells with entries, without these.
    pub fn windings(&self) -> &[(u32, i32)] {
        &self.windings
    }

    /// Returns whether the whole cell is inside by a fill rule, if no triangle of any shell meets it; for one operand.
    pub fn constant_state(&self, fill: FillRule) -> Option<bool> {
        let winding: i32 = self.windings.iter().map(|(_, winding)| winding).sum();
        self.entries.is_empty().then(|| fill.is_inside(winding))
    }

    /// Returns the integral of a shell's winding number over the cell, and a bound of its error.
    pub fn integral(&self, shells: &Shells, shell: u32, entries: &[Entry]) -> (f64, f64) {
        let (volume, rounding) = self.cell.volume();
        let mut sum = Sum::default();
        if let Ok(at) = self.windings.binary_search_by_key(&shell, |&(shell, _)| shell) {
            let winding = f64::from(self.windings[at].1);
            sum.add(winding * volume, winding.abs() * rounding);
        }
        checked(entries).for_each(|entry| add_share(&mut sum, &shells.corners(entry.triangle), &self.cell));
        sum.total()
    }
}

/// Number of entries between two checkpoints.
const CHUNK: usize = 4096;

/// Returns entries one after another, with checkpoints.
fn checked(entries: &[Entry]) -> impl Iterator<Item = &Entry> {
    entries.chunks(CHUNK).flat_map(|chunk| {
        checkpoint();
        chunk
    })
}

/// Returns the winding number of a shell without triangles in a cell, from those in the column below: it is the same in the whole
/// cell, so that its integral is a whole number of times the volume. Returns nothing where the error leaves two such numbers.
fn constant_winding(shells: &Shells, below: &[Entry], cell: &Cell) -> Option<i32> {
    if below.is_empty() {
        return Some(0);
    }
    let (volume, rounding) = cell.volume();
    let mut sum = Sum::default();
    checked(below).for_each(|entry| add_share(&mut sum, &shells.corners(entry.triangle), cell));
    let (integral, error) = sum.total();
    let winding = (integral / volume).round();
    let uncertainty = error + (winding.abs() + 1.0) * rounding;
    (uncertainty < 0.25 * volume).then_some(winding as i32)
}
