//! Chords: the stretches of rays within a phase.
//!
//! The rays of an image are the test lines of stereology, and the stretches that the surface cuts them into are chords of
//! the solid and of its pores. Their lengths are known to a millionth of a pitch. Drawn by number they are the chord-length
//! distribution p(z) of Torquato (*Random Heterogeneous Materials*, Springer 2002, § 2.5), where every chord counts once; by
//! length, each counts with its length, as it does for a point thrown into the phase at random.
//!
//! # Censored chords
//! A chord that ends at the region's boundary is *censored*: it goes on beyond, and only its least length is known. Neither
//! way out of that is right. To leave such chords out ([`Counted::Complete`]) makes the mean too short, as long chords are
//! cut more often; to take them as long as they are seen ([`Counted::All`]) does so, too. The distribution that this module
//! takes by default is of complete chords: each of its lengths is one that the structure has, and PoreSpy does the same.
//! How much was left out is in [`Censored`].
//!
//! For the **mean** there is a right way: the length of the phase on the lines over half the number of ends that the surface
//! makes ([`Chords::mean`]). An end is seen or not irrespective of how long its chord is, so every chord counts as often as
//! its ends are seen, which on average is right. With the crossings by unit length P_L of
//! [`anisotropy`](super::anisotropy), a mean over the same lines, that is 2φ/P_L for the pores of a porosity φ: each chord
//! has two ends. In a cell that repeats nothing needs be cut ([`Edges::Periodic`]): what leaves at one face goes on at
//! the opposite one.
//!
//! A ball of radius R has chords of mean 4R/3 and standard deviation √2 R/3 by number.

use rayon::prelude::*;

use super::stretches::{End, flush, stretches};
use super::{Distribution, Edges, Phase, Region};
use crate::ldi::{Ldi, Spans};

/// What a chord counts with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Weighting {
    /// Every chord once.
    #[default]
    Number,
    /// Every chord with its length.
    Length,
}

/// Which chords count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Counted {
    /// Those that end at the surface on both sides.
    #[default]
    Complete,
    /// All of them, censored ones as long as they are seen.
    All,
}

/// Chords that end at the region's boundary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Censored {
    /// How many there are.
    pub count: u64,
    /// Their share of all chords by number.
    pub share: f64,
    /// What is seen of them, in world units.
    pub length: f64,
    /// Their share of the length of all chords.
    pub share_of_length: f64,
}

/// The chords of a phase within a region.
#[derive(Clone, Debug, PartialEq)]
pub struct Chords {
    step: f64,
    /// In lattice steps.
    complete: Vec<i32>,
    /// In lattice steps, as far as they are seen.
    censored: Vec<i32>,
    /// Ends that the surface makes.
    ends: u64,
}

/// Chords of a few rows, in lattice steps.
#[derive(Default)]
struct Found {
    complete: Vec<i32>,
    censored: Vec<i32>,
    ends: u64,
}

impl Found {
    fn add(&mut self, length: i32, ends: [End; 2]) {
        let seen = ends.iter().filter(|&&end| end == End::Surface).count();
        self.ends += seen as u64;
        match seen {
            2 => self.complete.push(length),
            _ => self.censored.push(length),
        }
    }
}

impl Chords {
    /// The chords on the rays of one exact image of the solid. Of [`Edges`], `Periodic` joins what a box cuts; the others
    /// leave it cut, and so does every region that is not a box.
    pub fn along(image: &Ldi, region: &Region, phase: Phase, edges: Edges) -> Chords {
        let (columns, rows) = image.size();
        let flush = flush(image.grid());
        let joins = edges == Edges::Periodic && region.is_box();
        let of_row = |row: u32| {
            let mut found = Found::default();
            let mut of_ray = Vec::new();
            for ray in row * columns..(row + 1) * columns {
                of_ray.clear();
                let (solid, spans) = (Spans::new(image.samples(ray)), region.spans(image.axis(), ray));
                stretches(solid, spans, phase, flush, |stretch| of_ray.push(stretch));
                if let (true, [first, .., last]) = (joins, &of_ray[..])
                    && (first.ends[0], last.ends[1]) == (End::Boundary, End::Boundary)
                {
                    found.add(first.length() + last.length(), [last.ends[0], first.ends[1]]);
                    of_ray.pop();
                    of_ray.swap_remove(0);
                }
                of_ray.iter().for_each(|stretch| found.add(stretch.length(), stretch.ends));
            }
            found
        };
        let by_row: Vec<Found> = (0..rows).into_par_iter().map(of_row).collect();
        Chords {
            step: image.grid().step(),
            complete: by_row.iter().flat_map(|found| &found.complete).copied().collect(),
            censored: by_row.iter().flat_map(|found| &found.censored).copied().collect(),
            ends: by_row.iter().map(|found| found.ends).sum(),
        }
    }

    /// The chords of several images of one grid together, as those along x, y and z.
    ///
    /// # Panics
    /// If there are none, or their lattices differ in step.
    pub fn together(parts: &[Chords]) -> Chords {
        let step = parts.first().expect("chords to put together").step;
        assert!(parts.iter().all(|part| part.step == step), "chords on lattices of different steps");
        Chords {
            step,
            complete: parts.iter().flat_map(|part| &part.complete).copied().collect(),
            censored: parts.iter().flat_map(|part| &part.censored).copied().collect(),
            ends: parts.iter().map(|part| part.ends).sum(),
        }
    }

    /// How many chords there are, censored ones among them.
    pub fn count(&self) -> u64 {
        (self.complete.len() + self.censored.len()) as u64
    }

    /// The length of all chords, censored ones as far as they are seen, in world units.
    pub fn length(&self) -> f64 {
        self.world(total(&self.complete) + total(&self.censored))
    }

    /// The mean chord, in world units: the length of all over half the ends that the surface makes, so that cut chords
    /// distort nothing; see the module's docs. Nothing where the surface ends no chord.
    pub fn mean(&self) -> Option<f64> {
        (self.ends > 0).then(|| self.length() / (0.5 * self.ends as f64))
    }

    /// The chords that the region's boundary ends; shares are NaN where there are no chords at all.
    pub fn censored(&self) -> Censored {
        let length = self.world(total(&self.censored));
        let count = self.censored.len() as u64;
        Censored { count, share: count as f64 / self.count() as f64, length, share_of_length: length / self.length() }
    }

    /// The distribution of lengths in world units; nothing where no chord counts.
    pub fn distribution(&self, weighting: Weighting, counted: Counted) -> Option<Distribution> {
        let censored = match counted {
            Counted::Complete => &[][..],
            Counted::All => &self.censored,
        };
        let complete = self.complete.len();
        Distribution::gather(complete + censored.len(), |i| {
            let steps = if i < complete { self.complete[i] } else { censored[i - complete] };
            let length = self.step * f64::from(steps);
            match weighting {
                Weighting::Number => (length, 1.0),
                Weighting::Length => (length, length),
            }
        })
    }

    fn world(&self, steps: i64) -> f64 {
        self.step * steps as f64
    }
}

fn total(lengths: &[i32]) -> i64 {
    lengths.par_iter().with_min_len(1 << 16).map(|&length| i64::from(length)).sum()
}
