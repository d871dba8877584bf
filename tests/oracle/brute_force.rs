//! A second, plain implementation of the sampling contract: it intersects every ray with every triangle in exact integers.
//!
//! This file uses nothing of the library, so that an error in one of them is not copied to the other. It follows the words of the
//! contract where the library is optimised for speed: the perturbation is a polynomial in ε, and comparing coefficients gives its
//! sign; a depth is a fraction; and the states of a voxel are recounted from all crossings of its ray.
//!
//! Positions are lattice positions from 0 to 2³⁰. An edge function then stays below 2⁶², the numerator of a depth below
//! 2⁹⁵, and the plane function below 2⁹⁵, so `i128` never overflows.

// Each test binary that includes this file uses a part of it.
#![allow(dead_code)]

use std::collections::{BTreeMap, BTreeSet};

/// The axes of an image's columns and rows, indexed by the axis of its rays.
const COLUMN_AND_ROW_AXES: [(usize, usize); 3] = [(1, 2), (0, 2), (0, 1)];

/// The raster in lattice terms: pixels of `2^shift` steps, their number along x, y and z, and the voxels of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lattice {
    pub shift: u32,
    pub rays: [u32; 3],
    pub lod: u32,
}

impl Lattice {
    /// Returns the steps across one pixel, `S` in the contract.
    pub fn step(&self) -> i64 {
        1 << self.shift
    }

    /// Returns the length of an axis in lattice steps.
    pub fn length(&self, axis: usize) -> i64 {
        i64::from(self.rays[axis]) * self.step()
    }

    /// Returns the odd position of ray or node `index` along an axis.
    pub fn node(&self, index: u32) -> i64 {
        i64::from(index) * self.step() + self.step() / 2 + 1
    }

    /// Returns the steps along one LOD-C voxel: the least even `V` with `lod · V ≥ length`.
    pub fn voxel(&self, axis: usize) -> i64 {
        let (lod, length) = (i64::from(self.lod), self.length(axis));
        let mut voxel = length / lod / 2 * 2;
        while voxel < 2 || lod * voxel < length {
            voxel += 2;
        }
        voxel
    }

    /// Returns the voxel that a crossing belongs to; a depth at the very end of the axis belongs to the last voxel.
    fn voxel_of(&self, axis: usize, floor: i32) -> i64 {
        (i64::from(floor) / self.voxel(axis)).min(i64::from(self.lod) - 1)
    }
}

/// Triangles by index into positions; every position is even.
#[derive(Clone, Copy, Debug)]
pub struct Solid<'a> {
    pub positions: &'a [[i32; 3]],
    pub triangles: &'a [[u32; 3]],
}

/// The fill rule: a point is inside if its crossing parity is odd, or if its winding number is not zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FillRule {
    EvenOdd,
    NonZero,
}

/// The kind of image: the exact one, or a conservative one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    Exact,
    Over,
    Under,
}

/// A Boolean operation on two images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    Union,
    Intersection,
    Difference,
    Xor,
}

/// One crossing of a triangle with a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crossing {
    pub floor: i32,
    pub ceil: i32,
    pub nearest: i32,
    pub entering: bool,
    pub triangle: u32,
}

/// The samples of every ray, in ray order; `[sample 2i, sample 2i + 1)` is inside. Unclosed rays, in ray order, have
/// no samples.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    pub columns: u32,
    pub rows: u32,
    pub samples: Vec<Vec<i32>>,
    pub unclosed: Vec<u32>,
}

/// `constant + epsilon[0]·ε₁ + epsilon[1]·ε₂ + epsilon[2]·ε₃` with ε₁ ≫ ε₂ ≫ ε₃ > 0.
#[derive(Clone, Copy)]
struct Perturbed {
    constant: i128,
    epsilon: [i128; 3],
}

impl Perturbed {
    /// Returns the coordinate `position` of a node along `axis`, which stands for `position + ε` of that axis.
    fn coordinate(position: i64, axis: usize) -> Self {
        let mut epsilon = [0; 3];
        epsilon[axis] = 1;
        Self { constant: i128::from(position), epsilon }
    }

