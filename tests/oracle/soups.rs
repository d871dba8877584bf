//! Test geometry on the lattice: triangle soups, closed by construction, at places that are hardest to sample.
//!
//! Every generator takes a random source and a [`Frame`] and returns even positions within the frame. All soups are closed: every
//! edge occurs as often in one direction as in the other, up to edges of no length. The one exception to orientation is
//! [`disoriented`], whose edges merely occur an even number of times. Equal seeds give equal soups on every machine.

// Each test binary that includes this file uses a part of it.
#![allow(dead_code)]

use std::collections::BTreeMap;

use crate::testing::random::Random;

/// The part of the lattice that a soup occupies: pixels of `2^shift` steps (2 to 26), and their numbers.
/// Shapes on oblique directions need at least six pixels an axis.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    pub shift: u32,
    pub rays: [u32; 3],
}

impl Frame {
    /// Returns the greatest even position along an axis; it is the end of the axis unless that is 2³⁰ itself.
    pub fn most(&self, axis: usize) -> i32 {
        ((i64::from(self.rays[axis])) << self.shift).min((1 << 30) - 2) as i32
    }

    /// Returns the least of `most` over the axes.
    pub fn side(&self) -> i32 {
        (0..3).map(|axis| self.most(axis)).min().expect("three axes")
    }

    fn holds(&self, soup: &Soup) -> bool {
        soup.positions.iter().all(|position| (0..3).all(|axis| (0..=self.most(axis)).contains(&position[axis])))
    }
}

/// Triangles by index into even positions.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Soup {
    pub positions: Vec<[i32; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

impl Soup {
    fn push(&mut self, corners: [[i32; 3]; 3]) {
        let first = self.positions.len() as u32;
        self.positions.extend(corners);
        self.triangles.push([first, first + 1, first + 2]);
    }

    /// Adds the quadrilateral a b c d as two triangles, divided along either diagonal.
    fn push_quad(&mut self, [a, b, c, d]: [[i32; 3]; 4], along_ac: bool) {
        if along_ac {
            self.push([a, b, c]);
            self.push([a, c, d]);
        } else {
            self.push([a, b, d]);
            self.push([b, c, d]);
        }
    }

    /// Adds all of another soup.
    pub fn add(&mut self, other: &Soup) {
        let first = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + first)));
    }

    /// Returns the corner positions of every triangle.
    pub fn corners(&self) -> impl Iterator<Item = [[i32; 3]; 3]> + '_ {
        self.triangles.iter().map(|triangle| triangle.map(|vertex| self.positions[vertex as usize]))
    }

    /// Returns the same surface turned inside out.
    pub fn inverted(&self) -> Self {
        Self {
            positions: self.positions.clone(),
            triangles: self.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(),
        }
    }

    pub fn translated(&self, by: [i32; 3]) -> Self {
        Self { positions: self.positions.iter().map(|&p| plus(p, by)).collect(), triangles: self.triangles.clone() }
    }

    /// Returns the same triangles over positions without repeats, in sorted order.
    pub fn welded(&self) -> Self {
        let mut positions = self.positions.clone();
        positions.sort_unstable();
        positions.dedup();
        let index = |vertex: u32| {
            positions.binary_search(&self.positions[vertex as usize]).expect("every position was kept") as u32
        };
        let triangles = self.triangles.iter().map(|triangle| triangle.map(index)).collect();
        Self { positions, triangles }
    }

    /// Counts how often each edge between different positions occurs, as (forwards, backwards).
    fn edges(&self) -> BTreeMap<([i32; 3], [i32; 3]), (u32, u32)> {
        let mut edges = BTreeMap::<_, (u32, u32)>::new();
        for [a, b, c] in self.corners() {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                match from.cmp(&to) {
                    std::cmp::Ordering::Less => edges.entry((from, to)).or_default().0 += 1,
                    std::cmp::Ordering::Greater => edges.entry((to, from)).or_default().1 += 1,
                    std::cmp::Ordering::Equal => {}
                }
            }
        }
        edges
    }

    /// Returns whether every edge occurs an even number of times.
    pub fn is_closed(&self) -> bool {
        self.edges().values().all(|(forwards, backwards)| (forwards + backwards) % 2 == 0)
    }

    /// Returns whether every edge occurs as often forwards as backwards.
    pub fn is_oriented(&self) -> bool {
        self.edges().values().all(|(forwards, backwards)| forwards == backwards)
    }
}

