//! Normals of triangles and of their corners.
//!
//! A triangle has one normal, and a triangulated smooth surface shows its facets. Corner normals undo that: the normal at a
//! corner is the mean of those triangles around the vertex that meet at less than the crease angle, weighted after Max 1999
//! ("Weights for computing vertex normals from facet normals"), which is exact for vertices on a sphere. Edges sharper than the
//! crease angle stay sharp.

use std::sync::OnceLock;

use crate::parallel::*;
use glam::{DVec2, Vec3};

use super::scene::Skin;
use crate::cancel::checkpoint;

/// The shading of the facets of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facets {
    /// Flat shading.
    Flat,
    /// Smooth shading over edges that are less sharp than 40°.
    Smooth,
    /// Flat shading, with the sides of triangles drawn.
    Sides,
}

/// The cosine of the crease angle.
const CREASE: f32 = 0.766;

/// The normals of one skin.
pub(super) struct Normals<'a> {
    skin: Skin<'a>,
    /// `None` for flat shading.
    corners: Option<Corners>,
    /// Whether sides are drawn.
    has_sides: bool,
}

impl<'a> Normals<'a> {
    pub fn new(skin: Skin<'a>, facets: Facets) -> Normals<'a> {
        let corners = (facets == Facets::Smooth).then(|| Corners::of(&skin));
        Normals { skin, corners, has_sides: facets == Facets::Sides }
    }

    /// Returns the unit normal where a triangle passes a ray, turned to the eye: a visible surface is seen from outside,
    /// whichever orientation the mesh has. `x` and `y` are the ray's position on the lattice.
    pub fn at(&self, triangle: u32, x: f64, y: f64) -> Vec3 {
        let [a, b, c] = corners_of(&self.skin, triangle as usize);
        let face = cross(a, b, c);
        let side = if face.z < 0.0 { -1.0 } else { 1.0 };
        let normal = match &self.corners {
            None => face.normalize_or_zero(),
            Some(corners) => {
                let normals = corners.normals(&self.skin, triangle as usize);
                let at = |p: [i32; 3]| DVec2::new(f64::from(p[0]) - x, f64::from(p[1]) - y);
                let (a, b, c) = (at(a), at(b), at(c));
                let weights = [b.perp_dot(c), c.perp_dot(a), a.perp_dot(b)].map(|w| (w * f64::from(side)).max(0.0));
                let sum: f64 = weights.iter().sum();
                let mixed: Vec3 = (0..3).map(|i| normals[i] * (weights[i] / sum) as f32).sum();
                if sum > 0.0 { mixed } else { face.normalize_or_zero() }
            }
        };
        let mut normal = normal * side;
        // Near a silhouette a smoothed normal may point away from the eye.
        normal.z = normal.z.max(0.02);
        normal.normalize_or(Vec3::Z)
    }

    /// Returns the distance of a ray from the nearest side of the triangle that it passes, seen along the ray, in lattice steps;
    /// `None` where sides are not drawn. `x` and `y` are the ray's position on the lattice.
    pub fn to_side(&self, triangle: u32, x: f64, y: f64) -> Option<f64> {
        let [a, b, c] = corners_of(&self.skin, triangle as usize);
        let at = |p: [i32; 3]| DVec2::new(f64::from(p[0]) - x, f64::from(p[1]) - y);
        let from_side = |a: [i32; 3], b: [i32; 3]| {
            let (from, along) = (at(a), at(b) - at(a));
            let share = (-from.dot(along) / along.length_squared()).clamp(0.0, 1.0);
            // Sides along the ray are points.
            if share.is_nan() { from.length() } else { (from + along * share).length() }
        };
        self.has_sides.then(|| from_side(a, b).min(from_side(b, c)).min(from_side(c, a)))
    }
}

fn corners_of(skin: &Skin, triangle: usize) -> [[i32; 3]; 3] {
    skin.triangles[triangle].map(|vertex| skin.positions[vertex as usize])
}

fn difference(a: [i32; 3], b: [i32; 3]) -> Vec3 {
    Vec3::from_array(std::array::from_fn(|i| (b[i] - a[i]) as f32))
}

/// Returns (b − a) × (c − a), scaled down so that its square stays finite.
fn cross(a: [i32; 3], b: [i32; 3], c: [i32; 3]) -> Vec3 {
    const SCALE: f32 = 1.0 / (1 << 15) as f32;
    (difference(a, b) * SCALE).cross(difference(a, c) * SCALE)
}

/// Returns the weight of a triangle at its corner `a`: the sine of the angle there over the product of the lengths of the two
/// sides.
fn weight(a: [i32; 3], b: [i32; 3], c: [i32; 3]) -> f32 {
    const SCALE: f32 = 1.0 / (1 << 15) as f32;
    let (ab, ac) = (difference(a, b) * SCALE, difference(a, c) * SCALE);
    let squares = ab.length_squared() * ac.length_squared();
    if squares > 0.0 { ab.cross(ac).length() / squares } else { 0.0 }
}

/// Triangles in one task.
const CHUNK: usize = 1 << 12;

/// The normals at the corners of triangles, found for visible ones alone: most triangles of a large mesh are hidden.
struct Corners {
    faces: Vec<Vec3>,
    fans: Fans,
    found: Vec<OnceLock<[Vec3; 3]>>,
}

impl Corners {
    fn of(skin: &Skin) -> Corners {
        let face = |t: usize| {
            checkpoint();
            let [a, b, c] = corners_of(skin, t);
            cross(a, b, c).normalize_or_zero()
        };
        let all = || (0..skin.triangles.len()).into_par_iter().with_min_len(CHUNK);
        Corners {
            faces: all().map(face).collect(),
            fans: Fans::of(skin),
            found: all().map(|_| OnceLock::new()).collect(),
        }
    }

