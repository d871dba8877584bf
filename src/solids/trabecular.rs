//! A block of trabecular bone: disordered rods and plates of similar thickness.
//!
//! # Theory
//! Many plane waves of one length, of random directions and phases, add up to a Gaussian random field (Cahn, Phase
//! separation by spinodal decomposition, 1965). The solid is the set where the field is below a quantile. Such spinodal
//! solids are used as models of bone (Kumar et al., Inverse-designed spinodoid metamaterials, 2020). Waves that are
//! longer along z elongate the trabeculae in that direction, as a load does.
//!
//! The lower the volume fraction, the more disconnected pieces there are; the higher it is, the more enclosed pores.
//! Only the largest shell is kept: one connected solid without enclosed pores.

use std::f64::consts::TAU;

use glam::DVec3;

use super::contour::{Block, Implicit, contour};
use super::{SolidError, check_length, check_range};
use crate::mesh::TriangleMesh;

/// Number of waves, each of which costs time at every point. The excess kurtosis of n waves is −1.5 / n, so these are
/// close to Gaussian.
const WAVES: usize = 40;

/// Number of points along each axis that determine the level.
const LEVEL_SAMPLES: usize = 32;

/// A block of trabecular bone centred on the origin, clipped by the planes of its box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrabecularBone {
    /// Sides of the block, rounded to whole grid cells.
    pub size: DVec3,
    /// Length of the waves: about the distance between neighbouring trabeculae.
    pub spacing: f64,
    /// Volume fraction of bone, 0.2 to 0.6, before loose pieces are removed.
    pub fraction: f64,
    /// Ratio of the wavelength along z to that across it, 1 to 4.
    pub stretch: f64,
    /// The seed, which selects one of many bones of the same kind.
    pub seed: u32,
    /// Number of grid cells along `spacing`, 4 to 256; the number of triangles grows with its square.
    pub resolution: u32,
}

impl TrabecularBone {
    /// Builds the closed surface of the bone.
    ///
    /// # Errors
    /// Fails for a parameter out of the range that its field states, and too many grid nodes or triangles.
    pub fn build(&self) -> Result<TriangleMesh, SolidError> {
        check_length("spacing", self.spacing)?;
        check_range("fraction", self.fraction, 0.2, 0.6)?;
        check_range("stretch", self.stretch, 1.0, 4.0)?;
        check_range("resolution", self.resolution.into(), 4.0, 256.0)?;
        let step = self.spacing / f64::from(self.resolution);
        for side in self.size.to_array() {
            check_range("size", side, step, 1e6 * step)?;
        }
        let cells = (self.size / step).round();
        let block = Block { min: -step / 2.0 * cells, spacing: step, cells: cells.to_array().map(|n| n as usize) };
        let mut field = Field::new(self.seed, TAU / self.spacing * DVec3::new(1.0, 1.0, 1.0 / self.stretch));
        field.level = field.quantile(self.fraction, block.min, -2.0 * block.min);
        let mesh = contour(&field, &block, ("resolution", self.resolution.into()))?;
        Ok(largest_shell(mesh))
    }
}

/// A sum of plane waves minus a level.
struct Field {
    /// Wave vectors and phases.
    waves: [(DVec3, f64); WAVES],
    level: f64,
}

impl Field {
    /// Returns waves with wave vectors on the ellipsoid of the given half axes.
    fn new(seed: u32, half_axes: DVec3) -> Field {
        let mut random = Random(seed.into());
        let waves = std::array::from_fn(|_| {
            // Heights on a sphere are uniformly distributed (Archimedes).
            let (height, angle, phase) = (2.0 * random.next() - 1.0, TAU * random.next(), TAU * random.next());
            let direction = DVec3::from(((1.0 - height * height).sqrt() * glam::DVec2::from_angle(angle), height));
            (half_axes * direction, phase)
        });
        Field { waves, level: 0.0 }
    }

    /// Returns the value below which the field lies in a given fraction of a box.
    fn quantile(&self, fraction: f64, min: DVec3, extent: DVec3) -> f64 {
        let n = LEVEL_SAMPLES;
        let at = |i: usize| DVec3::new((i % n) as f64, (i / n % n) as f64, (i / n / n) as f64);
        let mut values: Vec<f64> =
            (0..n * n * n).map(|i| self.value(min + extent * (at(i) + 0.5) / n as f64)).collect();
        let rank = (fraction * values.len() as f64) as usize;
        *values.select_nth_unstable_by(rank, f64::total_cmp).1
    }
}

impl Implicit for Field {
    fn value(&self, p: DVec3) -> f64 {
        self.waves.iter().map(|&(k, phase)| (k.dot(p) + phase).cos()).sum::<f64>() - self.level
    }

    fn value_and_gradient(&self, p: DVec3, _spacing: f64) -> (f64, DVec3) {
        self.waves.iter().fold((-self.level, DVec3::ZERO), |(value, gradient), &(k, phase)| {
            let (sin, cos) = (k.dot(p) + phase).sin_cos();
            (value + cos, gradient - sin * k)
        })
    }
}

/// SplitMix64 (Steele, Lea and Flood, 2014): the same numbers for a seed on every machine.
struct Random(u64);