fn plus(a: [i32; 3], b: [i32; 3]) -> [i32; 3] {
    std::array::from_fn(|axis| a[axis] + b[axis])
}

fn minus(a: [i32; 3], b: [i32; 3]) -> [i32; 3] {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

fn times(a: [i32; 3], factor: i32) -> [i32; 3] {
    a.map(|coordinate| coordinate * factor)
}

/// Returns the even integer nearest to a coordinate; the greater of two that are equally near.
pub fn rounded_to_even(coordinate: f64) -> i32 {
    (coordinate / 2.0 + 0.5).floor() as i32 * 2
}

/// Returns `point` turned by `angle` about the line through `centre` along `direction`, rounded to even positions.
pub fn rotated(point: [i32; 3], centre: [f64; 3], direction: [f64; 3], angle: f64) -> [i32; 3] {
    let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
    let axis = direction.map(|d| d / length);
    let arm: [f64; 3] = std::array::from_fn(|i| f64::from(point[i]) - centre[i]);
    let along: f64 = (0..3).map(|i| axis[i] * arm[i]).sum();
    let (sin, cos) = angle.sin_cos();
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let across = axis[j] * arm[k] - axis[k] * arm[j];
        rounded_to_even(centre[i] + arm[i] * cos + across * sin + axis[i] * along * (1.0 - cos))
    })
}

/// The places where the vertices of a shape fall.
#[derive(Clone, Copy, Debug)]
enum Placement {
    /// Anywhere in the frame.
    Anywhere,
    /// One step from a node along every axis, so that edges run through nodes and faces close over them.
    BesideNodes,
    /// On the boundaries of pixels.
    OnPixelBoundaries,
    /// On the boundary of the frame or within a few steps of it.
    AtTheEnds,
    /// Within a few pixels of one place.
    Crowded([i32; 3]),
}

impl Placement {
    fn random(random: &mut Random, frame: &Frame) -> Self {
        match random.below(6) {
            0 => Self::Anywhere,
            1 | 2 => Self::BesideNodes,
            3 => Self::OnPixelBoundaries,
            4 => Self::AtTheEnds,
            _ => Self::Crowded(Self::Anywhere.vertex(random, frame)),
        }
    }

    fn vertex(self, random: &mut Random, frame: &Frame) -> [i32; 3] {
        let step = 1 << frame.shift;
        std::array::from_fn(|axis| {
            let most = frame.most(axis);
            let pixel = random.below(frame.rays[axis] as usize) as i32;
            let position = match self {
                Self::Anywhere => random.even(0, most),
                Self::BesideNodes => pixel * step + step / 2 + random.choose(&[0, 2]),
                Self::OnPixelBoundaries => (pixel + random.choose(&[0, 1])) * step,
                Self::AtTheEnds => random.choose(&[0, most]) + random.even(-6, 6),
                Self::Crowded(place) => place[axis] + random.even(-3 * step, 3 * step),
            };
            position.clamp(0, most)
        })
    }
}

/// Returns a tetrahedron that faces outwards. A flat one keeps the order of its corners: it is closed all the same.
pub fn tetrahedron([a, b, c, d]: [[i32; 3]; 4]) -> Soup {
    let [u, v, w] = [b, c, d].map(|corner| minus(corner, a).map(i128::from));
    let volume =
        u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) + u[2] * (v[0] * w[1] - v[1] * w[0]);
    let mut soup = Soup::default();
    for corners in [[a, c, b], [a, b, d], [b, c, d], [c, a, d]] {
        soup.push(corners);
    }
    if volume < 0 { soup.inverted() } else { soup }
}

