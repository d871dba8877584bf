//! The state of a cell: the sets that divide it, and the volume of the result within it.

use super::frechet::{self, Part};
use super::node::{Entry, Node};
use super::shells::Shells;
use crate::boolean::Expression;
use crate::sampler::FillRule;

/// Operands, and the expression over them.
pub(super) struct Scene<'e> {
    pub shells: Shells,
    pub expression: &'e Expression,
    pub fill: FillRule,
}

/// A set that a cell lies partly in.
struct Divider<'n> {
    operand: u32,
    /// The inside of a shell, with its winding number there and its triangles; `None` for an operand of which only its surface
    /// is known.
    shell: Option<(u32, i32, &'n [Entry])>,
}

/// Largest number of dividers whose combinations are enumerated.
const FEW: usize = 4;

/// The state of a cell.
pub(super) struct State<'s> {
    scene: &'s Scene<'s>,
    node: &'s Node,
    /// The winding numbers, where they are not zero, of operands by number, without those of the dividers.
    windings: Vec<(u32, i32)>,
    /// The sets of which the result may depend in the cell.
    dividers: Vec<Divider<'s>>,
}

impl<'s> State<'s> {
    pub fn of(scene: &'s Scene, node: &'s Node) -> State<'s> {
        let mut state = State { scene, node, windings: Vec::new(), dividers: Vec::new() };
        let mut with_entries = Vec::new();
        for entries in node.by_shell(&scene.shells) {
            let shell = scene.shells.shell_of(entries[0].triangle);
            with_entries.push(shell);
            state.divide(shell, entries);
        }
        for &(shell, winding) in node.windings().iter().filter(|(shell, _)| with_entries.binary_search(shell).is_err())
        {
            let operand = scene.shells.shell(shell).operand;
            match state.windings.last_mut() {
                Some((last, sum)) if *last == operand => *sum += winding,
                _ => state.windings.push((operand, winding)),
            }
        }
        state.drop_idle();
        state
    }

    /// Adds a shell with triangles in the cell. An operand with a shell of unknown winding numbers is one divider.
    fn divide(&mut self, shell: u32, entries: &'s [Entry]) {
        let of_shell = self.scene.shells.shell(shell);
        let operand = of_shell.operand;
        if self.dividers.last().is_some_and(|last| last.operand == operand && last.shell.is_none()) {
            return;
        }
        let known = of_shell.sign.map(|sign| (shell, sign, entries));
        if known.is_none() {
            self.dividers.retain(|divider| divider.operand != operand);
        }
        self.dividers.push(Divider { operand, shell: known });
    }

    /// Returns whether the points in the dividers with a bit, and in no others, belong to the result.
    fn holds(&self, bits: u64) -> bool {
        self.scene.expression.holds(|input| {
            let operand = input as u32;
            let mut winding = self.winding(operand);
            for (i, divider) in self.dividers.iter().enumerate().filter(|(_, divider)| divider.operand == operand) {
                let is_in = bits >> i & 1 == 1;
                match divider.shell {
                    Some((_, sign, _)) => winding += if is_in { sign } else { 0 },
                    None => return is_in,
                }
            }
            self.scene.fill.is_inside(winding)
        })
    }

    fn winding(&self, operand: u32) -> i32 {
        let at = self.windings.binary_search_by_key(&operand, |&(operand, _)| operand);
        at.map_or(0, |at| self.windings[at].1)
    }

    /// Drops dividers on which the result does not depend: all where the other operands decide (Kleene's logic), and each of a
    /// few that changes it in no combination with the others.
    fn drop_idle(&mut self) {
        let known = |operand: usize| {
            let is_divided = self.dividers.iter().any(|divider| divider.operand as usize == operand);
            (!is_divided).then(|| self.scene.fill.is_inside(self.winding(operand as u32)))
        };
        if self.scene.expression.decided(known).is_some() {
            // Their winding numbers may remain out of the sum, as they do not matter.
            self.dividers.clear();
        }
        let mut i = 0;
        while i < self.dividers.len() && self.dividers.len() <= FEW {
            let changes = |bits: u64| self.holds(bits) != self.holds(bits | 1 << i);
            match (0..1 << self.dividers.len()).any(changes) {
                true => i += 1,
                false => drop(self.dividers.remove(i)),
            }
        }
    }

    /// Returns whether the bounds differ by rounding alone.
    pub fn is_exact(&self) -> bool {
        match &self.dividers[..] {
            [] => true,
            [divider] => divider.shell.is_some(),
            _ => false,
        }
    }

    /// Returns bounds of the volume of the result within the cell.
    pub fn bounds(&self) -> [f64; 2] {
        let (volume, error) = self.node.cell.volume();
        let cell = Part { volume, error };
        let holds = |bits| self.holds(bits);
        match &self.dividers[..] {
            [] if holds(0) => [volume - error, volume + error],
            [] => [0.0; 2],
            [a] => frechet::of_one([0, 1].map(holds), self.part(a, cell), cell),
            [a, b] => frechet::of_two([0, 1, 2, 3].map(holds), [self.part(a, cell), self.part(b, cell)], cell),
            // The bits of a mask.
            many if many.len() > 64 => [0.0, volume + error],
            many => {
                let parts: Vec<Part> = many.iter().map(|divider| self.part(divider, cell)).collect();
                let is_most = |part: &Part| 2.0 * part.volume > volume;
                let bits = parts.iter().enumerate().map(|(i, part)| u64::from(is_most(part)) << i).sum();
                let lesser = parts.iter().map(|part| match is_most(part) {
                    true => Part { volume: volume - part.volume, error: part.error + error },
                    false => *part,
                });
                frechet::of_many(holds(bits), lesser, cell)
            }
        }
    }

    /// Returns the volume of a divider within the cell.
    fn part(&self, divider: &Divider, cell: Part) -> Part {
        match divider.shell {
            Some((shell, sign, entries)) => {
                let (integral, error) = self.node.integral(&self.scene.shells, shell, entries);
                Part { volume: (f64::from(sign) * integral).clamp(0.0, cell.volume), error: error + cell.error }
            }
            None => Part { volume: 0.5 * cell.volume, error: 0.5 * cell.volume + cell.error },
        }
    }
}
