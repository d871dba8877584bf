//! Surfaces that touch in a vertex: on which side of the one the other lies.
//!
//! Near a vertex a surface is a cone of sectors, one for each triangle there. The signed distance from it has the sign that the normal
//! has at the nearest point: in a sector its own, on a side the sum of the two beside it, and at the apex the sum of all, weighted by
//! their angles (J. A. Bærentzen, H. Aanæs, Signed distance computation using the angle weighted pseudonormal, IEEE Transactions on
//! Visualization and Computer Graphics 11 (2005) 243–253).

use std::cmp::Ordering;

use glam::DVec3;

use super::manifold::Stars;
use crate::mesh::TriangleMesh;

/// Distances of directions from a cone that may be rounding.
const ROUNDED: f64 = 1e-9;

/// The surface at a vertex, without an end.
pub(super) struct Cone {
    sectors: Vec<Sector>,
    /// The normal at the apex, by angles.
    normal: DVec3,
}

/// The part of a cone that a triangle gives.
struct Sector {
    /// The directions of its sides from the apex, of unit length.
    sides: [DVec3; 2],
    /// Of unit length.
    normal: DVec3,
}

impl Cone {
    /// Creates that of a vertex from the triangles there that have an area.
    pub fn at(mesh: &TriangleMesh, stars: &Stars, vertex: u32) -> Cone {
        let mut star = stars.corners_at(vertex as usize).to_vec();
        star.sort_unstable();
        let sectors: Vec<Sector> = star.into_iter().filter_map(|corner| Sector::of(mesh, corner)).collect();
        let normal = sectors.iter().map(|sector| sector.sides[0].angle_between(sector.sides[1]) * sector.normal).sum();
        Cone { sectors, normal }
    }

    /// Returns on which side another cone with the same apex lies, which does not cross this one: greater on the outer side, with a gap
    /// between, less on the inner side, with solid between, and equal where the two coincide.
    pub fn side_of(&self, other: &Cone) -> Ordering {
        let distance: f64 = other.directions().map(|direction| self.signed_distance(direction)).sum();
        if distance.abs() <= ROUNDED { Ordering::Equal } else { distance.total_cmp(&0.0) }
    }

    /// Returns directions along it: both sides of each sector, and three between.
    fn directions(&self) -> impl Iterator<Item = DVec3> {
        let of_sector = |sector: &Sector| {
            let [b, c] = sector.sides;
            [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| b.lerp(c, share))
        };
        self.sectors.iter().flat_map(of_sector).filter_map(DVec3::try_normalize)
    }

    /// Returns the distance of a direction of unit length, positive on the outer side.
    fn signed_distance(&self, direction: DVec3) -> f64 {
        let nearest = self.sectors.iter().map(|sector| sector.distance_and_height(direction)).min_by(|one, other| {
            // Of two sectors at the same distance, whose common side is nearest, the steeper one has the sign of their sum.
            one.0.total_cmp(&other.0).then(other.1.abs().total_cmp(&one.1.abs()))
        });
        match nearest {
            Some((distance, height)) if distance < 1.0 - ROUNDED => distance.copysign(height),
            // The apex is nearest.
            _ => self.normal.dot(direction),
        }
    }
}

impl Sector {
    /// Creates that of the corner of a triangle, unless this has no area.
    fn of(mesh: &TriangleMesh, corner: u32) -> Option<Sector> {
        let mut corners = mesh.triangles[corner as usize / 3].map(|index| mesh.positions[index as usize]);
        corners.rotate_left(corner as usize % 3);
        let [apex, b, c] = corners;
        let sides = [(b - apex).try_normalize()?, (c - apex).try_normalize()?];
        Some(Sector { sides, normal: sides[0].cross(sides[1]).try_normalize()? })
    }

    /// Returns the distance of a direction of unit length from the sector, and its height above the sector's plane.
    fn distance_and_height(&self, direction: DVec3) -> (f64, f64) {
        let ([b, c], height) = (self.sides, self.normal.dot(direction));
        let is_above = self.normal.dot(b.cross(direction)) >= 0.0 && self.normal.dot(direction.cross(c)) >= 0.0;
        let from_side = |side: DVec3| direction.distance(side * side.dot(direction).max(0.0));
        (if is_above { height.abs() } else { from_side(b).min(from_side(c)) }, height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a cone around z from the origin with this slope and number of sides; its inside is below.
    fn cone(slope: f64, sides: u32) -> (TriangleMesh, Cone) {
        let around = |i: u32| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / f64::from(sides) + 0.3).sin_cos();
            DVec3::new(cos, sin, slope)
        };
        let positions = [DVec3::ZERO].into_iter().chain((0..sides).map(around)).collect();
        let triangles = (0..sides).map(|i| [0, 1 + i, 1 + (i + 1) % sides]).collect();
        let mesh = TriangleMesh { positions, triangles };
        let cone = Cone::at(&mesh, &Stars::of(&mesh), 0);
        (mesh, cone)
    }

    #[test]
    fn cones_that_touch_along_edges_lie_on_a_side() {
        // The edges of the lower one run along the middles of the other's faces.
        let [upper, lower] =
            [[[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]], [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]]
                .map(|corners: [[f64; 2]; 4]| {
                    let corners = corners.map(|[x, y]| DVec3::new(x, y, -1.0));
                    let positions = [DVec3::ZERO].into_iter().chain(corners).collect();
                    let mesh = TriangleMesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]] };
                    Cone::at(&mesh, &Stars::of(&mesh), 0)
                });
        assert_eq!(upper.side_of(&lower), Ordering::Less);
        assert_eq!(lower.side_of(&upper), Ordering::Greater);
    }

    #[test]
    fn steeper_cones_lie_above() {
        // Spikes, pits and faces with few and many sides; those with few are up to twice as steep between their edges.
        let slopes = [-30.0, -4.0, -0.7, 0.0, 0.6, 3.0, 25.0];
        for (i, &slope) in slopes.iter().enumerate() {
            for (j, &other) in slopes.iter().enumerate() {
                for sides in [[3, 4], [4, 3], [3, 24], [24, 3], [12, 12]] {
                    let ((_, one), (mut mesh, two)) = (cone(slope, sides[0]), cone(other, sides[1]));
                    if i != j {
                        assert_eq!(one.side_of(&two), j.cmp(&i), "{slope} {other} {sides:?}");
                        // Turned over, the other is what it was, and this one has its sides exchanged.
                        mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
                        let turned = Cone::at(&mesh, &Stars::of(&mesh), 0);
                        assert_eq!(one.side_of(&turned), j.cmp(&i), "{slope} {other} {sides:?}");
                        assert_eq!(turned.side_of(&one), j.cmp(&i), "{slope} {other} {sides:?}");
                    } else if sides[0] == sides[1] {
                        assert_eq!(one.side_of(&two), Ordering::Equal);
                    }
                }
            }
        }
    }
}