/// Returns the octahedron of all points with |x − centre| + |y − centre| + |z − centre| ≤ radius.
pub fn octahedron(centre: [i32; 3], radius: i32) -> Soup {
    let tip = |axis: usize, sign: i32| {
        let mut tip = centre;
        tip[axis] += sign * radius;
        tip
    };
    let mut soup = Soup::default();
    for signs in 0..8 {
        let sign: [i32; 3] = std::array::from_fn(|axis| if signs >> axis & 1 == 0 { 1 } else { -1 });
        let [a, b, c] = std::array::from_fn(|axis| tip(axis, sign[axis]));
        soup.push(if sign.iter().product::<i32>() > 0 { [a, b, c] } else { [a, c, b] });
    }
    soup
}

/// Returns the box between two opposite corners, the first the lesser on every axis.
pub fn cuboid(from: [i32; 3], to: [i32; 3]) -> Soup {
    let edge = |axis: usize| {
        let mut edge = [0; 3];
        edge[axis] = to[axis] - from[axis];
        edge
    };
    brick(&mut Random::new(0), from, [edge(0), edge(1), edge(2)], [1; 3])
}

/// Returns the parallelepiped over `count[i]` steps of `steps[i]` from a corner, with each face divided into that grid of
/// quadrilaterals. It faces outwards if the steps form a right-handed triple.
fn brick(random: &mut Random, corner: [i32; 3], steps: [[i32; 3]; 3], count: [i32; 3]) -> Soup {
    let mut soup = Soup::default();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for i in 0..count[u] {
            for j in 0..count[v] {
                let near = plus(corner, plus(times(steps[u], i), times(steps[v], j)));
                let far = plus(near, times(steps[axis], count[axis]));
                let quad = |p| [p, plus(p, steps[u]), plus(p, plus(steps[u], steps[v])), plus(p, steps[v])];
                soup.push_quad(quad(far), random.chance(2));
                let [a, b, c, d] = quad(near);
                soup.push_quad([a, d, c, b], random.chance(2));
            }
        }
    }
    soup
}

/// Returns the cone from one apex over a closed loop, less the cone from another.
pub fn double_cone(rim: &[[i32; 3]], first: [i32; 3], second: [i32; 3]) -> Soup {
    let mut soup = Soup::default();
    for (index, &from) in rim.iter().enumerate() {
        let to = rim[(index + 1) % rim.len()];
        soup.push([from, to, first]);
        soup.push([to, from, second]);
    }
    soup
}

/// Draws until a soup lies within the frame. Draws are small often enough for this to end.
fn within(random: &mut Random, frame: &Frame, draw: impl Fn(&mut Random) -> Soup) -> Soup {
    loop {
        let soup = draw(random);
        if frame.holds(&soup) {
            return soup;
        }
    }
}

/// Draws one to four tetrahedra, each with a placement of its own.
pub fn tetrahedra(random: &mut Random, frame: &Frame) -> Soup {
    let mut soup = Soup::default();
    for _ in 0..=random.below(4) {
        let placement = Placement::random(random, frame);
        soup.add(&tetrahedron(std::array::from_fn(|_| placement.vertex(random, frame))));
    }
    soup
}

/// Draws one to three octahedra: edges of 45° through nodes, and faces whose depth at a node is an even integer.
pub fn octahedra(random: &mut Random, frame: &Frame) -> Soup {
    let mut soup = Soup::default();
    for _ in 0..=random.below(3) {
        let most = random.choose(&[frame.side() / 2, frame.side() / 4, 1 << frame.shift, 4]).max(2) / 2 * 2;
        soup.add(&within(random, frame, |random| {
            octahedron(Placement::random(random, frame).vertex(random, frame), random.even(2, most))
        }));
    }
    soup
}

/// Draws one to four boxes along the axes, some of no thickness.
pub fn boxes(random: &mut Random, frame: &Frame) -> Soup {
    let mut soup = Soup::default();
    for _ in 0..=random.below(4) {
        let placement = Placement::random(random, frame);
        let (a, b) = (placement.vertex(random, frame), placement.vertex(random, frame));
        soup.add(&cuboid(
            std::array::from_fn(|axis| a[axis].min(b[axis])),
            std::array::from_fn(|axis| a[axis].max(b[axis])),
        ));
    }
    soup
}

