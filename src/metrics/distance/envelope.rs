//! The minimum of squared distances along a row: the lower envelope of parabolas.

/// A squared distance and the crossing at that distance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    pub squared: f32,
    pub site: u32,
}

impl Nearest {
    /// No crossing.
    pub const NONE: Nearest = Nearest { squared: f32::INFINITY, site: u32::MAX };
}

/// A parabola of the envelope: squared distance `height` at position `at`.
#[derive(Clone, Copy, Debug, Default)]
struct Parabola {
    at: f32,
    height: f32,
    site: u32,
}

/// The parabolas of the lower envelope, kept between rows to avoid allocations.
#[derive(Debug, Default)]
pub(super) struct Envelope {
    parabolas: Vec<Parabola>,
}

impl Envelope {
    /// Replaces each squared distance by the minimum over the row of squared distance plus squared offset, with its site.
    ///
    /// The parabolas of the envelope are found without a division: of three in a row the middle one is hidden if its
    /// intersection with the first comes after that with the last (Maurer, Qi & Raghavan 2003).
    pub fn lower(&mut self, row: &mut [Nearest], repeats: bool) {
        let length = row.len();
        self.parabolas.resize(if repeats { 3 * length } else { length }, Parabola::default());
        let mut count = 0;
        let mut push = |at: f32, nearest: &Nearest| {
            if nearest.squared == f32::INFINITY {
                return;
            }
            let parabolas = &mut self.parabolas[..];
            while count >= 2 && hides(parabolas[count - 2], parabolas[count - 1], at, nearest.squared) {
                count -= 1;
            }
            parabolas[count] = Parabola { at, height: nearest.squared, site: nearest.site };
            count += 1;
        };
        if repeats {
            let period = length as f32;
            for shift in [-period, 0.0, period] {
                row.iter().enumerate().for_each(|(i, nearest)| push(i as f32 + shift, nearest));
            }
        } else {
            row.iter().enumerate().for_each(|(i, nearest)| push(i as f32, nearest));
        }
        let parabolas = &self.parabolas[..count];
        let Some(mut least) = parabolas.first() else { return };
        let mut rest = &parabolas[1..];
        for (i, out) in row.iter_mut().enumerate() {
            let from = |parabola: &Parabola| parabola.height + (i as f32 - parabola.at) * (i as f32 - parabola.at);
            let mut squared = from(least);
            while let Some((next, others)) = rest.split_first() {
                let of_next = from(next);
                if of_next >= squared {
                    break;
                }
                (least, squared, rest) = (next, of_next, others);
            }
            *out = Nearest { squared, site: least.site };
        }
    }
}

/// Returns whether the middle one of three parabolas is nowhere the least.
#[inline]
fn hides(first: Parabola, middle: Parabola, at: f32, height: f32) -> bool {
    let (before, after) = (middle.at - first.at, at - middle.at);
    let both = before + after;
    both * middle.height - after * first.height - before * height > before * after * both
}
