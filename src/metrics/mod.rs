//! Metrics of scaffolds and of their pores in the terms of histomorphometry and porosimetry, from images and nodes.
//!
//! # Two sources
//! **Rays** locate the surface on them to a millionth of a pitch. They give volume, area, chords, profiles, moments and all
//! sums over the surface. **Nodes**, where the rays of the three axes meet, have neighbours. They give components, the Euler
//! characteristic, and all that needs distances: thickness, access, percolation, paths. Distances are not between nodes: they
//! go from a node to a ray's crossing with the surface ([`distance`]), and the centres of balls lie between nodes, where they
//! fit best ([`thickness`]).
//!
//! # Terms
//! A [`Region`] is the volume of interest (VOI, of volume TV): the box of the solid, or the inside of another mesh. A [`Phase`]
//! is the solid within it, or the pores: the part of the region that is not solid. [`BoundaryCondition`] is the boundary
//! condition for balls and paths. A face of the solid that lies in a face of the box was cut there; it is not surface.
//!
//! # Units
//! Positions and lengths on the raster are in pitches, node `i` of a side lying at `i`: a face of the box is at −0.5, where the
//! box is a whole number of pitches. Results are in world units, or pure numbers; the docs of each say which. Sums run in an
//! order that does not depend on the number of threads.
//!
//! # Modules
//! - [`NodeSet`], [`Region`], [`Facets`], [`Distribution`]: the input and output types of the others.
//! - [`components`], [`euler`]: pieces, pores, holes and cavities.
//! - [`distance`] → [`thickness`] → [`access`]: balls that fit; their access from outside; percolation of the region.
//! - [`tortuosity`]: the lengthening of paths, and the slowing of diffusion.
//! - [`surface_area`]: the surface within a region, over which [`anisotropy`] and [`overhang`] sum.
//! - [`chords`], [`profiles`], [`inertia`], [`curvature`], [`permeability`]: further metrics from rays and facets.
//! - [`bounds`]: certified bounds of the solid.
//! - [`wrap`]: the shape of a porous solid, a region to measure it in.

pub mod access;
pub mod anisotropy;
pub mod bounds;
pub mod chords;
pub mod components;
pub mod curvature;
pub mod distance;
mod distribution;
mod eigen;
pub mod euler;
mod facets;
pub mod inertia;
mod nodes;
pub mod overhang;
pub mod permeability;
pub mod profiles;
mod region;
mod segments;
pub mod surface_area;
pub mod thickness;
pub mod tortuosity;
pub mod wrap;

pub use distribution::{Distribution, Histogram};
pub use facets::Facets;
pub use nodes::NodeSet;
pub use region::{Region, RegionSpans};

/// The solid within a region, or the part of the region that is not solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Phase {
    /// The inside of the mesh.
    Solid,
    /// The rest of the region.
    Pore,
}

impl Phase {
    /// Both phases: solid, pore.
    pub const BOTH: [Phase; 2] = [Phase::Solid, Phase::Pore];

    /// Returns the nodes of this phase: those of the region that are solid, or those that are not.
    pub fn nodes(self, solid: &NodeSet, region: &NodeSet) -> NodeSet {
        match self {
            Phase::Solid => solid.and(region),
            Phase::Pore => region.minus(solid),
        }
    }

    /// Returns `solid` or `pore`.
    pub const fn name(self) -> &'static str {
        match self {
            Phase::Solid => "solid",
            Phase::Pore => "pore",
        }
    }
}

/// The boundary condition for balls and paths at the region's boundary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BoundaryCondition {
    /// The space beyond is ignored: balls touch only the surface and may extend beyond the region, as they do in BoneJ and
    /// PoreSpy. Pores at the faces of a box seem wider than they are.
    Clip,
    /// The region is a periodic cell: balls and paths that leave at one face enter at the opposite one. For boxes of whole
    /// numbers of pitches.
    Periodic,
    /// Balls of either phase must lie within the region: its boundary is a wall.
    Border,
}

impl BoundaryCondition {
    /// All of them, the usual one first.
    pub const ALL: [BoundaryCondition; 3] =
        [BoundaryCondition::Border, BoundaryCondition::Clip, BoundaryCondition::Periodic];

    /// Returns `clip`, `periodic` or `border`.
    pub const fn name(self) -> &'static str {
        match self {
            BoundaryCondition::Clip => "clip",
            BoundaryCondition::Periodic => "periodic",
            BoundaryCondition::Border => "border",
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::distance::{Crossings, DistanceField};
    use super::thickness::local_thickness;
    use super::*;
    use crate::grid::Axis;
    use crate::ldi::Ldi;
    use crate::solids;
    use crate::testing::images::{closed, grid_around, surface_images};

    /// Returns the exact images of a ball of radius 10, with triangles.
    fn ball(resolution: u32) -> [Ldi; 3] {
        let ball = closed(solids::geodesic(10.0, 24).unwrap());
        surface_images(&grid_around(&[&ball], resolution, 1024).quantise(&ball).unwrap())
    }

    #[test]
    fn boxes_and_solids_are_regions() {
        let images = ball(65);
        let grid = *images[0].grid();
        let of_ball = Region::of_solid(&images);
        let of_box = Region::of_box(&grid, of_ball.bounds());
        assert!((of_ball.volume() / of_box.volume() - std::f64::consts::PI / 6.0).abs() < 3e-3);
        assert_eq!(of_box.nodes().count(), 65 * 65 * 65);
        let [pore, solid] =
            [Phase::Pore, Phase::Solid].map(|phase| phase.nodes(of_ball.nodes(), of_box.nodes()).count());
        assert_eq!(pore + solid, 65 * 65 * 65);
        assert!((solid as f64 / (65.0 * 65.0 * 65.0) - std::f64::consts::PI / 6.0).abs() < 5e-3);
        let middle = 32 * 65 + 32;
        assert_eq!(of_box.spans(Axis::Z, middle).collect::<Vec<_>>(), [(0, grid.length(2))]);
        assert_eq!(of_ball.spans(Axis::Z, middle).count(), 1);
        let [low, high] = of_box.bounds_in_pitches();
        assert!(low.iter().zip(high).all(|(low, high)| (low + 0.5).abs() < 1e-3 && (high - 64.5).abs() < 1e-3));
    }

    /// A plate of height 1 from which a box of 2 × 2 × 4 cuts a piece: the balls that fit in the piece, above and below.
    #[test]
    fn walls_of_a_region_bound_inscribed_balls() {
        let cuboid = |min, max| closed(solids::cuboid(min, max).unwrap());
        let plate = cuboid(DVec3::ZERO, DVec3::new(4.0, 4.0, 1.0));
        let roi = cuboid(DVec3::new(1.0, 1.0, -1.0), DVec3::new(3.0, 3.0, 3.0));
        let grid = grid_around(&[&plate, &roi], 41, 1024);
        let [plate, roi] = [plate, roi].map(|mesh| surface_images(&grid.quantise(&mesh).unwrap()));
        let (solid, region) = (Region::of_solid(&plate), Region::of_solid(&roi));
        let field = DistanceField::of(
            &Crossings::of_images(&plate, &region, BoundaryCondition::Border),
            BoundaryCondition::Border,
        );
        for (phase, exact) in [(Phase::Solid, 1.0), (Phase::Pore, 2.0)] {
            let widths = local_thickness(&field, &phase.nodes(solid.nodes(), region.nodes()));
            let widest = Distribution::of_map(&widths, grid.pitch()).unwrap().max();
            assert!((widest - exact).abs() < grid.pitch(), "{}: {widest} for {exact}", phase.name());
        }
    }
}