    fn minus(self, other: Self) -> Self {
        Self {
            constant: self.constant - other.constant,
            epsilon: std::array::from_fn(|i| self.epsilon[i] - other.epsilon[i]),
        }
    }

    fn plus(self, other: Self) -> Self {
        self.minus(other.times(-1))
    }

    fn less(self, position: i32) -> Self {
        Self { constant: self.constant - i128::from(position), ..self }
    }

    fn times(self, factor: i128) -> Self {
        Self { constant: self.constant * factor, epsilon: self.epsilon.map(|coefficient| coefficient * factor) }
    }

    /// Returns −1, 0 or 1: the sign of the first coefficient that is not zero, in order of falling size.
    fn sign(self) -> i128 {
        let [first, second, third] = self.epsilon;
        [self.constant, first, second, third].into_iter().map(i128::signum).find(|&sign| sign != 0).unwrap_or(0)
    }
}

/// Returns (b − a) × (c − a), the normal that points outwards where the corners run anticlockwise seen from outside.
fn normal([a, b, c]: [[i32; 3]; 3]) -> [i128; 3] {
    let ab: [i128; 3] = std::array::from_fn(|i| i128::from(b[i]) - i128::from(a[i]));
    let ac: [i128; 3] = std::array::from_fn(|i| i128::from(c[i]) - i128::from(a[i]));
    [ab[1] * ac[2] - ab[2] * ac[1], ab[2] * ac[0] - ab[0] * ac[2], ab[0] * ac[1] - ab[1] * ac[0]]
}

/// Returns whether the perturbed ray at (column, row) passes strictly through the projection of a triangle.
fn passes_through(corners: [[i32; 3]; 3], axis: usize, column: i64, row: i64) -> bool {
    let (u, v) = COLUMN_AND_ROW_AXES[axis];
    let (ray_u, ray_v) = (Perturbed::coordinate(column, u), Perturbed::coordinate(row, v));
    let side_of_edge = |from: [i32; 3], to: [i32; 3]| {
        let edge_u = i128::from(to[u]) - i128::from(from[u]);
        let edge_v = i128::from(to[v]) - i128::from(from[v]);
        ray_v.less(from[v]).times(edge_u).minus(ray_u.less(from[u]).times(edge_v)).sign()
    };
    let [a, b, c] = corners;
    let sides = [side_of_edge(a, b), side_of_edge(b, c), side_of_edge(c, a)];
    sides == [1; 3] || sides == [-1; 3]
}

/// Returns the crossing of one triangle with one ray, if there is one.
fn crossing(corners: [[i32; 3]; 3], triangle: u32, axis: usize, column: i64, row: i64) -> Option<Crossing> {
    let normal = normal(corners);
    if normal[axis] == 0 || !passes_through(corners, axis, column, row) {
        return None;
    }
    // The unperturbed ray meets the plane normal · (point − corner) = 0 at depth numerator / denominator.
    let (u, v) = COLUMN_AND_ROW_AXES[axis];
    let corner = corners[0].map(i128::from);
    let denominator = normal[axis].abs();
    let numerator = normal[axis].signum()
        * (normal[axis] * corner[axis]
            - normal[u] * (i128::from(column) - corner[u])
            - normal[v] * (i128::from(row) - corner[v]));

    let floor = numerator.div_euclid(2 * denominator) * 2;
    let above_floor = numerator - floor * denominator;
    let ceil = if above_floor == 0 { floor } else { floor + 2 };
    let nearest = if above_floor < denominator {
        floor
    } else if above_floor > denominator {
        ceil
    } else {
        // The depth is the odd integer of a node. The plane function at the perturbed node, divided by the normal's
        // component along the ray, is how far the node lies above the perturbed plane.
        let depth = i64::try_from(floor + 1).expect("a depth lies on the lattice");
        let node = [(u, column), (v, row), (axis, depth)];
        let plane_function = node
            .into_iter()
            .map(|(axis, position)| Perturbed::coordinate(position, axis).less(corners[0][axis]).times(normal[axis]))
            .reduce(Perturbed::plus)
            .expect("three terms");
        assert_eq!(plane_function.constant, 0, "the unperturbed node lies in the plane");
        match plane_function.sign() * normal[axis].signum() {
            1 => floor,
            -1 => ceil,
            _ => unreachable!("the normal has a component along the ray"),
        }
    };
    let on_lattice = |depth: i128| i32::try_from(depth).expect("a depth lies within its triangle");
    Some(Crossing {
        floor: on_lattice(floor),
        ceil: on_lattice(ceil),
        nearest: on_lattice(nearest),
        entering: normal[axis] < 0,
        triangle,
    })
}

