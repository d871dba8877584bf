//! Brute force for Minkowski sums of heaps of convex pieces. The sum of two heaps is the union of the sums of their pieces, and
//! the sum of two convex pieces is the hull of the sums of their vertices. Every ray is clipped by every half space of every
//! hull, in rational arithmetic and with the perturbation of the sampling contract. This file uses nothing of the library.

use std::cmp::Ordering;

/// A point in space.
pub type Point = [i128; 3];

/// A rational number; the denominator is positive.
#[derive(Clone, Copy, Debug)]
struct Rational {
    numerator: i128,
    denominator: i128,
}

impl Rational {
    fn new(numerator: i128, denominator: i128) -> Rational {
        assert_ne!(denominator, 0);
        Rational { numerator: numerator * denominator.signum(), denominator: denominator.abs() }
    }

    fn cmp(self, other: Rational) -> Ordering {
        (self.numerator * other.denominator).cmp(&(other.numerator * self.denominator))
    }

    fn floor(self) -> i128 {
        self.numerator.div_euclid(self.denominator)
    }

    fn is_whole(self) -> bool {
        self.numerator % self.denominator == 0
    }
}

/// The place where a perturbed ray meets a plane, relative to the perturbed node at the same depth: the depth, and the parts of
/// ε₁, ε₂ and ε₃ that are added.
#[derive(Clone, Copy, Debug)]
pub struct Depth {
    value: Rational,
    epsilon: [Rational; 3],
}

impl Depth {
    fn cmp(&self, other: &Depth) -> Ordering {
        let by_epsilon = (0..3).map(|i| self.epsilon[i].cmp(other.epsilon[i])).find(|order| order.is_ne());
        self.value.cmp(other.value).then(by_epsilon.unwrap_or(Ordering::Equal))
    }

    /// Returns the largest even integer that is not above.
    fn floor(&self) -> i128 {
        self.value.floor().div_euclid(2) * 2
    }

    /// Returns the least even integer that is not below.
    fn ceil(&self) -> i128 {
        let floor = self.floor();
        floor + if self.value.is_whole() && self.value.floor() == floor { 0 } else { 2 }
    }

    /// Returns whether there is a gap between this depth and a later one: there is an odd position between their even roundings,
    /// upwards and downwards, or a node between them. Pixels have 2^`shift` steps.
    pub fn has_gap_to(&self, later: &Depth, shift: u32) -> bool {
        let nodes_before = |depth: i128| (depth + (1 << (shift - 1)) - 2).div_euclid(1 << shift);
        self.ceil() < later.floor() || nodes_before(self.nearest()) < nodes_before(later.nearest())
    }

    /// Returns the nearest even integer; of an odd one, the neighbour on the side that the perturbation points to.
    pub fn nearest(&self) -> i128 {
        let (whole, floor) = (self.value.floor(), self.floor());
        if self.value.is_whole() && whole != floor {
            let sign = self.epsilon.iter().map(|e| e.numerator.signum()).find(|&sign| sign != 0).unwrap_or(0);
            assert_ne!(sign, 0, "a plane that the rays cross moves against the nodes");
            return whole + sign;
        }
        floor + if whole == floor { 0 } else { 2 }
    }
}

/// The half space {x : n·x ≤ d}.
#[derive(Clone, Copy, Debug)]
pub struct HalfSpace {
    normal: Point,
    offset: i128,
}

impl HalfSpace {
    /// Returns whether a point lies inside, and not on the plane.
    pub fn holds_within(&self, point: Point) -> bool {
        dot(self.normal, point) < self.offset
    }
}

fn dot(a: Point, b: Point) -> i128 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

