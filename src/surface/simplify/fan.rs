//! The distance between the triangles around a vertex before and after it is removed.
//!
//! Both are height fields over the same polygon, if no triangle is turned over when seen along their mean normal. Their difference
//! in height is then linear between the places where their sides meet, so that its largest values are found there: at the vertex
//! that is removed, and where sides before and after cross.

use glam::DVec3;

/// Rounding of a share.
const ROUNDED: f64 = 1e-9;

/// The triangles around a vertex, seen along their mean normal, and those in which another vertex takes its place.
#[derive(Default)]
pub(super) struct Fan {
    spokes: Vec<Spoke>,
    /// The crossings of sides before and after.
    crossings: Vec<Crossing>,
    /// The triangles after that the removed vertex lies in, and its difference in height from them.
    around_middle: Vec<usize>,
    at_middle: f64,
}

/// A side from the removed vertex, and the triangle that begins with it.
struct Spoke {
    /// Its end, and the number of the spoke with the triangle's third corner.
    end: u32,
    next: usize,
    /// Its end in coordinates with their origin at the vertex, z along the mean normal.
    at: DVec3,
    /// Whether the triangle stays, as it does not have the vertex that takes the place of the middle.
    stays: bool,
}

/// A crossing of a side before and a side after, by the numbers of the spokes with their ends.
struct Crossing {
    before: usize,
    after: usize,
    /// The difference in height.
    difference: f64,
}

impl Fan {
    /// Compares the triangles around a vertex with those in which the vertex `into` takes its place. Returns false where a triangle
    /// is turned over, so that they cannot be compared.
    ///
    /// `ends` gives the other two corners of each triangle, in its direction.
    pub fn compare(
        &mut self,
        middle: DVec3,
        into: u32,
        ends: impl Iterator<Item = [u32; 2]> + Clone,
        place: impl Fn(u32) -> DVec3,
    ) -> bool {
        let Fan { spokes, crossings, around_middle, at_middle } = self;
        spokes.clear();
        crossings.clear();
        around_middle.clear();
        let number = |end: u32| ends.clone().position(|[first, _]| first == end);
        for [end, other] in ends.clone() {
            let Some(next) = number(other) else { return false };
            spokes.push(Spoke { end, next, at: place(end) - middle, stays: end != into && other != into });
        }
        let Some(apex) = number(into) else { return false };
        let normal: DVec3 = spokes.iter().map(|spoke| spoke.at.cross(spokes[spoke.next].at)).sum();
        let Some(normal) = normal.try_normalize() else { return false };
        let (x, y) = normal.any_orthonormal_pair();
        for spoke in &mut *spokes {
            spoke.at = DVec3::new(x.dot(spoke.at), y.dot(spoke.at), normal.dot(spoke.at));
        }
        let apex = spokes[apex].at;
        *at_middle = 0.0;
        for (i, spoke) in spokes.iter().enumerate() {
            let [p, q] = [spoke.at, spokes[spoke.next].at];
            let area = turn(p - apex, q - apex);
            if turn(p, q) <= 0.0 || (spoke.stays && area <= 0.0) {
                return false;
            }
            let weights = DVec3::new(turn(q, apex), turn(apex, p), turn(p, q)) / area;
            if spoke.stays && weights.min_element() >= -ROUNDED {
                around_middle.push(i);
                *at_middle = at_middle.max(weights.dot(DVec3::new(p.z, q.z, apex.z)).abs());
            }
        }
        if around_middle.is_empty() {
            return false;
        }
        for (after, side) in spokes.iter().enumerate().filter(|(_, side)| side.end != into) {
            let along = side.at - apex;
            let (of_middle, squared) = (turn(along, -apex), along.x * along.x + along.y * along.y);
            for (before, spoke) in spokes.iter().enumerate() {
                let of_end = turn(along, spoke.at - apex);
                if of_middle * of_end < 0.0 {
                    let at = spoke.at * (of_middle / (of_middle - of_end));
                    let share = ((at.x - apex.x) * along.x + (at.y - apex.y) * along.y) / squared;
                    if (-ROUNDED..=1.0 + ROUNDED).contains(&share) {
                        let difference = (at.z - (apex.z + share * along.z)).abs();
                        crossings.push(Crossing { before, after, difference });
                    }
                }
            }
        }
        true
    }

    /// Returns the largest difference in height of a triangle before from those after.
    pub fn difference(&self, triangle: usize) -> f64 {
        let ends = [triangle, self.spokes[triangle].next];
        let crossings = self.crossings.iter().filter(|crossing| ends.contains(&crossing.before));
        crossings.map(|crossing| crossing.difference).fold(self.at_middle, f64::max)
    }

    /// Returns for each triangle after, in order, the largest error of those before that lie over it, plus the difference in height
    /// there.
    pub fn errors(&self, of: &[f64]) -> impl Iterator<Item = f64> {
        let before = |spoke: usize| self.spokes.iter().position(|other| other.next == spoke);
        let in_middle = of.iter().copied().fold(0.0, f64::max) + self.at_middle;
        self.spokes.iter().enumerate().filter(|(_, spoke)| spoke.stays).map(move |(i, spoke)| {
            let own = if self.around_middle.contains(&i) { in_middle } else { of[i] };
            let crossings = self.crossings.iter().filter(|crossing| [i, spoke.next].contains(&crossing.after));
            let at_crossing = |crossing: &Crossing| {
                let beside = before(crossing.before).map_or(0.0, |triangle| of[triangle]);
                of[crossing.before].max(beside) + crossing.difference
            };
            crossings.map(at_crossing).fold(own, f64::max)
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
                for [u, v] in inside {
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
                // The largest one is between two of the points.
                prop_assert!(difference <= largest + 0.3, "{largest} {difference}");
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
