//! The raster of a report, and the exact images on it.

use glam::DVec3;

use super::Shells;
use crate::Error;
use crate::boolean::{BooleanOperation, merge};
use crate::driver::input::Solid;
use crate::driver::raster;
use crate::grid::{Axis, Grid, LOD_RANGE, LatticeBox, LatticeSolid};
use crate::integrate::{AxisVolume, CHECK_PITCHES, VolumeEstimate};
use crate::ldi::Ldi;
use crate::mesh::Aabb;
use crate::metrics::surface_area::{Scale, SurfaceElements};
use crate::metrics::{BoundaryCondition, Facets, Region};
use crate::number::number;
use crate::report::Settings;
use crate::sampler::{FillRule, Sampler};

/// A solid and its region of interest.
#[derive(Clone, Copy)]
pub struct Subject<'s> {
    pub solid: &'s Solid,
    /// The region of interest; the solid's box if `None`.
    pub roi: Option<&'s Solid>,
}

/// Returns the first axis along which a side is no whole number of pitches.
pub fn not_whole(extent: DVec3, pitch: f64) -> Option<Axis> {
    let pitches = |axis: &Axis| extent[axis.depth()] / pitch;
    Axis::ALL.into_iter().find(|axis| (pitches(axis) - pitches(axis).round()).abs() > 1e-6)
}

impl Subject<'_> {
    /// Returns a grid whose pitch follows from the region and which contains solid and region.
    pub fn grid(&self, settings: &Settings) -> Result<Grid, Error> {
        let region = self.roi.unwrap_or(self.solid);
        let spacing = settings.spacing.in_unit(self.solid.unit)?;
        let of_region = raster::lay(region.bounds(), spacing, *LOD_RANGE.start(), region.name())?;
        if settings.edges == BoundaryCondition::Periodic {
            self.whole(&of_region)?;
        }
        match self.roi {
            None => Ok(of_region),
            Some(_) => self.grid_of_pitch(of_region.pitch()),
        }
    }

    /// Returns the box around solid and region.
    pub fn bounds(&self) -> Aabb {
        self.roi.map_or(self.solid.bounds(), |roi| roi.bounds().union(self.solid.bounds()))
    }

    /// Returns a grid of another pitch that contains solid and region.
    pub fn grid_of_pitch(&self, pitch: f64) -> Result<Grid, Error> {
        Grid::with_pitch(self.bounds(), pitch, *LOD_RANGE.start())
            .map_err(|error| Error::input(format!("{}: {error}", self.solid.name())))
    }

    /// Returns the volumes of the solid within its region on the coarser rasters that an estimate on a grid is compared with.
    pub fn check_volumes(
        &self,
        grid: &Grid,
        fill: FillRule,
        sampler: &dyn Sampler,
    ) -> Result<Vec<Vec<AxisVolume>>, Error> {
        let volumes = |pitch| Ok(self.sample(&self.grid_of_pitch(pitch)?, fill, sampler)?.axis_volumes());
        CHECK_PITCHES.iter().map(|ratio| volumes(ratio * grid.pitch())).collect()
    }

    /// Rejects a periodic cell whose sides are not whole numbers of pitches.
    fn whole(&self, grid: &Grid) -> Result<(), Error> {
        let extent = self.solid.bounds().extent();
        let Some(axis) = not_whole(extent, grid.pitch()) else { return Ok(()) };
        let side = extent[axis.depth()];
        Err(Error::input(format!(
            "{}: --edges periodic needs sides of whole numbers of pitches, and along {} the side of {} is {:.4} pitches of {}; \
             choose --resolution or --pitch so that all three are",
            self.solid.name(),
            axis.name(),
            number(side),
            side / grid.pitch(),
            number(grid.pitch()),
        )))
    }

    /// Samples the solid and its region.
    pub fn sample<'s>(&'s self, grid: &Grid, fill: FillRule, sampler: &dyn Sampler) -> Result<Images<'s>, Error> {
        self.sample_on(self.solid.quantise(grid)?, fill, sampler)
    }

    /// Samples the solid, which is on the lattice already, and its region.
    pub fn sample_on<'s>(
        &'s self,
        lattice: LatticeSolid<'s>,
        fill: FillRule,
        sampler: &dyn Sampler,
    ) -> Result<Images<'s>, Error> {
        let solid = along_axes(|axis| Ok(sampler.sample_surface(&lattice, axis, fill)?))?;
        let within = match self.roi {
            None => None,
            Some(roi) => {
                let (roi_lattice, volume) = (roi.quantise(lattice.grid())?, roi.volume);
                let roi = along_axes(|axis| Ok(sampler.sample_surface(&roi_lattice, axis, fill)?))?;
                let common = along_axes(|axis| {
                    let axis = axis.depth();
                    Ok(merge(BooleanOperation::Intersection, &solid[axis], &roi[axis])?)
                })?;
                Some(Within { lattice: roi_lattice, volume, roi, common })
            }
        };
        let shells = match fill {
            FillRule::EvenOdd => Shells::of(&solid),
            // The non-zero rule drops crossings within the solid.
            FillRule::NonZero => {
                Shells::of(&along_axes(|axis| Ok(sampler.sample_surface(&lattice, axis, FillRule::EvenOdd)?))?)
            }
        };
        Ok(Images { bounds: *lattice.bounds(), lattice, solid, shells, within })
    }
}