/// Returns the crossings of every ray along an axis, in ray order; those of one ray in triangle order.
pub fn crossings(lattice: &Lattice, solid: Solid, axis: usize) -> Vec<Vec<Crossing>> {
    let (u, v) = COLUMN_AND_ROW_AXES[axis];
    let mut rays = Vec::new();
    for row in 0..lattice.rays[v] {
        for column in 0..lattice.rays[u] {
            let on_ray = solid.triangles.iter().enumerate().filter_map(|(index, triangle)| {
                let corners = triangle.map(|vertex| solid.positions[vertex as usize]);
                crossing(corners, index as u32, axis, lattice.node(column), lattice.node(row))
            });
            rays.push(on_ray.collect());
        }
    }
    rays
}

/// Returns the winding number that some crossings add up to.
fn winding<'a>(crossings: impl IntoIterator<Item = &'a Crossing>) -> i64 {
    crossings.into_iter().map(|crossing| if crossing.entering { 1 } else { -1 }).sum()
}

/// Returns whether a point beyond exactly these crossings is inside.
fn inside<'a>(crossings: impl IntoIterator<Item = &'a Crossing>, fill: FillRule) -> bool {
    match fill {
        FillRule::EvenOdd => crossings.into_iter().count() % 2 == 1,
        FillRule::NonZero => winding(crossings) != 0,
    }
}

/// Returns whether a ray is closed: it ends outside the solid.
fn is_closed(crossings: &[Crossing], fill: FillRule) -> bool {
    !inside(crossings, fill)
}

/// Groups crossings by the value of `key`, in its order.
fn grouped<K: Ord>(crossings: &[Crossing], key: impl Fn(&Crossing) -> K) -> BTreeMap<K, Vec<Crossing>> {
    let mut groups = BTreeMap::<K, Vec<Crossing>>::new();
    for crossing in crossings {
        groups.entry(key(crossing)).or_default().push(*crossing);
    }
    groups
}

fn exact_ray(crossings: &[Crossing], fill: FillRule) -> Vec<i32> {
    match fill {
        FillRule::EvenOdd => {
            let mut depths: Vec<i32> = crossings.iter().map(|crossing| crossing.nearest).collect();
            depths.sort_unstable();
            depths
        }
        FillRule::NonZero => grouped(crossings, |crossing| crossing.nearest)
            .into_keys()
            .filter(|&depth| {
                let before = crossings.iter().filter(|crossing| crossing.nearest < depth);
                let after = crossings.iter().filter(|crossing| crossing.nearest <= depth);
                inside(before, fill) != inside(after, fill)
            })
            .collect(),
    }
}

/// The state of one voxel of one ray for one solid, as the conservative images need it.
struct Voxel {
    /// The state at the near face.
    before: bool,
    /// The state at the far face.
    after: bool,
    touched: bool,
    crossings: Vec<Crossing>,
}

impl Voxel {
    /// True if the voxel may hold a part of the solid.
    fn occupied(&self) -> bool {
        self.before || self.after || self.touched
    }
}

fn voxel(lattice: &Lattice, axis: usize, fill: FillRule, on_ray: &[Crossing], index: i64) -> Voxel {
    let voxel_of = |crossing: &Crossing| lattice.voxel_of(axis, crossing.floor);
    let before: Vec<Crossing> = on_ray.iter().filter(|crossing| voxel_of(crossing) < index).copied().collect();
    let crossings: Vec<Crossing> = on_ray.iter().filter(|crossing| voxel_of(crossing) == index).copied().collect();
    let touched = !crossings.is_empty()
        && match fill {
            FillRule::EvenOdd => true,
            FillRule::NonZero => {
                let mut current = winding(&before);
                let mut possible = BTreeSet::from([current]);
                for group in grouped(&crossings, |crossing| crossing.floor).into_values() {
                    let entering = group.iter().filter(|crossing| crossing.entering).count() as i64;
                    let leaving = group.iter().filter(|crossing| !crossing.entering).count() as i64;
                    possible.extend(current - leaving..=current + entering);
                    current += winding(&group);
                }
                possible.contains(&0) && possible.iter().any(|&value| value != 0)
            }
        };
    Voxel { before: inside(&before, fill), after: inside(before.iter().chain(&crossings), fill), touched, crossings }
}

