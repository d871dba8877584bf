//! The line common to two planes: where it crosses third planes, and in which order.
//!
//! A plane n · x = o is a row (n, o) of four numbers. The 2 × 2 minors of two rows are the Plücker coordinates of their line; products
//! of them with a third row give the point common to three planes, and those with the minors of two other rows the determinant of
//! all four rows, whose sign tells on which side of the fourth plane that point lies.

use std::cell::OnceCell;

use bnum::types::I512;
use glam::DVec3;

use super::polynomial::{Number, Polynomial, sum_of_products};
use super::signs::{HALF_ULP, Located, Move, Plane, Time, components, first_move_is_positive};

/// The columns of each minor. The determinant of four rows is the sum of the products of minors with those of the other two rows in
/// reverse order, as the columns of both are an even permutation of all.
const COLUMNS: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [3, 1], [2, 3]];

/// The line common to two planes.
pub(super) struct CommonLine<'p, 'b> {
    planes: [&'p Plane<'b>; 2],
    resting: Minors<I512>,
    growing: OnceCell<Minors<Polynomial>>,
}

impl<'p, 'b> CommonLine<'p, 'b> {
    pub fn of(planes: [&'p Plane<'b>; 2]) -> CommonLine<'p, 'b> {
        CommonLine { planes, resting: Minors::at(Time::Resting, planes), growing: OnceCell::new() }
    }

    fn growing(&self) -> &Minors<Polynomial> {
        self.growing.get_or_init(|| Minors::at(Time::Growing, self.planes))
    }

    /// Returns the point in which the line crosses a third plane, rounded once: at infinity if growth alone turns them, so that they
    /// are not parallel; `None` if they stay parallel.
    pub fn crossing(&self, third: &Plane) -> Option<Located> {
        let at = match self.resting.meet(&row(third, Time::Resting)) {
            Some(at) => at,
            None => self.growing().meet(&row(third, Time::Growing))?,
        };
        Some(Located { at, error: 4.0 * HALF_ULP * at.length() })
    }

    /// Returns whether the crossing with a third plane, which is not parallel, lies in front of a fourth one.
    pub fn crossing_is_in_front(&self, third: &Plane, crossing: &Located, fourth: &Plane) -> bool {
        fourth.is_certainly_in_front(crossing).unwrap_or_else(|| self.is_exactly_in_front(third, fourth))
    }

    #[cold]
    fn is_exactly_in_front(&self, third: &Plane, fourth: &Plane) -> bool {
        // By Cramer's rule the height above the fourth plane is minus the quotient of the determinants of four rows and of three normals.
        let beside = Minors::<I512>::at(Time::Resting, [third, fourth]);
        let of_four = self.resting.determinant_with(&beside).sign();
        let of_three = self.resting.determinant(&row(third, Time::Resting)).sign();
        if let (Some(of_four), Some(of_three)) = (of_four, of_three) {
            return of_four != of_three;
        }
        let (line, beside) = (self.growing(), Minors::<Polynomial>::at(Time::Growing, [third, fourth]));
        let of_three = line.determinant(&row(third, Time::Growing));
        let of_four = line.determinant_with(&beside).sign().unwrap_or_else(|| {
            // Moving a plane by a vector adds the product with its normal to its offset.
            let [f, g] = self.planes;
            let rows = [f, g, third, fourth].map(|plane| row::<Polynomial>(plane, Time::Growing));
            let bodies = [f.body, g.body, third.body, fourth.body];
            let factors = [
                (beside.determinant(&rows[1]), true),
                (beside.determinant(&rows[0]), false),
                (line.determinant(&rows[3]), true),
                (line.determinant(&rows[2]), false),
            ];
            let moves = [0, 1, 2, 3].map(|i| {
                let ([x, y, z, _], (factor, is_negative)) = (&rows[i], &factors[i]);
                Move { body: bodies[i], normal: [x, y, z], factor, is_negative: *is_negative }
            });
            first_move_is_positive(&moves).unwrap_or_else(|| {
                fourth.note_touching();
                true
            })
        });
        Some(of_four) != of_three.sign()
    }
}

/// Returns the components of a plane's normal n and the offset o = n · x of its points.
fn row<T: Number>(plane: &Plane, time: Time) -> [T; 4] {
    let (normal, offset) = plane.equation(time);
    let [x, y, z] = components(normal);
    [x, y, z, T::of(&offset)]
}

/// The minors of the rows of two planes, by [`COLUMNS`].
struct Minors<T>([T; 6]);

impl<T: Number> Minors<T> {
    fn at(time: Time, planes: [&Plane; 2]) -> Minors<T> {
        let [a, b] = planes.map(|plane| row::<T>(plane, time));
        Minors(COLUMNS.map(|[i, j]| sum_of_products([(&a[i], &b[j], false), (&a[j], &b[i], true)])))
    }

    /// Returns the determinant of the normals of both planes and of a third one.
    fn determinant(&self, [x, y, z, _]: &[T; 4]) -> T {
        let [xy, xz, _, yz, ..] = &self.0;
        sum_of_products([(x, yz, false), (y, xz, true), (z, xy, false)])
    }

    /// Returns the determinant of the rows of both planes and of two others.
    fn determinant_with(&self, others: &Minors<T>) -> T {
        let mut sum = T::of(&[]);
        self.0.iter().zip(others.0.iter().rev()).for_each(|(one, other)| sum.add_product(one, other, false));
        sum
    }