/// Draws a brick whose edges run along directions such as (1, 1, 0), divided into many coplanar triangles: depths are odd
/// integers at every node that its faces meet, and the inner edges run through nodes too.
pub fn slanted_brick(random: &mut Random, frame: &Frame) -> Soup {
    // All of these triples are right-handed.
    const FRAMES: [[[i32; 3]; 3]; 6] = [
        [[1, 0, 1], [0, 1, 0], [-1, 0, 1]],
        [[1, 1, 0], [-1, 1, 0], [0, 0, 1]],
        [[1, 0, 0], [0, 1, 1], [0, -1, 1]],
        [[1, 0, 0], [1, 1, 0], [1, 1, 1]],
        [[0, 1, 1], [1, 0, 1], [1, 1, 0]],
        [[2, 1, 0], [-1, 2, 0], [1, 1, 1]],
    ];
    let steps = random.choose(&FRAMES);
    let size = (frame.side() / 16).max(2) / 2 * 2;
    within(random, frame, |random| {
        let size = random.even(2, size);
        let count = std::array::from_fn(|_| random.between(1, 4));
        let corner = Placement::random(random, frame).vertex(random, frame);
        brick(random, corner, steps.map(|step| times(step, size)), count)
    })
}

/// Draws a prism over a right triangle with two equal legs; its 45° face is towards any of the twelve diagonals.
pub fn wedge(random: &mut Random, frame: &Frame) -> Soup {
    let side = frame.side();
    within(random, frame, |random| {
        let (axis, leg) = (random.below(3), random.even(2, side));
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let corner = Placement::random(random, frame).vertex(random, frame);
        let (mut along_u, mut along_v, mut height) = (corner, corner, [0; 3]);
        along_u[u] += leg * random.choose(&[-1, 1]);
        along_v[v] += leg * random.choose(&[-1, 1]);
        height[axis] = random.even(2, side);
        let base = [corner, along_u, along_v];
        let top = base.map(|point| plus(point, height));
        let mut soup = Soup::default();
        soup.push([base[0], base[2], base[1]]);
        soup.push(top);
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            soup.push_quad([base[i], base[j], top[j], top[i]], random.chance(2));
        }
        let right_handed = (along_u[u] > corner[u]) == (along_v[v] > corner[v]);
        if right_handed { soup } else { soup.inverted() }
    })
}

/// Draws a box turned about an axis by the angle of the triangle 3-4-5, exact on the lattice.
pub fn pythagorean_box(random: &mut Random, frame: &Frame) -> Soup {
    let size = (frame.side() / 16).max(2) / 2 * 2;
    within(random, frame, |random| {
        let (axis, size) = (random.below(3), random.even(2, size));
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut steps = [[0; 3]; 3];
        let (cos, sin) = random.choose(&[(3, 4), (4, 3), (-3, 4)]);
        (steps[0][u], steps[0][v]) = (cos * size, sin * size);
        (steps[1][u], steps[1][v]) = (-sin * size, cos * size);
        steps[2][axis] = size;
        let count = std::array::from_fn(|_| random.between(1, 3));
        let corner = Placement::random(random, frame).vertex(random, frame);
        brick(random, corner, steps, count)
    })
}

/// Draws a box turned by any angle about any direction; rounding bends its faces slightly, as in a file.
pub fn rotated_box(random: &mut Random, frame: &Frame) -> Soup {
    within(random, frame, |random| {
        let placement = Placement::random(random, frame);
        let (a, b) = (placement.vertex(random, frame), placement.vertex(random, frame));
        let from = std::array::from_fn(|axis| a[axis].min(b[axis]));
        let to: [i32; 3] = std::array::from_fn(|axis| a[axis].max(b[axis]));
        let mut soup = cuboid(from, to);
        let centre = std::array::from_fn(|axis| (f64::from(from[axis]) + f64::from(to[axis])) / 2.0);
        let direction = [random.unit(), random.unit(), random.unit() + 2.0];
        let angle = random.unit() * std::f64::consts::PI;
        for position in &mut soup.positions {
            *position = rotated(*position, centre, direction, angle);
        }
        soup
    })
}

