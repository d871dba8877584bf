//! Convex polyhedra with integer corners, and the volume of their common part in rational arithmetic.

use num_rational::BigRational;
use num_traits::{One, Zero};

/// A convex polyhedron: its corners, and its faces with the front outside.
#[derive(Clone, Debug)]
pub struct Piece {
    pub corners: Vec<[i128; 3]>,
    pub faces: Vec<[usize; 3]>,
}

type Point = [BigRational; 3];

impl Piece {
    pub fn cuboid(low: [i128; 3], size: [i128; 3]) -> Piece {
        let corner = |i: usize| [0, 1, 2].map(|axis| low[axis] + if i >> axis & 1 != 0 { size[axis] } else { 0 });
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let faces = quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
        Piece { corners: (0..8).map(corner).collect(), faces: faces.collect() }
    }

    /// Returns the tetrahedron of four points; `None` if they lie in a plane.
    pub fn tetrahedron(corners: [[i128; 3]; 4]) -> Option<Piece> {
        let [a, b, c, d] = corners;
        let volume = dot(cross(minus(b, a), minus(c, a)), minus(d, a));
        let faces = match volume {
            0 => return None,
            1.. => [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
            _ => [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]],
        };
        Some(Piece { corners: corners.to_vec(), faces: faces.to_vec() })
    }

    /// Returns the piece with coordinates that are larger by a factor.
    pub fn scaled(mut self, factor: i128) -> Piece {
        self.corners.iter_mut().for_each(|corner| *corner = corner.map(|x| factor * x));
        self
    }

    /// Returns the planes (n, o) of the faces, with n · x ≤ o inside, each plane once.
    fn planes(&self) -> Vec<([i128; 3], i128)> {
        let mut planes: Vec<([i128; 3], i128)> = Vec::new();
        for face in &self.faces {
            let [a, b, c] = face.map(|i| self.corners[i]);
            let normal = cross(minus(b, a), minus(c, a));
            let divisor = normal.iter().fold(0, |d, &x| gcd(d, x)).abs();
            let normal = normal.map(|n| n / divisor);
            let plane = (normal, dot(normal, a));
            if !planes.contains(&plane) {
                planes.push(plane);
            }
        }
        planes
    }
}

/// Returns the volume of the common part of convex pieces: a divergence sum over each face, clipped by all other pieces. Of faces
/// in the same plane that look the same way, only the first piece's counts; where two look at each other, nothing is common.
pub fn common_volume(pieces: &[&Piece]) -> BigRational {
    let planes: Vec<_> = pieces.iter().map(|piece| piece.planes()).collect();
    let is_opposite = |(n, o): &([i128; 3], i128), (m, p): &([i128; 3], i128)| n.map(|x| -x) == *m && -o == *p;
    let all = || planes.iter().flatten();
    if all().any(|a| all().any(|b| is_opposite(a, b))) {
        return BigRational::zero();
    }
    let mut six = BigRational::zero();
    for (i, piece) in pieces.iter().enumerate() {
        for face in &piece.faces {
            let [a, b, c] = face.map(|index| piece.corners[index]);
            let normal = cross(minus(b, a), minus(c, a));
            let mut polygon: Vec<Point> = [a, b, c].map(|corner| corner.map(rational)).to_vec();
            for (j, others) in planes.iter().enumerate().filter(|(j, _)| *j != i) {
                for (m, o) in others {
                    let is_same = dot(*m, a) == *o && dot(*m, b) == *o && dot(*m, c) == *o && dot(*m, normal) > 0;
                    match is_same {
                        true if j < i => polygon.clear(),
                        true => {}
                        false => polygon = clipped(&polygon, *m, *o),
                    }
                }
            }
            for k in 2..polygon.len() {
                six += determinant(&polygon[0], &polygon[k - 1], &polygon[k]);
            }
        }
    }
    six / rational(6)
}

/// Returns the part of a convex polygon with m · x ≤ o.
fn clipped(polygon: &[Point], m: [i128; 3], o: i128) -> Vec<Point> {
    let height = |p: &Point| (0..3).fold(rational(-o), |sum, i| sum + rational(m[i]) * &p[i]);
    let heights: Vec<BigRational> = polygon.iter().map(height).collect();
    let zero = BigRational::zero();
    let mut kept = Vec::new();
    for i in 0..polygon.len() {
        let j = (i + 1) % polygon.len();
        if heights[i] <= zero {
            kept.push(polygon[i].clone());
        }
        if (heights[i] < zero && heights[j] > zero) || (heights[i] > zero && heights[j] < zero) {
            let share = &heights[i] / (&heights[i] - &heights[j]);
            let rest = BigRational::one() - &share;
            kept.push([0, 1, 2].map(|axis| &polygon[i][axis] * &rest + &polygon[j][axis] * &share));
        }
    }
    kept
}

fn determinant(a: &Point, b: &Point, c: &Point) -> BigRational {
    let minor = |i: usize, j: usize| &b[i] * &c[j] - &b[j] * &c[i];
    &a[0] * minor(1, 2) + &a[1] * minor(2, 0) + &a[2] * minor(0, 1)
}

fn rational(x: i128) -> BigRational {
    BigRational::from_integer(x.into())
}

fn minus(a: [i128; 3], b: [i128; 3]) -> [i128; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: [i128; 3], b: [i128; 3]) -> [i128; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [i128; 3], b: [i128; 3]) -> i128 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn gcd(a: i128, b: i128) -> i128 {
    if b == 0 { a } else { gcd(b, a % b) }
}