impl Random {
    /// Returns a number from 0 to below 1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Returns the shell of most vertices alone, its vertices and triangles in their order.
fn largest_shell(mesh: TriangleMesh) -> TriangleMesh {
    let mut parent: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    fn root(parent: &mut [u32], mut v: u32) -> u32 {
        while parent[v as usize] != v {
            let above = parent[parent[v as usize] as usize];
            parent[v as usize] = above;
            v = above;
        }
        v
    }
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| root(&mut parent, v));
        // The least of a shell's vertices is its root, which does not depend on the order of joining.
        let least = a.min(b).min(c);
        [a, b, c].into_iter().for_each(|v| parent[v as usize] = least);
    }
    let roots: Vec<u32> = (0..parent.len() as u32).map(|v| root(&mut parent, v)).collect();
    let mut sizes = vec![0_u32; roots.len()];
    roots.iter().for_each(|&r| sizes[r as usize] += 1);
    let largest = (0..sizes.len()).max_by_key(|&v| (sizes[v], std::cmp::Reverse(v))).map(|v| v as u32);
    let kept = |v: u32| Some(roots[v as usize]) == largest;
    let mut number = vec![u32::MAX; roots.len()];
    let mut positions = Vec::new();
    for (v, &position) in mesh.positions.iter().enumerate().filter(|&(v, _)| kept(v as u32)) {
        number[v] = positions.len() as u32;
        positions.push(position);
    }
    let triangles = mesh.triangles.iter().filter(|t| kept(t[0])).map(|t| t.map(|v| number[v as usize])).collect();
    TriangleMesh { positions, triangles }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::closure::{assert_solid, components, euler_characteristic, least_angles, volume};
    use crate::solids::{cuboid, geodesic};

    const BONE: TrabecularBone = TrabecularBone {
        size: DVec3::new(5.0, 4.0, 6.0),
        spacing: 1.0,
        fraction: 0.35,
        stretch: 1.5,
        seed: 1,
        resolution: 10,
    };

    #[test]
    fn bone_is_one_component_with_many_holes() {
        for seed in 0..4 {
            let bone = TrabecularBone { seed, ..BONE };
            let mesh = bone.build().unwrap();
            assert_solid(&mesh);
            assert_eq!(components(&mesh), 1);
            assert!(euler_characteristic(&mesh) < -50, "{}", euler_characteristic(&mesh));
            let share = volume(&mesh) / 120.0;
            assert!((share - 0.35).abs() < 0.02, "{seed}: {share}");
            let (low, high) = mesh.positions.iter().fold((DVec3::MAX, DVec3::MIN), |(l, h), p| (l.min(*p), h.max(*p)));
            assert!((low + bone.size / 2.0).length() < 1e-12 && (high - bone.size / 2.0).length() < 1e-12);
        }
    }

    #[test]
    fn stretch_elongates_the_bone_along_z() {
        // In a Gaussian field the area across an axis grows with the mean square of the waves along it.
        let across = |stretch: f64| {
            let mesh = TrabecularBone { stretch, resolution: 8, ..BONE }.build().unwrap();
            let mut sums = DVec3::ZERO;
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
                sums += (b - a).cross(c - a).abs();
            }
            2.0 * sums.z / (sums.x + sums.y)
        };
        let ratio = across(1.0);
        assert!((ratio - 1.0).abs() < 0.15, "{ratio}");
        let ratio = across(3.0);
        assert!(ratio < 0.55, "{ratio}");
    }

    #[test]
    fn the_mesh_depends_on_the_seed_and_not_on_the_thread_count() {
        let [one, two] = [1, 2].map(|threads| {
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| BONE.build().unwrap())
        });
        assert_eq!(one, two);
        assert_ne!(one, TrabecularBone { seed: 2, ..BONE }.build().unwrap());
        assert!(least_angles(&one)[one.triangles.len() / 100] > 10.0);
    }

    #[test]
    fn only_the_largest_shell_is_kept() {
        let mut mesh = cuboid(DVec3::ZERO, DVec3::ONE).unwrap();
        let ball = geodesic(1.0, 3).unwrap();
        for _ in 0..2 {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(&ball.positions);
            mesh.triangles.extend(ball.triangles.iter().map(|t| t.map(|v| v + first)));
        }
        assert_eq!(largest_shell(mesh), ball);
    }

    #[test]
    fn waves_have_one_length_and_all_directions() {
        let field = Field::new(7, DVec3::splat(3.0));
        let sum: DVec3 = field.waves.iter().map(|(k, _)| k).sum();
        assert!(field.waves.iter().all(|(k, _)| (k.length() - 3.0).abs() < 1e-12));
        assert!(sum.length() < 3.0 * 3.0 * (WAVES as f64).sqrt());
    }

    #[test]
    fn wrong_parameters_are_refused() {
        let text = |bone: TrabecularBone| bone.build().unwrap_err().to_string();
        assert_eq!(text(TrabecularBone { fraction: 0.7, ..BONE }), "fraction is 0.7, but must be from 0.2 to 0.6");
        assert_eq!(text(TrabecularBone { stretch: 0.5, ..BONE }), "stretch is 0.5, but must be from 1 to 4");
        assert!(text(TrabecularBone { size: DVec3::new(1.0, 0.0, 1.0), ..BONE }).starts_with("size is 0, but"));
        assert!(text(TrabecularBone { resolution: 2, ..BONE }).starts_with("resolution is 2, but"));
    }
}
