//! The nearest crossing of each row at its nodes.

use std::ops::Range;

use super::Crossings;
use super::site::{Site, lesser};
use crate::bits::Ones;
use crate::grid::Axis;

/// The rows along an axis.
#[derive(Clone, Copy)]
pub(super) struct NodeRows<'a> {
    pub crossings: &'a Crossings,
    pub axis: Axis,
    /// The site of the first of their crossings.
    pub number: u32,
    /// The length after which they repeat.
    pub period: Option<f32>,
}

/// Number of rows tested at once for a passed crossing.
const CHUNK: usize = 16;

/// A crossing: its place on its row, and its number.
type Place = (f32, u32);

/// Stands for no crossing before a node, and for none after it.
const NONE: [Place; 2] = [(f32::NEG_INFINITY, u32::MAX), (f32::INFINITY, u32::MAX)];

impl<'a> NodeRows<'a> {
    /// Returns the places of the crossings of a row, and the site of the first of them.
    #[inline]
    fn row(&self, row: usize) -> (&'a [f32], u32) {
        (self.crossings.row(self.axis, row), self.number + self.crossings.first(self.axis, row))
    }

    /// Returns a crossing of a row; past the last one, the first one a period on, or none.
    #[inline]
    fn crossing(&self, (places, number): (&[f32], u32), index: usize) -> Place {
        match (places.get(index), self.period, places) {
            (Some(&place), ..) => (place, number + index as u32),
            (None, Some(period), [first, ..]) => (first + period, number),
            _ => NONE[1],
        }
    }

    /// Returns the last crossing of a row, one period earlier; none if rows do not repeat.
    fn before(&self, (places, number): (&[f32], u32)) -> Place {
        match (self.period, places.last()) {
            (Some(period), Some(last)) => (last - period, number + places.len() as u32 - 1),
            _ => NONE[0],
        }
    }

    /// Sets the squared distance of each node of a row from the nearest of its crossings, and that crossing; of two as near, it
    /// is the one before the node.
    pub fn along<S: Site>(&self, row: usize, (squared, sites): (&mut [f32], &mut [S])) {
        let places = self.row(row);
        if places.0.is_empty() {
            squared.fill(f32::INFINITY);
            sites.fill(S::NONE);
            return;
        }
        let (mut from, mut here) = (0, self.before(places));
        for index in 0..=places.0.len() {
            let next = self.crossing(places, index);
            // Crossings at one place are as near as one another everywhere.
            if next.0 == here.0 {
                continue;
            }
            let is_nearer = |node: usize| next.0 - (node as f32) < node as f32 - here.0;
            // The middle decides but for rounding.
            let mut to = ((0.5 * (here.0 + next.0)) as usize).saturating_add(1).clamp(from, squared.len());
            while to > from && is_nearer(to - 1) {
                to -= 1;
            }
            while to < squared.len() && !is_nearer(to) {
                to += 1;
            }
            square_distances(here.0, from, &mut squared[from..to]);
            sites[from..to].fill(S::numbered(here.1));
            (from, here) = (to, next);
        }
        square_distances(here.0, from, &mut squared[from..]);
        sites[from..].fill(S::numbered(here.1));
    }
}

/// Sets squared distances from a place to nodes.
#[inline]
fn square_distances(place: f32, from: usize, squared: &mut [f32]) {
    for (node, squared) in (from as i32..).zip(squared) {
        let distance = node as f32 - place;
        *squared = distance * distance;
    }
}

/// Sets squared distances from the nearer of two places each, those before and those after, and its site.
fn nearer<S: Site>(at: f32, before: (&[f32], &[u32]), after: (&[f32], &[u32]), squared: &mut [f32], sites: &mut [S]) {
    let before = before.0.iter().zip(before.1).map(|(&place, &number)| (at - place, S::numbered(number)));
    let after = after.0.iter().zip(after.1).map(|(&place, &number)| (place - at, S::numbered(number)));
    for (((before, after), squared), site) in before.zip(after).zip(squared).zip(sites) {
        let (distance, nearest) = lesser(before, after);
        (*squared, *site) = (distance * distance, nearest);
    }
}

/// A crossing of each row.
#[derive(Default)]
struct Places {
    places: Vec<f32>,
    numbers: Vec<u32>,
}

impl Places {
    fn clear(&mut self) {
        self.places.clear();
        self.numbers.clear();
    }

    fn push(&mut self, (place, number): Place) {
        self.places.push(place);
        self.numbers.push(number);
    }

    fn set(&mut self, row: usize, (place, number): Place) {
        (self.places[row], self.numbers[row]) = (place, number);
    }

    fn part(&self, part: Range<usize>) -> (&[f32], &[u32]) {
        (&self.places[part.clone()], &self.numbers[part])
    }
}

/// A plane that sweeps along the rows across it, with the last crossing before it and the first one after it of each row.
pub(super) struct Sweep<'a> {
    rows: NodeRows<'a>,
    /// The number of the first of the rows.
    first: usize,
    before: Places,
    /// Those in the plane or after it.
    after: Places,
}

