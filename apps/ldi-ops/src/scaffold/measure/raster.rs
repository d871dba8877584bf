//! The raster of a report, and the exact images on it.

use ldi_ops::boolean::{BooleanOperation, merge};
use ldi_ops::grid::{Axis, Grid, LOD_RANGE, LatticeBox, LatticeSolid};
use ldi_ops::integrate::{AxisVolume, VolumeEstimate};
use ldi_ops::ldi::Ldi;
use ldi_ops::metrics::{Edges, Region};
use ldi_ops::sampler::{Fill, Sampler};

use crate::exit::Failure;
use crate::number::number;
use crate::resolve::Spacing;
use crate::run::Solid;

/// A solid, and what it is measured in.
#[derive(Clone, Copy)]
pub struct Subject<'s> {
    pub solid: &'s Solid,
    /// The region of interest; the solid's box where there is none.
    pub roi: Option<&'s Solid>,
}

impl Subject<'_> {
    /// A grid whose pitch goes by the region and which holds all there is.
    pub fn grid(&self, spacing: Spacing, edges: Edges) -> Result<Grid, Failure> {
        let region = self.roi.unwrap_or(self.solid);
        let bounds = region.bounds();
        let refused = |error| Failure::input(format!("{}: {error}", region.name()));
        let lod = *LOD_RANGE.start();
        let of_region = match spacing {
            Spacing::Resolution(rays) => Grid::with_resolution(bounds, rays, lod),
            Spacing::Pitch(pitch) => Grid::with_pitch(bounds, pitch, lod),
            Spacing::Tolerance(_) => unreachable!("reports have no tolerance"),
        };
        let of_region = of_region.map_err(refused)?;
        if edges == Edges::Periodic {
            self.whole(&of_region)?;
        }
        match self.roi {
            None => Ok(of_region),
            Some(_) => self.grid_of_pitch(of_region.pitch()),
        }
    }

    /// A grid of another pitch that holds all there is.
    pub fn grid_of_pitch(&self, pitch: f64) -> Result<Grid, Failure> {
        let bounds = self.roi.map_or(self.solid.bounds(), |roi| roi.bounds().union(self.solid.bounds()));
        Grid::with_pitch(bounds, pitch, *LOD_RANGE.start())
            .map_err(|error| Failure::input(format!("{}: {error}", self.solid.name())))
    }

    /// Refuses a cell whose sides are not whole numbers of pitches: it would not fit onto itself.
    fn whole(&self, grid: &Grid) -> Result<(), Failure> {
        let extent = self.solid.bounds().extent();
        for axis in Axis::ALL {
            let pitches = extent[axis.depth()] / grid.pitch();
            if (pitches - pitches.round()).abs() > 1e-6 {
                return Err(Failure::input(format!(
                    "{}: --edges periodic needs sides of whole numbers of pitches, and along {} the side of {} is {pitches:.4} \
                     pitches of {}; choose --resolution or --pitch so that all three are",
                    self.solid.name(),
                    axis.name(),
                    number(extent[axis.depth()]),
                    number(grid.pitch()),
                )));
            }
        }
        Ok(())
    }

    /// Samples the solid and its region.
    pub fn sample<'s>(&'s self, grid: &Grid, fill: Fill, sampler: &dyn Sampler) -> Result<Images<'s>, Failure> {
        let lattice = self.solid.quantise(grid)?;
        let solid = along_axes(|axis| Ok(sampler.sample_surface(&lattice, axis, fill)?))?;
        let within = match self.roi {
            None => None,
            Some(roi) => {
                let roi_lattice = roi.quantise(grid)?;
                let roi = along_axes(|axis| Ok(sampler.sample_surface(&roi_lattice, axis, fill)?))?;
                let common = along_axes(|axis| {
                    let axis = axis.depth();
                    Ok(merge(BooleanOperation::Intersection, &solid[axis], &roi[axis])?)
                })?;
                Some(Within { lattice: roi_lattice, roi, common })
            }
        };
        Ok(Images { bounds: *lattice.bounds(), lattice, solid, within })
    }
}

fn along_axes(image: impl Fn(Axis) -> Result<Ldi, Failure>) -> Result<[Ldi; 3], Failure> {
    Ok([image(Axis::X)?, image(Axis::Y)?, image(Axis::Z)?])
}

/// Exact images along x, y and z.
pub struct Images<'s> {
    pub lattice: LatticeSolid<'s>,
    bounds: LatticeBox,
    /// Of the solid, in the region or not, with triangles.
    pub solid: [Ldi; 3],
    within: Option<Within<'s>>,
}

/// What there is where a region of interest is given.
struct Within<'s> {
    lattice: LatticeSolid<'s>,
    roi: [Ldi; 3],
    /// What of the solid lies in it.
    common: [Ldi; 3],
}

impl<'s> Images<'s> {
    /// The region of interest on the lattice, where there is one.
    pub fn roi(&self) -> Option<&LatticeSolid<'s>> {
        self.within.as_ref().map(|within| &within.lattice)
    }

    /// The region.
    pub fn region(&self) -> Region<'_> {
        match &self.within {
            None => Region::of_box(self.solid[0].grid(), self.bounds),
            Some(within) => Region::of_solid(&within.roi),
        }
    }

    /// Of the solid within the region.
    pub fn common(&self) -> &[Ldi; 3] {
        self.within.as_ref().map_or(&self.solid, |within| &within.common)
    }

    /// Rays of the solid that did not close, along all axes.
    pub fn unclosed(&self) -> usize {
        self.solid.iter().map(|image| image.unclosed().len()).sum()
    }

    /// The volume of the solid within the region.
    pub fn volume(&self) -> VolumeEstimate {
        VolumeEstimate::from_axes(&self.common().each_ref().map(AxisVolume::of))
    }
}