/// Returns the samples of one voxel. `before` and `after` are the states at its faces; `between` says whether the state may
/// change and change back in between; the ends are found over `crossings`.
fn voxel_samples(mode: Mode, before: bool, after: bool, between: bool, crossings: &[Crossing]) -> Vec<i32> {
    let floor = || crossings.iter().map(|crossing| crossing.floor).min().expect("a class has crossings");
    let ceil = || crossings.iter().map(|crossing| crossing.ceil).max().expect("a class has crossings");
    match (before, after, mode) {
        (_, _, Mode::Exact) => unreachable!("an exact image has no voxels"),
        (false, true, Mode::Over) | (true, false, Mode::Under) => vec![floor()],
        (false, true, Mode::Under) | (true, false, Mode::Over) => vec![ceil()],
        (false, false, Mode::Over) | (true, true, Mode::Under) if between => vec![floor(), ceil()],
        (false, false, _) | (true, true, _) => vec![],
    }
}

/// Returns the image of one solid along an axis.
pub fn image(lattice: &Lattice, solid: Solid, axis: usize, mode: Mode, fill: FillRule) -> Image {
    let rays = crossings(lattice, solid, axis);
    let samples_of = |on_ray: &Vec<Crossing>| {
        if mode == Mode::Exact {
            return exact_ray(on_ray, fill);
        }
        let voxels = grouped(on_ray, |crossing| lattice.voxel_of(axis, crossing.floor));
        let of_voxel = |index| {
            let voxel = voxel(lattice, axis, fill, on_ray, index);
            voxel_samples(mode, voxel.before, voxel.after, voxel.touched, &voxel.crossings)
        };
        voxels.into_keys().flat_map(of_voxel).collect()
    };
    collect(lattice, axis, rays.iter().map(|on_ray| is_closed(on_ray, fill).then(|| samples_of(on_ray))))
}

/// Sums over the crossings of all closed rays. `wound` counts each point as often as shells wind around it. `aligned` sums the
/// windings of the groups that change the parity, negated where the parity becomes even, and `changes` counts these groups.
/// `unpaired` sums what the windings of all other groups enclose, by the positions of the groups.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Windings {
    pub wound: i64,
    pub aligned: i64,
    pub changes: i64,
    pub unpaired: i64,
}

/// Returns the windings of one solid along an axis. A group has one depth in the exact image, and one voxel in the others.
pub fn windings(lattice: &Lattice, solid: Solid, axis: usize, mode: Mode, fill: FillRule) -> Windings {
    let mut windings = Windings { wound: 0, aligned: 0, changes: 0, unpaired: 0 };
    for on_ray in crossings(lattice, solid, axis).iter().filter(|on_ray| is_closed(on_ray, fill)) {
        for crossing in on_ray {
            windings.wound -= i64::from(crossing.nearest) * winding([crossing]);
        }
        let group_of = |crossing: &Crossing| match mode {
            Mode::Exact => i64::from(crossing.nearest),
            Mode::Over | Mode::Under => lattice.voxel_of(axis, crossing.floor),
        };
        for (index, group) in grouped(on_ray, group_of) {
            let near = inside(on_ray.iter().filter(|crossing| group_of(crossing) < index), FillRule::EvenOdd);
            let far = inside(on_ray.iter().filter(|crossing| group_of(crossing) <= index), FillRule::EvenOdd);
            let towards_inside = i64::from(far) - i64::from(near);
            windings.aligned += towards_inside * winding(&group);
            windings.changes += towards_inside.abs();
            if group.len() % 2 == 0 {
                windings.unpaired -= index * winding(&group);
            }
        }
    }
    windings
}