/// Draws triangles of no area: pillows of coincident, edge-on and collinear triangles, needles with two equal corners, and a
/// tetrahedron with a vertex on one edge that only a collinear triangle closes.
pub fn degenerate(random: &mut Random, frame: &Frame) -> Soup {
    let mut soup = Soup::default();
    for _ in 0..=random.below(4) {
        let placement = Placement::random(random, frame);
        let [a, mut b, mut c, d] = std::array::from_fn(|_| placement.vertex(random, frame));
        match random.below(5) {
            0 => {}
            1 => {
                let axis = random.below(3);
                (b[axis], c[axis]) = (a[axis], a[axis]);
            }
            2 => c = std::array::from_fn(|axis| rounded_to_even(f64::from(a[axis] + b[axis]) / 2.0)),
            3 => c = b,
            _ => {
                let end = std::array::from_fn(|axis| a[axis] + (b[axis] - a[axis]) / 4 * 4);
                let middle = std::array::from_fn(|axis| (a[axis] + end[axis]) / 2);
                for corners in [[a, middle, c], [middle, end, c], [end, middle, a]] {
                    soup.push(corners);
                }
                for corners in [[a, d, end], [end, d, c], [c, d, a]] {
                    soup.push(corners);
                }
                continue;
            }
        }
        soup.push([a, b, c]);
        soup.push([c, b, a]);
    }
    soup
}

/// Repeats a soup two or three times: under the even-odd rule two copies cancel, under the non-zero rule they do not.
pub fn duplicated(random: &mut Random, frame: &Frame) -> Soup {
    let once = simple(random, frame);
    let mut soup = once.clone();
    for _ in 0..=random.below(2) {
        soup.add(&once);
    }
    soup
}

/// Draws a soup inside out, alone or with another that faces outwards.
pub fn inside_out(random: &mut Random, frame: &Frame) -> Soup {
    let mut soup = simple(random, frame).inverted();
    if random.chance(2) {
        soup.add(&simple(random, frame));
    }
    soup
}

/// Draws boxes within boxes, the inner ones turned inside out or not.
pub fn nested_shells(random: &mut Random, frame: &Frame) -> Soup {
    let mut soup = Soup::default();
    let (mut from, mut to) = ([0; 3], std::array::from_fn(|axis| frame.most(axis)));
    for _ in 0..=random.below(5) {
        let shell = cuboid(from, to);
        soup.add(&if random.chance(2) { shell } else { shell.inverted() });
        for axis in 0..3 {
            let thickness = (to[axis] - from[axis]) / 4 / 2 * 2;
            from[axis] += random.even(0, thickness);
            to[axis] -= random.even(0, thickness);
        }
    }
    soup
}

/// Draws boxes that share a face, a part of one, an edge, or everything.
pub fn touching_boxes(random: &mut Random, frame: &Frame) -> Soup {
    within(random, frame, |random| {
        let placement = Placement::random(random, frame);
        let (a, b) = (placement.vertex(random, frame), placement.vertex(random, frame));
        let from: [i32; 3] = std::array::from_fn(|axis| a[axis].min(b[axis]));
        let to: [i32; 3] = std::array::from_fn(|axis| a[axis].max(b[axis]));
        let mut soup = cuboid(from, to);
        for _ in 0..=random.below(3) {
            let by = std::array::from_fn(|axis| (to[axis] - from[axis]) * random.choose(&[-1, 0, 0, 1]));
            let grown = random.even(0, 2);
            let mut other = cuboid(from, plus(to, [grown, 0, 0])).translated(by);
            if random.chance(4) {
                other = other.inverted();
            }
            soup.add(&other);
        }
        soup
    })
}

