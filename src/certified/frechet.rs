//! The volume of the points of a cell for which a Boolean function of some sets holds, from the volumes of the sets.

/// The volume of a set within a cell: `volume` ∓ `error`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Part {
    pub volume: f64,
    pub error: f64,
}

/// Returns the least and the greatest volume of the points where a function of two sets holds. `table[i]` is its value where
/// bit 0 of i says whether the point lies in the first set, and bit 1 whether it lies in the second.
///
/// With volumes a and b and x for both sets together, max(0, a + b − cell) ≤ x ≤ min(a, b), and each x is possible (Fréchet
/// 1935). The volume sought is linear in x, so that its extremes are at these ends; and each of them changes by no more than a
/// or b does, and by no more than twice the change of the cell.
pub(super) fn of_two(table: [bool; 4], [a, b]: [Part; 2], cell: Part) -> [f64; 2] {
    let [neither, first, second, both] = table.map(|holds| f64::from(u8::from(holds)));
    let at = |x: f64| {
        both * x + first * (a.volume - x) + second * (b.volume - x) + neither * (cell.volume - a.volume - b.volume + x)
    };
    let ends = [at((a.volume + b.volume - cell.volume).max(0.0)), at(a.volume.min(b.volume))];
    let error = a.error + b.error + 2.0 * cell.error + 16.0 * f64::EPSILON * cell.volume;
    within([ends[0].min(ends[1]) - error, ends[0].max(ends[1]) + error], cell)
}

/// Returns the same for one set.
pub(super) fn of_one(table: [bool; 2], a: Part, cell: Part) -> [f64; 2] {
    of_two([table[0], table[1], table[0], table[1]], [a, Part { volume: 0.0, error: 0.0 }], cell)
}

/// Returns bounds for any number of sets. `lesser` lists, for each of them, the lesser of its volume in the cell and that of
/// the rest of the cell, and `holds` is the value of the function where all points lie on the greater sides: the others have at
/// most the sum of the lesser volumes.
pub(super) fn of_many(holds: bool, lesser: impl Iterator<Item = Part>, cell: Part) -> [f64; 2] {
    let others: f64 = lesser.map(|part| part.volume + part.error).sum::<f64>() * (1.0 + 1e-9);
    let bounds = match holds {
        true => [cell.volume - cell.error - others, cell.volume + cell.error],
        false => [0.0, others],
    };
    within(bounds, cell)
}

fn within([lower, upper]: [f64; 2], cell: Part) -> [f64; 2] {
    [lower.max(0.0), upper.min(cell.volume + cell.error)]
}