/// Returns the image of the intersection of two solids: the conservative ones by voxels, the exact one from the exact images.
pub fn intersection(lattice: &Lattice, a: Solid, b: Solid, axis: usize, mode: Mode, fill: FillRule) -> Image {
    if mode == Mode::Exact {
        let image_of = |solid| image(lattice, solid, axis, mode, fill);
        return boolean(Operation::Intersection, &image_of(a), &image_of(b));
    }
    let samples_of = |on_a: &Vec<Crossing>, on_b: &Vec<Crossing>| -> Vec<i32> {
        let voxel_of = |crossing: &Crossing| lattice.voxel_of(axis, crossing.floor);
        let voxels: BTreeSet<i64> = on_a.iter().chain(on_b).map(voxel_of).collect();
        let of_voxel = |index| {
            let of_a = voxel(lattice, axis, fill, on_a, index);
            let of_b = voxel(lattice, axis, fill, on_b, index);
            let (before, after) = (of_a.before && of_b.before, of_a.after && of_b.after);
            let between = match (before, after) {
                (false, false) => of_a.occupied() && of_b.occupied(),
                _ => of_a.touched || of_b.touched,
            };
            let touched = [of_a, of_b].into_iter().filter(|voxel| voxel.touched);
            let crossings: Vec<Crossing> = touched.flat_map(|voxel| voxel.crossings).collect();
            voxel_samples(mode, before, after, between, &crossings)
        };
        voxels.into_iter().flat_map(of_voxel).collect()
    };
    let (rays_a, rays_b) = (crossings(lattice, a, axis), crossings(lattice, b, axis));
    let rays = rays_a.iter().zip(&rays_b).map(|(on_a, on_b)| {
        let closed = is_closed(on_a, fill) && is_closed(on_b, fill);
        closed.then(|| samples_of(on_a, on_b))
    });
    collect(lattice, axis, rays)
}

/// Builds an image from the samples of its rays in ray order, where `None` is an unclosed ray.
fn collect(lattice: &Lattice, axis: usize, rays: impl Iterator<Item = Option<Vec<i32>>>) -> Image {
    let (u, v) = COLUMN_AND_ROW_AXES[axis];
    let (mut samples, mut unclosed) = (Vec::new(), Vec::new());
    for (index, ray) in rays.enumerate() {
        if ray.is_none() {
            unclosed.push(index as u32);
        }
        samples.push(ray.unwrap_or_default());
    }
    Image { columns: lattice.rays[u], rows: lattice.rays[v], samples, unclosed }
}

/// Returns whether the step from `depth` to just beyond it is inside, by the half-open intervals of one ray.
pub fn contains(samples: &[i32], depth: i32) -> bool {
    samples.chunks(2).any(|span| span[0] <= depth && depth < span[1])
}

/// Returns the Boolean of two images of equal size. Membership is constant between neighbouring ends of intervals, so it is
/// evaluated once for each segment between two ends. Intervals of no length vanish, touching ones merge, and a ray that is
/// unclosed in either image is unclosed in the result.
pub fn boolean(operation: Operation, a: &Image, b: &Image) -> Image {
    assert_eq!((a.columns, a.rows), (b.columns, b.rows), "the images are of one raster");
    let unclosed: BTreeSet<u32> = a.unclosed.iter().chain(&b.unclosed).copied().collect();
    let samples_of = |(index, (in_a, in_b)): (usize, (&Vec<i32>, &Vec<i32>))| {
        let mut samples = Vec::new();
        if unclosed.contains(&(index as u32)) {
            return samples;
        }
        let ends: BTreeSet<i32> = in_a.iter().chain(in_b).copied().collect();
        let mut state = false;
        for depth in ends {
            let (in_a, in_b) = (contains(in_a, depth), contains(in_b, depth));
            let next = match operation {
                Operation::Union => in_a || in_b,
                Operation::Intersection => in_a && in_b,
                Operation::Difference => in_a && !in_b,
                Operation::Xor => in_a != in_b,
            };
            if next != state {
                samples.push(depth);
                state = next;
            }
        }
        samples
    };
    let samples = a.samples.iter().zip(&b.samples).enumerate().map(samples_of).collect();
    Image { columns: a.columns, rows: a.rows, samples, unclosed: unclosed.into_iter().collect() }
}
