//! The Gauss map: the outward normals of features on the sphere of directions.
//!
//! Seen from the centre, the six faces of a cube show the sphere such that great circles are straight lines. On each face a
//! facet is a point, a convex edge a segment, a corner a convex polygon, and only the bounding box of each is used.
//!
//! All of this is `f64`, and only prunes. Constraints are relaxed by [`TOLERANCE`] and boxes grown by [`GROWTH`], both far
//! larger than the rounding of the directions, so that features which share an outward normal exactly have boxes that meet on
//! the face that [`face_of`] returns for it.

use glam::{DVec3, Vec3A};
use obvhs::Boundable;
use obvhs::aabb::Aabb;

/// Greatest violation of a constraint that is accepted; directions are rounded to about 10⁻¹⁵.
const TOLERANCE: f64 = 1e-9;

/// Enlargement of boxes; single precision rounds by 2⁻²⁵ on a face.
const GROWTH: f32 = 1.0 / (1 << 20) as f32;

/// The box of a feature on one face of the cube.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// Two coordinates on the face, and the face.
    pub bounds: Aabb,
    /// The index of the feature.
    pub feature: u32,
    /// The number of the face: twice the axis, plus one where it is the negative one.
    pub face: u32,
}

impl Boundable for Patch {
    fn aabb(&self) -> Aabb {
        self.bounds
    }
}

/// Returns the face that a direction points to, the first of several.
pub fn face_of(normal: [i64; 3]) -> u32 {
    let sizes = normal.map(i64::unsigned_abs);
    let axis = (1..3).fold(0, |best, axis| if sizes[axis] > sizes[best] { axis } else { best });
    2 * axis as u32 + u32::from(normal[axis] < 0)
}

/// Returns the patch of a direction, on the given face.
pub fn point(direction: DVec3, face: u32, feature: u32) -> Patch {
    let [depth, x, y] = on_face(direction, face);
    let mut spread = Spread::NONE;
    spread.add(x / depth, y / depth);
    spread.patch(face, feature).expect("a point is there")
}

/// Adds the patches of the arcs between consecutive directions, no two more than a right angle apart.
pub fn arc(directions: &[DVec3], feature: u32, patches: &mut Vec<Patch>) {
    for face in 0..6 {
        let mut spread = Spread::NONE;
        for pair in directions.windows(2) {
            let [from, to] = [pair[0], pair[1]].map(|direction| on_face(direction, face));
            if let Some(ends) = clip(from, to) {
                ends.iter().for_each(|[depth, x, y]| spread.add(x / depth, y / depth));
            }
        }
        patches.extend(spread.patch(face, feature));
    }
}

/// Adds the patches of the directions whose dot product with none of the spokes, which are unit vectors, is positive.
pub fn cone(spokes: &[DVec3], feature: u32, patches: &mut Vec<Patch>, room: &mut [Vec<[f64; 2]>; 2]) {
    for face in 0..6 {
        let constraints = spokes.iter().map(|&spoke| on_face(spoke, face));
        // The least value on the face, attained in one of its corners.
        if constraints.clone().any(|[depth, x, y]| depth - x.abs() - y.abs() > 4.0 * TOLERANCE) {
            continue;
        }
        let [polygon, clipped] = &mut *room;
        polygon.clear();
        let most = 1.0 + TOLERANCE;
        polygon.extend([[-most, -most], [most, -most], [most, most], [-most, most]]);
        for constraint in constraints {
            halve(polygon, constraint, clipped);
            std::mem::swap(polygon, clipped);
            if polygon.is_empty() {
                break;
            }
        }
        let mut spread = Spread::NONE;
        polygon.iter().for_each(|&[x, y]| spread.add(x, y));
        patches.extend(spread.patch(face, feature));
    }
}

/// Clips a polygon to depth + x·X + y·Y ≤ 0.
fn halve(polygon: &[[f64; 2]], [depth, x, y]: [f64; 3], kept: &mut Vec<[f64; 2]>) {
    let excess = |[px, py]: [f64; 2]| depth + x * px + y * py - 2.0 * TOLERANCE;
    kept.clear();
    let Some(&last) = polygon.last() else { return };
    let (mut from, mut before) = (last, excess(last));
    for &to in polygon {
        let after = excess(to);
        if (before > 0.0) != (after > 0.0) {
            let t = before / (before - after);
            kept.push([from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])]);
        }
        if after <= 0.0 {
            kept.push(to);
        }
        (from, before) = (to, after);
    }
}

/// Returns the component along the axis of a face, and those along the other two.
fn on_face(direction: DVec3, face: u32) -> [f64; 3] {
    let v = direction.to_array();
    let axis = (face / 2) as usize;
    let depth = if face.is_multiple_of(2) { v[axis] } else { -v[axis] };
    [depth, v[(axis + 1) % 3], v[(axis + 2) % 3]]
}

/// Clips a chord to the part visible on its face.
fn clip(from: [f64; 3], to: [f64; 3]) -> Option<[[f64; 3]; 2]> {
    let mut range = [0.0_f64, 1.0];
    for (axis, sign) in [(1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)] {
        let [before, after] = [from, to].map(|v| v[0] + sign * v[axis] + TOLERANCE);
        match (before < 0.0, after < 0.0) {
            (true, true) => return None,
            (true, false) => range[0] = range[0].max(before / (before - after)),
            (false, true) => range[1] = range[1].min(before / (before - after)),
            (false, false) => {}
        }
    }
    (range[0] <= range[1]).then(|| range.map(|t| [0, 1, 2].map(|i| from[i] + t * (to[i] - from[i]))))
}

/// The box of points on a face.
struct Spread {
    min: [f64; 2],
    max: [f64; 2],
}

impl Spread {
    const NONE: Spread = Spread { min: [f64::INFINITY; 2], max: [f64::NEG_INFINITY; 2] };

    fn add(&mut self, x: f64, y: f64) {
        self.min = [self.min[0].min(x), self.min[1].min(y)];
        self.max = [self.max[0].max(x), self.max[1].max(y)];
    }

    fn patch(&self, face: u32, feature: u32) -> Option<Patch> {
        let at = |[x, y]: [f64; 2]| Vec3A::new(x as f32, y as f32, face as f32);
        let growth = Vec3A::splat(GROWTH);
        let bounds = Aabb { min: at(self.min) - growth, max: at(self.max) + growth };
        (self.min[0] <= self.max[0]).then_some(Patch { bounds, feature, face })
    }
}
