//! Surface by orientation: overhangs in layer-by-layer manufacturing.

use glam::DVec3;

use super::surface_area::{SurfaceElements, in_chunks};

/// The treatment of surface on the build plate as overhang.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Plate {
    /// It counts like all surface that faces down.
    #[default]
    Counted,
    /// Facets in the lowest plane of the mesh rest on the plate.
    Supported,
}

/// Surface that faces down within the overhang angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overhang {
    /// Its area, in square world units.
    pub area: f64,
    /// Its share of all surface within the region.
    pub share: f64,
}

/// Distance from the lowest corner within which a facet's corners lie in the lowest plane, as a share of the mesh's height.
const LOWEST: f64 = 1e-6;

/// Returns the surface whose normal n has n·`build` < −cos `angle`: that within `angle`, in degrees, of facing straight down. A
/// ball has (1 − cos θ)/2 of its surface there, 14.64 % at 45°; a lying cylinder a quarter of its side.
///
/// `build` is the direction in which layers are added, of any length; cuts by faces of a box are not surface and count neither
/// as overhang nor in the share. `None` where there is no surface, or no direction.
pub fn overhang(surface: &SurfaceElements, build: DVec3, angle: f64, plate: Plate) -> Option<Overhang> {
    let up = build.try_normalize()?;
    let limit = -angle.to_radians().cos();
    let facets = surface.facets();
    let heights = || facets.triangles.iter().flatten().map(|&v| facets.positions[v as usize].dot(up));
    let lowest = match plate {
        Plate::Counted => f64::NEG_INFINITY,
        Plate::Supported => {
            let (low, high) = heights().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), h| (a.min(h), b.max(h)));
            low + LOWEST * (high - low)
        }
    };
    let rests = |facet: usize| facets.corners(facet).iter().all(|corner| corner.dot(up) <= lowest);
    let total = surface.area();
    let area = in_chunks(facets.normals.len(), &|facet| {
        let overhangs = facets.normals[facet].dot(up) < limit && !rests(facet);
        if overhangs { surface.areas()[facet] } else { 0.0 }
    });
    (total > 0.0).then(|| Overhang { area, share: area / total })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::surface_area::Scale;
    use crate::metrics::surface_area::tests::{Sampled, cube, grid_of, order, turned, turns};
    use crate::solids;
    use glam::DQuat;

    #[test]
    fn a_ball_overhangs_by_its_lower_cap() {
        let exact = 0.5 * (1.0 - 0.5f64.sqrt());
        for build in [DVec3::Z, -3.0 * DVec3::X, DVec3::new(1.0, 2.0, -0.5)] {
            let errors = [16, 32, 64].map(|frequency| {
                let ball = Sampled::of(solids::geodesic(1.0, frequency).unwrap(), 64);
                let facets = ball.facets();
                let surface = SurfaceElements::of_facets(&facets, &ball.whole()).unwrap();
                let share = overhang(&surface, build, 45.0, Plate::Counted).unwrap().share;
                let hits = SurfaceElements::of_hits(&facets, &ball.images, &ball.whole(), Scale::Counted);
                let by_hits = overhang(&hits, build, 45.0, Plate::Counted).unwrap().share;
                println!("ball of frequency {frequency} along {build}: {share:.5}, by hits {by_hits:.5}");
                assert!((by_hits - share).abs() < 3e-3);
                share - exact
            });
            println!("ball: order {:.2}", order(errors));
            assert!(errors[2].abs() < 1e-3, "{errors:?}");
        }
    }

    #[test]
    fn a_lying_cylinder_overhangs_by_a_quarter() {
        let lying =
            turned(solids::cylinder(1.0, 4.0, 400).unwrap(), DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2));
        let half = DVec3::new(2.0, 1.5, 1.5);
        let rod = Sampled::on(&grid_of(-half, half, 32), lying);
        let facets = rod.facets();
        let surface = SurfaceElements::of_facets(&facets, &rod.whole()).unwrap();
        let found = overhang(&surface, DVec3::Z, 45.0, Plate::Counted).unwrap();
        println!("lying cylinder: {:.5}", found.share);
        assert!((found.share - 0.25).abs() < 2.6e-3 && (found.area / surface.area() - found.share).abs() < 1e-15);
    }

    #[test]
    fn faces_on_the_build_plate_are_no_overhang() {
        let turn = turns(3).last().unwrap();
        let block = turned(cube(2.0), turn);
        let bounds = block.bounds().unwrap();
        let block = Sampled::on(&grid_of(bounds.min - DVec3::ONE, bounds.max + DVec3::ONE, 16), block);
        let facets = block.facets();
        let surface = SurfaceElements::of_facets(&facets, &block.whole()).unwrap();
        let up = turn * DVec3::Z;
        let counted = overhang(&surface, up, 45.0, Plate::Counted).unwrap();
        assert!((counted.area - 4.0).abs() < 1e-9 && (counted.share - 1.0 / 6.0).abs() < 1e-12);
        assert_eq!(overhang(&surface, up, 45.0, Plate::Supported).unwrap().share, 0.0);
        assert!(overhang(&surface, DVec3::ZERO, 45.0, Plate::Counted).is_none());
    }
}