fn along_axes(image: impl Fn(Axis) -> Result<Ldi, Error>) -> Result<[Ldi; 3], Error> {
    Ok([image(Axis::X)?, image(Axis::Y)?, image(Axis::Z)?])
}

/// Exact images along x, y and z.
pub struct Images<'s> {
    pub lattice: LatticeSolid<'s>,
    bounds: LatticeBox,
    /// Images of the solid, within the region or not, with triangles.
    pub solid: [Ldi; 3],
    /// The relation between the shells of the solid.
    pub shells: Shells,
    within: Option<Within<'s>>,
}

/// The images of a region of interest.
struct Within<'s> {
    lattice: LatticeSolid<'s>,
    /// The volume of its mesh.
    volume: f64,
    roi: [Ldi; 3],
    /// The part of the solid within it.
    common: [Ldi; 3],
}

impl Within<'_> {
    /// Returns whether the region is an axis-parallel box up to the lattice: then all its rays have the same span, and its
    /// columns and rows are those of its bounds.
    fn is_box(&self) -> bool {
        let bounds = self.lattice.bounds();
        let step = self.roi[0].grid().step();
        let sides = [0, 1, 2].map(|axis| step * f64::from(bounds.max[axis] - bounds.min[axis]));
        let is_full = |image: &Ldi| {
            let axis = image.axis().depth();
            image.depths().chunks_exact(2).all(|span| span == [bounds.min[axis], bounds.max[axis]])
        };
        self.roi.iter().all(is_full) && (self.volume.abs() / sides.iter().product::<f64>() - 1.0).abs() < 1e-6
    }
}

impl<'s> Images<'s> {
    /// Returns the region of interest on the lattice, if any.
    pub fn roi(&self) -> Option<&LatticeSolid<'s>> {
        self.within.as_ref().map(|within| &within.lattice)
    }

    /// Returns the region; as a box if the region of interest is one.
    pub fn region(&self) -> Region<'_> {
        match &self.within {
            None => Region::of_box(self.solid[0].grid(), self.bounds),
            Some(within) if within.is_box() => Region::of_box(self.solid[0].grid(), *within.lattice.bounds()),
            Some(within) => Region::of_solid(&within.roi),
        }
    }

    /// Returns the images of the solid within the region.
    pub fn common(&self) -> &[Ldi; 3] {
        self.within.as_ref().map_or(&self.solid, |within| &within.common)
    }

    /// Returns the surface of the solid within the region.
    pub fn surface<'f>(&self, facets: &'f Facets<'f>, region: &Region) -> SurfaceElements<'f> {
        match self.shells {
            Shells::Apart => SurfaceElements::within(facets, &self.solid, region),
            Shells::Meeting => SurfaceElements::of_hits(facets, &self.solid, region, Scale::Counted),
        }
    }

    fn axis_volumes(&self) -> Vec<AxisVolume> {
        self.common().iter().map(AxisVolume::of).collect()
    }

    /// Returns the number of unclosed rays of the solid, along all axes.
    pub fn unclosed(&self) -> usize {
        self.solid.iter().map(|image| image.unclosed().len()).sum()
    }

    /// Returns the volume of the solid within the region, at most that of the region: with few rays the estimate may exceed it.
    /// `coarser` are the [volumes of coarser rasters](Subject::check_volumes) that its error is estimated with.
    pub fn volume(&self, region: &Region, coarser: &[Vec<AxisVolume>]) -> VolumeEstimate {
        let estimate = VolumeEstimate::from_rasters(&self.axis_volumes(), coarser);
        let value = estimate.value.clamp(0.0, region.volume());
        let farthest = value.max(region.volume() - value);
        VolumeEstimate { value, error: (estimate.error + (value - estimate.value).abs()).min(farthest) }
    }
}