    fn normals(&self, skin: &Skin, triangle: usize) -> &[Vec3; 3] {
        checkpoint();
        let own = self.faces[triangle];
        let at_corner = |corner: usize| {
            let fan = self.fans.around(skin.triangles[triangle][corner]);
            let near = fan.iter().filter(|&&use_| self.faces[use_ as usize / 3].dot(own) > CREASE);
            let sum: Vec3 = near.map(|&use_| fan_normal(skin, &self.faces, use_)).sum();
            sum.normalize_or(own)
        };
        self.found[triangle].get_or_init(|| [0, 1, 2].map(at_corner))
    }
}

/// Returns the weighted normal of a triangle at one of its corners.
fn fan_normal(skin: &Skin, faces: &[Vec3], use_: u32) -> Vec3 {
    let (t, corner) = (use_ as usize / 3, use_ as usize % 3);
    let corners = corners_of(skin, t);
    faces[t] * weight(corners[corner], corners[(corner + 1) % 3], corners[(corner + 2) % 3])
}

/// The triangles around each vertex; vertices at one position count as one.
struct Fans {
    /// The representative vertex of each position.
    vertex: Vec<u32>,
    /// The first use of each vertex.
    first: Vec<u32>,
    /// Corners of triangles, 3 · triangle + corner, vertex by vertex in ascending order.
    uses: Vec<u32>,
}

impl Fans {
    fn of(skin: &Skin) -> Fans {
        let mut order: Vec<u32> = (0..skin.positions.len() as u32).collect();
        order.par_sort_unstable_by_key(|&i| (skin.positions[i as usize], i));
        let mut vertex = vec![0; order.len()];
        let mut found = 0;
        for (k, &i) in order.iter().enumerate() {
            found += u32::from(k > 0 && skin.positions[order[k - 1] as usize] != skin.positions[i as usize]);
            vertex[i as usize] = found;
        }
        let corners = skin.triangles.as_flattened();
        let mut first = vec![0u32; found as usize + 2];
        for &corner in corners {
            first[vertex[corner as usize] as usize + 1] += 1;
        }
        for v in 1..first.len() {
            first[v] += first[v - 1];
        }
        let (mut next, mut uses) = (first.clone(), vec![0; corners.len()]);
        for (use_, &corner) in corners.iter().enumerate() {
            let slot = &mut next[vertex[corner as usize] as usize];
            uses[*slot as usize] = use_ as u32;
            *slot += 1;
        }
        Fans { vertex, first, uses }
    }

