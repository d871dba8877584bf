//! The distance between the triangles around a vertex before and after it is removed.
//!
//! Both are height fields over the same polygon, if seen along their mean normal no triangle is turned over and the polygon goes
//! around the vertex once. Their difference in height is then linear between the places where their sides meet, so that its largest
//! values are found there: at the vertex that is removed, and where sides before and after cross.

use glam::DVec3;

/// Rounding of a share.
const ROUNDED: f64 = 1e-9;

/// Most triangles that are compared: the time grows with the square.
const MOST: usize = 128;

/// The triangles around a vertex, seen along their mean normal, and those in which another vertex takes its place.
#[derive(Default)]
pub(super) struct Fan {
    spokes: Vec<Spoke>,
    /// The crossings of sides before and after.
    crossings: Vec<Crossing>,
    /// The triangles after over which the removed vertex lies, more than one if it lies over a side, and its height above them.
    under_middle: Vec<usize>,
    at_middle: f64,
    /// For each spoke the largest error and difference at the crossings of the side after with the same end.
    of_sides: Vec<f64>,
}

/// A side from the removed vertex, and the triangle that begins with it.
struct Spoke {
    /// Its end, and the numbers of the spokes with the triangle's third corner, and before it.
    end: u32,
    next: usize,
    previous: usize,
    /// Its end in coordinates with their origin at the vertex, z along the mean normal.
    at: DVec3,
    /// Whether the triangle stays, as it does not have the vertex that takes the place of the middle.
    stays: bool,
    /// The largest difference in height along the side.
    difference: f64,
}

/// A crossing of a side before and a side after, by the numbers of the spokes with their ends.
struct Crossing {
    before: usize,
    after: usize,
    /// The difference in height.
    difference: f64,
}

impl Fan {
    /// Compares the triangles around a vertex with those in which the vertex `into` takes its place. Returns false if they cannot be
    /// compared.
    ///
    /// `ends` gives the other two corners of each triangle, in its direction.
    pub fn compare(
        &mut self,
        middle: DVec3,
        into: u32,
        ends: impl ExactSizeIterator<Item = [u32; 2]> + Clone,
        place: impl Fn(u32) -> DVec3,
    ) -> bool {
        let Fan { spokes, crossings, under_middle, at_middle, .. } = self;
        spokes.clear();
        crossings.clear();
        under_middle.clear();
        if ends.len() > MOST {
            return false;
        }
        for [end, other] in ends.clone() {
            let (at, stays) = (place(end) - middle, end != into && other != into);
            spokes.push(Spoke { end, next: 0, previous: 0, at, stays, difference: 0.0 });
        }
        for (i, [_, other]) in ends.enumerate() {
            let Some(next) = spokes.iter().position(|spoke| spoke.end == other) else { return false };
            spokes[i].next = next;
            spokes[next].previous = i;
        }
        let Some(apex) = spokes.iter().position(|spoke| spoke.end == into) else { return false };
        let normal: DVec3 = spokes.iter().map(|spoke| spoke.at.cross(spokes[spoke.next].at)).sum();
        let Some(normal) = normal.try_normalize() else { return false };
        let (x, y) = normal.any_orthonormal_pair();
        for spoke in &mut *spokes {
            spoke.at = DVec3::new(x.dot(spoke.at), y.dot(spoke.at), normal.dot(spoke.at));
        }
        let apex = spokes[apex].at;
        let mut turns = 0;
        *at_middle = 0.0;
        for (i, spoke) in spokes.iter().enumerate() {
            let [p, q] = [spoke.at, spokes[spoke.next].at];
            let area = turn(p - apex, q - apex);
            if turn(p, q) <= 0.0 || (spoke.stays && area <= 0.0) {
                return false;
            }
            turns += usize::from(p.y < 0.0 && q.y >= 0.0);
            let weights = DVec3::new(turn(q, apex), turn(apex, p), turn(p, q)) / area;
            if spoke.stays && weights.min_element() >= -ROUNDED {
                under_middle.push(i);
                *at_middle = at_middle.max(weights.dot(DVec3::new(p.z, q.z, apex.z)).abs());
            }
        }
        if turns != 1 || under_middle.is_empty() {
            return false;
        }
        for after in 0..spokes.len() {
            if spokes[after].end == into {
                continue;
            }
            let along = spokes[after].at - apex;
            let (of_middle, squared) = (turn(along, -apex), along.x * along.x + along.y * along.y);
            for (before, spoke) in spokes.iter_mut().enumerate() {
                let of_end = turn(along, spoke.at - apex);
                if (of_middle < 0.0 && of_end > 0.0) || (of_middle > 0.0 && of_end < 0.0) {
                    let at = spoke.at * (of_middle / (of_middle - of_end));
                    let share = ((at.x - apex.x) * along.x + (at.y - apex.y) * along.y) / squared;
                    if (-ROUNDED..=1.0 + ROUNDED).contains(&share) {
                        let difference = (at.z - (apex.z + share * along.z)).abs();
                        spoke.difference = spoke.difference.max(difference);
                        crossings.push(Crossing { before, after, difference });
                    }
                }
            }
        }
        true
    }

    /// Returns the largest difference in height of a triangle before from those after.
    pub fn difference(&self, triangle: usize) -> f64 {
        let spoke = &self.spokes[triangle];
        self.at_middle.max(spoke.difference).max(self.spokes[spoke.next].difference)
    }