impl<'a> Sweep<'a> {
    pub fn new(rows: NodeRows<'a>) -> Sweep<'a> {
        Sweep { rows, first: 0, before: Places::default(), after: Places::default() }
    }

    /// Starts on some rows, at a place of their nodes.
    pub fn begin(&mut self, numbers: Range<usize>, at: usize) {
        let rows = self.rows;
        self.first = numbers.start;
        self.before.clear();
        self.after.clear();
        for row in numbers.map(|number| rows.row(number)) {
            let next = row.0.partition_point(|&place| place < at as f32);
            let before = next.checked_sub(1).map_or_else(|| rows.before(row), |last| rows.crossing(row, last));
            self.before.push(before);
            self.after.push(rows.crossing(row, next));
        }
    }

    /// Sets the squared distances of the nodes at a place of some rows, counted from the first, from the nearest crossings of
    /// these, and those crossings. The place is not before the last one.
    pub fn nearest<S: Site>(&mut self, part: Range<usize>, at: usize, (squared, sites): (&mut [f32], &mut [S])) {
        let at = at as f32;
        for first in part.clone().step_by(CHUNK) {
            let after = &self.after.places[first..part.end.min(first + CHUNK)];
            let is_passed = after.iter().zip(0..).fold(0, |bits, (&after, row)| bits | u64::from(after < at) << row);
            Ones(is_passed).for_each(|row| self.pass(first + row as usize, at));
        }
        nearer(at, self.before.part(part.clone()), self.after.part(part), squared, sites);
    }

    /// Passes the crossings of a row that lie before a place. None of their repetitions does, as no crossing lies before −1.
    fn pass(&mut self, row: usize, at: f32) {
        let crossings = self.rows.row(self.first + row);
        debug_assert!(self.rows.period.is_none() || crossings.0[0] >= -1.0, "no repetition is passed");
        while self.after.places[row] < at {
            let passed = (self.after.places[row], self.after.numbers[row]);
            self.before.set(row, passed);
            self.after.set(row, self.rows.crossing(crossings, (passed.1 - crossings.1) as usize + 1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random::Random;

    /// Returns the squared distance from a node to the nearest crossing of a row, and the sites that lie so near.
    fn expected(rows: &NodeRows, row: usize, node: usize) -> (f32, Vec<u32>) {
        let (places, number) = rows.row(row);
        let shifts = rows.period.map_or(vec![0.0], |period| vec![-period, 0.0, period]);
        let all = || {
            let of = |shift: f32| {
                places.iter().zip(number..).map(move |(&place, site)| ((place + shift - node as f32).abs(), site))
            };
            shifts.iter().copied().flat_map(of)
        };
        let least = all().map(|(distance, _)| distance).fold(f32::INFINITY, f32::min);
        let sites: Vec<u32> = all().filter(|&(distance, _)| distance == least).map(|(_, site)| site).collect();
        (least * least, if sites.is_empty() { vec![u32::MAX] } else { sites })
    }

    #[test]
    fn rows_and_sweeps_find_the_nearest_crossings() {
        let mut random = Random::new(21);
        for case in 0..60 {
            let size = [1 + random.below(40), 1 + random.below(9), 1 + random.below(50)];
            let density = [0.0, 0.5, 3.0, 60.0][case % 4];
            // Halves make ties, and crossings at one place; others, middles that roundings decide.
            let steps = [2.0, 2.0, 1e5][case % 3];
            let crossings = Crossings::of_places(size, |axis, _| {
                let count = (random.share() * density) as usize;
                let mut place = || ((random.share() * steps * size[axis.depth()] as f64).floor() / steps) as f32 - 0.5;
                let mut places: Vec<f32> = (0..count).map(|_| place()).collect();
                places.sort_unstable_by(f32::total_cmp);
                places
            });
            for (axis, repeats) in Axis::ALL.into_iter().flat_map(|axis| [(axis, false), (axis, true)]) {
                let [depth, columns] = [axis.depth(), axis.column()].map(|axis| size[axis]);
                let rows = NodeRows { crossings: &crossings, axis, number: 5, period: repeats.then_some(depth as f32) };
                let count = columns * size[axis.row()];
                let (mut squared, mut sites) = (vec![0.0; depth], vec![0; depth]);
                let mut by_row = vec![Vec::new(); depth];
                for row in 0..count {
                    rows.along(row, (&mut squared, &mut sites));
                    for (node, found) in squared.iter().copied().zip(sites.iter().copied()).enumerate() {
                        let (least, nearest) = expected(&rows, row, node);
                        assert!(
                            found.0 == least && nearest.contains(&found.1),
                            "{case}: {row}, {node}: {found:?}, not {least}"
                        );
                        by_row[node].push(found.0);
                    }
                }
                let begin = random.below(depth);
                let mut sweep = Sweep::new(rows);
                sweep.begin(0..count, begin);
                let (mut squared, mut sites) = (vec![0.0; count], vec![0; count]);
                for (node, expected_squared) in by_row.iter().enumerate().skip(begin) {
                    let half = count / 2;
                    sweep.nearest(0..half, node, (&mut squared[..half], &mut sites[..half]));
                    sweep.nearest(half..count, node, (&mut squared[half..], &mut sites[half..]));
                    assert_eq!(squared, *expected_squared, "{case}: {node}");
                    for (row, site) in sites.iter().enumerate() {
                        assert!(expected(&rows, row, node).1.contains(site), "{case}: {row}, {node}");
                    }
                }
            }
        }
    }
}
