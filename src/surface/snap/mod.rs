//! Parts of a closed surface that lie on one another within a distance, as walls and gaps thinner than a file can hold: they get the
//! same vertices, sides and triangles there, and triangles that face each other vanish.
//!
//! Vertices within twice the distance of one another become one, vertices within it of a side or a triangle become corners there, and
//! sides that pass each other get a common vertex, round by round until nothing new is as near (a form of iterated snap rounding;
//! Valque and Lazard, "Removing self-intersections in 3D meshes while preserving floating-point coordinates", 2020). Diagonals between
//! parts of a triangle wait for that: parts with the same corners come to have the same diagonals, where cutting them at once would
//! double the parts from round to round. Each step maps the surface as a chain of triangles: its boundary stays zero, so every edge
//! keeps as many uses in one direction as in the other.

mod diagonals;
mod join;
mod meetings;
mod parted;

use std::collections::HashMap;

use diagonals::{remove_opposites, turn_diagonals};
use join::join;
use meetings::{Meeting, least_height, meetings, tree_of};
use parted::{Given, Parted};

use glam::DVec3;

use crate::cancel::checkpoint;
use crate::mesh::meet::{meet_elsewhere, shared_corners, widest_axis};
use crate::mesh::{Precision, TriangleMesh};
use crate::parallel::*;

/// Most rounds; each may bring further parts of the surface near one another.
const ROUNDS: usize = 32;

/// The distances that are tried, until all that is near is joined, or what is left does not cross itself: where many sides pass each
/// other, they may bend one another on and on within one, but not within a smaller or a greater one.
const FACTORS: [f64; 7] = [1.0, 0.5, 2.0, 0.25, 4.0, 0.125, 8.0];

/// Most times that the same is joined: what was joined may be parted again where other parts of the surface are.
const MOST_TIMES: usize = 3;

/// Triangles that may be added, per triangle that was looked at first.
const MOST_MORE: usize = 2;

/// Gives parts of a closed, oriented mesh within a distance of one another the same vertices, and removes triangles that then face
/// each other. Edges must have as many uses in one direction as in the other, and do so after. Vertices come from cuts from the
/// number `first_of_cuts` on, which is returned as it is after. Parts near one another are looked for from `suspects`, and from
/// triangles of cuts that are thinner than the distance. `sources` follow the triangles. Of several vertices the lowest keeps its
/// position; new ones are rounded to a precision. Where that does not come to an end, or leaves what is near as it is and crossing, other
/// distances are tried; if it comes to no end with any, all stays as it is.
pub(crate) fn snap<S: Copy + Send + Sync>(
    mesh: &mut TriangleMesh,
    sources: &mut Vec<S>,
    (first_of_cuts, suspects): (u32, Vec<bool>),
    distance: f64,
    precision: Precision,
) -> u32 {
    let is_new = |&(&corners, is_suspect): &(&[u32; 3], bool)| {
        // Of a triangle without extent it is no number.
        let is_thin = |height: f64| height <= distance || height.is_nan();
        let is_of_cut = || corners.iter().any(|&vertex| vertex >= first_of_cuts);
        is_suspect || is_of_cut() && is_thin(least_height(corners.map(|vertex| mesh.positions[vertex as usize])))
    };
    let numbers = (0..mesh.triangles.len() as u32).into_par_iter();
    let flagged = numbers.zip(mesh.triangles.par_iter().zip(suspects)).with_min_len(1 << 12);
    let new: Vec<u32> = flagged.filter(|(_, triangle)| is_new(triangle)).map(|(number, _)| number).collect();
    if new.is_empty() {
        return first_of_cuts;
    }
    let given = Given::of(&mesh.triangles, &mesh.positions);
    let mut first = None;
    let mut found = None;
    for factor in FACTORS {
        let Some(joined) = in_rounds(Parted::of(&given, new.clone()), factor * distance, precision) else { continue };
        if joined.is_settled || !joined.has_crossings() {
            found = Some(joined);
            break;
        }
        first = first.or(Some(joined));
    }
    let Some(Joined { surface, positions, .. }) = found.or(first) else { return first_of_cuts };
    let Some((triangles, wholes)) = surface.finish() else { return first_of_cuts };
    *sources = wholes.iter().map(|&whole| sources[whole as usize]).collect();
    let (compact, used) = TriangleMesh { positions, triangles: Vec::new() }.of_triangles(triangles);
    *mesh = compact;
    used.partition_point(|&vertex| vertex < first_of_cuts) as u32
}

/// A surface whose parts near one another were joined.
struct Joined<'g> {
    surface: Parted<'g>,
    positions: Vec<DVec3>,
    /// The distance of a piece within which the triangles lie whose pieces may meet it.
    around: f64,
    /// True if nothing that was near one another had to be left so, at any time.
    is_settled: bool,
}