/// Draws tetrahedra that are almost a line or almost a plane, from one end of the frame to the other.
pub fn slivers(random: &mut Random, frame: &Frame) -> Soup {
    let mut soup = Soup::default();
    let near = |random: &mut Random, point: [i32; 3]| {
        std::array::from_fn(|axis| (point[axis] + random.even(-2, 2)).clamp(0, frame.most(axis)))
    };
    for _ in 0..=random.below(4) {
        let (a, b) = (Placement::AtTheEnds.vertex(random, frame), Placement::AtTheEnds.vertex(random, frame));
        let middle = std::array::from_fn(|axis| rounded_to_even(f64::from(a[axis]) / 2.0 + f64::from(b[axis]) / 2.0));
        let other = random.choose(&[a, b, middle]);
        let last = if random.chance(2) { Placement::random(random, frame).vertex(random, frame) } else { middle };
        soup.add(&tetrahedron([a, b, near(random, other), near(random, last)]));
    }
    soup
}

/// Draws a slab across the frame that leans by a few steps over its whole length, so that its planes are almost edge-on.
pub fn steep_slab(random: &mut Random, frame: &Frame) -> Soup {
    within(random, frame, |random| {
        let axis = random.below(3);
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut corner = Placement::random(random, frame).vertex(random, frame);
        corner[axis] = 0;
        corner[v] = 0;
        let mut edges = [[0; 3]; 3];
        edges[0][u] = random.even(2, 8);
        edges[1][v] = frame.most(v);
        edges[1][u] = random.even(-4, 4);
        edges[2][axis] = frame.most(axis);
        edges[2][u] = random.even(-4, 4);
        brick(random, corner, edges, [1; 3])
    })
}

/// Draws two cones over one random loop, which cross themselves and each other.
pub fn cones(random: &mut Random, frame: &Frame) -> Soup {
    let mut soup = Soup::default();
    for _ in 0..=random.below(2) {
        let placement = Placement::random(random, frame);
        let rim: Vec<_> = (0..3 + random.below(6)).map(|_| placement.vertex(random, frame)).collect();
        let apex = Placement::random(random, frame);
        soup.add(&double_cone(&rim, apex.vertex(random, frame), apex.vertex(random, frame)));
    }
    soup
}

/// Draws a closed soup with some of the triangles turned over: for the even-odd rule alone.
pub fn disoriented(random: &mut Random, frame: &Frame) -> Soup {
    let mut soup = simple(random, frame);
    for triangle in &mut soup.triangles {
        if random.chance(3) {
            triangle.swap(1, 2);
        }
    }
    soup
}

/// A generator of soups.
pub type Generator = fn(&mut Random, &Frame) -> Soup;

/// Generators of closed shapes that others repeat, turn and combine.
const SIMPLE: [(&str, Generator); 8] = [
    ("tetrahedra", tetrahedra),
    ("octahedra", octahedra),
    ("boxes", boxes),
    ("slanted_brick", slanted_brick),
    ("wedge", wedge),
    ("pythagorean_box", pythagorean_box),
    ("rotated_box", rotated_box),
    ("cones", cones),
];

/// Generators of shapes that are difficult because they repeat, lack or stretch something.
const DIFFICULT: [(&str, Generator); 7] = [
    ("degenerate", degenerate),
    ("duplicated", duplicated),
    ("inside_out", inside_out),
    ("nested_shells", nested_shells),
    ("touching_boxes", touching_boxes),
    ("slivers", slivers),
    ("steep_slab", steep_slab),
];

fn simple(random: &mut Random, frame: &Frame) -> Soup {
    let (_, generator) = random.choose(&SIMPLE);
    generator(random, frame)
}

/// Joins a few soups of any oriented kind.
pub fn mixture(random: &mut Random, frame: &Frame) -> Soup {
    let mut soup = Soup::default();
    for _ in 0..2 + random.below(2) {
        let (_, generator) = random.choose(&alone());
        soup.add(&generator(random, frame));
    }
    soup
}

/// Returns every generator of oriented soups by name, except for [`mixture`], which draws from them.
fn alone() -> Vec<(&'static str, Generator)> {
    SIMPLE.into_iter().chain(DIFFICULT).collect()
}

/// Returns every generator of oriented soups by name.
pub fn oriented() -> Vec<(&'static str, Generator)> {
    let mixture: (&str, Generator) = ("mixture", mixture);
    alone().into_iter().chain([mixture]).collect()
}