fn minus(a: Point, b: Point) -> Point {
    std::array::from_fn(|i| a[i] - b[i])
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Returns the half spaces that bound the hull of some points, each once.
pub fn hull(points: &[Point]) -> Vec<HalfSpace> {
    let mut found: Vec<HalfSpace> = Vec::new();
    for (i, &a) in points.iter().enumerate() {
        for (j, &b) in points.iter().enumerate().skip(i + 1) {
            for &c in &points[j + 1..] {
                let normal = cross(minus(b, a), minus(c, a));
                let divisor = normal.iter().fold(0, |g, &n| gcd(g, n.abs()));
                if divisor == 0 {
                    continue;
                }
                let normal = normal.map(|n| n / divisor);
                for normal in [normal, normal.map(|n| -n)] {
                    let offset = dot(normal, a);
                    let bounds = || points.iter().all(|&p| dot(normal, p) <= offset);
                    if !found.iter().any(|h| h.normal == normal && h.offset == offset) && bounds() {
                        found.push(HalfSpace { normal, offset });
                    }
                }
            }
        }
    }
    found
}

fn gcd(a: i128, b: i128) -> i128 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Returns the hull of all sums of a point of one piece and one of the other.
pub fn sum(a: &[Point], b: &[Point]) -> Vec<HalfSpace> {
    let points: Vec<Point> =
        a.iter().flat_map(|p| b.iter().map(move |q| std::array::from_fn(|i| p[i] + q[i]))).collect();
    hull(&points)
}

/// Returns {x : x + B ⊆ A} for a convex A.
pub fn eroded(a: &[Point], b: &[Point]) -> Vec<HalfSpace> {
    let mut bounds = hull(a);
    for half_space in &mut bounds {
        half_space.offset -= b.iter().map(|&p| dot(half_space.normal, p)).max().expect("B has points");
    }
    bounds
}

/// Returns the segment that a perturbed ray and a convex body share, if it has any length. The ray runs along `axis` through
/// `position`; the coordinate of `position` along `axis` is ignored.
pub fn clip(body: &[HalfSpace], axis: usize, position: Point) -> Option<(Depth, Depth)> {
    let (mut low, mut high): (Option<Depth>, Option<Depth>) = (None, None);
    let across = |n: Point| (0..3).filter(|&i| i != axis).map(|i| n[i] * position[i]).sum::<i128>();
    for half_space in body {
        let (n, along) = (half_space.normal, half_space.normal[axis]);
        let room = half_space.offset - across(n);
        if along == 0 {
            // For a ray in the plane itself, the perturbation decides on which side it is.
            let beyond = (0..3).filter(|&i| i != axis).map(|i| n[i].signum()).find(|&sign| sign != 0).unwrap_or(0);
            if room < 0 || room == 0 && beyond > 0 {
                return None;
            }
            continue;
        }
        let epsilon =
            std::array::from_fn(|i| if i == axis { Rational::new(-1, 1) } else { Rational::new(-n[i], along) });
        let depth = Depth { value: Rational::new(room, along), epsilon };
        let (bound, tighter) = match along > 0 {
            true => (&mut high, Ordering::Less),
            false => (&mut low, Ordering::Greater),
        };
        if bound.is_none_or(|bound| depth.cmp(&bound) == tighter) {
            *bound = Some(depth);
        }
    }
    let (low, high) = (low.expect("a bounded body"), high.expect("a bounded body"));
    (low.cmp(&high) == Ordering::Less).then_some((low, high))
}

/// Returns the union of spans as disjoint spans in order. Gaps that are too short to count are closed.
pub fn union(mut spans: Vec<(Depth, Depth)>, shift: u32) -> Vec<(Depth, Depth)> {
    spans.sort_by(|a, b| a.0.cmp(&b.0));
    let mut united: Vec<(Depth, Depth)> = Vec::new();
    for span in spans {
        match united.last_mut() {
            Some(last) if !last.1.has_gap_to(&span.0, shift) => {
                if span.1.cmp(&last.1) == Ordering::Greater {
                    last.1 = span.1;
                }
            }
            _ => united.push(span),
        }
    }
    united
}

/// Returns the parts of `from` that the disjoint spans of `taken` leave.
pub fn minus_spans(from: (Depth, Depth), taken: &[(Depth, Depth)]) -> Vec<(Depth, Depth)> {
    let mut left = Vec::new();
    let (mut at, end) = from;
    for (low, high) in taken {
        if low.cmp(&at) == Ordering::Greater && at.cmp(&end) == Ordering::Less {
            left.push((at, if low.cmp(&end) == Ordering::Less { *low } else { end }));
        }
        if high.cmp(&at) == Ordering::Greater {
            at = *high;
        }
    }
    if at.cmp(&end) == Ordering::Less {
        left.push((at, end));
    }
    left
}