impl Joined<'_> {
    /// Returns whether pieces that are not as given meet others elsewhere than in corners and sides that they share, by their places.
    fn has_crossings(&self) -> bool {
        let pieces = self.surface.near_parted(&self.positions, self.around).pieces;
        if pieces.is_empty() {
            return false;
        }
        let tree = tree_of(&pieces, &self.positions, 0.0);
        let piece = |place: usize| &pieces[tree.faces()[place] as usize];
        let is_changed = |place: usize| !self.surface.is_as_given(piece(place));
        let prepare = |place: usize| piece(place).corners.map(|vertex| self.positions[vertex as usize]);
        let has_area = |[a, b, c]: &[DVec3; 3]| (b - a).cross(c - a) != DVec3::ZERO;
        let look = |one: &[DVec3; 3], other: &[DVec3; 3]| {
            let shared = shared_corners(one, other);
            // Walls between the same corners do not cross.
            let may_meet = shared.contains(&3) && has_area(one) && has_area(other);
            (may_meet && meet_elsewhere(one, other, shared, widest_axis(*one))).then_some(())
        };
        tree.first_of_own_pairs(is_changed, prepare, look).is_some()
    }
}

/// Joins what is near one another; `None` if that does not come to an end.
fn in_rounds<'g>(mut surface: Parted<'g>, distance: f64, precision: Precision) -> Option<Joined<'g>> {
    let most = surface.count() + MOST_MORE * (64 + surface.new_triangles());
    let mut positions = surface.given_positions().to_vec();
    let mut times: HashMap<Meeting, usize> = HashMap::new();
    let mut is_settled = true;
    for round in 0..ROUNDS {
        checkpoint();
        // In a round a piece gets corners at most seven distances from where it was: one from the vertex to the side of another piece,
        // two as that vertex is joined, and two for the ends of each side. So far pieces may be from their triangles, and what is joined
        // lies within a few distances of new pieces.
        let around = (8 + 8 * round) as f64 * distance;
        let mut near = surface.near_new(&positions, around);
        let mut meetings = meetings(&near.pieces, &positions, distance);
        let is_diagonal = |meeting: &Meeting| matches!(meeting, Meeting::Diagonals(_));
        let are_diagonals = meetings.iter().all(is_diagonal);
        meetings.retain(|meeting| {
            if is_diagonal(meeting) && !are_diagonals {
                return true;
            }
            let times = times.entry(*meeting).or_default();
            *times += 1;
            is_settled &= *times <= MOST_TIMES;
            *times <= MOST_TIMES
        });
        if meetings.is_empty() {
            return Some(Joined { surface, positions, around, is_settled });
        }
        join(&mut near.pieces, &mut positions, &meetings, distance, precision);
        surface.put(near);
        let mut near = surface.near_new(&positions, around);
        turn_diagonals(&mut near.pieces, &positions);
        remove_opposites(&mut near.pieces, positions.len());
        surface.put(near);
        if surface.count() > most {
            return None;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;
    use crate::solids::{cuboid, geodesic};
    use crate::surface::fans::sorted;
    use crate::surface::manifold::ManifoldReport;
    use crate::surface::take_apart;

    const DISTANCE: f64 = 1e-11;

    /// Returns both meshes as one.
    fn beside(mut mesh: TriangleMesh, other: &TriangleMesh) -> TriangleMesh {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(&other.positions);
        mesh.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + first)));
        mesh
    }

    fn snapped(mut mesh: TriangleMesh) -> TriangleMesh {
        let mut sources: Vec<usize> = (0..mesh.triangles.len()).collect();
        let suspects = vec![true; mesh.triangles.len()];
        let vertices = mesh.positions.len() as u32;
        snap(&mut mesh, &mut sources, (vertices, suspects), DISTANCE, Precision::Double);
        take_apart(&mut mesh, &mut sources, Precision::Double);
        assert_eq!(mesh.triangles.len(), sources.len());
        let report = ManifoldReport::of(&mesh, Precision::Double);
        assert!(report.passed(), "{:?}", report.failures());
        mesh
    }

    #[test]
    fn gaps_and_walls_thinner_than_the_distance_vanish() {
        let whole = cuboid(DVec3::ZERO, DVec3::ONE).unwrap();
        for turn in 0..40 {
            let (size, angle) = (0.2 + 0.013 * f64::from(turn), 0.37 * f64::from(turn));
            // On top of the first, turned about a vertical axis and tilted by less than the distance, its lower side facing down.
            let placed = |low: f64, high: f64, height: f64| {
                let tilt = DQuat::from_rotation_x(2e-13) * DQuat::from_rotation_z(angle);
                let corners = [DVec3::new(-0.5, -0.5, low), DVec3::new(0.5, 0.5, high)].map(|corner| corner * size);
                let mut mesh = cuboid(corners[0], corners[1]).unwrap();
                mesh.positions.iter_mut().for_each(|p| *p = tilt * *p + DVec3::new(0.5, 0.5, height));
                mesh
            };
            let on_top = placed(0.0, 1.0, 1.0 + 1e-12);
            let joined = snapped(beside(whole.clone(), &on_top));
            let expected = whole.area() + on_top.area() - 2.0 * size * size;
            assert!((joined.area() - expected).abs() < 1e-9, "{turn}: {} {expected}", joined.area());
            assert!((joined.signed_volume() - 1.0 - size.powi(3)).abs() < 1e-9);
            assert!(whole.positions.iter().all(|position| joined.positions.contains(position)));
            // A cavity up to the top, but for a skin.
            let mut cavity = placed(-1.0, 0.0, 1.0 - 1e-12);
            cavity.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
            let open = snapped(beside(whole.clone(), &cavity));
            let expected = whole.area() + cavity.area() - 2.0 * size * size;
            assert!((open.area() - expected).abs() < 1e-9, "{turn}: {} {expected}", open.area());
        }
    }

    #[test]
    fn what_is_farther_apart_stays() {
        let ball = geodesic(1.0, 6).unwrap();
        let mut other = geodesic(1.0, 6).unwrap();
        other.positions.iter_mut().for_each(|position| position.x = 2.0 + 1e-9 - position.x);
        other.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        let both = beside(other, &ball);
        assert_eq!(snapped(both.clone()), both);
    }

    #[test]
    fn what_is_joined_does_not_depend_on_what_lies_elsewhere() {
        for distance in [DISTANCE, 1e-3] {
            let whole = cuboid(DVec3::ZERO, DVec3::ONE).unwrap();
            let mut on_top = cuboid(DVec3::new(-0.3, -0.3, 0.0), DVec3::splat(0.3)).unwrap();
            let turn = DQuat::from_rotation_z(0.3);
            on_top.positions.iter_mut().for_each(|p| *p = turn * *p + DVec3::new(0.5, 0.5, 1.0 + 0.1 * distance));
            let near = beside(whole, &on_top);
            let mut far = geodesic(1.0, 40).unwrap();
            far.positions.iter_mut().for_each(|p| p.x += 4.0);
            let joined = |mut mesh: TriangleMesh, is_suspect: &dyn Fn(usize) -> bool| {
                let suspects = (0..mesh.triangles.len()).map(is_suspect).collect();
                let mut sources: Vec<usize> = (0..mesh.triangles.len()).collect();
                let vertices = mesh.positions.len() as u32;
                snap(&mut mesh, &mut sources, (vertices, suspects), distance, Precision::Double);
                (mesh, sources)
            };
            let (alone, of_alone) = joined(near.clone(), &|_| true);
            assert_ne!(alone, near);
            let (both, of_both) = joined(beside(far.clone(), &near), &|triangle| triangle >= far.triangles.len());
            assert_eq!(both.triangles.len(), far.triangles.len() + alone.triangles.len());
            let (first, vertices) = (far.triangles.len(), far.positions.len() as u32);
            assert_eq!(
                (&both.positions[..far.positions.len()], &both.triangles[..first]),
                (&far.positions[..], &far.triangles[..])
            );
            assert_eq!(both.positions[far.positions.len()..], alone.positions);
            let moved = |triangle: &[u32; 3]| triangle.map(|vertex| vertex + vertices);
            assert!(both.triangles[first..].iter().copied().eq(alone.triangles.iter().map(moved)));
            assert!(of_both.iter().copied().eq((0..first).chain(of_alone.iter().map(|source| source + first))));
        }
    }

    #[test]
    fn boundaries_stay_zero() {
        // A sheet crumpled within some distances: all becomes chains whose edges are used as often in both directions.
        let mut random = crate::testing::random::Random::new(7);
        // Of the triangles of half the sheets few are suspect, at a distance that 32 bits do not hide.
        for (distance, period) in [(DISTANCE, 1), (1e-3, 10)].repeat(25) {
            let mut mesh = beside(geodesic(1.0, 3).unwrap(), &cuboid(DVec3::splat(-0.5), DVec3::splat(0.5)).unwrap());
            mesh.positions.iter_mut().for_each(|position| {
                position.z = distance * 3.0 * random.unit();
                position.x += distance * 3.0 * random.unit();
            });
            let count = mesh.triangles.len();
            let mut sources = vec![(); count];
            let vertices = mesh.positions.len() as u32;
            let suspects = (0..count).map(|triangle| triangle % period == 0).collect();
            snap(&mut mesh, &mut sources, (vertices, suspects), distance, Precision::Double);
            let mut uses: HashMap<[u32; 2], i32> = HashMap::new();
            for &[a, b, c] in &mesh.triangles {
                for [from, to] in [[a, b], [b, c], [c, a]] {
                    *uses.entry(sorted([from, to])).or_default() += if from < to { 1 } else { -1 };
                }
            }
            assert!(uses.values().all(|&uses| uses == 0));
        }
    }
}