    fn around(&self, position: u32) -> &[u32] {
        let v = self.vertex[position as usize] as usize;
        &self.uses[self.first[v] as usize..self.first[v + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::grid::Grid;
    use crate::mesh::{ClosedMesh, TriangleMesh};
    use crate::picture::palette;
    use crate::solids;

    /// Returns the cosines between the normals in the middles of all triangles that face the eye and the expected normals.
    fn cosines(mesh: TriangleMesh, facets: Facets, expected: impl Fn(Vec3, Vec3) -> Vec3) -> Vec<f32> {
        let closed = ClosedMesh::check(mesh).unwrap();
        let grid = Grid::with_resolution(closed.bounds(), 64, 1024).unwrap();
        let solid = grid.quantise(&closed).unwrap();
        let skin = Skin { positions: solid.positions(), triangles: solid.triangles(), tint: palette::alone() };
        let normals = Normals::new(skin, facets);
        let mut found = Vec::new();
        for t in 0..solid.triangles().len() {
            let [a, b, c] = corners_of(&skin, t);
            let face = cross(a, b, c).normalize();
            if face.z < 0.1 {
                continue;
            }
            let middle: [f64; 3] = std::array::from_fn(|i| f64::from(a[i] / 3 + b[i] / 3 + c[i] / 3));
            let world = grid.origin() + DVec3::from_array(middle) * grid.step();
            found.push(normals.at(t as u32, middle[0], middle[1]).dot(expected(world.as_vec3(), face)));
        }
        assert!(found.len() > 1);
        found
    }

    #[test]
    fn smooth_normals_are_radial_on_a_ball_and_flat_ones_constant_per_facet() {
        let least = |facets| {
            let cosines = cosines(solids::geodesic(1.0, 4).unwrap(), facets, |at, _| at.normalize());
            cosines.into_iter().fold(1.0, f32::min)
        };
        assert!(least(Facets::Smooth) > 0.9999, "{}", least(Facets::Smooth));
        let own = cosines(solids::geodesic(1.0, 4).unwrap(), Facets::Flat, |_, face| face);
        assert!(own.into_iter().all(|cosine| cosine > 0.999_99));
    }

    #[test]
    fn sides_are_as_far_as_the_middle_of_a_triangle_is_from_them() {
        let positions = [[0, 0, 0], [30, 0, 7], [0, 40, 9]];
        let skin = Skin { positions: &positions, triangles: &[[0, 1, 2]], tint: palette::alone() };
        let sides = Normals::new(skin, Facets::Sides);
        let expected = [((10.0, 10.0), 10.0), ((12.0, 16.0), 4.8), ((3.0, 2.0), 2.0), ((-3.0, -4.0), 5.0)];
        for ((x, y), distance) in expected {
            assert!((sides.to_side(0, x, y).unwrap() - distance).abs() < 1e-12, "{x} {y}");
        }
        assert_eq!(Normals::new(skin, Facets::Flat).to_side(0, 10.0, 10.0), None);
    }

    #[test]
    fn smooth_normals_are_continuous_across_facets() {
        let closed = ClosedMesh::check(solids::geodesic(1.0, 3).unwrap()).unwrap();
        let grid = Grid::with_resolution(closed.bounds(), 64, 1024).unwrap();
        let solid = grid.quantise(&closed).unwrap();
        let skin = Skin { positions: solid.positions(), triangles: solid.triangles(), tint: palette::alone() };
        let jump = |facets| {
            let normals = Normals::new(skin, facets);
            let facing = |t: &usize| {
                let [a, b, c] = corners_of(&skin, *t);
                cross(a, b, c).normalize().z > 0.5
            };
            let mut most = 0.0f32;
            let faces: Vec<usize> = (0..solid.triangles().len()).filter(facing).collect();
            for (&t, &u) in faces.iter().flat_map(|t| faces.iter().map(move |u| (t, u))) {
                let shared: Vec<u32> =
                    solid.triangles()[t].into_iter().filter(|v| solid.triangles()[u].contains(v)).collect();
                if let (true, [v, w]) = (t != u, &shared[..]) {
                    let [p, q] = [*v, *w].map(|v| solid.positions()[v as usize]);
                    let at = |i: usize| 0.5 * (f64::from(p[i]) + f64::from(q[i]));
                    let [n, m] = [t, u].map(|t| normals.at(t as u32, at(0), at(1)));
                    most = most.max((n - m).length());
                }
            }
            most
        };
        assert!(jump(Facets::Smooth) < 1e-3 && jump(Facets::Flat) > 0.1, "{}", jump(Facets::Smooth));
    }

    #[test]
    fn smooth_normals_keep_sharp_edges() {
        let cube = || solids::cuboid(DVec3::ZERO, DVec3::ONE).unwrap();
        assert!(cosines(cube(), Facets::Smooth, |_, face| face).into_iter().all(|cosine| cosine > 0.999_99));
    }
}