    /// Returns for each triangle after, in order, the largest of the errors of those before that lie over it, plus the difference
    /// in height there.
    pub fn errors(&mut self, of: &[f64]) -> impl Iterator<Item = f64> {
        let Fan { spokes, crossings, under_middle, at_middle, of_sides } = self;
        of_sides.clear();
        of_sides.resize(spokes.len(), 0.0);
        for crossing in &*crossings {
            let beside = of[crossing.before].max(of[spokes[crossing.before].previous]);
            of_sides[crossing.after] = of_sides[crossing.after].max(beside + crossing.difference);
        }
        let in_middle = of.iter().copied().fold(0.0, f64::max) + *at_middle;
        spokes.iter().enumerate().filter(|(_, spoke)| spoke.stays).map(move |(i, spoke)| {
            let own = if under_middle.contains(&i) { in_middle } else { of[i] };
            own.max(of_sides[i]).max(of_sides[spoke.next])
        })
    }
}

/// Returns twice the area of a triangle with a corner at the origin, seen along z.
fn turn(a: DVec3, b: DVec3) -> f64 {
    a.x * b.y - a.y * b.x
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Returns where a line meets a triangle, as a multiple of its direction; `None` beside it.
    fn along_line(from: DVec3, direction: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
        let normal = (b - a).cross(c - a);
        let at = (a - from).dot(normal) / direction.dot(normal);
        let point = from + direction * at;
        let is_inside = [(a, b), (b, c), (c, a)].into_iter().all(|(p, q)| (q - p).cross(point - p).dot(normal) > 1e-9);
        is_inside.then_some(at)
    }

    proptest! {
        #[test]
        fn differences_are_those_of_points_along_the_normal(
            ring in prop::collection::vec((0.3..1.0f64, -0.5..0.5f64), 3..9),
            middle in (-0.2..0.2f64, -0.2..0.2f64, -0.5..0.5f64),
            errors in prop::collection::vec(0.0..0.3f64, 9),
            tilt in -1.0..1.0f64,
        ) {
            let count = ring.len();
            let corner = |i: usize| {
                let turn = std::f64::consts::TAU * i as f64 / count as f64;
                let (radius, height) = ring[i];
                DVec3::new(radius * turn.cos(), radius * turn.sin(), height + tilt * radius * turn.cos())
            };
            let middle = DVec3::from(middle);
            let places: Vec<DVec3> = (0..count).map(corner).collect();
            let ends = (0..count as u32).map(|i| [i, (i + 1) % count as u32]);
            let mut fan = Fan::default();
            prop_assume!(fan.compare(middle, 0, ends.clone(), |end| places[end as usize]));
            let normal: DVec3 = (0..count).map(|i| places[i].cross(places[(i + 1) % count])).sum::<DVec3>().normalize();
            let before: Vec<[DVec3; 3]> = ends.map(|[p, q]| [middle, places[p as usize], places[q as usize]]).collect();
            let after: Vec<[DVec3; 3]> = (1..count - 1).map(|i| [places[0], places[i], places[i + 1]]).collect();
            let of_after: Vec<f64> = fan.errors(&errors[..count]).collect();
            prop_assert_eq!(of_after.len(), after.len());
            let mut largest = vec![0.0f64; count];
            for (i, [a, b, c]) in before.iter().enumerate() {
                let inside = (1..24).flat_map(|u| (0..24 - u).map(move |v| [u, v].map(|i| f64::from(i) / 24.0)));
                // Differences are largest at the middle, and on the sides that end there.
                let beside = (0..480).map(|i| f64::from(i) / 480.0).flat_map(|along| [[along.max(1e-3), 0.0], [1e-3, along]]);
                for [u, v] in inside.chain(beside) {
                    let point = *a + (*b - *a) * u + (*c - *a) * (v + 1e-3);
                    for (triangle, error) in after.iter().zip(&of_after) {
                        if let Some(difference) = along_line(point, normal, *triangle) {
                            let difference = difference.abs();
                            largest[i] = largest[i].max(difference);
                            prop_assert!(errors[i] + difference <= error + 1e-9, "{} {difference} {error}", errors[i]);
                        }
                    }
                }
            }
            for (i, largest) in largest.into_iter().enumerate() {
                let difference = fan.difference(i);
                prop_assert!(largest <= difference + 1e-9, "{largest} {difference}");
                // The largest one is near one of the points.
                prop_assert!(difference <= largest + 0.1, "{largest} {difference}");
            }
        }
    }

    #[test]
    fn a_pyramid_differs_from_its_base_by_its_height() {
        let places = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]].map(DVec3::from_array);
        let ends = (0..4).map(|i| [i, (i + 1) % 4]);
        let mut fan = Fan::default();
        let place = |end: u32| places[end as usize];
        assert!(fan.compare(DVec3::new(0.1, 0.2, 0.5), 0, ends.clone(), place));
        assert!((0..4).all(|triangle| (fan.difference(triangle) - 0.5).abs() < 1e-12));
        let errors: Vec<f64> = fan.errors(&[0.1, 0.2, 0.3, 0.0]).collect();
        // The apex lies over the first; the side from it to (0, −1, 0) crosses the base's diagonal at a lower height.
        assert!(errors.len() == 2 && (errors[0] - 0.8).abs() < 1e-12, "{errors:?}");
        assert!(0.3 < errors[1] && errors[1] < 0.8, "{errors:?}");
        // The apex beyond the base: the triangles are turned over.
        assert!(!fan.compare(DVec3::new(2.0, 2.0, 0.5), 0, ends, place));
    }
}