    /// Returns the point common with a third plane, by Cramer's rule; `None` if it is parallel.
    fn meet(&self, third: &[T; 4]) -> Option<DVec3> {
        let determinant = self.determinant(third);
        determinant.sign()?;
        let [x, y, z, offset] = third;
        let [xy, xz, xo, yz, oy, zo] = &self.0;
        let at = [
            [(offset, yz, false), (z, oy, false), (y, zo, false)],
            [(offset, xz, true), (x, zo, true), (z, xo, false)],
            [(offset, xy, false), (y, xo, true), (x, oy, true)],
        ];
        // The same for all orders of the planes: also the sign of zero.
        Some(DVec3::from_array(at.map(|products| sum_of_products(products).quotient(&determinant) + 0.0)))
    }
}

#[cfg(test)]
mod tests {
    use num_bigint::BigInt;
    use num_traits::{Signed, ToPrimitive, Zero};
    use proptest::prelude::*;

    use super::super::signs::Vertex;
    use super::super::signs::tests::{growing, tetrahedron};
    use super::*;

    /// Bits by which growth is smaller than any coefficient, and each translation than the one before.
    const GROWTH: usize = 420;
    const TRANSLATION: usize = 4300;

    /// Which of the infinitesimals are numbers.
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Stage {
        Rest,
        Growth,
        Translation,
    }

    impl Stage {
        const ALL: [Stage; 3] = [Stage::Rest, Stage::Growth, Stage::Translation];

        /// Returns a point with all that moves it, in small units; there are three bodies.
        fn point(self, vertex: &Vertex) -> [BigInt; 3] {
            let unit = [0, GROWTH, 10 * TRANSLATION][self as usize];
            [0, 1, 2].map(|axis| {
                let mut at = BigInt::from(vertex.at[axis] as i64) << unit;
                if self != Stage::Rest {
                    at += BigInt::from(vertex.speed()[axis]) << (unit - GROWTH);
                }
                if self == Stage::Translation {
                    at += BigInt::from(1) << (unit - TRANSLATION * (1 + 3 * (2 - vertex.body as usize) + axis));
                }
                at
            })
        }

        fn row(self, plane: &Plane) -> Vec<BigInt> {
            let [a, b, c] = plane.corners.each_ref().map(|corner| self.point(corner));
            let from_a = |point: [BigInt; 3]| [0, 1, 2].map(|axis| &point[axis] - &a[axis]);
            let (u, v) = (from_a(b), from_a(c));
            let mut row: Vec<BigInt> = [[1, 2], [2, 0], [0, 1]].map(|[i, j]| &u[i] * &v[j] - &u[j] * &v[i]).into();
            row.push((0..3).map(|axis| &row[axis] * &a[axis]).sum());
            row
        }
    }

    /// Returns the determinant of some columns of as many rows, by cofactors.
    fn determinant(rows: &[Vec<BigInt>], columns: &[usize]) -> BigInt {
        let Some((first, others)) = rows.split_first() else { return BigInt::from(1) };
        let mut sum = BigInt::zero();
        for (place, &column) in columns.iter().enumerate().filter(|(_, column)| !first[**column].is_zero()) {
            let left: Vec<usize> = columns.iter().copied().filter(|other| *other != column).collect();
            let product = &first[column] * determinant(others, &left);
            sum += if place % 2 == 0 { product } else { -product };
        }
        sum
    }

    /// Returns the first determinant that is not zero, with its stage.
    fn first(planes: &[&Plane], columns: &[usize]) -> Option<(BigInt, Stage)> {
        Stage::ALL.into_iter().find_map(|stage| {
            let rows: Vec<_> = planes.iter().map(|plane| stage.row(plane)).collect();
            let found = determinant(&rows, columns);
            (!found.is_zero()).then_some((found, stage))
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        /// Of few positions, so that planes often coincide, are parallel, or have a common point.
        #[test]
        fn points_lie_where_long_integers_say(
            corners in prop::array::uniform3(tetrahedron()), rates in prop::array::uniform3(-1i32..2), seed in 0..1000u32,
        ) {
            let bodies = growing(&corners, &rates);
            let random = |below: u32, salt: u32| (seed.wrapping_mul(2654435761).wrapping_add(salt * 40503) >> 7) % below;
            for salt in 0..8 {
                let face = |body: u32, which: u32| bodies.plane(4 * body + random(4, 10 * salt + which));
                let (f, g, third) = (face(0, 1), face(1, 2), face(2, 3));
                let fourth = face(random(3, 10 * salt), 4);
                let line = CommonLine::of([&f, &g]);
                let expected = first(&[&f, &g, &third], &[0, 1, 2]);
                let crossing = line.crossing(&third);
                // Translations turn no plane.
                prop_assert_eq!(crossing.is_some(), expected.is_some());
                let (Some(crossing), Some((of_three, stage))) = (crossing, expected) else { continue };
                let orders = [[&g, &third, &f], [&third, &g, &f]].map(|[p, q, r]| CommonLine::of([p, q]).crossing(r).unwrap().at);
                prop_assert!(orders.iter().all(|at| at.to_array().map(f64::to_bits) == crossing.at.to_array().map(f64::to_bits)));
                if stage == Stage::Rest {
                    let rows = [&f, &g, &third].map(|plane| stage.row(plane));
                    for axis in 0..3 {
                        let columns: Vec<usize> = (0..3).map(|column| if column == axis { 3 } else { column }).collect();
                        let at = determinant(&rows, &columns).to_f64().unwrap() / of_three.to_f64().unwrap();
                        prop_assert!((at - crossing.at[axis]).abs() <= crossing.error, "{} {}", at, crossing.at[axis]);
                    }
                }
                let Some((of_four, _)) = first(&[&f, &g, &third, &fourth], &[0, 1, 2, 3]) else { continue };
                let is_in_front = of_four.is_positive() != of_three.is_positive();
                prop_assert_eq!(line.crossing_is_in_front(&third, &crossing, &fourth), is_in_front);
                prop_assert_eq!(line.is_exactly_in_front(&third, &fourth), is_in_front);
            }
        }
    }
}
